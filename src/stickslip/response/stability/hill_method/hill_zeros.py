"""Zeros of an analytic determinant: found by contour integrals, refined by Newton's method, and counted.

W.-J. Beyn, "An integral method for solving nonlinear eigenvalue problems", Linear Algebra and its Applications 436
(2012) 3839-3863.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray

POINTS = 64  # of a contour
RANK = 1e-10  # relative singular value of the first moment that counts as zero
ROUNDS = 6  # of Newton's method
LAST_CHANGE = 1e-9  # change of a zero that ends Newton's method
NUDGE = 1e-9  # offset from a zero, so that the matrix is regular
OUTSIDE = 1.5  # squared size relative to the ellipse, above which zeros are discarded
MAX_CHANGE = 0.05  # largest total change of a zero by Newton's method; others are spurious
LARGEST_TURN = 2.0  # largest change of the determinant's argument between two points, rad

Matrix = Callable[[ComplexArray], ComplexArray]  # (k,) exponents -> (k, s, s)


@dataclass(frozen=True, eq=False)
class Zeros:
    """Zeros of the determinant of a matrix function S, with their vectors.

    Attributes
    ----------
    values
        (z,) exponents.
    right, left
        (z, s) vectors with ``S v = 0`` and ``wᴴ S = 0``, where the rows of S are divided by `scale`.
    slopes
        (z,) ``wᴴ S' v``.
    scale
        (s, 1) scale of the rows.
    """

    values: ComplexArray
    right: ComplexArray
    left: ComplexArray
    slopes: ComplexArray
    scale: FloatArray


def zeros_near(matrix: Matrix, slope: Matrix, centre: complex, wide: float, high: float) -> Zeros:
    """Return the zeros within an ellipse, and zeros near it that the integral resolves.

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
    scale = np.max(np.abs(values), axis=(0, 2))[:, None]  # rows differ widely in size
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
        # beside the zero, where the matrix is regular
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
    """Return the change of the determinant's argument along a path, rad; NaN if the path is too coarse.

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
