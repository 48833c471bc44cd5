"""Input and output of the continuation: the curve, its range, and the points on it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.solve.branch import Latest, Problem
from stickslip.solve.continuation import Following, Point, StepControl
from stickslip.solve.newton_method import Newton, Solution

LARGEST = 0.25  # arc length of the largest step: a quarter of the size of the vibration, or `1 / points` of the range
IDLE = 2.0  # points without progress by a step, over the smallest number of points, after which a branch is left
# smallest such number of points: a sharp resonance takes some tens, however few are requested
PATIENCE = 80
BACKWARD = 0.1  # distance of a branch behind its start, over the range, at which it is left

Kind = Literal["point", "audit", "trial", "found", "between"]


@dataclass(frozen=True, eq=False)
class Judged:
    """Estimated truncation error of a solution.

    Attributes
    ----------
    bound
        Bound of the relative error; 0 without forces on the neglected harmonics; NaN if unknown.
    asked, start
        Further harmonics requested by a strategy, and a start for their solution; empty without a request.
    """

    bound: float = np.nan
    asked: tuple[int, ...] = ()
    start: ComplexArray | None = None


@dataclass(frozen=True, eq=False)
class Followed:
    """Solution in the continuation of a branch, or a failed attempt.

    Attributes
    ----------
    kind
        ``point``: a point of the branch, which replaces all points with its index or a higher one. ``audit``: the same
        motion with more harmonics, for comparison. ``trial``: the same motion with fewer harmonics, from which the
        branch continues. ``found``: replaces the failed point of its index only. ``between``: follows the point of its
        index, added after the end of the branch.
    index
        Position along the branch.
    level
        Level of the harmonics.
    point
        Solution, tangent and step.
    judged
        Estimated error of a ``point``, ``trial`` or ``found``.
    seconds
        Computing time, s.
    """

    kind: Kind
    index: int
    level: int
    point: Point
    judged: Judged
    seconds: float

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""
        return self.point.solution.status.converged

    @property
    def p(self) -> float:
        """Value of the parameter."""
        return self.point.p

    def taking(self, seconds: float) -> "Followed":
        """Return the solution with its computing time, s."""
        return Followed(self.kind, self.index, self.level, self.point, self.judged, seconds)


class Curve(Protocol):
    """Curve of solutions of one equation with several levels of harmonics.

    The default methods suit a curve with one level.
    """

    @property
    def levels(self) -> int:
        """Number of levels, at least one."""
        return 1

    def problem(self, level: int) -> Problem:
        """Return the equation."""
        ...

    def following(self, level: int) -> Following:
        """Return the continuation options of a level."""
        ...

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve at a value that no branch reached.

        `effort` is the share of the Newton steps of `steps_at_most`; 0: Newton's method only.
        """
        ...

    def lifted(self, x: FloatArray, level: int, to: int) -> FloatArray:
        """Convert unknowns from one level to another."""
        return x

    def starts(self, known: Followed, to: int) -> list[FloatArray]:
        """Return starts for a known solution on another level, the most promising first."""
        return [self.lifted(known.point.x, known.level, to)]

    def cost(self, level: int) -> float:
        """Return the work of a Newton step, relative to that of a small system."""
        return 1.0

    def judge(self, level: int, point: Point, latest: Latest) -> Judged:
        """Estimate the error of a solution."""
        return Judged()

    def at_the_cap(self, level: int, point: Point) -> Judged:
        """Estimate the error of a solution on the last level from a solution with fewer harmonics."""
        return Judged()

    def quiet(self, level: int, judged: Judged) -> bool:
        """Whether a solution needs no more harmonics by its estimated error."""
        return True

    def agree(self, fewer: Followed, more: Followed) -> bool:
        """Whether the solutions of two levels are the same motion."""
        return True

    def alike(self, one: Followed, other: Followed) -> bool:
        """Whether two motions at one value of the parameter differ by no more than the allowed error."""
        return False

    def near(self, fewer: Followed, more: Followed) -> bool:
        """Whether the solutions of two levels are too close to lie on different sheets of the branch."""
        return True

    def stored(self, found: Followed) -> Followed:
        """Return a solution in the form in which the journal restores it.

        An interrupted run thus continues identically.
        """
        return found

    def height(self, found: Followed) -> float:
        """Return the quantity whose maxima are audited."""
        return 0.0


