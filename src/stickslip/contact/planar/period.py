"""Forces and derivatives of isotropic planar Coulomb friction over one period, at located events.

Stick is linear, and begins and ends at zeros of trigonometric polynomials or of the slip speed. In slip
``T = L (cos θ, sin θ)`` with ``L θ' = k x'·e⊥``, one smooth equation. Integrals over stick are in closed form;
integrals over slip use the quadrature of the collocation.
"""

from functools import cache, lru_cache
from typing import Any

import numpy as np
from numba import prange, types

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import address_of, function_at
from stickslip.contact.cache import njit
from stickslip.contact.element import K_T
from stickslip.contact.event_integrals import add_normal_force, fill_limit
from stickslip.contact.events import LARGEST, sample_normal
from stickslip.contact.law import NN, OPEN, SLIP, STICK, TN, TT, TW, WN, WT, WW
from stickslip.contact.planar.cycle import follow_closings, forgets, settle
from stickslip.contact.planar.motion import Motion, fill_motion, place
from stickslip.contact.planar.radau import CROWDED, INNER, NEARLY, PART, POWER
from stickslip.contact.planar.sensitivities import Rows, basis_at, follow_rows, rows_room, to_stick
from stickslip.contact.planar.slip import Piece, interpolated
from stickslip.contact.planar.trajectory import (
    COUNT,
    END,
    FIRST,
    PIECE_ANGLE,
    PIECE_KIND,
    PIECE_START,
    PIECE_WIDTH,
    PLACE_X,
    PLACE_Y,
    START,
    STATE,
    Course,
    course_room,
    run,
)
from stickslip.contact.slider import PERIOD, scratch, zeros
from stickslip.contact.threads import thread_shares
from stickslip.contact.trigonometric import product_matrix, search_grid

_line = types.float64[::1]
_plane = types.float64[:, ::1]
_whole = types.int64[::1]
_named: Any = types.NamedTuple
_motion = _named((_plane, _line), Motion)
_piece = _named((_plane, _line, _line, _plane, _whole, _line, _line), Piece)
_course = _named((_motion, _piece, _line, _line, _plane, _plane, _plane, _whole), Course)
_rows = _named(
    (_plane, _line, _plane, _plane, _plane, _whole, _line, *(_plane,) * 6, types.float64[:, :, ::1], _plane), Rows
)
RUN = types.void(_course, types.float64, types.float64, types.int64)
FOLLOW_ROWS = types.void(_course, types.float64, types.float64, _rows, types.boolean)


@njit(**INNER)
def sample_plane(course, gap, k, force, state):  # type: ignore[no-untyped-def]
    """Fill the force in the plane and the states on samples where the contact is closed."""
    n = gap.shape[1]
    if n == 0:
        return
    step = PERIOD / n
    for s in range(course.counts[0]):
        segment = course.segments[s]
        now = int(segment[STATE])
        piece = int(segment[FIRST])
        last = piece + int(segment[COUNT]) - 1
        i = int(np.ceil(segment[START] / step))
        while i * step < segment[END]:
            at = i % n
            if now == STICK:
                force[0, at] = k * gap[0, at] - segment[PLACE_X]
                force[1, at] = k * gap[1, at] - segment[PLACE_Y]
            elif last >= piece:
                tau = i * step
                while piece < last and tau > course.pieces[piece + 1, PIECE_START]:
                    piece += 1
                row = course.pieces[piece]
                share = (tau - row[PIECE_START]) / row[PIECE_WIDTH]
                share = min(max(share, 0.0), 1.0)
                if row[PIECE_KIND] == CROWDED:
                    share = min((1.0 - (1.0 - share) ** (1.0 / POWER)) / NEARLY, 1.0)
                angle = interpolated(row[PIECE_ANGLE:], share)
                _, _, limit = place(course.motion, tau)
                limit = max(limit, 0.0)
                force[0, at], force[1, at] = limit * np.cos(angle), limit * np.sin(angle)
            state[0, at] = state[1, at] = now
            i += 1


_BLOCKS = np.array([[TT, TW, TN], [WT, WW, WN]])


@njit(**PART)
def _dragged(run, follow_rows, course, k, slope, rows, correction, out):  # type: ignore[no-untyped-def]
    """Follow a slider that begins at zero displacement until it stops being dragged; return the number of periods.

    The derivatives of its final position are written to `out`.
    """
    motion = course.motion
    x, y, limit = place(motion, 0.0)
    limit = max(limit, 0.0)
    rows.place[:] = 0.0
    rows.angle[:] = 0.0
    size = np.hypot(x, y)
    if size >= limit and size > 0.0:
        m = motion.waves.shape[1]
        basis_at(0.0, rows.basis)
        for p in range(m):
            rows.angle[p] = -k * y / (size * size) * rows.basis[0, p]
            rows.angle[m + p] = k * x / (size * size) * rows.basis[0, p]
        to_stick(motion, np.arctan2(y, x), 0.0, k, slope, rows)
    periods = settle(run, course, correction, follow_rows, k, slope, rows, np.bool_(True))
    out[:] = rows.place
    return periods


