"""End of stick of a planar contact: the first zero of ``F = |X - z|² - L²``, bracketed so that none is missed.

From value, slope and second derivative at a time and a bound M on the third derivative follows how long F stays below
zero, or rises without turning. Steps of this length lead from the beginning of stick to the first zero, which the last
step brackets. Slip ends at a double zero of F; after slip, the search must not find this zero again.
"""

import numpy as np

from stickslip.contact.cache import njit
from stickslip.contact.planar.motion import TINY, L, X, Y, place, place_and_rates
from stickslip.contact.planar.radau import INNER

_SHORTEST = 1e-10  # step over times at which rounding hides the sign
_MOST_STEPS = 4000
_TIME_TOLERANCE = 1e-8


@njit(**INNER)
def never_reached(motion, z_x, z_y):  # type: ignore[no-untyped-def]
    """Whether bounds prove that the force of a spring with its slider at z always stays below the limit."""
    bounds = motion.bounds
    reach = np.hypot(motion.waves[X, 0] - z_x, motion.waves[Y, 0] - z_y) + bounds[0]
    return reach <= motion.waves[L, 0] - (bounds[4] - abs(motion.waves[L, 0]))


@njit(**INNER)
def _square(motion, z_x, z_y, tau):  # type: ignore[no-untyped-def]
    """Return ``|X - z|² - L²`` at `tau`."""
    x, y, limit = place(motion, tau)
    size = np.hypot(x - z_x, y - z_y)
    return (size - limit) * (size + limit)


@njit(**INNER)
def _root(motion, z_x, z_y, left, right):  # type: ignore[no-untyped-def]
    """Return the zero between `left` and `right`, at which F changes from negative to positive."""
    tau = 0.5 * (left + right)
    for _ in range(80):
        x, y, limit, x_rate, y_rate, limit_rate, _, _, _ = place_and_rates(motion, tau)
        x -= z_x
        y -= z_y
        size = np.hypot(x, y)
        f = (size - limit) * (size + limit)
        slope = 2.0 * (x * x_rate + y * y_rate - limit * limit_rate)
        if f < 0.0:
            left = tau
        else:
            right = tau
        new = tau - f / slope if slope > 0.0 else left
        if not left < new < right:
            tau = 0.5 * (left + right)
            if right - left <= _TIME_TOLERANCE * _TIME_TOLERANCE:
                return tau
            continue
        # the error after a step of Newton's method is about its square
        if abs(new - tau) <= _TIME_TOLERANCE or not left < new < right:
            return new
        tau = new
    return tau


@njit(**INNER)
def _below(gap, slope, bend, third):  # type: ignore[no-untyped-def]
    """Return a step over which ``-gap + slope h + bend h²/2 + third h³/6`` stays below zero, or 0."""
    curved = max(bend, 0.0)
    if slope > 0.0:
        h = min(gap / (3.0 * slope), np.cbrt(2.0 * gap / third))
        return min(h, np.sqrt(2.0 * gap / (3.0 * curved))) if curved > 0.0 else h
    h = np.cbrt(3.0 * gap / third)
    if curved > 0.0:
        h = min(h, np.sqrt(gap / curved))
    fall = -slope
    h = max(h, 2.0 * fall / (0.5 * curved + np.sqrt(0.25 * curved**2 + 2.0 * third * fall / 3.0) + TINY))
    return max(h, -3.0 * bend / third)


@njit(**INNER)
def slip_begins(motion, z_x, z_y, tau, end, after_slip):  # type: ignore[no-untyped-def]
    """Return the time at which a contact that sticks from `tau` on reaches its limit; `end` if it does not.

    Parameters
    ----------
    motion
        Motion imposed on the contact.
    z_x, z_y
        Position of its slider, in units of force.
    tau, end
        Interval of time.
    after_slip
        Whether the contact is at its limit at `tau`, because slip ends or the contact closes.
    """
    b = motion.bounds
    reach = np.hypot(motion.waves[X, 0] - z_x, motion.waves[Y, 0] - z_y) + b[0]
    third = 2.0 * reach * b[3] + 6.0 * b[1] * b[2] + 6.0 * b[5] * b[6] + 2.0 * b[4] * b[7] + TINY
    for _ in range(_MOST_STEPS):
        x, y, limit, x_rate, y_rate, limit_rate, x_bend, y_bend, limit_bend = place_and_rates(motion, tau)
        x -= z_x
        y -= z_y
        size = np.hypot(x, y)
        gap = max((limit - size) * (limit + size), 0.0)
        slope = 2.0 * (x * x_rate + y * y_rate - limit * limit_rate)
        bend = 2.0 * (x_rate**2 + y_rate**2 - limit_rate**2 + x * x_bend + y * y_bend - limit * limit_bend)
        if after_slip:
            gap, slope, after_slip = 0.0, 0.0, False
        elif gap == 0.0 and slope > 0.0:
            return tau
        step = max(_below(gap, slope, bend, third), _SHORTEST)
        if slope > 0.0:
            root = np.sqrt(bend * bend + 2.0 * third * slope)
            rise = (bend + root) / third if bend > 0.0 else 2.0 * slope / (root - bend)
            if rise > step:
                right = min(tau + rise, end)
                if _square(motion, z_x, z_y, right) > 0.0:
                    return _root(motion, z_x, z_y, tau, right)
                step = rise
        tau += step
        if tau >= end:
            return end
    return end
