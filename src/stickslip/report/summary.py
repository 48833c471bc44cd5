"""The head of the page: headline numbers, warnings, and what the alert asked for and why."""

import json
from html import escape

import numpy as np

from stickslip.report.figures_response import peak_hz, peak_response
from stickslip.report.quantities import counted, number, percent, predicted, scale_for
from stickslip.report.result import RATIO, Result

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


def _choice_card(result: Result) -> str:
    error = result.alert.error
    if not result.is_error:
        more = int(np.sum(result.more & result.converged))
        n = int(result.converged.sum())
        note = f"{more} of {counted(n, 'accepted point')}, chosen by {result.selection}"
        share = f"{number(100 * more / n, 2)} %" if n else "–"
        return _card(share, f"of points keep other harmonics than H = {result.low_name}", note)
    if not error.size:
        return _card("–", "asked for more harmonics", "no predicted error was computed")
    asked = int(np.sum(error > result.threshold))
    note = f"{asked} of {counted(error.size, 'checked point')} above {percent(result.threshold)}"
    return _card(
        f"{number(100 * asked / error.size, 2)} %", "of points asked for more harmonics", note
    )


def _worst_card(result: Result) -> str:
    asked = result.alert
    if not result.is_error and result.has("unknowns_solved"):
        work = int(result.floats("unknowns_solved").sum())
        steps = int(result.floats("newton_steps").sum())
        note = f"of all solutions together, in {counted(steps, 'Newton step')}"
        return _card(number(work, 6), "unknowns solved", note)
    if not asked.error.size:
        return _card("–", "worst predicted error", "no predicted error was computed")
    at = int(np.argmax(asked.error))
    ratio = number(float(result.floats("load_ratio")[asked.case[at]]), 4)
    note = f"at {number(float(asked.hz[at]), 5)} Hz, {RATIO} = {ratio}"
    largest = float(asked.error[at])
    return _card(predicted(largest), f"worst predicted error with H = {result.low_name}", note)


def headline(result: Result) -> str:
    """Return the four numbers that sum the run up."""
    cards = (_optimum_card(result), _shift_card(result), _choice_card(result), _worst_card(result))
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
