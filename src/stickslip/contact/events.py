"""Forces and derivatives of piecewise-linear contacts over one period, by exact events (Petrov & Ewins 2003).

The gaps are trigonometric polynomials, and so are the pressure of a closed contact and, within a state, the friction
force. Opening and closing are sign changes of the pressure; transitions between stick and slip are located in
`contact.slider`. Between these events only integrals of products of cosines and sines remain, in closed form: there is
no sampling error.

The force is continuous in time, so the motion of the events contributes to its derivative only through the position of
the resting slider. The end of slip is stationary in time and contributes nothing. A contact that closes into stick
keeps the gap at the time of closing, which moves with the normal gap.
"""

from functools import lru_cache

import numpy as np
from numba import prange

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.element import UNILATERAL
from stickslip.contact.event_integrals import (
    UNKEPT,
    Events,
    add_normal_force,
    fill_limit,
    integrate_spring,
    keep_rows,
    room_for_events,
)
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT
from stickslip.contact.slider import PERIOD, PLACE, SIGN, START, STATE, find_segments, scratch, zeros
from stickslip.contact.steps.element import normal_contact
from stickslip.contact.threads import thread_shares
from stickslip.contact.trigonometric import search_grid

LARGEST = 1e152  # largest Fourier coefficient of a gap whose square is still finite


@njit(cache=True)
def sample_normal(gap, row, limit, force, state):  # type: ignore[no-untyped-def]
    """Add the normal force on samples.

    Fill the friction limit on samples and the state of directions without stiffness.
    """
    for i in range(gap.size):
        normal, _, limit[i], _, is_open = normal_contact(gap[i], row)
        force[i] += normal
        state[0, i] = state[1, i] = OPEN if is_open else STICK


@njit(cache=True)
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


@njit(cache=True)
def _element(  # type: ignore[no-untyped-def]
    polynomials, row, e, gap, grid, n_x, work, coefficients, blocks, force, state, kept
):
    """Add coefficients, derivatives and samples of elementary contact `e`.

    Write its states to `state`, and its events to `kept`.
    """
    crossings, n_crossings, begins_open, segments, n_segments = kept
    limit_slope = fill_limit(polynomials[2], row, work)
    n_roots, starts_open = 0, False
    if row[UNILATERAL] != 0.0:
        n_roots, starts_open = zeros(work.normal, grid, work, work.roots[0])
    keeps = e < n_crossings.size
    if keeps:
        n_crossings[e] = keep_rows(work.roots[0], n_roots, crossings[e])
        begins_open[e] = starts_open
    add_normal_force(polynomials[2], row, n_roots, starts_open, work, coefficients[2], blocks[NN])
    sample_normal(gap[2], row, work.pressure, force[2], state)
    for d in range(2):
        k, x = row[d], polynomials[d]
        if k == 0.0:
            continue
        count = find_segments(x, d, row, limit_slope, n_roots, starts_open, n_x, grid, work)
        if keeps:
            n_segments[e, d] = keep_rows(work.segments, count, segments[e, d])
        integrate_spring(x, k, limit_slope, count, work, coefficients[d], blocks[TT + d], blocks[TN + d])
        _sample_tangent(gap[d], k, work.pressure, count, work.segments, force[d], state[d])


@njit(cache=True)
def _contact(  # type: ignore[no-untyped-def]
    polynomials, elements, start, end, gap, grid, work, n_x, other, coefficients, blocks, force, state, kept
):
    """Evaluate one contact, the sum of elements `start` to before `end`; it slips where their states differ."""
    coefficients[:] = 0.0
    blocks[:] = 0.0
    force[:] = 0.0
    n_x[:] = -1
    for e in range(start, end):
        own = state if e == start else other
        _element(polynomials, elements[e], e, gap, grid, n_x, work, coefficients, blocks, force, own, kept)
        if e > start:
            for d in range(2):
                for i in range(gap.shape[1]):
                    if state[d, i] != other[d, i]:
                        state[d, i] = SLIP


@njit(cache=True)
def _contacts(  # type: ignore[no-untyped-def]
    start, end, polynomials, elements, first, grid, gap, coefficients, blocks, force, state, kept
):
    """Evaluate the contacts from `start` to before `end`."""
    samples = gap.shape[2]
    work = scratch(polynomials.shape[2], grid.shape[1], samples)
    n_x = np.empty(2, np.int64)
    other = np.empty((2, samples), np.int64)
    for c in range(start, end):
        _contact(
            polynomials[c],
            elements,
            first[c],
            first[c + 1],
            gap[c],
            grid,
            work,
            n_x,
            other,
            coefficients[c],
            blocks[c],
            force[c],
            state[c],
            kept,
        )


