"""Forces and derivatives of isotropic planar Coulomb friction over one period of the steady state, at located events.

A contact that opens forgets its history, and is followed once from each closing to the next opening. A contact that stays closed keeps
the memory of its start while it slips. Its periods are followed from a slider at zero displacement, with Newton steps towards the
periodic state. Directions that never forget their start stay where the first periods dragged them.

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
from stickslip.contact.planar.motion import TINY, Motion, X, Y, fill_motion, place
from stickslip.contact.planar.radau import CROWDED, INNER, NEARLY, PART, POWER
from stickslip.contact.planar.sensitivities import Rows, basis_at, follow_rows, rows_room, to_stick
from stickslip.contact.planar.slip import Piece, interpolated
from stickslip.contact.planar.trajectory import (
    ANGLE,
    CLOSED,
    COUNT,
    END,
    FIRST,
    MODE,
    PIECE_ANGLE,
    PIECE_KIND,
    PIECE_START,
    PIECE_WIDTH,
    PLACE_X,
    PLACE_Y,
    START,
    STARTED,
    STATE,
    Z_X,
    Z_Y,
    Course,
    begin_at,
    begin_closed,
    course_room,
    run,
)
from stickslip.contact.slider import PERIOD, scratch, zeros
from stickslip.contact.threads import thread_shares
from stickslip.contact.trigonometric import product_matrix, search_grid

MAX_PERIODS = 400
_ROUNDING = 1e-13  # change over a period that counts as zero, as a share of the smaller of limit and motion
_ROUND_OFF = 1e-15  # relative to the displacement
# distance from the periodic state that is corrected by the derivatives by the start, in the same measure
_START_DIFFERENCE = 1e-7
_NOTHING = 1e-13  # share of the largest limit below which a contact counts as just closing
_LEAST_SHARE = 0.1  # smallest share of a Newton step that is tried
_KEPT = 1e-9  # singular value below which a direction never forgets its start


@njit(**INNER)
def follow_closings(run, course, roots, n_roots, starts_open):  # type: ignore[no-untyped-def]
    """Follow a contact that opens, from each closing to the next opening."""
    course.counts[:] = 0
    first = 0 if starts_open else 1
    for i in range(first, n_roots, 2):
        closes = roots[i]
        opens = roots[i + 1] if i + 1 < n_roots else roots[0] + PERIOD
        begin_closed(course, closes)
        run(course, closes, opens, np.int64(CLOSED))


@njit(**INNER)
def _place_of(course, x, y, limit):  # type: ignore[no-untyped-def]
    """Return the slider's position at the end or the start of a period, where the motion is x, y, limit."""
    state = course.state
    if state[MODE] == SLIP:
        return x - limit * np.cos(state[ANGLE]), y - limit * np.sin(state[ANGLE])
    return state[Z_X], state[Z_Y]


@njit(**PART)
def one_period(run, course, x, y, limit):  # type: ignore[no-untyped-def]
    """Follow one period from the present state.

    Fill `memory`, the derivative of the slider's final position by its initial one.
    """
    course.counts[:3] = 0
    memory, state = course.memory, course.state
    course.begun[:] = state
    memory[:] = np.eye(2)
    if state[MODE] == SLIP:
        size = max(limit, TINY)
        memory[:] = 0.0
        memory[0, 0], memory[0, 1] = np.sin(state[ANGLE]) / size, -np.cos(state[ANGLE]) / size
    run(course, 0.0, PERIOD, np.int64(STARTED))
    if state[MODE] == SLIP:
        cos, sin = np.cos(state[ANGLE]), np.sin(state[ANGLE])
        for s in range(2):
            turned = memory[0, s]
            memory[0, s], memory[1, s] = limit * sin * turned, -limit * cos * turned


