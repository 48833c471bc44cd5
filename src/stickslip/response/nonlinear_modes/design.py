"""Design curves from one backbone: the peak over the level of the load, and over anything that scales like it."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator
from stickslip.response.parameter import Discretisation

TWICE = 2.0
CONTACT_FORCE_RTOL = 1e-9  # relative difference of contact forces that counts as none


@dataclass(frozen=True, eq=False)
class PeakCurve:
    """All resonances of a mode along its backbone, all arrays (p,).

    Parameters
    ----------
    place
        On the backbone.
    level
        Of the load that makes each of them.
    omega
        Frequency, rad/s.
    amplitude
        Of the output in the first harmonic, m.
    top
        Whether it is a peak: a little more of the load makes a little more amplitude.
    """

    place: FloatArray
    level: FloatArray
    omega: FloatArray
    amplitude: FloatArray
    top: BoolArray

    @property
    def per_load(self) -> FloatArray:
        """Peak over level, m.

        Where all contact laws are homogeneous this is also the curve of a damper's pull: a static load s times as large under the same
        vibration load has the peak of the level 1/s, s times as large.
        """
        return self.amplitude / self.level


@by_one_thread
def peak_curve(oscillator: ModalOscillator, dof: int) -> PeakCurve:
    """Return the resonances of all levels, without solving for any of them: each place of the backbone needs one level."""
    after = oscillator.table >= oscillator.begins
    place, level = oscillator.table[after], oscillator.needed_in_table[after]
    here = oscillator.at(place)
    motion = oscillator.displacement(place, np.array([dof]))[:, 1, 0]
    return PeakCurve(place, level, here.resonance(), np.abs(motion), np.gradient(level) > 0.0)


def is_homogeneous(oscillator: ModalOscillator, how: Discretisation | None = None) -> bool:
    """Whether contact forces are twice as large where all displacements are: laws without a preload, gap or limit of their own.

    Static and vibration loads that grow by a factor then make everything grow by it, and one backbone serves all static loads. This is looked
    at in the motion of the largest amplitude.
    """
    backbone = oscillator.backbone
    balance = (how or Discretisation()).balance(backbone.system, oscillator.load, np.array([backbone.dof]))
    last = max(backbone.solutions, key=lambda p: p.modal_amplitude)
    motion = last.coefficients[: balance.order + 1, balance.linear.retained]
    one, two = (_forces(balance, factor * motion, last.omega) for factor in (1.0, TWICE))
    size = float(np.max(np.abs(two), initial=0.0))
    return bool(np.max(np.abs(two - TWICE * one), initial=0.0) <= CONTACT_FORCE_RTOL * size)


def _forces(balance: HarmonicBalance, motion: ComplexArray, omega: float) -> FloatArray:
    x = balance.unknowns(motion)
    return np.asarray(balance.forces(x, omega).coefficients)
