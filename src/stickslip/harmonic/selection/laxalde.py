"""Selection of harmonics by the truncation error of the contact forces.

D. Laxalde, as reviewed by Gastaldi & Berruti 2017, section 3.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import to_complex
from stickslip.harmonic.selection.spectrum import contacts_of_reference, foretold, up_to
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class Laxalde:
    """Keep enough harmonics at the next frequency to represent the contact forces of this one.

    The error of ``nH`` harmonics is the truncation error of the contact forces in the time domain, its absolute value
    averaged over the period and summed over the contacts (Gastaldi & Berruti 2017, eq. 8), here relative to the error
    of the static term alone.

    Parameters
    ----------
    threshold
        Largest error of the forces that is accepted, a fraction; the review gives no number.
    repeats
        Solve a frequency again until it has the harmonics that it predicts (section 4.5.3); the published rule does
        not.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 0.05
    repeats: bool = False

    def judge(self, step: Step) -> Verdict:
        """Choose the lowest order whose error is small; this frequency is solved again only with `repeats`."""
        errors = left_out(step)
        orders = list(step.reference.harmonics)
        own = errors[orders.index(step.balance.order)]
        enough = [h for h, e in zip(orders, errors, strict=True) if e <= self.threshold]
        following = up_to(step, min(enough, default=orders[-1]))
        return foretold(step, float(own), following, repeats=self.repeats)


def left_out(step: Step) -> FloatArray:
    """Return the truncation error of the contact forces for each order, relative to the error of the static term."""
    period = contacts_of_reference(step)
    force = period.force.reshape(-1, period.force.shape[2])
    turn = np.exp(2j * np.pi * np.arange(force.shape[1]) / force.shape[1])
    parts = to_complex(period.coefficients)
    left, rest = [], force
    for h in step.reference.harmonics:
        rest = rest - np.real(parts[h][:, None] * turn**h)
        left.append(float(np.mean(np.abs(rest), axis=1).sum()))
    # constant forces are represented exactly by the static term
    silent = left[0] <= np.finfo(float).eps * float(np.abs(force).sum())
    return np.zeros(len(left)) if silent else np.array(left) / left[0]
