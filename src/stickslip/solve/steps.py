"""One step along a branch: prediction, correction, and passage around corners."""

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

SHARP_TURN = 0.5  # cosine between successive tangents below which the step is shortened, if possible
SMOOTH_TURN = 0.9  # cosine above which a change of orientation is a bifurcation, not a corner
STRAIGHT = 0.97  # cosine above which a branch hardly turns
EASY = 1  # Newton steps of an easy correction
TANGENT_DISTANCE = 0.3  # share of a step: distance from the prediction within which its factors determine the tangent
ASIDE = 0.3  # share of a step: a parabola farther from the tangent is not used
PATIENT = 8.0  # times the smallest step, below which no factors are kept
LOOKS_AHEAD = (1.0, 4.0, 16.0, 64.0)  # smallest steps at which the far side of a corner is probed
# distance of the end of a step from its start, in step lengths, above which it is on another piece of the branch
MAX_END_DISTANCE = 2.0
LONGEST = 2.0  # longest step at a prescribed change of p, in largest steps: it is longer only next to a fold
ROUND = 300  # limit of Newton steps for the far side of a corner
LEAVES_BY = (4.0, 16.0, 1.0, 64.0)  # lengths tried along the far side, in smallest steps


@dataclass(frozen=True, eq=False)
class _Across:
    """The equation with one additional condition: ``row @ (x, p) = value``."""

    at: ParameterEvaluation
    row: FloatArray
    residual: FloatArray

    @cached_property
    def jac(self) -> Bordered:
        """Derivative by all unknowns; it is not computed for rejected trials."""
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
    # a corrector that moves far away, or past the end of the range, has found another piece of the branch
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
    """Whether factors are kept in a step; the shortest steps, at corners, use the full corrector."""
    return following.corrector == "kept_factors" and step >= PATIENT * following.control.smallest


def _by_factors(
    inverse: Signed, before: Point, y: FloatArray, unit: FloatArray, following: Following
) -> tuple[FloatArray, float] | None:
    """Return direction and orientation from the factors of a Jacobian near `y`.

    None if the branch turns, so that these factors are not accurate enough.
    """
    measure = measure_at(y[:-1], following)
    tangent = inverse(upward(y.size))
    tangent = tangent / measure.of(tangent)
    straight = measure.cosine(unit, tangent) > STRAIGHT and inverse.sign * before.orientation > 0.0
    return (tangent, inverse.sign) if straight else None


def _bend(y: FloatArray, before: FloatArray, tangent: FloatArray, following: Following) -> FloatArray | None:
    """Return half the curvature of the parabola through two points with the tangent at the first."""
    if following.predictor != "parabola":
        return None
    measure = measure_at(y[:-1], following)
    back = before - y
    length = measure.of(back)
    return np.asarray((back + length * tangent) / length**2)


def _prediction(
    point: Point, unit: FloatArray, step: float, measure: Measure, following: Following
) -> tuple[FloatArray, FloatArray] | None:
    """Return the predicted change of (x, p) and the row of the corrector's condition; None if it is too long."""
    if following.parametrisation == "natural":
        share = measure.p * abs(float(unit[-1]))
        # near a fold a small change of p requires a long step, whose end is not related to this branch
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
    # Where contact states change, the branch may turn back so sharply that the tangent closest to the old one leads
    # back to the corner. The sign of the bordered determinant is constant along a piecewise smooth path (Allgower &
    # Georg 1990). If it changes although the tangent hardly turned, the point is a bifurcation, which is passed
    # straight on.
    old = measure_at(before.x, following)
    if sign * before.orientation < 0.0 and old.cosine(unit, tangent) < SMOOTH_TURN:
        return -tangent, -sign
    return tangent, sign


def round_corner(problem: Problem, point: Point, unit: FloatArray, end: float, following: Following) -> Point:
    """Leave a corner of more than a right angle along its far side.

    No plane normal to the old tangent meets the far side. Its tangent follows from the Jacobian just beyond the corner,
    with the orientation of the path; if the linear solver gives no determinant, both directions are tried.
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
    """Whether a step along the far side of a corner ended on the far side, not on the near side."""
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
