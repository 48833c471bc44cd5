"""Branches of ``F(x, p) = 0`` by pseudo-arc-length continuation (Keller 1977), as a generator of points."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.linear import Bordered, Jacobian, LinearSolver
from stickslip.solve.newton import Newton, Solution, newton
from stickslip.solve.status import Status

SHARP_TURN = (
    0.5  # cosine between successive tangents below which the step is shortened, as far as that goes
)
SMOOTH_TURN = 0.9  # cosine above which a change of orientation is a bifurcation, not a corner
LOOKS_AHEAD = (
    1.0,
    4.0,
    16.0,
    64.0,
)  # smallest steps at which the far side of a corner is looked for
LEAVES_BY = (4.0, 16.0, 1.0, 64.0)  # smallest steps taken along the far side


class ParameterEvaluation(Protocol):
    """Residual, Jacobian and parameter derivative at one state."""

    @property
    def residual(self) -> FloatArray:
        """(n,) residual."""
        ...

    @property
    def jac(self) -> Jacobian:
        """(n, n) derivative by x."""
        ...

    @property
    def jac_p(self) -> FloatArray:
        """(n,) derivative by p."""
        ...

    @property
    def seconds_contact(self) -> float:
        """Time spent in contact forces."""
        ...


class Problem(Protocol):
    """An equation with one parameter."""

    def linearise(self, x: FloatArray, p: float) -> ParameterEvaluation:
        """Evaluate everything at (x, p)."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StepControl:
    """How far a branch is followed in one step.

    Length is measured in changes of x relative to its own size and in changes of p relative to `scale`.

    Parameters
    ----------
    scale
        Change of the parameter that counts as length one.
    first, smallest, largest
        Step lengths.
    max_points
        Where to stop a branch that does not reach its end.
    """

    scale: float
    first: float = 0.1
    smallest: float = 1e-3
    largest: float = 0.25
    max_points: int = 500


@dataclass(frozen=True, slots=True, kw_only=True)
class Following:
    """How a branch is followed: corrector, steps, and what makes length.

    Parameters
    ----------
    newton
        Corrector.
    control
        Step control.
    weights
        (n,) share of each unknown in the length of a step.
    """

    newton: Newton
    control: StepControl
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a branch with all that is needed to go on from it.

    Attributes
    ----------
    x, p
        The solution and its parameter.
    tangent
        (n + 1,) direction of travel, unit length in the measure of the step control; the last entry is that of p.
    step
        Length of the next step.
    solution
        How Newton ended; x is a solution only if its status says so.
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent; it stays the same along a path.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    solution: Solution
    orientation: float


@dataclass(frozen=True, eq=False)
class _Across:
    """The equation with the arc-length condition below it."""

    residual: FloatArray
    jac: Bordered
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class _Measure:
    """Weights that make lengths: of x (per entry) and of p."""

    x: FloatArray
    p: float

    def of(self, vector: FloatArray) -> float:
        return float(np.sqrt(self.row(vector) @ vector))

    def row(self, vector: FloatArray) -> FloatArray:
        """Return the row whose product with another vector is their inner product."""
        return np.append(self.x**2 * vector[:-1], self.p**2 * vector[-1])

    def cosine(self, a: FloatArray, b: FloatArray) -> float:
        return float(self.row(a) @ b) / (self.of(a) * self.of(b))


def _measure(x: FloatArray, following: Following) -> _Measure:
    weights = following.weights
    size = float(np.linalg.norm(weights * x))
    return _Measure(weights / size if size > 0 else weights, 1.0 / following.control.scale)


def _across(problem: Problem, y: FloatArray, row: FloatArray, value: float) -> _Across:
    at = problem.linearise(y[:-1], float(y[-1]))
    jac = Bordered(at.jac, at.jac_p, row[:-1], float(row[-1]))
    return _Across(np.append(at.residual, row @ y - value), jac, at.seconds_contact)


