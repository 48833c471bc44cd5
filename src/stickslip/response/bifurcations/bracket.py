"""Segments of a branch that bracket bifurcations, and multipliers sorted to be continuous along a branch."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.response.stability.found import UNIT_TOLERANCE, Stability
from stickslip.solve.branch import Following, Point, measure_at, reversed_point
from stickslip.solve.branch_events import FOLD, Mark, located
from stickslip.solve.continuation import start_point

SAME_SHEET = 0.3  # relative change of a motion by more harmonics above which it is another motion
APART = 100.0  # largest distance of the last two neighbours on a branch without a gap, in tolerances
Examine = Callable[[ForcedProblem, ForcedPoint], Stability]
ON_AXIS = 1e-6  # imaginary part below which a multiplier is real: real multipliers of real matrices have exactly zero
CIRCLE = 1.0 + UNIT_TOLERANCE


@dataclass(frozen=True, eq=False)
class Stretch:
    """Segment of a branch between two neighbouring points with the same harmonics.

    Parameters
    ----------
    problem
        The forced response.
    balance, following
        Equations with these harmonics, and their continuation options.
    before, after
        The two points, with tangents along the branch.
    """

    problem: ForcedProblem
    balance: Balance
    following: Following
    before: Point
    after: Point

    @property
    def folds(self) -> bool:
        """Whether the segment has a fold."""
        return bool(self.before.tangent[-1] * self.after.tangent[-1] < 0.0)

    @cached_property
    def length(self) -> float:
        """Length of the chord."""
        return measure_at(self.before.x, self.following).of(self.after.y - self.before.y)

    def along(self, point: Point) -> float:
        """Return the position of a point along the chord, as a share of its length."""
        row = measure_at(self.before.x, self.following).row(self.after.y - self.before.y)
        return float(row @ (point.y - self.before.y)) / self.length**2

    def between(self, before: Point, after: Point) -> "Stretch":
        """Return the segment between two of its points."""
        return Stretch(self.problem, self.balance, self.following, before, after)

    def fold(self) -> Point:
        """Return the fold of the segment."""
        return located(self.balance, self.before, self.after, FOLD, self.following)

    def where(self, value: Callable[[Point], float], tolerance: float) -> Point:
        """Return the point at which a function of the point changes its sign, continuously or by a jump."""
        mark = Mark(name="bifurcation", value=value, tolerance=tolerance)
        return located(self.balance, self.before, self.after, mark, self.following)

    def at(self, share: float, tolerance: float) -> Point:
        """Return the point at a share of the chord."""
        return self.where(lambda point: self.along(point) - share, tolerance)

    def connected(self, low: Point, high: Point, tolerance: float) -> bool:
        """Whether the two neighbours of a located point are close enough to belong to one connected branch."""
        measure = measure_at(low.x, self.following)
        return measure.of(high.y - low.y) <= APART * tolerance

    def forced(self, point: Point) -> ForcedPoint:
        """Return a point of the segment as a point of the response."""
        return forced_point(self.balance, point.solution, "check", 0, point.p, 0.0)


def stretch(problem: ForcedProblem, before: ForcedPoint, after: ForcedPoint) -> Stretch | None:
    """Return the segment between two neighbouring points, both solved with the larger set of harmonics.

    It is None without such solutions.
    """
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
    """Return a point solved with the harmonics of a balance; None without a nearby solution.

    Its tangent points towards growing frequency.
    """
    x = balance.unknowns(point.coefficients)
    found = start_point(balance, x, point.omega, following)
    if not found.solution.status.converged:
        return None
    near = np.linalg.norm(found.x - x) <= SAME_SHEET * np.linalg.norm(x)
    return found if near else None


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Multipliers of a motion, the largest first.

    Parameters
    ----------
    values, errors
        (k,) multipliers, and their error bounds.
    """

    values: ComplexArray
    errors: FloatArray

    @property
    def outside(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int(np.count_nonzero(np.abs(self.values) > CIRCLE))

    def excess(self, k: int) -> float:
        """Return the k-th modulus (from 0) minus 1."""
        return float(abs(self.values[k])) - CIRCLE if k < self.values.size else -1.0

    def known(self, k: int) -> bool:
        """Whether the k-th multiplier, with its error, lies on one side of the unit circle."""
        if k >= self.values.size:
            return True
        return bool(self.errors[k] < abs(self.excess(k)))

    def rough(self, k: int, error: float) -> bool:
        """Whether the k-th multiplier may lie on either side of the unit circle and has an error above `error`."""
        return k < self.values.size and not self.known(k) and bool(self.errors[k] > error)

    def of_place(self, k: int) -> tuple[complex, float]:
        """Return the k-th multiplier and its error; zero where there are fewer."""
        if k >= self.values.size:
            return 0.0j, 0.0
        return complex(self.values[k]), float(self.errors[k])


def neutral_of(found: Stability) -> int:
    """Return the number of multipliers that are 1."""
    return found.floquet.neutral


def spectrum(found: Stability, neutral: int) -> Spectrum:
    """Return the multipliers of a motion without the `neutral` ones nearest to 1."""
    values, errors = found.floquet.multipliers, found.errors
    left = np.sort(np.argsort(np.abs(values - 1.0), kind="stable")[neutral:])
    order = left[np.argsort(-np.abs(values[left]), kind="stable")]
    return Spectrum(values[order], errors[order])


def nearest_to_one(found: Stability) -> tuple[complex, float]:
    """Return the multiplier nearest to 1, which belongs to a fold, and its error."""
    values = found.floquet.multipliers
    if found.unknown or not values.size:
        return complex(np.nan), np.inf
    at = int(np.argmin(np.abs(values - 1.0)))
    return complex(values[at]), float(found.errors[at])
