"""Matrices that no passive structure has: refusals and warnings."""

import numpy as np
import scipy

from stickslip.arrays import Matrix
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import DENSE
from stickslip.model.modes import refuse_bad_mass
from stickslip.model.readers.units import ARGUMENTS
from stickslip.model.structure import Structure

ROUNDED = 1e-3  # of the largest eigenvalue: files of few digits make small ones negative


def refuse_indefinite(structure: Structure, place: str) -> None:
    """Refuse a mass that is not positive, and a stiffness by which a motion drives itself.

    Raises
    ------
    InputError
        Naming the matrix and the dof.
    """
    if structure.n and abs(structure.mass).max() > 0:
        refuse_bad_mass(structure, place)
    worst = _most_negative(structure.stiffness)
    if worst is not None:
        raise input_error(
            f"{place}: stiffness",
            f"is not positive: a motion, {structure.dofs.labels[worst[0]]} the most, has {worst[1]:.6g} N/m",
            "Check its source: a sign, or a triangle of a matrix given as the whole; or give $plausible where it is meant.",
            **ARGUMENTS,
        )


def negative_damping(structure: Structure, name: str) -> tuple[str, ...]:
    """Return a warning where the damping in file `name` feeds a motion."""
    worst = _most_negative((structure.damping + structure.damping.conj().T) / 2)
    if worst is None:
        return ()
    dof, value = structure.dofs.labels[worst[0]], worst[1]
    text = (
        f"{name}: the damping is negative, {value:.4g} N s/m in a motion of {dof} the most: it feeds vibration instead of "
        "taking from it. Periodic solutions may be unstable; check the sign."
    )
    return (text,)


def _most_negative(matrix: Matrix) -> tuple[int, float] | None:
    """Return the dof that moves the most where a Hermitian matrix is negative, and how much it is; of large ones by the diagonal."""
    if not matrix.shape[0]:
        return None
    diagonal = matrix.diagonal().real
    if matrix.shape[0] > DENSE:
        dof = int(np.argmin(diagonal))
        negative = diagonal[dof] < -ROUNDED * np.abs(diagonal).max()
        return (dof, float(diagonal[dof])) if negative else None
    values, shapes = np.linalg.eigh(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix)
    if values[0] >= -ROUNDED * max(abs(values[-1]), abs(values[0])) or values[0] == 0:
        return None
    return int(np.argmax(np.abs(shapes[:, 0]))), float(values[0])
