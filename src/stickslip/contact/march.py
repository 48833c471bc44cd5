"""Forces and derivatives of any contact law over one period, sample by sample.

The state is marched from its start until it is periodic, with its derivatives by the Fourier coefficients of the gaps.
One period is enough for a law without memory, two for independent tangents. Other laws forget their start only
gradually: a planar Coulomb contact near incipient slip or a Dahl contact in micro-slip would take hundreds of periods.
From the third period on, the derivative of the state after a period by the state before it is therefore marched, too,
and each period is followed by one Newton step towards the periodic state. The step also measures the distance to that
state, for which the change over a period is no measure if the start is forgotten slowly. Directions that never forget
their start, as of a spring that only sticks, stay where marching brought them.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from stickslip.contact.addresses import law_at
from stickslip.contact.cache import njit
from stickslip.contact.law import PAIRS

MAX_PERIODS = 400
ROUNDING = 1e-14  # change over a period that counts as zero, as a share of the state's range
SETTLED = 1e-12  # largest distance from the periodic state, in the same measure
# times ROUNDING: residual after a Newton step that counts as rounding if the start is forgotten slowly
NOISE = 10.0
ROWS = 1e3  # factor on ROUNDING and SETTLED for derivatives
KEPT = 1e-11  # singular value below which a direction never forgets its start

_PAIRS = np.array(PAIRS)
_cube = types.float64[:, :, ::1]
_SIGNATURE = types.void(
    types.int64,  # address of the law's step
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


@njit(cache=True)
def _carry(jac, basis_row, rate_row, v_by_omega, rows, by_omega, out, out_omega, first, count):  # type: ignore[no-untyped-def]
    """Chain the derivatives of a step with the derivatives of the state (`rows`, `by_omega`).

    Of the step's jac, `count` rows from row `first` are used.
    """
    n_state, m = rows.shape[0], basis_row.size
    for a in range(count):
        line = jac[first + a]
        out_omega[a] = 0.0
        for b in range(3):
            u, v = line[b], line[3 + b]
            if v == 0.0:
                for p in range(m):
                    out[a, b, p] = u * basis_row[p]
                continue
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


@njit(cache=True)
def _blocks_of(rows, basis, blocks):  # type: ignore[no-untyped-def]
    """Fill the (P, m, m) blocks of a contact from the (P, samples, m) derivatives of its force on samples."""
    n_samples, m = basis.shape
    for k in range(rows.shape[0]):
        np.dot(basis.T, rows[k], blocks[k])
        for p in range(m):
            share = (1.0 if p == 0 else 2.0) / n_samples
            for q in range(m):
                blocks[k, p, q] *= share


@njit(cache=True)
def _load(c, i, gap, velocity, omega, u, v, v_by_omega):  # type: ignore[no-untyped-def]
    """Read displacement, velocity and its derivative by ω at sample `i`."""
    for a in range(3):
        u[a] = gap[c, a, i]
        v[a] = velocity[c, a, i]
        v_by_omega[a] = v[a] / omega if omega > 0.0 else 0.0


@njit(cache=True)
def _carry_map(jac, period_map, new_map):  # type: ignore[no-untyped-def]
    """Chain the derivative of the state by the state at the beginning of the period."""
    n_state = period_map.shape[0]
    new_map[:] = 0.0
    for a in range(n_state):
        for s in range(n_state):
            share = jac[3 + a, 6 + s]
            if share != 0.0:
                for b in range(n_state):
                    new_map[a, b] += share * period_map[s, b]
    period_map[:] = new_map


@njit(cache=True)
def _workspace(n_state, n_pairs, n_samples, m):  # type: ignore[no-untyped-def]
    """Allocate the work arrays of a march.

    They are for a sample, for derivatives, for the ranges of the state, and for derivatives of the force on samples.
    """
    of_state = (n_state, 3, m)
    return (
        (
            np.empty(3),
            np.empty(3),
            np.empty(3),
            np.empty(3),
            np.empty(n_state),
            np.empty((3 + n_state, 6 + n_state)),
            np.empty(2, np.int64),
        ),
        (np.empty(of_state), np.empty(n_state), np.empty((3, 3, m)), np.empty(3), np.empty((n_state, n_state))),
        (np.empty(n_state), np.empty(n_state)),
        np.empty((n_pairs, n_samples, m)),
    )


@njit(cache=True)
def _one_period(  # type: ignore[no-untyped-def]
    step,
    parameters,
    c,
    first,
    gap,
    velocity,
    basis,
    basis_rate,
    omega,
    s,
    rows,
    s_omega,
    period_map,
    work,
    record,
    track,
    force,
    state,
    by_omega,
):
    """March one contact over a period from the state `s`, with its derivatives and, if `track`, the `period_map`."""
    u, v, v_by_omega, f, new, jac, status = work[0]
    new_rows, new_omega, force_rows, f_omega, new_map = work[1]
    low, high = work[2]
    force_history = work[3]
    n_state = s.size
    low[:] = np.inf
    high[:] = -np.inf
    if track:
        period_map[:] = 0.0
        for a in range(n_state):
            period_map[a, a] = 1.0
    for i in range(first, basis.shape[0]):
        _load(c, i, gap, velocity, omega, u, v, v_by_omega)
        jac[:] = 0.0
        step(u, v, s, parameters[c], f, new, jac, status)
        _carry(jac, basis[i], basis_rate[i], v_by_omega, rows, s_omega, new_rows, new_omega, 3, n_state)
        if record:
            _carry(jac, basis[i], basis_rate[i], v_by_omega, rows, s_omega, force_rows, f_omega, 0, 3)
            for k in range(force_history.shape[0]):
                force_history[k, i] = force_rows[_PAIRS[k, 0], _PAIRS[k, 1]]
            for a in range(3):
                force[c, a, i] = f[a]
                by_omega[c, a, i] = f_omega[a]
            state[c, 0, i], state[c, 1, i] = status[0], status[1]
        if track:
            _carry_map(jac, period_map, new_map)
        rows[:] = new_rows
        for a in range(n_state):
            s[a], s_omega[a] = new[a], new_omega[a]
            low[a], high[a] = np.minimum(low[a], s[a]), np.maximum(high[a], s[a])


@njit(cache=True)
def _scales(ranges, largest_gap, scale, row_scale, rows):  # type: ignore[no-untyped-def]
    """Set the scale of each state and of its derivatives, relative to which rounding hides a change."""
    low, high = ranges
    for a in range(scale.size):
        size = max(high[a] - low[a], abs(high[a]), abs(low[a]))
        scale[a] = size if size > 0.0 else 1.0
        row_scale[a] = max(np.max(np.abs(rows[a])), size / largest_gap)
        if row_scale[a] == 0.0:
            row_scale[a] = 1.0


@njit(cache=True)
def _largest(change, scale):  # type: ignore[no-untyped-def]
    """Return the largest entry of (n_state, ...) `change` in units of each state's `scale`."""
    out = 0.0
    for a in range(scale.size):
        size = np.max(np.abs(change[a])) / scale[a]
        if not size <= out:
            out = size  # NaN counts as large, too
    return out


