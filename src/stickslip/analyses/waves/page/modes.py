"""Natural frequencies and mode shapes on the page, for tuned and mistuned wheels."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.waves.page.shapes import mode_shapes
from stickslip.analyses.waves.page.waves import NEEDED, Waves, diameter_axes, mode_lines, view_of
from stickslip.analyses.waves.records import Modes, hertz, stages, with_contacts
from stickslip.arrays import FloatArray
from stickslip.report.content import Table, Words
from stickslip.report.plot import INK, Plot, colour, legend_above, ring, styled
from stickslip.report.quantities import NONE, counted, number, percent
from stickslip.report.section import Block, Card, Section


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
        figure.add_trace(
            go.Scatter(
                x=np.array([w.nodal_diameter for w in view.found.waves])[known],
                y=given[known, mode],
                mode="markers",
                name="reference",
                hovertemplate="reference: %{y:.6g} Hz<extra></extra>",
                marker=ring(INK, 12, 1.2),
            )
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
