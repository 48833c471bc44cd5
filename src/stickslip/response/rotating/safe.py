"""Natural frequencies of a bladed disk by nodal diameter, and the SAFE diagram of their resonances with engine orders.

M. P. Singh, J. J. Vargo, D. M. Schiffer and J. D. Dello, "SAFE diagram: a design and reliability tool for turbine
blading", Proceedings of the 17th Turbomachinery Symposium (1988) 93-101.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.modes import gyroscopic_modes, normal_modes
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.wave_family import WaveFamily
from stickslip.units import HZ


@dataclass(frozen=True, eq=False)
class NodalDiameterMap:
    """Natural frequencies over the nodal diameter.

    Parameters
    ----------
    sectors
        Number n_s of sectors.
    nodal_diameters
        (k,) ascending, each from 0 to n_s / 2.
    frequencies_hz
        (k, n_modes) of the wave whose wave number is the nodal diameter; between 0 and n_s / 2 it travels backward,
        against rotation.
    forward_hz
        (k, n_modes) of wave number n_s minus nodal diameter; equal to `frequencies_hz` without Coriolis forces.
    shapes
        (n, n_modes) for each nodal diameter on the travelling-wave structure, of unit mass; None if not kept.
    """

    sectors: int
    nodal_diameters: IntArray
    frequencies_hz: FloatArray
    forward_hz: FloatArray
    shapes: tuple[FloatArray | ComplexArray, ...] | None = None

    def row(self, nodal_diameter: int) -> int:
        """Return the row of a nodal diameter; raise `InputError` if it was not computed."""
        found = np.flatnonzero(self.nodal_diameters == nodal_diameter)
        if not found.size:
            raise input_error(
                "NodalDiameterMap",
                f"nodal diameter {nodal_diameter} was not computed, only {self.nodal_diameters.tolist()}",
                "Leave nodal_diameters out to have them all.",
            )
        return int(found[0])

    def of_wave(self, wave_number: int) -> FloatArray:
        """Return the (n_modes,) frequencies in Hz of a wave number, taken modulo the number of sectors."""
        k = wave_number % self.sectors
        backward = 2 * k <= self.sectors
        table = self.frequencies_hz if backward else self.forward_hz
        return np.asarray(table[self.row(k if backward else self.sectors - k)])

    def stationary_hz(self, speed: float) -> tuple[FloatArray, FloatArray]:
        """Return the frequencies of backward and of forward waves in the stationary frame, (k, n_modes) each.

        Parameters
        ----------
        speed
            Speed of the rotor at which the sector was computed, rad/s.
        """
        turning = self.nodal_diameters[:, None] * speed / HZ
        return np.abs(self.frequencies_hz - turning), np.abs(self.forward_hz + turning)


def nodal_diameter_map(
    sector: CyclicSector,
    n_modes: int,
    nodal_diameters: Sequence[int] | None = None,
    *,
    coriolis: bool = False,
    shapes: bool = False,
) -> NodalDiameterMap:
    """Return the lowest natural frequencies of a wheel by nodal diameter.

    Parameters
    ----------
    sector
        One sector, at rest or at speed.
    n_modes
        Number of frequencies of each nodal diameter.
    nodal_diameters
        Ascending nodal diameters; None: all.
    coriolis
        Whether to include the skew part of the sector's damping, which separates backward from forward waves.
    shapes
        Whether to keep the mode shapes of `frequencies_hz`.

    Raises
    ------
    InputError
        If a nodal diameter does not exist, or there are fewer modes than requested.
    """
    half = sector.sectors // 2
    diameters = np.arange(half + 1) if nodal_diameters is None else np.asarray(nodal_diameters)
    if not diameters.size or diameters.min() < 0 or diameters.max() > half or np.any(np.diff(diameters) <= 0):
        raise input_error(
            "nodal_diameter_map: nodal_diameters",
            f"must ascend from 0 to at most {half}, got {diameters[:8].tolist()}",
            f"A wheel of {sector.sectors} sectors has no others.",
        )
    backward, forward, kept = [], [], []
    family = WaveFamily(partial(travelling_wave, sector), sector.sectors, tuple(diameters.tolist()))
    for diameter in diameters.tolist():
        hertz, vectors = _wave_modes(family, diameter, n_modes, coriolis)
        backward.append(hertz)
        kept.append(vectors)
        if coriolis and 0 < 2 * diameter < sector.sectors:
            hertz, _ = _wave_modes(family, -diameter, n_modes, True)
        forward.append(hertz)
    return NodalDiameterMap(
        sector.sectors,
        diameters.astype(np.int64),
        np.array(backward),
        np.array(forward),
        tuple(kept) if shapes else None,
    )


def _wave_modes(
    family: WaveFamily, wave_number: int, n_modes: int, coriolis: bool
) -> tuple[FloatArray, FloatArray | ComplexArray]:
    structure = family.at(wave_number)
    shift, factors = family.shifted(wave_number, structure)
    if coriolis:
        turning = gyroscopic_modes(structure, n_modes, shift=shift, factors=factors)
        return turning.frequencies_hz, turning.shapes
    modes = normal_modes(structure, n_modes, shift=shift, factors=factors)
    return modes.frequencies_hz, modes.shapes


@dataclass(frozen=True)
class Interference:
    """Engine order and a mode of the nodal diameter that it excites.

    Parameters
    ----------
    engine_order
        Oscillations per revolution.
    wave_number
        Engine order modulo the number of sectors: the excited wave in the rotating frame.
    nodal_diameter
        Nodal diameter of the wave.
    mode
        Column of the map, from 0.
    frequency_hz
        Natural frequency.
    speed
        Speed at which the engine order meets this frequency, rad/s; infinite if it never does.
    margin
        Relative distance of this speed from the speed range, negative below the range and zero within.
    """

    engine_order: int
    wave_number: int
    nodal_diameter: int
    mode: int
    frequency_hz: float
    speed: float
    margin: float


@dataclass(frozen=True, eq=False)
class Safe:
    """SAFE (interference) diagram; build it with `safe`.

    Parameters
    ----------
    frequencies
        Frequencies by nodal diameter.
    speed_range
        Lowest and highest speed, rad/s.
    engine_orders
        Engine orders compared.
    allowed
        Required margin.
    points
        All pairs of engine order and mode, the closest first.
    """

    frequencies: NodalDiameterMap
    speed_range: tuple[float, float]
    engine_orders: tuple[int, ...]
    allowed: float
    points: tuple[Interference, ...]

    @property
    def resonances(self) -> tuple[Interference, ...]:
        """Points whose margin is below the required one."""
        return tuple(p for p in self.points if abs(p.margin) <= self.allowed)

    @property
    def not_judged(self) -> tuple[int, ...]:
        """Engine orders that, with the margin, exceed the highest computed mode of the waves that they excite.

        Unless the map has all modes, close frequencies above it are missing from `points`.
        """
        top = self.speed_range[1] * (1 + self.allowed) / (2 * math.pi)
        return tuple(m for m in self.engine_orders if m * top > self.frequencies.of_wave(m).max(initial=0.0))

    def speed_line(self, speed: float, engine_orders: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the zigzag line of a speed: nodal diameters and frequencies in Hz of engine orders 0, 1, 2, ...

        Parameters
        ----------
        speed
            Rotor speed, rad/s.
        engine_orders
            Last engine order; None: the highest of the diagram. The line turns at n_s / 2 nodal diameters and at 0.
        """
        last = max(self.engine_orders) if engine_orders is None else engine_orders
        half = 0.5 * self.frequencies.sectors
        corners = half * np.arange(math.ceil(last / half))
        orders = np.union1d(np.arange(last + 1), corners)
        wave = orders % self.frequencies.sectors
        return np.minimum(wave, self.frequencies.sectors - wave), orders * speed / HZ


