"""Compiled time step of `stickslip.response.time.transient`, for contacts of any law.

The linear structure with all contacts stuck is propagated exactly. The contact force minus the force of the stuck
springs, r, is linear within the step, and its value at the end is the unknown: it must agree with the laws at the
resulting gaps and rates. For a sticking contact, r does not depend on the gap.
"""

# mypy: disallow-untyped-decorators=False

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numba import typeof, types

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.law import OPEN
from stickslip.response.time.stepping.contact_step import (
    FORCE,
    GAP,
    RATE,
    ContactTable,
    StepState,
    evaluate,
    inner,
    large,
    law_work,
)
from stickslip.response.time.stepping.step_newton import (
    back_substitute,
    dot,
    factor_anew,
    factor_slopes,
    newton_work,
    slopes,
)

# Newton steps at full length before a cycle between contact states is broken, first by sticking, then by half steps
FULL_STEPS = 12
NEWTON_STEPS = 60
GAP_TOLERANCE = 1e-12  # relative to the largest gap: a few hundred roundings


class StepOperators(NamedTuple):
    """Matrices of one step; state ``x = (motion, r)``."""

    transfer: FloatArray  # (m + k, m), transposed: x -> motion at the end, with r held zero there
    drive: FloatArray  # (steps, m): motion due to the loads
    hold: FloatArray  # (k, m), transposed: r at the end of the step -> motion
    response: FloatArray  # (k, 2k), transposed: r at the end of the step -> gaps and rates
    gaps: FloatArray  # (k, m/2): displacements -> gaps
    rates: FloatArray  # (k, m/2): velocities -> rates of the gaps
    turn: FloatArray  # (4, m/2): `transfer` of uncoupled modes, q by q and w, w by q and w; (0, m/2) if coupled


class StepLog(NamedTuple):
    """Derivatives of the laws in every step, stored once for successive steps with the same derivatives."""

    jac: FloatArray  # (rows, ...) as `LawWork.jac`
    steps: IntArray  # (rows,) number of successive steps


# entries of a plan. Task: whether to evaluate the laws first, first step, number of steps, whether to fill the log.
# Result: steps taken, steps in which the contacts were not solved (-1: overflow), rows of the log
BEGIN, FIRST, STEPS, LOGS, TAKEN, FAILED, ROWS = range(7)


@inner
def _accumulate(matrix, x, out):  # type: ignore[no-untyped-def]
    """Add ``matrixᵀ x`` to `out`, for as many columns as it has.

    At this size plain loops are faster than a threaded BLAS.
    """
    whole = x.size - x.size % 4
    for j in range(0, whole, 4):
        a, b, c, d = x[j], x[j + 1], x[j + 2], x[j + 3]
        for i in range(out.size):
            out[i] += matrix[j, i] * a + matrix[j + 1, i] * b + matrix[j + 2, i] * c + matrix[j + 3, i] * d
    for j in range(whole, x.size):
        for i in range(out.size):
            out[i] += matrix[j, i] * x[j]


@inner
def _defect(ops, table, laws, work):  # type: ignore[no-untyped-def]
    """Write the defect of r against the laws at the iterate; return the largest change of a gap by it."""
    k, largest = work.r.size, 0.0
    for i in range(k):
        work.defect[i] = laws.seen[FORCE, i] - table.springs[i] * laws.seen[GAP, i] - work.r[i]
        if not np.isfinite(work.defect[i]):
            return np.inf
    for i in range(k):
        work.moves[i] = 0.0
    _accumulate(ops.response, work.defect, work.moves)
    for i in range(k):
        largest = max(largest, abs(work.moves[i]))
    return largest


