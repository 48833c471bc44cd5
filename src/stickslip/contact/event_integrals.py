"""Forces and derivatives of piecewise-linear contacts between known events, in closed form.

Once the events of a contact are known, only integrals of products of cosines and sines remain. They may include more
harmonics than the gaps have, which gives forces and derivatives in these harmonics without a further search.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.element import K_N, MU, PRELOAD, UNILATERAL
from stickslip.contact.law import NN, SLIP, STICK, TN, TT
from stickslip.contact.slider import ANCHOR, BY_NORMAL, NO_ANCHOR, PERIOD, PLACE, SIGN, START, STATE, scratch
from stickslip.contact.trigonometric import add_means, harmonics_at, product_matrix

UNKEPT = -1  # number of events if they exceed the arrays: round-off produced more than such gaps can have


@dataclass(frozen=True, eq=False)
class Events:
    """State changes of contacts over a period, sufficient to integrate forces and derivatives again.

    Attributes
    ----------
    polynomials
        (n_contacts, 3, m) real Fourier coefficients of the gaps, m.
    crossings, n_crossings, starts_open
        (n_elements, 2 order + 4) times at which elements open and close, number of these times, and whether an element
        begins open.
    segments, n_segments
        (n_elements, 2, 12 order + 12, 6) and (n_elements, 2): states of both tangential springs, from
        `slider.find_segments`.
    """

    polynomials: FloatArray
    crossings: FloatArray
    n_crossings: IntArray
    starts_open: BoolArray
    segments: FloatArray
    n_segments: IntArray

    @property
    def whole(self) -> bool:
        """Whether all events fit into the arrays."""
        return bool(np.all(self.n_crossings > UNKEPT) and np.all(self.n_segments > UNKEPT))

    @property
    def none(self) -> bool:
        """Whether no state changes, so that forces are linear in the gaps, in the same harmonics."""
        return bool(self.whole and np.all(self.n_crossings == 0) and np.max(self.n_segments, initial=0) <= 1)


def room_for_events(order: int, elements: int) -> Events:
    """Allocate arrays for the events of gaps with `order` harmonics; `polynomials` is not yet filled.

    A polynomial has at most 2 H sign changes and 2 H extrema. This gives 6 H + 1 cells between nodes, each with two
    segments.
    """
    return Events(
        np.zeros((0, 3, 2 * order + 1)),
        np.empty((elements, 2 * order + 4)),
        np.zeros(elements, dtype=np.int64),
        np.zeros(elements, dtype=np.bool_),
        np.empty((elements, 2, 12 * order + 12, 6)),
        np.zeros((elements, 2), dtype=np.int64),
    )


@njit(cache=True)
def _basis_row(at, weight, out):  # type: ignore[no-untyped-def]
    """Fill `out` with cos and sin in the order of coefficients, times `weight` from the first harmonic on."""
    out[0] = at[0, 0]
    for h in range(1, (out.size + 1) // 2):
        out[2 * h - 1] = weight * at[0, h]
        out[2 * h] = weight * at[1, h]


@njit(cache=True)
def _add_stuck(segment, at_start, k, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
    """Subtract the contribution of the resting slider in one segment from the force ``k x``."""
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


@njit(cache=True)
def _apply(means, factor, polynomial, slope, work, coefficients, block):  # type: ignore[no-untyped-def]
    """Add the integral of ``factor * polynomial`` to the force, and of ``slope * b b^T`` to the block."""
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


@njit(cache=True)
def integrate_spring(x, k, limit_slope, count, work, coefficients, block_x, block_n):  # type: ignore[no-untyped-def]
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
        # the end of the period equals its beginning exactly
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


@njit(cache=True)
def add_normal_force(g, row, n_roots, starts_open, work, coefficients, block):  # type: ignore[no-untyped-def]
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


@njit(cache=True)
def fill_limit(g, row, work):  # type: ignore[no-untyped-def]
    """Fill pressure and friction limit; return the derivative of the limit by the normal gap."""
    mu, k_n = row[MU], row[K_N]
    slope = 0.0 if row[UNILATERAL] == 0.0 else -mu * k_n
    for p in range(g.size):
        work.normal[p] = -k_n * g[p]
        work.limit[p] = slope * g[p]
    work.normal[0] += row[PRELOAD]
    work.limit[0] += mu * row[PRELOAD]
    return slope


@njit(cache=True)
def keep_rows(values, count, kept):  # type: ignore[no-untyped-def]
    """Copy the first `count` rows of `values` to `kept`; return their number, or `UNKEPT` if `kept` is too small."""
    if count > kept.shape[0]:
        return UNKEPT
    for i in range(count):
        kept[i] = values[i]
    return count


@njit(cache=True)
def _integrate_events(  # type: ignore[no-untyped-def]
    polynomials, elements, first, crossings, n_crossings, starts_open, segments, n_segments, coefficients, blocks
):
    """Fill coefficients and derivatives of all contacts from their events.

    The polynomials may have more coefficients than the events had.
    """
    work = scratch(polynomials.shape[2], 0, 0)
    for c in range(polynomials.shape[0]):
        coefficients[c] = 0.0
        blocks[c] = 0.0
        for e in range(first[c], first[c + 1]):
            row, normal = elements[e], polynomials[c, 2]
            limit_slope = fill_limit(normal, row, work)
            keep_rows(crossings[e], n_crossings[e], work.roots[0])
            add_normal_force(normal, row, n_crossings[e], starts_open[e], work, coefficients[c, 2], blocks[c, NN])
            for d in range(2):
                if row[d] == 0.0:
                    continue
                count = keep_rows(segments[e, d], n_segments[e, d], work.segments)
                integrate_spring(
                    polynomials[c, d],
                    row[d],
                    limit_slope,
                    count,
                    work,
                    coefficients[c, d],
                    blocks[c, TT + d],
                    blocks[c, TN + d],
                )


def integrated(
    events: Events, elements: FloatArray, first: IntArray, order: int, pairs: int = 5
) -> tuple[FloatArray, FloatArray]:
    """Integrate forces and derivatives up to `order` between known events, without a new search.

    Parameters
    ----------
    events
        All events of gaps with few harmonics.
    elements, first
        As for `exact_period`.
    order
        Highest harmonic, at least the highest one of the gaps.
    pairs
        Number of derivative blocks of a contact, at least five.

    Returns
    -------
    tuple
        (2 order + 1, 3 n_contacts) coefficients of the forces, N; (n_contacts, pairs, 2 order + 1, 2 order + 1)
        derivatives, N/m, also by harmonics that the gaps do not have.
    """
    n, _, few = events.polynomials.shape
    m = 2 * order + 1
    polynomials = np.zeros((n, 3, m))
    polynomials[:, :, :few] = events.polynomials
    coefficients = np.empty_like(polynomials)
    blocks = np.empty((n, pairs, m, m))
    _integrate_events(
        polynomials,
        elements,
        first,
        events.crossings,
        events.n_crossings,
        events.starts_open,
        events.segments,
        events.n_segments,
        coefficients,
        blocks,
    )
    return coefficients.reshape(3 * n, m).T, blocks
