"""The example study, two blades and a damper: harmonic balance against time integration over the whole range of ratios.

At the accepted peak of every ratio and at one frequency on either flank, the first harmonic of the report output, as a run gives
it (the alert choosing between H = 1 and H = 5), is compared with the time integration of the same reduced model. So is the balance
with many more harmonics, which tells which of the two is wrong where they differ. The mesh is that of the example with its
element sizes doubled, so that the comparison takes minutes: it is a comparison on one reduced model, not of meshes.

A row that does not hold is left as it is, with what is known of the reason.
"""

import numpy as np

from evidence.models.two_blades import COARSER, two_blades
from evidence.validation.compare import Record, record
from stickslip.response.forced.problem import ForcedPoint
from stickslip.study.analyses.forced.in_time import integrated, listed, refined
from stickslip.study.analyses.forced.points import Accepted, Response
from stickslip.study.analyses.forced.question import Question
from stickslip.units import HZ

CASE = "Two blades and a damper"
TOLERANCE = 0.01  # issue of the first release: first-harmonic amplitude at H = 5
PERIODS = 300  # a blade damped by 0.3 % forgets its start: 2 % of what was off is left where the average begins
ORDERS = (
    15,
    25,
    41,
)  # of the balance that tells which side is wrong, raised until its amplitude no longer changes
UNCHANGED = 3e-3  # relative


def converged(question: Question, point: ForcedPoint) -> ForcedPoint | None:
    """Raise the harmonics until the amplitude no longer changes; the last solution, or None if there is none."""
    found, problem = None, question.problem
    for order in ORDERS:
        more = refined(question, found or point, order)
        if more is None:
            break
        change = abs(problem.amplitude(more) / problem.amplitude(found or point) - 1)
        found = more
        if change < UNCHANGED:
            break
    return found


def compare(question: Question, ratio: float, accepted: Accepted, where: str) -> list[Record]:
    """Compare what a run accepts, and the balance with many harmonics, with the integration."""
    problem, point, output = question.problem, accepted.point, question.model.peak_output
    many = converged(question, point)
    # several periodic motions may exist beside each other: begin at the one that is compared
    found = integrated(problem, many or point, question.model.load, PERIODS)
    first = found.harmonics[1] if found.settled else found.average
    reference = float(np.abs(first[output]))
    motion = (
        f"periodic after {found.periods} periods"
        if found.settled
        else f"not periodic after {found.periods} periods, average of the last third, scatter {100 * found.scatter:.1g} %"
    )
    drifts = f"; drifting: {listed(found.drifting)}" if found.drifting else ""
    lost = "" if many else f"; the balance with {ORDERS[0]} harmonics finds no solution from there"
    source = f"time integration, 1024 steps a period, {motion}{drifts}{lost}"
    at = f"F_CL/F_HE = {ratio:g}, {where}, {point.omega / HZ:.2f} Hz: first harmonic"
    rows = [(f"{at}, as accepted, H = {point.order}, m", problem.amplitude(point, output))]
    if many:
        rows.append((f"{at}, H = {many.order}, m", problem.amplitude(many, output)))
    return [record(CASE, name, own, reference, TOLERANCE, source) for name, own in rows]


def places(response: Response) -> list[tuple[str, Accepted]]:
    """Return the peak and a point on either flank, each with what it is."""
    if response.top is None:
        return []
    named = [
        ("below the peak" if a.point.omega < response.top.point.omega else "above the peak", a)
        for a in response.flanks
    ]
    return [("peak", response.top), *named]


def run() -> list[Record]:
    """Compare at the peak and on both flanks for every ratio of the example."""
    example = two_blades(COARSER)
    records = []
    for ratio in example.ratios:
        question = example.at(ratio)
        for where, accepted in places(example.response(ratio)):
            records += compare(question, ratio, accepted, where)
    return records
