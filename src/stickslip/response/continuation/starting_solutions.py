"""Periodic solutions without a neighbour: a ladder of methods, each with a limit of Newton steps."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import (
    Followed,
    OneLevel,
    Route,
    branch_of,
    following_vibration,
    steps_through,
    vibration_weights,
)
from stickslip.response.continuation.homotopies import homotopies, lowest_harmonics
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.system import System
from stickslip.solve.fallbacks import Homotopy, solve_robustly, steps_at_most
from stickslip.solve.newton_method import Newton, Solution, first_converged, newton


def without_branch(
    system: System,
    balance: AnyBalance,
    options: Newton,
    omega: float,
    near: Sequence[FloatArray] = (),
    effort: float = 1.0,
) -> Solution:
    """Solve a frequency from motions nearby, from the static equilibrium with the bonded vibration, from few harmonics, then by all that `solve_robustly` knows.

    Parameters
    ----------
    system
        What `balance` was made of.
    balance
        The periodic problem.
    options
        Corrector.
    omega
        Frequency, rad/s.
    near
        (size,) unknowns of motions that may be near.
    effort
        Share of the Newton steps of `steps_at_most` for all attempts, homotopies and other globalisations among them; 0: the corrector alone.
    """
    starts = _starts(system, balance, options, omega, near)
    if effort:
        return solve_robustly(
            lambda x: balance.linearise(x, omega),
            starts,
            options,
            _ways(system, balance, omega),
            vibration_weights(balance),
            steps=steps_at_most(balance.size, effort),
        )
    return first_converged(newton(lambda x: balance.linearise(x, omega), start, options) for start in starts)


def plain_sweep(
    system: System,
    balance: AnyBalance,
    omega_range: tuple[float, float],
    points: int,
    options: Newton,
    over: Callable[[], bool] = bool,
) -> list[Followed]:
    """Return the response of `balance` between two frequencies, in the order of the branch; it may hold points that were not found.

    `over` is asked after each solution, and ends the sweep.
    """
    first, last = omega_range
    way = following_vibration(balance, steps_through(last - first, points), options)
    curve = OneLevel(balance, way, partial(without_branch, system, balance, options))
    return branch_of(_until(over, follow(curve, Route(first=first, last=last, points=points))))


def _until(over: Callable[[], bool], every: Iterable[Followed]) -> Iterator[Followed]:
    for one in every:
        yield one
        if over():
            return


def _ways(system: System, balance: AnyBalance, omega: float) -> Iterator[Homotopy]:
    yield from homotopies(balance, omega, at_rest(system, balance, omega)[0].real)


def at_rest(system: System, balance: AnyBalance, omega: float) -> ComplexArray:
    """Return the (1, n_retained) static equilibrium, m; zero at coordinates that are retained beside those of the system."""
    rest = np.zeros((1, balance.linear.n), dtype=complex)
    own = np.searchsorted(balance.linear.retained, system.retained)
    rest[0, own] = preload(system.at(omega), balance.linear.load_at(omega).static)
    return rest


def _starts(
    system: System, balance: AnyBalance, options: Newton, omega: float, near: Sequence[FloatArray]
) -> Iterator[FloatArray]:
    """Yield scaled unknowns to start Newton from."""
    yield from near
    guess = balance.coefficients(bonded_start(balance, omega, system))
    guess[:1] = at_rest(system, balance, omega)
    yield balance.unknowns(guess)
    few = balance.with_harmonics(lowest_harmonics(balance))
    if few.order < balance.order:
        solution = newton(lambda x: few.linearise(x, omega), few.unknowns(guess), options)
        if solution.status.converged:
            yield balance.unknowns(few.coefficients(solution.x))
