"""Picture of the meshed blades with the contact points; it turns with the mouse."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.figures_contact import contact_lines, right_side
from stickslip.report.plot import INK, LEFT_SIDE, RIGHT_SIDE, Plot, absent, styled
from stickslip.report.quantities import NARROW_SPACE, counted, number
from stickslip.report.result import Result

_MANY_EDGES = 40_000  # above it only the sharp edges are drawn, to keep the page small
_SHARP = np.cos(np.radians(30.0))
_STEEL = "#b9c4d0"


def edges(points: FloatArray, triangles: IntArray) -> tuple[IntArray, np.ndarray]:
    """Find the edges of a triangulated surface.

    Returns
    -------
    pairs
        (n, 2) nodes of each edge, once.
    sharp
        (n,) True where the two faces make an angle of more than 30 degrees, or there is only one.
    """
    normal = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
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


def _lines(points: FloatArray, pairs: IntArray, colour: str, width: float) -> go.Scatter3d:
    """Draw separate segments as one trace, with gaps between them."""
    path = np.full((len(pairs), 3, 3), np.nan, dtype=np.float32)
    path[:, :2] = points[pairs]
    x, y, z = path.reshape(-1, 3).T
    line = {"color": colour, "width": width}
    return go.Scatter3d(x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip", showlegend=False)


def _skin(points: FloatArray, triangles: IntArray, opacity: float) -> go.Mesh3d:
    x, y, z = points.astype(np.float32).T
    i, j, k = triangles.astype(np.int32).T
    light = {"ambient": 0.65, "diffuse": 0.6, "specular": 0.1, "roughness": 0.9}
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color=_STEEL, opacity=opacity, flatshading=True,
        lighting=light, hoverinfo="skip", name="blades", showlegend=False,
    )  # fmt: skip


def _inside(points: FloatArray, parts: IntArray, low: FloatArray, high: FloatArray) -> IntArray:
    """Keep the triangles or edges whose bounding box meets the box from `low` to `high`."""
    corners = points[parts]
    meets = (corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)
    return np.asarray(parts[meets.all(axis=1)])


def _points(result: Result, position: FloatArray, *, named: bool) -> list[go.Scatter3d]:
    right = np.array(right_side(result))
    names = np.array(result.labels("contact"))
    # names of neighbouring contact lines go above and below their points, so that they do not cover each other
    place = np.empty(len(names), dtype=object)
    for line, members in enumerate(contact_lines(result.labels("contact"))):
        below = line % 2 == 1 or right[members].all()
        place[members] = "bottom center" if below else "top center"
    traces = []
    for side, mask, colour in (("left", ~right, LEFT_SIDE), ("right", right, RIGHT_SIDE)):
        if mask.any():
            x, y, z = position[mask].T
            traces.append(
                go.Scatter3d(
                    x=x, y=y, z=z, mode="markers+text" if named else "markers",
                    name=f"contact with the {side} blade", legendgroup=side, showlegend=named,
                    text=names[mask], textposition=place[mask], textfont={"size": 12, "color": INK},
                    marker={"size": 5 if named else 3, "color": colour},
                    hovertemplate="%{text}: x %{x:.2f}, y %{y:.2f}, z %{z:.2f} mm<extra></extra>",
                )
            )  # fmt: skip
    return traces


def _sections(result: Result, position: FloatArray) -> go.Scatter3d:
    """Join the contact points of each section of the damper: names that end alike."""
    rows: dict[str, list[int]] = {}
    for index, name in enumerate(result.labels("contact")):
        rows.setdefault(name.rpartition(".")[2], []).append(index)
    gap = np.full((1, 3), np.nan)
    paths = [np.vstack([position[[*row, row[0]]], gap]) for row in rows.values() if len(row) > 2]
    x, y, z = np.vstack([*paths, gap]).T
    line = {"color": INK, "width": 3}
    return go.Scatter3d(
        x=x, y=y, z=z, mode="lines", line=line, hoverinfo="skip", name="sections of the damper"
    )


def _neighbourhood(position: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Corners of a box around the contact points."""
    margin = 0.35 * float(np.ptp(position, axis=0).max())
    return position.min(axis=0) - margin, position.max(axis=0) + margin


