"""Harmonics over frequency on the page: kept harmonics, frequencies that needed more, the reasons, and the cost."""

from collections import Counter

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from stickslip.analyses.forced_response.page.at_peak.contacts import states
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.records.columns import Attempts, MoreHarmonics, read
from stickslip.analyses.forced_response.summary import cost_sentence
from stickslip.arrays import IntArray
from stickslip.harmonic.harmonic_set import named
from stickslip.report.cases import ShownCase
from stickslip.report.content import Table, Words
from stickslip.report.plot import ALARM, Plot, styled
from stickslip.report.quantities import (
    NONE,
    counted,
    fixed,
    number,
    predicted,
    runs,
)
from stickslip.solve.status import Status

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
        middle = ("harmonics kept", "largest error predicted of what was accepted; found by audits, which overrule it")
    elif response.is_error:
        middle = (f"{response.more_name} asked for", "largest predicted error")
        alert, text = _alert_row, _alert_text
    rows = [[c.short, *alert(response, c), _why(response, c)] for c in response.cases]
    told = [text(response)]
    if response.fields.retained_displacement.size and response.numbers_of[0].unknowns_solved >= 0:
        told.append(cost_sentence(response.data))
    found = response.table("", told, [*middle, "why"], rows, numeric=False)
    said = response.text("alert_explanation")
    return [found, Words((said,), folded="As the run put it")] if said else [found]


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
