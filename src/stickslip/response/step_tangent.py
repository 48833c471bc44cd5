"""The derivative of the compiled time step, for `stickslip.response.shooting`.

The state of a motion has a tangent, one column for each direction in which its start may change. A step that ends with
every contact sticking is linear and the same for all states; what the other contacts add is a small system of equations
with the active set in which the step was solved.
"""

# mypy: disallow-untyped-decorators=False

from typing import NamedTuple

import numpy as np
from numba import njit

from stickslip.arrays import FloatArray
from stickslip.response.time_step import (
    StepOperators,
    StepRecord,
    StepState,
    StepWork,
    advance,
    write_record,
)

STUCK = 1  # the code of a contact that is closed, held both ways, and was closed before
LANDING = 10  # and above: the gap closes within the step


class TangentOperators(NamedTuple):
    """Matrices of a step that act on tangents."""

    stuck: FloatArray  # (m, m + k): (motion, r) -> motion, with r unchanged over the step
    gaps: FloatArray  # (k, n): modal displacements -> gaps


class Tangent(NamedTuple):
    """Derivatives of the state, one column a direction."""

    state: FloatArray  # (m + k, columns): of (motion, r)
    moved: FloatArray  # (m, columns): scratch
    gap: FloatArray  # (k, columns): scratch
    known: FloatArray  # (k, columns): scratch


def tangent_operators(ops: StepOperators, gaps: FloatArray) -> TangentOperators:
    """Return the matrices that the tangents need; `gaps` (k, n) turns modal displacements into gaps."""
    k, m = ops.hold.shape
    stuck = np.array(ops.transfer[:, :m].T)
    stuck[:, m : m + k] += ops.hold.T
    return TangentOperators(np.ascontiguousarray(stuck), np.ascontiguousarray(gaps))


def fresh_tangent(state: FloatArray, k: int) -> Tangent:
    """Return `state` (m + k, columns) with its scratch arrays."""
    columns = state.shape[1]
    scratch = (np.zeros((rows, columns)) for rows in (len(state) - k, k, k))
    return Tangent(np.array(state, dtype=float, order="C"), *scratch)


@njit(cache=True)
def _given(
    c: int, gap_before: FloatArray, law: FloatArray, work: StepWork, m: int, tan: Tangent, ops: TangentOperators
) -> None:
    """Write to ``known`` the derivative of the contact's r by what it was before the step."""
    columns, n = tan.state.shape[1], ops.gaps.shape[1]
    normal, closed_by = law[4] - law[2] * work.gap[3 * c + 2], law[4] - law[2] * gap_before[2]
    slips = work.code[c] - (LANDING if work.code[c] >= LANDING else STUCK)  # t in units, w in threes
    for d in range(3):
        row = tan.known[3 * c + d]
        row[:] = 0.0
        if work.code[c] == 0 or d == 2 or (d == 0 and slips % 3 > 0) or (d == 1 and slips > 2):
            continue
        row[:] = tan.state[m + 3 * c + d]
        if work.code[c] < LANDING:
            continue
        # takes hold within the step: force = force before + share k (gap - gap before), see _contact
        share = normal / (normal - closed_by)
        by_normal = -law[2] * normal / (normal - closed_by) ** 2
        travel = law[d] * (work.gap[3 * c + d] - gap_before[d])
        for j in range(n):
            factor = law[d] * (1.0 - share) * ops.gaps[3 * c + d, j]
            factor += travel * by_normal * ops.gaps[3 * c + 2, j]
            for col in range(columns):
                row[col] += factor * tan.state[j, col]


