"""Facets of surfaces: shape functions of triangles and quadrilaterals, linear and quadratic; the closest points, near facets.

Node order: corners anticlockwise seen from outside the body, then the mid node of each edge in turn. Reference
coordinates: triangles ``xi, eta >= 0, xi + eta <= 1``, quadrilaterals ``-1 <= xi, eta <= 1``.

One array of facets may contain several kinds: short rows are padded with -1. All functions take one facet per row.
"""

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray

KINDS = (3, 4, 6, 8)  # supported numbers of nodes of a facet
CORNERS = {3: 3, 4: 4, 6: 3, 8: 4}
DEGREE = {3: 1, 4: 2, 6: 2, 8: 3}  # polynomial degree of the shape functions in the plane
REFERENCE_NODES = {
    3: np.array([[0, 0], [1, 0], [0, 1]], dtype=float),
    4: np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float),
    6: np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]]),
    8: np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [0, -1], [1, 0], [0, 1], [-1, 0]], dtype=float),
}
CENTRE = {kind: nodes[: CORNERS[kind]].mean(axis=0) for kind, nodes in REFERENCE_NODES.items()}


def kinds_of(facets: IntArray) -> IntArray:
    """Return the number of nodes of each row of `facets` (m, k), not counting fillers -1."""
    return np.asarray(np.count_nonzero(facets >= 0, axis=1), dtype=np.int64)


def corner_counts(facets: IntArray) -> IntArray:
    """Return 3 for triangles and 4 for quadrilaterals among `facets` (m, k)."""
    return np.where(np.isin(kinds_of(facets), (3, 6)), 3, 4)


def shape_functions(kind: int, at: FloatArray) -> FloatArray:
    """Return the (n, kind) shape functions of a facet of `kind` nodes at the reference points `at` (n, 2)."""
    xi, eta = at.T
    if kind == 3:
        return np.column_stack([1 - xi - eta, xi, eta])
    if kind == 6:
        first = 1 - xi - eta
        corners = [first * (2 * first - 1), xi * (2 * xi - 1), eta * (2 * eta - 1)]
        return np.column_stack([*corners, 4 * first * xi, 4 * xi * eta, 4 * eta * first])
    a, b = REFERENCE_NODES[4].T
    x, y = xi[:, None] * a, eta[:, None] * b
    if kind == 4:
        return np.asarray((1 + x) * (1 + y) / 4)
    corners8 = (1 + x) * (1 + y) * (x + y - 1) / 4
    in_xi, in_eta = (1 - xi**2) / 2, (1 - eta**2) / 2
    middle = [in_xi * (1 - eta), in_eta * (1 + xi), in_xi * (1 + eta), in_eta * (1 - xi)]
    return np.column_stack([corners8, *middle])


def shape_gradients(kind: int, at: FloatArray) -> FloatArray:
    """Return the (n, 2, kind) derivatives of the shape functions by the reference coordinates `at` (n, 2)."""
    xi, eta = at.T
    one, zero = np.ones_like(xi), np.zeros_like(xi)
    if kind == 3:
        rows = [[-one, one, zero], [-one, zero, one]]
    elif kind == 6:
        first = 1 - xi - eta
        by_first = 1 - 4 * first
        rows = [
            [by_first, 4 * xi - 1, zero, 4 * (first - xi), 4 * eta, -4 * eta],
            [by_first, zero, 4 * eta - 1, -4 * xi, 4 * xi, 4 * (first - eta)],
        ]
    else:
        a, b = REFERENCE_NODES[4].T
        x, y = xi[:, None] * a, eta[:, None] * b
        if kind == 4:
            return np.stack([a * (1 + y) / 4, b * (1 + x) / 4], axis=1)
        corners = a * (1 + y) * (2 * x + y) / 4, b * (1 + x) * (x + 2 * y) / 4
        in_xi, in_eta = (1 - xi**2) / 2, (1 - eta**2) / 2
        rows = [
            [*corners[0].T, -xi * (1 - eta), in_eta, -xi * (1 + eta), -in_eta],
            [*corners[1].T, -in_xi, -eta * (1 + xi), in_xi, -eta * (1 - xi)],
        ]
    return np.stack([np.column_stack(row) for row in rows], axis=1)


def interpolation(facets: IntArray, at: FloatArray) -> FloatArray:
    """Return the (n, k) weights of the nodes of `facets` (n, k) at the reference points `at` (n, 2); 0 for fillers."""
    weights = np.zeros(facets.shape)
    for kind, rows in _by_kind(facets):
        weights[rows, :kind] = shape_functions(kind, at[rows])
    return weights


