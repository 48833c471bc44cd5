"""Limit cycles: where the damping over the amplitude is zero, each solved as the autonomous problem, with as many harmonics as it needs."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize_scalar

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.self_excited.curve import AmplitudePoint, at_amplitude
from stickslip.response.self_excited.problem import SelfExcited
from stickslip.solve.linear import Dense, factorised
from stickslip.solve.newton_method import Newton, newton

MORE = 2  # times the harmonics, and one, at each step
MOST_HALVINGS = 30
SHARP = 1e-4  # of ln a, to which an extreme of the damping is found: its value is then known to the square of that
BRACKETED = 1.0  # times the distance of the two amplitudes by which a cycle may lie outside of them


@dataclass(frozen=True, eq=False)
class LimitCycle:
    """A periodic motion that nothing drives and nothing has to keep going.

    Parameters
    ----------
    amplitude
        Of the coordinate that stands for the motion, in its first harmonic, m.
    omega
        rad/s.
    slope
        ``dζ / d ln a``: positive where friction grows faster with the amplitude than what feeds the motion, so that it is attracting.
    order
        Highest harmonic.
    change
        Of the amplitude or the frequency, relative and the larger, by the last raise of the harmonics; NaN where there was none.
    enough
        Whether that is below what was asked for.
    coefficients
        (order + 1, n_retained) complex amplitudes, m.
    unknowns
        Of the autonomous equation.
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
        """Whether motions of its own family with nearby amplitudes come to it."""
        return self.slope > 0.0


def limit_cycles(
    problem: SelfExcited,
    curve: Sequence[AmplitudePoint],
    *,
    most_harmonics: int = 0,
    tolerance: float = 1e-5,
) -> list[LimitCycle]:
    """Return the limit cycles of a mode, by growing amplitude.

    Parameters
    ----------
    problem
        The mode.
    curve
        Its damping over the amplitude, in the order of the branch.
    most_harmonics
        Harmonics are raised, to twice as many and one at a time, while they change the amplitude by more than the `tolerance`, relative,
        up to so many; fewer than there are: none is raised.
    """
    found: list[LimitCycle] = []
    known = with_extremes(problem, curve)
    for before, after in pairwise(known):
        if before.level * after.level > 0.0 or before.level == after.level:
            continue
        cycle = _between(problem, before, after)
        if cycle is not None:
            found.append(_refined(problem, cycle, most_harmonics, tolerance))
    return sorted(found, key=lambda c: c.amplitude)


def with_extremes(problem: SelfExcited, curve: Sequence[AmplitudePoint]) -> list[AmplitudePoint]:
    """Return the solutions of a curve with the motions of most and of least damping between them, which may lie just beyond zero."""
    known = [p for p in curve if p.converged]
    out = known[:1]
    for i in range(1, len(known) - 1):
        three = known[i - 1 : i + 2]
        a, b, c = (p.level for p in three)
        extreme = _extreme(problem, three) if (b - a) * (b - c) > 0.0 else three[1]
        out += sorted((three[1], extreme), key=lambda p: p.amplitude)
    return list(dict.fromkeys([*out, *known[-1:]]))


def _extreme(problem: SelfExcited, three: Sequence[AmplitudePoint]) -> AmplitudePoint:
    """Return the motion of most (least) damping between three of which that in the middle has more (less) than its neighbours."""
    upward = -1.0 if three[1].level > three[0].level else 1.0
    best = three[1]

    def level(log_amplitude: float) -> float:
        nonlocal best
        found = at_amplitude(problem, float(np.exp(log_amplitude)), [best.unknowns])
        if not found.converged:
            return np.inf
        if upward * found.level < upward * best.level:
            best = found
        return upward * found.level

    first, last = np.log([three[0].amplitude, three[2].amplitude])
    if first != last:
        bounds = min(first, last), max(first, last)
        minimize_scalar(level, bounds=bounds, method="bounded", options={"xatol": SHARP})
    return best


def solve_cycle(
    problem: SelfExcited, start: FloatArray, amplitude: float, omega: float
) -> FloatArray | None:
    """Return the unknowns of a limit cycle from a motion over its amplitude; None where there is none nearby.

    Parameters
    ----------
    problem
        The mode.
    start
        (size,) unknowns of a motion over its amplitude.
    amplitude, omega
        Its amplitude, m, and frequency, rad/s.
    """
    equation = problem.limit_cycle()
    guess = np.append(start, [np.log(omega / problem.mode.omega), np.log(amplitude)])
    options = Newton(
        tolerance=problem.how.newton.tolerance,
        max_iterations=60,
        linear=problem.how.newton.linear,
    )
    found = newton(lambda y: equation.linearise(y, 0.0), guess, options)
    return found.x if found.status.converged else None


def _between(
    problem: SelfExcited, before: AmplitudePoint, after: AmplitudePoint
) -> LimitCycle | None:
    """Return the cycle between two points, which are brought together where it is not found from them: slip begins with a corner."""
    for _ in range(MOST_HALVINGS):
        share = before.level / (before.level - after.level)
        y = before.unknowns + share * (after.unknowns - before.unknowns)
        ends = np.log([before.amplitude, after.amplitude])
        here = float(ends[0] + share * (ends[1] - ends[0]))
        found = solve_cycle(problem, y[:-2], float(np.exp(here)), problem.omega(y))
        if found is not None and abs(found[-1] - here) <= BRACKETED * abs(ends[1] - ends[0]):
            return _cycle(problem, found, np.nan, enough=False)
        middle = at_amplitude(
            problem, float(np.exp(np.mean(ends))), [before.unknowns, after.unknowns]
        )
        if not middle.converged:
            return None
        on_first_side = middle.level * before.level > 0.0
        before, after = (middle, after) if on_first_side else (before, middle)
    return None


def _refined(problem: SelfExcited, cycle: LimitCycle, most: int, tolerance: float) -> LimitCycle:
    """Raise the harmonics until the amplitude stays."""
    while cycle.order < most:
        more = problem.with_order(min(MORE * cycle.order + 1, most))
        start = more.unknowns(cycle.coefficients / cycle.amplitude, cycle.omega, 0.0)[:-2]
        found = solve_cycle(more, start, cycle.amplitude, cycle.omega)
        if found is None:
            break
        moved = abs(float(np.exp(found[-1])) / cycle.amplitude - 1.0)
        change = max(moved, abs(more.omega(found) / cycle.omega - 1.0))
        cycle = _cycle(more, found, change, enough=change <= tolerance)
        if cycle.enough:
            break
    return cycle


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
    """Return ``dζ / d ln a`` along the motions that damping keeps going, at a limit cycle."""
    y, p = np.append(cycle[:-1], 0.0), float(cycle[-1])
    at = problem.over_amplitude().linearise(y, p)
    inverse = factorised(Dense(), at.jac)
    change = None if inverse is None else inverse(-at.jac_p)
    return np.nan if change is None else 0.5 * float(change[-1]) * float(np.exp(-cycle[-2]))