@njit(**PART)
def _closed_for_ever(run, follow_rows, course, k, slope, rows, correction, start_rows):  # type: ignore[no-untyped-def]
    """Integrate a contact that never opens; return whether its state is periodic.

    The derivatives of its position at the start are written to `start_rows`.
    """
    # a literal False would cause a second compilation
    periods = settle(run, course, correction, follow_rows, k, slope, rows, np.bool_(False))
    begun = course.begun
    _, forgotten = forgets(course.memory)
    start_rows[:] = 0.0
    moved = begun[0] == SLIP or begun[2] != 0.0 or begun[3] != 0.0
    if periods < 0 or (moved and not forgotten):
        periods = _dragged(run, follow_rows, course, k, slope, rows, correction, start_rows)
    q = rows.angle.size
    rows.place[:] = 0.0
    rows.angle[:] = 0.0
    rows.place[0, q - 2] = rows.place[1, q - 1] = 1.0
    follow_rows(course, k, slope, rows, True)
    inverse, _ = forgets(rows.place[:, q - 2 :])
    for p in range(q - 2):
        dx, dy = rows.place[0, p] - start_rows[0, p], rows.place[1, p] - start_rows[1, p]
        for s in range(2):
            dx += rows.place[0, q - 2 + s] * start_rows[s, p]
            dy += rows.place[1, q - 2 + s] * start_rows[s, p]
        start_rows[0, p] += inverse[0, 0] * dx + inverse[0, 1] * dy
        start_rows[1, p] += inverse[1, 0] * dx + inverse[1, 1] * dy
    return periods > 0


@njit(**PART)
def _assemble(motion, k, rows, correction, start_rows, work, coefficients, blocks):  # type: ignore[no-untyped-def]
    """Fill coefficients and blocks from the integrals, and the contribution of the start of the period."""
    m = motion.waves.shape[1]
    q = rows.angle.size
    product_matrix(rows.stick, work.matrix)
    for a in range(2):
        first, x = a * q, motion.waves[a]
        for p in range(m):
            sums = rows.sums[p]
            u, v = sums[first + q - 2], sums[first + q - 1]
            total = sums[2 * q + a] + u * correction[0] + v * correction[1]
            for j in range(m):
                total += work.matrix[p, j] * x[j]
            coefficients[a, p] += total
            for b in range(3):
                out = blocks[_BLOCKS[a, b], p]
                for j in range(m):
                    column = b * m + j
                    out[j] += sums[first + column] + u * start_rows[0, column] + v * start_rows[1, column]
            own = blocks[_BLOCKS[a, a], p]
            for j in range(m):
                own[j] += k * work.matrix[p, j]


@njit(**PART)
def _contact(run, follow_rows, gaps, row, gap, grid, room, coefficients, blocks, force, state):  # type: ignore[no-untyped-def]
    """Evaluate one contact; return whether its state is periodic."""
    work, course, rows, correction, start_rows = room
    coefficients[:] = 0.0
    blocks[:] = 0.0
    force[:] = 0.0
    slope = fill_limit(gaps[2], row, work)
    n_roots, starts_open = zeros(work.normal, grid, work, work.roots[0])
    add_normal_force(gaps[2], row, n_roots, starts_open, work, coefficients[2], blocks[NN])
    sample_normal(gap[2], row, work.pressure, force[2], state)
    if row[K_T] == 0.0 or (n_roots == 0 and starts_open):
        return True
    if not np.any(work.limit != 0.0):
        state[:] = np.where(state == STICK, SLIP, state)
        return True
    k = row[K_T]
    fill_motion(gaps, k, work.limit, course.motion)
    rows.sums[:] = 0.0
    rows.stick[:] = 0.0
    correction[:] = 0.0
    settled = True
    if n_roots > 0:
        follow_closings(run, course, work.roots[0], n_roots, starts_open)
        start_rows[:] = 0.0
        follow_rows(course, k, slope, rows, True)
        settled = course.counts[2] == 0
    else:
        settled = _closed_for_ever(run, follow_rows, course, k, slope, rows, correction, start_rows)
    _assemble(course.motion, k, rows, correction, start_rows, work, coefficients, blocks)
    sample_plane(course, gap, k, force, state)
    return settled


