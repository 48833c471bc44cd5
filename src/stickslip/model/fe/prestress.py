"""Stress stiffening: tangent stiffness of a loaded elastic solid.

St. Venant-Kirchhoff's law, total Lagrangian: Green strain, second Piola-Kirchhoff stress ``λ tr(E) I + 2 G E``.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.model.fe.cell_laws import CellLaws, laws_of_group
from stickslip.model.fe.cell_matrices import (
    cell_stiffness,
    condensed,
    inner_motion,
    store_blocks,
    strain_operator,
    with_inner_modes,
)
from stickslip.model.fe.elements import EXACT, NodeBlocks, Shape, cell_groups, chunks, gradients, shape_functions
from stickslip.model.fe.material import PAIRS, TENSOR
from stickslip.model.mesh.solid_mesh import SolidMesh


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
    laws: CellLaws,
    shape: Shape,
    places: NodeBlocks,
    displacement: FloatArray,
    *,
    green: bool = False,
    heated: bool = False,
) -> PrestressTerms:
    """Integrate the terms that a static displacement adds to the stiffness.

    Parameters
    ----------
    laws, shape, places
        Cells with their materials, shape functions at the quadrature points, and assembly.
    displacement
        (nodes, 3) displacement in metres.
    green
        True: stress of the Green strain; False: stress of the small strain, linear in the displacement.
    heated
        Whether the thermal strain belongs to the displacement: stress follows from the strain without it.
    """
    mesh = laws.mesh
    stores = [places.zeros(9), places.zeros(9), places.zeros(9 if shape.inner else 1)]
    for piece in chunks(mesh, shape):
        slopes, volume = gradients(mesh, shape, piece)
        law = laws.elastic(shape, piece)
        motion, own = _inner(shape, law, slopes, volume), None
        free = laws.thermal_strain(shape, piece) if heated else None
        if motion is not None and free is not None:
            own = inner_start(shape, law, slopes, volume, free)
        turn = displacement_gradients(mesh, slopes, piece, displacement, motion, own)
        small = strain_operator(np.broadcast_to(np.eye(3), turn.shape), slopes)
        large = strain_operator(turn, slopes)
        m, q, k, _ = slopes.shape
        stressed = (volume[:, :, None, None] * (elasticity(law) @ large)).reshape(m, 6 * q, 3 * k)
        mixed = small.reshape(m, 6 * q, 3 * k).transpose(0, 2, 1) @ stressed
        square = large.reshape(m, 6 * q, 3 * k).transpose(0, 2, 1) @ stressed
        stress = volume[:, :, None, None] * second_stress(law, turn, green, free)
        pulled = np.matmul(slopes, stress).transpose(0, 2, 1, 3).reshape(m, k, 3 * q)
        geometric = pulled @ slopes.transpose(0, 1, 3, 2).reshape(m, 3 * q, k)
        store_blocks(places, stores[0], piece, condensed(mixed + mixed.transpose(0, 2, 1), motion))
        store_blocks(places, stores[1], piece, condensed(square, motion))
        if motion is None:
            places.add(stores[2], piece, geometric[..., None])
        else:
            store_blocks(places, stores[2], piece, condensed(np.kron(geometric, np.eye(3)), motion))
    return PrestressTerms(*(places.matrix(store) for store in stores))


def internal_force(laws: CellLaws, shape: Shape, displacement: FloatArray) -> FloatArray:
    """Return the (nodes, 3) forces in N that keep the solid in equilibrium at a finite displacement (nodes, 3), heated as it is."""
    mesh = laws.mesh
    force = np.zeros_like(mesh.points)
    for piece in chunks(mesh, shape):
        slopes, volume = gradients(mesh, shape, piece)
        law = laws.elastic(shape, piece)
        motion, own = _inner(shape, law, slopes, volume), None
        free = laws.thermal_strain(shape, piece)
        if motion is not None and free is not None:
            own = inner_start(shape, law, slopes, volume, free)
        turn = displacement_gradients(mesh, slopes, piece, displacement, motion, own)
        first = (np.eye(3) + turn) @ second_stress(law, turn, green=True, free=free)
        _pull(force, mesh.cells[piece], shape, first, slopes, volume, motion)
    return force


def thermal_force(laws: CellLaws, shape: Shape) -> FloatArray:
    """Return the (nodes, 3) forces in N whose linear displacement is that of the thermal strain: ``∫ Bᵀ C ε``."""
    mesh = laws.mesh
    force = np.zeros_like(mesh.points)
    for piece in chunks(mesh, shape):
        free = laws.thermal_strain(shape, piece)
        if free is not None:
            slopes, volume = gradients(mesh, shape, piece)
            law = laws.elastic(shape, piece)
            stress = second_stress(law, free, green=False)
            _pull(force, mesh.cells[piece], shape, stress, slopes, volume, _inner(shape, law, slopes, volume))
    return force


def _pull(
    force: FloatArray,
    cells: IntArray,
    shape: Shape,
    stress: FloatArray,
    slopes: FloatArray,
    volume: FloatArray,
    motion: FloatArray | None,
) -> None:
    """Add the nodal forces of stresses (m, q, 3, 3) to `force` (nodes, 3)."""
    pull = np.einsum("mqac,mqkc,mq->mka", stress, slopes, volume, optimize=True)
    if motion is not None:
        onto = motion.transpose(0, 2, 1) @ pull[:, shape.width :].reshape(len(pull), -1, 1)
        pull = pull[:, : shape.width] + onto.reshape(len(pull), shape.width, 3)
    nodes = cells.ravel()
    for axis in range(3):
        force[:, axis] += np.bincount(nodes, pull[..., axis].ravel(), minlength=len(force))


def inner_start(shape: Shape, law: FloatArray, slopes: FloatArray, volume: FloatArray, free: FloatArray) -> FloatArray:
    """Return the (m, 9) amplitudes of a brick's incompatible modes that the thermal strain causes while its nodes are held."""
    stress = second_stress(law, free, green=False)
    pull = np.einsum("mqac,mqkc,mq->mka", stress, slopes[:, :, shape.width :], volume, optimize=True)
    n = 3 * shape.width
    inner = cell_stiffness(law, slopes, volume)[:, n:, n:]
    return np.asarray(np.linalg.solve(inner, pull.reshape(len(pull), -1, 1))[..., 0])


