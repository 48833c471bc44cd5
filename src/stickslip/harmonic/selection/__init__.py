"""Strategies of harmonic selection, one per file; their names are in `stickslip.harmonic.strategies`."""

from functools import cache
from importlib import import_module
from typing import Any

from stickslip.harmonic.selection.strategy import Strategy
from stickslip.harmonic.strategies import STRATEGIES


def strategy_named(name: str, threshold: float | None = None, **options: bool) -> Strategy:
    """Return the strategy with a name; threshold and options replace its defaults.

    The module of the strategy is imported at first use.

    Parameters
    ----------
    name
        One of `STRATEGIES`.
    threshold
        Indicator above which more harmonics are needed; None: the value of the strategy's source.
    options
        ``per_dof`` and ``repeats``, for strategies that have them (`strategies.options_of`).
    """
    own = _class_of(name)
    strategy: Strategy = own(**options) if threshold is None else own(threshold=threshold, **options)
    return strategy


@cache
def _class_of(name: str) -> Any:
    file, own = STRATEGIES[name]
    return getattr(import_module(f"{__name__}.{file}"), own)
