"""Protocol of the linear solvers, the dense solver, and LU factors of arrays and Schur complements."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, TypeGuard

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.blas_threads import threads_for
from stickslip.operators import (
    MAX_CHEAP_ARRAY,
    Bordered,
    Corner,
    Costs,
    Elimination,
    Inverse,
    Jacobian,
    JacobianOperator,
    array_of,
    transpose_of,
)

# assumed number of solutions with a factorised matrix, and of products of each by a Krylov method
SOLUTIONS, PRODUCTS = (5, 10)
MAX_ARRAY_UNKNOWNS = 8000  # largest array, about half a GB
SINGULAR = 1e-15  # ratio of smallest to largest pivot below which a matrix has no usable inverse


class Assembling(JacobianOperator, Protocol):
    """A Jacobian known by its products that can be assembled as an array."""

    @property
    def costs(self) -> Costs:
        """Estimated cost of its linear systems."""
        ...

    def dense(self) -> FloatArray:
        """Return the array."""
        ...


def is_assembling(jac: Jacobian) -> TypeGuard[Assembling]:
    """Whether a Jacobian known by its products can be assembled as an array.

    `isinstance` with a protocol would take longer than solving a small system.
    """
    return hasattr(type(jac), "dense")


class Signed(Protocol):
    """Solver of systems with one factorised matrix, with the sign of its determinant."""

    @property
    def sign(self) -> float: ...  # noqa: D102

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return the solution; see `Inverse`."""
        ...


class LinearSolver(Protocol):
    """Solver of the linear systems of a corrector. `Dense` factorises; iterative solvers need products only."""

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``.

        Parameters
        ----------
        jac
            (n, n) Jacobian; an array may be overwritten.
        right
            (n,) right side.

        Returns
        -------
        ndarray or None
            (n,) solution; None if the Jacobian is singular or no solution was found.
        """
        ...

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve ``[[jac, column], [row, corner]] x = right``; `jac` itself may be singular, as at a fold.

        Parameters
        ----------
        jac
            (n, n) Jacobian; it is not changed.
        column, row, corner
            (n,), (n,) and a number, or (n, m), (m, n) and (m, m): the border.
        right
            (n + m,) right side.

        Returns
        -------
        solution
            (n + m,) solution; None if the bordered matrix is singular or no solution was found.
        sign
            Sign of the determinant of the bordered matrix, 0 if it is singular, NaN if the solver gives no sign.
        """
        ...


@dataclass(frozen=True, slots=True)
class Dense:
    """LU with partial pivoting of the whole Jacobian, which is an array or can be assembled as one."""

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        return solve_dense(_array(jac), right)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system and return the sign of its determinant; see `LinearSolver`."""
        if isinstance(jac, np.ndarray) and isinstance(corner, float) and corner and not row.any():
            return _last_known(jac, column, corner, right)
        return solve_signed(_array(Bordered(jac, column, row, corner)), right)


@dataclass(frozen=True, slots=True)
class Assembled:
    """LU of a Jacobian known by its products.

    If cheap unknowns can be eliminated, the Schur complement is factorised, otherwise `dense` solves with the whole
    array.
    """

    dense: LinearSolver = Dense()

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        elimination = _elimination_of(jac)
        if elimination is None:
            array = assembled(jac)
            return None if array is None else self.dense.solve(array, right)
        factors = reduced_factors(elimination)
        return None if factors is None else factors(right)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system and return the sign of its determinant; see `LinearSolver`."""
        elimination = _elimination_of(Bordered(jac, column, row, corner))
        if elimination is None:
            array = assembled(jac)
            if array is None:
                return None, np.nan
            return self.dense.solve_bordered(array, column, row, corner, right)
        factors = reduced_factors(elimination)
        return (None, 0.0) if factors is None else (factors(right), factors.sign)


def _last_known(
    jac: FloatArray, column: FloatArray, corner: float, right: FloatArray
) -> tuple[FloatArray | None, float]:
    """Solve a bordered system whose last row prescribes the last unknown, by the inner system without a border."""
    last = right[-1] / corner
    inside, sign = solve_signed(np.array(jac, order="F"), right[:-1] - last * column)
    if inside is None or not np.isfinite(inside).all():
        return None, 0.0
    return np.append(inside, last), sign if corner > 0.0 else -sign


