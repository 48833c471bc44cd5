"""Solve at a fixed parameter by whatever it takes: other globalisations, then homotopies; what it took is counted."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.iterate import Evaluation
from stickslip.solve.linear import Jacobian
from stickslip.solve.newton import GLOBALISATIONS, Newton, Solution, charged, newton
from stickslip.solve.status import Rung, Status

Evaluate = Callable[[FloatArray], Evaluation]
Family = Callable[[float], Evaluate]

STEPS = StepControl(scale=1.0, first=0.1, largest=0.5, smallest=1e-4, max_points=200)
DIFFERENCE = 1e-6  # change of s for the derivative of a family by s
BEYOND = 1e-9  # how far outside 0..1 rounding may carry s


def solve_robustly(
    evaluate: Evaluate,
    x: FloatArray,
    options: Newton,
    families: Sequence[Family] = (),
    weights: FloatArray | None = None,
) -> Solution:
    """Solve ``residual(x) = 0`` at a fixed parameter, trying harder as long as it does not converge.

    First the corrector of `options`; then the other globalisations, from the same start; then each of `families` in turn, followed by
    arc length from s = 0 to s = 1, so that folds in s are passed; last the homotopy that needs no physics,
    ``residual(x) - (1 - s) residual(x_start) = 0``. Shorter continuation steps come between the first two and are the business of
    `stickslip.solve.continuation.advance`.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point, as for `newton`.
    x
        (n,) start; of homotopies as well, at s = 0.
    options
        Corrector. A homotopy uses it at each of its steps.
    families
        Each returns, for s from 0 (easy: little load, no friction) to 1 (the equation itself), an `evaluate` at that s. It is never asked
        outside 0..1. Its derivative by s is found by a difference.
    weights
        (n,) share of each unknown in the length of a step of a homotopy; default: equal.

    Returns
    -------
    Solution
        The solution with the cost of all attempts. Its `rung` says what it took: `Rung.FULL_STEPS`, `DAMPED_STEP`,
        `OTHER_GLOBALISATION` or `HOMOTOPY`; ``collections.Counter(s.rung for s in ...)`` counts a sweep. If nothing converges, that
        attempt which came nearest, with its status.

    Examples
    --------
    Load homotopy of a harmonic balance whose excitation is scaled by s::

        solve_robustly(
            lambda v: balance.linearise(v, omega), guess, Newton(),
            [lambda s: lambda v: loaded(s).linearise(v, omega)],
        )
    """
    spent: list[Solution] = []
    for attempt in _attempts(evaluate, x, options, families, weights):
        spent.append(attempt)
        if attempt.status.converged:
            return charged(attempt, spent)
    return charged(min(spent, key=lambda s: _finite(s.residual_norm)), spent)


def _attempts(
    evaluate: Evaluate,
    x: FloatArray,
    options: Newton,
    families: Sequence[Family],
    weights: FloatArray | None,
) -> Iterator[Solution]:
    yield newton(evaluate, x, options)
    for name in GLOBALISATIONS:
        if name != options.globalisation:
            attempt = newton(evaluate, x, replace(options, globalisation=name))
            yield replace(attempt, rung=Rung.OTHER_GLOBALISATION)
    weights = np.ones(x.size) if weights is None else weights
    following = Following(newton=options, control=STEPS, weights=weights)
    for family in families:
        yield _followed(_FamilyProblem(family), evaluate, x, following)
    yield _followed(_Relaxed(evaluate, evaluate(x).residual), evaluate, x, following)


@dataclass(frozen=True, eq=False)
class _At:
    residual: FloatArray
    jac: Jacobian
    jac_p: FloatArray
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class _FamilyProblem:
    """A family as an equation with the parameter s; there is none outside 0..1."""

    family: Family

    def linearise(self, x: FloatArray, p: float) -> _At:
        s = min(max(p, 0.0), 1.0)
        at = self.family(s)(x)
        aside = s + DIFFERENCE if s < 0.5 else s - DIFFERENCE
        other = self.family(aside)(x)
        slope = (other.residual - at.residual) / (aside - s)
        residual = at.residual if abs(p - s) <= BEYOND else np.full_like(at.residual, np.nan)
        return _At(residual, at.jac, slope, at.seconds_contact + other.seconds_contact)


@dataclass(frozen=True, eq=False)
class _Relaxed:
    """The equation with a share 1 - s of its residual at the start taken away (Newton homotopy)."""

    evaluate: Evaluate
    start: FloatArray

    def linearise(self, x: FloatArray, p: float) -> _At:
        at = self.evaluate(x)
        return _At(at.residual - (1.0 - p) * self.start, at.jac, self.start, at.seconds_contact)


def _followed(
    problem: _FamilyProblem | _Relaxed, evaluate: Evaluate, x: FloatArray, following: Following
) -> Solution:
    """Follow a homotopy from s = 0 to 1."""
    points = [start_point(problem, x, 0.0, following)]
    if points[0].solution.status.converged:
        points += trace(problem, points[0], 1.0, following)
    point = points[-1]
    solution = point.solution
    if solution.status.converged and point.p != 1.0:
        solution = replace(solution, status=Status.TOO_MANY_ITERATIONS)
    if not solution.status.converged:
        # what a failed step left is no measure of how near s = 1 is
        norm = float(np.max(np.abs(evaluate(point.x).residual)))
        solution = replace(solution, x=point.x, residual_norm=norm)
    return replace(charged(solution, [p.solution for p in points]), rung=Rung.HOMOTOPY)


def _finite(norm: float) -> float:
    return norm if np.isfinite(norm) else np.inf
