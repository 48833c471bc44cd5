"""Newton's method with a line search, for equations that are smooth between kinks."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.linear import Dense, Jacobian, LinearSolver, solve_with
from stickslip.solve.status import Status

MIN_STEP = 1.0 / 64.0  # shortest share of a Newton step that the line search tries
MEMORY = 3  # residual norms a step is compared with: kinks make single increases normal


class Evaluation(Protocol):
    """What Newton needs of one evaluation."""

    @property
    def residual(self) -> FloatArray: ...  # noqa: D102

    @property
    def jac(self) -> Jacobian: ...  # noqa: D102

    @property
    def seconds_contact(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, slots=True, kw_only=True)
class Newton:
    """Options of the corrector.

    Parameters
    ----------
    tolerance
        Largest absolute entry of the scaled residual at a solution.
    max_iterations
        Newton steps before giving up.
    linear
        Solver of the linear systems.
    """

    tolerance: float = 1e-10
    max_iterations: int = 25
    linear: LinearSolver = Dense()  # noqa: RUF009  # frozen


@dataclass(frozen=True, eq=False)
class Solution:
    """Where Newton ended, why, and what it cost."""

    x: FloatArray
    status: Status
    iterations: int
    residual_norm: float
    seconds_contact: float
    seconds_linear: float


def newton(
    evaluate: Callable[[FloatArray], Evaluation], x: FloatArray, options: Newton
) -> Solution:
    """Solve ``residual(x) = 0``.

    A step is shortened until the residual norm falls below the largest of the last few (non-monotone line search after Grippo et al.
    1986), because contact states that switch make the norm rise for one step on the way to the solution.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point.
    x
        (n,) start.
    options
        Tolerance and limits.
    """
    contact = linear = 0.0
    at = evaluate(x)
    contact += at.seconds_contact
    norms = [float(np.max(np.abs(at.residual)))]
    for iteration in range(options.max_iterations + 1):
        if not np.isfinite(norms[-1]):
            return Solution(x, Status.NOT_FINITE, iteration, norms[-1], contact, linear)
        if norms[-1] <= options.tolerance:
            return Solution(x, Status.CONVERGED, iteration, norms[-1], contact, linear)
        if iteration == options.max_iterations:
            break
        start = perf_counter()
        step = solve_with(options.linear, at.jac, -at.residual)
        linear += perf_counter() - start
        if step is None:
            return Solution(x, Status.SINGULAR, iteration, norms[-1], contact, linear)
        share = 1.0
        while True:
            trial = evaluate(x + share * step)
            contact += trial.seconds_contact
            norm = float(np.max(np.abs(trial.residual)))
            if norm <= (1.0 - 1e-4 * share) * max(norms[-MEMORY:]):
                break
            share *= 0.5
            if share < MIN_STEP:
                return Solution(x, Status.STALLED, iteration + 1, norms[-1], contact, linear)
        x = x + share * step
        at = trial
        norms.append(norm)
    return Solution(
        x, Status.TOO_MANY_ITERATIONS, options.max_iterations, norms[-1], contact, linear
    )
