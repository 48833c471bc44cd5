"""Forces and derivatives of piecewise-linear contacts over one period, by exact events (Petrov & Ewins 2003).

The gaps are trigonometric polynomials, and so are the pressure of a closed contact and, within a state, the friction force. The times
of opening and closing are found as sign changes of the pressure, those of stick and slip as in `contact.slider`; what is left are
integrals of products of cosines and sines between them, in closed form: there is no sampling error.

The force is continuous in time, so the motion of the events adds to its derivative only through the place where the slider rests. The
end of slip is stationary in time and adds nothing; a contact that closes into stick keeps the gap at the time of closing, which moves
with the normal gap.
"""

from functools import lru_cache

import numba
import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.element import K_N, MU, PRELOAD, UNILATERAL, normal_contact
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT
from stickslip.contact.slider import (
    ANCHOR,
    BY_NORMAL,
    NO_ANCHOR,
    PERIOD,
    PLACE,
    SIGN,
    START,
    STATE,
    find_segments,
    scratch,
    zeros,
)
from stickslip.contact.threads import thread_shares
from stickslip.contact.trigonometric import add_means, harmonics_at, product_matrix, search_grid

LARGEST = 1e152  # of a gap's Fourier coefficients; its square is still finite


@numba.njit(cache=True)
def _basis_row(at, weight, out):  # type: ignore[no-untyped-def]
    """Fill `out` with cos and sin in the order of coefficients, times `weight` from the first harmonic on."""
    out[0] = at[0, 0]
    for h in range(1, (out.size + 1) // 2):
        out[2 * h - 1] = weight * at[0, h]
        out[2 * h] = weight * at[1, h]


@numba.njit(cache=True)
def _add_stuck(segment, at_start, k, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
    """Add what the resting slider of one segment takes off the force ``k x``."""
    _basis_row(work.means[0], 2.0, work.row)
    m = work.row.size
    for p in range(m):
        coefficients[p] -= segment[PLACE] * work.row[p]
    if segment[ANCHOR] == NO_ANCHOR:
        return
    at = at_start
    if segment[ANCHOR] != segment[START]:
        at = work.harmonics[2]
        harmonics_at(segment[ANCHOR], at)
    _basis_row(at, 1.0, work.anchor)
    by_normal = segment[BY_NORMAL]
    for p in range(m):
        by_x = k * work.row[p]
        for q in range(m):
            block_x[p, q] -= by_x * work.anchor[q]
        if by_normal != 0.0:
            by_gap = by_normal * work.row[p]
            for q in range(m):
                block_n[p, q] -= by_gap * work.anchor[q]


@numba.njit(cache=True)
def _apply(means, factor, polynomial, slope, work, coefficients, block):  # type: ignore[no-untyped-def]
    """Add the integral of ``factor * polynomial`` over intervals to the force and that of ``slope * b b^T`` to the block."""
    product_matrix(means, work.matrix)
    m = polynomial.size
    for p in range(m):
        total = 0.0
        for q in range(m):
            total += work.matrix[p, q] * polynomial[q]
        coefficients[p] += factor * total
        if slope != 0.0:
            for q in range(m):
                block[p, q] += slope * work.matrix[p, q]


@numba.njit(cache=True)
def _integrate(x, k, limit_slope, count, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
    """Add the force coefficients and derivatives of one tangential spring from its segments."""
    segments = work.segments
    own, stick, slip = work.means[0], work.means[1], work.means[2]
    stick[:] = 0.0
    slip[:] = 0.0
    harmonics_at(0.0, work.harmonics[0])
    for i in range(count):
        at_start, at_end = work.harmonics[i % 2], work.harmonics[(i + 1) % 2]
        left = segments[i, START]
        right = PERIOD if i + 1 == count else segments[i + 1, START]
        # the end of the period is its beginning to the last bit
        harmonics_at(0.0 if i + 1 == count else right, at_end)
        if segments[i, STATE] == STICK:
            own[:] = 0.0
            add_means(left, at_start, right, at_end, 1.0, own)
            stick += own
            _add_stuck(segments[i], at_start, k, work, coefficients, block_x, block_n)
        elif segments[i, STATE] == SLIP:
            add_means(left, at_start, right, at_end, segments[i, SIGN], slip)
    if stick[0, 0] != 0.0:
        _apply(stick, k, x, k, work, coefficients, block_x)
    if np.any(slip != 0.0):
        _apply(slip, 1.0, work.limit, limit_slope, work, coefficients, block_n)


@numba.njit(cache=True)
def _normal_force(g, row, n_roots, starts_open, work, coefficients, block):  # type: ignore[no-untyped-def]
    """Add the normal force ``-N`` and its derivative from the intervals in which the contact is closed."""
    k_n = row[K_N]
    if n_roots == 0:
        if starts_open:
            return
        coefficients[0] -= 0.0 if row[UNILATERAL] == 0.0 else row[PRELOAD]
        for p in range(g.size):
            coefficients[p] += k_n * g[p]
            block[p, p] += k_n
        return
    closed = work.means[1]
    closed[:] = 0.0
    is_open, left = starts_open, 0.0
    harmonics_at(0.0, work.harmonics[0])
    for i in range(n_roots + 1):
        at_left, at_right = work.harmonics[i % 2], work.harmonics[(i + 1) % 2]
        right = PERIOD if i == n_roots else work.roots[0, i]
        harmonics_at(0.0 if i == n_roots else right, at_right)
        if not is_open:
            add_means(left, at_left, right, at_right, 1.0, closed)
        is_open, left = not is_open, right
    _apply(closed, -1.0, work.normal, k_n, work, coefficients, block)


@numba.njit(cache=True)
def _limit(g, row, work):  # type: ignore[no-untyped-def]
    """Fill pressure and friction limit; return the derivative of the limit by the normal gap."""
    mu, k_n = row[MU], row[K_N]
    slope = 0.0 if row[UNILATERAL] == 0.0 else -mu * k_n
    for p in range(g.size):
        work.normal[p] = -k_n * g[p]
        work.limit[p] = slope * g[p]
    work.normal[0] += row[PRELOAD]
    work.limit[0] += mu * row[PRELOAD]
    return slope


@numba.njit(cache=True)
def _sample_normal(gap, row, limit, force, state):  # type: ignore[no-untyped-def]
    """Add the normal force on samples; fill the limit there and the state that a direction without stiffness has."""
    for i in range(gap.size):
        normal, _, limit[i], _, is_open = normal_contact(gap[i], row)
        force[i] += normal
        state[0, i] = state[1, i] = OPEN if is_open else STICK


@numba.njit(cache=True)
def _sample_tangent(gap, k, limit, count, segments, force, state):  # type: ignore[no-untyped-def]
    """Add the tangential force on samples and fill the states."""
    n = gap.size
    step = PERIOD / max(n, 1)
    i = 0
    for s in range(count):
        end = PERIOD if s + 1 == count else segments[s + 1, START]
        now, sign, place = int(segments[s, STATE]), segments[s, SIGN], segments[s, PLACE]
        while i < n and (step * i < end or s + 1 == count):
            state[i] = now
            if now == STICK:
                force[i] += k * gap[i] - place
            elif now == SLIP:
                force[i] += sign * limit[i]
            i += 1


@numba.njit(cache=True)
def _element(polynomials, row, gap, grid, n_x, work, coefficients, blocks, force, state):  # type: ignore[no-untyped-def]
    """Add coefficients, derivatives and samples of one elementary contact; its states are written to `state`."""
    limit_slope = _limit(polynomials[2], row, work)
    n_roots, starts_open = 0, False
    if row[UNILATERAL] != 0.0:
        n_roots, starts_open = zeros(work.normal, grid, work, work.roots[0])
    _normal_force(polynomials[2], row, n_roots, starts_open, work, coefficients[2], blocks[NN])
    _sample_normal(gap[2], row, work.pressure, force[2], state)
    for d in range(2):
        k, x = row[d], polynomials[d]
        if k == 0.0:
            continue
        count = find_segments(x, d, row, limit_slope, n_roots, starts_open, n_x, grid, work)
        _integrate(x, k, limit_slope, count, work, coefficients[d], blocks[TT + d], blocks[TN + d])
        _sample_tangent(gap[d], k, work.pressure, count, work.segments, force[d], state[d])


@numba.njit(cache=True)
def _contact(  # type: ignore[no-untyped-def]
    polynomials, elements, gap, grid, work, n_x, other, coefficients, blocks, force, state
):  # fmt: skip
    """Evaluate one contact, the sum of `elements`; it slips where their states differ."""
    coefficients[:] = 0.0
    blocks[:] = 0.0
    force[:] = 0.0
    n_x[:] = -1
    for e in range(elements.shape[0]):
        own = state if e == 0 else other
        _element(polynomials, elements[e], gap, grid, n_x, work, coefficients, blocks, force, own)
        if e > 0:
            for d in range(2):
                for i in range(gap.shape[1]):
                    if state[d, i] != other[d, i]:
                        state[d, i] = SLIP


@numba.njit(cache=True)
def _contacts(  # type: ignore[no-untyped-def]
    start, end, polynomials, elements, first, grid, gap, coefficients, blocks, force, state
):  # fmt: skip
    """Evaluate the contacts from `start` to before `end`."""
    samples = gap.shape[2]
    work = scratch(polynomials.shape[2], grid.shape[1], samples)
    n_x = np.empty(2, np.int64)
    other = np.empty((2, samples), np.int64)
    for c in range(start, end):
        _contact(
            polynomials[c], elements[first[c] : first[c + 1]], gap[c], grid, work, n_x, other,
            coefficients[c], blocks[c], force[c], state[c],
        )  # fmt: skip


@numba.njit(cache=True)
def contact_events(polynomials, elements, first, grid, gap, coefficients, blocks, force, state):  # type: ignore[no-untyped-def]
    """Evaluate all contacts over one period, exactly.

    Parameters
    ----------
    polynomials
        (n_contacts, 3, m) real Fourier coefficients of the gaps t, w, n in m, m = 2 order + 1.
    elements
        (n_elements, 7) rows of elementary contacts, see `contact.element`.
    first
        (n_contacts + 1,) contact c is the sum of the elements first[c] to first[c + 1].
    grid
        From `search_grid`.
    gap
        (n_contacts, 3, samples) the gaps on samples, for `force` and `state`; there may be none.
    coefficients
        Out: (n_contacts, 3, m) Fourier coefficients of the forces (T_t, T_w, -N) in N.
    blocks
        Out: (n_contacts, P, m, m) their derivatives by the coefficients of the gaps, of which the first five differ from zero: t by t,
        w by w, n by n, t by n, w by n.
    force
        Out: (n_contacts, 3, samples) forces on samples.
    state
        Out: (n_contacts, 2, samples) 0 stick, 1 slip, 2 open, for t and w; a contact of several elements slips where they differ.
    """
    _contacts(
        0, gap.shape[0], polynomials, elements, first, grid, gap, coefficients, blocks, force, state
    )


@numba.njit(cache=True, parallel=True)
def contact_events_threads(  # type: ignore[no-untyped-def]
    shares, polynomials, elements, first, grid, gap, coefficients, blocks, force, state
):  # fmt: skip
    """Do the same as `contact_events` in `shares` that threads take in turn."""
    n = gap.shape[0]
    for share in numba.prange(shares):
        _contacts(
            share * n // shares, (share + 1) * n // shares,
            polynomials, elements, first, grid, gap, coefficients, blocks, force, state,
        )  # fmt: skip


@lru_cache(maxsize=32)
def _grid(order: int) -> FloatArray:
    return search_grid(order)


def exact_period(
    gap_coefficients: FloatArray,
    elements: FloatArray,
    first: IntArray,
    gap: FloatArray,
    pairs: int = 5,
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Evaluate contacts whose gaps have the given Fourier coefficients, without sampling error (Petrov & Ewins 2003).

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n_contacts) real coefficients of the gaps (t, w, n of each contact), m.
    elements, first
        (n_elements, 7) rows and (n_contacts + 1,) offsets, see `contact_events`.
    gap
        (n_contacts, 3, samples) the gaps on samples where forces and states are wanted; there may be none.
    pairs
        Derivative blocks a contact, at least five.

    Returns
    -------
    tuple
        (2H+1, 3 n_contacts) coefficients of the forces, N; (n_contacts, pairs, 2H+1, 2H+1) derivatives, N/m;
        (n_contacts, 3, samples) forces, N; (n_contacts, 2, samples) states. All NaN, and open, where a gap is not finite or beyond 1e152 m.
    """
    m, width = gap_coefficients.shape
    n = width // 3
    polynomials = np.ascontiguousarray(gap_coefficients.T).reshape(n, 3, m)
    coefficients = np.empty_like(polynomials)
    blocks = np.empty((n, pairs, m, m))
    force = np.empty_like(gap)
    state = np.empty((n, 2, gap.shape[2]), dtype=np.int64)
    if not np.all(np.abs(polynomials) < LARGEST):
        # a lost iterate: what is not a number, or overflows in a product, has no sign changes to look for
        for out in (coefficients, blocks, force):
            out[:] = np.nan
        state[:] = OPEN
        return coefficients.reshape(width, m).T, blocks, force, state
    arrays = (polynomials, elements, first, _grid((m - 1) // 2), gap, coefficients, blocks, force, state)  # fmt: skip
    shares = thread_shares(n)
    if shares > 1:
        contact_events_threads(shares, *arrays)
    else:
        contact_events(*arrays)
    return coefficients.reshape(width, m).T, blocks, force, state
