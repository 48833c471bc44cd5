"""Folds and other events of a branch: where a function of its points changes sign, located between two points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from stickslip.arrays import FloatArray
from stickslip.solve.branch import Following, Point, Problem, measure_at, tangent_at
from stickslip.solve.newton import Solution, charged, newton
from stickslip.solve.steps import across


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happens where a function of the points of a branch changes its sign.

    Parameters
    ----------
    name
        Given to the points located, as their `event`.
    value
        A number for a point of the branch; its tangent is the true one there, whatever the predictor.
    tolerance
        Length along the branch to which the event is located.
    """

    name: str
    value: Callable[[Point], float]
    tolerance: float = 1e-10


FOLD = Event(name="fold", value=lambda point: float(point.tangent[-1]))


class _LostError(Exception):
    """The corrector failed between two points of the branch."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(solution.status.advice)
        self.solution = solution


def located(
    problem: Problem, before: Point, after: Point, event: Event, following: Following
) -> Point:
    """Locate an event between two neighbouring points of a branch.

    The branch between them is solved on planes normal to the chord. It meets all of these, whatever corners it has; where the function
    jumps, as the tangent does at a corner, the place of the jump is found.

    Parameters
    ----------
    problem
        The equation.
    before, after
        Points with values of different sign, with their tangents.
    event
        What to look for.
    following
        Corrector and measure of length.

    Returns
    -------
    Point
        The point where the value is zero or jumps, named after the event. If the corrector fails in between, a point with its status and
        the state it came from.
    """
    measure = measure_at(before.x, following)
    chord = after.y - before.y
    length = measure.of(chord)
    row = measure.row(chord) / length**2
    known = {0.0: before, 1.0: after}
    spent: list[Solution] = []

    def point_at(share: float) -> Point:
        if share not in known:
            guess = _between(known, share)
            value = float(row @ before.y) + share
            solution = newton(lambda v: across(problem, v, row, value), guess, following.newton)
            spent.append(solution)
            if not solution.status.converged:
                raise _LostError(solution)
            tangent, sign = tangent_at(problem, solution.x, chord / length, following)
            x, p = solution.x[:-1], float(solution.x[-1])
            found = replace(solution, x=x)
            known[share] = Point(x, p, tangent, before.step, found, sign)
        return known[share]

    try:
        share = scipy.optimize.brentq(
            lambda s: event.value(point_at(float(s))), 0.0, 1.0, xtol=event.tolerance / length
        )
        point = point_at(float(share))
    except _LostError as lost:
        point = replace(before, solution=replace(lost.solution, x=before.x))
    return replace(point, event=event.name, solution=charged(point.solution, spent))


def _between(known: dict[float, Point], share: float) -> FloatArray:
    """Return a guess on the plane at `share`, from its neighbours."""
    low = max(s for s in known if s < share)
    high = min(s for s in known if s > share)
    part = (share - low) / (high - low)
    return (1.0 - part) * known[low].y + part * known[high].y


def with_tangent(problem: Problem, point: Point, following: Following) -> Point:
    """Return the point with its true tangent in place of a secant."""
    if following.predictor == "tangent" or not point.solution.status.converged:
        return point
    tangent, sign = tangent_at(problem, point.y, point.tangent, following)
    return replace(point, tangent=tangent, orientation=sign)


def between(
    problem: Problem, before: Point, after: Point, events: Sequence[Event], following: Following
) -> list[Point]:
    """Return the events between two neighbouring points of a branch, located, in the order of travel.

    An event that happens twice between two points leaves no change of sign and is not seen: take shorter steps.
    """
    if not after.solution.status.converged:
        return []
    measure = measure_at(before.x, following)
    found = []
    for event in events:
        first, last = event.value(before), event.value(after)
        if first * last < 0.0 or (last == 0.0 and first != 0.0):
            found.append(located(problem, before, after, event, following))
    chord = measure.row(after.y - before.y)
    return sorted(found, key=lambda point: float(chord @ np.subtract(point.y, before.y)))
