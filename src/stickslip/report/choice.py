"""Where more harmonics were needed and why, in plain words."""

from collections import Counter
from html import escape

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.figures_contact import states
from stickslip.report.quantities import number
from stickslip.report.result import RATIO, Case, Result
from stickslip.report.tables import html_table
from stickslip.study.chooser import cost_sentence
from stickslip.study.harmonics_table import named

NAMED = 4  # sets of harmonics that a cell names


def flagged_ranges(result: Result, case: Case) -> list[tuple[float, float]]:
    """Ranges of frequency in which the alert asked for more harmonics.

    Returns
    -------
    ranges
        (first Hz, last Hz) of each run of neighbouring points.
    """
    at = np.flatnonzero(result.alert.case == case.index)
    hz, error = result.alert.hz[at], result.alert.error[at]
    above = np.concatenate([[False], error > result.threshold, [False]])
    starts = np.flatnonzero(~above[:-1] & above[1:])
    ends = np.flatnonzero(above[:-1] & ~above[1:])
    return [(float(hz[a:b].min()), float(hz[a:b].max())) for a, b in zip(starts, ends, strict=True)]


def _harmonic_share(result: Result, at: IntArray) -> float:
    """Largest share of the contact forces' vibration that harmonics beyond the first passage's carry, in percent."""
    if not at.size or not result.has("contact_force"):
        return float("nan")
    force = result.data["contact_force"].isel(point=at)
    parts = np.asarray(force.transpose("point", "harmonic", "contact", "direction", "part").values)
    power: FloatArray = np.nansum(np.square(parts, dtype=np.float64), axis=(2, 3, 4))
    moving = power[:, 1:].sum(axis=1)
    beyond = ~np.isin(np.arange(power.shape[1]), result.low_harmonics)
    share = np.sqrt(power[:, beyond].sum(axis=1) / np.where(moving > 0, moving, 1.0))
    return float(100 * share.max())


def _why(result: Result, case: Case) -> str:
    """Say what the contact does at the peak of a case and what the higher harmonics carry."""
    reasons = []
    if result.has("peak_state") and result.peak(case) >= 0:
        state = states(result, case)
        slipping, open_ = (state == 1).any(axis=(1, 2)), (state == 2).any(axis=(1, 2))
        n = len(state)
        if slipping.any() or open_.any():
            reasons.append(
                f"at the peak {int(slipping.sum())} of {n} contacts slip, {int(open_.sum())} lift off"
            )
        else:
            reasons.append("at the peak all contacts stick: the system is linear")
    mine = result.integers("case") == case.index
    high = np.flatnonzero(mine & result.converged & result.more)
    share = _harmonic_share(result, high)
    if np.isfinite(share):
        reasons.append(
            f"harmonics beyond H = {result.low_name} carry up to {number(share, 2)} % of the contact force"
        )
    return "; ".join(reasons) or "–"


def choice(result: Result) -> str:
    """Where more harmonics were needed, what chose them, and why, in plain words."""
    if not result.decides:
        return f"<p>The same harmonics everywhere (<code>{result.selection}</code>): {_kept_where(result)}.</p>"
    if not result.alert.error.size:
        return (
            "<p>No predicted error was computed: nothing was asked which harmonics are needed.</p>"
        )
    text = _alert_text(result) if result.is_error else _other_text(result)
    rows, head = _alert_rows(result) if result.is_error else _other_rows(result)
    stored = escape(result.text("alert_explanation"))
    log = (
        f"<details><summary>As the run put it</summary><p>{stored}</p></details>" if stored else ""
    )
    return text + html_table(head, rows, numeric=False) + _cost(result) + log


def _cost(result: Result) -> str:
    """Say what choosing has cost beside the harmonics of the reference everywhere."""
    if not result.has("unknowns_solved", "retained_displacement"):
        return ""
    solved, each = int(result.floats("unknowns_solved").sum()), result.data.sizes["retained"]
    each *= 2 * len(result.high_harmonics) - 1
    return f"<p>{cost_sentence(solved, result.converged.size, each, result.high_name)}</p>"


_REASON = (
    "A contact that slips or lifts off makes forces at multiples of the excitation frequency, which a solution with few "
    "harmonics cannot see."
)


def _alert_text(result: Result) -> str:
    over = escape(result.text("error_over"))
    where = f" of {over}" if over else " of the output"
    single = result.text("passages") == "single"
    first = (
        "Each frequency is settled before the next one, beginning"
        if single
        else "Each point is first solved"
    )
    return (
        f"<p>{first} with H = {result.low_name}. <code>{result.selection}</code> then predicts how far the motion{where} would "
        f"change with H = {result.high_name}; where that exceeds {result.shown(result.threshold)}, the point is solved again "
        f"with more harmonics. {_REASON}</p>"
    )


def _other_text(result: Result) -> str:
    return (
        f"<p><code>{result.selection}</code> chooses among the harmonics of H = {result.high_name}, never fewer than H = {result.low_name}, one frequency "
        f"after the other: it compares an indicator of its own, which is no error, with {result.shown(result.threshold)}. How good the "
        f"solution is, it does not say; <code>--verify-harmonics</code> does. {_REASON}</p>"
    )


def _alert_rows(result: Result) -> tuple[list[list[str]], list[str]]:
    rows = []
    for case in result.cases:
        ranges = flagged_ranges(result, case)
        where = "<br>".join(
            f"{number(a, 5)} Hz" if a == b else f"{number(a, 5)} to {number(b, 5)} Hz"
            for a, b in ranges
        )
        peak = _largest(result, case)
        rows.append([case.label, where or "nowhere", peak, _why(result, case)])
    return rows, [RATIO, f"{result.more_name} asked for", "largest predicted error", "why"]


def _largest(result: Result, case: Case) -> str:
    """Say how large the predicted error of a case is at most, and where."""
    own = np.flatnonzero(result.alert.case == case.index)
    if not own.size:
        return "–"
    worst = own[int(np.argmax(result.alert.error[own]))]
    return f"{result.shown(float(result.alert.error[worst]))} at {number(float(result.alert.hz[worst]), 5)} Hz"


def _other_rows(result: Result) -> tuple[list[list[str]], list[str]]:
    rows = []
    for case in result.cases:
        own = result.alert.error[result.alert.case == case.index]
        largest = result.shown(float(own.max())) if own.size else "–"
        rows.append([case.label, _kept_where(result, case), largest, _why(result, case)])
    return rows, [RATIO, "harmonics kept", "largest indicator", "why"]


def _kept_where(result: Result, case: Case | None = None) -> str:
    """Say which harmonics were kept how often, the most frequent ones first."""
    mine = (
        np.full(result.converged.shape, True)
        if case is None
        else result.integers("case") == case.index
    )
    counts = Counter(named(np.flatnonzero(row)) for row in result.kept[mine & result.converged])
    each = [f"H = {own} at {n}" for own, n in counts.most_common(NAMED)]
    rest = sum(counts.values()) - sum(n for _, n in counts.most_common(NAMED))
    if rest:
        each.append(f"others at {rest}")
    return "; ".join(each) + f" of {sum(counts.values())} points" if each else "–"