def _scene(position: FloatArray, points: FloatArray, *, close: bool) -> dict[str, object]:
    """Axes of a view: of all, or of the neighbourhood of the contact points; equal lengths on all axes."""
    if close:
        low, high = _neighbourhood(position)
        eye, size = {"x": 0.32, "y": -1.5, "z": -0.8}, 1.3
    else:
        low, high = points.min(axis=0), points.max(axis=0)
        eye, size = {"x": 1.0, "y": -1.5, "z": 0.55}, 1.65
    span = size * (high - low) / (high - low).max()
    axes = {
        f"{name}axis": {
            "range": [float(a), float(b)], "title": {"text": f"{name} (mm)", "font": {"size": 12}}, "showbackground": False,
            "gridcolor": "#dfe4ea", "zeroline": False, "nticks": 6 if close else 3, "tickfont": {"size": 11},
        }
        for name, a, b in zip("xyz", low, high, strict=True)
    }  # fmt: skip
    return {
        **axes,
        "aspectmode": "manual",
        "aspectratio": dict(zip("xyz", span.tolist(), strict=True)),
        "camera": {"eye": eye, "projection": {"type": "orthographic"}},
        "dragmode": "orbit",
    }


def _caption(result: Result, points: FloatArray, triangles: IntArray) -> str:
    size = np.ptp(points, axis=0)
    caption = (
        f"Skin of the mesh: {counted(len(triangles), 'triangle')} between {len(np.unique(triangles))} corner nodes, "
        f"{number(size[0])} × {number(size[1])} × {number(size[2])}{NARROW_SPACE}mm. Drag to turn, scroll to zoom."
    )
    if result.has("contact_position"):
        n_right = sum(right_side(result))
        n_left = len(right_side(result)) - n_right
        caption += (
            f" The rigid damper is not meshed: it touches the left blade at {n_left} points (blue) and the right "
            f"blade at {n_right} (orange); black triangles join the points of each of its sections."
        )
    return caption


def mesh_picture(result: Result) -> Plot:
    """Show the blades' skin with its mesh, whole and near the damper."""
    key, title = "mesh", "The meshed blades and the contact points of the damper"
    if not result.has("surface_point", "surface_triangle"):
        return absent(key, title, "the skin of the mesh is not in this result")
    points = result.floats("surface_point") * 1e3
    triangles = result.integers("surface_triangle")
    has_contacts = result.has("contact_position")
    position = result.floats("contact_position") * 1e3 if has_contacts else points
    pairs, sharp = edges(points, triangles)
    drawn = pairs if len(pairs) <= _MANY_EDGES else pairs[sharp]
    views = 2 if has_contacts else 1
    figure = make_subplots(
        1, views, specs=[[{"type": "scene"}] * views], horizontal_spacing=0.02,
        subplot_titles=("whole", "near the damper, from below")[:views],
    )  # fmt: skip
    low, high = _neighbourhood(position)
    for view in range(views):
        close = view == 1
        faces = _inside(points, triangles, low, high) if close else triangles
        lines = _inside(points, drawn, low, high) if close else drawn
        figure.add_trace(_skin(points, faces, 0.35 if close else 1.0), row=1, col=view + 1)
        figure.add_trace(_lines(points, lines, "#6f7f91", 1.0), row=1, col=view + 1)
        for trace in _points(result, position, named=close) if has_contacts else []:
            figure.add_trace(trace, row=1, col=view + 1)
    if has_contacts:
        figure.add_trace(_sections(result, position), row=1, col=2)
    styled(figure, 620)
    figure.update_layout(
        scene=_scene(position, points, close=False),
        margin={"l": 0, "r": 0, "t": 40, "b": 10},
        legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 0, "yanchor": "bottom"},
    )
    if has_contacts:
        figure.update_layout(scene2=_scene(position, points, close=True))
    return Plot(key, title, _caption(result, points, triangles), figure)
