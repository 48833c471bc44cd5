"""Matrices of cells that scikit-fem does not assemble.

These are wedges, pyramids, bricks of 8 nodes with incompatible modes or one point, and all cells of anisotropic materials.
"""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.model.fe.cell_laws import CellLaws
from stickslip.model.fe.elements import N_INNER, CellGroup, NodeBlocks, Shape, chunks, gradients
from stickslip.model.fe.material import PAIRS

# the four patterns of a brick's corners that strain nothing at its centre, at -1 and 1 (Flanagan and Belytschko 1981)
HOURGLASS = np.array(
    [
        [1, 1, -1, -1, -1, -1, 1, 1],
        [1, -1, -1, 1, -1, 1, 1, -1],
        [1, -1, 1, -1, 1, -1, 1, -1],
        [-1, 1, -1, 1, 1, -1, 1, -1],
    ],
    dtype=float,
)


def assemble_cells(group: CellGroup, laws: CellLaws) -> tuple[Matrix, Matrix]:
    """Return mass and stiffness (3n, 3n) of a group of cells on all n points of its mesh.

    Parameters
    ----------
    group
        The cells.
    laws
        Their materials.
    """
    places = NodeBlocks(group.mesh, np.ones(len(group.mesh.points), dtype=bool))
    store = places.zeros(9)
    shape = group.strain
    for piece in chunks(group.mesh, shape):
        stiffness = cell_stiffness(laws.elastic(shape, piece), *gradients(group.mesh, shape, piece))
        store_blocks(places, store, piece, condensed(stiffness, inner_motion(shape, stiffness)))
    stiffness = places.matrix(store)
    if group.rule.hourglass is not None:
        stiffness = scipy.sparse.csr_array(stiffness + hourglass_stiffness(group, laws))
    return inertia(group, laws, np.eye(3)), scipy.sparse.csr_array((stiffness + stiffness.T) / 2)


def inertia(group: CellGroup, laws: CellLaws, block: FloatArray) -> Matrix:
    """Return (3n, 3n) ``∫ ρ Nᵀ B N``, with `block` B (3, 3), as `assemble_cells`.

    Incompatible modes move as without load (Guyan 1965), so their mass counts.
    """
    places = NodeBlocks(group.mesh, np.ones(len(group.mesh.points), dtype=bool))
    store = places.zeros(9)
    shape, strain = group.inertia, group.strain
    for piece in chunks(group.mesh, strain if shape.inner else shape):
        _, volume = gradients(group.mesh, shape, piece)
        scalar = np.einsum(
            "qk,ql,mq->mkl", shape.values, shape.values, volume * laws.density(piece)[:, None], optimize=True
        )
        matrix = (scalar[:, :, None, :, None] * block[:, None]).reshape(len(scalar), 3 * scalar.shape[1], -1)
        motion = None
        if shape.inner:
            motion = inner_motion(
                strain, cell_stiffness(laws.elastic(strain, piece), *gradients(group.mesh, strain, piece))
            )
        store_blocks(places, store, piece, condensed(matrix, motion))
    return places.matrix(store)


def hourglass_stiffness(group: CellGroup, laws: CellLaws) -> Matrix:
    """Return the (3n, 3n) stiffness against hourglass motions: ``f E V Σ_k |∇N_k|²`` times the hourglass patterns.

    Patterns lose their part in linear fields, so that uniform strain costs nothing. f is `Quadrature.hourglass`.
    """
    places = NodeBlocks(group.mesh, np.ones(len(group.mesh.points), dtype=bool))
    store = places.zeros(1)
    shape, factor = group.strain, group.rule.hourglass or 0.0
    for piece in chunks(group.mesh, shape):
        slopes, volume = gradients(group.mesh, shape, piece)
        mean = slopes[:, 0]
        corners = group.mesh.points[group.mesh.cells[piece]]
        patterns = HOURGLASS - (HOURGLASS @ corners) @ mean.transpose(0, 2, 1)
        scale = factor * laws.modulus(piece) * volume[:, 0] * np.sum(mean**2, axis=(1, 2))
        places.add(store, piece, (scale[:, None, None] * (patterns.transpose(0, 2, 1) @ patterns))[..., None])
    return places.matrix(store)


