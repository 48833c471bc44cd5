"""How much the retention stiffness moves a peak."""

from dataclasses import replace

from stickslip.response.forced import forced_problem, forced_response
from stickslip.study.build import Case
from stickslip.study.collect import HZ, NO_SHIFT, CaseResult, collect
from stickslip.study.journal import Journal

WEAKER = 0.1  # the stiffness of the comparison, as a share of the study's
WINDOW = (
    0.02  # half width of the frequency range of the comparison, relative to the peak's frequency
)
POINTS = 12


def peak_shift(
    case: Case, result: CaseResult, load_case: int, journal: Journal
) -> tuple[float, float]:
    """Solve the peak again with a tenth of the retention stiffness.

    Returns
    -------
    tuple of float
        Relative change of the peak amplitude, and change of its frequency in Hz; NaN without retention or without a peak.
    """
    if case.retention == 0.0 or result.peak < 0:
        return NO_SHIFT
    name = f"retention.{load_case}"
    known = journal.get(name)
    if known is None:
        known = dict(zip(("amplitude", "frequency_hz"), _shift(case, result), strict=True))
        journal.put(name, known)
    return known["amplitude"], known["frequency_hz"]


def _shift(case: Case, result: CaseResult) -> tuple[float, float]:
    peak = result.accepted[result.peak].point
    first, last = case.sweep.omega_range
    window = max(first, (1 - WINDOW) * peak.omega), min(last, (1 + WINDOW) * peak.omega)
    sweep = replace(
        case.sweep,
        omega_range=window,
        points=POINTS,
        selection="always_low" if peak.order == case.sweep.low else "always_high",
    )
    system = case.with_retention(WEAKER * case.retention)
    load = case.load(result.ratio)
    again = collect(
        forced_problem(system, load, sweep),
        list(forced_response(system, load, sweep)),
        ratio=result.ratio,
        excitation=result.excitation,
        report_output=result.report_output,
    )
    return (
        again.peak_amplitude / result.peak_amplitude - 1,
        again.peak_frequency_hz - peak.omega / HZ,
    )
