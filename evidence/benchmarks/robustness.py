"""How many points of random small systems converge, and how many of those are right.

    python -m evidence.benchmarks.robustness                          # 500 systems, seed 1, on two processes
    python -m evidence.benchmarks.robustness --systems 60 --seed 7 --workers 1
    python -m evidence.benchmarks.robustness --seed 1 --only 137      # one system again, point by point
    python -m evidence.benchmarks.robustness --planar --systems 100   # planar friction; with --planes the same systems with two springs, with both each system both ways

`evidence.benchmarks.robustness_systems` says what is drawn. Each system is swept through its resonance with the public `forced_response`. Every
frequency that the response consists of counts, and so does each repeat of a frequency that failed; a system that exceeds its
CPU time counts one failed point for each step of a `points`-th of the range that it did not reach. For a random tenth of the systems
`evidence.benchmarks.robustness_judge` asks a time integration whether the solutions are right.
"""

import argparse
import os
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy: the processes share the cores

import signal
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache, partial
from itertools import count, islice
from multiprocessing import Pool
from time import process_time

import numpy as np

from evidence.benchmarks.robustness_judge import Judgement, judge
from evidence.models.random_machines import MANY, Drawn, draw, draw_many, has_planes
from stickslip.errors import StickslipError
from stickslip.response.forced.response import ForcedPoint, accepted_points, forced_problem, forced_response

CPU_SECONDS = 20.0  # of a sweep
TENTH = 10
GOAL = 0.999


