"""Results of shooting for one point of a forced response, besides its harmonics."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray


@dataclass(frozen=True, eq=False)
class Shot:
    """Periodic motion found by shooting; see `stickslip.response.ShootingResult`.

    Attributes
    ----------
    residual
        Change of the state over a period, relative to the vibration.
    step_error
        Estimated error of the harmonics by the time step, relative to the largest.
    growth_error
        Estimated error of the largest multiplier by the time step; 0 where it is far from 1.
    steps
        Time steps in a period.
    periods
        Periods integrated.
    multipliers
        (n_states,) Floquet multipliers.
    displacement, velocity
        (n,) state at t = 0, m and m/s.
    states
        States of all contact laws at t = 0, one contact after the other.
    """

    residual: float
    step_error: float
    growth_error: float
    steps: int
    periods: int
    multipliers: ComplexArray
    displacement: FloatArray
    velocity: FloatArray
    states: FloatArray

    @property
    def error(self) -> float:
        """Error for the verdict on the motion, a fraction; infinite if unknown."""
        return self.step_error if np.isfinite(self.step_error) else float("inf")
