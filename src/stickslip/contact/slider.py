"""The steady cycle of a Jenkins slider whose limits are trigonometric polynomials.

In units of force the slider is at ``z = k x - T``, and friction keeps it between the walls ``k x - μN`` and
``k x + μN``. It rests while the contact sticks; the lower wall pushes it while the contact slips forward, the upper one
while it slips backward. Slip therefore ends at a maximum of the lower or a minimum of the upper wall, and begins where
a wall reaches the resting slider. The nodes are the extrema of both walls and the sign changes of N. Between nodes the
walls are monotone, so that clipping z at the nodes is exact, and each cell between two nodes contains at most one onset
of slip. Two periods are enough, as in `contact.intervals`, because the map of z over a period is a clip.
"""

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.element import K_N, MU, RESIDUAL
from stickslip.contact.law import OPEN, SLIP, STICK
from stickslip.contact.trigonometric import (
    DEEPEST,
    bounds,
    derivative,
    most_sign_changes,
    root_between,
    sign_changes,
    value_and_slope,
)

START, STATE, SIGN, PLACE, ANCHOR, BY_NORMAL = range(6)  # columns of segments
NO_ANCHOR = -1.0
PERIOD = 2.0 * np.pi
_EXTREMUM, _OPENING, _CLOSING = 0, 1, 2  # kinds of nodes


class Scratch(NamedTuple):
    """Work arrays of the evaluation of a contact, of length m = 2H+1 unless stated otherwise."""

    normal: FloatArray  # pressure as long as it is positive
    limit: FloatArray  # friction limit
    low: FloatArray  # walls of the slider
    high: FloatArray
    slope: FloatArray
    curvature: FloatArray
    values: FloatArray  # (cells + 1,) on the search grid
    slopes: FloatArray
    cells: FloatArray  # (DEEPEST, 3)
    roots: (
        FloatArray  # (5, most_sign_changes): of N, extrema of the low wall, of the high wall, of both tangential gaps
    )
    nodes: FloatArray  # (3, most nodes) time, low and high wall
    kinds: IntArray
    segments: FloatArray  # (most segments, 6)
    harmonics: FloatArray  # (3, 2, 2m-1) cos(mτ), sin(mτ) at both ends of a segment and at its anchor
    means: FloatArray  # (3, 2, 2m-1) over a segment, over all stick, over all slip
    row: FloatArray
    anchor: FloatArray
    matrix: FloatArray  # (m, m)
    pressure: FloatArray  # (samples,)