def safe(
    frequencies: NodalDiameterMap,
    speed: float | tuple[float, float],
    engine_orders: Sequence[int],
    *,
    margin: float = 0.05,
    growth: Callable[[int], FloatArray] | None = None,
) -> Safe:
    """Compare engine orders with the frequencies of the nodal diameters that they excite.

    On a wheel of n_s equal sectors, engine order m does work only on wave number ``m mod n_s``. A resonance therefore
    needs a matching shape as well as a matching frequency.

    Parameters
    ----------
    frequencies
        Result of `nodal_diameter_map`, at a speed within the range.
    speed
        Operating speed, rad/s, or the lowest and the highest one.
    engine_orders
        Positive engine orders.
    margin
        Relative distance in speed below which a point counts as a resonance.
    growth
        Function of the wave number that returns the (n_modes,) derivatives of squared natural frequencies by the
        squared speed, at the one operating speed. Engine orders then meet the modes along these straight lines
        (Southwell), as in a Campbell diagram near this speed. None: frequencies do not change with the speed.

    Raises
    ------
    InputError
        If a number is invalid, a nodal diameter excited by an engine order is not in the map, or `growth` is given with
        a range of speeds.
    """
    low, high = (speed, speed) if isinstance(speed, (int, float)) else speed
    if not 0 < low <= high < math.inf:
        raise input_error("safe: speed", f"needs 0 < lowest <= highest, got {speed}", "Give rad/s.")
    wrong = [m for m in engine_orders if m < 1 or m != int(m)]
    if wrong or not len(engine_orders):
        raise input_error(
            "safe: engine_orders",
            f"must be positive whole numbers, got {list(engine_orders)[:6]}",
            "Give the counts of vanes, struts and burners, and their multiples.",
        )
    if not 0 <= margin < math.inf:
        raise input_error("safe: margin", f"must not be negative, got {margin}", "0.05 is 5 %.")
    if growth is not None and low != high:
        raise input_error("safe: growth", f"belongs to one speed, got a range {speed}", "Give the speed of the map.")
    points = [p for m in engine_orders for p in _points(frequencies, int(m), low, high, growth)]
    return Safe(
        frequencies,
        (low, high),
        tuple(int(m) for m in engine_orders),
        margin,
        tuple(sorted(points, key=lambda p: abs(p.margin))),
    )


def _points(
    frequencies: NodalDiameterMap,
    engine_order: int,
    low: float,
    high: float,
    growth: Callable[[int], FloatArray] | None,
) -> list[Interference]:
    wave = engine_order % frequencies.sectors
    diameter = min(wave, frequencies.sectors - wave)
    own = frequencies.of_wave(wave)
    slopes = np.zeros(len(own)) if growth is None else growth(wave)
    found = []
    for mode, (hertz, slope) in enumerate(zip(own, slopes, strict=True)):
        speed = _meeting(2 * math.pi * float(hertz), float(slope), engine_order, high)
        outside = speed / high - 1 if speed > high else min(speed / low - 1, 0.0)
        found.append(Interference(engine_order, wave, diameter, mode, float(hertz), speed, outside))
    return found


def _meeting(omega: float, slope: float, engine_order: int, speed: float) -> float:
    """Return the Ω with ``ω² + slope (Ω² − speed²) = (engine_order Ω)²``.

    It is infinite if the order never meets the line.
    """
    rest, rise = omega**2 - slope * speed**2, engine_order**2 - slope
    return math.sqrt(rest / rise) if rise != 0.0 and rest / rise > 0.0 else math.inf
