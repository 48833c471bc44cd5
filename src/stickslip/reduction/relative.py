"""Relative coordinates of contacts: gaps in the place of the displacements of both sides (Krack et al. 2017, appendix 3)."""

from collections.abc import Sequence

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates, surviving_sets

RANK = 1e-9  # smallest singular value over largest, below which gaps depend on each other
DIRECTIONS = ("t", "w", "n")


def in_relative_coordinates(
    structure: Structure, gap_operator: Matrix, names: Sequence[str] = ()
) -> tuple[Structure, Matrix]:
    """Write a structure in the gaps of its contacts and the coordinates that leave the gaps alone.

    ``u = L [g, rest]`` with ``L = [B⁺ N]``, the pseudo-inverse and the null space of the gap operator, block by block over the groups of
    contacts that share dofs (eq. 51 and 52; dofs that no contact touches stay as they are). A contact force then acts on its gap
    alone (eq. 54), so that only the gaps need to be retained: half the unknowns between two flexible bodies.

    Parameters
    ----------
    structure
        Structure that the contacts join; also a travelling wave.
    gap_operator
        (3 n_contacts, n) rows t, w, n of each contact; rows of zeros are directions without a gap and get no coordinate. Complex
        for contacts between neighbouring sectors of a travelling wave, ``g = B u`` with the neighbour's phase in B.
    names
        Names of the contacts, for labels and messages; numbers where none are given.

    Returns
    -------
    structure
        The same structure in the coordinates gaps [m], rest [m], untouched dofs. Sets of untouched dofs survive; ``gaps`` holds the gaps
        in the order of the rows, ``rest`` the coordinates that move no gap. `basis` leads back.
    gap_operator
        (3 n_contacts, n) in the new coordinates: a single one in each row that had an entry.

    Raises
    ------
    InputError
        If gaps depend on each other; the message names the contacts.
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
    full = np.asarray(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix)
    return full if np.iscomplexobj(full) else full.astype(float)


def _local_inverses(B: Matrix, used: IntArray, touched: IntArray, contacts: tuple[str, ...]) -> tuple[Matrix, Matrix]:
    """Return B⁺ and the null space of B on all dofs, from the blocks of contacts that share dofs."""
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
    """Return a basis of the same space with as many zeros as elimination gives, orthonormal: a block has no preferred one."""
    if not vectors.size:
        return vectors
    _, _, order = scipy.linalg.qr(vectors.T, pivoting=True)
    pivots = np.sort(order[: vectors.shape[1]])
    return np.asarray(np.linalg.qr(vectors @ np.linalg.inv(vectors[pivots]))[0])


def _refuse(u: Matrix, s: FloatArray, rows: IntArray, contacts: tuple[str, ...]) -> None:
    """Name the contacts whose gaps depend on each other."""
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
