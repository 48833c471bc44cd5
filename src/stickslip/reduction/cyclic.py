"""Cyclic symmetry: travelling waves on a wheel, from one of its sectors.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendices 1 and 2.
"""

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import even_part, ones_at, surviving_sets
from stickslip.reduction.cyclic_faces import face, pair_faces, refuse_torn_axis
from stickslip.reduction.turning import dof_rotation, node_table
from stickslip.reduction.waves import check_sectors, wave

ROUNDING = 1e-9  # smaller entries of null vectors are rounding


@dataclass(frozen=True, eq=False)
class CyclicSector:
    """A sector of a wheel and its coupling to the neighbours: ``u_high = e^{iθ} R u_low``.

    `cyclic_sector` makes one from geometry. A lumped sector is made directly, with ``axis=None``: its coordinates are
    scalars with the same meaning in every sector. The coordinates `high` are a massless copy of the neighbour's coordinates,
    for the springs that lead there. Example, a ring of masses: ``Structure`` of two coordinates, mass ``diag(m, 0)``, a spring
    between them, ``low=[0]``, ``high=[1]``. A coordinate in both `low` and `high` is shared by all sectors (a hub); give it one
    sector's share of mass and stiffness.

    Parameters
    ----------
    structure
        The sector with free faces.
    sectors
        Number of sectors n_s; sector n lies at angle ``n * pitch`` about the axis.
    low, high
        (m,) dofs on the faces to the previous and to the next sector; the i-th dofs of both are partners, and the components of a
        node are adjacent.
    axis
        Axis of rotation; None for scalar coordinates, which do not rotate.
    weights
        (m_high, m_low) weights for faces with different meshes: each dof of `high` follows the dofs of `low` with the weights of its
        row, which add up to one and are the same for all components of a node; None: each dof follows its partner.

    Raises
    ------
    InputError
        If `low` and `high` do not fit the structure or each other.
    """

    structure: Structure
    sectors: int
    low: IntArray
    high: IntArray
    axis: Axis | None = field(default_factory=Axis)
    weights: Matrix | None = None

    def __post_init__(self) -> None:
        check_sectors("CyclicSector", self.sectors)
        low, high = (np.asarray(side, dtype=np.int64) for side in (self.low, self.high))
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        wanted = low.shape + low.shape if self.weights is None else self.weights.shape
        if high.shape + low.shape != wanted or low.ndim != 1:
            raise input_error(
                "CyclicSector: low, high",
                f"have shapes {low.shape} and {high.shape}",
                "Give each dof of one face and its partner on the other, or weights (high, low).",
            )
        both = np.concatenate([low, high[self._tied()[0]]])
        if both.size and (both.min() < 0 or both.max() >= self.structure.n):
            raise input_error(
                "CyclicSector: low, high",
                f"hold dofs outside the structure's {self.structure.n}",
                "Take the indices from the structure's sets.",
            )
        if np.unique(both).size != both.size:
            values, counts = np.unique(both, return_counts=True)
            twice = self.structure.dofs.labels[values[counts > 1][0]]
            raise input_error(
                "CyclicSector: low, high",
                f"name {twice} more than once",
                "A dof has one partner; one shared by all sectors stands at the same place in both.",
            )

    def __repr__(self) -> str:
        """Describe the sector in a line, without its matrices."""
        return f"<CyclicSector: one of {self.sectors}; {self.low.size} dofs on a face; {self.structure!r}>"

    @property
    def pitch(self) -> float:
        """Angle of a sector in rad."""
        return 2 * math.pi / self.sectors

    @property
    def independent(self) -> IntArray:
        """Dofs that neither follow the low face nor lie on the axis, in the structure's order."""
        return np.setdiff1d(np.arange(self.structure.n), self.high)

    @property
    def shared(self) -> IntArray:
        """Dofs that all sectors share, on the axis or of a hub."""
        return np.asarray(self.high[~self._tied()[0]])

    @property
    def following(self) -> tuple[IntArray, IntArray, Matrix]:
        """Dependent dofs of the high face, dofs of the low face on which they depend, and CSR weights (dependent, independent)."""
        high, low = self._tied()
        weights = (
            scipy.sparse.eye_array(high.sum(), format="csr")
            if self.weights is None
            else scipy.sparse.csr_array(self.weights)[high][:, low]
        )
        return self.high[high], self.low[low], weights

    def _tied(self) -> tuple[BoolArray, BoolArray]:
        """Return masks of the dofs of the high and of the low face that are not shared by all sectors."""
        if self.weights is None:
            differ = self.low != self.high
            return differ, differ
        return ~np.isin(self.high, self.low), ~np.isin(self.low, self.high)

    @property
    def tie(self) -> Matrix:
        """Real CSR matrix P_0 (n, m) of displacements ``tie @ q`` that are equal in all sectors."""
        return self.wave_tie(0)

    def wave_tie(self, wave_number: int) -> Matrix:
        """Return P_k (eq. 50): the sector's displacements from the coordinates of a travelling wave.

        Parameters
        ----------
        wave_number
            Any whole number, modulo the number of sectors.

        Returns
        -------
        scipy.sparse.csr_array
            (n, m), real for standing waves. Columns: `independent` dofs, then the motion of nodes on the axis
            that the wave allows (axial for k = 0, a whirl for k = 1 and n_s − 1, none for others).
        """
        phase = wave(wave_number, self.sectors).phase
        n, free = self.structure.n, self.independent
        own = ones_at(free, np.arange(free.size), (n, free.size))
        high, low, weights = self.following
        turn = phase * self._turn(low, 1)
        into = ones_at(high, np.arange(high.size), (n, high.size))
        tie = own + into @ (weights @ turn) @ own[low]
        return scipy.sparse.hstack([tie, self._whirl(phase)], format="csr")

    def turn(self, sectors: int) -> Matrix:
        """Return the (n, n) matrix that rotates displacements by `sectors` pitches, from the sector's frame to global axes."""
        return self._turn(np.arange(self.structure.n), sectors)

    def _turn(self, index: IntArray, sectors: int) -> Matrix:
        if self.axis is None or not sectors % self.sectors:
            return scipy.sparse.eye_array(index.size, format="csr")
        angle = sectors % self.sectors * self.pitch
        return dof_rotation(self.structure.dofs.take(index), self.axis.rotation(angle), "CyclicSector")

    def _whirl(self, phase: complex) -> Matrix:
        """Return the motions of shared nodes that a rotation by one pitch only multiplies by the phase of the wave."""
        shared = self.shared
        turn = (phase * self._turn(shared, 1)).toarray() - np.eye(shared.size)
        columns = [np.zeros((self.structure.n, 0))]
        groups = [np.array([i]) for i in range(shared.size)]
        if self.axis is not None:
            groups = [row[row >= 0] for row in node_table(self.structure.dofs.take(shared))]
        for group in groups:
            null = scipy.linalg.null_space(turn[np.ix_(group, group)], rcond=ROUNDING)
            null[np.abs(null) < ROUNDING] = 0.0
            whirl = np.zeros((self.structure.n, null.shape[1]), dtype=null.dtype)
            whirl[shared[group]] = null
            columns.append(whirl)
        return scipy.sparse.csr_array(np.hstack(columns))


