"""Forces and derivatives of elastic Coulomb contacts over one period, by intervals of constant state.

Between two changes of state the force is linear in the gap, and the derivative of a sticking spring depends only on the last
sample that did not stick (slip and lift-off erase memory). A derivative block is therefore a sum over the few intervals of
``sum b_i b_i^T`` and ``(sum b_i) b_a^T``, with ``b`` the Fourier basis (1, cos, sin, ...) at a sample and ``a`` the anchor
sample; products of basis functions are sums of cosines and sines of the sum and the difference of their orders, so that both come
from one table of prefix sums (cf. Petrov & Ewins 2003, who do the same with exact event times).

Two periods are marched. That is enough, not an approximation: one period maps the tangential force T to clip(T + k Δx, lo, hi)
composed over the samples, which is again a clip, and the net Δx over a period is zero, so the map is idempotent.
"""

import numba
import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.element import K_N, RESIDUAL, normal_contact
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
    return (
        basis,
        np.vstack([zero, np.cumsum(cos, axis=0)]),
        np.vstack([zero, np.cumsum(sin, axis=0)]),
    )


@numba.njit(cache=True)
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


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def _march_tangent(x, limit, is_open, k, start, force, state, anchor, anchor_sign):  # type: ignore[no-untyped-def]
    """March one Jenkins spring with the limit of each sample over two periods; the second one is kept.

    `anchor` is the sample whose force and position fix the spring while it sticks (-1: none, the spring starts unstretched at zero
    displacement), `anchor_sign` the sign of the slip there (0 for a sample at which the contact was open).
    """
    n = x.size
    a = -1
    sign = 0.0
    held = 0.0
    if not np.isnan(start):
        a = n - 1
        sign = start
        held = start * limit[a]
    for _ in range(2):
        for i in range(n):
            if is_open[i]:
                a, sign, held = i, 0.0, 0.0
                force[i] = 0.0
                state[i] = OPEN
            else:
                trial = k * x[i] if a < 0 else held + k * (x[i] - x[a])
                if abs(trial) > limit[i]:
                    sign = 1.0 if trial > 0.0 else -1.0
                    a, held = i, sign * limit[i]
                    force[i] = held
                    state[i] = SLIP
                else:
                    force[i] = trial
                    state[i] = STICK
            anchor[i] = a
            anchor_sign[i] = sign


@numba.njit(cache=True)
def _tangent_blocks(  # type: ignore[no-untyped-def]
    state,
    anchor,
    anchor_sign,
    k,
    limit_slope,
    basis,
    cos_table,
    sin_table,
    order,
    cos_stick,
    sin_stick,
    cos_slip,
    sin_slip,
    block_x,
    block_n,
):
    """Add the derivatives of one tangential force by its own displacement and by the normal gap, from its intervals."""
    n = state.size
    cos_stick[:] = 0.0
    sin_stick[:] = 0.0
    cos_slip[:] = 0.0
    sin_slip[:] = 0.0
    i = 0
    while i < n:
        j = i + 1
        if state[i] == STICK:
            while j < n and state[j] == STICK:
                j += 1
            cos_row = cos_table[j] - cos_table[i]
            sin_row = sin_table[j] - sin_table[i]
            cos_stick += cos_row
            sin_stick += sin_row
            a = anchor[i]
            if a >= 0:
                _outer(cos_row, sin_row, basis[a], order, -k / n, block_x)
                if anchor_sign[i] != 0.0:
                    _outer(
                        cos_row, sin_row, basis[a], order, anchor_sign[i] * limit_slope / n, block_n
                    )
        elif state[i] == SLIP:
            while j < n and state[j] == SLIP and anchor_sign[j] == anchor_sign[i]:
                j += 1
            cos_slip += anchor_sign[i] * (cos_table[j] - cos_table[i])
            sin_slip += anchor_sign[i] * (sin_table[j] - sin_table[i])
        i = j
    _product_matrix(cos_stick, sin_stick, order, k / n, block_x)
    _product_matrix(cos_slip, sin_slip, order, limit_slope / n, block_n)


