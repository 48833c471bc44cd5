"""Records of the analyses by waves: plain arrays, wave by wave."""

from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.rotating.flutter import FlutterOfWave
from stickslip.units import HZ


def _none() -> ComplexArray:
    return np.zeros(0, dtype=complex)


def _no_numbers() -> FloatArray:
    return np.zeros(0)


def _no_shares() -> FloatArray:
    return np.zeros((0, 0))


@dataclass(frozen=True, eq=False)
class WaveModes:
    """Modes of one travelling wave.

    Parameters
    ----------
    wave_number
        Of the wave.
    frequencies_hz
        (m,) ascending.
    shapes
        (m, n, 3) complex displacements of the skin's points, the largest of length 1; n = 0 if not asked for.
    growth
        (m,) derivatives of ω² by Ω² at the speed; zeros for a model that no speed changes.
    seconds
        Time of the computation.
    in_flow
        (m,) eigenvalues with aerodynamic forces and the structure's damping, 1/s; none where the model has no such forces.
    shares
        (stages, m) of each stage in the kinetic energy; none where there is one wheel.
    stiffest_hz
        (m,) frequencies with all harmonics held that flanges do not couple; none where there is one wheel.
    """

    wave_number: int
    frequencies_hz: FloatArray
    shapes: ComplexArray
    growth: FloatArray
    seconds: float
    in_flow: ComplexArray = field(default_factory=_none)
    shares: FloatArray = field(default_factory=_no_shares)
    stiffest_hz: FloatArray = field(default_factory=_no_numbers)


@dataclass(frozen=True, eq=False)
class WaveBranches:
    """Frequencies of one travelling wave against speed, and where engine orders cross them.

    Parameters
    ----------
    wave_number
        Of the wave.
    frequencies_hz
        (s, m) at the speeds, followed by mode shape.
    engine_orders, modes
        (c,) of each crossing; modes count from 0.
    speeds, crossings_hz
        (c,) in rad/s and Hz.
    error
        Largest relative error of the frequencies that the small basis was found to have.
    seconds
        Time of the computation.
    """

    wave_number: int
    frequencies_hz: FloatArray
    engine_orders: IntArray
    modes: IntArray
    speeds: FloatArray
    crossings_hz: FloatArray
    error: float
    seconds: float


@dataclass(frozen=True, eq=False)
class WaveFlutter:
    """A wave in the flow; as `FlutterOfWave`, with its number.

    Parameters
    ----------
    wave_number
        Of the wave.
    frequencies_hz
        (n,) in still fluid.
    amplitudes
        (n, m) of the patterns in each mode.
    by_energy
        (n,) aerodynamic damping ratio by the energy method.
    in_flow, damped
        (n,) eigenvalues with the fluid alone, and with the structure's damping, 1/s.
    seconds
        Time of the computation.
    """

    wave_number: int
    frequencies_hz: FloatArray
    amplitudes: ComplexArray
    by_energy: FloatArray
    in_flow: ComplexArray
    damped: ComplexArray
    seconds: float

    @property
    def solved(self) -> FlutterOfWave:
        """The same without its number."""
        omega = HZ * self.frequencies_hz
        return FlutterOfWave(omega, self.amplitudes, self.by_energy, self.in_flow, self.damped)
