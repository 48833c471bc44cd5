"""Travelling waves: their numbers and names, and the discrete Fourier transform over sectors.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendix 1.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, Matrix
from stickslip.errors import input_error

Kind = Literal["standing", "backward", "forward"]
NO_WAVE = -1  # stored as the wave number of a single structure


@dataclass(frozen=True)
class Wave:
    """A travelling wave of a wheel by its wave number (Krack et al. 2017, table 3).

    Parameters
    ----------
    wave_number
        k, from 0 to sectors − 1.
    sectors
        Number of sectors n_s.

    Raises
    ------
    InputError
        If the wave number is out of range.
    """

    wave_number: int
    sectors: int

    def __post_init__(self) -> None:
        check_sectors("Wave", self.sectors)
        if not 0 <= self.wave_number < self.sectors:
            raise input_error(
                "Wave.wave_number",
                f"must be from 0 to {self.sectors - 1}, got {self.wave_number}",
                "wave() takes any whole number, modulo the number of sectors.",
            )

    @property
    def nodal_diameter(self) -> int:
        """Number of nodal diameters: the smaller of k and n_s − k."""
        return min(self.wave_number, self.sectors - self.wave_number)

    @property
    def kind(self) -> Kind:
        """``standing`` at k = 0 and n_s/2, ``backward`` below n_s/2, ``forward`` above.

        Directions are in the rotating frame, forward in the sense of rotation; sector n leads sector 0 by n θ_k.
        """
        if self.wave_number == 0 or 2 * self.wave_number == self.sectors:
            return "standing"
        return "backward" if 2 * self.wave_number < self.sectors else "forward"

    @property
    def phase_angle(self) -> float:
        """Inter-blade phase angle θ_k = 2πk/n_s in rad, by which each sector leads the previous one."""
        return 2 * math.pi * self.wave_number / self.sectors

    @property
    def phase(self) -> complex | float:
        """``exp(i θ_k)``; a real number for standing waves."""
        if self.kind == "standing":
            return 1.0 if self.wave_number == 0 else -1.0
        return complex(math.cos(self.phase_angle), math.sin(self.phase_angle))


def wave(wave_number: int, sectors: int) -> Wave:
    """Return the wave of any whole number, modulo the sectors: −1 is sectors − 1."""
    check_sectors("wave", sectors)
    return Wave(wave_number % sectors, sectors)


def excited_wave(engine_order: int, sectors: int, harmonic: int = 1) -> int:
    """Return the wave number that an engine order excites in a temporal harmonic.

    Parameters
    ----------
    engine_order
        Number of waves of the pressure field around the casing; negative for a field that rotates faster than the wheel.
    sectors
        Number of sectors.
    harmonic
        Harmonic of the vibration; 1 is the frequency of the excitation.

    Returns
    -------
    int
        ``harmonic * engine_order mod sectors``, in the rotating frame; the wheel rotates towards the next sector.
    """
    check_sectors("excited_wave", sectors)
    return harmonic * engine_order % sectors


def to_waves(displacements: Matrix) -> ComplexArray:
    """Return travelling-wave coordinates (eq. 39).

    Parameters
    ----------
    displacements
        (n_s, ...) displacements of all sectors, each in its own axes.

    Returns
    -------
    numpy.ndarray
        (n_s, ...) complex, one row for each wave number; the transform is unitary.
    """
    return np.asarray(np.fft.fft(displacements, axis=0, norm="ortho"))


def to_sectors(waves: Matrix) -> ComplexArray:
    """Return the displacements of all sectors, each in its own axes, from travelling-wave coordinates (eq. 40)."""
    return np.asarray(np.fft.ifft(waves, axis=0, norm="ortho"))


def check_sectors(place: str, sectors: int) -> None:
    """Refuse an invalid number of sectors."""
    if sectors != int(sectors) or sectors < 1:
        raise input_error(f"{place}: sectors", f"must be a whole number from 1, got {sectors}", "Count the blades.")
