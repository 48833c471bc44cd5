"""Craig-Bampton reduction.

R. R. Craig and M. C. C. Bampton, "Coupling of substructures for dynamic analyses", AIAA Journal
6 (1968) 1313-1319.
"""

import numpy as np
import scipy.sparse

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import SingularError, input_error
from stickslip.model.dofs import Dofs, join_dofs, modal_dofs
from stickslip.model.factorisation import factorise
from stickslip.model.modes import connected_parts, lowest_modes, submatrix
from stickslip.model.structure import Structure

RIGID = 1e-9  # strain energy of a rigid motion over that of single dofs: below, nothing holds it


def craig_bampton(structure: Structure, keep: IntArray, n_modes: int) -> Structure:
    """Reduce to the kept dofs and the lowest modes with those dofs fixed.

    Parameters
    ----------
    structure
        Full model, dense or sparse; held against rigid motion by supports or by `keep`.
    keep
        (k,) indices of the dofs that stay physical: contact, excitation, output.
    n_modes
        Number of fixed-interface modes.

    Returns
    -------
    Structure
        Dense, with coordinates ``(u_keep [m], modal [√kg m])``. Sets whose dofs are all kept
        survive in their order; ``modes`` holds the modal coordinates. `basis` leads back.

    Raises
    ------
    InputError
        If `keep` or `n_modes` does not fit the structure.
    SingularError
        If the stiffness with `keep` fixed is singular: a body is not held.

    Notes
    -----
    ``u = [I 0; Ψ Φ] q`` with constraint modes ``Ψ = −K_ii⁻¹ K_ik`` and mass-normalised
    fixed-interface modes ``Φ``. Exact in statics for loads on `keep`; frequencies converge from
    above. The basis is orthogonal in stiffness: ``K_reduced = diag(K_kk + K_ki Ψ, ω²)``.
    """
    keep = _checked(structure, keep, n_modes)
    inner = np.setdiff1d(np.arange(structure.n), keep)
    constraint, modes, squares = _inner_shapes(structure, keep, inner, n_modes)
    k = len(keep)
    basis = np.zeros((structure.n, k + n_modes))
    basis[keep, np.arange(k)] = 1.0
    basis[np.ix_(inner, np.arange(k))] = constraint
    basis[np.ix_(inner, np.arange(k, k + n_modes))] = modes
    stiffness = np.zeros((k + n_modes, k + n_modes))
    stiffness[:k, :k] = _project(structure.stiffness, basis[:, :k])
    stiffness[k:, k:] = np.diag(squares)
    return Structure(
        _project(structure.mass, basis),
        _project(structure.damping, basis),
        stiffness,
        _reduced_dofs(structure.dofs.take(keep), n_modes),
        _surviving_sets(structure, keep) | {"modes": np.arange(k, k + n_modes)},
        structure.expand(basis) if structure.basis is not None else basis,
    )


def _checked(structure: Structure, keep: IntArray, n_modes: int) -> IntArray:
    """Return `keep` as an index array, after checking it and `n_modes`."""
    keep = np.asarray(keep, dtype=np.int64)
    outside = keep[(keep < 0) | (keep >= structure.n)]
    if outside.size:
        raise input_error(
            "craig_bampton: keep",
            f"dof {outside[0]} is not among the structure's {structure.n} dofs",
            "Take the indices from the structure's sets.",
        )
    values, counts = np.unique(keep, return_counts=True)
    if np.any(counts > 1):
        twice = structure.dofs.labels[values[counts > 1][0]]
        raise input_error(
            "craig_bampton: keep",
            f"dof {values[counts > 1][0]} ({twice}) is listed more than once",
            "Two of the sets share a node: list it once.",
        )
    if not 0 <= n_modes <= structure.n - len(keep):
        raise input_error(
            "craig_bampton: n_modes",
            f"got {n_modes}, and {structure.n - len(keep)} dofs are not kept",
            "Ask for at most that many.",
        )
    return keep


