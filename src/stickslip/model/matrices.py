"""Lumped structures: matrices given directly, and the chain of masses and springs."""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure

SYMMETRY = 1e-10  # relative


def lumped(
    mass: FloatArray, stiffness: FloatArray, damping: FloatArray | None = None, names: Sequence[str] | None = None
) -> Structure:
    """Return a structure of n coordinates from its matrices.

    Parameters
    ----------
    mass
        (n, n) positive definite, or (n,) for a diagonal matrix, in kg.
    stiffness
        (n, n) symmetric, in N/m.
    damping
        (n, n) symmetric, in N s/m; None for no damping.
    names
        n different names; each becomes a set of one dof (``structure.sets[name]``). Labels of dofs stay ``node0.x``, ``node1.x``, ...

    Returns
    -------
    Structure
        Dense; coordinate i is dof ``x`` of node i.

    Raises
    ------
    InputError
        If a matrix is not finite, square or symmetric, or the mass is not positive definite.
    """
    M = _symmetric("mass", np.diag(mass) if np.ndim(mass) == 1 else mass)
    n = len(M)
    K = _symmetric("stiffness", stiffness, n)
    C = np.zeros((n, n)) if damping is None else _symmetric("damping", damping, n)
    lowest = np.linalg.eigvalsh(M)[0] if n else 0.0
    if lowest <= 0:
        raise input_error(
            "lumped: mass",
            f"must be positive definite, its lowest eigenvalue is {lowest:.6g}",
            "Give every coordinate a mass.",
        )
    if names is not None and (len(names) != n or len(set(names)) != n):
        raise input_error("lumped: names", f"need {n} different names, got {list(names)}", "Name each coordinate.")
    sets: dict[str, IntArray] = {name: np.array([i]) for i, name in enumerate(names or ())}
    return Structure(M, C, K, Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3))), sets)


def lumped_sector(
    mass: Sequence[float], stiffness: FloatArray, damping: FloatArray, names: Sequence[str], behind: Sequence[str]
) -> Structure:
    """Return one sector of a wheel of masses; after its own masses come massless copies of masses of the next sector.

    Parameters
    ----------
    mass
        (n,) masses of the sector, kg.
    stiffness, damping
        (n + m, n + m) matrices of springs and dashpots, including those to the copies, N/m and N s/m.
    names
        Names of the n masses; each becomes a set.
    behind
        Names of the m masses with a copy: the set ``cyclic_low`` contains these masses, ``cyclic_high`` their copies.
    """
    own = lumped(np.array(mass), np.zeros((len(mass), len(mass))), names=names)
    n, copies = own.n, len(behind)
    low = np.array([own.sets[name][0] for name in behind], dtype=np.int64)
    M = np.diag([*mass, *[0.0] * copies])
    sets = {**own.sets, "cyclic_low": low, "cyclic_high": np.arange(n, n + copies)}
    dofs = Dofs(np.arange(n + copies), ("x",) * (n + copies), np.zeros((n + copies, 3)))
    return Structure(M, damping, stiffness, dofs, sets)


def chain(n: int, mass: float, stiffness: float, damping_factor: float = 0.0) -> Structure:
    """Return a chain of `n` masses, the first one grounded by a spring, the last one free.

    Parameters
    ----------
    n
        Number of masses.
    mass
        Each mass in kg.
    stiffness
        Each of the n springs in N/m.
    damping_factor
        β of ``C = β K`` in s.
    """
    if n < 1 or not stiffness > 0:
        raise input_error("chain", f"needs masses and a positive stiffness, got {n} and {stiffness}", "Check.")
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    K *= stiffness
    return lumped(np.full(n, float(mass)), K, damping_factor * K)


def _symmetric(name: str, matrix: FloatArray, n: int | None = None) -> FloatArray:
    """Return the matrix as floats after checking shape, finiteness and symmetry."""
    if np.iscomplexobj(matrix):
        raise input_error(
            f"lumped: {name}",
            "is complex",
            "Give the real part, and structural damping by structural_damping or as Structure.loss.",
        )
    matrix = np.asarray(matrix, dtype=float)
    expected = len(matrix) if n is None and matrix.ndim else n
    if matrix.shape != (expected, expected):
        raise input_error(
            f"lumped: {name}",
            f"must be square of size {expected}, got shape {matrix.shape}",
            "All matrices belong to the same coordinates.",
        )
    if not np.all(np.isfinite(matrix)):
        raise input_error(f"lumped: {name}", "holds NaN or infinite numbers", "Check its source.")
    if np.abs(matrix - matrix.T).max(initial=0.0) > SYMMETRY * np.abs(matrix).max(initial=0.0):
        row, column = divmod(int(np.abs(matrix - matrix.T).argmax()), len(matrix))
        raise input_error(
            f"lumped: {name}",
            f"is not symmetric: entry ({row}, {column}) is {matrix[row, column]:.6g}, its mirror "
            f"{matrix[column, row]:.6g}",
            "Give the full matrix, not one triangle.",
        )
    return matrix
