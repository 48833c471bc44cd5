"""A model that is a sector of a wheel: how its parts meet their neighbours, and its waves reduced."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.assembly.coordinates import Coordinates
from stickslip.assembly.pairs import Pairs, Turn
from stickslip.assembly.places import Places
from stickslip.assembly.ties import Ties
from stickslip.errors import InputError, input_error
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector, cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.relative import in_relative_coordinates
from stickslip.reduction.tuned import TunedWheel
from stickslip.reduction.waves import excited_wave, wave

IN_SPACE = 2  # directions in which a node moves; fewer: coordinates that no turn changes


@dataclass(frozen=True, eq=False)
class Neighbours:
    """How the parts of a sector meet those of its neighbours.

    Parameters
    ----------
    turn
        Number of sectors and axis.
    low, high
        (m,) dofs of all parts that are partners.
    ties
        Part -> tie of its static displacement, which all sectors have alike.
    warnings
        What the user should know.
    """

    turn: Turn
    low: IntArray
    high: IntArray
    ties: Mapping[str, Matrix]
    warnings: tuple[str, ...]

    def sector(self, structure: Structure, at: Coordinates) -> CyclicSector:
        """Return the sector, given its structure on coordinates that hold all partners or none of a pair."""
        untied = np.full(max(int(at.ids.max(initial=-1)), *self.low, *self.high, 0) + 1, -1)
        known = at.stays[at.ids[at.stays] >= 0]
        untied[at.ids[known]] = np.flatnonzero(at.ids[at.stays] >= 0)
        low, high = untied[self.low], untied[self.high]
        torn = np.flatnonzero((low < 0) != (high < 0))
        if torn.size:
            raise input_error(
                "join",
                f"{torn.size} dofs of a cyclic face follow a join, and their partners on the other face do not",
                "Join both faces alike.",
            )
        both = low >= 0
        return CyclicSector(structure, self.turn.sectors, low[both], high[both], self.turn.axis)


def neighbours(places: Places, parts: Mapping[str, Part]) -> Neighbours | None:
    """Pair the cyclic faces of all parts; None where the model is no sector.

    Raises
    ------
    InputError
        If parts belong to wheels of different sizes, faces do not match, or sets are not there.
    """
    counts = {name: part.sectors for name, part in parts.items() if part.sectors > 1}
    if not counts:
        return None
    _refuse_others(parts, counts)
    low, high, ties, warnings, axes = [], [], {}, [], []
    for name in counts:
        part = parts[name]
        sector = _faces(name, part)
        if sector is None:
            warnings.append(
                f"part.{name}: has no cyclic faces; only contacts and joins lead to its neighbours."
            )
            continue
        ties[name] = sector.tie
        axes.append(sector.axis)
        low.append(sector.low + places.offset(name))
        high.append(sector.high + places.offset(name))
    axis = axes[0] if axes else parts[next(iter(counts))].axis
    if any((a is None) != (axis is None) or (a is not None and a != axis) for a in axes):
        raise input_error(
            "part", "turn about different axes", "Give all parts of a wheel one axis."
        )
    turn = Turn(next(iter(counts.values())), axis)
    empty = np.zeros(0, dtype=np.int64)
    return Neighbours(
        turn, np.concatenate([empty, *low]), np.concatenate([empty, *high]), ties, tuple(warnings)
    )


def with_joins(found: Neighbours | None, ties: Ties) -> Neighbours | None:
    """Return the neighbours with what joins tie from sector to sector."""
    if found is None or not ties.low.size:
        return found
    low, high = np.concatenate([found.low, ties.low]), np.concatenate([found.high, ties.high])
    first = np.sort(np.unique(high, return_index=True)[1])  # corners of faces that meet
    return replace(found, low=low[first], high=high[first])


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


def _faces(name: str, part: Part) -> CyclicSector | None:
    """Return the sector that a part is; None where it has no faces."""
    here = [face in part.structure.sets for face in part.faces]
    if not any(here) and part.faces == Part.faces:
        return None
    try:
        low, high = (part.structure.dof_set(face) for face in part.faces)
        if part.mesh is None and not _in_space(part.structure, low):
            return CyclicSector(part.structure, part.sectors, low, high, axis=None)
        return cyclic_sector(
            part.structure, part.sectors, low=part.faces[0], high=part.faces[1], axis=part.axis
        )
    except InputError as error:
        raise error.inside(f"part.{name}") from None


def _in_space(structure: Structure, members: IntArray) -> bool:
    nodes, counts = np.unique(structure.dofs.node[members], return_counts=True)
    return bool(nodes.size and nodes[0] >= 0 and counts.max() >= IN_SPACE)


@dataclass(frozen=True, eq=False)
class Roles:
    """Contacts of a sector on its kept coordinates, alike in all waves.

    Coordinates on which a contact of the neighbour behind acts stand for this dof of the sector ahead: ``u_next = exp(iθ) u``.

    Parameters
    ----------
    kept
        (k,) dofs of the sector that stay physical.
    ahead
        (k,) which of them stand for those of the next sector.
    gaps
        (3 p, k) CSR.
    """

    kept: IntArray
    ahead: BoolArray
    gaps: Matrix

    def shift(self, k: int, sectors: int, n: int) -> Matrix:
        """Return the (n,) factors that make displacements of a wave's kept dofs and modes of the coordinates."""
        phase = wave(k, sectors).phase
        factors = np.ones(n, dtype=type(phase))
        factors[: self.kept.size][self.ahead] = np.conj(phase)
        return factors


