"""Coulomb limit of a contact, whatever its law."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.harmonic.aft import contact_forces

TRAVEL_M = 1e6  # amplitude of a cycle in which every slider has slipped far, of a model without dimensions, too
SAMPLES = 256  # of the cycle, for laws that are marched
ROUNDING = 1e-13  # of the force of a spring beside the slider: dissipation below is rounding


@dataclass(frozen=True, eq=False)
class Friction:
    """Friction of contacts under their static loads.

    Attributes
    ----------
    limits
        (n_contacts, 2) force along t and w that a contact slips at, N: a quarter of what it dissipates in a long cycle, over the amplitude.
    variable
        (n_contacts,) whether the limit follows a normal gap that moves.
    """

    limits: FloatArray
    variable: BoolArray

    @property
    def slips(self) -> BoolArray:
        """(3 n_contacts,) directions t, w, n in which contacts slip."""
        along = np.zeros((len(self.limits), 3), dtype=bool)
        along[:, :2] = self.limits > 0.0
        return along.reshape(-1)

    @property
    def any(self) -> bool:
        """Whether any contact slips at all."""
        return bool(np.any(self.limits > 0.0))


def friction_of(interface: Interface, static_gap: FloatArray, static_force: FloatArray) -> Friction:
    """Return the friction of contacts that stand at the static gaps (n_contacts, 3), m, under the forces (n_contacts, 3), N.

    Every law is taken round a cycle of great amplitude in t and then in w, its normal gap at rest: what it dissipates is four times its limit
    times the amplitude. Springs that never slip have no limit, nor have contacts that are open.
    """
    n = interface.n_contacts
    compiled = interface.compiled()
    limits = np.zeros((n, 2))
    for axis in range(2):
        cycle = np.zeros((3, n, 3))
        cycle[0] = static_gap
        cycle[1, :, axis] = TRAVEL_M
        force = contact_forces(cycle.reshape(3, -1), compiled, SAMPLES).coefficients.reshape(3, n, 3)
        work = np.pi * TRAVEL_M * force[2, :, axis]
        size = np.linalg.norm(force[1:, :, axis], axis=0)
        limit = np.abs(work) / (4.0 * TRAVEL_M)
        limits[:, axis] = np.where(limit > ROUNDING * size, limit, 0.0)
    follows = np.array([hasattr(law, "mu") and law.stuck_stiffness()[2] > 0 for law in interface.laws])
    pressed = static_force[:, 2] < 0.0
    return Friction(limits, np.asarray(follows & pressed, dtype=bool))
