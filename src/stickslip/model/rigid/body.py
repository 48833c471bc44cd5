"""Rigid bodies: six degrees of freedom and no stiffness of their own."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.units import check_quantities, quantity

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A rigid body whose principal axes are x, y, z.

    Parameters
    ----------
    mass
        Mass in kg.
    inertia
        Moments of inertia about the axes x, y, z through `centre`, in kg m².
    centre
        Centre of mass in metres.

    Raises
    ------
    InputError
        If mass or inertia are not positive, or no body can have these moments of inertia.
    """

    mass: float = quantity("mass of the body", "kg", above=0)
    inertia: tuple[float, float, float] = quantity(
        "moments of inertia [x, y, z] about the centre of mass", "kg_m2", above=0, entries=(3, 3)
    )
    centre: tuple[float, float, float] = quantity(
        "centre of mass [x, y, z]", "m", usual=100, entries=(3, 3)
    )

    def __post_init__(self) -> None:
        check_quantities(self)
        if 2 * max(self.inertia) > sum(self.inertia) * (1 + 1e-9):
            raise input_error(
                "RigidBody.inertia",
                f"the largest moment exceeds the sum of the other two, got {self.inertia}",
                "No distribution of mass has such moments: check their order and units (kg m²).",
            )

    def structure(self) -> Structure:
        """Return six dofs ``x y z rx ry rz`` at the centre of mass: no stiffness, no damping."""
        dofs = Dofs(np.full(6, -1), COMPONENTS, np.tile(self.centre, (6, 1)))
        mass = np.diag([self.mass] * 3 + list(self.inertia)).astype(float)
        return Structure(mass, np.zeros((6, 6)), np.zeros((6, 6)), dofs)

    def displacement_operator(self, points: FloatArray) -> FloatArray:
        """Return the (p, 3, 6) operator to the displacement ``u_G + θ × r`` of material points.

        Parameters
        ----------
        points
            (p, 3) positions in metres.
        """
        operator = np.zeros((len(points), 3, 6))
        operator[:, :, :3] = np.eye(3)
        x, y, z = (np.asarray(points, dtype=float) - self.centre).T
        operator[:, 0, 4], operator[:, 0, 5] = z, -y
        operator[:, 1, 3], operator[:, 1, 5] = -z, x
        operator[:, 2, 3], operator[:, 2, 4] = y, -x
        return operator