def roles(sector: CyclicSector, pairs: Pairs, kept: IntArray) -> Roles:
    """Find which coordinates stand for the next sector's.

    Raises
    ------
    InputError
        If contacts need one dof both as this sector's and as the next one's.
    """
    own, following = _off_the_high_face(sector, pairs)
    needed = np.union1d(own.nonzero()[1], following.nonzero()[1])
    kept = np.union1d(_partners(sector)[kept], needed)
    here, there = (np.isin(kept, m.nonzero()[1]) for m in (own, following))
    both = np.flatnonzero(here & there)
    if both.size:
        name = sector.structure.dofs.labels[kept[both[0]]]
        raise input_error(
            "contact",
            f"{name} takes part both in a contact with the sector ahead and in one with the sector behind or inside, {both.size} such dofs",
            "Take its node out of one of the surfaces.",
        )
    return Roles(kept, there, scipy.sparse.csr_array((own + following)[:, kept]))


def _partners(sector: CyclicSector) -> IntArray:
    """Return each dof of a sector, those of the high face replaced by their partners on the low one."""
    place = np.arange(sector.structure.n)
    tied = sector.low != sector.high
    place[sector.high[tied]] = sector.low[tied]
    return place


def _off_the_high_face(sector: CyclicSector, pairs: Pairs) -> tuple[Matrix, Matrix]:
    """Return the gap operators with the motion of the high face written as that of the next sector's low face."""
    own, following = pairs.own, pairs.following
    tied = sector.low != sector.high
    high = sector.high[tied]
    if following[:, high].nnz:
        raise input_error(
            "contact",
            "the sector ahead is touched on its high cyclic face, which belongs to the one after it",
            "Let the contact be that between the sector behind and this one's low side.",
        )
    if not own[:, high].nnz:
        return own, following
    n = sector.structure.n
    tie = sector.wave_tie(
        0
    )  # to displacements of the high face from those of the low one in the next sector
    moved = scipy.sparse.csr_array(own[:, high] @ tie[high])
    free = sector.independent
    place = scipy.sparse.csr_array(
        (np.ones(free.size), (np.arange(free.size), free)), shape=(tie.shape[1], n)
    )
    stays = np.ones(n)
    stays[high] = 0.0
    return (
        scipy.sparse.csr_array(own @ scipy.sparse.diags_array(stays)),
        scipy.sparse.csr_array(following + moved @ place),
    )


@dataclass(frozen=True, eq=False)
class ReducedSector:
    """The waves of a wheel, reduced, on coordinates that mean the same to its contacts.

    Parameters
    ----------
    sector
        What was reduced.
    role
        Kept dofs, and what contacts make of them.
    wheel
        Waves without their way back.
    gaps
        (3 p, n) CSR.
    steady
        (n,) load of steady rotation.
    into
        (n0, n) CSR from the coordinates to kept dofs and modes; None where they are the same.
    """

    sector: CyclicSector
    role: Roles
    wheel: TunedWheel
    gaps: Matrix
    steady: FloatArray
    into: Matrix | None

    def load(self, force: Matrix, wave_number: int) -> Matrix:
        """Return the (n,) load on the coordinates of a wave of a load (n_sector,) on kept dofs."""
        k = wave_number % self.sector.sectors
        on_wave = self.sector.wave_tie(k).conj().T @ force
        place = np.searchsorted(self.sector.independent, self.role.kept)
        n0 = self.wheel.n if self.into is None else self.into.shape[0]
        own = np.zeros(n0, dtype=on_wave.dtype)
        own[: place.size] = on_wave[place]
        own = np.conj(self.role.shift(k, self.sector.sectors, n0)) * own
        return own if self.into is None else np.asarray(self.into.T @ own)

    def of_dofs(self, dofs: IntArray, place: str) -> IntArray:
        """Return the coordinates that dofs of the sector are; `place` is the key that asks for them."""
        found = np.searchsorted(self.role.kept, _partners(self.sector)[dofs])
        if self.into is None:
            return found
        rows = self.into[found]
        single = np.diff(rows.indptr) == 1
        if not single.all():
            name = self.sector.structure.dofs.labels[int(dofs[np.flatnonzero(~single)[0]])]
            raise input_error(
                place, f"{name} takes part in a contact", "Take a place beside the contact."
            )
        return np.asarray(rows.indices, dtype=np.int64)


