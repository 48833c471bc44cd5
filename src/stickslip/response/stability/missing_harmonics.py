"""Correction of a motion by its missing harmonics: one Newton step, or a solution."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics, harmonics_of
from stickslip.harmonic.judging import HIGHEST, judging_set_of
from stickslip.harmonic.selection.alert import silent
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.solve.newton_method import newton

HARMONICS_FACTOR, HARMONICS_MORE = (
    2,
    3,
)  # highest harmonic of the step: FACTOR times the highest of the motion plus MORE,
MAX_SOLVED_HARMONICS = 41  # highest harmonic of full solutions: beyond, time integration costs less
FARTHER = (
    2.0  # error over change, for a solution farther away than one step: higher harmonics may change it as much again
)
STEP_WORK = 1e6  # floating-point operations of a Newton step for each unknown
MOST_ROWS = 4500  # largest system that is solved for multipliers
SOLUTIONS = 10  # largest number of solutions of a point
FAILED = 3  # successive failures after which time integration costs less
MIN_HARMONICS = 11  # and at least this one: after H = 1, five harmonics do not resolve closures


@dataclass(frozen=True, eq=False)
class Corrected:
    """Point with more harmonics, and the floating-point operations to solve it."""

    point: ForcedPoint
    work: float


def corrected(problem: ForcedProblem, point: ForcedPoint) -> tuple[ForcedPoint, float] | None:
    """Return a point after a Newton step with more harmonics, and the ratio of the error to the change by this step.

    The Jacobian Alert predicts errors by the same step. If the step increases the residual, Newton's method continues
    to a solution with up to `MAX_SOLVED_HARMONICS`, whose change counts `FARTHER` times. The result is the point itself
    if no force acts on the missing harmonics, and None if no solution is found.
    """
    step = corrected_by_step(problem, point)
    if step is not None:
        return step.point, 1.0
    fed = judging_set_of(with_stiffness(problem.balance(point.support)))
    order = max(MIN_HARMONICS, HARMONICS_FACTOR * point.order + HARMONICS_MORE, fed[-1])
    more = None if order > MAX_SOLVED_HARMONICS else solved_with(problem, point, order)
    return None if more is None else (more.point, FARTHER)


def corrected_by_step(problem: ForcedProblem, point: ForcedPoint) -> Corrected | None:
    """Return a point after a Newton step with more harmonics.

    The result is the point itself if no force acts on these harmonics, and None if the step increases the residual.
    """
    omega = point.omega
    low = with_stiffness(problem.balance(point.support))
    fed = {*judging_set_of(low), *harmonics_of(max(MIN_HARMONICS, HARMONICS_FACTOR * low.order + HARMONICS_MORE))}
    high = _more(problem, tuple(sorted(fed)))
    x, padded = low.unknowns(point.coefficients), high.unknowns(point.coefficients)
    period = high.forces(padded, omega, problem.step(low, x, omega).events)
    if silent(low, high, period):
        return Corrected(point, 0.0)
    before = high.linearise(padded, omega, period)
    change = problem.alert_solve(before.jac, -before.residual)
    if change is None or not np.all(np.isfinite(change)):
        return None
    after = high.linearise(padded + change, omega)
    if not np.linalg.norm(after.residual) < np.linalg.norm(before.residual):
        return None
    return Corrected(_point(point, high, padded + change), newton_work(padded.size))


def solved_with(problem: ForcedProblem, point: ForcedPoint, order: int) -> Corrected | None:
    """Return the motion of a point solved with harmonics up to an order; None without convergence."""
    high = _more(problem, harmonics_of(order))
    start = high.unknowns(point.coefficients)
    found = newton(lambda x: high.linearise(x, point.omega), start, problem.sweep.newton.near)
    if not found.status.converged:
        return None
    work = max(found.iterations, 1) * newton_work(start.size)
    return Corrected(_point(point, high, found.x), work)


def more_harmonics(problem: ForcedProblem, point: ForcedPoint) -> Iterator[Corrected]:
    """Yield the motion solved with increasing harmonics, in smaller steps after a failure."""
    reached, order = point, max(HARMONICS_FACTOR * point.order + HARMONICS_MORE, MIN_HARMONICS)
    failed = 0
    for _ in range(SOLUTIONS):
        order = min(order, HIGHEST)
        if order <= reached.order or problem.system.retained.size * (2 * order + 1) > MOST_ROWS:
            return
        more = solved_with(problem, reached, order)
        if more is None:
            failed += 1
            if failed == FAILED:
                return
            order = (reached.order + order) // 2
            continue
        failed = 0
        if more.point.order <= reached.order:
            return  # the wheel has no more waves
        yield more
        reached, order = more.point, HARMONICS_FACTOR * order + HARMONICS_MORE


def newton_work(rows: int) -> float:
    """Estimate the floating-point operations of a Newton step with contacts.

    They are proportional to the rows (measured from 99 to 3000).
    """
    return STEP_WORK * rows


def with_more(point: ForcedPoint, coefficients: ComplexArray, harmonics: IntArray, error: float) -> ForcedPoint:
    """Return the motion of a point with more harmonics and its predicted error as a new point."""
    none = np.zeros(0)
    return replace(
        point,
        coefficients=coefficients,
        harmonics=harmonics,
        predicted_error=error,
        iterations=0,
        tangent=none,
        step=0.0,
        orientation=0.0,
        kept=np.zeros((0, 0), dtype=np.int64),
        seconds_contact=0.0,
        seconds_linear=0.0,
        seconds_total=0.0,
    )


def _point(point: ForcedPoint, high: HarmonicBalance, x: FloatArray) -> ForcedPoint:
    return replace(point, coefficients=high.coefficients(x), harmonics=np.array(high.harmonics))


def _more(problem: ForcedProblem, harmonics: Harmonics) -> HarmonicBalance:
    """Return the problem with these harmonics, as far as a wheel has their waves, and with enough samples."""
    most = problem.high.linear.most
    return with_stiffness(problem.balance(tuple(h for h in harmonics if most is None or h <= most)))
