"""The two passages of the Jacobian Alert: a branch with few harmonics, then the frequencies that need more."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.balance import Linearisation
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.selection.strategy import always_kept, judged
from stickslip.harmonic.support import Harmonics
from stickslip.response.equilibrium import bonded_start, preload
from stickslip.response.forced.accepted import branch_end, replaced
from stickslip.response.forced.homotopies import homotopies
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.branch import Latest
from stickslip.solve.continuation import Point, advance, reversed_point, start_point, step_to
from stickslip.solve.newton_method import Solution, charged, newton
from stickslip.solve.rescue import Homotopy, solve_robustly

LOOP = 3  # multiples of `Sweep.points` after which a branch that gains no frequency is left
BRANCH_SEEDS = 4  # points from which a branch with many harmonics is begun
BRANCH_LENGTH = 8  # multiples of `Sweep.points` after which such a branch is given up
STALLS = 1.5  # multiples of `Sweep.points` after which it is left where it does not gain a step of frequency
LEAPS = (1.0, 0.25)  # steps of frequency by which it is then taken up further on
BACKWARD = 0.1  # share of the range by which it may fall back behind the start of the range
DETOUR = 30  # most points on the way from a neighbour to a repeat that fails


def first_passage(
    problem: ForcedProblem, load: HarmonicLoad, points: list[ForcedPoint]
) -> Iterator[ForcedPoint]:
    """Continue the first passage after `points`, which may be empty, and append to them.

    Each new point depends on `points` alone, so that a run taken up again goes on as it would have.
    """
    sweep = problem.sweep
    if sweep.grid.size:
        yield from _grid(problem, load, points)
        return
    first, last = sweep.ends
    latest = Latest(problem.low)
    while not points or _before(sweep, points[-1].omega, last) or not points[-1].converged:
        began = perf_counter()
        reach = points[_farthest(sweep, points)].omega if points else first
        if points and not points[-1].converged and reach == last:
            return
        point = None
        if points and not _lost(problem, points):
            following = problem.following(problem.low)
            point = advance(latest, problem.branch_point(points[-1]), last, following)
        if point is None or not point.solution.status.converged or _before(sweep, point.p, first):
            # the branch starts here, or is lost: take it up (again) a little further on
            gap = sweep.forward * _gap(sweep) if points else 0.0
            ahead = reach + gap if _before(sweep, reach + gap, last) else last
            # a single frequency is left to the repeats, which know both sides; a second one in a row to the homotopies
            left = bool(points) and points[-1].converged and problem.repeats
            point = fresh_point(problem, load, points, ahead, left, latest)
            point = point if sweep.direction == "up" else reversed_point(point)
        points.append(_low_point(problem, point, len(points), began, latest))
        yield points[-1]


def _before(sweep: Sweep, omega: float, other: float) -> bool:
    """Whether one frequency comes before another on the way."""
    return sweep.forward * omega < sweep.forward * other


def _farthest(sweep: Sweep, points: Sequence[ForcedPoint]) -> int:
    """Return the position of the point farthest along the way."""
    return int(np.argmax([sweep.forward * p.omega for p in points]))


def _lost(problem: ForcedProblem, points: list[ForcedPoint]) -> bool:
    """Whether the branch ended or runs in circles."""
    farthest = _farthest(problem.sweep, points)
    return not points[-1].converged or len(points) - farthest > LOOP * problem.sweep.points


def _grid(
    problem: ForcedProblem, load: HarmonicLoad, points: list[ForcedPoint]
) -> Iterator[ForcedPoint]:
    """Step through the frequencies of a list."""
    following = problem.following(problem.low)
    latest = Latest(problem.low)
    for omega in problem.sweep.grid[len(points) :]:
        began = perf_counter()
        before = [p for p in points if p.converged]
        point = None
        if before:
            point = step_to(latest, problem.branch_point(before[-1]), float(omega), following)
        if point is None or not point.solution.status.converged:
            point = fresh_point(problem, load, before, float(omega), latest=latest)
        points.append(_low_point(problem, point, len(points), began, latest))
        yield points[-1]


def fresh_point(
    problem: ForcedProblem,
    load: HarmonicLoad,
    points: list[ForcedPoint],
    omega: float,
    quickly: bool = False,
    latest: Latest | None = None,
) -> Point:
    """Solve without a branch that leads here.

    From the last solution; from the static equilibrium plus the bonded vibration; from a solution with few harmonics. Then, unless it is
    to go quickly, by all that `solve_robustly` knows. The evaluation at the solution is left in `latest`.
    """
    balance = problem.low
    following = problem.following(balance)
    if quickly:
        solution = _from_starts(problem, load, points, omega)
    else:
        solution = solve_robustly(
            lambda x: balance.linearise(x, omega),
            _starts(problem, load, points, omega),
            problem.sweep.newton,
            _ways(problem, load, omega),
            following.weights,
        )
    if not solution.status.converged:
        upward = np.append(np.zeros(balance.size), 1.0)
        return Point(solution.x, omega, upward, following.control.first, solution, 0.0)
    return replace(start_point(latest or balance, solution.x, omega, following), solution=solution)


def _from_starts(
    problem: ForcedProblem, load: HarmonicLoad, points: list[ForcedPoint], omega: float
) -> Solution:
    """Return where Newton's method ends from the first start that converges, or from the last one."""
    spent: list[Solution] = []
    for start in _starts(problem, load, points, omega):
        spent.append(newton(lambda x: problem.low.linearise(x, omega), start, problem.sweep.newton))
        if spent[-1].status.converged:
            break
    return charged(spent[-1], spent)