def positions(points: FloatArray, facets: IntArray, at: FloatArray) -> FloatArray:
    """Return the (n, 3) positions of the reference points `at` (n, 2) of `facets` (n, k)."""
    return np.asarray(np.einsum("nk,nkc->nc", interpolation(facets, at), points[facets]))


def tangents(points: FloatArray, facets: IntArray, at: FloatArray) -> FloatArray:
    """Return the (n, 2, 3) derivatives of the position by the reference coordinates."""
    found = np.zeros((len(facets), 2, 3))
    for kind, rows in _by_kind(facets):
        gradients = shape_gradients(kind, at[rows])
        found[rows] = np.einsum("nak,nkc->nac", gradients, points[facets[rows, :kind]])
    return found


def centres(facets: IntArray) -> FloatArray:
    """Return the (n, 2) reference coordinates of the middle of each of `facets` (n, k)."""
    found = np.zeros((len(facets), 2))
    for kind, rows in _by_kind(facets):
        found[rows] = CENTRE[kind]
    return found


def normals(points: FloatArray, facets: IntArray, at: FloatArray) -> FloatArray:
    """Return the (n, 3) normals of the facets; their length is the area per unit area of the reference facet."""
    first, second = tangents(points, facets, at).transpose(1, 0, 2)
    return np.asarray(np.cross(first, second))


def node_normals(points: FloatArray, facets: IntArray) -> FloatArray:
    """Return the (n, k, 3) normals of each facet at its own nodes; their length is the facet's angle there in rad.

    Their sum over the facets around a node does not depend on the triangulation of a surface (Thürmer & Wüthrich 1998).
    """
    found = np.zeros((*facets.shape, 3))
    for kind, rows in _by_kind(facets):
        count = CORNERS[kind]
        corners = points[facets[rows, :count]]
        ahead, back = (np.roll(corners, shift, axis=1) - corners for shift in (-1, 1))
        sine = np.linalg.norm(np.cross(ahead, back), axis=2)
        angle = np.full((len(rows), kind), np.pi)  # at mid nodes
        angle[:, :count] = np.arctan2(sine, np.sum(ahead * back, axis=2))
        for j, node in enumerate(REFERENCE_NODES[kind]):
            normal = normals(points, facets[rows], np.tile(node, (len(rows), 1)))
            normal /= np.linalg.norm(normal, axis=1, keepdims=True)
            found[rows, j] = angle[:, j, None] * normal
    return found


def lumped_areas(points: FloatArray, facets: IntArray) -> FloatArray:
    """Return the (n, k) area of each facet distributed to its nodes, all positive.

    Linear triangles and parallelograms: ``∫ N_i dA``, the nodal loads of a uniform pressure. Quadratic facets: in
    proportion to ``∫ N_i² dA`` (Hinton, Rock & Zienkiewicz 1976), because ``∫ N_i dA`` is zero or negative at their
    corners.
    """
    shares = np.zeros(facets.shape)
    for kind, rows in _by_kind(facets):
        at, weights = _reference_rule(CORNERS[kind])
        N = shape_functions(kind, at)
        mine = np.repeat(facets[rows], len(at), axis=0)
        density = np.linalg.norm(normals(points, mine, np.tile(at, (len(rows), 1))), axis=1)
        area = density.reshape(len(rows), -1) * weights
        if kind in {3, 4}:
            shares[rows, :kind] = area @ N
        else:
            squares = area @ N**2
            share = squares / squares.sum(axis=1, keepdims=True)
            shares[rows, :kind] = share * area.sum(axis=1, keepdims=True)
    return shares


def _by_kind(facets: IntArray) -> list[tuple[int, IntArray]]:
    kinds = kinds_of(facets)
    return [(kind, np.flatnonzero(kinds == kind)) for kind in KINDS if np.any(kinds == kind)]


def _reference_rule(corners: int) -> tuple[FloatArray, FloatArray]:
    """Return 3 by 3 Gauss points and weights of the reference square, or of this square collapsed into the triangle."""
    x, w = np.polynomial.legendre.leggauss(3)
    at = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(w, w).ravel()
    if corners == 4:
        return at, weights
    u, v = (1 + at.T) / 2
    return np.column_stack([u, v * (1 - u)]), weights * (1 - u) / 4


