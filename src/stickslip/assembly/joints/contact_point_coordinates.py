"""Contact points as coordinates in place of the nodes around them: fewer coordinates in contact."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.assembly.joints.rigid import InGaps
from stickslip.errors import InputError
from stickslip.model.structure import Structure
from stickslip.reduction.contact_coordinates import in_relative_coordinates


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