def _inner(shape: Shape, law: FloatArray, slopes: FloatArray, volume: FloatArray) -> FloatArray | None:
    """Return the `inner_motion` of bricks with incompatible modes; None of other cells."""
    return inner_motion(shape, cell_stiffness(law, slopes, volume)) if shape.inner else None


def displacement_gradients(
    mesh: SolidMesh,
    slopes: FloatArray,
    piece: slice,
    displacement: FloatArray,
    motion: FloatArray | None = None,
    start: FloatArray | None = None,
) -> FloatArray:
    """Return (m, q, 3, 3) gradients ``∂u_a / ∂x_b`` of a displacement (nodes, 3) in a piece of the cells.

    `motion` is the `inner_motion` of bricks with incompatible modes, `start` (m, 9) what their amplitudes are beside it.
    """
    moved = with_inner_modes(displacement[mesh.cells[piece]], motion)
    if start is not None:
        moved[:, -len(start[0]) // 3 :] += start.reshape(len(start), -1, 3)
    moved = moved.transpose(0, 2, 1)
    return np.asarray(moved[:, None] @ slopes)


def second_stress(law: FloatArray, turn: FloatArray, green: bool, free: FloatArray | None = None) -> FloatArray:
    """Return the (m, q, 3, 3) stress in Pa of displacement gradients, from their Green or small strain less the strain `free`.

    `law` is that of `CellLaws.elastic`.
    """
    strain = (turn + np.swapaxes(turn, -1, -2)) / 2
    if green:
        strain = strain + np.swapaxes(turn, -1, -2) @ turn / 2
    if free is not None:
        strain = strain - free
    if law.ndim > 2:
        vector = np.stack([strain[..., i, j] * (1 if i == j else 2) for i, j in PAIRS], axis=-1)
        stress = (law @ vector[..., None])[..., 0]
        return np.asarray(stress[..., TENSOR])
    first, second = law.T[:, :, None, None, None]
    trace = np.trace(strain, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(first * trace * np.eye(3) + 2 * second * strain)


def elasticity(law: FloatArray) -> FloatArray:
    """Return (m, 1 or q, 6, 6) matrices from strain vectors to stress vectors."""
    if law.ndim > 2:
        return law
    first, second = law.T[:, :, None, None]
    volume = np.zeros((6, 6))
    volume[:3, :3] = 1.0
    found = first * volume + second * np.diag([2.0] * 3 + [1.0] * 3)
    return np.asarray(found[:, None])


def strain_and_rotation(laws: CellLaws, displacement: FloatArray) -> tuple[float, float]:
    """Return the largest principal strain (a magnitude) and the largest rotation (rad) at the centres of the elements.

    Parameters
    ----------
    laws
        Cells of the solid; their free thermal strain does not count.
    displacement
        (nodes, 3) displacement in m.
    """
    strain = rotation = 0.0
    for group in cell_groups(laws.mesh, EXACT):
        own, law = group.mesh, laws_of_group(laws, group.mesh, group.rows)
        shape = shape_functions(own.cells.shape[1], 1)
        for piece in chunks(own, shape):
            slopes, _ = gradients(own, shape, piece)
            found = np.einsum("mkx,mqky->mqxy", displacement[own.cells[piece]], slopes)
            turned = np.swapaxes(found, 2, 3)
            free = law.thermal_strain(shape, piece)
            stressed = found + turned - (0.0 if free is None else 2 * free)
            strain = max(strain, float(np.linalg.norm(stressed, 2, axis=(2, 3)).max()) / 2)
            rotation = max(rotation, float(np.linalg.norm(found - turned, 2, axis=(2, 3)).max()) / 2)
    return strain, rotation
