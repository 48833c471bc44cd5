"""LU factors that are solved with many times, one right side at a time.

LAPACK's triangular solves work through single columns. Here the diagonal blocks of both triangles are inverted once, so that a solve
consists of products of blocks with vectors and is as fast as memory delivers the factors.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray

SINGULAR = 5.0  # roundings; smallest pivot over largest below which a matrix has no usable factors
BLOCK = 64  # rows; blocks half or twice as large cost up to a tenth more


@dataclass(frozen=True, eq=False)
class Factors:
    """LU factors with partial pivoting; build them with `factorise`.

    Attributes
    ----------
    lu
        (n, n) both triangles as LAPACK leaves them.
    order
        (n,) rows of the matrix in the order of the pivots.
    lower, upper
        Inverses of the diagonal blocks of both triangles.
    """

    lu: FloatArray | ComplexArray
    order: IntArray
    lower: tuple[FloatArray | ComplexArray, ...]
    upper: tuple[FloatArray | ComplexArray, ...]

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


def factorise(matrix: FloatArray | ComplexArray) -> Factors | None:
    """Factorise a (n, n) matrix in Fortran order, which is overwritten; None if it is singular to its precision."""
    getrf, invert = scipy.linalg.get_lapack_funcs(("getrf", "trtri"), (matrix,))
    lu, pivots, info = getrf(matrix, overwrite_a=True)
    size = np.abs(np.diagonal(lu))
    if info != 0 or not size.min() > SINGULAR * np.finfo(lu.dtype).eps * size.max():
        return None
    lower, upper = [], []
    for first in range(0, size.size, BLOCK):
        block = lu[first : first + BLOCK, first : first + BLOCK]
        # LAPACK takes the diagonal of the lower triangle for ones and leaves the other triangle in place
        below = np.tril(invert(block, lower=1, unitdiag=1)[0], -1)
        lower.append(below + np.eye(len(below), dtype=below.dtype))
        upper.append(np.triu(invert(block)[0]))
    return Factors(lu, _row_order(pivots), tuple(lower), tuple(upper))


def _row_order(pivots: IntArray) -> IntArray:
    """Turn LAPACK's successive swaps of rows into one order of them."""
    order = np.arange(pivots.size)
    for row, other in enumerate(pivots):
        order[row], order[other] = order[other], order[row]
    return order
