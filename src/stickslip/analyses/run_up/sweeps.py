"""The sweep along each engine order of a run-up."""

from collections.abc import Iterable
from typing import Any

from stickslip.analyses.forced_response.problem import sweep_through
from stickslip.response.forced.response import Sweep


def sweep_along(settings: Any, engine_order: int, driven: Iterable[int] = (1,)) -> Sweep:
    """Return the sweep along an engine order, as defined by a study's tables.

    Parameters
    ----------
    settings
        Settings with the tables ``run_up``, ``harmonics`` and ``solver``.
    engine_order
        Ratio of the frequency of the first harmonic to the speed.
    driven
        Harmonics of the loads.
    """
    table = settings.run_up
    lowest, highest = (engine_order * speed for speed in table.speeds)
    return sweep_through(settings, table, (lowest, highest), driven)
