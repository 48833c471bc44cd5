"""Contact segments: intersections of the facets of two surfaces, with quadrature points on both sides.

Segments as in Puso & Laursen (2004): the facets of side B are projected on the plane of each facet of side A and
clipped there (Sutherland & Hodgman 1974), so that no shape function has a kink inside a piece. Triangles are integrated
by symmetric rules with positive weights and interior points (Dunavant 1985; Strang & Fix 1973).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.projection import facet_balls, meet
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.mesh.facets import (
    CORNERS,
    DEGREE,
    REFERENCE_NODES,
    interpolation,
    kinds_of,
    near_pairs,
    normals,
    positions,
    shape_functions,
)

# degree -> orbits (weight, barycentric coordinates); an orbit holds all permutations
_ORBITS: dict[int, tuple[tuple[float, tuple[float, float, float]], ...]] = {
    1: ((1.0, (1 / 3, 1 / 3, 1 / 3)),),
    2: ((1 / 3, (2 / 3, 1 / 6, 1 / 6)),),
    4: (
        (0.223381589678011, (0.108103018168070, 0.445948490915965, 0.445948490915965)),
        (0.109951743655322, (0.816847572980459, 0.091576213509771, 0.091576213509771)),
    ),
    5: (
        (0.225, (1 / 3, 1 / 3, 1 / 3)),
        ((155 + 15**0.5) / 1200, ((9 - 2 * 15**0.5) / 21, (6 + 15**0.5) / 21, (6 + 15**0.5) / 21)),
        ((155 - 15**0.5) / 1200, ((9 + 2 * 15**0.5) / 21, (6 - 15**0.5) / 21, (6 - 15**0.5) / 21)),
    ),
    6: (
        (0.116786275726379, (0.501426509658179, 0.249286745170910, 0.249286745170910)),
        (0.050844906370207, (0.873821971016996, 0.063089014491502, 0.063089014491502)),
        (0.082851075618374, (0.636502499121399, 0.310352451033785, 0.053145049844816)),
    ),
}
HIGHEST_DEGREE = max(_ORBITS)


def triangle_rule(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return barycentric points (n, 3) and weights (n,) with sum 1, exact for polynomials up to `degree`.

    Raises
    ------
    InputError
        If no rule of that degree is known.
    """
    if not 1 <= degree <= HIGHEST_DEGREE:
        raise input_error(
            "degree of the quadrature",
            f"must lie between 1 and {HIGHEST_DEGREE}, got {degree}",
            "Products of quadratic shape functions on triangles have degree 4, on quadrilaterals 6.",
        )
    orbits = _ORBITS[min(known for known in _ORBITS if known >= degree)]
    points: list[tuple[float, ...]] = []
    weights: list[float] = []
    for weight, (a, b, c) in orbits:
        orbit = sorted({(a, b, c), (b, c, a), (c, a, b), (a, c, b), (c, b, a), (b, a, c)})
        points += orbit
        weights += [weight] * len(orbit)
    return np.array(points), np.array(weights)


# distance of mid nodes from a straight edge, as a share of its length, up to which the edge counts as straight
STRAIGHT = 1e-9
ON_EDGE = 1e-12  # distance of corners from a clipping edge, as a share of its length, up to which they lie on it
SLIVER = 1e-10  # area of a piece, as a share of the smaller cell, below which it is rounding
# division of a facet with curved edges into cells (corners; triangles repeat the last one) between these reference
# points
_PARTS = {
    6: (REFERENCE_NODES[6], np.array([[0, 3, 5, 5], [3, 1, 4, 4], [5, 4, 2, 2], [3, 4, 5, 5]])),
    8: (
        np.vstack([REFERENCE_NODES[8], [[0.0, 0.0]]]),
        np.array([[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]]),
    ),
}


@dataclass(frozen=True, eq=False)
class Segments:
    """Quadrature points on the intersections of two surfaces, in the plane of side A.

    Parameters
    ----------
    facet_a, facet_b
        (p,) facets of both sides.
    place
        (p, 3) positions in the plane of the cell of side A, m.
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

    A facet with straight edges is one cell, a facet with curved edges several; triangles repeat their last corner.
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
    """Cut both surfaces along each other's edges and place quadrature points on the pieces.

    Parameters
    ----------
    a, b
        The two sides; facets of `b` are projected on the planes of `a`.
    reach
        Largest distance between the sides, m.
    degree
        Degree of polynomials that are integrated exactly on each piece.
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
    polygons : (p, 8, 2) corners of the common part; the first `count` of a row are valid
    count : (p,) number of corners, 0 where the polygons do not overlap
    """
    polygon, count = subject, np.full(len(subject), subject.shape[1])
    for e in range(window.shape[1]):
        start = window[:, e]
        along = window[:, (e + 1) % window.shape[1]] - start
        polygon, count = _cut(polygon, count, start, along)
    return polygon, count


def _cut(polygon: FloatArray, count: IntArray, start: FloatArray, along: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the part of each polygon to the left of the line from `start` along `along`."""
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
    """Return the triangles of polygons: their polygon (t,), corners (t, 3, 2) and area (t,)."""
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
    """Return pairs of cells close to each other with opposite normals."""
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


