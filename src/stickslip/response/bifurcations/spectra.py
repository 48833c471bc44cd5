"""Multipliers sorted so that they are continuous along a branch."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.found import Stability
from stickslip.response.time.floquet import UNIT_TOLERANCE

Examine = Callable[[ForcedProblem, ForcedPoint], Stability]
ON_AXIS = 1e-6  # imaginary part below which a multiplier is real: pairs of real matrices have none at all
CIRCLE = 1.0 + UNIT_TOLERANCE


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Multipliers of a motion, the largest first.

    Parameters
    ----------
    values, errors
        (k,) multipliers and how far they may be off.
    """

    values: ComplexArray
    errors: FloatArray

    @property
    def outside(self) -> int:
        """Number of multipliers outside of the unit circle."""
        return int(np.count_nonzero(np.abs(self.values) > CIRCLE))

    def excess(self, k: int) -> float:
        """Return by how much the k-th modulus, from 0, is above that of the circle."""
        return float(abs(self.values[k])) - CIRCLE if k < self.values.size else -1.0

    def known(self, k: int) -> bool:
        """Whether the k-th multiplier lies on its side of the circle with its error."""
        if k >= self.values.size:
            return True
        return bool(self.errors[k] < abs(self.excess(k)))

    def rough(self, k: int, error: float) -> bool:
        """Whether the k-th multiplier may be on either side of the circle and is off by more than an `error`."""
        return k < self.values.size and not self.known(k) and bool(self.errors[k] > error)

    def of_place(self, k: int) -> tuple[complex, float]:
        """Return the k-th multiplier and its error; zero where there are fewer."""
        if k >= self.values.size:
            return 0.0j, 0.0
        return complex(self.values[k]), float(self.errors[k])


def neutral_of(found: Stability) -> int:
    """Return how many multipliers are 1."""
    return found.floquet.neutral


def spectrum(found: Stability, neutral: int) -> Spectrum:
    """Return the multipliers of a motion without so many `neutral` ones, those nearest to 1."""
    values, errors = found.floquet.multipliers, found.errors
    left = np.sort(np.argsort(np.abs(values - 1.0), kind="stable")[neutral:])
    order = left[np.argsort(-np.abs(values[left]), kind="stable")]
    return Spectrum(values[order], errors[order])


def nearest_to_one(found: Stability) -> tuple[complex, float]:
    """Return the multiplier that is nearest to 1 and its error: that of a fold."""
    values = found.floquet.multipliers
    if found.unknown or not values.size:
        return complex(np.nan), np.inf
    at = int(np.argmin(np.abs(values - 1.0)))
    return complex(values[at]), float(found.errors[at])
