"""Forced response in one or two passages through the frequencies (Gastaldi & Berruti 2017, section 4.4).

The two of the Jacobian Alert: first passage: the branch with few harmonics, each point with the error that the missing harmonics are predicted to make. Second
passage: the frequencies where that error exceeds the threshold, solved again with many harmonics from ``q + Δq``. Last, a few points
that resolve the resonance peak.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache

from stickslip.arrays import FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.equilibrium import preload
from stickslip.response.forced.accepted import (
    accepted_pairs,
    accepted_points,
    branch_points,
    replaced,
    runs_of_repeats,
)
from stickslip.response.forced.passages import first_passage, follow_run
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.repeats import passing, postponed, repeat, worth_a_try
from stickslip.response.forced.resonance import resolve_peak
from stickslip.response.forced.single_passage import single_passage
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


Way = Callable[[], FloatArray]  # gives the static equilibrium where homotopies begin
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
    static = cache(lambda: preload(system, load.static))
    solved = [p for p in done if p.stage != "peak"]
    before = tuple(solved)
    if sweep.single:
        passage = single_passage(problem, load, before)
    else:
        passage = _double_passage(problem, load, before, static)
    for point in passage:
        solved.append(point)
        yield point
    peak = [p for p in done if p.stage == "peak"]
    upward = accepted_points(solved)[:: int(sweep.forward)]
    yield from resolve_peak(problem, upward, peak, static)


def _double_passage(
    problem: ForcedProblem,
    load: HarmonicLoad,
    done: Sequence[ForcedPoint],
    static: Way,
) -> Iterator[ForcedPoint]:
    """Finish the response with few harmonics, then solve again what needs more."""
    low = [p for p in done if p.stage == "low"]
    yield from first_passage(problem, load, low)
    high = {p.index: p for p in done if p.stage == "high"}
    quiet = {p.index: p for p in low if p.converged and not problem.alerted(p)}
    tried = Counter(p.index for p in done if p.stage == "high")
    branches: list[ForcedPoint] = []
    passed = -1

    def again(indices: Iterable[int], most: int, last_way: Way | None) -> Iterator[ForcedPoint]:
        for index in [i for i in indices if not high[i].converged and tried[i] <= most]:
            known = quiet | {i: p for i, p in high.items() if p.converged}
            led = index - 1 in known or index + 1 in known or bool(passing(branches, low[index]))
            # homotopies cost seconds each: in a long row that found nothing only some are tried
            if led or (last_way is not None and worth_a_try(index, True, high, led)):
                high[index] = repeat(problem, low[index], known, last_way, branches)
            else:
                high[index] = postponed(problem, low[index])
            tried[index] += 1
            yield high[index]

    asked = {p.index: p for p in low if problem.asks_again(p)}
    for first, last in runs_of_repeats(asked):
        if last <= passed:  # in the place of a branch that went on to the end of the range
            continue
        yield from _repeats(problem, low[first : last + 1], quiet, high, tried)
        branch = branch_points(done, first, last)
        if _nothing_known(low, high, first) and tried[first] == LAST_TRY:
            high[first] = repeat(problem, low[first], {}, static)
            tried[first] += 1
            yield high[first]
        begin = _branch_begin(low, high, first, last)
        # once the last tries of a run have begun, its branch is over
        if begin is not None and all(tried[i] <= LAST_TRY for i in range(first + 1, last + 1)):
            yield from follow_run(problem, begin, last, low, branch, high)
        branches += branch
        passed = replaced(branch, low, last)
        # from where the branch passed a frequency, or from new neighbours
        yield from again(range(max(first, passed + 1), last + 1), LAST_TRY, None)
    # for what is left then, a homotopy
    yield from again(_unsolved(low, high, branches), LAST_TRY + 1, static)


def _repeats(
    problem: ForcedProblem,
    low: Sequence[ForcedPoint],
    quiet: dict[int, ForcedPoint],
    high: dict[int, ForcedPoint],
    tried: Counter[int],
) -> Iterator[ForcedPoint]:
    """Repeat what the alert asks for, once forward, and what failed once more backward, when its neighbours are known."""
    for attempt, order in enumerate((low, low[::-1])):
        for point in order:
            index = point.index
            done = index in high and high[index].converged
            if not problem.asks_again(point) or done or tried[index] > attempt:
                continue
            known = quiet | {i: p for i, p in high.items() if p.converged}
            beside = index - 1 in known or index + 1 in known
            if worth_a_try(index, attempt == 0, high, beside):
                high[index] = repeat(problem, point, known, quickly=attempt == 0)
            else:
                high[index] = postponed(problem, point)
            tried[index] += 1
            yield high[index]


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


def _nothing_known(low: Sequence[ForcedPoint], high: Mapping[int, ForcedPoint], first: int) -> bool:
    """Whether a run of repeats failed from its first one on, and no point before it is known from which a branch could begin."""
    return not high[first].converged and not any(p.converged for p in low[:first])


def _unsolved(
    low: Sequence[ForcedPoint], high: Mapping[int, ForcedPoint], branches: Sequence[ForcedPoint]
) -> list[int]:
    """Return the indices of repeats that failed and that no branch replaces."""
    passed = -1
    unsolved: list[int] = []
    for first, last in runs_of_repeats(high):
        passed = max(passed, replaced(branch_points(branches, first, last), low, last))
        unsolved += [i for i in range(max(first, passed + 1), last + 1) if not high[i].converged]
    return unsolved