@inner
def _at_guess(ops, laws, work):  # type: ignore[no-untyped-def]
    """Write gaps and rates of the iterate; return the largest gap."""
    k, scale = work.r.size, 0.0
    for i in range(k):
        laws.seen[GAP, i], laws.seen[RATE, i] = work.free[i], work.free[k + i]
        scale = max(scale, abs(work.free[i]))
    _accumulate(ops.response, work.r, laws.seen.reshape(3 * k)[: 2 * k])  # rows of gaps and rates
    for i in range(k):
        scale = max(scale, abs(laws.seen[GAP, i]))
    return scale


@inner
def _foresee(state, laws, work):  # type: ignore[no-untyped-def]
    """Predict r with the factorised derivatives; exact while piecewise-linear laws stay in their states."""
    k = work.r.size
    if k == 0 or np.isnan(work.factored[0, 0]):
        return
    for i in range(k):
        first = 3 * (i // 3)
        work.defect[i] = 0.0
        for b in range(6):
            slope = work.factored[i, b]
            if slope != 0.0:
                row, j = (GAP, first + b) if b < 3 else (RATE, first + b - 3)
                work.defect[i] += slope * (laws.seen[row, j] - state.seen[row, j])
    back_substitute(work)
    for i in range(k):
        if not np.isfinite(work.defect[i]):
            return
    for i in range(k):
        work.r[i] += work.defect[i]


@large
def _assume_stick(table, ops, state, work):  # type: ignore[no-untyped-def]
    """Restart with all contacts stuck or open: for steep laws the solution lies between slip in both directions."""
    k = work.r.size
    m = state.x.size - k
    for i in range(k):
        for b in range(6):
            work.slope[i, b] = 0.0
        closed = state.status[i // 3, 0] != OPEN
        work.slope[i, i % 3] = (table.stuck[i] if closed else 0.0) - table.springs[i]
        work.r[i] = state.x[m + i]
    factor_anew(ops, work)


@inner
def _solve_contacts(table, ops, state, laws, work, solves):  # type: ignore[no-untyped-def]
    """Solve for r at the end of a step by a semi-smooth Newton method; return whether it converged to rounding.

    For piecewise-linear laws, a step without a change of state is exact. Without `solves`, only evaluate the laws at
    the given gaps and rates.
    """
    for iteration in range(-1, NEWTON_STEPS):
        if iteration == FULL_STEPS:
            _assume_stick(table, ops, state, work)
        scale = _at_guess(ops, laws, work) if solves else np.inf
        if solves and (iteration < 0 or iteration == FULL_STEPS):
            _foresee(state, laws, work)
            continue
        evaluate(table, state, laws)
        largest = _defect(ops, table, laws, work)
        if not solves or largest <= GAP_TOLERANCE * scale * work.stiff[0]:
            return True
        if largest == np.inf:
            return False
        if not slopes(table, laws, work):
            factor_slopes(ops, work)
        back_substitute(work)
        length = 1.0 if iteration < 2 * FULL_STEPS else 0.5
        for i in range(work.r.size):
            work.r[i] += length * work.defect[i]
    return False


@inner
def _turn(turn, x, out):  # type: ignore[no-untyped-def]
    """Add the propagated motion of each mode."""
    n = turn.shape[1]
    for j in range(n):
        out[j] += turn[0, j] * x[j] + turn[1, j] * x[n + j]
        out[n + j] += turn[2, j] * x[j] + turn[3, j] * x[n + j]


@inner
def _take_over(table, state, laws):  # type: ignore[no-untyped-def]
    """Accept the forces and states of the laws as the new state."""
    k = table.springs.size
    m = state.x.size - k
    for i in range(k):
        for d in range(3):
            state.seen[d, i] = laws.seen[d, i]
        state.x[m + i] = laws.seen[FORCE, i] - table.springs[i] * laws.seen[GAP, i]
    for i in range(state.law.size):
        state.law[i] = laws.law[0, i]
    for c in range(table.weight.size):
        state.status[c, 0], state.status[c, 1] = laws.status[c, 0], laws.status[c, 1]


@inner
def _same(first, second):  # type: ignore[no-untyped-def]
    same = True
    for i in range(first.size):
        same = same and first[i] == second[i]
    return same


@large
def _keep(log, laws, rows):  # type: ignore[no-untyped-def]
    """Log the derivatives of a step; return the new number of rows."""
    if rows > 0 and _same(log.jac[rows - 1], laws.jac):
        log.steps[rows - 1] += 1
        return rows
    for i in range(laws.jac.size):
        log.jac[rows, i] = laws.jac[i]
    log.steps[rows] = 1
    return rows + 1


@inner
def _write(row, state, n):  # type: ignore[no-untyped-def]
    """Record displacements, gaps and forces at the end of a step; return whether the state is finite."""
    total, k = 0.0, state.seen.shape[1]
    for i in range(n):
        row[i] = state.x[i]
    for i in range(k):
        row[n + i], row[n + k + i] = state.seen[GAP, i], state.seen[FORCE, i]
    for i in range(state.x.size):
        total += state.x[i]
    return np.isfinite(total)


@inner
def _predict(ops, state, work, step):  # type: ignore[no-untyped-def]
    """Write motion, gaps and rates at the end of a step with zero r there; the initial guess of r is its last value."""
    n, k, moved, free = ops.gaps.shape[1], work.r.size, work.moved, work.free
    for j in range(moved.size):
        moved[j] = ops.drive[step, j]
    if ops.turn.shape[0] == 0:
        _accumulate(ops.transfer, state.x, moved)
    else:
        _turn(ops.turn, state.x, moved)
        _accumulate(ops.transfer[2 * n :], state.x[2 * n :], moved)
    for i in range(k):
        free[i], free[k + i] = dot(ops.gaps[i], moved[:n]), dot(ops.rates[i], moved[n:])
        work.r[i] = state.x[2 * n + i]


@inner
def _move(ops, state, work):  # type: ignore[no-untyped-def]
    """Add the effect of r at the end of the step to the motion."""
    moved, m = work.moved, work.moved.size
    _accumulate(ops.hold, state.x[m:], moved)
    for j in range(m):
        state.x[j] = moved[j]


def _run_steps(table, ops, state, laws, work, record, log, plan):  # type: ignore[no-untyped-def]
    """Take the steps of `plan` until the log is full."""
    k, n = table.springs.size, ops.gaps.shape[1]
    for j in range(k):
        laws.seen[GAP, j], laws.seen[RATE, j] = state.seen[GAP, j], state.seen[RATE, j]
    plan[TAKEN], plan[FAILED], plan[ROWS] = 0, 0, 0
    for i in range(-plan[BEGIN], plan[STEPS]):
        logs, step = plan[LOGS] != 0, plan[FIRST] + i
        if logs and plan[ROWS] == log.steps.size:
            return
        if i >= 0:
            _predict(ops, state, work, step)
        if not _solve_contacts(table, ops, state, laws, work, i >= 0):
            plan[FAILED] += 1
        _take_over(table, state, laws)
        if logs:
            plan[ROWS] = _keep(log, laws, plan[ROWS])
        if i >= 0:
            _move(ops, state, work)
            plan[TAKEN] += 1
            if not _write(record[step], state, n):
                plan[FAILED] = -1
                return


@cache
def run_steps() -> Any:
    """Return the compiled run of steps, ``run(table, ops, state, laws, work, record, log, plan)``."""
    vector, matrix = types.float64[::1], types.float64[:, ::1]
    counts, table = types.int64[::1], types.int64[:, ::1]
    named: Any = types.NamedTuple
    alike: Any = types.NamedUniTuple
    type_of: Any = typeof
    tuples = (
        named((table, vector, vector, vector, vector), ContactTable),
        alike(matrix, 7, StepOperators),
        named((vector, matrix, vector, table), StepState),
        type_of(law_work(0, 0, 0)),
        type_of(newton_work(0, 0)),
        matrix,
        named((matrix, counts), StepLog),
        counts,
    )
    return njit(types.void(*tuples), cache=True, error_model="numpy")(_run_steps)
