"""Folds and other events of a branch, located between two points."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.optimize

from stickslip.arrays import FloatArray
from stickslip.solve.branch import Following, Point, Problem, measure_at, tangent_at
from stickslip.solve.newton_method import Solution, charged, newton
from stickslip.solve.steps import across


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """An event of a branch: a sign change of a function of its points.

    Parameters
    ----------
    name
        Name, which becomes the `mark` of located points.
    value
        Function of a point of the branch; it gets the point with its true tangent for any predictor.
    tolerance
        Accuracy of the location, a length along the branch.
    """

    name: str
    value: Callable[[Point], float]
    tolerance: float = 1e-10


FOLD = Mark(name="fold", value=lambda point: float(point.tangent[-1]))
NEIGHBOUR_TOLERANCES = 10.0  # largest distance of a mark's neighbours, in tolerances
HALVINGS = 60  # largest number of chords between the neighbours


class _LostError(Exception):
    """The corrector failed between two points of the branch."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(solution.status.advice)
        self.solution = solution


def located(problem: Problem, before: Point, after: Point, mark: Mark, following: Following) -> Point:
    """Locate an event between two neighbouring points of a branch.

    Points between them are solved on planes normal to the chord, which meet the branch even at corners. If the function
    jumps, as the tangent does at a corner, the jump is located.

    Parameters
    ----------
    problem
        The equation.
    before, after
        Points with values of different sign, with their tangents.
    mark
        The event.
    following
        Corrector and measure of length.

    Returns
    -------
    Point
        The point at which the value is zero or jumps, with the name of the event. If the corrector fails in between, a
        point with the status of the failure and the state before it.
    """
    spent: list[Solution] = []
    try:
        point, low, high = _narrowed(problem, before, after, mark, following, spent)
        side = np.sign(mark.value(before))
        for _ in range(HALVINGS):
            measure = measure_at(low.x, following)
            if measure.of(high.y - low.y) <= NEIGHBOUR_TOLERANCES * mark.tolerance:
                break
            # at a sharp corner, planes meet both of its sides, and the neighbours are far apart: each chord between the
            # last neighbours cuts off a part that contains the corner
            point = _on_chord(problem, low, high, 0.5, following, spent)
            if np.sign(mark.value(point)) == side:
                low = point
            else:
                high = point
    except _LostError as lost:
        point = replace(before, solution=replace(lost.solution, x=before.x))
    return replace(point, mark=mark.name, solution=charged(point.solution, spent))


def _narrowed(
    problem: Problem, before: Point, after: Point, mark: Mark, following: Following, spent: list[Solution]
) -> tuple[Point, Point, Point]:
    """Search for the mark on planes across one chord (Brent 1973); return it and its neighbours on both sides."""
    known = {0.0: before, 1.0: after}

    def value_at(share: float) -> float:
        if share not in known:
            low = max(s for s in known if s < share)
            high = min(s for s in known if s > share)
            part = (share - low) / (high - low)
            guess = known[low].y + part * (known[high].y - known[low].y)
            known[share] = _on_chord(problem, before, after, share, following, spent, guess)
        return mark.value(known[share])

    length = measure_at(before.x, following).of(after.y - before.y)
    xtol = mark.tolerance / length
    root = float(scipy.optimize.brentq(lambda s: value_at(float(s)), 0.0, 1.0, xtol=xtol))
    value_at(root)
    side = np.sign(value_at(0.0))
    low = max(s for s in known if s <= root and np.sign(value_at(s)) == side)
    high = min(s for s in known if s >= root and np.sign(value_at(s)) != side)
    return known[root], known[low], known[high]


def _on_chord(
    problem: Problem,
    before: Point,
    after: Point,
    share: float,
    following: Following,
    spent: list[Solution],
    guess: FloatArray | None = None,
) -> Point:
    """Solve on the plane across the chord at a share of its length."""
    measure = measure_at(before.x, following)
    chord = after.y - before.y
    length = measure.of(chord)
    # the condition is a length: a share of a short chord would be lost in rounding
    row = measure.row(chord / length)
    guess = before.y + share * chord if guess is None else guess
    value = float(row @ before.y) + share * length
    solution = newton(lambda v: across(problem, v, row, value), guess, following.newton)
    spent.append(solution)
    if not solution.status.converged:
        raise _LostError(solution)
    tangent, sign = tangent_at(problem, solution.x, chord / length, following)
    # near a sharp corner the chord may point against the direction of travel, which the determinant shows
    if sign * before.orientation < 0.0 < before.orientation * after.orientation:
        tangent, sign = -tangent, -sign
    found = replace(solution, x=solution.x[:-1])
    return Point(found.x, float(solution.x[-1]), tangent, before.step, found, sign)


def with_tangent(problem: Problem, point: Point, following: Following) -> Point:
    """Return the point with its true tangent instead of a secant."""
    if following.predictor == "tangent" or not point.solution.status.converged:
        return point
    tangent, sign = tangent_at(problem, point.y, point.tangent, following)
    return replace(point, tangent=tangent, orientation=sign)


def between(problem: Problem, before: Point, after: Point, marks: Sequence[Mark], following: Following) -> list[Point]:
    """Locate the events between two neighbouring points of a branch; return them in the order of travel.

    A function with two sign changes between the points is missed, unless steps are shorter.
    """
    if not after.solution.status.converged:
        return []
    measure = measure_at(before.x, following)
    found = []
    for mark in marks:
        first, last = mark.value(before), mark.value(after)
        if first * last < 0.0 or (last == 0.0 and first != 0.0):
            found.append(located(problem, before, after, mark, following))
    chord = measure.row(after.y - before.y)
    return sorted(found, key=lambda point: float(chord @ np.subtract(point.y, before.y)))
