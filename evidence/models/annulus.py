"""Regular grids of cells of any kind, and a sector of a ring or a plain disk made of one; no mesher is needed."""

import math

import numpy as np

from stickslip.arrays import IntArray
from stickslip.model.mesh.solid_mesh import EDGES, SolidMesh

# grid steps (radius, angle, axis) of a hexahedron's corners within its 2 x 2 x 2 cell, VTK order
CORNERS = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)])
# corners of the cells that fill it, by their number of nodes: the hexahedron, two wedges, six tetrahedra
BRICK = [[0, 1, 2, 3, 4, 5, 6, 7]]
WEDGES = [[0, 1, 2, 4, 5, 6], [0, 2, 3, 4, 6, 7]]
TETRAHEDRA = [[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]]
FILLED = {8: BRICK, 20: BRICK, 6: WEDGES, 15: WEDGES, 4: TETRAHEDRA, 10: TETRAHEDRA}


def filled_grid(divisions: tuple[int, int, int], cell: int) -> tuple[IntArray, IntArray]:
    """Return nodes (n, 3) in half steps, and cells (m, cell) that fill a grid of bricks."""
    steps = 2 * np.array(divisions) + 1
    first = np.stack(np.meshgrid(*(np.arange(0, n - 1, 2) for n in steps), indexing="ij"), axis=-1)
    shapes = CORNERS[FILLED[cell]]
    if cell > shapes.shape[1]:
        ends = np.array(EDGES[shapes.shape[1]])
        shapes = np.concatenate([shapes, (shapes[:, ends[:, 0]] + shapes[:, ends[:, 1]]) // 2], axis=1)
    at = (first.reshape(-1, 1, 1, 3) + shapes).reshape(-1, cell, 3)
    cells = np.ravel_multi_index(tuple(at.transpose(2, 0, 1)), tuple(steps))
    used = np.unique(cells)  # the middle of a face belongs to a cell only if the face is divided
    place = np.stack(np.unravel_index(used, tuple(steps)), axis=1)
    return place, np.searchsorted(used, cells).astype(np.int64)


def annular_sector(
    inner_radius: float,
    outer_radius: float,
    width: float,
    *,
    sectors: int,
    divisions: tuple[int, int, int] = (4, 2, 1),
    cell: int = 20,
) -> SolidMesh:
    """Mesh one of `sectors` equal sectors of a ring of rectangular cross-section.

    Rotation axis z, sector centred on +x, as `mesh_sector`; the sides of the elements are curved.

    Parameters
    ----------
    inner_radius, outer_radius
        In metres.
    width
        Extent along the axis in metres.
    sectors
        How many make the ring, at least 2.
    divisions
        Bricks along the radius, around the sector, and along the axis.
    cell
        Nodes of a cell: 20 for bricks, 15 for wedges, 10 for tetrahedra.

    Returns
    -------
    SolidMesh
        With the node sets ``root`` (inner radius), ``tip`` (outer radius), ``cyclic_low`` and ``cyclic_high`` (paired).
    """
    steps = 2 * np.array(divisions) + 1
    half = math.pi / sectors
    radius = np.linspace(inner_radius, outer_radius, steps[0])
    angle = np.linspace(-half, half, steps[1])
    z = np.linspace(-width / 2, width / 2, steps[2])
    place, cells = filled_grid(divisions, cell)
    r, a, h = radius[place[:, 0]], angle[place[:, 1]], z[place[:, 2]]
    points = np.column_stack([r * np.cos(a), r * np.sin(a), h])

    def where(column: int, step: int) -> IntArray:
        return np.flatnonzero(place[:, column] == step)

    sets = {
        "root": where(0, 0),
        "tip": where(0, steps[0] - 1),
        "cyclic_low": where(1, 0),
        "cyclic_high": where(1, steps[1] - 1),
    }
    return SolidMesh(points, cells, sets)
