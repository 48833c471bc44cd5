"""Figures of the response: curves of all load cases, low against accepted order, the optimisation curves."""

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.arrays import FloatArray
from stickslip.report.plot import (
    ALARM,
    GRID,
    MUTED,
    Plot,
    absent,
    key_marker,
    log_ticks,
    styled,
)
from stickslip.report.quantities import Scale, counted, joined, number, percent, scale_for
from stickslip.report.result import RATIO, Case, Result
from stickslip.study.harmonics_table import named

COMPARED = 3  # curves of the most nonlinear cases that stay legible in one panel


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
    high = result.more[at]
    kept = [named(np.flatnonzero(row)) for row in result.kept[at]]
    error = result.floats("predicted_error_percent" if result.is_error else "indicator")[at]
    said = [result.shown(float(e)) for e in error]
    about = "predicted error" if result.is_error else "indicator"
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
        customdata=list(zip(kept, said, strict=True)),
        hovertemplate=(
            f"{RATIO} = {case.label}<br>%{{x:.2f}} Hz: %{{y:.4g}} {scale.unit}<br>"
            f"H = %{{customdata[0]}}, {about} %{{customdata[1]}}<extra></extra>"
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
    high = converged & result.more
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
        f"{int(high.sum())} of {counted(int(converged.sum()), 'accepted point')} keep "
        f"{result.more_name} (filled diamonds)"
    )
    text += (
        f", from {number(hz[high].min(), 4)} to {number(hz[high].max(), 4)} Hz; "
        if high.any()
        else "; "
    )
    text += f"the rest keep H = {result.low_name} (open circles)."
    if not converged.all():
        n = counted(int((~converged).sum()), "point")
        text += f" {n} did not converge (crosses); the curve is left open there."
    return text


def frequency_response(result: Result) -> Plot:
    """FRFs of all load cases with the order at which each point was accepted (Gastaldi and Berruti 2017, fig. 4b)."""
    key, title = "frf", "Frequency response of all load ratios"
    if not np.isfinite(accepted_response(result)).any():
        return absent(key, title, "no point of the run has converged yet")
    scale = _response_scale(result)
    figure = go.Figure([_curve(result, case, scale) for case in result.cases])
    figure.add_trace(
        key_marker(f"accepted with H = {result.low_name}", "circle-open", "key", "points")
    )
    figure.add_trace(key_marker(f"accepted with {result.more_name}", "diamond", "key"))
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
        f"Solid: accepted; dashed: H = {result.low_name} alone, where that was solved. The largest difference of the "
        f"low-order amplitude is {joined(parts)}."
    )


def low_order(result: Result) -> Plot:
    """Low-order against accepted curves of the most nonlinear cases (Gastaldi and Berruti 2017, fig. 4a)."""
    key, title = "low-order", f"What H = {result.low_name} alone would have given"
    if not result.has("amplitude_low"):
        return absent(key, title, "the low-order amplitudes are not in this result")
    low = result.response("amplitude_low")
    accepted = accepted_response(result)
    cases = [c for c in result.cases if np.isfinite(low[result.points(c)]).any()][-COMPARED:]
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
            (hz[only], low[only], f"H = {result.low_name} alone", {"width": 1.6, "dash": "dash"}),
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
    """Peak amplitude and frequency against the load ratio (Gastaldi and Berruti 2017, fig. 9)."""
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
