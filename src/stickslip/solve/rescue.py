"""Solve at a fixed parameter by whatever it takes: other globalisations, then homotopies; what it took is counted."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.operators import Jacobian
from stickslip.solve.branch import ParameterEvaluation, Problem
from stickslip.solve.continuation import Following, Point, StepControl, start_point, trace
from stickslip.solve.iterate import Evaluation
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, Solution, charged, newton
from stickslip.solve.status import Rung, Status

Evaluate = Callable[[FloatArray], Evaluation]
EvaluateAt = Callable[[float], Evaluate]

PATIENCE = 30  # iterations of a corrector that has no neighbour to start from
STEPS = StepControl(scale=1.0, first=0.1, largest=0.5, smallest=1e-5)
ITERATIONS = (
    10  # of a corrector along a homotopy: there a shorter step is cheaper than a long correction
)
MOST_STEPS = (
    1500  # Newton steps along the legs of one homotopy: those that came through took 770 to 1200
)
ROOTLESS = 200  # points of the homotopy that needs no physics and may lead nowhere
DIFFERENCE = 1e-6  # change of s for the derivative of a family by s
BEYOND = 1e-9  # how far outside 0..1 rounding may carry s


@dataclass(frozen=True, eq=False)
class Homotopy:
    """Equations with a parameter from 0 (easy) to 1, followed one after the other by arc length; the last one ends as the wanted one.

    Attributes
    ----------
    legs
        At p = 1 each has the solutions that the next one has at p = 0.
    start
        (n,) a point near the solution of the first leg where it begins.
    begins
        Parameters at which the first leg may begin, 0 or little more: the first at which the corrector converges.
    least
        Parameter below which a path is left: beyond the only solution of the easy equation, it has lost its direction.
    max_points
        Most points of one leg.
    """

    legs: tuple[Problem, ...]
    start: FloatArray
    begins: tuple[float, ...] = (0.0,)
    least: float = 0.0
    max_points: int = 600


def solve_robustly(
    evaluate: Evaluate,
    starts: Iterable[FloatArray],
    options: Newton,
    homotopies: Iterable[Homotopy] = (),
    weights: FloatArray | None = None,
    patience: int = PATIENCE,
) -> Solution:
    """Solve ``residual(x) = 0`` at a fixed parameter, trying harder as long as it does not converge.

    First the corrector of `options` from each start; then the other globalisations, from that start whose residual is least; then each
    of `homotopies` in turn; last the homotopy that needs no physics, ``residual(x) - (1 - s) residual(x_start) = 0``. Shorter
    continuation steps come between the first two and are the business of `stickslip.solve.continuation.advance`.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point, as for `newton`.
    starts
        (n,) starts, at least one. Those after one that converged are not asked for.
    options
        Corrector. A homotopy uses it at each of its steps.
    homotopies
        From easy equations to this one; those after one that came through are not asked for.
    weights
        (n,) share of each unknown in the length of a step of a homotopy; default: equal.
    patience
        Most iterations of the other globalisations.

    Returns
    -------
    Solution
        The solution with the cost of all attempts. Its `rung` says what it took: `Rung.FULL_STEPS`, `DAMPED_STEP`,
        `OTHER_GLOBALISATION` or `HOMOTOPY`; ``collections.Counter(s.rung for s in ...)`` counts a sweep. If nothing converges, that
        attempt which came nearest, with its status.

    Examples
    --------
    Homotopy in a load that `loaded` scales by s::

        growing = ByDifference(lambda s: lambda v: loaded(s).linearise(v, omega))
        solve_robustly(lambda v: balance.linearise(v, omega), [guess], Newton(), [Homotopy((growing,), at_rest)])
    """
    spent: list[Solution] = []
    for attempt in _attempts(evaluate, starts, options, homotopies, weights, patience):
        spent.append(attempt)
        if attempt.status.converged:
            return charged(attempt, spent)
    return charged(min(spent, key=lambda s: _finite(s.residual_norm)), spent)


def _attempts(
    evaluate: Evaluate,
    starts: Iterable[FloatArray],
    options: Newton,
    homotopies: Iterable[Homotopy],
    weights: FloatArray | None,
    patience: int,
) -> Iterator[Solution]:
    tried: list[FloatArray] = []
    for start in starts:
        tried.append(start)
        yield newton(evaluate, start, options)
    x = min(tried, key=lambda v: _finite(float(np.max(np.abs(evaluate(v).residual)))))
    for name in GLOBALISATIONS:
        if name != options.globalisation:
            patient = replace(options, globalisation=name, max_iterations=patience)
            yield replace(newton(evaluate, x, patient), rung=Rung.OTHER_GLOBALISATION)
    quick = replace(options, max_iterations=min(options.max_iterations, ITERATIONS))
    weights = np.ones(x.size) if weights is None else weights
    following = Following(newton=quick, control=STEPS, weights=weights)
    for homotopy in homotopies:
        yield _followed(homotopy, evaluate, following)
    relaxed = (_Relaxed(evaluate, evaluate(x).residual),)
    wandering = Homotopy(relaxed, x, least=-np.inf, max_points=ROOTLESS)
    yield _followed(wandering, evaluate, following)


@dataclass(frozen=True, eq=False)
class _At:
    residual: FloatArray
    jac: Jacobian
    jac_p: FloatArray
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class ByDifference:
    """A family of equations as one with the parameter s, whose derivative by s is found by a difference.

    Attributes
    ----------
    family
        Returns, for s from 0 to 1, an `evaluate` at that s. It is never asked outside.
    """

    family: EvaluateAt

    def linearise(self, x: FloatArray, p: float) -> ParameterEvaluation:
        """Return residual and derivatives at `x` and s = `p`."""
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


def _followed(homotopy: Homotopy, evaluate: Evaluate, following: Following) -> Solution:
    """Follow a homotopy to the end of its last leg."""
    control = replace(following.control, max_points=homotopy.max_points)
    following = replace(following, control=control)
    spent: list[Solution] = []
    x, begins = homotopy.start, homotopy.begins
    for leg in homotopy.legs:
        first = _begun(leg, x, begins, following, spent)
        point = _to_the_end(leg, first, homotopy.least, following, spent)
        x, begins = point.x, (0.0,)
        if point.p != 1.0 or not point.solution.status.converged:
            break
    solution = point.solution
    if solution.status.converged and (point.p != 1.0 or leg is not homotopy.legs[-1]):
        solution = replace(solution, status=Status.TOO_MANY_ITERATIONS)
    if not solution.status.converged:
        # what a failed step left is no measure of how near s = 1 is
        norm = float(np.max(np.abs(evaluate(point.x).residual)))
        solution = replace(solution, x=point.x, residual_norm=norm)
    return replace(charged(solution, spent), rung=Rung.HOMOTOPY)


def _begun(
    leg: Problem,
    x: FloatArray,
    begins: tuple[float, ...],
    following: Following,
    spent: list[Solution],
) -> Point:
    """Return the first point of a leg, or the last attempt at one."""
    for begin in begins:
        point = start_point(leg, x, begin, following)
        spent.append(point.solution)
        if point.solution.status.converged:
            break
    return point


def _to_the_end(
    leg: Problem, start: Point, least: float, following: Following, spent: list[Solution]
) -> Point:
    """Follow a leg from `start` until p = 1, p < `least`, no step converges, or `MOST_STEPS` are spent."""
    point = start
    if not start.solution.status.converged:
        return start
    for point in trace(leg, start, 1.0, following):
        spent.append(point.solution)
        if point.p < least or sum(s.iterations for s in spent) > MOST_STEPS:
            break
    return point


def _finite(norm: float) -> float:
    return norm if np.isfinite(norm) else np.inf
