"""Slip of a planar friction spring over one step: path and limit are straight from the step before.

The tangential force is T = K (x - s) with K = diag(k_t, k_w) and |T| <= L. Where it slips, T = L e and the slider moves along e. With Δ the
way over the step and D = L1 - L0 the direction obeys, in the share of the step,

    L e' = V - (e·V) e,   V = (k_t k_w Δ - (k_w - k_t)/2 D (e_t, -e_w)) / (e·K e).

For equal stiffnesses V = k Δ is fixed, and with ℓ = ∫ ds/L the direction turns towards it by tan(δ/2) -> tan(δ/2) exp(-|V| ℓ): the exact
solution. Otherwise V is taken at the middle of the step, where the same solution over half the step leads: an error of second order, without a
bound on the step. A force that grows from nothing where the contact closes keeps its direction: Δ = (λ + D/K) e.

All derivatives are those of the angle of e.
"""

import math

from stickslip.contact.cache import njit

SHALLOW = 1e-3  # relative change of the limit below which the series of its logarithm is better than the logarithm
FAINT = 1e-290  # of a turning below which it has no direction
UNKNOWN = 1e-16  # rounding of an angle
_MAX_STEPS = 60  # Newton steps of a scalar equation; it is nearly linear, and most take three


@njit(cache=True, error_model="numpy")
def _towards(half, left):  # type: ignore[no-untyped-def]
    """Return cosine and sine of the angle from b behind, from the tangent of half of it before, and parts of its derivatives."""
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

    Exactly against b the direction stays, however unstable that is. Where the rest of the way would turn even an angle of rounding,
    the force has vanished on it: there the direction is that of b.
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
    """Turn the direction e by ``e' = b - (e·b) e`` over the time one.

    Returns
    -------
    e_t, e_w
        The direction behind.
    kept
        Derivative of its angle by the angle before.
    g_t, g_w
        Derivative of its angle by b.
    """
    size = math.hypot(b_t, b_w)
    if size < FAINT:
        return e_t, e_w, 1.0, -e_w, e_t
    d_t, d_w = b_t / size, b_w / size
    left = math.exp(-size)
    cosine = d_t * e_t + d_w * e_w
    if cosine < 0.0:  # by the cotangent of half the angle, which is exact where e is against b
        half = (d_t * (e_w + d_w) - d_w * (e_t + d_t)) / (1.0 - cosine)
        cos, sin, kept, swung = _away_from(half, left)
    else:
        half = (d_t * (e_w - d_w) - d_w * (e_t - d_t)) / (1.0 + cosine)
        cos, sin, kept, swung = _towards(half, left)
    swung *= -math.expm1(-size) / size
    return (cos * d_t - sin * d_w, cos * d_w + sin * d_t, kept, -swung * d_w - sin * d_t, swung * d_t - sin * d_w)


@njit(cache=True, error_model="numpy")
def _inverse_mean(first, last, share):  # type: ignore[no-untyped-def]
    """Return ∫ ds/L over the first `share` of a straight limit, and its derivatives by both ends."""
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
    """Turn the direction of a slipping force over a straight way, while its size goes from `first` to `last`, both positive.

    Returns
    -------
    e_t, e_w
        The direction behind.
    kept, q_t, q_w, q_first, q_last
        Derivatives of its angle by the angle before, the way and both sizes.
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
    """Return the direction of a force that grows from nothing over a straight way, slipping, to the size `last`.

    Returns
    -------
    e_t, e_w
        The direction.
    q_t, q_w, q_last
        Derivatives of its angle by the way and the size.
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
