"""The second passage of the Jacobian Alert: one frequency solved again with more harmonics."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.selection.strategy import judged
from stickslip.response.continuation.homotopies import homotopies
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.solve.branch import ParameterEvaluation
from stickslip.solve.fallbacks import solve_robustly, steps_at_most
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, Solution, charged, newton
from stickslip.solve.status import Rung

PATIENT = 16  # iterations of a repeat from one start
ISOLATED = 25  # iterations of a repeat beside none that is accepted: damped steps of planar friction need them, and one that comes through leads to the others
REPEAT_DISTANCE_RTOL = 1.0  # relative distance from a repeat beside a frequency within which it leads there at once
NEIGHBOURS = 1  # points on each side from which a repeat that fails is tried


def repeat(
    problem: ForcedProblem,
    point: ForcedPoint,
    others: Mapping[int, ForcedPoint],
    static: Callable[[], FloatArray] | None = None,
    branch: Sequence[ForcedPoint] = (),
) -> ForcedPoint:
    """Solve a frequency with more harmonics: from the best of q + Δq, q and its neighbours, or along the branch from a neighbour.

    A neighbour whose own neighbours failed is as far as the branch led: no detour begins farther away than the next point.

    Parameters
    ----------
    problem
        The forced response.
    point
        Point of the first passage.
    others
        Accepted points by index: repeats, and points of the first passage that need none.
    static
        Gives the (n_retained,) static equilibrium, m, for what `solve_robustly` tries if all else fails; None: that is not tried.
    branch
        Points of a branch with many harmonics: where it passed the frequency, it leads to a solution.
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

    # between two points of the branch a solution is near: a dozen evaluations where other starts take a hundred
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
        # from q itself contacts change one by one, which leads to a solution from farther away than the measure tells
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
    """Solve by all that may help, within so many Newton `steps`; not at all without a static equilibrium."""
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
    """Return the repeat of a frequency beside this one, if it is near: comparing it with other starts costs more than it saves."""
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
    """Sort starts by the Newton correction that the Jacobian at the padded low-order solution `q` foretells from each.

    The residual is no measure: a contact that has changed its state adds its stiffness times the motion to it, however near the
    solution is. Where there is no correction, the residual decides after all.
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
    """Solve from a start that is evaluated already."""
    first, begin = start

    def evaluate(x: FloatArray) -> ParameterEvaluation:
        return first if x is begin else balance.linearise(x, omega)

    return newton(evaluate, begin, options, NaturalLevel())


def _predicted(problem: ForcedProblem, point: ForcedPoint) -> list[FloatArray]:
    """Return q + Δq in a list; empty if q is no solution, or the strategy knows no better start."""
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
    """Return the two points of a branch between which it went across the frequency of `point`, on the sheet nearest to its motion."""
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
