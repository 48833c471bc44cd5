"""Campbell diagrams of a wheel, one for each travelling wave.

An engine order meets only modes of the wave that it excites.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.waves import excited_wave
from stickslip.response.rotating.campbell import Campbell, campbell


def cyclic_campbell(
    sector_at: Callable[[float], CyclicSector],
    speeds: Sequence[float] | FloatArray,
    n_modes: int,
    engine_orders: Sequence[int],
    *,
    wave_numbers: Sequence[int] | None = None,
    coriolis: bool = False,
    tolerance: float = 1e-6,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[Campbell, ...]:
    """Track the modes of a wheel over rotor speed, wave by wave.

    Parameters
    ----------
    sector_at
        Function of the speed, rad/s, that returns the sector. It is called for each wave and speed, so it should cache
        expensive results.
    speeds
        Ascending speeds, rad/s.
    n_modes
        Number of modes of each wave.
    engine_orders
        Positive engine orders. On n_s equal sectors, engine order m excites wave number ``m mod n_s`` and has crossings
        in its diagram only.
    wave_numbers
        Wave numbers of the diagrams; None: the ones excited by the engine orders. Without Coriolis forces, waves k and
        n_s - k have the same frequencies and one diagram, with the smaller number.
    coriolis, tolerance
        As in `campbell`.
    progress
        Function called with wave number and speed.

    Returns
    -------
    tuple of Campbell
        Diagrams by wave number.

    Raises
    ------
    InputError
        If a wave number is not between 0 and n_s - 1, or `campbell` refuses its arguments.
    """
    sectors = sector_at(float(speeds[0])).sectors

    def name(wave: int) -> int:
        return wave if coriolis else min(wave, sectors - wave)

    by_order = {m: name(excited_wave(m, sectors)) for m in engine_orders}
    asked = by_order.values() if wave_numbers is None else wave_numbers
    wrong = [k for k in asked if not 0 <= k < sectors]
    if wrong:
        raise input_error(
            "cyclic_campbell: wave_numbers",
            f"must be from 0 to {sectors - 1}, got {wrong[0]}",
            "A forward wave of d nodal diameters has the number of sectors minus d.",
        )
    diagrams = []
    for wave in sorted({name(k) for k in asked}):
        found = campbell(
            partial(_wave_at, sector_at, wave),
            speeds,
            n_modes,
            [m for m, own in by_order.items() if own == wave],
            coriolis=coriolis,
            tolerance=tolerance,
            progress=None if progress is None else partial(progress, wave),
        )
        diagrams.append(replace(found, wave_number=wave, sectors=sectors))
    return tuple(diagrams)


def _wave_at(sector_at: Callable[[float], CyclicSector], wave: int, speed: float) -> Structure:
    return travelling_wave(sector_at(speed), wave)
