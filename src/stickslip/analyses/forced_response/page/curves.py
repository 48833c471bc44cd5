"""Figures of the response: curves of all cases, low against accepted order, the optimisation curves and the working range of the friction."""

from html import escape
from textwrap import wrap

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.bifurcations import mark_bifurcations
from stickslip.analyses.forced_response.page.contacts.tractions import draw_bands, draw_peak_bands
from stickslip.analyses.forced_response.page.measured import measured_of
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.summary import amplitude_name
from stickslip.analyses.forced_response.verdicts.working_range import MIN_PEAKS, TITLE, range_lines, working_ranges
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import named
from stickslip.report.cases import ShownCase, first_number
from stickslip.report.content import Words
from stickslip.report.plot import ALARM, GRID, MUTED, Plot, key_marker, log_ticks, styled
from stickslip.report.quantities import counted, joined, number, percent, scale_for
from stickslip.study.verdict import POINT_LEVELS


def where_friction_works(response: Response) -> Words | None:
    """State the values at which all contacts stick, friction works, or contacts slide freely."""
    lines = range_lines(response.data)
    if not lines:
        return None
    return Words(heading=TITLE, items=lines)


def what_is_needed(response: Response) -> Words | None:
    """State the values missing for an optimisation curve, if a number is varied with too few of them."""
    key, n = first_number(response.data)[0], len(response.cases)
    if not key or n >= MIN_PEAKS:
        return None
    text = f"Curves over {key}, and where friction works, need {MIN_PEAKS} values or more; there are {n}. Add values to [vary]."
    return Words((text,))


def shade_working_range(figure: go.Figure, response: Response, *, logarithmic: bool) -> str:
    """Shade the values at which friction works; return the sentence for the caption, empty for none."""
    ranges = working_ranges(response.data)
    stretches = ranges[0].stretches if len(ranges) == 1 and ranges[0].judged else []
    if not stretches:
        return ""
    values = np.unique([p.value for p in ranges[0].peaks])
    middles = np.sqrt(values[1:] * values[:-1]) if logarithmic else (values[1:] + values[:-1]) / 2
    edges = np.array([values[0], *middles, values[-1]])
    for stretch in stretches:
        at = np.searchsorted(values, sorted(p.value for p in stretch))
        figure.add_vrect(
            x0=float(edges[at[0]]),
            x1=float(edges[at[-1] + 1]),
            fillcolor=GRID,
            opacity=0.6,
            line_width=0,
            layer="below",
        )
    return " Shaded, to halfway to the neighbouring cases: where friction works."


COMPARED = 3  # curves that stay legible in one panel
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
    if response.has("speed_rpm"):
        return response.floats("speed_rpm"), "speed", "rpm"
    return response.hz, "frequency", "Hz"


