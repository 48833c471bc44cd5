"""Wheels of a model: cyclic faces between sectors, reduced and damped waves, and stages coupled at their flanges."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.assembly.contact import ALONE, NEXT, SPATIAL, Join
from stickslip.assembly.joints.cyclic_faces import unlike_faces
from stickslip.assembly.joints.pairs import Pairs, Turn
from stickslip.assembly.joints.ties import MEAN, Coordinates, Ties
from stickslip.assembly.locations import Places, picked, stacked
from stickslip.errors import InputError, input_error
from stickslip.model.damping import Damping
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.choice import Reduction
from stickslip.reduction.contact_coordinates import in_relative_coordinates, nodal_coordinates
from stickslip.reduction.coupled_stages import Flange, Multistage, multistage
from stickslip.reduction.cyclic import CyclicSector, cyclic_sector, travelling_wave
from stickslip.reduction.speed_basis import modes_of, on_modes_of_others
from stickslip.reduction.tuned import TunedWheel
from stickslip.reduction.waves import excited_wave, wave

IN_SPACE = 2  # directions in which a node must move at least; otherwise coordinates do not rotate
JOINED = 1e-12  # relative to the largest entry: smaller entries couple no parts


@dataclass(frozen=True)
class DampingOfParts:
    """Modal damping of parts that only contacts connect.

    Parameters
    ----------
    parts
        Name and damping of each part; None: the part has no modal damping.
    """

    parts: tuple[tuple[str, Damping | None], ...]

    def of_modes(self, moving: Structure) -> Structure:
        """Return a wave of all parts with the modal damping of each part.

        Raises
        ------
        InputError
            If parts are connected by more than contacts.
        """
        owner = np.array(moving.dofs.part)
        damping = as_array(moving.damping).astype(complex if moving.is_complex else float)
        for name, own in self.parts:
            if own is None:
                continue
            rows = np.flatnonzero(owner == name)
            others = np.flatnonzero(owner != name)
            _refuse_joined(name, moving, np.ix_(rows, others))
            square = np.ix_(rows, rows)
            mass, skew, stiffness = (as_array(m)[square] for m in (moving.mass, moving.damping, moving.stiffness))
            alone = Structure(mass, skew, stiffness, moving.dofs.take(rows))
            damping[square] = as_array(own.of_modes(alone).damping)
        sparse = scipy.sparse.issparse(moving.stiffness)
        return replace(moving, damping=scipy.sparse.csr_array(damping) if sparse else damping)


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Cyclic faces between the parts of neighbouring sectors.

    Parameters
    ----------
    turn
        Number of sectors and axis.
    low, high
        Dofs of all parts on the low and high faces.
    weights
        CSR as in `CyclicSector`; None: dofs in the same position are partners.
    ahead
        As in `CyclicSector`: 1: `high` follows `low` of the next sector; −1: `low` follows `high` of the previous one.
    ties
        Part -> tie of its static displacement, which is the same in all sectors.
    warnings
        Warnings for the user.
    """

    turn: Turn
    low: IntArray
    high: IntArray
    weights: Matrix | None
    ahead: int
    ties: Mapping[str, Matrix]
    warnings: tuple[str, ...]

    @property
    def followers(self) -> IntArray:
        """Dofs of the face that follows."""
        return self.high if self.ahead > 0 else self.low

    @property
    def leaders(self) -> IntArray:
        """Dofs of the face that leads."""
        return self.low if self.ahead > 0 else self.high

    def sector(self, structure: Structure, at: Coordinates) -> CyclicSector:
        """Return the cyclic sector of a structure.

        Its coordinates must include both partners of a pair of dofs, or neither.
        """
        untied = np.full(max(int(at.ids.max(initial=-1)), *self.low, *self.high, 0) + 1, -1)
        known = at.stays[at.ids[at.stays] >= 0]
        untied[at.ids[known]] = np.flatnonzero(at.ids[at.stays] >= 0)
        low, high = untied[self.low], untied[self.high]
        weights = self.weights
        if weights is None:
            here, torn = low >= 0, np.flatnonzero((low < 0) != (high < 0))
            low, high = low[here], high[here]
        else:
            here, there = low >= 0, high >= 0
            follow, lead = (there, here) if self.ahead > 0 else (here, there)
            across = (weights[follow][:, ~lead], weights[~follow][:, lead])
            torn = np.concatenate([np.unique(part.nonzero()[0]) for part in across])
            low, high, weights = low[here], high[there], weights[follow][:, lead]
        if torn.size:
            raise input_error(
                "join",
                f"{torn.size} dofs of a cyclic face follow a join, and their partners on the other face do not",
                "Join both faces alike.",
            )
        return CyclicSector(structure, self.turn.sectors, low, high, self.turn.axis, weights, self.ahead)