def cell_stiffness(law: FloatArray, slopes: FloatArray, volume: FloatArray) -> FloatArray:
    """Return (m, 3k, 3k) stiffness of cells from gradients (m, q, k, 3) and weights (m, q); k includes incompatible modes.

    `law` is that of `CellLaws.elastic`: Lamé's constants (m, 2), or matrices (m, q, 6, 6).
    """
    m, q, k, _ = slopes.shape
    if law.ndim > 2:
        strained = strain_operator(np.broadcast_to(np.eye(3), (m, q, 3, 3)), slopes)
        stressed = (volume[:, :, None, None] * (law @ strained)).reshape(m, 6 * q, 3 * k)
        return np.asarray(strained.reshape(m, 6 * q, 3 * k).transpose(0, 2, 1) @ stressed)
    weighted = slopes * volume[..., None, None]
    flat = weighted.transpose(0, 2, 3, 1).reshape(m, 3 * k, -1), slopes.transpose(0, 1, 2, 3).reshape(m, -1, 3 * k)
    products = (flat[0] @ flat[1]).reshape(m, k, 3, k, 3)  # ∫ ∂_a N_p ∂_b N_q as (p, a, q, b)
    first, second = (constant[:, None, None, None, None] for constant in law.T)
    trace = np.einsum("mpaqa->mpq", products)
    matrix = first * products + second * products.transpose(0, 1, 4, 3, 2)
    for axis in range(3):
        matrix[:, :, axis, :, axis] += second[:, :, :, 0, 0] * trace
    return np.asarray(matrix.reshape(m, 3 * k, 3 * k))


def strain_operator(turn: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return (m, q, 6, 3k): ``sym(turnᵀ ∇v)`` of the k nodes' displacements v, in the order `PAIRS`, shears doubled."""
    product = np.einsum("mqac,mqkd->mqcdka", turn, slopes)
    rows = [product[:, :, c, d] if c == d else product[:, :, c, d] + product[:, :, d, c] for c, d in PAIRS]
    stacked = np.stack(rows, axis=2)
    return stacked.reshape(*stacked.shape[:3], -1)


def inner_motion(shape: Shape, stiffness: FloatArray) -> FloatArray | None:
    """Return the (m, 9, 24) amplitudes of a brick's incompatible modes for unit displacements of its nodes; None without them."""
    if not shape.inner:
        return None
    n = 3 * shape.width
    return np.asarray(-np.linalg.solve(stiffness[:, n:, n:], stiffness[:, n:, :n]))


def condensed(matrix: FloatArray, motion: FloatArray | None) -> FloatArray:
    """Return matrices (m, 33, 33) on the nodes alone (m, 24, 24), with the `inner_motion`; others unchanged."""
    if motion is None:
        return matrix
    n = motion.shape[2]
    side = matrix[:, :n, n:] @ motion
    back = motion.transpose(0, 2, 1) @ matrix[:, n:, :n]
    return np.asarray(matrix[:, :n, :n] + side + back + motion.transpose(0, 2, 1) @ matrix[:, n:, n:] @ motion)


def with_inner_modes(moved: FloatArray, motion: FloatArray | None) -> FloatArray:
    """Return displacements (m, 8, 3) of nodes with the amplitudes of the incompatible modes behind, (m, 11, 3)."""
    if motion is None:
        return moved
    inner = motion @ moved.reshape(len(moved), -1, 1)
    return np.concatenate([moved, inner.reshape(len(moved), N_INNER, 3)], axis=1)


def store_blocks(places: NodeBlocks, store: FloatArray, piece: slice, matrix: FloatArray) -> None:
    """Add matrices (m, 3k, 3k) of cells to the blocks of their node pairs."""
    m, k = len(matrix), matrix.shape[1] // 3
    places.add(store, piece, matrix.reshape(m, k, 3, k, 3).transpose(0, 1, 3, 2, 4).reshape(m, k, k, 9))


def is_plain(group: CellGroup) -> bool:
    """Whether scikit-fem assembles the cells: tetrahedra and hexahedra without incompatible modes or hourglass control."""
    rule, mesh = group.rule, group.mesh
    return mesh.cells.shape[1] in (4, 8, 10, 20) and not rule.inner and rule.hourglass is None
