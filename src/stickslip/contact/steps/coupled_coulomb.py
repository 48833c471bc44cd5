"""The step of the law coupled_coulomb, see `contact.laws.coupled_coulomb`."""

import math

from stickslip.contact.addresses import compiled_step
from stickslip.contact.cache import njit
from stickslip.contact.law import OPEN, SLIP, STICK
from stickslip.contact.planar_slip import grown, slipped

NOTHING = 1e-60  # of the force that it would have without a limit: a limit that is none
OUTSIDE = 1e-3  # share of a step by which a start outside the limit may lie behind it


@njit(cache=True, error_model="numpy")
def _meeting(f_t, f_w, pull_t, pull_w, before, rise):  # type: ignore[no-untyped-def]
    """Return the share of the step at which a spring that sticks meets the limit, and whether that moves with its start.

    It is beyond the limit at the end. From a start on the limit the share is zero but for rounding; a little outside it is
    negative, so that the step is smooth there.
    """
    excess = f_t * f_t + f_w * f_w - before * before
    b = f_t * pull_t + f_w * pull_w - before * rise
    a = pull_t * pull_t + pull_w * pull_w - rise * rise
    root = math.sqrt(max(0.0, b * b - a * excess))
    if b > 0.0:
        share = -excess / (b + root)
        near = share > -OUTSIDE and -min(share, 0.0) * rise < 0.5 * before
        return (min(share, 1.0), True) if near else (0.0, False)
    return (min((root - b) / a, 1.0), True) if a > 0.0 else (1.0, False)  # beyond by rounding alone


@njit(cache=True, error_model="numpy")
def _slip_on(k_t, k_w, way_t, way_w, f_t, f_w, before, after):  # type: ignore[no-untyped-def]
    """Follow the force from `f` inside the limit to the limit and along it; both limits are positive.

    Returns
    -------
    e_t, e_w
        Direction of the force behind the step.
    p_t, p_w, p_ft, p_fw, p_before, p_after
        Derivatives of its angle by the way, the force before and both limits.
    """
    pull_t, pull_w, rise = k_t * way_t, k_w * way_w, after - before
    share, moves = _meeting(f_t, f_w, pull_t, pull_w, before, rise)
    m_t, m_w, limit = f_t + share * pull_t, f_w + share * pull_w, before + share * rise
    size = math.hypot(m_t, m_w)
    start = math.hypot(f_t, f_w)
    outside = moves and start > 0.0 and not abs(size - limit) <= OUTSIDE * limit
    o_t, o_w = f_t / start, f_w / start
    if outside:  # a limit of rounding, far within the force before, which is brought back to it
        share, moves = _meeting(before * o_t, before * o_w, pull_t, pull_w, before, rise)
        m_t, m_w = before * o_t + share * pull_t, before * o_w + share * pull_w
        limit = before + share * rise
        size = math.hypot(m_t, m_w)
    a_t, a_w, rest = m_t / size, m_w / size, 1.0 - share
    e_t, e_w, kept, q_t, q_w, q_limit, q_after = slipped(k_t, k_w, a_t, a_w, rest * way_t, rest * way_w, limit, after)
    turn_t, turn_w = -kept * a_w / size, kept * a_t / size  # by the force where it meets the limit
    by_share = turn_t * pull_t + turn_w * pull_w - q_t * way_t - q_w * way_w + q_limit * rise
    steep = m_t * pull_t + m_w * pull_w - limit * rise
    moved = -by_share / steep if moves and steep > 0.0 else 0.0
    by_t, by_w = turn_t + moved * m_t, turn_w + moved * m_w
    by_way = share * k_t * by_t + rest * q_t, share * k_w * by_w + rest * q_w
    by_before = rest * (q_limit - moved * limit)
    if outside:
        along, across = by_t * o_t + by_w * o_w, (by_w * o_t - by_t * o_w) * before / start
        by_t, by_w, by_before = -across * o_w, across * o_t, by_before + along
    return (e_t, e_w, by_way[0], by_way[1], by_t, by_w, by_before, q_after + share * (q_limit - moved * limit))