@njit(cache=True)
def _to_fixed_point(period_map, scale, change, row_change, omega_change):  # type: ignore[no-untyped-def]
    """Convert the changes over a period into the steps to the periodic state and its derivatives, in place.

    They solve ``(1 - M) step = change`` with the period map M, by least squares without the directions that M never
    forgets.
    """
    n_state = scale.size
    matrix = np.empty((n_state, n_state))
    for a in range(n_state):
        for b in range(n_state):
            matrix[a, b] = (1.0 if a == b else 0.0) - period_map[a, b] * scale[b] / scale[a]
    left, sizes, right = np.linalg.svd(matrix)
    inverse = np.zeros((n_state, n_state))
    for k in range(n_state):
        if sizes[k] > KEPT:
            for a in range(n_state):
                for b in range(n_state):
                    inverse[a, b] += right[k, a] * left[b, k] / sizes[k]
    for a in range(n_state):
        for b in range(n_state):
            inverse[a, b] *= scale[a] / scale[b]
    change[:] = inverse @ change
    omega_change[:] = inverse @ omega_change
    flat = np.ascontiguousarray(row_change).reshape(n_state, -1)
    row_change[:] = (inverse @ flat).reshape(row_change.shape)


@njit(cache=True)
def _settle(  # type: ignore[no-untyped-def]
    step, parameters, c, first, gap, velocity, basis, basis_rate, omega, s, rows, s_omega, work, force, state, by_omega
):
    """March contact `c` from the state `s` until it is periodic; return the number of periods, or -1."""
    n_state = s.size
    scale, row_scale = np.empty(n_state), np.empty(n_state)
    period_map = np.empty((n_state, n_state))
    largest_gap = max(np.max(np.abs(gap[c])), 1e-300)
    safe, safe_rows, safe_omega = s.copy(), rows.copy(), s_omega.copy()
    last, plain, patience = np.inf, 0, 1
    memory = n_state > 0
    _one_period(
        step,
        parameters,
        c,
        first,
        gap,
        velocity,
        basis,
        basis_rate,
        omega,
        s,
        rows,
        s_omega,
        period_map,
        work,
        not memory,
        False,
        force,
        state,
        by_omega,
    )
    if not memory:
        return 1
    for period in range(1, MAX_PERIODS):
        before, rows_before, omega_before = s.copy(), rows.copy(), s_omega.copy()
        track = period > 1
        _one_period(
            step,
            parameters,
            c,
            0,
            gap,
            velocity,
            basis,
            basis_rate,
            omega,
            s,
            rows,
            s_omega,
            period_map,
            work,
            True,
            track,
            force,
            state,
            by_omega,
        )
        _scales(work[2], largest_gap, scale, row_scale, rows)
        change, row_change, omega_change = s - before, rows - rows_before, s_omega - omega_before
        moved, turned = _largest(change, scale), _largest(row_change, row_scale)
        if moved <= ROUNDING and turned <= ROWS * ROUNDING:
            return period + 1
        if not track:
            continue
        _to_fixed_point(period_map, scale, change, row_change, omega_change)
        distance, row_distance = _largest(change, scale), _largest(row_change, row_scale)
        noise = NOISE * ROUNDING if last < np.inf else ROUNDING
        if (moved <= noise or distance <= SETTLED) and (turned <= ROWS * noise or row_distance <= ROWS * SETTLED):
            return period + 1
        if plain > 0:
            plain -= 1
        elif moved > 0.5 * last or not np.isfinite(distance + row_distance):
            # the last step made it worse: march on from the state before it
            s[:], rows[:], s_omega[:] = safe, safe_rows, safe_omega
            last, plain, patience = np.inf, patience, 2 * patience
        else:
            last = moved
            safe[:], safe_rows[:], safe_omega[:] = s, rows, s_omega
            s[:], rows[:], s_omega[:] = before + change, rows_before + row_change, omega_before + omega_change
    return -1


