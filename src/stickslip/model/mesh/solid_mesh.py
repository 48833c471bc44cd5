"""Meshes of solids, facets of their skin, and mesh files for ParaView and gmsh; meshio is imported only to write a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error, missing_package

CELL_NAMES = {4: "tetra", 10: "tetra10", 8: "hexahedron", 20: "hexahedron20"}
TET_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])  # outward
HEX_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])  # outward


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of tetrahedra or hexahedra of first or second order; all cells are of the same kind.

    Parameters
    ----------
    points
        (n, 3) nodes in metres.
    cells
        (m, k) nodes of each cell in VTK order: k = 4 or 10 for tetrahedra, 8 or 20 (serendipity) for hexahedra.
    node_sets
        Name -> nodes, as indices into `points`; ``root`` is clamped.
    numbers
        (n,) node numbers of the program that wrote the mesh; 0 ... n − 1 by default.
    cell_numbers
        (m,) cell numbers of that program; 0 ... m − 1 by default.

    Raises
    ------
    InputError
        If the cells have another number of nodes or refer to missing nodes, or the counts of numbers differ from those
        of nodes and cells.
    """

    points: FloatArray
    cells: IntArray
    node_sets: Mapping[str, IntArray]
    numbers: IntArray = None  # type: ignore[assignment]  # counted in __post_init__
    cell_numbers: IntArray = None  # type: ignore[assignment]  # counted in __post_init__

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or self.cells.shape[1] not in CELL_NAMES:
            raise input_error(
                "SolidMesh.cells",
                f"needs rows of 4, 10, 8 or 20 nodes, got an array of shape {self.cells.shape}",
                "Use tetrahedra or hexahedra of first or second order, one kind a mesh.",
            )
        n, m = len(self.points), len(self.cells)
        if m and not 0 <= self.cells.min() <= self.cells.max() < n:
            raise input_error(
                "SolidMesh.cells",
                f"name nodes from {self.cells.min()} to {self.cells.max()}, but there are {n} points",
                "Cells hold indices into points, counted from 0, not node numbers.",
            )
        for name, count in (("numbers", n), ("cell_numbers", m)):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.arange(count))
            elif getattr(self, name).shape != (count,):
                raise input_error(
                    f"SolidMesh.{name}", f"has shape {getattr(self, name).shape} for {count}", "Give one number each."
                )

    @property
    def surface(self) -> IntArray:
        """(k, 3) corner nodes of the skin's triangles, oriented outward; a quadrilateral gives two."""
        pattern = TET_FACES if self.cells.shape[1] in (4, 10) else HEX_FACES
        faces = self.cells[:, pattern].reshape(-1, pattern.shape[1])
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        skin = faces[np.sort(first[count == 1])]
        if skin.shape[1] == 4:
            skin = skin[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
        return np.asarray(skin)


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """Write the mesh for ParaView (``.vtu``) or gmsh (``.msh``); node sets become point data."""
    if path.suffix not in {".vtu", ".msh"}:
        raise input_error(str(path), f"unknown mesh format {path.suffix!r}", "Use .vtu or .msh.")
    try:
        import meshio
    except ModuleNotFoundError as error:
        raise missing_package("meshio", error, "fe") from error
    flags = {}
    for name, nodes in mesh.node_sets.items():
        flags[name] = np.zeros(len(mesh.points))
        flags[name][nodes] = 1.0
    tags = {}
    if path.suffix == ".msh":
        ones = np.ones(len(mesh.cells), dtype=np.int32)
        tags = {"gmsh:physical": [ones], "gmsh:geometrical": [ones]}
    kind = CELL_NAMES[mesh.cells.shape[1]]
    data = meshio.Mesh(mesh.points, [(kind, mesh.cells)], point_data=flags, cell_data=tags)
    if path.suffix == ".msh":
        meshio.write(path, data, file_format="gmsh22", binary=True)
    else:
        meshio.write(path, data)


# edges of second-order cells in the order of their mid nodes, which follow the corners
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
HEX_EDGES = (*((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7)), *((0, 4), (1, 5), (2, 6), (3, 7)))


def facets_of(mesh: SolidMesh, nodes: IntArray) -> IntArray:
    """Return the facets of the skin whose nodes all belong to a set.

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
    """Return the local node numbers of each face of a cell, corners first."""
    kind = mesh.cells.shape[1]
    corners, edges = (TET_FACES, TET_EDGES) if kind in (4, 10) else (HEX_FACES, HEX_EDGES)
    if kind in (4, 8):
        return corners
    first = 4 if kind == 10 else 8
    place = {pair: first + i for i, pair in enumerate(edges)}
    middles = [[place[min(a, b), max(a, b)] for a, b in zip(row, np.roll(row, -1), strict=True)] for row in corners]
    return np.hstack([corners, np.array(middles)])


def mirrored_cells(cells: IntArray) -> IntArray:
    """Return cells (m, k) after a mirror operation, with corners reordered so that volumes stay positive."""
    order = {
        4: [1, 0, 2, 3],
        10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9],
        8: [*range(4, 8), *range(4)],
        20: [*range(4, 8), *range(4), *range(12, 16), *range(8, 12), *range(16, 20)],
    }
    return np.asarray(cells[:, order[cells.shape[1]]])
