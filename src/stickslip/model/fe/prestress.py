"""Stress stiffening: tangent stiffness of a loaded elastic solid.

St. Venant-Kirchhoff's law, total Lagrangian: Green strain, second Piola-Kirchhoff stress ``λ tr(E) I + 2 G E``.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, Matrix
from stickslip.model.fe.cell_laws import cell_laws
from stickslip.model.fe.cell_matrices import (
    cell_stiffness,
    condensed,
    inner_motion,
    store_blocks,
    strain_operator,
    with_inner_modes,
)
from stickslip.model.fe.elements import EXACT, NodeBlocks, Shape, cell_groups, chunks, gradients, shape_functions
from stickslip.model.fe.material import PAIRS, Materials
from stickslip.model.mesh.solid_mesh import SolidMesh

TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # places of a tensor's components in a vector


@dataclass(frozen=True, eq=False)
class PrestressTerms:
    """Terms of the tangent stiffness at a displacement u, without the stiffness at rest.

    Parameters
    ----------
    linear
        (n, n) initial-displacement terms linear in u.
    quadratic
        (n, n) initial-displacement terms quadratic in u.
    geometric
        (n, n) stress stiffness: linear in u if the stress follows from linear elasticity.
    """

    linear: Matrix
    quadratic: Matrix
    geometric: Matrix


def prestress_terms(
    mesh: SolidMesh,
    material: Materials,
    shape: Shape,
    places: NodeBlocks,
    displacement: FloatArray,
    *,
    green: bool = False,
) -> PrestressTerms:
    """Integrate the terms that a static displacement adds to the stiffness.

    Parameters
    ----------
    mesh, material, shape, places
        Mesh, its material, shape functions at the quadrature points, and assembly.
    displacement
        (nodes, 3) displacement in metres.
    green
        True: stress of the Green strain; False: stress of the small strain, linear in the displacement.
    """
    laws = cell_laws(mesh, material)
    stores = [places.zeros(9), places.zeros(9), places.zeros(9 if shape.inner else 1)]
    for piece in chunks(mesh, shape):
        slopes, volume = gradients(mesh, shape, piece)
        law = laws.elastic(shape, piece)
        motion = _inner(shape, law, slopes, volume)
        turn = displacement_gradients(mesh, slopes, piece, displacement, motion)
        small = strain_operator(np.broadcast_to(np.eye(3), turn.shape), slopes)
        large = strain_operator(turn, slopes)
        m, q, k, _ = slopes.shape
        stressed = (volume[:, :, None, None] * (_elasticity(law) @ large)).reshape(m, 6 * q, 3 * k)
        mixed = small.reshape(m, 6 * q, 3 * k).transpose(0, 2, 1) @ stressed
        square = large.reshape(m, 6 * q, 3 * k).transpose(0, 2, 1) @ stressed
        stress = volume[:, :, None, None] * second_stress(law, turn, green)
        pulled = np.matmul(slopes, stress).transpose(0, 2, 1, 3).reshape(m, k, 3 * q)
        geometric = pulled @ slopes.transpose(0, 1, 3, 2).reshape(m, 3 * q, k)
        store_blocks(places, stores[0], piece, condensed(mixed + mixed.transpose(0, 2, 1), motion))
        store_blocks(places, stores[1], piece, condensed(square, motion))
        if motion is None:
            places.add(stores[2], piece, geometric[..., None])
        else:
            store_blocks(places, stores[2], piece, condensed(np.kron(geometric, np.eye(3)), motion))
    return PrestressTerms(*(places.matrix(store) for store in stores))


def internal_force(mesh: SolidMesh, material: Materials, shape: Shape, displacement: FloatArray) -> FloatArray:
    """Return the (nodes, 3) forces in N that keep the solid in equilibrium at a finite displacement (nodes, 3)."""
    force, laws = np.zeros_like(mesh.points), cell_laws(mesh, material)
    for piece in chunks(mesh, shape):
        slopes, volume = gradients(mesh, shape, piece)
        law = laws.elastic(shape, piece)
        motion = _inner(shape, law, slopes, volume)
        turn = displacement_gradients(mesh, slopes, piece, displacement, motion)
        first = (np.eye(3) + turn) @ second_stress(law, turn, green=True)
        pull = np.einsum("mqac,mqkc,mq->mka", first, slopes, volume, optimize=True)
        if motion is not None:
            onto = motion.transpose(0, 2, 1) @ pull[:, shape.width :].reshape(len(pull), -1, 1)
            pull = pull[:, : shape.width] + onto.reshape(len(pull), shape.width, 3)
        nodes = mesh.cells[piece].ravel()
        for axis in range(3):
            force[:, axis] += np.bincount(nodes, pull[..., axis].ravel(), minlength=len(force))
    return force


def _inner(shape: Shape, law: FloatArray, slopes: FloatArray, volume: FloatArray) -> FloatArray | None:
    """Return the `inner_motion` of bricks with incompatible modes; None of other cells."""
    return inner_motion(shape, cell_stiffness(law, slopes, volume)) if shape.inner else None


def displacement_gradients(
    mesh: SolidMesh, slopes: FloatArray, piece: slice, displacement: FloatArray, motion: FloatArray | None = None
) -> FloatArray:
    """Return (m, q, 3, 3) gradients ``∂u_a / ∂x_b`` of a displacement (nodes, 3) in a piece of the cells.

    `motion` is the `inner_motion` of bricks with incompatible modes.
    """
    moved = with_inner_modes(displacement[mesh.cells[piece]], motion).transpose(0, 2, 1)
    return np.asarray(moved[:, None] @ slopes)


def second_stress(law: FloatArray, turn: FloatArray, green: bool) -> FloatArray:
    """Return the (m, q, 3, 3) stress in Pa of displacement gradients, from their Green or small strain.

    `law` is that of `CellLaws.elastic`.
    """
    strain = (turn + np.swapaxes(turn, -1, -2)) / 2
    if green:
        strain = strain + np.swapaxes(turn, -1, -2) @ turn / 2
    if law.ndim > 2:
        vector = np.stack([strain[..., i, j] * (1 if i == j else 2) for i, j in PAIRS], axis=-1)
        stress = (law @ vector[..., None])[..., 0]
        return np.asarray(stress[..., TENSOR])
    first, second = law.T[:, :, None, None, None]
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(first * trace * np.eye(3) + 2 * second * strain)


def _elasticity(law: FloatArray) -> FloatArray:
    """Return (m, 1 or q, 6, 6) matrices from strain vectors to stress vectors."""
    if law.ndim > 2:
        return law
    first, second = law.T[:, :, None, None]
    volume = np.zeros((6, 6))
    volume[:3, :3] = 1.0
    found = first * volume + second * np.diag([2.0] * 3 + [1.0] * 3)
    return np.asarray(found[:, None])


def strain_and_rotation(mesh: SolidMesh, displacement: FloatArray) -> tuple[float, float]:
    """Return the largest principal strain (a magnitude) and the largest rotation (rad) at the centres of the elements.

    Parameters
    ----------
    mesh
        Mesh of the solid.
    displacement
        (nodes, 3) displacement in m.
    """
    strain = rotation = 0.0
    for own in (group.mesh for group in cell_groups(mesh, EXACT)):
        shape = shape_functions(own.cells.shape[1], 1)
        for piece in chunks(own, shape):
            slopes, _ = gradients(own, shape, piece)
            found = np.einsum("mkx,mqky->mqxy", displacement[own.cells[piece]], slopes)
            turned = np.swapaxes(found, 2, 3)
            strain = max(strain, float(np.linalg.norm(found + turned, 2, axis=(2, 3)).max()) / 2)
            rotation = max(rotation, float(np.linalg.norm(found - turned, 2, axis=(2, 3)).max()) / 2)
    return strain, rotation
