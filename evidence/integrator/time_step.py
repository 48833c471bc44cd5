"""The compiled time step of `evidence.integrator.transient`, with its own elastic Coulomb law.

Nothing here is shared with the laws that the harmonic balance uses: the two are compared with each other.
"""

# mypy: disallow-untyped-decorators=False

from typing import NamedTuple

import numpy as np
from numba import njit

from stickslip.arrays import FloatArray, IntArray

FULL_STEPS = 12  # Newton steps taken at full length before they are halved to break a cycle between two states
NEWTON_STEPS = 60
GAP_TOLERANCE = 1e-12  # of the largest gap: some hundred roundings


class StepOperators(NamedTuple):
    """Matrices of one step; state ``x = (motion, r)``, r being the contact force beyond the stuck springs."""

    transfer: (
        FloatArray  # (m + k, m + k), transposed: x -> motion and gaps at the end of the step, with r held zero there
    )
    drive: FloatArray  # (steps, m + k): what the loads add to that
    hold: FloatArray  # (k, m), transposed: r at the end of the step -> motion
    response: FloatArray  # (k, k): r at the end of the step -> gaps
    law: FloatArray  # (n_contacts, 5): k_t, k_w, k_n, mu, preload


class StepState(NamedTuple):
    """State between steps; x as in `StepOperators`."""

    x: FloatArray  # (m + k,)
    gap: FloatArray  # (k,)
    force: FloatArray  # (k,)


class StepRecord(NamedTuple):
    """One period, sampled at the end of every step."""

    motion: FloatArray  # (steps, n) modal displacements
    gap: FloatArray  # (steps, k)
    force: FloatArray  # (steps, k)


class StepWork(NamedTuple):
    """Arrays that the contact solve writes to, so that no step allocates."""

    gap: FloatArray  # (k,) iterate
    force: FloatArray  # (k,) there
    defect: FloatArray  # (k,)
    slope: FloatArray  # (n_contacts, 3, 3): derivative of the force beyond the stuck springs
    code: IntArray  # (n_contacts,) contact state there
    factor: FloatArray  # (k, k) LU of the Newton matrix
    pivot: IntArray  # (k,)
    factored: IntArray  # (n_contacts,) contact states that the LU belongs to


@njit(cache=True)
def _contact(
    gap: FloatArray, before: FloatArray, force_before: FloatArray, law: FloatArray, force: FloatArray, slope: FloatArray
) -> int:
    """Step one contact: write its force and derivative; return 0 open, 1-9 closed, 10-18 landing in this step."""
    slope[:, :] = 0.0
    force[:] = 0.0
    normal = law[4] - law[2] * gap[2]
    if normal <= 0.0:
        return 0
    normal_before = law[4] - law[2] * before[2]
    share, share_slope, code = 1.0, 0.0, 1
    if normal_before < 0.0:
        # The slider takes hold where the gap closes within the step, not at its beginning: without this the force would
        # be off by an amount of first order for the rest of the sticking phase.
        share = normal / (normal - normal_before)
        share_slope = law[2] * normal_before / (normal - normal_before) ** 2
        code = 10
    force[2] = -normal
    slope[2, 2] = law[2]
    limit = law[3] * normal
    for d in range(2):
        travel = law[d] * (gap[d] - before[d])
        trial = force_before[d] + share * travel
        if abs(trial) <= limit:
            force[d] = trial
            slope[d, d] = share * law[d]
            slope[d, 2] = travel * share_slope
        else:
            sign = 1.0 if trial > 0.0 else -1.0
            force[d] = sign * limit
            slope[d, 2] = -sign * law[3] * law[2]
            code += (1 if sign > 0.0 else 2) * (1 if d == 0 else 3)
    return code


