"""The Campbell diagram: frequencies over speed, engine-order lines, and where they meet."""

import numpy as np
import plotly.graph_objects as go

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import INK, MUTED, Plot, styled
from stickslip.report.quantities import counted, number
from stickslip.report.wheel_result import WheelResult

_DASHES = ("solid", "dot", "dashdot", "longdash")
# a wave has its own, so that a print without colours can be read
_SYMBOLS = ("circle", "square", "diamond", "triangle-up", "x", "triangle-down", "star", "cross")
_BAND = 0.02  # half the height of a label, and its distance from the line, as a share of the picture's height


def _label_places(hz: FloatArray, top: float) -> tuple[IntArray, IntArray]:
    """Return where each line (wave, mode) is labelled: index of the speed, and 1 above or -1 below.

    It is the first speed at which neither another line nor another label is in the way.
    """
    speed, side = (np.zeros((hz.shape[0], hz.shape[2]), dtype=np.int64) for _ in range(2))
    side += 1
    taken: list[tuple[int, float]] = []
    for w, mode in np.ndindex(*speed.shape):
        for s, way in ((s, way) for s in range(hz.shape[1]) for way in (1, -1)):
            middle = float(hz[w, s, mode]) + way * _BAND * top
            others = np.delete(hz[:, s].ravel(), w * hz.shape[2] + mode)
            placed = np.array([y for other, y in taken if other == s])
            free = np.all(np.abs(others - middle) > _BAND * top)
            if free and np.all(np.abs(placed - middle) > 2 * _BAND * top):
                speed[w, mode], side[w, mode] = s, way
                taken.append((s, middle))
                break
    return speed, side


def _branches(result: WheelResult) -> list[go.Scatter]:
    rpm, hz = result.floats("speed_rpm"), result.floats("frequency_hz")
    pairs = zip(result.waves, result.colours, strict=True)
    at, side = _label_places(hz, float(np.nanmax(hz)))
    return [
        go.Scatter(
            x=rpm, y=hz[w, :, mode], mode="lines+markers+text", name=name, legendgroup=name, showlegend=mode == 0,
            text=[f"{name}, {mode + 1}" if s == at[w, mode] else "" for s in range(len(rpm))],
            textposition=f"{'top' if side[w, mode] > 0 else 'bottom'} {'center' if at[w, mode] else 'right'}", textfont={"size": 10, "color": colour},
            # beyond eight waves colours come again, dashed
            line={"color": colour, "width": 1.8, "dash": _DASHES[(w // 8) % len(_DASHES)]},
            marker={"size": 6, "symbol": _SYMBOLS[w % len(_SYMBOLS)]},
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


def _not_shown(result: WheelResult, top: float) -> str:
    """Say which engine orders leave the picture, and from where on their crossings are not known."""
    last, first = float(result.floats("speed_rpm").max()), float(result.floats("speed_rpm").min())
    orders = [int(m) for m in result.numbers("engine_orders")]
    cut = [f"EO {m}" for m in orders if first < top * 60 / m < last]
    outside = [f"EO {m}" for m in orders if top * 60 / m <= first]
    text = f" Cut at the upper edge of the picture: the lines of {', '.join(cut)}." if cut else ""
    if outside:
        text += f" Above the picture at all speeds: {', '.join(outside)}."
    if result.has("unfollowed_engine_order", "unfollowed_from_rpm"):
        named = [
            f"EO {order} from {rpm:.4g} rpm"
            for order, rpm in zip(
                result.integers("unfollowed_engine_order"),
                result.floats("unfollowed_from_rpm"),
                strict=True,
            )
        ]
        text += (
            " <b>Not judged</b>, because they lie above the followed modes of the nodal diameters that they excite: "
            f"{', '.join(named)}."
        )
    return text


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
        f"Lines are labelled with wave and mode. Thin and dashed: engine orders. Circles: {found}; only those where the engine "
        f"order excites the nodal diameter of the mode.{_not_shown(result, top)}"
    )
    return Plot("campbell", "Campbell diagram", caption, figure)
