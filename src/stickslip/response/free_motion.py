"""A damper whose mean position nothing determines.

A contact that slips or opens in every cycle forgets its mean position. When all contacts do, the coordinates of a free damper that no
normal spring holds may drift: the Jacobian is singular, and the static part of the solution along them means nothing.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem

STEPS = 12  # of each iteration: a vector that nothing holds appears in two or three
SINGULAR = 1e-9  # smallest over largest singular value of the balanced Jacobian below which a coordinate counts as undetermined


@dataclass(frozen=True, slots=True)
class Drift:
    """How well the contacts hold the free body at one point.

    Attributes
    ----------
    ratio
        Smallest over largest singular value of the balanced Jacobian, to some per cent.
    coordinate
        Name of the coordinate that is held least.
    """

    ratio: float
    coordinate: str

    @property
    def undetermined(self) -> bool:
        """Whether the coordinate may drift."""
        return self.ratio < SINGULAR


def drift(problem: ForcedProblem, point: ForcedPoint) -> Drift:
    """Find the least held coordinate of the periodic problem at a point.

    Parameters
    ----------
    problem
        System, load and sweep.
    point
        A point of the response, converged or not.
    """
    balance = problem.balance(point.support)
    jac = balance.linearise(balance.unknowns(point.coefficients), point.omega).dense_jac()
    # balance rows and columns first: translations and rotations differ by orders of magnitude
    scale = np.sqrt(np.maximum(np.max(np.abs(jac), axis=0), np.finfo(float).tiny))
    ratio, held_least = _least_held(jac / scale[:, None] / scale[None, :])
    labels = problem.system.retained_labels
    worst = int(np.argmax(np.abs(held_least)))
    return Drift(ratio, labels[worst % len(labels)])


def _least_held(matrix: FloatArray) -> tuple[float, FloatArray]:
    """Return the smallest over the largest singular value, and the vector of the smallest, by iterations on one LU factorisation.

    All singular values of the Jacobian of a mistuned wheel would take longer than its response.
    """
    rng = np.random.default_rng(0)
    matrix = matrix / np.max(np.abs(matrix))
    large: FloatArray = rng.standard_normal(len(matrix))
    largest = inverse = 0.0
    for _ in range(STEPS):
        large, _ = _unit(matrix @ large)
        large, largest = _unit(matrix.T @ large)
    lu, pivots, _ = scipy.linalg.lapack.dgetrf(matrix)
    tiny = np.finfo(float).eps * largest
    diagonal = np.einsum("ii->i", lu)
    # a singular matrix is told by its vector, not by a division by zero
    diagonal[np.abs(diagonal) < tiny] = tiny
    small: FloatArray = rng.standard_normal(len(matrix))
    for _ in range(STEPS):
        small, _ = _unit(scipy.linalg.lu_solve((lu, pivots), small, trans=1))
        small, inverse = _unit(scipy.linalg.lu_solve((lu, pivots), small))
    return 1.0 / (inverse * largest), small


def _unit(vector: FloatArray) -> tuple[FloatArray, float]:
    """Return a vector of unit length and the length, whose square may be beyond all numbers."""
    most = float(np.max(np.abs(vector)))
    scaled = vector / most
    length = float(np.linalg.norm(scaled))
    return scaled / length, length * most
