"""Periodic loads."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import input_error


@dataclass(frozen=True, eq=False)
class HarmonicLoad:
    """A static load and harmonics: ``f(t) = static + Re sum_h f_h exp(i h ω t)``.

    Parameters
    ----------
    static
        (n,) static forces, N.
    harmonics
        Harmonic order -> (n,) complex amplitudes, N.

    Raises
    ------
    ValueError
        If an order is below 1 or a length differs.
    InputError
        If a force is not finite.
    """

    static: FloatArray
    harmonics: Mapping[int, ComplexArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for order, amplitude in self.harmonics.items():
            if order < 1 or np.shape(amplitude) != self.static.shape:
                raise ValueError(
                    f"HarmonicLoad: harmonic {order} with shape {np.shape(amplitude)} for {self.static.shape}"
                )

        for f in (self.static, *self.harmonics.values()):
            if not np.all(np.isfinite(f)):
                raise input_error(
                    "HarmonicLoad", "contains NaN or infinite forces", "Give finite forces in N."
                )

    def coefficients(self, order: int) -> ComplexArray:
        """Return the (order+1, n) complex coefficients, harmonic 0 being the static load."""
        out = np.zeros((order + 1, self.static.size), dtype=complex)
        out[0] = self.static
        for h, amplitude in self.harmonics.items():
            if h <= order:
                out[h] = amplitude
        return out

    @property
    def scale(self) -> float:
        """Largest force amplitude, N."""
        return float(
            max(np.max(np.abs(f), initial=0.0) for f in (self.static, *self.harmonics.values()))
        )
