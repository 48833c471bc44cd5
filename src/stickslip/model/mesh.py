"""Meshes of solids, and files of them for ParaView and gmsh; meshio is imported only to write one."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error, missing_package

TET_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])  # outward


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of second-order tetrahedra.

    Parameters
    ----------
    points
        (n, 3) nodes in metres.
    cells
        (m, 10) nodes of each tetrahedron in VTK order.
    node_sets
        Name -> nodes; ``root`` is clamped.
    """

    points: FloatArray
    cells: IntArray
    node_sets: Mapping[str, IntArray]

    @property
    def surface(self) -> IntArray:
        """(k, 3) corner nodes of the skin's triangles, oriented outward."""
        faces = self.cells[:, TET_FACES].reshape(-1, 3)
        _, first, count = np.unique(
            np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
        )
        return np.asarray(faces[np.sort(first[count == 1])])


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
    data = meshio.Mesh(mesh.points, [("tetra10", mesh.cells)], point_data=flags, cell_data=tags)
    if path.suffix == ".msh":
        meshio.write(path, data, file_format="gmsh22", binary=True)
    else:
        meshio.write(path, data)