def _curve(response: Response, case: ShownCase) -> go.Scatter:
    at, scale = response.points(case), response.scale
    x, _, unit = abscissa(response)
    high = response.more[at]
    kept = [named(np.flatnonzero(row)) for row in response.kept[at]]
    first = "predicted_error_percent" if response.is_error else "indicator"
    own = "own_error_percent" if response.is_error and response.has("own_error_percent") else first
    error = response.floats(own)[at]
    said = [response.shown(float(e)) for e in error]
    reasons = _reasons(response)[at]
    about = "predicted error" if response.is_error else "indicator"
    return go.Scatter(
        x=x[at],
        y=response.accepted[at] * scale.factor,
        mode="markers" if response.unstable[at].any() else "lines+markers",
        name=case.short if len(response.cases) > 1 else "response",
        legendgroup="cases",
        legendgrouptitle={"text": response.varied} if len(response.cases) > 1 else None,
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


def _lines(response: Response, case: ShownCase) -> list[go.Scatter]:
    """Return a curve as two lines, the second one dashed along unstable points; none without points."""
    at, x = response.points(case), abscissa(response)[0]
    off, y = response.unstable[at], response.accepted[at] * response.scale.factor
    if not off.any():
        return []
    dashed = off[1:] | off[:-1]
    drawn = []
    for chosen, dash in ((~dashed, "solid"), (dashed, "dash")):
        steps = np.flatnonzero(chosen)
        gap = np.full(steps.size, np.nan)
        rows = [np.column_stack([own[steps], own[steps + 1], gap]).ravel() for own in (x[at], y)]
        line = {"color": case.colour, "width": 1.6, "dash": dash}
        drawn.append(
            go.Scatter(
                x=rows[0], y=rows[1], mode="lines", line=line, showlegend=False, hoverinfo="skip", legendgroup="cases"
            )
        )
    return drawn


def _symbols(response: Response) -> np.ndarray:
    """Return (point,) symbols: circles for the harmonics of the first passage, diamonds for others; open if doubtful, crosses if wrong."""
    shape = np.where(response.more, "diamond", "circle").astype(object)
    return np.where(response.levels == 2, "x", shape + np.where(response.levels == 1, "-open", ""))


def _reasons(response: Response) -> np.ndarray:
    """Return (point,) hover lines with the reason why a point is not trusted."""
    if not response.has("verdict_reason"):
        return np.full(response.hz.size, "", dtype=object)
    reasons = zip(response.levels, response.labels_of("verdict_reason"), strict=True)
    said = [f"<br>{POINT_LEVELS[k]}: {_wrapped(why)}" if why else "" for k, why in reasons]
    return np.array(said, dtype=object)


def _wrapped(text: str) -> str:
    return "<br>".join(escape(line) for line in wrap(text, 80))


def _failures(response: Response) -> go.Scatter:
    """Draw crosses at unconverged points: at their amplitude if it is known, else at the bottom."""
    at = np.flatnonzero(~response.converged)
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
        f"{number(response.peak_response(c) * scale.factor)} {scale.unit} at {number(response.peak_hz(c), 5)} Hz{response.blade_at_peak(c)}{c.where}"
        for c in ends
    ]
    if len(ends) > 1:
        return f"The peak goes from {' to '.join(peaks)}. "
    return f"Peak: {peaks[0]}. " if ends else ""


def _caption(response: Response) -> str:
    converged, hz = response.converged, response.hz
    high = converged & response.more
    over = " divided by the amplitude of the excitation" if response.per_force else ""
    name = amplitude_name(response.data)
    text = f"{name[0].upper()}{name[1:]} of {response.output_name}{over}. {_peaks(response)}"
    if not response.decides:
        text += f"All points keep the same harmonics (`{response.selection}`)."
    else:
        n = counted(int(converged.sum()), "accepted point")
        ends = [number(float(f), 4) for f in (hz[high].min(), hz[high].max())] if high.any() else []
        where = f", from {' to '.join(ends)} Hz" if ends else ""
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
    if not converged.all():
        n = counted(int((~converged).sum()), "point")
        text += f" {n} did not converge (crosses); the curve is left open there."
    return text


def frequency_response(response: Response) -> Plot | None:
    """Draw the responses of all cases, marked by the harmonics of each point (Gastaldi and Berruti 2017, fig. 4b)."""
    if not np.isfinite(response.accepted).any():
        return None
    scale = response.scale
    figure = go.Figure()
    banded = draw_bands(figure, response)
    figure.add_traces([_curve(response, case) for case in response.cases])
    figure.add_traces([line for case in response.cases for line in _lines(response, case)])
    if response.decides:
        low, more = response.low_name, response.more_name
        figure.add_trace(key_marker(f"H = {low}", "circle", "key", "points"))
        figure.add_trace(key_marker(more, "diamond", "key"))
    for level, word, symbol in ((1, "doubtful", "circle-open"), (2, "wrong", "x")):
        if np.any(response.converged & (response.levels == level)):
            figure.add_trace(key_marker(word, symbol, "key"))
    if not response.converged.all():
        figure.add_trace(_failures(response))
    x, name, unit = abscissa(response)
    marked = mark_bifurcations(figure, response, float(np.nanmean(x / response.hz)))
    styled(figure, 540)
    buttons = _scale_buttons(logarithmic=True)
    figure.update_layout(updatemenus=buttons, showlegend=len(figure.data) > 1)
    figure.update_xaxes(title_text=f"{name} ({unit})")
    ticks = log_ticks(response.accepted * scale.factor)
    figure.update_yaxes(title_text=f"{response.quantity} ({scale.unit})", type="log", **ticks)
    title = "Frequency response of all cases" if len(response.cases) > 1 else "Frequency response"
    return Plot("response", title, _caption(response) + marked + banded, figure)


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
        f"Solid: accepted; dashed: H = {response.low_name} alone, where that was solved. The largest difference of the "
        f"low-order amplitude is {joined(parts)}."
    )


