"""Joins of a model as ties: ``u = tie @ q``, where the first side's dofs follow the second's."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.assembly.contact import ALONE, SPATIAL, Join
from stickslip.assembly.joints.pairs import Turn, match, sides
from stickslip.assembly.joints.surface_checks import named
from stickslip.assembly.locations import NO_FACETS, Places, Spot, picked
from stickslip.contact.mortar import mortar_tie
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import in_coordinates, surviving_sets

MEAN = "segment_to_segment"
TINY = 1e-12  # smaller weights of partners are rounding


@dataclass(frozen=True, eq=False)
class Ties:
    """Ties between the N dofs of all parts.

    Parameters
    ----------
    followers
        (m,) dependent dofs.
    weights
        (m, N) CSR: each dependent dof as a weighted sum of independent ones.
    low, high
        Dofs tied from sector to sector: `high` of this sector follows `low` of the next one.
    onward
        (high, low) CSR weights of these ties.
    """

    followers: IntArray
    weights: Matrix
    low: IntArray
    high: IntArray
    onward: Matrix

    def matrix(self, index: IntArray) -> tuple[Matrix, IntArray]:
        """Return the tie of some of the dofs, and which of them are independent.

        Parameters
        ----------
        index
            (n,) dofs in the order of coordinates, -1 for modal ones. They include all dofs that a dependent one follows.

        Returns
        -------
        tie
            (n, m) CSR from the independent coordinates to all of `index`.
        stays
            (m,) positions of the independent coordinates in `index`.
        """
        follows = np.isin(index, self.followers)
        stays = np.flatnonzero(~follows)
        own = picked(np.where(follows, -1, np.cumsum(~follows) - 1), stays.size)
        if not follows.any():
            return own, stays
        column = np.full(self.weights.shape[1], -1)
        column[index[stays][index[stays] >= 0]] = np.flatnonzero(index[stays] >= 0)
        mine = self.weights[np.searchsorted(self.followers, index[follows])].tocoo()
        entries = (mine.data, (mine.row, column[mine.col]))
        followed = scipy.sparse.csr_array(entries, shape=(mine.shape[0], stays.size))
        into = picked(np.where(follows, np.cumsum(follows) - 1, -1), mine.shape[0])
        return scipy.sparse.csr_array(own + into @ followed), stays


def tie_joins(places: Places, joins: Mapping[str, Join], turn: Turn | None) -> Ties:
    """Return the ties of the joins of a model.

    Raises
    ------
    InputError
        If surfaces do not meet, a node follows twice or in a circle, or a dependent node is clamped. The message names the join.
    """
    n = places.n
    rows: dict[int, Matrix] = {}
    ahead_of: dict[int, Matrix] = {}
    for name, join in joins.items():
        key = f"join.{name}"
        if join.pairing == SPATIAL:
            raise input_error(
                f"{key}.pairing", f"is {SPATIAL}, and of wheels coupled so only the modes are known", ALONE
            )
        first, second, ahead = sides(places, key, join, turn)
        if second is None or first.surface is None or second.surface is None:
            raise input_error(f"{key}.between", "needs two surfaces", "Clamp a part to hold it against the ground.")
        found = _followed(key, join, first, second, ahead)
        if ahead is not None:
            ahead_of |= {dof: row for dof, row in found.items() if dof not in ahead_of}
            continue
        _refuse_twice(places, key, found, rows)
        rows |= found
    followers = np.array(sorted(rows), dtype=np.int64)
    weights = scipy.sparse.vstack([scipy.sparse.csr_array((0, n)), *(rows[d] for d in followers)], format="csr")
    weights = _resolved(places, followers, weights, len(joins))
    onward = scipy.sparse.vstack([scipy.sparse.csr_array((0, n)), *ahead_of.values()], format="csr")
    low = np.unique(onward.indices).astype(np.int64)
    high = np.array(list(ahead_of), dtype=np.int64)
    return Ties(followers, weights, low, high, onward[:, low])


def _followed(key: str, join: Join, first: Spot, second: Spot, turn: Turn | None) -> dict[int, Matrix]:
    """Return each dof of the first side with its row of weights, and such rows for the next sector in its own axes."""
    assert first.surface is not None
    assert second.surface is not None
    if first.nodes is None:
        raise input_error(
            f"{key}.between",
            f"the points of {first.name!r} are those of a rigid body, which cannot follow",
            "Let it be the second side.",
        )
    a, b = first.surface, second.surface
    if turn is not None:
        b = Surface(turn.points(b.points), b.displacement, b.facets, b.normals, b.numbers)
    theirs = _in_the_mean(key, join, a, b) if join.pairing == MEAN else _by_nodes(key, join, _towards(a, b), b)
    theirs.data[np.abs(theirs.data) < TINY] = 0.0
    theirs.eliminate_zeros()
    dofs = first.nodes.ravel()
    _refuse_clamped(key, first, dofs, theirs)
    return {int(d): theirs[[i]] for i, d in enumerate(dofs) if d >= 0}


def _by_nodes(key: str, join: Join, a: Surface, b: Surface) -> Matrix:
    """Return the motion (3 n_A, N) of the partners of all nodes of side A."""
    try:
        pairing = named(key, join, lambda: match(join, a, b, _across(a)))
    except InputError as error:
        if join.pairing != "node_to_node":
            raise
        remedy = "Use node_to_segment, or raise the tolerance."
        raise input_error(error.place, error.problem, remedy) from None
    # gap = frameᵀ (u_b - u_a): back to global axes
    p = pairing.n_points
    blocks = (pairing.frames, np.arange(p), np.arange(p + 1))
    back = scipy.sparse.bsr_array(blocks, shape=(3 * p, 3 * p)).tocsr()
    return scipy.sparse.csr_array(back @ pairing.gap_operator + a.displacement)


def _in_the_mean(key: str, join: Join, a: Surface, b: Surface) -> Matrix:
    """Return the motion (3 n_A, N) of the nodes of side A by the mortar tie to side B."""
    weights = named(key, join, lambda: mortar_tie(a, b, reach=join.tolerance))
    return scipy.sparse.csr_array(scipy.sparse.kron(weights, np.eye(3)) @ b.displacement)


def _across(a: Surface) -> tuple[float, float, float]:
    normals = a.node_normals()[a.used]
    sines = [np.linalg.norm(np.cross(normals, axis), axis=1).min() for axis in np.eye(3)]
    x, y, z = (float(v) for v in np.eye(3)[int(np.argmax(sines))])
    return x, y, z


def _towards(a: Surface, b: Surface) -> Surface:
    """Return all nodes of side A with normals towards side B; any normals if B has no facets."""
    from scipy.spatial import cKDTree

    normals = np.tile([0.0, 0.0, 1.0], (len(a.points), 1))
    if len(b.facets):
        near = b.used[cKDTree(b.points[b.used]).query(a.points)[1]]
        normals = -b.node_normals()[near]
    return Surface(a.points, a.displacement, NO_FACETS, normals, a.numbers)


def _refuse_clamped(key: str, first: Spot, dofs: IntArray, theirs: Matrix) -> None:
    moving = np.diff(theirs.indptr) > 0
    stuck = np.flatnonzero((dofs < 0) & moving)
    if stuck.size:
        assert first.surface is not None
        assert first.surface.numbers is not None
        node = first.surface.numbers[stuck[0] // 3]
        raise input_error(
            f"{key}.between",
            f"node {node} of {first.name!r} is clamped and cannot follow, {stuck.size} such dofs in all",
            "Clamp its partner as well, or take it out of the set.",
        )


def _refuse_twice(places: Places, key: str, found: Mapping[int, Matrix], rows: Mapping[int, Matrix]) -> None:
    for dof in found:
        if dof in rows:
            raise input_error(
                f"{key}.between",
                f"{places.dofs.labels[dof]} follows another surface already",
                "Tie it once: take the node out of one of the sets.",
            )


def _resolved(places: Places, followers: IntArray, weights: Matrix, rounds: int) -> Matrix:
    """Replace masters that are themselves followers by their own masters."""
    for _ in range(rounds + 1):
        chained = weights[:, followers]
        if not chained.nnz:
            return weights
        keep = np.ones(weights.shape[1])
        keep[followers] = 0.0
        weights = scipy.sparse.csr_array(weights @ scipy.sparse.diags_array(keep) + chained @ weights)
        weights.eliminate_zeros()
    dof = int(followers[weights[:, followers].nonzero()[1][0]])
    raise input_error(
        "join",
        f"{places.dofs.labels[dof]} follows itself round a circle of joins",
        "Turn the sides of one of the joins round.",
    )


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of all parts, tied by the joins.

    Parameters
    ----------
    ids
        (n0,) dof of all parts for each untied coordinate; -1 for modal coordinates.
    tie
        (n0, n) CSR from independent to untied coordinates; None without ties.
    stays
        (n,) untied coordinates that are independent.
    """

    ids: IntArray
    tie: Matrix | None
    stays: IntArray

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.stays.size)

    def tied(self, structure: Structure) -> Structure:
        """Return a structure of the untied coordinates on the independent ones, without `basis`."""
        if self.tie is None:
            return structure
        sets = surviving_sets(structure, self.stays)
        found = in_coordinates(structure, self.tie, structure.dofs.take(self.stays), sets)
        return replace(found, basis=None)

    def columns(self, operator: Matrix) -> Matrix:
        """Return an operator (m, N) on the dofs of all parts as one on the coordinates.

        It must be zero at other dofs.
        """
        mine = scipy.sparse.csr_array(operator).tocoo()
        place = np.full(operator.shape[1], -1)
        known = self.ids >= 0
        place[self.ids[known]] = np.flatnonzero(known)
        column = place[mine.col]
        assert np.all(column >= 0), "an operator reaches a dof that was not kept"
        entries = (mine.data, (mine.row, column))
        own = scipy.sparse.csr_array(entries, shape=(operator.shape[0], self.ids.size))
        return own if self.tie is None else scipy.sparse.csr_array(own @ self.tie)

    def untied(self, q: Matrix) -> Matrix:
        """Return the untied coordinates (n0,) from the independent ones (n,)."""
        return q if self.tie is None else np.asarray(self.tie @ q)

    def load(self, untied: Matrix) -> Matrix:
        """Return a load (n0,) on the untied coordinates as one (n,) on the independent ones."""
        return untied if self.tie is None else np.asarray(self.tie.T @ untied)

    def load_of_dofs(self, force: Matrix) -> Matrix:
        """Return a force (N,) on the dofs of all parts as one (n,) on the independent coordinates.

        Forces on other dofs are dropped.
        """
        untied = np.zeros(self.ids.size, dtype=force.dtype)
        known = self.ids >= 0
        untied[known] = force[self.ids[known]]
        return self.load(untied)

    def of_dofs(self, dofs: IntArray, table: Dofs, place: str) -> IntArray:
        """Return the coordinates of dofs of the parts.

        Raises
        ------
        InputError
            If a dof follows several others. `place` is the study key, for the message.
        """
        rows = self.columns(scipy.sparse.eye_array(len(table), format="csr")[dofs])
        single = (np.diff(rows.indptr) == 1) & np.isclose(np.asarray(rows.sum(axis=1)).ravel(), 1.0)
        if not np.all(single):
            name = table.labels[int(dofs[np.flatnonzero(~single)[0]])]
            raise input_error(
                place,
                f"{name} lies on a joined surface and is no coordinate of its own",
                "Take a place off the surface, or let the join's other side be the first.",
            )
        return np.asarray(rows.indices, dtype=np.int64)


def coordinates(ids: IntArray, ties: Ties) -> Coordinates:
    """Return the coordinates of parts from the dof `ids` of each untied coordinate (-1: modal)."""
    if not ties.followers.size:
        return Coordinates(ids, None, np.arange(ids.size))
    tie, stays = ties.matrix(ids)
    return Coordinates(ids, tie, stays)
