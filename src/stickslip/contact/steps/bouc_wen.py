"""The step of the law bouc_wen, see `contact.laws.bouc_wen`."""

import numpy as np

from stickslip.contact.addresses import compiled_step
from stickslip.contact.cache import njit
from stickslip.contact.law import SLIP, STICK

# Gauss-Legendre points and weights on [0, 1] after s = y v², which makes fractional powers of s smooth
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_V = 0.5 * (_POINTS + 1.0)
_SQUARES, _FACTORS = _V**2, _WEIGHTS * _V
STEPS = 60  # limit for Newton's method, which needs about five
SATURATED = 40.0  # -log(1 - y) above which y = 1 to rounding


@njit(cache=True)
def _beyond_pole(s, n):  # type: ignore[no-untyped-def]
    """Return ``1 / (1 - sⁿ) - 1 / (n (1 - s))``, which is smooth on [0, 1]."""
    e = 1.0 - s
    if n * e < 1e-4:
        a, b = (n - 1.0) / 2.0, (n - 1.0) * (n - 2.0) / 6.0
        return (a + (a * a - b) * e) / n
    whole = -np.expm1(n * np.log1p(-e)) if s > 0.0 else 1.0
    return (n * e - whole) / (n * e * whole)


@njit(cache=True)
def _way_up(p, n):  # type: ignore[no-untyped-def]
    """Return ``∫ ds / (1 - sⁿ)`` from 0 to ``1 - exp(-p)`` and its derivative by p."""
    y = -np.expm1(-p)
    rest = 0.0
    for i in range(_SQUARES.size):
        rest += _FACTORS[i] * _beyond_pole(y * _SQUARES[i], n)
    e = np.exp(-p)
    whole = -np.expm1(n * np.log1p(-e)) if p > 0.0 else 1.0
    return p / n + y * rest, e / whole


@njit(cache=True)
def _way_down(y, n, r):  # type: ignore[no-untyped-def]
    """Return ``∫ ds / (1 + r sⁿ)`` from 0 to y."""
    total = 0.0
    for i in range(_SQUARES.size):
        total += _FACTORS[i] / (1.0 + r * (y * _SQUARES[i]) ** n)
    return y * total


@njit(cache=True)
def loaded(y, u, n):  # type: ignore[no-untyped-def]
    """Solve ``dy/du = 1 - yⁿ`` from y in [0, 1] over u >= 0."""
    p = -np.log1p(-y) if y < 1.0 else SATURATED
    p = min(p, SATURATED)
    target = _way_up(p, n)[0] + u
    if target > SATURATED / n + 1.0:
        return 1.0
    for _ in range(STEPS):  # the integral is concave in p: from below, Newton's method overshoots at most once
        way, slope = _way_up(p, n)
        step = (target - way) / slope
        p = max(p + step, 0.0)
        if abs(step) <= 1e-15 * (1.0 + p):
            break
    return -np.expm1(-p)


@njit(cache=True)
def unloaded(y, u, n, r):  # type: ignore[no-untyped-def]
    """Solve ``dy/du = -(1 + r yⁿ)`` from y in [0, 1] over u >= 0; return y and, if it reaches zero, the remaining u."""
    way = _way_down(y, n, r)
    if u >= way:
        return 0.0, u - way
    target = way - u
    for _ in range(STEPS):  # the integral is concave in y, too
        step = (target - _way_down(y, n, r)) * (1.0 + r * y**n)
        y = min(max(y + step, 0.0), 1.0)
        if abs(step) <= 1e-15:
            break
    return y, 0.0


@njit(cache=True)
def advanced(y, u, n, r):  # type: ignore[no-untyped-def]
    """Advance the signed share y of the limit by the signed u; return it with its derivatives by u and by its start."""
    if u == 0.0:
        return y, 1.0, 1.0
    sign = 1.0 if u > 0.0 else -1.0
    start, way = sign * y, abs(u)
    if start >= 0.0:
        end = loaded(min(start, 1.0), way, n)
        rate = -np.expm1(n * np.log(end)) if end > 0.0 else 1.0
        before = -np.expm1(n * np.log(start)) if start > 0.0 else 1.0
        return sign * end, rate, (rate / before if before > 0.0 else np.exp(-n * way))
    before = 1.0 + r * (-start) ** n
    below, left = unloaded(-start, way, n, r)
    if left == 0.0:
        rate = 1.0 + r * below**n
        return -sign * below, rate, rate / before
    end = loaded(0.0, left, n)
    rate = -np.expm1(n * np.log(end)) if end > 0.0 else 1.0
    return sign * end, rate, rate / before


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Integrate over the increment; the state is displacement and share of the largest z, along t, then along w."""
    alpha, largest, initial, n, r, k_n = parameters[2:8]
    for d in range(2):
        k, x = parameters[d], displacement[d]
        per_metre = initial / largest
        y, rate, by_start = advanced(state[2 * d + 1], (x - state[2 * d]) * per_metre, n, r)
        slope = rate * per_metre
        inner = (1.0 - alpha) * k * largest
        force[d] = alpha * k * x + inner * y
        new_state[2 * d] = x
        new_state[2 * d + 1] = y
        jac[d, d] = alpha * k + inner * slope
        jac[d, 6 + 2 * d] = -inner * slope
        jac[d, 7 + 2 * d] = inner * by_start
        jac[3 + 2 * d, d] = 1.0
        jac[4 + 2 * d, d] = slope
        jac[4 + 2 * d, 6 + 2 * d] = -slope
        jac[4 + 2 * d, 7 + 2 * d] = by_start
        status[d] = SLIP if rate < 0.5 else STICK
    force[2] = k_n * displacement[2]
    jac[2, 2] = k_n


step = compiled_step(_step)
