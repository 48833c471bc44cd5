"""Branches of ``F(x, p) = 0`` by pseudo-arc-length continuation (Keller 1977), as a generator of points."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.newton import Newton, Solution, newton, solve_signed
from stickslip.solve.status import Status

SHARP_TURN = (
    0.5  # cosine between successive tangents below which the step is shortened, as far as that goes
)
BACKWARD = (
    0.1  # share of the range by which a branch may fall back behind its start before it is left
)
SMOOTH_TURN = 0.9  # cosine above which a change of orientation is a bifurcation, not a corner


class ParameterEvaluation(Protocol):
    """Residual, Jacobian and parameter derivative at one state."""

    @property
    def residual(self) -> FloatArray: ...  # noqa: D102

    @property
    def jac(self) -> FloatArray: ...  # noqa: D102

    @property
    def jac_p(self) -> FloatArray: ...  # noqa: D102

    @property
    def seconds_contact(self) -> float: ...  # noqa: D102


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


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a branch with all that is needed to go on from it.

    Attributes
    ----------
    x, p
        The solution and its parameter.
    tangent
        (n + 1,) direction of the branch, unit length in the measure of the step control; the last entry is that of p.
    step
        Length of the next step.
    solution
        How Newton ended; x is a solution only if its status says so.
    orientation
        Sign of the determinant of the Jacobian bordered by the tangent; 0: not known yet.
    """

    x: FloatArray
    p: float
    tangent: FloatArray
    step: float
    solution: Solution
    orientation: float = 0.0


@dataclass(frozen=True, eq=False)
class _Bordered:
    """The equation with the arc-length condition below it.

    [ J   r_p ]
    [ cᵀ  c_p ]
    """

    residual: FloatArray
    jac: FloatArray
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


def _measure(x: FloatArray, weights: FloatArray, control: StepControl) -> _Measure:
    size = float(np.linalg.norm(weights * x))
    return _Measure(weights / size if size > 0 else weights, 1.0 / control.scale)


def _border(problem: Problem, y: FloatArray, row: FloatArray, value: float) -> _Bordered:
    at = problem.linearise(y[:-1], float(y[-1]))
    n = at.residual.size
    jac = np.empty((n + 1, n + 1), order="F")
    jac[:n, :n] = at.jac
    jac[:n, n] = at.jac_p
    jac[n] = row
    return _Bordered(np.append(at.residual, row @ y - value), jac, at.seconds_contact)


def start_point(
    problem: Problem,
    x: FloatArray,
    p: float,
    options: Newton,
    control: StepControl,
    weights: FloatArray,
) -> Point:
    """Solve at fixed `p` from the guess `x` and find the direction of growing parameter."""
    solution = newton(lambda v: problem.linearise(v, p), x, options)
    upward = np.zeros(x.size + 1)
    upward[-1] = 1.0
    if not solution.status.converged:
        return Point(solution.x, p, upward, control.first, solution)
    measure = _measure(solution.x, weights, control)
    tangent, sign = _tangent(problem, np.append(solution.x, p), upward, measure)
    return Point(solution.x, p, tangent, control.first, solution, sign)


def _tangent(
    problem: Problem, y: FloatArray, previous: FloatArray, measure: _Measure
) -> tuple[FloatArray, float]:
    """Return the unit tangent on the side of `previous` and its orientation; `previous` itself where it is undetermined."""
    at = _border(problem, y, measure.row(previous), 0.0)
    right = np.zeros(y.size)
    right[-1] = 1.0
    tangent, sign = solve_signed(at.jac, right)
    if tangent is None:
        return previous, 0.0
    return tangent / measure.of(tangent), sign


def _oriented(
    tangent: FloatArray, sign: float, point: Point, turn: float
) -> tuple[FloatArray, float]:
    """Keep the direction of travel across a kink.

    Where contact states change the branch may turn back sharply, so that the tangent nearest to the old one leads back to the kink. The
    sign of the bordered determinant is the same along a piecewise smooth path (Allgower & Georg 1990); a sign that changes although the
    tangent hardly turned is a bifurcation point, which is passed straight on.
    """
    reversed_ = sign * point.orientation < 0.0 and turn < SMOOTH_TURN
    return (-tangent, -sign) if reversed_ else (tangent, sign)


