"""Forces of a contact law along any path of the gap, sample by sample, by the law's own step."""

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
