"""The course of a planar contact over a period that repeats.

A contact that opens forgets: it is followed from each closing to the next opening, once. One that stays closed keeps the memory of its
start in its slip; its periods are followed from a slider at zero displacement, with steps of Newton's method towards the state that
repeats. A direction that forgets nothing is left where the first periods dragged it.
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
_ROUNDING = 1e-13  # change over a period that counts as none, as a share of the smaller of limit and motion
_ROUND_OFF = 1e-15  # of the displacement
# distance from the periodic state that the derivatives by the start bridge, in the same measure
_START_DIFFERENCE = 1e-7
_NOTHING = 1e-13  # share of the largest limit at which a contact counts as just closing
_LEAST_SHARE = 0.1  # of a step of Newton's method that is tried
_KEPT = 1e-9  # singular value below which a direction keeps its memory for ever


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
    """Return the slider's place at the end or the start of a period, where the motion is x, y, limit."""
    state = course.state
    if state[MODE] == SLIP:
        return x - limit * np.cos(state[ANGLE]), y - limit * np.sin(state[ANGLE])
    return state[Z_X], state[Z_Y]


@njit(**PART)
def one_period(run, course, x, y, limit):  # type: ignore[no-untyped-def]
    """Follow one period from the present state; its memory is the derivative of the slider's place at the end by that at the start."""
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
    """Follow one period from the state that is there, with `carries` the rows of the place, too; return how far the place moves."""
    before_x, before_y = _place_of(course, x, y, limit)
    one_period(run, course, x, y, limit)
    if carries:
        follow_rows(course, k, slope, rows, False)
    after_x, after_y = _place_of(course, x, y, limit)
    return after_x - before_x, after_y - before_y


@njit(**PART)
def _measures(motion):  # type: ignore[no-untyped-def]
    """Return the smaller of motion and limit, by which distances are measured, and the change over a period that counts as none."""
    size = np.hypot(motion.waves[X, 0], motion.waves[Y, 0]) + motion.bounds[0]
    small = min(size, motion.bounds[4])
    return small, _ROUNDING * small + _ROUND_OFF * size


@njit(**PART)
def _newton(memory, dx, dy):  # type: ignore[no-untyped-def]
    """Return the pseudo-inverse of ``1 - M`` and the step from the place at the start of a period to that which repeats."""
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
    """Fill the difference of the rows at the end of a period from those at the start of the next Newton iteration."""
    for p in range(before.shape[1]):
        dx, dy = after[0, p] - before[0, p], after[1, p] - before[1, p]
        leap[0, p] = inverse[0, 0] * dx + inverse[0, 1] * dy - dx
        leap[1, p] = inverse[1, 0] * dx + inverse[1, 1] * dy - dy


@njit(**INNER)
def _leap(course, x, y, limit, share, safe, leap, safe_rows, rows_leap, rows):  # type: ignore[no-untyped-def]
    """Continue from the safe state plus a share of the last step from it."""
    course.state[:] = safe
    _step(course, x, y, limit, share * leap[0], share * leap[1])
    for s in range(2):
        for p in range(safe_rows.shape[1]):
            rows.place[s, p] = safe_rows[s, p] + share * rows_leap[s, p]


@njit(**PART)
def _touch(run, course, correction):  # type: ignore[no-untyped-def]
    """Follow the one period of a contact whose normal force touches zero where it begins: nothing is remembered."""
    course.counts[:] = 0
    correction[:] = 0.0
    begin_closed(course, 0.0)
    run(course, 0.0, PERIOD, np.int64(CLOSED))
    return 1


@njit(**PART)
def _lead(run, course, x, y, limit, follow_rows, k, slope, rows, carries):  # type: ignore[no-untyped-def]
    """Follow the first period from zero displacement, roughly where its end only leads near a state that forgets it."""
    begin_at(course, 0.0, 0.0, 0.0)
    course.counts[3] = 0 if carries else 1
    _follow(run, course, x, y, limit, follow_rows, k, slope, rows, carries)
    course.counts[3] = 0


@njit(**INNER)
def settle(run, course, correction, follow_rows, k, slope, rows, carries):  # type: ignore[no-untyped-def]
    """Follow periods until the state repeats.

    Parameters
    ----------
    run
        `course.run`.
    course
        Course with its motion filled; on return its segments are those of the last period.
    correction
        Out: (2,) remaining error of the slider's place at the start of this period, small enough for a correction by derivatives.
    follow_rows, k, slope
        The function `sensitivities.follow_rows` and its arguments.
    rows
        With `carries`: derivatives of the place at the start of the first period, and on return at the end of the last one. Steps of
        Newton's method change them as they change the state.

    Returns
    -------
    int
        Periods followed, or -1 if the state did not repeat.
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
        # a step of Newton's method after which the contact slips less often has left out where the slider would have come to rest
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
            # where the start is hardly forgotten, the first step goes too far, and the next ones come back by halves
            leaps, last = leaps - 1, np.inf
        if plain > 0:
            plain -= 1
        elif moved > 0.5 * last or not leads:
            # the last step led nowhere: go on from where it was made
            state[:] = safe
            rows.place[:] = safe_rows
            last, plain, patience, leaps = np.inf, patience, 2 * patience, 1
        else:
            last, jumped, share = moved, True, 1.0
            safe[:] = state
            safe_rows[:] = rows.place
            # the state at the end has moved by d already
            leap[0], leap[1] = step_x - dx, step_y - dy
            _rows_of_step(inverse, rows_before, rows.place, rows_leap)
            _leap(course, x, y, limit, share, safe, leap, safe_rows, rows_leap, rows)
    return -1
