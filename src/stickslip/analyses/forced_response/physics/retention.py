"""Sensitivity of a peak to the retention stiffness."""

from dataclasses import replace

from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.records.points import Response
from stickslip.response.forced.resonance import peak_from
from stickslip.response.forced.response import forced_problem
from stickslip.units import HZ

NO_SHIFT = (float("nan"), float("nan"))
# shares of the study's stiffness, each solved from the one before; the last one counts
WEAKER = (0.5, 0.2, 0.1)


def peak_shift(question: Question, response: Response) -> tuple[float, float]:
    """Follow the peak to a tenth of the retention stiffness.

    Returns
    -------
    tuple of float
        Relative change of the peak amplitude, and change of its frequency in Hz; NaN without retention, without a peak, or where no
        periodic motion was found with a weaker retention.
    """
    model = question.model
    if model.retention == 0.0 or response.top is None:
        return NO_SHIFT
    point = first = response.top.point
    own = point.support
    sweep = replace(question.sweep, low=own, high=own, selection="always_high")
    for share in WEAKER:
        held = model.bare.with_retention(share * model.retention)
        problem = forced_problem(held, model.load, sweep)
        again = peak_from(problem, point)
        if again is None:
            return NO_SHIFT
        point = again
    amplitude = problem.amplitude(point, response.output)
    return amplitude / response.peak_amplitude - 1, (point.omega - first.omega) / HZ
