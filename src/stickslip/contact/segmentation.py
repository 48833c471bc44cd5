"""Contact segments: the pieces that the facets of two surfaces have in common, and quadrature points on them.

Segments as in Puso & Laursen (2004): the facets of side B are projected on the plane of each facet of side A and clipped there
(Sutherland & Hodgman 1974), so that no shape function has a kink inside a piece.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.facets import CORNERS, REFERENCE_NODES, kinds_of, shape_functions
from stickslip.contact.projection import near_pairs
from stickslip.contact.quadrature import triangle_rule
from stickslip.contact.surface import Surface

STRAIGHT = 1e-9  # mid nodes nearer to the edge than this share of its length do not bend it
ON_EDGE = 1e-12  # corners nearer to a clipping edge than this share of it lie on it
SLIVER = 1e-10  # pieces smaller than this share of the smaller cell are rounding
# a facet with curved edges: cells (corners; triangles repeat their last) between points at these reference places
_PARTS = {
    6: (REFERENCE_NODES[6], np.array([[0, 3, 5, 5], [3, 1, 4, 4], [5, 4, 2, 2], [3, 4, 5, 5]])),
    8: (
        np.vstack([REFERENCE_NODES[8], [[0.0, 0.0]]]),
        np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]]),
    ),
}


@dataclass(frozen=True, eq=False)
class Segments:
    """Quadrature points of the pieces that two surfaces have in common.

    Parameters
    ----------
    facet_a, facet_b
        (p,) facets of both sides.
    place
        (p, 3) places in the plane of the cell of side A, m.
    axes
        (p, 2, 3) two unit vectors of that plane.
    weight
        (p,) area in that plane, m².
    """

    facet_a: IntArray
    facet_b: IntArray
    place: FloatArray
    axes: FloatArray
    weight: FloatArray


def cells_of(surface: Surface) -> tuple[FloatArray, IntArray]:
    """Return the (c, 4, 3) corners of polygons that cover the facets, and the (c,) facet of each.

    A facet with straight edges is one cell, one with curved edges several; triangles repeat their last corner.
    """
    corners, owner = [], []
    kinds = kinds_of(surface.facets)
    for kind in np.unique(kinds):
        rows = np.flatnonzero(kinds == kind)
        nodes = surface.points[surface.facets[rows, :kind]]
        count = CORNERS[int(kind)]
        curved = _is_curved(nodes, count)
        simple = np.minimum(np.arange(4), count - 1)
        corners.append(nodes[~curved][:, simple])
        owner.append(rows[~curved])
        if curved.any():
            places, parts = _PARTS[int(kind)]
            spread = np.einsum("gk,mkc->mgc", shape_functions(int(kind), places), nodes[curved])
            corners.append(spread[:, parts].reshape(-1, 4, 3))
            owner.append(np.repeat(rows[curved], len(parts)))
    return np.concatenate(corners), np.concatenate(owner)


def segments(a: Surface, b: Surface, reach: float, degree: int) -> Segments:
    """Cut both surfaces along each other's edges and put quadrature points on the pieces.

    Parameters
    ----------
    a, b
        The two sides; planes are those of `a`.
    reach
        Largest distance between the sides, m.
    degree
        Polynomials up to this degree are integrated exactly on each piece.
    """
    cells_a, owner_a = cells_of(a)
    cells_b, owner_b = cells_of(b)
    normal_a, normal_b = _cell_normals(cells_a), _cell_normals(cells_b)
    first, second = _facing_cells(cells_a, normal_a, cells_b, normal_b, reach)
    origin = cells_a[:, 0]
    axes = _plane_axes(cells_a, normal_a)
    flat_a = np.einsum("pad,pkd->pka", axes, cells_a - origin[:, None])
    flat_b = np.einsum("pad,pkd->pka", axes[first], cells_b[second] - origin[first][:, None])
    pieces, count = clip(flat_b[:, ::-1], flat_a[first])  # seen from A, B's corners run clockwise
    pair, triangle, area = _fan(pieces, count)
    smaller = np.minimum(_areas(cells_a)[first[pair]], _areas(cells_b)[second[pair]])
    keep = area > SLIVER * smaller
    pair, triangle, area = pair[keep], triangle[keep], area[keep]
    barycentric, weights = triangle_rule(degree)
    flat = np.einsum("gv,pva->pga", barycentric, triangle).reshape(-1, 2)
    pair = np.repeat(pair, len(weights))
    cell = first[pair]
    place = origin[cell] + np.einsum("pa,pad->pd", flat, axes[cell])
    weight = (area[:, None] * weights).ravel()
    return Segments(owner_a[cell], owner_b[second[pair]], place, axes[cell], weight)


def clip(subject: FloatArray, window: FloatArray) -> tuple[FloatArray, IntArray]:
    """Intersect pairs of convex polygons in the plane (Sutherland & Hodgman 1974).

    Parameters
    ----------
    subject, window
        (p, 4, 2) corners, anticlockwise; repeated corners are allowed.

    Returns
    -------
    polygons : (p, 8, 2) corners of the common part; the first `count` of a row hold
    count : (p,) number of corners, 0 where the polygons do not overlap
    """
    polygon, count = subject, np.full(len(subject), subject.shape[1])
    for e in range(window.shape[1]):
        start = window[:, e]
        along = window[:, (e + 1) % window.shape[1]] - start
        polygon, count = _cut(polygon, count, start, along)
    return polygon, count


def _cut(polygon: FloatArray, count: IntArray, start: FloatArray, along: FloatArray) -> tuple[FloatArray, IntArray]:
    """Keep what lies to the left of the line from `start` along `along`."""
    p, m, _ = polygon.shape
    column = np.arange(m)
    following = np.where(column + 1 < count[:, None], column + 1, 0)
    away = polygon - start[:, None]
    side = along[:, None, 0] * away[..., 1] - along[:, None, 1] * away[..., 0]
    side = np.where(np.abs(side) <= ON_EDGE * np.sum(along**2, axis=1)[:, None], 0.0, side)
    after = np.take_along_axis(side, following, axis=1)
    real = column < count[:, None]
    crosses = real & (side * after < 0)
    share = np.where(crosses, side / np.where(crosses, side - after, 1.0), 0.0)
    end = np.take_along_axis(polygon, following[..., None], axis=1)
    crossing = polygon + share[..., None] * (end - polygon)
    corners = np.stack([polygon, crossing], axis=2).reshape(p, 2 * m, 2)
    kept = np.stack([real & (side >= 0), crosses], axis=2).reshape(p, 2 * m)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : m + 1]
    kept_count = np.minimum(kept.sum(axis=1), m + 1)
    return np.take_along_axis(corners, order[..., None], axis=1), kept_count


def _fan(polygons: FloatArray, count: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Split polygons into triangles: their polygon (t,), corners (t, 3, 2) and area (t,)."""
    row, last = np.nonzero(np.arange(2, polygons.shape[1]) < count[:, None])
    triangles = np.stack([polygons[row, 0], polygons[row, last + 1], polygons[row, last + 2]], axis=1)
    first, second = (triangles[:, 1:] - triangles[:, :1]).transpose(1, 0, 2)
    return row, triangles, (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]) / 2


