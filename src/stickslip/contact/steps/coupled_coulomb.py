"""Stick and slip of a planar friction spring over one step, for the law `contact.laws.coupled_coulomb`.

The tangential force is T = K (x - s) with K = diag(k_t, k_w) and |T| <= L. In slip, T = L e and the slider moves along
e. With Δ the displacement over the step and D = L1 - L0, the direction obeys, over the share of the step,

    L e' = V - (e·V) e,   V = (k_t k_w Δ - (k_w - k_t)/2 D (e_t, -e_w)) / (e·K e).

For equal stiffnesses V = k Δ is constant, and with ℓ = ∫ ds/L the angle δ to V decreases by tan(δ/2) -> tan(δ/2)
exp(-|V| ℓ): the exact solution. Otherwise V is taken at the middle of the step, which the same solution over half the
step predicts: an error of second order, for steps of any size. A force that grows from zero where the contact closes
keeps its direction: Δ = (λ + D/K) e.

All derivatives in slip are derivatives of the angle of e.
"""

import math

from stickslip.contact.addresses import compiled_step
from stickslip.contact.cache import njit
from stickslip.contact.law import OPEN, SLIP, STICK

SHALLOW = 1e-3  # relative change of the limit below which the logarithm is expanded in a series
FAINT = 1e-290  # length of b below which it has no direction
UNKNOWN = 1e-16  # rounding error of an angle
_MAX_STEPS = 60  # Newton steps of a scalar equation; it is nearly linear, and most take three


@njit(cache=True, error_model="numpy")
def _towards(half, left):  # type: ignore[no-untyped-def]
    """Return cosine and sine of the final angle to b, and parts of its derivatives.

    `half` is the tangent of half the initial angle.
    """
    whole = 1.0 + (left * half) ** 2
    return (
        (1.0 - (left * half) ** 2) / whole,
        2.0 * left * half / whole,
        left * (1.0 + half * half) / whole,
        (1.0 - left * half * half) / whole,
    )


@njit(cache=True, error_model="numpy")
def _away_from(half, left):  # type: ignore[no-untyped-def]
    """Return the same from the cotangent of half the angle.

    A direction exactly opposite to b stays, although it is unstable. If the remaining displacement would turn even an
    angle of rounding, the force has vanished on the way, and the direction is that of b.
    """
    if abs(half) < UNKNOWN:
        if left < UNKNOWN:
            return _towards(0.0, left)
        half = 0.0
    whole = half * half + left * left
    return (
        (half * half - left * left) / whole,
        2.0 * left * half / whole,
        left * (1.0 + half * half) / whole,
        (half * half - left) / whole,
    )


@njit(cache=True, error_model="numpy")
def turned(e_t, e_w, b_t, b_w):  # type: ignore[no-untyped-def]
    """Integrate ``e' = b - (e·b) e`` for the direction e over the time 1.

    Returns
    -------
    e_t, e_w
        The direction at the end.
    kept
        Derivative of its angle by the initial angle.
    g_t, g_w
        Derivatives of its angle by b.
    """
    size = math.hypot(b_t, b_w)
    if size < FAINT:
        return e_t, e_w, 1.0, -e_w, e_t
    d_t, d_w = b_t / size, b_w / size
    left = math.exp(-size)
    cosine = d_t * e_t + d_w * e_w
    if cosine < 0.0:  # by the cotangent of half the angle, which is exact for e opposite to b
        half = (d_t * (e_w + d_w) - d_w * (e_t + d_t)) / (1.0 - cosine)
        cos, sin, kept, swung = _away_from(half, left)
    else:
        half = (d_t * (e_w - d_w) - d_w * (e_t - d_t)) / (1.0 + cosine)
        cos, sin, kept, swung = _towards(half, left)
    swung *= -math.expm1(-size) / size
    return (cos * d_t - sin * d_w, cos * d_w + sin * d_t, kept, -swung * d_w - sin * d_t, swung * d_t - sin * d_w)


@njit(cache=True, error_model="numpy")
def _inverse_mean(first, last, share):  # type: ignore[no-untyped-def]
    """Return ∫ ds/L over the first `share` of a linear limit, and its derivatives by both ends."""
    end = last if share == 1.0 else first + share * (last - first)
    r = (end - first) / first
    if abs(r) < SHALLOW:
        f = 1.0 - r * (1 / 2 - r * (1 / 3 - r * (1 / 4 - r * (1 / 5 - r / 6))))
        slope = -1 / 2 + r * (2 / 3 - r * (3 / 4 - r * (4 / 5 - r * 5 / 6)))
    else:
        ratio = max(end / first, 1e-100)
        f = math.log(ratio) / r
        slope = (1.0 / ratio - f) / r
    mean = share * f / first
    by_last = share * share * slope / (first * first)
    return mean, -(mean + last * by_last) / first, by_last


