"""Comparison of the balance with a time integration: numbers and sentence."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.units import LARGEST_PERCENT, metres

PATIENCE = 600  # periods; a blade damped by 0.3 % forgets its start to 1e-5, undamped ringing of a damper never ends
LARGE = 1.0  # percent: above it the balance is repeated with more harmonics, to tell which of the two is wrong
STEPS = 1024  # of a period

Motion = Literal["attained", "left", "not periodic", "not settled"]
TOLD: dict[str, str] = {
    "attained": "attained: the motion in time stays with that of the balance",
    "left": "left: the motion in time goes away from that of the balance",
    "not periodic": "the motion in time does not repeat with the period of the load",
    "not settled": "where the motion in time goes is not known yet",
}


@dataclass(frozen=True)
class Check:
    """Amplitude of the report output, of the harmonics that the load drives, by balance and by time integration.

    Parameters
    ----------
    frequency_hz
        Where.
    balance, transient
        Amplitudes in m; of the integration the average over its last third where it did not become periodic.
    settled
        Whether the integration became periodic.
    periods
        Periods integrated.
    outputs_percent
        Largest difference of an output, as the vector of its driven harmonics with their phases, by the measure of errors; NaN where it was not taken.
    scatter
        Largest distance of a period's harmonics from that average, relative to it; over all outputs.
    drifting
        Names of the coordinates whose mean moves on from period to period, with commas between them.
    order
        Harmonics of the balance.
    steps
        Steps in a period of the integration: more than usual where these were too few.
    step_percent
        By how much the amplitude changed with the last doubling of the steps; 0 where it was not needed.
    refined_order, refined
        Harmonics and amplitude of the balance repeated with more of them; NaN where it was not needed or failed.
    motion
        What the motion in time did that began with the balance's state: *attained* it, *left* it for another one or without bound,
        is *not periodic*, or has *not settled* so far.
    shows_after
        Periods in which a disturbance changes a thousandfold by the multiplier that was found; 0 where that was not asked for.
    """

    frequency_hz: float
    balance: float
    transient: float
    settled: bool
    periods: int
    scatter: float = 0.0
    drifting: str = ""
    order: int = 0
    steps: int = STEPS
    step_percent: float = 0.0
    refined_order: int = 0
    refined: float = float("nan")
    motion: Motion | Literal[""] = ""
    shows_after: int = 0
    outputs_percent: float = float("nan")

    @property
    def difference_percent(self) -> float:
        """Of the balance against the integration."""
        return 100 * (self.balance - self.transient) / self.transient

    @property
    def wanders_near(self) -> bool:
        """Whether a motion in time that is not periodic stays within 1 % of the balance's amplitude."""
        near = max(100 * self.scatter, abs(self.difference_percent)) <= LARGE
        return self.motion == "not periodic" and near

    @property
    def sentence(self) -> str:
        """What was compared and what happened."""
        return (
            f"{self.frequency_hz:.3f} Hz: balance {metres(self.balance)} (H = {self.order}), "
            f"time integration {metres(self.transient)}{self._difference}; "
            f"{self._outputs}{self._motion}{self._step}{self._verdict}{self._became}"
        )

    @property
    def _difference(self) -> str:
        percent = self.difference_percent
        return f", difference {percent:+.3g} %" if abs(percent) < LARGEST_PERCENT else ""

    @property
    def _outputs(self) -> str:
        known = self.outputs_percent > LARGE
        return f"largest difference of an output, with its phase, {self.outputs_percent:.2g} %; " * known

    @property
    def _motion(self) -> str:
        if not np.isfinite(self.transient):
            return f"the integration overflowed after {self.periods} periods"
        if self.settled:
            return f"periodic after {self.periods} periods"
        drifting = f", and these coordinates drift: {self.drifting}" if self.drifting else ""
        word = "not settled" if self.motion == "not settled" else "not periodic"
        if self.motion == "attained":
            word = "periodic but for the scatter"
        return (
            f"{word} after {self.periods} periods: average over the last third, "
            f"scatter {100 * self.scatter:.2g} %{drifting}"
        )

    @property
    def _step(self) -> str:
        if self.steps == STEPS:
            return ""
        if abs(self.step_percent) <= LARGE:
            return f", with {self.steps} steps a period (half of them: {-self.step_percent:+.2g} %)"
        return f"; {self.steps} steps a period are still too few for it: the last doubling moved it by {self.step_percent:+.2g} %"

    @property
    def _verdict(self) -> str:
        if self.refined_order == 0:
            return ""
        if not np.isfinite(self.refined):
            return f"; the balance with {self.refined_order} harmonics does not converge"
        left = 100 * (self.refined - self.transient) / self.transient
        return f"; the balance with {self.refined_order} harmonics gives {metres(self.refined)} ({left:+.2f} %)"

    @property
    def _became(self) -> str:
        if not self.motion:
            return ""
        capped = (
            f" (followed for {self.periods} periods at most, of {self.shows_after} in which a disturbance would show)"
            if self.shows_after > PATIENCE
            else ""
        )
        return f"; {TOLD[self.motion]}{capped}"
