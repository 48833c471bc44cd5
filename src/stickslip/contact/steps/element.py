"""The step of an elementary contact, see `contact.element`."""

import numpy as np

from stickslip.contact.addresses import compiled_step
from stickslip.contact.cache import njit
from stickslip.contact.element import K_N, MU, PRELOAD, RESIDUAL, ROUND_OFF, UNILATERAL
from stickslip.contact.law import OPEN, SLIP, STICK


@njit(cache=True)
def normal_contact(g_n, parameters):  # type: ignore[no-untyped-def]
    """Return the normal force on the structure, the friction limit, their slopes, and whether the contact is open."""
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
        if k == 0.0 or is_open or parameters[MU] == 0.0:  # without friction the slider follows, even if x does not move
            status[d] = OPEN if is_open else STICK if k == 0.0 else SLIP
            force[d] = 0.0
            new_state[d] = x
            jac[3 + d, d] = 1.0
            continue
        started = not np.isnan(s)
        trial = k * (x - s) if started else parameters[RESIDUAL] * limit
        # x - s of a slider at rest on its limit is off by rounding
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


step = compiled_step(_step)
