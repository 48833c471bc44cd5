"""Trust-region correctors: Levenberg-Marquardt's damped least squares, and Powell's dogleg."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from scipy.sparse.linalg import LinearOperator, lsmr

from stickslip.arrays import FloatArray
from stickslip.operators import Jacobian, times, transposed_times
from stickslip.solve.iterate import Iterate, Work, column_scale, squared_ratio
from stickslip.solve.line_search import Kinks, slow
from stickslip.solve.linear import whole_array
from stickslip.solve.status import Status

FIRST = 1e-3  # damping of the first step, relative to the squared columns
MIN_DAMPING = 1e-14  # smallest damping: below, rounding dominates
ACCEPT = 1e-4  # share of the predicted decrease below which a step is refused
DAMPINGS = 10  # dampings tried at one iterate, with accelerating growth
STATIONARY_COSINE = 1e-13  # cosine between residual and columns below which the residual has a minimum
ITERATIVE = 1e-4  # relative accuracy of a step computed from products only
POOR, GOOD = 0.25, 0.75  # shares of the predicted decrease at which the region shrinks and grows
REGIONS = 12  # regions tried, each a tenth to a half of the previous one


class LevenbergMarquardt:
    """Damped least squares (Levenberg 1944, Marquardt 1963) with the control of damping of Nielsen (1999).

    The step minimises ``|J s + r|² + λ |D s|²``, D being the norms of the columns (Moré 1978), so that units do not
    matter. λ is proportional to the residual: convergence is then fast even if the Jacobian is singular at the solution
    (Fan & Yuan 2005).
    """

    def __init__(self) -> None:
        self._kinks = Kinks()
        self._scale: FloatArray | None = None
        self._first: float | None = None
        self._damping = FIRST
        self._growth = 2.0

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        jac, residual = now.at.jac, now.at.residual
        scale = self._scale = column_scale(jac, self._scale)
        size = float(np.linalg.norm(residual))
        self._first = self._first or size
        if np.linalg.norm(transposed_times(jac, residual) / scale) <= STATIONARY_COSINE * size:
            return Status.LOCAL_MINIMUM
        trial = None
        for _ in range(DAMPINGS):
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
        """Return the iterate after a step, and set the damping of the next; None if the step is refused."""
        residual = now.at.residual
        size = float(np.linalg.norm(residual))
        expected = squared_ratio(residual + times(now.at.jac, step), size) - 1.0
        trial = work.at(now.x + step)
        change = squared_ratio(trial.at.residual, size) - 1.0
        # without a predicted decrease beyond rounding, no decrease is possible
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
        (n, n) Jacobian; it is not changed.
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
    # QR, because the normal equations would square the condition number
    _, solution, info = scipy.linalg.lapack.dgels(
        stacked, np.append(right, np.zeros(n)), lwork=64 * n, overwrite_a=True
    )
    return np.asarray(solution[:n]) / scale if info == 0 else None


@dataclass(frozen=True, eq=False)
class _Path:
    """Dogleg path: from the state along the gradient to the Cauchy point, and on to the Newton point, in scaled steps.

    At the Newton point the linear model has no residual. If the Jacobian is singular, the path ends at the Cauchy
    point.
    """

    residual: FloatArray
    cauchy: FloatArray
    newton: FloatArray
    left: FloatArray  # residual of the model at the Cauchy point
    singular: bool

    def within(self, radius: float) -> tuple[FloatArray, FloatArray]:
        """Return the last point of the path within `radius`, and the residual of the linear model there."""
        short = float(np.linalg.norm(self.cauchy))
        if radius <= short or self.singular:
            share = min(radius / short, 1.0)
            return share * self.cauchy, self.residual + share * (self.left - self.residual)
        if radius >= np.linalg.norm(self.newton):
            return self.newton, np.zeros_like(self.residual)
        leg = self.newton - self.cauchy
        a, b, c = leg @ leg, self.cauchy @ leg, short**2 - radius**2
        # the positive root of a s² + 2 b s + c, written without cancellation
        root = float(np.sqrt(b * b - a * c))
        share = float(-c / (b + root) if b >= 0.0 else (root - b) / a)
        return self.cauchy + share * leg, (1.0 - share) * self.left


class Dogleg:
    """Trust region with the dogleg path (Powell 1970); lengths are scaled by columns of the Jacobian (Moré 1978).

    At a singular Jacobian the step follows the gradient. The first region contains the whole Newton step, so that easy
    problems cost as much as with Newton's method.
    """

    def __init__(self) -> None:
        self._kinks = Kinks()
        self._scale: FloatArray | None = None
        self._radius = 0.0

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        scale = self._scale = column_scale(now.at.jac, self._scale)
        path = _path(work, now, scale)
        if path is None:
            return Status.LOCAL_MINIMUM
        if self._radius == 0.0:
            self._radius = float(np.linalg.norm(path.newton))
        trial = self._within_region(work, now, path, scale)
        if path.singular or (trial is not None and not slow(trial, now)):
            return trial or Status.STALLED
        beyond = self._kinks.cross(work, now, path.newton / scale)
        if isinstance(beyond, Status):
            return trial or beyond
        self._radius = float(np.linalg.norm(path.newton))
        return beyond

    def _within_region(self, work: Work, now: Iterate, path: _Path, scale: FloatArray) -> Iterate | None:
        """Return the first iterate that decreases the residual as predicted, in increasingly small regions."""
        radius, size = self._radius, float(np.linalg.norm(path.residual))
        for _ in range(REGIONS):
            step, model = path.within(radius)
            expected = squared_ratio(model, size) - 1.0
            if expected >= 0.0:  # equal to rounding: a smaller region cannot help
                return None
            trial = work.at(now.x + step / scale)
            length = float(np.linalg.norm(step))
            change = squared_ratio(trial.at.residual, size) - 1.0
            share = change / expected if np.isfinite(change) else -np.inf
            if share < POOR:
                slope = 2.0 * (float(path.residual / size @ model) / size - 1.0)
                radius = length * _shorter(change, slope)
            elif share > GOOD and length >= 0.99 * radius:
                radius = 2.0 * length
            self._radius = radius
            if share > ACCEPT:
                return trial
            work.rejected += 1
        return None


def _path(work: Work, now: Iterate, scale: FloatArray) -> _Path | None:
    """Return the path at an iterate; None if there is no descent direction."""
    residual = now.at.residual
    gradient = transposed_times(now.at.jac, residual) / scale
    slope = times(now.at.jac, gradient / scale)  # before the factorisation overwrites the Jacobian
    newton = work.newton_step(now)
    steep = float(np.linalg.norm(gradient))
    if steep <= STATIONARY_COSINE * float(np.linalg.norm(residual)) or not np.any(slope):
        if newton is None:
            return None
        # nearly singular: the gradient is rounding, but the Newton step is not
        return _Path(residual, scale * newton, scale * newton, np.zeros_like(residual), False)
    down = -((steep / float(np.linalg.norm(slope))) ** 2)
    cauchy, left = down * gradient, residual + down * slope
    if newton is None:
        return _Path(residual, cauchy, cauchy, left, True)
    return _Path(residual, cauchy, scale * newton, left, False)


def _shorter(change: float, slope: float) -> float:
    """Return the factor on a step that leads to the minimum of the parabola through the known values, within bounds."""
    curved = 2.0 * (change - slope)
    if not np.isfinite(curved):
        return 0.1
    return float(np.clip(-slope / curved, 0.1, 0.5)) if curved > 0.0 else 0.5
