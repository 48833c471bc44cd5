"""Coordinates of a joined model: the part and dof of each, and constraints."""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.assembly.joints.ties import Ties
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import in_coordinates, surviving_sets


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of all parts, tied by the joins.

    Parameters
    ----------
    ids
        (n0,) dof of all parts behind each untied coordinate; -1 for modal coordinates.
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
        """Return an operator (m, N) on the dofs of all parts as one on the coordinates. It must be zero at other dofs."""
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
        """Return a force (N,) on the dofs of all parts as one (n,) on the independent coordinates. Forces on other dofs are dropped."""
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
