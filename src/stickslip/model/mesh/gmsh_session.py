"""A gmsh session, imported only when a mesh is made, with settings that all our meshes share."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import missing_package

TET10_FROM_GMSH = np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 8])  # gmsh swaps VTK's last two nodes
GMSH_OPTIONS = {
    "Mesh.SecondOrderLinear": 1,  # straight edges: coarse curved elements would turn inside out
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.Algorithm": 6,
    "Mesh.RandomSeed": 1,
}


@contextmanager
def gmsh_session() -> Iterator[Any]:
    """Yield a silent, single-threaded gmsh with an empty model; the model is removed afterwards."""
    try:
        import gmsh
    except (ModuleNotFoundError, OSError) as error:
        raise missing_package("gmsh", error, "fe") from error
    ours = not gmsh.isInitialized()
    if ours:
        # interruptible=False: signal handlers may only be set in the main thread
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setNumber("General.NumThreads", 1)
    gmsh.model.add("stickslip")
    try:
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()


def quadratic_tetrahedra(gmsh: Any) -> tuple[FloatArray, IntArray]:
    """Mesh the current model; return its nodes (n, 3) and tetrahedra (m, 10) in VTK order."""
    for name, value in GMSH_OPTIONS.items():
        gmsh.option.setNumber(name, value)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(2)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, nodes = gmsh.model.mesh.getElementsByType(11)
    cells = np.asarray(nodes, dtype=np.int64).reshape(-1, 10)[:, TET10_FROM_GMSH]
    used, cells = np.unique(cells, return_inverse=True)
    row = np.argsort(tags)[np.searchsorted(np.sort(tags), used)]
    return np.asarray(coordinates).reshape(-1, 3)[row], cells.reshape(-1, 10).astype(np.int64)
