"""Stability of a limit cycle by its multipliers; of a wheel against every wave."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.self_excited.cycles import LimitCycle, solve_cycle
from stickslip.response.self_excited.problem import SelfExcited
from stickslip.response.stability.found import Stability
from stickslip.response.stability.multipliers import stability_in_time
from stickslip.response.stability.waves import WaveDisturbance, growing_wave, wave_disturbances
from stickslip.response.time.floquet import Floquet
from stickslip.response.time.sectors import all_in_time


@dataclass(frozen=True, eq=False)
class CycleStability:
    """Growth or decay of small disturbances of a limit cycle.

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


@by_one_thread
def cycle_stability(problem: SelfExcited, cycle: LimitCycle) -> CycleStability:
    """Return the stability of a limit cycle of a problem with as many harmonics.

    What half as many harmonics change in each multiplier is its error, and so is the distance of the one along the cycle from 1.

    Raises
    ------
    InputError
        If the structure cannot be marched in time, or a wheel has not all its waves.
    """
    found, along = _of(problem, cycle.unknowns)
    errors = np.full(found.errors.size, np.inf)
    fewer = _with_fewer(problem, cycle)
    if fewer is not None:
        other, _ = _of(*fewer)
        size = min(found.errors.size, other.errors.size)
        errors[:size] = _changes(found.floquet, other.floquet)[:size]
        errors[size:] = 0.0
    errors = np.maximum(errors + found.errors, abs(along - 1.0))
    found = replace(found, errors=errors, moduli=None)
    if problem.system.structure.wheel is None:
        return CycleStability(found, along, None)
    every = wave_disturbances(problem.system, _gaps(problem, cycle.unknowns), cycle.omega)
    others = sorted(every, key=lambda d: abs(d.multiplier - along))[1:]
    return CycleStability(found, along, growing_wave(others, found.multiplier))


def _of(problem: SelfExcited, unknowns: FloatArray) -> tuple[Stability, complex]:
    """Return the stability without the disturbance along the motion, and the multiplier of this."""
    own = all_in_time(problem.system, _gaps(problem, unknowns))
    found = stability_in_time(own, problem.omega(unknowns))
    values = found.floquet.multipliers
    if found.unknown or not values.size:
        return found, complex(np.nan)
    at = int(np.argmin(np.abs(values - 1.0)))
    rest = Floquet(np.delete(values, at))
    errors = np.delete(found.errors, at)
    return replace(found, floquet=rest, errors=errors, moduli=None), complex(values[at])


def _gaps(problem: SelfExcited, unknowns: FloatArray) -> ComplexArray:
    motion = float(np.exp(unknowns[-1])) * problem.relative(unknowns)
    return np.asarray(motion @ problem.balance.interface.gap_operator.T)


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
