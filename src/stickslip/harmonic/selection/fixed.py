"""Strategies with the same harmonics at every frequency, which accept every solution."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stickslip.harmonic.selection.strategy import Kept, Step, Verdict


@dataclass(frozen=True)
class AlwaysLow:
    """Keep the harmonics of the first passage; frequencies that do not converge are not repeated with more."""

    always: ClassVar[Kept] = "low"
    verifies: ClassVar[bool] = False
    threshold: ClassVar[float] = np.inf

    def judge(self, step: Step) -> Verdict:
        """Accept the solution."""
        return accepted(step)


@dataclass(frozen=True)
class AlwaysHigh:
    """Keep the harmonics of the reference."""

    always: ClassVar[Kept] = "high"
    verifies: ClassVar[bool] = False
    threshold: ClassVar[float] = np.inf

    def judge(self, step: Step) -> Verdict:
        """Accept the solution."""
        return accepted(step)


def accepted(step: Step) -> Verdict:
    """Accept a solution without a check."""
    return Verdict(np.nan, None, step.balance.harmonics)
