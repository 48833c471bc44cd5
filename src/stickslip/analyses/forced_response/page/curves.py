"""Figures of the response: curves of all cases, of each engine order, and low against accepted order."""

from collections.abc import Sequence
from html import escape
from textwrap import wrap

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.bifurcations import located, mark_bifurcations
from stickslip.analyses.forced_response.page.many_cases import Panel, extremes, panels
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import OperatingRange, of_cases
from stickslip.analyses.forced_response.summary import amplitude_name, orders_sentence, several_orders
from stickslip.analyses.residual_tractions.page import draw_bands
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import named
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, DASHES, GRID, MUTED, Plot, key_marker, log_ticks, shade, styled
from stickslip.report.quantities import counted, joined, number, percent, scale_for
from stickslip.study.file.case_names import CASE
from stickslip.study.verdict import POINT_LEVELS

COMPARED = 3  # legible curves in one panel
_BUTTONS = {
    "type": "buttons",
    "direction": "right",
    "x": 0,
    "xanchor": "left",
    "y": 1.02,
    "yanchor": "bottom",
    "pad": {"t": 0, "b": 4},
    "font": {"size": 11},
    "showactive": True,
    "bordercolor": GRID,
}


def most(response: Response, size: FloatArray) -> list[ShownCase]:
    """Return the `COMPARED` cases with the largest value of `size` (point,); cases without a finite value are left out."""
    largest = {c: float(np.nanmax(size[response.point_case == c.index], initial=-np.inf)) for c in response.cases}
    known = [c for c in response.cases if np.isfinite(largest[c])]
    chosen = sorted(known, key=lambda c: largest[c])[-COMPARED:]
    return [c for c in response.cases if c in chosen]


def abscissa(response: Response) -> tuple[FloatArray, str, str]:
    """Return abscissa (point,), its name and its unit: frequency, or speed for a response over speed."""
    speed = response.of_points.speed_rpm
    if np.isfinite(speed).any():
        return speed, "speed", "rpm"
    return response.hz, "frequency", "Hz"


def _curve(response: Response, case: ShownCase, name: str) -> go.Scatter:
    at, scale = response.points(case), response.scale
    x, _, unit = abscissa(response)
    high = response.more[at]
    kept = [named(np.flatnonzero(row)) for row in response.kept[at]]
    judged = response.is_error and response.has("own_error_percent")
    error = response.of_points.own_error_percent if judged else response.first_error
    said = [response.shown(float(e)) for e in error[at]]
    reasons = _reasons(response)[at]
    about = "predicted error" if response.is_error else "indicator"
    return go.Scatter(
        x=x[at],
        y=response.accepted[at] * scale.factor,
        mode="markers" if _marked(response) else "lines+markers",
        name=name if len(response.cases) > 1 else "response",
        legendgroup="cases",
        legendgrouptitle={"text": CASE} if len(response.cases) > 1 else None,
        showlegend=len(response.cases) > 1,
        line={"color": case.colour, "width": 1.6},
        marker={
            "symbol": _symbols(response)[at].tolist(),
            "size": np.where(high, 7.0, 5.5).tolist(),
            "color": case.colour,
            "line": {"width": 1.1, "color": case.colour},
        },
        customdata=list(zip(kept, said, response.hz[at], reasons, strict=True)),
        hovertemplate=(
            f"{case.named}{response.blade_at_peak(case)}<br>%{{x:.2f}} {unit}: %{{y:.4g}} {scale.unit}<br>"
            f"H = %{{customdata[0]}}, {about} %{{customdata[1]}}%{{customdata[3]}}<extra></extra>"
        ),
    )


STABLE, UNSTABLE, UNKNOWN = "stable", "unstable", "stability not known"
MARKS = {
    STABLE: {"width": 1.8, "dash": "solid"},
    UNSTABLE: {"width": 1.8, "dash": "dash"},
    UNKNOWN: {"width": 0.7, "dash": "solid"},
}  # line styles as in the literature


def _marked(response: Response) -> bool:
    """Return whether curves are drawn by stability: the result holds a point that is not known to be stable."""
    return bool((response.unstable | response.unknown_stability).any())


