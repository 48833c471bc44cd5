"""Figures of the response: curves of all load cases, the alert's errors, the optimisation curves."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.plot import (
    ALARM,
    GRID,
    INK,
    MUTED,
    Plot,
    absent,
    key_marker,
    log_ticks,
    styled,
)
from stickslip.report.quantities import Scale, counted, joined, number, percent, scale_for
from stickslip.report.result import RATIO, Case, Result

_COMPARED = 3  # curves of the most nonlinear cases that stay legible in one panel
_SMALLEST_ERROR = 1e-3  # percent; below it the axis would only show rounding


def accepted_response(result: Result, name: str = "amplitude") -> FloatArray:
    """(point,) response in m/N, NaN where the point did not converge."""
    return np.where(result.converged, result.response(name), np.nan)


def _response_scale(result: Result) -> Scale:
    return scale_for(accepted_response(result), "m/N")


def peak_response(result: Result, case: Case) -> float:
    """Peak amplitude over excitation in m/N; NaN without a peak."""
    return float(result.response()[result.peak(case)]) if result.peak(case) >= 0 else float("nan")


def peak_hz(result: Result, case: Case) -> float:
    """Frequency of the peak in Hz; NaN without a peak."""
    at = result.peak(case)
    return float(result.floats("frequency_hz")[at]) if at >= 0 else float("nan")


def _curve(result: Result, case: Case, scale: Scale) -> go.Scatter:
    at = result.points(case)
    order = result.integers("order")[at]
    error = result.floats("predicted_error_percent")[at]
    high = order > result.low
    return go.Scatter(
        x=result.floats("frequency_hz")[at],
        y=accepted_response(result)[at] * scale.factor,
        mode="lines+markers",
        name=case.label,
        legendgroup="cases",
        legendgrouptitle={"text": f"load ratio {RATIO}"},
        line={"color": case.colour, "width": 1.6},
        marker={
            "symbol": np.where(high, "diamond", "circle-open").tolist(),
            "size": np.where(high, 7.0, 5.5).tolist(),
            "color": case.colour,
            "line": {"width": 1.1, "color": case.colour},
        },
        customdata=np.stack([order, error], axis=1),
        hovertemplate=(
            f"{RATIO} = {case.label}<br>%{{x:.2f}} Hz: %{{y:.4g}} {scale.unit}<br>"
            "H = %{customdata[0]:.0f}, predicted error %{customdata[1]:.2g} %<extra></extra>"
        ),
    )


def _failures(result: Result, scale: Scale) -> go.Scatter:
    """Crosses where points did not converge: at their amplitude if it is known, else at the bottom."""
    at = np.flatnonzero(~result.converged)
    response = result.response() * scale.factor
    accepted = response[result.converged & np.isfinite(response)]
    floor = float(accepted.min()) if accepted.size else 1.0
    return go.Scatter(
        x=result.floats("frequency_hz")[at],
        y=np.where(np.isfinite(response[at]), response[at], floor),
        mode="markers",
        name="did not converge",
        legendgroup="key",
        marker={"symbol": "x", "size": 9, "color": ALARM},
        hovertemplate="not converged<br>%{x:.2f} Hz<extra></extra>",
    )


def _scale_buttons(logarithmic: bool) -> list[dict[str, object]]:
    ticks = {"log": "array", "linear": "auto"}
    buttons = [
        {
            "label": f"{kind} scale",
            "method": "relayout",
            "args": [{"yaxis.type": kind, "yaxis.tickmode": mode, "yaxis.autorange": True}],
        }
        for kind, mode in ticks.items()
    ]
    return [
        {
            "type": "buttons",
            "direction": "right",
            "active": 0 if logarithmic else 1,
            "buttons": buttons,
            "x": 0,
            "xanchor": "left",
            "y": 1.02,
            "yanchor": "bottom",
            "pad": {"t": 0, "b": 4},
            "font": {"size": 11},
            "showactive": True,
            "bordercolor": GRID,
        }
    ]


def _frf_caption(result: Result, scale: Scale) -> str:
    converged = result.converged
    high = converged & (result.integers("order") > result.low)
    hz = result.floats("frequency_hz")
    text = f"First harmonic of {result.output_name} divided by the amplitude of the excitation. "
    if result.peaked:
        ends = (result.peaked[0], result.peaked[-1])[: len(result.peaked)]
        peaks = [
            f"{number(peak_response(result, c) * scale.factor)} {scale.unit} at "
            f"{number(peak_hz(result, c), 5)} Hz for {RATIO} = {c.label}"
            for c in ends
        ]
        text += (
            "The peak goes from " + " to ".join(peaks) + ". "
            if len(ends) > 1
            else f"Peak: {peaks[0]}. "
        )
    text += (
        f"{int(high.sum())} of {counted(int(converged.sum()), 'accepted point')} stand at "
        f"H = {result.high} (filled diamonds)"
    )
    text += (
        f", from {number(hz[high].min(), 4)} to {number(hz[high].max(), 4)} Hz; "
        if high.any()
        else "; "
    )
    text += f"the rest needed H = {result.low} only (open circles)."
    if not converged.all():
        n = counted(int((~converged).sum()), "point")
        text += f" {n} did not converge (crosses); the curve is left open there."
    return text


def frequency_response(result: Result) -> Plot:
    """FRFs of all load cases with the order at which each point was accepted (seed 1, fig. 4b)."""
    key, title = "frf", "Frequency response of all load ratios"
    if not np.isfinite(accepted_response(result)).any():
        return absent(key, title, "no point of the run has converged yet")
    scale = _response_scale(result)
    figure = go.Figure([_curve(result, case, scale) for case in result.cases])
    figure.add_trace(key_marker(f"accepted at H = {result.low}", "circle-open", "key", "points"))
    figure.add_trace(key_marker(f"accepted at H = {result.high}", "diamond", "key"))
    if not result.converged.all():
        figure.add_trace(_failures(result, scale))
    styled(figure, 540)
    figure.update_layout(updatemenus=_scale_buttons(logarithmic=True))
    figure.update_xaxes(title_text="frequency (Hz)")
    ticks = log_ticks(accepted_response(result) * scale.factor)
    figure.update_yaxes(title_text=f"amplitude / force ({scale.unit})", type="log", **ticks)
    return Plot(key, title, _frf_caption(result, scale), figure)


def _low_caption(result: Result, cases: list[Case], low: FloatArray) -> str:
    accepted = accepted_response(result)
    parts = []
    for case in cases:
        at = result.points(case)
        both = at[np.isfinite(low[at]) & np.isfinite(accepted[at])]
        if not both.size:
            continue
        worst = both[np.argmax(np.abs(low[both] / accepted[both] - 1))]
        difference = 100 * (low[worst] / accepted[worst] - 1)
        where = number(float(result.floats("frequency_hz")[worst]), 5)
        parts.append(f"{percent(difference)} at {where} Hz for {RATIO} = {case.label}")
    return (
        f"Solid: accepted with the alert; dashed: H = {result.low} alone. The largest difference of the "
        f"low-order amplitude is {joined(parts)}."
    )


def low_order(result: Result) -> Plot:
    """Low-order against accepted curves of the most nonlinear cases (seed 1, fig. 4a)."""
    key, title = "low-order", f"What H = {result.low} alone would have given"
    if not result.has("amplitude_low"):
        return absent(key, title, "the low-order amplitudes are not in this result")
    low = result.response("amplitude_low")
    accepted = accepted_response(result)
    cases = [c for c in result.cases if np.isfinite(low[result.points(c)]).any()][-_COMPARED:]
    if not cases:
        return absent(key, title, "no load case has a low-order solution")
    scale = _response_scale(result)
    hz = result.floats("frequency_hz")
    figure = go.Figure()
    for case in cases:
        at = result.points(case)
        group = {"legendgroup": case.label, "legendgrouptitle": {"text": f"{RATIO} = {case.label}"}}
        only = at[np.isfinite(low[at])]
        for x, y, name, line in (
            (hz[at], accepted[at], "accepted", {"width": 2}),
            (hz[only], low[only], f"H = {result.low} alone", {"width": 1.6, "dash": "dash"}),
        ):
            line_style = {**line, "color": case.colour}
            values = y * scale.factor
            figure.add_scatter(x=x, y=values, mode="lines", name=name, line=line_style, **group)
    styled(figure, 440)
    figure.update_layout(updatemenus=_scale_buttons(logarithmic=False))
    figure.update_xaxes(title_text="frequency (Hz)")
    ticks = log_ticks(accepted * scale.factor)
    figure.update_yaxes(
        title_text=f"amplitude / force ({scale.unit})", **{**ticks, "tickmode": "auto"}
    )
    return Plot(key, title, _low_caption(result, cases, low), figure)


def _error_traces(figure: go.Figure, result: Result) -> list[Case]:
    """Add predicted errors of all cases (left) and both errors of some (right); return those."""
    hz = result.floats("frequency_hz")
    predicted, real = result.floats("predicted_error_percent"), result.floats("real_error_percent")
    both = [c for c in result.cases if np.isfinite(real[result.points(c)]).any()][-_COMPARED:]

    def add(case: Case, at: IntArray, y: FloatArray, column: int, **style: object) -> None:
        keep = at[np.isfinite(y[at])]
        hover = f"{RATIO} = {case.label}<br>%{{x:.2f}} Hz: %{{y:.3g}} %<extra></extra>"
        options = {"legendgroup": "cases", "hovertemplate": hover, **style}
        figure.add_scatter(x=hz[keep], y=y[keep], row=1, col=column, **options)

    heading = {"text": f"load ratio {RATIO}"}
    for case in result.cases:
        at = result.points(case)
        line = {"color": case.colour, "width": 1.6}
        add(
            case,
            at,
            predicted,
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
            add(case, at, predicted, 2, mode="lines", name=case.label, line=line, showlegend=False)
            add(case, at, real, 2, mode="markers", name="real", marker=mark, showlegend=False)
    return both


def _error_caption(result: Result) -> str:
    error = result.floats("predicted_error_percent")
    known, above = np.isfinite(error), result.flagged
    text = (
        f"The alert's predicted error of the H = {result.low} solution on the output dofs; the dashed line "
        f"is the threshold of {percent(result.threshold)}. {int(above.sum())} of "
        f"{counted(int(known.sum()), 'checked point')} lie above it and were asked to repeat at "
        f"H = {result.high}. "
    )
    worst = int(np.nanargmax(error))
    ratio = number(float(result.floats("load_ratio")[result.integers("case")[worst]]))
    hz = number(float(result.floats("frequency_hz")[worst]), 5)
    text += f"The largest, {percent(float(error[worst]))}, is at {hz} Hz for {RATIO} = {ratio}. "
    real = np.isfinite(result.floats("real_error_percent"))
    if real.any():
        text += (
            f"Right: the real error (open circles), the difference of the two orders, where both were "
            f"solved ({counted(int(real.sum()), 'point')}; at most {_COMPARED} load cases are drawn). "
        )
    hidden = int((error < _SMALLEST_ERROR).sum())
    if hidden:
        text += f"{counted(hidden, 'point')} below {number(_SMALLEST_ERROR)} % lie under the axis."
    return text


def errors(result: Result) -> Plot:
    """Predicted and real error against frequency (seed 1, fig. 6)."""
    key, title = "errors", "The alert: predicted and real error against frequency"
    error = result.floats("predicted_error_percent")
    if not np.isfinite(error).any():
        return absent(key, title, "no predicted error was computed")
    some_real = np.isfinite(result.floats("real_error_percent")).any()
    titles = ("predicted, all load cases", "predicted (line) and real (circles)")
    columns = 2 if some_real else 1
    figure = make_subplots(
        1, columns, shared_yaxes=True, horizontal_spacing=0.04, subplot_titles=titles[:columns]
    )
    _error_traces(figure, result)
    styled(figure, 430)
    real = result.floats("real_error_percent")
    top = float(np.nanmax(np.concatenate([error, real, [result.threshold]])))
    figure.add_hline(y=result.threshold, line={"dash": "dash", "color": ALARM, "width": 1.4})
    hz = result.floats("frequency_hz")
    figure.update_xaxes(title_text="frequency (Hz)", range=[float(hz.min()), float(hz.max())])
    ticks = log_ticks(np.array([_SMALLEST_ERROR, top]), steps=(1,))
    figure.update_yaxes(
        type="log", range=[np.log10(_SMALLEST_ERROR), np.log10(2 * top)], ticksuffix=" %", **ticks
    )
    figure.update_yaxes(title_text="error of the output dofs (%)", col=1)
    return Plot(key, title, _error_caption(result), figure)


def error_scatter(result: Result) -> Plot:
    """Real against predicted error (seed 1, fig. 7a)."""
    key, title = "error-scatter", "Does the prediction hold? Real against predicted error"
    predicted, real = result.floats("predicted_error_percent"), result.floats("real_error_percent")
    known = np.isfinite(predicted) & np.isfinite(real) & (predicted > 0) & (real > 0)
    if not known.any():
        return absent(key, title, "no point was solved at both orders")
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
    missed = int(((real > result.threshold) & (predicted <= result.threshold))[known].sum())
    caption = (
        f"{counted(int(known.sum()), 'point')} solved at both orders; on the dotted line the prediction is "
        f"exact. In {larger} of them the real error is larger than predicted; {missed} "
        f"{'lies' if missed == 1 else 'lie'} in the upper left corner, where the alert would have missed an "
        f"error above {percent(result.threshold)} (dashed)."
    )
    return Plot(key, title, caption, figure)


def _optimum_caption(ratio: FloatArray, peak: FloatArray, hz: FloatArray) -> str:
    best = int(np.nanargmin(peak))
    text = (
        f"Among the ratios computed the damper works best at {RATIO} = {number(ratio[best], 4)}: the peak is "
        f"{percent(100 * peak[best] / np.nanmax(peak))} of the largest one. "
    )
    if best in (0, len(peak) - 1) and len(peak) > 1:
        text += "That is the end of the range: the optimum may lie beyond it. "
    shift = hz[-1] - hz[0]
    text += (
        f"From the most stuck to the most nonlinear case the peak moves by {number(shift)} Hz, "
        f"from {number(hz[0], 5)} to {number(hz[-1], 5)} Hz."
    )
    return text


def optimisation(result: Result) -> Plot:
    """Peak amplitude and frequency against the load ratio (seed 1, fig. 9)."""
    key, title = "optimisation", "Optimisation curves of the damper"
    cases = [c for c in result.peaked if np.isfinite(peak_response(result, c))]
    if len(cases) < 2:
        return absent(key, title, "the curves need the peaks of at least two load cases")
    ratio = np.array([c.ratio for c in cases])
    peak = np.array([peak_response(result, c) for c in cases])
    hz = np.array([peak_hz(result, c) for c in cases])
    scale = scale_for(peak, "m/N")
    figure = make_subplots(1, 2, horizontal_spacing=0.12)
    mark = {"size": 10, "color": [c.colour for c in cases], "line": {"width": 1, "color": "white"}}
    for column, y, unit in ((1, peak * scale.factor, scale.unit), (2, hz, "Hz")):
        hover = f"{RATIO} = %{{x:.4g}}<br>%{{y:.4g}} {unit}<extra></extra>"
        figure.add_scatter(
            x=ratio, y=y, mode="lines+markers", line={"color": MUTED, "width": 1.3}, marker=mark,
            showlegend=False, hovertemplate=hover, row=1, col=column,
        )  # fmt: skip
    styled(figure, 380)
    figure.update_xaxes(
        type="log",
        title_text=f"load ratio {RATIO}",
        tickvals=ratio,
        ticktext=[c.label for c in cases],
    )
    figure.update_yaxes(
        title_text=f"peak amplitude / force ({scale.unit})",
        type="log",
        **log_ticks(peak * scale.factor),
        col=1,
    )
    figure.update_yaxes(title_text="peak frequency (Hz)", col=2)
    return Plot(key, title, _optimum_caption(ratio, peak, hz), figure)
