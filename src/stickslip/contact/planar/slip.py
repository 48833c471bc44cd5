"""One piece of slip: angle θ of the friction force by collocation of ``L θ' = X'·e⊥``, and the end of slip.

Multiplication by L keeps the equation regular where the contact closes or opens. The equation is stiff for small L,
where θ follows the direction of the motion. Radau IIA is stiffly accurate, and its stages are also the nodes of a
quadrature.
"""

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.planar.motion import AT_LIMIT_RATE, AT_X_RATE, AT_Y_RATE, SHARE, SIN, TINY
from stickslip.contact.planar.radau import BARYCENTRIC, BEND, FINE, INNER, NODES, PART, RATE, STAGES, TIMES, TO_FINE

_LAST_STEP = 1e-5  # last step of Newton's method: the remaining error is its square
_MOST_STEPS = 12


class Piece(NamedTuple):
    """Work space of one piece."""

    at: FloatArray  # (7, stages) what `fill_stages` finds
    angle: FloatArray  # (stages + 1,) θ at its start and stages
    guess: FloatArray  # (2,) θ' and θ'' at the end of the previous piece
    matrix: FloatArray  # (stages, stages) derivative of the equations, factorised
    pivots: IntArray
    right: FloatArray  # (stages,)
    speed: FloatArray  # (stages + 1,) X'·e - L', positive during slip


@njit(**INNER)
def piece_room():  # type: ignore[no-untyped-def]
    """Allocate a `Piece`."""
    return Piece(
        np.empty((SIN + 1, STAGES)),
        np.empty(STAGES + 1),
        np.zeros(2),
        np.empty((STAGES, STAGES)),
        np.empty(STAGES, np.int64),
        np.empty(STAGES),
        np.empty(STAGES + 1),
    )


@njit(**INNER)
def factorise(a, pivots):  # type: ignore[no-untyped-def]
    """Factorise `a` in place with row exchanges; return whether it is regular."""
    for k in range(STAGES):
        row, largest = k, abs(a[k, k])
        for i in range(k + 1, STAGES):
            if abs(a[i, k]) > largest:
                row, largest = i, abs(a[i, k])
        pivots[k] = row
        if not largest > 0.0:
            return False
        if row != k:
            for j in range(STAGES):
                a[k, j], a[row, j] = a[row, j], a[k, j]
        inverse = 1.0 / a[k, k]
        for i in range(k + 1, STAGES):
            a[i, k] *= inverse
            factor = a[i, k]
            for j in range(k + 1, STAGES):
                a[i, j] -= factor * a[k, j]
    return True


@njit(**INNER)
def solve_vector(a, pivots, b):  # type: ignore[no-untyped-def]
    """Solve with the factors `a` in place."""
    for k in range(STAGES):
        row = pivots[k]
        if row != k:
            b[k], b[row] = b[row], b[k]
    for k in range(STAGES):
        for i in range(k):
            b[k] -= a[k, i] * b[i]
    for k in range(STAGES - 1, -1, -1):
        for i in range(k + 1, STAGES):
            b[k] -= a[k, i] * b[i]
        b[k] /= a[k, k]


@njit(**PART)
def _forward(a, pivots, b):  # type: ignore[no-untyped-def]
    """Exchange the rows of `b` and solve with the lower factor."""
    for k in range(STAGES):
        row = pivots[k]
        if row != k:
            for q in range(b.shape[1]):
                b[k, q], b[row, q] = b[row, q], b[k, q]
    for k in range(STAGES):
        for i in range(k):
            factor = a[k, i]
            for q in range(b.shape[1]):
                b[k, q] -= factor * b[i, q]


@njit(**INNER)
def solve_rows(a, pivots, b):  # type: ignore[no-untyped-def]
    """Solve for the rows of `b` in place."""
    _forward(a, pivots, b)
    for k in range(STAGES - 1, -1, -1):
        for i in range(k + 1, STAGES):
            factor = a[k, i]
            for q in range(b.shape[1]):
                b[k, q] -= factor * b[i, q]
        inverse = 1.0 / a[k, k]
        for q in range(b.shape[1]):
            b[k, q] *= inverse


