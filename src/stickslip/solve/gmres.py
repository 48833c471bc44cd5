"""GMRES (Saad & Schultz 1986), without restart.

SciPy's orthogonalises a new vector against one other at a time, in Python: for systems whose product takes a tenth of a millisecond that is
more than half of the time.
"""

from collections.abc import Callable

import numba
import numpy as np

from stickslip.arrays import FloatArray


def gmres(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, tolerance: float, most: int
) -> tuple[FloatArray, float]:
    """Solve a linear system known by its products.

    Parameters
    ----------
    product
        The product of the matrix with a vector (n,).
    right
        (n,) right side, not zero.
    tolerance
        Residual left, relative to the right side.
    most
        Products at most.

    Returns
    -------
    solution
        (n,)
    residual
        The relative residual that is left.
    """
    size = float(np.linalg.norm(right))
    most = min(most, right.size)
    basis = np.empty((most + 1, right.size))
    basis[0] = right / size
    triangle = np.zeros((most, most))
    turns = np.zeros((most, 2))
    rest = np.zeros(most + 1)
    rest[0] = 1.0
    count = 0
    while count < most and abs(rest[count]) > tolerance:
        before = basis[: count + 1]
        new = product(basis[count])
        column = np.zeros(count + 2)
        for _ in range(2):  # once more: the first time leaves its rounding
            share = before @ new
            new = new - share @ before
            column[:-1] += share
        column[-1] = length = float(np.linalg.norm(new))
        _rotate(column, turns, rest, count)
        triangle[: count + 1, count] = column[:-1]
        count += 1
        if length <= np.finfo(float).eps * float(np.linalg.norm(column)) or not np.isfinite(length):
            break
        basis[count] = new / length
    shares = _back(triangle[:count, :count], rest[:count])
    return size * (shares @ basis[:count]), abs(float(rest[count]))


@numba.njit(cache=True, nogil=True)
def _rotate(column, turns, rest, count):  # type: ignore[no-untyped-def]
    """Turn a new column of the Hessenberg matrix, its last entry to zero, and the right side with it."""
    for k in range(count):
        c, s = turns[k]
        column[k], column[k + 1] = (
            c * column[k] + s * column[k + 1],
            c * column[k + 1] - s * column[k],
        )
    size = np.hypot(column[count], column[count + 1])
    c, s = (column[count] / size, column[count + 1] / size) if size > 0.0 else (1.0, 0.0)
    turns[count] = c, s
    column[count], column[count + 1] = size, 0.0
    rest[count + 1] = -s * rest[count]
    rest[count] = c * rest[count]


@numba.njit(cache=True, nogil=True)
def _back(triangle, rest):  # type: ignore[no-untyped-def]
    """Solve with an upper triangle."""
    out = rest.copy()
    for k in range(out.size - 1, -1, -1):
        out[k] = out[k] / triangle[k, k] if triangle[k, k] != 0.0 else 0.0
        for j in range(k):
            out[j] -= triangle[j, k] * out[k]
    return out
