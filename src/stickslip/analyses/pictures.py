"""The model on the page: drawing of its skin and contact points, accuracy of the reduction, and facts."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.at_peak.bodies import group_colours, rigid_bodies
from stickslip.analyses.forced_response.page.at_peak.contacts import contact_lines, states
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import Drawn, read
from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import INK, MUTED, STATE_COLOURS, Plot, styled
from stickslip.report.quantities import NARROW_SPACE, NONE, counted, fixed, joined, number, percent, quantity
from stickslip.report.result import Node
from stickslip.report.section import Table
from stickslip.report.tiles import outlines, patches, triangulated

_MANY_EDGES = 4_000  # edges of a panel, above which only sharp edges are drawn, to keep the page small
_SHARP = np.cos(np.radians(30.0))
STEEL, BODY, EDGES = "#b9c4d0", "#8d99a6", "#6f7f91"
_SAID = ("sticks, or stays closed", "slips", "lifts off", "stays open")
_COLOURS = (*STATE_COLOURS[:3], MUTED)
_FLAT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0}  # colours as in the legend
_ONE_WAY = 0.8  # least length of the mean normal of contacts that face one way
_MOST_NAMES = 15  # names of contact points that do not overlap
_CHECKED = (
    ("free", "frequency_full_hz", "frequency_reduced_hz"),
    ("stuck", "frequency_stuck_full_hz", "frequency_stuck_reduced_hz"),
)


def edges(points: FloatArray, triangles: IntArray) -> tuple[IntArray, np.ndarray]:
    """Find the edges of a triangulated surface.

    Returns
    -------
    pairs
        (n, 2) nodes of each edge, once.
    sharp
        (n,) True if the two faces make an angle of more than 30 degrees, or there is only one face.
    """
    normal = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]], points[triangles[:, 2]] - points[triangles[:, 0]]
    )
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0, length, 1.0)
    corners = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    pairs, which = np.unique(corners, axis=0, return_inverse=True)
    face = np.repeat(np.arange(len(triangles)), 3)
    order = np.argsort(which.ravel(), kind="stable")
    start = np.searchsorted(which.ravel()[order], np.arange(len(pairs)))
    end = np.append(start[1:], len(order)) - 1
    first, last = face[order[start]], face[order[end]]
    angle = np.abs(np.sum(normal[first] * normal[last], axis=1))
    return pairs, (start == end) | (angle < _SHARP)


def segments(points: FloatArray, pairs: IntArray, colour: str, width: float) -> go.Scatter3d:
    """Draw separate segments as one trace, with gaps between them."""
    path = np.full((len(pairs), 3, 3), np.nan, dtype=np.float32)
    path[:, :2] = points[pairs]
    x, y, z = path.reshape(-1, 3).T
    line = {"color": colour, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip", showlegend=False)


def surface(points: FloatArray, triangles: IntArray, **look: Any) -> go.Mesh3d:
    """Draw a triangulated surface."""
    x, y, z = points.astype(np.float32).T
    whole = np.uint16 if len(points) <= np.iinfo(np.uint16).max else np.int32
    i, j, k = triangles.astype(whole).T
    shared = {"flatshading": True, "hoverinfo": "skip", "showlegend": False}
    return go.Mesh3d(x=x, y=y, z=z, i=i, j=j, k=k, **shared, **look)


def _skin(points: FloatArray, triangles: IntArray, opacity: float) -> go.Mesh3d:
    light = {"ambient": 0.65, "diffuse": 0.6, "specular": 0.1, "roughness": 0.9}
    return surface(points, triangles, color=STEEL, opacity=opacity, lighting=light, name="skin")


def _bodies(solids: list[tuple[str, FloatArray, IntArray]], opacity: float) -> list[go.Mesh3d]:
    """Draw rigid bodies."""
    light = {"ambient": 0.65, "diffuse": 0.6, "specular": 0.1, "roughness": 0.9}
    return [
        surface(points, triangles, color=BODY, opacity=opacity, lighting=light, name=name)
        for name, points, triangles in solids
    ]


def _inside(points: FloatArray, parts: IntArray, low: FloatArray, high: FloatArray) -> IntArray:
    """Return the triangles or edges whose bounding box meets the box from `low` to `high`."""
    corners = points[parts]
    meets = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
    return np.asarray(parts[meets.all(axis=1)])


def _contacts(response: Response, position: FloatArray, *, named: bool, keyed: bool = False) -> list[go.Scatter3d]:
    """Draw the contact points, coloured by their contact."""
    names, colours = np.array(response.labels("contact"), dtype=object), group_colours(response)
    place = _places(response)
    mode = "markers+text" if named and len(names) <= _MOST_NAMES else "markers"
    return [
        go.Scatter3d(
            x=position[at, 0],
            y=position[at, 1],
            z=position[at, 2],
            mode=mode,
            name=group,
            legendgroup=group,
            showlegend=keyed,
            text=names[at],
            textposition=place[at],
            textfont={"size": 12, "color": INK},
            marker={"size": 5 if named else 3, "color": colours[group]},
            hovertemplate="%{text}: x %{x:.2f}, y %{y:.2f}, z %{z:.2f} mm<extra></extra>",
        )
        for group, at in response.groups.items()
    ]


def _states(response: Response, position: FloatArray) -> list[go.Scatter3d | go.Mesh3d]:
    """Draw the contacts coloured by their state in a cycle at the peak of the case shown first; as patches if points have areas."""
    case = response.cases[response.chosen]
    state = states(response, case)
    open_, slips = ((state == k).any(axis=(1, 2)) for k in (2, 1))
    apart = (state == 2).all(axis=(1, 2))
    each = np.where(apart, 3, np.where(open_, 2, np.where(slips, 1, 0)))
    tiles = contact_patches(response, position)
    found: list[go.Scatter3d | go.Mesh3d] = []
    for k in range(4):
        at = np.flatnonzero(each == k)
        key = {"name": _SAID[k], "legend": "legend2", "legendgroup": _SAID[k]}
        drawn = [tiles[int(i)] for i in at if i in tiles]
        if drawn:
            points, triangles = triangulated(drawn)
            found.append(
                surface(points, triangles, color=_COLOURS[k], lighting=_FLAT).update(key | {"showlegend": True})
            )
        alone = np.array([i for i in at if i not in tiles], dtype=np.int64)
        if at.size:
            found.append(_named(response, position, at, alone, k).update(key | {"showlegend": not drawn}))
    if tiles:
        x, y, z = outlines(tiles.values()).astype(np.float32).T
        rim = {"mode": "lines", "line": {"color": INK, "width": 2}, "hoverinfo": "skip"}
        found.append(go.Scatter3d(x=x, y=y, z=z, name="rims", showlegend=False, **rim))
    return found


def _named(response: Response, position: FloatArray, at: IntArray, alone: IntArray, state: int) -> go.Scatter3d:
    """Draw contact points in a state: single points as dots, points of a patch as hover targets; with names if they are few."""
    names = np.array(response.labels("contact"), dtype=object)
    few = len(names) <= _MOST_NAMES
    size = np.where(np.isin(at, alone), 8.0, 2.0)
    return go.Scatter3d(
        x=position[at, 0],
        y=position[at, 1],
        z=position[at, 2],
        mode="markers+text" if few else "markers",
        text=names[at],
        textposition=_places(response)[at],
        textfont={"size": 12, "color": INK},
        marker={
            "size": size.tolist(),
            "color": _COLOURS[state] if alone.size else INK,
            "line": {"width": 1, "color": INK},
        },
        hovertemplate="%{text} " + _SAID[state] + ": x %{x:.2f}, y %{y:.2f}, z %{z:.2f} mm<extra></extra>",
    )


def contact_patches(response: Response, position: FloatArray) -> dict[int, FloatArray]:
    """Return the corners (k, 3) of the patch of each contact point that has an area; positions in mm."""
    if not response.has("contact_area", "contact_frame"):
        return {}
    frame, area = response.values("contact_frame"), 1e6 * response.values("contact_area")
    found: dict[int, FloatArray] = {}
    for members in response.groups.values():
        found |= patches(position, frame, area, members)
    return found


def _places(response: Response) -> np.ndarray:
    """Return label positions of contact points, alternately above and below neighbouring lines so that they do not overlap."""
    place = np.full(len(response.labels("contact")), "top center", dtype=object)
    for line, members in enumerate(contact_lines(response)):
        place[members] = "bottom center" if line % 2 else "top center"
    return place


def _sections(response: Response, position: FloatArray) -> go.Scatter3d:
    """Connect the contact points of each section of a rigid body, which has no skin; names of a section end alike."""
    rows: dict[str, list[int]] = {}
    for index, name in enumerate(response.labels("contact") if rigid_bodies(response) else ()):
        rows.setdefault(name.rpartition(".")[2], []).append(index)
    gap = np.full((1, 3), np.nan)
    paths = [np.vstack([position[[*row, row[0]]], gap]) for row in rows.values() if len(row) == 3]
    x, y, z = np.vstack([*paths, gap]).T
    drawn = {"mode": "lines", "line": {"color": INK, "width": 3}, "hoverinfo": "skip"}
    return go.Scatter3d(x=x, y=y, z=z, name="sections", showlegend=bool(paths), **drawn)


def _neighbourhood(position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the corners of a box around the contact points."""
    margin = 0.35 * float(np.ptp(position, axis=0).max())
    return position.min(axis=0) - margin, position.max(axis=0) + margin