@njit(**INNER)
def linearise(at, angle, matrix, right):  # type: ignore[no-untyped-def]
    """Fill the derivative of the collocation equations by θ at the stages, and minus their values."""
    for j in range(STAGES):
        cos, sin = np.cos(angle[j + 1]), np.sin(angle[j + 1])
        rate = 0.0
        for i in range(STAGES + 1):
            rate += RATE[j, i] * angle[i]
        share = at[SHARE, j]
        along = at[AT_X_RATE, j] * cos + at[AT_Y_RATE, j] * sin
        across = at[AT_Y_RATE, j] * cos - at[AT_X_RATE, j] * sin
        for i in range(STAGES):
            matrix[j, i] = share * RATE[j, i + 1]
        matrix[j, j] += along
        right[j] = across - share * rate


@njit(**INNER)
def predict(width, kind, piece):  # type: ignore[no-untyped-def]
    """Predict the angles by the parabola of the previous piece."""
    slope, bend = piece.guess[0] * width, 0.5 * piece.guess[1] * width * width
    size = abs(slope) + abs(bend)
    share = 1.0 if size <= 1.0 else 1.0 / size
    for j in range(1, STAGES + 1):
        c = TIMES[kind, j]
        piece.angle[j] = piece.angle[0] + share * c * (slope + c * bend)


@njit(**INNER)
def collocate(piece):  # type: ignore[no-untyped-def]
    """Solve for θ at the stages of a piece with known motion, from the present values.

    Return whether Newton's method converged.
    """
    for _ in range(_MOST_STEPS):
        linearise(piece.at, piece.angle, piece.matrix, piece.right)
        if not factorise(piece.matrix, piece.pivots):
            return False
        solve_vector(piece.matrix, piece.pivots, piece.right)
        largest = np.max(np.abs(piece.right))
        if not largest < 4.0:
            return False
        for j in range(STAGES):
            piece.angle[j + 1] += piece.right[j]
        if largest <= _LAST_STEP:
            return True
    return False


@njit(**INNER)
def remember_end(width, piece):  # type: ignore[no-untyped-def]
    """Store the start values of the next piece."""
    slope = bend = 0.0
    for i in range(STAGES + 1):
        slope += RATE[STAGES - 1, i] * piece.angle[i]
        bend += BEND[i] * piece.angle[i]
    piece.guess[0], piece.guess[1] = slope / width, bend / (width * width)


@njit(**INNER)
def decay(piece):  # type: ignore[no-untyped-def]
    """Return the derivative of θ at the end of a piece by θ at its start."""
    for j in range(STAGES):
        piece.right[j] = -piece.at[SHARE, j] * RATE[j, 0]
    solve_vector(piece.matrix, piece.pivots, piece.right)
    return piece.right[STAGES - 1]


@njit(**INNER)
def interpolated(values, c):  # type: ignore[no-untyped-def]
    """Return the polynomial through `values` at the nodes, at `c` in [0, 1]."""
    above = below = 0.0
    for i in range(STAGES + 1):
        distance = c - NODES[i]
        if distance == 0.0:
            return values[i]
        share = BARYCENTRIC[i] / distance
        above += share * values[i]
        below += share
    return above / below


@njit(**INNER)
def slip_speed(piece):  # type: ignore[no-untyped-def]
    """Fill the speed of slip at the stages."""
    at = piece.at
    for j in range(STAGES):
        angle = piece.angle[j + 1]
        piece.speed[j + 1] = at[AT_X_RATE, j] * np.cos(angle) + at[AT_Y_RATE, j] * np.sin(angle) - at[AT_LIMIT_RATE, j]


@njit(**INNER)
def slip_ends(speed):  # type: ignore[no-untyped-def]
    """Return the share of the piece at which slip ends, or 2 if it continues.

    The polynomial through the speed at the nodes is also checked at points between them.
    """
    left, f_left = 0.0, max(speed[0], TINY)
    for i in range(FINE):
        f = 0.0
        for j in range(STAGES + 1):
            f += TO_FINE[i, j] * speed[j]
        right = (i + 1.0) / FINE
        if f <= 0.0:
            return _zero(speed, left, f_left, right, f)
        left, f_left = right, f
    return 2.0


@njit(**INNER)
def _zero(values, left, f_left, right, f_right):  # type: ignore[no-untyped-def]
    """Return the zero at which the polynomial through `values` becomes negative, by the Illinois method."""
    side = 0
    for _ in range(60):
        c = (left * f_right - right * f_left) / (f_right - f_left)
        f = interpolated(values, c)
        if abs(right - left) <= 1e-13 or f == 0.0:
            return c
        if f > 0.0:
            if side == 1:
                f_right *= 0.5
            left, f_left, side = c, f, 1
        else:
            if side == -1:
                f_left *= 0.5
            right, f_right, side = c, f, -1
    return right
