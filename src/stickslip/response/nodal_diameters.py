"""Natural frequencies of a bladed disk by nodal diameter."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error


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
