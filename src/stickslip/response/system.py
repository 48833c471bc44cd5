"""A structure with its contacts: what every analysis needs."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.arrays import IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.travelling import condense_waves
from stickslip.model.modes import with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.tuned import TunedWheel


@dataclass(frozen=True, eq=False)
class System:
    """A reduced structure, its contacts, and the dofs that are solved for and reported.

    Parameters
    ----------
    structure
        Blades joined with dampers, reduced; or one sector of a tuned wheel.
    interface
        Contacts on the structure's dofs.
    outputs
        Dof indices whose motion is reported.
    alert_dofs
        Dofs over which the predicted error of the harmonics is taken: outputs, contact dofs, chosen directions; None: the outputs.
    free
        Dofs of rigid bodies that only contacts hold; they are retained whether or not a contact touches them.
    """

    structure: Structure | TunedWheel
    interface: Interface
    outputs: IntArray
    alert_dofs: IntArray | None = None
    free: IntArray | None = None

    def __post_init__(self) -> None:
        if self.interface.gap_operator.shape[1] != self.structure.n:
            raise input_error(
                "System",
                f"the gap operator has {self.interface.gap_operator.shape[1]} columns for {self.structure.n} dofs",
                "Build the interface on the joined structure.",
            )

    @property
    def retained(self) -> IntArray:
        """Dofs that stay unknown: those of the contacts and of free bodies, sorted."""
        free = np.zeros(0, dtype=np.int64) if self.free is None else self.free
        return np.union1d(self.interface.coordinates(), free)

    @property
    def retained_labels(self) -> tuple[str, ...]:
        """Names of the retained coordinates."""
        labels = self.structure.dofs.labels
        return tuple(labels[i] for i in self.retained)

    def condensed(self, load: HarmonicLoad, order: int) -> DynamicStiffness:
        """Return the structure and a load on it, condensed to the retained dofs, for harmonics up to `order`."""
        if isinstance(self.structure, TunedWheel):
            waves = [self.structure.of_harmonic(h) for h in range(order + 1)]
            return condense_waves(tuple(waves), self.retained, load)
        return condense(self.structure, self.retained, load)

    @property
    def plain_structure(self) -> Structure:
        """The structure, where one and the same vibrates in all harmonics.

        Raises
        ------
        InputError
            If it is a tuned wheel.
        """
        if isinstance(self.structure, TunedWheel):
            raise input_error(
                "System",
                "this analysis has no form for a tuned wheel, whose harmonics are different travelling waves",
                "Take the wheel of all sectors (reduced_wheel).",
            )
        return self.structure

    def with_retention(self, stiffness: float) -> "System":
        """Return the system with a spring of `stiffness` (N/m, rotations N m/rad per m²) from each free dof to ground.

        Rotational dofs get the stiffness times the squared radius of gyration of the body, so that one number serves all six.
        """
        if self.free is None or stiffness == 0.0:
            return self
        structure = self.plain_structure
        added = np.zeros(structure.n)
        dofs = structure.dofs
        turns = np.array([dofs.component[d].startswith("r") for d in self.free])
        inertia = np.array([structure.mass[d, d] for d in self.free])
        for dof, turn, own in zip(self.free, turns, inertia, strict=True):
            same_body = np.array([dofs.part[d] == dofs.part[dof] for d in self.free]) & ~turns
            mass = np.max(inertia[same_body], initial=0.0)
            added[dof] = stiffness * (own / mass if turn and mass > 0.0 else 1.0)
        diagonal = (
            scipy.sparse.diags_array(added)
            if scipy.sparse.issparse(structure.stiffness)
            else np.diag(added)
        )
        return replace(self, structure=replace(structure, stiffness=structure.stiffness + diagonal))

    def stuck_structure(self) -> Structure:
        """Return the linear structure with every contact bonded through its springs."""
        b = self.interface.gap_operator
        return with_springs(self.plain_structure, b, self.interface.stuck_stiffness())
