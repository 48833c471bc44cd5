"""Forced response with the double-passage Jacobian Alert (Gastaldi & Berruti 2017, section 4.4).

First passage: the branch with few harmonics, each point with the error that the missing harmonics are predicted to make. Second
passage: the frequencies where that error exceeds the threshold, solved again with many harmonics from ``q + Δq``. Last, a few points
that resolve the resonance peak.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.passages import first_passage, follow_run, repeat
from stickslip.response.preload import preload
from stickslip.response.resonance import resolve_peak
from stickslip.response.sweep import (
    ForcedPoint,
    ForcedProblem,
    Sweep,
    accepted_pairs,
    accepted_points,
    branch_points,
    forced_problem,
    reached,
    runs_of_repeats,
)
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


LAST_TRY = 2  # repeats of a frequency before the last one, by homotopy


def forced_response(
    system: System, load: HarmonicLoad, sweep: Sweep, done: Sequence[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Compute the steady forced response over a frequency range.

    Parameters
    ----------
    system
        Structure, contacts and outputs; the first output decides where the peak is.
    load
        Static and harmonic forces on all dofs, N.
    sweep
        Range, harmonics, alert.
    done
        Points of an interrupted run, in the order in which they came; none of them is computed again, and the rest comes out
        as it would have.

    Yields
    ------
    ForcedPoint
        Points not in `done`, as they are found.

    Raises
    ------
    SingularError
        If the static load finds no equilibrium.
    """
    problem = forced_problem(system, load, sweep)
    low = [p for p in done if p.stage == "low"]
    yield from first_passage(problem, load, low)
    high = {p.index: p for p in done if p.stage == "high"}
    quiet = {p.index: p for p in low if p.converged and not problem.alerted(p)}
    tried = Counter(p.index for p in done if p.stage == "high")
    # once forward, and what failed once more backward, when its neighbours are known
    for attempt, order in enumerate((low, low[::-1])):
        for point in order:
            index = point.index
            failed = index not in high or not high[index].converged
            if problem.alerted(point) and failed and tried[index] <= attempt:
                solved = {i: p for i, p in high.items() if p.converged}
                high[index] = repeat(problem, point, quiet | solved)
                tried[index] += 1
                yield high[index]
    branches: list[ForcedPoint] = []
    for first, last in runs_of_repeats(high):
        branch = branch_points(done, first, last)
        begin = _branch_begin(low, high, first, last)
        if begin is not None and all(tried[i] <= LAST_TRY for i in range(first, last + 1)):
            yield from follow_run(problem, begin, last, low, branch, high)
        branches += branch
    # last, a homotopy for what neither neighbours nor the branch led to
    lost = [low[i] for i in _unsolved(low, high, branches) if tried[i] <= LAST_TRY]
    static = preload(system, load.static) if lost else None
    for point in lost:
        solved = {i: p for i, p in high.items() if p.converged}
        high[point.index] = repeat(problem, point, quiet | solved, static)
        yield high[point.index]
    accepted = accepted_points([*low, *high.values(), *branches])
    yield from resolve_peak(problem, accepted, [p for p in done if p.stage == "peak"])


def _branch_begin(
    low: Sequence[ForcedPoint], high: Mapping[int, ForcedPoint], first: int, last: int
) -> int | None:
    """Return the first repeat of a run that its branch replaces: all of them, if a solution before the run is known.

    None if all of them converged, or where nothing is known from which a branch could begin.
    """
    failed = [i for i in range(first, last + 1) if not high[i].converged]
    if not failed:
        return None
    if any(p.converged for p in low[:first]):
        return first
    return failed[0] if failed[0] > first else None


def _unsolved(
    low: Sequence[ForcedPoint], high: Mapping[int, ForcedPoint], branches: Sequence[ForcedPoint]
) -> list[int]:
    """Return the indices of repeats that failed and that no branch replaces."""
    return [
        i
        for first, last in runs_of_repeats(high)
        if not reached(branch_points(branches, first, last), low, last)
        for i in range(first, last + 1)
        if not high[i].converged
    ]