def _lines(response: Response, case: ShownCase) -> list[go.Scatter]:
    """Return a curve as lines by stability; none if every point is stable, or stability was not examined."""
    if not _marked(response):
        return []
    at, x = response.points(case), abscissa(response)[0]
    y = response.accepted[at] * response.scale.factor
    off, unknown = response.unstable[at], response.unknown_stability[at]
    dashed = off[1:] | off[:-1]
    thin = (unknown[1:] | unknown[:-1]) & ~dashed
    drawn = []
    for chosen, kind in ((~dashed & ~thin, STABLE), (dashed, UNSTABLE), (thin, UNKNOWN)):
        steps = np.flatnonzero(chosen)
        if not steps.size:
            continue
        gap = np.full(steps.size, np.nan)
        rows = [np.column_stack([own[steps], own[steps + 1], gap]).ravel() for own in (x[at], y)]
        line = {"color": case.colour, **MARKS[kind]}
        drawn.append(
            go.Scatter(
                x=rows[0], y=rows[1], mode="lines", line=line, showlegend=False, hoverinfo="skip", legendgroup="cases"
            )
        )
    return drawn


def _stability_keys(response: Response) -> list[go.Scatter]:
    """Return the legend of the lines of `_lines`."""
    if not _marked(response):
        return []
    known = ~(response.unstable | response.unknown_stability)
    group = "motion" if len(response.cases) > 1 else ""
    there = {STABLE: known.any(), UNSTABLE: response.unstable.any(), UNKNOWN: response.unknown_stability.any()}
    return [
        go.Scatter(x=[None], y=[None], mode="lines", name=kind, legendgroup=group, line={"color": MUTED, **MARKS[kind]})
        for kind, some in there.items()
        if some
    ]


def _symbols(response: Response) -> np.ndarray:
    """Return (point,) symbols: circles for the harmonics of the first passage, diamonds for others; open if doubtful, crosses if wrong."""
    shape = np.where(response.more, "diamond", "circle").astype(object)
    return np.where(response.levels == 2, "x", shape + np.where(response.levels == 1, "-open", ""))


def _reasons(response: Response) -> np.ndarray:
    """Return (point,) hover lines with the reason why a point is not trusted."""
    told = response.verdicts.verdict_reason
    if told is None:
        return np.full(response.hz.size, "", dtype=object)
    reasons = zip(response.levels, map(str, told), strict=True)
    said = [f"<br>{POINT_LEVELS[k]}: {_wrapped(why)}" if why else "" for k, why in reasons]
    return np.array(said, dtype=object)


def _wrapped(text: str) -> str:
    return "<br>".join(escape(line) for line in wrap(text, 80))


def _failures(response: Response, cases: Sequence[ShownCase]) -> go.Scatter:
    """Draw crosses at unconverged points of some cases: at their amplitude if it is known, else at the bottom."""
    at = np.flatnonzero(~response.converged & np.isin(response.point_case, [c.index for c in cases]))
    values = response.response() * response.scale.factor
    good = values[response.converged & np.isfinite(values)]
    floor = float(good.min()) if good.size else 1.0
    x, _, unit = abscissa(response)
    return go.Scatter(
        x=x[at],
        y=np.where(np.isfinite(values[at]), values[at], floor),
        mode="markers",
        name="did not converge",
        legendgroup="key",
        marker={"symbol": "x", "size": 9, "color": ALARM},
        hovertemplate=f"not converged<br>%{{x:.2f}} {unit}<extra></extra>",
    )


def _scale_buttons(*, logarithmic: bool) -> list[dict[str, object]]:
    buttons = []
    for kind, ticks in (("log", "array"), ("linear", "auto")):
        axis = {"yaxis.type": kind, "yaxis.tickmode": ticks, "yaxis.autorange": True}
        buttons.append({"label": f"{kind} scale", "method": "relayout", "args": [axis]})
    return [_BUTTONS | {"active": 0 if logarithmic else 1, "buttons": buttons}]


