"""Deflated Newton method: known solutions are divided out of the residual (Farrell, Birkisson & Funke 2015)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.blas_threads import by_one_thread
from stickslip.operators import array_of
from stickslip.solve.iterate import Evaluation
from stickslip.solve.newton_method import Newton, Solution, charged, newton

SOLUTION_DISTANCE = 1e-4  # distance, relative to the vibration, up to which two solutions are the same


@dataclass(frozen=True, eq=False)
class _Deflated:
    """Evaluation with the residual multiplied by ``Π (1/‖x - x_i‖² + 1)``."""

    residual: FloatArray
    jac: FloatArray
    seconds_contact: float


@dataclass(frozen=True, eq=False)
class Distance:
    """Distance of two states over the size of the vibration: distinct motions are about 1 apart.

    Parameters
    ----------
    weights
        (size,) weight of each unknown; zero for static ones.
    size
        Size of the compared vibrations.
    """

    weights: FloatArray
    size: float

    def between(self, a: FloatArray, b: FloatArray) -> float:
        """Return the distance."""
        return float(np.linalg.norm(self.weights * (a - b))) / self.size

    def same(self, a: FloatArray, b: FloatArray) -> bool:
        """Whether two solutions are the same motion."""
        near = min(float(np.linalg.norm(self.weights * v)) / self.size for v in (a, b))
        return self.between(a, b) <= SOLUTION_DISTANCE * min(1.0, max(near, SOLUTION_DISTANCE))


def distance_among(weights: FloatArray, known: Sequence[FloatArray]) -> Distance:
    """Return the distance for states near the `known` ones, in units of the smallest of them."""
    sizes = [float(np.linalg.norm(weights * x)) for x in known]
    return Distance(weights, min((s for s in sizes if s > 0.0), default=1.0))


@by_one_thread
def deflated_newton(
    evaluate: Callable[[FloatArray], Evaluation],
    start: FloatArray,
    known: Sequence[FloatArray],
    distance: Distance,
    options: Newton,
) -> Solution:
    """Solve ``residual(x) = 0`` for a solution other than the known ones.

    The residual r becomes ``m r`` with ``m = Π (1/d_i² + 1)`` and the distances d_i from the known solutions. It has no
    zero at a known solution and equals r far away. Its Jacobian is ``m J + r ∇mᵀ``. The solution is then solved once
    more without m.

    Parameters
    ----------
    evaluate
        Residual and Jacobian.
    start
        (size,) initial unknowns, different from all known solutions.
    known
        Known solutions (size,), which are excluded.
    distance
        Distance between states.
    options
        Tolerance and iterations.

    Returns
    -------
    Solution
        Converged only if it solves the equations and differs from the known solutions.
    """
    weights = distance.weights / distance.size

    def deflated(x: FloatArray) -> _Deflated:
        at = evaluate(x)
        factor, slope = 1.0, np.zeros(x.size)
        for other in known:
            apart = weights * (x - other)
            square = float(apart @ apart)
            if square == 0.0:
                return _Deflated(np.full(x.size, np.nan), np.eye(x.size), at.seconds_contact)
            own = 1.0 / square + 1.0
            slope -= 2.0 * weights * apart / (square**2 * own)
            factor *= own
        own_jac = array_of(at.jac)
        if own_jac is None:
            raise input_error(
                "deflated_newton",
                "takes a Jacobian that can be an array",
                "Search a smaller model, or with fewer harmonics.",
            )
        jac = factor * (own_jac + np.outer(at.residual, slope))
        return _Deflated(factor * at.residual, jac, at.seconds_contact)

    found = newton(deflated, start, options)
    if not found.status.converged:
        return found
    return charged_with(newton(evaluate, found.x, options), found)


def charged_with(last: Solution, before: Solution) -> Solution:
    """Return a solution whose cost includes that of the previous solve."""
    return charged(last, [before, last])
