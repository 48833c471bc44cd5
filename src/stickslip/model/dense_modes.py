"""Modes of small models by dense algebra; the mass may be singular."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.structure import Dofs

ROUNDED = 1e-12  # of the terms that an eigenvalue is the sum of: below, it is rounding
NEGATIVE = 1e-9  # of the largest eigenvalue of a mass: negative ones beyond are no rounding


def dense_modes(
    stiffness: Matrix, mass: Matrix, n: int, shift: float = 0.0, dofs: Dofs | None = None
) -> tuple[FloatArray, Matrix]:
    """Return the `n` lowest squares of circular frequencies and mass-normalised modes.

    Motions without mass follow the others statically, ``K₀₀ x₀ + K₀₁ x₁ = 0``, and are no modes; neither are motions without mass and
    stiffness. Such mass matrices come from bricks with reduced integration (C3D20R) and from static reduction.

    Parameters
    ----------
    stiffness, mass
        (size, size), dense, real symmetric or complex Hermitian.
    n
        Number of modes, at most the rank of the mass.
    shift
        Shift in rad²/s², at most the lowest square.
    dofs
        Dofs of the coordinates, for messages.

    Returns
    -------
    tuple[FloatArray, Matrix]
        (n,) squares in rad²/s², ascending, and (size, n) modes.

    Raises
    ------
    InputError
        If fewer than `n` motions have mass, if a mass is negative, or if coordinates are multipliers of constraints.
    """
    if _definite(mass):
        return _of_full_rank(stiffness, mass, n, shift)
    squares, with_mass, without = _by_mass(mass, dofs)
    if n > squares.size:
        raise input_error(
            "mass",
            f"is singular: {squares.size} of {len(mass)} motions have mass, and {n} modes are asked",
            f"Ask for at most {squares.size} modes.",
        )
    follow = _following(stiffness, with_mass, without, dofs)
    basis = with_mass + without @ follow
    condensed = with_mass.conj().T @ stiffness @ basis
    values, vectors = _of_full_rank((condensed + condensed.conj().T) / 2, np.diag(squares), n, shift)
    return values, np.asarray(basis @ vectors)


def mass_rank(mass: Matrix) -> int:
    """Return the rank of a (size, size) mass matrix, dense or sparse."""
    dense = mass.toarray() if scipy.sparse.issparse(mass) else mass
    return len(dense) if _definite(dense) else _by_mass(dense, None)[0].size


def _definite(mass: Matrix) -> bool:
    """Whether no motion is without mass, beyond rounding."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(mass)).real ** 2
    except np.linalg.LinAlgError:
        return False
    return bool((pivots > ROUNDED * np.diagonal(mass).real).all())


def _by_mass(mass: Matrix, dofs: Dofs | None) -> tuple[FloatArray, Matrix, Matrix]:
    """Return the (r,) masses of motions (size, r) that have one, and the motions (size, size - r) that have none."""
    diagonal = np.diagonal(mass).real
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = scale[:, None] * mass * scale
    sizes = np.abs(scaled).max(axis=0)
    if not np.all(np.isfinite(sizes)):  # beside a positive diagonal no number of a positive matrix is so large
        raise _not_positive(np.where(np.isfinite(sizes), 0.0, 1.0), dofs)
    squares, shapes = np.linalg.eigh(scaled)
    if squares[0] < -NEGATIVE * squares[-1]:
        raise _not_positive(shapes[:, 0], dofs)
    heavy = squares > ROUNDED * squares[-1]
    moved = scale[:, None] * shapes
    return squares[heavy], moved[:, heavy], moved[:, ~heavy]


def _not_positive(motion: Matrix, dofs: Dofs | None) -> InputError:
    """Return the error of a mass in which a motion (size,) has a negative one."""
    return input_error(
        "mass",
        f"is not positive: a motion, {_most(motion, dofs)} the most, has a negative one",
        "Check its source: a triangle of a matrix given as the whole, or the stiffness in its place.",
    )


def _following(stiffness: Matrix, with_mass: Matrix, without: Matrix, dofs: Dofs | None) -> Matrix:
    """Return how motions without mass follow those with one statically; those without stiffness, too, stay where they are.

    Refuse multipliers of constraints, which have no stiffness of their own and hold others.
    """
    inner = without.conj().T @ stiffness @ without
    terms = np.sum(abs(without) * (abs(stiffness) @ abs(without)), axis=0)
    scale = 1 / np.sqrt(np.where(terms > 0, terms, 1.0))
    values, shapes = np.linalg.eigh(scale[:, None] * inner * scale)
    scaled = scale[:, None] * shapes
    idle = np.abs(values) < ROUNDED
    held = np.abs(stiffness @ without @ scaled[:, idle])
    if (held > ROUNDED * np.abs(stiffness).max() * np.abs(without @ scaled).max()).any():
        first = without @ scaled[:, idle][:, int(np.argmax(held.max(axis=0)))]
        raise input_error(
            "mass",
            f"is singular: {idle.sum()} coordinates without mass are multipliers of constraints, {_most(first, dofs)} one of them",
            "Eliminate the constraints: write matrices of independent coordinates.",
        )
    resisting = scaled[:, ~idle]
    pull = resisting.conj().T @ without.conj().T @ stiffness @ with_mass
    return np.asarray(-resisting @ (pull / values[~idle, None]))


def _most(motion: Matrix, dofs: Dofs | None) -> str:
    """Return the name of the coordinate that moves the most."""
    at = int(np.argmax(np.abs(motion)))
    return f"coordinate {at}" if dofs is None else dofs.labels[at]


def _of_full_rank(K: Matrix, M: Matrix, n: int, shift: float) -> tuple[FloatArray, Matrix]:
    """Solve the reciprocal problem for few modes: of a fine mesh the direct one has the lowest to six digits only."""
    few = 2 * n <= len(K)
    try:
        return (_reciprocal if few else _direct)(K, M, n, shift)
    except np.linalg.LinAlgError:  # a mode diverges
        return (_direct if few else _reciprocal)(K, M, n, shift)


def _direct(K: Matrix, M: Matrix, n: int, _: float) -> tuple[FloatArray, Matrix]:
    values, vectors = scipy.linalg.eigh(K, M, subset_by_index=(0, n - 1))
    return np.asarray(values), np.asarray(vectors)


def _reciprocal(K: Matrix, M: Matrix, n: int, shift: float) -> tuple[FloatArray, Matrix]:
    size = len(K)
    largest = (size - n, size - 1)
    inverse, vectors = scipy.linalg.eigh(M, K - shift * M, subset_by_index=largest)
    if inverse[0] <= 0:
        raise np.linalg.LinAlgError("dofs have no mass, or a negative one")
    values = shift + 1.0 / inverse[::-1]
    return np.asarray(values), np.asarray((vectors / np.sqrt(inverse))[:, ::-1])
