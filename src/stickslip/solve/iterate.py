"""What the correctors share: an iterate, the work they do, and how a step is taken from one iterate to the next."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter
from typing import Protocol

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.linear import Bordered, Jacobian, LinearSolver, solve_with
from stickslip.solve.status import Status


class Evaluation(Protocol):
    """What a corrector needs of one evaluation."""

    @property
    def residual(self) -> FloatArray: ...  # noqa: D102

    @property
    def jac(self) -> Jacobian: ...  # noqa: D102

    @property
    def seconds_contact(self) -> float: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class Iterate:
    """A state and what was evaluated there; `norm` is the largest absolute entry of the residual."""

    x: FloatArray
    at: Evaluation
    norm: float


@dataclass(eq=False)
class Work:
    """Evaluations and linear solves of one correction, and what they cost.

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
    rejected: int = 0  # trials that were evaluated and not accepted

    def at(self, x: FloatArray) -> Iterate:
        """Evaluate at `x`."""
        at = self.evaluate(x)
        self.seconds_contact += at.seconds_contact
        return Iterate(x, at, float(np.max(np.abs(at.residual))))

    def newton_step(self, now: Iterate) -> FloatArray | None:
        """Return the full Newton step; None if there is none. The Jacobian of `now` may be overwritten."""
        return self.timed(lambda: solve_with(self.linear, now.at.jac, -now.at.residual))

    def timed(self, solve: Callable[[], FloatArray | None]) -> FloatArray | None:
        """Solve a linear problem on the clock; a solution that is not finite is none."""
        start = perf_counter()
        step = solve()
        self.seconds_linear += perf_counter() - start
        return step if step is not None and np.all(np.isfinite(step)) else None


class Globalisation(Protocol):
    """How far to go, and where. An instance serves one correction and remembers what it learned on the way."""

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or why there is none."""
        ...


def column_scale(jac: Jacobian, before: FloatArray | None) -> FloatArray:
    """Return what makes lengths of steps independent of units: the largest norm each column has had (Moré 1978).

    Unknowns of a Jacobian that is known by its products only count as they are.
    """
    norms = np.sqrt(_column_squares(jac))
    if before is not None:
        return np.maximum(before, norms)
    norms[norms == 0.0] = 1.0
    return norms


def _column_squares(jac: Jacobian) -> FloatArray:
    if isinstance(jac, np.ndarray):
        return np.asarray(np.einsum("ij,ij->j", jac, jac))
    if isinstance(jac, Bordered) and isinstance(jac.jac, np.ndarray):
        squares = _column_squares(jac.jac) + jac.row**2
        return np.append(squares, jac.column @ jac.column + jac.corner**2)
    return np.ones(jac.shape[1])


def squared_ratio(residual: FloatArray, size: float) -> float:
    """Return ``|residual|² / size²``; infinite and not an error where it overflows."""
    ratio = float(np.linalg.norm(residual)) / size
    return ratio * ratio
