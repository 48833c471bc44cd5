"""GMRES (Saad & Schultz 1986), without restart.

SciPy's orthogonalises a new vector against one other at a time, in Python: for systems whose product takes a tenth of a millisecond that is
more than half of the time.
"""

from collections.abc import Callable

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray


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
    turns = np.eye(most + 1)  # the product of all rotations that made the Hessenberg matrix a triangle
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