def _ways(problem: ForcedProblem, load: HarmonicLoad, omega: float) -> Iterator[Homotopy]:
    yield from homotopies(problem.low, omega, preload(problem.system, load.static))


def _starts(
    problem: ForcedProblem, load: HarmonicLoad, points: list[ForcedPoint], omega: float
) -> Iterator[FloatArray]:
    """Yield scaled unknowns of the first passage to start Newton from."""
    balance = problem.low
    if points and points[-1].converged:
        yield balance.unknowns(points[-1].coefficients)
    guess = balance.coefficients(bonded_start(balance, omega, problem.system))
    guess[0] = preload(problem.system, load.static)
    yield balance.unknowns(guess)
    driven = max(load.harmonics, default=balance.order)
    few = balance.with_harmonics(tuple(h for h in balance.harmonics if h <= max(driven, 1)))
    if few.order < balance.order:
        solution = newton(
            lambda x: few.linearise(x, omega), few.unknowns(guess), problem.sweep.newton
        )
        if solution.status.converged:
            yield balance.unknowns(few.coefficients(solution.x))


def _low_point(
    problem: ForcedProblem, point: Point, index: int, began: float, latest: Latest
) -> ForcedPoint:
    error = np.nan
    asked: Harmonics = ()
    start = np.zeros((0, 0), dtype=complex)
    if point.solution.status.converged and always_kept(problem.strategy) is None:
        known = latest.known(point.x, point.p)
        left = known.events if isinstance(known, Linearisation) else None
        verdict = judged(problem.strategy, problem.step(problem.low, point.x, point.p, left=left))
        error, asked = verdict.indicator, verdict.again or ()
        start = verdict.start if asked and verdict.start is not None else start
    made = forced_point(problem.low, point.solution, "low", index, point.p, perf_counter() - began)
    return replace(
        made,
        tangent=point.tangent,
        step=point.step,
        orientation=point.orientation,
        predicted_error=error,
        asked=np.array(asked, dtype=np.int64),
        start=start,
    )


def follow_run(
    problem: ForcedProblem,
    first: int,
    last: int,
    low: list[ForcedPoint],
    branch: list[ForcedPoint],
    high: Mapping[int, ForcedPoint],
) -> Iterator[ForcedPoint]:
    """Follow the branch with many harmonics through a run of repeats that did not all converge, and append to `branch`.

    Where the two orders differ much the branch may fold: then some frequencies have no solution near the low-order one, and only the
    branch itself leads through. It ends at the next quiet point if it comes to its motion, else at the end of the range. Stiff contacts
    that lift off under little damping fold it hundreds of times within a step of frequency: there it is left, as a machine would leave
    it, for a solution further on.
    """
    sweep, balance = problem.sweep, problem.high
    end = branch_end(low, last)
    begin, stop = sweep.omega_range
    margin = BACKWARD * (stop - begin)
    following = problem.following(balance)
    while len(branch) <= BRANCH_LENGTH * sweep.points and replaced(branch, low, last) < 0:
        began = perf_counter()
        here = branch[-1] if branch else None
        lost = here and not (here.converged and begin - margin < here.omega < stop + margin)
        if here is None:
            point = _branch_start(problem, low, high, first)
        else:
            leap = lost or _stalled(sweep, branch)
            point = _further_on(problem, low, branch, end) if leap else None
            if point is None and not lost and not _idle(sweep, branch):
                # another sheet at the frequency of the end: on to that of the range
                goal = low[-1].omega if any(p.omega == end for p in branch) else end
                point = advance(balance, problem.branch_point(here), goal, following)
        if point is None:
            return
        made = forced_point(
            balance, point.solution, "branch", first, point.p, perf_counter() - began
        )
        branch.append(
            replace(made, tangent=point.tangent, step=point.step, orientation=point.orientation)
        )
        yield branch[-1]


