"""One step along a branch: predict, correct, and find the way round corners."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.operators import Bordered
from stickslip.solve.branch import (
    Following,
    Latest,
    Measure,
    ParameterEvaluation,
    Point,
    Problem,
    StepControl,
    measure_at,
    tangent_at,
    upward,
)
from stickslip.solve.chord_newton import KeptFactors, LastFactors
from stickslip.solve.linear import Signed
from stickslip.solve.newton_method import newton
from stickslip.solve.status import Status

SHARP_TURN = 0.5  # cosine between successive tangents below which the step is shortened, as far as that goes
SMOOTH_TURN = 0.9  # cosine above which a change of orientation is a bifurcation, not a corner
STRAIGHT = 0.97  # cosine above which a branch hardly turns
EASY = 1  # Newton step
TANGENT_DISTANCE = 0.3  # of a step: distance from the prediction within which its factors tell the tangent
ASIDE = 0.3  # of a step: a parabola that leaves the tangent by more is none of the branch
PATIENT = 8.0  # smallest steps below which no factors are kept
LOOKS_AHEAD = (1.0, 4.0, 16.0, 64.0)  # smallest steps at which the far side of a corner is looked for
# lengths of a step by which its end may be away: farther, it lies on another piece of the branch
MAX_END_DISTANCE = 2.0
LONGEST = 2.0  # largest steps that a step of p may be long: more is asked for beside a fold only
ROUND = 300  # Newton steps for the far side of a corner, after which none is looked for
LEAVES_BY = (4.0, 16.0, 1.0, 64.0)  # smallest steps taken along the far side


@dataclass(frozen=True, eq=False)
class _Across:
    """The equation with one additional condition: ``row @ (x, p) = value``."""

    at: ParameterEvaluation
    row: FloatArray
    residual: FloatArray

    @cached_property
    def jac(self) -> Bordered:
        """Derivative by all unknowns; trials that are not accepted never ask for it."""
        return Bordered(self.at.jac, self.at.jac_p, self.row[:-1], float(self.row[-1]))

    @property
    def seconds_contact(self) -> float:
        """Time spent in contact forces."""
        return self.at.seconds_contact


def across(problem: Problem, y: FloatArray, row: FloatArray, value: float) -> _Across:
    """Evaluate the equation and the condition ``row @ y = value`` at `y` (n + 1,)."""
    at = problem.linearise(y[:-1], float(y[-1]))
    return _Across(at, row, np.append(at.residual, row @ y - value))


def take_step(problem: Problem, point: Point, unit: FloatArray, step: float, end: float, following: Following) -> Point:
    """Predict along `unit` and correct; the status of the returned point says whether it converged.

    Parameters
    ----------
    problem
        The equation.
    point
        Start of the step.
    unit
        (n + 1,) direction of unit length.
    step
        Length of the step; with natural parametrisation the change of p over its scale.
    end
        Parameter value at which a step ends that would pass it.
    following
        Corrector, parametrisation, predictor, measure of length.
    """
    measure = measure_at(point.x, following)
    y = point.y
    predicted = _prediction(point, unit, step, measure, following)
    if predicted is None:
        free = replace(point.solution, iterations=0, seconds_contact=0.0, seconds_linear=0.0)
        return replace(point, solution=replace(free, status=Status.STALLED))
    ahead, row = predicted
    guess = y + ahead
    reach = max(step, measure.of(ahead)) if following.parametrisation == "natural" else step
    passes = (guess[-1] - end) * (point.p - end) <= 0.0
    if passes:
        guess = y + (end - point.p) / unit[-1] * unit
        row = measure.p * upward(y.size)
    value = float(row @ guess)
    latest = Latest(problem)
    own = following.newton
    kept = KeptFactors(own.tolerance) if _keeps(following, step) else None
    last = LastFactors(own.linear)
    solution = newton(lambda v: across(latest, v, row, value), guess, own, kept, last)
    x, p = solution.x[:-1], end if passes else float(solution.x[-1])
    # a corrector that slides far away, or past the end of the range, has found another piece of the branch
    near = measure.of(solution.x - y) <= MAX_END_DISTANCE * reach and (p - end) * (point.p - end) >= 0.0
    found = replace(solution, x=x)
    if not (solution.status.converged and near):
        status = Status.STALLED if solution.status.converged else solution.status
        return replace(point, solution=replace(found, x=point.x, status=status))
    inverse = last.at(solution) if following.predictor != "secant" else None
    if kept is not None and measure.of(solution.x - guess) < TANGENT_DISTANCE * step:
        inverse = kept.inverse
    known = None
    if inverse is not None:
        known = _by_factors(inverse, point, solution.x, unit, following)
    tangent, sign = known or _direction(latest, point, solution.x, unit, following)
    return Point(x, p, tangent, step, found, sign, bend=_bend(solution.x, y, tangent, following))


def _keeps(following: Following, step: float) -> bool:
    """Whether factors are kept in a step: the shortest ones, at corners, are corrected by all that the corrector has."""
    return following.corrector == "kept_factors" and step >= PATIENT * following.control.smallest


def _by_factors(
    inverse: Signed, before: Point, y: FloatArray, unit: FloatArray, following: Following
) -> tuple[FloatArray, float] | None:
    """Return direction and orientation by the factors of a Jacobian beside `y`; None where the branch turns, and that beside it tells too little."""
    measure = measure_at(y[:-1], following)
    tangent = inverse(upward(y.size))
    tangent = tangent / measure.of(tangent)
    straight = measure.cosine(unit, tangent) > STRAIGHT and inverse.sign * before.orientation > 0.0
    return (tangent, inverse.sign) if straight else None


def _bend(y: FloatArray, before: FloatArray, tangent: FloatArray, following: Following) -> FloatArray | None:
    """Return the deviation from its tangent of the parabola through two points with the tangent at the first."""
    if following.predictor != "parabola":
        return None
    measure = measure_at(y[:-1], following)
    back = before - y
    length = measure.of(back)
    return np.asarray((back + length * tangent) / length**2)


def _prediction(
    point: Point, unit: FloatArray, step: float, measure: Measure, following: Following
) -> tuple[FloatArray, FloatArray] | None:
    """Return the predicted change of (x, p) and the row of the condition that holds the corrector; None if it is too long."""
    if following.parametrisation == "natural":
        share = measure.p * abs(float(unit[-1]))
        # beside a fold a small change of p asks for a long way, whose end has nothing to do with this branch
        if step > LONGEST * following.control.largest * share:
            return None
        return step / share * unit, measure.p * upward(unit.size)
    if following.parametrisation == "local":
        largest = int(np.argmax(np.abs(measure.weights * unit)))
        row = np.zeros(unit.size)
        row[largest] = measure.weights[largest]
        return step * unit, row
    ahead = step * unit
    if point.bend is not None and unit @ point.tangent > 0.0:
        aside = step**2 * point.bend
        ahead = ahead + aside if measure.of(aside) < ASIDE * step else ahead
    return ahead, measure.row(unit)


def _direction(
    latest: Latest, before: Point, y: FloatArray, unit: FloatArray, following: Following
) -> tuple[FloatArray, float]:
    """Return the direction of continuation from the corrected point `y`, and its orientation."""
    measure = measure_at(y[:-1], following)
    if following.predictor == "secant":
        chord = y - before.y
        return chord / measure.of(chord), 0.0
    at = latest.known(y[:-1], float(y[-1]))
    tangent, sign = tangent_at(latest.problem, y, unit, following, at)
    # Where contact states change the branch may turn back so sharply that the tangent nearest to the old one leads back to the
    # corner. The sign of the bordered determinant is the same along a piecewise smooth path (Allgower & Georg 1990); a sign
    # that changes although the tangent hardly turned is a bifurcation point, which is passed straight on.
    old = measure_at(before.x, following)
    if sign * before.orientation < 0.0 and old.cosine(unit, tangent) < SMOOTH_TURN:
        return -tangent, -sign
    return tangent, sign


def round_corner(problem: Problem, point: Point, unit: FloatArray, end: float, following: Following) -> Point:
    """Leave a corner of more than a right angle along its far side.

    No plane normal to the old tangent meets the far side. The tangent there follows from the Jacobian just beyond the corner, with the
    orientation of the path; if the linear solver gives no determinant, both directions are tried.
    """
    smallest = following.control.smallest
    measure = measure_at(point.x, following)
    orientation = point.orientation
    if following.predictor == "secant":
        orientation = tangent_at(problem, point.y, unit, following)[1]
    iterations = 0
    for ahead in LOOKS_AHEAD:
        far, sign = tangent_at(problem, point.y + ahead * smallest * unit, unit, following)
        if sign == 0.0:
            continue
        known = not np.isnan(sign * orientation)
        if known and sign * orientation < 0.0:
            far = -far
        for side in (far,) if known else (far, -far):
            for share in LEAVES_BY:
                new = take_step(problem, point, side, share * smallest, end, following)
                iterations += new.solution.iterations
                if not new.solution.status.converged and iterations > ROUND:
                    return no_step(point, following.control, iterations)
                if new.solution.status.converged and _left(new, side, unit, known, measure):
                    solution = replace(new.solution, iterations=iterations)
                    return replace(new, step=4.0 * smallest, solution=solution)
    return no_step(point, following.control, iterations)


def _left(new: Point, side: FloatArray, unit: FloatArray, known: bool, measure: Measure) -> bool:
    """Whether a step along the far side of a corner ended there, and not on the near side again."""
    turn = measure.cosine(side, new.tangent)
    return turn > SHARP_TURN and (known or turn > abs(measure.cosine(unit, new.tangent)))


def no_step(point: Point, control: StepControl, iterations: int) -> Point:
    """Return `point` with the status `Status.STEP_TOO_SMALL`."""
    failed = replace(
        point.solution,
        status=Status.STEP_TOO_SMALL,
        iterations=iterations,
        residual_norm=np.nan,
        seconds_contact=0.0,
        seconds_linear=0.0,
    )
    return replace(point, step=control.first, solution=failed)


def next_step(step: float, iterations: int, turn: float, control: StepControl) -> float:
    """Return the next step length: longer after few Newton steps, shorter after many or where the branch turns."""
    factor = 1.5 if iterations <= 4 else 1.0 if iterations <= 8 else 0.6
    if iterations <= EASY and turn > STRAIGHT:
        factor = control.growth
    if turn < STRAIGHT:
        factor = min(factor, 0.7)
    return float(np.clip(step * factor, control.smallest, control.largest))
