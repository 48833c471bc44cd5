"""What the harmonics that a motion lacks change in it: one Newton step with more of them, from the motion as it was solved."""

from dataclasses import replace

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.alert import silent
from stickslip.harmonic.support import harmonics_of
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness

FACTOR, MORE = 2, 3  # the step has FACTOR times the harmonics of the motion and MORE,
LEAST = 11  # and at least these: after H = 1, five are too few to see what closings do


def corrected(problem: ForcedProblem, point: ForcedPoint) -> ComplexArray | None:
    """Return the (order+1, n_retained) coefficients of a point after a Newton step with more harmonics, m.

    It is the step that the Jacobian Alert predicts errors from. The point's own come back where no force acts on the missing harmonics,
    and None where the step is none: singular, or with a larger residual behind it.
    """
    omega = point.omega
    low = with_stiffness(problem.balance(point.support))
    high = _more(problem, max(LEAST, FACTOR * low.order + MORE))
    x, padded = low.unknowns(point.coefficients), high.unknowns(point.coefficients)
    period = high.forces(padded, omega, problem.step(low, x, omega).events)
    if silent(low, high, period):
        return point.coefficients
    before = high.linearise(padded, omega, period)
    change = problem.alert_solve(before.jac, -before.residual)
    if change is None or not np.all(np.isfinite(change)):
        return None
    after = high.linearise(padded + change, omega)
    fallen = np.linalg.norm(after.residual) < np.linalg.norm(before.residual)
    return high.coefficients(padded + change) if fallen else None


def _more(problem: ForcedProblem, order: int) -> HarmonicBalance:
    """Return the problem with all harmonics up to `order`, and the samples that they need."""
    if problem.high.samples > 4 * order:
        return with_stiffness(problem.balance(harmonics_of(order)))
    return replace(with_stiffness(problem.high), samples=8 * order).with_order(order)