class OutOfTimeError(Exception):
    """The CPU time of a system is used up."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What became of one system."""

    number: int
    family: str
    note: str
    points: int
    failed: int
    few: tuple[int, int]  # points with the harmonics of the first passage, and failed ones
    many: tuple[int, int]  # those with more
    reasons: dict[str, int]
    rescues: dict[str, int]
    seconds: float
    judgements: list[Judgement] = field(default_factory=list)
    planar: bool = False


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Raise `OutOfTimeError` when the process has used so much more CPU time."""

    def stop(*_: object) -> None:
        raise OutOfTimeError

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def solve(drawn: Drawn) -> tuple[list[ForcedPoint], str]:
    """Sweep a system; return its points and why it ended early, if it did."""
    points: list[ForcedPoint] = []
    try:
        with at_most(CPU_SECONDS):
            points.extend(forced_response(drawn.system, drawn.load, drawn.sweep))
    except OutOfTimeError:
        return points, "out of CPU time"
    except StickslipError as error:
        return points, str(error)
    return points, ""


@cache
def warmed(*, planar: bool) -> None:
    """Compile or load the kernels, once a process and outside the clock."""
    drawn = draw(0, 0, planar=planar)
    next(iter(forced_response(drawn.system, drawn.load, drawn.sweep)))


def outcome(seed: int, number: int, *, planar: bool = False) -> Outcome:
    """Solve and count one system; negative numbers are the larger wedges."""
    warmed(planar=planar)
    drawn = drawn_system(seed, number, planar=planar)
    began = process_time()
    points, early = solve(drawn)
    seconds = process_time() - began
    accepted = accepted_points(points)
    failed = [p for p in accepted if not p.converged]
    reasons = Counter(f"{p.stage}: {p.status.name.lower()}" for p in failed)
    unsolved = missing(drawn, points) if early else 0
    if unsolved:
        reasons[early] += unsolved
    low = [p for p in accepted if p.order <= drawn.sweep.supports[0][-1]]
    high = [p for p in accepted if p.order > drawn.sweep.supports[0][-1]]
    judged = not planar and number >= 0 and np.random.default_rng([seed, number, TENTH]).integers(TENTH) == 0
    judgements = []
    if judged and any(p.converged for p in accepted):
        problem = forced_problem(drawn.system, drawn.load, drawn.sweep)
        chosen = np.random.default_rng([seed, number, TENTH + 1])
        judgements = judge(problem, drawn.load, [p for p in accepted if p.converged], chosen)
    return Outcome(
        number,
        drawn.family,
        drawn.note,
        len(accepted) + unsolved,
        sum(reasons.values()),
        (len(low), sum(not p.converged for p in low)),
        (len(high), sum(not p.converged for p in high)),
        dict(reasons),
        dict(Counter(str(getattr(p, "rescue", 0)) for p in accepted if p.converged)),
        seconds,
        judgements,
        planar,
    )


def drawn_system(seed: int, number: int, *, planar: bool = False) -> Drawn:
    """Draw a system; negative numbers are the larger wedges, which have two springs always."""
    if number < 0:
        return draw_many(seed, -number, MANY[-number - 1])
    return draw(seed, number, planar=planar)


def with_planes(seed: int, systems: int) -> list[int]:
    """Return the first numbers whose systems can have planar friction."""
    return list(islice((n for n in count() if has_planes(seed, n)), systems))


def missing(drawn: Drawn, points: list[ForcedPoint]) -> int:
    """Return how many steps of the range were not reached, and repeats not tried; at least one."""
    first, last = drawn.sweep.omega_range
    reach = max((p.omega for p in points if p.converged), default=first)
    steps = round(drawn.sweep.points * (last - reach) / (last - first))
    tried = {p.index for p in points if p.stage == "high"}
    asked = {p.index for p in points if p.stage == "low" and p.predicted_error > drawn.sweep.threshold}
    return max(1, steps + len(asked - tried))


def show(outcomes: list[Outcome], seed: int) -> None:
    """Print shares, failures, rescues and judgements."""
    print(
        f"\nseed {seed}; {sum(o.seconds for o in outcomes):.0f} CPU seconds in sweeps, "
        f"the slowest {max(o.seconds for o in outcomes):.1f} s"
    )
    print(
        f"{'family':10} {'systems':>8} {'clean':>8} {'points':>8} {'converged':>10} {'few harmonics':>14} {'more':>10}"
    )
    families = [*sorted({o.family for o in outcomes}), "all"]
    for family in families:
        own = [o for o in outcomes if family in ("all", o.family)]
        points, failed = sum(o.points for o in own), sum(o.failed for o in own)
        shares = [
            share(sum(o.few[1] for o in own), sum(o.few[0] for o in own)),
            share(sum(o.many[1] for o in own), sum(o.many[0] for o in own)),
        ]
        clean = sum(o.failed == 0 for o in own)
        print(
            f"{family:10} {len(own):8} {clean:8} {points:8} {share(failed, points):>10} {shares[0]:>14} {shares[1]:>10}"
        )
    rescues = sum((Counter(o.rescues) for o in outcomes), Counter())
    print("\nconverged points by the rung that saved them:", dict(sorted(rescues.items())))
    show_judgements(outcomes)
    failures = sorted((o for o in outcomes if o.failed), key=lambda o: -o.failed)
    print(f"\n{len(failures)} systems with failures, each again by --seed {seed} --only NUMBER:")
    for o in failures:
        print(f"{o.number:5} {o.failed:4} of {o.points:4}  {o.seconds:5.1f} s  {o.reasons}  {o.family}: {o.note}")


def show_judgements(outcomes: list[Outcome]) -> None:
    """Print how balance and time integration agree."""
    judged = [(o, j) for o in outcomes for j in o.judgements]
    print(f"\n{len(judged)} points of {sum(bool(o.judgements) for o in outcomes)} systems against time integration:")
    for verdict, times in Counter(j.verdict for _, j in judged).most_common():
        print(f"{times:5} {verdict}")
    off = [j.default_off for _, j in judged if j.verdict == "agrees"]
    if off:
        print(
            f"of those that agree, the default orders differ from the integration by {np.median(off):.1e} in the median, "
            f"{np.quantile(off, 0.9):.1e} in nine of ten, {max(off):.1e} at most"
        )
    for o, j in judged:
        if j.verdict != "agrees":
            print(f"{o.number:5} {j.sentence}  ({o.family}: {o.note})")


def share(failed: int, of: int) -> str:
    """Return the share that did not fail, in percent."""
    return f"{100 * (1 - failed / of):.2f} %" if of else "-"


def run(numbers: list[int], seed: int, workers: int, laws: Sequence[bool] = (False,)) -> list[Outcome]:
    """Solve the systems of the given numbers, planar (True) or with two springs; each is told as it is done."""
    asked = [(n, planar) for n in numbers for planar in laws]
    one = partial(_one, seed)
    if workers == 1:
        return [told(one(each)) for each in asked]
    with Pool(workers) as pool:
        return [told(done) for done in pool.imap(one, asked, chunksize=1)]


def _one(seed: int, asked: tuple[int, bool]) -> Outcome:
    return outcome(seed, asked[0], planar=asked[1])


def told(done: Outcome) -> Outcome:
    """Print one line, so that a run that is ended leaves what it found."""
    law = "planar" if done.planar else "springs"
    print(
        f"{done.number:5} {done.family:8} {law:8} {done.failed:4} of {done.points:4} failed "
        f"{done.seconds:5.1f} s  {done.reasons}",
        flush=True,
    )
    return done


def asked_numbers(asked: argparse.Namespace) -> list[int]:
    """Return the numbers of the systems asked for; 500 of all families have the larger wedges beside them."""
    if asked.planar or asked.planes:
        return with_planes(asked.seed, asked.systems)
    larger = range(-1, -len(MANY) - 1, -1) if asked.systems >= 500 else ()
    return [*range(asked.systems), *larger]


def main() -> int:
    """Parse, run and print."""
    parser = argparse.ArgumentParser(
        description=f"{__doc__.splitlines()[0]} A sweep has {CPU_SECONDS:g} s of CPU time, not of the clock on the wall."
    )
    parser.add_argument("--systems", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", type=int)
    parser.add_argument("--planar", action="store_true", help="friction coupled in the plane")
    parser.add_argument(
        "--planes", action="store_true", help="the systems of --planar with two springs; with --planar: both ways"
    )
    asked = parser.parse_args()
    if asked.only is None:
        laws = [True, False] if asked.planar and asked.planes else [asked.planar]
        outcomes = run(asked_numbers(asked), asked.seed, asked.workers, laws)
        for law in laws:
            print("\nplanar friction" if law else "\ntwo springs")
            show([o for o in outcomes if o.planar is law], asked.seed)
        return 0
    drawn = drawn_system(asked.seed, asked.only, planar=asked.planar)
    points, early = solve(drawn)
    print(drawn.note, early)
    problem = forced_problem(drawn.system, drawn.load, drawn.sweep)
    for p in points:
        rescue = getattr(p, "rescue", 0)
        print(
            f"{p.stage:6} {p.index:4} {p.omega / 2 / np.pi:12.6f} Hz  {problem.amplitude(p):.4e} m  H = {p.order}  "
            f"{p.status.name.lower():20} {p.iterations:4}  {rescue}"
        )
    show([outcome(asked.seed, asked.only, planar=asked.planar)], asked.seed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
