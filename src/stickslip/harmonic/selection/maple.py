"""Increase of the order by the energy of the last harmonic.

R.C. Maple, P.I. King, P.D. Orkwis and J.M. Wolff, J. Comput. Phys. 193 (2004) 620-641.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.harmonic.harmonic_set import of_all
from stickslip.harmonic.selection.spectrum import next_up, raised, shares_by_dof, spectral_shares
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Maple:
    """Add one harmonic at a frequency as long as the last one has too large a share of the spectral energy.

    The share is defined by eq. 10 of Gastaldi & Berruti 2017. Added harmonics are kept at the next frequencies; none is
    ever dropped.

    Parameters
    ----------
    threshold
        Largest accepted share of the last harmonic in the square of the motion; the review gives no number: 1e-4 is a
        hundredth of the amplitude.
    per_dof
        Check the last harmonic of each retained coordinate, and add harmonics only where needed, as in the source
        (section 4.5.2.1); otherwise all coordinates keep the same harmonics.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 1e-4
    per_dof: bool = False

    def judge(self, step: Step) -> Verdict:
        """Compare the energy of the last harmonic with the total energy."""
        if self.per_dof:
            return self._judge_each(step)
        share = float(spectral_shares(step.balance, step.x)[-1])
        again = raised(step) if share > self.threshold else None
        return Verdict(share, again, step.balance.harmonics)

    def _judge_each(self, step: Step) -> Verdict:
        """Compare the energy of the last harmonic of each coordinate with its total energy."""
        shares = shares_by_dof(step.balance, step.x)
        place = {h: i for i, h in enumerate(step.balance.harmonics)}
        own = step.supports
        last = np.array([shares[place[s[-1]], i] for i, s in enumerate(own)])
        more = tuple(next_up(step, s) if share > self.threshold else s for s, share in zip(own, last, strict=True))
        largest = float(last.max(initial=0.0))
        if more == own:
            return Verdict(largest, None, of_all(own), following_by_dof=own)
        return Verdict(largest, of_all(more), of_all(own), None, more, own)
