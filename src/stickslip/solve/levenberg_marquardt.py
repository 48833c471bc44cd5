"""Levenberg-Marquardt method."""

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import LinearOperator, lsmr

from stickslip.arrays import FloatArray
from stickslip.operators import Jacobian, times, transposed_times
from stickslip.solve.iterate import Iterate, Work, column_scale, squared_ratio
from stickslip.solve.line_search import Kinks, slow
from stickslip.solve.linear import whole_array
from stickslip.solve.status import Status

FIRST = 1e-3  # damping of the first step, as a share of the squared columns
MIN_DAMPING = 1e-14  # smallest damping: below, rounding decides
ACCEPT = 1e-4  # share of the predicted decrease below which a step is refused
TRIALS = 10  # dampings tried at one iterate; each grows faster than the last
STATIONARY_COSINE = 1e-13  # cosine between residual and columns below which the residual has a minimum
ITERATIVE = 1e-4  # relative accuracy of a step found by products only


class LevenbergMarquardt:
    """Damped least squares (Levenberg 1944, Marquardt 1963) with the control of damping of Nielsen (1999).

    The step minimises ``|J s + r|² + λ |D s|²``, D being the norms of the columns (Moré 1978), so that units do not matter. λ is proportional
    to the residual: convergence is then fast even if the Jacobian is singular at the solution (Fan & Yuan 2005).
    """

    def __init__(self) -> None:
        self._kinks = Kinks()
        self._scale: FloatArray | None = None
        self._first: float | None = None
        self._damping = FIRST
        self._growth = 2.0

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or why there is none."""
        jac, residual = now.at.jac, now.at.residual
        scale = self._scale = column_scale(jac, self._scale)
        size = float(np.linalg.norm(residual))
        self._first = self._first or size
        if np.linalg.norm(transposed_times(jac, residual) / scale) <= STATIONARY_COSINE * size:
            return Status.LOCAL_MINIMUM
        trial = None
        for _ in range(TRIALS):
            damping = max(self._damping * size / self._first, MIN_DAMPING)
            step = work.timed(lambda d=damping: damped_step(jac, -residual, scale, d))  # type: ignore[misc]
            trial = None if step is None else self._trial(work, now, step)
            if trial is not None:
                break
            self._damping *= self._growth
            self._growth *= 2.0
        if trial is not None and not slow(trial, now):
            return trial
        step = work.timed(lambda: damped_step(jac, -residual, scale, MIN_DAMPING))
        beyond = Status.STALLED if step is None else self._kinks.cross(work, now, step)
        if isinstance(beyond, Status):
            return trial or beyond
        self._damping, self._growth = FIRST, 2.0
        return beyond

    def _trial(self, work: Work, now: Iterate, step: FloatArray) -> Iterate | None:
        """Return the iterate at the end of a step, and set the damping of the next; None if it is refused."""
        residual = now.at.residual
        size = float(np.linalg.norm(residual))
        expected = squared_ratio(residual + times(now.at.jac, step), size) - 1.0
        trial = work.at(now.x + step)
        change = squared_ratio(trial.at.residual, size) - 1.0
        # no decrease to be expected, to rounding: no decrease to be had
        share = change / expected if np.isfinite(change) and expected < 0.0 else -np.inf
        if share <= ACCEPT:
            work.rejected += 1
            return None
        eased = max(1.0 / 3.0, 1.0 - (2.0 * share - 1.0) ** 3)
        self._damping = max(self._damping * eased, MIN_DAMPING)
        self._growth = 2.0
        return trial


def damped_step(jac: Jacobian, right: FloatArray, scale: FloatArray, damping: float) -> FloatArray | None:
    """Minimise ``|jac s - right|² + damping |scale s|²``.

    Parameters
    ----------
    jac
        (n, n) Jacobian; it is left as it is.
    right
        (n,) right side.
    scale
        (n,) positive scale of each entry of the step.
    damping
        Positive number.

    Returns
    -------
    ndarray or None
        (n,) step; None if even the damped problem is singular to working precision.
    """
    root = float(np.sqrt(damping))
    n = right.size
    array = whole_array(jac)
    if array is None:
        scaled = LinearOperator(
            (n, n),
            matvec=lambda v: times(jac, v.reshape(n) / scale),
            rmatvec=lambda v: transposed_times(jac, v.reshape(n)) / scale,
            dtype=float,
        )
        found = lsmr(scaled, right, damp=root, atol=ITERATIVE, btol=ITERATIVE, maxiter=4 * n)
        return np.asarray(found[0]) / scale
    stacked = np.zeros((2 * n, n), order="F")
    stacked[:n] = array / scale
    np.fill_diagonal(stacked[n:], root)
    # QR and not the normal equations, which would square the condition number
    _, solution, info = scipy.linalg.lapack.dgels(
        stacked, np.append(right, np.zeros(n)), lwork=64 * n, overwrite_a=True
    )
    return np.asarray(solution[:n]) / scale if info == 0 else None
