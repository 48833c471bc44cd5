"""Onset of subharmonic resonances, which no branch of the response leads to.

The branch is isolated as a rule. It is looked for by Newton's method from the response of one period with the motion added that it resists least at the
lower frequency, of many amplitudes and phases; and then followed through the frequencies, both ways.
"""

from collections.abc import Iterator

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.response.continuation.branch import following_vibration, steps_through
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.system import System
from stickslip.solve.branch import Following
from stickslip.solve.continuation import Point, reversed_point, start_point, trace
from stickslip.solve.newton_method import Newton, newton

FREQUENCIES = 9  # within the range at which motions are looked for
AMPLITUDES = (1.0, 2.0, 4.0, 8.0, 0.5, 16.0)  # over that of the response of one period
PHASES = 6  # within the turn after which the motion is the same one, some periods of the load later
LEAST = 1e-3  # of the whole motion in the lowest harmonic: less is the response of one period
CLOSED = 0.02  # distance from where it began, of its size and of the range, at which a branch has closed ...
FEW = 8  # ... but not within so many points
BESIDE = 0.1  # of the range by which a branch may leave it
POINTS = 200  # of a branch either way


def motions_of_several_periods(
    system: System,
    balance: HarmonicBalance,
    omega_range: tuple[float, float],
    periods: int,
    points: int,
    options: Newton,
) -> list[Point]:
    """Return motions of several periods of the load through the frequencies, in the order of their branch.

    Parameters
    ----------
    system
        System of `balance`.
    balance
        Balance at the lower frequency.
    omega_range
        Range of the lower frequency, rad/s.
    periods
        Periods of the load in one period of the motion.
    points
        Steps through the range, at least.
    options
        Corrector.

    Raises
    ------
    InputError
        If none is found.
    """
    first, last = omega_range
    way = following_vibration(balance, steps_through(last - first, points), options)
    for omega in np.linspace(first, last, FREQUENCIES + 2)[1:-1]:
        for x in _motions(system, balance, float(omega), periods, options):
            start = start_point(balance, x, float(omega), way)
            if not start.solution.status.converged:
                continue
            up = _followed(balance, start, omega_range, last, way)
            down = _followed(balance, reversed_point(start), omega_range, first, way)
            return [*down[::-1], start, *up]
    tries = FREQUENCIES * len(AMPLITUDES) * PHASES
    raise input_error(
        "omega_range",
        f"holds no motion of {periods} periods that was found from {tries} starts, which proves that there is none as little as a march in time does",
        "Give a narrower range, another value or a larger load; `bifurcations.subharmonic_branch` takes a start of your own.",
    )


def _motions(
    system: System, balance: HarmonicBalance, omega: float, periods: int, options: Newton
) -> Iterator[FloatArray]:
    """Yield motions at a frequency whose lowest harmonic is there."""
    plain = without_branch(system, balance, options, omega)
    if not plain.status.converged:
        return
    n = balance.linear.n
    own = slice(n, 3 * n)  # the lowest harmonic: cosine and sine parts
    jac = balance.linearise(plain.x, omega).dense_jac()[own, own]
    shape = np.linalg.svd(jac)[2][-1]
    motion = (shape[:n] - 1j * shape[n:]) / np.linalg.norm(shape)
    size = float(np.linalg.norm(plain.x[n:]))
    for amplitude in AMPLITUDES:
        for turn in np.arange(PHASES) * 2.0 * np.pi / (periods * PHASES):
            added = amplitude * size * motion * np.exp(1j * turn)
            guess = plain.x.copy()
            guess[own] += np.concatenate([added.real, -added.imag])
            found = newton(lambda v: balance.linearise(v, omega), guess, options)
            if found.status.converged and _subharmonic(balance, found.x):
                yield found.x


def _subharmonic(balance: HarmonicBalance, x: FloatArray) -> bool:
    n = balance.linear.n
    return bool(np.linalg.norm(x[n : 3 * n]) > LEAST * np.linalg.norm(x[n:]))


def _followed(
    balance: HarmonicBalance, start: Point, omega_range: tuple[float, float], end: float, way: Following
) -> list[Point]:
    """Follow the branch until it leaves the range, closes or is no subharmonic one any more."""
    found: list[Point] = []
    first, last = omega_range
    beside = BESIDE * (last - first)
    for point in trace(balance, start, end, way):
        lost = not point.solution.status.converged or not _subharmonic(balance, point.x)
        if lost or len(found) == POINTS or not first - beside < point.p < last + beside:
            break
        found.append(point)
        near = np.linalg.norm(point.x - start.x) < CLOSED * np.linalg.norm(start.x)
        if len(found) > FEW and near and abs(point.p - start.p) < CLOSED * (last - first):
            break
    return found
