"""Resonance peak of a forced response: resolved by a few added points, and audited."""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.response.continuation.branch import Followed, Judged
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.forced.along import ForcedCurve, of_forced, to_forced
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.solve.branch import Latest
from stickslip.solve.continuation import Point, start_point, step_to
from stickslip.solve.fallbacks import steps_at_most
from stickslip.solve.newton_method import Solution, charged, first_converged, newton
from stickslip.solve.status import Rung

NEARBY = 0.002  # half-width of the initial bracket about a known peak, relative to its frequency
WALK = 6  # most points beyond the bracket, each twice as far, until the peak is enclosed
PEAK_CHANGE = 0.005  # relative change of a peak with more harmonics that ends its audit
ALMOST = 0.95  # share of the peak above which points get its harmonics
FREQUENCY_RTOL = 1e-5  # smallest useful relative distance of frequencies
PEAK_RESOLUTION = 5e-4  # width of a resolved peak's bracket, relative to its frequency


def resolve_peak(
    problem: ForcedProblem, accepted: Sequence[ForcedPoint], done: Iterable[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Add points around the highest one until its bracket is narrow, each with the harmonics it needs.

    Parameters
    ----------
    problem
        The forced response.
    accepted
        Points of the response in the order of the branch.
    done
        Peak points of an interrupted run, and their checks.

    Yields
    ------
    ForcedPoint
        Points not in `done`: ``peak``, the one with most harmonics counts at each frequency; ``check`` with more
        harmonics, for comparison.
    """
    known = [p for p in accepted if p.converged][:: int(problem.sweep.forward)]
    search = _Search(problem, iter(done))  # an iterator is consumed as far as the peak needs it
    yield from _refined(problem, search, known, problem.sweep.peak_points)
    if not known or not problem.sweep.auto or not problem.sweep.peak_points:
        return
    top = known[_highest(problem, known)]
    made = yield from search.settled(top, audit=True)
    if made is top:
        return
    # points nearly as high may only be so because they have fewer harmonics
    height = ALMOST * problem.amplitude(made)
    for place, point in enumerate(known):
        if point is top:
            known[place] = made
        elif problem.amplitude(point) >= height and point.harmonics.size < made.harmonics.size:
            known[place] = yield from search.raised(point, made.support)
    yield from _refined(problem, search, known, problem.sweep.peak_points)


def _refined(problem: ForcedProblem, search: "_Search", known: list[ForcedPoint], most: int) -> Iterator[ForcedPoint]:
    """Add at most `most` points around the highest of `known` until its bracket is narrow."""
    heights = [problem.amplitude(p) for p in known] if most else []
    for _ in range(most):
        if not known:
            return
        top = int(np.argmax(heights))
        seam = _on_seam(known, top)
        omega = known[top].omega if seam else peak_vertex(known, heights)
        if omega is None:
            return
        aside = top - 1 if omega <= known[top].omega else min(top + 1, len(known) - 1)
        sides = known[max(top - 1, 0) : top + 2] if seam else (known[top], known[aside])
        point = yield from search.point(sides, omega)
        if not point.converged:
            return
        place = top if omega <= known[top].omega else top + 1
        known[place : place + seam] = [point]
        heights[place : place + seam] = [problem.amplitude(point)]


def _highest(problem: ForcedProblem, known: Sequence[ForcedPoint]) -> int:
    return int(np.argmax([problem.amplitude(p) for p in known]))


def peak_from(problem: ForcedProblem, point: ForcedPoint) -> ForcedPoint | None:
    """Return the peak of `problem` near a peak of a slightly different problem; None without a solution there.

    Parameters
    ----------
    problem
        The changed problem. Its low or its high order equals the order of `point`.
    point
        The known peak.
    """
    balance = problem.balance(point.support)
    following = problem.following(balance)
    middle = start_point(balance, balance.unknowns(point.coefficients), point.omega, following)
    if not middle.solution.status.converged:
        return None
    sides = [step_to(balance, middle, (1.0 + side) * point.omega, following) for side in (-NEARBY, NEARBY)]
    walked = [sides[0], middle, sides[1]]
    for _ in range(WALK):
        heights = [problem.amplitude(_at_peak(balance, p)) for p in walked if p.solution.status.converged]
        top = int(np.argmax(heights))
        if len(heights) < len(walked) or 0 < top < len(walked) - 1:
            break
        way = 1 if top else -1
        wider = walked[top].p * (1.0 + way * NEARBY * 2.0 ** (len(walked) - 3))
        walked.insert(top + (top > 0), step_to(balance, walked[top], wider, following))
    points = [_at_peak(balance, p) for p in walked][:: int(problem.sweep.forward)]
    found = [p for p in [*points, *resolve_peak(problem, points)] if p.converged]
    return max(found, key=problem.amplitude)


def _at_peak(balance: AnyBalance, point: Point) -> ForcedPoint:
    return forced_point(balance, point.solution, "peak", 0, point.p, 0.0)


Taken = Generator[ForcedPoint, None, ForcedPoint]


@dataclass(slots=True, eq=False)
class _Search:
    """Search that solves points of a peak, or takes them from an interrupted run."""

    problem: ForcedProblem
    stored: Iterator[ForcedPoint]
    count: int = 0

    def point(self, sides: Sequence[ForcedPoint], omega: float) -> Taken:
        """Solve at a frequency with the larger set of its two neighbours' harmonics.

        More are added if the strategy requests them.
        """
        made = yield from self._take(lambda: self._between(sides, omega))
        return (yield from self.settled(made))

    def settled(self, made: ForcedPoint, *, audit: bool = False) -> Taken:
        """Add harmonics until a point needs no more; `audit`: always compare it with more harmonics."""
        auto = self.problem.sweep.auto
        while made.converged:
            curve = self._curve(made.support)
            now = of_forced(curve, made)
            level = now.level + 1
            if level >= curve.levels or now.judged.bound == 0.0:
                break
            if curve.quiet(now.level, now.judged) and not audit:
                break
            stage: Stage = "check" if auto else "peak"
            more = yield from self._take(lambda: self._more(curve, now, level, stage))  # noqa: B023
            if not auto:
                return more
            if not more.converged or self._enough(curve, made, more, audit=audit):
                break
            made = yield from self._take(lambda: self._accepted(curve, more))  # noqa: B023
        return made

    def _enough(self, curve: ForcedCurve, made: ForcedPoint, more: ForcedPoint, *, audit: bool) -> bool:
        """Whether more harmonics change a point little enough; the limit for a peak is tighter."""
        change = self.problem.amplitude(more) / self.problem.amplitude(made) - 1.0
        if audit and abs(change) > PEAK_CHANGE:
            return False
        return curve.agree(of_forced(curve, made), of_forced(curve, more))

    def raised(self, point: ForcedPoint, support: Harmonics) -> Taken:
        """Solve a point with the harmonics of `support`; return the point itself if this fails."""
        curve = self._curve(support)
        now, level = of_forced(curve, point), curve.supports.index(support)
        more = yield from self._take(lambda: self._more(curve, now, level, "check"))
        if not more.converged:
            return point
        return (yield from self._take(lambda: self._accepted(curve, more)))

    def _take(self, make: Callable[[], ForcedPoint]) -> Taken:
        self.count += 1
        known = next(self.stored, None)
        if known is None:
            began = perf_counter()
            made = make()
            known = replace(made, index=self.count - 1, seconds_total=perf_counter() - began)
            yield known
        return known

    def _curve(self, support: Harmonics) -> ForcedCurve:
        """Return the curve with the levels of harmonics that a point may have."""
        problem, strategy = self.problem, self.problem.strategy
        if problem.sweep.auto:
            return ForcedCurve(problem, problem.sweep.supports)
        few = strategy.verifies and support == problem.low.harmonics != problem.high.harmonics
        supports = (support, problem.high.harmonics) if few else (support,)
        return ForcedCurve(problem, supports, raises=few)

    def _between(self, sides: Sequence[ForcedPoint], omega: float) -> ForcedPoint:
        """Solve along the branch from either side, then without a branch."""
        most = max(sides, key=lambda p: p.harmonics.size).support
        curve = self._curve(most)
        level = curve.supports.index(most)
        balance = curve.problem(level)
        third = steps_at_most(balance.size) // 3
        spent: list[Solution] = []
        for end in sides:
            found = self.problem.along_branch(end, omega, balance, third).solution
            rung = max(found.rung, Rung.SHORTER_STEP) if spent else found.rung
            spent.append(replace(found, rung=rung))
            if found.status.converged:
                break
        if not spent[-1].status.converged:
            near = [balance.unknowns(end.coefficients) for end in sides]
            options = self.problem.sweep.newton
            effort = 1 / 3 if self.problem.sweep.rescue == "all" else 0.0
            spent.append(without_branch(self.problem.system, balance, options, omega, near, effort))
        return self._point(curve, level, omega, charged(spent[-1], spent), "peak")

    def _more(self, curve: ForcedCurve, now: Followed, level: int, stage: Stage) -> ForcedPoint:
        """Solve with more harmonics, from the strategy's prediction and from the padded solution."""
        balance, options = curve.problem(level), self.problem.sweep.newton
        solution = first_converged(
            newton(lambda x: balance.linearise(x, now.p), start, options) for start in curve.starts(now, level)
        )
        return self._point(curve, level, now.p, solution, stage)

    def _accepted(self, curve: ForcedCurve, check: ForcedPoint) -> ForcedPoint:
        found = of_forced(curve, check)
        return self._point(curve, found.level, found.p, found.point.solution, "peak")

    def _point(self, curve: ForcedCurve, level: int, omega: float, solution: Solution, stage: Stage) -> ForcedPoint:
        latest = Latest(curve.problem(level))
        point = Point(solution.x, omega, np.zeros(0), 0.0, solution, 0.0)
        judged = Judged()
        if solution.status.converged and stage == "peak":
            judged = curve.judge(level, point, latest)
        found = Followed("point", self.count, level, point, judged, 0.0)
        return to_forced(curve, found, stage)


def _on_seam(known: Sequence[ForcedPoint], top: int) -> bool:
    """Whether the highest point has fewer harmonics than a neighbour: then it may be the highest for this reason."""
    few = known[top].harmonics.size if known else 0
    return any(p.harmonics.size > few for p in known[max(top - 1, 0) : top + 2] if few)


def peak_vertex(known: Sequence[ForcedPoint], heights: Sequence[float]) -> float | None:
    """Return the next frequency in the search for the peak.

    It is None if the peak is resolved, at an end of the branch, or beside a fold.
    """
    top = int(np.argmax(heights)) if heights else 0
    if top in (0, len(known) - 1):
        return None
    a, b, c = (known[i].omega for i in (top - 1, top, top + 1))
    u, v, w = (heights[i] for i in (top - 1, top, top + 1))
    if not a < b < c or c - a < PEAK_RESOLUTION * b:
        return None
    below, above = (b - a) * (v - w), (b - c) * (v - u)
    wider = 0.5 * (b + c) if c - b > b - a else 0.5 * (a + b)
    # at a kink, parabolas stay on one side of the peak: halve the other side once it is three times as wide
    if max(c - b, b - a) > 3.0 * min(c - b, b - a) or below == above:
        return wider
    vertex = float(b - 0.5 * ((b - a) * below - (b - c) * above) / (below - above))
    return wider if abs(vertex - b) < FREQUENCY_RTOL * b else vertex