def reduced_wave(
    sector: CyclicSector, kept: IntArray, k: int, n_modes: int | None, steady: FloatArray
) -> tuple[Structure, Matrix]:
    """Return a reduced wave, its first coordinates the kept dofs, without its way back, and the load of steady rotation on it."""
    place = np.searchsorted(sector.independent, kept)
    moving = travelling_wave(sector, k)
    if n_modes is not None:
        moving = craig_bampton(moving, place, n_modes)
    else:
        moving = _taken(moving, np.concatenate([place, np.setdiff1d(np.arange(moving.n), place)]))
    return replace(moving, basis=None), moving.project(steady)


def _taken(structure: Structure, order: IntArray) -> Structure:
    square = np.ix_(order, order)
    dense = _dense(structure)
    place = np.argsort(order)
    sets = {name: place[index] for name, index in structure.sets.items()}
    loss = None if dense.loss is None else dense.loss[square]
    return Structure(
        dense.mass[square], dense.damping[square], dense.stiffness[square],
        structure.dofs.take(order), sets, structure.basis[:, order], loss,
    )  # fmt: skip


def _dense(structure: Structure) -> Structure:
    def full(matrix: Matrix) -> Matrix:
        return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix

    names = ("mass", "damping", "stiffness", "loss")
    return replace(structure, **{name: full(getattr(structure, name)) for name in names})


def _shifted(structure: Structure, shift: Matrix) -> Structure:
    """Return a structure in coordinates of another phase: ``u = shift * q``; the way back is dropped."""

    def turned(matrix: Matrix) -> Matrix:
        return None if matrix is None else np.conj(shift)[:, None] * matrix * shift

    names = ("mass", "damping", "stiffness", "loss")
    found = {name: turned(getattr(structure, name)) for name in names}
    return replace(structure, basis=None, **found)


def conjugate(structure: Structure) -> Structure:
    """Return the wave that travels the other way."""
    names = ("mass", "damping", "stiffness", "loss")
    own = {name: getattr(structure, name) for name in names}
    return replace(structure, **{k: None if m is None else np.conj(m) for k, m in own.items()})


def wave_numbers(sectors: int, engine_order: int, harmonics: int) -> list[int]:
    """Return the wave numbers of all harmonics, in rising order."""
    return sorted({excited_wave(engine_order, sectors, h) for h in range(harmonics + 1)})


def wheel_of(
    sector: CyclicSector,
    role: Roles,
    waves: Mapping[int, tuple[Structure, Matrix]],
    order: tuple[int, int],
    names: tuple[str, ...],
    stay: IntArray,
) -> ReducedSector:
    """Put the waves together, in gaps where these do not depend on each other and no coordinate that has to stay is touched.

    Parameters
    ----------
    sector, role
        What was reduced.
    waves
        Wave number -> what `reduced_wave` returned.
    order
        Engine order and highest harmonic.
    names
        Of the contacts.
    stay
        Dofs that have to stay coordinates: outputs, rigid bodies.
    """
    n = waves[0][0].n
    gaps = _padded(role.gaps, n)
    steady = np.real(waves[0][1])
    structures = {
        k: _shifted(structure, role.shift(k, sector.sectors, n))
        for k, (structure, _) in waves.items()
    }
    touched = np.unique(gaps.nonzero()[1])
    into = None
    if touched.size and not np.isin(role.kept[touched], _partners(sector)[stay]).any():
        try:
            small = {k: in_relative_coordinates(s, gaps, names) for k, s in structures.items()}
        except InputError:  # gaps depend on each other: nodes stay
            small = {}
        if small:
            into = scipy.sparse.csr_array(small[0][0].basis)
            gaps = scipy.sparse.csr_array(small[0][1])
            steady = np.asarray(into.T @ steady)
            structures = {k: replace(s, basis=None) for k, (s, _) in small.items()}
    wheel = TunedWheel(structures, sector.sectors, *order)
    return ReducedSector(sector, role, wheel, gaps, steady, into)


def _padded(gaps: Matrix, n: int) -> Matrix:
    own = gaps.tocoo()
    return scipy.sparse.csr_array((own.data, (own.row, own.col)), shape=(gaps.shape[0], n))
