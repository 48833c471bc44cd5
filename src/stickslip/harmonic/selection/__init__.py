"""Which harmonics a frequency needs: strategies, one a file, and their names."""

from importlib import import_module
from typing import Any

from stickslip.harmonic.selection.strategy import Strategy

# name → file and class
STRATEGIES = {
    "jacobian_alert": ("jacobian_alert", "JacobianAlert"),
    "guarded_alert": ("guarded_alert", "GuardedAlert"),
    "goal_oriented": ("goal_oriented", "GoalOriented"),
    "grolet": ("grolet", "Grolet"),
    "jaumouille": ("jaumouille", "Jaumouille"),
    "laxalde": ("laxalde", "Laxalde"),
    "maple": ("maple", "Maple"),
    "suess_jacobian": ("suess_jacobian", "SuessJacobian"),
    "suess_spectral": ("suess_spectral", "SuessSpectral"),
    "always_low": ("fixed", "AlwaysLow"),
    "always_high": ("fixed", "AlwaysHigh"),
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
    file, own = STRATEGIES[name]
    made: Any = getattr(import_module(f"{__name__}.{file}"), own)
    strategy: Strategy = made() if threshold is None else made(threshold=threshold)
    return strategy
