"""The derivative of the compiled time step, for `stickslip.response.time.shooting`.

The state of a motion has a tangent, one column for each direction in which its start may change. A step that ends with
every contact sticking is linear and the same for all states; what the other contacts add is a small system of equations
with the active set in which the step was solved.
"""

# mypy: disallow-untyped-decorators=False

from typing import NamedTuple

import numpy as np
from numba import njit

from stickslip.arrays import FloatArray, IntArray
from stickslip.response.time.time_step import (
    StepOperators,
    StepRecord,
    StepState,
    StepWork,
    advance,
    step_workspace,
    write_record,
)

OPEN = 0
STUCK = 1  # the code of a contact that is closed, held both ways, and was closed before
LANDING = 10  # and above: the gap closes within the step
SINGLY = 3  # steps in one set of contact states up to which their matrix is not worth its making
GRAZING = 1e-8  # of the limit: a spring that is nearer to it has reached it and does not slip


class TangentOperators(NamedTuple):
    """Matrices of a step that act on tangents."""

    stuck: FloatArray  # (m, m + k): (motion, r) -> motion, with r unchanged over the step
    gaps: FloatArray  # (k, n): modal displacements -> gaps
    hold: FloatArray  # (m, k): r at the end of the step -> motion


class Tangent(NamedTuple):
    """Derivatives of the state, one column a direction."""

    state: FloatArray  # (m + k, columns): of (motion, r)
    moved: FloatArray  # (m, columns): scratch
    grazed: IntArray  # (k,): how often a spring was at its limit without slipping


class EqualSteps(NamedTuple):
    """Room for steps that wait for others in the same contact states."""

    work: StepWork  # their contact states and slopes
    power: Tangent  # (m + k) columns


def tangent_operators(ops: StepOperators, gaps: FloatArray) -> TangentOperators:
    """Return the matrices that the tangents need; `gaps` (k, n) turns modal displacements into gaps."""
    k, m = ops.hold.shape
    stuck = np.array(ops.transfer[:, :m].T)
    stuck[:, m : m + k] += ops.hold.T
    arrays = (stuck, gaps, ops.hold.T)
    return TangentOperators(*(np.ascontiguousarray(array) for array in arrays))


def fresh_tangent(state: FloatArray, k: int) -> Tangent:
    """Return `state` (m + k, columns) with its scratch arrays."""
    first = np.array(state, dtype=float, order="C")
    return Tangent(first, np.zeros_like(first[: len(first) - k]), np.zeros(k, dtype=np.int64))


def equal_steps(m: int, k: int) -> EqualSteps:
    """Return fresh room for `m` coordinates of motion and `k` gaps."""
    return EqualSteps(step_workspace(k), fresh_tangent(np.eye(m + k), k))


@njit(cache=True)
def _hold_grazing(c: int, before: StepState, law: FloatArray, work: StepWork, tan: Tangent) -> None:
    """Take a spring that just reaches its limit as sticking.

    A contact that stays closed and slips one way only cannot be in a periodic motion unless it slips by nothing: Newton
    ends there exactly, and the next state is one in which it sticks.
    """
    if work.code[c] < STUCK or work.code[c] >= LANDING:
        return
    for d in range(2):
        row, unit = 3 * c + d, 1 if d == 0 else 3
        trial = before.force[row] + law[d] * (work.gap[row] - before.gap[row])
        limit = abs(law[3] * work.force[3 * c + 2])
        if law[d] == 0.0 or limit == 0.0 or abs(abs(trial) - limit) > GRAZING * limit:
            continue
        work.code[c] -= (work.code[c] - STUCK) // unit % 3 * unit
        work.slope[c, d, :] = 0.0
        tan.grazed[row] += 1


@njit(cache=True)
def _let_slide(c: int, law: FloatArray, work: StepWork) -> None:
    """Take a spring without friction as slipping where its gap did not move, so that it seemed to stick.

    Its force is zero wherever the gap goes: it keeps no traction, and neither does it just reach its limit.
    """
    if work.code[c] == OPEN or law[3] > 0.0:
        return
    slips = work.code[c] - (LANDING if work.code[c] >= LANDING else STUCK)
    for d in range(2):
        unit = 1 if d == 0 else 3
        if slips // unit % 3 == 0:
            work.code[c] += unit
            work.slope[c, d, :] = 0.0
            work.slope[c, d, d] = -law[d]


@njit(cache=True)
def _given(
    c: int,
    gap_before: FloatArray,
    law: FloatArray,
    work: StepWork,
    tan: Tangent,
    ops: TangentOperators,
    out: FloatArray,
) -> None:
    """Write to `out` (3, columns) the part of a contact's r that what was before the step decides."""
    m = tan.moved.shape[0]
    normal, closed_by = law[4] - law[2] * work.gap[3 * c + 2], law[4] - law[2] * gap_before[2]
    slips = work.code[c] - (
        LANDING if work.code[c] >= LANDING else STUCK
    )  # t in units, w in threes
    for d in range(2):
        if work.code[c] == OPEN or (d == 0 and slips % 3 > 0) or (d == 1 and slips > 2):
            continue
        out[d] = tan.state[m + 3 * c + d]
        if work.code[c] < LANDING:
            continue
        # takes hold within the step: force = force before + share k (gap - gap before), see time_step
        share = normal / (normal - closed_by)
        by_normal = -law[2] * normal / (normal - closed_by) ** 2
        travel = law[d] * (work.gap[3 * c + d] - gap_before[d])
        for j in range(ops.gaps.shape[1]):
            factor = law[d] * (1.0 - share) * ops.gaps[3 * c + d, j]
            factor += travel * by_normal * ops.gaps[3 * c + 2, j]
            out[d] += factor * tan.state[j]


