"""How often the default response is found, and how often what it trusts is wrong: random systems against 63 harmonics.

Run ``python -m evidence.benchmarks.trust``. A point is *trusted* where its own bound or its audit is below the threshold, else *doubted*. Truth is the solution
with 63 harmonics that Newton's method finds from the point; where it finds none, 31; a point without either is *not judged*.
"""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from time import process_time

import numpy as np

from evidence.benchmarks.robustness import CPU_SECONDS, OutOfTimeError, at_most, missing
from evidence.models.fresh_machines import FAMILIES, draw_fresh
from evidence.models.random_machines import Drawn, draw
from stickslip.errors import StickslipError
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.response.forced.collected import Accepted, collect
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.solve.newton_method import Newton, newton

TRUTHS = (63, 31)  # harmonics
SAMPLES = 8  # a harmonic, at least
JUDGED = 12  # points of a system
PATIENT = Newton(max_iterations=40)


@dataclass(frozen=True)
class Judged:
    """A point and how wrong it is.

    Parameters
    ----------
    omega
        Frequency, rad/s.
    order
        Highest harmonic kept.
    said
        What is said of its error, a fraction.
    true
        Its error against the truth, a fraction; NaN where there is none.
    """

    omega: float
    order: int
    said: float
    true: float


@dataclass(frozen=True)
class Trial:
    """What became of one system."""

    number: int
    note: str
    points: int
    failed: int
    seconds: float
    unknowns: int
    judged: tuple[Judged, ...]


def trial(seed: int, family: str, number: int) -> Trial:
    """Solve a system of the benchmark, of its planar variant or of a fresh family by default and judge a sample of what was accepted."""
    if family in FAMILIES:
        drawn = by_default(draw_fresh(family, seed, number))
    else:
        drawn = by_default(draw(seed, number, planar=family == "planar"))
    points: list[ForcedPoint] = []
    next(iter(forced_response(drawn.system, drawn.load, drawn.sweep)))  # compiles, off the clock
    began, unsolved = process_time(), 0
    try:
        with at_most(CPU_SECONDS):
            points.extend(forced_response(drawn.system, drawn.load, drawn.sweep))
    except OutOfTimeError:
        unsolved = missing(drawn, points)
    except StickslipError:
        unsolved = drawn.sweep.points
    seconds = process_time() - began
    if not points:
        return Trial(number, drawn.note, unsolved, unsolved, seconds, 0, ())
    problem = forced_problem(drawn.system, drawn.load, drawn.sweep)
    found = collect(problem, points, 0).accepted
    solved = [a for a in found if a.point.converged]
    rng = np.random.default_rng([seed, number, 7])
    some = rng.permutation(len(solved))[:JUDGED]
    judged = []
    for i in sorted(int(i) for i in some):
        a = solved[i]
        judged.append(Judged(a.point.omega, a.point.order, said(a), truth(problem, a.point)))
    unknowns = sum(p.coefficients.shape[1] * (2 * p.harmonics.size - 1) for p in points)
    failed = len(found) - len(solved) + unsolved
    return Trial(number, drawn.note, len(found) + unsolved, failed, seconds, unknowns, tuple(judged))


def by_default(drawn: Drawn) -> Drawn:
    """Return a drawn system with the sweep that a user gets who asks for nothing."""
    return replace(drawn, sweep=replace(drawn.sweep, selection="guarded_alert", high="auto"))


def said(found: Accepted) -> float:
    """Return what is said of the error of a point, a fraction: its audit where there is one, and that is less."""
    return float(np.nanmin([found.own_error, found.audit_error]))


def truth(problem: ForcedProblem, point: ForcedPoint) -> float:
    """Return the error of a point against many harmonics, a fraction; NaN where no solution is found from it."""
    most = getattr(problem.system.structure, "harmonics", TRUTHS[0])  # of a tuned wheel
    for order in sorted({min(order, most) for order in TRUTHS}, reverse=True):
        samples = max(problem.low.samples, SAMPLES * order)
        many = replace(problem.low, samples=samples).with_harmonics(harmonics_of(order))
        at = partial(many.linearise, omega=point.omega)
        solution = newton(at, many.unknowns(point.coefficients), PATIENT)
        if solution.status.converged:
            exact = many.coefficients(solution.x)
            rows = min(len(exact), len(point.coefficients))
            one, other = (problem.low.linear.recover(point.omega, q[:rows]) for q in (point.coefficients, exact))
            return problem.measure.change(one, other - one)[0]
    return float("nan")


def show(trials: Sequence[Trial], threshold: float = 0.05) -> None:
    """Print the counts."""
    points, failed = sum(t.points for t in trials), sum(t.failed for t in trials)
    judged = [j for t in trials for j in t.judged]
    known = [j for j in judged if not np.isnan(j.true)]
    trusted = [j for j in known if j.said <= threshold]
    wrong = [j for j in trusted if j.true > threshold]
    doubted = [j for j in known if not j.said <= threshold]
    false = [j for j in doubted if j.true <= threshold]
    print(f"{len(trials)} systems: {points - failed} of {points} points converged, {100 * (1 - failed / points):.2f} %")
    print(
        f"{len(judged)} points judged, {len(judged) - len(known)} without a truth; trusted {len(trusted)}, of these wrong {len(wrong)}; "
        f"doubted {len(doubted)}, of these right {len(false)}"
    )
    print("orders", dict(sorted(Counter(j.order for j in judged).items())))
    for t in trials:
        told = [
            f"{j.omega:.5g} H={j.order} said {j.said:.3g} true {j.true:.3g}"
            for j in t.judged
            if j.said <= threshold < j.true
        ]
        if t.failed or told or t.seconds > CPU_SECONDS / 2:
            print(t.number, t.note, f"{t.failed} of {t.points} failed, {t.seconds:.1f} s", *told)


def main() -> int:
    """Parse, run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--systems", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--family", choices=("random", "planar", *FAMILIES), default="random")
    asked = parser.parse_args()
    numbers = range(asked.first, asked.first + asked.systems)
    trials = []
    with get_context("spawn").Pool(asked.workers) as pool:
        for made in pool.imap(partial(trial, asked.seed, asked.family), numbers):
            trials.append(made)
            print(
                f"{made.number}: {made.failed} of {made.points} failed, {made.seconds:.1f} s",
                file=sys.stderr,
                flush=True,
            )
    show(trials)
    return 0


if __name__ == "__main__":
    sys.exit(main())