def low_order(response: Response) -> Plot | None:
    """Draw low-order against accepted curves for the cases with the largest difference (Gastaldi and Berruti 2017, fig. 4a)."""
    if not response.has("amplitude_low"):
        return None
    low, accepted, scale = response.response("amplitude_low"), response.accepted, response.scale
    cases = most(response, np.abs(low / accepted - 1))
    if not cases:
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


def _optimum_caption(response: Response, cases: list[ShownCase]) -> str:
    peak, hz = ([of(c) for c in cases] for of in (response.peak_response, response.peak_hz))
    within = [response.resonates(c) for c in cases]
    best = int(np.argmin(np.where(within, peak, np.inf) if any(within) else peak))
    text = (
        f"Among the cases computed the peak is smallest{cases[best].where}: "
        f"{percent(100 * peak[best] / max(peak))} of the largest one. "
    )
    if best in (0, len(peak) - 1):
        text += "No value beyond it was computed: the optimum may lie there. "
    if not all(within):
        ends = joined([c.label for c, inside in zip(cases, within, strict=True) if not inside])
        text += f"The largest amplitude stands at the end of the sweep, which is no resonance: {ends}. "
    known = [k for k, inside in enumerate(within) if inside]
    if len(known) < 2:
        return text
    a, b = known[0], known[-1]
    return text + (
        f"Between the values the peak moves by {number(abs(hz[b] - hz[a]))} Hz, "
        f"from {number(hz[a], 5)} Hz{cases[a].where} to {number(hz[b], 5)} Hz{cases[b].where}."
    )


def _families(cases: list[ShownCase], key: str) -> dict[str, list[ShownCase]]:
    """Group cases by all varied keys except `key`; each group is a curve."""
    found: dict[str, list[ShownCase]] = {}
    for case in cases:
        others = ", ".join(t for t in case.label.split(", ") if not t.startswith(f"{key} = "))
        found.setdefault(others, []).append(case)
    return found


def optimisation(response: Response) -> Plot | None:
    """Draw peak amplitude and frequency against the first varied number (Gastaldi and Berruti 2017, fig. 9)."""
    key = first_number(response.data)[0]
    known = (c for c in response.peaked if np.isfinite(response.peak_response(c)))
    cases = sorted(known, key=lambda c: c.value)
    measured = measured_of(response, key)
    if not key or len(cases) < (1 if measured else MIN_PEAKS):
        return None
    peak = {c: response.peak_response(c) for c in cases}
    scale = scale_for(np.array(list(peak.values())), response.unit)
    figure, families = make_subplots(1, 2, horizontal_spacing=0.12), _families(cases, key)
    banded = [draw_peak_bands(figure, response, own, scale.factor) for own in families.values()]
    for name, family in families.items():
        edge = {"width": 1, "color": "white"}
        mark = {"size": 10, "color": [c.colour for c in family], "line": edge}
        curves = ((scale.unit, [peak[c] * scale.factor for c in family]), ("Hz", [response.peak_hz(c) for c in family]))
        for column, (unit, y) in enumerate(curves, 1):
            figure.add_scatter(
                x=[c.value for c in family],
                y=y,
                mode="lines+markers",
                line={"color": MUTED, "width": 1.3},
                marker=mark,
                name=name,
                showlegend=column == 1 and len(families) > 1,
                text=[c.named for c in family],
                hovertemplate=f"%{{text}}<br>%{{y:.4g}} {unit}<extra></extra>",
                row=1,
                col=column,
            )
    styled(figure, 380)
    if measured:
        measured.draw(figure, scale)
    values = np.unique([c.value for c in cases])
    wide = values[0] > 0 and values[-1] > 5 * values[0]
    ticks = {"tickvals": values, "ticktext": [number(float(v), 4) for v in values]}
    figure.update_xaxes(title_text=key, type="log" if wide else "linear", **(ticks if len(values) < 15 else {}))
    drawn = np.array([*peak.values(), *(measured.ends if measured else ())]) * scale.factor
    figure.update_yaxes(title_text=f"peak {response.quantity} ({scale.unit})", type="log", **log_ticks(drawn), col=1)
    figure.update_yaxes(title_text="peak frequency (Hz)", col=2)
    caption = _optimum_caption(response, cases) + (measured.caption(cases) if measured else "")
    caption += next(filter(None, banded), "")
    caption += shade_working_range(figure, response, logarithmic=bool(wide))
    return Plot("optimisation", "Optimisation curves", caption, figure)