SKIP = "; or leave them out with outside='skip'"

Outside = Literal["error", "skip"]


@dataclass(frozen=True, eq=False)
class SegmentPoints:
    """Quadrature points on the intersections of two sides' facets, on both sides.

    Parameters
    ----------
    facet_a, facet_b
        (p,) facets.
    on_a, on_b
        (p, 2) reference coordinates on both sides.
    place, partner, normal
        (p, 3) positions on both sides, m, and the unit normal of side A.
    weight
        (p,) area, m².
    unpaired
        Facets of side A without any partner.
    """

    facet_a: IntArray
    facet_b: IntArray
    on_a: FloatArray
    on_b: FloatArray
    place: FloatArray
    partner: FloatArray
    normal: FloatArray
    weight: FloatArray
    unpaired: IntArray


def segment_points(
    a: Surface, b: Surface, *, reach: float | None = None, degree: int | None = None, outside: Outside = "error"
) -> SegmentPoints:
    """Place quadrature points on the intersections of two sides' facets; see `segment_to_segment`."""
    need_facets("segment_to_segment", a, b)
    radius_a, radius_b = facet_balls(a)[1], facet_balls(b)[1]
    reach = float(max(radius_a.max(), radius_b.max())) if reach is None else reach
    if degree is None:
        highest = [max(DEGREE[int(kind)] for kind in kinds_of(side.facets)) for side in (a, b)]
        degree = min(sum(highest), HIGHEST_DEGREE)
    found = segments(a, b, reach, degree)
    facets_a, facets_b = a.facets[found.facet_a], b.facets[found.facet_b]
    on_a, missed_a = meet(a.points, facets_a, found.place, found.axes)
    places = positions(a.points, facets_a, on_a)
    normal = np.einsum("pk,pkc->pc", interpolation(facets_a, on_a), a.corner_normals()[found.facet_a])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    on_b, missed_b = meet(b.points, facets_b, places, _across(normal))
    _refuse_warped(found.facet_a[np.union1d(missed_a, missed_b)])
    partner = positions(b.points, facets_b, on_b)
    near = np.linalg.norm(partner - places, axis=1) <= reach
    left = np.setdiff1d(np.arange(len(a.facets)), found.facet_a[near])
    if left.size and (outside == "error" or not near.any()):
        raise _without_facet(a, left, reach)
    # the plane of a cell and the curved facet above it have different areas
    own = normals(a.points, facets_a, on_a)
    plane = np.cross(found.axes[:, 0], found.axes[:, 1])
    tilt = np.einsum("pc,pc->p", own, plane) / np.linalg.norm(own, axis=1)
    return SegmentPoints(
        found.facet_a[near],
        found.facet_b[near],
        on_a[near],
        on_b[near],
        places[near],
        partner[near],
        normal[near],
        (found.weight / tilt)[near],
        left,
    )


def _across(normal: FloatArray) -> FloatArray:
    """Return two unit vectors (p, 2, 3) perpendicular to each unit normal (p, 3)."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def need_facets(place: str, *sides: Surface) -> None:
    """Refuse sides without facets."""
    for name, side in zip("AB"[-len(sides) :], sides, strict=True):
        if len(side.facets) == 0:
            raise input_error(place, f"side {name} has no facets", "Give facets, or pair by node_to_node.")


def _without_facet(a: Surface, left: IntArray, reach: float) -> InputError:
    row = a.facets[left[0]]
    middle = a.points[row[row >= 0]].mean(axis=0)
    return input_error(
        "segment_to_segment",
        f"{len(left)} of {len(a.facets)} facets of side A have no facet of side B opposite to them within {reach:.3g} m, e.g. facet "
        f"{left[0]} at ({', '.join(f'{x:.6g}' for x in middle)}) m",
        "Check that both sides' normals point outward, or raise $reach$outside.",
        outside=SKIP,
        reach="reach",
    )


def _refuse_warped(facets: IntArray) -> None:
    if facets.size:
        raise input_error(
            "segment_to_segment",
            f"points of {np.unique(facets).size} facets of side A, e.g. facet {facets[0]}, cannot be projected on both sides",
            "Facets are folded or too warped there: refine the mesh.",
        )
