"""Forces and derivatives of elastic Coulomb contacts over one period, by intervals of constant state.

Between two changes of state the force is linear in the gap, and the derivative of a sticking spring depends only on the
last sample that did not stick, the anchor (slip and lift-off erase memory). A derivative block is therefore a sum over
the few intervals of ``sum b_i b_i^T`` and ``(sum b_i) b_a^T``, with ``b`` the Fourier basis (1, cos, sin, ...) at a
sample and ``a`` the anchor. Products of basis functions are cosines and sines of sums and differences of their orders,
so that both terms come from one table of prefix sums (cf. Petrov & Ewins 2003, who use exact event times).

Two periods are marched, which is exact. One period maps the tangential force T to clip(T + k Δx, lo, hi) composed over
the samples, which is again a clip. The net Δx over a period is zero, so the map is idempotent.
"""

import numpy as np
from numba import prange

from stickslip.arrays import FloatArray
from stickslip.contact.cache import njit
from stickslip.contact.element import K_N, MU, PRELOAD, RESIDUAL, UNILATERAL
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT


def prefix_sums(order: int, samples: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Tabulate the Fourier basis and the prefix sums of its products.

    Parameters
    ----------
    order
        Highest harmonic.
    samples
        Samples per period.

    Returns
    -------
    tuple
        Basis (samples, 2 order + 1) in the order 1, cos, sin, cos 2, ...; prefix sums over samples of cos(m τ) and of sin(m τ),
        each (samples + 1, 2 order + 1), m = 0 .. 2 order.
    """
    tau = 2.0 * np.pi * np.arange(samples) / samples
    angles = np.outer(tau, np.arange(2 * order + 1))
    cos, sin = np.cos(angles), np.sin(angles)
    basis = np.empty((samples, 2 * order + 1))
    basis[:, 0] = 1.0
    basis[:, 1::2] = cos[:, 1 : order + 1]
    basis[:, 2::2] = sin[:, 1 : order + 1]
    zero = np.zeros((1, 2 * order + 1))
    return (basis, np.vstack([zero, np.cumsum(cos, axis=0)]), np.vstack([zero, np.cumsum(sin, axis=0)]))


@njit(cache=True)
def _product_matrix(cos_sum, sin_sum, order, factor, out):  # type: ignore[no-untyped-def]
    """Add ``factor * W sum b b^T`` to `out`, from the sums of cos(m τ) and sin(m τ); W weights rows 1, 2, 2, ..."""
    out[0, 0] += factor * cos_sum[0]
    for k in range(1, order + 1):
        out[0, 2 * k - 1] += factor * cos_sum[k]
        out[0, 2 * k] += factor * sin_sum[k]
        out[2 * k - 1, 0] += 2.0 * factor * cos_sum[k]
        out[2 * k, 0] += 2.0 * factor * sin_sum[k]
    for h in range(1, order + 1):
        for k in range(1, order + 1):
            d = h - k
            sign = 1.0 if d >= 0 else -1.0
            c_d, s_d = cos_sum[abs(d)], sign * sin_sum[abs(d)]
            c_s, s_s = cos_sum[h + k], sin_sum[h + k]
            out[2 * h - 1, 2 * k - 1] += factor * (c_d + c_s)
            out[2 * h, 2 * k] += factor * (c_d - c_s)
            out[2 * h, 2 * k - 1] += factor * (s_s + s_d)
            out[2 * h - 1, 2 * k] += factor * (s_s - s_d)


@njit(cache=True)
def _outer(cos_row, sin_row, basis_row, order, factor, out):  # type: ignore[no-untyped-def]
    """Add ``factor * W (sum b_i) b_a^T`` to `out`; the sums of the interval are given as cos and sin sums."""
    m = 2 * order + 1
    for q in range(m):
        out[0, q] += factor * cos_row[0] * basis_row[q]
    for h in range(1, order + 1):
        c, s = 2.0 * factor * cos_row[h], 2.0 * factor * sin_row[h]
        for q in range(m):
            out[2 * h - 1, q] += c * basis_row[q]
            out[2 * h, q] += s * basis_row[q]


@njit(cache=True)
def _first_period(x, limit, is_open, k, start):  # type: ignore[no-untyped-def]
    """March one Jenkins spring over the first period; return its anchor, and sign of slip and force there.

    The anchor is the sample whose force and position determine the spring while it sticks (-1: none, the spring starts
    unstretched at zero displacement). The sign is 0 if the contact was open at the anchor.
    """
    n = x.size
    a, sign, held, place = -1, 0.0, 0.0, 0.0
    if not np.isnan(start):
        a, sign = n - 1, start
        held, place = start * limit[a], x[a]
    for i in range(n):
        if is_open[i]:
            a, sign, held, place = i, 0.0, 0.0, x[i]
            continue
        trial = held + k * (x[i] - place)
        if abs(trial) > limit[i]:
            sign = 1.0 if trial > 0.0 else -1.0
            a, held, place = i, sign * limit[i], x[i]
    return a, sign, held


@njit(cache=True)
def _march_tangent(x, limit, is_open, k, start, force, state, spans, signs):  # type: ignore[no-untyped-def]
    """March one Jenkins spring over two periods, with a limit per sample; add the force of the second to `force`.

    Returns
    -------
    int
        Number of rows of `spans`: first sample, state, and anchor of each interval of constant state, with the sign of
        the slip in `signs`, for stick at the anchor.
    """
    a, sign, held = _first_period(x, limit, is_open, k, start)
    place = x[a] if a >= 0 else 0.0
    count, last, last_sign = 0, -1, 0.0
    for i in range(x.size):
        now = STICK
        if is_open[i]:
            now = OPEN
            a, sign, held, place = i, 0.0, 0.0, x[i]
        else:
            trial = held + k * (x[i] - place)
            if abs(trial) > limit[i]:
                now = SLIP
                sign = 1.0 if trial > 0.0 else -1.0
                a, held, place = i, sign * limit[i], x[i]
                trial = held
            force[i] += trial
        state[i] = now
        if now != last or sign != last_sign:
            spans[count, 0], spans[count, 1], spans[count, 2] = i, now, a
            signs[count] = sign
            count += 1
            last, last_sign = now, sign
    return count


@njit(cache=True)
def _tangent_blocks(  # type: ignore[no-untyped-def]
    spans, signs, count, k, limit_slope, basis, cos_table, sin_table, sums, block_x, block_n
):
    """Add the derivatives of one tangential force by its own displacement and by the normal gap, from its intervals."""
    n = basis.shape[0]
    order = (basis.shape[1] - 1) // 2
    cos_stick, sin_stick, cos_slip, sin_slip, cos_row, sin_row = sums
    cos_stick[:] = 0.0
    sin_stick[:] = 0.0
    cos_slip[:] = 0.0
    sin_slip[:] = 0.0
    for r in range(count):
        i = spans[r, 0]
        j = n if r + 1 == count else spans[r + 1, 0]
        if spans[r, 1] == STICK:
            for p in range(cos_row.size):
                cos_row[p] = cos_table[j, p] - cos_table[i, p]
                sin_row[p] = sin_table[j, p] - sin_table[i, p]
                cos_stick[p] += cos_row[p]
                sin_stick[p] += sin_row[p]
            a = spans[r, 2]
            if a >= 0:
                _outer(cos_row, sin_row, basis[a], order, -k / n, block_x)
                slope = signs[r] * limit_slope
                if slope != 0.0:
                    _outer(cos_row, sin_row, basis[a], order, slope / n, block_n)
        elif spans[r, 1] == SLIP:
            for p in range(cos_row.size):
                cos_slip[p] += signs[r] * (cos_table[j, p] - cos_table[i, p])
                sin_slip[p] += signs[r] * (sin_table[j, p] - sin_table[i, p])
    _product_matrix(cos_stick, sin_stick, order, k / n, block_x)
    if limit_slope != 0.0:
        _product_matrix(cos_slip, sin_slip, order, limit_slope / n, block_n)


@njit(cache=True)
def _normal(gap, row, force, limit, is_open):  # type: ignore[no-untyped-def]
    """Add the normal force, and fill the friction limit and whether the contact is open.

    Return the slope of the limit by the gap.
    """
    k_n, mu, preload = row[K_N], row[MU], row[PRELOAD]
    if row[UNILATERAL] == 0.0:
        for i in range(gap.size):
            force[i] += k_n * gap[i]
            limit[i] = mu * preload
            is_open[i] = False
        return 0.0
    for i in range(gap.size):
        pressure = preload - k_n * gap[i]
        is_open[i] = pressure < 0.0
        pressure = 0.0 if is_open[i] else pressure
        force[i] -= pressure
        limit[i] = mu * pressure
    return -mu * k_n


@njit(cache=True)
def _closed_sums(is_open, cos_table, sin_table, cos_sum, sin_sum):  # type: ignore[no-untyped-def]
    """Sum cosines and sines over the samples at which the contact is closed."""
    n = is_open.size
    cos_sum[:] = 0.0
    sin_sum[:] = 0.0
    i = 0
    while i < n:
        j = i + 1
        while j < n and is_open[j] == is_open[i]:
            j += 1
        if not is_open[i]:
            cos_sum += cos_table[j] - cos_table[i]
            sin_sum += sin_table[j] - sin_table[i]
        i = j


@njit(cache=True)
def _element_period(gap, row, basis, cos_table, sin_table, force, state, blocks, work):  # type: ignore[no-untyped-def]
    """Add the force and the blocks of one elementary contact; `work` contains work arrays."""
    n = gap.shape[1]
    order = (basis.shape[1] - 1) // 2
    limit, is_open, spans, signs, sums = work
    limit_slope = _normal(gap[2], row, force[2], limit, is_open)
    if row[K_N] != 0.0:
        _closed_sums(is_open, cos_table, sin_table, sums[0], sums[1])
        _product_matrix(sums[0], sums[1], order, row[K_N] / n, blocks[NN])
    for d in range(2):
        k = row[d]
        if k == 0.0:
            # without stiffness there is no force along the direction
            for i in range(n):
                state[d, i] = OPEN if is_open[i] else STICK
            continue
        count = _march_tangent(gap[d], limit, is_open, k, row[RESIDUAL], force[d], state[d], spans, signs)
        _tangent_blocks(
            spans, signs, count, k, limit_slope, basis, cos_table, sin_table, sums, blocks[TT + d], blocks[TN + d]
        )


@njit(cache=True)
def _merge(state, other):  # type: ignore[no-untyped-def]
    """Merge the state of a further element into the state of the contact.

    The contact slips unless all elements stick or all are open.
    """
    for d in range(2):
        for i in range(state.shape[1]):
            if state[d, i] != other[d, i]:
                state[d, i] = SLIP


@njit(cache=True)
def _contacts(  # type: ignore[no-untyped-def]
    start, end, gap, elements, first, basis, cos_table, sin_table, force, state, blocks
):
    """Evaluate the contacts from `start` to before `end`."""
    n = gap.shape[2]
    size = cos_table.shape[1]
    work = (
        np.empty(n),
        np.empty(n, np.bool_),
        np.empty((n, 3), np.int64),
        np.empty(n),
        (np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)),
    )
    other = np.empty((2, n), np.int64)
    for c in range(start, end):
        force[c] = 0.0
        blocks[c] = 0.0
        for e in range(first[c], first[c + 1]):
            own = state[c] if e == first[c] else other
            _element_period(gap[c], elements[e], basis, cos_table, sin_table, force[c], own, blocks[c], work)
            if e > first[c]:
                _merge(state[c], other)


@njit(cache=True)
def contact_period(gap, elements, first, basis, cos_table, sin_table, force, state, blocks):  # type: ignore[no-untyped-def]
    """Evaluate all contacts over one period.

    Parameters
    ----------
    gap
        (n_contacts, 3, samples) gaps t, w, n in m.
    elements
        (n_elements, 7) rows of elementary contacts, see `contact.element`.
    first
        (n_contacts + 1,) contact c is the sum of the elements first[c] to first[c + 1].
    basis, cos_table, sin_table
        From `prefix_sums`.
    force
        Out: (n_contacts, 3, samples) contact forces (T_t, T_w, -N) in N.
    state
        Out: (n_contacts, 2, samples) 0 stick, 1 slip, 2 open, for t and w; a contact of several elements slips where
        they differ.
    blocks
        Out: (n_contacts, P, m, m) derivatives of the Fourier coefficients of the force by those of the gap, m = 2 order
        + 1. Only the first five differ from zero: t by t, w by w, n by n, t by n, w by n.
    """
    _contacts(0, gap.shape[0], gap, elements, first, basis, cos_table, sin_table, force, state, blocks)


@njit(cache=True, parallel=True)
def contact_period_threads(  # type: ignore[no-untyped-def]
    shares, gap, elements, first, basis, cos_table, sin_table, force, state, blocks
):
    """Evaluate like `contact_period`, in `shares` that are distributed over threads."""
    n = gap.shape[0]
    for share in prange(shares):
        _contacts(
            share * n // shares,
            (share + 1) * n // shares,
            gap,
            elements,
            first,
            basis,
            cos_table,
            sin_table,
            force,
            state,
            blocks,
        )
