"""How much the retention stiffness moves a peak."""

from dataclasses import replace

from stickslip.response.forced.resonance import peak_from
from stickslip.response.forced.response import forced_problem
from stickslip.study.build import Case
from stickslip.study.collect import HZ, NO_SHIFT, CaseResult
from stickslip.study.journal import Journal

WEAKER = (
    0.5,
    0.2,
    0.1,
)  # shares of the study's stiffness, each solved from the one before; the last one counts


def peak_shift(
    case: Case, result: CaseResult, load_case: int, journal: Journal
) -> tuple[float, float]:
    """Follow the peak to a tenth of the retention stiffness.

    Returns
    -------
    tuple of float
        Relative change of the peak amplitude, and change of its frequency in Hz; NaN without retention, without a peak, or where no
        periodic motion was found with a weaker retention.
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
    point = first = result.accepted[result.peak].point
    own = point.support
    sweep = replace(case.sweep, low=own, high=own, selection="always_high")
    for share in WEAKER:
        problem = forced_problem(
            case.with_retention(share * case.retention), case.load(result.ratio), sweep
        )
        again = peak_from(problem, point)
        if again is None:
            return NO_SHIFT
        point = again
    amplitude = problem.amplitude(point, result.report_output)
    return amplitude / result.peak_amplitude - 1, (point.omega - first.omega) / HZ