def neighbours(places: Places, parts: Mapping[str, Part], *, joined: bool = False) -> Neighbours | None:
    """Pair the cyclic faces of all parts; None if the model is not a sector.

    The high faces follow. The low faces follow instead if all of them have meshes that do not match and are the finer ones, and
    no surface is `joined` to the next sector.

    Raises
    ------
    InputError
        If parts have different numbers of sectors, faces do not match, or sets do not exist.
    """
    counts = {name: part.sectors for name, part in parts.items() if part.sectors > 1}
    if not counts:
        return None
    _refuse_others(parts, counts)
    found = {name: faces_of(name, parts[name], 1 if joined else None) for name in counts}
    ahead = -1 if all(one is None or one.ahead < 0 for one in found.values()) and any(found.values()) else 1
    for name, one in found.items():
        if one is not None and one.ahead != ahead:
            found[name] = faces_of(name, parts[name], ahead)
    tied, ties, warnings, axes = [], {}, [], []
    for name, sector in found.items():
        if sector is None:
            why = "has no cyclic faces; only contacts and joins lead to its neighbours."
            warnings.append(f"part.{name}: {why}")
            continue
        ties[name] = sector.tie
        axes.append(sector.axis)
        first = places.offset(name)
        tied.append((sector.leaders + first, sector.followers + first, sector.weights))
    axis = axes[0] if axes else parts[next(iter(counts))].axis
    if any((a is None) != (axis is None) or (a is not None and a != axis) for a in axes):
        raise input_error("part", "turn about different axes", "Give all parts of a wheel one axis.")
    turn = Turn(next(iter(counts.values())), axis)
    leaders, followers, weights = _one_after_the_other(tied)
    low, high = (leaders, followers) if ahead > 0 else (followers, leaders)
    return Neighbours(turn, low, high, weights, ahead, ties, tuple(warnings))


def with_joins(found: Neighbours | None, ties: Ties) -> Neighbours | None:
    """Return the cyclic faces together with the ties of joins to the next sector."""
    if found is None or not ties.high.size:
        return found
    assert found.ahead > 0
    both = (found.low, found.high, found.weights), (ties.low, ties.high, ties.onward)
    low, high, weights = _one_after_the_other(both)
    first = np.sort(np.unique(high, return_index=True)[1])  # corners at which faces meet
    low = low if weights is not None else low[first]
    weights = None if weights is None else weights[first]
    return replace(found, low=low, high=high[first], weights=weights)


def _one_after_the_other(
    tied: Sequence[tuple[IntArray, IntArray, Matrix | None]],
) -> tuple[IntArray, IntArray, Matrix | None]:
    """Concatenate tied dofs, leading and following; with weights, each leading dof occurs once."""
    low, high = stacked(one[0] for one in tied), stacked(one[1] for one in tied)
    if all(one[2] is None for one in tied):
        return low, high, None
    weights = scipy.sparse.block_diag(
        [scipy.sparse.eye_array(one[0].size) if one[2] is None else one[2] for one in tied]
    )
    once, place = np.unique(low, return_inverse=True)
    merged = weights @ picked(place, once.size)
    return once, high, scipy.sparse.csr_array(merged)


