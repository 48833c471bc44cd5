"""Number of time steps in a period, from the stiffest contact that opens and closes.

A contact of stiffness k on the mass m that moves with it alone vibrates with √(k/m). An impact lasts half such a vibration. What the step makes
of it depends on the angle ``√(k/m) h``. Masses on stops, held against an integrator with exact events (`tests/test_step_choice.py`), are off by
less than 1 % below `FINE` and by 2 % below `ROUGH`. A contact that stays closed needs no fine steps, nor does one that slips.
"""

from collections.abc import Callable

from stickslip.response.time.start import TransientStart
from stickslip.response.time.stepping.marcher import Marcher

FINE, ROUGH = 0.2, 0.3  # rad
LOOK = 4  # periods after which contacts that open and close are known
MOST_STEPS = 8192  # in a period


def with_enough_steps(
    made: Callable[[int], Marcher], start: TransientStart, least: int, angle: float = FINE
) -> Marcher:
    """Return a marcher whose step follows the impacts of its first periods.

    Parameters
    ----------
    made
        Gives the marcher with so many steps a period.
    start
        Where the motion begins.
    least
        Steps in a period, which are doubled as often as necessary, up to `MOST_STEPS`.
    angle
        Largest one, rad.
    """
    marcher = made(least)
    state, record, seen = marcher.begun(start), marcher.record(), 0.0
    for _ in range(LOOK):
        if marcher.march(state, record) < 0:
            break
        seen = max(seen, marcher.turn(record))
    steps = least
    while seen > angle and 2 * steps <= MOST_STEPS:
        steps, seen = 2 * steps, seen / 2.0
    return marcher if steps == least else made(steps)
