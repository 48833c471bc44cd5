"""Detection of free dampers with an undetermined mean position.

A contact that slips or opens in every cycle forgets its mean position. If all contacts of a free damper do, its
coordinates without a normal spring may drift: the Jacobian is singular, and the static part of the solution along them
is meaningless.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import FloatArray
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.operators import Jacobian
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.solve.krylov import Krylov

Held = tuple[float, FloatArray]  # smallest over largest singular value, and vector of the smallest
Product = Callable[[FloatArray], FloatArray]

STEPS = 12  # of each iteration; an undetermined vector appears in two or three
SETTLED = 0.01  # relative change of a singular value that ends an iteration
MANY = 2000  # unknowns above which matrix-vector products are cheaper than LU factors
SINGULAR = 1e-9  # smallest over largest singular value of the balanced Jacobian of an undetermined coordinate


@dataclass(frozen=True, slots=True)
class Drift:
    """Determinacy of the mean position of a free body at one point.

    Attributes
    ----------
    ratio
        Smallest over largest singular value of the balanced Jacobian, to a few per cent.
    coordinate
        Name of the least determined coordinate.
    """

    ratio: float
    coordinate: str

    @property
    def undetermined(self) -> bool:
        """Whether the coordinate may drift."""
        return self.ratio < SINGULAR


def drift(problem: ForcedProblem, point: ForcedPoint) -> Drift:
    """Find the least determined coordinate of the periodic problem at a point.

    Parameters
    ----------
    problem
        System, load and sweep.
    point
        Point of the response, converged or not.
    """
    balance = problem.balance(point.support)
    at = balance.linearise(balance.unknowns(point.coefficients), point.omega)
    jac = at.jac
    found = None
    if isinstance(jac, StructuredJacobian) and jac.shape[0] >= MANY:
        found = by_products(jac)
    ratio, held_least = as_array(at.dense_jac()) if found is None else found
    labels = problem.system.retained_labels
    worst = int(np.argmax(np.abs(held_least)))
    return Drift(ratio, labels[worst % len(labels)])


def as_array(jac: FloatArray) -> Held:
    """Return the ratio of smallest to largest singular value, and the vector of the smallest.

    Iterations use one LU factorisation.

    Rows and columns are balanced first: translations and rotations differ by orders of magnitude.
    """
    scale = np.sqrt(np.maximum(np.max(np.abs(jac), axis=0), np.finfo(float).tiny))
    matrix = jac / scale[:, None] / scale[None, :]
    matrix /= np.max(np.abs(matrix))
    rng = np.random.default_rng(0)
    first, second = rng.standard_normal((2, len(matrix)))
    largest, _ = _largest(matrix.__matmul__, matrix.T.__matmul__, first)
    lu, pivots, _ = scipy.linalg.lapack.dgetrf(matrix)
    tiny = np.finfo(float).eps * largest
    diagonal = np.einsum("ii->i", lu)
    # avoid a division by zero for a singular matrix, whose vector is wanted
    diagonal[np.abs(diagonal) < tiny] = tiny
    solve = partial(scipy.linalg.lu_solve, (lu, pivots))
    inverse, small = _largest(partial(solve, trans=1), solve, second)
    return 1.0 / (inverse * largest), small


def by_products(jac: StructuredJacobian) -> Held | None:
    """Return the same ratio and vector by matrix-vector products, for thousands of contacts.

    The result is None if an iteration does not converge.

    Each coordinate is balanced in each harmonic by its coupling within this harmonic.
    """
    most = [abs(block).max(axis=0) for _, block in jac.own_blocks()]
    own = np.array([a.toarray().ravel() if scipy.sparse.issparse(a) else a for a in most])
    scale = np.sqrt(np.maximum(np.repeat(own, 2, axis=0)[1:], np.finfo(float).tiny)).ravel()
    krylov = Krylov()

    def solve(matrix: Jacobian, right: FloatArray) -> FloatArray:
        found = krylov.solve(matrix, scale * right)
        if found is None:
            raise np.linalg.LinAlgError
        return np.asarray(scale * found)

    rng = np.random.default_rng(0)
    first, second = rng.standard_normal((2, scale.size))
    largest, _ = _largest(lambda v: jac.matvec(v / scale) / scale, lambda v: jac.rmatvec(v / scale) / scale, first)
    try:
        inverse, small = _largest(partial(solve, jac.transposed), partial(solve, jac), second)
    except np.linalg.LinAlgError:
        return None
    return 1.0 / (inverse * largest), small


def _largest(first: Product, second: Product, vector: FloatArray) -> Held:
    """Return the largest singular value of an operator, given by `first` and then `second`, and its vector."""
    value = 0.0
    for _ in range(STEPS):
        before = value
        vector, _ = _unit(first(vector))
        vector, value = _unit(second(vector))
        if abs(value - before) <= SETTLED * value:
            break
    return value, vector


def _unit(vector: FloatArray) -> tuple[FloatArray, float]:
    """Return a vector of unit length and the original length, whose square may overflow."""
    most = float(np.max(np.abs(vector)))
    scaled = vector / most
    length = float(np.linalg.norm(scaled))
    return scaled / length, length * most
