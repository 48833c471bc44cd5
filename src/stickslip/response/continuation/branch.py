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
IDLE = 2.0  # multiples of the smallest number of points without a step's gain after which a branch is left
# points that it is given in any case: a sharp resonance takes some tens of them, however few were asked for
PATIENCE = 80
BACKWARD = 0.1  # share of the range by which a branch may fall back behind its start

Kind = Literal["point", "audit", "trial", "found", "between"]


@dataclass(frozen=True, eq=False)
class Judged:
    """What is known of the error of a solution.

    Attributes
    ----------
    bound
        Of its relative error; 0 where nothing acts on the harmonics left out; NaN where nobody can tell.
    asked, start
        What a strategy of harmonic selection said beside it, where it is one.
    """

    bound: float = np.nan
    asked: tuple[int, ...] = ()
    start: ComplexArray | None = None


@dataclass(frozen=True, eq=False)
class Followed:
    """One solution on the way, or why there is none.

    Attributes
    ----------
    kind
        ``point``: a point of the branch; it takes the place of all that had its index or a higher one. ``audit``: the same motion with more harmonics, to
        compare. ``trial``: the same with fewer, from which the branch goes on. ``found``: takes the place of the
        point of its index alone, which was no solution. ``between``: stands behind the point of its index, once the branch is at its end.
    index
        Position along the branch.
    level
        Of its harmonics.
    point
        The solution and where the branch goes on.
    judged
        Of a ``point``, ``trial`` or ``found``.
    seconds
        What it took.
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
        """The parameter."""
        return self.point.p

    def taking(self, seconds: float) -> "Followed":
        """Return the same with what it took."""
        return Followed(self.kind, self.index, self.level, self.point, self.judged, seconds)


class Curve(Protocol):
    """What is followed: one equation with several levels of harmonics; what is said here of levels holds where there is only one."""

    @property
    def levels(self) -> int:
        """Number of levels, at least one."""
        return 1

    def problem(self, level: int) -> Problem:
        """Return the equation."""
        ...

    def following(self, level: int) -> Following:
        """Return how its branch is followed."""
        ...

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve where no branch leads, by all that may help with a share `effort` of the Newton steps of `steps_at_most`; 0: by the corrector alone."""
        ...

    def lifted(self, x: FloatArray, level: int, to: int) -> FloatArray:
        """Return unknowns of one level as those of another."""
        return x

    def starts(self, known: Followed, to: int) -> list[FloatArray]:
        """Return states from which a known solution is solved on another level, the likeliest first."""
        return [self.lifted(known.point.x, known.level, to)]

    def cost(self, level: int) -> float:
        """Return the work of a Newton step, beside that of a small system."""
        return 1.0

    def judge(self, level: int, point: Point, latest: Latest) -> Judged:
        """Judge the error of a solution."""
        return Judged()

    def at_the_cap(self, level: int, point: Point) -> Judged:
        """Judge a solution where more harmonics are not to be had, by fewer."""
        return Judged()

    def quiet(self, level: int, judged: Judged) -> bool:
        """Whether a solution needs no more harmonics."""
        return True

    def agree(self, fewer: Followed, more: Followed) -> bool:
        """Whether two levels tell the same motion."""
        return True

    def alike(self, one: Followed, other: Followed) -> bool:
        """Whether two motions at one value of the parameter differ by no more than the error that is allowed."""
        return False

    def near(self, fewer: Followed, more: Followed) -> bool:
        """Whether they differ by so little that they cannot stand on different sheets."""
        return True

    def stored(self, found: Followed) -> Followed:
        """Return a solution as it comes back from where it was written down, which rounds: what an interrupted run goes on from."""
        return found

    def height(self, found: Followed) -> float:
        """Return what maxima are looked for in."""
        return 0.0


Begin = Callable[[float, Sequence[FloatArray], float], Solution]


