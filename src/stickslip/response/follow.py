"""How branches of vibrations are followed by arc length."""

import numpy as np

from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.dlft import DynamicLagrangian
from stickslip.solve.branch import Following, StepControl
from stickslip.solve.newton_method import Newton

LARGEST = 0.25  # arc length of the largest step: a quarter of the size of the vibration, or `1 / points` of the range


def steps_through(length: float, points: int) -> StepControl:
    """Return the step control that takes `points` steps or more through a range of the parameter of some `length`."""
    # a range of a single frequency has no length, and no step is taken in it
    return StepControl(scale=length / (points * LARGEST) or 1.0, first=0.05, largest=LARGEST)


def following_vibration(
    problem: HarmonicBalance | DynamicLagrangian, control: StepControl, newton: Newton
) -> Following:
    """Return how a branch of a periodic problem is followed: the static part would hide the growth of the vibration."""
    weights = np.ones(problem.size)
    weights[: problem.linear.n] = 0.0
    return Following(newton=newton, control=control, weights=weights)
