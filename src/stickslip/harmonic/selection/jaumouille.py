"""Increase of the order until the strain energy converges.

V. Jaumouillé, J.-J. Sinou and B. Petitjean, J. Sound Vib. 329 (2010) 4048-4067.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.harmonic.selection.spectrum import raised
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Jaumouille:
    """Add one harmonic at a time at every frequency until the strain energy of the structure hardly changes.

    The indicator is ``|E(nH) - E(nH + 1)| / E(nH)`` (Gastaldi & Berruti 2017, eq. 9), with the mean energy over the
    period. Each frequency begins with the fewest harmonics.

    Parameters
    ----------
    threshold
        Largest relative change of the energy that is accepted; the review gives no number.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 0.01

    def judge(self, step: Step) -> Verdict:
        """Request one more harmonic if there is no solution to compare with, or the energy changes too much."""
        before = step.before
        if before is None:
            return Verdict(np.nan, raised(step), step.smallest)
        was, now = strain_energy(before), strain_energy(step)
        change = abs(was - now) / was if was > 0.0 else 0.0
        again = raised(step) if change > self.threshold else None
        return Verdict(change, again, step.smallest)


def strain_energy(step: Step) -> float:
    """Return the strain energy of the whole structure, mean over the period, J."""
    q = step.balance.coefficients(step.x)
    return float(step.balance.linear.strain_energy(step.omega, q).sum())
