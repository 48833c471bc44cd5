"""Motion of a planar contact while it is closed: alternating stick and slip, with located transitions.

The memory of the start is followed, too: the derivative of the slider's position z, or of the slip angle, by the
initial position.
"""

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.law import SLIP, STICK
from stickslip.contact.planar.motion import AT_LIMIT, TINY, Motion, accelerations, fill_stages, place, rates
from stickslip.contact.planar.radau import CROWDED, EVEN, HIGHEST, INNER, NEARLY, NODES, PART, POWER, STAGES
from stickslip.contact.planar.slip import (
    Piece,
    collocate,
    decay,
    factorise,
    interpolated,
    linearise,
    piece_room,
    predict,
    remember_end,
    slip_ends,
    slip_speed,
)
from stickslip.contact.planar.stick import never_reached, slip_begins

STARTED, CLOSED, FOLLOWED = (0, 1, 2)  # how a segment begins: with the period, with the contact, after another segment
MODE, ANGLE, Z_X, Z_Y = range(4)  # entries of a state
START, END, STATE, PLACE_X, PLACE_Y, DIRECTION, FIRST, COUNT, ORIGIN = range(9)  # columns of segments
# columns of pieces; θ at start and stages fill the rest
PIECE_START, PIECE_WIDTH, PIECE_KIND, PIECE_ANGLE = range(4)

WIDEST = 3.0  # width of a piece times the highest harmonic
# for the highest Legendre coefficient of θ on a piece, at the largest L; errors of integrals are about its square
TOLERANCE = 1e-6
ROUGH = 1e-3  # the same tolerance on the way to a state that only starts Newton's method
_ACCEPTED = 2.0  # times the tolerance: largest accepted error
_GROWTH = 1.8
_NEAR_END = 0.3  # share of the widest piece up to which nodes may be crowded: they are wider apart at its start
_SHORTEST = 1e-12
_SLIGHT = 0.02  # smallest weight: derivatives do not vanish with the limit
_FADING = 0.5  # factor on the weight of a piece at whose end the contact opens
_BRIEF = 10.0  # pieces shorter than 1 / 10 have proportionally less weight


class Course(NamedTuple):
    """Arrays that store the course of a contact."""

    motion: Motion
    piece: Piece
    state: FloatArray  # (4,) stick or slip, angle of the force, position of the slider
    begun: FloatArray  # (4,) the state with which the period began
    # (2, 2) derivative of the position by the initial one; in slip, row 0 is the derivative of the angle
    memory: FloatArray
    segments: FloatArray  # (most, 9)
    pieces: FloatArray  # (most, stages + 4)
    # (4,) number of segments, number of pieces, 1 if there was no room for all, and 1 if a rough course suffices
    counts: IntArray


@njit(**INNER)
def course_room(m):  # type: ignore[no-untyped-def]
    """Allocate a `Course` for polynomials of `m` coefficients.

    A limit has at most 2 H zeros, and each end of an interval may need increasingly short pieces.
    """
    order = (m - 1) // 2
    return Course(
        Motion(np.empty((6, m)), np.empty(8)),
        piece_room(),
        np.zeros(4),
        np.zeros(4),
        np.zeros((2, 2)),
        np.empty((64 + 32 * order, 9)),
        np.empty((256 + 96 * order, STAGES + 4)),
        np.zeros(4, np.int64),
    )


@njit(**INNER)
def begin_at(course, tau, z_x, z_y):  # type: ignore[no-untyped-def]
    """Set the state for a slider at z.

    At its limit, or beyond, the contact slips unless the motion leads inside the limit.
    """
    x, y, limit = place(course.motion, tau)
    x_rate, y_rate, limit_rate = rates(course.motion, tau)
    x -= z_x
    y -= z_y
    size = np.hypot(x, y)
    state = course.state
    state[MODE], state[Z_X], state[Z_Y] = STICK, z_x, z_y
    if size < limit or size == 0.0:
        return
    cos, sin = x / size, y / size
    state[ANGLE] = np.arctan2(y, x)
    state[Z_X] += (size - limit) * cos
    state[Z_Y] += (size - limit) * sin
    if x_rate * cos + y_rate * sin > limit_rate:
        state[MODE] = SLIP


