"""Motion of a planar contact in units of force: ``X = k x`` and limit ``L = μ N``, with derivatives by τ."""

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.cache import njit
from stickslip.contact.planar.radau import INNER, PACE, STAGES, TIMES

TINY = 1e-300
X, Y, L, X_RATE, Y_RATE, L_RATE = range(6)  # rows of waves
# rows of the values at the stages of a piece; SHARE is L over the derivative of time
AT_X_RATE, AT_Y_RATE, AT_LIMIT, AT_LIMIT_RATE, SHARE, COS, SIN = range(7)


class Motion(NamedTuple):
    """Polynomials of one contact."""

    waves: FloatArray  # (6, m) X, Y and L, and their derivatives
    bounds: FloatArray  # (8,) of |X| without its mean, X', X'', X''', and of L, L', L'', L'''


@njit(**INNER)
def fill_motion(gaps, k, limit, motion):  # type: ignore[no-untyped-def]
    """Fill `motion` from the (3, m) coefficients of the gaps, the stiffness and the coefficients of the limit."""
    waves, bounds = motion.waves, motion.bounds
    for p in range(waves.shape[1]):
        waves[X, p], waves[Y, p], waves[L, p] = k * gaps[0, p], k * gaps[1, p], limit[p]
    waves[3:, 0] = 0.0
    bounds[:] = 0.0
    bounds[4] = abs(waves[L, 0])
    for h in range(1, (waves.shape[1] + 1) // 2):
        c, s = 2 * h - 1, 2 * h
        for i in range(3):
            waves[i + 3, c], waves[i + 3, s] = h * waves[i, s], -h * waves[i, c]
        path = np.sqrt(waves[X, c] ** 2 + waves[X, s] ** 2 + waves[Y, c] ** 2 + waves[Y, s] ** 2)
        friction = np.sqrt(waves[L, c] ** 2 + waves[L, s] ** 2)
        factor = 1.0
        for j in range(4):
            bounds[j] += factor * path
            bounds[4 + j] += factor * friction
            factor *= h


@njit(**INNER)
def _three(waves, first, tau):  # type: ignore[no-untyped-def]
    """Return the values of three rows from `first` on."""
    c1, s1 = np.cos(tau), np.sin(tau)
    c, s = 1.0, 0.0
    x, y, z = waves[first, 0], waves[first + 1, 0], waves[first + 2, 0]
    for h in range(1, (waves.shape[1] + 1) // 2):
        c, s = c * c1 - s * s1, s * c1 + c * s1
        x += waves[first, 2 * h - 1] * c + waves[first, 2 * h] * s
        y += waves[first + 1, 2 * h - 1] * c + waves[first + 1, 2 * h] * s
        z += waves[first + 2, 2 * h - 1] * c + waves[first + 2, 2 * h] * s
    return x, y, z


@njit(**INNER)
def place(motion, tau):  # type: ignore[no-untyped-def]
    """Return X, Y and L at `tau`."""
    return _three(motion.waves, X, tau)


@njit(**INNER)
def rates(motion, tau):  # type: ignore[no-untyped-def]
    """Return X', Y' and L' at `tau`."""
    return _three(motion.waves, X_RATE, tau)


@njit(**INNER)
def place_and_rates(motion, tau):  # type: ignore[no-untyped-def]
    """Return X, Y and L at `tau`, their derivatives, and second derivatives."""
    waves = motion.waves
    c1, s1 = np.cos(tau), np.sin(tau)
    c, s = 1.0, 0.0
    x, y, limit = waves[X, 0], waves[Y, 0], waves[L, 0]
    x_rate = y_rate = limit_rate = x_bend = y_bend = limit_bend = 0.0
    for h in range(1, (waves.shape[1] + 1) // 2):
        c, s = c * c1 - s * s1, s * c1 + c * s1
        a, b = waves[X, 2 * h - 1], waves[X, 2 * h]
        own, turned = a * c + b * s, h * (b * c - a * s)
        x, x_rate, x_bend = x + own, x_rate + turned, x_bend - h * h * own
        a, b = waves[Y, 2 * h - 1], waves[Y, 2 * h]
        own, turned = a * c + b * s, h * (b * c - a * s)
        y, y_rate, y_bend = y + own, y_rate + turned, y_bend - h * h * own
        a, b = waves[L, 2 * h - 1], waves[L, 2 * h]
        own, turned = a * c + b * s, h * (b * c - a * s)
        limit, limit_rate, limit_bend = limit + own, limit_rate + turned, limit_bend - h * h * own
    return x, y, limit, x_rate, y_rate, limit_rate, x_bend, y_bend, limit_bend


@njit(**INNER)
def accelerations(motion, tau):  # type: ignore[no-untyped-def]
    """Return X'', Y'' and L'' at `tau`."""
    waves = motion.waves
    c1, s1 = np.cos(tau), np.sin(tau)
    c, s = 1.0, 0.0
    x = y = limit = 0.0
    for h in range(1, (waves.shape[1] + 1) // 2):
        c, s = c * c1 - s * s1, s * c1 + c * s1
        a, b = -h * s, h * c
        x += waves[X_RATE, 2 * h - 1] * a + waves[X_RATE, 2 * h] * b
        y += waves[Y_RATE, 2 * h - 1] * a + waves[Y_RATE, 2 * h] * b
        limit += waves[L_RATE, 2 * h - 1] * a + waves[L_RATE, 2 * h] * b
    return x, y, limit


@njit(**INNER)
def fill_stages(motion, start, width, kind, at):  # type: ignore[no-untyped-def]
    """Evaluate the motion at the stages of the piece that begins at `start`; negative limits are set to zero."""
    waves = motion.waves
    for j in range(STAGES):
        tau = start + width * TIMES[kind, j + 1]
        c1, s1 = np.cos(tau), np.sin(tau)
        at[COS, j], at[SIN, j] = c1, s1
        c, s = 1.0, 0.0
        x = y = rate = 0.0
        limit = waves[L, 0]
        for h in range(1, (waves.shape[1] + 1) // 2):
            c, s = c * c1 - s * s1, s * c1 + c * s1
            x += waves[X_RATE, 2 * h - 1] * c + waves[X_RATE, 2 * h] * s
            y += waves[Y_RATE, 2 * h - 1] * c + waves[Y_RATE, 2 * h] * s
            limit += waves[L, 2 * h - 1] * c + waves[L, 2 * h] * s
            rate += waves[L_RATE, 2 * h - 1] * c + waves[L_RATE, 2 * h] * s
        limit = max(limit, 0.0)
        at[AT_X_RATE, j], at[AT_Y_RATE, j], at[AT_LIMIT, j], at[AT_LIMIT_RATE, j] = (x, y, limit, rate)
        at[SHARE, j] = limit / (width * PACE[kind, j + 1])