def cyclic_sector(
    structure: Structure,
    sectors: int,
    *,
    low: str = "cyclic_low",
    high: str = "cyclic_high",
    axis: Axis = Axis(),  # noqa: B008  # frozen
    tolerance: float | None = None,
) -> CyclicSector:
    """Pair the nodes of the two cut faces of a sector by their positions.

    Parameters
    ----------
    structure
        One sector with free faces; nodes may be clamped (removed) on both faces.
    sectors
        Number of sectors of the wheel.
    low, high
        Names of the sets of dofs; `high` is `low` turned by 2π/sectors about `axis` by the right-hand rule. A node
        on the axis may be in either set or in both.
    axis
        Axis of the wheel.
    tolerance
        Largest distance of partners in metres; None: 1e-5 of the size of the faces.

    Returns
    -------
    CyclicSector
        The sector, with pairs in the order of `low`.

    Raises
    ------
    InputError
        If nodes have no partner; the message lists them, and detects swapped faces and a wrong number of
        sectors. If nodes on the axis are in neither face.
    """
    check_sectors("cyclic_sector", sectors)
    faces = [face(structure.dofs, structure.dof_set(name), name) for name in (low, high)]
    pairs = pair_faces(faces[0], faces[1], sectors, axis, tolerance)
    if sectors > 1:
        refuse_torn_axis(structure.dofs, pairs, axis)
    return CyclicSector(structure, sectors, *pairs, axis)


