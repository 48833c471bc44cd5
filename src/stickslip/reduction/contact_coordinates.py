"""Coordinates of a structure for its contacts: the gaps, or displacements of a sector and of its neighbours.

Relative coordinates replace the displacements of both sides by their gaps (Krack et al. 2017, appendix 3).

Nodal coordinates serve travelling waves. Sector n + s moves like sector n times ``exp(i s θ)``, so a neighbour's dof is the
sector's own dof in another phase. If contacts act on a dof in one phase only, the dof in this phase becomes the coordinate (a
unitary change). A dof on which contacts act in several phases gets a coordinate for each; a constraint, whose force is an
unknown, ties it to the first. The gaps are then real combinations of the coordinates, the same in all waves and so in all
harmonics.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure, join_dofs
from stickslip.reduction.basis import in_coordinates, surviving_sets
from stickslip.reduction.cyclic import CyclicSector


@dataclass(frozen=True, eq=False)
class NodalCoordinates:
    """Nodal coordinates of travelling waves, with real gap operators; `nodal_coordinates` makes them.

    The new coordinates are, in order: the old ones, in the first phase in which contacts act on them; copies in other phases; the
    constraint forces of the copies.

    Parameters
    ----------
    ahead
        (m,) sectors by which the phase of each old coordinate is ahead; -1: behind.
    copied
        (c,) old coordinate of each copy.
    farther
        (c,) sectors by which a copy is ahead of its coordinate.
    operator
        (3 n_contacts, m + 2 c) from the new coordinates to the gaps.
    """

    ahead: IntArray
    copied: IntArray
    farther: IntArray
    operator: FloatArray

    @property
    def multipliers(self) -> IntArray:
        """Indices of the coordinates that are constraint forces."""
        first = self.ahead.size + self.copied.size
        return np.arange(first, first + self.copied.size)

    def of_wave(self, structure: Structure, phase: complex | float) -> Structure:
        """Return a wave in the new coordinates.

        Parameters
        ----------
        structure
            The wave in the old coordinates.
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
        """Return the rows and columns of the constraints ``copy = phase^s coordinate``, scaled by the coordinate's stiffness."""
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
        """Return the table of dofs; copies have the name of the neighbour whose motion they describe."""
        copies = dofs.take(self.copied)
        parts = tuple(
            _beside(int(s)) + p if p else _beside(int(s)).removesuffix(".")
            for s, p in zip(self.farther, copies.part, strict=True)
        )
        held = tuple(f"tie_{c}" for c in copies.component)
        joined = join_dofs({"": dofs, "copies": copies, "held": copies})
        return Dofs(
            joined.node, dofs.component + copies.component + held, joined.position, (*dofs.part, *parts, *parts)
        )


def _beside(sectors: int) -> str:
    """Return the prefix of a neighbour's part."""
    return "next." * sectors if sectors > 0 else "previous." * -sectors


