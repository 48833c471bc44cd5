"""Derivatives of a planar contact by the coefficients of its gaps and by the slider's initial position.

A row contains the derivatives of one number: by the m coefficients of each of the gaps t, w and n, and by both
coordinates of the initial position. In stick, the rows of the slider's position z are followed, in slip the row of the
angle θ. Forces are continuous at all events, and z is stationary where slip ends, so that the times of events
contribute nothing, with one exception: a contact that closes keeps the motion at the time of closing, which moves.
"""

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.law import SLIP, STICK
from stickslip.contact.planar.motion import (
    AT_LIMIT,
    AT_LIMIT_RATE,
    COS,
    SHARE,
    SIN,
    TINY,
    accelerations,
    fill_stages,
    place,
    rates,
)
from stickslip.contact.planar.radau import CROWDED, INNER, PACE, PART, RATE, STAGES, TIMES, WEIGHTS
from stickslip.contact.planar.slip import factorise, linearise, solve_rows
from stickslip.contact.planar.trajectory import (
    CLOSED,
    COUNT,
    DIRECTION,
    END,
    FIRST,
    ORIGIN,
    PIECE_ANGLE,
    PIECE_KIND,
    PIECE_START,
    PIECE_WIDTH,
    PLACE_X,
    PLACE_Y,
    START,
    STATE,
)
from stickslip.contact.slider import PERIOD
from stickslip.contact.trigonometric import add_means, harmonics_at

_STEEP = 1e-9  # smallest slope of the limit at a zero that counts as a crossing, as a share of its bound
_NODES_AT_ONCE = 16 * STAGES  # nodes whose products are evaluated in one BLAS call


class Rows(NamedTuple):
    """Arrays for the derivatives of numbers by q = 3 m + 2 quantities."""

    place: FloatArray  # (2, q) of the slider's position
    angle: FloatArray  # (q,) of the angle of slip
    basis: FloatArray  # (2, m) cosines and sines at a time, and their derivatives
    stages: FloatArray  # (stages, q)
    matrix: FloatArray  # (stages, stages)
    pivots: IntArray
    right: FloatArray  # (stages,)
    at: FloatArray  # (7, stages) what `fill_stages` finds
    weighted: FloatArray  # (nodes, m) basis at the nodes with the weights of the quadrature
    force: FloatArray  # (nodes, 2 q + 2) rows of both components of the force, and the force
    sums: FloatArray  # (m, 2 q + 2) Fourier integrals of `force`
    products: FloatArray  # (m, 2 q + 2)
    means: FloatArray  # (2, 2 m - 1)
    harmonics: FloatArray  # (2, 2, 2 m - 1)
    stick: FloatArray  # (2, 2 m - 1) means over all stick


@njit(**INNER)
def rows_room(m):  # type: ignore[no-untyped-def]
    """Allocate `Rows` for `m` coefficients."""
    q = 3 * m + 2
    wide = 2 * q + 2
    return Rows(
        np.empty((2, q)),
        np.empty(q),
        np.empty((2, m)),
        np.empty((STAGES, q)),
        np.empty((STAGES, STAGES)),
        np.empty(STAGES, np.int64),
        np.empty(STAGES),
        np.empty((SIN + 1, STAGES)),
        np.empty((_NODES_AT_ONCE, m)),
        np.empty((_NODES_AT_ONCE, wide)),
        np.empty((m, wide)),
        np.empty((m, wide)),
        np.empty((2, 2 * m - 1)),
        np.empty((2, 2, 2 * m - 1)),
        np.empty((2, 2 * m - 1)),
    )


@njit(**INNER)
def basis_at(tau, out):  # type: ignore[no-untyped-def]
    """Fill both rows of `out` with the basis and its derivative by τ."""
    _turned_basis(np.cos(tau), np.sin(tau), out)


