"""Choice of single harmonics by their effect on the outputs: a goal-oriented error estimate (see `adjoint`)."""

from dataclasses import dataclass, replace
from typing import ClassVar, get_args

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.errors import check_choice, input_error
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.judging import covers
from stickslip.harmonic.selection.adjoint import Estimate, Goal, Outputs, contributions, estimate, outputs_of
from stickslip.harmonic.selection.guarded_alert import GuardedAlert
from stickslip.harmonic.selection.strategy import Step, Verdict

GOALS = 8  # outputs with the largest errors, which decide on the harmonics
NEGLIGIBLE_CHANGE = 1e-6  # relative change below which a harmonic is not needed


@dataclass(frozen=True)
class GoalOriented:
    """Repeat with the harmonics that the outputs need if their error bound exceeds a threshold.

    Parameters
    ----------
    threshold
        Largest expected error that is accepted, as a fraction.
    left_out
        Share of the threshold that the harmonics left out of a repeat may contribute in total, without cancellation.
    goal
        Quantity of an output that must be accurate: its ``motion``, amplitude and phase as in the Jacobian Alert, or
        only its ``amplitude``.
    guarded
        Whether `GuardedAlert` checks solutions whose bound is below the threshold. If it gives the alarm, the frequency
        is repeated with all harmonics.
    """

    verifies: ClassVar[bool] = True
    threshold: float = 0.05
    left_out: float = 0.2
    goal: Goal = "motion"
    guarded: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.left_out <= 1.0:
            raise input_error("GoalOriented.left_out", f"must lie from 0 to 1, got {self.left_out}", "0.2 is usual.")
        hint = "'motion' is what the Jacobian Alert judges."
        check_choice("GoalOriented.goal", self.goal, get_args(Goal), hint)

    def judge(self, step: Step) -> Verdict:
        """Estimate the error of the outputs, and choose the harmonics that cause it."""
        low, high = step.balance, step.reference
        if low.harmonics == high.harmonics:
            return Verdict(0.0, None, step.smallest)
        before = low.linear.recover(step.omega, low.coefficients(step.x))
        outputs = outputs_of(step.measure, before, self.goal)
        found = estimate(low, high, step.x, step.omega, outputs, step.solve, step.events)
        again = None
        start = high.coefficients(found.start)
        if found.bound > self.threshold:
            again = self._needed(step, outputs, found)
        elif self.guarded and (found.bound > 0.0 or not covers(low, high)):
            doubted = GuardedAlert(threshold=self.threshold).judge(step)
            if doubted.again is not None or not covers(low, high):
                return replace(doubted, indicator=max(doubted.indicator, found.bound))
        return Verdict(found.bound, again, step.smallest, start)

    def _needed(self, step: Step, outputs: Outputs, found: Estimate) -> Harmonics:
        """Return the harmonics of the repeat."""
        low, high = step.balance, step.reference
        if found.mean is None:
            return high.harmonics
        worst = np.argsort(-found.errors, kind="stable")[:GOALS]
        missing = tuple(h for h in high.harmonics if h not in low.harmonics)
        parts = contributions(low, high, step.omega, outputs.some(worst), found)
        # contributions add up only in a linear problem: the less linear this one is, the fewer are left out
        allowed = self.left_out * self.threshold * max(1.0 - found.doubt, 0.0)
        chosen = chosen_harmonics(parts, missing, max(allowed, NEGLIGIBLE_CHANGE))
        return tuple(sorted({*low.harmonics, *chosen}))


def chosen_harmonics(parts: ComplexArray, missing: Harmonics, allowed: float) -> Harmonics:
    """Return the missing harmonics with the largest contributions, until the sum of the others is below a limit.

    Parameters
    ----------
    parts
        (k, n_missing) relative change of each output by each missing harmonic.
    missing
        The missing harmonics.
    allowed
        Limit of the sum of magnitudes of the neglected contributions to one output. At least one harmonic is chosen.
    """
    size = np.abs(parts)
    order = np.argsort(-size.max(axis=0), kind="stable")
    left = size.sum(axis=1)
    count = 0
    while count < len(missing) and (count == 0 or left.max() > allowed):
        left = size[:, order[count + 1 :]].sum(axis=1)
        count += 1
    return tuple(sorted(missing[i] for i in order[:count]))