def _inner_shapes(
    structure: Structure, keep: IntArray, inner: IntArray, n_modes: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return constraint modes, fixed-interface modes and their squared circular frequencies.

    Bodies that only `keep` joins are treated one by one: equal blades have equal frequencies, of
    which a Krylov method may miss some.
    """
    K_ii = submatrix(structure.stiffness, inner, inner)
    M_ii = submatrix(structure.mass, inner, inner)
    K_ik = submatrix(structure.stiffness, inner, keep)
    constraint = np.zeros((len(inner), len(keep)))
    shapes, squares = [], []
    for part in connected_parts(K_ii, M_ii) if inner.size else []:
        K, M = submatrix(K_ii, part, part), submatrix(M_ii, part, part)
        _check_held(K, structure.dofs.take(inner[part]))
        solve = factorise(K)
        load = submatrix(K_ik, part, np.arange(len(keep)))
        constraint[part] = -solve(load.toarray() if scipy.sparse.issparse(load) else load)
        count = min(n_modes, len(part))
        if count:
            values, vectors = lowest_modes(K, M, count, solve)
            shape = np.zeros((len(inner), count))
            shape[part] = vectors
            shapes.append(shape)
            squares.append(values)
    if not shapes:
        return constraint, np.zeros((len(inner), 0)), np.zeros(0)
    lowest = np.argsort(np.concatenate(squares), kind="stable")[:n_modes]
    return constraint, np.hstack(shapes)[:, lowest], np.concatenate(squares)[lowest]


def _check_held(stiffness: Matrix, dofs: Dofs) -> None:
    """Refuse a body that can move rigidly without strain."""
    motion = _rigid_motions(dofs)
    energy = motion.T @ (stiffness @ motion)
    scale = float(np.max(np.abs(stiffness.diagonal()), initial=0.0))
    if motion.shape[1] and np.linalg.eigvalsh(energy)[0] > RIGID * scale / len(dofs):
        return
    if not motion.shape[1] and scale > 0:
        return
    raise SingularError(
        f"craig_bampton: the body of dof {dofs.labels[0]} ({len(dofs)} dofs) is not held when the "
        "kept dofs are fixed: its stiffness is singular. Clamp it, or keep dofs that hold it"
    )


def _rigid_motions(dofs: Dofs) -> FloatArray:
    """Return orthonormal columns that span the rigid motions of the translational dofs."""
    axis = np.array(["xyz".find(c) if c in {"x", "y", "z"} else -1 for c in dofs.component])
    moving = np.flatnonzero(axis >= 0)
    if not moving.size:
        return np.zeros((len(dofs), 0))
    arm = dofs.position[moving] - dofs.position[moving].mean(axis=0)
    size = float(np.max(np.abs(arm))) or 1.0
    motion = np.zeros((len(dofs), 6))
    for i in range(3):
        direction = np.eye(3)[axis[moving]]
        motion[moving, i] = direction[:, i]
        rotated = np.cross(np.broadcast_to(np.eye(3)[i], arm.shape), arm / size)
        motion[moving, 3 + i] = np.sum(rotated * direction, axis=1)
    left, values, _ = np.linalg.svd(motion, full_matrices=False)
    return np.asarray(left[:, values > 1e-9 * values[0]])


def _project(matrix: Matrix, basis: FloatArray) -> FloatArray:
    product = basis.T @ (matrix @ basis)
    return np.asarray((product + product.T) / 2)


def _reduced_dofs(kept: Dofs, n_modes: int) -> Dofs:
    """Return the kept rows followed by modal rows, with the parts the kept rows had."""
    table = join_dofs({"kept": kept, "modal": modal_dofs(n_modes)})
    return Dofs(table.node, table.component, table.position, kept.part + ("",) * n_modes)


def _surviving_sets(structure: Structure, keep: IntArray) -> dict[str, IntArray]:
    place = np.full(structure.n, -1)
    place[keep] = np.arange(len(keep))
    moved = {name: place[index] for name, index in structure.sets.items()}
    return {name: index for name, index in moved.items() if np.all(index >= 0)}
