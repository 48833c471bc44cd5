"""Preconditioned Krylov methods for linear systems known by products, and the choice between these and LU.

A system ``J x = b`` is solved as ``(J P⁻¹) y = b, x = P⁻¹ y``. This is preconditioning from the right, so that the
minimised residual is the residual of Newton's method. GMRES (Saad & Schultz 1986) is the package's own: SciPy
orthogonalises a new vector against one other at a time in Python, which takes more than half of the time if a product
takes a tenth of a millisecond.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal, Protocol, TypeGuard
from weakref import WeakKeyDictionary

import numpy as np
import scipy.linalg
import scipy.sparse.linalg

from stickslip.arrays import FloatArray
from stickslip.errors import check_choice, input_error
from stickslip.operators import Bordered, Corner, Jacobian, JacobianOperator, array_of, times
from stickslip.solve.linear import MAX_ARRAY_UNKNOWNS, Assembled, Assembling, Dense, LinearSolver, is_assembling

Solve = Callable[[FloatArray], FloatArray]
Product = Callable[[FloatArray, FloatArray], FloatArray]
MAX_ITERATION_GROWTH = 2.0  # growth of the iterations at which a new preconditioner is made ...
MIN_WORN_ITERATIONS = 12  # ... unless there are fewer iterations than this, which cost less than new factors
GAIN = 0.1  # share of the residual of a bordered system above which a further correction does not help
CREDIT = 4.0  # largest credit from systems that were cheaper by products, in costs of an array
PAUSES = (4, 64)  # systems that are factorised before products are tried again: the first and the largest number
MIN_PRODUCTS = 8  # smallest limit of products in a trial
COARSE = 1e-4  # tolerance above which rounding does not matter
ROUNDING = 2.0  # factor on the tolerance for the rounding of the product that computes the residual


class Preconditioned(JacobianOperator, Protocol):
    """A Jacobian known by its products that can make a preconditioner."""

    @property
    def problem(self) -> object:
        """Key of the equation; Jacobians with the same key can share a preconditioner."""
        ...

    def preconditioner(self) -> object | None:
        """Return the costly part of a new preconditioner, such as factors; None if there is none."""
        ...

    def preconditioned_by(self, kept: object) -> tuple[Solve, Product]:
        """Return the solver of ``P x = y``, and ``J v`` as a function of v and ``P v``.

        P consists of the `kept` part and this Jacobian.
        """
        ...


class Graded(Preconditioned, Protocol):
    """A Jacobian with a second, better preconditioner for systems in which the first one fails."""

    def better_preconditioner(self, kept: object) -> object | None:
        """Return the costly part of a better preconditioner than `kept`; None if there is none."""
        ...


class Either(Preconditioned, Assembling, Protocol):
    """A Jacobian for which systems can be solved by products or as an array."""


def is_preconditioned(jac: Jacobian) -> TypeGuard[Preconditioned]:
    """Whether a Jacobian makes a preconditioner."""
    return hasattr(type(jac), "preconditioned_by")


def is_either(jac: Jacobian) -> TypeGuard[Either]:
    """Whether systems with a Jacobian can be solved by products or as an array."""
    return is_preconditioned(jac) and is_assembling(jac)


def is_graded(jac: Preconditioned) -> TypeGuard[Graded]:
    """Whether a Jacobian has a second, better preconditioner."""
    return hasattr(type(jac), "better_preconditioner")


@dataclass(eq=False)
class KrylovCounts:
    """Work of a Krylov solver so far: systems solved, products with a Jacobian, preconditioners made, systems given up."""

    systems: int = 0
    products: int = 0
    preconditioners: int = 0
    failures: int = 0


@dataclass(eq=False)
class _Kept:
    """A preconditioner, its initial number of products per digit, and whether it takes many more now (worn)."""

    preconditioner: object
    rate: float = 0.0
    worn: bool = False

    def took(self, products: int, tolerance: float) -> None:
        """Record the cost of a system; the first one is the reference."""
        digits = -np.log10(tolerance)
        self.rate = self.rate or products / digits
        self.worn = products > max(MAX_ITERATION_GROWTH * self.rate * digits, MIN_WORN_ITERATIONS)


@dataclass(frozen=True, eq=False, kw_only=True)
class Krylov:
    """Preconditioned GMRES or BiCGStab for Jacobians known by their products.

    A preconditioner is reused for Jacobians of the same problem until the iteration takes twice as many products as
    with the first one.

    Parameters
    ----------
    method
        ``gmres`` (Saad & Schultz 1986) without restart, or ``bicgstab`` (van der Vorst 1992), which keeps fewer
        vectors.
    tolerance
        Residual of a Newton step relative to the right side: an inexact Newton method (Dembo, Eisenstat & Steihaug
        1982).
    tangent_tolerance
        The same for the tangent of a branch, whose right side is zero except in the border; the smaller one of this and
        `tolerance` applies.
    max_products
        Largest number of products with the Jacobian in one system.
    lenient
        Whether the result after so many products is accepted if its relative residual is below the square root of the
        tolerance.
    counts
        Work so far.
    memory
        The preconditioner of each problem.
    """

    method: Literal["gmres", "bicgstab"] = "gmres"
    tolerance: float = 1e-2
    tangent_tolerance: float = 1e-6
    max_products: int = 100
    lenient: bool = True
    counts: KrylovCounts = field(default_factory=KrylovCounts)
    memory: "WeakKeyDictionary[object, _Kept]" = field(default_factory=WeakKeyDictionary, repr=False)

    def __post_init__(self) -> None:
        check_choice("Krylov.method", self.method, ("gmres", "bicgstab"))

    def __reduce__(self) -> tuple["partial[Krylov]", tuple[()]]:
        """Pickle only the options: preconditioners belong to the problems of one process."""
        options = ("method", "tolerance", "tangent_tolerance", "max_products", "lenient")
        return partial(Krylov, **{name: getattr(self, name) for name in options}), ()

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right`` to `tolerance`; see `LinearSolver`."""
        return self._solve(jac, right, self.tolerance)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system with a preconditioner of the same border; the sign is NaN. See `LinearSolver`."""
        whole = Bordered(jac, column, row, corner).flat
        tolerance = self.tolerance
        if not np.any(right[: whole.jac.shape[0]]):
            tolerance = min(tolerance, self.tangent_tolerance)
        return self._solve(whole, right, tolerance), np.nan

    def _solve(self, jac: Jacobian, right: FloatArray, tolerance: float) -> FloatArray | None:
        """Solve with the kept preconditioner, and with a new one if it fails or is worn."""
        jac = jac.flat if isinstance(jac, Bordered) else jac
        inside = _preconditioned(jac.jac if isinstance(jac, Bordered) else jac)
        self.counts.systems += 1
        if not np.any(right):
            return np.zeros_like(right)
        kept = self.memory.get(inside.problem)
        if kept is not None and not kept.worn:
            solution, left = self._refined(jac, kept, right, tolerance)
            if left <= tolerance:
                return solution
        # delete old factors before making new ones: they take most of the memory of a large problem
        self.memory.pop(inside.problem, None)
        made = inside.preconditioner()
        while made is not None:
            self.counts.preconditioners += 1
            kept = self.memory[inside.problem] = _Kept(made)
            solution, left = self._refined(jac, kept, right, tolerance)
            if left <= (max(tolerance, np.sqrt(tolerance)) if self.lenient else tolerance):
                return solution
            made = inside.better_preconditioner(made) if is_graded(inside) else None
        self.counts.failures += 1
        return None

    def _refined(self, jac: Jacobian, kept: _Kept, right: FloatArray, tolerance: float) -> tuple[FloatArray, float]:
        """Return a solution and its relative residual, which is `tolerance` if that was reached.

        A preconditioner in single precision is linear only to that precision. Inside a border, a matrix and its
        preconditioner may be singular, so that large numbers cancel in every product. The iteration then ends at this
        level of rounding, and corrections from the true residual are added as long as they help.
        """
        before = self.counts.products
        solution, left = self._iterate(jac, kept, right, tolerance)
        kept.took(self.counts.products - before, tolerance)
        if tolerance > COARSE:
            return solution, left
        size, best = float(np.linalg.norm(right)), np.inf
        while True:
            self.counts.products += 1
            rest = right - times(jac, solution)
            left = float(np.linalg.norm(rest)) / size
            if left <= ROUNDING * tolerance:
                return solution, tolerance
            if left > GAIN * best or not np.isfinite(left):
                return solution, left
            best = left
            solution = solution + self._iterate(jac, kept, rest, tolerance / left)[0]

    def _iterate(self, jac: Jacobian, kept: _Kept, right: FloatArray, tolerance: float) -> tuple[FloatArray, float]:
        """Return a solution and the relative residual of the iteration, which is `tolerance` if that was reached."""
        system = _system(jac, kept.preconditioner)

        def product(y: FloatArray) -> FloatArray:
            self.counts.products += 1
            return system.product(y)

        if self.method == "gmres":
            y, left = gmres(product, right, tolerance, self.max_products)
            return system.precondition(y), left
        operator = scipy.sparse.linalg.LinearOperator((right.size, right.size), matvec=product, dtype=float)
        y, failed = scipy.sparse.linalg.bicgstab(operator, right, rtol=tolerance, maxiter=self.max_products // 2)
        left = tolerance
        if failed:
            left = float(np.linalg.norm(right - system.product(y)) / np.linalg.norm(right))
        return system.precondition(y), left


@dataclass(frozen=True, eq=False)
class _System:
    """The operations of a Krylov method: solution with the preconditioner, and subsequent product with the matrix."""

    precondition: Callable[[FloatArray], FloatArray]
    product: Callable[[FloatArray], FloatArray]


def _system(jac: Jacobian, kept: object) -> _System:
    """Add the borders of the matrix to the preconditioner, too, by elimination."""
    if not isinstance(jac, Bordered):
        solve, after = _preconditioned(jac).preconditioned_by(kept)
        return _System(solve, lambda y: after(solve(y), y))
    solve, after = _preconditioned(jac.jac).preconditioned_by(kept)
    columns, rows, corner = jac.borders
    n = columns.shape[0]
    solved = np.stack([solve(column) for column in columns.T], axis=1)
    pivot = _inverse(corner - rows @ solved)

    def precondition(y: FloatArray) -> FloatArray:
        x = solve(y[:n])
        z = pivot @ (y[n:] - rows @ x)
        return np.append(x - solved @ z, z)

    def product(y: FloatArray) -> FloatArray:
        v = precondition(y)
        x, z = v[:n], v[n:]
        given = columns @ z
        return np.append(after(x, y[:n] - given) + given, rows @ x + corner @ z)

    return _System(precondition, product)


def _inverse(matrix: FloatArray) -> FloatArray:
    """Return the inverse, with an arbitrary value for zero singular values: the matrix is an approximation."""
    if matrix.shape == (1, 1):
        return 1.0 / np.where(matrix == 0.0, 1.0, matrix)
    left, sizes, right = np.linalg.svd(matrix)
    return np.asarray((right.T / np.where(sizes > 0.0, sizes, 1.0)) @ left.T)


def _preconditioned(jac: Jacobian) -> Preconditioned:
    if is_preconditioned(jac):
        return jac
    raise input_error(
        "Newton.linear",
        f"Krylov needs a Jacobian that makes its preconditioner, and got {type(jac).__name__}",
        "Give Dense for an array.",
    )


@dataclass(eq=False)
class _Account:
    """Cost of the systems of a problem by products, and number of next systems to be factorised.

    Attributes
    ----------
    debt
        Additional seconds of products compared with arrays, estimated by `Costs`; negative if products took less.
    arrays
        Systems to be factorised before products are tried again.
    pause
        Number of systems to be factorised the next time.
    """

    debt: float = 0.0
    arrays: int = 0
    pause: int = PAUSES[0]

    def took(self, spent: float, array: float, *, failed: bool) -> None:
        """Record the cost of a system by products, and its cost as an array."""
        self.debt = max(self.debt + spent - array, -CREDIT * array)
        if failed or self.debt > array:
            self.arrays, self.debt = self.pause, 0.0
            self.pause = min(2 * self.pause, PAUSES[1])
        elif self.debt == -CREDIT * array:
            self.pause = PAUSES[0]


_By = Callable[[LinearSolver, Jacobian], tuple[FloatArray | None, float]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Automatic:
    """LU for a Jacobian that is an array; for one known by its products, a Krylov method or LU, whichever cost less.

    Products are counted, not timed, so that every run makes the same choices; `Costs` estimates the time of a product
    and of an array. A small array, as with stuck contacts, is factorised at once. If a Krylov method costs more than an
    array, or finds no solution, LU solves some systems of the same problem before the Krylov method is tried again.

    Parameters
    ----------
    dense, krylov
        The solvers.
    accounts
        Costs so far, by problem and tolerance.
    """

    dense: LinearSolver = Dense()  # noqa: RUF009  # frozen
    krylov: Krylov = field(default_factory=Krylov)
    accounts: "WeakKeyDictionary[object, dict[float, _Account]]" = field(default_factory=WeakKeyDictionary, repr=False)

    def __reduce__(self) -> tuple["partial[Automatic]", tuple[()]]:
        """Pickle only the solvers: costs so far belong to the problems of one process."""
        return partial(Automatic, dense=self.dense, krylov=self.krylov), ()

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        return self._solve(jac, lambda linear, whole: (linear.solve(whole, right), np.nan))[0]

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system; see `LinearSolver`."""

        def by(linear: LinearSolver, inside: Jacobian) -> tuple[FloatArray | None, float]:
            return linear.solve_bordered(inside, column, row, corner, right)

        return self._solve(jac, by)

    def _solve(self, jac: Jacobian, by: _By) -> tuple[FloatArray | None, float]:
        """Solve `by` the cheaper solver."""
        if array_of(jac) is not None:
            return by(self.dense, jac)
        inside = jac.flat.jac if isinstance(jac, Bordered) else jac
        if not is_either(inside):
            return by(self.krylov, jac)
        account = self.accounts.setdefault(inside.problem, {}).setdefault(self.krylov.tolerance, _Account())
        costs, within = inside.costs, inside.shape[0] <= MAX_ARRAY_UNKNOWNS
        if account.arrays > 0 or not costs.products_pay:
            account.arrays = max(account.arrays - 1, 0)
            if within:
                return by(Assembled(self.dense), jac)
        counts, before = self.krylov.counts, replace(self.krylov.counts)
        krylov = self.krylov
        if within:  # limited to the cost of an array, which is the alternative
            worth = max(int(costs.array / costs.product), MIN_PRODUCTS)
            krylov = replace(krylov, max_products=min(krylov.max_products, worth), lenient=False)
        found = by(krylov, jac)
        products = counts.products - before.products
        new = counts.preconditioners - before.preconditioners
        spent = products * costs.product + new * costs.factors
        account.took(spent, costs.array, failed=found[0] is None)
        if found[0] is not None:
            return found
        return by(Assembled(self.dense), jac) if within else found


