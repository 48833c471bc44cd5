"""Zeros of the determinant of a small analytic matrix, found by a contour integral, polished by Newton's method, and counted.

W.-J. Beyn, "An integral method for solving nonlinear eigenvalue problems", Linear Algebra and its Applications 436 (2012) 3839-3863.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray

POINTS = 64  # of a contour
RANK = 1e-10  # singular value of the first moment, over the largest, that is none
ROUNDS = 6  # of Newton's method
CLOSE = 1e-10  # change of a zero that ends it
FAR = 0.05  # a zero that Newton's method moves farther was none
LARGEST_TURN = 2.0  # rad between two values of a determinant, beyond which its turns are not counted

Matrix = Callable[[ComplexArray], ComplexArray]  # (k,) exponents -> (k, s, s)


@dataclass(frozen=True, eq=False)
class Zeros:
    """Where a matrix is singular.

    Attributes
    ----------
    values
        (z,) exponents.
    right, left
        (z, s) vectors with ``S v = 0`` and ``wᴴ S = 0``.
    slopes
        (z,) ``wᴴ S' v``.
    """

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    slopes: ComplexArray


def zeros_near(matrix: Matrix, slope: Matrix, centre: complex, wide: float, high: float) -> Zeros:
    """Return the zeros within an ellipse, and those beside it that the integral shows, too.

    Parameters
    ----------
    matrix, slope
        Of exponents (k,): (k, s, s) and its derivative.
    centre, wide, high
        Of the ellipse, and its half axes along the real and the imaginary axis.
    """
    angle = 2.0 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
    around = wide * np.cos(angle) + 1j * high * np.sin(angle)
    step = (-wide * np.sin(angle) + 1j * high * np.cos(angle)) / (1j * POINTS)
    values = matrix(centre + around)
    s = values.shape[1]
    none = np.zeros((0, s), dtype=complex)
    if not s:
        return Zeros(np.zeros(0, dtype=complex), none, none, np.zeros(0, dtype=complex))
    scale = np.max(np.abs(values), axis=(0, 2))  # rows are of very different size
    inverse = np.linalg.inv(values / scale[:, None])
    first = np.tensordot(step, inverse, axes=1)
    second = np.tensordot(step * around, inverse, axes=1)
    u, singular, vh = np.linalg.svd(first)
    rank = int(np.count_nonzero(singular > RANK * singular[0]))
    u, vh = u[:, :rank], vh[:rank]
    small = (u.conj().T @ second @ vh.conj().T) / singular[:rank]
    return polished(matrix, slope, centre + np.linalg.eigvals(small))


def polished(matrix: Matrix, slope: Matrix, starts: ComplexArray) -> Zeros:
    """Return the zeros next to starts, those that Newton's method does not find being left out."""
    now, kept = starts.astype(complex), np.ones(starts.size, dtype=bool)
    if not now.size:
        s = matrix(np.zeros(1, dtype=complex)).shape[1]
        none = np.zeros((0, s), dtype=complex)
        return Zeros(now, none, none, now)
    for _ in range(ROUNDS):
        right, left = _null_vectors(matrix(now))
        slopes = np.einsum("ki,kij,kj->k", left.conj(), slope(now), right)
        rests = np.einsum("ki,kij,kj->k", left.conj(), matrix(now), right)
        change = np.where(slopes != 0.0, -rests / np.where(slopes != 0.0, slopes, 1.0), 0.0)
        change *= np.minimum(1.0, FAR / np.maximum(np.abs(change), FAR))
        now = now + change
    kept &= (np.abs(change) < CLOSE) & (np.abs(now - starts) < FAR)
    right, left = _null_vectors(matrix(now))
    slopes = np.einsum("ki,kij,kj->k", left.conj(), slope(now), right)
    return Zeros(now[kept], right[kept], left[kept], slopes[kept])


def _null_vectors(matrices: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the right and left singular vectors (k, s) of the smallest singular value of matrices with scaled rows."""
    rows = np.max(np.abs(matrices), axis=2, keepdims=True)
    rows = np.where(rows > 0.0, rows, 1.0)
    u, _, vh = np.linalg.svd(matrices / rows)
    return vh[:, -1].conj(), u[:, :, -1] / rows[:, :, 0]


def turning(matrix: Matrix, zeros: ComplexArray, path: ComplexArray) -> float:
    """Return by how much the determinant turns along a path, rad; NaN where it turns too fast to tell.

    The zeros near the path that are known are taken out before, and what they turn is added exactly.
    """
    values = matrix(path)
    if not values.shape[1]:
        return 0.0
    sign, _ = np.linalg.slogdet(values)
    apart = path[:, None] - zeros
    smooth = sign * np.exp(-1j * np.angle(apart).sum(axis=1))
    steps = np.angle(smooth[1:] / smooth[:-1])
    if not np.all(np.abs(steps) < LARGEST_TURN):
        return float("nan")
    return float(steps.sum() + np.angle(apart[-1:] / apart[:1]).sum())
