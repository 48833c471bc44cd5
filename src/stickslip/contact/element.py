"""The elementary contact: a normal spring with two independent Jenkins springs (Gastaldi & Berruti 2017, section 5.1).

Its row of parameters is ``k_t, k_w, k_n, mu, preload, residual_traction, unilateral``. With ``unilateral = 1`` the normal force is
``N = max(0, preload - k_n g_n)`` and limits each tangential spring to ``mu N``; with ``unilateral = 0`` the limit is the constant
``mu preload`` and the normal spring ``k_n g_n`` acts both ways. ``residual_traction = m`` puts the tangential force just before t = 0 at
``m mu N``; NaN leaves the spring unstretched at zero displacement.
"""

import numba
import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import OPEN, SLIP, STICK, law_kernel

ROUND_OFF = 4e-16
K_T, K_W, K_N, MU, PRELOAD, RESIDUAL, UNILATERAL = range(7)


def element(
    *,
    k_t: float = 0.0,
    k_w: float = 0.0,
    k_n: float = 0.0,
    mu: float = 0.0,
    preload: float = 0.0,
    residual_traction: float | None = None,
    unilateral: bool = True,
) -> FloatArray:
    """Return the (7,) row of an elementary contact."""
    m = np.nan if residual_traction is None else residual_traction
    return np.array([k_t, k_w, k_n, mu, preload, m, float(unilateral)])


@numba.njit(cache=True)
def normal_contact(g_n, parameters):  # type: ignore[no-untyped-def]
    """Return the normal force on the structure, its slope, the limit of the friction force, its slope, and whether it is open."""
    k_n, mu, preload = parameters[K_N], parameters[MU], parameters[PRELOAD]
    if parameters[UNILATERAL] == 0.0:
        return k_n * g_n, k_n, mu * preload, 0.0, False
    pressure = preload - k_n * g_n
    if pressure < 0.0:
        return 0.0, 0.0, 0.0, 0.0, True
    return -pressure, k_n, mu * pressure, -mu * k_n, False


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Advance both sliders, whose positions are the state."""
    force[2], slope, limit, limit_slope, is_open = normal_contact(displacement[2], parameters)
    jac[2, 2] = slope
    for d in range(2):
        k, x, s = parameters[d], displacement[d], state[d]
        if (
            k == 0.0 or is_open or parameters[MU] == 0.0
        ):  # without friction the slider follows, also where x rests
            status[d] = OPEN if is_open else STICK if k == 0.0 else SLIP
            force[d] = 0.0
            new_state[d] = x
            jac[3 + d, d] = 1.0
            continue
        started = not np.isnan(s)
        trial = k * (x - s) if started else parameters[RESIDUAL] * limit
        # x - s of a slider that rests at its limit is off by rounding
        if started and abs(trial) <= limit + ROUND_OFF * k * (abs(x) + abs(s)):
            status[d] = STICK
            force[d] = trial
            new_state[d] = s
            jac[d, d] = k
            jac[d, 6 + d] = -k
            jac[3 + d, 6 + d] = 1.0
            continue
        share = parameters[RESIDUAL] if not started else 1.0 if trial > 0.0 else -1.0
        status[d] = SLIP
        force[d] = share * limit
        jac[d, 2] = share * limit_slope
        new_state[d] = x - force[d] / k
        jac[3 + d, d] = 1.0
        jac[3 + d, 2] = -share * limit_slope / k


element_step = law_kernel(_step)


def slider_start(
    residual_traction: float | None, slider: tuple[float, float] | None = None
) -> FloatArray:
    """Return the (2,) slider positions before t = 0: `slider`, zero without one, or NaN where a residual traction decides."""
    if residual_traction is not None:
        return np.full(2, np.nan)
    return np.zeros(2) if slider is None else np.array(slider)
