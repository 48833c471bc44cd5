"""Figures of the strategy: predicted and real error of first solutions, or an indicator of its own."""

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray
from stickslip.report.figures_response import COMPARED
from stickslip.report.plot import ALARM, INK, Plot, absent, log_ticks, styled
from stickslip.report.quantities import counted, number, percent
from stickslip.report.result import RATIO, Case, Result

_SMALLEST_INDICATOR = 1e-8
_SMALLEST_ERROR = 1e-3  # percent; below it the axis would only show rounding


def _error_traces(figure: go.Figure, result: Result) -> list[Case]:
    """Add predicted errors of all cases (left) and both errors of some (right); return those."""
    hz, asked = result.floats("frequency_hz"), result.alert
    real = result.floats("real_error_percent")
    both = [c for c in result.cases if np.isfinite(real[result.points(c)]).any()][-COMPARED:]
    if not result.is_error:
        both = []

    def add(case: Case, x: FloatArray, y: FloatArray, column: int, **style: object) -> None:
        unit = " %" if result.is_error else ""
        hover = f"{RATIO} = {case.label}<br>%{{x:.2f}} Hz: %{{y:.3g}}{unit}<extra></extra>"
        options = {"legendgroup": "cases", "hovertemplate": hover, **style}
        figure.add_scatter(x=x, y=y, row=1, col=column, **options)

    heading = {"text": f"load ratio {RATIO}"}
    for case in result.cases:
        own = np.flatnonzero(asked.case == case.index)
        at = result.points(case)
        at = at[np.isfinite(real[at])]
        line = {"color": case.colour, "width": 1.6}
        add(
            case,
            asked.hz[own],
            asked.error[own],
            1,
            mode="lines",
            name=case.label,
            line=line,
            legendgrouptitle=heading,
        )
        if case in both:
            mark = {
                "color": case.colour,
                "size": 6,
                "symbol": "circle-open",
                "line": {"width": 1.4},
            }
            add(
                case,
                asked.hz[own],
                asked.error[own],
                2,
                mode="lines",
                name=case.label,
                line=line,
                showlegend=False,
            )
            add(
                case,
                hz[at],
                real[at],
                2,
                mode="markers",
                name="real",
                marker=mark,
                showlegend=False,
            )
    return both


def _error_caption(result: Result) -> str:
    asked = result.alert
    error = asked.error
    above = error > result.threshold
    if result.is_error:
        text = (
            f"The error that <code>{result.selection}</code> predicts of the solution with few harmonics (H = {result.low_name} at least); "
            f"the dashed line is the threshold of {percent(result.threshold)}. {int(above.sum())} of "
            f"{counted(error.size, 'checked point')} lie above it and were asked to repeat with more. "
        )
    else:
        text = (
            f"What <code>{result.selection}</code> compares with its threshold of {result.shown(result.threshold)} (dashed) at the accepted "
            "solution of each frequency: no error, and not to be compared with the indicators of others. "
        )
    worst = int(np.argmax(error))
    ratio = number(float(result.floats("load_ratio")[asked.case[worst]]))
    hz = number(float(asked.hz[worst]), 5)
    text += (
        f"The largest, {result.shown(float(error[worst]))}, is at {hz} Hz for {RATIO} = {ratio}. "
    )
    real = np.isfinite(result.floats("real_error_percent"))
    if real.any() and result.is_error:
        text += (
            f"Right: the real error (open circles), the difference to the accepted solution, where a point was "
            f"solved again ({counted(int(real.sum()), 'point')}; at most {COMPARED} load cases are drawn). "
        )
    floor = _floor(result)
    hidden = int((error < floor).sum())
    if hidden:
        text += f"{counted(hidden, 'point')} below {result.shown(floor)} lie under the axis. "
    endless = int(np.isinf(error).sum())
    if endless:
        text += f"{counted(endless, 'point')} beyond all bounds are not drawn."
    return text


def _floor(result: Result) -> float:
    """Smallest value drawn: an error below is rounding; other indicators may be smaller."""
    return _SMALLEST_ERROR if result.is_error else _SMALLEST_INDICATOR