@njit(**INNER)
def _turned_basis(c1, s1, out):  # type: ignore[no-untyped-def]
    """Fill `out` like `basis_at`, from cosine and sine of τ."""
    c, s = 1.0, 0.0
    out[0, 0], out[1, 0] = 1.0, 0.0
    for h in range(1, (out.shape[1] + 1) // 2):
        c, s = c * c1 - s * s1, s * c1 + c * s1
        out[0, 2 * h - 1], out[0, 2 * h] = c, s
        out[1, 2 * h - 1], out[1, 2 * h] = -h * s, h * c


@njit(**PART)
def _close(motion, row, tau, k, slope, rows):  # type: ignore[no-untyped-def]
    """Set the rows of a contact that closes at `tau`; `slope` is the derivative of the limit by the normal gap."""
    m = motion.waves.shape[1]
    basis_at(tau, rows.basis)
    b, db = rows.basis[0], rows.basis[1]
    x_rate, y_rate, limit_rate = rates(motion, tau)
    rows.place[:] = 0.0
    rows.angle[:] = 0.0
    if row[STATE] == STICK:
        by_x = by_y = 0.0
        if limit_rate > 0.0:
            by_x, by_y = -slope * x_rate / limit_rate, -slope * y_rate / limit_rate
        for p in range(m):
            rows.place[0, p] = rows.place[1, m + p] = k * b[p]
            rows.place[0, 2 * m + p], rows.place[1, 2 * m + p] = by_x * b[p], by_y * b[p]
        return
    size = max(np.hypot(x_rate, y_rate), TINY)
    cos, sin = x_rate / size, y_rate / size
    x_bend, y_bend, _ = accelerations(motion, tau)
    by_n = -slope * (y_bend * cos - x_bend * sin) / (size * max(limit_rate + size, TINY))
    for p in range(m):
        rows.angle[p], rows.angle[m + p] = -k * sin * db[p] / size, k * cos * db[p] / size
        rows.angle[2 * m + p] = by_n * b[p]


@njit(**INNER)
def _to_slip(motion, angle, tau, k, rows):  # type: ignore[no-untyped-def]
    """Convert the rows of the position into the row of the angle, where the force reaches its limit."""
    m = motion.waves.shape[1]
    _, _, limit = place(motion, tau)
    limit = max(limit, TINY)
    c, s = np.cos(angle) / limit, np.sin(angle) / limit
    for p in range(rows.angle.size):
        rows.angle[p] = s * rows.place[0, p] - c * rows.place[1, p]
    basis_at(tau, rows.basis)
    for p in range(m):
        rows.angle[p] -= k * s * rows.basis[0, p]
        rows.angle[m + p] += k * c * rows.basis[0, p]


@njit(**INNER)
def to_stick(motion, angle, tau, k, slope, rows):  # type: ignore[no-untyped-def]
    """Convert the row of the angle into the rows of the position."""
    m = motion.waves.shape[1]
    _, _, limit = place(motion, tau)
    limit = max(limit, 0.0)
    cos, sin = np.cos(angle), np.sin(angle)
    for p in range(rows.angle.size):
        turned = limit * rows.angle[p]
        rows.place[0, p], rows.place[1, p] = sin * turned, -cos * turned
    basis_at(tau, rows.basis)
    for p in range(m):
        b = rows.basis[0, p]
        rows.place[0, p] += k * b
        rows.place[1, m + p] += k * b
        rows.place[0, 2 * m + p] -= slope * cos * b
        rows.place[1, 2 * m + p] -= slope * sin * b


@njit(**INNER)
def _flush(rows, count):  # type: ignore[no-untyped-def]
    """Add the products of the waiting nodes."""
    if count > 0:
        np.dot(rows.weighted[:count].T, rows.force[:count], rows.products)
        rows.sums[:] += rows.products


@njit(**PART)
def _fill_nodes(motion, piece, k, slope, count, rows):  # type: ignore[no-untyped-def]
    """Solve for the row of the angle at the stages of a piece; store the rows of the force from node `count` on."""
    m = motion.waves.shape[1]
    q = 3 * m + 2
    start, width, kind, angles, at = (
        piece[PIECE_START],
        piece[PIECE_WIDTH],
        int(piece[PIECE_KIND]),
        piece[PIECE_ANGLE:],
        rows.at,
    )
    fill_stages(motion, start, width, kind, at)
    linearise(at, angles, rows.matrix, rows.right)
    for j in range(STAGES):
        cos, sin = np.cos(angles[j + 1]), np.sin(angles[j + 1])
        pace = width * PACE[kind, j + 1]
        turn = 0.0
        for i in range(STAGES + 1):
            turn += RATE[j, i] * angles[i]
        turn /= pace
        by_start = -at[SHARE, j] * RATE[j, 0]
        _turned_basis(at[COS, j], at[SIN, j], rows.basis)
        own, weighted, force = rows.stages[j], rows.weighted[count + j], rows.force[count + j]
        weight = WEIGHTS[j] * pace / PERIOD
        for p in range(q):
            own[p] = by_start * rows.angle[p]
        for p in range(m):
            b, db = rows.basis[0, p], rows.basis[1, p]
            own[p] -= k * sin * db
            own[m + p] += k * cos * db
            own[2 * m + p] -= turn * slope * b
            weighted[p] = (weight if p == 0 else 2.0 * weight) * b
            force[p] = force[m + p] = force[q + p] = force[q + m + p] = 0.0
            force[2 * m + p], force[q + 2 * m + p] = slope * cos * b, slope * sin * b
        for p in range(3 * m, q):
            force[p] = force[q + p] = 0.0
        force[2 * q], force[2 * q + 1] = at[AT_LIMIT, j] * cos, at[AT_LIMIT, j] * sin
    if kind == CROWDED:
        _move_end(motion, piece, slope, count, rows)
    if factorise(rows.matrix, rows.pivots):
        solve_rows(rows.matrix, rows.pivots, rows.stages)
    else:
        for j in range(STAGES):
            rows.stages[j] = rows.angle
    rows.angle[:] = rows.stages[STAGES - 1]


@njit(**PART)
def _move_end(motion, piece, slope, count, rows):  # type: ignore[no-untyped-def]
    """Add the effect of the opening time at the end of a piece.

    It moves with the normal gap, and the nodes move along.
    """
    m = motion.waves.shape[1]
    q = 3 * m + 2
    start, width, angles, at = piece[PIECE_START], piece[PIECE_WIDTH], piece[PIECE_ANGLE:], rows.at
    end_rate = rates(motion, start + width)[2]
    if not end_rate < -_STEEP * motion.bounds[5]:
        return  # it only touches zero there
    by_n = -slope / end_rate
    basis_at(start + width, rows.basis)
    at_end = rows.basis[0].copy()
    moved = np.zeros((2, m))
    for j in range(STAGES):
        time = TIMES[CROWDED, j + 1]
        tau, pace = start + width * time, width * PACE[CROWDED, j + 1]
        cos, sin = np.cos(angles[j + 1]), np.sin(angles[j + 1])
        x_bend, y_bend, _ = accelerations(motion, tau)
        turn = 0.0
        for i in range(STAGES + 1):
            turn += RATE[j, i] * angles[i]
        turn /= pace
        across = at[AT_LIMIT, j] * turn
        own, force = rows.stages[j], rows.force[count + j]
        share = by_n * ((y_bend * cos - x_bend * sin) * time + across / width - turn * at[AT_LIMIT_RATE, j] * time)
        grown = by_n * at[AT_LIMIT_RATE, j] * time
        basis_at(tau, rows.basis)
        weight = WEIGHTS[j] * pace / PERIOD
        for p in range(m):
            own[2 * m + p] += share * at_end[p]
            force[2 * m + p] += grown * cos * at_end[p]
            force[q + 2 * m + p] += grown * sin * at_end[p]
            change = (weight if p == 0 else 2.0 * weight) * (rows.basis[0, p] / width + time * rows.basis[1, p])
            moved[0, p] += change * force[2 * q]
            moved[1, p] += change * force[2 * q + 1]
    for p in range(m):
        sums = rows.sums[p]
        for j in range(m):
            sums[2 * m + j] += by_n * moved[0, p] * at_end[j]
            sums[q + 2 * m + j] += by_n * moved[1, p] * at_end[j]


@njit(**PART)
def _turn_forces(count, rows):  # type: ignore[no-untyped-def]
    """Add the effect of the rotation of the force at the stages of a piece."""
    q = rows.angle.size
    for j in range(STAGES):
        own, force = rows.stages[j], rows.force[count + j]
        x, y = force[2 * q], force[2 * q + 1]
        for p in range(q):
            force[p] -= y * own[p]
            force[q + p] += x * own[p]


@njit(**PART)
def _stuck(segment, rows):  # type: ignore[no-untyped-def]
    """Subtract the contribution of the resting slider from the force ``X`` over a segment."""
    left, right = segment[START], segment[END]
    harmonics_at(left, rows.harmonics[0])
    harmonics_at(right, rows.harmonics[1])
    means = rows.means
    means[:] = 0.0
    add_means(left, rows.harmonics[0], right, rows.harmonics[1], 1.0, means)
    rows.stick[:] += means
    m, wide = rows.sums.shape
    q = (wide - 2) // 2
    for p in range(m):
        h = (p + 1) // 2
        weight = means[0, 0] if p == 0 else 2.0 * means[(p + 1) % 2, h]
        sums = rows.sums[p]
        for j in range(q):
            sums[j] -= weight * rows.place[0, j]
            sums[q + j] -= weight * rows.place[1, j]
        sums[2 * q] -= weight * segment[PLACE_X]
        sums[2 * q + 1] -= weight * segment[PLACE_Y]


@njit(**PART)
def _follow_slip(course, segment, k, slope, waiting, rows, adds):  # type: ignore[no-untyped-def]
    """Follow the rows through the pieces of a slip segment.

    Return the number of nodes whose products are not yet added.
    """
    motion, angle = course.motion, segment[DIRECTION]
    first = int(segment[FIRST])
    for j in range(first, first + int(segment[COUNT])):
        if waiting + STAGES > _NODES_AT_ONCE:
            _flush(rows, waiting)
            waiting = np.int64(0)
        _fill_nodes(motion, course.pieces[j], k, slope, waiting, rows)
        angle = course.pieces[j, PIECE_ANGLE + STAGES]
        if adds:
            _turn_forces(waiting, rows)
            waiting += STAGES
    to_stick(motion, angle, segment[END], k, slope, rows)
    return waiting


@njit(cache=True, error_model="numpy")
def follow_rows(course, k, slope, rows, adds):  # type: ignore[no-untyped-def]
    """Integrate the rows along the stored segments; with `adds`, add the integrals of the force and its rows to `sums`.

    If the first segment begins the period, `rows.place` holds the rows at its start, and on return the rows at its end.
    """
    waiting = np.int64(0)  # a literal 0 would cause a second compilation
    for i in range(course.counts[0]):
        segment = course.segments[i]
        if segment[ORIGIN] == CLOSED:
            _close(course.motion, segment, segment[START], k, slope, rows)
        elif segment[STATE] == SLIP:
            _to_slip(course.motion, segment[DIRECTION], segment[START], k, rows)
        if segment[STATE] == SLIP:
            waiting = _follow_slip(course, segment, k, slope, waiting, rows, adds)
        elif adds:
            _stuck(segment, rows)
    _flush(rows, waiting)