@njit(cache=True)
def scratch(m, width, samples):  # type: ignore[no-untyped-def]
    """Allocate a `Scratch` for polynomials of `m` coefficients, a search grid of `width` columns and `samples`."""
    most = most_sign_changes((m - 1) // 2)
    most_nodes = 3 * most + 2
    return Scratch(
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(width),
        np.empty(width),
        np.empty((DEEPEST, 3)),
        np.empty((5, most)),
        np.empty((3, most_nodes)),
        np.empty(most_nodes, np.int64),
        np.empty((2 * most_nodes, 6)),
        np.empty((3, 2, 2 * m - 1)),
        np.empty((3, 2, 2 * m - 1)),
        np.empty(m),
        np.empty(m),
        np.empty((m, m)),
        np.empty(samples),
    )


@njit(cache=True)
def zeros(polynomial, grid, work, roots):  # type: ignore[no-untyped-def]
    """Write the sign changes into `roots`; return their number and whether the polynomial begins negative."""
    derivative(polynomial, work.slope)
    count = sign_changes(polynomial, work.slope, grid, work.values, work.slopes, work.cells, roots)
    return count, work.values[0] < 0.0


@njit(cache=True)
def extrema(polynomial, grid, work, roots):  # type: ignore[no-untyped-def]
    """Write the extrema into `roots`; return their number."""
    derivative(polynomial, work.slope)
    derivative(work.slope, work.curvature)
    return sign_changes(work.slope, work.curvature, grid, work.values, work.slopes, work.cells, roots)


@njit(cache=True)
def _merge(first, n_first, low, n_low, high, n_high, starts_open, tau, kinds):  # type: ignore[no-untyped-def]
    """Sort sign changes of N and extrema of both walls, all ascending, into nodes from 0 to 2π; return their number."""
    i = j = k = 0
    tau[0] = 0.0
    kinds[0] = _EXTREMUM
    closing = starts_open
    count = 1
    while i < n_first or j < n_low or k < n_high:
        a = first[i] if i < n_first else np.inf
        b = low[j] if j < n_low else np.inf
        c = high[k] if k < n_high else np.inf
        tau[count] = min(a, b, c)
        kinds[count] = _EXTREMUM
        if a <= b and a <= c:
            kinds[count] = _CLOSING if closing else _OPENING
            closing = not closing
            i += 1
        elif b <= c:
            j += 1
        else:
            k += 1
        count += 1
    tau[count] = PERIOD
    kinds[count] = _EXTREMUM
    return count + 1


@njit(cache=True)
def _evaluate_walls(low, high, nodes, kinds, count):  # type: ignore[no-untyped-def]
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


@njit(cache=True)
def _clipped(z, i, nodes, anchor, by_normal, slip_by_normal):  # type: ignore[no-untyped-def]
    """Return position, anchor and derivative by the normal gap (at the anchor) of the slider at node `i`."""
    if nodes[1, i] > z:
        return nodes[1, i], nodes[0, i], slip_by_normal
    if nodes[2, i] < z:
        return nodes[2, i], nodes[0, i], -slip_by_normal
    return z, anchor, by_normal


@njit(cache=True)
def _closing_by_normal(x, normal, k, row, tau):  # type: ignore[no-untyped-def]
    """Return the derivative of ``k x`` at the time of closing by the normal gap at that time.

    The time of closing moves with the gap. A contact that sticks after closing has |k x'| <= μN', which bounds the
    derivative.
    """
    rate = k * value_and_slope(x, tau)[1]
    closing_rate = value_and_slope(normal, tau)[1]
    if abs(rate) >= row[MU] * closing_rate:
        return np.copysign(row[MU] * row[K_N], rate)
    return rate * row[K_N] / closing_rate


@njit(cache=True)
def _settle(z, anchor, by_normal, nodes, kinds, count, starts_open, slip_by_normal):  # type: ignore[no-untyped-def]
    """Return the slider after one period: position, anchor, and derivative by the normal gap at the anchor.

    The derivative is NaN if the contact closed at the anchor.
    """
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


@njit(cache=True)
def _append(segments, count, start, state, sign, z, anchor, by_normal):  # type: ignore[no-untyped-def]
    """Append a segment unless its state equals the last one; a last segment of zero length is replaced."""
    if count > 0:
        last = count - 1
        if segments[last, STATE] == state and segments[last, SIGN] == sign:
            return count
        if segments[last, START] >= start:
            count = last
    segments[count, START] = start
    segments[count, STATE] = state
    segments[count, SIGN] = sign
    segments[count, PLACE] = z
    segments[count, ANCHOR] = anchor
    segments[count, BY_NORMAL] = by_normal
    return count + 1


@njit(cache=True)
def _slip_start(wall, z, left, f_left, right, f_right):  # type: ignore[no-untyped-def]
    """Return the time at which the wall, monotone from `left` to `right`, reaches the resting slider."""
    size, second, _ = bounds(wall)
    # between two extrema a wall resembles half a cosine wave
    share = np.arccos(1.0 - 2.0 * (z - f_left) / (f_right - f_left)) / np.pi
    guess = left + share * (right - left)
    return root_between(wall, z, left, f_left - z, right, f_right - z, guess, size + abs(z), second)


@njit(cache=True)
def _cell(i, z, anchor, by_normal, slip_by_normal, work, count):  # type: ignore[no-untyped-def]
    """Append the segments of the closed cell after node `i`.

    Return their number and the slider at the end of the cell.
    """
    nodes, segments = work.nodes, work.segments
    left, right = nodes[0, i], nodes[0, i + 1]
    moved, new_anchor, new_by_normal = _clipped(z, i + 1, nodes, anchor, by_normal, slip_by_normal)
    if moved == z:
        count = _append(segments, count, left, STICK, 0.0, z, anchor, by_normal)
        return count, z, anchor, by_normal
    sign = 1.0 if moved > z else -1.0
    wall = work.low if moved > z else work.high
    at_left = nodes[1, i] if moved > z else nodes[2, i]
    start = left
    if sign * at_left < sign * z:
        start = _slip_start(wall, z, left, at_left, right, moved)
        count = _append(segments, count, left, STICK, 0.0, z, anchor, by_normal)
    count = _append(segments, count, start, SLIP, sign, moved, start, 0.0)
    return count, moved, new_anchor, new_by_normal


@njit(cache=True)
def _march(x, k, row, z, anchor, by_normal, slip_by_normal, starts_open, n_nodes, work):  # type: ignore[no-untyped-def]
    """Fill ``work.segments`` with the states of the second period; return their number."""
    nodes, kinds = work.nodes, work.kinds
    z, anchor, by_normal = _settle(z, anchor, by_normal, nodes, kinds, n_nodes, starts_open, slip_by_normal)
    if np.isnan(by_normal):
        by_normal = _closing_by_normal(x, work.normal, k, row, anchor)
    is_open = starts_open
    count = 0
    for i in range(n_nodes - 1):
        tau = nodes[0, i]
        if kinds[i] == _OPENING:
            is_open = True
        elif kinds[i] == _CLOSING:
            is_open = False
            z, anchor = nodes[1, i], tau
            by_normal = _closing_by_normal(x, work.normal, k, row, tau)
        if is_open:
            count = _append(work.segments, count, tau, OPEN, 0.0, 0.0, tau, 0.0)
        else:
            count, z, anchor, by_normal = _cell(i, z, anchor, by_normal, slip_by_normal, work, count)
    return count


@njit(cache=True)
def _start(row, slip_by_normal, starts_open, low, high):  # type: ignore[no-untyped-def]
    """Return the slider just before t = 0: position, anchor, and derivative by the normal gap at the anchor."""
    share = row[RESIDUAL]
    if np.isnan(share):
        return 0.0, NO_ANCHOR, 0.0
    z = low[0] + high[0]
    difference = low[0] - high[0]
    for p in range(1, low.size, 2):
        z += low[p] + high[p]
        difference += low[p] - high[p]
    if starts_open:
        return 0.5 * z, 0.0, 0.0
    return 0.5 * (z + share * difference), 0.0, share * slip_by_normal


@njit(cache=True)
def find_segments(x, d, row, limit_slope, n_roots, starts_open, n_x, grid, work):  # type: ignore[no-untyped-def]
    """Find the states of the spring along one tangent over the steady cycle.

    Parameters
    ----------
    x
        (m,) tangential gap, m.
    d
        Tangent, 0 or 1.
    row
        (7,) row of the element, see `contact.element`; its stiffness is not zero.
    limit_slope
        Derivative of the limit by the normal gap while it is closed, N/m.
    n_roots, starts_open
        Number of zeros of the pressure, in ``work.roots[0]``, and whether the contact starts open.
    n_x
        In and out: number of extrema of both tangential gaps, in ``work.roots[3:]``; -1: not yet known.
    grid, work
        Search grid; scratch with pressure and limit.

    Returns
    -------
    int
        Number of rows of ``work.segments``: start, state, sign of the slip, position of the resting slider, anchor
        (time at which the slider came to rest there, or `NO_ANCHOR`), derivative of the position by the normal gap at
        the anchor.
    """
    k = row[d]
    for p in range(x.size):
        work.low[p] = k * x[p] - work.limit[p]
        work.high[p] = k * x[p] + work.limit[p]
    z, anchor, by_normal = _start(row, -limit_slope, starts_open, work.low, work.high)
    if n_roots == 0:
        if starts_open:
            return _append(work.segments, 0, 0.0, OPEN, 0.0, 0.0, 0.0, 0.0)
        reach = z - work.low[0] + abs(work.low[0]) - bounds(work.low)[0]
        room = work.high[0] - z + abs(work.high[0]) - bounds(work.high)[0]
        if min(reach, room) >= 0.0:  # no wall reaches the slider
            return _append(work.segments, 0, 0.0, STICK, 0.0, z, anchor, by_normal)
    if limit_slope == 0.0:
        # both walls follow x, as for all such elements of a contact: its extrema are computed once
        if n_x[d] < 0:
            n_x[d] = extrema(x, grid, work, work.roots[3 + d])
        n_low, n_high = n_x[d], 0
        low_roots = high_roots = work.roots[3 + d]
    else:
        low_roots, high_roots = work.roots[1], work.roots[2]
        n_low = extrema(work.low, grid, work, low_roots)
        n_high = extrema(work.high, grid, work, high_roots)
    count = _merge(work.roots[0], n_roots, low_roots, n_low, high_roots, n_high, starts_open, work.nodes[0], work.kinds)
    _evaluate_walls(work.low, work.high, work.nodes, work.kinds, count)
    return _march(x, k, row, z, anchor, by_normal, -limit_slope, starts_open, count, work)
