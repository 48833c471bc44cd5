"""Floquet multipliers: growth of small disturbances over a period."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray

UNIT_TOLERANCE = 1e-6  # of 1: far above the rounding of a period, far below the damping of any structure


@dataclass(frozen=True, eq=False)
class Floquet:
    """Multipliers of a periodic motion.

    A multiplier within `UNIT_TOLERANCE` of 1 is called neutral and is not judged: residual tractions of contacts that
    never slip, and places of bodies that nothing holds, form families of periodic motions beside each other. One on the
    unit circle elsewhere belongs to a vibration that nothing damps; it neither grows nor dies, and counts as stable.

    Parameters
    ----------
    multipliers
        (n_states,) eigenvalues of the derivative of the period map, largest first.
    """

    multipliers: ComplexArray

    @property
    def neutral(self) -> int:
        """Number of multipliers that are 1."""
        return int(np.count_nonzero(self._neutral))

    @property
    def ringing(self) -> int:
        """Number of multipliers on the unit circle that are not 1."""
        on = np.abs(np.abs(self.multipliers) - 1.0) <= UNIT_TOLERANCE
        return int(np.count_nonzero(on & ~self._neutral))

    @property
    def growth(self) -> float:
        """Largest modulus of the multipliers that are not neutral; 0 if there are none."""
        return float(np.max(np.abs(self.multipliers[~self._neutral]), initial=0.0))

    @property
    def stable(self) -> bool:
        """Whether no small disturbance grows: all moduli but those of neutral multipliers are at most 1."""
        return self.growth <= 1.0 + UNIT_TOLERANCE

    @property
    def _neutral(self) -> BoolArray:
        return np.asarray(np.abs(self.multipliers - 1.0) <= UNIT_TOLERANCE)


def floquet(monodromy: FloatArray) -> Floquet:
    """Return the multipliers of a monodromy matrix, which is NaN where the motion was lost."""
    if not np.all(np.isfinite(monodromy)):
        return Floquet(np.full(len(monodromy), np.nan, dtype=complex))
    values = np.linalg.eigvals(monodromy)
    return Floquet(np.asarray(values[np.argsort(-np.abs(values), kind="stable")], dtype=complex))
