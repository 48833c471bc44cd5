"""What contacts do in a motion that nothing drives."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, SLIP, STICK, ContactLaw
from stickslip.response.self_excited.problem import SelfExcited

FAR = 1e6  # m: whatever can slip has slipped there, of a model without dimensions, too


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts over one period.

    Attributes
    ----------
    slipping
        Share of the contact points that can slip or open and do so, or close, at some time; NaN where none can.
    sticking
        Share of those that stick all the time.
    open_for
        Largest share of the period for which one is open.
    """

    slipping: float
    sticking: float
    open_for: float


def contacts_of(problem: SelfExcited, y: FloatArray, amplitude: float) -> Contacts:
    """Return what contacts do in a motion given by its unknowns over an amplitude, m."""
    balance = problem.at_amplitude(problem.balance, float(np.log(amplitude)))
    state = balance.contacts(y[:-2], problem.omega(y)).state
    leaves = leaving(problem.system.interface)
    # one that stays open does nothing
    moved = np.any(state == SLIP, axis=(1, 2)) | np.any(state != state[:, :, :1], axis=(1, 2))
    share = float(np.mean(moved[leaves])) if np.any(leaves) else np.nan
    opened = np.mean(np.any(state == OPEN, axis=1), axis=1)
    stuck = np.all(state == STICK, axis=(1, 2))
    sticks = float(np.mean(stuck[leaves])) if np.any(leaves) else np.nan
    return Contacts(share, sticks, float(np.max(opened, initial=0.0)))


def leaving(interface: Interface) -> BoolArray:
    """Return the contact points (p,) whose law slips or opens at some gap."""
    found: dict[int, bool] = {}
    for law in interface.laws:
        found.setdefault(id(law), _leaves(law))
    return np.array([found[id(law)] for law in interface.laws], dtype=bool)


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
