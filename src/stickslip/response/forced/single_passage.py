"""The single passage: the harmonics of each frequency are settled before the next one (Gastaldi & Berruti 2017, section 4.4)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from stickslip.arrays import ComplexArray
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, joined, of_all
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.harmonic.selection.strategy import Step, Verdict, judged
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import BRANCH_ITERATIONS, ForcedPoint, ForcedProblem, forced_point
from stickslip.solve.fallbacks import steps_at_most
from stickslip.solve.newton_method import Solution, charged, newton


def single_passage(problem: ForcedProblem, done: Sequence[ForcedPoint]) -> Iterator[ForcedPoint]:
    """Solve equally spaced or listed frequencies in order; the strategy chooses the harmonics of each.

    A frequency is solved again with additional harmonics as long as the strategy requests them; the last solution counts. A failed
    frequency is tried once more with the reference harmonics, and at the end from the frequency after it.

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
    """Look for frequencies that were not found once more, along the branch from the frequency after each, the last ones first."""
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
    """Solve from a given start, or what was found so far; then along the branch from there; then as without one."""
    quick = replace(problem.sweep.newton, max_iterations=BRANCH_ITERATIONS)
    near = _nearest(tried, balance.harmonics, omega)
    guesses = [] if start is None else [balance.unknowns(start)]
    guesses += [balance.unknowns(p.coefficients) for p in near]
    spent: list[Solution] = []

    def taken() -> int:
        return sum(s.iterations for s in spent)

    if guesses:
        # the smallest residual decides: contact states may have changed since, or with the harmonics
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
    """Return the last solutions with the same harmonics, at all, and at another frequency."""
    found = [p for p in tried if p.converged]
    alike = [p for p in found if p.support == harmonics]
    elsewhere = [p for p in found if p.omega != omega]
    return list({id(p): p for p in (*alike[-1:], *found[-1:], *elsewhere[-1:])}.values())


def _judged(
    problem: ForcedProblem, point: ForcedPoint, following: float, before: Step | None
) -> tuple[Step | None, Verdict]:
    """Return the solution as the strategy saw it, and what it said."""
    reference = problem.high.harmonics
    if not point.converged:
        # one that is not found may be so because its harmonics are too few
        return None, Verdict(np.nan, reference, problem.sweep.low_harmonics)
    balance = problem.local(point.support, point.by_dof)
    x = balance.unknowns(point.coefficients)
    step = replace(problem.step(balance, x, point.omega, following), before=before)
    return step, judged(problem.strategy, step)


def _more(
    problem: ForcedProblem, had: Harmonics, by_dof: ByDof | None, verdict: Verdict
) -> tuple[Harmonics | None, ByDof | None]:
    """Return the harmonics of a repeat, and those of each coordinate; None if it would have no more than there were: that ends every quarrel."""
    asked = verdict.again or ()
    if by_dof is None and verdict.again_by_dof is None:
        wanted = tuple(sorted({*had, *asked}))
        return (None if wanted == had else wanted), None
    n = problem.low.linear.n
    before = by_dof or (had,) * n
    both = joined(before, verdict.again_by_dof or (asked,) * n)
    return (None, None) if both == before else (of_all(both), both)