def _eye(response: Response) -> dict[str, float] | None:
    """Return the viewpoint: oblique to the contact faces if they face one way; None otherwise."""
    if not response.has("contact_frame"):
        return None
    normal = np.nanmean(response.values("contact_frame")[:, :, 2], axis=0)
    if not np.linalg.norm(normal) > _ONE_WAY:
        return None
    along = np.eye(3)[int(np.argmin(np.abs(normal)))]
    aslant = normal + 0.45 * along + 0.3 * np.cross(normal, along)
    seen = 1.75 * aslant / np.linalg.norm(aslant)
    return dict(zip("xyz", seen.tolist(), strict=True))


def space(low: FloatArray, high: FloatArray, *, close: bool, seen: dict[str, float] | None = None) -> dict[str, object]:
    """Return the axes of a view of the box between two corners, with equal lengths on all axes."""
    eye, size = {"x": 1.0, "y": -1.5, "z": 0.55}, 1.65
    if close:
        eye, size = seen or {"x": 0.32, "y": -1.5, "z": -0.8}, 1.6 if seen else 1.3
    extent = high - low
    # nodes that all lie on one point have no extent
    span = size * (extent / extent.max() if extent.max() > 0.0 else np.ones(3))
    axes = {
        f"{name}axis": {
            "range": [float(a), float(b)],
            "title": {"text": f"{name} (mm)", "font": {"size": 12}},
            "showbackground": False,
            "gridcolor": "#dfe4ea",
            "zeroline": False,
            "nticks": 6 if close else 3,
            "tickfont": {"size": 11},
        }
        for name, a, b in zip("xyz", low, high, strict=True)
    }
    camera = {"eye": eye, "projection": {"type": "orthographic"}}
    ratio = dict(zip("xyz", span.tolist(), strict=True))
    shown = {"aspectmode": "manual", "aspectratio": ratio, "camera": camera, "dragmode": "orbit"}
    return {**axes, **shown}


