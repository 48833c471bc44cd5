"""Gaps as coordinates: of rigid contacts, and where contact points need fewer coordinates than the nodes around them."""

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
    """A structure in coordinates of which each gap is one.

    Parameters
    ----------
    structure, gaps
        The structure, and (3 p, n) CSR from its coordinates to the gaps.
    place
        (n0,) where each coordinate of before is now, -1 where it became part of gaps; None: all are as they were.
    """

    structure: Structure
    gaps: Matrix
    place: IntArray | None = None

    def load(self, force: Matrix) -> Matrix:
        """Return a load on the coordinates of before as one on those of now."""
        return force if self.place is None else self.structure.project(force)

    def of(self, coordinates: IntArray, key: str) -> IntArray:
        """Return where coordinates of before are now.

        Raises
        ------
        InputError
            If one became part of a gap; `key` is the key that asks for it.
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
    """Write a structure in the gaps of its contacts where one of them is rigid and its gaps are no coordinates.

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
    """Whether each gap of the contacts that are `rigid` (p,) is a coordinate of its own, times a factor."""
    entries = np.diff(gaps.indptr)[np.repeat(rigid, 3)]
    columns = gaps[np.repeat(rigid, 3)].indices
    return bool(np.all(entries <= 1) and np.unique(columns).size == columns.size)


def refuse_mixed_gaps(model: Model, gaps: Matrix) -> None:
    """Refuse rigid contacts of a wheel whose gaps (3 p, n) are no coordinates."""
    rigid = _rigid(model.pairs)
    if not are_coordinates(scipy.sparse.csr_array(gaps), rigid):
        raise input_error(
            f"contact.{model.pairs.groups[int(np.argmax(rigid))]}.law",
            "is rigid_coulomb, and its gaps are no coordinates: an output or load lies on its nodes, or contacts share nodes",
            "Name places off the contact, or give the contact a stiffness, such as elastic_coulomb.",
        )


def held_gaps(model: Model, gaps: Matrix) -> int:
    """Return how many gaps (3 p, n) rigid contacts hold while they stick."""
    entries = np.diff(scipy.sparse.csr_array(gaps).indptr)
    return int(np.count_nonzero(entries[np.repeat(_rigid(model.pairs), 3)]))


def _rigid(pairs: Pairs) -> BoolArray:
    return np.array([isinstance(law, Rigid) for law in pairs.laws], dtype=bool)


def refuse_rigid(model: Model) -> None:
    """Refuse rigid contacts that cannot be solved: of free rigid bodies, and single dofs that nothing presses."""
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
    """Write a reduced structure in the rows of its gaps, where that leaves fewer coordinates for contacts to touch.

    A point on a facet of six nodes touches 18 dofs and has three rows. What the coordinates that stay add to a row is left in the
    gap operator: a row then is the motion of the other side at that point.

    Parameters
    ----------
    structure
        Of all parts; a sparse one is left as it is.
    gaps
        (3 p, n) CSR rows t, w, n.
    stay
        Coordinates that stay what they are: outputs, and rigid bodies.
    names
        Of the p contact points.
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
    except InputError:  # rows depend on each other: nodes stay
        return same
    place = np.full(structure.n, -1)
    free = np.setdiff1d(np.arange(structure.n), touched)
    place[free] = np.arange(structure.n - free.size, structure.n)
    others = scipy.sparse.csr_array(gaps @ scipy.sparse.diags_array(fixed))
    whole = scipy.sparse.csr_array(own + others @ written.basis)
    whole.eliminate_zeros()
    return InGaps(written, whole, place)
