"""The blades of a mistuned wheel in motion at the peak: an animation that needs no script of its own."""

import numpy as np
import plotly.graph_objects as go

from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.page.wheel import mistuned
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.report.plot import GRID, Plot, colour, styled
from stickslip.report.quantities import quantity

HUB, TIP = 0.55, 1.0  # radii in the picture
REACH = 0.8  # share of a pitch by which the largest blade leans
FRAMES = 24  # of a period
MILLISECONDS = 60  # a frame


def leaning(motion: ComplexArray, phase: float) -> tuple[FloatArray, FloatArray]:
    """Return the lines (hub, tip, gap for each blade) of blades that lean by their motion at a phase of the period."""
    count = motion.size
    angle = 2 * np.pi * np.arange(count) / count
    lean = np.real(motion * np.exp(1j * phase)) / np.abs(motion).max() * REACH * 2 * np.pi / count
    at = np.column_stack([angle, angle + lean])
    radius = np.array([HUB, TIP])
    gap = np.full((count, 1), np.nan)
    return tuple(np.hstack([radius * f(at), gap]).ravel() for f in (np.cos, np.sin))  # type: ignore[return-value]


def wheel_in_motion(response: Response) -> Plot | None:
    """Draw all blades at the peak, leaning by their motion, over a period."""
    if not mistuned(response):
        return None
    parts = response.values("blade_motion", "case", "blade", "part")
    motion = parts[..., 0] + 1j * parts[..., 1]
    cases = [c for c in response.peaked if np.abs(motion[c.index]).max() > 0]
    if not cases:
        return None
    own = [motion[c.index] * np.exp(-1j * _first(motion[c.index])) for c in cases]

    def lines(phase: float) -> list[go.Scatter]:
        found = []
        for case, one in zip(cases, own, strict=True):
            x, y = leaning(one, phase)
            line = {"color": colour(0), "width": 3}
            found.append(go.Scatter(x=x, y=y, mode="lines", line=line, meta=case.index, hoverinfo="skip"))
        return found

    ring = np.linspace(0, 2 * np.pi, 181)
    hub = go.Scatter(
        x=HUB * np.cos(ring), y=HUB * np.sin(ring), mode="lines", line={"color": GRID, "width": 6}, hoverinfo="skip"
    )
    figure = go.Figure([*lines(0.0), hub])
    moving = list(range(len(cases)))
    figure.frames = [go.Frame(data=lines(2 * np.pi * k / FRAMES), traces=moving, name=str(k)) for k in range(FRAMES)]
    styled(figure, 520)
    play = {"frame": {"duration": MILLISECONDS, "redraw": False}, "transition": {"duration": 0}, "fromcurrent": True}
    names = [str(k) for _ in range(20) for k in range(FRAMES)]
    stop = {"frame": {"duration": 0, "redraw": False}, "mode": "immediate"}
    figure.update_layout(
        showlegend=False,
        updatemenus=[
            {
                "type": "buttons",
                "direction": "left",
                "x": 0,
                "xanchor": "left",
                "y": 1.0,
                "yanchor": "bottom",
                "buttons": [
                    {"label": "play", "method": "animate", "args": [names, play]},
                    {"label": "stop", "method": "animate", "args": [[None], stop]},
                ],
            }
        ],
    )
    hidden = {"visible": False, "range": [-1.1, 1.1]}
    figure.update_xaxes(**hidden)
    figure.update_yaxes(**hidden, scaleanchor="x")
    text = (
        "Each line is a blade, which leans by its motion at the peak; the largest one by eight tenths of the distance to its neighbour. "
        "Blade 0 points to the right, numbers grow anticlockwise, in the sense of rotation. Play runs through twenty periods."
    )
    said = {
        c.index: f"Largest amplitude {quantity(float(np.abs(motion[c.index]).max()), response.length)}." for c in cases
    }
    return Plot("wheel_motion", "The blades in motion", text, figure, said, response.chosen)


def _first(motion: ComplexArray) -> float:
    """Return the phase of the largest blade, which leans most at the beginning."""
    return float(np.angle(motion[int(np.argmax(np.abs(motion)))]))
