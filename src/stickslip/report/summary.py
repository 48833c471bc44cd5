"""The head of the page: headline numbers, warnings, and what the alert asked for and why."""

import json
from html import escape

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.report.figures_contact import states
from stickslip.report.figures_response import peak_hz, peak_response
from stickslip.report.quantities import counted, number, percent, scale_for
from stickslip.report.result import RATIO, Case, Result
from stickslip.report.tables import html_table

_LARGE_SHIFT = 0.01  # relative change of the peak worth a warning
_LARGE_DIFFERENCE = 1.0  # percent between time integration and balance (Gastaldi and Berruti 2017: below it at H = 5)


def _card(value: str, label: str, note: str) -> str:
    return f'<div class="card"><b>{value}</b><span>{label}</span><small>{note}</small></div>'


def _optimum_card(result: Result) -> str:
    cases = [c for c in result.peaked if np.isfinite(peak_response(result, c))]
    if not cases:
        return _card("–", "damper optimum", "no load case has its peak yet")
    peaks = np.array([peak_response(result, c) for c in cases])
    best = int(np.argmin(peaks))
    scale = scale_for(peaks[best : best + 1], "m/N")
    note = f"smallest peak: {number(float(peaks[best]) * scale.factor)} {scale.unit}"
    if len(cases) > 1:
        note += f", {percent(100 * float(peaks[best] / peaks.max()))} of the largest"
    if len(cases) > 1 and best in (0, len(cases) - 1):
        note += "; at the end of the range"
    return _card(f"{RATIO} = {cases[best].label}", "damper optimum", note)


def _shift_card(result: Result) -> str:
    if len(result.peaked) < 2:
        return _card("–", "frequency shift", "needs the peaks of two load cases")
    stuck, slipping = result.peaked[0], result.peaked[-1]
    a, b = peak_hz(result, stuck), peak_hz(result, slipping)
    note = f"from {number(a, 5)} Hz at {stuck.label} to {number(b, 5)} Hz at {slipping.label}"
    return _card(
        f"{number(b - a)} Hz",
        f"shift of the peak, stuck to slip ({percent(100 * (b / a - 1))})",
        note,
    )


def _alert_card(result: Result) -> str:
    error = result.alert.error
    if not error.size:
        return _card("–", "asked for more harmonics", "no predicted error was computed")
    asked = int(np.sum(error > result.threshold))
    note = f"{asked} of {counted(error.size, 'checked point')} above {percent(result.threshold)}"
    return _card(
        f"{number(100 * asked / error.size, 2)} %", "of points asked for more harmonics", note
    )


def _worst_card(result: Result) -> str:
    asked = result.alert
    if not asked.error.size:
        return _card("–", "worst predicted error", "no predicted error was computed")
    at = int(np.argmax(asked.error))
    ratio = number(float(result.floats("load_ratio")[asked.case[at]]), 4)
    note = f"at {number(float(asked.hz[at]), 5)} Hz, {RATIO} = {ratio}"
    largest = float(asked.error[at])
    said = "over 100 %" if largest > 100.0 else percent(largest)
    return _card(said, f"worst predicted error at H = {result.low}", note)


def headline(result: Result) -> str:
    """Return the four numbers that sum the run up."""
    cards = (_optimum_card(result), _shift_card(result), _alert_card(result), _worst_card(result))
    return f'<div class="cards">{"".join(cards)}</div>'


def _stored_warnings(result: Result) -> list[str]:
    text = result.text("warnings", "[]")
    try:
        stored = json.loads(text)
    except json.JSONDecodeError:
        stored = text
    return [escape(str(s)) for s in (stored if isinstance(stored, list) else [stored]) if str(s)]


def _unconverged(result: Result) -> list[str]:
    bad = ~result.converged
    warnings = []
    for case in result.cases:
        at = np.flatnonzero(bad & (result.integers("case") == case.index))
        if at.size:
            hz = result.floats("frequency_hz")[at]
            between = f"between {number(hz.min(), 5)} and {number(hz.max(), 5)} Hz"
            where = f"at {number(hz[0], 5)} Hz" if at.size == 1 else between
            warnings.append(
                f"{counted(int(at.size), 'point')} of {RATIO} = {case.label} did not converge, {where}. They are "
                "left out of curves and peaks; smaller frequency steps may help."
            )
    return warnings


def _doubts(result: Result) -> list[str]:
    """Warnings that follow from numbers: a peak that hangs on the retention, a check that failed."""
    warnings = []
    shift = (
        result.floats("retention_peak_shift")
        if result.has("retention_peak_shift")
        else np.array([])
    )
    warnings += [
        f"For {RATIO} = {case.label} the peak changes by {percent(100 * float(shift[case.index]))} when the "
        "damper's retention stiffness is ten times smaller: it depends on a stiffness that is not physical."
        for case in (result.cases if shift.size else ())
        if abs(np.nan_to_num(shift[case.index])) > _LARGE_SHIFT
    ]
    if result.has("verify_difference_percent"):
        large = (
            np.abs(np.nan_to_num(result.floats("verify_difference_percent"))) > _LARGE_DIFFERENCE
        )
        if large.any():
            warnings.append(
                f"Time integration and harmonic balance differ by more than {percent(_LARGE_DIFFERENCE)} in "
                f"{counted(int(large.sum()), 'check')}; see the table."
            )
    if result.has("verify_settled") and (result.floats("verify_settled") == 0).any():
        warnings.append("A time integration did not settle to a periodic motion; see the table.")
    return warnings