def _caption(node: Node, points: FloatArray, triangles: IntArray) -> str:
    size = np.ptp(points, axis=0)
    text = (
        f"Skin of the mesh: {counted(len(triangles), 'triangle')} between {len(np.unique(triangles))} corner nodes, "
        f"{number(size[0])} × {number(size[1])} × {number(size[2])}{NARROW_SPACE}mm. Drag to turn, scroll to zoom."
    )
    if not isinstance(node, Response):
        return text
    each = [f"{counted(len(at), 'point')} of {group}" for group, at in node.groups.items()]
    text += f" Contact points, coloured by contact: {joined(each)}." if each else ""
    if node.has("peak_state", "contact_position") and node.chosen >= 0:
        drawn = "their patches" if contact_patches(node, 1e3 * node.floats("contact_position")) else "they"
        text += f" Near the contacts {drawn} are coloured by what they do in a cycle at the peak{node.cases[node.chosen].where}."
    bodies = sorted({name for name, _, _ in _solids(node)})
    missing = [name for name in rigid_bodies(node) if name not in bodies]
    verb = "has" if len(missing) == 1 else "have"
    text += f" Rigid bodies are darker: {joined(bodies)}." if bodies else ""
    return text + (f" Not drawn: {joined(missing)}, which {verb} no shape in the result." if missing else "")