def _peaks(response: Response) -> str:
    """Name the peaks of the first and the last case."""
    known = [c for c in response.peaked if response.resonates(c)] or response.peaked
    scale, ends = response.scale, (*known[:1], *known[1:][-1:])
    peaks = [
        f"{number(response.peak_response(c) * scale.factor)} {scale.unit} at {response.place(c)}{response.blade_at_peak(c)}{c.where}"
        for c in ends
    ]
    if len(ends) > 1:
        return f"The peak goes from {' to '.join(peaks)}. "
    return f"Peak: {peaks[0]}. " if ends else ""


def _caption(response: Response) -> str:
    converged, (x, _, unit) = response.converged, abscissa(response)
    high = converged & response.more
    over = " divided by the amplitude of the largest harmonic force" if response.per_force else ""
    name = amplitude_name(response.data)
    text = f"{name[0].upper()}{name[1:]} of {response.output_name}{over}. {_peaks(response)}"
    if response.steps:
        text += f"Each motion was found in time by shooting, {response.steps} steps a period."
    elif not response.decides:
        text += f"All points keep the same harmonics (`{response.selection}`)."
    else:
        n = counted(int(converged.sum()), "accepted point")
        ends = [number(float(f), 4) for f in (x[high].min(), x[high].max())] if high.any() else []
        where = f", from {' to '.join(ends)} {unit}" if ends else ""
        text += (
            f"{int(high.sum())} of {n} keep {response.more_name} (diamonds){where}; the rest keep "
            f"H = {response.low_name} (circles)."
        )
    doubtful, wrong = (int(np.sum(converged & (response.levels == k))) for k in (1, 2))
    if doubtful or wrong:
        told = [f"{counted(doubtful, 'doubtful point')} (open symbols)"] * bool(doubtful)
        told += [f"{wrong} wrong (crosses)"] * bool(wrong)
        text += f" Not trusted: {', '.join(told)}."
    if response.unstable.any():
        n = counted(int(response.unstable.sum()), "point")
        text += f" Dashed: {n} whose motion is unstable, so that a machine does not stay there."
    if response.unknown_stability.any():
        n = counted(int(response.unknown_stability.sum()), "point")
        text += f" Thin: {n} whose stability was not examined or not decided."
    if not converged.all():
        n = counted(int((~converged).sum()), "point")
        text += f" {n} did not converge (crosses); the curve is left open there."
    return text


