"""The models of the figures: the example study, and the same blades with a damper whose flat side cannot slip."""

from collections.abc import Callable
from dataclasses import dataclass

from evidence.models.two_blades import COARSER, two_blades
from stickslip import HarmonicLoad, Sweep, System
from stickslip.arrays import IntArray

# Angles and contact lines of a damper whose flat side does not slip: it rests on L1 and R alone, within both friction cones.
GLUED = {
    "part.blades.flat_angle_deg": 50.0,
    "part.blades.curved_angle_deg": 70.0,
    "part.damper.flat_distances_m": (0.008, 0.023),
    "part.damper.curved_distance_m": 0.01,
}


@dataclass(frozen=True, eq=False)
class Model:
    """What the figures need of a system.

    Attributes
    ----------
    system, sweep
        The system, and how its study sweeps.
    load
        Loads for a ratio F_CL/F_HE.
    rotation
        Dof of the damper's rotation about the axial direction.
    contact_dofs
        Dofs of the blades at the contact points, along the excitation.
    flat
        Contacts of the flat side.
    """

    system: System
    sweep: Sweep
    load: Callable[[float], HarmonicLoad]
    rotation: int
    contact_dofs: IntArray
    flat: IntArray


def model(**values: object) -> Model:
    """Return the example with elements twice as large, and with other `values`."""
    own = two_blades(COARSER, **values)
    return Model(own.system, own.sweep, own.load, own.rotation, own.contact_dofs, own.flat)
