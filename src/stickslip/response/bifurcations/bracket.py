"""A step of a branch between two neighbouring points, in which bifurcations are located."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.solve.branch import Following, Point, measure_at, reversed_point
from stickslip.solve.branch_events import FOLD, Mark, located
from stickslip.solve.continuation import start_point

SAME_SHEET = 0.3  # relative change of a motion by more harmonics beyond which it is another one
APART = 100.0  # tolerances that the last two neighbours may be apart where the branch has no gap


@dataclass(frozen=True, eq=False)
class Stretch:
    """Two neighbouring points of a branch with the same harmonics, and what lies between.

    Parameters
    ----------
    problem
        The forced response.
    balance, following
        Its equation with these harmonics, and how a branch of it is followed.
    before, after
        The two points, their tangents along the branch.
    """

    problem: ForcedProblem
    balance: Balance
    following: Following
    before: Point
    after: Point

    @property
    def folds(self) -> bool:
        """Whether the branch turns back in it."""
        return bool(self.before.tangent[-1] * self.after.tangent[-1] < 0.0)

    @cached_property
    def length(self) -> float:
        """Length of the chord."""
        return measure_at(self.before.x, self.following).of(self.after.y - self.before.y)

    def along(self, point: Point) -> float:
        """Return how far along the chord a point lies, a share of it."""
        row = measure_at(self.before.x, self.following).row(self.after.y - self.before.y)
        return float(row @ (point.y - self.before.y)) / self.length**2

    def between(self, before: Point, after: Point) -> "Stretch":
        """Return a part of it."""
        return Stretch(self.problem, self.balance, self.following, before, after)

    def fold(self) -> Point:
        """Return the fold in it."""
        return located(self.balance, self.before, self.after, FOLD, self.following)

    def where(self, value: Callable[[Point], float], tolerance: float) -> Point:
        """Return the point at which a function of the points changes its sign, or jumps over zero."""
        mark = Mark(name="bifurcation", value=value, tolerance=tolerance)
        return located(self.balance, self.before, self.after, mark, self.following)

    def at(self, share: float, tolerance: float) -> Point:
        """Return its point at a share of the chord."""
        return self.where(lambda point: self.along(point) - share, tolerance)

    def connected(self, low: Point, high: Point, tolerance: float) -> bool:
        """Whether two neighbours of a located point are so near to each other that no gap of the branch lies between."""
        measure = measure_at(low.x, self.following)
        return measure.of(high.y - low.y) <= APART * tolerance

    def forced(self, point: Point) -> ForcedPoint:
        """Return a point of it as one of the response."""
        return forced_point(self.balance, point.solution, "check", 0, point.p, 0.0)


def stretch(problem: ForcedProblem, before: ForcedPoint, after: ForcedPoint) -> Stretch | None:
    """Return the step between two neighbouring points, both with the harmonics of that which has more; None where one of them has no such solution."""
    support = max(before, after, key=lambda p: p.harmonics.size).support
    balance = problem.balance(support)
    following = problem.following(balance)
    ends = [_solved(balance, following, point) for point in (before, after)]
    if ends[0] is None or ends[1] is None:
        return None
    first, last = ends[0], ends[1]
    measure, chord = measure_at(first.x, following), last.y - first.y
    if measure.of(chord) == 0.0:
        return None
    towards = [p if measure.row(chord) @ p.tangent >= 0.0 else reversed_point(p) for p in (first, last)]
    return Stretch(problem, balance, following, towards[0], towards[1])


def _solved(balance: Balance, following: Following, point: ForcedPoint) -> Point | None:
    """Return a point with the harmonics of a balance, its tangent showing growing frequency; None where it has none beside it."""
    x = balance.unknowns(point.coefficients)
    found = start_point(balance, x, point.omega, following)
    if not found.solution.status.converged:
        return None
    near = np.linalg.norm(found.x - x) <= SAME_SHEET * np.linalg.norm(x)
    return found if near else None
