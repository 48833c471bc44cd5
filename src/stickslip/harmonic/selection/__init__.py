"""Which harmonics a frequency needs: strategies, one a file, and their names."""

from importlib import import_module
from typing import Any

from stickslip.harmonic.selection.strategy import Strategy

# file → class
STRATEGIES = {
    "jacobian_alert": "JacobianAlert",
    "guarded_alert": "GuardedAlert",
    "goal_oriented": "GoalOriented",
    "grolet": "Grolet",
    "jaumouille": "Jaumouille",
    "laxalde": "Laxalde",
    "maple": "Maple",
    "suess_jacobian": "SuessJacobian",
    "suess_spectral": "SuessSpectral",
}


def strategy_named(name: str, threshold: float | None = None) -> Strategy:
    """Return a strategy with its own parameters, but for a threshold; its file is loaded when it is first asked for.

    Parameters
    ----------
    name
        One of `STRATEGIES`.
    threshold
        Indicator above which more harmonics are asked for; None: that of the strategy's source.
    """
    made: Any = getattr(import_module(f"{__name__}.{name}"), STRATEGIES[name])
    strategy: Strategy = made() if threshold is None else made(threshold=threshold)
    return strategy