@dataclass(frozen=True, eq=False)
class OneLevel(Curve):
    """A curve whose harmonics stay as they are.

    Parameters
    ----------
    equation
        What is solved.
    way
        How its branch is followed.
    begin
        Solves a value of the parameter to which no branch leads, from states that may be near; the last argument: effort, as for `stickslip.response.continuation.starting_solutions.without_branch`.
    """

    equation: Problem
    way: Following
    begin: Begin

    def problem(self, level: int) -> Problem:
        """Return the equation."""
        return self.equation

    def following(self, level: int) -> Following:
        """Return how its branch is followed."""
        return self.way

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve where no branch leads."""
        return self.begin(p, [n.point.x for n in near], effort)


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """Where a branch begins and ends.

    Parameters
    ----------
    first, last
        Values of the parameter; the last may be the smaller one.
    points
        Smallest number of points.
    listed
        Values to step through, in their order; empty: by arc length.
    leaves
        Whether a branch that leads back, or nowhere for long, is left and taken up further on; otherwise it is followed to where it leads.
    """

    first: float
    last: float
    points: int = 40
    listed: tuple[float, ...] = ()
    leaves: bool = True

    @property
    def forward(self) -> float:
        """1 where the parameter grows on the way, -1 where it falls."""
        return 1.0 if self.last >= self.first else -1.0

    @property
    def gap(self) -> float:
        """Change of the parameter in the longest step."""
        return (self.last - self.first) / self.points

    def before(self, one: float, other: float) -> bool:
        """Whether one value comes before another on the way."""
        return self.forward * one < self.forward * other

    def farthest(self, values: Sequence[float]) -> float:
        """Return which of some values lies farthest along the way."""
        return max(values, key=lambda p: self.forward * p)

    def onward(self, values: Sequence[float]) -> float:
        """Return the value at which a branch through some values is taken up where it was lost."""
        if self.listed:
            return self.listed[len(values)]
        ahead = self.farthest(values) + self.gap
        return ahead if self.before(ahead, self.last) else self.last

    def idle(self, values: Sequence[float]) -> bool:
        """Whether a branch left the range backwards, or gained less than a step in its last points.

        Stiff contacts that lift off under little damping fold it hundreds of times within a step: there it is left, as a machine would leave it.
        """
        if self.listed or not self.leaves:
            return False
        if self.before(values[-1], self.first - BACKWARD * (self.last - self.first)):
            return True
        count = max(int(IDLE * self.points), PATIENCE)
        ways = [self.forward * p for p in values]
        return len(ways) > count and max(ways) - max(ways[:-count]) < abs(self.gap)


def steps_through(length: float, points: int) -> StepControl:
    """Return the step control that takes `points` steps or more through a range of the parameter of some `length`."""
    # a range of a single frequency has no length, and no step is taken in it
    return StepControl(scale=length / (points * LARGEST) or 1.0, first=0.05, largest=LARGEST)


def following_vibration(problem: AnyBalance, control: StepControl, newton: Newton) -> Following:
    """Return how a branch of a periodic problem is followed."""
    return Following(newton=newton, control=control, weights=vibration_weights(problem))


def vibration_weights(problem: AnyBalance) -> FloatArray:
    """Return the share of each unknown in the length of a step: the static part would hide the growth of the vibration."""
    weights = np.ones(problem.size)
    weights[: problem.linear.n] = 0.0
    return weights


class Placed(Protocol):
    """What has its place along a branch: `Followed`, or what is kept of it."""

    @property
    def kind(self) -> str: ...  # noqa: D102

    @property
    def index(self) -> int: ...  # noqa: D102


P = TypeVar("P", bound=Placed)


def branch_of(every: Iterable[P]) -> list[P]:
    """Return the points of a branch among all that were found on the way: those that no later one took the place of."""
    branch: list[P] = []
    for one in every:
        if one.kind == "point":
            branch[one.index :] = [one]
        elif one.kind == "found":
            branch[one.index] = one
        elif one.kind == "between":
            branch.insert(one.index + 1, one)
    return branch
