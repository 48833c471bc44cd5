"""Selection of harmonics by a solution for the missing ones.

D. Süß, M. Jerschl and K. Willner, Proc. IMAC XXXIV (2016).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.harmonic.factors import solved
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.harmonic.selection.alert import solve_array
from stickslip.harmonic.selection.spectrum import above, foretold, padded_solution, spectral_shares
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class SuessSpectral:
    """Keep at the next frequency the harmonics with a sufficient share in the energy, after adding the missing ones.

    Only the missing harmonics are solved for; their effect on the present ones is neglected (Gastaldi & Berruti 2017,
    eq. 26, in Newton's form, which is also valid with preloads and gaps).

    Parameters
    ----------
    threshold
        Share of the square of the motion above which a harmonic is kept; the review gives no number: 1e-4 is a
        hundredth of the amplitude.
    frozen
        Keep the contact forces constant while the missing harmonics are solved (eq. 14), with the stiffness of the
        structure alone.
    repeats
        Solve a frequency again until it has the harmonics that it predicts (section 4.5.3); the published rule does
        not.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 1e-4
    frozen: bool = False
    repeats: bool = False

    def judge(self, step: Step) -> Verdict:
        """Add the missing harmonics; this frequency is solved again only with `repeats`.

        The indicator is the largest share of a missing harmonic.
        """
        q = padded_solution(step)
        missing = np.array([h not in step.balance.harmonics for h in step.reference.harmonics])
        change = self._change(step, q, missing)
        if change is None:  # without a solution there is no prediction, and all harmonics are kept
            return foretold(step, float("inf"), step.reference.harmonics, repeats=self.repeats)
        shares = spectral_shares(step.reference, q + change)
        largest = float(np.max(shares[missing], initial=0.0))
        following = above(step, shares, self.threshold)
        return foretold(step, largest, following, repeats=self.repeats)

    def _change(self, step: Step, q: FloatArray, missing: BoolArray) -> FloatArray | None:
        """Return the change of all scaled unknowns, zero at the present harmonics."""
        high = step.reference
        change = np.zeros((high.n_rows, high.linear.n))
        at = high.linearise(q, step.omega)
        if self.frozen:
            right = -to_complex(at.residual.reshape(change.shape))
            found = np.zeros_like(right)
            scale = high.force_scale / high.displacement_scale
            for i in np.flatnonzero(missing):
                block = high.linear_block(step.omega, high.harmonics[i])
                found[i] = solved(block, scale * right[i])
            return to_real(found).reshape(-1)
        rows = np.append(missing[0], np.repeat(missing[1:], 2))
        own = np.repeat(rows, high.linear.n)
        part = solve_array(at.dense_jac()[np.ix_(own, own)], -at.residual[own])
        if part is None:
            return None
        change[rows] = part.reshape(-1, high.linear.n)
        return change.reshape(-1)
