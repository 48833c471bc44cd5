"""Factors of the last Newton step, used again for the tangent."""

from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.operators import Bordered, Corner, Jacobian
from stickslip.solve.krylov import Automatic
from stickslip.solve.linear import Dense, LinearSolver, Signed, factors_of, is_factorised
from stickslip.solve.newton_method import Solution

KEPT_FACTORS_RESIDUAL = 1e-4  # part of the residual that a step may leave where its Jacobian is that of the solution


@dataclass(eq=False)
class LastFactors:
    """A linear solver that remembers the last factors of an array.

    A full Newton step reduces the residual by the relative change of the Jacobian along the step. Where no contact changes its state,
    this change is nearly zero, so the factors still serve.

    Parameters
    ----------
    linear
        Solver of the systems; factors are remembered if it factorises arrays.

    Attributes
    ----------
    inverse
        The factors; None where there are none.
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
        self.inverse = None  # those of an earlier step are not those of this one
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
