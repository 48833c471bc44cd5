"""Mortar tie of two surfaces: displacements agree in a weighted mean (standard multipliers; Puso 2004)."""

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.contact.segmentation import segment_points
from stickslip.contact.surface import Surface
from stickslip.errors import input_error
from stickslip.model.mesh.facets import interpolation, lumped_areas

MAX_UNCOVERED = 1e-3  # share of side A that may extend beyond side B
ROUNDING_WEIGHT = 1e-14  # weights below are rounding


def mortar_tie(a: Surface, b: Surface, *, reach: float | None = None, held: BoolArray | None = None) -> Matrix:
    """Return the weights by which the nodes of side A follow the nodes of side B.

    The difference of the displacements vanishes in the mean over side A, weighted by each of its shape functions:
    ``D u_A = M u_B`` with ``D = ∫ N_A N_Aᵀ`` and ``M = ∫ N_A N_Bᵀ``. On plane surfaces a constant stress passes exactly
    through any two meshes of triangles and parallelograms.

    Parameters
    ----------
    a, b
        The two sides; all nodes of A belong to facets, and all of A faces B.
    reach
        Largest distance of partners, m; None: the radius of the largest facet.
    held
        (n_A,) supported nodes of A where B is supported too: their rows are empty, and the difference vanishes in the
        mean weighted by the shape functions of the other nodes; None: no such nodes.

    Returns
    -------
    Matrix
        (n_A, n_B) CSR; without supported nodes each row adds up to one.

    Raises
    ------
    InputError
        If a node of A belongs to no facet, or A extends beyond B.
    """
    loose = np.setdiff1d(np.arange(len(a.points)), a.used)
    if loose.size or not len(a.facets):
        assert a.numbers is not None
        named = f"node {a.numbers[loose[0]]} of side A spans no facet, {loose.size} such nodes in all"
        raise input_error(
            "segment_to_segment",
            named if loose.size else "side A has no facets",
            "Take such nodes out of the set, or use node_to_segment, where each node follows.",
        )
    found = segment_points(a, b, reach=reach)
    whole, covered = float(lumped_areas(a.points, a.facets).sum()), float(found.weight.sum())
    if covered < (1.0 - MAX_UNCOVERED) * whole:
        raise input_error(
            "segment_to_segment",
            f"{100 * (1 - covered / whole):.2g} % of side A have nothing of side B opposite to them",
            "Let the smaller surface be the first, which follows.",
        )

    def shapes(side: Surface, facet: IntArray, at: FloatArray) -> Matrix:
        facets = side.facets[facet]
        row = np.repeat(np.arange(len(facets)), facets.shape[1])
        entries = (interpolation(facets, at).ravel(), (row, np.maximum(facets, 0).ravel()))
        return scipy.sparse.csr_array(entries, shape=(len(facets), len(side.points)))

    on_a, on_b = shapes(a, found.facet_a, found.on_a), shapes(b, found.facet_b, found.on_b)
    moves = np.arange(len(a.points)) if held is None else np.flatnonzero(~held)
    weighted = (on_a[:, moves] * found.weight[:, None]).T
    weights = np.zeros((len(a.points), len(b.points)))
    weights[moves] = np.linalg.solve((weighted @ on_a[:, moves]).toarray(), (weighted @ on_b).toarray())
    return scipy.sparse.csr_array(np.where(np.abs(weights) > ROUNDING_WEIGHT, weights, 0.0))
