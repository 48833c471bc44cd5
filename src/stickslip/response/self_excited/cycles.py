"""Limit cycles: zeros of the damping over the amplitude, solved as autonomous problems with adaptive harmonics.

Floquet multipliers give the stability of a cycle, on a wheel against disturbances of every wave.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.self_excited.curve import AmplitudePoint, at_amplitude
from stickslip.response.self_excited.problem import SelfExcited
from stickslip.response.stability.found import Floquet, Stability
from stickslip.response.stability.multipliers import stability_in_time
from stickslip.response.stability.waves import WaveDisturbance, growing_wave, wave_disturbances
from stickslip.response.time.sectors import all_in_time
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, newton

SHORTEST = 1e-3  # smallest step in the removal of damping, over the initial damping
FARTHEST_STEP = 0.2  # largest change of ln a in such a step: beyond, it is another motion
MORE = 2  # harmonics are raised from h to MORE h + 1
SMALL = 1e-5  # change of the motion for the derivative of its energy
SHARP = 1e-4  # accuracy of ln a at an extreme of the damping, whose value is then accurate to the square
AT_A_FOLD = (
    0.02  # smallest allowed distance in ln a between cycle and bracket: a curve may turn back between two points
)
BRACKETED = 1.0  # distance in ln a between cycle and bracket, over the width of the bracket


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """Self-sustained periodic motion.

    Parameters
    ----------
    amplitude
        Amplitude of the prescribed coordinate in the first harmonic, m.
    omega
        Frequency, rad/s.
    slope
        ``dζ / d ln √E``, where the kinetic energy E of the first harmonic measures the amplitude of the mode. Positive
        if the dissipation by friction grows faster than the energy input: then the cycle is attracting.
    order
        Highest harmonic.
    change
        Relative change of amplitude or frequency by the last raise of the harmonics, the larger one; NaN without a
        raise.
    enough
        Whether the change is below the tolerance.
    coefficients
        (order + 1, n_retained) complex amplitudes, m.
    unknowns
        Unknowns of the autonomous problem.
    """

    amplitude: float
    omega: float
    slope: float
    order: int
    change: float
    enough: bool
    coefficients: ComplexArray
    unknowns: FloatArray

    @property
    def attracting(self) -> bool:
        """Whether motions of the same mode with nearby amplitudes approach the limit cycle."""
        return self.slope > 0.0


@by_one_thread
def limit_cycles(
    problem: SelfExcited, curve: Sequence[AmplitudePoint], *, most_harmonics: int = 0, tolerance: float = 1e-5
) -> list[LimitCycle]:
    """Return the limit cycles of a mode, by ascending amplitude.

    Parameters
    ----------
    problem
        The mode.
    curve
        Damping over the amplitude, in the order of the branch.
    most_harmonics
        Highest harmonic. Harmonics are raised from h to 2 h + 1 while amplitude or frequency change by more than
        `tolerance`. They stay fixed if this is at most the initial number.
    """
    found: list[LimitCycle] = []
    for before, after in crossings(with_extremes(problem, curve)):
        cycle = _between(problem, before, after)
        if cycle is not None:
            found.append(_refined(problem, cycle, most_harmonics, tolerance))
    return sorted(found, key=lambda c: c.amplitude)


def crossings(curve: Sequence[AmplitudePoint]) -> list[tuple[AmplitudePoint, AmplitudePoint]]:
    """Return the neighbouring points of a curve between which the damping changes its sign."""
    known = [p for p in curve if p.converged]
    return [(a, b) for a, b in pairwise(known) if a.level * b.level <= 0.0 and a.level != b.level]


def with_extremes(problem: SelfExcited, curve: Sequence[AmplitudePoint]) -> list[AmplitudePoint]:
    """Add extremes of the damping to the solutions of a curve.

    These are the largest one, and others that may lie just beyond zero.
    """
    known = [p for p in curve if p.converged]
    out, top = known[:1], max((p.level for p in known), default=0.0)
    for i in range(1, len(known) - 1):
        three = known[i - 1 : i + 2]
        a, b, c = (p.level for p in three)
        near = b == top or abs(b) < abs(b - a) + abs(b - c)
        extreme = _extreme(problem, three) if near and (b - a) * (b - c) > 0.0 else three[1]
        out += sorted((three[1], extreme), key=lambda p: p.amplitude)
    return list(dict.fromkeys([*out, *known[-1:]]))


def _extreme(problem: SelfExcited, three: Sequence[AmplitudePoint]) -> AmplitudePoint:
    """Return the motion with extreme damping near the middle one of three.

    This one has more or less damping than both others.
    """
    upward = -1.0 if three[1].level > three[0].level else 1.0
    best = three[1]

    def level(log_amplitude: float) -> float:
        nonlocal best
        found = at_amplitude(problem, float(np.exp(log_amplitude)), [best.unknowns])
        if not found.converged:
            return max(upward * p.level for p in three)
        if upward * found.level < upward * best.level:
            best = found
        return upward * found.level

    first, last = np.log([three[0].amplitude, three[2].amplitude])
    if first != last:
        bounds = min(first, last), max(first, last)
        minimize_scalar(level, bounds=bounds, method="bounded", options={"xatol": SHARP})
    return best


def solve_cycle(
    problem: SelfExcited, start: FloatArray, amplitude: float, omega: float, level: float = 0.0
) -> FloatArray | None:
    """Return the unknowns of a limit cycle from a nearby motion; None without convergence.

    Parameters
    ----------
    problem
        The mode.
    start
        (size,) unknowns of a motion over its amplitude.
    amplitude, omega
        Initial amplitude, m, and frequency, rad/s.
    level
        Prescribed level of damping; zero for a limit cycle.
    """
    equation = problem.limit_cycle()
    guess = np.append(start, [np.log(omega / problem.mode.omega), np.log(amplitude)])
    options = Newton(tolerance=problem.how.newton.tolerance, max_iterations=60, linear=problem.how.newton.linear)
    found = newton(lambda y: equation.linearise(y, level), guess, options)
    return found.x if found.status.converged else None


def _between(problem: SelfExcited, before: AmplitudePoint, after: AmplitudePoint) -> LimitCycle | None:
    """Return the cycle between two points.

    It is solved directly, or by gradual removal of damping from either, since slip begins with a corner.
    """
    share = before.level / (before.level - after.level)
    y = before.unknowns + share * (after.unknowns - before.unknowns)
    ends = np.log([before.amplitude, after.amplitude])
    here = float(ends[0] + share * (ends[1] - ends[0]))
    near = max(BRACKETED * abs(ends[1] - ends[0]), AT_A_FOLD)
    tries: tuple[Callable[[], FloatArray | None], ...] = (
        lambda: solve_cycle(problem, y[:-2], float(np.exp(here)), problem.omega(y)),
        lambda: _undamped(problem, before),
        lambda: _undamped(problem, after),
    )
    for attempt in tries:
        found = attempt()
        if found is not None and abs(found[-1] - here) <= near:
            return _cycle(problem, found, np.nan, enough=False)
    return None


def _undamped(problem: SelfExcited, point: AmplitudePoint) -> FloatArray | None:
    """Remove the damping of a motion in as many steps as needed."""
    level = problem.level(point.level, point.omega)
    known = np.append(point.unknowns[:-1], np.log(point.amplitude))
    left, step = 1.0, 0.5
    while step > SHORTEST:
        ahead = max(left - step, 0.0)
        found = solve_cycle(problem, known[:-2], float(np.exp(known[-1])), problem.omega(known), ahead * level)
        if found is None or abs(found[-1] - known[-1]) > FARTHEST_STEP:
            step *= 0.5
            continue
        if ahead == 0.0:
            return found
        known, left = found, ahead
    return None


def _refined(problem: SelfExcited, cycle: LimitCycle, most: int, tolerance: float) -> LimitCycle:
    """Raise the harmonics until amplitude and frequency converge."""
    while cycle.order < most:
        more = problem.with_order(min(MORE * cycle.order + 1, most))
        start = more.unknowns(cycle.coefficients / cycle.amplitude, cycle.omega, 0.0)[:-2]
        found = solve_cycle(more, start, cycle.amplitude, cycle.omega)
        if found is None:
            break
        moved = abs(float(np.exp(found[-1])) / cycle.amplitude - 1.0)
        change = max(moved, abs(more.omega(found) / cycle.omega - 1.0))
        if change <= tolerance:
            change = max(change, _foretold(more, found))
        cycle = _cycle(more, found, change, enough=change <= tolerance)
        if cycle.enough:
            break
    return cycle


def _foretold(problem: SelfExcited, y: FloatArray) -> float:
    """Predict the change of amplitude or frequency by a Newton step with the judging harmonics.

    It is relative, and the larger one of both.

    The result is infinite if a wheel lacks their waves.
    """
    wider = problem.judging()
    if wider is None:
        return np.inf
    motion = problem.relative(y)
    start = np.append(wider.unknowns(motion, problem.omega(y), 0.0)[:-1], y[-1])
    at = wider.limit_cycle().linearise(start, 0.0)
    inverse = factorised(problem.how.newton.linear, at.jac)
    step = None if inverse is None else inverse(-at.residual)
    return np.inf if step is None else float(np.max(np.abs(step[-2:])))


def _cycle(problem: SelfExcited, y: FloatArray, change: float, *, enough: bool) -> LimitCycle:
    amplitude = float(np.exp(y[-1]))
    return LimitCycle(
        amplitude,
        problem.omega(y),
        _slope(problem, y),
        problem.balance.order,
        change,
        enough,
        amplitude * problem.relative(y),
        y,
    )


def _slope(problem: SelfExcited, cycle: FloatArray) -> float:
    """Return ``dζ / d ln √E`` along the motions sustained by damping, at a limit cycle.

    The amplitude of one coordinate may fall while the motion grows, as at the onset of slip; the kinetic energy E of
    the first harmonic does not.
    """
    y, p = np.append(cycle[:-1], 0.0), float(cycle[-1])
    equation = problem.over_amplitude()
    at = equation.linearise(y, p)
    inverse = factorised(problem.how.newton.linear, at.jac)
    change = None if inverse is None else inverse(-at.jac_p)
    if change is None:
        return np.nan
    step = SMALL / max(1.0, float(np.linalg.norm(change)))
    ends = [_energy(problem, y + side * step * change, p + side * step) for side in (-1.0, 1.0)]
    grown = 0.5 * float(np.log(ends[1] / ends[0])) / (2.0 * step)
    return 0.5 * float(change[-1]) * float(np.exp(-cycle[-2])) / grown


def _energy(problem: SelfExcited, y: FloatArray, log_amplitude: float) -> float:
    """Return the kinetic energy of the first harmonic, up to a constant factor."""
    omega, motion = problem.omega(y), problem.relative(y)
    linear = problem.balance.linear
    moving = linear.recover(omega, motion)[1]
    mass = problem.system.structure.of_harmonic(1).mass
    return float(omega**2 * np.exp(2.0 * log_amplitude) * np.vdot(moving, mass @ moving).real)


@dataclass(frozen=True, eq=False)
class CycleStability:
    """Growth or decay of small disturbances of a limit cycle.

    Parameters
    ----------
    stability
        Stability against all disturbances except the one along the cycle, which only shifts time.
    along
        Multiplier of the disturbance along the cycle. Its exact value is 1, and the difference indicates the error of
        the motion.
    wave
        Disturbance of a wheel with the deciding multiplier; None for a single structure, and if unknown.
    """

    stability: Stability
    along: complex
    wave: WaveDisturbance | None


@by_one_thread
def cycle_stability(problem: SelfExcited, cycle: LimitCycle) -> CycleStability:
    """Return the stability of a limit cycle; the problem has the same harmonics.

    The error of each multiplier is its change with half as many harmonics, plus the distance from 1 of the multiplier
    along the cycle.

    Raises
    ------
    InputError
        If the structure has no equations in time, or a wheel lacks waves.
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
    """Return the stability without the disturbance along the motion, and the multiplier of this disturbance."""
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
    """Return the distance of each multiplier from its partner in another solution."""
    left, out = other.multipliers.copy(), np.full(found.multipliers.size, np.inf)
    for i, value in enumerate(found.multipliers):
        if np.all(np.isnan(left)):
            break
        nearest = int(np.nanargmin(np.abs(left - value)))
        out[i] = abs(left[nearest] - value)
        left[nearest] = np.nan
    return out
