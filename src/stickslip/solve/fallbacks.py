"""Fallbacks at a fixed parameter: other globalisations, then homotopies, within a limit of Newton steps."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.operators import Jacobian
from stickslip.solve.branch import ParameterEvaluation, Problem
from stickslip.solve.continuation import Following, Point, StepControl, start_point, trace
from stickslip.solve.iterate import Evaluation
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, Solution, charged, newton
from stickslip.solve.status import Rung, Status

Evaluate = Callable[[FloatArray], Evaluation]
EvaluateAt = Callable[[float], Evaluate]

STEPS_A_POINT = 300  # Newton steps at one value of the parameter, for all attempts together,
SMALL_UNKNOWNS = 60  # up to this number of unknowns; with more unknowns in proportion,
MAX_BUDGET_FACTOR = 5.0  # up to this factor
PATIENCE = 15  # iterations of a corrector without a neighbouring solution
STEPS = StepControl(scale=1.0, first=0.1, largest=0.5, smallest=1e-5)
ITERATIONS = 6  # of a corrector along a homotopy: a shorter step is cheaper than a long correction
ROUGH = 1e-5  # scaled residual along a homotopy, whose points need no accuracy
ROOTLESS = 200  # points of the Newton homotopy, which may lead nowhere
DIFFERENCE = 1e-6  # change of s for the derivative of a family by s
MAX_OVERSHOOT = 1e-9  # distance from [0, 1] that counts as rounding of s


@dataclass(frozen=True, eq=False)
class Homotopy:
    """Equations with a parameter from 0 (easy) to 1, followed by arc length one after the other.

    The last one ends at the equation to solve.

    Attributes
    ----------
    legs
        Equations in order; each has at p = 1 the solutions that the next one has at p = 0.
    start
        (n,) a point near the solution of the first leg at its beginning.
    begins
        Parameters, 0 or slightly more, at which the first leg may begin. It begins at the first one at which the
        corrector converges.
    least
        Parameter below which a path is abandoned, because it runs backwards past the only solution of the easy
        equation.
    max_points
        Largest number of points of one leg.

    Raises
    ------
    InputError
        If `legs` or `begins` is empty.
    """

    legs: tuple[Problem, ...]
    start: FloatArray
    begins: tuple[float, ...] = (0.0,)
    least: float = 0.0
    max_points: int = 600

    def __post_init__(self) -> None:
        """Refuse a homotopy without an equation or without a beginning."""
        for name, need in (("legs", "an equation from p = 0 to 1"), ("begins", "a parameter, such as 0.0")):
            if not getattr(self, name):
                raise input_error(f"Homotopy.{name}", "is empty, so nothing can be followed", f"Give at least {need}.")


def steps_at_most(unknowns: int, share: float = 1.0) -> int:
    """Return the limit of Newton steps of all attempts at one parameter value.

    It is `share` times 300 up to 60 unknowns, and more for more unknowns.
    """
    return int(share * STEPS_A_POINT * min(max(unknowns / SMALL_UNKNOWNS, 1.0), MAX_BUDGET_FACTOR))


def solve_robustly(
    evaluate: Evaluate,
    starts: Iterable[FloatArray],
    options: Newton,
    homotopies: Iterable[Homotopy] = (),
    weights: FloatArray | None = None,
    patience: int = PATIENCE,
    steps: int = 0,
) -> Solution:
    """Solve ``residual(x) = 0`` at a fixed parameter by one method after the other, until one converges.

    The order is: the corrector of `options` from each start; each of `homotopies`; the other globalisations, from the
    start with the smallest residual; the Newton homotopy ``residual(x) - (1 - s) residual(x_start) = 0``, which needs
    no physics. Shorter continuation steps belong between the first two; `stickslip.solve.continuation.advance` takes
    them.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point, as for `newton`.
    starts
        (n,) starts, at least one; they are evaluated lazily, none after one that converged.
    options
        Corrector. A homotopy uses it at each of its steps.
    homotopies
        From easy equations to this one; they are evaluated lazily, none after one that converged.
    weights
        (n,) share of each unknown in the length of a step of a homotopy; default: equal.
    patience
        Largest number of iterations of the other globalisations.
    steps
        Limit of Newton steps of all attempts together; 0: the limit of `steps_at_most`.

    Returns
    -------
    Solution
        The solution with the cost of all attempts. Its `rung` names the method that converged: `Rung.FULL_STEPS`,
        `DAMPED_STEP`, `OTHER_GLOBALISATION` or `HOMOTOPY`; ``collections.Counter(s.rung for s in ...)`` counts a sweep.
        If nothing converges, the attempt with the smallest residual, with its status.

    Examples
    --------
    Homotopy in a load that `loaded` scales by s::

        growing = ByDifference(lambda s: lambda v: loaded(s).linearise(v, omega))
        solve_robustly(lambda v: balance.linearise(v, omega), [guess], Newton(), [Homotopy((growing,), at_rest)])
    """
    spent: list[Solution] = []
    for attempt in _attempts(evaluate, starts, options, homotopies, weights, patience, steps):
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
    steps: int,
) -> Iterator[Solution]:
    tried: list[FloatArray] = []
    left = _Left(steps)
    for start in starts:
        left.steps = left.steps or steps_at_most(start.size) * (not tried)
        if not left.steps:
            return
        tried.append(start)
        yield left.after(newton(evaluate, start, left.at_most(options)))
    x = min(tried, key=lambda v: _finite(float(np.max(np.abs(evaluate(v).residual)))))
    weights = np.ones(x.size) if weights is None else weights
    for homotopy in homotopies:
        if left.steps:
            yield left.after(_followed(homotopy, evaluate, options, weights, left.steps))
    patient = replace(options, max_iterations=patience)
    for name in GLOBALISATIONS:
        if name != options.globalisation and left.steps:
            other = replace(left.at_most(patient), globalisation=name)
            found = replace(newton(evaluate, x, other), rung=Rung.OTHER_GLOBALISATION)
            yield left.after(found)
    if left.steps:
        relaxed = (_Relaxed(evaluate, evaluate(x).residual),)
        wandering = Homotopy(relaxed, x, least=-np.inf, max_points=ROOTLESS)
        yield left.after(_followed(wandering, evaluate, options, weights, left.steps))


@dataclass(eq=False)
class _Left:
    """Remaining Newton steps of a budget."""

    steps: int

    def after(self, attempt: Solution) -> Solution:
        """Return an attempt after subtracting its steps."""
        self.steps = max(self.steps - attempt.iterations, 0)
        return attempt

    def at_most(self, options: Newton) -> Newton:
        """Return the corrector limited to the remaining steps."""
        return replace(options, max_iterations=max(min(options.max_iterations, self.steps), 1))


@dataclass(frozen=True, eq=False)
class _At:
    residual: FloatArray
    jac: Jacobian
    jac_p: FloatArray
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class ByDifference:
    """A family of equations as one equation with the parameter s, whose derivative by s is a finite difference.

    Attributes
    ----------
    family
        Function of s that returns an `evaluate`; s is always in [0, 1].
    """

    family: EvaluateAt

    def linearise(self, x: FloatArray, p: float) -> ParameterEvaluation:
        """Return residual and derivatives at `x` and s = `p`."""
        s = min(max(p, 0.0), 1.0)
        at = self.family(s)(x)
        aside = s + DIFFERENCE if s < 0.5 else s - DIFFERENCE
        other = self.family(aside)(x)
        slope = (other.residual - at.residual) / (aside - s)
        residual = at.residual if abs(p - s) <= MAX_OVERSHOOT else np.full_like(at.residual, np.nan)
        return _At(residual, at.jac, slope, at.seconds_contact + other.seconds_contact)


@dataclass(frozen=True, eq=False)
class _Relaxed:
    """The equation minus the share 1 - s of its residual at the start (Newton homotopy)."""

    evaluate: Evaluate
    start: FloatArray

    def linearise(self, x: FloatArray, p: float) -> _At:
        at = self.evaluate(x)
        return _At(at.residual - (1.0 - p) * self.start, at.jac, self.start, at.seconds_contact)


def _followed(homotopy: Homotopy, evaluate: Evaluate, options: Newton, weights: FloatArray, steps: int) -> Solution:
    """Follow a homotopy roughly to the end of its last leg, and solve there, within `steps` Newton steps."""
    rough = replace(
        options, max_iterations=min(options.max_iterations, ITERATIONS), tolerance=max(options.tolerance, ROUGH)
    )
    control = replace(STEPS, max_points=homotopy.max_points)
    following = Following(
        newton=rough, control=control, weights=weights, predictor="parabola", corrector="kept_factors"
    )
    spent: list[Solution] = []
    x, begins = homotopy.start, homotopy.begins
    for leg in homotopy.legs:
        first = _begun(leg, x, begins, following, spent)
        point = _to_the_end(leg, first, homotopy.least, following, spent, steps)
        x, begins = point.x, (0.0,)
        if point.p != 1.0 or not point.solution.status.converged:
            break
    solution = point.solution
    if solution.status.converged and point.p == 1.0 and leg is homotopy.legs[-1]:
        solution = newton(evaluate, x, options)
        spent.append(solution)
    elif solution.status.converged:
        solution = replace(solution, status=Status.TOO_MANY_ITERATIONS)
    if not solution.status.converged:
        # the residual after a failed step says nothing about the distance to s = 1
        norm = float(np.max(np.abs(evaluate(point.x).residual)))
        solution = replace(solution, x=point.x, residual_norm=norm)
    return replace(charged(solution, spent), rung=Rung.HOMOTOPY)


def _begun(
    leg: Problem, x: FloatArray, begins: tuple[float, ...], following: Following, spent: list[Solution]
) -> Point:
    """Return the first point of a leg, or the last attempt to find it."""
    for begin in begins:
        point = start_point(leg, x, begin, following)
        spent.append(point.solution)
        if point.solution.status.converged:
            break
    return point


def _to_the_end(
    leg: Problem, start: Point, least: float, following: Following, spent: list[Solution], steps: int
) -> Point:
    """Follow a leg from `start` until p = 1, p < `least`, no step converges, or `steps` Newton steps are spent."""
    point = start
    if not start.solution.status.converged:
        return start
    for point in trace(leg, start, 1.0, following):
        spent.append(point.solution)
        if point.p < least or sum(s.iterations for s in spent) > steps - 2 * ITERATIONS:
            break
    return point


def _finite(norm: float) -> float:
    return norm if np.isfinite(norm) else np.inf