def _solids(node: Response) -> list[tuple[str, FloatArray, IntArray]]:
    """Return name, points in mm and triangles of each rigid body with a drawn surface."""
    own = read(Drawn, node.data, max(node.chosen, 0))
    if own.drawn_triangle is None or own.drawn_part is None or own.drawn_kind is None:
        return []
    bodies = np.isin(own.drawn_kind, ("section", "contact faces"))
    first = own.drawn_triangle[:, 0]
    return [
        (str(name), 1e3 * own.drawn_point, own.drawn_triangle[own.drawn_part[first] == name])
        for name in dict.fromkeys(own.drawn_part[bodies].tolist())
    ]


def skin_picture(node: Node) -> Plot | None:
    """Draw the skin with its mesh, whole and near the contacts."""
    if not node.has("surface_point", "surface_triangle"):
        return None
    points, triangles = node.floats("surface_point") * 1e3, node.integers("surface_triangle")
    contacts = isinstance(node, Response) and node.has("contact_position")
    position = node.floats("contact_position") * 1e3 if contacts else points
    contacts = contacts and bool(np.isfinite(position).all())
    pairs, sharp = edges(points, triangles)
    drawn = pairs if len(pairs) <= _MANY_EDGES else pairs[sharp]
    titles = ("whole", "near the contacts")[: 1 + contacts]
    panels = {"specs": [[{"type": "scene"}] * len(titles)], "subplot_titles": titles}
    figure = make_subplots(1, len(titles), horizontal_spacing=0.02, **panels)
    whole = [_skin(points, triangles, 1.0), segments(points, drawn, EDGES, 1.0)]
    figure.add_traces(whole, rows=1, cols=1)
    if contacts and isinstance(node, Response):
        low, high = _neighbourhood(position)
        close, rough = (_inside(points, own, low, high) for own in (pairs, drawn))
        near = [
            _skin(points, _inside(points, triangles, low, high), 0.35),
            segments(points, close if len(close) <= _MANY_EDGES else rough, EDGES, 1.0),
            _sections(node, position),
            *_bodies(_solids(node), 0.5),
        ]
        stated = node.has("peak_state") and node.chosen >= 0
        whole = _contacts(node, position, named=False, keyed=True)
        figure.add_traces([*_bodies(_solids(node), 1.0), *whole], rows=1, cols=1)
        points_near = _states(node, position) if stated else _contacts(node, position, named=True)
        figure.add_traces([*near, *points_near], rows=1, cols=2)
        figure.update_layout(scene2=space(low, high, close=True, seen=_eye(node)))
    styled(figure, 480)
    row = {"orientation": "h", "xanchor": "center", "y": 0, "yanchor": "top", "itemsizing": "constant"}
    legend = row | {"x": 0.24 if contacts else 0.5, "title": {"text": "contacts"}}
    shown = node.cases[node.chosen].where if contacts and isinstance(node, Response) and node.chosen >= 0 else ""
    second = row | {"x": 0.76, "title": {"text": f"at the peak{shown}"}, "font": {"size": 12}}
    scene = space(points.min(axis=0), points.max(axis=0), close=False)
    margin = {"l": 0, "r": 0, "t": 62, "b": 70 if contacts else 10}
    figure.update_layout(scene=scene, margin=margin, legend=legend, legend2=second)
    title = "The mesh and the contact points" if contacts else "The mesh"
    return Plot("mesh", title, _caption(node, points, triangles), figure)


def picture(nodes: Mapping[str, Node]) -> Plot | None:
    """Return the drawing of the skin with the contacts, if an analysis stores them."""
    found = (skin_picture(node) for node in nodes.values())
    return next((plot for plot in found if plot is not None), None)