def errors(result: Result) -> Plot:
    """Predicted and real error against frequency (Gastaldi and Berruti 2017, fig. 6)."""
    key, title = "errors", "Predicted and real error against frequency"
    if not result.is_error:
        title = "The strategy's indicator against frequency"
    error = result.alert.error
    if not error.size:
        return absent(key, title, "no predicted error was computed")
    some_real = result.is_error and np.isfinite(result.floats("real_error_percent")).any()
    titles = ["predicted, all load cases", "predicted (line) and real (circles)"]
    if not result.is_error:
        titles = ["all load cases"]
    columns = 2 if some_real else 1
    figure = make_subplots(
        1, columns, shared_yaxes=True, horizontal_spacing=0.04, subplot_titles=titles[:columns]
    )
    _error_traces(figure, result)
    styled(figure, 430)
    real = result.floats("real_error_percent")
    shown = np.concatenate([error, real if some_real else [], [result.threshold]])
    floor, top = _floor(result), float(shown[np.isfinite(shown)].max())
    figure.add_hline(y=result.threshold, line={"dash": "dash", "color": ALARM, "width": 1.4})
    hz = result.floats("frequency_hz")
    figure.update_xaxes(title_text="frequency (Hz)", range=[float(hz.min()), float(hz.max())])
    ticks = log_ticks(np.array([floor, top]))
    figure.update_yaxes(type="log", range=[np.log10(floor), np.log10(2 * top)], **ticks)
    what = "error (%)" if result.is_error else f"indicator of {result.selection}"
    figure.update_yaxes(title_text=what, col=1)
    return Plot(key, title, _error_caption(result), figure)


def _scatter(
    result: Result, predicted: FloatArray, real: FloatArray, known: npt.NDArray[np.bool_]
) -> go.Figure:
    """Scatter the `known` points, one trace a load case."""
    figure = go.Figure()
    for case in result.cases:
        at = np.flatnonzero(known & (result.integers("case") == case.index))
        if at.size:
            mark = {
                "color": case.colour,
                "size": 7,
                "symbol": "circle-open",
                "line": {"width": 1.5},
            }
            hover = "predicted %{x:.3g} %<br>real %{y:.3g} %<br>%{customdata:.2f} Hz<extra></extra>"
            figure.add_scatter(
                x=predicted[at], y=real[at], mode="markers", name=case.label, marker=mark,
                customdata=result.floats("frequency_hz")[at], hovertemplate=hover,
            )  # fmt: skip
    return figure


def error_scatter(result: Result) -> Plot:
    """Real against predicted error (Gastaldi and Berruti 2017, fig. 7a)."""
    key, title = "error-scatter", "Does the prediction hold? Real against predicted error"
    predicted, real = result.floats("predicted_error_percent"), result.floats("real_error_percent")
    known = np.isfinite(predicted) & np.isfinite(real) & (predicted > 0) & (real > 0)
    if not result.is_error:
        return absent(key, title, f"{result.selection} predicts no error")
    if not known.any():
        return absent(key, title, "no point was solved at both orders")
    figure = _scatter(result, predicted, real, known)
    values = np.concatenate([predicted[known], real[known], [result.threshold]])
    ends = np.array([values.min() / 1.5, values.max() * 1.5])
    dotted = {"color": INK, "width": 1, "dash": "dot"}
    figure.add_scatter(x=ends, y=ends, mode="lines", name="real = predicted", line=dotted)
    styled(figure, 520, legend_title=f"load ratio {RATIO}")
    dash = {"dash": "dash", "color": ALARM, "width": 1.2}
    figure.add_hline(y=result.threshold, line=dash)
    figure.add_vline(x=result.threshold, line=dash)
    axis = {
        "type": "log",
        "range": np.log10(ends).tolist(),
        **log_ticks(values),
    }
    figure.update_xaxes(title_text="predicted error (%)", **axis)
    figure.update_yaxes(title_text="real error (%)", scaleanchor="x", constrain="domain", **axis)
    figure.update_xaxes(constrain="domain")
    larger = int((real[known] > predicted[known]).sum())
    caption = (
        f"{counted(int(known.sum()), 'point')} solved again; on the dotted line the prediction is "
        f"exact. In {larger} of them the real error is larger than predicted. Points below the threshold of "
        f"{percent(result.threshold)} (dashed) were not solved twice, so that errors which the alert missed cannot show here."
    )
    return Plot(key, title, caption, figure)
