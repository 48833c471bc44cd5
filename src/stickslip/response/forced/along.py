"""Forced response along a branch with adaptive harmonics: raised until the error is small, audited, lowered again."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.judging import UNSEEN, covers, judging_balance, judging_set_of, ringing
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import Step, always_kept, judged
from stickslip.operators import Jacobian
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import Followed, Judged, Kind, Route
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point, with_stiffness
from stickslip.solve.branch import Latest
from stickslip.solve.continuation import Following, Point
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.linear import factorised, is_factorised
from stickslip.solve.newton_method import Solution, newton

_Inverse = Callable[[FloatArray], FloatArray | None]
KINDS: tuple[Kind, ...] = ("point", "audit", "trial", "found")
# safety factors on predictions, with the fewest harmonics and with more: smaller ones accepted some wrong motions
SAFETY = (2.0, 1.25)
SMALL = 100.0  # number of unknowns at which half the work of a Newton step grows with the unknowns
START = 0.3  # share of the threshold above which a predicted motion is kept as a start
ROUGHLY = 1e-3  # relative residual of the predicting step by an iterative solver
AGREE = 0.5  # share of the threshold by which neighbouring levels may differ: the next levels add to it
DOUBT = 2.0  # uncertainty of a prediction over the second Newton step
NEARLY = 8  # iterations to a nearby solution with fewer harmonics
SAME_SHEET_RTOL = 0.3  # relative difference up to which motions count as on the same sheet


@dataclass(frozen=True, eq=False)
class ForcedCurve:
    """Forced response as a curve with several levels of harmonics.

    Parameters
    ----------
    forced
        The forced response.
    supports
        Harmonics of each level; each level includes the previous one.
    raises
        Whether harmonics are raised where the estimated error is above the threshold.
    """

    forced: ForcedProblem
    supports: tuple[Harmonics, ...]
    raises: bool = True
    references: dict[Harmonics, HarmonicBalance] = field(default_factory=dict, repr=False)  # made when first needed

    @property
    def levels(self) -> int:
        """Number of levels."""
        return len(self.supports)

    def problem(self, level: int) -> Balance:
        """Return the balance with the harmonics of a level."""
        return self.forced.balance(self.supports[level])

    def following(self, level: int) -> Following:
        """Return the continuation options of a level."""
        return self.forced.following(self.problem(level))

    def lifted(self, x: FloatArray, level: int, to: int) -> FloatArray:
        """Convert unknowns from one level to another; missing harmonics are zero."""
        if level == to:
            return x
        return self.problem(to).unknowns(self.problem(level).coefficients(x))

    def starts(self, known: Followed, to: int) -> list[FloatArray]:
        """Return the starts for a level: the prediction of the judgement, if there is one, and the solution itself."""
        own = [self.lifted(known.point.x, known.level, to)]
        if known.judged.start is not None and to == known.level + 1:
            own.insert(0, self.problem(to).unknowns(known.judged.start))
        return own

    def fresh(self, level: int, p: float, near: Sequence[Followed], effort: float) -> Solution:
        """Solve at a frequency that no branch reached."""
        forced, known = self.forced, [self.lifted(n.point.x, n.level, level) for n in near]
        return without_branch(
            forced.system,
            self.problem(level),
            forced.sweep.newton,
            p,
            known,
            effort if forced.sweep.rescue == "all" else 0,
        )

    def cost(self, level: int) -> float:
        """Return the relative work of a Newton step; it grows linearly, as large systems are solved by iteration."""
        return 1.0 + self.problem(level).size / SMALL

    def judge(self, level: int, point: Point, latest: Latest) -> Judged:
        """Bound the error of a solution by the strategy's estimate for the harmonics of the next level."""
        strategy, forced = self.forced.strategy, self.forced
        if always_kept(strategy) is not None or (self.raises and self.levels == 1):
            return Judged()
        known = latest.known(point.x, point.p)
        left = known.events if isinstance(known, Linearisation) else None
        balance = self.problem(level)
        step = forced.step(balance, point.x, point.p, left=left)
        if self.raises and level + 1 == self.levels > 1:
            return self.at_the_cap(level, point)
        if self.raises and level > 0:
            return self._predicted(level, step, point)
        if level + 1 < self.levels:
            step = replace(step, reference=self._reference(level, point))
        verdict = judged(strategy, step)
        bound = (SAFETY[0] if self.raises else 1.0) * verdict.indicator
        if verdict.again is None:
            return Judged(bound)
        return Judged(bound, verdict.again, verdict.start)

    def _predicted(self, level: int, step: Step, point: Point) -> Judged:
        """Predict the error by a Newton step with the harmonics of the next level.

        A second step gives the uncertainty of the prediction.
        """
        more, following = self._reference(level, point), self.supports[level + 1]
        linear = to_tolerance(self.forced.sweep.newton.linear, ROUGHLY)
        kept: list[tuple[_Inverse | None, float]] = []

        def solve(jac: Jacobian, right: FloatArray) -> FloatArray | None:
            # for two right sides alone an operator is not assembled
            inverse = factorised(linear, jac) if is_factorised(jac) else partial(linear.solve, jac)
            kept.append((inverse, float(np.linalg.norm(right))))
            return None if inverse is None else inverse(right)

        alert = jacobian_alert(step.balance, more, step.x, step.omega, step.measure, solve, events=step.events)
        bound = SAFETY[1] * alert.error
        if kept and bound <= self.forced.strategy.threshold:
            bound += self._doubt(step, more, alert.start, *kept[0])
        if bound == 0.0 and (kept or not covers(step.balance, more)):
            bound = UNSEEN
        far = bound > START * self.forced.strategy.threshold
        start = more.coefficients(alert.start)[: following[-1] + 1] if far else None
        return Judged(bound, (), start)

    def _reference(self, level: int, point: Point) -> HarmonicBalance:
        """Return the reference problem of a level.

        It has the harmonics of the next level, the judging set, and harmonics that excite a resonance.
        """
        own, following = with_stiffness(self.problem(level)), self.supports[level + 1]
        wanted = {*following, *judging_set_of(own), *ringing(own, point.x, point.p)}
        if wanted <= set(following):
            return with_stiffness(self.problem(level + 1))
        harmonics = tuple(sorted(wanted))
        if harmonics not in self.references:
            self.references[harmonics] = judging_balance(own, harmonics)
        return self.references[harmonics]

    def _doubt(
        self, step: Step, more: HarmonicBalance, x: FloatArray, inverse: _Inverse | None, residual: float
    ) -> float:
        """Return the uncertainty of a prediction.

        Where contacts change their states, the next step may be as large or larger.
        """
        rest = more.linearise(x, step.omega).residual
        chord = None if inverse is None else inverse(-rest)
        if chord is None or not float(np.linalg.norm(rest)) <= residual:
            return np.inf
        linear, q = more.linear, step.balance.coefficients(step.x)
        rows = step.measure.rows(len(q), more.order + 1)
        moved = linear.recover_change(step.omega, more.coefficients(chord)[:rows])
        return DOUBT * step.measure.change(linear.recover(step.omega, q), moved)[0]

    def at_the_cap(self, level: int, point: Point) -> Judged:
        """Bound the error on the last allowed level by the difference from the previous level.

        This difference is larger than the error if the series converges.
        """
        before = self.problem(level - 1)
        x = self.lifted(point.x, level, level - 1)
        few_steps = replace(self.following(level - 1).newton, max_iterations=NEARLY)
        fewer = newton(lambda v: before.linearise(v, point.p), x, few_steps, NaturalLevel())
        if not fewer.status.converged:
            return Judged(np.inf)
        safety = SAFETY[min(level - 1, 1)]
        change = self._difference(point.p, (level - 1, fewer.x), (level, point.x))
        return Judged(max(safety * change, UNSEEN))

    def quiet(self, level: int, judged: Judged) -> bool:
        """Whether a bound is below the threshold, or unknown."""
        if not self.raises:
            return True
        return not judged.bound > self.forced.strategy.threshold

    def agree(self, fewer: Followed, more: Followed) -> bool:
        """Whether the motions differ by clearly less than the threshold."""
        return self.change(fewer, more) <= AGREE * self.forced.strategy.threshold

    def alike(self, one: Followed, other: Followed) -> bool:
        """Whether two motions differ by no more than the threshold."""
        return self.change(one, other) <= self.forced.strategy.threshold

    def near(self, fewer: Followed, more: Followed) -> bool:
        """Whether the motions are too close to lie on different sheets of the branch."""
        return self.change(fewer, more) <= SAME_SHEET_RTOL

    def change(self, fewer: Followed, more: Followed) -> float:
        """Return the largest relative difference between two motions, a fraction."""
        return self._difference(fewer.p, (fewer.level, fewer.point.x), (more.level, more.point.x))

    def _difference(self, omega: float, fewer: tuple[int, FloatArray], more: tuple[int, FloatArray]) -> float:
        a, b = (self.problem(level).coefficients(x) for level, x in (fewer, more))
        return self.forced.difference(omega, a, b)[0]

    def stored(self, found: Followed) -> Followed:
        """Return a solution in the form in which the journal restores it."""
        return of_forced(self, to_forced(self, found))

    def stage_of(self, found: Followed) -> Stage:
        """Return the stage under which the journal stores a solution."""
        if found.kind == "between":
            raise ValueError("no response has points between those of its branch")
        return "low" if found.kind == "point" and not self.raises else found.kind

    def height(self, found: Followed) -> float:
        """Return the amplitude of the first output, m."""
        return _height(self, found)


