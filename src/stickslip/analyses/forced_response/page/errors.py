"""Figures of the selection of harmonics: predicted and real error of first solutions, or the strategy's own indicator."""

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.curves import COMPARED, most
from stickslip.analyses.forced_response.page.response import Response
from stickslip.arrays import FloatArray
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, INK, Plot, log_ticks, ring, styled
from stickslip.report.quantities import counted, number, percent
from stickslip.study.file.case_names import CASE

_SMALLEST_INDICATOR = 1e-8
_SMALLEST_ERROR = 1e-3  # percent; below it the axis would only show rounding


def _error_traces(figure: go.Figure, response: Response) -> None:
    """Draw predicted errors of all cases (left), and predicted and real errors of some (right; in the same panel for a single case)."""
    asked, real = response.alert, response.of_points.real_error_percent
    both = most(response, real) if response.is_error else []

    def add(case: ShownCase, x: FloatArray, y: FloatArray, column: int, **style: object) -> None:
        unit = " %" if response.is_error else ""
        hover = f"{case.named}<br>%{{x:.2f}} Hz: %{{y:.3g}}{unit}<extra></extra>"
        options = {"legendgroup": "cases", "hovertemplate": hover, "showlegend": False, **style}
        figure.add_scatter(x=x, y=y, row=1, col=column, **options)

    named = len(response.cases) > 1
    for case in response.cases:
        own = np.flatnonzero(asked.case == case.index)
        x, y = asked.hz[own], asked.error[own]
        if response.auto:
            along = response.points(case)
            x, y = response.hz[along], response.of_points.own_error_percent[along]
        drawn = {"mode": "lines", "name": case.short, "line": {"color": case.colour, "width": 1.6}}
        add(case, x, y, 1, **drawn, showlegend=named, legendgrouptitle={"text": CASE})
        if case in both:
            column = 1 + named
            at = response.points(case)
            at = at[np.isfinite(real[at])]
            if named:
                add(case, x, y, column, **drawn)
            mark = {"mode": "markers", "name": "real", "marker": ring(case.colour, 6)}
            add(case, response.hz[at], real[at], column, **mark)


def _caption(response: Response) -> str:
    asked, error = response.alert, response.alert.error
    above, real = error > response.threshold, np.isfinite(response.of_points.real_error_percent)
    if response.auto:
        text = f"The error that `{response.selection}` predicts for the harmonics of each accepted solution. The dashed line is the threshold of {percent(response.threshold)}. {_above(response)}"
    elif response.is_error:
        text = (
            f"The error that `{response.selection}` predicts for the solution with few harmonics (H = {response.low_name} at least). The dashed line is the threshold of {percent(response.threshold)}. "
            f"{int(above.sum())} of {counted(error.size, 'checked point')} lie above it and were asked to repeat with more. "
        )
    else:
        text = (
            f"What `{response.selection}` compares with its threshold of {response.shown(response.threshold)} "
            "(dashed) at the accepted solution of each frequency: it is no error, and indicators of other strategies cannot be compared with it. "
        )
    worst = int(np.argmax(error))
    where = response.cases[asked.case[worst]].where
    text += f"The largest, {response.shown(float(error[worst]))}, is at {number(float(asked.hz[worst]), 5)} Hz{where}. "
    if real.any() and response.is_error:
        several = len(response.cases) > 1
        right, some = " (right)" * several, f"; at most {COMPARED} cases are drawn" * several
        text += (
            f"Open circles{right}: the real error, the difference to the accepted solution, where a point was solved again "
            f"({counted(int(real.sum()), 'point')}{some}). "
        )
    floor = _floor(response)
    hidden, endless = int((error < floor).sum()), int(np.isinf(error).sum())
    if hidden:
        text += f"Under the axis, below {response.shown(floor)}: {counted(hidden, 'point')}. "
    return text + (f"Not drawn, beyond all bounds: {counted(endless, 'point')}." if endless else "")


def _above(response: Response) -> str:
    """State the number of solutions with too large a predicted error; a solution with more harmonics overrules it."""
    audit = response.of_points.audit_error_percent
    above = response.converged & (response.of_points.own_error_percent > response.threshold)
    if not above.any():
        return "None lies above it. "
    solved, doubtful = above & np.isfinite(audit), above & np.isin(response.levels, (1, 2))
    told = f"Above it: {counted(int(above.sum()), 'point')}"
    if solved.any():
        most = response.shown(float(audit[solved].max()))
        told += f", {int(solved.sum())} of them solved again with more harmonics, which overrules the prediction; the difference is {most} at most"
    bad = int(doubtful.sum())
    return f"{told}. {bad or 'None'} of them {'are' if bad > 1 else 'is'} doubtful or wrong. "


