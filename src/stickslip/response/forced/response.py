"""Steady forced response over a frequency range: with adaptive harmonics, or by the published passages.

A few points that resolve the resonance peak come last.
"""

from collections.abc import Iterator, Sequence
from functools import cache

from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.equilibrium import preload
from stickslip.response.forced.accepted import accepted_pairs, accepted_points
from stickslip.response.forced.along import along_the_branch
from stickslip.response.forced.from_time import found_in_time
from stickslip.response.forced.passages import double_passage, single_passage
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.resonance import resolve_peak
from stickslip.response.forced.settled import settle
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System

__all__ = [
    "ForcedPoint",
    "ForcedProblem",
    "Sweep",
    "accepted_pairs",
    "accepted_points",
    "forced_problem",
    "forced_response",
]

OF_PEAK = ("peak", "check")
SETTLED = ("settled", "compared")


@by_one_thread
def forced_response(
    system: System, load: HarmonicLoad, sweep: Sweep, done: Sequence[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Compute the steady forced response over a frequency range.

    Parameters
    ----------
    system
        Structure, contacts and outputs; the first output defines the peak.
    load
        Static and harmonic forces on all dofs, N.
    sweep
        Range, harmonics, alert.
    done
        Points of an interrupted run, in their order. They are not computed again, and the remaining points are the
        same.

    Yields
    ------
    ForcedPoint
        Points not in `done`, as they are found.

    Raises
    ------
    SingularError
        If there is no equilibrium under the static load.
    """
    problem = forced_problem(system, load, sweep)
    solved = [p for p in done if p.stage not in (*OF_PEAK, *SETTLED, "in_time")]
    before = tuple(solved)
    if sweep.auto:
        passage = along_the_branch(problem, before)
    elif sweep.single:
        passage = single_passage(problem, before)
    else:
        first = sweep.ends[0]
        static = cache(lambda: preload(system.at(first), problem.low.linear.load_at(first).static))
        passage = double_passage(problem, before, static)
    for point in passage:
        solved.append(point)
        yield point
    marched = [p for p in done if p.stage == "in_time"]
    solved += marched
    for point in found_in_time(problem, accepted_points(solved), marched):
        solved.append(point)
        yield point
    stored = [p for p in done if p.stage in SETTLED]
    for point in settle(problem, accepted_points(solved), solved, iter(stored)):
        stored.append(point)
        yield point
    solved += stored
    known = [p for p in done if p.stage in OF_PEAK]
    peak, left = list(known), iter(known)
    for point in resolve_peak(problem, accepted_points(solved), left):
        peak.append(point)
        yield point
    last = list(left)  # points of an interrupted run that followed the peak
    solved += [p for p in peak if not any(p is one for one in last)]
    yield from settle(problem, accepted_points(solved), solved, iter(last), of_peak=True)