@njit(**INNER)
def forgets(memory):  # type: ignore[no-untyped-def]
    """Return the pseudo-inverse of ``1 - M``, M being the memory, and whether all directions forget their start."""
    a, b, c, d = 1.0 - memory[0, 0], -memory[0, 1], -memory[1, 0], 1.0 - memory[1, 1]
    inverse = np.zeros((2, 2))
    det = a * d - b * c
    size = a * a + b * b + c * c + d * d
    if not np.isfinite(size):
        return inverse, False
    if abs(det) > _KEPT * max(size, 1.0):
        inverse[0, 0], inverse[0, 1], inverse[1, 0], inverse[1, 1] = (d / det, -b / det, -c / det, a / det)
        return inverse, True
    matrix = np.array([[a, b], [c, d]])
    left, sizes, right = np.linalg.svd(matrix)
    for k in range(2):
        if sizes[k] > _KEPT:
            for i in range(2):
                for j in range(2):
                    inverse[i, j] += right[k, i] * left[j, k] / sizes[k]
    return inverse, False


@njit(**INNER)
def _step(course, x, y, limit, dx, dy):  # type: ignore[no-untyped-def]
    """Move the state at the start of a period."""
    state = course.state
    if state[MODE] == SLIP:
        turn = (np.sin(state[ANGLE]) * dx - np.cos(state[ANGLE]) * dy) / max(limit, TINY)
        state[ANGLE] += min(max(turn, -1.0), 1.0)
        return
    begin_at(course, 0.0, state[Z_X] + dx, state[Z_Y] + dy)


@njit(**INNER)
def _follow(run, course, x, y, limit, follow_rows, k, slope, rows, carries):  # type: ignore[no-untyped-def]
    """Follow one period from the present state; return how far the slider's position moves.

    With `carries`, the derivatives of the position are followed, too.
    """
    before_x, before_y = _place_of(course, x, y, limit)
    one_period(run, course, x, y, limit)
    if carries:
        follow_rows(course, k, slope, rows, False)
    after_x, after_y = _place_of(course, x, y, limit)
    return after_x - before_x, after_y - before_y


@njit(**PART)
def _measures(motion):  # type: ignore[no-untyped-def]
    """Return the smaller of motion and limit, a measure of distances, and the change that counts as zero."""
    size = np.hypot(motion.waves[X, 0], motion.waves[Y, 0]) + motion.bounds[0]
    small = min(size, motion.bounds[4])
    return small, _ROUNDING * small + _ROUND_OFF * size


@njit(**PART)
def _newton(memory, dx, dy):  # type: ignore[no-untyped-def]
    """Return the pseudo-inverse of ``1 - M`` and the step from the initial position to the periodic one."""
    inverse, _ = forgets(memory)
    return inverse, inverse[0, 0] * dx + inverse[0, 1] * dy, inverse[1, 0] * dx + inverse[1, 1] * dy


@njit(**PART)
def _slips(course):  # type: ignore[no-untyped-def]
    """Return the number of slips of the contact in the period."""
    count = 0
    for i in range(course.counts[0]):
        if course.segments[i, STATE] == SLIP and course.segments[i, COUNT] > 0:
            count += 1
    return count


@njit(**PART)
def _rows_of_step(inverse, before, after, leap):  # type: ignore[no-untyped-def]
    """Fill the difference between the rows at the end of a period and at the start of the next Newton iteration."""
    for p in range(before.shape[1]):
        dx, dy = after[0, p] - before[0, p], after[1, p] - before[1, p]
        leap[0, p] = inverse[0, 0] * dx + inverse[0, 1] * dy - dx
        leap[1, p] = inverse[1, 0] * dx + inverse[1, 1] * dy - dy


@njit(**INNER)
def _leap(course, x, y, limit, share, safe, leap, safe_rows, rows_leap, rows):  # type: ignore[no-untyped-def]
    """Set the safe state plus a share of the last step from it."""
    course.state[:] = safe
    _step(course, x, y, limit, share * leap[0], share * leap[1])
    for s in range(2):
        for p in range(safe_rows.shape[1]):
            rows.place[s, p] = safe_rows[s, p] + share * rows_leap[s, p]


