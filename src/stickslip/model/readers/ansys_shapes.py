"""Wedges, pyramids and tetrahedra that ANSYS writes as bricks with repeated nodes."""

from collections.abc import Iterable
from functools import cache

import numpy as np

from stickslip.arrays import IntArray
from stickslip.model.mesh.solid_mesh import EDGES, FACES

Face = tuple[int, ...]


def regular_nodes(nodes: IntArray) -> IntArray | None:
    """Return the nodes of the cell that a brick of 8 or 20 nodes stands for, in VTK order; None if it is no known shape.

    Corners may be repeated in any way that leaves a hexahedron, wedge, pyramid or tetrahedron. Mid-side nodes of edges
    without length are left out.
    """
    corners = nodes[:8].tolist()
    pattern = tuple(corners.index(node) for node in corners)
    found = _positions(pattern, len(nodes) > 8)
    if found is None:
        return None
    for same in found[1]:
        if len(set(nodes[list(same)].tolist())) > 1:
            return None  # two mid-side nodes on one edge
    cell = nodes[list(found[0])]
    return cell if len(np.unique(cell)) == len(cell) and (cell > 0).all() else None


@cache
def _positions(pattern: Face, second: bool) -> tuple[Face, tuple[Face, ...]] | None:
    """Return the places of a cell's nodes among those of the brick, and places that must hold the same node.

    `pattern` has for each corner the first corner with the same node.
    """
    corners = _corners(pattern)
    if corners is None or not second:
        return None if corners is None else (corners, ())
    middles: dict[Face, list[int]] = {}
    for place, (a, b) in enumerate(EDGES[8], 8):
        if pattern[a] != pattern[b]:
            middles.setdefault(_pair(pattern[a], pattern[b]), []).append(place)
    own = [middles[_pair(corners[a], corners[b])] for a, b in EDGES[len(corners)]]
    return (*corners, *(places[0] for places in own)), tuple(tuple(places) for places in own if len(places) > 1)


def _corners(pattern: Face) -> Face | None:
    """Return the corners of the cell in VTK order; None for other shapes."""
    faces = [_without_repeats(pattern[i] for i in face) for face in FACES[8]]
    faces = [face for face in faces if len(face) > 2]
    count, kinds = len(set(pattern)), sorted(len(face) for face in faces)
    if count == 8:
        return tuple(range(8))
    if count == 6 and kinds == [3, 3, 4, 4, 4]:
        low = next(face for face in faces if len(face) == 3)[::-1]  # faces are seen from outside, the base from inside
        sides = [face for face in faces if len(face) == 4]
        above = [_beside(corner, low, sides) for corner in low]
        return None if None in above else (*low, *(corner for corner in above if corner is not None))
    if (count, kinds) in ((5, [3, 3, 3, 3, 4]), (4, [3, 3, 3, 3])):
        base = max(faces, key=len)[::-1]
        (top,) = set(pattern) - set(base)
        return (*base, top)
    return None


def _beside(corner: int, base: Face, sides: Iterable[Face]) -> int | None:
    """Return the corner above one of the base of a wedge: its neighbour in a quadrilateral that is not of the base."""
    for side in sides:
        if corner in side:
            at = side.index(corner)
            for other in (side[at - 1], side[(at + 1) % 4]):
                if other not in base:
                    return other
    return None


def _without_repeats(face: Iterable[int]) -> Face:
    return tuple(dict.fromkeys(face))


def _pair(a: int, b: int) -> Face:
    return (a, b) if a < b else (b, a)
