"""The resonance peak of a forced response, resolved by a few points."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.selection.strategy import judged
from stickslip.response.forced.homotopies import homotopies
from stickslip.response.forced.passages import along_branch
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.response.forced.repeats import repeat
from stickslip.solve.continuation import start_point, step_to
from stickslip.solve.newton_method import Solution, charged
from stickslip.solve.rescue import solve_robustly
from stickslip.solve.status import Rung

NEARBY = 0.002  # half the bracket about a known peak, relative to its frequency
PEAK_RESOLUTION = 5e-4  # width of the bracket of the peak, relative to its frequency, at which it counts as resolved


def resolve_peak(
    problem: ForcedProblem,
    accepted: list[ForcedPoint],
    done: list[ForcedPoint],
    static: Callable[[], FloatArray] | None = None,
) -> Iterator[ForcedPoint]:
    """Add points around the highest one until its bracket is narrow.

    Parameters
    ----------
    problem
        The forced response.
    accepted
        Points of both passages in the order of the branch, its lowest frequency first.
    done
        Peak points of an interrupted run.
    static
        Gives the (n_retained,) static equilibrium, m, for the homotopies of what does not converge otherwise; None: they are not tried.
    """
    known = [p for p in accepted if p.converged]
    heights = [problem.amplitude(p) for p in known]
    for index in range(problem.sweep.peak_points):
        top = int(np.argmax(heights)) if heights else 0
        seam = _on_seam(known, top)
        omega = known[top].omega if seam else _vertex(known, heights)
        if omega is None:
            return
        if index < len(done):
            point = done[index]
        elif seam:
            point = _repeated_top(problem, known, top, index, static)
            yield point
        else:
            aside = known[top - 1 if omega <= known[top].omega else top + 1]
            point = _peak_point(problem, (known[top], aside), omega, index, static)
            yield point
        if not point.converged:
            return
        place = top if omega <= known[top].omega else top + 1
        known[place : place + seam] = [point]
        heights[place : place + seam] = [problem.amplitude(point)]


def _on_seam(known: list[ForcedPoint], top: int) -> bool:
    """Whether the highest point has few harmonics and a neighbour many: then it may be highest because it has few."""
    few = known[top].harmonics.size if known else 0
    return any(p.harmonics.size > few for p in known[max(top - 1, 0) : top + 2] if few)


def _repeated_top(
    problem: ForcedProblem,
    known: list[ForcedPoint],
    top: int,
    index: int,
    static: Callable[[], FloatArray] | None,
) -> ForcedPoint:
    began = perf_counter()
    here = known[top].index
    sides = {here - 1: known[max(top - 1, 0)], here + 1: known[min(top + 1, len(known) - 1)]}
    made = repeat(problem, known[top], sides, static)
    return replace(made, stage="peak", index=index, seconds_total=perf_counter() - began)


def peak_from(problem: ForcedProblem, point: ForcedPoint) -> ForcedPoint | None:
    """Return the peak of `problem` near a peak of a slightly different one; None if no solution is found there.

    Parameters
    ----------
    problem
        The changed problem; the order of its first passage, or its high one, is that of `point`.
    point
        The known peak.
    """
    balance = problem.balance(point.support)
    following = problem.following(balance)
    middle = start_point(balance, balance.unknowns(point.coefficients), point.omega, following)
    if not middle.solution.status.converged:
        return None
    sides = [
        step_to(balance, middle, (1.0 + side) * point.omega, following)
        for side in (-NEARBY, NEARBY)
    ]
    points = [
        forced_point(balance, p.solution, "peak", 0, p.p, 0.0) for p in (sides[0], middle, sides[1])
    ]
    found = [p for p in [*points, *resolve_peak(problem, points, [])] if p.converged]
    return max(found, key=problem.amplitude)


def _vertex(known: list[ForcedPoint], heights: list[float]) -> float | None:
    """Where to look next for the peak; None when it is resolved, at the ends of the branch, or where it folds."""
    top = int(np.argmax(heights)) if heights else 0
    if top in (0, len(known) - 1):
        return None
    a, b, c = (known[i].omega for i in (top - 1, top, top + 1))
    u, v, w = (heights[i] for i in (top - 1, top, top + 1))
    if not a < b < c or c - a < PEAK_RESOLUTION * b:
        return None
    below, above = (b - a) * (v - w), (b - c) * (v - u)
    # a kink holds the parabola on one side of the peak: halve the other side once it is three times as wide
    if max(c - b, b - a) > 3.0 * min(c - b, b - a) or below == above:
        return 0.5 * (b + c) if c - b > b - a else 0.5 * (a + b)
    return float(b - 0.5 * ((b - a) * below - (b - c) * above) / (below - above))


def _peak_point(
    problem: ForcedProblem,
    ends: tuple[ForcedPoint, ForcedPoint],
    omega: float,
    index: int,
    static: Callable[[], FloatArray] | None,
) -> ForcedPoint:
    """Solve at a frequency between two points: along the branch from either of them, then by all that `solve_robustly` knows."""
    began = perf_counter()
    top = ends[0]
    balance = problem.balance(top.support)
    solution = _between(problem, ends, omega, static)
    made = forced_point(balance, solution, "peak", index, omega, perf_counter() - began)
    strategy = problem.strategy
    if not strategy.verifies or not made.converged:
        return made
    if balance is not problem.low:
        return made
    verdict = judged(strategy, problem.step(balance, solution.x, omega))
    asked = np.array(verdict.again or (), dtype=np.int64)
    made = replace(made, predicted_error=verdict.indicator, asked=asked)
    if asked.size and verdict.start is not None:
        made = replace(made, start=verdict.start)
    if problem.alerted(made):
        made = replace(repeat(problem, made, {}, static), stage="peak")
    return replace(made, seconds_total=perf_counter() - began)


def _between(
    problem: ForcedProblem,
    ends: tuple[ForcedPoint, ForcedPoint],
    omega: float,
    static: Callable[[], FloatArray] | None,
) -> Solution:
    balance = problem.balance(ends[0].support)
    spent: list[Solution] = []
    for end in ends:
        found = along_branch(problem, end, omega, balance).solution
        rung = max(found.rung, Rung.SHORTER_STEP) if spent else found.rung
        spent.append(replace(found, rung=rung))
        if found.status.converged:
            return charged(spent[-1], spent)
    if static is None:
        return charged(spent[0], spent)
    solution = solve_robustly(
        lambda v: balance.linearise(v, omega),
        [balance.unknowns(end.coefficients) for end in ends],
        problem.sweep.newton,
        homotopies(balance, omega, static()),
        problem.following(balance).weights,
    )
    return charged(solution, [*spent, solution])