def start_point(problem: Problem, x: FloatArray, p: float, following: Following) -> Point:
    """Solve at fixed `p` from the guess `x` and find the direction of growing parameter."""
    solution = newton(lambda v: problem.linearise(v, p), x, following.newton)
    upward = np.zeros(x.size + 1)
    upward[-1] = 1.0
    first = following.control.first
    if not solution.status.converged:
        return Point(solution.x, p, upward, first, solution, 0.0)
    measure = _measure(solution.x, following)
    tangent, sign = _tangent(
        problem, np.append(solution.x, p), upward, measure, following.newton.linear
    )
    return Point(solution.x, p, tangent, first, solution, sign)


def reversed_point(point: Point) -> Point:
    """Return the point looking the other way along its branch."""
    return replace(point, tangent=-point.tangent, orientation=-point.orientation)


def trace(problem: Problem, start: Point, end: float, following: Following) -> Iterator[Point]:
    """Follow a branch from `start`, in the direction of its tangent, until its parameter passes `end`.

    Parameters
    ----------
    problem
        The equation.
    start
        A converged point with its tangent; it is not yielded again.
    end
        Parameter value of the last point, which is solved exactly there.
    following
        Corrector, step control, weights.

    Yields
    ------
    Point
        Each point that was reached, until the end or `max_points`. If no step, however short, converges, a last point with
        status `Status.STEP_TOO_SMALL` and the state it came from.
    """
    point = start
    for _ in range(following.control.max_points):
        point = advance(problem, point, end, following)
        yield point
        if not point.solution.status.converged or point.p == end:
            return


def advance(problem: Problem, point: Point, end: float, following: Following) -> Point:
    """Take one step from `point` along its branch; see `trace`."""
    control = following.control
    measure = _measure(point.x, following)
    unit = point.tangent / measure.of(point.tangent)
    step = point.step
    spent: list[Solution] = []
    while step >= control.smallest:
        new = _step(problem, point, unit, step, end, following)
        spent.append(new.solution)
        if new.solution.status.converged:
            turn = measure.cosine(unit, new.tangent)
            if abs(turn) > SHARP_TURN or step < 4 * control.smallest:
                wanted = _next_step(step, new.solution.iterations, abs(turn), control)
                return _with_cost(replace(new, step=wanted), spent)
        step *= 0.5
    new = _round_corner(problem, point, unit, end, following)
    return _with_cost(new, [*spent, new.solution])


def _step(
    problem: Problem, point: Point, unit: FloatArray, step: float, end: float, following: Following
) -> Point:
    """Predict along `unit` and correct across it; the point says whether that worked."""
    measure = _measure(point.x, following)
    y = np.append(point.x, point.p)
    guess = y + step * unit
    row = measure.row(unit)
    passes = (guess[-1] - end) * (point.p - end) <= 0.0
    if passes:
        guess = y + (end - point.p) / unit[-1] * unit
        row = np.append(np.zeros(point.x.size), 1.0 / following.control.scale)
    value = float(row @ guess)
    solution = newton(lambda v: _across(problem, v, row, value), guess, following.newton)
    x, p = solution.x[:-1], end if passes else float(solution.x[-1])
    # a corrector that slides far away, or past the end of the range, has found another piece of the branch
    near = measure.of(solution.x - y) <= 4.0 * step and (p - end) * (point.p - end) >= 0.0
    found = replace(solution, x=x)
    if not (solution.status.converged and near):
        status = Status.STALLED if solution.status.converged else solution.status
        return replace(point, solution=replace(found, x=point.x, status=status))
    tangent, sign = _tangent(
        problem, solution.x, unit, _measure(x, following), following.newton.linear
    )
    # Where contact states change the branch may turn back so sharply that the tangent nearest to the old one leads back to the
    # corner. The sign of the bordered determinant is the same along a piecewise smooth path (Allgower & Georg 1990); a sign
    # that changes although the tangent hardly turned is a bifurcation point, which is passed straight on.
    if sign * point.orientation < 0.0 and measure.cosine(unit, tangent) < SMOOTH_TURN:
        tangent, sign = -tangent, -sign
    return Point(x, p, tangent, step, found, sign)


