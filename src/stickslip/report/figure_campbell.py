"""The Campbell diagram: frequencies over speed, engine-order lines, and where they meet."""

import numpy as np
import plotly.graph_objects as go

from stickslip.report.plot import INK, MUTED, Plot, styled
from stickslip.report.quantities import counted, number
from stickslip.report.wheel_result import WheelResult

_DASHES = ("solid", "dash", "dot", "dashdot", "longdash")


def _branches(result: WheelResult) -> list[go.Scatter]:
    rpm, hz = result.floats("speed_rpm"), result.floats("frequency_hz")
    pairs = zip(result.waves, result.colours, strict=True)
    return [
        go.Scatter(
            x=rpm, y=hz[w, :, mode], mode="lines+markers", name=name, legendgroup=name, showlegend=mode == 0,
            # beyond eight waves colours come again, dashed
            line={"color": colour, "width": 1.8, "dash": _DASHES[(w // 8) % len(_DASHES)]}, marker={"size": 4},
            hovertemplate=f"{name}, mode {mode + 1}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
        )
        for w, (name, colour) in enumerate(pairs)
        for mode in range(hz.shape[2])
    ]  # fmt: skip


def _orders(result: WheelResult, top: float) -> list[go.Scatter]:
    """Engine-order lines, cut where they leave the picture, each with its name at the end."""
    last, first = result.floats("speed_rpm").max(), result.floats("speed_rpm").min()
    traces = []
    for index, order in enumerate(result.numbers("engine_orders").astype(int)):
        end = last if order == 0 else min(last, top * 60 / order)
        if end <= first:
            continue
        x = np.array([first, end])
        traces.append(
            go.Scatter(
                x=x, y=order * x / 60, mode="lines+text", text=["", f"EO {order}"], name="engine orders",
                textposition="middle right" if end == last else "top center",
                textfont={"size": 11, "color": MUTED}, legendgroup="orders", showlegend=index == 0,
                line={"color": MUTED, "width": 1, "dash": "dash"}, cliponaxis=False,
                hovertemplate=f"EO {order}: %{{y:.6g}} Hz at %{{x:.5g}} rpm<extra></extra>",
            )
        )  # fmt: skip
    return traces


def _crossings(result: WheelResult) -> go.Scatter:
    names = result.waves
    text = [
        f"EO {order} meets {names[w]}, mode {mode + 1}"
        for order, w, mode in zip(
            result.integers("crossing_engine_order"),
            result.integers("crossing_wave"),
            result.integers("crossing_mode"),
            strict=True,
        )
    ]
    return go.Scatter(
        x=result.floats("crossing_speed_rpm"), y=result.floats("crossing_frequency_hz"), text=text,
        mode="markers", name="crossings",
        marker={"symbol": "circle-open", "size": 12, "color": INK, "line": {"width": 2}},
        hovertemplate="%{text}: %{y:.6g} Hz at %{x:.6g} rpm<extra></extra>",
    )  # fmt: skip


def campbell_diagram(result: WheelResult) -> Plot:
    """Show frequencies against speed with engine-order lines and the crossings that can be excited."""
    hz, rpm = result.floats("frequency_hz"), result.floats("speed_rpm")
    top = 1.06 * float(hz[np.isfinite(hz)].max())
    figure = go.Figure([*_orders(result, top), *_branches(result)])
    n = int(result.data.sizes.get("crossing", 0))
    if n:
        figure.add_trace(_crossings(result))
    styled(figure, 620)
    span = float(np.ptp(rpm))
    figure.update_xaxes(
        title_text="speed (rpm)", range=[rpm.min() - 0.01 * span, rpm.max() + 0.06 * span]
    )
    figure.update_xaxes(exponentformat="none", separatethousands=True)
    figure.update_yaxes(title_text="frequency (Hz), rotating frame", range=[0, 1.04 * top])
    found = f"{counted(n, 'crossing')} marked" if n else "no crossing in the range"
    caption = (
        f"{counted(hz.shape[2], 'mode')} of {counted(len(hz), 'wave')} at {counted(len(rpm), 'speed')} from "
        f"{number(float(rpm.min()), 5)} to {number(float(rpm.max()), 5)} rpm, in the frame that turns with the wheel. "
        f"Dashed: engine orders. Circles: {found}; only those where the engine order excites the nodal diameter of the mode."
    )
    return Plot("campbell", "Campbell diagram", caption, figure)
