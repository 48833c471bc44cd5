"""Newton steps, shortened where they do not help."""

from stickslip.solve.iterate import Iterate, Work
from stickslip.solve.nonsmooth_step import Kinks
from stickslip.solve.status import Status

MIN_STEP = 1.0 / 64.0  # shortest share of a Newton step before kinks are stepped across
MEMORY = 3  # residual norms a step is compared with: kinks make single increases normal


class LineSearch:
    """Non-monotone line search along Newton steps (after Grippo et al. 1986).

    A step is shortened until the residual norm falls below the largest of the last few, because contacts that switch their state raise the norm
    for one step on the way to the solution. If no length suffices, the next steps go from kink to kink; see `Kinks`.
    """

    def __init__(self) -> None:
        self._norms: list[float] = []
        self._careful = False
        self._kinks = Kinks()

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        """Return the next iterate, or why there is none."""
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
