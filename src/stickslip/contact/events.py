"""Forces and derivatives of piecewise-linear contacts over one period, by exact events (Petrov & Ewins 2003).

The spring of a tangential element is held by a slider. In units of force its place is ``z = k x - T``, and friction keeps it between
two walls that are trigonometric polynomials, ``k x - μN <= z <= k x + μN``: it rests while it sticks, and is pushed by the lower wall
while it slips forward and by the upper one while it slips backward. Slip therefore ends at a maximum of the lower or a minimum of the
upper wall, and begins where a wall passes the resting slider. Between all extrema of both walls and all changes of the sign of N the
walls are monotone, so that clipping z at these nodes is exact and each cell holds at most one beginning of slip. What is left are
integrals of products of cosines and sines over the segments of a period: no sampling error.

The force is continuous, so the motion of the events adds nothing to its derivative but through the slider: its place at the end of
slip is stationary in time, but a contact that closes into stick holds x at the time of closing, which moves with the normal gap.

Two periods are exact, as in `contact.intervals`: the map of z over a period is a clip.
"""

from functools import lru_cache
from typing import NamedTuple

import numba
import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.element import K_N, MU, PRELOAD, RESIDUAL, UNILATERAL
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT
from stickslip.contact.trigonometric import (
    DEEPEST,
    add_means,
    bounds,
    derivative,
    harmonics_at,
    product_matrix,
    root_between,
    search_grid,
    sign_changes,
    value_and_slope,
)


_EXTREMUM, _OPENING, _CLOSING = 0, 1, 2  # kinds of nodes
_START, _STATE, _SIGN, _PLACE, _ANCHOR, _BY_NORMAL = range(6)  # columns of segments
_NO_ANCHOR = -1.0
_PERIOD = 2.0 * np.pi


class _Scratch(NamedTuple):
    """Arrays of one contact's evaluation, m = 2H+1 long unless said otherwise."""

    normal: FloatArray  # pressure if closed
    limit: FloatArray  # of friction
    low: FloatArray  # walls of the slider
    high: FloatArray
    slope: FloatArray
    curvature: FloatArray
    values: FloatArray  # (cells + 1,) on the search grid
    slopes: FloatArray
    cells: FloatArray  # (DEEPEST, 3)
    roots: FloatArray  # (3, most_sign_changes): of N, extrema of the low and of the high wall
    x_roots: FloatArray  # (2, most_sign_changes) extrema of both tangential gaps
    nodes: FloatArray  # (3, most nodes) time, low and high wall
    kinds: IntArray
    segments: FloatArray  # (most segments, 6)
    harmonics: (
        FloatArray  # (3, 2, 2m-1) cos(mτ), sin(mτ) at both ends of a segment and at its anchor
    )
    means: FloatArray  # (3, 2, 2m-1) over a segment, over all stick, over all slip
    row: FloatArray
    anchor: FloatArray
    matrix: FloatArray  # (m, m)
    pressure: FloatArray  # (samples,)


@numba.njit(cache=True)
def _scratch(m, width, samples):  # type: ignore[no-untyped-def]
    most = 4 * (m - 1) + 16  # most_sign_changes(order)
    return _Scratch(
        np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m),
        np.empty(width), np.empty(width), np.empty((DEEPEST, 3)), np.empty((3, most)), np.empty((2, most)),
        np.empty((3, 3 * most + 2)), np.empty(3 * most + 2, np.int64), np.empty((6 * most + 6, 6)),
        np.empty((3, 2, 2 * m - 1)), np.empty((3, 2, 2 * m - 1)), np.empty(m), np.empty(m), np.empty((m, m)),
        np.empty(samples),
    )  # fmt: skip


@numba.njit(cache=True)
def _zeros(polynomial, grid, work, roots):  # type: ignore[no-untyped-def]
    """Return the number of sign changes, put into `roots`, and whether the polynomial begins negative."""
    derivative(polynomial, work.slope)
    count = sign_changes(polynomial, work.slope, grid, work.values, work.slopes, work.cells, roots)
    return count, work.values[0] < 0.0


@numba.njit(cache=True)
def _extrema(polynomial, grid, work, roots):  # type: ignore[no-untyped-def]
    """Return the number of extrema, put into `roots`."""
    derivative(polynomial, work.slope)
    derivative(work.slope, work.curvature)
    return sign_changes(
        work.slope, work.curvature, grid, work.values, work.slopes, work.cells, roots
    )