def _refuse_others(parts: Mapping[str, Part], counts: Mapping[str, int]) -> None:
    first = next(iter(counts))
    for name, count in counts.items():
        if count != counts[first]:
            raise input_error(
                f"part.{name}.sectors",
                f"is {count}, and the part {first!r} is one of {counts[first]} sectors",
                "All parts of a wheel have the same number of sectors.",
            )
    for name, part in parts.items():
        if part.sectors == 1 and part.mesh is not None:
            raise input_error(
                f"part.{name}.sectors",
                f"is 1, and the part {first!r} is one of {counts[first]} sectors",
                f"Give sectors = {counts[first]}: each sector has one of all parts.",
            )


def faces_of(name: str, part: Part, ahead: int | None = None) -> CyclicSector | None:
    """Return the cyclic sector of a part; None without cyclic faces.

    `ahead` says which face follows where meshes do not match, as in `CyclicSector`; None: the finer one.
    """
    here = [face in part.structure.sets for face in part.faces]
    if not any(here) and part.faces == Part.faces:
        return None
    try:
        low, high = (part.structure.dof_set(face) for face in part.faces)
        if part.cyclic == MEAN:
            return unlike_faces(part, ahead)
        if part.mesh is None and not _in_space(part.structure, low):
            return CyclicSector(part.structure, part.sectors, low, high, axis=None)
        return cyclic_sector(part.structure, part.sectors, low=part.faces[0], high=part.faces[1], axis=part.axis)
    except InputError as error:
        raise error.inside(f"part.{name}") from None


def _in_space(structure: Structure, members: IntArray) -> bool:
    nodes, counts = np.unique(structure.dofs.node[members], return_counts=True)
    return bool(nodes.size and nodes[0] >= 0 and counts.max() >= IN_SPACE)


def partners(sector: CyclicSector) -> IntArray:
    """Return all dofs of a sector, with dofs of the face that follows replaced by their partners on the other.

    -1 for several partners.
    """
    place = np.arange(sector.structure.n)
    follow, lead, weights = sector.following
    place[follow] = -1
    single = np.flatnonzero(np.diff(weights.indptr) == 1)
    place[follow[single]] = lead[weights.indices[weights.indptr[single]]]
    return place


def leaders(sector: CyclicSector, dofs: IntArray) -> IntArray:
    """Return the independent dofs for `dofs` of a sector, in ascending order.

    They are the dofs themselves, or their partners on the face that leads.
    """
    follow, lead, weights = sector.following
    followed = weights[np.isin(follow, dofs)].nonzero()[1]
    return np.union1d(np.setdiff1d(dofs, follow), lead[followed])


def own_and_onward(sector: CyclicSector, dofs: IntArray) -> tuple[Matrix, Matrix]:
    """Return (n, b) matrices from independent dofs to the motion in their own sector, and in the neighbour that follows them."""
    tie = sector.tie[:, np.searchsorted(sector.independent, dofs)]
    follows = np.zeros(sector.structure.n)
    follows[sector.followers] = 1.0
    own, onward = (scipy.sparse.csr_array(scipy.sparse.diags_array(d) @ tie) for d in (1 - follows, follows))
    onward.eliminate_zeros()
    return own, onward


