"""Search for subharmonic resonances on branches isolated from the response.

Newton's method starts from the period-one response plus the motion of least resistance at the lower frequency, with
various amplitudes and phases. The branch of a solution is then followed over the frequency in both directions.
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

FREQUENCIES = 9  # of the search within the range
AMPLITUDES = (1.0, 2.0, 4.0, 8.0, 0.5, 16.0)  # over the amplitude of the period-one response
PHASES = 6  # within the range of distinct phases; beyond, the motion is the same some load periods later
LEAST = 1e-3  # share of the lowest harmonic in the motion, below which it is the period-one response
CLOSED = 0.02  # distance from its start, relative to the motion and to the range, at which a branch has closed ...
FEW = 8  # ... after at least this number of points
BESIDE = 0.1  # distance of a branch beyond the range, over the range
POINTS = 200  # of a branch in each direction


def motions_of_several_periods(
    system: System,
    balance: HarmonicBalance,
    omega_range: tuple[float, float],
    periods: int,
    points: int,
    options: Newton,
) -> list[Point]:
    """Return motions that repeat after several load periods, over the frequency, in the order of their branch.

    Parameters
    ----------
    system
        System of `balance`.
    balance
        Balance at the lower frequency.
    omega_range
        Range of the lower frequency, rad/s.
    periods
        Load periods in one period of the motion.
    points
        Smallest number of steps through the range.
    options
        Corrector options.

    Raises
    ------
    InputError
        If no such motion is found.
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
    """Yield motions with a lowest harmonic at a frequency."""
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
    """Follow the branch until it leaves the range, closes or joins the period-one response."""
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
