"""Newton steps shortened until the residual or the next correction decreases, and steps past kinks."""

from functools import partial
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.iterate import Iterate, Work
from stickslip.solve.linear import factorised
from stickslip.solve.status import Status

SHARES = tuple(0.5**k for k in range(31))  # of a Newton step, longest first
CREEP = 1.01  # largest growth of the residual on the far side of a kink
MAX_CREEP_SHARE = 1.0 / 64.0  # share of a Newton step up to which this growth is allowed
MAX_IDLE_CROSSINGS = 10  # consecutive crossings without a new smallest residual
SLOW_REDUCTION = 0.9  # share of the residual after a step that hardly helped, usually because it ends at a kink


def slow(after: Iterate, before: Iterate) -> bool:
    """Whether a step hardly reduced the residual."""
    left = np.linalg.norm(after.at.residual) / np.linalg.norm(before.at.residual)
    return bool(left > SLOW_REDUCTION)


class Kinks:
    """Steps to just beyond the next kink, as long as the residual decreases within a few crossings.

    Where contact states change, the residual grows along the Newton direction beyond the kink. The Jacobian of the far
    side must take over there, so a trial just beyond the kink is accepted although the residual grew a little. If the
    determinants of both sides have the same sign, the Newton direction of the far side leads away from the kink and not
    back (Ralph 1994, for piecewise smooth equations). A piecewise linear equation is thus solved piece by piece
    (Katzenelson 1965).
    """

    def __init__(self) -> None:
        self._best = np.inf
        self._idle = 0

    def cross(self, work: Work, now: Iterate, step: FloatArray) -> Iterate | Status:
        """Go along a Newton step to just beyond the next kink.

        Parameters
        ----------
        work
            Evaluations and their cost.
        now
            Iterate at which no other step reduced the residual.
        step
            (n,) Newton step of this iterate.

        Returns
        -------
        Iterate or Status
            An iterate with a smaller residual, or just beyond the kink; `Status.STALLED` if there is neither, or if the
            last few crossings did not reduce the residual.
        """
        size = float(np.linalg.norm(now.at.residual))
        self._idle = 0 if size < self._best else self._idle + 1
        self._best = min(self._best, size)
        if self._idle > MAX_IDLE_CROSSINGS:
            return Status.STALLED
        for share in SHARES:
            trial = work.at(now.x + share * step)
            norm = float(np.linalg.norm(trial.at.residual))
            if norm <= (1.0 - 1e-4 * share) * size or (share <= MAX_CREEP_SHARE and norm <= CREEP * size):
                return trial
            work.rejected += 1
        return Status.STALLED


MIN_STEP = 1.0 / 64.0  # shortest share of a Newton step before kinks are crossed
MEMORY = 3  # residual norms to which a step is compared: at kinks single increases are normal


class LineSearch:
    """Non-monotone line search along Newton steps (after Grippo et al. 1986).

    A step is shortened until the residual norm is below the largest of the last few, because contacts that change their
    state raise the norm for one step on the way to the solution. If no length suffices, the next steps go from kink to
    kink; see `Kinks`.
    """

    def __init__(self) -> None:
        self._norms: list[float] = []
        self._careful = False
        self._kinks = Kinks()

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        self._norms = [*self._norms[1 - MEMORY :], now.norm]
        step = work.newton_step(now)
        if step is None:
            return Status.SINGULAR
        share = 1.0
        while not self._careful and share >= MIN_STEP:
            trial = work.at(now.x + share * step)
            if trial.norm <= (1.0 - 1e-4 * share) * max(self._norms):
                return trial
            work.rejected += 1
            share *= 0.5
        self._careful = True
        return self._kinks.cross(work, now, step)


MIN_NATURAL_STEP = 1.0 / 32.0  # shortest share of a Newton step, which is accepted across a kink
GAIN = 0.25  # required relative decrease of the next correction, as a part of the share
NATURAL_PATIENCE = 3  # consecutive shortest steps without success before the search is given up


class NaturalLevel:
    """Damped Newton steps with the natural monotonicity test (Deuflhard 2004, section 3.3).

    A step is judged by the correction that the same factors give at its end, not by the residual. A contact that
    changes its state raises the residual by the stiffness of the contact times the motion, even close to the solution,
    whereas a correction is the distance to the solution itself. Each trial costs a back substitution. If even the
    shortest step fails the test, it crosses a kink, and the far side has its own Jacobian: the step is accepted. The
    iteration stops after a few such steps in a row.

    Use it for starts near a solution. From far away, or if the Jacobian is nearly singular, the other globalisations
    converge more often.
    """

    def __init__(self) -> None:
        self._failed = 0

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or the status that ends the iteration."""
        began = perf_counter()
        solve = factorised(work.linear, now.at.jac)
        work.seconds_linear += perf_counter() - began
        step = None if solve is None else work.timed(partial(solve, -now.at.residual))
        if solve is None or step is None:
            return Status.SINGULAR
        size, share = float(np.linalg.norm(step)), 1.0
        while True:
            trial = work.at(now.x + share * step)
            finite = np.isfinite(trial.norm)
            left = work.timed(partial(solve, trial.at.residual)) if finite else None
            if left is not None and np.linalg.norm(left) <= (1.0 - GAIN * share) * size:
                self._failed = 0
                return trial
            work.rejected += 1
            if share <= MIN_NATURAL_STEP:
                break
            share *= 0.5
        self._failed += 1
        return Status.STALLED if left is None or self._failed > NATURAL_PATIENCE else trial