@dataclass(frozen=True, eq=False)
class ReducedSector:
    """Reduced waves of a wheel, in coordinates with the same gaps for every wave.

    Parameters
    ----------
    sector
        The unreduced sector.
    kept
        (k,) dofs of the sector that are the first coordinates of the reduced waves.
    ways
        Wave number -> (n0, n) from the coordinates to those of the reduced wave.
    waves
        Wave number -> reduced wave and load of steady rotation, from `reduced_wave`.
    wheel
        The waves in the common coordinates, without `basis`.
    gaps
        (3 p, n) CSR gaps from the coordinates.
    steady
        (n,) load of steady rotation, N.
    fields
        Wave number -> (n, l) loads of `Model.spread` on its coordinates; empty without such loads.
    bases
        Wave number -> map to the sector's dofs, as in `SectorWaves`.
    """

    sector: CyclicSector
    kept: IntArray
    ways: Mapping[int, Matrix]
    waves: Mapping[int, tuple[Structure, Matrix]]
    wheel: TunedWheel
    gaps: Matrix
    steady: FloatArray
    fields: Mapping[int, Matrix] = field(default_factory=dict)
    bases: Mapping[int, Matrix] = field(default_factory=dict)

    def expand(self, q: Matrix, wave_number: int) -> Matrix:
        """Return the motion (n_sector,) of all dofs of the sector from coordinates of a wave.

        The wave must have an entry in `bases`.
        """
        k = wave_number % self.sector.sectors
        return np.asarray(self.bases[k] @ (self.ways[k] @ q))

    def field(self, index: int, wave_number: int) -> Matrix:
        """Return the (n,) load number `index` of `fields` on the coordinates of a wave."""
        return np.asarray(self.fields[wave_number % self.sector.sectors][:, index])

    def load(self, force: Matrix, wave_number: int) -> Matrix:
        """Return a load (n_sector,) on kept dofs as one (n,) on the coordinates of a wave."""
        k = wave_number % self.sector.sectors
        on_wave = self.sector.wave_tie(k).conj().T @ force
        own = np.zeros(self.ways[k].shape[0], dtype=on_wave.dtype)
        own[: self.kept.size] = on_wave[np.searchsorted(self.sector.independent, self.kept)]
        return np.asarray(self.ways[k].conj().T @ own)

    def on_wave(self, operator: Matrix, k: int) -> Matrix:
        """Return an operator (m, n_sector) on kept dofs as one (m, n0) on the original coordinates of a reduced wave."""
        moved = scipy.sparse.csr_array(operator @ self.sector.wave_tie(k))
        own = moved[:, np.searchsorted(self.sector.independent, self.kept)].tocoo()
        shape = (own.shape[0], self.waves[k][0].n)
        return scipy.sparse.csr_array((own.data, (own.row, own.col)), shape=shape)

    def of_dofs(self, dofs: IntArray, place: str) -> IntArray:
        """Return the coordinates of dofs of the sector; `place` is the study key, for messages."""
        here = partners(self.sector)[dofs]
        behind = dofs[here != dofs]
        if behind.size and (place == "output.points" or np.any(here < 0)):
            face, other = ("high", "low") if self.sector.ahead > 0 else ("low", "high")
            raise input_error(
                place,
                f"{self.sector.structure.dofs.labels[int(behind[0])]} lies on the {face} cyclic face, which moves as the neighbour's {other} face",
                f"Take its partner on the {other} face, or a place beside the faces.",
            )
        rows = self.ways[0][np.searchsorted(self.kept, here)]
        single = np.diff(rows.indptr) == 1
        if not single.all():
            name = self.sector.structure.dofs.labels[int(dofs[np.flatnonzero(~single)[0]])]
            raise input_error(place, f"{name} takes part in a contact", "Take a place beside the contact.")
        return np.asarray(rows.indices, dtype=np.int64)


def reduced_wave(
    sector: CyclicSector,
    kept: IntArray,
    k: int,
    how: tuple[Reduction | None, Damping | DampingOfParts | None],
    steady: Matrix,
    others: Sequence[Matrix] = (),
) -> tuple[Structure, Matrix]:
    """Return a reduced wave, whose first coordinates are the kept dofs, and the loads of steady rotation on it.

    `how` has the reduction and the modal damping; None: no reduction, no damping. Modal coordinates follow the modes at
    the reference speeds, see `on_modes_of_others`.
    """
    moving = _with_way_back(sector, kept, k, how, others)
    load = moving.project(steady)
    return moving, as_array(load)