@njit(**INNER)
def begin_closed(course, tau):  # type: ignore[no-untyped-def]
    """Set the state of a contact that closes: it sticks if the limit grows faster than the spring force."""
    x_rate, y_rate, limit_rate = rates(course.motion, tau)
    state = course.state
    course.memory[:] = 0.0
    if np.hypot(x_rate, y_rate) > limit_rate:
        state[MODE], state[ANGLE] = SLIP, np.arctan2(y_rate, x_rate)
    else:
        state[MODE] = STICK
        state[Z_X], state[Z_Y], _ = place(course.motion, tau)


@njit(**INNER)
def _start_to_slip(course, tau):  # type: ignore[no-untyped-def]
    """Change the state from stick to slip."""
    x, y, _ = place(course.motion, tau)
    state, memory = course.state, course.memory
    x -= state[Z_X]
    y -= state[Z_Y]
    size = max(np.hypot(x, y), TINY)
    cos, sin = x / size, y / size
    for s in range(2):
        memory[0, s] = (sin * memory[0, s] - cos * memory[1, s]) / size
        memory[1, s] = 0.0
    state[MODE], state[ANGLE] = SLIP, np.arctan2(y, x)


@njit(**INNER)
def stop_slipping(course, tau):  # type: ignore[no-untyped-def]
    """Change the state from slip to stick: the slider rests at its present position."""
    x, y, limit = place(course.motion, tau)
    state, memory = course.state, course.memory
    limit = max(limit, 0.0)
    cos, sin = np.cos(state[ANGLE]), np.sin(state[ANGLE])
    for s in range(2):
        turned = memory[0, s]
        memory[0, s], memory[1, s] = limit * sin * turned, -limit * cos * turned
    state[MODE], state[Z_X], state[Z_Y] = STICK, x - limit * cos, y - limit * sin


@njit(**INNER)
def closing_turn(motion, tau, angle):  # type: ignore[no-untyped-def]
    """Return θ' of a contact that slips from its closing on."""
    x_rate, y_rate, limit_rate = rates(motion, tau)
    x_bend, y_bend, _ = accelerations(motion, tau)
    across = y_bend * np.cos(angle) - x_bend * np.sin(angle)
    return across / max(limit_rate + np.hypot(x_rate, y_rate), TINY)


@njit(**PART)
def _first_piece(course, tau, origin, widest):  # type: ignore[no-untyped-def]
    """Prepare the prediction of the first piece of slip; return its width."""
    motion, piece, angle = course.motion, course.piece, course.state[ANGLE]
    x_rate, y_rate, limit_rate = rates(motion, tau)
    cos, sin = np.cos(angle), np.sin(angle)
    piece.guess[:] = 0.0
    piece.speed[0] = x_rate * cos + y_rate * sin - limit_rate
    if origin == CLOSED:
        piece.guess[0] = closing_turn(motion, tau, angle)
        return 0.5 * widest
    _, _, limit = place(motion, tau)
    limit = max(limit, TINY)
    piece.guess[0] = (y_rate * cos - x_rate * sin) / limit
    speed = np.hypot(x_rate, y_rate)
    return min(0.6 * widest, 3.0 * limit / max(speed, TINY))


@njit(**PART)
def _attempt(course, tau, width, kind):  # type: ignore[no-untyped-def]
    """Collocate a piece; return the estimate of its error in units of the tolerance, infinite without convergence."""
    piece, motion = course.piece, course.motion
    fill_stages(motion, tau, width, kind, piece.at)
    piece.angle[0] = course.state[ANGLE]
    predict(width, kind, piece)
    if not collocate(piece):
        return np.inf
    highest = 0.0
    for i in range(STAGES + 1):
        highest += HIGHEST[i] * piece.angle[i]
    weight = (np.max(piece.at[AT_LIMIT]) / motion.bounds[4] + _SLIGHT) * min(1.0, _BRIEF * width)
    if kind == CROWDED:
        weight *= _FADING
    return abs(highest) * weight / (ROUGH if course.counts[3] == 1 else TOLERANCE)


@njit(**INNER)
def _store(course, tau, width, kind):  # type: ignore[no-untyped-def]
    """Append the piece, follow the memory over it, and move the state to its end."""
    counts, piece = course.counts, course.piece
    if counts[1] == course.pieces.shape[0]:
        counts[2] = 1
        return
    row = course.pieces[counts[1]]
    counts[1] += 1
    row[PIECE_START], row[PIECE_WIDTH], row[PIECE_KIND] = tau, width, kind
    row[PIECE_ANGLE:] = piece.angle
    if course.memory[0, 0] != 0.0 or course.memory[0, 1] != 0.0:
        course.memory[0] *= decay(piece)
    course.state[ANGLE] = piece.angle[STAGES]
    piece.speed[0] = piece.speed[STAGES]
    remember_end(width, piece)


