"""A sector of a ring or a plain disk, as a regular grid of second-order hexahedra; no mesher is needed."""

import math

import numpy as np

from stickslip.arrays import IntArray
from stickslip.model.mesh.solid_mesh import SolidMesh

# grid steps (radius, angle, axis) of a 20-node hexahedron's nodes within its 2 x 2 x 2 cell, VTK order
CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
MIDDLES = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
UPRIGHT = [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
HEX20 = np.array([*CORNERS, *MIDDLES, *UPRIGHT])


def annular_sector(
    inner_radius: float, outer_radius: float, width: float, *, sectors: int, divisions: tuple[int, int, int] = (4, 2, 1)
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
        Elements along the radius, around the sector, and along the axis.

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
    r, a, h = (grid.ravel() for grid in np.meshgrid(radius, angle, z, indexing="ij"))
    points = np.column_stack([r * np.cos(a), r * np.sin(a), h])
    place = np.stack(np.meshgrid(*(np.arange(n) for n in steps), indexing="ij"), axis=-1)
    place = place.reshape(-1, 3)
    first = np.stack(np.meshgrid(*(np.arange(0, n - 1, 2) for n in steps), indexing="ij"), axis=-1)
    cells = np.ravel_multi_index(tuple((first.reshape(-1, 1, 3) + HEX20).transpose(2, 0, 1)), tuple(steps))
    # nodes with at most one odd step lie on edges: the others belong to no serendipity element
    used = np.flatnonzero((place % 2).sum(axis=1) <= 1)
    place = place[used]

    def where(column: int, step: int) -> IntArray:
        return np.flatnonzero(place[:, column] == step)

    sets = {
        "root": where(0, 0),
        "tip": where(0, steps[0] - 1),
        "cyclic_low": where(1, 0),
        "cyclic_high": where(1, steps[1] - 1),
    }
    return SolidMesh(points[used], np.searchsorted(used, cells).astype(np.int64), sets)