def modes_of_wave(sector: CyclicSector, kept: IntArray, k: int, reduction: Reduction) -> Matrix:
    """Return the modes that a reduction of a wave adds to the static shapes of the kept dofs.

    They are on the coordinates of the wave.
    """
    place = np.searchsorted(sector.independent, kept)
    return modes_of(travelling_wave(sector, k), place, reduction)


def _with_way_back(
    sector: CyclicSector,
    kept: IntArray,
    k: int,
    how: tuple[Reduction | None, Damping | DampingOfParts | None],
    others: Sequence[Matrix],
) -> Structure:
    reduction, damping = how
    place = np.searchsorted(sector.independent, kept)
    moving = travelling_wave(sector, k)
    if reduction is not None and others:
        moving = on_modes_of_others(moving, place, reduction, others)
    elif reduction is not None:
        moving = reduction.of(moving, place)
    else:
        rest = np.setdiff1d(np.arange(moving.n), place)
        moving = _in_order(moving, np.concatenate([place, rest]))
    return moving if damping is None else damping.of_modes(moving)


def _in_order(structure: Structure, order: IntArray) -> Structure:
    into = picked(order, structure.n).T.tocsr()
    return in_coordinates(structure, into, structure.dofs.take(order), {})


def wave_numbers(sectors: int, engine_order: int, harmonics: int) -> list[int]:
    """Return the wave numbers of all harmonics, in ascending order."""
    return sorted({excited_wave(engine_order, sectors, h) for h in range(harmonics + 1)})


def wheel_of(
    sector: CyclicSector,
    kept: IntArray,
    waves: Mapping[int, tuple[Structure, Matrix]],
    order: tuple[int, int],
    pairs: Pairs,
    stay: tuple[IntArray, IntArray],
) -> ReducedSector:
    """Combine reduced waves to a wheel.

    Gaps become coordinates if they are independent and act on no dof of `stay`.

    Parameters
    ----------
    sector, kept
        Unreduced sector, and its kept dofs.
    waves
        Wave number -> result of `reduced_wave`.
    order
        Engine order and highest harmonic.
    pairs
        Contacts, on the dofs of the sector.
    stay
        Dofs that must stay coordinates: outputs, in the phase of this sector, and rigid bodies.
    """
    place = np.searchsorted(sector.independent, kept)
    shown = picked(stay[0], sector.structure.n)
    following = scipy.sparse.vstack([pairs.following, scipy.sparse.csr_array(shown.shape)])
    known = scipy.sparse.vstack([pairs.own, shown]), following
    nodal = nodal_coordinates(sector, place, waves[0][0].n, known)
    phases = {k: wave(k, sector.sectors).phase for k in waves}
    written = {k: nodal.of_wave(structure, phases[k]) for k, (structure, _) in waves.items()}
    ways = {k: scipy.sparse.csr_array(structure.basis) for k, structure in written.items()}
    gaps = scipy.sparse.csr_array(nodal.operator[: pairs.own.shape[0]])
    stays = np.isin(kept, partners(sector)[np.concatenate(stay)])
    fixed = np.zeros(gaps.shape[1])
    fixed[np.flatnonzero(stays)] = 1.0
    moved = gaps @ scipy.sparse.diags_array(1.0 - fixed)
    moved.eliminate_zeros()
    touched = np.unique(moved.indices)
    hidden = bool(np.isin(gaps.indices, np.flatnonzero(stays)).any())
    fewer = np.count_nonzero(np.diff(moved.indptr)) < touched.size
    if touched.size and (fewer or not hidden) and not nodal.multipliers.size:
        # without the contribution of `stay`, gaps and remaining coordinates are the same combinations in all waves
        plain = {k: replace(structure, basis=None) for k, structure in written.items()}
        try:
            small = {k: in_relative_coordinates(s, moved, pairs.names) for k, s in plain.items()}
        except InputError:  # gaps depend on each other: nodes stay
            small = {}
        if small:
            into = scipy.sparse.csr_array(small[0][0].basis)
            gaps = small[0][1] + gaps @ scipy.sparse.diags_array(fixed) @ into
            written = {k: structure for k, (structure, _) in small.items()}
            ways = {k: scipy.sparse.csr_array(way @ into) for k, way in ways.items()}
    structures = {k: replace(structure, basis=None) for k, structure in written.items()}
    wheel = TunedWheel(structures, sector.sectors, *order, nodal.multipliers)
    steady = np.real(ways[0].conj().T @ waves[0][1])
    return ReducedSector(sector, kept, ways, waves, wheel, scipy.sparse.csr_array(gaps), steady)


