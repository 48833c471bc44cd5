"""Selection of harmonics by the tangent prediction.

A. Grolet and F. Thouverez, Mech. Syst. Signal Process. 30 (2012) 43-60.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import kept_by_dof, of_all, supports_of
from stickslip.harmonic.selection.alert import solve_array
from stickslip.harmonic.selection.spectrum import above, foretold, padded_solution, shares_by_dof, spectral_shares
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Grolet:
    """Keep at the next frequency the harmonics with a sufficient share in the energy of its tangent prediction.

    ``∂r/∂q Δq = -∂r/∂ω Δω`` is solved with all harmonics of the reference (Gastaldi & Berruti 2017, eq. 11, 12); then
    the shares of the harmonics in ``q + Δq`` are compared with the threshold.

    Parameters
    ----------
    threshold
        Share of the square of the motion above which a harmonic is kept; the review gives no number: 1e-4 is a
        hundredth of the amplitude.
    per_dof
        Evaluate the shares of each retained coordinate, which then keeps its own harmonics, as in the source (section
        4.5.2.1); otherwise all coordinates keep the same harmonics.
    repeats
        Solve a frequency again until it has the harmonics that it predicts (section 4.5.3); the published rule does
        not.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 1e-4
    per_dof: bool = False
    repeats: bool = False

    def judge(self, step: Step) -> Verdict:
        """Predict the next solution; this frequency is solved again only with `repeats`.

        The indicator is the largest neglected share.
        """
        q = padded_solution(step)
        at = step.reference.linearise(q, step.omega)
        ahead = step.next_omega - step.omega
        change = (step.solve or solve_array)(at.jac, -ahead * at.jac_p)
        if change is None:  # at a fold there is no prediction, and all harmonics are kept
            return foretold(step, float("inf"), step.reference.harmonics, repeats=self.repeats)
        if self.per_dof:
            return self._judge_each(step, shares_by_dof(step.reference, q + change))
        shares = spectral_shares(step.reference, q + change)
        had = step.balance.harmonics
        missed = [s for h, s in zip(step.reference.harmonics, shares, strict=True) if h not in had]
        following = above(step, shares, self.threshold)
        return foretold(step, max(missed, default=0.0), following, repeats=self.repeats)

    def _judge_each(self, step: Step, shares: FloatArray) -> Verdict:
        """Choose the harmonics of each coordinate from its predicted shares."""
        reference = step.reference.harmonics
        smallest = np.isin(reference, step.smallest)
        wanted = (shares > self.threshold) | smallest[:, None]
        missed = shares[~kept_by_dof(step.supports, reference)]
        by_dof = supports_of(wanted, reference)
        largest = float(missed.max(initial=0.0))
        return foretold(step, largest, of_all(by_dof), repeats=self.repeats, by_dof=by_dof)
