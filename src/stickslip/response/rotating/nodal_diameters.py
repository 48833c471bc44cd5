"""Natural frequencies of a bladed disk by nodal diameter."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.gyroscopic import gyroscopic_modes
from stickslip.model.modes import normal_modes
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.wave_family import WaveFamily
from stickslip.units import HZ


@dataclass(frozen=True, eq=False)
class NodalDiameterMap:
    """Natural frequencies against the number of nodal diameters.

    Parameters
    ----------
    sectors
        n_s of the wheel.
    nodal_diameters
        (k,) ascending, each from 0 to n_s / 2.
    frequencies_hz
        (k, n_modes) of the wave whose wave number is the nodal diameter: between 0 and n_s / 2 it runs backward, against rotation.
    forward_hz
        (k, n_modes) of wave number n_s minus nodal diameter; equal to `frequencies_hz` unless Coriolis forces part them.
    shapes
        (n, n_modes) of each nodal diameter on the travelling-wave structure, of unit mass; None where not kept.
    """

    sectors: int
    nodal_diameters: IntArray
    frequencies_hz: FloatArray
    forward_hz: FloatArray
    shapes: tuple[FloatArray | ComplexArray, ...] | None = None

    def row(self, nodal_diameter: int) -> int:
        """Return the row of a nodal diameter; an `InputError` says if it was not computed."""
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
        """Return the frequencies of backward and of forward waves as seen by who does not rotate, (k, n_modes) each.

        Parameters
        ----------
        speed
            Of the rotor, in rad/s; the one that the sector was computed at.
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
        Frequencies of each nodal diameter.
    nodal_diameters
        Ascending; all if not given.
    coriolis
        Whether the skew part of the sector's damping counts, which parts backward from forward waves.
    shapes
        Whether to keep the mode shapes of `frequencies_hz`.

    Raises
    ------
    InputError
        If there is no such nodal diameter, or fewer modes than asked for.
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