@numba.njit(cache=True)
def _merge(first, n_first, low, n_low, high, n_high, starts_open, tau, kinds):  # type: ignore[no-untyped-def]
    """Sort three ascending lists (changes of the sign of N, extrema of both walls) into nodes from 0 to 2π; return their number."""
    i = j = k = 0
    tau[0] = 0.0
    kinds[0] = _EXTREMUM
    closing = starts_open
    count = 1
    while i < n_first or j < n_low or k < n_high:
        a = first[i] if i < n_first else np.inf
        b = low[j] if j < n_low else np.inf
        c = high[k] if k < n_high else np.inf
        if a <= b and a <= c:
            tau[count] = a
            kinds[count] = _CLOSING if closing else _OPENING
            closing = not closing
            i += 1
        else:
            tau[count] = min(b, c)
            kinds[count] = _EXTREMUM
            if b <= c:
                j += 1
            else:
                k += 1
        count += 1
    tau[count] = _PERIOD
    kinds[count] = _EXTREMUM
    return count + 1


@numba.njit(cache=True)
def _walls(low, high, nodes, kinds, count):  # type: ignore[no-untyped-def]
    """Evaluate both walls at the nodes; they meet where the contact opens or closes."""
    for i in range(count - 1):
        c1, s1 = np.cos(nodes[0, i]), np.sin(nodes[0, i])
        c, s = 1.0, 0.0
        f, g = low[0], high[0]
        for h in range(1, (low.size + 1) // 2):
            c, s = c * c1 - s * s1, s * c1 + c * s1
            f += low[2 * h - 1] * c + low[2 * h] * s
            g += high[2 * h - 1] * c + high[2 * h] * s
        if kinds[i] != _EXTREMUM:
            f = g = 0.5 * (f + g)
        nodes[1, i], nodes[2, i] = f, g
    nodes[1, count - 1], nodes[2, count - 1] = nodes[1, 0], nodes[2, 0]


@numba.njit(cache=True)
def _clipped(z, i, nodes, anchor, by_normal, slip_by_normal):  # type: ignore[no-untyped-def]
    """Return the slider's place at node `i` of a closed contact, its anchor, and its derivative by the normal gap there."""
    if nodes[1, i] > z:
        return nodes[1, i], nodes[0, i], slip_by_normal
    if nodes[2, i] < z:
        return nodes[2, i], nodes[0, i], -slip_by_normal
    return z, anchor, by_normal


@numba.njit(cache=True)
def _closing_by_normal(x, normal, k, k_n, mu, tau):  # type: ignore[no-untyped-def]
    """Derivative of ``k x`` at the time of closing by the normal gap there: that time moves with the gap.

    A contact that sticks from then on has |k x'| <= μN', which bounds it.
    """
    rate = k * value_and_slope(x, tau)[1]
    closing_rate = value_and_slope(normal, tau)[1]
    if abs(rate) >= mu * closing_rate:
        return np.copysign(mu * k_n, rate)
    return rate * k_n / closing_rate


@numba.njit(cache=True)
def _settle(z, anchor, by_normal, nodes, kinds, count, starts_open, slip_by_normal):  # type: ignore[no-untyped-def]
    """Return the slider after one period: place, anchor, its derivative there (NaN: closed there)."""
    is_open = starts_open
    for i in range(count):
        if kinds[i] == _CLOSING:
            is_open = False
            z, anchor, by_normal = nodes[1, i], nodes[0, i], np.nan
        elif kinds[i] == _OPENING:
            is_open = True
        elif not is_open:
            z, anchor, by_normal = _clipped(z, i, nodes, anchor, by_normal, slip_by_normal)
    return z, anchor, by_normal


@numba.njit(cache=True)
def _append(segments, count, start, state, sign, z, anchor, by_normal):  # type: ignore[no-untyped-def]
    """Append a segment unless it goes on in the state of the last; one without length is replaced."""
    if count > 0:
        last = count - 1
        if segments[last, _STATE] == state and segments[last, _SIGN] == sign:
            return count
        if segments[last, _START] >= start:
            count = last
    segments[count, _START] = start
    segments[count, _STATE] = state
    segments[count, _SIGN] = sign
    segments[count, _PLACE] = z
    segments[count, _ANCHOR] = anchor
    segments[count, _BY_NORMAL] = by_normal
    return count + 1


@numba.njit(cache=True)
def _slip_start(wall, z, left, f_left, right, f_right):  # type: ignore[no-untyped-def]
    """Return when the wall, monotone from `left` to `right`, passes the resting slider."""
    size, second, _ = bounds(wall)
    # between two extrema a wall looks like half a wave
    share = np.arccos(1.0 - 2.0 * (z - f_left) / (f_right - f_left)) / np.pi
    guess = left + share * (right - left)
    return root_between(wall, z, left, f_left - z, right, f_right - z, guess, size + abs(z), second)


@numba.njit(cache=True)
def _cell(i, z, anchor, by_normal, slip_by_normal, work, segments, count):  # type: ignore[no-untyped-def]
    """Append the segments of the closed cell after node `i`; return their number and the slider at its end."""
    nodes = work.nodes
    left, right = nodes[0, i], nodes[0, i + 1]
    moved, new_anchor, new_by_normal = _clipped(z, i + 1, nodes, anchor, by_normal, slip_by_normal)
    if moved == z:
        return (
            _append(segments, count, left, STICK, 0.0, z, anchor, by_normal),
            z,
            anchor,
            by_normal,
        )
    forward = moved > z
    wall = work.low if forward else work.high
    at_left = nodes[1, i] if forward else nodes[2, i]
    start = left
    if (at_left < z) == forward and at_left != z:
        start = _slip_start(wall, z, left, at_left, right, moved)
        count = _append(segments, count, left, STICK, 0.0, z, anchor, by_normal)
    sign = 1.0 if forward else -1.0
    count = _append(segments, count, start, SLIP, sign, moved, start, 0.0)
    return count, moved, new_anchor, new_by_normal


@numba.njit(cache=True)
def _find_segments(x, k, row, slip_by_normal, starts_open, n_nodes, work):  # type: ignore[no-untyped-def]
    """Fill ``work.segments`` with the states of the steady cycle; return their number."""
    nodes, kinds = work.nodes, work.kinds
    z, anchor, by_normal = 0.0, _NO_ANCHOR, 0.0
    start = row[RESIDUAL]
    if not np.isnan(start):
        anchor = 0.0
        if not starts_open:
            z = 0.5 * ((1.0 + start) * nodes[1, 0] + (1.0 - start) * nodes[2, 0])
            by_normal = start * slip_by_normal
    z, anchor, by_normal = _settle(
        z, anchor, by_normal, nodes, kinds, n_nodes, starts_open, slip_by_normal
    )
    if np.isnan(by_normal):
        by_normal = _closing_by_normal(x, work.normal, k, row[K_N], row[MU], anchor)
    is_open = starts_open
    count = 0
    for i in range(n_nodes - 1):
        tau = nodes[0, i]
        if kinds[i] == _OPENING:
            is_open = True
        elif kinds[i] == _CLOSING:
            is_open = False
            z, anchor = nodes[1, i], tau
            by_normal = _closing_by_normal(x, work.normal, k, row[K_N], row[MU], tau)
        if is_open:
            count = _append(work.segments, count, tau, OPEN, 0.0, 0.0, tau, 0.0)
        else:
            count, z, anchor, by_normal = _cell(
                i, z, anchor, by_normal, slip_by_normal, work, work.segments, count
            )
    return count


@numba.njit(cache=True)
def _basis_row(cos, sin, factor, weight, out):  # type: ignore[no-untyped-def]
    """Fill `out` with ``factor`` times cos and sin in the order of coefficients, `weight` times from the first harmonic on."""
    out[0] = factor * cos[0]
    for h in range(1, (out.size + 1) // 2):
        out[2 * h - 1] = weight * factor * cos[h]
        out[2 * h] = weight * factor * sin[h]


@numba.njit(cache=True)
def _add_stuck(segment, start, k, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
    """Add what the resting slider of one segment takes off the force ``k x``."""
    means = work.means[0]
    _basis_row(means[0], means[1], 1.0, 2.0, work.row)
    m = work.row.size
    for p in range(m):
        coefficients[p] -= segment[_PLACE] * work.row[p]
    if segment[_ANCHOR] == _NO_ANCHOR:
        return
    if segment[_ANCHOR] == segment[_START]:
        at = start
    else:
        at = work.harmonics[2]
        harmonics_at(segment[_ANCHOR], at[0], at[1])
    _basis_row(at[0], at[1], 1.0, 1.0, work.anchor)
    by_normal = segment[_BY_NORMAL]
    for p in range(m):
        f = work.row[p]
        for q in range(m):
            block_x[p, q] -= f * k * work.anchor[q]
        if by_normal != 0.0:
            for q in range(m):
                block_n[p, q] -= f * by_normal * work.anchor[q]


@numba.njit(cache=True)
def _apply(means, factor, polynomial, slope, work, coefficients, block):  # type: ignore[no-untyped-def]
    """Add the integral of ``factor * polynomial`` over intervals to the force and that of ``slope * b b^T`` to the block."""
    product_matrix(means[0], means[1], work.matrix)
    m = polynomial.size
    for p in range(m):
        total = 0.0
        for q in range(m):
            total += work.matrix[p, q] * polynomial[q]
            block[p, q] += slope * work.matrix[p, q]
        coefficients[p] += factor * total


@numba.njit(cache=True)
def _integrate(x, k, limit_slope, count, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
    """Add the force coefficients and derivatives of one tangential spring from its segments."""
    segments = work.segments
    own, stick, slip = work.means[0], work.means[1], work.means[2]
    stick[:] = 0.0
    slip[:] = 0.0
    any_stick = any_slip = False
    for i in range(count):
        start, end = work.harmonics[i % 2], work.harmonics[(i + 1) % 2]
        left = segments[i, _START]
        right = segments[i + 1, _START] if i + 1 < count else _PERIOD
        if i == 0:
            harmonics_at(0.0, start[0], start[1])
        harmonics_at(right if i + 1 < count else 0.0, end[0], end[1])
        if segments[i, _STATE] == STICK:
            any_stick = True
            own[:] = 0.0
            add_means(left, start[0], start[1], right, end[0], end[1], 1.0, own[0], own[1])
            stick += own
            _add_stuck(segments[i], start, k, work, coefficients, block_x, block_n)
        elif segments[i, _STATE] == SLIP:
            any_slip = True
            add_means(
                left,
                start[0],
                start[1],
                right,
                end[0],
                end[1],
                segments[i, _SIGN],
                slip[0],
                slip[1],
            )
    if any_stick:
        _apply(stick, k, x, k, work, coefficients, block_x)
    if any_slip:
        _apply(slip, 1.0, work.limit, limit_slope, work, coefficients, block_n)


@numba.njit(cache=True)
def _sample_tangent(gap, k, normal, mu, count, segments, force, state):  # type: ignore[no-untyped-def]
    """Add the tangential force on samples and fill the states; `normal` is the force that sets the limit."""
    n = gap.size
    i = 0
    for s in range(count):
        end = segments[s + 1, _START] if s + 1 < count else _PERIOD
        while i < n and _PERIOD * i / n < end:
            state[i] = int(segments[s, _STATE])
            if state[i] == STICK:
                force[i] += k * gap[i] - segments[s, _PLACE]
            elif state[i] == SLIP:
                force[i] += segments[s, _SIGN] * mu * normal[i]
            i += 1


@numba.njit(cache=True)
def _normal_force(g, row, n_roots, starts_open, work, coefficients, block):  # type: ignore[no-untyped-def]
    """Add the normal force ``-N`` and its derivative from the intervals in which the contact is closed."""
    k_n = row[K_N]
    m = g.size
    if row[UNILATERAL] == 0.0 or (n_roots == 0 and not starts_open):
        bias = row[PRELOAD] if row[UNILATERAL] != 0.0 else 0.0
        coefficients[0] -= bias
        for p in range(m):
            coefficients[p] += k_n * g[p]
            block[p, p] += k_n
        return
    if n_roots == 0:
        return
    closed = work.means[1]
    closed[:] = 0.0
    is_open, left = starts_open, 0.0
    start, end = work.harmonics[0], work.harmonics[1]
    harmonics_at(0.0, start[0], start[1])
    for i in range(n_roots + 1):
        right = work.roots[0, i] if i < n_roots else _PERIOD
        harmonics_at(right if i < n_roots else 0.0, end[0], end[1])
        if not is_open:
            add_means(left, start[0], start[1], right, end[0], end[1], 1.0, closed[0], closed[1])
        is_open, left = not is_open, right
        start, end = end, start
    _apply(closed, -1.0, work.normal, k_n, work, coefficients, block)


@numba.njit(cache=True)
def _limit(g, row, work):  # type: ignore[no-untyped-def]
    """Fill pressure and friction limit; return the derivative of the limit by the normal gap."""
    mu = row[MU]
    for p in range(g.size):
        work.normal[p] = -row[K_N] * g[p]
        work.limit[p] = 0.0
    work.normal[0] += row[PRELOAD]
    if row[UNILATERAL] == 0.0 or row[K_N] == 0.0:
        work.limit[0] = mu * row[PRELOAD]
        return 0.0
    for p in range(g.size):
        work.limit[p] = mu * work.normal[p]
    return -mu * row[K_N]


@numba.njit(cache=True)
def _tangent(x, d, row, limit_slope, n_roots, starts_open, n_x, grid, work):  # type: ignore[no-untyped-def]
    """Find the segments of the spring along tangent `d`; return their number. `n_x` remembers the extrema of its gap."""
    k = row[d]
    for p in range(x.size):
        work.low[p] = k * x[p] - work.limit[p]
        work.high[p] = k * x[p] + work.limit[p]
    if limit_slope == 0.0:
        # both walls follow x, as do those of all such elements of a contact
        if n_x[d] < 0:
            n_x[d] = _extrema(x, grid, work, work.x_roots[d])
        n_low, n_high = n_x[d], 0
        low_roots = high_roots = work.x_roots[d]
    else:
        low_roots, high_roots = work.roots[1], work.roots[2]
        n_low = _extrema(work.low, grid, work, low_roots)
        n_high = _extrema(work.high, grid, work, high_roots)
    count = _merge(
        work.roots[0], n_roots, low_roots, n_low, high_roots, n_high, starts_open, work.nodes[0], work.kinds
    )  # fmt: skip
    _walls(work.low, work.high, work.nodes, work.kinds, count)
    return _find_segments(x, k, row, -limit_slope, starts_open, count, work)


@numba.njit(cache=True)
def _element(polynomials, row, gap, grid, n_x, work, coefficients, blocks, force, state):  # type: ignore[no-untyped-def]
    """Add coefficients, derivatives and samples of one elementary contact; its states are written to `state`."""
    samples = gap.shape[1]
    limit_slope = _limit(polynomials[2], row, work)
    n_roots, starts_open = 0, False
    if row[UNILATERAL] != 0.0:
        n_roots, starts_open = _zeros(work.normal, grid, work, work.roots[0])
    _normal_force(polynomials[2], row, n_roots, starts_open, work, coefficients[2], blocks[NN])
    normal = work.pressure
    for i in range(samples):
        pressure = row[PRELOAD] - row[K_N] * gap[2, i]
        if row[UNILATERAL] == 0.0:
            force[2, i] += row[K_N] * gap[2, i]
            normal[i] = row[PRELOAD]
        else:
            normal[i] = max(pressure, 0.0)
            force[2, i] -= normal[i]
    for d in range(2):
        k = row[d]
        if k == 0.0:
            for i in range(samples):
                state[d, i] = (
                    OPEN
                    if row[UNILATERAL] != 0.0 and row[PRELOAD] - row[K_N] * gap[2, i] < 0.0
                    else STICK
                )
            continue
        count = _tangent(polynomials[d], d, row, limit_slope, n_roots, starts_open, n_x, grid, work)
        _integrate(
            polynomials[d],
            k,
            limit_slope,
            count,
            work,
            coefficients[d],
            blocks[TT + d],
            blocks[TN + d],
        )
        _sample_tangent(gap[d], k, normal, row[MU], count, work.segments, force[d], state[d])


@numba.njit(cache=True)
def contact_events(polynomials, elements, first, grid, gap, coefficients, blocks, force, state):  # type: ignore[no-untyped-def]
    """Evaluate all contacts over one period, exactly.

    Parameters
    ----------
    polynomials
        (n_contacts, 3, m) real Fourier coefficients of the gaps t, w, n in m, m = 2 order + 1.
    elements
        (n_elements, 7) rows k_t, k_w, k_n, mu, preload, residual traction or NaN, unilateral.
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
    n_contacts, _, m = polynomials.shape
    samples = gap.shape[2]
    work = _scratch(m, grid.shape[1], samples)
    n_x = np.empty(2, np.int64)
    other = np.empty((2, samples), np.int64)
    for c in range(n_contacts):
        coefficients[c] = 0.0
        blocks[c] = 0.0
        force[c] = 0.0
        n_x[:] = -1
        for e in range(first[c], first[c + 1]):
            own = state[c] if e == first[c] else other
            _element(
                polynomials[c], elements[e], gap[c], grid, n_x, work, coefficients[c], blocks[c], force[c], own
            )  # fmt: skip
            if e > first[c]:
                for d in range(2):
                    for i in range(samples):
                        if state[c, d, i] != other[d, i]:
                            state[c, d, i] = SLIP


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
    """Evaluate contacts whose gaps have the given Fourier coefficients, without sampling error.

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
        (n_contacts, 3, samples) forces, N; (n_contacts, 2, samples) states.
    """
    m, width = gap_coefficients.shape
    n = width // 3
    polynomials = np.ascontiguousarray(gap_coefficients.T).reshape(n, 3, m)
    coefficients = np.empty_like(polynomials)
    blocks = np.empty((n, pairs, m, m))
    force = np.empty_like(gap)
    state = np.empty((n, 2, gap.shape[2]), dtype=np.int64)
    contact_events(
        polynomials, elements, first, _grid((m - 1) // 2), gap, coefficients, blocks, force, state
    )
    return coefficients.reshape(width, m).T, blocks, force, state
