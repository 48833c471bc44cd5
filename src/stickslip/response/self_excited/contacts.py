"""Contact forces and dissipation in a self-excited motion."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.element import K_T, MU, PRELOAD, UNILATERAL
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, SLIP, STICK, ContactLaw, PiecewiseLinear
from stickslip.response.self_excited.problem import SelfExcited

FAR = 1e6  # m: whatever can slip has slipped there, of a model without dimensions, too


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts over one period.

    Attributes
    ----------
    slipping
        Share of the contact points that can slip or open and do so, or close, at some time; NaN where none can. A contact of several
        sliders counts with the share of them that slip: it is 1 in gross slip alone.
    sticking
        Share of those that stick all the time, of several sliders likewise.
    open_for
        Largest share of the period for which one is open.
    """

    slipping: float
    sticking: float
    open_for: float


def contacts_of(problem: SelfExcited, y: FloatArray, amplitude: float) -> Contacts:
    """Return what contacts do in a motion given by its unknowns over an amplitude, m."""
    balance = problem.at_amplitude(problem.balance, float(np.log(amplitude)))
    period = balance.contacts(y[:-2], problem.omega(y))
    state, leaves = period.state, leaving(problem.system.interface)
    # one that stays open does nothing
    slips = np.any(state == SLIP, axis=(1, 2)) | np.any(state != state[:, :, :1], axis=(1, 2))
    stays = np.all(state == STICK, axis=(1, 2))
    moved, stuck = slips.astype(float), stays.astype(float)
    for c, travels in _sliders(problem.system.interface).items():
        moved[c] = np.mean(np.any(np.ptp(period.gap[c, :2], axis=1) > travels, axis=1))
        stuck[c] = 1.0 - moved[c]
    share = float(np.mean(moved[leaves])) if np.any(leaves) else np.nan
    opened = np.mean(np.any(state == OPEN, axis=1), axis=1)
    sticks = float(np.mean(stuck[leaves])) if np.any(leaves) else np.nan
    return Contacts(share, sticks, float(np.max(opened, initial=0.0)))


@lru_cache(maxsize=8)
def _sliders(interface: Interface) -> dict[int, FloatArray]:
    """Return of each contact of several sliders the (n, 2) travels from turn to turn along t and w, m, beyond which they slip."""
    found: dict[int, FloatArray] = {}
    for law in interface.laws:
        if id(law) not in found:
            found[id(law)] = _travels(law)
    every = {c: found[id(law)] for c, law in enumerate(interface.laws)}
    return {c: travels for c, travels in every.items() if len(travels) > 1}


def _travels(law: ContactLaw) -> FloatArray:
    """Return the travels of the sliders of a law whose limits are constant, elastic springs left out; of others none."""
    rows = law.elements() if isinstance(law, PiecewiseLinear) else np.zeros((0, UNILATERAL + 1))
    if np.any(rows[:, UNILATERAL]):
        return np.zeros((0, 2))
    k, limit = rows[:, K_T : K_T + 2], np.tile(rows[:, MU] * rows[:, PRELOAD], (2, 1)).T
    travels = np.divide(2.0 * limit, k, out=np.full(k.shape, np.inf), where=k > 0.0)
    return np.asarray(travels[np.any(np.isfinite(travels), axis=1)])


@lru_cache(maxsize=8)
def leaving(interface: Interface) -> BoolArray:
    """Return the contact points (p,) whose law slips or opens at some gap."""
    found: dict[int, bool] = {}
    for law in interface.laws:
        found.setdefault(id(law), _leaves(law))
    leaves = np.array([found[id(law)] for law in interface.laws], dtype=bool)
    leaves.setflags(write=False)
    return leaves


def _leaves(law: ContactLaw) -> bool:
    """Tell whether a law leaves the state of sticking far along its tangents or far away."""
    return any(_state(law, gap) for gap in FAR * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]]))


def _state(law: ContactLaw, gap: FloatArray) -> bool:
    state = law.initial_state()
    jac = np.zeros((3 + state.size, 6 + state.size))
    status = np.empty(2, dtype=np.int64)
    after = np.empty_like(state)
    law.kernel(gap, np.zeros(3), state, law.parameters(), np.empty(3), after, jac, status)
    return bool(np.any(status != STICK))