def _stalled(sweep: Sweep, branch: Sequence[ForcedPoint]) -> bool:
    """Whether the last points of a branch together gained less than a step of frequency; asked once for so many of them."""
    count = int(STALLS * sweep.points)
    if len(branch) % count:
        return False
    reach = [sweep.forward * p.omega for p in branch]
    return max(reach) - max(reach[:-count], default=reach[0]) < _gap(sweep)


def _idle(sweep: Sweep, branch: Sequence[ForcedPoint]) -> bool:
    """Whether the last points of a branch gained no frequency at all."""
    return len(branch) - _farthest(sweep, branch) > STALLS * sweep.points


def _gap(sweep: Sweep) -> float:
    return sweep.control.largest * sweep.control.scale


def _further_on(
    problem: ForcedProblem,
    low: Sequence[ForcedPoint],
    branch: Sequence[ForcedPoint],
    end: float,
) -> Point | None:
    """Solve beyond the farthest frequency of a branch, from its farthest point and from the first passage there."""
    sweep, balance = problem.sweep, problem.high
    following = problem.following(balance)
    found = [p for p in branch if p.converged]
    farthest = found[_farthest(sweep, found)]
    end = end if _before(sweep, farthest.omega, end) else low[-1].omega
    for leap in LEAPS:
        omega = farthest.omega + sweep.forward * leap * _gap(sweep)
        omega = omega if _before(sweep, omega, end) else end
        beside = min((p for p in low if p.converged), key=lambda p: abs(p.omega - omega))
        for seed in (farthest, beside):
            point = start_point(balance, balance.unknowns(seed.coefficients), omega, following)
            if point.solution.status.converged:
                return point if sweep.direction == "up" else reversed_point(point)
        if omega == end:
            break
    return None


def _branch_start(
    problem: ForcedProblem,
    low: list[ForcedPoint],
    high: Mapping[int, ForcedPoint],
    first: int,
) -> Point | None:
    """Solve with many harmonics at an accepted point before index `first`, so that the whole run is passed."""
    balance = problem.high
    following = replace(problem.following(balance), newton=problem.sweep.newton)
    usable = [high.get(p.index, p) for p in low[:first] if p.converged]
    usable = [p for p in usable if p.converged and (p.stage == "high" or not problem.alerted(p))]
    for seed in sorted(usable, key=lambda p: -p.index)[:BRANCH_SEEDS]:
        point = start_point(balance, balance.unknowns(seed.coefficients), seed.omega, following)
        if point.solution.status.converged:
            # a first passage that goes down, or was coming back from a fold, goes on downward
            return reversed_point(point) if _goes_down(problem.sweep, low[seed.index]) else point
    return None


def _goes_down(sweep: Sweep, point: ForcedPoint) -> bool:
    """Whether frequencies fall beyond a point of the first passage; tangents of listed frequencies all show upward."""
    if sweep.grid.size:
        return sweep.direction == "down"
    return point.tangent.size > 0 and bool(point.tangent[-1] < 0.0)


def along_branch(
    problem: ForcedProblem, point: ForcedPoint, omega: float, balance: Balance | None = None
) -> Point:
    """Go from an accepted point to another frequency on the branch with many harmonics, or on that of `balance`."""
    balance = problem.high if balance is None else balance
    following = problem.following(balance)
    following = replace(following, control=replace(following.control, max_points=DETOUR))
    start = start_point(balance, balance.unknowns(point.coefficients), point.omega, following)
    if not start.solution.status.converged:
        return start
    return step_to(balance, start, omega, following)