Begin = Callable[[float, Sequence[FloatArray], float], Solution]


@dataclass(frozen=True, eq=False)
class OneLevel(Curve):
    """Curve with fixed harmonics.

    Parameters
    ----------
    equation
        Equation of the curve.
    way
        Continuation options.
    begin
        Function that solves at a value that no branch reached, from nearby states. Its last argument is the effort, as
        in `stickslip.response.continuation.starting_solutions.without_branch`.
    """

    equation: Problem
    way: Following
    begin: Begin

    def problem(self, level: int) -> Problem:
        """Return the equation."""
        return self.equation

    def following(self, level: int) -> Following:
        """Return the continuation options of a level."""
        return self.way

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve at a value that no branch reached."""
        return self.begin(p, [n.point.x for n in near], effort)


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """Parameter range of a branch, and its steps.

    Parameters
    ----------
    first, last
        Values of the parameter; the last may be the smaller one.
    points
        Smallest number of points.
    listed
        Values to step through, in their order; empty: continuation by arc length.
    leaves
        Whether to leave a branch that leads back or makes no progress, and restart further on. Otherwise it is followed
        to its end.
    """

    first: float
    last: float
    points: int = 40
    listed: tuple[float, ...] = ()
    leaves: bool = True

    @property
    def forward(self) -> float:
        """1 for a growing parameter, -1 for a falling one."""
        return 1.0 if self.last >= self.first else -1.0

    @property
    def gap(self) -> float:
        """Change of the parameter in the longest step."""
        return (self.last - self.first) / self.points

    def before(self, one: float, other: float) -> bool:
        """Whether one value comes before another along the route."""
        return self.forward * one < self.forward * other

    def farthest(self, values: Sequence[float]) -> float:
        """Return the value farthest along the route."""
        return max(values, key=lambda p: self.forward * p)

    def onward(self, values: Sequence[float]) -> float:
        """Return the value at which a lost branch through `values` is restarted."""
        if self.listed:
            return self.listed[len(values)]
        ahead = self.farthest(values) + self.gap
        return ahead if self.before(ahead, self.last) else self.last

    def idle(self, values: Sequence[float]) -> bool:
        """Whether a branch left the range backwards, or advanced less than a step in its last points.

        Stiff contacts that lift off under little damping may fold a branch hundreds of times within a step. It is then
        left, as a machine would leave it.
        """
        if self.listed or not self.leaves:
            return False
        if self.before(values[-1], self.first - BACKWARD * (self.last - self.first)):
            return True
        count = max(int(IDLE * self.points), PATIENCE)
        ways = [self.forward * p for p in values]
        return len(ways) > count and max(ways) - max(ways[:-count]) < abs(self.gap)


def steps_through(length: float, points: int) -> StepControl:
    """Return the step control with at least `points` steps through a parameter range of this `length`."""
    # a single frequency has zero length and takes no step
    return StepControl(scale=length / (points * LARGEST) or 1.0, first=0.05, largest=LARGEST)


def following_vibration(problem: AnyBalance, control: StepControl, newton: Newton) -> Following:
    """Return the continuation options of a periodic problem."""
    return Following(newton=newton, control=control, weights=vibration_weights(problem))


def vibration_weights(problem: AnyBalance) -> FloatArray:
    """Return the weight of each unknown in the step length.

    It is zero for the static part, which would hide the growth of the vibration.
    """
    weights = np.ones(problem.size)
    weights[: problem.linear.n] = 0.0
    return weights


class Placed(Protocol):
    """Result with a position along a branch: `Followed`, or its stored form."""

    @property
    def kind(self) -> str: ...  # noqa: D102

    @property
    def index(self) -> int: ...  # noqa: D102


P = TypeVar("P", bound=Placed)


def branch_of(every: Iterable[P]) -> list[P]:
    """Return the points of a branch among all results, without replaced ones."""
    branch: list[P] = []
    for one in every:
        if one.kind == "point":
            branch[one.index :] = [one]
        elif one.kind == "found":
            branch[one.index] = one
        elif one.kind == "between":
            branch.insert(one.index + 1, one)
    return branch