@njit(cache=True)
def contact_events(  # type: ignore[no-untyped-def]
    polynomials, elements, first, grid, gap, coefficients, blocks, force, state, kept
):
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
        (n_contacts, 3, samples) gaps on samples, for `force` and `state`; there may be no samples.
    coefficients
        Out: (n_contacts, 3, m) Fourier coefficients of the forces (T_t, T_w, -N) in N.
    blocks
        Out: (n_contacts, P, m, m) their derivatives by the coefficients of the gaps. Only the first five differ from
        zero: t by t, w by w, n by n, t by n, w by n.
    force
        Out: (n_contacts, 3, samples) forces on samples.
    state
        Out: (n_contacts, 2, samples) 0 stick, 1 slip, 2 open, for t and w; a contact of several elements slips where
        they differ.
    kept
        Out: the arrays of `Events` after the polynomials, or empty ones.
    """
    _contacts(0, gap.shape[0], polynomials, elements, first, grid, gap, coefficients, blocks, force, state, kept)


@njit(cache=True, parallel=True)
def contact_events_threads(  # type: ignore[no-untyped-def]
    shares, polynomials, elements, first, grid, gap, coefficients, blocks, force, state, kept
):
    """Evaluate like `contact_events`, in `shares` that are distributed over threads."""
    n = gap.shape[0]
    for share in prange(shares):
        _contacts(
            share * n // shares,
            (share + 1) * n // shares,
            polynomials,
            elements,
            first,
            grid,
            gap,
            coefficients,
            blocks,
            force,
            state,
            kept,
        )


@lru_cache(maxsize=32)
def _grid(order: int) -> FloatArray:
    return search_grid(order)


def exact_period(
    gap_coefficients: FloatArray,
    elements: FloatArray,
    first: IntArray,
    gap: FloatArray,
    pairs: int = 5,
    kept: Events | None = None,
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray]:
    """Evaluate contacts whose gaps have the given Fourier coefficients, without sampling error (Petrov & Ewins 2003).

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n_contacts) real coefficients of the gaps (t, w, n of each contact), m.
    elements, first
        (n_elements, 7) rows and (n_contacts + 1,) offsets, see `contact_events`.
    gap
        (n_contacts, 3, samples) gaps on samples at which forces and states are returned; there may be no samples.
    pairs
        Number of derivative blocks of a contact, at least five.
    kept
        Out: events, from `room_for_events`; None: they are not returned.

    Returns
    -------
    tuple
        (2H+1, 3 n_contacts) coefficients of the forces, N; (n_contacts, pairs, 2H+1, 2H+1) derivatives, N/m;
        (n_contacts, 3, samples) forces, N; (n_contacts, 2, samples) states. If a gap is not finite or beyond 1e152 m,
        all numbers are NaN and all states open.
    """
    m, width = gap_coefficients.shape
    n = width // 3
    polynomials = np.ascontiguousarray(gap_coefficients.T).reshape(n, 3, m)
    coefficients = np.empty_like(polynomials)
    blocks = np.empty((n, pairs, m, m))
    force = np.empty_like(gap)
    state = np.empty((n, 2, gap.shape[2]), dtype=np.int64)
    if not np.all(np.abs(polynomials) < LARGEST):
        # a lost iterate: NaN and values that overflow in a product have no sign changes to find
        for each in (coefficients, blocks, force):
            each[:] = np.nan
        state[:] = OPEN
        if kept is not None:
            kept.n_crossings[:] = UNKEPT
        return coefficients.reshape(width, m).T, blocks, force, state
    room = room_for_events(0, 0) if kept is None else kept
    out = room.crossings, room.n_crossings, room.starts_open, room.segments, room.n_segments
    arrays = (polynomials, elements, first, _grid((m - 1) // 2), gap, coefficients, blocks, force, state, out)
    shares = thread_shares(n)
    if shares > 1:
        contact_events_threads(shares, *arrays)
    else:
        contact_events(*arrays)
    return coefficients.reshape(width, m).T, blocks, force, state
