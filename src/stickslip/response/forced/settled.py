"""Doubtful points, solved again with more harmonics until two levels agree.

The point's own prediction decides whether it is solved again, not the number of requested points. Each point has its
own budget.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from stickslip.harmonic.harmonic_set import Harmonics, multiples
from stickslip.harmonic.judging import JUDGED_MULTIPLE, SAMPLES_A_HARMONIC
from stickslip.response.forced.accepted import audits_by_frequency
from stickslip.response.forced.along import AGREE, SAFETY, SAME_SHEET_RTOL, SMALL
from stickslip.response.forced.choices import RUNGS, Stage
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point, with_stiffness
from stickslip.response.verification import own_error, with_waves
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import Solution, newton

SOLUTIONS = 10  # largest number of solutions for a point
# least budget, in Newton steps of a small system; otherwise the work of the branch
WORK = 2000.0
# share of the threshold above which an unconfirmed prediction is doubtful
BELIEVED = 0.5
CAP_SAFETY = SAFETY[1]  # factor on the change from fewer harmonics, at the highest level
LOST = 2  # failed levels after which a point is left unchanged
BESIDE = 2  # neighbours on either side that serve as starts with more harmonics

Taken = Generator[ForcedPoint, None, ForcedPoint]


def settle(
    problem: ForcedProblem,
    accepted: Sequence[ForcedPoint],
    solved: Sequence[ForcedPoint],
    stored: Iterator[ForcedPoint],
    *,
    of_peak: bool = False,
) -> Iterator[ForcedPoint]:
    """Solve points again whose verdict is a mere prediction, with more harmonics until two levels agree.

    Parameters
    ----------
    problem
        The forced response, whose harmonics are raised along the branch.
    accepted
        Points of the response in the order of the branch.
    solved
        All solved points, audits included.
    stored
        Points of an interrupted run, in their order.
    of_peak
        Whether to solve the points that resolve the peak, or all others.

    Yields
    ------
    ForcedPoint
        Points not in `stored`: ``settled`` (``peak`` at a peak), which replaces the point with fewer harmonics;
        ``compared`` (``check``) for comparison.
    """
    if not problem.strategy.verifies:
        return
    stages: tuple[Stage, Stage] = ("peak", "check") if of_peak else ("settled", "compared")
    budget = max(WORK, sum(map(_work, solved)))
    settling = _Settling(problem, list(accepted), stored, stages, budget)
    sweep, done = problem.sweep, set[int]()
    if not sweep.auto and of_peak and sweep.peak_points:
        done = yield from settling.settle_highest()
    audits = audits_by_frequency(solved)
    places = [i for i, p in enumerate(accepted) if p.converged and (p.stage == "peak") == of_peak and i not in done]
    open_ = (i for i in places if _open(problem, accepted[i], audits.get(accepted[i].omega, [])))
    # cheap points first, as the budget may not suffice for all
    for place in sorted(open_, key=lambda i: accepted[i].harmonics.size):
        yield from settling.settle(place)


def _open(problem: ForcedProblem, point: ForcedPoint, audits: Sequence[ForcedPoint]) -> bool:
    """Whether a point is doubtful.

    Its predicted error is large, or near the threshold, and no solution with more harmonics confirms it.
    """
    limit, bound = problem.strategy.threshold, point.predicted_error
    if not problem.sweep.auto:  # fixed harmonics are kept; doubtful points are only compared with more
        if point.support != problem.sweep.high_harmonics:
            return False
        bound = own_error(problem, point)
        bound = 0.0 if bound <= limit else bound
    if bound == 0.0:
        return False
    most = max(audits, key=lambda p: p.harmonics.size, default=point)
    if most.harmonics.size > point.harmonics.size:
        change = problem.real_error(point, most)
        return change > limit or (bound > limit and not _settles(problem, change, most))
    return not bound <= BELIEVED * limit


def _settles(problem: ForcedProblem, change: float, audit: ForcedPoint) -> bool:
    """Whether a solution with more harmonics confirms a doubtful point.

    The change to this solution plus its own predicted error has to stay below the threshold, since an even higher
    harmonic may excite a mode. A mode of damping ratio 0.001 at the 13th harmonic changed the first by 6.7 %; the
    change from five to nine harmonics was 2.3 %, the prediction of nine 4.6 %.
    """
    return change + own_error(problem, audit) <= problem.strategy.threshold


@dataclass(frozen=True)
class _Levels:
    """Sets of harmonics that a point may have, the fewest first, and larger sets for comparison only."""

    standing: tuple[Harmonics, ...]
    beyond: tuple[Harmonics, ...] = ()


def _levels(problem: ForcedProblem) -> _Levels:
    """Return the levels of a sweep; with fixed harmonics, higher levels serve for comparison only."""
    sweep = problem.sweep
    if sweep.auto:
        return _Levels(sweep.supports)
    high = sweep.high_harmonics
    step = multiples(high, high[-1])[1]
    beyond = (multiples(high, step * rung) for rung in RUNGS)
    return _Levels(
        tuple(dict.fromkeys((sweep.low_harmonics, high))),
        tuple(b for b in beyond if high[-1] < b[-1] <= JUDGED_MULTIPLE * high[-1]),
    )


def _balance(problem: ForcedProblem, support: Harmonics) -> Balance | None:
    """Return the periodic problem with the harmonics of a level; None where a wheel has no waves for them."""
    most = problem.low.linear.most
    if support not in problem.others and most is not None and most < support[-1]:
        wide = with_waves(problem, with_stiffness(problem.low), support[-1])
        if wide.linear.most is not None and wide.linear.most < support[-1]:
            return None
        problem.others[support] = replace(
            wide, samples=max(wide.samples, SAMPLES_A_HARMONIC * support[-1])
        ).with_harmonics(support)
    return problem.balance(support)


def _work(point: ForcedPoint) -> float:
    """Return the work of a solution, in Newton steps of a small system."""
    return point.iterations * (1.0 + point.unknowns / SMALL)


@dataclass(slots=True, eq=False)
class _Settling:
    problem: ForcedProblem
    known: list[ForcedPoint]
    stored: Iterator[ForcedPoint]
    stages: tuple[Stage, Stage]
    left: float  # work
    spent: int = 0  # solutions for the current point

    def settle_highest(self) -> Generator[ForcedPoint, None, set[int]]:
        """Compare the highest point with more harmonics until the then highest one has been compared.

        Return the positions of all compared points.
        """
        seen: set[int] = set()
        for _ in range(SOLUTIONS):
            heights = [self.problem.amplitude(p) if p.converged else -np.inf for p in self.known]
            top = int(np.argmax(heights)) if heights else -1
            if top < 0 or top in seen or not self.known[top].converged:
                break
            seen.add(top)
            yield from self.settle(top)
        return seen

    def settle(self, place: int) -> Iterator[ForcedPoint]:
        """Yield solutions of a point with increasing harmonics until the motion no longer changes."""
        lost, levels = 0, _levels(self.problem)
        limit, self.spent = AGREE * self.problem.strategy.threshold, 0
        for support in (*levels.standing, *levels.beyond):
            here = self.known[place]
            if len(support) <= here.harmonics.size or not set(here.support) <= set(support):
                continue
            more, change = yield from self._nearest(place, support)
            if self._exhausted and more is None:
                return
            if more is None:
                lost += 1  # the next level may still succeed
                if lost == LOST:
                    return
                continue
            beyond, threshold = support in levels.beyond, self.problem.strategy.threshold
            near = change <= (threshold if beyond else limit)
            doubted = not here.predicted_error <= threshold
            if near and doubted and not _settles(self.problem, change, more):
                if beyond:
                    continue
            elif near or beyond:
                return
            last = not levels.beyond and support == levels.standing[-1]
            bound = CAP_SAFETY * change if last else np.nan
            self.known[place] = yield from self._take(lambda p=more, b=bound: self._raised(p, b))  # type: ignore[misc]

    @property
    def _exhausted(self) -> bool:
        return self.spent == SOLUTIONS or self.left <= 0.0

    def _nearest(
        self, place: int, support: Harmonics
    ) -> Generator[ForcedPoint, None, tuple[ForcedPoint | None, float]]:
        """Solve a point with more harmonics; return the nearest solution, None without one, and its relative change."""
        here, balance = self.known[place], _balance(self.problem, support)
        more: ForcedPoint | None = None
        change = np.inf
        for make in self._ways(place, balance) if balance is not None else ():
            if self._exhausted:
                return None, np.inf
            self.spent += 1
            found = yield from self._take(make)
            off = self.problem.real_error(here, found) if found.converged else np.inf
            if off < change:
                more, change = found, off
            if change <= SAME_SHEET_RTOL:
                break
        return more, change

    def _ways(self, place: int, balance: Balance) -> Iterator[Callable[[], ForcedPoint]]:
        """Yield attempts with more harmonics.

        They start from the point's own motion, then from neighbours with as many harmonics.
        """
        here = self.known[place]
        yield lambda: self._solved(balance, here, here)
        near = [place + side * d for d in range(1, BESIDE + 1) for side in (-1, 1)]
        for i in near:
            other = self.known[i] if 0 <= i < len(self.known) else here
            if other.converged and set(balance.harmonics) <= set(other.support):
                yield lambda p=other: self._solved(balance, p, here)  # type: ignore[misc]

    def _solved(self, balance: Balance, start: ForcedPoint, here: ForcedPoint) -> ForcedPoint:
        x, options = balance.unknowns(start.coefficients), self.problem.sweep.newton.near
        found: Solution = newton(lambda v: balance.linearise(v, here.omega), x, options, NaturalLevel())
        return forced_point(balance, found, self.stages[1], here.index, here.omega, 0.0)

    def _raised(self, more: ForcedPoint, bound: float) -> ForcedPoint:
        """Return an audit solution as the accepted one at its frequency; `bound` is its error at the highest level."""
        return replace(
            more, stage=self.stages[0], predicted_error=bound, iterations=0, seconds_contact=0.0, seconds_linear=0.0
        )

    def _take(self, make: Callable[[], ForcedPoint]) -> Taken:
        known = next(self.stored, None)
        if known is None:
            began = perf_counter()
            made = make()
            known = replace(made, seconds_total=perf_counter() - began)
            yield known
        self.left -= _work(known)
        return known
