"""The double passage of the Jacobian Alert: a branch with few harmonics, then the frequencies that need more (Gastaldi & Berruti 2017, section 4.4)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter

from stickslip.arrays import FloatArray
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.forced.accepted import branch_end, points_of_branch, replaced, runs_of_repeats
from stickslip.response.forced.along import ForcedCurve, of_forced, route_of, to_forced
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.response.forced.repeats import repeat
from stickslip.solve.continuation import Point, advance, reversed_point, start_point

BRANCH_SEEDS = 4  # points from which a branch with many harmonics is begun
BRANCH_LENGTH = 8  # multiples of `Sweep.points` after which such a branch is given up
BACKWARD = 0.1  # share of the range by which it may leave the range


def double_passage(
    problem: ForcedProblem, done: Sequence[ForcedPoint], static: Callable[[], FloatArray]
) -> Iterator[ForcedPoint]:
    """Finish the response with few harmonics, then solve again what needs more.

    A run of neighbouring repeats is gone through forward, and backward for what failed. What has failed still is looked for along the branch with many
    harmonics, which may take the place of the run, then by homotopies.

    Parameters
    ----------
    problem
        The forced response.
    done
        Points of an interrupted run, in the order in which they came.
    static
        Gives the (n_retained,) static equilibrium, m.

    Yields
    ------
    ForcedPoint
        Points not in `done`: of the first passage as ``low`` and ``found``, repeats as ``high``, those of a branch as ``branch``.
    """
    curve = ForcedCurve(problem, (problem.low.harmonics,), raises=False)
    passage = [p for p in done if p.stage in ("low", "found")]
    known = [of_forced(curve, p) for p in passage]
    for found in follow(curve, route_of(problem), known):
        passage.append(to_forced(curve, found))
        yield passage[-1]
    low = [p if p.stage == "low" else replace(p, stage="low") for p in points_of_branch(passage, "low")]
    stored = iter([p for p in done if p.stage in ("high", "branch")])
    yield from _Second(problem, low, static, stored).run()


@dataclass(slots=True, eq=False)
class _Second:
    """The second passage."""

    problem: ForcedProblem
    low: list[ForcedPoint]
    static: Callable[[], FloatArray]
    stored: Iterator[ForcedPoint]  # of an interrupted run
    high: dict[int, ForcedPoint] = field(default_factory=dict)

    def run(self) -> Iterator[ForcedPoint]:
        """Repeat what needs more harmonics, run by run."""
        passed = -1
        asked = {p.index: p for p in self.low if self.problem.asks_again(p)}
        for first, last in runs_of_repeats(asked):
            if last <= passed:  # in the place of a branch that went on to the end of the range
                continue
            run, branch = self.low[first : last + 1], list[ForcedPoint]()
            for order in (run, run[::-1]):
                yield from self._again(order, None, branch)
            if self.problem.sweep.rescue != "all":
                continue
            if self._left(run):
                yield from _followed(self.problem, first, last, self.low, branch, self.high, self.stored)
                passed = max(passed, replaced(branch, self.low, last))
            if passed < last:
                for way in (None, self.static):
                    yield from self._again(run, way, branch)

    def _left(self, run: Sequence[ForcedPoint]) -> list[ForcedPoint]:
        """Return what of a run has not been found."""
        return [p for p in run if p.index not in self.high or not self.high[p.index].converged]

    def _again(
        self, run: Sequence[ForcedPoint], way: Callable[[], FloatArray] | None, branch: Sequence[ForcedPoint]
    ) -> Iterator[ForcedPoint]:
        """Repeat what of a run has not been found."""
        for point in self._left(run):
            made = next(self.stored, None)
            if made is None:
                quiet = {p.index: p for p in self.low if p.converged and not self.problem.alerted(p)}
                known = quiet | {i: p for i, p in self.high.items() if p.converged}
                made = repeat(self.problem, point, known, way, branch)
                yield made
            self.high[point.index] = made


def _followed(
    problem: ForcedProblem,
    first: int,
    last: int,
    low: list[ForcedPoint],
    branch: list[ForcedPoint],
    high: Mapping[int, ForcedPoint],
    stored: Iterator[ForcedPoint],
) -> Iterator[ForcedPoint]:
    """Follow the branch with many harmonics through a run of repeats that did not all converge, and append to `branch`.

    Where the two orders differ much the branch may fold: then some frequencies have no solution near the low-order one, and only the
    branch itself leads through. It ends at the next quiet point if it comes to its motion, else at the end of the range.
    """
    sweep, balance = problem.sweep, problem.high
    end = branch_end(low, last)
    begin, stop = sweep.omega_range
    margin = BACKWARD * (stop - begin)
    following = problem.following(balance)
    while len(branch) <= BRANCH_LENGTH * sweep.points and replaced(branch, low, last) < 0:
        here = branch[-1] if branch else None
        if here and not (here.converged and begin - margin < here.omega < stop + margin):
            return
        made = next(stored, None)
        if made is None:
            began = perf_counter()
            if here is None:
                point = _begun(problem, low, high, first)
                if point is None:
                    return
            else:
                # another sheet at the frequency of the end: on to that of the range
                goal = low[-1].omega if any(p.omega == end for p in branch) else end
                point = advance(balance, problem.branch_point(here), goal, following)
            seconds = perf_counter() - began
            made = forced_point(balance, point.solution, "branch", first, point.p, seconds, point)
            yield made
        branch.append(made)


def _begun(problem: ForcedProblem, low: list[ForcedPoint], high: Mapping[int, ForcedPoint], first: int) -> Point | None:
    """Solve with many harmonics at an accepted point before index `first`, so that the whole run is passed."""
    balance = problem.high
    following = replace(problem.following(balance), newton=problem.sweep.newton)
    usable = [high.get(p.index, p) for p in low[:first] if p.converged]
    usable = [p for p in usable if p.converged and (p.stage == "high" or not problem.alerted(p))]
    for seed in sorted(usable, key=lambda p: -p.index)[:BRANCH_SEEDS]:
        point = start_point(balance, balance.unknowns(seed.coefficients), seed.omega, following)
        if point.solution.status.converged:
            # a first passage that goes down, or was coming back from a fold, goes on downward
            return reversed_point(point) if _goes_down(problem, low[seed.index]) else point
    return None


def _goes_down(problem: ForcedProblem, point: ForcedPoint) -> bool:
    """Whether frequencies fall beyond a point of the first passage; tangents of listed frequencies all show upward."""
    if problem.sweep.grid.size:
        return problem.sweep.direction == "down"
    return point.tangent.size > 0 and bool(point.tangent[-1] < 0.0)
