"""Range of a synthesised response in which one mode dominates.

At a peak the mode is large and the other modes are small beside it; away from it they may be a fifth of it. As long as nothing slips they are
added, and the sum is exact. Where contacts slip, they feel the other modes too, and a mode whose amplitude follows the load steeply, as on the flank
of a peak that slip softens, makes much of that little.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator
from stickslip.response.nonlinear_modes.single_mode_validity import CHANGES, OtherModes, left_over
from stickslip.response.nonlinear_modes.synthesis import Synthesised

ALONE = 0.05  # relative, of the motion of the others and of what the contacts make of it
DIFFERENCE = 1e-4  # of the place, over which the amplitude follows the load


@dataclass(frozen=True, eq=False)
class Along:
    """The other modes along a response, all arrays (p,).

    Parameters
    ----------
    amplitude
        Of the output in the first harmonic with what the other modes add, m.
    share
        Motion of the other modes over that of the mode, in the output or in the gaps of the contacts, whichever is larger.
    change
        About the relative change of the amplitude at its frequency, if the contacts feel what the others add to the gaps.
    linear
        Whether nothing slips: the response is exact.
    """

    amplitude: FloatArray
    share: FloatArray
    change: FloatArray
    linear: BoolArray

    @property
    def alone(self) -> BoolArray:
        """Where nothing slips, or both numbers are at most `ALONE`."""
        return self.linear | ((self.share <= ALONE) & (self.change <= ALONE))


def along(others: OtherModes, found: Synthesised, dof: int) -> Along:
    """Return what the other modes do along a synthesised response.

    Parameters
    ----------
    others
        The modes beside the followed one.
    found
        The response of a level.
    dof
        The output.
    """
    own = others.oscillator
    system = own.backbone.system
    gaps = np.asarray(system.interface.gap_operator @ np.eye(system.structure.n))
    rows = np.vstack([np.eye(1, system.structure.n, dof), gaps])
    moves = (own.first(found.place) * np.exp(1j * found.phase)[:, None]) @ rows.T
    beside = others.answer(found.omega, left_over(own, found), rows)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = [
            np.linalg.norm(beside[:, k], axis=1) / np.linalg.norm(moves[:, k], axis=1)
            for k in (slice(1), slice(1, None))
        ]
    # gaps of the mode and the others together, as amplitudes of the mode alone
    size = np.sum(np.abs(moves[:, 1:]) ** 2, axis=1)
    both = np.abs(1.0 + np.sum(moves[:, 1:].conj() * beside[:, 1:], axis=1) / size)
    felt = _needs(own, found.place + np.log(both), found.omega)
    turned = np.log(felt / _needs(own, found.place, found.omega))
    linear = found.place + np.log1p(share[1]) < slips_from(own)
    return Along(
        np.abs(moves[:, 0] + beside[:, 0]), np.fmax(*share), np.abs(_steepness(own, found) * turned), np.asarray(linear)
    )


def slips_from(oscillator: ModalOscillator) -> float:
    """Return the first place at which the mode is no longer the linear one; infinite where it stays so."""
    if oscillator.begins <= 0.0:
        return -np.inf
    here = oscillator.at(oscillator.table)
    moved = np.abs(here.omega / here.omega[0] - 1.0)
    damped = np.abs(here.ratio - here.ratio[0]) / np.maximum(np.abs(here.ratio[0]), CHANGES)
    off = np.flatnonzero(np.maximum(moved, damped) >= CHANGES)
    return float(oscillator.table[off[0]]) if off.size else np.inf


def _needs(oscillator: ModalOscillator, place: FloatArray, omega: FloatArray) -> FloatArray:
    """Return the modal stiffness at frequencies, as a size."""
    here = oscillator.at(np.clip(place, *oscillator.ends))
    return np.asarray(np.abs(here.stiffness(omega)))


def _steepness(oscillator: ModalOscillator, found: Synthesised) -> FloatArray:
    """Return ``d ln a / d ln level`` at the frequency of each point."""
    ends = [np.clip(found.place + d, *oscillator.ends) for d in (-DIFFERENCE, DIFFERENCE)]
    here = [oscillator.at(place) for place in ends]
    level = [np.log(np.abs(o.stiffness(found.omega)) * o.amplitude / np.abs(o.force)) for o in here]
    grown = np.log(here[1].amplitude / here[0].amplitude)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(grown / (level[1] - level[0]))
