"""Mortar tie of two surfaces: displacements agree in a weighted mean, with dual multipliers.

B. I. Wohlmuth, "A mortar finite element method using dual spaces for the Lagrange multiplier", SIAM Journal on Numerical
Analysis 38 (2000) 989-1012; quadratic facets as in A. Popp, B. I. Wohlmuth, M. W. Gee and W. A. Wall, "Dual quadratic mortar
finite element methods for 3D finite deformation contact", SIAM Journal on Scientific Computing 34 (2012) B421-B446.
"""

import numpy as np
import scipy
import scipy.sparse.linalg

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.contact.segmentation import SegmentPoints, segment_points
from stickslip.contact.surface import Surface
from stickslip.errors import input_error
from stickslip.model.mesh.facets import CORNERS, interpolation, kinds_of, lumped_areas

MAX_UNCOVERED = 1e-3  # share of side A that may extend beyond side B
ROUNDING_WEIGHT = 1e-14  # weights below are rounding
MIDDLE_SHARE = 0.2  # share of a mid node's shape function that each corner of its edge takes (Popp et al. 2012, 1/5)
DUAL_COVERED = 0.9  # covered share of a facet above which it has dual multipliers: on less they grow large


def mortar_tie(a: Surface, b: Surface, *, reach: float | None = None, held: BoolArray | None = None) -> Matrix:
    """Return the weights by which the nodes of side A follow the nodes of side B.

    The difference of the displacements vanishes in the mean over side A, weighted by multipliers ψ that are dual to the shape
    functions of side A: ``D u_A = M u_B`` with ``D = ∫ ψ N_Aᵀ`` diagonal and ``M = ∫ ψ N_Bᵀ``. Each node thus follows nodes
    nearby only; with the shape functions as multipliers it follows all nodes of side B. One step of defect correction leads
    towards these multipliers, whose error is smaller (a coarse sector of quadratic tetrahedra: frequencies lower by 1.2e-4
    without this step, 3e-5 with it). On plane surfaces linear displacements agree and a constant stress passes exactly through
    any two meshes of triangles and parallelograms, with and without it.

    Quadratic shape functions have no area at corners, and no dual multipliers; corners take a share of the mid nodes.

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

    moves = np.arange(len(a.points)) if held is None else np.flatnonzero(~held)
    functions, multipliers = (side[:, moves] for side in _on_side_a(a, found))
    opposite = b.facets[found.facet_b]
    on_b = _spread(interpolation(opposite, found.on_b), opposite, len(b.points))
    area = scipy.sparse.diags_array(found.weight)
    dual, standard = (scipy.sparse.csc_array(side.T @ area) for side in (multipliers, functions))
    own = _without_rounding(dual @ functions)  # diagonal but for facets that are covered in part
    follows = scipy.sparse.csc_array(scipy.sparse.linalg.spsolve(own.tocsc(), dual @ on_b))
    lumped = scipy.sparse.diags_array(1.0 / np.asarray(standard.sum(axis=1)).ravel())
    follows = follows + lumped @ (standard @ on_b - (standard @ functions) @ follows)
    place = scipy.sparse.eye_array(len(a.points), format="csr")[moves]
    return _without_rounding(place.T @ (place @ _to_nodes(a) @ place.T @ follows))


def _on_side_a(a: Surface, found: SegmentPoints) -> tuple[Matrix, Matrix]:
    """Return the (p, n_A) shape functions of side A, in which corners have their shares, and the multipliers at all points."""
    facets, size = a.facets[found.facet_a], len(a.points)
    whole, covered = (
        lumped_areas(a.points, a.facets).sum(axis=1),
        np.bincount(found.facet_a, found.weight, len(a.facets)),
    )
    functions, multipliers = interpolation(facets, found.on_a), np.zeros(facets.shape)
    kinds = kinds_of(a.facets)
    for kind in np.unique(kinds):
        at = np.flatnonzero(kinds[found.facet_a] == kind)
        functions[at, :kind] = functions[at, :kind] @ _corner_shares(int(kind))
        own, facet = functions[at, :kind], found.facet_a[at]
        weighted = own * found.weight[at, None]
        products = np.zeros((len(a.facets), kind, kind))
        np.add.at(products, facet, weighted[:, :, None] * own[:, None, :])
        areas = products.sum(axis=2)  # the functions add up to one
        dual = np.tile(np.eye(kind), (len(a.facets), 1, 1))
        enough = (kinds == kind) & (covered > DUAL_COVERED * whole)
        dual[enough] = areas[enough, :, None] * np.linalg.inv(products[enough])
        multipliers[at, :kind] = np.einsum("pij,pj->pi", dual[facet], own)
    return _spread(functions, facets, size), _spread(multipliers, facets, size)


def _corner_shares(kind: int) -> FloatArray:
    """Return the (kind, kind) shape functions of a facet from its usual ones: corners take a share of the mid nodes."""
    corners = CORNERS[kind]
    shares = np.eye(kind)
    for middle in range(corners, kind):
        ends = [middle - corners, (middle - corners + 1) % corners]
        shares[middle, ends] = MIDDLE_SHARE
        shares[middle, middle] = 1.0 - 2.0 * MIDDLE_SHARE
    return shares


def _to_nodes(side: Surface) -> Matrix:
    """Return the (n, n) displacements of the nodes from the factors of these shape functions."""
    rows, columns, values = [], [], []
    kinds = kinds_of(side.facets)
    for kind in np.unique(kinds):
        shares, nodes = _corner_shares(int(kind)), side.facets[kinds == kind, :kind]
        row, column = np.nonzero(shares)
        rows.append(nodes[:, row].ravel())
        columns.append(nodes[:, column].ravel())
        values.append(np.tile(shares[row, column], len(nodes)))
    # neighbouring facets say the same of the nodes between them
    pairs, first = np.unique(np.stack([np.concatenate(rows), np.concatenate(columns)]), axis=1, return_index=True)
    size = len(side.points)
    return scipy.sparse.csr_array((np.concatenate(values)[first], (pairs[0], pairs[1])), shape=(size, size))


def _spread(values: FloatArray, facets: IntArray, nodes: int) -> Matrix:
    """Return (p, nodes) CSR from the values (p, k) of the nodes of facets (p, k)."""
    row = np.repeat(np.arange(len(facets)), facets.shape[1])
    return scipy.sparse.csr_array((values.ravel(), (row, np.maximum(facets, 0).ravel())), shape=(len(facets), nodes))


def _without_rounding(matrix: Matrix) -> Matrix:
    """Return a sparse matrix without entries that are rounding beside its largest."""
    found = scipy.sparse.csr_array(matrix)
    found.data[np.abs(found.data) <= ROUNDING_WEIGHT * np.max(np.abs(found.data), initial=0.0)] = 0.0
    found.eliminate_zeros()
    return found