def reduction(nodes: Mapping[str, Node]) -> Table | None:
    """Compare the frequencies of the full and the reduced model."""
    node = next((n for n in nodes.values() if n.has(*_CHECKED[0][1:])), None)
    if node is None:
        return None
    rows, off = [], []
    for name, full, reduced in _CHECKED:
        if node.has(full, reduced):
            a, b = (of_first_case(node, n) for n in (full, reduced))
            with np.errstate(divide="ignore", invalid="ignore"):
                difference = np.where(a > 0, b / a - 1, np.nan)
            cells = zip(a, b, difference, strict=True)
            rows += [
                [f"{name} {k + 1}", fixed(float(x), 3), fixed(float(y), 3), percent(100 * d)]
                for k, (x, y, d) in enumerate(cells)
                if np.isfinite(x)
            ]
            off += np.abs(difference[np.isfinite(difference)]).tolist()
    worst = percent(100 * max(off)) if off else NONE
    text = f"The reduced model reproduces the frequencies of the full one within {worst}."
    head = ["mode", "full (Hz)", "reduced (Hz)", "difference"]
    return Table(head, rows, "Reduction", (text,)) if rows else None


def of_first_case(node: Node, name: str) -> FloatArray:
    """Return a variable of the first case."""
    found = node.data[name]
    return np.asarray((found.isel(case=0) if "case" in found.dims else found).values, dtype=float)


def facts(nodes: Mapping[str, Node]) -> Table | None:
    """Return mass, centre, size and counts of the model."""
    node = _together(nodes)
    if node.stored("mass_kg") is None:
        return None
    sectors = int(node.scalar("sectors", 1))
    stages = node.text("stages")
    sectors = 1 if stages else sectors
    mass, each = node.scalar("mass_kg"), " of a sector" if sectors > 1 else ""
    rows = [
        ["stages", stages or NONE],
        ["sectors", str(sectors) if sectors > 1 else NONE],
        [f"mass{each}", quantity(1e3 * mass, "g", 6)],
        ["mass of the wheel", quantity(1e3 * sectors * mass, "g", 6) if sectors > 1 else NONE],
        [f"centre of mass{each}", _lengths(node.numbers("centre_m"))],
        ["box from", _lengths(node.numbers("box_low_m"))],
        ["box to", _lengths(node.numbers("box_high_m"))],
        *([text, fixed(node.scalar(name), 0)] for name, text in _COUNTS),
        ["rotation", node.text("rotation") or NONE],
        *_static(node),
    ]
    return Table((), [row for row in rows if row[1] != NONE], "Facts", numeric=False)


def _together(nodes: Mapping[str, Node]) -> Node:
    """Return the facts about the model from the first analysis that stores them."""
    each = [node.data for node in reversed(list(nodes.values()))]
    told = {n: v.variable for data in each for n, v in data.data_vars.items() if set(v.dims) <= {"xyz"}}
    return Node(xr.Dataset(told, attrs={k: v for data in each for k, v in data.attrs.items()}))


_COUNTS = (
    ("nodes", "nodes"),
    ("elements", "elements"),
    ("dofs", "free degrees of freedom"),
    ("reduced", "coordinates of the reduced model"),
    ("retained", "coordinates of contacts and rigid bodies"),
)


def _static(node: Node) -> list[list[str]]:
    """Return the effects of the centrifugal load, if something rotates."""
    displacement = node.scalar("static_displacement_m")
    if not np.isfinite(displacement):
        return []
    rpm = number(node.scalar("static_rpm"), 5)
    strain = percent(100 * node.scalar("static_strain"), 3)
    degrees = number(float(np.degrees(node.scalar("static_rotation_rad"))), 3)
    return [
        [f"largest static displacement at {rpm} rpm", f"{number(1e3 * displacement, 4)} mm"],
        ["with strains and rotations up to", f"{strain}, {degrees}°"],
    ]


def _lengths(values: np.ndarray) -> str:
    if values.size != 3 or not np.isfinite(values).all():
        return NONE
    return f"({', '.join(number(float(v) * 1e3, 5) for v in values)}) mm"


PARTS = (reduction, facts)
