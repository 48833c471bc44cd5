"""Static displacements of joined parts under the centrifugal load, and check of their size."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray
from stickslip.assembly.joints.ties import Coordinates, Ties
from stickslip.assembly.locations import Places, picked
from stickslip.assembly.part_reduction import Steady, steady_of
from stickslip.assembly.sides.wheel import Neighbours
from stickslip.model.fe.factorisation import factorise
from stickslip.model.fe.prestress import strain_and_rotation
from stickslip.model.part import Part
from stickslip.model.structure import join

MOST_STRAIN = 0.01  # several times the yield strain of alloys for disks and blades
MOST_ROTATION = 0.05  # rad; linear statics neglects its square
MOST_DISPLACEMENT = 0.02  # share of the largest radius


def joined_displacements(
    places: Places, at: Coordinates, tied: tuple[Neighbours | None, Ties], loose: IntArray
) -> dict[str, Steady]:
    """Return the displacements of joined parts by linear statics under the centrifugal load at 1 rad/s.

    Parameters
    ----------
    places, at
        The parts, and their coordinates under the ties of the joins.
    tied
        Cyclic faces between neighbours on a wheel (None for a single structure), and ties of the joins.
    loose
        Dofs without supports, whose displacement is set to zero.
    """
    parts, (here, _) = places.parts, tied
    free = _free_solids(places, *tied)
    loose = np.concatenate([loose, *(places.own(name) for name in free)])
    rest = at.tied(join(**{name: part.structure for name, part in parts.items()}))
    tie = picked(np.arange(at.ids.size), at.ids.size) if at.tie is None else at.tie
    if here is not None:
        tie = tie @ here.sector(rest, at).wave_tie(0)
    moves = np.setdiff1d(np.arange(tie.shape[1]), tie[loose].nonzero()[1])
    tie = scipy.sparse.csr_array(tie[:, moves])
    stiffness = scipy.sparse.block_diag([scipy.sparse.csr_array(part.structure.stiffness) for part in parts.values()])
    solve = factorise(scipy.sparse.csr_array(tie.T @ stiffness @ tie))
    moved, hot = (
        None if load is None else np.asarray(tie @ solve(tie.T @ load))
        for load in (np.concatenate([_centrifugal(part) for part in parts.values()]), _thermal(parts))
    )
    assert moved is not None
    shared = {
        name: Steady(unit=moved[places.own(name)], hot=None if hot is None else hot[places.own(name)]) for name in parts
    }
    return shared | free


def _thermal(parts: Mapping[str, Part]) -> FloatArray | None:
    """Return the (N,) forces of the thermal strain on the dofs of all parts, N; None without thermal strain."""
    own = {name: None if part.solid is None else part.solid.thermal_load for name, part in parts.items()}
    if all(load is None for load in own.values()):
        return None
    return np.concatenate(
        [np.zeros(part.structure.n) if (load := own[name]) is None else load for name, part in parts.items()]
    )


def _centrifugal(part: Part) -> FloatArray:
    """Return the (n,) centrifugal load at 1 rad/s, N s²; for matrices at several speeds the one of the highest over its square."""
    if part.turning is not None:
        highest = float(part.turning.speeds[-1])
        return part.turning.static_load(highest) / highest**2
    return np.zeros(part.structure.n) if part.solid is None else part.solid.centrifugal


def _free_solids(places: Places, here: Neighbours | None, joins: Ties) -> dict[str, Steady]:
    """Return the equilibrium conditions of parts without support or join."""
    cyclic = {} if here is None else here.ties
    tied = np.union1d(joins.followers, joins.weights.nonzero()[1])
    own = {
        name: steady_of(part, cyclic.get(name))
        for name, part in places.parts.items()
        if not np.isin(places.own(name), tied).any()
    }
    return {name: steady for name, steady in own.items() if steady.carried is not None}


@dataclass(frozen=True)
class StaticState:
    """Static deformation of a model's solids under the centrifugal load and heat, by linear statics without contacts.

    Parameters
    ----------
    speed
        Rotor speed, rad/s.
    displacement
        Largest displacement of a node, m.
    strain
        Largest magnitude of a principal strain at the element centres, without free thermal strain.
    rotation
        Largest rotation at the element centres, rad.
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
        return not small  # NaN counts as too large


def static_state(parts: Mapping[str, Part], displacement: Mapping[str, FloatArray], speed: float) -> StaticState | None:
    """Return the static state of parts from the displacements (nodes, 3), m, of their meshes at a speed in rad/s.

    None without displacements.
    """
    rows = []
    for name, moved in displacement.items():
        part = parts[name]
        assert part.mesh is not None
        assert part.solid is not None
        length = float(np.linalg.norm(moved, axis=1).max())
        radius = float(np.linalg.norm(part.axis.arm(part.mesh.points), axis=1).max())
        rows.append((length, *strain_and_rotation(part.solid.laws, moved), radius))
    if not rows:
        return None
    return StaticState(speed, *(float(v) for v in np.max(np.array(rows), axis=0)))
