"""The static displacement under the centrifugal load in two numbers: how large it is, and whether linear statics can hold."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.assembly.model import Model
from stickslip.model.fe.elements import chunks, gradients, shape_functions
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.units import RPM

MOST_STRAIN = 0.01  # several times the yield strain of alloys for disks and blades
MOST_ROTATION = 0.05  # rad; linear statics leaves out its square
MOST_DISPLACEMENT = 0.02  # of the largest radius


@dataclass(frozen=True)
class StaticState:
    """What the centrifugal load does to a solid at a speed, by linear statics.

    Parameters
    ----------
    rpm
        The speed.
    displacement
        Largest length of a node's displacement in m.
    strain
        Largest principal strain, as a magnitude, at the middles of the elements.
    rotation
        Largest rotation there, in rad.
    radius
        Largest distance of a node from the axis in m.
    """

    rpm: float
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


def static_state(model: Model, rpm: float) -> StaticState | None:
    """Return the static state at a speed, the worst of all parts; None at rest and for models that no speed changes."""
    moved = model.static_displacement(rpm * RPM)
    if not moved:
        return None
    found = []
    for name, displacement in moved.items():
        part = model.parts[name]
        assert part.mesh is not None
        length = float(np.linalg.norm(displacement, axis=1).max())
        radius = float(np.linalg.norm(model.axis.arm(part.mesh.points), axis=1).max())
        found.append((length, *strain_and_rotation(part.mesh, displacement), radius))
    return StaticState(rpm, *np.max(found, axis=0).tolist())


def strain_and_rotation(mesh: SolidMesh, displacement: FloatArray) -> tuple[float, float]:
    """Return the largest principal strain (a magnitude) and the largest rotation (rad) at the middles of the elements.

    Parameters
    ----------
    mesh
        Of the solid.
    displacement
        (nodes, 3) in m.
    """
    shape = shape_functions(mesh.cells.shape[1], 1)
    strain = rotation = 0.0
    for piece in chunks(mesh, shape):
        slopes, _ = gradients(mesh, shape, piece)
        found = np.einsum("mkx,mqky->mqxy", displacement[mesh.cells[piece]], slopes)
        turned = np.swapaxes(found, 2, 3)
        strain = max(strain, float(np.linalg.norm(found + turned, 2, axis=(2, 3)).max()) / 2)
        rotation = max(rotation, float(np.linalg.norm(found - turned, 2, axis=(2, 3)).max()) / 2)
    return strain, rotation