@njit(cache=True, error_model="numpy")
def _keep(displacement, pressure, k, k_n, force, new_state, jac):  # type: ignore[no-untyped-def]
    """Write the state behind the step: slider, displacement and pressure, with the derivatives that follow from those of the force."""
    for d in range(2):
        new_state[d] = displacement[d]
        new_state[2 + d] = displacement[d]
        jac[3 + d, d] = 1.0
        jac[5 + d, d] = 1.0
        if k[d] > 0.0:
            new_state[d] -= force[d] / k[d]
            for a in range(11):
                jac[3 + d, a] -= jac[d, a] / k[d]
    new_state[4] = pressure
    jac[7, 2] = -k_n


@njit(cache=True, error_model="numpy")
def _closed_share(pressure, before, k_n):  # type: ignore[no-untyped-def]
    """Return the share of the step behind the closing of the contact, its derivatives by the normal gap and by the pressure before."""
    if before > 0.0 or pressure <= before:
        return 1.0, 0.0, 0.0
    change = pressure - before
    return pressure / change, k_n * before / change**2, pressure / change**2


@njit(cache=True, error_model="numpy")
def _stick_rows(k, way, closing, share, jac):  # type: ignore[no-untyped-def]
    """Fill the derivatives of a force that sticks; `share` is what `_closed_share` returns."""
    for d in range(2):
        jac[d, d] = k[d] * share[0]
        if closing:
            jac[d, 2] = k[d] * way[d] * share[1]
            jac[d, 8 + d] = -k[d] * share[0]
            jac[d, 10] = k[d] * way[d] * share[2]
        else:
            jac[d, 6 + d] = -k[d]


@njit(cache=True, error_model="numpy")
def _slip(way, state, parameters, limit, closing, share, force, jac):  # type: ignore[no-untyped-def]
    """Fill a force that slips, and its derivatives."""
    k_t, k_w, k_n, mu, _ = parameters
    # derivatives of its angle: by the gap t, w, n, by slider, displacement and pressure before
    if closing:
        part, by_gap, by_before = share
        e_t, e_w, q_t, q_w, q_limit = grown(k_t, k_w, part * way[0], part * way[1], limit)
        by_share = q_t * way[0] + q_w * way[1]
        row = (
            part * q_t,
            part * q_w,
            by_share * by_gap - q_limit * mu * k_n,
            0.0,
            0.0,
            -part * q_t,
            -part * q_w,
            by_share * by_before,
        )
    else:
        f_t, f_w = k_t * (state[2] - state[0]), k_w * (state[3] - state[1])
        e_t, e_w, p_t, p_w, p_ft, p_fw, p_before, p_after = _slip_on(
            k_t, k_w, way[0], way[1], f_t, f_w, mu * state[4], limit
        )
        row = (
            p_t,
            p_w,
            -p_after * mu * k_n,
            -k_t * p_ft,
            -k_w * p_fw,
            k_t * p_ft - p_t,
            k_w * p_fw - p_w,
            mu * p_before,
        )
    for d, along, across in ((0, e_t, -e_w), (1, e_w, e_t)):
        force[d] = limit * along
        for a in range(3):
            jac[d, a] = limit * across * row[a]
        for a in range(5):
            jac[d, 6 + a] = limit * across * row[3 + a]
        jac[d, 2] -= mu * k_n * along


def _step(displacement, velocity, state, parameters, force, new_state, jac, status):  # type: ignore[no-untyped-def]
    """Stick, slip and open along the straight way from the step before; the state is slider (2), displacement (2) and pressure there."""
    k_t, k_w, k_n, mu, preload = parameters
    k = (k_t, k_w)
    pressure = preload - k_n * displacement[2]
    if pressure < 0.0:
        status[:] = OPEN
        force[:] = 0.0
        _keep(displacement, pressure, k, k_n, force, new_state, jac)
        return
    force[2] = -pressure
    jac[2, 2] = k_n
    way = (displacement[0] - state[2], displacement[1] - state[3])
    closing = state[4] <= 0.0
    share = _closed_share(pressure, state[4], k_n)
    for d in range(2):
        force[d] = k[d] * (share[0] * way[d] if closing else displacement[d] - state[d])
    limit, trial = mu * pressure, math.hypot(force[0], force[1])
    status[:] = STICK if trial <= limit else SLIP
    if trial <= limit:
        _stick_rows(k, way, closing, share, jac)
    elif limit <= NOTHING * trial:
        force[0] = force[1] = 0.0
    else:
        _slip(way, state, parameters, limit, closing, share, force, jac)
    _keep(displacement, pressure, k, k_n, force, new_state, jac)


step = compiled_step(_step)
