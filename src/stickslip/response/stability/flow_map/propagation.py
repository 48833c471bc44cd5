"""Propagation of disturbances between transitions: matrix exponential to rounding accuracy.

Reduced structures are stiff: their fastest modes vibrate a thousand times in a period. In short intervals, the Taylor
series of the exponential acts on the disturbances. Longer intervals are halved until a rational approximation is exact
to rounding, which is then squared (Higham 2005). Additional columns contain the constant force of sticking sliders.
"""

import numpy as np
from scipy.linalg.lapack import dgesv

from stickslip.arrays import FloatArray

SHORT = 1.0  # |A| times the length, up to which the series costs less than a rational function
ACCURACY = 1e-14  # last term of the series, relative to the result
TOO_FAST = "the linear motion between contacts' changes is too fast for a number"
RATIONAL = 5.37  # |A| times the length, up to which the rational function is exact to rounding
NUMERATOR = (
    64764752532480000.0,
    32382376266240000.0,
    7771770303897600.0,
    1187353796428800.0,
    129060195264000.0,
    10559470521600.0,
    670442572800.0,
    33522128640.0,
    1323241920.0,
    40840800.0,
    960960.0,
    16380.0,
    182.0,
    1.0,
)  # of the diagonal Padé approximant of order 13, by the power of its argument


def propagate(a: FloatArray, states: FloatArray, pull: FloatArray, sliders: FloatArray, length: float) -> FloatArray:
    """Return the columns of `states` after `length` under ``dy/dτ = A y + (0, pull @ sliders)``.

    Parameters
    ----------
    a
        (2n, 2n), its upper half (0, diagonal).
    states
        (2n, k).
    pull, sliders
        (n, m) operator of the sliders and (m, k) their positions, constant over the interval.
    length
        Length of the interval, rad.
    """
    if length * _size(a) <= SHORT:
        force = np.zeros_like(states)
        force[len(pull) :] = pull @ sliders
        return states + _series(a, _times(a, states) + force, length)
    exponential, driven = transition(a, pull, length)
    return np.asarray(exponential @ states + driven @ sliders)


def transition(a: FloatArray, pull: FloatArray, length: float) -> tuple[FloatArray, FloatArray]:
    """Return the (2n, 2n) transition matrix of an interval, and the (2n, m) effect of the sliders.

    Raises
    ------
    FloatingPointError
        If the motion oscillates or grows too fast for double precision.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        a2 = _times(a, a)
        a4 = a2 @ a2
        powers = a2, a4, a4 @ a2
        # roots of powers come closer to the spectral radius than norms do (Al-Mohy & Higham 2009)
        size = length * max(float(np.linalg.norm(m, 1)) ** (1.0 / k) for m, k in zip(powers[1:], (4, 6), strict=True))
        if not size < 1.0 / np.finfo(float).eps:  # no digit of the phase is significant
            raise FloatingPointError(TOO_FAST)
        halvings = max(0, int(np.ceil(np.log2(max(size, RATIONAL) / RATIONAL))))
        part = length / 2**halvings
        columns = np.zeros((len(a), pull.shape[1]))
        columns[len(pull) :] = part * pull
        exponential, driven = _rational(a, powers, part, columns)
        for _ in range(halvings):
            driven += exponential @ driven
            exponential = exponential @ exponential
    if not (np.all(np.isfinite(exponential)) and np.all(np.isfinite(driven))):
        raise FloatingPointError(TOO_FAST)
    return exponential, driven


def _times(a: FloatArray, columns: FloatArray) -> FloatArray:
    """Return ``A @ columns``; the upper half of A is ``(0, diagonal)``."""
    n = len(a) // 2
    out = np.empty_like(columns)
    np.multiply(np.diagonal(a, n)[:n, None], columns[n:], out=out[:n])
    np.matmul(a[n:], columns, out=out[n:])
    return out


def _size(a: FloatArray) -> float:
    """Return a bound on the norm of a matrix."""
    return float(np.sqrt(np.linalg.norm(a, 1) * np.linalg.norm(a, np.inf)))


def _series(a: FloatArray, rate: FloatArray, length: float) -> FloatArray:
    """Return the increase over an interval from the rates at its beginning, by the Taylor series."""
    term = length * rate
    total = term.copy()
    enough = ACCURACY * np.max(np.abs(total), initial=0.0)
    order = 1
    while np.max(np.abs(term), initial=0.0) > enough:
        order += 1
        term = (length / order) * _times(a, term)
        total += term
    return total


def _rational(
    a: FloatArray, powers: tuple[FloatArray, ...], part: float, columns: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the Padé approximants of order 13 of an exponential.

    They are ``exp(part A)``, and ``(exp(part A) - 1) / (part A)`` times the columns.

    The `powers` are A², A⁴ and A⁶.
    """
    b, n = NUMERATOR, len(a)
    a2, a4, a6 = (part**k * m for k, m in zip((2, 4, 6), powers, strict=True))
    half = a6 @ (b[13] * a6 + b[11] * a4 + b[9] * a2)
    half += b[7] * a6 + b[5] * a4 + b[3] * a2
    half.flat[:: n + 1] += b[1]
    odd = part * _times(a, half)
    even = a6 @ (b[12] * a6 + b[10] * a4 + b[8] * a2)
    even += b[6] * a6 + b[4] * a4 + b[2] * a2
    even.flat[:: n + 1] += b[0]
    right = np.hstack([even + odd, 2.0 * (half @ columns)])
    solved = dgesv(even - odd, right)[2]
    return np.ascontiguousarray(solved[:, :n]), np.ascontiguousarray(solved[:, n:])
