"""How a frequency is solved where the branch does not lead there: one ladder, every rung counted and bounded in Newton steps."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.forced.homotopies import homotopies
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem
from stickslip.solve.continuation import Point, start_point, step_to
from stickslip.solve.newton_method import Solution, charged, newton
from stickslip.solve.rescue import Homotopy, solve_robustly

DETOUR = 30  # most points on the way from a neighbour


def without_branch(
    problem: ForcedProblem,
    load: HarmonicLoad,
    balance: Balance,
    omega: float,
    near: Sequence[ComplexArray] = (),
    most: bool = True,
) -> Solution:
    """Solve a frequency from motions nearby, from the static equilibrium with the bonded vibration, from few harmonics, then by all that `solve_robustly` knows.

    Parameters
    ----------
    problem, load
        The forced response.
    balance
        Its balance with the harmonics wanted.
    omega
        Frequency, rad/s.
    near
        Motions that may be near, (H+1, n_retained) coefficients, m.
    most
        Whether other globalisations and homotopies are tried as well.
    """
    starts = _starts(problem, load, balance, omega, near)
    newton_options = problem.sweep.newton
    if most:
        return solve_robustly(
            lambda x: balance.linearise(x, omega),
            starts,
            newton_options,
            _ways(problem, load, balance, omega),
            problem.following(balance).weights,
        )
    spent: list[Solution] = []
    for start in starts:
        spent.append(newton(lambda x: balance.linearise(x, omega), start, newton_options))
        if spent[-1].status.converged:
            break
    return charged(spent[-1], spent)


def along_branch(
    problem: ForcedProblem, point: ForcedPoint, omega: float, balance: Balance
) -> Point:
    """Go from a solution to another frequency on the branch with the harmonics of `balance`."""
    following = problem.following(balance)
    following = replace(following, control=replace(following.control, max_points=DETOUR))
    start = start_point(balance, balance.unknowns(point.coefficients), point.omega, following)
    if not start.solution.status.converged:
        return start
    return step_to(balance, start, omega, following)


def _ways(
    problem: ForcedProblem, load: HarmonicLoad, balance: Balance, omega: float
) -> Iterator[Homotopy]:
    yield from homotopies(balance, omega, preload(problem.system, load.static))


def _starts(
    problem: ForcedProblem,
    load: HarmonicLoad,
    balance: Balance,
    omega: float,
    near: Sequence[ComplexArray],
) -> Iterator[FloatArray]:
    """Yield scaled unknowns to start Newton from."""
    yield from map(balance.unknowns, near)
    guess = balance.coefficients(bonded_start(balance, omega, problem.system))
    guess[0] = preload(problem.system, load.static)
    yield balance.unknowns(guess)
    driven = max(load.harmonics, default=balance.order)
    few = balance.with_harmonics(tuple(h for h in balance.harmonics if h <= max(driven, 1)))
    if few.order < balance.order:
        solution = newton(
            lambda x: few.linearise(x, omega), few.unknowns(guess), problem.sweep.newton
        )
        if solution.status.converged:
            yield balance.unknowns(few.coefficients(solution.x))
