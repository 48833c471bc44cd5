"""Natural frequencies and modes of dense and sparse structures."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.csgraph
import scipy.sparse.linalg

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import SingularError, input_error
from stickslip.model.structure import Structure

DENSE = 400  # below this many dofs a dense eigensolver is faster than shift-invert

Solve = Callable[[FloatArray], FloatArray]


def natural_frequencies(structure: Structure, n: int) -> FloatArray:
    """Return the `n` lowest undamped natural frequencies in Hz; rigid-body modes count as zeros."""
    if not 0 < n <= structure.n:
        raise input_error(
            "natural_frequencies",
            f"{n} asked of a structure with {structure.n} dofs",
            "Ask for at least one and at most as many.",
        )
    # the shift keeps the factorised matrix regular where a body is free to move
    scale = abs(structure.stiffness.diagonal()).sum() / structure.mass.diagonal().sum()
    squares = []
    for part in connected_parts(structure.stiffness, structure.mass):
        K, M = submatrix(structure.stiffness, part, part), submatrix(structure.mass, part, part)
        squares.append(_lowest_squares(K, M, min(n, len(part)), 1e-8 * scale))
    lowest = np.sort(np.concatenate(squares))[:n]
    return np.asarray(np.sqrt(np.maximum(lowest, 0.0)) / (2 * np.pi))


def with_springs(structure: Structure, operator: Matrix, stiffness: FloatArray) -> Structure:
    """Return the structure with springs added: ``K + operatorᵀ diag(stiffness) operator``.

    Parameters
    ----------
    structure
        Dense or sparse.
    operator
        (m, n) from coordinates to the springs' elongations.
    stiffness
        (m,) in N/m.
    """
    sparse = scipy.sparse.csr_array(operator)
    added = sparse.T @ scipy.sparse.diags_array(np.asarray(stiffness, dtype=float)) @ sparse
    if scipy.sparse.issparse(structure.stiffness):
        return replace(structure, stiffness=(structure.stiffness + added).tocsr())
    return replace(structure, stiffness=structure.stiffness + added.toarray())


def connected_parts(*matrices: Matrix) -> list[IntArray]:
    """Return the index sets that the matrices do not couple to each other.

    Equal bodies have equal frequencies, of which a Krylov method may miss some; one by one it
    does not.
    """
    graph = sum(abs(scipy.sparse.csr_array(m)) for m in matrices)
    count, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    if count > DENSE:  # a crowd of single masses: dense algebra handles repeated values
        return [np.arange(len(label))]
    return [np.flatnonzero(label == i) for i in range(count)]


def submatrix(matrix: Matrix, rows: IntArray, columns: IntArray) -> Matrix:
    """Return ``matrix[rows][:, columns]`` of a dense or CSR matrix."""
    if scipy.sparse.issparse(matrix):
        return matrix[rows][:, columns]
    return matrix[np.ix_(rows, columns)]


def factorise(matrix: Matrix) -> Solve:
    """Factorise a symmetric matrix; return the map from right-hand sides to solutions.

    Raises
    ------
    SingularError
        If a pivot vanishes.
    """
    if len(matrix.shape) == 2 and matrix.shape[0] <= DENSE:
        dense = matrix.toarray() if scipy.sparse.issparse(matrix) else matrix
        inverse = scipy.linalg.lu_factor(dense, check_finite=True)
        if not np.all(np.diag(inverse[0])):
            raise SingularError("factorise: the matrix is singular")
        return lambda b: np.asarray(scipy.linalg.lu_solve(inverse, b))
    try:
        lu = scipy.sparse.linalg.splu(
            scipy.sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.01,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SingularError(f"factorise: {error}") from error
    return lambda b: np.asarray(lu.solve(np.asarray(b, dtype=float)))


def lowest_modes(
    stiffness: Matrix, mass: Matrix, n: int, solve: Solve, shift: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the `n` lowest squares of circular frequencies and mass-normalised modes.

    Parameters
    ----------
    stiffness, mass
        Symmetric (size, size).
    n
        At most size.
    solve
        Solves with ``stiffness − shift · mass`` (`factorise`).
    shift
        In rad²/s², at most the lowest square.
    """
    size = stiffness.shape[0]
    if size <= DENSE or n > size // 3:
        K, M = (m.toarray() if scipy.sparse.issparse(m) else m for m in (stiffness, mass))
        values, vectors = scipy.linalg.eigh(K, M, subset_by_index=(0, n - 1))
        return np.asarray(values), np.asarray(vectors)
    inverse = scipy.sparse.linalg.LinearOperator((size, size), matvec=solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)  # the same in every run
    values, vectors = scipy.sparse.linalg.eigsh(
        stiffness, n, M=mass, sigma=shift, OPinv=inverse, v0=start
    )
    order = np.argsort(values)
    return values[order], vectors[:, order]


def _lowest_squares(stiffness: Matrix, mass: Matrix, n: int, shift: float) -> FloatArray:
    if stiffness.shape[0] <= DENSE:
        return lowest_modes(stiffness, mass, n, lambda b: b)[0]
    solve = factorise(stiffness + shift * mass)
    return lowest_modes(stiffness, mass, n, solve, -shift)[0]
