"""Passages of the Jacobian Alert (Gastaldi & Berruti 2017, section 4.4).

The double passage computes a branch with few harmonics, then repeats the frequencies that need more. The single passage
settles each frequency before the next.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, joined, of_all
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.harmonic.selection.strategy import Step, Verdict, judged
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.starting_solutions import homotopies, without_branch
from stickslip.response.forced.accepted import branch_end, points_of_branch, replaced, runs_of_repeats
from stickslip.response.forced.along import ForcedCurve, of_forced, route_of, to_forced
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import BRANCH_ITERATIONS, Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.solve.branch import ParameterEvaluation
from stickslip.solve.continuation import Point, advance, reversed_point, start_point
from stickslip.solve.fallbacks import solve_robustly, steps_at_most
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, Solution, charged, newton
from stickslip.solve.status import Rung

BRANCH_SEEDS = 4  # starting points that are tried for a branch with many harmonics
BRANCH_LENGTH = 8  # largest length of such a branch, in multiples of `Sweep.points`
BACKWARD = 0.1  # share of the range by which it may leave the range
PATIENT = 16  # iterations of a repeat from one start
# iterations of a repeat without accepted neighbours: planar friction needs damped steps, and one success helps others
ISOLATED = 25
REPEAT_DISTANCE_RTOL = (
    1.0  # relative distance up to which a neighbouring repeat is used as a start without comparing others
)
NEIGHBOURS = 1  # starting points on each side for a failed repeat


def double_passage(
    problem: ForcedProblem, done: Sequence[ForcedPoint], static: Callable[[], FloatArray]
) -> Iterator[ForcedPoint]:
    """Compute the response with few harmonics, then repeat the points that need more.

    A run of neighbouring repeats is solved forward, and failed repeats once more backward. Points that still fail are
    sought along the branch with many harmonics, which may replace the run, then by homotopies.

    Parameters
    ----------
    problem
        The forced response.
    done
        Points of an interrupted run, in their order.
    static
        Function that returns the (n_retained,) static equilibrium, m.

    Yields
    ------
    ForcedPoint
        Points not in `done`: ``low`` and ``found`` of the first passage, ``high`` for repeats, ``branch`` for the
        branch.
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
        """Repeat the points that need more harmonics, run by run."""
        passed = -1
        asked = {p.index: p for p in self.low if self.problem.asks_again(p)}
        for first, last in runs_of_repeats(asked):
            if last <= passed:  # a branch to the end of the range replaced this run
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
        """Return the missing points of a run."""
        return [p for p in run if p.index not in self.high or not self.high[p.index].converged]

    def _again(
        self, run: Sequence[ForcedPoint], way: Callable[[], FloatArray] | None, branch: Sequence[ForcedPoint]
    ) -> Iterator[ForcedPoint]:
        """Repeat the missing points of a run."""
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

    Where the two orders differ much, the branch may fold. Some frequencies then have no solution near the low-order
    one, and only the branch leads through. It ends at the motion of the next point without an alert, or at the end of
    the range.
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
                # on another sheet at that frequency: continue to the end of the range
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
            # keep the direction of the first passage, which may go down or return from a fold
            return reversed_point(point) if _goes_down(problem, low[seed.index]) else point
    return None


def _goes_down(problem: ForcedProblem, point: ForcedPoint) -> bool:
    """Whether frequencies fall after a point of the first passage.

    Tangents of listed frequencies always point upward.
    """
    if problem.sweep.grid.size:
        return problem.sweep.direction == "down"
    return point.tangent.size > 0 and bool(point.tangent[-1] < 0.0)


