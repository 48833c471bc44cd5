"""The selection of harmonics on the page: kept harmonics over frequency, frequencies that needed more, the reasons, the cost, and the errors.

The errors are the predicted and real ones of first solutions, or the strategy's own indicator.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.at_peak.contacts import states
from stickslip.analyses.forced_response.page.curves import COMPARED, most
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import Attempts, MoreHarmonics, read
from stickslip.analyses.forced_response.summary import cost_sentence
from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.harmonic_set import named
from stickslip.report.cases import ShownCase
from stickslip.report.plot import ALARM, INK, Plot, log_ticks, ring, styled
from stickslip.report.quantities import (
    NONE,
    counted,
    fixed,
    number,
    percent,
    predicted,
    runs,
)
from stickslip.report.section import Table, Words
from stickslip.solve.status import Status
from stickslip.study.file.case_names import CASE

_SHOWN = 12  # cases that stay legible below one another
_EDGE = 0.01  # margin as a share of the frequency range, so that marks at its ends are whole
_ROW, _LINE, _PANEL = (46, 13, 200)  # pixels: height of an empty panel, of each harmonic, and of all harmonics at most
_TICKS = 12  # largest number of labels on an axis


def kept_harmonics(response: Response) -> Plot | None:
    """Draw a mark for every harmonic that an accepted solution keeps, against frequency."""
    cases = [c for c in response.cases if np.any(response.point_case == c.index)][-_SHOWN:]
    if not cases or not response.decides:
        return None
    spacing = 0.25 / len(cases) if len(cases) > 1 else 0.0
    titles = [c.label for c in cases]
    figure = make_subplots(len(cases), 1, shared_xaxes=True, vertical_spacing=spacing, subplot_titles=titles)
    highest = max((int(h) for h in np.flatnonzero(response.kept.any(axis=0))), default=1)
    for row, case in enumerate(cases, 1):
        figure.add_trace(_marks(response, case), row=row, col=1)
        lost = np.flatnonzero(~response.converged & (response.point_case == case.index))
        if lost.size:
            figure.add_trace(_lost(response, lost, highest), row=row, col=1)
    styled(figure, 90 + len(cases) * (_ROW + min(_LINE * highest, _PANEL)))
    figure.update_layout(showlegend=False)
    ticks = [int(h) for h in response.high_harmonics if 0 < h <= highest]
    if len(ticks) > _TICKS:
        ticks = [1, *range(5, highest + 1, 5)]
    figure.update_yaxes(tickvals=ticks, range=[0.3, highest + 0.9])
    figure.update_yaxes(title_text="harmonic", row=(len(cases) + 1) // 2, col=1)
    hz = response.hz
    aside = _EDGE * float(hz.max() - hz.min())
    figure.update_xaxes(range=[float(hz.min()) - aside, float(hz.max()) + aside])
    figure.update_xaxes(title_text="frequency (Hz)", row=len(cases), col=1)
    return Plot("harmonics", "Harmonics kept at each frequency", _caption(response, cases), figure)


def _marks(response: Response, case: ShownCase) -> go.Scatter:
    at = response.points(case)
    at = at[response.converged[at]]
    row, harmonic = np.nonzero(response.kept[at, 1:])
    return go.Scatter(
        x=response.hz[at][row],
        y=harmonic + 1,
        mode="markers",
        name=case.short,
        marker={"symbol": "square", "size": 6 if response.kept.shape[1] <= _TICKS else 4, "color": case.colour},
        hovertemplate="%{x:.2f} Hz: harmonic %{y} is kept<extra></extra>",
    )


def _lost(response: Response, at: IntArray, highest: int) -> go.Scatter:
    return go.Scatter(
        x=response.hz[at],
        y=np.full(at.size, highest + 0.5),
        mode="markers",
        name="did not converge",
        marker={"symbol": "x", "size": 7, "color": ALARM},
        hovertemplate="not converged<br>%{x:.2f} Hz<extra></extra>",
    )


def _caption(response: Response, cases: list[ShownCase]) -> str:
    good = response.converged
    text = (
        f"A mark stands for a harmonic of the accepted solution, chosen by `{response.selection}`. The static term is always kept. {int(np.sum(response.more & good))} of {counted(int(good.sum()), 'accepted point')} "
        f"keep other harmonics than H = {response.low_name}"
    )
    used = np.flatnonzero(response.kept[good].any(axis=0)) if good.any() else np.zeros(0, dtype=int)
    unused = [int(h) for h in response.high_harmonics if h not in used]
    text += f"; no point keeps {runs(unused)}." if unused and good.any() else "."
    if len(cases) < len(response.cases):
        text += f" The last {len(cases)} of {len(response.cases)} cases are drawn."
    return text


_NAMED = 4  # sets of harmonics that a cell lists


def flagged_ranges(response: Response, case: ShownCase) -> list[tuple[float, float]]:
    """Return the frequency ranges in which the alert requested more harmonics.

    Returns
    -------
    ranges
        (first Hz, last Hz) of each run of neighbouring points.
    """
    at = np.flatnonzero(response.alert.case == case.index)
    hz, error = response.alert.hz[at], response.alert.error[at]
    above = np.concatenate([[False], error > response.threshold, [False]])
    starts = np.flatnonzero(~above[:-1] & above[1:])
    ends = np.flatnonzero(above[:-1] & ~above[1:])
    return [(float(hz[a:b].min()), float(hz[a:b].max())) for a, b in zip(starts, ends, strict=True)]


def _harmonic_share(response: Response, case: ShownCase) -> float:
    """Return the largest percentage of the oscillating contact forces in harmonics beyond the first passage."""
    at = np.flatnonzero((response.point_case == case.index) & response.converged & response.more)
    force = response.fields.contact_force
    if not np.isfinite(force[at]).any():
        return float("nan")
    power = np.nansum(np.square(force[at], dtype=np.float64), axis=(2, 3, 4))
    moving = power[:, 1:].sum(axis=1)
    beyond = ~np.isin(np.arange(power.shape[1]), response.low_harmonics)
    share = np.sqrt(power[:, beyond].sum(axis=1) / np.where(moving > 0, moving, 1.0))
    return float(100 * share.max())


def _why(response: Response, case: ShownCase) -> str:
    """Describe the contacts at the peak of a case and the share of the higher harmonics."""
    reasons = []
    state = states(response, case)
    if state.size and response.peak(case) >= 0:
        slipping, open_ = (int((state == k).any(axis=(1, 2)).sum()) for k in (1, 2))
        said = f"{slipping} of {len(state)} contacts slip, {open_} lift off"
        still = "all contacts stick: the system is linear"
        reasons.append(f"at the peak {said if slipping or open_ else still}")
    share = _harmonic_share(response, case)
    if np.isfinite(share):
        reasons.append(
            f"harmonics beyond H = {response.low_name} carry up to {number(share, 2)} % of the contact force"
        )
    return "; ".join(reasons) or "–"


def choice(response: Response) -> list[Table | Words]:
    """Return words and a table: frequencies that needed more harmonics, the strategy, and the reasons."""
    if response.steps:
        said = f"Each motion was found in time by shooting, {response.steps} steps a period. Its harmonics up to {response.high_harmonics[-1]} are stored; none was solved for."
        return [Words((said,))]
    if not response.decides:
        kept = _kept_where(response)
        return [Words((f"The same harmonics everywhere (`{response.selection}`): {kept}.",))]
    if not response.alert.error.size:
        return []
    alert, middle, text = _other_row, ("harmonics kept", "largest indicator"), _other_text
    if response.auto:
        alert, text = _auto_row, _auto_text
        middle = ("harmonics kept", "largest error: predicted; found by audits")
    elif response.is_error:
        middle = (f"{response.more_name} asked for", "largest predicted error")
        alert, text = _alert_row, _alert_text
    rows = [[c.short, *alert(response, c), _why(response, c)] for c in response.cases]
    told = [text(response)]
    if response.fields.retained_displacement.size and response.numbers_of[0].unknowns_solved >= 0:
        told.append(cost_sentence(response.data))
    found = response.table("", told, [*middle, "why"], rows, numeric=False)
    said = response.text("alert_explanation")
    return [found, Words((), items=_each_case(said, response), folded="In the words of the run")] if said else [found]


def _each_case(said: str, response: Response) -> Sequence[str]:
    """Return a text on all cases as one entry a case."""
    places = sorted(said.find(f"{case.label}: ") for case in response.cases if case.label)
    cuts = [place for place in places if place > 0]
    return [said[a:b].strip() for a, b in pairwise([0, *cuts, len(said)])]


_REASON = "A contact that slips or lifts off makes forces at multiples of the excitation frequency. A solution with few harmonics misses them."


def _alert_text(response: Response) -> str:
    over = response.text("error_over") or "the output"
    first = "Each point is first solved"
    if response.text("passages") == "single":
        first = "Each frequency is settled before the next one, beginning"
    return (
        f"{first} with H = {response.low_name}. `{response.selection}` then predicts how far the motion of {over} would "
        f"change with H = {response.high_name}; where that exceeds {response.shown(response.threshold)}, the point is solved again "
        f"with more harmonics. {_REASON}"
    )


def _auto_text(response: Response) -> str:
    over = response.text("error_over") or "the output"
    return (
        f"Harmonics are raised along the branch, from H = {response.low_name} up to {response.high_harmonics[-1]}, until "
        f"`{response.selection}` predicts that more would change the motion of {over} by well below "
        f"{response.shown(response.threshold)}. Some points and the peak are solved with more in any case, as audits. {_REASON}"
    )


def _auto_row(response: Response, case: ShownCase) -> tuple[str, str]:
    mine = response.converged & (response.point_case == case.index)
    each = [own[mine] for own in (response.of_points.own_error_percent, response.of_points.audit_error_percent)]
    told = [predicted(float(np.nanmax(e))) if np.isfinite(e).any() else NONE for e in each]
    return _kept_where(response, case), "; ".join(told)


def _other_text(response: Response) -> str:
    return (
        f"`{response.selection}` chooses among the harmonics of H = {response.high_name}, never fewer than H = {response.low_name}, one frequency after the other. It compares an indicator of its own, which is no error, with "
        f"{response.shown(response.threshold)}. It does not say how good the solution is; `--verify-harmonics` does. "
        f"{_REASON}"
    )


def _alert_row(response: Response, case: ShownCase) -> tuple[str, str]:
    """Return the flagged ranges of a case, and its largest predicted error."""
    ranges = (
        number(a, 5) + (f" to {number(b, 5)}" if a != b else "") + " Hz" for a, b in flagged_ranges(response, case)
    )
    own = np.flatnonzero(response.alert.case == case.index)
    if not own.size:
        return "nowhere", "–"
    worst = own[int(np.argmax(response.alert.error[own]))]
    largest = f"{response.shown(float(response.alert.error[worst]))} at {number(float(response.alert.hz[worst]), 5)} Hz"
    return "\n".join(ranges) or "nowhere", largest


def _other_row(response: Response, case: ShownCase) -> tuple[str, str]:
    own = response.alert.error[response.alert.case == case.index]
    return _kept_where(response, case), response.shown(float(own.max())) if own.size else "–"


def _kept_where(response: Response, case: ShownCase | None = None) -> str:
    """Count the points with each set of harmonics, the most frequent set first."""
    mine = response.converged
    if case is not None:
        mine = mine & (response.point_case == case.index)
    counts = Counter(named(np.flatnonzero(row)) for row in response.kept[mine])
    each = [f"H = {own} at {n}" for own, n in counts.most_common(_NAMED)]
    rest = sum(counts.values()) - sum(n for _, n in counts.most_common(_NAMED))
    if rest:
        each.append(f"others at {rest}")
    return "; ".join(each) + f" of {sum(counts.values())} points" if each else "–"


def attempts(response: Response) -> Table | None:
    """Return a table with one row a case and set of harmonics: the work, including discarded solutions."""
    made = read(Attempts, response.data)
    if made.attempt_case is None or not made.attempt_kept.size:
        return None
    sets = np.array([named(np.flatnonzero(row)) for row in made.attempt_kept])
    columns = (made.attempt_newton_iterations, made.attempt_unknowns, made.attempt_seconds)
    good, rows = made.attempt_status == Status.CONVERGED, []
    for one in response.cases:
        mine = made.attempt_case == one.index
        for own in sorted(set(sets[mine]), key=lambda s: (int(s.rsplit(", ", maxsplit=1)[-1]), s)):
            at = mine & (sets == own)
            sums = [float(column[at].sum()) for column in columns]
            rows.append(
                [one.short, own, str(int(at.sum())), str(int((at & ~good).sum()))]
                + [fixed(total, digits) for total, digits in zip(sums, (0, 0, 2), strict=True)]
            )
    head = ["H", "solved", "not converged", "Newton steps", "unknowns", "time (s)"]
    text = "The table counts all solutions by case and harmonics, also the solutions that others replaced. The unknowns of all solutions compare the work of strategies on any machine."
    return response.table("Everything that was solved", (text,), head, rows)


def more_harmonics(response: Response) -> Table | None:
    """Report the predicted change by twice as many harmonics."""
    found = [(c, read(MoreHarmonics, response.data, c.index)) for c in response.cases]
    if all(own.reference_above < 0 for _, own in found):
        return None
    rows = [
        [
            c.short,
            predicted(own.reference_worst_percent),
            fixed(own.reference_worst_hz, 2),
            fixed(own.reference_above, 0),
        ]
        for c, own in found
    ]
    head = ["largest predicted change", "at (Hz)", "points above the threshold"]
    text = f"Predicted change of the accepted points with twice as many harmonics as {response.high_name}, relative to the complex amplitude, phase included."
    items = response.sentences((c, own.reference_sentence) for c, own in found)
    return response.table("More harmonics", (text,), head, rows, items=items)


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


def _error_caption(response: Response) -> str:
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
    return Plot("errors", title, _error_caption(response), figure)


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
