"""Compiled steps of one contact law along given gaps: forces, tangents at samples, and over whole steps with several parts."""

from functools import cache
from typing import Any

import numpy as np
from numba import types

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import law_address, law_at
from stickslip.contact.cache import njit
from stickslip.contact.law import ContactLaw

_SIGNATURE = types.void(
    types.int64,  # address of the law's step
    types.float64[::1],  # parameters
    types.float64[::1],  # state, changed
    types.float64[:, ::1],  # gap
    types.float64[:, ::1],  # force
    types.int64[:, ::1],  # status of each tangent
)


def forces_along(law: ContactLaw, gap: FloatArray, start: FloatArray | None = None) -> tuple[FloatArray, IntArray]:
    """Return forces and states along a quasi-static path of the gap, with zero velocities.

    Parameters
    ----------
    law
        A contact law.
    gap
        (n, 3) along t, w, n, m.
    start
        State before the first sample; None: `initial_state` of the law.

    Returns
    -------
    tuple
        (n, 3) forces in N, and (n, 2) states of the tangents: 0 stick, 1 slip, 2 open.
    """
    force, status = np.zeros(gap.shape), np.zeros((len(gap), 2), dtype=np.int64)
    state = np.array(law.initial_state() if start is None else start, dtype=float)
    path = np.ascontiguousarray(gap, dtype=float)
    _walk()(law_address(law.kernel), law.parameters(), state, path, force, status)
    return force, status


@cache
def _walk() -> Any:
    """Return `_march`, compiled at first use."""
    return njit(_SIGNATURE, cache=True)(_march)


def _march(address, parameters, state, gap, force, status):  # type: ignore[no-untyped-def]
    step = law_at(address)
    n_state = state.size
    new, rest = np.empty(n_state), np.zeros(3)
    jac = np.empty((3 + n_state, 6 + n_state))
    for i in range(gap.shape[0]):
        jac[:] = 0.0
        step(gap[i], rest, state, parameters, force[i], new, jac, status[i])
        state[:] = new


_matrix = types.float64[:, ::1]
_cube = types.float64[:, :, ::1]
_AT = types.void(
    types.int64,  # address of the law's step
    _matrix,  # gap
    _matrix,  # velocity
    _matrix,  # starts
    types.int64[::1],  # part
    types.float64[::1],  # parameters
    _cube,  # out
)
_ALONG = types.void(
    types.int64,  # address of the law's step
    types.int64,  # first
    _matrix,  # gap
    _matrix,  # velocity
    types.float64[::1],  # state
    types.float64[::1],  # parameters
    types.float64[::1],  # share
    types.int64[::1],  # samples
    _matrix,  # starts
    _cube,  # whole
)


@njit(_AT, cache=True)
def _tangents_at(address, gap, velocity, starts, part, parameters, out):  # type: ignore[no-untyped-def]
    """Fill the (k, 3, 6) derivatives of the forces, N/m and N s/m, by gaps and velocities (k, 3) at `k` times.

    The step at each begins with the state of its `part`, a row of `starts` (parts, s).
    """
    step = law_at(address)
    s = starts.shape[1]
    jac = np.zeros((3 + s, 6 + s))
    force, new, status = np.empty(3), np.empty(s), np.empty(2, np.int64)
    for i in range(gap.shape[0]):
        jac[:] = 0.0
        step(gap[i], velocity[i], starts[part[i]], parameters, force, new, jac, status)
        for a in range(3):
            for b in range(6):
                out[i, a, b] = jac[a, b]


@njit(cache=True)
def _chain(jac, carried, share, line):  # type: ignore[no-untyped-def]
    """Fill the (3 + s, 9 + s) derivatives after a part of a step.

    They are by gap, velocity, state and previous gap of the whole step.
    """
    s = carried.shape[0]
    for a in range(3 + s):
        for b in range(9 + s):
            total = 0.0
            for c in range(s):
                total += jac[a, 6 + c] * carried[c, b]
            line[a, b] = total
        for b in range(3):
            line[a, b] += share * jac[a, b]
            line[a, 6 + s + b] += (1.0 - share) * jac[a, b]
            line[a, 3 + b] += jac[a, 3 + b]


@njit(_ALONG, cache=True)
def _steps_along(address, first, gap, velocity, state, parameters, share, samples, starts, whole):  # type: ignore[no-untyped-def]
    """March a law along gaps and velocities (parts, 3) from its part `first`; `state` (s,) is changed in place.

    `samples` are the parts that end a step; `share` (parts,) is the position of each part's end within its step. The
    function fills the states `starts` (parts, s) with which the parts begin, and `whole` (samples, 3 + s, 9 + s): the
    derivatives of force and new state of a step by gap, velocity and state, and by the gap at the previous sample.
    """
    step = law_at(address)
    s = state.size
    jac, line = np.zeros((3 + s, 6 + s)), np.zeros((3 + s, 9 + s))
    carried = np.zeros((s, 9 + s))  # derivatives of the state by the gaps, velocity and state of the whole step
    force, new, status = np.empty(3), np.empty(s), np.empty(2, np.int64)
    for a in range(s):
        carried[a, 6 + a] = 1.0
    sample = 0
    while samples[sample] < first:
        sample += 1
    for i in range(first, gap.shape[0]):
        jac[:] = 0.0
        for a in range(s):
            starts[i, a] = state[a]
        step(gap[i], velocity[i], starts[i], parameters, force, new, jac, status)
        _chain(jac, carried, share[i], line)
        for a in range(s):
            state[a] = new[a]
        if i == samples[sample]:
            whole[sample] = line
            carried[:] = 0.0
            for a in range(s):
                carried[a, 6 + a] = 1.0
            sample += 1
        else:
            carried[:] = line[3:]


tangents_at: Any = _tangents_at
steps_along: Any = _steps_along
