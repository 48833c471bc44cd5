"""Whether a limit cycle is stable: multipliers of all its disturbances but the one along itself; of a wheel against every wave."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.fourier import to_real
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.self_excited.cycles import LimitCycle, solve_cycle
from stickslip.response.self_excited.problem import SelfExcited
from stickslip.response.stability.multipliers import Stability, motion_stability
from stickslip.response.stability.waves import (
    WaveDisturbance,
    growing_wave,
    sector_gaps,
    wave_disturbances,
    whole_wheel,
)
from stickslip.response.time.floquet import Floquet
from stickslip.response.time.sectors import SectorsInTime


@dataclass(frozen=True, eq=False)
class CycleStability:
    """What becomes of small disturbances of a limit cycle.

    Parameters
    ----------
    stability
        Of all disturbances but that along the cycle, which only moves the beginning of time.
    along
        Multiplier of that one, which is 1: how far it is off tells how good the motion is.
    wave
        Of a wheel: the disturbance whose multiplier decides; None for a single structure, and where nothing is known.
    """

    stability: Stability
    along: complex
    wave: WaveDisturbance | None


def cycle_stability(problem: SelfExcited, cycle: LimitCycle) -> CycleStability:
    """Return the stability of a limit cycle of a problem with as many harmonics.

    What half as many harmonics change in each multiplier is its error, and so is the distance of the one along the cycle from 1.

    Raises
    ------
    InputError
        If the structure cannot be marched in time, or a wheel has not all its waves.
    """
    whole = (
        whole_wheel(problem.system) if isinstance(problem.system.structure, TunedWheel) else None
    )
    found, along = _of(problem, cycle.unknowns, whole)
    errors = np.full(found.errors.size, np.inf)
    fewer = _with_fewer(problem, cycle)
    if fewer is not None:
        other, _ = _of(*fewer, whole)
        size = min(found.errors.size, other.errors.size)
        errors[:size] = _changes(found.floquet, other.floquet)[:size]
        errors[size:] = 0.0
    errors = np.maximum(errors + found.errors, abs(along - 1.0))
    found = replace(found, errors=errors)
    if whole is None:
        return CycleStability(found, along, None)
    gaps = _gaps(problem, cycle.unknowns, whole)
    every = wave_disturbances(whole, gaps, problem.omega(cycle.unknowns))
    others = [d for d in every if abs(d.multiplier - along) > 0.0]
    return CycleStability(found, along, growing_wave(others, found.multiplier))


def _of(
    problem: SelfExcited, unknowns: FloatArray, whole: SectorsInTime | None
) -> tuple[Stability, complex]:
    """Return the stability without the disturbance along the motion, and the multiplier of this."""
    omega, gaps = problem.omega(unknowns), _gaps(problem, unknowns, whole)
    structure, contacts = problem.system.structure, problem.system.interface
    if whole is not None:
        structure, contacts = whole.structure, whole.contacts
    found = motion_stability(structure, contacts, gaps, omega)
    values = found.floquet.multipliers
    if found.unknown or not values.size:
        return found, complex(np.nan)
    own = int(np.argmin(np.abs(values - 1.0)))
    rest = Floquet(np.delete(values, own))
    return replace(found, floquet=rest, errors=np.delete(found.errors, own)), complex(values[own])


def _gaps(problem: SelfExcited, unknowns: FloatArray, whole: SectorsInTime | None) -> FloatArray:
    amplitude = float(np.exp(unknowns[-1]))
    motion = amplitude * problem.relative(unknowns)
    gaps = motion @ problem.balance.interface.gap_operator.T
    return to_real(gaps) if whole is None else sector_gaps(whole, gaps)


def _with_fewer(problem: SelfExcited, cycle: LimitCycle) -> tuple[SelfExcited, FloatArray] | None:
    order = (cycle.order - 1) // 2
    if order < 1:
        return None
    fewer = problem.with_order(order)
    start = fewer.unknowns(cycle.coefficients / cycle.amplitude, cycle.omega, 0.0)[:-2]
    found = solve_cycle(fewer, start, cycle.amplitude, cycle.omega)
    return None if found is None else (fewer, found)


def _changes(found: Floquet, other: Floquet) -> FloatArray:
    """Return the distance of each multiplier from its partner among others."""
    left, out = other.multipliers.copy(), np.full(found.multipliers.size, np.inf)
    for i, value in enumerate(found.multipliers):
        if np.all(np.isnan(left)):
            break
        nearest = int(np.nanargmin(np.abs(left - value)))
        out[i] = abs(left[nearest] - value)
        left[nearest] = np.nan
    return out