def trace(
    problem: Problem,
    start: Point,
    end: float,
    *,
    options: Newton,
    control: StepControl,
    weights: FloatArray,
) -> Iterator[Point]:
    """Follow a branch from `start` until its parameter passes `end`.

    Parameters
    ----------
    problem
        The equation.
    start
        A converged point with its tangent; it is not yielded again.
    end
        Parameter value of the last point, which is solved exactly there.
    options, control
        Corrector and step control.
    weights
        (n,) share of each unknown in the length of a step.

    Yields
    ------
    Point
        Each point that was reached, until the end, `max_points`, or a return to before the start. If no step, however short, converges, a last point with status
        `Status.STEP_TOO_SMALL` and the state it came from.
    """
    point = start
    # the tangent is oriented towards growing p; a branch to the left starts against it
    if (end - start.p) * start.tangent[-1] < 0:
        point = replace(point, tangent=-start.tangent, orientation=-start.orientation)
    if point.orientation == 0.0:
        measure = _measure(point.x, weights, control)
        _, sign = _tangent(problem, np.append(point.x, point.p), point.tangent, measure)
        point = replace(point, orientation=sign)
    for _ in range(control.max_points):
        point = _advance(problem, point, end, options, control, weights)
        yield point
        left = (point.p - start.p) * (end - start.p) < -BACKWARD * (end - start.p) ** 2
        if not point.solution.status.converged or point.p == end or left:
            return


def _advance(
    problem: Problem,
    point: Point,
    end: float,
    options: Newton,
    control: StepControl,
    weights: FloatArray,
) -> Point:
    measure = _measure(point.x, weights, control)
    unit = point.tangent / measure.of(point.tangent)
    y = np.append(point.x, point.p)
    step = point.step
    contact = linear = 0.0
    iterations = 0
    while step >= control.smallest:
        guess = y + step * unit
        row = measure.row(unit)
        passes = (guess[-1] - end) * (point.p - end) <= 0.0
        if passes:
            guess = y + (end - point.p) / unit[-1] * unit
            row = np.append(np.zeros(point.x.size), 1.0 / control.scale)
        value = float(row @ guess)
        solution = newton(lambda v, r=row, b=value: _border(problem, v, r, b), guess, options)  # type: ignore[misc]
        contact, linear = contact + solution.seconds_contact, linear + solution.seconds_linear
        iterations += solution.iterations
        p = end if passes else float(solution.x[-1])
        # a corrector that slides past the end of the range is taken back like one that slides too far
        near = measure.of(solution.x - y) <= 4.0 * step and (p - end) * (point.p - end) >= 0.0
        if solution.status.converged and near:
            x = solution.x[:-1]
            tangent, sign = _tangent(problem, solution.x, unit, _measure(x, weights, control))
            turn = _cosine(unit, tangent, measure)
            if turn > SHARP_TURN or step < 4 * control.smallest:
                next_step = _next_step(step, solution.iterations, turn, control)
                tangent, sign = _oriented(tangent, sign, point, turn)
                spent = replace(
                    solution,
                    x=x,
                    iterations=iterations,
                    seconds_contact=contact,
                    seconds_linear=linear,
                )
                return Point(x, p, tangent, next_step, spent, sign)
        step *= 0.5
    failed = Solution(point.x, Status.STEP_TOO_SMALL, iterations, np.nan, contact, linear)
    return Point(point.x, point.p, point.tangent, control.first, failed, point.orientation)


def _cosine(a: FloatArray, b: FloatArray, measure: _Measure) -> float:
    return float(measure.row(a) @ b) / (measure.of(a) * measure.of(b))


def _next_step(step: float, iterations: int, turn: float, control: StepControl) -> float:
    """Grow after easy corrections, shrink where Newton works hard or the branch turns."""
    factor = 1.5 if iterations <= 4 else 1.0 if iterations <= 8 else 0.6
    if turn < 0.97:
        factor = min(factor, 0.7)
    return float(np.clip(step * factor, control.smallest, control.largest))


def step_to(
    problem: Problem,
    point: Point,
    p: float,
    options: Newton,
    control: StepControl,
    weights: FloatArray,
) -> Point:
    """Go from `point` to the parameter value `p`: one predicted step, or the branch between where that fails.

    Returns
    -------
    Point
        The point at `p`; if neither way converges, one at `p` with the status of the direct attempt and its last iterate.
    """
    if point.p == p:
        return point
    guess = point.x
    if abs(point.tangent[-1]) > 0:
        guess = point.x + (p - point.p) / point.tangent[-1] * point.tangent[:-1]
    direct = start_point(problem, guess, p, options, control, weights)
    if direct.solution.status.converged:
        return direct
    last, iterations = direct, direct.solution.iterations
    contact, linear = direct.solution.seconds_contact, direct.solution.seconds_linear
    for last in trace(problem, point, p, options=options, control=control, weights=weights):
        iterations += last.solution.iterations
        contact, linear = (
            contact + last.solution.seconds_contact,
            linear + last.solution.seconds_linear,
        )
    reached = last.p == p and last.solution.status.converged
    ended = last if reached else direct
    solution = replace(
        ended.solution, iterations=iterations, seconds_contact=contact, seconds_linear=linear
    )
    return replace(ended, p=p, solution=solution)