def _floor(response: Response) -> float:
    """Return the smallest value drawn: smaller errors are rounding, but other indicators may be smaller."""
    return _SMALLEST_ERROR if response.is_error else _SMALLEST_INDICATOR


def _all_rounding(response: Response) -> bool:
    """Whether all errors are below the axis, so that nothing would be drawn."""
    every = np.concatenate([response.alert.error, response.of_points.real_error_percent])
    return response.is_error and not np.any(every >= _SMALLEST_ERROR)


def errors(response: Response) -> Plot | None:
    """Draw predicted and real error against frequency (Gastaldi and Berruti 2017, fig. 6)."""
    error, real = response.alert.error, response.of_points.real_error_percent
    if not error.size or not response.decides or _all_rounding(response):
        return None
    two = response.is_error and bool(np.isfinite(real).any())
    titles = ["predicted (line) and real (circles)"] if two else []
    if two and len(response.cases) > 1:
        titles.insert(0, "predicted, all cases")
    figure = make_subplots(
        1, max(len(titles), 1), shared_yaxes=True, horizontal_spacing=0.04, subplot_titles=titles or None
    )
    _error_traces(figure, response)
    styled(figure, 430)
    shown = np.concatenate([error, real if two else [], [response.threshold]])
    floor, top = _floor(response), float(shown[np.isfinite(shown)].max())
    figure.add_hline(y=response.threshold, line={"dash": "dash", "color": ALARM, "width": 1.4})
    hz = response.hz
    figure.update_xaxes(title_text="frequency (Hz)", range=[float(hz.min()), float(hz.max())])
    ticks = log_ticks(np.array([floor, top]))
    figure.update_yaxes(type="log", range=[np.log10(floor), np.log10(2 * top)], **ticks)
    what = "error (%)" if response.is_error else f"indicator of {response.selection}"
    figure.update_yaxes(title_text=what, col=1)
    title = f"Predicted{' and real' * two} error of first solutions against frequency"
    if response.auto:
        title = "Predicted error of the accepted solutions against frequency"
    if not response.is_error:
        title = "The strategy's indicator against frequency"
    return Plot("errors", title, _caption(response), figure)


def _scatter(response: Response, x: FloatArray, y: FloatArray, known: npt.NDArray[np.bool_]) -> go.Figure:
    """Scatter the `known` points, one trace a case."""
    figure = go.Figure()
    for case in response.cases:
        at = np.flatnonzero(known & (response.point_case == case.index))
        if at.size:
            figure.add_scatter(
                x=x[at],
                y=y[at],
                mode="markers",
                marker=ring(case.colour, 7),
                name=case.short if case.label else "points",
                customdata=response.hz[at],
                hovertemplate="predicted %{x:.3g} %<br>real %{y:.3g} %<br>%{customdata:.2f} Hz<extra></extra>",
            )
    return figure


def error_scatter(response: Response) -> Plot | None:
    """Draw real against predicted error (Gastaldi and Berruti 2017, fig. 7a)."""
    predicted, real = response.of_points.predicted_error_percent, response.of_points.real_error_percent
    known = np.isfinite(predicted) & np.isfinite(real) & (predicted > 0) & (real > 0)
    if not response.is_error or not known.any():
        return None
    figure = _scatter(response, predicted, real, known)
    values = np.concatenate([predicted[known], real[known], [response.threshold]])
    ends = np.array([values.min() / 1.5, values.max() * 1.5])
    dotted = {"color": INK, "width": 1, "dash": "dot"}
    figure.add_scatter(x=ends, y=ends, mode="lines", name="real = predicted", line=dotted)
    styled(figure, 520, legend_title=CASE if len(response.cases) > 1 else "")
    dash = {"dash": "dash", "color": ALARM, "width": 1.2}
    figure.add_hline(y=response.threshold, line=dash)
    figure.add_vline(x=response.threshold, line=dash)
    axis = {"type": "log", "range": np.log10(ends).tolist(), "constrain": "domain"} | log_ticks(values)
    figure.update_xaxes(title_text="predicted error (%)", **axis)
    figure.update_yaxes(title_text="real error (%)", scaleanchor="x", **axis)
    larger = int((real[known] > predicted[known]).sum())
    caption = (
        f"{counted(int(known.sum()), 'point')} solved again; on the dotted line the prediction is "
        f"exact. In {larger} of them the real error is larger than predicted. Points below the threshold of "
        f"{percent(response.threshold)} (dashed) were not solved twice, so that errors which the alert missed cannot show here."
    )
    title = "Does the prediction hold? Real against predicted error"
    return Plot("error_scatter", title, caption, figure)