@njit(cache=True)
def _solve(matrix: FloatArray, right: FloatArray) -> None:
    """Overwrite `right` (size, columns) with the solution; Gauss with row pivoting, of a small matrix."""
    size, columns = right.shape
    for j in range(size):
        best = j
        for i in range(j + 1, size):
            if abs(matrix[i, j]) > abs(matrix[best, j]):
                best = i
        if best != j:
            for i in range(size):
                matrix[j, i], matrix[best, i] = matrix[best, i], matrix[j, i]
            for col in range(columns):
                right[j, col], right[best, col] = right[best, col], right[j, col]
        for i in range(j + 1, size):
            factor = matrix[i, j] / matrix[j, j]
            if factor != 0.0:
                for col in range(j + 1, size):
                    matrix[i, col] -= factor * matrix[j, col]
                for col in range(columns):
                    right[i, col] -= factor * right[j, col]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            for col in range(columns):
                right[i, col] -= matrix[i, j] * right[j, col]
        for col in range(columns):
            right[i, col] /= matrix[i, i]


@njit(cache=True)
def _contact_changes(
    active: FloatArray, ops: StepOperators, work: StepWork, m: int, tan: Tangent
) -> None:
    """Replace ``known`` of the active contacts by the change of their r over the step."""
    size, columns = 3 * active.size, tan.state.shape[1]
    matrix, right = np.empty((size, size)), np.zeros((size, columns))
    where = np.empty(size, dtype=np.int64)
    for a in range(active.size):
        for d in range(3):
            where[3 * a + d] = 3 * active[a] + d
    for i in range(size):
        tan.known[where[i]] -= tan.state[m + where[i]]
    for i in range(size):
        right[i] = tan.gap[where[i]]
        for j in range(size):
            response = ops.response[where[j], where[i]]
            right[i] += response * tan.known[where[j]]
            total = 1.0 if i == j else 0.0
            for d in range(3):
                total -= ops.response[3 * active[j // 3] + d, where[i]] * work.slope[active[j // 3], d, j % 3]
            matrix[i, j] = total
    _solve(matrix, right)
    for a in range(active.size):
        for d in range(3):
            for e in range(3):
                slope = work.slope[active[a], d, e]
                if slope != 0.0:
                    tan.known[3 * active[a] + d] += slope * right[3 * a + e]


@njit(cache=True)
def advance_tangent(
    ops: StepOperators,
    linear: TangentOperators,
    gap_before: FloatArray,
    work: StepWork,
    tan: Tangent,
) -> None:
    """Carry the tangents over the step that `work` has just solved."""
    m, n = tan.moved.shape[0], linear.gaps.shape[1]
    np.dot(linear.stuck, tan.state, tan.moved)
    active = np.empty(work.code.size, dtype=np.int64)
    count = 0
    for c in range(work.code.size):
        closed_by = ops.law[c, 4] - ops.law[c, 2] * gap_before[3 * c + 2]
        if work.code[c] != STUCK or closed_by <= 0.0:
            active[count] = c
            count += 1
            _given(c, gap_before[3 * c : 3 * c + 3], ops.law[c], work, m, tan, linear)
    if count > 0:
        np.dot(linear.gaps, tan.moved[:n], tan.gap)
        _contact_changes(active[:count], ops, work, m, tan)
    for a in range(count):
        for d in range(3):
            i = 3 * active[a] + d
            tan.state[m + i] += tan.known[i]
            for row in range(m):
                tan.moved[row] += ops.hold[i, row] * tan.known[i]
    tan.state[:m] = tan.moved


@njit(cache=True)
def run_tangent_period(
    ops: StepOperators,
    linear: TangentOperators,
    state: StepState,
    work: StepWork,
    record: StepRecord,
    tan: Tangent,
) -> int:
    """Advance `state` and its tangents by one period; return what `run_period` returns."""
    moved = np.empty(ops.hold.shape[1] + ops.hold.shape[0])
    gap_before = np.empty(state.gap.size)
    failures = 0
    for step in range(record.motion.shape[0]):
        gap_before[:] = state.gap
        if not advance(ops, state, work, step, moved):
            failures += 1
        write_record(record, state, step)
        if not np.isfinite(np.sum(state.x)):
            return -1
        advance_tangent(ops, linear, gap_before, work, tan)
    return failures
