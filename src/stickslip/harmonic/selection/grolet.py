"""The tangent foretells the spectrum (A. Grolet and F. Thouverez, Mech. Syst. Signal Process. 30 (2012) 43-60)."""

from dataclasses import dataclass
from typing import ClassVar

from stickslip.harmonic.selection.alert import solve_array
from stickslip.harmonic.selection.spectrum import above, padded_solution, spectral_shares
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Grolet:
    """Keep at the next frequency the harmonics that have a share in the energy of its tangent prediction.

    ``∂r/∂q Δq = -∂r/∂ω Δω`` in the space of all harmonics of the reference (Gastaldi & Berruti 2017, eq. 11, 12), then the share of
    each harmonic in ``q + Δq``. All dofs get the same harmonics.

    Parameters
    ----------
    threshold
        Share of the square of the motion above which a harmonic is kept; the review gives no number: 1e-4 is a hundredth of
        the amplitude.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 1e-4

    def judge(self, step: Step) -> Verdict:
        """Predict the next solution; this frequency is not solved again. The indicator is the largest share left out."""
        q = padded_solution(step)
        at = step.reference.linearise(q, step.omega)
        ahead = step.next_omega - step.omega
        change = (step.solve or solve_array)(at.jac, -ahead * at.jac_p)
        if change is None:  # a fold: nothing can be foretold, all harmonics are kept
            return Verdict(float("inf"), None, step.reference.harmonics)
        shares = spectral_shares(step.reference, q + change)
        had = step.balance.harmonics
        missed = [s for h, s in zip(step.reference.harmonics, shares, strict=True) if h not in had]
        return Verdict(max(missed, default=0.0), None, above(step, shares, self.threshold))
