"""The outer surface of a model and fields on it, for pictures."""

from collections.abc import Mapping

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.assembly.assembled import Skin
from stickslip.assembly.locations import AXES, Places
from stickslip.model.fe.solid import node_dofs
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import Part


def skin_of(parts: Mapping[str, Part]) -> Skin | None:
    """Return the outer surface of all meshes by their corner nodes; None if no part has a mesh."""
    points, triangles, cuts = [], [], []
    count = 0
    for part in parts.values():
        if part.mesh is None:
            continue
        skin = part.mesh.surface
        used, place = np.unique(skin, return_inverse=True)
        points.append(part.mesh.points[used])
        triangles.append(place.reshape(skin.shape) + count)
        cuts.append(_cut(part, part.mesh, skin))
        count += len(used)
    if not points:
        return None
    return Skin(np.vstack(points), np.vstack(triangles).astype(np.int64), np.concatenate(cuts))


def on_skin(places: Places, field: Matrix) -> Matrix:
    """Return displacements (m, n, 3) of the skin's points from fields (N, m) on the dofs of all parts."""
    found = []
    for name, part in places.parts.items():
        if part.mesh is None:
            continue
        rows = node_dofs(np.unique(part.mesh.surface))
        moved = mesh_motion(part, part.mesh)[rows] @ field[places.own(name)]
        found.append(np.asarray(moved).T.reshape(field.shape[1], -1, 3))
    return np.concatenate(found, axis=1)


def mesh_motion(part: Part, mesh: SolidMesh) -> Matrix:
    """Return the CSR matrix (3 n, m) from a part's dofs to the x, y, z of the nodes of its mesh; rows of held ones are zero."""
    if part.solid is not None:
        return part.solid.onto
    dofs, nodes, components = _mesh_dofs(part, mesh)
    entries = (np.ones(dofs.size), (3 * nodes + components, dofs))
    return scipy.sparse.csr_array(entries, shape=(3 * len(mesh.points), part.structure.n))


def _mesh_dofs(part: Part, mesh: SolidMesh) -> tuple[IntArray, IntArray, IntArray]:
    """Return a part's dofs that are mesh displacements, their nodes (indices), and their components (0, 1, 2)."""
    table = part.structure.dofs
    order = np.argsort(mesh.numbers, kind="stable")
    at = np.searchsorted(mesh.numbers, table.node, sorter=order)
    nodes = order[np.minimum(at, len(order) - 1)]
    known = (mesh.numbers[nodes] == table.node) & np.isin(table.component, AXES)
    dofs = np.flatnonzero(known)
    components = np.array([AXES.index(table.component[i]) for i in dofs], dtype=np.int64)
    return dofs, nodes[dofs], components


def _cut(part: Part, mesh: SolidMesh, skin: IntArray) -> IntArray:
    """Return 1 for triangles on a cyclic face: all corners are on it or clamped, and at least one is on it."""
    cut = np.zeros(len(skin), dtype=np.int64)
    if part.sectors == 1:
        return cut
    dofs, nodes, _ = _mesh_dofs(part, mesh)
    held = np.ones(len(mesh.points), dtype=bool)
    held[nodes] = False
    for face in part.faces:
        own: BoolArray = np.zeros(len(mesh.points), dtype=bool)
        if face in part.structure.sets:
            own[nodes[np.isin(dofs, part.structure.sets[face])]] = True
        cut |= (own | held)[skin].all(axis=1) & own[skin].any(axis=1)
    return cut
