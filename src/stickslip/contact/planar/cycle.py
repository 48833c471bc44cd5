"""The periodic steady state of a planar contact.

A contact that opens forgets its history, and is followed once from each closing to the next opening. A contact that
stays closed keeps the memory of its start while it slips. Its periods are followed from a slider at zero displacement,
with Newton steps towards the periodic state. Directions that never forget their start stay where the first periods
dragged them.
"""

import numpy as np

from stickslip.contact.cache import njit
from stickslip.contact.law import SLIP
from stickslip.contact.planar.motion import TINY, X, Y, place
from stickslip.contact.planar.radau import INNER, PART
from stickslip.contact.planar.trajectory import (
    ANGLE,
    CLOSED,
    COUNT,
    MODE,
    STARTED,
    STATE,
    Z_X,
    Z_Y,
    begin_at,
    begin_closed,
)
from stickslip.contact.slider import PERIOD

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