@njit(cache=True, error_model="numpy")
def _pull(k_t, k_w, e_t, e_w, way_t, way_w, rise):  # type: ignore[no-untyped-def]
    """Return V, its derivative by the angle of e, and e·K e."""
    q = k_t * e_t * e_t + k_w * e_w * e_w
    uneven = 0.5 * (k_w - k_t) * rise
    v_t, v_w = (k_t * k_w * way_t - uneven * e_t) / q, (k_t * k_w * way_w + uneven * e_w) / q
    q_angle = 2.0 * (k_w - k_t) * e_t * e_w / q
    return v_t, v_w, uneven * e_w / q - v_t * q_angle, uneven * e_t / q - v_w * q_angle, q


@njit(cache=True, error_model="numpy")
def slipped(k_t, k_w, e_t, e_w, way_t, way_w, first, last):  # type: ignore[no-untyped-def]
    """Integrate the direction of a slipping force over a straight displacement.

    The size of the force changes from `first` to `last`, both positive.

    Returns
    -------
    e_t, e_w
        The direction at the end.
    kept, q_t, q_w, q_first, q_last
        Derivatives of its angle by the initial angle, the displacement and both sizes.
    """
    mean, mean_first, mean_last = _inverse_mean(first, last, 1.0)
    if k_t == k_w:
        n_t, n_w, kept, g_t, g_w = turned(e_t, e_w, mean * k_t * way_t, mean * k_t * way_w)
        pulled = k_t * (g_t * way_t + g_w * way_w)
        return (n_t, n_w, kept, mean * k_t * g_t, mean * k_t * g_w, pulled * mean_first, pulled * mean_last)
    rise = last - first
    half, half_first, half_last = _inverse_mean(first, last, 0.5)
    v_t, v_w, turn_t, turn_w, q = _pull(k_t, k_w, e_t, e_w, way_t, way_w, rise)
    m_t, m_w, kept_m, g_t, g_w = turned(e_t, e_w, half * v_t, half * v_w)
    both, uneven = k_t * k_w, 0.5 * (k_w - k_t)
    # derivatives of the angle at the middle
    m_angle = kept_m + half * (g_t * turn_t + g_w * turn_w)
    m_way_t, m_way_w = half * both / q * g_t, half * both / q * g_w
    m_rise = -half * uneven / q * (g_t * e_t - g_w * e_w)
    m_mean = g_t * v_t + g_w * v_w
    v_t, v_w, turn_t, turn_w, q = _pull(k_t, k_w, m_t, m_w, way_t, way_w, rise)
    n_t, n_w, kept, g_t, g_w = turned(e_t, e_w, mean * v_t, mean * v_w)
    by_middle = mean * (g_t * turn_t + g_w * turn_w)
    q_rise = -mean * uneven / q * (g_t * m_t - g_w * m_w) + by_middle * m_rise
    q_mean = g_t * v_t + g_w * v_w
    return (
        n_t,
        n_w,
        kept + by_middle * m_angle,
        mean * both / q * g_t + by_middle * m_way_t,
        mean * both / q * g_w + by_middle * m_way_w,
        q_mean * mean_first + by_middle * m_mean * half_first - q_rise,
        q_mean * mean_last + by_middle * m_mean * half_last + q_rise,
    )


@njit(cache=True, error_model="numpy")
def grown(k_t, k_w, way_t, way_w, last):  # type: ignore[no-untyped-def]
    """Return the direction of a force that grows from zero to the size `last` in slip over a straight displacement.

    Returns
    -------
    e_t, e_w
        The direction.
    q_t, q_w, q_last
        Derivatives of its angle by the displacement and the size.
    """
    multiplier = 0.0
    for _ in range(_MAX_STEPS):
        d_t, d_w = last + k_t * multiplier, last + k_w * multiplier
        e_t, e_w = k_t * way_t / d_t, k_w * way_w / d_w
        size = math.hypot(e_t, e_w)
        change = size * (size - 1.0) / (e_t * e_t * k_t / d_t + e_w * e_w * k_w / d_w) * size
        multiplier += change
        if abs(change) <= 1e-15 * multiplier:
            break
    d_t, d_w = last + k_t * multiplier, last + k_w * multiplier
    e_t, e_w = k_t * way_t / d_t, k_w * way_w / d_w
    size = math.hypot(e_t, e_w)
    e_t, e_w = e_t / size, e_w / size
    weight = k_t * e_t * e_t / d_t + k_w * e_w * e_w / d_w
    share = e_t * e_w * (k_w / d_w - k_t / d_t) / weight
    return (
        e_t,
        e_w,
        (-e_w - share * e_t) * k_t / d_t,
        (e_t - share * e_w) * k_w / d_w,
        -e_t * e_w * (1.0 / d_w - 1.0 / d_t) + share * (e_t * e_t / d_t + e_w * e_w / d_w),
    )


