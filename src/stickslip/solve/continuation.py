"""Continuation of branches of ``F(x, p) = 0`` as a generator of points, by default by arc length (Keller 1977)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.branch import (
    Following,
    Latest,
    Measure,
    ParameterEvaluation,
    Parametrisation,
    Point,
    Predictor,
    Problem,
    StepControl,
    measure_at,
    reversed_point,
    tangent_at,
    upward,
)
from stickslip.solve.branch_events import FOLD, Mark, between, located, with_tangent
from stickslip.solve.chord_newton import LastFactors
from stickslip.solve.newton_method import Solution, charged, newton
from stickslip.solve.status import Rung
from stickslip.solve.steps import SHARP_TURN, next_step, no_step, round_corner, take_step

__all__ = [
    "FOLD",
    "STEPS_BETWEEN",
    "Following",
    "Mark",
    "Measure",
    "ParameterEvaluation",
    "Parametrisation",
    "Point",
    "Predictor",
    "Problem",
    "StepControl",
    "advance",
    "located",
    "reversed_point",
    "start_point",
    "step_to",
    "trace",
]


STEPS_BETWEEN = 150  # limit of Newton steps from one value of the parameter to another


def start_point(problem: Problem, x: FloatArray, p: float, following: Following) -> Point:
    """Solve at fixed `p` from the guess `x`; return the point with its tangent towards growing p."""
    latest = problem if isinstance(problem, Latest) else Latest(problem)
    factors = LastFactors(following.newton.linear)
    solution = newton(lambda v: latest.linearise(v, p), x, following.newton, linear=factors)
    first, growing = following.control.first, upward(x.size + 1)
    if not solution.status.converged:
        return Point(solution.x, p, growing, first, solution, 0.0)
    at, inverse = latest.known(solution.x, p), factors.at(solution)
    if at is None or inverse is None:
        y = np.append(solution.x, p)
        tangent, sign = tangent_at(problem, y, growing, following, at)
    else:
        along = upward(x.size + 1)
        along[:-1] = inverse(-at.jac_p)
        tangent, sign = along / measure_at(solution.x, following).of(along), inverse.sign
    return Point(solution.x, p, tangent, first, solution, sign)


def trace(
    problem: Problem, start: Point, end: float, following: Following, marks: Sequence[Mark] = ()
) -> Iterator[Point]:
    """Follow a branch from `start`, in the direction of its tangent, until its parameter passes `end`.

    Parameters
    ----------
    problem
        The equation.
    start
        A converged point with its tangent; it is not yielded again.
    end
        Parameter value of the last point.
    following
        Corrector, step control, weights.
    marks
        Events to locate, such as `FOLD`.

    Yields
    ------
    Point
        Each computed point, until the end or `max_points`. Located events lie between the points of steps, carry their name in `mark`
        and do not change the steps. If no step, however short, converges, the last point has the status `Status.STEP_TOO_SMALL` and
        the state before the failed step.
    """
    point = start
    seen = with_tangent(problem, point, following) if marks else point
    for _ in range(following.control.max_points):
        point = advance(problem, point, end, following)
        if marks:
            before, seen = seen, with_tangent(problem, point, following)
            yield from between(problem, before, seen, marks, following)
        yield point
        if not point.solution.status.converged or point.p == end:
            return


def advance(problem: Problem, point: Point, end: float, following: Following) -> Point:
    """Take one step from `point` along its branch; see `trace`.

    The rung of the point's solution is at least `Rung.SHORTER_STEP` if a longer step did not converge.
    """
    control = following.control
    measure = measure_at(point.x, following)
    unit = point.tangent / measure.of(point.tangent)
    step = point.step
    spent: list[Solution] = []
    rung = Rung.FULL_STEPS
    while step >= control.smallest:
        new = take_step(problem, point, unit, step, end, following)
        spent.append(new.solution)
        if new.solution.status.converged:
            turn = measure.cosine(unit, new.tangent)
            # orientation is constant along a path: a change means another branch, unless the shortest step shows it,
            # too
            flipped = new.orientation * point.orientation < 0.0
            if (turn > SHARP_TURN and not flipped) or step < 4 * control.smallest:
                wanted = next_step(step, new.solution.iterations, abs(turn), control)
                return _with_cost(replace(new, step=wanted), spent, rung)
        else:
            rung = Rung.SHORTER_STEP
        step *= 0.5
    if following.parametrisation == "natural":
        return _with_cost(no_step(point, control, 0), spent, rung)
    new = round_corner(problem, point, unit, end, following)
    return _with_cost(new, [*spent, new.solution], rung)


def _with_cost(point: Point, spent: list[Solution], rung: Rung = Rung.FULL_STEPS) -> Point:
    """Return a point charged with all the attempts that led to it."""
    solution = charged(point.solution, spent)
    return replace(point, solution=replace(solution, rung=max(solution.rung, rung)))


def step_to(problem: Problem, point: Point, p: float, following: Following, steps: int = STEPS_BETWEEN) -> Point:
    """Go from `point`, whose tangent points to growing p, to the value `p`.

    One predicted step is tried first, then the branch is followed. The branch is abandoned after `steps` Newton steps,
    or if it leads away from `p`.

    Returns
    -------
    Point
        The point at `p`, its tangent pointing to growing p. If neither way converges, a point at `p` with the status
        and the last iterate of the predicted step.
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
        # after a fold the branch leads away, and would reach `p` only in another state
        if abs(last.p - p) > abs(point.p - p) or sum(s.iterations for s in spent) > steps:
            break
    if last.p != p or not last.solution.status.converged:
        return _with_cost(direct, spent)
    return _with_cost(last if p > point.p else reversed_point(last), spent)
