"""Which harmonics a frequency needs: strategies, one a file, and their names."""

from dataclasses import fields
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
OPTIONS = ("per_dof", "repeats")


def strategy_named(name: str, threshold: float | None = None, **options: bool) -> Strategy:
    """Return a strategy with its own parameters, but for a threshold and options; its file is loaded when it is first asked for.

    Parameters
    ----------
    name
        One of `STRATEGIES`.
    threshold
        Indicator above which more harmonics are asked for; None: that of the strategy's source.
    options
        ``per_dof`` and ``repeats`` of those that have them (`options_of`).
    """
    own = _class_of(name)
    strategy: Strategy = (
        own(**options) if threshold is None else own(threshold=threshold, **options)
    )
    return strategy


def options_of(name: str) -> tuple[str, ...]:
    """Return which of the options ``per_dof`` and ``repeats`` a strategy has."""
    known = {field.name for field in fields(_class_of(name))}
    return tuple(option for option in OPTIONS if option in known)


def _class_of(name: str) -> Any:
    file, own = STRATEGIES[name]
    return getattr(import_module(f"{__name__}.{file}"), own)
