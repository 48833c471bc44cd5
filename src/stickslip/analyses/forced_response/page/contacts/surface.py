"""Contact surfaces seen along their normal: where they slip, and where they lift off."""

from collections.abc import Mapping

import numpy as np
import plotly.graph_objects as go
from plotly.colors import sample_colorscale
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.contacts.contact import states
from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray, IntArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import MUTED, STATE_COLOURS, Plot, styled
from stickslip.report.quantities import joined, percent
from stickslip.report.tiles import outlines, patches

MIN_MAP_POINTS = 9  # points that make a surface worth a map
THICK = 0.05  # second extent over the first, below which points stand in a line
MOST_BESIDE = 3  # maps beside each other
STEPS = 10  # of the colours of patches, from those that stick to those that slip all the time
_SCALE = [[0.0, STATE_COLOURS[0]], [0.5, "#f4efe6"], [1.0, STATE_COLOURS[1]]]  # from stick to slip


def surface_map(response: Response) -> Plot | None:
    """Draw the fraction of the cycle during which each point of a contact surface slips."""
    needed = ("peak_state", "contact_position", "contact_frame")
    cases = response.peaked if response.has(*needed) else ()
    surfaces = _surfaces(response) if cases else {}
    if not surfaces:
        return None
    width = min(len(surfaces), MOST_BESIDE)
    height = -(-len(surfaces) // width)
    figure = make_subplots(height, width, subplot_titles=list(surfaces), horizontal_spacing=0.1)
    names = np.array(response.labels("contact"))
    rims = {group: _rims(response, points) for group, (points, _) in surfaces.items()}
    for case in cases:
        slips, opens = _shares(response, case)
        for k, (group, (points, at)) in enumerate(surfaces.items()):
            filled = _patches(rims[group], slips)
            dots = _map(at, names[points], slips[points], opens[points], small=bool(filled))
            for trace in (*filled, dots):
                figure.add_trace(trace.update(meta=case.index), row=k // width + 1, col=k % width + 1)
    styled(figure, 90 + 330 * height)
    figure.update_xaxes(title_text="along t (mm)")
    figure.update_yaxes(title_text="along w (mm)", col=1)
    bar = {"title": {"text": "slips (%)"}, "len": 0.9, "thickness": 12, "outlinewidth": 0}
    figure.update_layout(showlegend=False, coloraxis={"colorscale": _SCALE, "cmin": 0, "cmax": 100, "colorbar": bar})
    patched = "what belongs to them, as far as their areas go, " if any(rims.values()) else ""
    caption = (
        f"Contact points at their places, {patched}seen along the normal; colours tell for which share of the cycle at the peak a "
        "point slips in either direction. A dark rim marks points that lift off in the cycle."
    )
    captions = {c.index: _caption(response, c, surfaces) for c in cases}
    return Plot("surface", "Where the contacts slip", caption, figure, captions, response.chosen)


def _surfaces(response: Response) -> dict[str, tuple[IntArray, FloatArray]]:
    """Return the contacts whose points span a surface: their points, and positions (p, 2) along t and w from the centre, mm."""
    position, frame = (response.values(f"contact_{name}") for name in ("position", "frame"))
    found = {}
    for group, members in response.groups.items():
        points = np.array(members, dtype=np.int64)
        if points.size < MIN_MAP_POINTS or not np.isfinite(position[points]).all():
            continue
        arm = position[points] - position[points].mean(axis=0)
        extent = np.linalg.svd(arm, compute_uv=False)
        if extent[1] > THICK * extent[0]:
            # the frame of the first point: those of a curved surface turn with it
            found[group] = points, 1e3 * arm @ frame[points[0]][:, :2]
    return found


def _shares(response: Response, case: ShownCase) -> tuple[FloatArray, FloatArray]:
    """Return the percentage of the cycle during which each contact point slips and is open."""
    state = states(response, case)
    slips, opens = (100.0 * (state == k).any(axis=1).mean(axis=1) for k in (1, 2))
    return slips, opens


def _rims(response: Response, points: IntArray) -> dict[int, FloatArray]:
    """Return the corners (k, 2) of a contact's patches in the plane of `_surfaces`, mm; none without areas."""
    if not response.has("contact_area"):
        return {}
    position, frame, area = (response.values(f"contact_{n}") for n in ("position", "frame", "area"))
    middle, plane = position[points].mean(axis=0), frame[points[0]][:, :2]
    found = patches(position, frame, area, points.tolist())
    return {k: 1e3 * (corners - middle) @ plane for k, corners in found.items()}


def _patches(rims: Mapping[int, FloatArray], slips: FloatArray) -> list[go.Scatter]:
    """Draw the patches of a contact, with one trace for patches of similar slip."""
    steps: dict[int, list[int]] = {}
    for k in rims:
        steps.setdefault(int(np.ceil(STEPS * slips[k] / 100.0)), []).append(k)
    drawn = []
    for step, own in sorted(steps.items()):
        x, y = outlines([rims[k] for k in own]).astype(np.float32).T
        (fill,) = sample_colorscale(_SCALE, [step / STEPS])
        drawn.append(
            go.Scatter(
                x=x,
                y=y,
                mode="lines",
                fill="toself",
                fillcolor=fill,
                line={"width": 0.5, "color": MUTED},
                hoverinfo="skip",
                showlegend=False,
            )
        )
    return drawn


def _map(at: FloatArray, names: FloatArray, slips: FloatArray, opens: FloatArray, *, small: bool) -> go.Scatter:
    lifted = opens > 0
    return go.Scatter(
        x=at[:, 0].astype(np.float32),
        y=at[:, 1].astype(np.float32),
        mode="markers",
        showlegend=False,
        marker={
            "size": 5 if small else 7,
            "color": slips.astype(np.float32),
            "coloraxis": "coloraxis",
            "line": {"color": MUTED, "width": np.where(lifted, 1.8, 0.4)},
        },
        customdata=np.column_stack([names, slips.round(), opens.round()]),
        hovertemplate="%{customdata[0]}<br>slips %{customdata[1]} %, open %{customdata[2]} %<extra></extra>",
    )


def _caption(response: Response, case: ShownCase, surfaces: dict[str, tuple[IntArray, FloatArray]]) -> str:
    slips, opens = _shares(response, case)
    said = []
    for group, (points, _) in surfaces.items():
        share, lifted = (percent(100.0 * float(np.mean(of[points] > 0))) for of in (slips, opens))
        lifts = f", {lifted} lift off" if opens[points].any() else ""
        said.append(f"{share} of the points of {group} slip{lifts}")
    return f"In the cycle {joined(said)}."