def _refuse_joined(name: str, moving: Structure, across: tuple[Matrix, ...]) -> None:
    for matrix in (moving.mass, moving.stiffness):
        dense = as_array(matrix)
        if np.abs(dense[across]).max(initial=0.0) > JOINED * np.abs(dense).max(initial=0.0):
            raise input_error(
                f"part.{name}.damping",
                "differs from the value of a part joined to it, and both have their modes together",
                "Give them the same damping by modes, or another form.",
            )


def is_staged(joins: Mapping[str, Join]) -> bool:
    """Whether a join couples stages."""
    return any(join.pairing == SPATIAL for join in joins.values())


def stages_of(places: Places, joins: Mapping[str, Join], contacts: Collection[str], speed: float) -> Multistage | None:
    """Return the wheels of a model whose joins couple several wheels; None for a model with one wheel.

    Parameters
    ----------
    places
        Dofs and names of the parts.
    joins, contacts
        Joins of the model, and names of its contacts.
    speed
        Rotor speed, rad/s; zero for models that do not depend on it.

    Raises
    ------
    InputError
        If the parts have other joins or contacts, a part is not a sector or has no flange, or the flanges do not fit.
    """
    if not is_staged(joins):
        return None
    for name, join in joins.items():
        if join.pairing != SPATIAL:
            raise input_error(f"join.{name}.pairing", f"is {join.pairing} beside joins by {SPATIAL}", ALONE)
    if contacts:
        raise input_error(f"contact.{next(iter(contacts))}", "is between stages or within one", ALONE)
    if speed > 0:
        raise input_error("rotation.speed_rpm", "gives stages a prestress that crosses their flanges", ALONE)
    flanges = [_flange(places, f"join.{name}", join) for name, join in joins.items()]
    used = {stage for flange in flanges for stage in flange.stages}
    sectors = {}
    for name, part in places.parts.items():
        sector = faces_of(name, part) if part.sectors > 1 and name in used else None
        if sector is None:
            raise input_error(
                f"part.{name}",
                "is no sector with cyclic faces on a flange",
                "Every part is one stage: give it its sectors, and a join by spatial harmonics.",
            )
        sectors[name] = sector
    return multistage(sectors, flanges)


def _flange(places: Places, key: str, join: Join) -> Flange:
    names, dofs = [], []
    for surface in join.between:
        if surface.startswith(NEXT):
            raise input_error(f"{key}.between", f"{surface!r} is on the next sector", "Name the stages.")
        spot = places.spot(surface, f"{key}.between")
        if spot.nodes is None:
            raise input_error(f"{key}.between", f"{surface!r} holds no nodes", "Name a node set.")
        names.append(spot.part)
        dofs.append(_of_part(spot.nodes, places.offset(spot.part)))
    if names[0] == names[1]:
        raise input_error(f"{key}.between", f"names {names[0]!r} twice", "Name two stages.")
    return Flange((names[0], names[1]), (dofs[0], dofs[1]), tuple(sorted(set(join.harmonics))))


def _of_part(nodes: IntArray, offset: int) -> IntArray:
    return np.unique(nodes[nodes >= 0]) - offset