def all_warnings(result: Result) -> list[str]:
    """Everything the reader must know before using the numbers, as HTML sentences."""
    warnings = []
    if not result.scalar("complete", 1):
        held = counted(len(result.cases), "load case")
        warnings.append(
            f"The run is not complete: this file holds {held}, {len(result.peaked)} of them with a peak. Run the study "
            "again: it resumes where it stopped."
        )
    return warnings + _stored_warnings(result) + _unconverged(result) + _doubts(result)


def warnings_box(result: Result) -> str:
    """Return the warnings, or the statement that there are none."""
    warnings = all_warnings(result)
    if not warnings:
        n = counted(len(result.converged), "point")
        return f'<div class="box good"><b>No warnings.</b> The run is complete and all {n} converged.</div>'
    items = "".join(f"<li>{w}</li>" for w in warnings)
    return f'<div class="box bad"><b>{counted(len(warnings), "warning")}</b><ul>{items}</ul></div>'


def flagged_ranges(result: Result, case: Case) -> list[tuple[float, float, float, float]]:
    """Ranges of frequency in which the alert asked for more harmonics.

    Returns
    -------
    ranges
        (first Hz, last Hz, largest predicted error in percent, Hz of it) of each run of neighbouring points.
    """
    at = np.flatnonzero(result.alert.case == case.index)
    hz, error = result.alert.hz[at], result.alert.error[at]
    above = np.concatenate([[False], error > result.threshold, [False]])
    starts = np.flatnonzero(~above[:-1] & above[1:])
    ends = np.flatnonzero(above[:-1] & ~above[1:])
    ranges = []
    for a, b in zip(starts, ends, strict=True):
        worst = a + int(np.argmax(error[a:b]))
        ranges.append(
            (float(hz[a:b].min()), float(hz[a:b].max()), float(error[worst]), float(hz[worst]))
        )
    return ranges


def _harmonic_share(result: Result, at: IntArray) -> float:
    """Largest share of the contact forces' vibration that harmonics above the low order carry, in percent."""
    if not at.size or not result.has("contact_force"):
        return float("nan")
    force = result.data["contact_force"].isel(point=at)
    parts = np.asarray(force.transpose("point", "harmonic", "contact", "direction", "part").values)
    power: FloatArray = np.nansum(np.square(parts, dtype=np.float64), axis=(2, 3, 4))
    moving = power[:, 1:].sum(axis=1)
    share = np.sqrt(power[:, result.low + 1 :].sum(axis=1) / np.where(moving > 0, moving, 1.0))
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
    high = np.flatnonzero(mine & result.converged & (result.integers("order") > result.low))
    share = _harmonic_share(result, high)
    if np.isfinite(share):
        above = result.low + 1
        reasons.append(
            f"harmonics {above} to {result.high} carry up to {number(share, 2)} % of the contact force"
        )
    return "; ".join(reasons) or "–"


def alert(result: Result) -> str:
    """Where the alert asked for more harmonics, and why, in plain words."""
    if not result.alert.error.size:
        return "<p>No predicted error was computed: the alert did not run.</p>"
    rows = []
    for case in result.cases:
        ranges = flagged_ranges(result, case)
        where = "<br>".join(
            f"{number(a, 5)} Hz" if a == b else f"{number(a, 5)} to {number(b, 5)} Hz"
            for a, b, _, _ in ranges
        )
        worst = max(ranges, key=lambda r: r[2]) if ranges else None
        peak = f"{percent(worst[2])} at {number(worst[3], 5)} Hz" if worst else "–"
        rows.append([case.label, where or "nowhere", peak, _why(result, case)])
    text = (
        f"<p>Each point is first solved with harmonics 0 to {result.low}. One Newton step with harmonics 0 to "
        f"{result.high} then predicts how far the output would move; where that exceeds "
        f"{percent(result.threshold)}, the point is solved again with harmonics 0 to {result.high}. A contact that "
        "slips or lifts off makes forces at multiples of the excitation frequency, which the first pass cannot see."
        "</p>"
    )
    stored = escape(result.text("alert_explanation"))
    log = (
        f"<details><summary>As the run put it</summary><p>{stored}</p></details>" if stored else ""
    )
    head = [RATIO, f"H = {result.high} asked for", "largest predicted error", "why"]
    return text + html_table(head, rows, numeric=False) + log