@njit(**PART)
def _cut(course, tau, width, kind, share):  # type: ignore[no-untyped-def]
    """Collocate the piece again up to the end of slip.

    z is stationary there, so that the position needs no further correction.
    """
    piece = course.piece
    even = np.int64(EVEN)  # a literal would be compiled once more
    whole = piece.angle.copy()
    part = share if kind == EVEN else 1.0 - (1.0 - NEARLY * share) ** POWER
    short = part * width
    fill_stages(course.motion, tau, short, even, piece.at)
    for j in range(1, STAGES + 1):
        c = part * NODES[j]
        piece.angle[j] = interpolated(whole, c if kind == EVEN else (1.0 - (1.0 - c) ** (1.0 / POWER)) / NEARLY)
    collocate(piece)
    return short


@njit(**PART)
def _constant(piece):  # type: ignore[no-untyped-def]
    """Keep the direction on a piece of negligible length."""
    for j in range(1, STAGES + 1):
        piece.angle[j] = piece.angle[0]
    linearise(piece.at, piece.angle, piece.matrix, piece.right)
    if not factorise(piece.matrix, piece.pivots):
        piece.matrix[:] = np.eye(STAGES)


@njit(**INNER)
def _next_width(width, error, widest):  # type: ignore[no-untyped-def]
    """Return the width of the next piece after one with `error`, in units of the tolerance."""
    if not np.isfinite(error):
        return 0.25 * width
    change = 0.85 * max(error, 1e-3) ** (-1.0 / STAGES)
    return min(width * min(max(change, 0.2), _GROWTH), widest)


@njit(**INNER)
def _slip(course, tau, end, origin, opens, widest):  # type: ignore[no-untyped-def]
    """Follow slip from `tau` until it ends or time `end` is reached, where with `opens` the contact opens.

    Return the time.
    """
    piece, counts = course.piece, course.counts
    width = _first_piece(course, tau, origin, widest)
    crowded = opens
    while tau < end:
        left = end - tau
        if counts[1] == course.pieces.shape[0]:
            counts[2] = 1
            return end
        last = width >= 0.999 * left
        if opens and last and not (crowded and left <= _NEAR_END * widest):
            last, width = False, 0.65 * left
        kind = CROWDED if opens and last else EVEN
        width = left if last else min(width, 0.5 * left if not opens else 0.8 * left)
        error = _attempt(course, tau, width, kind)
        if error > _ACCEPTED and width > _SHORTEST:
            if kind == CROWDED:
                crowded = False
            else:
                width = _next_width(width, error, widest)
            continue
        if not np.isfinite(error):
            _constant(piece)
        slip_speed(piece)
        share = slip_ends(piece.speed)
        if share <= 1.0:
            if share * width > _SHORTEST:
                width = _cut(course, tau, width, kind, share)
                _store(course, tau, width, np.int64(EVEN))
                tau += width
            stop_slipping(course, tau)
            return tau
        _store(course, tau, width, kind)
        tau = end if last else tau + width
        width = _next_width(width, error, widest)
        crowded = opens
    return end


@njit(cache=True, error_model="numpy")
def run(course, tau, end, origin):  # type: ignore[no-untyped-def]
    """Follow the closed contact from `tau` to `end`: append segments and pieces, and set state and memory at the end."""
    motion, state, counts, segments = course.motion, course.state, course.counts, course.segments
    widest = WIDEST / max((motion.waves.shape[1] - 1) // 2, 1)
    at_limit = opens = origin == CLOSED
    while tau < end:
        if counts[0] == segments.shape[0]:
            counts[2] = 1
            return
        row = segments[counts[0]]
        counts[0] += 1
        row[START], row[STATE], row[ORIGIN] = tau, state[MODE], origin
        row[PLACE_X], row[PLACE_Y] = state[Z_X], state[Z_Y]
        row[DIRECTION], row[FIRST] = state[ANGLE], counts[1]
        if state[MODE] == STICK:
            inside = not at_limit and never_reached(motion, state[Z_X], state[Z_Y])
            tau = end if inside else slip_begins(motion, state[Z_X], state[Z_Y], tau, end, at_limit)
            if tau < end:
                _start_to_slip(course, tau)
        else:
            tau = _slip(course, tau, end, origin, opens, widest)
            at_limit = True
        row[END], row[COUNT] = tau, counts[1] - row[FIRST]
        origin = FOLLOWED
