"""Selection of harmonics by columns of the contact Jacobian.

D. Süß, M. Jerschl and K. Willner, Proc. IMAC XXXIV (2016), second method.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import rows_of
from stickslip.harmonic.selection.spectrum import above, contacts_of_reference, foretold
from stickslip.harmonic.selection.strategy import Step, Verdict


@dataclass(frozen=True)
class SuessJacobian:
    """Keep at the next frequency the harmonics that act on others through the contacts.

    The indicator of harmonic z is the norm of its column in the Jacobian of the contact forces, ``‖K̂^{h≠z, z}‖`` over
    all other vibrating harmonics h of the reference and all contacts (Gastaldi & Berruti 2017, section 3), here
    relative to its own block ``‖K̂^{z, z}‖``. It is zero in full stick. The row of the static term is left out, because
    a slider that starts on its limit couples every harmonic to it, even if stuck.

    Parameters
    ----------
    threshold
        Norm above which a harmonic is kept; the review gives no number.
    repeats
        Solve a frequency again until it has the harmonics that it predicts (section 4.5.3); the published rule does
        not.
    """

    verifies: ClassVar[bool] = False
    threshold: float = 0.05
    repeats: bool = False

    def judge(self, step: Step) -> Verdict:
        """Compute the norms of the columns; this frequency is solved again only with `repeats`.

        The indicator is the largest neglected column.
        """
        columns = column_norms(step)
        had = step.balance.harmonics
        missed = [c for h, c in zip(step.reference.harmonics, columns, strict=True) if h not in had]
        following = above(step, columns, self.threshold)
        return foretold(step, max(missed, default=0.0), following, repeats=self.repeats)


def column_norms(step: Step) -> FloatArray:
    """Return the norm of each harmonic's column without its own block, relative to that block.

    It is zero where the block is zero.
    """
    own = rows_of(step.reference.harmonics)
    blocks = contacts_of_reference(step).blocks[:, :, own[:, None], own]
    square = np.sum(blocks**2, axis=(0, 1))
    starts = np.append(0, np.arange(1, own.size, 2))  # of each harmonic's rows: one, then pairs
    square = np.add.reduceat(np.add.reduceat(square, starts, axis=0), starts, axis=1)
    itself = np.diagonal(square)
    vibrating = square[1:].sum(axis=0)
    vibrating[1:] -= itself[1:]
    others = np.maximum(vibrating, 0.0)
    ratio = np.divide(others, itself, out=np.zeros_like(others), where=itself > 0.0)
    return np.asarray(np.sqrt(ratio))
