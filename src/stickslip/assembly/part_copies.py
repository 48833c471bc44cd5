"""Mirrored, rotated and moved copies of parts."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.fe.material import moved_materials
from stickslip.model.fe.rotation import RotatingSolid, with_inner_inertia
from stickslip.model.mesh.solid_mesh import SolidMesh, mirrored_cells
from stickslip.model.part import BodyPoints, Part, Place, rigid_part
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.turning import dof_rotation


def place_of(
    *,
    mirror: tuple[float, float, float] | None = None,
    turn: float = 0.0,
    axis: Axis = Axis(),  # noqa: B008  # frozen
    move: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Place:
    """Return a placement: mirrored in the plane through the origin with the normal `mirror`, then rotated, then moved.

    Parameters
    ----------
    mirror
        Normal of the mirror; None for none.
    turn
        Angle in rad about `axis`.
    axis
        Axis of the rotation.
    move
        Translation, m.
    """
    flip = np.eye(3)
    if mirror is not None:
        normal = np.asarray(mirror, dtype=float)
        if not np.linalg.norm(normal) > 0:
            raise input_error("place_of: mirror", "has no length", "Give a normal, e.g. (1, 0, 0).")
        normal = normal / np.linalg.norm(normal)
        flip = flip - 2 * np.outer(normal, normal)
    rotation = axis.rotation(turn) if turn else np.eye(3)
    origin = np.asarray(axis.origin, dtype=float)
    return Place(rotation @ flip, np.asarray(move, dtype=float) + origin - rotation @ origin)


def copy_of(part: Part, place: Place, **others: Any) -> Part:
    """Return a copy of a part in another place; both share one reduction.

    Parameters
    ----------
    part
        Part to copy; a copy of a copy refers to the original.
    place
        Placement of the copy relative to `part`.
    **others
        Further fields of `Part` that differ.

    Raises
    ------
    InputError
        If a node lacks a component that the rotation mixes with another one.
    """
    template = part if part.template is None else part.template
    whole = place
    if part.place is not None and part.template is not None:
        whole = part.place.then(place)
    mesh = None if template.mesh is None else moved_mesh(template.mesh, whole)
    structure = turned_structure(template.structure, whole)
    if template.turning is not None and not whole.keeps(template.axis):
        raise input_error(
            "copy_of",
            "the copy is not the original turned about the axis of rotation, so that its matrices at speed are others",
            "Bring the matrices of that place as a part of their own.",
        )
    solid = None
    if template.solid is not None and mesh is not None:
        solid = _moved_solid(template.solid, whole, structure)
        mesh = solid.mesh
    body = template.body
    if body is not None:
        body = body.moved(whole.turn, whole.move)
    surfaces = {name: _moved_points(points, whole) for name, points in template.surfaces.items()}
    drawn = None if template.drawn is None else template.drawn.moved(whole.turn, whole.move)
    return replace(
        part,
        structure=structure,
        mesh=mesh,
        solid=solid,
        body=body,
        surfaces=surfaces,
        drawn=drawn,
        template=template,
        place=whole,
        **others,
    )


def placed_body(part: Part, place: Place) -> Part:
    """Return a rigid part with its body axes moved to `place`, as an independent part."""
    assert part.body is not None
    surfaces = {name: _moved_points(points, place) for name, points in part.surfaces.items()}
    drawn = None if part.drawn is None else part.drawn.moved(place.turn, place.move)
    return rigid_part(part.body.moved(place.turn, place.move), surfaces, drawn=drawn)


def moved_mesh(mesh: SolidMesh, place: Place) -> SolidMesh:
    """Return a mesh in another place; numbers and sets are unchanged."""
    cells = mirrored_cells(mesh.cells) if place.mirrors else mesh.cells
    return replace(mesh, points=place.put(mesh.points), cells=cells)


def turned_dofs(dofs: Dofs, place: Place) -> Matrix:
    """Return the CSR matrix from displacements of the original to those of the copy.

    Modal and other scalars are unchanged.
    """
    matrix = dof_rotation(dofs, place.turn, "copy_of")
    if place.mirrors:  # rotations are axial vectors
        sign = [-1.0 if c in ("rx", "ry", "rz") else 1.0 for c in dofs.component]
        matrix = scipy.sparse.csr_array(scipy.sparse.diags_array(np.array(sign)) @ matrix)
    return matrix


def turned_structure(structure: Structure, place: Place) -> Structure:
    """Return a structure in another place, with its matrices on the coordinates x, y, z there."""
    turn = turned_dofs(structure.dofs, place)

    def turned(matrix: Matrix) -> Matrix:
        if matrix is None:
            return None
        found = turn @ matrix @ turn.T
        return scipy.sparse.csr_array(found) if scipy.sparse.issparse(matrix) else np.asarray(found)

    dofs = replace(structure.dofs, position=place.put(structure.dofs.position))
    names = ("mass", "damping", "stiffness", "loss")
    own = {name: turned(getattr(structure, name)) for name in names}
    return replace(structure, dofs=dofs, basis=None, **own)


def _moved_points(points: BodyPoints, place: Place) -> BodyPoints:
    frame = place.turn @ points.frame
    if place.mirrors:  # frames stay right-handed: w is reversed
        frame = frame * np.array([1.0, -1.0, 1.0])
    return replace(points, position=place.put(points.position), frame=frame)


def _moved_solid(solid: RotatingSolid, place: Place, structure: Structure) -> RotatingSolid:
    mesh = moved_mesh(solid.mesh, place)
    arm = solid.axis.arm(mesh.points)
    load: FloatArray = solid.nodal_mass @ arm
    material = moved_materials(solid.material, place.turn, place.move)
    laws = cell_laws(mesh, material, solid.temperature)
    inner = with_inner_inertia(scipy.sparse.csr_array((arm.size, arm.size)), laws, solid.quadrature, np.eye(3))
    load = load.ravel() + inner @ arm.ravel() if inner.nnz else load.ravel()
    followers = None
    if solid.followers is not None:
        whole = scipy.sparse.kron(scipy.sparse.eye_array(len(mesh.points)), place.turn)
        back = turned_dofs(solid.structure.dofs, place).T
        followers = scipy.sparse.csr_array(whole @ solid.followers @ back)
    return RotatingSolid(
        structure,
        mesh,
        material,
        solid.axis,
        solid.quadrature,
        solid.moving,
        solid.nodal_mass,
        load[solid.moving] if followers is None else np.asarray(followers.T @ load),
        followers,
        solid.small,
        solid.temperature,
        solid.point_mass,
    )