@numba.njit(cache=True)
def _element_period(gap, row, basis, cos_table, sin_table, force, state, blocks, work):  # type: ignore[no-untyped-def]
    """Add the force and the blocks of one elementary contact; `work` holds the arrays it needs on the way."""
    n = gap.shape[1]
    order = (basis.shape[1] - 1) // 2
    limit, tangent, is_open, anchor, anchor_sign, sums = work
    cos_a, sin_a, cos_b, sin_b = sums
    k_n = row[K_N]
    slope = limit_slope = 0.0
    for i in range(n):
        normal, k, limit[i], by_gap, is_open[i] = normal_contact(gap[2, i], row)
        force[2, i] += normal
        if not is_open[i]:
            slope, limit_slope = k, by_gap
    if k_n != 0.0:
        cos_a[:] = 0.0
        sin_a[:] = 0.0
        i = 0
        while i < n:
            j = i + 1
            while j < n and is_open[j] == is_open[i]:
                j += 1
            if not is_open[i]:
                cos_a += cos_table[j] - cos_table[i]
                sin_a += sin_table[j] - sin_table[i]
            i = j
        _product_matrix(cos_a, sin_a, order, slope / n, blocks[NN])
    for d in range(2):
        k = row[d]
        if k == 0.0:
            # a direction without stiffness carries no force
            for i in range(n):
                state[d, i] = OPEN if is_open[i] else STICK
            continue
        _march_tangent(
            gap[d], limit, is_open, k, row[RESIDUAL], tangent, state[d], anchor, anchor_sign
        )
        force[d] += tangent
        _tangent_blocks(
            state[d], anchor, anchor_sign, k, limit_slope, basis, cos_table, sin_table, order,
            cos_a, sin_a, cos_b, sin_b, blocks[TT + d], blocks[TN + d],
        )  # fmt: skip


@numba.njit(cache=True)
def _merge(state, other):  # type: ignore[no-untyped-def]
    """Merge the state of one more element into that of the contact: what is neither all stuck nor all open slips."""
    for d in range(2):
        for i in range(state.shape[1]):
            if state[d, i] != other[d, i]:
                state[d, i] = SLIP


@numba.njit(cache=True)
def _contacts(  # type: ignore[no-untyped-def]
    start, end, gap, elements, first, basis, cos_table, sin_table, force, state, blocks
):  # fmt: skip
    """Evaluate the contacts from `start` to before `end`."""
    n = gap.shape[2]
    size = cos_table.shape[1]
    work = (
        np.empty(n), np.empty(n), np.empty(n, np.bool_), np.empty(n, np.int64), np.empty(n),
        (np.empty(size), np.empty(size), np.empty(size), np.empty(size)),
    )  # fmt: skip
    other = np.empty((2, n), np.int64)
    for c in range(start, end):
        force[c] = 0.0
        blocks[c] = 0.0
        for e in range(first[c], first[c + 1]):
            own = state[c] if e == first[c] else other
            _element_period(
                gap[c], elements[e], basis, cos_table, sin_table, force[c], own, blocks[c], work
            )
            if e > first[c]:
                _merge(state[c], other)


@numba.njit(cache=True)
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
        Out: (n_contacts, 2, samples) 0 stick, 1 slip, 2 open, for t and w; a contact of several elements slips where they differ.
    blocks
        Out: (n_contacts, P, m, m) derivatives of Fourier coefficients of the force by those of the gap, m = 2 order + 1, of which the
        first five differ from zero: t by t, w by w, n by n, t by n, w by n.
    """
    _contacts(
        0, gap.shape[0], gap, elements, first, basis, cos_table, sin_table, force, state, blocks
    )


@numba.njit(cache=True, parallel=True)
def contact_period_threads(  # type: ignore[no-untyped-def]
    shares, gap, elements, first, basis, cos_table, sin_table, force, state, blocks
):  # fmt: skip
    """Do the same as `contact_period` in `shares` that threads take in turn."""
    n = gap.shape[0]
    for share in numba.prange(shares):
        _contacts(
            share * n // shares, (share + 1) * n // shares,
            gap, elements, first, basis, cos_table, sin_table, force, state, blocks,
        )  # fmt: skip