NOTHING = 1e-60  # relative to the force without a limit: smaller limits count as zero
OUTSIDE = 1e-3  # largest share of a step by which a start outside the limit may lie before the step


@njit(cache=True, error_model="numpy")
def _meeting(f_t, f_w, pull_t, pull_w, before, rise):  # type: ignore[no-untyped-def]
    """Return the share of the step at which a sticking spring meets the limit, and whether it depends on the start.

    The spring is beyond the limit at the end. For a start on the limit the share is zero except for rounding; slightly
    outside it is negative, so that the step is smooth there.
    """
    excess = f_t * f_t + f_w * f_w - before * before
    b = f_t * pull_t + f_w * pull_w - before * rise
    a = pull_t * pull_t + pull_w * pull_w - rise * rise
    root = math.sqrt(max(0.0, b * b - a * excess))
    if b > 0.0:
        share = -excess / (b + root)
        near = share > -OUTSIDE and -min(share, 0.0) * rise < 0.5 * before
        return (min(share, 1.0), True) if near else (0.0, False)
    return (min((root - b) / a, 1.0), True) if a > 0.0 else (1.0, False)  # beyond only by rounding


@njit(cache=True, error_model="numpy")
def _slip_on(k_t, k_w, way_t, way_w, f_t, f_w, before, after):  # type: ignore[no-untyped-def]
    """Follow the force from `f` inside the limit to the limit and along it; both limits are positive.

    Returns
    -------
    e_t, e_w
        Direction of the force after the step.
    p_t, p_w, p_ft, p_fw, p_before, p_after
        Derivatives of its angle by the displacement, the initial force and both limits.
    """
    pull_t, pull_w, rise = k_t * way_t, k_w * way_w, after - before
    share, moves = _meeting(f_t, f_w, pull_t, pull_w, before, rise)
    m_t, m_w, limit = f_t + share * pull_t, f_w + share * pull_w, before + share * rise
    size = math.hypot(m_t, m_w)
    start = math.hypot(f_t, f_w)
    outside = moves and start > 0.0 and not abs(size - limit) <= OUTSIDE * limit
    o_t, o_w = f_t / start, f_w / start
    if outside:  # the limit is only rounding, far below the initial force, which is brought back to it
        share, moves = _meeting(before * o_t, before * o_w, pull_t, pull_w, before, rise)
        m_t, m_w = before * o_t + share * pull_t, before * o_w + share * pull_w
        limit = before + share * rise
        size = math.hypot(m_t, m_w)
    a_t, a_w, rest = m_t / size, m_w / size, 1.0 - share
    e_t, e_w, kept, q_t, q_w, q_limit, q_after = slipped(k_t, k_w, a_t, a_w, rest * way_t, rest * way_w, limit, after)
    turn_t, turn_w = -kept * a_w / size, kept * a_t / size  # by the force at the limit
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
    """Write the state after the step (slider, displacement and pressure) and its derivatives."""
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
    """Return the closed share of the step, and its derivatives by the normal gap and the previous pressure."""
    if before > 0.0 or pressure <= before:
        return 1.0, 0.0, 0.0
    change = pressure - before
    return pressure / change, k_n * before / change**2, pressure / change**2


@njit(cache=True, error_model="numpy")
def _stick_rows(k, way, closing, share, jac):  # type: ignore[no-untyped-def]
    """Fill the derivatives of a sticking force; `share` is the result of `_closed_share`."""
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
    """Fill a slipping force and its derivatives."""
    k_t, k_w, k_n, mu, _ = parameters
    # derivatives of its angle: by the gap t, w, n, and by previous slider, displacement and pressure
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
    """Stick, slip and open over a straight displacement.

    The state is slider (2), displacement (2) and pressure at the previous step.
    """
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
