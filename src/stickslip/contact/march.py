"""Forces and derivatives of any contact law over one period, sample by sample.

The state is marched from its start until it repeats from one period to the next; derivatives by the Fourier coefficients of the gaps
travel with it. Two periods are enough for independent tangents; with coupled ones the start is forgotten only gradually.
"""

import numba
import numpy as np
from numba import types

from stickslip.contact.law import PAIRS, STEP_SIGNATURE

MAX_PERIODS = 400
REPEATS = (
    1e-12  # change of a state from period to period, as a share of its range, that counts as none
)

_PAIRS = np.array(PAIRS)
_cube = types.float64[:, :, ::1]
_SIGNATURE = types.void(
    types.FunctionType(STEP_SIGNATURE),
    types.float64[:, ::1],  # parameters
    types.float64[:, ::1],  # start
    _cube,  # gap
    _cube,  # velocity
    types.float64[:, ::1],  # basis
    types.float64[:, ::1],  # basis_rate
    types.float64,  # omega
    _cube,  # force
    types.int64[:, :, ::1],  # state
    types.float64[:, :, :, ::1],  # blocks
    _cube,  # by_omega
    types.int64[::1],  # periods
)


@numba.njit(cache=True)
def _carry(jac, basis_row, rate_row, v_by_omega, rows, by_omega, out, out_omega, first, count):  # type: ignore[no-untyped-def]
    """Chain the derivatives of a step, `count` rows of its jac from row `first`, with those of the state (`rows`, `by_omega`)."""
    n_state, m = rows.shape[0], basis_row.size
    for a in range(count):
        line = jac[first + a]
        out_omega[a] = 0.0
        for b in range(3):
            u, v = line[b], line[3 + b]
            out_omega[a] += v * v_by_omega[b]
            for p in range(m):
                out[a, b, p] = u * basis_row[p] + v * rate_row[p]
        for s in range(n_state):
            share = line[6 + s]
            if share != 0.0:
                out_omega[a] += share * by_omega[s]
                for b in range(3):
                    for p in range(m):
                        out[a, b, p] += share * rows[s, b, p]


@numba.njit(cache=True)
def _repeats(now, before, low, high, rows, rows_before):  # type: ignore[no-untyped-def]
    """Whether the state and its derivatives are those of a period ago."""
    for s in range(now.size):
        if abs(now[s] - before[s]) > REPEATS * max(high[s] - low[s], abs(high[s]), abs(low[s])):
            return False
        size = 0.0
        change = 0.0
        for b in range(3):
            for p in range(rows.shape[2]):
                size = max(size, abs(rows[s, b, p]))
                change = max(change, abs(rows[s, b, p] - rows_before[s, b, p]))
        if change > 1e3 * REPEATS * max(size, 1.0):
            return False
    return True


@numba.njit(cache=True)
def _collect(c, jac, force_rows, basis_row, blocks):  # type: ignore[no-untyped-def]
    """Add the derivative of the force at one sample to the blocks of contact `c`."""
    m = basis_row.size
    for k in range(blocks.shape[1]):
        a, b = _PAIRS[k]
        if jac[a, b] == 0.0 and not np.any(force_rows[a, b] != 0.0):
            continue
        for p in range(m):
            share = basis_row[p] * (1.0 if p == 0 else 2.0)
            for q in range(m):
                blocks[c, k, p, q] += share * force_rows[a, b, q]


@numba.njit(cache=True)
def _load(c, i, gap, velocity, omega, u, v, v_by_omega):  # type: ignore[no-untyped-def]
    """Take displacement, velocity and its derivative by ω out of the period."""
    for a in range(3):
        u[a] = gap[c, a, i]
        v[a] = velocity[c, a, i]
        v_by_omega[a] = v[a] / omega if omega > 0.0 else 0.0


@numba.njit(cache=True)
def _workspace(n_state, m):  # type: ignore[no-untyped-def]
    """Arrays that a march writes on."""
    of_state = (n_state, 3, m)
    return (
        np.empty(3), np.empty(3), np.empty(3), np.empty(3),
        np.empty(n_state), np.empty(n_state), np.empty(n_state), np.empty(n_state), np.empty(n_state),
        np.empty((3 + n_state, 6 + n_state)), np.empty(of_state), np.empty(of_state), np.empty(of_state),
        np.empty((3, 3, m)), np.empty(n_state), np.empty(n_state), np.empty(3),
    )  # fmt: skip


@numba.njit(_SIGNATURE, cache=True)
def march_period(  # type: ignore[no-untyped-def]
    step, parameters, start, gap, velocity, basis, basis_rate, omega, force, state, blocks, by_omega, periods,
):  # fmt: skip
    """March contacts of one law until they are periodic; forces and derivatives are those of the last period.

    Parameters
    ----------
    step
        The law, compiled by `law_kernel`.
    parameters, start
        (n, n_parameters) and (n, n_state) of each contact.
    gap, velocity
        (n, 3, samples) in m and m/s.
    basis, basis_rate
        (samples, m) Fourier basis and its time derivative, 1/s.
    omega
        rad/s.
    force
        Out: (n, 3, samples), N.
    state
        Out: (n, 2, samples) 0 stick, 1 slip, 2 open.
    blocks
        Out: (n, P, m, m) derivatives of the Fourier coefficients of the force, in the order of `PAIRS`.
    by_omega
        Out: (n, 3, samples) derivative of the force by ω at fixed coefficients.
    periods
        Out: (n,) periods marched; -1 if the state did not repeat within the largest number.
    """
    n_samples, m = basis.shape
    n_state = start.shape[1]
    u, v, f, v_by_omega, s, new, before, low, high, jac, rows, new_rows, rows_before, force_rows, s_omega, new_omega, f_omega = _workspace(n_state, m)  # fmt: skip
    status = np.empty(2, np.int64)
    for c in range(gap.shape[0]):
        s[:] = start[c]
        rows[:] = 0.0
        s_omega[:] = 0.0
        first = -1 if np.any(np.isnan(s)) else 0
        periods[c] = -1
        for period in range(MAX_PERIODS):
            before[:] = s
            rows_before[:] = rows
            low[:] = np.inf
            high[:] = -np.inf
            blocks[c] = 0.0
            for i in range(first if period == 0 else 0, n_samples):
                _load(c, i, gap, velocity, omega, u, v, v_by_omega)
                jac[:] = 0.0
                step(u, v, s, parameters[c], f, new, jac, status)
                _carry(
                    jac,
                    basis[i],
                    basis_rate[i],
                    v_by_omega,
                    rows,
                    s_omega,
                    new_rows,
                    new_omega,
                    3,
                    n_state,
                )
                if period > 0:
                    _carry(
                        jac,
                        basis[i],
                        basis_rate[i],
                        v_by_omega,
                        rows,
                        s_omega,
                        force_rows,
                        f_omega,
                        0,
                        3,
                    )
                    _collect(c, jac, force_rows, basis[i], blocks)
                    force[c, :, i] = f
                    by_omega[c, :, i] = f_omega
                    state[c, :, i] = status
                s[:] = new
                s_omega[:] = new_omega
                rows[:] = new_rows
                np.minimum(low, s, low)
                np.maximum(high, s, high)
            if period > 0 and _repeats(s, before, low, high, rows, rows_before):
                periods[c] = period + 1
                break
        blocks[c] /= n_samples
