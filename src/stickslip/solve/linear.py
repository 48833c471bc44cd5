"""The linear systems of Newton and continuation: what a solver of them is, and the dense one."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.errors import input_error

SINGULAR = 1e-15  # smallest pivot over largest; below, the matrix has no usable inverse


class JacobianOperator(Protocol):
    """A Jacobian that is known by its products."""

    @property
    def shape(self) -> tuple[int, int]: ...  # noqa: D102

    def matvec(self, v: FloatArray) -> FloatArray: ...  # noqa: D102

    def rmatvec(self, v: FloatArray) -> FloatArray: ...  # noqa: D102


Jacobian = FloatArray | JacobianOperator


class LinearSolver(Protocol):
    """How the linear systems of a corrector are solved. `Dense` factorises; iterative solvers need products only."""

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
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: float, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve ``[[jac, column], [row, corner]] x = right``; `jac` itself may be singular, as at a fold.

        Parameters
        ----------
        jac
            (n, n) Jacobian; it is left as it is.
        column, row, corner
            (n,), (n,), number: the border.
        right
            (n + 1,) right side.

        Returns
        -------
        solution
            (n + 1,) solution; None if the bordered matrix is singular or no solution was found.
        sign
            Sign of the determinant of the bordered matrix, 0 if it is singular, NaN where the solver cannot tell.
        """
        ...


@dataclass(frozen=True, slots=True)
class Dense:
    """LU with partial pivoting; the Jacobian is an array. The right choice up to about a thousand unknowns."""

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        return solve_signed(_array(jac), right)[0]

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: float, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system and return the sign of its determinant; see `LinearSolver`."""
        return solve_signed(bordered_array(_array(jac), column, row, corner), right)


@dataclass(frozen=True, eq=False)
class Bordered:
    """The matrix ``[[jac, column], [row, corner]]`` as an operator."""

    jac: Jacobian
    column: FloatArray
    row: FloatArray
    corner: float

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        n = self.column.size + 1
        return n, n

    def matvec(self, v: FloatArray) -> FloatArray:
        """Return its product with `v` (n + 1,)."""
        top = times(self.jac, v[:-1]) + self.column * v[-1]
        return np.append(top, self.row @ v[:-1] + self.corner * v[-1])

    def rmatvec(self, v: FloatArray) -> FloatArray:
        """Return the product of its transpose with `v` (n + 1,)."""
        top = transposed_times(self.jac, v[:-1]) + self.row * v[-1]
        return np.append(top, self.column @ v[:-1] + self.corner * v[-1])


def solve_with(linear: LinearSolver, jac: Jacobian, right: FloatArray) -> FloatArray | None:
    """Solve ``jac x = right`` by `linear`, which is given a border apart from its matrix."""
    if isinstance(jac, Bordered):
        return linear.solve_bordered(jac.jac, jac.column, jac.row, jac.corner, right)[0]
    return linear.solve(jac, right)


def times(jac: Jacobian, v: FloatArray) -> FloatArray:
    """Return ``jac @ v``."""
    return jac @ v if isinstance(jac, np.ndarray) else jac.matvec(v)


def transposed_times(jac: Jacobian, v: FloatArray) -> FloatArray:
    """Return ``jac.T @ v``."""
    return v @ jac if isinstance(jac, np.ndarray) else jac.rmatvec(v)


def bordered_array(
    jac: FloatArray, column: FloatArray, row: FloatArray, corner: float
) -> FloatArray:
    """Return ``[[jac, column], [row, corner]]`` as a new array, in the order LAPACK likes."""
    n = column.size
    matrix = np.empty((n + 1, n + 1), order="F")
    matrix[:n, :n] = jac
    matrix[:n, n] = column
    matrix[n, :n] = row
    matrix[n, n] = corner
    return matrix


def solve_dense(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    """Solve a dense system by LU; None if the matrix is singular to working precision. `matrix` is overwritten."""
    return solve_signed(matrix, right)[0]


def factorised(
    linear: LinearSolver, jac: Jacobian
) -> Callable[[FloatArray], FloatArray | None] | None:
    """Return the solution of ``jac x = right`` by right side; None if `jac` is singular.

    An array is factorised once, and overwritten; a Jacobian known by its products is solved by `linear` for each right side.
    """
    if isinstance(jac, Bordered) and isinstance(jac.jac, np.ndarray):
        jac = bordered_array(jac.jac, jac.column, jac.row, jac.corner)
    if not isinstance(jac, np.ndarray):
        return lambda right: solve_with(linear, jac, right)
    lu, pivots = _factors(jac)
    if lu is None:
        return None
    return lambda right: np.asarray(scipy.linalg.lapack.dgetrs(lu, pivots, right)[0])


def _factors(matrix: FloatArray) -> tuple[FloatArray | None, FloatArray]:
    """Return LU factors and pivots; None if the matrix is singular to working precision. `matrix` is overwritten."""
    lu, pivots, info = scipy.linalg.lapack.dgetrf(matrix, overwrite_a=True)
    size = np.abs(np.diagonal(lu))
    if info != 0 or not np.all(np.isfinite(size)) or size.min() <= SINGULAR * size.max():
        return None, pivots
    return lu, pivots


def solve_signed(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray | None, float]:
    """Solve a dense system by LU and return the sign of its determinant too (0 if singular). `matrix` is overwritten."""
    lu, pivots = _factors(matrix)
    if lu is None:
        return None, 0.0
    solution, _ = scipy.linalg.lapack.dgetrs(lu, pivots, right)
    swaps = np.count_nonzero(pivots != np.arange(pivots.size))
    flips = swaps + np.count_nonzero(np.diagonal(lu) < 0.0)
    return np.asarray(solution, dtype=float), 1.0 if flips % 2 == 0 else -1.0


def _array(jac: Jacobian) -> FloatArray:
    if isinstance(jac, np.ndarray):
        return jac
    raise input_error(
        "Newton.linear",
        "Dense needs the Jacobian as an array, and this one is known by its products only",
        "Give a Krylov solver.",
    )
