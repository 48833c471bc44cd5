"""Gaps as coordinates, for rigid contacts and for contact points with fewer gaps than nodal coordinates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.assembly.joints.pairs import Pairs
from stickslip.assembly.model import Model
from stickslip.contact.law import Rigid
from stickslip.contact.laws import law_name
from stickslip.errors import InputError, input_error
from stickslip.model.structure import Structure
from stickslip.reduction.contact_coordinates import in_relative_coordinates


@dataclass(frozen=True, eq=False)
class InGaps:
    """Structure with each gap as a coordinate.

    Parameters
    ----------
    structure, gaps
        The structure, and (3 p, n) CSR from its coordinates to the gaps.
    place
        (n0,) new position of each previous coordinate; -1 if gaps replace it; None: no coordinate changed.
    """

    structure: Structure
    gaps: Matrix
    place: IntArray | None = None

    def load(self, force: Matrix) -> Matrix:
        """Return a load (n0,) on the previous coordinates as one (n,) on the new ones."""
        return force if self.place is None else self.structure.project(force)

    def of(self, coordinates: IntArray, key: str) -> IntArray:
        """Return the new positions of previous coordinates.

        Raises
        ------
        InputError
            If a gap replaces one of them. `key` is the study key, for the message.
        """
        if self.place is None:
            return coordinates
        found = self.place[coordinates]
        if np.any(found < 0):
            raise input_error(
                key,
                "names a node that a contact of rigid_coulomb touches, whose motion is no coordinate of its own",
                "Name a place off the contact, or give the contact a stiffness, such as elastic_coulomb.",
            )
        return found


def in_gaps(pairs: Pairs, structure: Structure, gaps: Matrix) -> InGaps:
    """Use the gaps of all contacts as coordinates, if a contact is rigid and its gaps are not coordinates yet.

    Raises
    ------
    InputError
        If gaps depend on each other.
    """
    rigid = _rigid(pairs)
    if not rigid.any() or are_coordinates(gaps, rigid):
        return InGaps(structure, gaps)
    bare = replace(structure, basis=None)
    try:
        written, operator = in_relative_coordinates(bare, gaps, pairs.names)
    except InputError as error:
        raise input_error(
            f"contact.{pairs.groups[int(np.argmax(rigid))]}.law",
            f"is rigid_coulomb, and {error.problem}",
            "Take points that share no nodes, or give the contacts a stiffness, such as elastic_coulomb.",
        ) from None
    touched = np.unique(gaps.nonzero()[1])
    free = np.setdiff1d(np.arange(structure.n), touched)
    place = np.full(structure.n, -1)
    place[free] = np.arange(written.n - free.size, written.n)
    return InGaps(written, operator, place)


def are_coordinates(gaps: Matrix, rigid: BoolArray) -> bool:
    """Whether each gap of the `rigid` contacts (p,) is proportional to a coordinate of its own."""
    entries = np.diff(gaps.indptr)[np.repeat(rigid, 3)]
    columns = gaps[np.repeat(rigid, 3)].indices
    return bool(np.all(entries <= 1) and np.unique(columns).size == columns.size)


def refuse_mixed_gaps(model: Model, gaps: Matrix) -> None:
    """Refuse rigid contacts of a wheel whose gaps (3 p, n) are not coordinates."""
    rigid = _rigid(model.pairs)
    if not are_coordinates(scipy.sparse.csr_array(gaps), rigid):
        raise input_error(
            f"contact.{model.pairs.groups[int(np.argmax(rigid))]}.law",
            "is rigid_coulomb, and its gaps are no coordinates: an output or load lies on its nodes, or contacts share nodes",
            "Name places off the contact, or give the contact a stiffness, such as elastic_coulomb.",
        )


def held_gaps(model: Model, gaps: Matrix) -> int:
    """Return the number of gaps (3 p, n) that sticking rigid contacts constrain."""
    entries = np.diff(scipy.sparse.csr_array(gaps).indptr)
    return int(np.count_nonzero(entries[np.repeat(_rigid(model.pairs), 3)]))


def _rigid(pairs: Pairs) -> BoolArray:
    return np.array([isinstance(law, Rigid) for law in pairs.laws], dtype=bool)


def refuse_rigid(model: Model) -> None:
    """Refuse unsolvable rigid contacts: of free rigid bodies, and of single dofs without a normal force."""
    pairs, laws = model.pairs, dict(zip(model.pairs.groups, model.pairs.laws, strict=True))
    for name, law in laws.items():
        if not isinstance(law, Rigid):
            continue
        rows = np.repeat([group == name for group in pairs.groups], 3)
        used = np.unique(np.concatenate([m[rows].nonzero()[1] for m in (pairs.own, pairs.following)]))
        bodies = np.intersect1d(used, model.places.bodies())
        if bodies.size:
            body = model.places.dofs.part[int(bodies[0])]
            raise input_error(
                f"contact.{name}.law",
                f"is {law_name(law)}, and the rigid body {body!r} has no stiffness of its own to hold it where it slips",
                "Give the contact a stiffness, such as elastic_coulomb.",
            )
        if law.preload is None and not np.any(np.diff(pairs.own.indptr)[np.flatnonzero(rows)[2::3]]):
            raise input_error(
                f"contact.{name}.preload_n",
                f"is missing: the law {law_name(law)} takes its pressure from the motion along the normal, and there is none",
                "Give the constant force that presses the contact.",
            )


def in_points(structure: Structure, gaps: Matrix, stay: IntArray, names: Sequence[str]) -> InGaps:
    """Use the gaps of a reduced structure as coordinates if contacts then act on fewer coordinates.

    A point on a facet of six nodes acts on 18 dofs and has three gaps. The contribution of the coordinates `stay`
    remains in the gap operator; the new coordinate is then the motion of the other side at that point.

    Parameters
    ----------
    structure
        Reduced structure of all parts; a sparse one is returned unchanged.
    gaps
        (3 p, n) CSR rows t, w, n.
    stay
        Coordinates that must not change: outputs, and rigid bodies.
    names
        Names of the p contact points.
    """
    same = InGaps(structure, gaps)
    fixed = np.isin(np.arange(structure.n), stay).astype(float)
    moved = scipy.sparse.csr_array(gaps @ scipy.sparse.diags_array(1.0 - fixed))
    moved.eliminate_zeros()
    touched = np.unique(moved.indices)
    if scipy.sparse.issparse(structure.stiffness) or touched.size <= np.count_nonzero(np.diff(moved.indptr)):
        return same
    try:
        written, own = in_relative_coordinates(replace(structure, basis=None), moved, names)
    except InputError:  # rows depend on each other: nodes are kept
        return same
    place = np.full(structure.n, -1)
    free = np.setdiff1d(np.arange(structure.n), touched)
    place[free] = np.arange(structure.n - free.size, structure.n)
    others = scipy.sparse.csr_array(gaps @ scipy.sparse.diags_array(fixed))
    whole = scipy.sparse.csr_array(own + others @ written.basis)
    whole.eliminate_zeros()
    return InGaps(written, whole, place)
