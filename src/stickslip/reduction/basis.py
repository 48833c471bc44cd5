"""Matrices and dof tables in the coordinates of a reduction."""

from collections.abc import Mapping

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.structure import Dofs, Structure, join_dofs, modal_dofs

BLOCK = 32  # columns solved at a time, so that dense arrays beside the basis need at most a tenth of its memory
ROWS = 8192  # rows of the basis projected at a time, for the same reason
SYMMETRY = 1e-12  # relative asymmetry below which a matrix counts as Hermitian


def in_basis(matrix: Matrix, basis: Matrix) -> Matrix:
    """Return ``basisᴴ matrix basis``, exactly Hermitian if `matrix` is.

    Parameters
    ----------
    matrix
        (n, n), dense or sparse; the skew part of a damping matrix (Coriolis) stays.
    basis
        (n, m), dense or sparse, real or complex.

    Returns
    -------
    numpy.ndarray or scipy.sparse.csr_array
        Sparse if both arguments are.
    """
    if scipy.sparse.issparse(basis):
        product = basis.conj().T @ matrix @ basis
        product = product.tocsr() if scipy.sparse.issparse(product) else np.asarray(product)
    elif scipy.sparse.issparse(matrix) and not matrix.nnz:  # no damping: saves a third of the work
        return np.zeros((basis.shape[1],) * 2, dtype=np.result_type(matrix.dtype, basis.dtype))
    else:
        product = _dense_product(matrix, basis)
    return (product + product.conj().T) / 2 if is_hermitian(matrix) else product


def in_coordinates(structure: Structure, basis: Matrix, dofs: Dofs, sets: Mapping[str, IntArray]) -> Structure:
    """Return a structure in new coordinates: its matrices are projected, and its `basis` is the product of both bases.

    Parameters
    ----------
    structure
        n dofs.
    basis
        (n, m) with ``u = basis @ new``.
    dofs, sets
        Table and sets of the m new coordinates.
    """
    return Structure(
        in_basis(structure.mass, basis),
        in_basis(structure.damping, basis),
        in_basis(structure.stiffness, basis),
        dofs,
        sets,
        structure.expand(basis),
        None if structure.loss is None else in_basis(structure.loss, basis),
    )


def is_hermitian(matrix: Matrix) -> bool:
    """Whether a matrix equals its conjugate transpose to rounding."""
    return even_part(matrix) is not None


def even_part(matrix: Matrix) -> Matrix | None:
    """Return ``(A + Aᴴ) / 2`` if a matrix equals its conjugate transpose to rounding; None otherwise."""
    if not min(matrix.shape):
        return matrix
    difference = matrix - matrix.conj().T
    largest = abs(difference).max()
    if largest > SYMMETRY * abs(matrix).max():
        return None
    return matrix - difference / 2 if largest else matrix


def _dense_product(matrix: Matrix, basis: Matrix) -> Matrix:
    m = basis.shape[1]
    kind = np.result_type(matrix.dtype, basis.dtype)
    if scipy.sparse.issparse(matrix) and not matrix.nnz:
        return np.zeros((m, m), dtype=kind)  # no damping
    product = np.zeros((m, m), dtype=kind)
    matrix = matrix.tocsr() if scipy.sparse.issparse(matrix) else matrix
    for first in range(0, basis.shape[0], ROWS):
        rows = slice(first, first + ROWS)
        product += basis[rows].conj().T @ (matrix[rows] @ basis)
    return product


def dof_indices(place: str, structure: Structure, keep: IntArray) -> IntArray:
    """Return the dofs to keep as an index array.

    Raises
    ------
    InputError
        If `keep` holds anything but whole numbers, or a dof that is not in the structure.
    """
    given = np.asarray(keep)
    if given.size and given.dtype.kind not in "iu":
        what, remedy = _no_indices(structure, given)
        raise input_error(f"{place}: keep", what, remedy)
    keep = given.astype(np.int64).reshape(-1)
    outside = keep[(keep < 0) | (keep >= structure.n)]
    if outside.size:
        raise input_error(
            f"{place}: keep",
            f"dof {outside[0]} is not among the structure's {structure.n} dofs",
            "Take the indices from the structure's sets.",
        )
    return keep


def _no_indices(structure: Structure, given: Matrix) -> tuple[str, str]:
    """Return the fault of an invalid array of indices, and the remedy."""
    if given.dtype.kind == "U":
        name = str(given.reshape(-1)[0])
        if name in structure.sets:
            return f"holds the name {name!r}", f"Give its dofs: structure.dof_set({name!r})."
        known = did_you_mean(name, list(structure.sets)) if structure.sets else "There are no sets."
        return f"holds the name {name!r}, which is no set", f"{known} Give structure.dof_set(name)."
    if given.dtype.kind == "b":
        return "is a mask", "Give indices: np.flatnonzero(mask)."
    return f"holds {given.reshape(-1)[0]!r}, which is no index", "Give whole numbers."


def kept_dofs(place: str, structure: Structure, keep: IntArray) -> IntArray:
    """Return the dofs to keep as an index array, after checking them.

    Raises
    ------
    InputError
        If `keep` holds anything but whole numbers, a dof that is not in the structure, or one twice.
    """
    keep = dof_indices(place, structure, keep)
    values, counts = np.unique(keep, return_counts=True)
    if np.any(counts > 1):
        twice = structure.dofs.labels[values[counts > 1][0]]
        raise input_error(
            f"{place}: keep",
            f"dof {values[counts > 1][0]} ({twice}) is listed more than once",
            "Two of the sets share a node: list it once.",
        )
    return keep


def with_modal_dofs(kept: Dofs, n_modes: int) -> Dofs:
    """Return the kept rows followed by `n_modes` modal rows of the same parts."""
    table = join_dofs({"kept": kept, "modal": modal_dofs(n_modes)})
    return Dofs(table.node, table.component, table.position, kept.part + ("",) * n_modes)


def ones_at(rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> Matrix:
    """Return the CSR matrix with ones at ``(rows, columns)``."""
    return scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=shape)


def surviving_sets(structure: Structure, keep: IntArray, offset: int = 0) -> dict[str, IntArray]:
    """Return the sets whose dofs are all kept, as positions in `keep`, plus `offset`."""
    place = np.full(structure.n, -1)
    place[keep] = offset + np.arange(len(keep))
    moved = {name: place[index] for name, index in structure.sets.items()}
    return {name: index for name, index in moved.items() if np.all(index >= 0)}