MAX_GAUSS_NEWTON = 40  # largest number of iterations; convergence is linear with the ratio gap / radius of curvature
MAX_REFERENCE = 4.0  # reference coordinates beyond this belong to a neighbouring facet
CONVERGED = 1e-12  # last step, in reference coordinates; the point itself is more accurate
INSIDE = 1e-12  # in reference coordinates


def near_pairs(
    centre: FloatArray, radius: FloatArray, others: FloatArray, radii: FloatArray, reach: float
) -> tuple[IntArray, IntArray]:
    """Return all pairs (i, j) of balls closer than `reach`, sorted by i.

    Parameters
    ----------
    centre, radius
        (p, 3) and (p,) balls.
    others, radii
        (q, 3) and (q,) other balls.
    reach
        Largest distance between two of them, m.
    """
    from scipy.spatial import cKDTree

    around = radius + radii.max(initial=0.0) + reach
    found = cKDTree(others).query_ball_point(centre, around)
    first = np.repeat(np.arange(len(centre)), [len(f) for f in found])
    second = np.array([j for f in found for j in f], dtype=np.int64)
    apart = np.linalg.norm(centre[first] - others[second], axis=1)
    near = apart <= radius[first] + radii[second] + reach
    return first[near], second[near]


def closest(points: FloatArray, facets: IntArray, target: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the closest point of one facet to each target: reference coordinates (p, 2) and its edge (p,), -1 inside.

    The method is Gauss-Newton on the distance; if the result lies outside the facet, the closest point of its edges is
    taken.
    """
    reference = centres(facets)
    for _ in range(MAX_GAUSS_NEWTON):
        T = tangents(points, facets, reference)
        miss = np.einsum("pac,pc->pa", T, target - positions(points, facets, reference))
        step = solve_two(np.einsum("pac,pbc->pab", T, T), miss)
        moved = np.clip(reference + step, -MAX_REFERENCE, MAX_REFERENCE)
        change = np.abs(moved - reference).max(initial=0.0)
        reference = moved
        if change < CONVERGED:
            break
    corners = corner_counts(facets)
    edge = np.full(len(facets), -1)
    out = np.flatnonzero(~_inside(corners, reference))
    best = np.full(len(out), np.inf)
    for e in range(4):
        for count in (3, 4):
            rows = np.flatnonzero(corners[out] == count)
            if e >= count or len(rows) == 0:
                continue
            at, distance = _closest_on_edge(points, facets[out[rows]], target[out[rows]], e, count)
            better = distance < best[rows]
            best[rows[better]] = distance[better]
            reference[out[rows[better]]], edge[out[rows[better]]] = at[better], e
    return reference, edge


def solve_two(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solve many systems of two equations; the solution of a singular one is zero."""
    (a, b), (c, d) = matrix.transpose(1, 2, 0)
    determinant = a * d - b * c
    usable = determinant != 0
    scale = np.where(usable, 1.0 / np.where(usable, determinant, 1.0), 0.0)
    first, second = right.T
    return np.column_stack([(d * first - b * second) * scale, (a * second - c * first) * scale])


def _inside(corners: IntArray, reference: FloatArray) -> BoolArray:
    xi, eta = reference.T
    triangle = (xi >= -INSIDE) & (eta >= -INSIDE) & (xi + eta <= 1 + INSIDE)
    square = np.abs(reference).max(axis=1, initial=0.0) <= 1 + INSIDE
    return np.asarray(np.where(corners == 3, triangle, square))


def _closest_on_edge(
    points: FloatArray, facets: IntArray, target: FloatArray, edge: int, corners: int
) -> tuple[FloatArray, FloatArray]:
    """Return the best reference point of one edge of each facet, and its distance."""
    start = REFERENCE_NODES[corners][edge]
    along = REFERENCE_NODES[corners][(edge + 1) % corners] - start
    s = np.full(len(facets), 0.5)
    for _ in range(MAX_GAUSS_NEWTON):
        at = start + s[:, None] * along
        slope = np.einsum("a,pac->pc", along, tangents(points, facets, at))
        miss = np.einsum("pc,pc->p", slope, target - positions(points, facets, at))
        moved = np.clip(s + miss / np.einsum("pc,pc->p", slope, slope), 0.0, 1.0)
        change = np.abs(moved - s).max(initial=0.0)
        s = moved
        if change < CONVERGED:
            break
    at = start + s[:, None] * along
    return at, np.linalg.norm(target - positions(points, facets, at), axis=1)
