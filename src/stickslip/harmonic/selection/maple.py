"""More harmonics while the last one holds energy (R.C. Maple, P.I. King, P.D. Orkwis and J.M. Wolff, J. Comput. Phys. 193 (2004) 620-641)."""

from dataclasses import dataclass
from typing import ClassVar

from stickslip.harmonic.selection.spectrum import raised, spectral_shares
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Maple:
    """Solve a frequency with one harmonic more while the last one has too large a share of the spectral energy.

    The share is that of Gastaldi & Berruti 2017, eq. 10. What was needed here is kept at the next frequency; nothing is ever
    dropped. All dofs get the same harmonics.

    Parameters
    ----------
    threshold
        Largest share of the last harmonic that is accepted, of the square of the motion; the review gives no number: 1e-4 is a
        hundredth of the amplitude.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 1e-4

    def judge(self, step: Step) -> Verdict:
        """Compare the last harmonic with all."""
        share = float(spectral_shares(step.balance, step.x)[-1])
        again = raised(step) if share > self.threshold else None
        return Verdict(share, again, step.balance.harmonics)
