"""Steps past a kink at which every damped step fails."""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.solve.iterate import Iterate, Work
from stickslip.solve.status import Status

SHARES = tuple(0.5**k for k in range(31))  # of a Newton step, longest first
CREEP = 1.01  # by how much the residual may grow on the far side of a kink
MAX_CREEP_SHARE = 1.0 / 64.0  # share of a Newton step from which on that is allowed
PATIENCE = 10  # crossings in a row without a smaller residual than any before
SLOW = 0.9  # share of the residual left by a step that hardly helped: usually one that ends at a kink


def slow(after: Iterate, before: Iterate) -> bool:
    """Whether a step hardly reduced the residual."""
    left = np.linalg.norm(after.at.residual) / np.linalg.norm(before.at.residual)
    return bool(left > SLOW)


class Kinks:
    """Steps to just beyond the next kink, while the residual falls over a few crossings.

    Where contact states switch, the residual grows along the Newton direction from the kink on. There the Jacobian of the far
    side must take over, so a trial just beyond the kink is accepted although the residual grew a little. Where the
    determinants of both sides have the same sign, the Newton direction of the far side leads away from the kink and not back (Ralph
    1994, for piecewise smooth equations); a piecewise linear equation is then solved piece by piece (Katzenelson 1965).
    """

    def __init__(self) -> None:
        self._best = np.inf
        self._idle = 0

    def cross(self, work: Work, now: Iterate, step: FloatArray) -> Iterate | Status:
        """Go along a Newton step until just beyond the next kink.

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
            An iterate with a smaller residual, or just beyond the kink; `Status.STALLED` if there is neither, or if the last few
            crossings did not reduce the residual.
        """
        size = float(np.linalg.norm(now.at.residual))
        self._idle = 0 if size < self._best else self._idle + 1
        self._best = min(self._best, size)
        if self._idle > PATIENCE:
            return Status.STALLED
        for share in SHARES:
            trial = work.at(now.x + share * step)
            norm = float(np.linalg.norm(trial.at.residual))
            if norm <= (1.0 - 1e-4 * share) * size or (share <= MAX_CREEP_SHARE and norm <= CREEP * size):
                return trial
            work.rejected += 1
        return Status.STALLED