def travelling_wave(sector: CyclicSector, wave_number: int) -> Structure:
    """Return the structure of the waves of one wave number (eq. 49), from one sector.

    Parameters
    ----------
    sector
        The sector.
    wave_number
        k of ``u^(n) = R^n u^(0) exp(2πi k n / n_s)``; any whole number, modulo the number of sectors.

    Returns
    -------
    Structure
        Complex, or real for standing waves of real sectors; Hermitian, and CSR, if the sector's matrices are. Its coordinates are the
        sector's coordinates without the high face; sets whose dofs are among them survive. `basis` leads to the sector's
        displacements, or to the model that was reduced to the sector.
    """
    tie = sector.wave_tie(wave_number)
    structure = sector.structure
    free = sector.independent
    project = partial(_projected, tie=tie, free=free)
    return Structure(
        project(structure.mass),
        project(structure.damping, evened=False),
        project(structure.stiffness),
        _wave_dofs(structure.dofs, free, tie[:, free.size :]),
        surviving_sets(structure, free),
        structure.expand(tie),
        None if structure.loss is None else project(structure.loss),
    )


def _projected(matrix: Matrix, tie: Matrix, free: IntArray, *, evened: bool = True) -> Matrix:
    """Return ``tieᴴ A tie``, exactly Hermitian if `evened` and A is Hermitian to rounding.

    The dofs `free` are the first coordinates, and W gives the other dofs from them. The product is then
    ``A_ff + A_fo W + Wᴴ A_of + Wᴴ A_oo W``; the first term, by far the largest, is real if A is.
    """
    even = even_part(matrix) if evened else None
    if not scipy.sparse.issparse(matrix):
        product = np.asarray(tie.conj().T @ matrix @ tie)
        return product if even is None else (product + product.conj().T) / 2
    sparse = scipy.sparse.csr_array(matrix if even is None else even)
    other = np.setdiff1d(np.arange(tie.shape[0]), free)
    way, size = tie[other], (tie.shape[1],) * 2
    of_free, of_other = sparse[free], sparse[other]
    own, right, corner = of_free[:, free], of_free[:, other] @ way, way.conj().T @ of_other[:, other] @ way
    left = right.conj().T if even is not None else way.conj().T @ of_other[:, free]
    if even is not None:
        corner = (corner + corner.conj().T) / 2
    parts = []
    for part in (own, right, left, corner):
        resized = scipy.sparse.csr_array(part)
        resized.resize(size)
        parts.append(resized)
    whole = scipy.sparse.csr_array(parts[0] + ((parts[1] + parts[2]) + parts[3]))
    whole.sum_duplicates()  # sorts the indices: sorting later would change the bytes of a matrix that has been hashed
    return whole


def _wave_dofs(dofs: Dofs, free: IntArray, whirl: Matrix) -> Dofs:
    """Return the dof table of a travelling wave; a coordinate on the axis has the name of the single component it moves."""
    kept = dofs.take(free)
    if not whirl.shape[1]:
        return kept
    columns = scipy.sparse.csc_array(whirl)
    moved = np.split(columns.indices, columns.indptr[1:-1])
    more = dofs.take(np.array([rows[0] for rows in moved]))
    names = tuple(dofs.component[rows[0]] if rows.size == 1 else "axis" for rows in moved)
    return Dofs(
        np.concatenate([kept.node, more.node]),
        kept.component + names,
        np.vstack([kept.position, more.position]),
        kept.part + more.part,
    )
