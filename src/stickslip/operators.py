"""Square matrices that need not be arrays, the interface of problems to solvers: matrix products, bordered matrices."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray

# in a Newton iteration: systems by LU, systems by a Krylov method that leaves 1 % of the residual, products of the latter
BY_ARRAY, BY_PRODUCTS, PRODUCTS = 4, 6, 8
MAX_CHEAP_ARRAY = 500  # unknowns up to which a whole array is assembled whatever its cost


class JacobianOperator(Protocol):
    """A Jacobian that is known by its products."""

    @property
    def shape(self) -> tuple[int, int]: ...  # noqa: D102

    def matvec(self, v: FloatArray) -> FloatArray: ...  # noqa: D102

    def rmatvec(self, v: FloatArray) -> FloatArray: ...  # noqa: D102

    @property
    def transposed(self) -> "JacobianOperator": ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Costs:
    """Estimated cost of a linear system, in seconds of one core.

    Parameters
    ----------
    product
        One product with the matrix and the preconditioner, with the work of the Krylov method for it.
    factors
        A new preconditioner.
    array
        The assembled matrix and its factors, or its Schur complement if some unknowns are eliminated.
    """

    product: float
    factors: float
    array: float

    @property
    def products_pay(self) -> bool:
        """Whether a Newton iteration costs less by products than by arrays if few contacts slip."""
        return self.factors + BY_PRODUCTS * PRODUCTS * self.product < BY_ARRAY * self.array


Jacobian = FloatArray | JacobianOperator
Corner = float | FloatArray


class Inverse(Protocol):
    """The solution of systems with one matrix."""

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray | None:
        """Return the solution for the right side (n,), of the transposed system if requested; None if there is none."""
        ...


class Elimination(Protocol):
    """Schur complement S of a square matrix J, after cheap unknowns R are eliminated.

    With the remaining unknowns A it is ``S = J_AA - J_AR J_RR⁻¹ J_RA``. ``J x = b`` is solved by
    ``S x_A = b_A - J_AR J_RR⁻¹ b_R``. For a transposed system the same unknowns are eliminated.
    """

    @property
    def size(self) -> int:
        """Number of remaining unknowns A."""
        ...

    @property
    def sign(self) -> float:
        """Sign of the determinant of J_RR."""
        ...

    def array(self) -> FloatArray:
        """Return S, (size, size), as a new array in Fortran order."""
        ...

    def reduced(self, right: FloatArray, *, transposed: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the right sides of S (size, j) from `right` (n, j), and ``J_RR⁻¹ b_R`` (n, j), zero in A."""
        ...

    def spread(self, x: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return the (n, j) vectors with ``x_A`` in A and ``-J_RR⁻¹ J_RA x_A`` in R, from x_A (size, j)."""
        ...


@dataclass(frozen=True, eq=False)
class Bordered:
    """The matrix ``[[jac, column], [row, corner]]`` as an operator, with one border or several.

    Parameters
    ----------
    jac
        (n, n) inner matrix, which may be bordered itself.
    column, row, corner
        (n,), (n,) and a number, or (n, m), (m, n) and (m, m).
    """

    jac: Jacobian
    column: FloatArray
    row: FloatArray
    corner: Corner

    @property
    def borders(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(n, m) columns, (m, n) rows and (m, m) corner."""
        n = self.jac.shape[0]
        columns = self.column.reshape(n, -1)
        m = columns.shape[1]
        return columns, self.row.reshape(m, n), np.reshape(self.corner, (m, m))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        n = self.jac.shape[0] + self.borders[2].shape[0]
        return n, n

    @property
    def transposed(self) -> "Bordered":
        """Transpose of the bordered matrix."""
        columns, rows, corner = self.borders
        return Bordered(transpose_of(self.jac), rows.T, columns.T, corner.T)

    @property
    def flat(self) -> "Bordered":
        """The same matrix, nested borders merged into one around the innermost Jacobian."""
        if not isinstance(self.jac, Bordered):
            return self
        inner = self.jac.flat
        n = inner.jac.shape[0]
        (near, below, own), (columns, rows, corner) = inner.borders, self.borders
        return Bordered(
            inner.jac,
            np.hstack([near, columns[:n]]),
            np.vstack([below, rows[:, :n]]),
            np.block([[own, columns[n:]], [rows[:, n:], corner]]),
        )

    def matvec(self, v: FloatArray) -> FloatArray:
        """Return the product of the matrix with `v` (n + m,)."""
        columns, rows, corner = self.borders
        x, z = np.split(v, [columns.shape[0]])
        return np.append(times(self.jac, x) + columns @ z, rows @ x + corner @ z)

    def rmatvec(self, v: FloatArray) -> FloatArray:
        """Return the product of the transposed matrix with `v` (n + m,)."""
        columns, rows, corner = self.borders
        x, z = np.split(v, [columns.shape[0]])
        return np.append(transposed_times(self.jac, x) + z @ rows, x @ columns + z @ corner)

    def array(self) -> FloatArray | None:
        """Return the matrix as a new array in Fortran order; None if the inner matrix is known by its products only."""
        flat = self.flat
        if not isinstance(flat.jac, np.ndarray):
            return None
        columns, rows, corner = flat.borders
        n, size = columns.shape[0], flat.shape[0]
        matrix = np.empty((size, size), order="F")
        matrix[:n, :n], matrix[:n, n:] = flat.jac, columns
        matrix[n:, :n], matrix[n:, n:] = rows, corner
        return matrix


def times(jac: Jacobian, v: FloatArray) -> FloatArray:
    """Return ``jac @ v``."""
    return jac @ v if isinstance(jac, np.ndarray) else jac.matvec(v)


def transposed_times(jac: Jacobian, v: FloatArray) -> FloatArray:
    """Return ``jac.T @ v``."""
    return v @ jac if isinstance(jac, np.ndarray) else jac.rmatvec(v)


def transpose_of(jac: Jacobian) -> Jacobian:
    """Return ``jac.T``."""
    return jac.T if isinstance(jac, np.ndarray) else jac.transposed


def array_of(jac: Jacobian) -> FloatArray | None:
    """Return a Jacobian as an array, borders included; None if it is known by its products only."""
    if isinstance(jac, Bordered):
        return jac.array()
    return jac if isinstance(jac, np.ndarray) else None