@njit(cache=True)
def _evaluate(free: FloatArray, ops: StepOperators, before: StepState, work: StepWork) -> float:
    """Contact forces and the defect of ``gap = free + response r(gap)`` at the iterate; return its largest entry."""
    n_contacts, k = work.code.size, work.gap.size
    for c in range(n_contacts):
        part = slice(3 * c, 3 * c + 3)
        work.code[c] = _contact(
            work.gap[part], before.gap[part], before.force[part], ops.law[c], work.force[part], work.slope[c]
        )
        for d in range(3):
            work.slope[c, d, d] -= ops.law[c, d]
    largest = 0.0
    for i in range(k):
        work.defect[i] = free[i] - work.gap[i]
    for j in range(k):
        beyond = work.force[j] - ops.law[j // 3, j % 3] * work.gap[j]
        for i in range(k):
            work.defect[i] += ops.response[j, i] * beyond
    for i in range(k):
        largest = max(largest, abs(work.defect[i]))
        if not np.isfinite(work.defect[i]):
            return np.inf
    return largest


@njit(cache=True)
def _newton_matrix(ops: StepOperators, work: StepWork) -> None:
    """Write ``I - response slope`` where its LU will be."""
    k = work.gap.size
    for i in range(k):
        for j in range(k):
            total = 1.0 if i == j else 0.0
            for d in range(3):
                total -= ops.response[3 * (j // 3) + d, i] * work.slope[j // 3, d, j % 3]
            work.factor[i, j] = total


@njit(cache=True)
def _factor(ops: StepOperators, work: StepWork) -> None:
    """LU of the Newton matrix with row pivoting, kept for as long as no contact changes its state."""
    k = work.gap.size
    _newton_matrix(ops, work)
    lu = work.factor
    for j in range(k):
        best = j
        for i in range(j + 1, k):
            if abs(lu[i, j]) > abs(lu[best, j]):
                best = i
        work.pivot[j] = best
        for i in range(k):
            lu[j, i], lu[best, i] = lu[best, i], lu[j, i]
        for i in range(j + 1, k):
            if lu[i, j] != 0.0:
                lu[i, j] /= lu[j, j]
                for col in range(j + 1, k):
                    lu[i, col] -= lu[i, j] * lu[j, col]
    work.factored[:] = work.code


@njit(cache=True)
def _back_substitute(work: StepWork) -> None:
    """Overwrite the defect with the Newton step that removes it."""
    k = work.gap.size
    lu, x = work.factor, work.defect
    for j in range(k):
        x[j], x[work.pivot[j]] = x[work.pivot[j]], x[j]
    for i in range(k):
        for j in range(i):
            x[i] -= lu[i, j] * x[j]
    for i in range(k - 1, -1, -1):
        for j in range(i + 1, k):
            x[i] -= lu[i, j] * x[j]
        x[i] /= lu[i, i]


@njit(cache=True)
def _solve_contacts(free: FloatArray, ops: StepOperators, before: StepState, work: StepWork) -> bool:
    """Semi-smooth Newton for the gaps at the end of a step; return whether it reached rounding.

    Within a contact state the force is affine in the gap, so that a step which ends in the state it was taken in is exact.
    """
    scale = 0.0
    for i in range(free.size):
        scale = max(scale, abs(free[i]), abs(work.gap[i]))
    for iteration in range(NEWTON_STEPS):
        largest = _evaluate(free, ops, before, work)
        if largest <= GAP_TOLERANCE * scale:
            return True
        if largest == np.inf:
            return False
        stale = False
        for c in range(work.code.size):
            stale = stale or work.code[c] != work.factored[c] or work.code[c] >= 10
        if stale:
            _factor(ops, work)
        _back_substitute(work)
        length = 1.0 if iteration < FULL_STEPS else 0.5
        for i in range(work.gap.size):
            work.gap[i] += length * work.defect[i]
    return False


@njit(cache=True)
def _accumulate(matrix: FloatArray, x: FloatArray, out: FloatArray) -> None:
    """``out += matrixᵀ x``: plain loops, because calling a threaded BLAS costs more than it saves at this size."""
    whole = x.size - x.size % 4
    for j in range(0, whole, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        for i in range(out.size):
            out[i] += matrix[j, i] * a + matrix[j + 1, i] * b + matrix[j + 2, i] * c + matrix[j + 3, i] * d
    for j in range(whole, x.size):
        for i in range(out.size):
            out[i] += matrix[j, i] * x[j]


@njit(cache=True)
def advance(ops: StepOperators, state: StepState, work: StepWork, step: int, moved: FloatArray) -> bool:
    """Take one step of `state`, with `moved` (m + k,) to write to; return whether the contacts were solved."""
    m, k = ops.hold.shape[1], ops.hold.shape[0]
    moved[:] = ops.drive[step]
    _accumulate(ops.transfer, state.x, moved)
    free = moved[m:]
    # First guess: the contact force does not change over the step.
    work.gap[:] = free
    _accumulate(ops.response, state.x[m:], work.gap)
    solved = _solve_contacts(free, ops, state, work)
    for i in range(k):
        state.x[m + i] = work.force[i] - ops.law[i // 3, i % 3] * work.gap[i]
    _accumulate(ops.hold, state.x[m:], moved[:m])
    state.x[:m] = moved[:m]
    state.gap[:] = work.gap
    state.force[:] = work.force
    return bool(solved)


@njit(cache=True)
def write_record(record: StepRecord, state: StepState, step: int) -> None:
    """Keep the state at the end of a step."""
    record.motion[step] = state.x[: record.motion.shape[1]]
    record.gap[step] = state.gap
    record.force[step] = state.force


@njit(cache=True)
def run_period(ops: StepOperators, state: StepState, work: StepWork, record: StepRecord) -> int:
    """Advance `state` by one period; return the number of failed steps, or -1 if the motion overflowed."""
    moved = np.empty(ops.hold.shape[1] + ops.hold.shape[0])
    failures = 0
    for step in range(record.motion.shape[0]):
        if not advance(ops, state, work, step, moved):
            failures += 1
        write_record(record, state, step)
        if not np.isfinite(np.sum(state.x)):
            return -1
    return failures


def step_workspace(k: int) -> StepWork:
    """Return fresh work arrays for `k` gaps."""
    return StepWork(
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros((k // 3, 3, 3)),
        np.zeros(k // 3, dtype=np.int64),
        np.zeros((k, k)),
        np.zeros(k, dtype=np.int64),
        np.full(k // 3, -1, dtype=np.int64),
    )
