"""The closest points of facets, and facets near points."""

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.model.mesh.facets import REFERENCE_NODES, centres, corner_counts, positions, tangents

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
