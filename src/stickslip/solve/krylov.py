"""Linear systems whose matrix is known by its products: preconditioned Krylov methods (SciPy's), and the choice between these and LU.

A system ``J x = b`` is solved as ``(J P⁻¹) y = b, x = P⁻¹ y``: preconditioned from the right, so that the residual that is made small is the
one that Newton sees.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, Protocol, runtime_checkable
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse.linalg

from stickslip.arrays import FloatArray
from stickslip.errors import check_choice, input_error
from stickslip.solve.linear import Dense, Jacobian, JacobianOperator, LinearSolver

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]
WORN = 2.0  # growth of the iterations at which a preconditioner is made anew ...
YOUNG = 12  # ... though not below that many iterations, which cost less than new factors


@runtime_checkable
class Preconditioned(JacobianOperator, Protocol):
    """A Jacobian known by its products that can make a preconditioner."""

    @property
    def problem(self) -> object:
        """What it is the Jacobian of; what is kept from one of its Jacobians serves the others."""
        ...

    def preconditioner(self) -> object | None:
        """Return what of a new preconditioner is costly, such as factors; None if there is none."""
        ...

    def preconditioned_by(self, kept: object) -> tuple[Solve, Product]:
        """Return how to solve ``P x = y``, with P from what was kept and from this Jacobian, and ``J v`` as a function of v and ``P v``."""
        ...


@dataclass(eq=False)
class KrylovCounts:
    """What a Krylov solver did so far: systems solved, products with a Jacobian, preconditioners made, systems given up."""

    systems: int = 0
    products: int = 0
    preconditioners: int = 0
    failures: int = 0


@dataclass(eq=False)
class _Kept:
    """A preconditioner and the products that its first system took."""

    preconditioner: object
    first: int = 0
    last: int = 0

    @property
    def worn(self) -> bool:
        return self.last > max(WORN * self.first, YOUNG)


@dataclass(frozen=True, eq=False, kw_only=True)
class Krylov:
    """Preconditioned GMRES or BiCGStab for Jacobians known by their products.

    A preconditioner is kept for the next Jacobians of the same problem until it makes the iteration twice as long as it was with it
    at first.

    Parameters
    ----------
    method
        ``gmres`` (Saad & Schultz 1986) without restart, or ``bicgstab`` (van der Vorst 1992), which keeps fewer vectors.
    tolerance
        Residual left by a Newton step, relative to the right side: an inexact Newton method (Dembo, Eisenstat & Steihaug 1982).
    tangent_tolerance
        The same for the tangent of a branch, whose right side is zero but for the border.
    max_products
        Products with the Jacobian in one system. What was reached then counts as a solution if its relative residual is below the root
        of the tolerance.
    counts
        What was done so far.
    memory
        The preconditioner of each problem.
    """

    method: Literal["gmres", "bicgstab"] = "gmres"
    tolerance: float = 1e-2
    tangent_tolerance: float = 1e-6
    max_products: int = 100
    counts: KrylovCounts = field(default_factory=KrylovCounts)
    memory: "WeakKeyDictionary[object, _Kept]" = field(
        default_factory=WeakKeyDictionary, repr=False
    )

    def __post_init__(self) -> None:
        check_choice("Krylov.method", self.method, ("gmres", "bicgstab"))

    def __reduce__(self) -> tuple["partial[Krylov]", tuple[()]]:
        """Pickle the options alone: what is kept belongs to the problems of one process."""
        options = ("method", "tolerance", "tangent_tolerance", "max_products")
        return partial(Krylov, **{name: getattr(self, name) for name in options}), ()

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right`` to `tolerance`; see `LinearSolver`."""
        return self._solve(_preconditioned(jac), None, right, self.tolerance)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: float, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system, whose preconditioner has the same border; the sign is not known. See `LinearSolver`."""
        tolerance = self.tolerance if np.any(right[:-1]) else self.tangent_tolerance
        border = _Border(column, row, corner)
        return self._solve(_preconditioned(jac), border, right, tolerance), np.nan

    def _solve(
        self, jac: Preconditioned, border: "_Border | None", right: FloatArray, tolerance: float
    ) -> FloatArray | None:
        """Solve with the preconditioner that is kept, and with a new one if that fails or is worn."""
        self.counts.systems += 1
        if not np.any(right):
            return np.zeros_like(right)
        kept = self.memory.get(jac.problem)
        if kept is not None and not kept.worn:
            solution, left = self._iterate(jac, kept, border, right, tolerance)
            if left <= tolerance:
                return solution
        # the old factors go before the new ones come: they are most of what a large problem holds
        self.memory.pop(jac.problem, None)
        kept = None
        made = jac.preconditioner()
        if made is not None:
            self.counts.preconditioners += 1
            kept = self.memory[jac.problem] = _Kept(made)
            solution, left = self._iterate(jac, kept, border, right, tolerance)
            kept.first = kept.last
            if left <= max(tolerance, np.sqrt(tolerance)):
                return solution
        self.counts.failures += 1
        return None

    def _iterate(
        self,
        jac: Preconditioned,
        kept: _Kept,
        border: "_Border | None",
        right: FloatArray,
        tolerance: float,
    ) -> tuple[FloatArray, float]:
        """Return the solution and its relative residual, which is `tolerance` where that was reached."""
        before = self.counts.products
        system = _system(*jac.preconditioned_by(kept.preconditioner), border)

        def product(y: FloatArray) -> FloatArray:
            self.counts.products += 1
            return system.product(y)

        operator = scipy.sparse.linalg.LinearOperator(
            (right.size, right.size), matvec=product, dtype=float
        )
        if self.method == "gmres":
            y, failed = scipy.sparse.linalg.gmres(
                operator, right, rtol=tolerance, restart=self.max_products, maxiter=1
            )
        else:
            y, failed = scipy.sparse.linalg.bicgstab(
                operator, right, rtol=tolerance, maxiter=self.max_products // 2
            )
        kept.last = self.counts.products - before
        left = tolerance
        if failed:
            left = float(np.linalg.norm(right - system.product(y)) / np.linalg.norm(right))
        return system.precondition(y), left


@dataclass(frozen=True, eq=False)
class _Border:
    column: FloatArray
    row: FloatArray
    corner: float


@dataclass(frozen=True, eq=False)
class _System:
    """What a Krylov method needs: the solve with the preconditioner, and the product with the matrix after it."""

    precondition: Callable[[FloatArray], FloatArray]
    product: Callable[[FloatArray], FloatArray]


def _system(solve: Solve, after: Product, border: _Border | None) -> _System:
    """Put the same border around matrix and preconditioner; that of the latter is eliminated."""
    if border is None:
        return _System(solve, lambda y: after(solve(y), y))
    solved = solve(border.column)
    pivot = border.corner - float(border.row @ solved)
    # where P is singular in the direction of the border, any number will do: P is an approximation
    pivot = pivot if pivot != 0.0 else 1.0

    def precondition(y: FloatArray) -> FloatArray:
        x = solve(y[:-1])
        z = float(y[-1] - border.row @ x) / pivot
        return np.append(x - z * solved, z)

    def product(y: FloatArray) -> FloatArray:
        v = precondition(y)
        x, z = v[:-1], v[-1]
        top = after(x, y[:-1] - z * border.column) + z * border.column
        return np.append(top, border.row @ x + border.corner * z)

    return _System(precondition, product)


def _preconditioned(jac: Jacobian) -> Preconditioned:
    if isinstance(jac, Preconditioned):
        return jac
    raise input_error(
        "Newton.linear",
        f"Krylov needs a Jacobian that makes its preconditioner, and got {type(jac).__name__}",
        "Give Dense for an array.",
    )


@dataclass(frozen=True, eq=False)
class Automatic:
    """LU for a Jacobian that is an array, and a Krylov method for one that is known by its products."""

    dense: LinearSolver = Dense()  # noqa: RUF009  # frozen
    krylov: LinearSolver = field(default_factory=Krylov)

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        return self._solver(jac).solve(jac, right)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: float, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system; see `LinearSolver`."""
        return self._solver(jac).solve_bordered(jac, column, row, corner, right)

    def _solver(self, jac: Jacobian) -> LinearSolver:
        return self.dense if isinstance(jac, np.ndarray) else self.krylov


def to_tolerance(linear: LinearSolver, tolerance: float) -> LinearSolver:
    """Return `linear` with another relative residual of its solutions; LU leaves none. Preconditioners and counts are shared."""
    if isinstance(linear, Krylov):
        return replace(linear, tolerance=tolerance)
    if isinstance(linear, Automatic):
        return replace(linear, krylov=to_tolerance(linear.krylov, tolerance))
    return linear