@lru_cache(maxsize=4)
def _height(curve: ForcedCurve, found: Followed) -> float:
    """Return a height; cached, because each point is compared with two neighbours."""
    q = curve.problem(found.level).coefficients(found.point.x)
    return curve.forced.amplitude_of(found.p, q)


def along_the_branch(problem: ForcedProblem, done: Sequence[ForcedPoint]) -> Iterator[ForcedPoint]:
    """Follow the response with the harmonics that each point needs.

    Parameters
    ----------
    problem
        The forced response.
    done
        Points of an interrupted run, in the order in which they came.

    Yields
    ------
    ForcedPoint
        Points not in `done`; the stage is the kind of `stickslip.response.continuation.adaptive_continuation.Followed`.
    """
    curve = ForcedCurve(problem, problem.sweep.supports)
    yield from followed(curve, route_of(problem), done)


def route_of(problem: ForcedProblem) -> Route:
    """Return the range and the steps of a sweep."""
    sweep = problem.sweep
    first, last = sweep.ends
    return Route(first=first, last=last, points=sweep.points, listed=tuple(sweep.grid.tolist()))


def followed(curve: ForcedCurve, route: Route, done: Sequence[ForcedPoint]) -> Iterator[ForcedPoint]:
    """Follow a curve, and convert its points from and to points of the response."""
    known = [of_forced(curve, p) for p in done]
    for found in follow(curve, route, known):
        yield to_forced(curve, found)


def to_forced(curve: ForcedCurve, found: Followed, stage: Stage | None = None) -> ForcedPoint:
    """Return a result of the continuation as a point of the response."""
    return _as_forced(curve, found, stage or curve.stage_of(found))


@lru_cache(maxsize=2)
def _as_forced(curve: ForcedCurve, found: Followed, stage: Stage) -> ForcedPoint:
    """Return `to_forced`, cached.

    The same object serves each time, since the continuation restarts from stored points.
    """
    point, judged = found.point, found.judged
    return forced_point(
        curve.problem(found.level), point.solution, stage, found.index, point.p, found.seconds, point, judged
    )


def of_forced(curve: ForcedCurve, point: ForcedPoint) -> Followed:
    """Return a point of the response as a result of the continuation."""
    kind: Kind = point.stage if point.stage in KINDS else "point"
    level = curve.supports.index(point.support)
    start = point.start if point.start.size else None
    judged = Judged(point.predicted_error, tuple(point.asked.tolist()), start)
    there = curve.forced.branch_point(point, curve.problem(level))
    return Followed(kind, point.index, level, there, judged, point.seconds_total)
