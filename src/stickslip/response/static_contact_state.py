"""Contacts under static loads: forces, and the state for small vibrations."""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, ContactLaw
from stickslip.harmonic.aft import contact_forces
from stickslip.response.equilibrium import preload
from stickslip.response.system import System

FAR = 1e6  # m: no contact is closed there, of a model without dimensions either


def holding(system: System, static_load: FloatArray) -> BoolArray:
    """Return the contact points (p,) of a system that stick in small vibrations under a static load (n,), N."""
    gap = system.interface.gap_operator[:, system.retained] @ preload(system, static_load)
    force = static_contact_force(system.springs, gap)
    return pressed_by(system.springs.laws, force)


def static_contact_force(interface: Interface, gap: FloatArray) -> FloatArray:
    """Return the (p, 3) forces t, w, n of contacts loaded once from rest to `gap` (p, 3)."""
    coefficients = gap.reshape(1, -1)
    return contact_forces(coefficients, interface.compiled(), samples=1).force[:, :, 0]


def pressed_by(laws: Sequence[ContactLaw], force: FloatArray) -> BoolArray:
    """Return the contact points that stick in small vibrations: those under pressure, and those whose law never opens.

    Parameters
    ----------
    laws
        One a point.
    force
        (p, 3) static contact forces t, w, n, N.
    """
    return np.asarray((force[:, 2] < 0.0) | ~opening(laws))


def opening(laws: Sequence[ContactLaw]) -> BoolArray:
    """Return the contact points (p,) whose law lets go of them where they are far away."""
    found: dict[int, bool] = {}
    for law in laws:
        found.setdefault(id(law), _opens(law))
    return np.array([found[id(law)] for law in laws], dtype=bool)


def _opens(law: ContactLaw) -> bool:
    """Tell whether a law lets go of a point that is far away."""
    state = law.initial_state()
    jac = np.zeros((3 + state.size, 6 + state.size))
    status = np.empty(2, dtype=np.int64)
    force, after = np.empty(3), np.empty_like(state)
    parameters = law.parameters()
    law.kernel(np.array([0.0, 0.0, FAR]), np.zeros(3), state, parameters, force, after, jac, status)
    return bool(np.all(status == OPEN))
