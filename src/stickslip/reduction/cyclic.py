"""Cyclic symmetry: travelling waves on a wheel, from one of its sectors, whose cut faces are paired by geometry.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendices 1 and 2.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import even_part, ones_at, surviving_sets
from stickslip.reduction.turning import COMPONENTS, dof_rotation, node_table
from stickslip.reduction.waves import check_sectors, wave

TOLERANCE = 1e-5  # distance of partners over the faces' size: coordinates in text files have six digits or more
PARTNERED_NODES_SHARE = 0.8  # fraction of nodes with partners, above which the faces match except for some nodes
FEW_UNMATCHED_SHARE = 0.5  # fraction of nodes with partners, above which the sets are the two faces of a sector
NEAR_PITCH = 0.1  # largest deviation from the pitch, over the pitch, of faces whose meshes do not match
LISTED = 6  # largest number of unmatched nodes in a message, where most have partners; otherwise one is named
ROUNDING = 1e-9  # smaller entries of null vectors are rounding


@dataclass(frozen=True, eq=False)
class Face:
    """Nodes of a cut face.

    Parameters
    ----------
    name
        Name of the set.
    node
        (p,) node numbers.
    position
        (p, 3) positions in metres.
    table
        (p, 6) dofs by component; -1 for missing components.
    """

    name: str
    node: IntArray
    position: FloatArray
    table: IntArray

    def take(self, index: IntArray) -> "Face":
        """Return the face with only the nodes `index`."""
        return Face(self.name, self.node[index], self.position[index], self.table[index])


def face(dofs: Dofs, members: IntArray, name: str) -> Face:
    """Return the face made of the nodes with the dofs `members`."""
    here = dofs.take(members)
    table = node_table(here)
    if np.count_nonzero(table >= 0) != members.size:
        odd = np.setdiff1d(np.arange(members.size), table)[0]
        raise input_error(
            f"cyclic_sector: set {name!r}",
            f"holds {here.labels[odd]}, which is no component of a node",
            "Pair coordinates without geometry by hand: CyclicSector(structure, sectors, low, high, axis=None).",
        )
    first = table.max(axis=1)
    whole = np.where(table >= 0, members[table], -1)
    return Face(name, here.node[first], here.position[first], whole)


def refuse_torn_axis(dofs: Dofs, pairs: tuple[IntArray, IntArray], axis: Axis) -> None:
    """Refuse nodes on the axis that are in neither face, since each sector would have its own copy of them.

    Parameters
    ----------
    dofs
        Table of the sector's dofs.
    pairs
        Dofs of both faces.
    axis
        Axis of the wheel.

    Raises
    ------
    InputError
        If there are such nodes; the message names them.
    """
    others = np.setdiff1d(np.flatnonzero(dofs.node >= 0), np.concatenate(pairs))
    faces = dofs.position[pairs[0]]
    size = float(np.max(np.ptp(faces, axis=0), initial=0.0)) if len(faces) else 0.0
    near = np.linalg.norm(axis.arm(dofs.position[others]), axis=1) <= TOLERANCE * size
    torn = np.unique(dofs.node[others[near]])
    if torn.size:
        raise input_error(
            "cyclic_sector",
            f"{torn.size} nodes on the axis are in neither face, e.g. node {torn[0]}",
            "They belong to all sectors: put them into the set of one face or of both, or check the axis.",
        )


def pair_faces(
    low: Face, high: Face, sectors: int, axis: Axis, tolerance: float | None, others: Iterable[Face] = ()
) -> tuple[IntArray, IntArray]:
    """Return the dofs of `low` and, in the same order, their partners on `high`.

    Parameters
    ----------
    low, high
        The faces; `high` is `low` turned by one pitch about `axis`.
    sectors
        Number of sectors of the wheel.
    axis
        Axis of the wheel.
    tolerance
        Largest distance of partners in metres; None: 1e-5 of the size of the faces.
    others
        Other sets, one of which the message may name as the face that was meant.

    Returns
    -------
    tuple of numpy.ndarray
        (m,) dofs each. Nodes on the axis are their own partners and come last.

    Raises
    ------
    InputError
        If a node has no partner, or its partner has other components. The message lists the nodes, and detects
        swapped faces and a wrong number of sectors.
    """
    points = np.vstack([low.position, high.position])
    if not np.all(np.isfinite(points)):
        raise input_error("cyclic_sector", "nodes of the faces have no position", "Give positions.")
    size = float(np.max(np.ptp(points, axis=0), initial=0.0))
    reach = TOLERANCE * size if tolerance is None else tolerance
    # a wide tolerance for partners must not move nodes to the axis
    hub, low, high = _split(low, high, axis, TOLERANCE * size if sectors > 1 else -1.0)
    partner, ok = _match(low, high, 2 * math.pi / sectors, axis, reach)
    if not (ok.all() and len(set(partner.tolist())) == len(high.node)):
        raise _unmatched(low, high, sectors, axis, reach, others)
    there = high.table[partner]
    differ = np.flatnonzero(np.any((low.table >= 0) != (there >= 0), axis=1))
    if differ.size:
        raise _other_components(low, high, differ[0], partner[differ[0]])
    present = low.table >= 0
    shared = hub[hub >= 0]
    return (np.concatenate([low.table[present], shared]), np.concatenate([there[present], shared]))


def _split(low: Face, high: Face, axis: Axis, reach: float) -> tuple[IntArray, Face, Face]:
    """Return the dofs of nodes on the axis, which all sectors share, and the faces without them."""
    tables = []
    sides = []
    for side in (low, high):
        on = np.linalg.norm(axis.arm(side.position), axis=1) <= reach
        tables.append(side.table[on])
        sides.append(side.take(np.flatnonzero(~on)))
    hub = np.unique(np.vstack(tables), axis=0)
    return hub, sides[0], sides[1]


def _match(low: Face, high: Face, angle: float, axis: Axis, reach: float) -> tuple[IntArray, BoolArray]:
    """Return the node of `high` nearest to each rotated node of `low`, and whether it is near enough."""
    distance, partner = _nearest(axis.turned(low.position, angle), high.position)
    return partner, np.asarray(distance <= reach)


def _nearest(points: FloatArray, among: FloatArray) -> tuple[FloatArray, IntArray]:
    if not len(among):
        return np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    if not len(points):
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    from scipy.spatial import cKDTree

    distance, index = cKDTree(among).query(points)
    return np.asarray(distance), np.asarray(index)


def _unmatched(low: Face, high: Face, sectors: int, axis: Axis, reach: float, others: Iterable[Face]) -> InputError:
    """Return the error that names nodes without a partner, or explains why no node has one."""
    pitch = 360 / sectors
    names = f"{low.name!r} and {high.name!r}"
    shares = [_share(low, high, sign * 2 * math.pi / sectors, axis, reach) for sign in (1.0, -1.0)]
    if sectors > 2 and shares[1] > PARTNERED_NODES_SHARE and shares[1] > 2 * shares[0]:
        return input_error(
            f"cyclic_sector: {names}",
            f"are swapped: {high.name!r} lies {pitch:.6g}° behind {low.name!r} about the axis {axis.direction}",
            "Swap them, or turn the axis round.",
        )
    found = _angle_between(low, high, axis, reach)
    if _share(low, high, found, axis, reach) > PARTNERED_NODES_SHARE > shares[0]:
        fits = round(2 * math.pi / abs(found)) if found else 0
        near = fits > 0 and math.isclose(2 * math.pi / fits, abs(found), rel_tol=1e-3)
        return input_error(
            f"cyclic_sector: {names}",
            f"are {math.degrees(found):.5g}° apart, {sectors} sectors need {pitch:.5g}°",
            f"Say sectors={fits}{', and swap them' if found < 0 else ''}, or check the axis {axis.direction}."
            if near
            else _remedy(low, high, sectors, axis, reach, others),
        )
    return input_error(
        f"cyclic_sector: {names}",
        _missing(low, high, 2 * math.pi / sectors, axis, reach)
        + _missing(high, low, -2 * math.pi / sectors, axis, reach)
        + f"sectors={sectors}, axis {axis.direction} through {axis.origin}, tolerance {reach:.3g} m",
        _remedy(low, high, sectors, axis, reach, others),
    )


def _remedy(low: Face, high: Face, sectors: int, axis: Axis, reach: float, others: Iterable[Face]) -> str:
    """Return what helps against faces that do not match: nodes held alike, other sets, or another tie."""
    angle = 2 * math.pi / sectors
    alike = 'Mesh both faces alike, or tie them in the mean, cyclic = "segment_to_segment"'
    if _share(low, high, angle, axis, reach) >= FEW_UNMATCHED_SHARE:
        return f"Clamp the nodes of both faces or of neither. {alike}."
    every = list(others)
    for kept, sign, word in ((low, 1.0, "high"), (high, -1.0, "low")):
        for other in every:
            sizes = sorted([len(kept.node), len(other.node)])
            fits = other.name not in (low.name, high.name) and sizes[0] > PARTNERED_NODES_SHARE * sizes[1]
            if fits and _share(kept, other, sign * angle, axis, reach) > PARTNERED_NODES_SHARE:
                return f"The set {other.name!r} meets {kept.name!r}: name it as the {word} face."
    apart = math.degrees(_angle_between(low, high, axis, reach))
    if abs(apart - math.degrees(angle)) < NEAR_PITCH * math.degrees(angle):
        return f"{alike}, and check the axis."
    return (
        f"Both lie {apart:.4g}° apart: name the two cut faces of a sector, or check the number of sectors and the axis."
    )


def _share(low: Face, high: Face, angle: float, axis: Axis, reach: float) -> float:
    """Return the number of nodes with partners after a rotation, over the number of nodes of the smaller face."""
    _, ok = _match(low, high, angle, axis, reach)
    return float(np.count_nonzero(ok)) / max(min(len(low.node), len(high.node)), 1)


def _missing(here: Face, there: Face, angle: float, axis: Axis, reach: float) -> str:
    """List the nodes of one face whose rotated positions match no node of the other face."""
    distance, nearest = _nearest(axis.turned(here.position, angle), there.position)
    lost = np.flatnonzero(distance > reach)
    if not lost.size:
        shared = np.unique(nearest).size < nearest.size
        return f"several nodes of {here.name!r} meet one of {there.name!r}; " if shared else ""
    listed = LISTED if lost.size <= FEW_UNMATCHED_SHARE * len(here.node) else 1
    named = [_one_missing(here, there, i, distance[i], nearest[i]) for i in lost[:listed]]
    more = f", and {lost.size - listed} more" if lost.size > listed else ""
    return (
        f"{lost.size} of {len(here.node)} nodes of {here.name!r}, turned by {math.degrees(angle):.6g}°, "
        f"meet none of {there.name!r}: {', '.join(named)}{more}; "
    )


def _one_missing(here: Face, there: Face, i: int, distance: float, nearest: int) -> str:
    at = ", ".join(f"{v:.6g}" for v in here.position[i])
    if not math.isfinite(distance):
        return f"node {here.node[i]} at ({at}) m"
    return f"node {here.node[i]} at ({at}) m, nearest node {there.node[nearest]} off by {distance:.3g} m"


def _angle_between(low: Face, high: Face, axis: Axis, reach: float) -> float:
    """Return the angle about the axis from one face to the other, rad.

    It is that of nodes at equal radius and height where most have such a partner, else that of the mean positions.
    """
    if not (len(low.node) and len(high.node)):
        return 0.0
    arms = [axis.arm(side.position) for side in (low, high)]
    flat = [
        np.column_stack([np.linalg.norm(arm, axis=1), side.position @ axis.unit])
        for arm, side in zip(arms, (low, high), strict=True)
    ]
    distance, partner = _nearest(flat[0], flat[1])
    here = np.flatnonzero(distance <= reach)
    a, b = arms[0][here], arms[1][partner[here]]
    if here.size < FEW_UNMATCHED_SHARE * min(len(low.node), len(high.node)):
        a, b = (arm.mean(axis=0)[None] for arm in arms)
    return float(np.median(np.arctan2(np.cross(a, b) @ axis.unit, np.sum(a * b, axis=1))))


def _other_components(low: Face, high: Face, here: int, there: int) -> InputError:
    def has(table: IntArray) -> str:
        return " ".join(c for c, row in zip(COMPONENTS, table, strict=True) if row >= 0)

    return input_error(
        f"cyclic_sector: {low.name!r} and {high.name!r}",
        f"node {low.node[here]} has {has(low.table[here])}, its partner {high.node[there]} has "
        f"{has(high.table[there])}",
        "Constrain both faces alike, or constrain neither.",
    )


@dataclass(frozen=True, eq=False)
class CyclicSector:
    """A sector of a wheel and its coupling to the neighbours: ``u_high = e^{iθ} R u_low``, or ``u_low = e^{−iθ} Rᵀ u_high``.

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
        Weights for faces with different meshes, (m_high, m_low), or (m_low, m_high) if the low face follows: each dof of the face that
        follows has a row, which adds up to one and is the same for all components of a node; None: each dof follows its partner.
    ahead
        Sectors by which the face that leads lies ahead of the face that follows. 1: the high face follows the low face of the next
        sector; −1: the low face follows the high face of the previous one.

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
    ahead: int = 1

    def __post_init__(self) -> None:
        check_sectors("CyclicSector", self.sectors)
        low, high = (np.asarray(side, dtype=np.int64) for side in (self.low, self.high))
        object.__setattr__(self, "low", low)
        object.__setattr__(self, "high", high)
        if self.ahead not in (1, -1):
            raise input_error(
                "CyclicSector: ahead", f"is {self.ahead}", "Give 1 or −1: the high or the low face follows."
            )
        wanted = low.shape + low.shape if self.weights is None else self.weights.shape
        if self.followers.shape + self.leaders.shape != wanted or low.ndim != 1:
            raise input_error(
                "CyclicSector: low, high",
                f"have shapes {low.shape} and {high.shape}",
                "Give each dof of one face and its partner on the other, or weights (high, low).",
            )
        both = np.concatenate([self.leaders, self.followers[self._tied()[0]]])
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
    def followers(self) -> IntArray:
        """Dofs of the face that follows, and dofs that all sectors share."""
        return self.high if self.ahead > 0 else self.low

    @property
    def leaders(self) -> IntArray:
        """Dofs of the face that leads, and dofs that all sectors share."""
        return self.low if self.ahead > 0 else self.high

    @property
    def independent(self) -> IntArray:
        """Dofs that neither follow a neighbour nor lie on the axis, in the structure's order."""
        return np.setdiff1d(np.arange(self.structure.n), self.followers)

    @property
    def shared(self) -> IntArray:
        """Dofs that all sectors share, on the axis or of a hub."""
        return np.asarray(self.followers[~self._tied()[0]])

    @property
    def following(self) -> tuple[IntArray, IntArray, Matrix]:
        """Dependent dofs of one face, dofs of the other on which they depend, and CSR weights (dependent, independent)."""
        follow, lead = self._tied()
        weights = (
            scipy.sparse.eye_array(follow.sum(), format="csr")
            if self.weights is None
            else scipy.sparse.csr_array(self.weights)[follow][:, lead]
        )
        return self.followers[follow], self.leaders[lead], weights

    def _tied(self) -> tuple[BoolArray, BoolArray]:
        """Return masks of the dofs of the following and of the leading face that are not shared by all sectors."""
        if self.weights is None:
            differ = self.low != self.high
            return differ, differ
        return ~np.isin(self.followers, self.leaders), ~np.isin(self.leaders, self.followers)

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
        follow, lead, weights = self.following
        turn = (phase if self.ahead > 0 else np.conj(phase)) * self._turn(lead, self.ahead)
        into = ones_at(follow, np.arange(follow.size), (n, follow.size))
        tie = own + into @ (weights @ turn) @ own[lead]
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
    others = (
        face(structure.dofs, members, name) for name, members in structure.sets.items() if _of_nodes(structure, members)
    )
    pairs = pair_faces(faces[0], faces[1], sectors, axis, tolerance, others)
    if sectors > 1:
        refuse_torn_axis(structure.dofs, pairs, axis)
    return CyclicSector(structure, sectors, *pairs, axis)


def _of_nodes(structure: Structure, members: IntArray) -> bool:
    """Return whether a set holds components of nodes with positions, each once."""
    here = structure.dofs.take(members)
    known = bool(np.all(np.isfinite(here.position)))
    return known and np.count_nonzero(node_table(here) >= 0) == members.size > 0


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
        sector's coordinates without the face that follows; sets whose dofs are among them survive. `basis` leads to the sector's
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
