"""Matrices of a structure as arrays, and checks of the properties that the condensation needs."""

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.structure import Structure

PROPORTIONAL = 1e-13  # largest deviation from Rayleigh damping, as a share of the largest damping in the row
ROWS = 64  # compared at a time, to avoid copies of large matrices
SYMMETRY = 1e-8  # largest difference of transposed entries, as a share of the largest entry


def asymmetry(matrix: Matrix) -> float:
    """Return the largest difference of a matrix from its transpose, over its largest entry."""
    if not matrix.shape[0]:
        return 0.0
    size = float(abs(matrix).max())
    return float(abs(matrix - matrix.T).max()) / size if size else 0.0


def is_diagonal(matrix: FloatArray | ComplexArray, tolerance: float) -> bool:
    """Whether no entry off the diagonal is larger than `tolerance` times the largest entry of all."""
    size = np.max(np.abs(matrix), initial=0.0)
    off = np.max(np.abs(matrix - np.diag(np.diagonal(matrix))), initial=0.0)
    return bool(off <= tolerance * size)


def is_real_symmetric(structure: Structure) -> bool:
    """Whether all matrices except the damping are real and symmetric, so that undamped modes decouple the interior."""
    matrices = (structure.mass, structure.stiffness, structure.loss)
    return not structure.is_complex and all(asymmetry(m) <= SYMMETRY for m in matrices if m is not None)


def checked_matrix(structure: Structure, name: str) -> FloatArray | ComplexArray:
    """Return a matrix of a structure as an array, after checking its size and that it is finite."""
    matrix = getattr(structure, name)
    dense: FloatArray | ComplexArray = as_array(matrix)
    if not np.all(np.isfinite(dense)):
        raise input_error(f"Structure.{name}", "contains NaN or infinite entries", "Check the model that was read.")
    if asymmetry(dense) > SYMMETRY and not (np.any(np.triu(dense, 1)) and np.any(np.tril(dense, -1))):
        raise input_error(f"Structure.{name}", "holds one triangle alone", "Give both triangles.")
    return dense


def real_symmetric(structure: Structure, name: str) -> FloatArray:
    """Return a matrix of a structure as an array, after checking that it is real and, except for the damping, symmetric."""
    dense = checked_matrix(structure, name)
    if np.iscomplexobj(dense):
        raise input_error(
            f"Structure.{name}",
            "is complex",
            "Give structural damping as Structure.loss (structural_damping); a System takes other complex matrices.",
        )
    if name != "damping" and asymmetry(dense) > SYMMETRY:
        raise input_error(
            f"Structure.{name}",
            "is not symmetric",
            "Coriolis terms belong into the damping; a System takes other unsymmetric matrices.",
        )
    return np.asarray(dense, dtype=float)


def shares_of_two(k: FloatArray, c: FloatArray, m: FloatArray) -> tuple[float, float] | None:
    """Return the Rayleigh coefficients a and b of ``c = a k + b m``, exact to rounding; None if they do not exist."""
    own = np.stack([np.diagonal(k), np.diagonal(m)], axis=1)
    size = np.linalg.norm(own, axis=0)
    if not np.all(size > 0.0):
        return None
    a, b = np.linalg.lstsq(own / size, np.diagonal(c), rcond=None)[0] / size
    return (float(a), float(b)) if are_shares(float(a), float(b), (k, c, m)) else None


def are_shares(
    a: float, b: float, blocks: tuple[FloatArray, FloatArray, FloatArray], rounding: float = PROPORTIONAL
) -> bool:
    """Whether the damping is ``a`` times the stiffness plus ``b`` times the mass.

    In each row, the largest error is compared with `rounding` times the largest entry.
    """
    k, c, m = blocks
    for first in range(0, len(c), ROWS):
        stiff, damped, inert = (matrix[first : first + ROWS] for matrix in (k, c, m))
        off = np.max(np.abs(a * stiff + b * inert - damped), axis=1, initial=0.0)
        if np.any(off > rounding * np.max(np.abs(damped), axis=1, initial=0.0)):
            return False
    return True