@njit(cache=True)
def _active(before: StepState, ops: StepOperators, work: StepWork) -> IntArray:
    """Return the contacts whose force beyond the stuck springs may change over the step."""
    found = np.empty(work.code.size, dtype=np.int64)
    count = 0
    for c in range(work.code.size):
        closed_by = ops.law[c, 4] - ops.law[c, 2] * before.gap[3 * c + 2]
        if work.code[c] != STUCK or closed_by <= 0.0:
            found[count] = c
            count += 1
    return found[:count]


@njit(cache=True)
def _contact_changes(
    rows: IntArray, given: FloatArray, gaps: FloatArray, ops: StepOperators, work: StepWork
) -> FloatArray:
    """Return the change of r over the step at active `rows`.

    ``dr = slope dg + given`` in each contact, with ``dg = gaps + response dr`` over all active ones.
    """
    size = rows.size
    response, slope = np.empty((size, size)), np.zeros((size, size))
    for i in range(size):
        for j in range(size):
            response[i, j] = ops.response[rows[j], rows[i]]
            if i // 3 == j // 3:
                slope[i, j] = work.slope[rows[i] // 3, i % 3, j % 3]
    moved = np.linalg.solve(np.eye(size) - np.dot(response, slope), gaps + np.dot(response, given))
    return np.asarray(given + np.dot(slope, moved))


@njit(cache=True)
def advance_tangent(
    ops: StepOperators,
    linear: TangentOperators,
    before: StepState,
    work: StepWork,
    tan: Tangent,
) -> None:
    """Carry the tangents over the step that `work` has just solved."""
    m, n = tan.moved.shape[0], linear.gaps.shape[1]
    active = _active(before, ops, work)
    np.dot(linear.stuck, tan.state, tan.moved)
    if active.size > 0:
        rows = np.empty(3 * active.size, dtype=np.int64)
        given = np.zeros((rows.size, tan.state.shape[1]))
        for a in range(active.size):
            c = active[a]
            gap_before = before.gap[3 * c : 3 * c + 3]
            for d in range(3):
                rows[3 * a + d] = 3 * c + d
            _given(c, gap_before, ops.law[c], work, tan, linear, given[3 * a : 3 * a + 3])
        gaps = np.dot(linear.gaps[rows], tan.moved[:n])
        beyond = m + rows
        change = _contact_changes(rows, given - tan.state[beyond], gaps, ops, work)
        for i in range(rows.size):
            tan.state[beyond[i]] += change[i]
        tan.moved[:] += np.dot(linear.hold[:, rows], change)
    tan.state[:m] = tan.moved


@njit(cache=True)
def _by_itself(before: StepState, ops: StepOperators, work: StepWork, tan: Tangent) -> bool:
    """Settle what grazes or has no friction; return whether the step's derivative depends on more than the contact states."""
    alone = False
    for c in range(work.code.size):
        _let_slide(c, ops.law[c], work)
        _hold_grazing(c, before, ops.law[c], work, tan)
        closed_by = ops.law[c, 4] - ops.law[c, 2] * before.gap[3 * c + 2]
        alone = alone or work.code[c] >= LANDING or (work.code[c] == STUCK and closed_by <= 0.0)
    return alone


@njit(cache=True)
def _advance_equal_steps(
    count: int,
    ops: StepOperators,
    linear: TangentOperators,
    before: StepState,
    work: StepWork,
    tan: Tangent,
    power: Tangent,
) -> None:
    """Carry the tangents over `count` steps in the same contact states: by squares of their common matrix."""
    if count <= SINGLY:
        for _ in range(count):
            advance_tangent(ops, linear, before, work, tan)
        return
    power.state[:] = np.eye(power.state.shape[0])
    advance_tangent(ops, linear, before, work, power)
    matrix = power.state.copy()
    while True:
        if count % 2 == 1:
            tan.state[:] = np.dot(matrix, tan.state)
        count //= 2
        if count == 0:
            return
        matrix = np.dot(matrix, matrix)


@njit(cache=True)
def run_tangent_period(
    ops: StepOperators,
    linear: TangentOperators,
    state: StepState,
    work: StepWork,
    record: StepRecord,
    tan: Tangent,
    equal: EqualSteps,
) -> int:
    """Advance `state` and its tangents by one period; return what `run_period` returns."""
    moved = np.empty(ops.hold.shape[1] + ops.hold.shape[0])
    before = StepState(state.x.copy(), state.gap.copy(), state.force.copy())
    failures, waiting = 0, 0
    for step in range(record.motion.shape[0]):
        before.gap[:] = state.gap
        before.force[:] = state.force
        if not advance(ops, state, work, step, moved):
            failures += 1
        write_record(record, state, step)
        if not np.isfinite(np.sum(state.x)):
            return -1
        alone = _by_itself(before, ops, work, tan)
        if alone or np.any(work.code != equal.work.code):
            _advance_equal_steps(waiting, ops, linear, before, equal.work, tan, equal.power)
            waiting = 0
        if alone:
            advance_tangent(ops, linear, before, work, tan)
            continue
        if waiting == 0:
            equal.work.code[:] = work.code
            equal.work.slope[:] = work.slope
        waiting += 1
    _advance_equal_steps(waiting, ops, linear, before, equal.work, tan, equal.power)
    return failures
