"""Natural frequencies and mode shapes on the page, for tuned and mistuned wheels; the shapes turn, at any phase.

The figure opens on the mode that an engine order excites nearest to the speed. The page holds the complex shapes of one sector on a
coarse skin, whose points belong to the fine one. The script ``assets/shapes.js`` expands them to the wheel.
"""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from markupsafe import Markup, escape
from plotly.subplots import make_subplots

from stickslip.analyses.columns import record_of
from stickslip.analyses.pictures import edges, segments, surface
from stickslip.analyses.waves.page.waves import NEEDED, Waves, diameter_axes, mode_lines, view_of
from stickslip.analyses.waves.records import (
    Campbell,
    Interference,
    Modes,
    Wave,
    contact_state,
    hertz,
    stages,
    with_contacts,
)
from stickslip.arrays import FloatArray, IntArray
from stickslip.model.mesh.solid_mesh import coarse_skin
from stickslip.report.plot import FONT, INK, MUTED, Plot, as_base64, colour, legend_above, ring, styled
from stickslip.report.quantities import NONE, counted, number, percent
from stickslip.report.section import Block, Card, Section, Table, Words
from stickslip.study.store.netcdf import one_case, variable

WAVE, MODE = "resonant_wave", "resonant_mode"  # indices of the mode on which the figure opens


@dataclass(frozen=True)
class _Met:
    """A mode that an engine order excites, and the distance of this resonance from the speed."""

    wave: Wave
    mode: int
    distance: float


def with_resonance(modes: xr.Dataset, tree: xr.DataTree) -> xr.Dataset:
    """Return the dataset of modes with the mode of each case nearest to a resonance, by SAFE or Campbell diagram.

    Parameters
    ----------
    modes
        Dataset of the analysis ``modes``.
    tree
        The result. The SAFE diagram takes precedence over the Campbell diagram, whose crossings are compared with the
        speed of the modes.
    """
    n = modes.sizes["case"]
    own = {name: tree[name].to_dataset() for name in ("safe", "campbell") if name in tree.children}
    usable = {name: data for name, data in own.items() if data.sizes.get("case") == n}
    found = [_of_case(modes, usable, k) for k in range(n)]
    if all(one is None for one in found):
        return modes
    each = np.array([(0, 0) if one is None else one for one in found])
    meaning = "of the mode nearest to a resonance"
    new = {WAVE: f"index of the wave {meaning}", MODE: f"index {meaning}"}
    return modes.assign_coords({name: variable("case", each[:, k], "1", new[name]) for k, name in enumerate(new)})


def _of_case(modes: xr.Dataset, own: dict[str, xr.Dataset], case: int) -> tuple[int, int] | None:
    """Return the indices of wave and mode in the modes of a case; None if nothing is known."""
    known = record_of(Modes, one_case(modes, case))
    met: list[_Met] = []
    if "safe" in own:
        met = _of_safe(record_of(Interference, one_case(own["safe"], case)))
    if not met and "campbell" in own:
        met = _of_campbell(record_of(Campbell, one_case(own["campbell"], case)), known.speed_rpm or 0.0)
    for one in sorted(met, key=lambda one: one.distance):
        here = [k for k, w in enumerate(known.waves) if w.wave_number == one.wave.wave_number]
        here += [k for k, w in enumerate(known.waves) if w.nodal_diameter == one.wave.nodal_diameter]
        if here and one.mode < len(known.waves[here[0]].frequencies_hz):
            return here[0], one.mode
    return None


def _of_safe(found: Any) -> list[_Met]:
    pairs = (pair for pair in found.pairs if np.isfinite(pair.margin))
    return [_Met(found.waves[pair.wave], pair.mode, abs(pair.margin)) for pair in pairs]


def _of_campbell(found: Any, rpm: float) -> list[_Met]:
    return [_Met(found.waves[w], c.mode, abs(c.speed_rpm - rpm)) for w, c in found.crossings]


_SHAPE_BYTES = 600_000  # all shapes of a page, before they become text
_POINT_BYTES = 12  # x, y, z, real and imaginary, 16 bits each
_WHEEL_POINTS = 26_000  # points of the whole wheel, so that it turns and moves without delay
_FEWEST_POINTS = 250
_FULL = 32767  # largest 16-bit number
_MM = 1e3


