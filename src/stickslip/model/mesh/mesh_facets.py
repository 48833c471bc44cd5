"""Facets of a mesh's skin that a set of nodes spans."""

import numpy as np

from stickslip.arrays import IntArray
from stickslip.model.mesh.solid_mesh import HEX_FACES, TET_FACES, SolidMesh

# edges of second-order cells in the order of their mid nodes, which follow the corners
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
HEX_EDGES = (*((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7)), *((0, 4), (1, 5), (2, 6), (3, 7)))


def facets_of(mesh: SolidMesh, nodes: IntArray) -> IntArray:
    """Return the facets of the skin all of whose nodes belong to a set.

    Parameters
    ----------
    mesh
        The mesh.
    nodes
        Indices into ``mesh.points``.

    Returns
    -------
    numpy.ndarray
        (m, k) indices into ``mesh.points``: corners anticlockwise seen from outside, then the mid node of each edge in turn;
        k = 3 or 6 for tetrahedra, 4 or 8 for hexahedra.
    """
    inside = np.zeros(len(mesh.points), dtype=bool)
    inside[nodes] = True
    touched = np.count_nonzero(inside[mesh.cells], axis=1) >= 3
    if not touched.any():
        return np.zeros((0, _pattern(mesh).shape[1]), dtype=np.int64)
    skin = _skin(mesh)
    return np.asarray(skin[inside[skin].all(axis=1)], dtype=np.int64)


def _skin(mesh: SolidMesh) -> IntArray:
    pattern = _pattern(mesh)
    corners = 3 if mesh.cells.shape[1] in (4, 10) else 4
    faces = mesh.cells[:, pattern].reshape(-1, pattern.shape[1])
    _, first, count = np.unique(np.sort(faces[:, :corners], axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[count == 1])])


def _pattern(mesh: SolidMesh) -> IntArray:
    """Return which nodes of a cell each of its faces has, corners first."""
    kind = mesh.cells.shape[1]
    corners, edges = (TET_FACES, TET_EDGES) if kind in (4, 10) else (HEX_FACES, HEX_EDGES)
    if kind in (4, 8):
        return corners
    first = 4 if kind == 10 else 8
    place = {pair: first + i for i, pair in enumerate(edges)}
    middles = [[place[min(a, b), max(a, b)] for a, b in zip(row, np.roll(row, -1), strict=True)] for row in corners]
    return np.hstack([corners, np.array(middles)])


def mirrored_cells(cells: IntArray) -> IntArray:
    """Return cells (m, k) whose nodes were mirrored, with their corners in an order that keeps volumes positive."""
    order = {
        4: [1, 0, 2, 3],
        10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9],
        8: [*range(4, 8), *range(4)],
        20: [*range(4, 8), *range(4), *range(12, 16), *range(8, 12), *range(16, 20)],
    }
    return np.asarray(cells[:, order[cells.shape[1]]])
