"""The example study, two blades and a damper: harmonic balance against time integration over the whole range of ratios.

At the accepted peak of every ratio and at one frequency on either flank, the first harmonic of the report output from the balance with many
harmonics is compared with the time integration of the same reduced model. The mesh is that of the example with its
element sizes doubled, so that the comparison takes minutes: it is a comparison on one reduced model, not of meshes.

What a run gives there, the alert choosing between H = 1 and H = 5 as in the paper, has rows of its own (`FIVE`): where contacts slip
much, five harmonics are not enough, and no solver can make them so. Such a row holds if the error against time integration is the one that
more harmonics state, and if the run does not trust the case where that error is above the tolerance.
"""

import numpy as np

from evidence.models.two_blades import COARSER, two_blades
from evidence.validation.compare import Record, record
from stickslip.analyses.forced_response.problem import Question
from stickslip.analyses.forced_response.stability.in_time import integrated, listed, refined
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.forced.problem import ForcedPoint
from stickslip.study.verdict import Level
from stickslip.units import HZ

CASE = "Two blades and a damper"
FIVE = "Two blades and a damper, five harmonics"
TOLERANCE = 0.01  # issue of the first release: first-harmonic amplitude at H = 5
PERIODS = 300  # a blade damped by 0.3 % forgets its start: 2 % of what was off is left where the average begins
ORDERS = (15, 25, 41)  # of the balance that tells which side is wrong, raised until its amplitude no longer changes
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


def compare(question: Question, ratio: float, accepted: Accepted, where: str, level: Level) -> list[Record]:
    """Compare the balance with many harmonics, and what a run accepts and judges with a level, with the integration."""
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
    source = f"time integration, 1024 steps a period, {motion}{drifts}"
    at = f"F_CL/F_HE = {ratio:g}, {where}, {point.omega / HZ:.2f} Hz: first harmonic"
    own = problem.amplitude(point, output)
    known = problem.amplitude(many, output) if many else None
    rows = [
        few_harmonics(
            f"{at}, H = {point.order}, {level}", own / reference - 1, known and own / known - 1, level, source
        )
    ]
    if many and known:
        name = f"{at}, H = {many.order}, m"
        rows.append(record(CASE, name, known, reference, TOLERANCE, source))
    return rows


def few_harmonics(name: str, error: float, stated: float | None, level: Level, source: str) -> Record:
    """Ask that an error is the one that more harmonics state, None where these find no solution, and that a large one is not trusted."""
    told = "none found with more" if stated is None else f"{stated:+.2%} stated by more"
    quantity = f"{name}: relative error, {told}"
    made = record(FIVE, quantity, error, error if stated is None else stated, 0.0, source)
    as_stated = stated is not None and abs(error - stated) <= TOLERANCE
    small = stated is not None and abs(error) <= TOLERANCE
    holds = (small and as_stated) or (level != "trusted" and (as_stated or stated is None))
    return {**made, "tolerance": TOLERANCE, "holds": holds}


def places(response: Response) -> list[tuple[str, Accepted]]:
    """Return the peak and a point on either flank, each with what it is."""
    if response.top is None:
        return []
    named = [
        ("below the peak" if a.point.omega < response.top.point.omega else "above the peak", a) for a in response.flanks
    ]
    return [("peak", response.top), *named]


def run() -> list[Record]:
    """Compare at the peak and on both flanks for every ratio of the example."""
    example = two_blades(COARSER)
    records = []
    for ratio in example.ratios:
        question = example.at(ratio)
        response, level = example.judged(ratio)
        for where, accepted in places(response):
            records += compare(question, ratio, accepted, where, level)
    return records
