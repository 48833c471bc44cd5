"""Newton steps that reuse factors while they converge, and reuse of the last factors for the tangent.

After a full Newton step the same factors give further corrections, with Broyden's updates of rank one (Kelley, Solving
Nonlinear Equations with Newton's Method, SIAM 2003, chapter 4), while each is clearly smaller than the one before. If
contacts change their states, they are not. Then the Jacobian is factorised again at the smallest residual.
"""

from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.operators import Bordered, Corner, Inverse, Jacobian
from stickslip.solve.iterate import Globalisation, Iterate, Work
from stickslip.solve.krylov import Automatic
from stickslip.solve.line_search import MEMORY, LineSearch
from stickslip.solve.linear import Dense, Factored, LinearSolver, Reduced, Signed, factorised, factors_of, is_factorised
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Status

MAX_CORRECTION_RATIO = 0.5  # largest ratio of a correction to the previous one with the same factors
MAX_CHORD_STEPS = 7  # corrections with the same factors
MAX_REFUSED_TRIALS = 2  # refused trials of a correction, after which the globalisation takes over


class KeptFactors:
    """Newton steps, each followed by corrections with the same factors, for starts near a solution.

    Parameters
    ----------
    tolerance
        Tolerance of the corrector, at which corrections end.
    then
        Globalisation that takes over after a few refused trials, or if the Jacobian is not factorised. None: the
        correction is given up, because a shorter step along a branch costs less.
    known
        Factors of a nearby Jacobian, which are tried first.

    Attributes
    ----------
    inverse
        The last factors, if corrections with them ended at a solution; None before, and if a new Jacobian is needed.
    """

    def __init__(self, tolerance: float, then: Globalisation | None = None, known: Signed | None = None) -> None:
        self.inverse: Signed | None = None
        self._known = known
        self._tolerance = tolerance
        self._then = then
        self._gives_up = then is None
        self._over = False
        self._norms: list[float] = []

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        self.inverse = None
        known, self._known = self._known, None
        step = None if known is None else work.timed(partial(known, -now.at.residual))
        if known is not None and step is not None:
            trial = work.at(now.x + step)
            if trial.norm < now.norm:
                return self._corrected(work, known, step, trial)
        if self._over or not is_factorised(now.at.jac):
            self._then = self._then or LineSearch()
            return self._then.advance(work, now)
        self._norms = [*self._norms[1 - MEMORY :], now.norm]
        solve = factorised(work.linear, now.at.jac)
        step = None if solve is None else work.timed(partial(solve, -now.at.residual))
        if solve is None or step is None:
            return Status.SINGULAR
        share = 1.0
        while work.rejected <= MAX_REFUSED_TRIALS:
            trial = work.at(now.x + share * step)
            if trial.norm <= (1.0 - 1e-4 * share) * max(self._norms):
                return self._corrected(work, solve, step, trial) if share == 1.0 else trial
            work.rejected += 1
            share *= 0.5
        self._over = True
        return Status.STALLED if self._gives_up else self.advance(work, now)

    def _corrected(self, work: Work, solve: Inverse, step: FloatArray, here: Iterate) -> Iterate:
        """Continue from the end of a full Newton step with its factors; return the iterate with the smallest residual."""
        steps, best = [step], here
        while len(steps) <= MAX_CHORD_STEPS and np.isfinite(here.norm) and here.norm > self._tolerance:
            next_one = work.timed(partial(solve, -here.at.residual))
            if next_one is None:
                break
            step = next_one
            for one, after in pairwise(steps):
                step = step + after * (one @ step) / (one @ one)
            last = steps[-1]
            along = (last @ step) / (last @ last)
            if along >= MAX_CORRECTION_RATIO:
                break
            step = step / (1.0 - along)
            if np.linalg.norm(step) > MAX_CORRECTION_RATIO * np.linalg.norm(last):
                break
            steps.append(step)
            here = work.at(here.x + step)
            best = here if here.norm < best.norm else best
        if best.norm <= self._tolerance and isinstance(solve, Factored | Reduced):
            self.inverse = solve
        return best


KEPT_FACTORS_RESIDUAL = 1e-4  # share of the residual that a step may leave if its Jacobian still holds at the solution


@dataclass(eq=False)
class LastFactors:
    """A linear solver that remembers the last factors of an array.

    A full Newton step reduces the residual by the relative change of the Jacobian along the step. If no contact changes
    its state, this change is nearly zero, so that the factors are still accurate.

    Parameters
    ----------
    linear
        Solver of the systems; factors are remembered if it factorises arrays.

    Attributes
    ----------
    inverse
        The factors; None if there are none.
    residual
        (n,) residual or its negative at the state of the factors.
    """

    linear: LinearSolver
    inverse: Signed | None = None
    residual: FloatArray = field(default_factory=lambda: np.zeros(1))

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        if self._factorises(jac):
            return self._solved(jac, right)
        self.inverse = None  # factors of an earlier step do not belong to this Jacobian
        return self.linear.solve(jac, right)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system; see `LinearSolver`."""
        if not self._factorises(jac):
            self.inverse = None
            return self.linear.solve_bordered(jac, column, row, corner, right)
        found = self._solved(Bordered(jac, column, row, corner), right)
        return found, 0.0 if self.inverse is None else self.inverse.sign

    def at(self, solution: Solution) -> Signed | None:
        """Return the factors if they also hold for the Jacobian at a solution."""
        before = float(np.abs(self.residual).max())
        return self.inverse if solution.residual_norm <= KEPT_FACTORS_RESIDUAL * before else None

    def _factorises(self, jac: Jacobian) -> bool:
        if isinstance(self.linear, Automatic):
            return is_factorised(jac)
        return isinstance(self.linear, Dense) and isinstance(jac, np.ndarray)

    def _solved(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        self.inverse = factors_of(jac)
        self.residual = right
        return None if self.inverse is None else self.inverse(right)
