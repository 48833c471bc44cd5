"""LU factors for many solutions with one right side at a time.

LAPACK's triangular solves work through single columns. Here the diagonal blocks of both triangles are inverted once, so
that a solution consists of products of blocks with vectors, limited only by memory bandwidth. Sparse matrices have
SuperLU's factors.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.interface import SparseRows
from stickslip.contact.product import add_stiffness
from stickslip.errors import input_error

SINGULAR = 5.0  # times rounding: ratio of smallest to largest pivot below which factors are unusable
BLOCK = 64  # rows; blocks half or twice as large cost up to a tenth more
PIVOTS = 0.01  # a sparse factorisation leaves the diagonal only for a pivot a hundred times as large
LARGEST_ARRAY = 4000  # rows, largest sparse matrix that is converted to an array


@dataclass(frozen=True, eq=False)
class Factors:
    """LU factors with partial pivoting; build them with `factorise`.

    Attributes
    ----------
    lu
        (n, n) both triangles in the layout of LAPACK.
    order
        (n,) rows of the matrix in the order of the pivots.
    lower, upper
        Inverses of the diagonal blocks of both triangles.
    """

    lu: FloatArray | ComplexArray
    order: IntArray
    lower: tuple[FloatArray | ComplexArray, ...]
    upper: tuple[FloatArray | ComplexArray, ...]

    @property
    def dtype(self) -> Any:
        """Precision and kind of the numbers."""
        return self.lu.dtype

    def solve(self, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
        """Solve with one right side (n,) or several (n, k)."""
        x = right[self.order]
        n = len(x)
        starts = range(0, n, BLOCK)
        for inverse, first in zip(self.lower, starts, strict=True):
            last = min(first + BLOCK, n)
            x[first:last] = inverse @ x[first:last]
            x[last:] -= self.lu[last:, first:last] @ x[first:last]
        for inverse, first in zip(self.upper[::-1], starts[::-1], strict=True):
            last = min(first + BLOCK, n)
            x[first:last] = inverse @ x[first:last]
            x[:first] -= self.lu[:first, first:last] @ x[first:last]
        return x

    def solve_transposed(self, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
        """Solve with the transposed matrix and one right side (n,) or several (n, k)."""
        x = right.copy()
        n = len(x)
        starts = range(0, n, BLOCK)
        for inverse, first in zip(self.upper, starts, strict=True):
            last = min(first + BLOCK, n)
            x[first:last] = inverse.T @ x[first:last]
            x[last:] -= self.lu[first:last, last:].T @ x[first:last]
        for inverse, first in zip(self.lower[::-1], starts[::-1], strict=True):
            last = min(first + BLOCK, n)
            x[first:last] = inverse.T @ x[first:last]
            x[:first] -= self.lu[first:last, :first].T @ x[first:last]
        out = np.empty_like(x)
        out[self.order] = x
        return out


@dataclass(frozen=True, eq=False)
class SparseFactors:
    """SuperLU's factors of a sparse matrix, in its precision; build them with `factorise`."""

    lu: Any
    dtype: Any

    def solve(self, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
        """Solve with one right side (n,) or several (n, k)."""
        return np.asarray(self.lu.solve(np.asarray(right, dtype=self.dtype)))

    def solve_transposed(self, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
        """Solve with the transposed matrix and one right side (n,) or several (n, k)."""
        return np.asarray(self.lu.solve(np.asarray(right, dtype=self.dtype), "T"))


AnyFactors = Factors | SparseFactors


def factorise(matrix: Matrix) -> AnyFactors | None:
    """Factorise a (n, n) matrix; None if it is singular to its precision.

    The matrix is sparse or an array; an array is overwritten, fastest in Fortran order.
    """
    return _sparse(matrix) if scipy.sparse.issparse(matrix) else _dense(matrix)


def _sparse(matrix: Matrix) -> SparseFactors | None:
    from scipy.sparse.linalg import splu

    try:
        lu = splu(
            scipy.sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=PIVOTS,
            options={"SymmetricMode": True},
        )
    except RuntimeError:  # a pivot vanishes
        return None
    return SparseFactors(lu, matrix.dtype)


def _dense(matrix: FloatArray | ComplexArray) -> Factors | None:
    getrf, invert = scipy.linalg.get_lapack_funcs(("getrf", "trtri"), (matrix,))
    lu, pivots, info = getrf(matrix, overwrite_a=True)
    size = np.abs(np.diagonal(lu))
    if info != 0 or not size.min() > SINGULAR * np.finfo(lu.dtype).eps * size.max():
        return None
    lower, upper = [], []
    for first in range(0, size.size, BLOCK):
        block = lu[first : first + BLOCK, first : first + BLOCK]
        # LAPACK ignores the diagonal of the lower triangle, which is one, and does not touch the other triangle
        below = np.tril(invert(block, lower=1, unitdiag=1)[0], -1)
        lower.append(below + np.eye(len(below), dtype=below.dtype))
        upper.append(np.triu(invert(block)[0]))
    return Factors(lu, _row_order(pivots), tuple(lower), tuple(upper))


def _row_order(pivots: IntArray) -> IntArray:
    """Convert LAPACK's successive row swaps into one order of the rows."""
    order = np.arange(pivots.size)
    for row, other in enumerate(pivots):
        order[row], order[other] = order[other], order[row]
    return order


def with_contacts(matrix: Matrix, stiffness: FloatArray | ComplexArray, rows: SparseRows) -> Matrix:
    """Return ``matrix + Bᵀ k B``: in place for an array, as a new matrix if it is sparse.

    Parameters
    ----------
    matrix
        (n, n).
    stiffness
        (n_contacts, 3, 3) k by contact, force and gap, N/m.
    rows
        B, the gap operator by contact.
    """
    if not scipy.sparse.issparse(matrix):
        add_stiffness(stiffness, rows.columns, rows.values, matrix)
        return matrix
    local = rows.values.transpose(0, 2, 1) @ stiffness @ rows.values
    place = np.broadcast_to(rows.columns[:, :, None], local.shape)
    where = place.reshape(-1), place.transpose(0, 2, 1).reshape(-1)
    added = scipy.sparse.coo_array((local.reshape(-1), where), shape=matrix.shape)
    return scipy.sparse.csc_array(matrix + added)


def real_part(matrix: Matrix) -> Matrix:
    """Return the real part of a matrix as a new one, an array in Fortran order."""
    return matrix.real.copy() if scipy.sparse.issparse(matrix) else np.array(matrix.real, order="F")


def solved(matrix: Matrix, right: FloatArray | ComplexArray) -> FloatArray | ComplexArray:
    """Solve a system, sparse or an array, for one right side; return the solution (n,).

    Raises
    ------
    LinAlgError
        If the matrix is singular.
    """
    if not scipy.sparse.issparse(matrix):
        return np.asarray(np.linalg.solve(matrix, right))
    factors = factorise(matrix)
    if factors is None:
        raise np.linalg.LinAlgError("Singular matrix")
    return factors.solve(right)


def as_array(matrix: Matrix) -> Matrix:
    """Return a sparse matrix as an array in Fortran order, and an array unchanged.

    Raises
    ------
    InputError
        If it is too large for an array.
    """
    if not scipy.sparse.issparse(matrix):
        return np.asarray(matrix)
    if matrix.shape[0] > LARGEST_ARRAY:
        raise input_error(
            "unreduced structure",
            f"this needs its matrices as arrays, and {matrix.shape[0]} dofs are too many",
            "Reduce it to its contacts (craig_bampton); forced response with always_low or always_high takes it as it is.",
        )
    return np.asarray(matrix.toarray(order="F"))
