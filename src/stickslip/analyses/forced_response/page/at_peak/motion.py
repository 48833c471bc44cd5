"""The motion at the peak in space: meshes, bodies and contacts over a period, which the script of ``assets/shapes.js`` draws."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from stickslip.analyses.forced_response.page.at_peak.bodies import group_colours
from stickslip.analyses.forced_response.page.at_peak.contacts import states
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import Drawn, read
from stickslip.analyses.pictures import BODY, EDGES, STEEL, edges, segments, space, surface
from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, INK, MUTED, STATE_COLOURS, STATE_NAMES, STATE_SCALE, Plot, as_base64, styled
from stickslip.report.quantities import joined, quantity

MOST_BYTES = 600_000  # all motions of a page, before they become text
SAMPLES = 48  # samples of contact states in a period
SMALLEST = 0.003  # share of the largest amplitude; harmonics above the last one that reaches it are not drawn
ARROW = 0.14  # length of an arrow over the size of the picture
FRAME = 0.05  # the same for the axes of contact frames
FULL = 32767  # largest 16-bit number
MM = 1e3
CONTACT_SHARE_OF_SIZE = 0.5  # extent of contacts over the size of the picture, below which they have their own view
FIXED = -1  # case of traces that a checkbox shows
AXES = (("t", "#009e73"), ("w", "#cc79a7"), ("n", "#56b4e9"))
SHOWN_AS = {"mesh": (STEEL, 0.45), "bodies": (BODY, 0.85)}
MOST_NAMES = 4  # names of contact points that do not overlap


@dataclass(frozen=True, eq=False)
class CaseMotion:
    """Motion of a case in the figure.

    Parameters
    ----------
    coefficients
        (H, n + p, 3) of the drawn points and the contact points in the harmonics from 1 on, m.
    states
        (p, s) states over a period: 0 stick, 1 slip, 2 open.
    """

    coefficients: ComplexArray
    states: IntArray

    @property
    def largest(self) -> float:
        """Largest displacement of a point at any phase, m."""
        phases = np.exp(2j * np.pi * np.outer(np.arange(64) / 64, np.arange(1, len(self.coefficients) + 1)))
        moved = np.einsum("sh,hpd->spd", phases, self.coefficients).real
        return float(np.sqrt((moved**2).sum(axis=-1)).max(initial=0.0))

    @property
    def size(self) -> int:
        """Bytes in the page."""
        return 4 * self.coefficients.size + self.states.size


def motion_of_case(response: Response, case: ShownCase) -> CaseMotion:
    """Return the motion of a case at its peak; without a recovered motion it is zero."""
    own = read(Drawn, response.data, case.index)
    known = np.isfinite(own.drawn_point).all(axis=1)  # another case may have more points
    both = np.concatenate([own.peak_drawn_motion[:, known], own.peak_contact_motion], axis=1)
    found = np.nan_to_num(both[..., 0] + 1j * both[..., 1])
    sizes = np.abs(found).max(axis=(1, 2), initial=0.0)
    kept = np.flatnonzero(sizes >= SMALLEST * sizes.max(initial=0.0))
    state = states(response, case).max(axis=1)
    at = np.arange(SAMPLES) * state.shape[-1] // SAMPLES
    return CaseMotion(found[: int(kept[-1]) + 1 if kept.size else 1], state[:, at])


def _cases(response: Response) -> dict[ShownCase, CaseMotion]:
    """Return the motions of the page: the case shown first, then cases with the same geometry, as far as there is room."""
    points = read(Drawn, response.data).drawn_point
    first = next(c for c in response.peaked if c.index == response.chosen)
    found: dict[ShownCase, CaseMotion] = {}
    room = MOST_BYTES
    for case in (first, *(c for c in response.peaked if c is not first)):
        if not np.array_equal(points[case.index], points[first.index], equal_nan=True):
            continue
        own = motion_of_case(response, case)
        room -= own.size
        if not found or room >= 0:
            found[case] = own
    return found


def in_motion(response: Response) -> Plot | None:
    """Draw meshes, bodies, contacts, loads and supports, and move them as at the peak."""
    if not response.has("drawn_point", "drawn_triangle", "peak_state") or not response.peaked:
        return None
    own = read(Drawn, response.data, response.chosen)
    cases = _cases(response)
    known = np.isfinite(own.drawn_point).all(axis=1)
    points, contacts = MM * own.drawn_point[known], MM * own.drawn_contact
    if own.drawn_triangle is None or own.drawn_kind is None or not np.isfinite(contacts).all():
        return None
    pairs, sharp = edges(points, own.drawn_triangle)
    every = np.vstack([points, contacts])
    span = float(np.ptp(every, axis=0).max())
    figure = go.Figure([*_surfaces(own, points), segments(points, pairs[sharp], EDGES, 1.5)])
    figure.add_trace(_contacts(response, contacts, next(iter(cases.values()))))
    figure.add_traces(_frames(response, contacts, FRAME * span))
    figure.add_traces([*_loads(own, ARROW * span), *_supports(own), *_keys()])
    _laid_out(figure, every, flat=bool(np.all(own.drawn_kind[known] == "mass")))
    views = {"whole": _view(figure.layout.scene)}
    if float(np.ptp(contacts, axis=0).max()) < CONTACT_SHARE_OF_SIZE * span:
        views["contacts"] = _view(_scene_of(contacts, 1.6, 0.4))
    framed = response.has("contact_frame") and bool(np.isfinite(response.values("contact_frame")).any())
    data = {
        "points": as_base64(points.astype("<f4")),
        "contacts": as_base64(contacts.astype("<f4")),
        "edges": as_base64(pairs[sharp].astype("<i4")),
        "frames": as_base64(np.nan_to_num(response.model.contact_frame).astype("<f4")) if framed else "",
        "frameLength": FRAME * span,
        "span": span,
        "chosen": response.chosen,
        "views": views,
        "cases": {case.index: _payload(one) for case, one in cases.items()},
    }
    caption = _caption(response, own)
    captions = {c.index: _said(cases.get(c)) for c in response.peaked}
    controls = _controls(data, framed=framed)
    return Plot("in_motion", "The motion at the peak", caption, figure, captions, response.chosen, controls)


def _payload(one: CaseMotion) -> dict[str, object]:
    """Return a motion as text: 16-bit numbers relative to the largest value."""
    parts = np.stack([one.coefficients.real, one.coefficients.imag], axis=-1)
    top = float(np.abs(parts).max(initial=0.0)) or 1.0
    return {
        "motion": as_base64(np.round(parts / top * FULL).astype("<i2")),
        "unit": MM * top / FULL,
        "harmonics": len(parts),
        "largest": MM * one.largest,
        "states": as_base64(one.states.astype("<i1")),
    }


def _surfaces(own: Drawn, points: FloatArray) -> list[go.Mesh3d]:
    """Draw meshes, through which contacts are seen, and rigid bodies and masses."""
    assert own.drawn_triangle is not None
    assert own.drawn_kind is not None
    meshed = own.drawn_kind[own.drawn_triangle[:, 0]] == "mesh"
    light = {"ambient": 0.7, "diffuse": 0.55, "specular": 0.1, "roughness": 0.9}
    each = zip(SHOWN_AS.items(), (meshed, ~meshed), strict=True)
    return [
        surface(points, own.drawn_triangle[which], color=colour, opacity=opacity, lighting=light, name=name)
        for (name, (colour, opacity)), which in each
    ]


def _contacts(response: Response, at: FloatArray, one: CaseMotion) -> go.Scatter3d:
    """Draw the contact points, coloured by their state."""
    names = np.array(response.labels("contact"), dtype=object)
    few = len(names) <= MOST_NAMES
    x, y, z = at.astype(np.float32).T
    colours = {"color": one.states[:, 0].astype(np.int8), "colorscale": STATE_SCALE, "cmin": -0.5, "cmax": 2.5}
    return go.Scatter3d(
        x=x,
        y=y,
        z=z,
        mode="markers+text" if few else "markers",
        text=names,
        textposition="bottom center",
        textfont={"size": 12, "color": INK},
        marker={"size": 7 if few else 4.5, "line": {"width": 1, "color": INK}, **colours},
        name="contacts",
        showlegend=False,
        hovertemplate="%{text}<extra></extra>",
    )


def _frames(response: Response, at: FloatArray, length: float) -> list[go.Scatter3d]:
    """Draw the axes t, w, n at each contact point; a checkbox shows them."""
    frame = np.nan_to_num(response.model.contact_frame) if response.has("contact_frame") else np.zeros((len(at), 3, 3))
    found = []
    for k, (name, colour) in enumerate(AXES):
        ends = np.stack([at, at + length * frame[:, :, k], np.full_like(at, np.nan)], axis=1).reshape(-1, 3)
        x, y, z = ends.astype(np.float32).T
        line = {"color": colour, "width": 4}
        found.append(go.Scatter3d(x=x, y=y, z=z, mode="lines", line=line, name=f"axis {name}", hoverinfo="skip"))
    return [trace.update(meta=FIXED, visible=False) for trace in found]


def _loads(own: Drawn, length: float) -> list[go.Scatter3d | go.Cone]:
    """Draw an arrow to the place of each load, static ones grey."""
    if own.drawn_load is None or own.drawn_load_point is None or own.drawn_load_direction is None:
        return []
    harmonics = own.drawn_load_harmonic if own.drawn_load_harmonic is not None else np.ones(len(own.drawn_load))
    found: list[go.Scatter3d | go.Cone] = []
    rows = zip(own.drawn_load, MM * own.drawn_load_point, own.drawn_load_direction, harmonics, strict=True)
    for name, tip, unit, harmonic in rows:
        colour, tail = ALARM if harmonic else MUTED, tip - length * unit
        x, y, z = np.vstack([tail, tip]).astype(np.float32).T
        line = {"color": colour, "width": 5}
        label = f"{name}{'' if harmonic else ' (static)'}"
        drawn = {"mode": "lines+text", "text": [label, ""], "textfont": {"size": 12, "color": colour}}
        found.append(go.Scatter3d(x=x, y=y, z=z, line=line, name=label, showlegend=False, hoverinfo="name", **drawn))
        cone = {"sizemode": "absolute", "sizeref": 0.35 * length, "anchor": "tip", "showscale": False}
        x, y, z, u, v, w = ([float(value)] for value in (*tip, *unit))
        shade = [[0, colour], [1, colour]]
        found.append(go.Cone(x=x, y=y, z=z, u=u, v=v, w=w, colorscale=shade, hoverinfo="skip", **cone))
    return found


def _supports(own: Drawn) -> list[go.Scatter3d]:
    """Draw squares at points that are held."""
    if own.drawn_support is None or not len(own.drawn_support):
        return []
    x, y, z = (MM * own.drawn_support).astype(np.float32).T
    few = len(own.drawn_support) <= MOST_NAMES
    mark = {"symbol": "square", "size": 6 if few else 3, "color": INK}
    return [go.Scatter3d(x=x, y=y, z=z, mode="markers", marker=mark, name="held", hoverinfo="name")]


def _keys() -> list[go.Scatter3d]:
    """Return the legend of the states."""
    nowhere = {"x": [None], "y": [None], "z": [None]}
    return [
        go.Scatter3d(
            **nowhere,
            mode="markers",
            name=name,
            marker={"size": 7, "color": colour, "line": {"width": 1, "color": INK}},
        )
        for name, colour in zip(STATE_NAMES, STATE_COLOURS, strict=True)
    ]


def _scene_of(points: FloatArray, grown: float, margin: float) -> dict[str, Any]:
    """Return a scene around points with a margin, a share of their extent; `grown` enlarges it in the figure."""
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    extent = np.ptp(points, axis=0)
    half = np.maximum((0.5 + margin) * extent, 0.15 * extent.max())
    scene: dict[str, Any] = space(middle - half, middle + half, close=True)
    scene["aspectratio"] = {name: grown * value for name, value in scene["aspectratio"].items()}
    return scene


def _view(scene: Any) -> dict[str, object]:
    """Return the changes of a layout that show a scene."""
    ranges = {f"scene.{a}axis.range": list(scene[f"{a}axis"]["range"]) for a in "xyz"}
    return ranges | {"scene.aspectratio": {a: scene["aspectratio"][a] for a in "xyz"}}


def _laid_out(figure: go.Figure, points: FloatArray, *, flat: bool) -> None:
    """Give the figure its axes and legend; masses in a row are seen from the side."""
    styled(figure, 360 if flat else 560)
    scene = _scene_of(points, 2.0 if flat else 1.35, 0.1)
    eye = {"x": 0.15, "y": -2.0, "z": 0.35} if flat else {"x": 1.1, "y": -1.5, "z": 0.5}
    scene["camera"] = {"eye": eye, "projection": {"type": "orthographic"}}
    if flat:
        hidden = {"visible": False, "showspikes": False}
        for name in "xyz":
            scene[f"{name}axis"] = {**scene[f"{name}axis"], **hidden}
    legend = {"orientation": "h", "x": 0, "y": 1, "yanchor": "bottom", "itemsizing": "constant"}
    figure.update_layout(scene=scene, margin={"l": 0, "r": 0, "t": 40, "b": 0}, legend=legend)


def _caption(response: Response, own: Drawn) -> str:
    assert own.drawn_part is not None
    assert own.drawn_kind is not None
    kinds = {kind: list(dict.fromkeys(own.drawn_part[own.drawn_kind == kind].tolist())) for kind in HOW}
    told = [sentence.format(joined(kinds[kind])) for kind, sentence in HOW.items() if kinds[kind]]
    groups = joined(list(group_colours(response)))
    text = f"Contact points of {groups}, coloured by their state at the phase shown; play runs through a cycle. Motions are about the mean position, larger than they are."
    arrows = (
        " Arrows point at loads, grey ones are static." if own.drawn_load is not None and len(own.drawn_load) else ""
    )
    some = own.drawn_support is not None and len(own.drawn_support) and not kinds["mass"]
    held = " Black squares mark points that are held." if some else ""
    return " ".join([text, *told]) + arrows + held


HOW = {
    "mesh": "Of fine meshes ({}) some of the nodes are drawn.",
    "section": "The surface of {} follows from its section.",
    "contact faces": "No section of {} is known: it is drawn from its contact faces to its centre of mass.",
    "node": "Cubes are nodes of {}.",
    "mass": "Cubes are the masses of {}, one behind the other along x; a black square above one marks a spring to the ground.",
}


def _said(one: CaseMotion | None) -> str:
    if one is None:
        return "The motion of this case is not in the page; `stickslip export` writes it for ParaView."
    if not one.largest:
        return "The motion is not drawn: the model has more than 60 000 degrees of freedom. `stickslip export` writes it for ParaView."
    return f"Largest displacement {quantity(one.largest, 'm')}."


def _controls(data: dict[str, object], *, framed: bool) -> Markup:
    """Return the form above the picture and the data behind it, as HTML."""
    text = json.dumps(data, separators=(",", ":")).replace("<", "\\u003c")
    near = (
        '<label>show <select name="view"><option value="whole">all</option><option value="contacts">the contacts</option></select></label>'
        if "contacts" in data["views"]  # type: ignore[operator]
        else ""
    )
    frames = '<label><input type="checkbox" name="frames"> contact frames t, w, n</label>' if framed else ""
    return Markup(
        '<form class="shapes" data-of="motion">'
        '<button type="button" name="play">play</button>'
        '<label>phase <input type="range" name="phase" min="0" max="360" value="0" step="5"></label>'
        '<label>deformation <input type="range" name="size" min="0" max="20" value="5" step="0.5"></label>'
        f"{near}{frames}</form>"
        f'<script type="application/json">{text}</script>'
    )