def _is_curved(nodes: FloatArray, corners: int) -> BoolArray:
    """Return whether a mid node of each facet (m, kind, 3) lies off its edge."""
    if nodes.shape[1] == corners:
        return np.zeros(len(nodes), dtype=bool)
    start = nodes[:, :corners]
    edge = np.roll(start, -1, axis=1) - start
    off = np.linalg.norm(np.cross(nodes[:, corners:] - start, edge), axis=2)
    return np.asarray(np.any(off > STRAIGHT * np.sum(edge**2, axis=2), axis=1))


def _diagonals(cells: FloatArray) -> FloatArray:
    """Return twice the vector area of each cell."""
    return np.cross(cells[:, 2] - cells[:, 0], cells[:, 3] - cells[:, 1])


def _areas(cells: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(_diagonals(cells), axis=1) / 2)


def _cell_normals(cells: FloatArray) -> FloatArray:
    vector = _diagonals(cells)
    return np.asarray(vector / np.linalg.norm(vector, axis=1, keepdims=True))


def _plane_axes(cells: FloatArray, normal: FloatArray) -> FloatArray:
    """Return two unit vectors (c, 2, 3) of each cell's plane, the first along its first edge."""
    first = cells[:, 1] - cells[:, 0]
    first = first - np.einsum("cd,cd->c", first, normal)[:, None] * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def _facing_cells(
    cells_a: FloatArray, normal_a: FloatArray, cells_b: FloatArray, normal_b: FloatArray, reach: float
) -> tuple[IntArray, IntArray]:
    """Return pairs of cells near each other whose normals point against each other."""
    middle_a, middle_b = cells_a.mean(axis=1), cells_b.mean(axis=1)
    radius_a = np.linalg.norm(cells_a - middle_a[:, None], axis=2).max(axis=1)
    radius_b = np.linalg.norm(cells_b - middle_b[:, None], axis=2).max(axis=1)
    first, second = near_pairs(middle_a, radius_a, middle_b, radius_b, reach)
    apart = middle_b[second] - middle_a[first]
    height = np.einsum("pd,pd->p", apart, normal_a[first])
    beside = np.linalg.norm(apart - height[:, None] * normal_a[first], axis=1)
    keep = beside < radius_a[first] + radius_b[second]
    keep &= np.einsum("pd,pd->p", normal_a[first], normal_b[second]) < 0
    return first[keep], second[keep]
