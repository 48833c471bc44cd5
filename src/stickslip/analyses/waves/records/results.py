"""Records of the analyses by waves: plain arrays, wave by wave; wave numbers and their names."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.reduction.waves import excited_wave, wave
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
        Wave number.
    frequencies_hz
        (m,) ascending, Hz.
    shapes
        (m, n, 3) complex displacements of the skin's points, the largest of length 1; n = 0 if not asked for.
    growth
        (m,) derivatives of ω² with respect to Ω² at the speed; zeros for a model that does not depend on speed.
    seconds
        Time of the computation.
    in_flow
        (m,) eigenvalues with aerodynamic forces and structural damping, 1/s; empty for a model without such forces.
    shares
        (stages, m) share of each stage in the kinetic energy; empty for a single wheel.
    stiffest_hz
        (m,) frequencies, Hz, with all harmonics fixed that the flanges do not couple; empty for a single wheel.
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
    """Frequencies of one travelling wave against speed, and their crossings with engine orders.

    Parameters
    ----------
    wave_number
        Wave number.
    frequencies_hz
        (s, m) at the speeds, Hz; columns follow mode shapes.
    engine_orders, modes
        (c,) engine order and mode of each crossing; modes count from 0.
    speeds, crossings_hz
        (c,) speed and frequency of each crossing, rad/s and Hz.
    error
        Largest measured relative error of the frequencies by the reduced basis.
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
    """Modes of a wave in the flow; as `FlutterOfWave`, with the wave number.

    Parameters
    ----------
    wave_number
        Wave number.
    frequencies_hz
        (n,) in still fluid, Hz.
    amplitudes
        (n, m) amplitudes of the patterns in each mode.
    by_energy
        (n,) aerodynamic damping ratio by the energy method.
    in_flow, damped
        (n,) eigenvalues with the aerodynamic forces alone, and with the structure's damping too, 1/s.
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
        """The same modes without the wave number."""
        omega = HZ * self.frequencies_hz
        return FlutterOfWave(omega, self.amplitudes, self.by_energy, self.in_flow, self.damped)


@dataclass(frozen=True)
class Wheel:
    """Properties of a wheel that define its wave numbers.

    Parameters
    ----------
    sectors
        Number of sectors; 1 for a whole structure.
    parted
        Whether Coriolis forces split the two directions of a nodal diameter.
    """

    sectors: int
    parted: bool

    def numbers(self, diameters: Sequence[int] | None = None) -> tuple[int, ...]:
        """Return the wave numbers of nodal diameters (all if None); with split directions also the forward waves."""
        half = self.sectors // 2
        found = sorted(range(half + 1) if diameters is None else diameters)
        if self.parted:
            found += [self.sectors - d for d in reversed(found) if 0 < 2 * d < self.sectors]
        return tuple(found)

    def diagram(self, engine_order: int) -> int:
        """Return the wave number whose diagram holds the crossings of an engine order."""
        excited = excited_wave(engine_order, self.sectors)
        # where nothing parts them, both directions have the same frequencies, and one diagram
        return excited if self.parted else min(excited, self.sectors - excited)

    def require(self, diameters: Sequence[int] | None, key: str) -> None:
        """Refuse nodal diameters that the wheel lacks."""
        highest = self.sectors // 2
        if diameters and self.sectors == 1 and max(diameters) > 0:
            raise input_error(key, "are of a wheel, and no part is a sector of one", "Leave them out.")
        if diameters and max(diameters) > highest:
            raise input_error(
                key,
                f"{max(diameters)} is above half of {self.sectors} sectors",
                f"The nodal diameters go from 0 to {highest}.",
            )


def wave_name(number: int, sectors: int) -> tuple[int, str]:
    """Return the nodal diameter of a wave number, and its kind."""
    if sectors == 1:
        return 0, "whole"
    found = wave(number, sectors)
    return found.nodal_diameter, found.kind


def label(number: int, sectors: int, *, parted: bool) -> str:
    """Return the name of a wave, with its direction if the two differ."""
    diameter, kind = wave_name(number, sectors)
    if sectors == 1:
        return "whole"
    told = parted and kind in ("backward", "forward")
    return f"ND {diameter} {kind}" if told else f"ND {diameter}"
