"""Structure with its contacts, the input of every analysis."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.arrays import IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import input_error
from stickslip.harmonic.engine_order_line import condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.linear import DynamicStiffness, LinearSide, full_structure, one_structure
from stickslip.harmonic.rigid_contacts import STIFF
from stickslip.model.modes import with_springs
from stickslip.model.structure import Structure

NO_DOFS: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class System:
    """Reduced structure, its contacts, and the retained and reported dofs.

    Parameters
    ----------
    structure
        Linear structure: reduced blades and dampers, one sector of a tuned wheel, or `Unreduced` for thousands of
        contacts.
    interface
        Contacts on the structure's dofs.
    outputs
        Dof indices whose motion is reported.
    alert_dofs
        Dofs of the predicted harmonic error: outputs, contact dofs or chosen directions; None: the outputs.
    free
        Dofs of rigid bodies held by contacts only; they are retained with or without a contact.
    peak_of
        Positions of the outputs whose largest amplitude defines the response, such as all blades; None: the first
        output.
    """

    structure: LinearSide
    interface: Interface
    outputs: IntArray
    alert_dofs: IntArray | None = None
    free: IntArray | None = None
    peak_of: IntArray | None = None

    def __post_init__(self) -> None:
        if self.interface.gap_operator.shape[1] != self.structure.n:
            raise input_error(
                "System",
                f"the gap operator has {self.interface.gap_operator.shape[1]} columns for {self.structure.n} dofs",
                "Build the interface on the joined structure.",
            )
        if not self.structure.reduced and self.interface.rigid:
            raise input_error(
                "System",
                "has a rigid contact on an unreduced structure",
                "Reduce it (craig_bampton), or give the contact a stiffness.",
            )
        for name in ("outputs", "alert_dofs", "free"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _dofs(name, given, self.structure.n))

    @property
    def retained(self) -> IntArray:
        """Sorted unknown dofs: of contacts, free bodies and constraints; with rigid or without contacts also the outputs."""
        free = NO_DOFS if self.free is None else self.free
        held = np.union1d(free, self.structure.multipliers).astype(np.int64)
        if self.interface.rigid or not self.interface.n_contacts:  # stuck contacts, or none, cannot measure a motion
            held = np.union1d(held, self.outputs)
        return np.union1d(self.interface.coordinates(), held)

    @property
    def springs(self) -> Interface:
        """Contacts with stiff springs in place of rigid contacts, for static states and small vibrations."""
        if not self.interface.rigid:
            return self.interface
        stiffness = np.abs(self.structure.of_harmonic(0).stiffness.diagonal())
        return self.interface.sprung(STIFF * float(stiffness[self.interface.coordinates()].max()))

    @property
    def retained_labels(self) -> tuple[str, ...]:
        """Names of the retained coordinates."""
        labels = self.structure.dofs.labels
        return tuple(labels[i] for i in self.retained)

    def at(self, omega: float) -> "System":
        """Return the system at a frequency, rad/s; it depends on the frequency only along an engine-order line."""
        side = self.structure.at_frequency(omega)
        return self if side is self.structure else replace(self, structure=side)

    def condensed(self, load: HarmonicLoad, order: int, more: IntArray = NO_DOFS) -> DynamicStiffness:
        """Return structure and load condensed to the retained dofs and `more`, for harmonics up to `order`.

        For a wheel the harmonics of the judging set are included, if the wheel has their waves.
        """
        side, retained = self.structure, np.union1d(self.retained, more)
        order = max(order, min(JUDGED_MULTIPLE * order, side.harmonics or 0))
        return condensed(side, retained, load, order)

    @property
    def plain_structure(self) -> Structure:
        """Structure with the same matrices in all harmonics; see `one_structure`."""
        return one_structure(self.structure, "this analysis")

    def with_retention(self, stiffness: float) -> "System":
        """Return the system with a spring of `stiffness` (N/m, rotations N m/rad per m²) from each free dof to ground.

        Rotational dofs get the stiffness times the inertia tensor over the mass of the body, so that one number serves
        all six dofs in any orientation of the body.
        """
        if self.free is None or stiffness == 0.0:
            return self
        structure = self.structure.of_harmonic(0)
        springs = scipy.sparse.lil_array((structure.n, structure.n))
        dofs = structure.dofs
        for body in dict.fromkeys(dofs.part[d] for d in self.free):
            own = np.array([d for d in self.free if dofs.part[d] == body])
            turns = np.array([dofs.component[d].startswith("r") for d in own])
            inertia = np.array([[np.real(structure.mass[a, b]) for b in own] for a in own])
            mass = np.max(inertia.diagonal()[~turns], initial=0.0)
            added = np.eye(own.size)
            if mass > 0.0:
                added[np.ix_(turns, turns)] = inertia[np.ix_(turns, turns)] / mass
            springs[np.ix_(own, own)] = stiffness * added
        return replace(self, structure=self.structure.grounded(springs.tocsr()))

    def stuck_structure(self) -> Structure:
        """Return the linear structure with every contact bonded through its springs."""
        b = self.interface.gap_operator
        structure = full_structure(self.structure, "System.stuck_structure")
        return with_springs(structure, b, self.springs.stuck_stiffness())


def _dofs(name: str, given: IntArray, n: int) -> IntArray:
    """Return dof indices as an array, after checking them."""
    index = np.asarray(given)
    if index.size and index.dtype.kind not in "iu":
        raise input_error(f"System.{name}", f"holds {index.reshape(-1)[0]!r}, which is no index", "Give whole numbers.")
    outside = index[(index < 0) | (index >= n)]
    if outside.size:
        raise input_error(
            f"System.{name}",
            f"names dof {outside[0]}, and the structure has the dofs 0 to {n - 1}",
            "Take indices from the structure's sets.",
        )
    return index.astype(np.int64).reshape(-1)
