"""Static displacements of the solids of a model."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.model.fe.prestress import strain_and_rotation
from stickslip.model.part import Part

MOST_STRAIN = 0.01  # several times the yield strain of alloys for disks and blades
MOST_ROTATION = 0.05  # rad; linear statics leaves out its square
MOST_DISPLACEMENT = 0.02  # of the largest radius


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


def static_state(parts: Mapping[str, Part], displacement: Mapping[str, FloatArray], speed: float) -> StaticState | None:
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