def _tangent(
    problem: Problem, y: FloatArray, previous: FloatArray, measure: _Measure, linear: LinearSolver
) -> tuple[FloatArray, float]:
    """Return the unit tangent on the side of `previous` and its orientation; `previous` itself where it is undetermined."""
    at = problem.linearise(y[:-1], float(y[-1]))
    row = measure.row(previous)
    right = np.zeros(y.size)
    right[-1] = 1.0
    tangent, sign = linear.solve_bordered(at.jac, at.jac_p, row[:-1], float(row[-1]), right)
    if tangent is None:
        return previous, 0.0
    return tangent / measure.of(tangent), sign


def _round_corner(
    problem: Problem, point: Point, unit: FloatArray, end: float, following: Following
) -> Point:
    """Leave a corner of more than a right angle along its far side.

    No plane across the old tangent meets that side. Its tangent is that of the Jacobian just beyond the corner, oriented as the path
    was.
    """
    smallest = following.control.smallest
    measure = _measure(point.x, following)
    y = np.append(point.x, point.p)
    iterations = 0
    for ahead in LOOKS_AHEAD:
        far, sign = _tangent(
            problem, y + ahead * smallest * unit, unit, measure, following.newton.linear
        )
        if sign == 0.0:
            continue
        if sign * point.orientation < 0.0:
            far = -far
        for share in LEAVES_BY:
            new = _step(problem, point, far, share * smallest, end, following)
            iterations += new.solution.iterations
            if new.solution.status.converged and measure.cosine(far, new.tangent) > SHARP_TURN:
                return replace(
                    new, step=4.0 * smallest, solution=replace(new.solution, iterations=iterations)
                )
    failed = replace(
        point.solution, status=Status.STEP_TOO_SMALL, iterations=iterations, residual_norm=np.nan
    )
    return replace(
        point,
        step=following.control.first,
        solution=replace(failed, seconds_contact=0.0, seconds_linear=0.0),
    )


def _next_step(step: float, iterations: int, turn: float, control: StepControl) -> float:
    """Grow after easy corrections, shrink where Newton works hard or the branch turns."""
    factor = 1.5 if iterations <= 4 else 1.0 if iterations <= 8 else 0.6
    if turn < 0.97:
        factor = min(factor, 0.7)
    return float(np.clip(step * factor, control.smallest, control.largest))


def _with_cost(point: Point, spent: list[Solution]) -> Point:
    """Charge a point with all the attempts that led to it."""
    solution = replace(
        point.solution,
        iterations=sum(s.iterations for s in spent),
        seconds_contact=sum(s.seconds_contact for s in spent),
        seconds_linear=sum(s.seconds_linear for s in spent),
    )
    return replace(point, solution=solution)


def step_to(problem: Problem, point: Point, p: float, following: Following) -> Point:
    """Go from `point`, whose tangent shows growing p, to the value `p`: one predicted step, or the branch between.

    Returns
    -------
    Point
        The point at `p`, its tangent showing growing p; if neither way converges, one at `p` with the status of the direct
        attempt and its last iterate.
    """
    if point.p == p:
        return point
    guess = point.x
    if point.tangent[-1] != 0.0:
        guess = point.x + (p - point.p) / point.tangent[-1] * point.tangent[:-1]
    direct = start_point(problem, guess, p, following)
    if direct.solution.status.converged:
        return direct
    onward = point if p > point.p else reversed_point(point)
    last, spent = onward, [direct.solution]
    for last in trace(problem, onward, p, following):
        spent.append(last.solution)
        # beyond a fold the branch leads away, and what it would reach in the end is another state
        if abs(last.p - p) > abs(point.p - p):
            break
    if last.p != p or not last.solution.status.converged:
        return _with_cost(direct, spent)
    return _with_cost(last if p > point.p else reversed_point(last), spent)