@cache
def period_march() -> Any:
    """Return `march_period`, compiled at first use: compiling takes half a minute, and exact events do not need it."""
    return njit(_SIGNATURE, cache=True)(march_period)


def march_period(  # type: ignore[no-untyped-def]
    address, parameters, start, gap, velocity, basis, basis_rate, omega, force, state, blocks, by_omega, periods
):
    """March contacts of one law until they are periodic; return forces and derivatives of the last period.

    Parameters
    ----------
    address
        Address of the compiled step of the law, from `law_address`.
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
        Out: (n,) number of periods marched; -1 if the state did not become periodic within `MAX_PERIODS`.
    """
    step = law_at(address)
    n_samples, m = basis.shape
    n_state = start.shape[1]
    work = _workspace(n_state, blocks.shape[1], n_samples, m)
    s, s_omega, rows = np.empty(n_state), np.empty(n_state), np.empty((n_state, 3, m))
    for c in range(gap.shape[0]):
        s[:] = start[c]
        s_omega[:] = 0.0
        rows[:] = 0.0
        first = -1 if np.any(np.isnan(s)) else 0
        periods[c] = _settle(
            step,
            parameters,
            c,
            first,
            gap,
            velocity,
            basis,
            basis_rate,
            omega,
            s,
            rows,
            s_omega,
            work,
            force,
            state,
            by_omega,
        )
        _blocks_of(work[3], basis, blocks[c])