def nodal_coordinates(
    sector: CyclicSector, place: IntArray, n: int, gaps: tuple[Matrix, Matrix | None]
) -> NodalCoordinates:
    """Find the phases in which contacts act on the coordinates of the waves.

    Parameters
    ----------
    sector
        One sector.
    place
        (m,) positions, among its independent dofs, of the first coordinates of the waves, the only ones on which contacts act.
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
    known, sectors = gaps_by_sector(sector, place, (own, following))
    phases = np.array([(abs(part) > 0).sum(axis=0) > 0 for part in known]).reshape(3, -1)
    first = np.argmax(phases, axis=0)
    ahead = np.zeros(n, dtype=np.int64)
    ahead[: place.size] = sectors[first]
    again = phases.copy()
    again[first, np.arange(place.size)] = False
    shift, copied = np.nonzero(again)
    operator = np.zeros((own.shape[0], n + 2 * copied.size))
    for s, part in enumerate(known):
        mine = np.flatnonzero(phases[s] & (first == s))
        operator[:, mine] = part[:, mine].toarray()
        copies = np.flatnonzero(shift == s)
        operator[:, n + copies] = part[:, copied[copies]].toarray()
    return NodalCoordinates(ahead, copied, sectors[shift] - sectors[first[copied]], operator)


def gaps_by_sector(
    sector: CyclicSector, place: IntArray, gaps: tuple[Matrix, Matrix]
) -> tuple[tuple[Matrix, Matrix, Matrix], IntArray]:
    """Return the dependence of gaps on independent dofs of three sectors, and the numbers (3,) of sectors ahead, own one first.

    Parameters
    ----------
    sector
        One sector.
    place
        (m,) positions among its independent dofs.
    gaps
        Operators (3 n_contacts, n_sector) on this sector and on the next one.
    """
    own, following = gaps
    tie = sector.tie[:, : sector.independent.size][:, place]
    follows = np.zeros(sector.structure.n)
    follows[sector.followers] = 1.0
    tied, free = (scipy.sparse.diags_array(d) @ tie for d in (follows, 1.0 - follows))
    if sector.ahead > 0:
        return (own @ free, own @ tied + following @ free, following @ tied), np.array([0, 1, 2])
    return (own @ free + following @ tied, following @ free, own @ tied), np.array([0, 1, -1])


def own_motions(structure: Structure, multipliers: IntArray) -> Matrix:
    """Return the (n, m) matrix from the independent coordinates of a wave to all of its coordinates.

    Copies follow by the constraints of the wave; the rows of constraint forces are zero.

    Parameters
    ----------
    structure
        The wave in `NodalCoordinates`, or in any coordinates without constraints.
    multipliers
        (c,) coordinates that are constraint forces, the last ones; the preceding c coordinates are the copies.
    """
    n, ties = structure.n, multipliers.size
    if not np.array_equal(multipliers, np.arange(n - ties, n)):
        raise input_error("TunedWheel", "has forces of constraints among its motions", "Put them behind these.")
    own = n - 2 * ties
    held = structure.stiffness[n - ties :]
    dense = as_array(held)
    copies = -np.linalg.solve(dense[:, own : own + ties], dense[:, :own])
    return np.vstack([np.eye(own), copies, np.zeros((ties, own))])


RANK = 1e-9  # smallest over largest singular value, below which gaps are dependent
DIRECTIONS = ("t", "w", "n")


def in_relative_coordinates(
    structure: Structure, gap_operator: Matrix, names: Sequence[str] = ()
) -> tuple[Structure, Matrix]:
    """Transform a structure to the gaps of its contacts and to coordinates that do not change the gaps.

    ``u = L [g, rest]`` with ``L = [B⁺ N]``, the pseudo-inverse and the null space of the gap operator, computed for each group of
    contacts that share dofs (eq. 51 and 52; dofs without contact do not change). A contact force then acts on its gap only
    (eq. 54), so that only the gaps are retained: half as many unknowns between two flexible bodies.

    Parameters
    ----------
    structure
        Structure with the contacts; also a travelling wave.
    gap_operator
        (3 n_contacts, n) rows t, w, n of each contact; rows of zeros are directions without a gap and get no coordinate. Complex
        for contacts between neighbouring sectors of a travelling wave, ``g = B u`` with the neighbour's phase in B.
    names
        Names of the contacts, for labels and messages; numbers by default.

    Returns
    -------
    structure
        The same structure in the coordinates gaps [m], rest [m], dofs without contact. Sets of dofs without contact survive; the set
        ``gaps`` contains the gaps in the order of the rows, ``rest`` the coordinates that do not change a gap. `basis` leads back.
    gap_operator
        (3 n_contacts, n) in the new coordinates: a single 1 in each row that had an entry.

    Raises
    ------
    InputError
        If gaps are linearly dependent; the message names the contacts.
    """
    B = _dense(gap_operator)
    if B.ndim != 2 or B.shape[1] != structure.n or B.shape[0] % 3:
        raise input_error(
            "in_relative_coordinates: gap_operator",
            f"has shape {B.shape} for {structure.n} dofs",
            "Give three rows (t, w, n) a contact and a column a dof.",
        )
    contacts = tuple(names) or tuple(str(i + 1) for i in range(B.shape[0] // 3))
    used = np.flatnonzero(np.any(B != 0.0, axis=1))
    touched = np.any(B != 0.0, axis=0)
    free = np.flatnonzero(~touched)
    inverse, null = _local_inverses(B, used, np.flatnonzero(touched), contacts)
    eye = scipy.sparse.csr_array((np.ones(free.size), (free, np.arange(free.size))), shape=(structure.n, free.size))
    L = scipy.sparse.hstack([inverse, null, eye], format="csr")
    gaps, rest = np.arange(used.size), np.arange(used.size, used.size + null.shape[1])
    operator = np.zeros_like(B)
    operator[used, gaps] = 1.0
    return (
        in_coordinates(
            structure,
            L if scipy.sparse.issparse(structure.stiffness) else L.toarray(),
            _dofs(structure.dofs, used, contacts, rest.size, free),
            surviving_sets(structure, free, rest.size + used.size) | {"gaps": gaps, "rest": rest},
        ),
        operator,
    )


def _dense(matrix: Matrix) -> Matrix:
    full = as_array(matrix)
    return full if np.iscomplexobj(full) else full.astype(float)


def _local_inverses(B: Matrix, used: IntArray, touched: IntArray, contacts: tuple[str, ...]) -> tuple[Matrix, Matrix]:
    """Return the pseudo-inverse B⁺ and the null space of B on all dofs, from the blocks of contacts that share dofs."""
    pattern = scipy.sparse.csr_array(B[np.ix_(used, touched)] != 0.0)
    graph = scipy.sparse.block_array([[None, pattern], [pattern.T, None]], format="csr")
    count, group = scipy.sparse.csgraph.connected_components(graph, directed=False)
    inverse = scipy.sparse.lil_array((B.shape[1], used.size), dtype=B.dtype)
    columns: list[tuple[IntArray, Matrix]] = []
    for g in range(count):
        rows = np.flatnonzero(group[: used.size] == g)
        dofs = touched[group[used.size :] == g]
        block = B[np.ix_(used[rows], dofs)]
        u, s, vt = np.linalg.svd(block)
        if rows.size > dofs.size or s[-1] <= RANK * s[0]:
            _refuse(u, s, used[rows], contacts)
        inverse[np.ix_(dofs, rows)] = vt[: s.size].conj().T @ (u.conj().T / s[:, None])
        columns.append((dofs, _tidy(vt[s.size :].conj().T)))
    null = scipy.sparse.lil_array((B.shape[1], sum(v.shape[1] for _, v in columns)), dtype=B.dtype)
    at = 0
    for dofs, vectors in columns:
        null[np.ix_(dofs, np.arange(at, at + vectors.shape[1]))] = vectors
        at += vectors.shape[1]
    return inverse.tocsr(), null.tocsr()


def _tidy(vectors: Matrix) -> Matrix:
    """Return an orthonormal basis of the same space with many zeros, from elimination."""
    if not vectors.size:
        return vectors
    _, _, order = scipy.linalg.qr(vectors.T, pivoting=True)
    pivots = np.sort(order[: vectors.shape[1]])
    return np.asarray(np.linalg.qr(vectors @ np.linalg.inv(vectors[pivots]))[0])


def _refuse(u: Matrix, s: FloatArray, rows: IntArray, contacts: tuple[str, ...]) -> None:
    """Raise the error that names the contacts with dependent gaps."""
    rank = int(np.count_nonzero(s > RANK * s[0]))
    share = np.linalg.norm(u[:, rank:], axis=1)
    involved = sorted({int(r) // 3 for r in rows[share > 1e-6]}, key=lambda c: contacts[c])
    listed = ", ".join(contacts[c] for c in involved[:6]) + (" ..." if len(involved) > 6 else "")
    raise input_error(
        "in_relative_coordinates",
        f"the gaps of contacts {listed} depend on each other: {rows.size} gaps of which {rank} are independent",
        "Keep nodal coordinates (harmonic_balance takes both), or leave out contacts that share nodes.",
    )


def _dofs(dofs: Dofs, used: IntArray, contacts: tuple[str, ...], n_rest: int, free: IntArray) -> Dofs:
    kept = dofs.take(free)
    new = used.size + n_rest
    return Dofs(
        np.concatenate([np.full(new, -1), kept.node]),
        tuple(f"gap_{DIRECTIONS[r % 3]}" for r in used) + ("rest",) * n_rest + kept.component,
        np.vstack([np.full((new, 3), np.nan), kept.position]),
        tuple(contacts[r // 3] for r in used) + ("",) * n_rest + kept.part,
    )
