"""Zeros of an analytic determinant: found by contour integrals, refined by Newton's method, and counted.

W.-J. Beyn, "An integral method for solving nonlinear eigenvalue problems", Linear Algebra and its Applications 436 (2012) 3839-3863.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray

POINTS = 64  # of a contour
RANK = 1e-10  # singular value of the first moment, over the largest, that is none
ROUNDS = 6  # of Newton's method
LAST_CHANGE = 1e-9  # change of a zero that ends it
NUDGE = 1e-9  # beside a zero, where the matrix can be solved
OUTSIDE = 1.5  # squared size of the ellipse beyond which the integral shows nothing
MAX_CHANGE = 0.05  # a zero that Newton's method moves farther was none
LARGEST_TURN = 2.0  # rad between two values of a determinant, beyond which its turns are not counted

Matrix = Callable[[ComplexArray], ComplexArray]  # (k,) exponents -> (k, s, s)


@dataclass(frozen=True, eq=False)
class Zeros:
    """Zeros of the determinant of a matrix function, with their vectors.

    Attributes
    ----------
    values
        (z,) exponents.
    right, left
        (z, s) vectors with ``S v = 0`` and ``wᴴ S = 0``, the rows of S being divided by `scale`.
    slopes
        (z,) ``wᴴ S' v``.
    scale
        (s, 1) of the rows.
    """

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    slopes: ComplexArray
    scale: FloatArray


def zeros_near(matrix: Matrix, slope: Matrix, centre: complex, wide: float, high: float) -> Zeros:
    """Return the zeros within an ellipse, and zeros beside it that the integral contains.

    Parameters
    ----------
    matrix, slope
        Matrix (k, s, s) at exponents (k,), and its derivative.
    centre, wide, high
        Centre of the ellipse, and its half axes along the real and the imaginary axis.
    """
    angle = 2.0 * np.pi * (np.arange(POINTS) + 0.5) / POINTS
    around = wide * np.cos(angle) + 1j * high * np.sin(angle)
    step = (-wide * np.sin(angle) + 1j * high * np.cos(angle)) / (1j * POINTS)
    values = matrix(centre + around)
    s = values.shape[1]
    none = np.zeros((0, s), dtype=complex)
    if not s:
        nothing = np.zeros(0, dtype=complex)
        return Zeros(nothing, none, none, nothing, np.ones((s, 1)))
    scale = np.max(np.abs(values), axis=(0, 2))[:, None]  # rows are of very different size
    inverse = np.linalg.inv(values / scale)
    first = np.tensordot(step, inverse, axes=1)
    second = np.tensordot(step * around, inverse, axes=1)
    u, singular, vh = np.linalg.svd(first)
    rank = int(np.count_nonzero(singular > RANK * singular[0]))
    u, vh = u[:, :rank], vh[:rank]
    small = (u.conj().T @ second @ vh.conj().T) / singular[:rank]
    starts, vectors = np.linalg.eig(small)
    beside = (starts.real / wide) ** 2 + (starts.imag / high) ** 2 < OUTSIDE
    starts, vectors = centre + starts[beside], (u @ vectors)[:, beside].T
    if not starts.size:
        return Zeros(starts, none, none, starts, scale)
    return _polished(lambda x: matrix(x) / scale, lambda x: slope(x) / scale, starts, vectors, scale)


def _polished(matrix: Matrix, slope: Matrix, starts: ComplexArray, vectors: ComplexArray, scale: FloatArray) -> Zeros:
    """Return the zeros next to the starts by inverse iteration; starts without convergence are left out."""
    now, right = starts.astype(complex), vectors.copy()
    change = np.full_like(now, np.inf)
    for _ in range(ROUNDS):
        moving = np.flatnonzero(np.abs(change) >= LAST_CHANGE)
        if not moving.size:
            break
        # no zero itself, where nothing could be solved
        near: ComplexArray = np.asarray(now[moving] + NUDGE)
        moved = _times(slope(near), right[moving])
        following = np.linalg.solve(matrix(near), moved[:, :, None])[:, :, 0]
        share = np.einsum("ki,ki->k", right[moving].conj(), following)
        step = NUDGE - 1.0 / np.where(share != 0.0, share, 1.0)
        step *= np.minimum(1.0, MAX_CHANGE / np.maximum(np.abs(step), MAX_CHANGE))
        now[moving], change[moving] = now[moving] + step, step
        right[moving] = following / np.linalg.norm(following, axis=1, keepdims=True)
    kept = (np.abs(change) < LAST_CHANGE) & (np.abs(now - starts) < MAX_CHANGE)
    now, right = now[kept], right[kept]
    slopes = slope(now)
    adjoint, other = matrix(now + NUDGE).conj().transpose(0, 2, 1), right
    for _ in range(2):
        moved = _times(slopes.conj().transpose(0, 2, 1), other)
        other = np.linalg.solve(adjoint, moved[:, :, None])[:, :, 0]
        other = other / np.linalg.norm(other, axis=1, keepdims=True)
    along = np.einsum("ki,ki->k", other.conj(), _times(slopes, right))
    return Zeros(now, right, other, along, scale)


def _times(matrices: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    return np.asarray((matrices @ vectors[:, :, None])[:, :, 0])


def turning(matrix: Matrix, zeros: ComplexArray, path: ComplexArray) -> float:
    """Return the change of the argument of the determinant along a path, rad; NaN where the path is too coarse.

    Known zeros near the path are divided out, and their contribution is added exactly.
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
