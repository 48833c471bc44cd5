"""Cyclic faces with meshes that do not match: the high face follows the low face of the next sector by a mortar tie."""

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray
from stickslip.assembly.locations import node_rows
from stickslip.contact.mortar import mortar_tie
from stickslip.contact.surface import Surface
from stickslip.errors import InputError, input_error
from stickslip.model.mesh.solid_mesh import facets_of
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.waves import check_sectors

KEY = "cyclic"
ON_AXIS = 1e-5  # relative to the size of a face, m/m


def unlike_faces(part: Part) -> CyclicSector:
    """Tie the cyclic faces of a sector by the mortar method.

    Parameters
    ----------
    part
        Part with a mesh. Nodes of its faces are clamped in all directions or in none.

    Raises
    ------
    InputError
        If there is no mesh, the faces do not cover each other, or a node lies on the axis or is clamped in some
        directions.
    """
    check_sectors("part", part.sectors)
    if part.mesh is None:
        raise input_error(
            KEY,
            "needs a mesh, whose facets are the faces",
            "Give the mesh beside the matrices, or match the faces node by node.",
        )
    low, high = (_face(part, name) for name in part.faces)
    pitch = 2 * np.pi / part.sectors
    ahead = Surface(part.axis.turned(low[0].points, pitch), low[0].displacement, low[0].facets, None, low[0].numbers)
    at_rest = np.all(high[1] < 0, axis=1)
    try:
        weights = mortar_tie(high[0], ahead, held=at_rest)
    except InputError as error:
        raise _told(part, error) from None
    moves = np.flatnonzero(~at_rest), np.flatnonzero(np.all(low[1] >= 0, axis=1))
    block = scipy.sparse.kron(weights[moves[0]][:, moves[1]], np.eye(3))
    dofs = low[1][moves[1]].ravel(), high[1][moves[0]].ravel()
    return CyclicSector(part.structure, part.sectors, *dofs, part.axis, scipy.sparse.csr_array(block))


def _face(part: Part, name: str) -> tuple[Surface, IntArray]:
    """Return a cyclic face including clamped nodes, and the (n, 3) dofs of its nodes, -1 if they are held."""
    mesh = part.mesh
    assert mesh is not None
    free, held = mesh.node_sets.get(name), _held(part.structure, mesh.numbers)
    if free is None:
        raise input_error(KEY, f"there is no set {name!r} in the mesh", "Name both faces.")
    facets = facets_of(mesh, np.union1d(free, np.flatnonzero(held)))
    facets = facets[np.isin(facets, free).any(axis=1)]
    own = facets >= 0
    nodes, number = np.unique(facets[own], return_inverse=True)
    place = np.full(facets.shape, -1)
    place[own] = number
    rows = node_rows(part.structure.dofs, mesh.numbers[nodes])[:, :3]
    partly = (rows >= 0).any(axis=1) & (rows < 0).any(axis=1)
    if partly.any():
        raise input_error(
            KEY,
            f"node {mesh.numbers[nodes[partly][0]]} of {name!r} is held in part",
            "Hold the nodes of the cyclic faces in all directions or in none, or match the faces node by node.",
        )
    size = float(np.ptp(mesh.points[nodes], axis=0).max(initial=0.0))
    centre = np.linalg.norm(part.axis.arm(mesh.points[nodes]), axis=1) <= ON_AXIS * size
    if centre.any():
        raise input_error(
            KEY,
            f"node {mesh.numbers[nodes[centre][0]]} of {name!r} lies on the axis, where all sectors meet",
            "Match the faces node by node, or give the disk a bore.",
        )
    nothing = scipy.sparse.csr_array((3 * nodes.size, part.structure.n))
    surface = Surface(mesh.points[nodes], nothing, place, numbers=mesh.numbers[nodes])
    return surface, rows


def _held(structure: Structure, numbers: IntArray) -> BoolArray:
    """Return whether each node of a mesh has no dof."""
    return np.asarray(~(node_rows(structure.dofs, numbers) >= 0).any(axis=1))


def _told(part: Part, error: InputError) -> InputError:
    """Return an error that names the faces instead of the sides of a pairing."""
    low, high = part.faces
    return input_error(
        KEY,
        error.problem.replace("side A", repr(high)).replace("side B", f"{low!r} of the next sector"),
        "Check that the faces have the same outline, the number of sectors and the axis.",
    )
