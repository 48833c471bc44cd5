"""Newton's method with the natural monotonicity test: steps are shortened until the next correction is smaller, whatever the scales."""

from functools import partial
from time import perf_counter

import numpy as np

from stickslip.solve.iterate import Iterate, Work
from stickslip.solve.linear import factorised
from stickslip.solve.status import Status

MIN_STEP = 1.0 / 32.0  # shortest share of a Newton step; it is taken, across a kink
GAIN = 0.25  # part of the share by which the next correction has to be smaller
PATIENCE = 3  # shortest steps in a row, none of which helped, before the search is given up


class NaturalLevel:
    """Damped Newton steps with the natural monotonicity test (Deuflhard 2004, section 3.3).

    A step is measured by the correction that the same factors give at its end, and not by the residual there. A contact that changes its
    state raises the residual by the stiffness of the contact times the motion, however near the solution is; a correction is the
    distance to the solution itself. Each trial costs a back substitution. If even the shortest step fails the test,
    a kink lies within it, and the far side has its own Jacobian: the step is accepted. The iteration stops after a few such steps in a row.

    Use it for starts near a solution. From far away, or where the Jacobian is nearly singular, the other globalisations converge more often.
    """

    def __init__(self) -> None:
        self._failed = 0

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or why there is none."""
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
            if share <= MIN_STEP:
                break
            share *= 0.5
        self._failed += 1
        return Status.STALLED if left is None or self._failed > PATIENCE else trial
