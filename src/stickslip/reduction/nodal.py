"""Coordinates of a travelling wave in which contacts between sectors act on displacements of their own sector and its neighbours.

Sector n + s does what sector n does, times ``exp(i s θ)``. A dof of a neighbour that a contact touches is therefore the own dof in
another phase: where contacts know it in that phase alone, it is taken as the coordinate, a unitary change. A dof that contacts know in
several phases gets a coordinate for each, held to the first by a constraint whose force is an unknown. The gaps are then real combinations
of the coordinates, the same ones in all waves and so in all harmonics.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs, join_dofs
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.cyclic import CyclicSector


@dataclass(frozen=True, eq=False)
class NodalCoordinates:
    """How contacts know the coordinates of the waves; `nodal_coordinates` makes it.

    The new coordinates are the old ones in the phase in which contacts know them first, then the copies in other phases, then the
    forces that hold the copies.

    Parameters
    ----------
    ahead
        (m,) number of sectors by which the phase of each old coordinate is ahead.
    copied
        (c,) old coordinate of each copy.
    farther
        (c,) number of sectors by which a copy is ahead of it.
    operator
        (3 n_contacts, m + 2 c) from the new coordinates to the gaps.
    """

    ahead: IntArray
    copied: IntArray
    farther: IntArray
    operator: FloatArray

    @property
    def multipliers(self) -> IntArray:
        """Coordinates that are forces of constraints."""
        first = self.ahead.size + self.copied.size
        return np.arange(first, first + self.copied.size)

    def of_wave(self, structure: Structure, phase: complex | float) -> Structure:
        """Return a wave in the new coordinates.

        Parameters
        ----------
        structure
            In the old ones.
        phase
            ``exp(i θ)`` of the wave.
        """
        old, count = structure.n, self.copied.size
        turn = np.array([phase**-s for s in self.ahead])
        tie = scipy.sparse.csr_array((turn, (np.arange(old), np.arange(old))), shape=(old, old + 2 * count))
        dense = not scipy.sparse.issparse(structure.stiffness)
        dofs = self._dofs(structure.dofs)
        turned = in_coordinates(structure, tie.toarray() if dense else tie, dofs, structure.sets)
        if not count:
            return turned
        held = self._constraints(structure.stiffness.diagonal(), phase)
        stiffness = turned.stiffness + (held.toarray() if dense else held)
        return Structure(turned.mass, turned.damping, stiffness, dofs, turned.sets, turned.basis, turned.loss)

    def _constraints(self, diagonal: Matrix, phase: complex | float) -> Matrix:
        """Return the stiffness of ``copy = phase^s coordinate`` and of its force, in the scale of the coordinate's own stiffness."""
        size = np.abs(diagonal)
        scale = np.where(size > 0.0, size, size.max(initial=0.0) or 1.0)[self.copied]
        copies = self.ahead.size + np.arange(self.copied.size)
        shape = (self.operator.shape[1],) * 2
        follow = -scale * np.array([phase**s for s in self.farther])
        values = np.concatenate([scale, follow])
        rows = np.tile(self.multipliers, 2)
        columns = np.concatenate([copies, self.copied])
        half = scipy.sparse.csr_array((values, (rows, columns)), shape=shape)
        return scipy.sparse.csr_array(half + half.conj().T)

    def _dofs(self, dofs: Dofs) -> Dofs:
        """Name copies after the neighbours whose motion they are."""
        copies = dofs.take(self.copied)
        parts = tuple(
            "next." * int(s) + p if p else "next." * int(s - 1) + "next"
            for s, p in zip(self.farther, copies.part, strict=True)
        )
        held = tuple(f"tie_{c}" for c in copies.component)
        joined = join_dofs({"": dofs, "copies": copies, "held": copies})
        return Dofs(
            joined.node, dofs.component + copies.component + held, joined.position, (*dofs.part, *parts, *parts)
        )


def nodal_coordinates(
    sector: CyclicSector, place: IntArray, n: int, gaps: tuple[Matrix, Matrix | None]
) -> NodalCoordinates:
    """Find in which phases contacts know the coordinates of the waves.

    Parameters
    ----------
    sector
        One sector.
    place
        (m,) positions, among its independent dofs, of the first coordinates of the waves: contacts act on these alone.
    n
        Number of coordinates of a wave.
    gaps
        Operators (3 n_contacts, n_sector) on this sector and on the next one.

    Raises
    ------
    InputError
        If a contact acts on a dof that all sectors share.
    """
    own = scipy.sparse.csr_array(gaps[0])
    following = scipy.sparse.csr_array(own.shape if gaps[1] is None else gaps[1])
    touched = np.union1d(own.nonzero()[1], following.nonzero()[1])
    shared = np.intersect1d(touched, sector.shared)
    if shared.size:
        raise input_error(
            "tuned_wheel: gaps",
            f"{sector.structure.dofs.labels[shared[0]]} lies on the axis, where a contact has a coordinate in few waves alone",
            "Leave it out, or take the wheel of all sectors (reduced_wheel).",
        )
    tie = sector.tie[:, : sector.independent.size][:, place]
    high = np.zeros(sector.structure.n)
    high[sector.high] = 1.0
    tied, free = (scipy.sparse.diags_array(d) @ tie for d in (high, 1.0 - high))
    # what a contact knows of a coordinate as it is, one sector and two sectors ahead
    known = [own @ free, own @ tied + following @ free, following @ tied]
    phases = np.array([(abs(part) > 0).sum(axis=0) > 0 for part in known]).reshape(3, -1)
    first = np.argmax(phases, axis=0)
    ahead = np.zeros(n, dtype=np.int64)
    ahead[: place.size] = first
    again = phases.copy()
    again[first, np.arange(place.size)] = False
    shift, copied = np.nonzero(again)
    operator = np.zeros((own.shape[0], n + 2 * copied.size))
    for s, part in enumerate(known):
        mine = np.flatnonzero(phases[s] & (first == s))
        operator[:, mine] = part[:, mine].toarray()
        copies = np.flatnonzero(shift == s)
        operator[:, n + copies] = part[:, copied[copies]].toarray()
    return NodalCoordinates(ahead, copied, shift - first[copied], operator)


def own_motions(structure: Structure, multipliers: IntArray) -> Matrix:
    """Return the (n, m) matrix from the coordinates of a wave that move by themselves to all of its coordinates.

    The copies of coordinates follow as the constraints of the wave say; the forces of the constraints are zero in it.

    Parameters
    ----------
    structure
        In coordinates of `NodalCoordinates`, or any where nothing is tied.
    multipliers
        (c,) coordinates that are forces of constraints, the last ones; the c before them are the copies.
    """
    n, ties = structure.n, multipliers.size
    if not np.array_equal(multipliers, np.arange(n - ties, n)):
        raise input_error("TunedWheel", "has forces of constraints among its motions", "Put them behind these.")
    own = n - 2 * ties
    held = structure.stiffness[n - ties :]
    dense = held.toarray() if scipy.sparse.issparse(held) else np.asarray(held)
    copies = -np.linalg.solve(dense[:, own : own + ties], dense[:, :own])
    return np.vstack([np.eye(own), copies, np.zeros((ties, own))])