_cube = types.float64[:, :, ::1]
_ARRAYS = (
    types.int64,
    types.int64,
    _cube,
    types.float64[:, ::1],
    types.float64[:, ::1],
    _cube,
    _cube,
    types.float64[:, :, :, ::1],
    _cube,
    types.int64[:, :, ::1],
    types.boolean[::1],
)
_SOME = types.void(types.int64, types.int64, *_ARRAYS)
_run_at, _follow_rows_at, _some_at = function_at(RUN), function_at(FOLLOW_ROWS), function_at(_SOME)


def _some(  # type: ignore[no-untyped-def]
    start, end, run_address, rows_address, polynomials, elements, grid, gap, coefficients, blocks, force, state, settled
):
    """Evaluate the contacts from `start` to before `end`."""
    run, follow_rows = _run_at(run_address), _follow_rows_at(rows_address)
    m = polynomials.shape[2]
    room = (
        scratch(m, grid.shape[1], gap.shape[2]),
        course_room(m),
        rows_room(m),
        np.zeros(2),
        np.zeros((2, 3 * m + 2)),
    )
    for c in range(start, end):
        settled[c] = _contact(
            run,
            follow_rows,
            polynomials[c],
            elements[c],
            gap[c],
            grid,
            room,
            coefficients[c],
            blocks[c],
            force[c],
            state[c],
        )


def _shared(  # type: ignore[no-untyped-def]
    shares,
    some_address,
    run_address,
    rows_address,
    polynomials,
    elements,
    grid,
    gap,
    coefficients,
    blocks,
    force,
    state,
    settled,
):
    """Evaluate all contacts as `_some` does, in `shares` that are distributed over threads."""
    n = gap.shape[0]
    for share in prange(shares):
        some = _some_at(some_address)
        some(
            share * n // shares,
            (share + 1) * n // shares,
            run_address,
            rows_address,
            polynomials,
            elements,
            grid,
            gap,
            coefficients,
            blocks,
            force,
            state,
            settled,
        )


@cache
def _compiled() -> Any:
    """Return the compiled `_some`; compilation happens when a planar contact is first evaluated."""
    return njit(_SOME, cache=True, error_model="numpy")(_some)


@cache
def _threads() -> Any:
    """Return the compiled `_shared`; compilation happens when there are enough contacts for threads."""
    return njit(types.void(types.int64, types.int64, *_ARRAYS), cache=True, parallel=True)(_shared)


@lru_cache(maxsize=32)
def _grid(order: int) -> FloatArray:
    return search_grid(order)


def planar_period(
    gap_coefficients: FloatArray, elements: FloatArray, gap: FloatArray, pairs: int = 7
) -> tuple[FloatArray, FloatArray, FloatArray, IntArray, int]:
    """Evaluate contacts with isotropic planar friction whose gaps have the given Fourier coefficients.

    Parameters
    ----------
    gap_coefficients
        (2H+1, 3 n) real coefficients of the gaps (t, w, n of each contact), m.
    elements
        (n, 7) rows, see `contact.element`; both tangential stiffnesses of a row are equal.
    gap
        (n, 3, samples) gaps on samples at which forces and states are returned; there may be no samples.
    pairs
        Number of derivative blocks of a contact, at least seven.

    Returns
    -------
    tuple
        (2H+1, 3 n) coefficients of the forces, N; (n, pairs, 2H+1, 2H+1) derivatives, N/m; (n, 3, samples) forces, N;
        (n, 2, samples) states; number of contacts whose state is not periodic. If a gap is not finite or beyond 1e152
        m, all forces are NaN and all states open.
    """
    m, width = gap_coefficients.shape
    n = width // 3
    polynomials = np.ascontiguousarray(gap_coefficients.T).reshape(n, 3, m)
    coefficients = np.empty_like(polynomials)
    blocks = np.empty((n, pairs, m, m))
    force = np.empty_like(gap)
    state = np.empty((n, 2, gap.shape[2]), dtype=np.int64)
    settled = np.ones(n, dtype=np.bool_)
    if not np.all(np.abs(polynomials) < LARGEST):
        for each in (coefficients, blocks, force):
            each[:] = np.nan
        state[:] = OPEN
        return coefficients.reshape(width, m).T, blocks, force, state, 0
    arrays = (
        address_of(run, RUN),
        address_of(follow_rows, FOLLOW_ROWS),
        polynomials,
        elements,
        _grid((m - 1) // 2),
        gap,
        coefficients,
        blocks,
        force,
        state,
        settled,
    )
    shares = thread_shares(n)
    if shares > 1:
        _threads()(shares, address_of(_compiled(), _SOME), *arrays)
    else:
        _compiled()(0, n, *arrays)
    return coefficients.reshape(width, m).T, blocks, force, state, int(np.count_nonzero(~settled))