def _in_panels(response: Response, shown: Sequence[Panel]) -> tuple[go.Figure, str]:
    """Draw the curves of each panel; return the figure and the sentence about residual tractions."""
    across = 1 if len(shown) == 1 else 2 if len(shown) <= 4 else 3
    down = -(-len(shown) // across)
    titles = [panel.title for panel in shown] if len(shown) > 1 else None
    shared = {
        "shared_xaxes": True,
        "shared_yaxes": True,
        "horizontal_spacing": 0.03,
        "vertical_spacing": 0.22 / down**1.3,
    }
    figure = make_subplots(down, across, subplot_titles=titles, **shared) if len(shown) > 1 else go.Figure()
    told, named = "", set[tuple[str, str]]()
    for k, panel in enumerate(shown):
        part = go.Figure()
        said = _draw(part, response, panel)
        told = max(told, said, key=len)  # the sentence on a band is longer than the one on equal bounds
        place = {"row": k // across + 1, "col": k % across + 1} if len(shown) > 1 else {}
        for trace in part.data:
            own = str(trace.legendgroup), str(trace.name)
            if own in named:
                trace.showlegend = False
            named.add(own)
            figure.add_trace(trace, **place)
    return figure, told


def _draw(figure: go.Figure, response: Response, panel: Panel) -> str:
    """Draw the cases of a panel with all their marks; return the sentence about residual tractions."""
    banded = draw_bands(figure, response, panel.cases)
    pairs = zip(panel.cases, panel.names, strict=True)
    figure.add_traces([_curve(response, case, name) for case, name in pairs])
    figure.add_traces([line for case in panel.cases for line in _lines(response, case)])
    failed = _failures(response, panel.cases)
    if len(failed.x):
        figure.add_trace(failed)
    over = float(np.nanmean(abscissa(response)[0] / response.hz))
    mark_bifurcations(figure, response, panel.cases, over)
    return banded


def _others(response: Response, named: Sequence[ShownCase]) -> go.Scatter:
    """Return the curves of all other cases as thin lines without names."""
    x, _, unit = abscissa(response)
    rest = [c for c in response.cases if c.index not in {own.index for own in named}]
    rows = [(c, response.points(c)) for c in rest]
    gap = [np.nan]
    return go.Scatter(
        x=np.concatenate([np.append(x[at], gap) for _, at in rows]),
        y=np.concatenate([np.append(response.accepted[at] * response.scale.factor, gap) for _, at in rows]),
        text=[c.named for c, at in rows for _ in range(at.size + 1)],
        mode="lines",
        name=f"{len(rest)} other cases",
        line={"color": "#b4bcc6", "width": 0.8},
        hovertemplate=f"%{{text}}<br>%{{x:.2f}} {unit}: %{{y:.4g}} {response.scale.unit}<extra></extra>",
    )


def _many(response: Response) -> tuple[go.Figure, str]:
    """Draw three cases by name and the others without; return the figure and the sentence about it."""
    chosen = extremes(response) or response.cases[:1]
    figure = go.Figure(_others(response, chosen))
    _draw(figure, response, Panel("", chosen, tuple(c.short for c in chosen)))
    return figure, f" Named: the smallest, the middle and the largest peak of {len(response.cases)} cases."


def _shade_operation(figure: go.Figure, response: Response) -> str:
    """Shade the operating range where all cases have the same; return the sentence for the caption, empty for none."""
    own = [(r.operating_lowest_hz, r.operating_highest_hz) for r in of_cases(OperatingRange, response.data)]
    if not np.isfinite(own).all() or len(set(own)) > 1:
        return ""
    over = float(np.nanmean(abscissa(response)[0] / response.hz))
    shade(figure, over * own[0][0], over * own[0][1])
    return " Shaded: the operating range."


def frequency_response(response: Response) -> Plot | None:
    """Draw the responses of all cases, marked by the harmonics of each point (Gastaldi and Berruti 2017, fig. 4b).

    Many cases are drawn in several panels; still more cases as lines, three of them with names.
    """
    if not np.isfinite(response.accepted).any():
        return None
    scale, shown = response.scale, panels(response)
    figure, told = _in_panels(response, shown) if shown else _many(response)
    figure.add_traces(_stability_keys(response))
    # a single curve needs no groups: its keys stand in one row below a narrow panel
    group, title = ("key", "points") if len(response.cases) > 1 else ("", "")
    if response.decides:
        low, more = response.low_name, response.more_name
        figure.add_trace(key_marker(f"H = {low}", "circle", group, title))
        if np.any(response.converged & response.more):
            figure.add_trace(key_marker(more, "diamond", group))
    for level, word, symbol in ((1, "doubtful", "circle-open"), (2, "wrong", "x")):
        if np.any(response.converged & (response.levels == level)):
            figure.add_trace(key_marker(word, symbol, group))
    _, name, unit = abscissa(response)
    rows = -(-len(shown) // (2 if len(shown) <= 4 else 3)) if len(shown) > 1 else 1
    height = max(480, 150 + 210 * rows)
    styled(figure, height)
    buttons = _scale_buttons(logarithmic=True)
    if len(shown) > 1:  # above the titles of panels
        buttons[0]["y"] = 1 + 30 / height
        figure.update_layout(margin_t=80)
    figure.update_layout(updatemenus=buttons, showlegend=len(figure.data) > 1)
    if len(response.cases) == 1:
        figure.update_layout(legend_traceorder="normal")  # in one row below a narrow panel
    figure.update_xaxes(title_text=f"{name} ({unit})", row=rows if rows > 1 else None)
    told += _shade_operation(figure, response)
    ticks = log_ticks(response.accepted * scale.factor)
    figure.update_yaxes(type="log", **ticks)
    figure.update_yaxes(title_text=f"{response.quantity} ({scale.unit})", col=1 if len(shown) > 1 else None)
    title = "Frequency response of all cases" if len(response.cases) > 1 else "Frequency response"
    return Plot("response", title, _caption(response) + located(response) + told, figure)


def of_each_order(response: Response) -> Plot | None:
    """Draw the amplitude of each engine order over frequency or speed."""
    orders = several_orders(response.data)
    if not orders or not response.fields.driven_amplitude.size:
        return None
    size = response.at_outputs(response.fields.driven_amplitude)
    size = np.where(response.converged[:, None], size, np.nan)
    scale = scale_for(size, response.length)
    x, name, unit = abscissa(response)
    cases = most(response, np.nanmax(size, axis=1, initial=-np.inf))
    figure, said = go.Figure(), []
    for case in cases:
        at = response.points(case)
        for k, m in enumerate(orders):
            figure.add_scatter(
                x=x[at],
                y=size[at, k] * scale.factor,
                mode="lines",
                name=f"engine order {m}",
                legendgroup=str(case.index),
                legendgrouptitle={"text": case.label or None},
                line={"color": case.colour, "width": 1.8, "dash": DASHES[k % len(DASHES)]},
                hovertemplate=f"{case.named}<br>engine order {m}<br>%{{x:.2f}} {unit}: %{{y:.4g}} {scale.unit}<extra></extra>",
            )
            if np.isfinite(size[at, k]).any():
                top = at[int(np.nanargmax(size[at, k]))]
                said.append(
                    f"engine order {m} {number(float(size[top, k]) * scale.factor)} {scale.unit} at {number(float(x[top]), 5)} {unit}{case.where}"
                )
    styled(figure, 440)
    figure.update_xaxes(title_text=f"{name} ({unit})")
    figure.update_yaxes(title_text=f"amplitude ({scale.unit})", type="log", **log_ticks(size * scale.factor))
    text = (
        f"Each engine order in {response.output_name}; the curve above is their norm. {orders_sentence(response.data)}"
    )
    largest = f" Largest: {'; '.join(said)}." if said else ""
    return Plot("orders", "Amplitude of each engine order", text + largest, figure)


def _low_caption(response: Response, cases: list[ShownCase], low: FloatArray) -> str:
    parts = []
    for case in cases:
        at = response.points(case)
        both = at[np.isfinite(low[at]) & np.isfinite(response.accepted[at])]
        if both.size:
            off = low[both] / response.accepted[both] - 1
            worst = int(np.argmax(np.abs(off)))
            hz = number(float(response.hz[both[worst]]), 5)
            parts.append(f"{percent(100 * float(off[worst]))} at {hz} Hz{case.where}")
    return (
        f"Solid lines are accepted, dashed lines have H = {response.low_name} alone. The largest difference of the "
        f"low-order amplitude is {joined(parts)}."
    )


def low_order(response: Response) -> Plot | None:
    """Draw low-order against accepted curves for the cases with the largest difference (Gastaldi and Berruti 2017, fig. 4a)."""
    low, accepted, scale = response.response(response.fields.amplitude_low), response.accepted, response.scale
    cases = most(response, np.abs(low / accepted - 1))
    if not cases or response.steps:
        return None
    figure = go.Figure()
    for case in cases:
        at = response.points(case)
        group = {"legendgroup": str(case.index), "legendgrouptitle": {"text": case.label or None}}
        only = at[np.isfinite(low[at])]
        for x, y, name, line in (
            (at, accepted, "accepted", {"width": 2}),
            (only, low, f"H = {response.low_name} alone", {"width": 1.6, "dash": "dash"}),
        ):
            drawn = {"mode": "lines", "name": name, "line": {**line, "color": case.colour}, **group}
            figure.add_scatter(x=response.hz[x], y=y[x] * scale.factor, **drawn)
    styled(figure, 440)
    figure.update_layout(updatemenus=_scale_buttons(logarithmic=False))
    figure.update_xaxes(title_text="frequency (Hz)")
    ticks = log_ticks(accepted * scale.factor)
    figure.update_yaxes(title_text=f"{response.quantity} ({scale.unit})", **{**ticks, "tickmode": "auto"})
    title = f"What H = {response.low_name} alone would have given"
    return Plot("low_order", title, _low_caption(response, cases, low), figure)