def repeat(
    problem: ForcedProblem,
    point: ForcedPoint,
    others: Mapping[int, ForcedPoint],
    static: Callable[[], FloatArray] | None = None,
    branch: Sequence[ForcedPoint] = (),
) -> ForcedPoint:
    """Solve one frequency with more harmonics.

    The starts are the best of q + Δq, q and its neighbours, or the branch from the next point.

    Parameters
    ----------
    problem
        The forced response.
    point
        Point of the first passage.
    others
        Accepted points by index: repeats, and points of the first passage without an alert.
    static
        Function that returns the (n_retained,) static equilibrium, m, for a last attempt by `solve_robustly`; None: no
        such attempt.
    branch
        Points of a branch with many harmonics, used as starts where it passed the frequency.
    """
    began = perf_counter()
    omega = point.omega
    balance = problem.balance(tuple(int(h) for h in point.asked) or problem.high.harmonics)
    near = _neighbours(point.index, others)
    q = balance.unknowns(point.coefficients)
    spent: list[Solution] = []
    most = steps_at_most(balance.size)

    def found() -> bool:
        return bool(spent) and spent[-1].status.converged

    def detours(ends: Sequence[ForcedPoint]) -> None:
        for end in ends:
            if found():
                return
            detour = problem.along_branch(end, omega, balance, most // 4).solution
            spent.append(replace(detour, rung=max(detour.rung, Rung.SHORTER_STEP)))

    # between two points of the branch a solution is near: it takes a dozen evaluations, from other starts a hundred
    detours(passing(branch, point))
    beside = [] if found() else [p for p in near if abs(p.index - point.index) <= 1]
    alone = not beside and not branch and static is None
    options = replace(problem.sweep.newton, max_iterations=ISOLATED if alone else PATIENT)
    led = None if found() else _leading(balance, point, beside)
    if led is not None:
        spent.append(newton(lambda v: balance.linearise(v, omega), led, options, NaturalLevel()))
    if not found():
        starts = [*_predicted(problem, point), *(balance.unknowns(p.coefficients) for p in near)]
        nearest, *further = _nearest_first(balance, omega, q, starts, options)
        # from q, contacts change their states one by one, which converges from farther away than the measure suggests
        second = [start for start in further if start[1] is q] or further[:1]
        for start in [nearest] if alone else [nearest, *second]:
            spent.append(_from_start(balance, omega, start, options))
            if found():
                break
    detours(beside)
    if not found():
        spent += _by_all(
            problem, balance, omega, nearest[1], static, max(most - charged(spent[-1], spent).iterations, 1)
        )
    solution = charged(spent[-1], spent)
    return forced_point(balance, solution, "high", point.index, omega, perf_counter() - began)


def _by_all(
    problem: ForcedProblem,
    balance: Balance,
    omega: float,
    start: FloatArray,
    static: Callable[[], FloatArray] | None,
    steps: int,
) -> list[Solution]:
    """Solve by homotopies and other globalisations within the given Newton `steps`.

    There is no attempt without a static equilibrium.
    """
    if static is None:
        return []
    solution = solve_robustly(
        lambda v: balance.linearise(v, omega),
        [start],
        problem.sweep.newton,
        homotopies(balance, omega, static()),
        problem.following(balance).weights,
        steps=steps,
    )
    return [solution]


def _leading(balance: Balance, point: ForcedPoint, beside: Sequence[ForcedPoint]) -> FloatArray | None:
    """Return the repeat at a neighbouring frequency if it is near.

    Comparing it with other starts costs more than it saves.
    """
    low = point.coefficients
    for known in beside:
        if known.order < balance.order:
            continue
        away = np.linalg.norm(known.coefficients[1 : len(low)] - low[1:])
        if away < REPEAT_DISTANCE_RTOL * np.linalg.norm(low[1:]):
            return balance.unknowns(known.coefficients)
    return None


def _nearest_first(
    balance: Balance, omega: float, q: FloatArray, others: Sequence[FloatArray], options: Newton
) -> list[tuple[ParameterEvaluation, FloatArray]]:
    """Sort starts by their Newton correction with the Jacobian at the padded low-order solution `q`.

    The residual is a poor measure: a contact that has changed its state adds its stiffness times the motion, however
    near the solution is. It decides only where the Jacobian is singular.
    """
    starts = [(balance.linearise(x, omega), x) for x in (q, *others)]
    jac = starts[0][0].jac
    solve = factorised(options.linear, jac.copy(order="F") if isinstance(jac, np.ndarray) else jac)

    def away(start: tuple[ParameterEvaluation, FloatArray]) -> float:
        residual = start[0].residual
        step = None if solve is None else solve(residual)
        size = float(np.linalg.norm(residual if step is None else step))
        return size if np.isfinite(size) else np.inf

    return sorted(starts, key=away)


def _from_start(
    balance: Balance, omega: float, start: tuple[ParameterEvaluation, FloatArray], options: Newton
) -> Solution:
    """Solve from a start that has been evaluated."""
    first, begin = start

    def evaluate(x: FloatArray) -> ParameterEvaluation:
        return first if x is begin else balance.linearise(x, omega)

    return newton(evaluate, begin, options, NaturalLevel())


def _predicted(problem: ForcedProblem, point: ForcedPoint) -> list[FloatArray]:
    """Return q + Δq in a list; empty if q is no solution, or the strategy predicts no start."""
    if not point.converged:
        return []
    if point.start.size:
        asked = tuple(int(h) for h in point.asked)
        return [problem.balance(asked).unknowns(point.start)]
    few = problem.balance(point.support)
    verdict = judged(problem.strategy, problem.step(few, few.unknowns(point.coefficients), point.omega))
    if verdict.start is None:
        return []
    return [problem.balance(verdict.again or problem.high.harmonics).unknowns(verdict.start)]


def passing(branch: Sequence[ForcedPoint], point: ForcedPoint) -> list[ForcedPoint]:
    """Return the two points of a branch on either side of the frequency of `point`.

    They lie on the sheet nearest to its motion.
    """
    ends = [
        sorted((a, b), key=lambda p: abs(p.omega - point.omega))
        for a, b in pairwise(p for p in branch if p.converged)
        if a.index == b.index and (a.omega - point.omega) * (b.omega - point.omega) <= 0.0
    ]
    low = point.coefficients[1:]

    def away(pair: list[ForcedPoint]) -> float:
        return float(np.linalg.norm(pair[0].coefficients[1 : len(low) + 1] - low))

    return min(ends, key=away, default=[])


def _neighbours(index: int, others: Mapping[int, ForcedPoint]) -> list[ForcedPoint]:
    """Return the accepted points nearest in index, from both sides."""
    below = sorted((i for i in others if i < index), reverse=True)[:NEIGHBOURS]
    above = sorted(i for i in others if i > index)[:NEIGHBOURS]
    return [others[i] for i in sorted([*below, *above], key=lambda i: abs(i - index))]


def single_passage(problem: ForcedProblem, done: Sequence[ForcedPoint]) -> Iterator[ForcedPoint]:
    """Solve equally spaced or listed frequencies in order; the strategy chooses the harmonics of each.

    A frequency is solved again with additional harmonics as long as the strategy requests them; the last solution
    counts. A failed frequency is tried once more with the reference harmonics, and at the end from the frequency after
    it.

    Parameters
    ----------
    problem
        The forced response.
    done
        Points of an interrupted run, in the order in which they came.

    Yields
    ------
    ForcedPoint
        Points not in `done`: the first solution of a frequency as ``low``, further ones as ``high``.
    """
    sweep = problem.sweep
    listed = sweep.grid if sweep.grid.size else sweep.spaced(sweep.points)
    grid = [float(w) for w in listed]
    stored = iter(done)
    tried: list[ForcedPoint] = []
    harmonics = problem.low.harmonics
    by_dof: ByDof | None = None
    for index, (omega, following) in enumerate(zip(grid, [*grid[1:], grid[-1]], strict=True)):
        before: Step | None = None
        start: ComplexArray | None = None
        first = True
        while True:
            began = perf_counter()
            kept = next(stored, None)
            if kept is None:
                balance = problem.local(harmonics, by_dof)
                solution = _solution(problem, balance, tried, omega, start)
                stage: Stage = "low" if first else "high"
                point = forced_point(balance, solution, stage, index, omega, 0.0)
            else:
                point = kept
            step, verdict = _judged(problem, point, following, before)
            again, again_by_dof = _more(problem, harmonics, by_dof, verdict)
            if kept is None:
                yield replace(
                    point,
                    predicted_error=verdict.indicator,
                    asked=np.array(again or (), dtype=np.int64),
                    seconds_total=perf_counter() - began,
                )
            tried.append(point)
            if again is None:
                break
            start = verdict.start
            harmonics, by_dof, before, first = again, again_by_dof, step, False
        harmonics, by_dof = verdict.following, verdict.following_by_dof
    yield from _from_behind(problem, tried, stored)


def _from_behind(
    problem: ForcedProblem, tried: Sequence[ForcedPoint], stored: Iterator[ForcedPoint]
) -> Iterator[ForcedPoint]:
    """Solve failed frequencies once more along the branch from the next frequency, the last ones first."""
    last = {p.index: p for p in tried}
    for index in reversed(range(len(last) - 1)):
        if last[index].converged or not last[index + 1].converged:
            continue
        began = perf_counter()
        point = next(stored, None)
        if point is None:
            omega, balance = last[index].omega, problem.high
            solution = problem.along_branch(last[index + 1], omega, balance).solution
            point = forced_point(balance, solution, "high", index, omega, perf_counter() - began)
            yield point
        last[index] = point


def _solution(
    problem: ForcedProblem, balance: AnyBalance, tried: Sequence[ForcedPoint], omega: float, start: ComplexArray | None
) -> Solution:
    """Solve from a given start or previous solutions, then along the branch from these, then without a start."""
    quick = replace(problem.sweep.newton, max_iterations=BRANCH_ITERATIONS)
    near = _nearest(tried, balance.harmonics, omega)
    guesses = [] if start is None else [balance.unknowns(start)]
    guesses += [balance.unknowns(p.coefficients) for p in near]
    spent: list[Solution] = []

    def taken() -> int:
        return sum(s.iterations for s in spent)

    if guesses:
        # the start with the smallest residual: contact states may differ with the frequency or the harmonics
        sizes = [float(np.linalg.norm(balance.linearise(x, omega).residual)) for x in guesses]
        x = guesses[int(np.argmin(sizes))]
        spent.append(newton(lambda v: balance.linearise(v, omega), x, quick))
    for point in near:
        if spent[-1].status.converged or taken() > steps_at_most(balance.size) // 2:
            break
        if point.omega != omega:
            spent.append(problem.along_branch(point, omega, balance).solution)
    if not (spent and spent[-1].status.converged):
        found = [balance.unknowns(p.coefficients) for p in tried if p.converged][-1:]
        left = 1.0 - taken() / steps_at_most(balance.size)
        effort = max(left, 0.0) if problem.sweep.rescue == "all" else 0.0
        spent.append(without_branch(problem.system, balance, problem.sweep.newton, omega, found, effort))
    return charged(spent[-1], spent)


def _nearest(tried: Sequence[ForcedPoint], harmonics: Harmonics, omega: float) -> list[ForcedPoint]:
    """Return the last solution with the same harmonics, the last of all, and the last at another frequency."""
    found = [p for p in tried if p.converged]
    alike = [p for p in found if p.support == harmonics]
    elsewhere = [p for p in found if p.omega != omega]
    return list({id(p): p for p in (*alike[-1:], *found[-1:], *elsewhere[-1:])}.values())


def _judged(
    problem: ForcedProblem, point: ForcedPoint, following: float, before: Step | None
) -> tuple[Step | None, Verdict]:
    """Return the strategy's input for a solution, and its verdict."""
    reference = problem.high.harmonics
    if not point.converged:
        # a failed point may have too few harmonics
        return None, Verdict(np.nan, reference, problem.sweep.low_harmonics)
    balance = problem.local(point.support, point.by_dof)
    x = balance.unknowns(point.coefficients)
    step = replace(problem.step(balance, x, point.omega, following), before=before)
    return step, judged(problem.strategy, step)


def _more(
    problem: ForcedProblem, had: Harmonics, by_dof: ByDof | None, verdict: Verdict
) -> tuple[Harmonics | None, ByDof | None]:
    """Return the harmonics of a repeat, for all coordinates and for each.

    Both are None unless they include new ones, so that repeats end.
    """
    asked = verdict.again or ()
    if by_dof is None and verdict.again_by_dof is None:
        wanted = tuple(sorted({*had, *asked}))
        return (None if wanted == had else wanted), None
    n = problem.low.linear.n
    before = by_dof or (had,) * n
    both = joined(before, verdict.again_by_dof or (asked,) * n)
    return (None, None) if both == before else (of_all(both), both)
