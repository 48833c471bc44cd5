"""Newton's method for piecewise smooth equations, with a choice of globalisations."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import check_choice, input_error
from stickslip.solve.iterate import Evaluation, Globalisation, Iterate, Work
from stickslip.solve.krylov import Automatic
from stickslip.solve.line_search import LineSearch
from stickslip.solve.linear import LinearSolver
from stickslip.solve.status import Rung, Status
from stickslip.solve.trust_region import Dogleg, LevenbergMarquardt

GlobalisationName = Literal["line_search", "dogleg", "levenberg_marquardt"]
GLOBALISATIONS: dict[GlobalisationName, Callable[[], Globalisation]] = {
    "line_search": LineSearch,
    "dogleg": Dogleg,
    "levenberg_marquardt": LevenbergMarquardt,
}

# On two blades whose damper lifts off, starts with more harmonics converged in 114 of 154 attempts; 3 of these took more than 6 steps without
# halving the residual, and two thirds of the time of the others fell after 6 such steps.
MAX_STEPS_TO_HALVE = 6
ROUNDING_REDUCTION = 0.1  # share of the residual after a step above which the residual may be rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Newton:
    """Options of the corrector.

    Parameters
    ----------
    tolerance
        Largest absolute entry of the scaled residual at a solution. If rounding of the unknowns changes the residual by
        more, as with contacts a million times stiffer than the structure, the level of rounding applies.
    max_iterations
        Largest number of Newton steps.
    patience
        Newton steps within which the residual has to fall to a half; 0 for no such limit. For starts near a solution,
        which converge at once or wander between kinks.
    globalisation
        Method for full Newton steps that do not reduce the residual: ``line_search`` shortens the step, ``dogleg``
        bends it towards the gradient (Powell), ``levenberg_marquardt`` damps directions of small singular values.
    linear
        Solver of the linear systems; by default LU for a Jacobian that is an array and a Krylov method for one known by
        its products.
    """

    tolerance: float = 1e-10
    max_iterations: int = 25
    patience: int = 0
    globalisation: GlobalisationName = "line_search"
    linear: LinearSolver = Automatic()  # noqa: RUF009  # frozen

    def __post_init__(self) -> None:
        check_choice("Newton.globalisation", self.globalisation, GLOBALISATIONS)
        if not 0.0 < self.tolerance < math.inf:
            raise input_error(
                "Newton.tolerance",
                f"must be above zero, got {self.tolerance!r}: no residual is smaller than rounding",
                "1e-10 is usual where the residual is scaled by the load.",
            )
        most: Any = self.max_iterations
        if not isinstance(most, int | np.integer) or most < 1:
            raise input_error("Newton.max_iterations", f"must be an integer from 1 on, got {most!r}", "25 is usual.")

    @property
    def near(self) -> "Newton":
        """The options for a start near a solution, given up after `MAX_STEPS_TO_HALVE` steps that do not halve the residual."""
        return replace(self, patience=MAX_STEPS_TO_HALVE)


@dataclass(frozen=True, eq=False)
class Solution:
    """Result of a corrector: last iterate, status, cost, and rung of the method that was needed."""

    x: FloatArray
    status: Status
    iterations: int
    residual_norm: float
    seconds_contact: float
    seconds_linear: float
    rung: Rung = Rung.FULL_STEPS


def charged(solution: Solution, spent: Sequence[Solution]) -> Solution:
    """Return a solution charged with the cost of all the attempts that led to it."""
    return replace(
        solution,
        iterations=sum(s.iterations for s in spent),
        seconds_contact=sum(s.seconds_contact for s in spent),
        seconds_linear=sum(s.seconds_linear for s in spent),
    )


def first_converged(attempts: Iterable[Solution]) -> Solution:
    """Return the first attempt that converged, or the last one, charged with the cost of all.

    The iterator is not advanced further.
    """
    spent: list[Solution] = []
    for attempt in attempts:
        spent.append(attempt)
        if attempt.status.converged:
            break
    return charged(spent[-1], spent)


def newton(
    evaluate: Callable[[FloatArray], Evaluation],
    x: FloatArray,
    options: Newton,
    globalisation: Globalisation | None = None,
    linear: LinearSolver | None = None,
) -> Solution:
    """Solve ``residual(x) = 0``.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point.
    x
        (n,) start.
    options
        Tolerance, limits, globalisation and linear solver.
    globalisation
        Replacement for the globalisation of the options, such as `NaturalLevel` for a start near the solution.
    linear
        Replacement for the linear solver of the options, such as one that remembers its factors.

    Returns
    -------
    Solution
        The solution, or the iterate with the smallest residual, with the status that ended the iteration. Its rung is
        `Rung.DAMPED_STEP` if a step was refused.
    """
    work = Work(evaluate, linear or options.linear)
    globalisation = globalisation or GLOBALISATIONS[options.globalisation]()
    now = best = work.at(x)
    iterations = 0
    halved, last = now.norm, 0  # residual that was last halved, and after how many steps
    status = _ended(now, iterations, options)
    while status is None:
        before = now.norm
        after = globalisation.advance(work, now)
        if isinstance(after, Status):
            iterations += after is Status.STALLED
            status = after
            break
        now = after
        iterations += 1
        best = now if now.norm < best.norm else best
        if now.norm <= 0.5 * halved:
            halved, last = now.norm, iterations
        status = _ended(now, iterations, options)
        if status is None and now.norm > ROUNDING_REDUCTION * before and work.rounded(best):
            status = Status.CONVERGED
        if status is None and options.patience and iterations - last >= options.patience:
            status = Status.STALLED
    if not status.converged and work.rounded(best):
        status = Status.CONVERGED
    rung = Rung.DAMPED_STEP if work.rejected else Rung.FULL_STEPS
    cost = (work.seconds_contact, work.seconds_linear)
    return Solution(best.x, status, iterations, best.norm, *cost, rung)


def _ended(now: Iterate, iterations: int, options: Newton) -> Status | None:
    if not math.isfinite(now.norm):
        return Status.NOT_FINITE
    if now.norm <= options.tolerance:
        return Status.CONVERGED
    return Status.TOO_MANY_ITERATIONS if iterations == options.max_iterations else None