def to_tolerance(linear: LinearSolver, tolerance: float) -> LinearSolver:
    """Return `linear` with another relative tolerance, which LU ignores. Preconditioners and counts are shared."""
    if isinstance(linear, Krylov):
        return replace(linear, tolerance=tolerance)
    if isinstance(linear, Automatic):
        return replace(linear, krylov=replace(linear.krylov, tolerance=tolerance))
    return linear


def gmres(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, tolerance: float, most: int
) -> tuple[FloatArray, float]:
    """Solve a linear system whose matrix is known by its products.

    Parameters
    ----------
    product
        The product of the matrix with a vector (n,).
    right
        (n,) right side, not zero.
    tolerance
        Residual at the end, relative to the right side.
    most
        Largest number of products.

    Returns
    -------
    solution
        (n,)
    residual
        Relative residual of the solution.
    """
    size = float(np.linalg.norm(right))
    most = min(most, right.size)
    basis = np.empty((most + 1, right.size))
    basis[0] = right / size
    triangle = np.zeros((most, most))
    turns = np.eye(most + 1)  # product of all rotations that made the Hessenberg matrix triangular
    rest = np.zeros(most + 1)
    rest[0] = 1.0
    count = 0
    while count < most and abs(rest[count]) > tolerance:
        before = basis[: count + 1]
        new = product(basis[count])
        column = np.zeros(count + 2)
        for _ in range(2):  # twice: the first pass leaves rounding errors
            share = before @ new
            new = new - share @ before
            column[:-1] += share
        column[-1] = length = float(np.linalg.norm(new))
        scale = float(np.linalg.norm(column))
        column[:-1] = turns[: count + 1, : count + 1] @ column[:-1]
        pivot = float(np.hypot(column[-2], column[-1])) or 1.0
        c, s = column[-2] / pivot, column[-1] / pivot
        turns[count : count + 2] = c * turns[count] + s * turns[count + 1], c * turns[count + 1] - s * turns[count]
        rest[count], rest[count + 1] = c * rest[count], -s * rest[count]
        triangle[:count, count], triangle[count, count] = column[:-2], pivot
        count += 1
        if not length > np.finfo(float).eps * scale:
            break
        basis[count] = new / length
    shares = scipy.linalg.solve_triangular(triangle[:count, :count], rest[:count], check_finite=False)
    return size * (shares @ basis[:count]), abs(float(rest[count]))
