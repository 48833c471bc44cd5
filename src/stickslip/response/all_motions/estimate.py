"""Estimated time of a search for all motions, from one timed linearisation and a few periods."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.response.all_motions.basins import in_time, not_marched, sampler
from stickslip.response.all_motions.options import MotionSearch
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.problem import ForcedProblem, with_stiffness
from stickslip.response.time.transient import TimeStepping

STEPS_OF_A_SOLVE = 20  # Newton steps of a deflated solve, as a rule
PERIODS_OF_A_START = 100  # until a motion repeats, as a rule
TIMED = 3  # periods


def search_seconds(problem: ForcedProblem, search: MotionSearch) -> float:
    """Return about how long the deflated solves and the starts take, s, new branches left aside; the budget may end them before."""
    order, omega = search.periods * search.harmonics, search.places[0] / search.periods
    whole = with_stiffness(problem.balance(harmonics_of(order)))
    balance = replace(whole, jacobian="dense")
    x = bonded_start(balance, omega, problem.system)
    step = start = np.inf
    for _ in range(2):  # the first compiles
        begun = perf_counter()
        balance.linearise(x, omega)
        step = min(step, perf_counter() - begun)
    solves = len(search.places) * search.tries * STEPS_OF_A_SOLVE * step
    if not_marched(problem.system) or not search.starts:
        return solves
    motion = problem.low.linear.recover(omega, balance.coefficients(x))
    own = sampler(problem, omega, [motion], search.modes, search.spread)
    stepping = TimeStepping(steps_per_period=search.steps, max_periods=TIMED, harmonics=order, tolerance=1e-4)
    for number in range(2):
        begun = perf_counter()
        in_time(own, own.draw((search.seed, 0, number)), stepping)
        start = min(start, perf_counter() - begun)
    periods = min(PERIODS_OF_A_START, search.most_periods)
    return solves + len(search.places) * search.starts * periods / TIMED * start