@njit(**PART)
def _touch(run, course, correction):  # type: ignore[no-untyped-def]
    """Follow one period of a contact whose normal force touches zero at its start: it has no memory."""
    course.counts[:] = 0
    correction[:] = 0.0
    begin_closed(course, 0.0)
    run(course, 0.0, PERIOD, np.int64(CLOSED))
    return 1


@njit(**PART)
def _lead(run, course, x, y, limit, follow_rows, k, slope, rows, carries):  # type: ignore[no-untyped-def]
    """Follow the first period from zero displacement.

    Without `carries`, a rough course suffices, because its end is only a first guess.
    """
    begin_at(course, 0.0, 0.0, 0.0)
    course.counts[3] = 0 if carries else 1
    _follow(run, course, x, y, limit, follow_rows, k, slope, rows, carries)
    course.counts[3] = 0


@njit(**INNER)
def settle(run, course, correction, follow_rows, k, slope, rows, carries):  # type: ignore[no-untyped-def]
    """Follow periods until the state is periodic.

    Parameters
    ----------
    run
        `course.run`.
    course
        Course with its motion filled; on return it contains the segments of the last period.
    correction
        Out: (2,) remaining error of the slider's position at the start of this period, small enough for a correction by
        derivatives.
    follow_rows, k, slope
        The function `sensitivities.follow_rows` and its arguments.
    rows
        With `carries`: derivatives of the position at the start of the first period, and on return at the end of the
        last one. Newton steps change them together with the state.

    Returns
    -------
    int
        Number of periods, or -1 if the state did not become periodic.
    """
    motion, state, memory = course.motion, course.state, course.memory
    x, y, limit = place(motion, 0.0)
    if limit <= _NOTHING * motion.bounds[4]:
        return _touch(run, course, correction)
    small, tolerance = _measures(motion)
    correction[:] = 0.0
    safe = np.empty(4)
    _lead(run, course, x, y, limit, follow_rows, k, slope, rows, carries)
    rows_before, safe_rows, rows_leap = rows.place.copy(), rows.place.copy(), rows.place.copy()
    leap, share = np.zeros(2), 1.0
    last, plain, patience, leaps, jumped, slips = np.inf, 0, 1, 1, False, 0
    safe[:] = state
    for period in range(2, MAX_PERIODS):
        rows_before[:] = rows.place
        dx, dy = _follow(run, course, x, y, limit, follow_rows, k, slope, rows, carries)
        if course.counts[2] != 0:
            return -1
        moved = max(abs(dx), abs(dy))
        # after a Newton step, fewer slips than before: the step passed the point where the slider would have come to
        # rest
        found = _slips(course)
        beyond, jumped = jumped and found < slips, False
        if beyond and share > _LEAST_SHARE:
            share, jumped = 0.5 * share if share < 1.0 else 0.9, True
            _leap(course, x, y, limit, share, safe, leap, safe_rows, rows_leap, rows)
            continue
        slips = found
        if moved <= tolerance and not beyond:
            return period
        inverse, step_x, step_y = _newton(memory, dx, dy)
        distance = max(abs(step_x), abs(step_y))
        if distance <= _START_DIFFERENCE * small and not beyond:
            correction[0], correction[1] = step_x, step_y
            return period
        leads = np.isfinite(distance) and not beyond
        if leads and moved > 0.5 * last and leaps > 0 and plain == 0:
            # if the start is hardly forgotten, the first step goes too far, and the next ones halve the error
            leaps, last = leaps - 1, np.inf
        if plain > 0:
            plain -= 1
        elif moved > 0.5 * last or not leads:
            # the last step made it worse: continue from the state before it
            state[:] = safe
            rows.place[:] = safe_rows
            last, plain, patience, leaps = np.inf, patience, 2 * patience, 1
        else:
            last, jumped, share = moved, True, 1.0
            safe[:] = state
            safe_rows[:] = rows.place
            # the state at the end of the period already contains the change d
            leap[0], leap[1] = step_x - dx, step_y - dy
            _rows_of_step(inverse, rows_before, rows.place, rows_leap)
            _leap(course, x, y, limit, share, safe, leap, safe_rows, rows_leap, rows)
    return -1


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
