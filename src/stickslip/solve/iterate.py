"""Iterates of the correctors: cost of evaluations, and steps to the next iterate."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.operators import Jacobian
from stickslip.solve.linear import LinearSolver, solve_with, whole_array
from stickslip.solve.status import Status

ROUNDED_COLUMN = 1e-15  # norm of a column, relative to the largest, below which it is rounding
EPS = float(np.finfo(float).eps)
PROBED_ULPS = 4.0  # change of the last digits, in units of the last one
PROBES = 6  # number of such changes
ROUNDING = 2.0  # times the largest resulting change: residuals below are rounding
FAR = 1e3  # times that change: larger residuals are probed again only after a reduction to a tenth
MAX_ROUNDING_RESIDUAL = 1e-4  # largest residual that may count as rounding


class Evaluation(Protocol):
    """Residual and Jacobian at one state, as a corrector needs them."""

    @property
    def residual(self) -> FloatArray: ...  # noqa: D102

    @property
    def jac(self) -> Jacobian: ...  # noqa: D102

    @property
    def seconds_contact(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class Iterate:
    """A state and its evaluation; `norm` is the largest absolute entry of the residual."""

    x: FloatArray
    at: Evaluation
    norm: float


@dataclass(eq=False)
class Work:
    """Evaluations and linear solves of one correction, with their cost.

    Parameters
    ----------
    evaluate
        Residual and Jacobian at a point.
    linear
        Solver of the linear systems.
    """

    evaluate: Callable[[FloatArray], Evaluation]
    linear: LinearSolver
    seconds_contact: float = 0.0
    seconds_linear: float = 0.0
    rejected: int = 0  # evaluated trials that were not accepted
    noise: float = 0.0  # largest change of the residual by a change of the last digits
    probed: float = np.inf  # residual at the last such change

    def at(self, x: FloatArray) -> Iterate:
        """Evaluate at `x`."""
        at = self.evaluate(x)
        self.seconds_contact += at.seconds_contact
        return Iterate(x, at, float(np.abs(at.residual).max()))

    def rounded(self, now: Iterate) -> bool:
        """Whether a residual is at the level of rounding of the unknowns.

        The last digits of the unknowns are changed at random, and the residual changes by the stiffness of a contact
        times the rounding error of a gap. No step can make the residual smaller than that.
        """
        if not now.norm <= MAX_ROUNDING_RESIDUAL:
            return False
        if now.norm > max(0.1 * self.probed, FAR * self.noise):  # probed recently, and far from rounding
            return False
        self.probed = now.norm
        digits = np.random.default_rng(0)
        for _ in range(PROBES):
            if now.norm <= ROUNDING * self.noise:
                break
            beside = now.x * (1.0 + EPS * digits.uniform(-PROBED_ULPS, PROBED_ULPS, now.x.size))
            change = float(np.max(np.abs(self.at(beside).at.residual - now.at.residual)))
            self.noise = max(self.noise, change)
        return now.norm <= ROUNDING * self.noise

    def newton_step(self, now: Iterate) -> FloatArray | None:
        """Return the full Newton step; None if the Jacobian is singular. The Jacobian of `now` may be overwritten."""
        return self.timed(lambda: solve_with(self.linear, now.at.jac, -now.at.residual))

    def timed(self, solve: Callable[[], FloatArray | None]) -> FloatArray | None:
        """Solve a linear problem and add its time; None also if the solution is not finite."""
        start = perf_counter()
        step = solve()
        self.seconds_linear += perf_counter() - start
        # a finite square implies finite entries; an overflowing square does not exclude them
        finite = step is not None and (math.isfinite(step.dot(step)) or np.isfinite(step).all())
        return step if finite else None


class Globalisation(Protocol):
    """Choice of direction and length of steps.

    An instance is for one correction and keeps its state between iterates.
    """

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        ...


def column_scale(jac: Jacobian, before: FloatArray | None) -> FloatArray:
    """Return the scale (n,) that makes lengths of steps independent of units (Moré 1978).

    It is the largest norm of each column so far. The scale is one for a large Jacobian known by its products only, and
    for columns that are zero or rounding, whose unknowns are undetermined: a step scaled by rounding could have any
    length.
    """
    norms = np.sqrt(_column_squares(jac))
    if before is not None:
        return np.maximum(before, norms)
    norms[norms <= ROUNDED_COLUMN * norms.max(initial=0.0)] = 1.0
    return norms


def _column_squares(jac: Jacobian) -> FloatArray:
    array = whole_array(jac)
    return np.ones(jac.shape[1]) if array is None else np.einsum("ij,ij->j", array, array)


def squared_ratio(residual: FloatArray, size: float) -> float:
    """Return ``|residual|² / size²``; infinite on overflow."""
    ratio = float(np.linalg.norm(residual)) / size
    return ratio * ratio
