"""Mode shapes that turn in the page: one sector or the wheel, at any phase, coloured by displacement.

The page holds the complex shapes of one sector on a coarse skin, whose points belong to the fine one. The script
``assets/shapes.js`` expands them to the wheel.
"""

import base64
import json

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from markupsafe import Markup, escape

from stickslip.analyses.pictures.skin import edges, segments, surface
from stickslip.analyses.waves.page.resonant import MODE, WAVE
from stickslip.analyses.waves.page.waves import Waves
from stickslip.analyses.waves.records import Modes, contact_state, hertz
from stickslip.arrays import FloatArray, IntArray
from stickslip.model.mesh.coarse import coarse_skin
from stickslip.report.plot import FONT, MUTED, Plot, styled
from stickslip.report.quantities import counted

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
        "points": _text(points.astype("<f4")),
        "faces": _text(faces.astype("<i4")),
        "wheelPoints": _text(wheel.astype("<i4")),
        "wheelFaces": _text(wheel_faces.astype("<i4")),
        "waveNumbers": [w.wave_number for w in found.waves],
        "waves": [
            f"{name}, {w.kind} wave" if view.sectors > 1 else name
            for name, w in zip(view.waves, found.waves, strict=True)
        ],
        "hertz": [[f"{f:.6g}" for f in row[:modes]] for row in hertz(found)],
        "shapes": [[_text(s) for s in row] for row in whole],
    }


def _outside_of_wheel(view: Waves[Modes], faces: IntArray) -> IntArray:
    """Remove the faces between neighbouring sectors, if the skin is not yet coarse."""
    cut = view.found.skin_cut
    return faces[cut == 0] if cut is not None and len(cut) == len(faces) and view.sectors > 1 else faces


def _unit(direction: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(direction))
    return direction / length if direction.size == 3 and length > 0 else np.array([0.0, 0.0, 1.0])


def _text(values: npt.NDArray[np.generic]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


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
