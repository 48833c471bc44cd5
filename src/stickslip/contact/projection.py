"""Projection of points on facets: the closest point, and the point along a direction."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.surface import Surface
from stickslip.model.mesh.facets import (
    CONVERGED,
    INSIDE,
    MAX_GAUSS_NEWTON,
    MAX_REFERENCE,
    REFERENCE_NODES,
    centres,
    closest,
    corner_counts,
    near_pairs,
    normals,
    positions,
    solve_two,
    tangents,
)


@dataclass(frozen=True, eq=False)
class Feet:
    """Perpendicular projections (feet) of p points on a surface.

    Parameters
    ----------
    facet
        (p,) facet of the foot; -1 if no facet is near.
    reference
        (p, 2) reference coordinates of the foot.
    overhang
        (p,) distance in metres by which the point lies beyond the rim of the surface, measured along the surface;
        infinite without a facet.
    """

    facet: IntArray
    reference: FloatArray
    overhang: FloatArray


def facet_balls(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return the (m, 3) centre of each facet and the (m,) radius of a ball about it that contains its nodes."""
    middle = positions(surface.points, surface.facets, centres(surface.facets))
    apart = np.linalg.norm(surface.points[surface.facets] - middle[:, None], axis=2)
    return middle, np.where(surface.facets >= 0, apart, 0.0).max(axis=1)


def project(points: FloatArray, outward: FloatArray, surface: Surface, reach: float) -> Feet:
    """Project points on the closest facet of a surface that faces them.

    Parameters
    ----------
    points
        (p, 3) positions in metres.
    outward
        (p, 3) outward normals at the points; only facets with an opposite normal are considered.
    surface
        The other side.
    reach
        Largest distance of a facet, m.
    """
    middle, radius = facet_balls(surface)
    point, facet = near_pairs(points, np.zeros(len(points)), middle, radius, reach)
    facing = normals(surface.points, surface.facets, centres(surface.facets))
    keep = np.einsum("pc,pc->p", outward[point], facing[facet]) < 0
    point, facet = point[keep], facet[keep]
    # a facet whose ball is farther away than the centre of another facet cannot be the closest
    apart = np.linalg.norm(points[point] - middle[facet], axis=1)
    bound = np.full(len(points), np.inf)
    np.minimum.at(bound, point, apart)
    keep = apart - radius[facet] <= bound[point]
    point, facet = point[keep], facet[keep]

    reference, edge = closest(surface.points, surface.facets[facet], points[point])
    foot = positions(surface.points, surface.facets[facet], reference)
    distance = np.linalg.norm(points[point] - foot, axis=1)
    order = np.lexsort((distance, point))
    best = order[np.unique(point[order], return_index=True)[1]]
    best = best[distance[best] <= reach]
    feet = Feet(np.full(len(points), -1), np.zeros((len(points), 2)), np.full(len(points), np.inf))
    p, f, r = point[best], facet[best], reference[best]
    feet.facet[p], feet.reference[p] = f, r
    past = points[p] - foot[best]
    normal = normals(surface.points, surface.facets[f], r)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = past - np.einsum("pc,pc->p", past, normal)[:, None] * normal
    on_rim = _on_rim(surface.facets, f, r, edge[best])
    feet.overhang[p] = np.where(on_rim, np.linalg.norm(along, axis=1), 0.0)
    return feet


def meet(points: FloatArray, facets: IntArray, origin: FloatArray, axes: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the intersection of lines with facets or their continuation.

    Each line passes through its origin, perpendicular to both axes.

    Parameters
    ----------
    points
        (n, 3) nodes.
    facets
        (p, k) one facet for each line.
    origin
        (p, 3) a point of the line.
    axes
        (p, 2, 3) two unit vectors normal to the line.

    Returns
    -------
    reference : (p, 2) reference coordinates
    missed : indices of lines that do not meet their facet, because it is folded or parallel to them
    """
    reference = centres(facets)
    size = np.abs(points[facets] - origin[:, None]).max(axis=(1, 2), where=(facets >= 0)[:, :, None], initial=0.0)
    for _ in range(MAX_GAUSS_NEWTON):
        miss = np.einsum("pac,pc->pa", axes, origin - positions(points, facets, reference))
        slope = np.einsum("pac,pbc->pab", axes, tangents(points, facets, reference))
        moved = np.clip(reference + solve_two(slope, miss), -MAX_REFERENCE, MAX_REFERENCE)
        change = np.abs(moved - reference).max(initial=0.0)
        reference = moved
        if change < CONVERGED:
            break
    miss = np.einsum("pac,pc->pa", axes, origin - positions(points, facets, reference))
    return reference, np.flatnonzero(np.abs(miss).max(axis=1) > 1e-10 * size)


def _rim(facets: IntArray) -> tuple[BoolArray, IntArray]:
    """Return which edges (m, 4) belong to one facet only, and the nodes on these edges."""
    corners = corner_counts(facets)
    ends, owner = [], []
    for e in range(int(corners.max())):
        rows = np.flatnonzero(corners > e)
        ends.append(np.column_stack([facets[rows, e], facets[rows, (e + 1) % corners[rows]]]))
        owner.append(np.column_stack([rows, np.full(len(rows), e)]))
    pairs, which = np.concatenate(ends), np.concatenate(owner)
    _, inverse, count = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True)
    single = count[inverse.ravel()] == 1
    edges = np.zeros((len(facets), 4), dtype=bool)
    edges[tuple(which[single].T)] = True
    return edges, np.unique(pairs[single])


def _on_rim(facets: IntArray, facet: IntArray, reference: FloatArray, edge: IntArray) -> BoolArray:
    """Return whether feet on an edge (-1: inside) lie on the rim of the surface, or on one of its nodes."""
    rim_edge, rim_node = _rim(facets)
    corners = corner_counts(facets[facet])
    at_rim_node = np.zeros(len(facet), dtype=bool)
    for count in np.unique(corners):
        rows = np.flatnonzero(corners == count)
        off = np.abs(reference[rows, None] - REFERENCE_NODES[int(count)]).max(axis=2)
        node = facets[facet[rows], off.argmin(axis=1)]
        at_rim_node[rows] = (off.min(axis=1) <= INSIDE) & np.isin(node, rim_node)
    return np.asarray((edge >= 0) & (rim_edge[facet, edge] | at_rim_node))
