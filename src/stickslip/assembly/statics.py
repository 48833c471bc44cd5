"""Contacts under static loads: their forces, and which of them stick in small vibrations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, ContactLaw
from stickslip.harmonic.aft import contact_forces
from stickslip.model.fe.prestress import strain_and_rotation
from stickslip.model.part import Part

FAR = 1.0  # m: no contact is closed there
MOST_STRAIN = 0.01  # several times the yield strain of alloys for disks and blades
MOST_ROTATION = 0.05  # rad; linear statics leaves out its square
MOST_DISPLACEMENT = 0.02  # of the largest radius


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


@dataclass(frozen=True)
class StaticState:
    """What the centrifugal load does to a model's solids at a speed, by linear statics and without contacts.

    Parameters
    ----------
    speed
        In rad/s.
    displacement
        Largest length of a node's displacement in m.
    strain
        Largest principal strain, as a magnitude, at the middles of the elements.
    rotation
        Largest rotation there, in rad.
    radius
        Largest distance of a node from the axis in m.
    """

    speed: float
    displacement: float
    strain: float
    rotation: float
    radius: float

    @property
    def too_large(self) -> bool:
        """Whether linear statics is in doubt."""
        small = (
            self.strain <= MOST_STRAIN
            and self.rotation <= MOST_ROTATION
            and self.displacement <= MOST_DISPLACEMENT * self.radius
        )
        return not small  # nor is what is no number small


def static_state(
    parts: Mapping[str, Part], displacement: Mapping[str, FloatArray], speed: float
) -> StaticState | None:
    """Return the static state of the parts whose meshes have a displacement (nodes, 3) in m at a speed in rad/s; None of none."""
    rows = []
    for name, moved in displacement.items():
        part = parts[name]
        assert part.mesh is not None
        length = float(np.linalg.norm(moved, axis=1).max())
        radius = float(np.linalg.norm(part.axis.arm(part.mesh.points), axis=1).max())
        rows.append((length, *strain_and_rotation(part.mesh, moved), radius))
    if not rows:
        return None
    return StaticState(speed, *(float(v) for v in np.max(np.array(rows), axis=0)))