def solve_with(linear: LinearSolver, jac: Jacobian, right: FloatArray) -> FloatArray | None:
    """Solve ``jac x = right`` by `linear`; the border of a `Bordered` matrix is passed separately."""
    if isinstance(jac, Bordered):
        flat = jac.flat
        return linear.solve_bordered(flat.jac, flat.column, flat.row, flat.corner, right)[0]
    return linear.solve(jac, right)


def solve_dense(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    """Solve a dense system by LU; None if the matrix is singular to working precision. `matrix` is overwritten."""
    factors = _lu_factors(matrix)
    return None if factors is None else factors(right)


def factorised(linear: LinearSolver, jac: Jacobian) -> Inverse | None:
    """Return the solver of systems with `jac` and with its transpose; None if `jac` is singular.

    An array is factorised once, and overwritten. A Jacobian known by its products is factorised if that costs less than
    solutions for several right sides; otherwise `linear` solves for each right side.
    """
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if isinstance(inside, np.ndarray) or array_pays(jac):
        return factors_of(jac)
    return _Iterated(linear, jac)


def array_pays(jac: Jacobian) -> bool:
    """Whether a Jacobian known by its products can be factorised, and this costs less for several right sides."""
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if not is_assembling(inside) or inside.shape[0] > MAX_ARRAY_UNKNOWNS:
        return False
    costs = inside.costs
    return costs.array < costs.factors + SOLUTIONS * PRODUCTS * costs.product


def factors_of(jac: Jacobian) -> Signed | None:
    """Factorise a Jacobian: an array, which is overwritten, or the Schur complement of one known by its products.

    None if it is singular or cannot be assembled.
    """
    array = array_of(jac)
    if array is not None:
        return _lu_factors(array)
    elimination = _elimination_of(jac)
    if elimination is not None:
        return reduced_factors(elimination)
    array = assembled(jac)
    return None if array is None else _lu_factors(array)


@dataclass(frozen=True, eq=False)
class _Iterated:
    linear: LinearSolver
    jac: Jacobian

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray | None:
        jac = transpose_of(self.jac) if transposed else self.jac
        return solve_with(self.linear, jac, right)


def assembled(jac: Jacobian) -> FloatArray | None:
    """Return a Jacobian known by its products as a new array, borders included.

    None if it cannot be assembled, or is too large.
    """
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if not is_assembling(inside) or inside.shape[0] > MAX_ARRAY_UNKNOWNS:
        return None
    array = inside.dense()
    return replace(jac.flat, jac=array).array() if isinstance(jac, Bordered) else array


def whole_array(jac: Jacobian) -> FloatArray | None:
    """Return a Jacobian as an array if it is one, or known by its products and small; None otherwise."""
    array = array_of(jac)
    return assembled(jac) if array is None and jac.shape[0] <= MAX_CHEAP_ARRAY else array


def is_factorised(jac: Jacobian) -> bool:
    """Whether systems with a Jacobian are solved by LU, because it is an array or costs less as one."""
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if is_assembling(inside):
        return inside.shape[0] <= MAX_ARRAY_UNKNOWNS and not inside.costs.products_pay
    return isinstance(inside, np.ndarray)


def solve_signed(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray | None, float]:
    """Solve a dense system by LU, and return the sign of its determinant (0 if singular), too.

    The `matrix` is overwritten.
    """
    known = _lu_factors(matrix)
    return (None, 0.0) if known is None else (known(right), known.sign)


def _array(jac: Jacobian) -> FloatArray:
    array = array_of(jac)
    if array is None:
        array = assembled(jac)
    if array is None:
        raise input_error(
            "Newton.linear",
            "Dense needs the Jacobian as an array, and this one is known by its products only, or is too large",
            "Give a Krylov solver.",
        )
    return array


@dataclass(frozen=True, eq=False)
class Factored:
    """LU factors of an array."""

    lu: FloatArray
    pivots: FloatArray

    @property
    def sign(self) -> float:
        """Sign of the determinant."""
        swaps = np.count_nonzero(self.pivots != np.arange(self.pivots.size))
        flips = swaps + np.count_nonzero(self.lu.diagonal() < 0.0)
        return 1.0 if flips % 2 == 0 else -1.0

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Solve; see `Inverse`."""
        solution, _ = scipy.linalg.lapack.dgetrs(self.lu, self.pivots, right, trans=int(transposed))
        return np.asarray(solution)


def _lu_factors(matrix: FloatArray) -> Factored | None:
    """Factorise an array, which is overwritten; None if it is singular to working precision."""
    with threads_for(len(matrix)):
        lu, pivots, info = scipy.linalg.lapack.dgetrf(matrix, overwrite_a=True)
    size = np.abs(lu.diagonal())
    size.sort()
    # NaN, which is sorted to the end, and infinity do not pass
    usable = info == 0 and size[0] > SINGULAR * size[-1]
    return Factored(lu, pivots) if usable else None


class Eliminating(JacobianOperator, Protocol):
    """A Jacobian from which cheap unknowns can be eliminated."""

    def eliminated(self) -> Elimination | None:
        """Return the elimination of cheap unknowns; None if the full array is cheaper."""
        ...


@dataclass(frozen=True, eq=False)
class BorderedElimination:
    """Elimination in a bordered matrix; the border remains.

    Parameters
    ----------
    inside
        The elimination without the border.
    columns, rows, corner
        (n, m), (m, n) and (m, m).
    """

    inside: Elimination
    columns: FloatArray
    rows: FloatArray
    corner: FloatArray

    @property
    def size(self) -> int:
        """Number of remaining unknowns, border included."""
        return self.inside.size + len(self.corner)

    @property
    def sign(self) -> float:
        """Sign of the determinant of the eliminated block."""
        return self.inside.sign

    @cached_property
    def _across(self) -> tuple[FloatArray, FloatArray]:
        return self.inside.reduced(self.columns)

    @cached_property
    def _down(self) -> tuple[FloatArray, FloatArray]:
        return self.inside.reduced(self.rows.T, transposed=True)

    def array(self) -> FloatArray:
        """Return the Schur complement (size, size)."""
        n = self.inside.size
        columns, inner = self._across
        out = np.empty((self.size, self.size), order="F")
        out[:n, :n], out[:n, n:] = self.inside.array(), columns
        out[n:, :n], out[n:, n:] = self._down[0].T, self.corner - self.rows @ inner
        return out

    def reduced(self, right: FloatArray, *, transposed: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the right sides of the Schur complement, and their part in the eliminated unknowns.

        See `Elimination`.
        """
        n = len(self.columns)
        rows = self.columns.T if transposed else self.rows
        left, inner = self.inside.reduced(right[:n], transposed=transposed)
        return np.vstack([left, right[n:] - rows @ inner]), np.vstack([inner, np.zeros_like(right[n:])])

    def spread(self, x: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return all unknowns from the remaining ones; see `Elimination`."""
        inner = (self._down if transposed else self._across)[1]
        n = self.inside.size
        all_of_it = self.inside.spread(x[:n], transposed=transposed)
        return np.vstack([all_of_it - inner @ x[n:], x[n:]])


@dataclass(frozen=True, eq=False)
class Reduced:
    """LU factors of the Schur complement of a matrix; None if no unknown remains."""

    elimination: Elimination
    factors: Factored | None

    @property
    def sign(self) -> float:
        """Sign of its determinant."""
        return self.elimination.sign * (1.0 if self.factors is None else self.factors.sign)

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Solve; see `Inverse`."""
        left, inner = self.elimination.reduced(right[:, None], transposed=transposed)
        if self.factors is None:
            return inner[:, 0]
        x = self.factors(left[:, 0], transposed=transposed)
        return (inner + self.elimination.spread(x[:, None], transposed=transposed))[:, 0]


def _is_eliminating(jac: Jacobian) -> TypeGuard[Eliminating]:
    return hasattr(type(jac), "eliminated")


def _elimination_of(jac: Jacobian) -> Elimination | None:
    """Return the elimination of cheap unknowns from a Jacobian, borders included; None if there are none."""
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if not _is_eliminating(inside):
        return None
    own = inside.eliminated()
    if own is None or not isinstance(jac, Bordered):
        return own
    return BorderedElimination(own, *jac.flat.borders)


def reduced_factors(elimination: Elimination) -> Reduced | None:
    """Factorise the Schur complement; None if it is singular to working precision."""
    if elimination.size == 0:
        return Reduced(elimination, None)
    factors = _lu_factors(elimination.array())
    return None if factors is None else Reduced(elimination, factors)