def mode_shapes(view: Waves[Modes]) -> Plot | None:
    """Show the mode shapes on the skin, with controls for wave, mode, phase and size."""
    found, waves = view.found, len(view.found.waves)
    shapes = [w.shape for w in found.waves if w.shape is not None]
    if not shapes or found.skin_point is None or found.skin_triangle is None:
        return None
    there = len(shapes[0])
    most_bytes = _SHAPE_BYTES // int(view.scalar("drawn_cases", 1))
    room = most_bytes // (_POINT_BYTES * _FEWEST_POINTS * waves)
    modes = max(1, min(there, room))
    points, triangles = found.skin_point * _MM, found.skin_triangle
    most = max(_FEWEST_POINTS, most_bytes // (_POINT_BYTES * waves * modes))
    kept, faces = coarse_skin(points, triangles, most)
    shape = np.array(shapes)[:, :modes, kept]
    data = _payload(view, points[kept], shape, faces)
    fine = "" if len(kept) == len(np.unique(triangles)) else ", coarser than the mesh"
    state = contact_state(found.contacts)
    left_out = "" if modes == there else f"The first {modes} of {there} modes are in the page."
    caption = (
        f"{state.capitalize() + '. ' if state else ''}Displacement over its largest value, on {counted(len(kept), 'point')} of the skin of a sector{fine}. Choose nodal "
        f"diameter and mode, drag to turn, scroll to zoom; the camera button saves a PNG. Sector n moves as sector 0 turned by "
        f"n pitches, n phase angles ahead: play shows which way the wave travels. {left_out}"
    )
    drawn, controls = _figure(points[kept], faces), _controls(view, modes, data)
    return Plot(f"shapes{view.key}", "Mode shapes", caption, drawn, controls=controls)


def _figure(points: FloatArray, triangles: IntArray) -> go.Figure:
    """Return the sector at rest; the script adds the mode shape."""
    light = {"ambient": 0.78, "diffuse": 0.5, "specular": 0.08, "roughness": 0.9}
    bar = {"title": {"text": "displacement<br>/ largest"}, "len": 0.55, "thickness": 14}
    still = np.zeros(len(points), dtype=np.float32)
    colours = {"intensity": still, "cmin": 0.0, "cmax": 1.0, "colorscale": "Viridis"}
    skin = surface(points, triangles, colorbar=bar, lighting=light, **colours)
    pairs, sharp = edges(points, triangles)
    figure = styled(go.Figure([skin, segments(points, pairs[sharp], MUTED, 1.5)]), 640)
    axis = {"visible": False, "showspikes": False}
    figure.update_layout(
        margin={"l": 0, "r": 0, "t": 44, "b": 0},
        title={"text": "", "x": 0.02, "y": 0.97, "font": {"size": 15, "family": FONT}},
        scene={
            "xaxis": axis,
            "yaxis": axis,
            "zaxis": axis,
            "aspectmode": "manual",
            "dragmode": "orbit",
            "camera": {"projection": {"type": "orthographic"}},
        },
    )
    return figure


def _payload(view: Waves[Modes], points: FloatArray, shape: FloatArray, faces: IntArray) -> dict[str, object]:
    """Return the data of the script, arrays as text."""
    found, modes = view.found, shape.shape[1]
    largest = np.abs(shape).max(axis=(2, 3, 4), keepdims=True)
    whole = np.round(shape / np.where(largest > 0, largest, 1.0) * _FULL).astype("<i2")
    inside = _outside_of_wheel(view, faces)
    wheel, wheel_faces = coarse_skin(points, inside, max(60, _WHEEL_POINTS // view.sectors))
    origin = np.zeros(3) if found.axis_origin is None else found.axis_origin * _MM
    wave, mode = int(view.scalar(WAVE, 0)), int(view.scalar(MODE, 0))
    return {
        "shown": [wave, mode] if mode < modes else [0, 0],
        "sectors": view.sectors,
        "axis": _unit(np.zeros(0) if found.axis_direction is None else found.axis_direction).tolist(),
        "origin": origin.tolist(),
        "points": as_base64(points.astype("<f4")),
        "faces": as_base64(faces.astype("<i4")),
        "wheelPoints": as_base64(wheel.astype("<i4")),
        "wheelFaces": as_base64(wheel_faces.astype("<i4")),
        "waveNumbers": [w.wave_number for w in found.waves],
        "waves": [
            f"{name}, {w.kind} wave" if view.sectors > 1 else name
            for name, w in zip(view.waves, found.waves, strict=True)
        ],
        "hertz": [[f"{f:.6g}" for f in row[:modes]] for row in hertz(found)],
        "shapes": [[as_base64(s) for s in row] for row in whole],
    }


def _outside_of_wheel(view: Waves[Modes], faces: IntArray) -> IntArray:
    """Remove the faces between neighbouring sectors, if the skin is not yet coarse."""
    cut = view.found.skin_cut
    return faces[cut == 0] if cut is not None and len(cut) == len(faces) and view.sectors > 1 else faces


def _unit(direction: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(direction))
    return direction / length if direction.size == 3 and length > 0 else np.array([0.0, 0.0, 1.0])


def _controls(view: Waves[Modes], modes: int, data: dict[str, object]) -> Markup:
    """Return the form above the picture and the data behind it, as HTML."""
    pairs = enumerate(zip(view.waves, view.found.waves, strict=True))
    waves = "".join(f'<option value="{k}">{escape(f"{name} ({w.kind})")}</option>' for k, (name, w) in pairs)
    numbers = "".join(f'<option value="{m}">{m + 1}</option>' for m in range(modes))
    views = (
        '<label>show <select name="view"><option value="wheel">whole wheel</option>'
        '<option value="sector">one sector</option></select></label>'
        if view.sectors > 1
        else '<input type="hidden" name="view" value="sector">'
    )
    # "<" could end the script element early
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    return Markup(
        f'<form class="shapes" data-of="modes"><label>wave <select name="wave">{waves}</select></label>'
        f'<label>mode <select name="mode">{numbers}</select></label>{views}'
        '<label>phase <input type="range" name="phase" min="0" max="360" value="0" step="5"></label>'
        '<label>deformation <input type="range" name="size" min="0" max="20" value="6" step="0.5"></label>'
        '<button type="button" name="play">play</button></form>'
        f'<script type="application/json">{text}</script>'
    )


def modes_of_wheel(view: Waves[Modes]) -> Plot | None:
    """Draw the localisation of each mode, and its distribution over blades and waves."""
    own = view.found.wheel_modes
    if not own:
        return None
    hz, factor = np.array([mode.frequency_hz for mode in own]), np.array([mode.localisation for mode in own])
    blades, waves = np.array([mode.sector_share for mode in own]), np.array([mode.wave_share for mode in own])
    figure = make_subplots(
        1,
        3,
        horizontal_spacing=0.08,
        column_widths=[0.3, 0.35, 0.35],
        subplot_titles=("localisation factor", "share of each blade", "share of each wave"),
    )
    modes = np.arange(1, hz.size + 1)
    figure.add_bar(
        x=factor,
        y=modes,
        orientation="h",
        marker_color=INK,
        customdata=hz,
        showlegend=False,
        hovertemplate="mode %{y}, %{customdata:.6g} Hz: %{x:.3f}<extra></extra>",
        row=1,
        col=1,
    )
    for column, share, name in ((2, blades, "blade"), (3, waves, "wave number")):
        figure.add_trace(
            go.Heatmap(
                z=100 * share,
                y=modes,
                x=np.arange(share.shape[1]),
                colorscale="Blues",
                showscale=column == 3,
                colorbar={"title": {"text": "%"}},
                zmin=0,
                customdata=np.tile(hz[:, None], share.shape[1]),
                hovertemplate=f"mode %{{y}}, %{{customdata:.6g}} Hz<br>{name} %{{x}}: %{{z:.2g}} %<extra></extra>",
            ),
            row=1,
            col=column,
        )
    styled(figure, max(380, min(12 * hz.size + 160, 900)))
    legend_above(figure)
    figure.update_yaxes(title_text="mode", col=1)
    figure.update_xaxes(range=[0, 1], col=1)
    figure.update_xaxes(title_text="blade", col=2)
    figure.update_xaxes(title_text="wave number", col=3)
    most = int(np.argmax(factor))
    text = (
        f"{hz.size} modes of all sectors together, {number(float(hz.min()), 6)} to {number(float(hz.max()), 6)} Hz: the share of the "
        "kinetic energy that each blade and each wave has. With all sectors alike every mode is one wave. The most localised one is mode "
        f"{most + 1} ({number(float(hz[most]), 6)} Hz): factor {number(float(factor[most]), 3)} (0: all blades alike, 1: one alone), blade "
        f"{int(np.argmax(blades[most]))}."
    )
    return Plot(f"wheel_modes{view.key}", "Modes of the wheel whose sectors differ", text, figure)


def diameter_map(view: Waves[Modes]) -> Plot:
    """Draw the frequencies over the nodal diameters."""
    figure = go.Figure(mode_lines(view))
    reference = ""
    given = np.array([w.reference_hz for w in view.found.waves if w.reference_hz is not None])
    if given.size:
        known, mode = np.nonzero(np.isfinite(given))
        figure.add_scatter(
            x=np.array([w.nodal_diameter for w in view.found.waves])[known],
            y=given[known, mode],
            mode="markers",
            name="reference",
            hovertemplate="reference: %{y:.6g} Hz<extra></extra>",
            marker=ring(INK, 12, 1.2),
        )
        reference = " Open circles are the frequencies to compare with."
    styled(figure, 520)
    diameter_axes(figure, view)
    if view.sectors == 1:
        figure.update_xaxes(title_text="", showticklabels=False)
    hz = hertz(view.found)
    caption = (
        f"{counted(hz.shape[1], 'mode')} of {counted(len(hz), 'wave')}, {number(hz.min(), 5)} to {number(hz.max(), 5)} Hz, "
        f"{with_contacts(view.found.rotation or '', view.found.contacts).removeprefix(', ')}. Lines join the same mode number; modes of different families that come close repel each "
        f"other instead of crossing (veering).{reference}"
    )
    return Plot(f"diameters{view.key}", "Nodal-diameter map", caption, figure)


def frequencies(view: Waves[Modes]) -> list[Table]:
    """Return a table of the natural frequencies: one row a wave, one column a mode."""
    hz = hertz(view.found)
    head = ["wave", *(f"mode {m + 1} (Hz)" for m in range(hz.shape[1]))]
    # without a split, both directions have the same frequencies
    kinds = [w.kind if view.both or w.kind == "standing" else "both ways" for w in view.found.waves]
    names = [f"{name}, {kind}" if view.sectors > 1 else name for name, kind in zip(view.waves, kinds, strict=True)]
    rows = [[name, *(number(f, 7) for f in row)] for name, row in zip(names, hz, strict=True)]
    found = [Table(head, rows, with_contacts("Natural frequencies", view.found.contacts))]
    held = [w.stiffest_hz for w in view.found.waves if w.stiffest_hz is not None]
    if not held:
        return found
    rows = [[name, *(number(f, 7) for f in row)] for name, row in zip(names, held, strict=True)]
    title = "All harmonics held that flanges do not couple"
    told = "Flanges move freely in the harmonics that they do not couple, which makes them softer than they are; held there, they are stiffer."
    return [*found, Table(head, rows, title, (told,))]


def in_flow(view: Waves[Modes]) -> Table | None:
    """Return a table of frequencies and damping ratios with aerodynamic forces, one row a wave."""
    rows = [
        [
            f"{name}, {w.kind}",
            *(f"{number(f, 7)} Hz, {number(100 * d, 4)} %" for f, d in zip(w.damped_hz, w.damping, strict=True)),
        ]
        for name, w in zip(view.waves, view.found.waves, strict=True)
        if w.damped_hz is not None and w.damping is not None
    ]
    if not rows:
        return None
    head = ["wave", *(f"mode {m}" for m in range(1, len(rows[0])))]
    text = "Eigenvalues with aerodynamic forces and the structure's damping: frequency and damping ratio."
    return Table(head, rows, with_contacts("In the flow", view.found.contacts), (text,))


def stage_shares(view: Waves[Modes]) -> Plot | None:
    """Draw the energy share of each stage in each mode, as bars that add up to one."""
    share, hz = np.array([w.shares for w in view.found.waves if w.shares is not None]), hertz(view.found)
    if not share.size:
        return None
    places = [
        [name for name, row in zip(view.waves, hz, strict=True) for _ in row],
        [f"{m + 1}" for row in hz for m in range(len(row))],
    ]
    bars = [
        go.Bar(
            x=places,
            y=100 * share[:, :, i].ravel(),
            name=stage,
            marker={"color": colour(i)},
            customdata=hz.ravel(),
            hovertemplate=f"%{{y:.3g}} % at %{{customdata:.6g}} Hz<extra>{name}</extra>",
        )
        for i, (stage, name) in enumerate(zip(stages(view.found), view.found.stage_name, strict=True))
    ]
    figure = styled(go.Figure(bars), 420)
    figure.update_layout(barmode="stack", bargap=0.15)
    figure.update_xaxes(title_text="mode", tickangle=0)
    figure.update_yaxes(title_text="share of the kinetic energy (%)", range=[0, 100])
    waves = "; ".join(f"{name}: {text}" for name, text in zip(view.waves, view.found.stage_waves, strict=True))
    caption = f"A mode with nearly all its energy in one stage belongs to that wheel alone. Modes shared by two stages exist in the assembly only. The flanges couple these waves: {waves}. They leave all other waves free."
    return Plot(f"stages{view.key}", "Which stage vibrates", caption, figure)


def comparison(view: Waves[Modes]) -> Table | Words | None:
    """Return a table of relative differences from the reference, one row a wave."""
    title, off = with_contacts("Against the reference", view.found.contacts), _differences(view)
    if not off.size:
        return None
    known = int(np.isfinite(off).sum())
    if not known:
        return Words(("The reference has none of these frequencies.",), title)
    rows = [
        [name, *(_share(float(d)) for d in row)]
        for name, row in zip(view.waves, off, strict=True)
        if np.isfinite(row).any()
    ]
    worst = np.unravel_index(np.nanargmax(np.abs(off)), off.shape)
    text = (
        f"{known} {'frequency' if known == 1 else 'frequencies'} compared; the largest relative difference is "
        f"{_share(float(off[worst]))}, at {view.waves[worst[0]]}, mode {worst[1] + 1}."
    )
    head = ["wave", *(f"mode {m + 1}" for m in range(off.shape[1]))]
    return Table(head, rows, title, (text,))


def _differences(view: Waves[Modes]) -> FloatArray:
    """Return (w, m) relative differences from the reference; empty without one."""
    return np.array([w.difference for w in view.found.waves if w.difference is not None])


def _share(value: float) -> str:
    """Write a relative difference, in parts of a million where it is small."""
    if not np.isfinite(value):
        return NONE
    return f"{number(1e6 * value)} ppm" if abs(value) < 1e-4 else percent(100 * value, 3)


def _cards(view: Waves[Modes]) -> list[Card]:
    hz, off = hertz(view.found), np.abs(_differences(view))
    over = counted(len(hz), "wave") if view.sectors > 1 else "a whole structure"
    lowest = f"{number(float(np.nanmin(hz)), 5)} Hz"
    note = with_contacts(f"{hz.size} modes, {over}", view.found.contacts)
    found = [Card(lowest, "lowest natural frequency", note)]
    if np.isfinite(off).any():
        note = with_contacts(f"of {np.count_nonzero(np.isfinite(off))} frequencies", view.found.contacts)
        worst = percent(100 * float(np.nanmax(off)))
        found.append(Card(worst, "largest difference from the reference", note))
    return found


_TITLE = "Natural frequencies and mode shapes"
_BLOCK = Block(
    "modes", _TITLE, (diameter_map, stage_shares, mode_shapes, frequencies, modes_of_wheel, in_flow, comparison)
)
SECTION: Section = Section(
    "modes", NEEDED, view_of(Modes), (_BLOCK,), by_case=True, cards=_cards, yields_to=("campbell", "flutter", "safe")
)
