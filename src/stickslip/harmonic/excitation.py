"""Periodic loads."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

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
    InputError
        If an order is not a positive integer, lengths differ, the static load is complex or a force is not finite.
    """

    static: FloatArray
    harmonics: Mapping[int, ComplexArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        static = np.asarray(self.static)
        if static.ndim != 1 or np.any(np.imag(static) != 0.0):
            raise input_error(
                "HarmonicLoad.static",
                f"must be one row of real forces, got shape {static.shape} of {static.dtype}",
                "A phase belongs to a harmonic: give it in `harmonics`.",
            )
        object.__setattr__(self, "static", np.real(static).astype(float))
        harmonics = {h: np.asarray(f, dtype=complex) for h, f in self.harmonics.items()}
        object.__setattr__(self, "harmonics", harmonics)
        order: Any
        for order, amplitude in harmonics.items():
            if not isinstance(order, int | np.integer) or order < 1:
                raise input_error(
                    "HarmonicLoad.harmonics",
                    f"the order of a harmonic must be an integer from 1 on, got {order!r}",
                    "Give what does not vibrate as `static`.",
                )
            if amplitude.shape != static.shape:
                raise input_error(
                    "HarmonicLoad.harmonics",
                    f"harmonic {order} has shape {amplitude.shape}, the static load {static.shape}",
                    "Give one force a dof.",
                )
        for f in (self.static, *self.harmonics.values()):
            if not np.all(np.isfinite(f)):
                raise input_error("HarmonicLoad", "contains NaN or infinite forces", "Give finite forces in N.")

    def coefficients(self, order: int) -> ComplexArray:
        """Return the (order+1, n) complex coefficients, harmonic 0 being the static load."""
        out = np.zeros((order + 1, self.static.size), dtype=complex)
        out[0] = self.static
        for h, amplitude in self.harmonics.items():
            if h <= order:
                out[h] = amplitude
        return out

    def over_periods(self, periods: int) -> "HarmonicLoad":
        """Return the same load as harmonics of ω / periods, for subharmonic motions with `periods` times the period."""
        return HarmonicLoad(self.static, {periods * h: f for h, f in self.harmonics.items()})

    @property
    def scale(self) -> float:
        """Largest force amplitude, N."""
        return float(max(np.max(np.abs(f), initial=0.0) for f in (self.static, *self.harmonics.values())))
