"""The default response on random systems, and what it costs beside the smallest number of harmonics that is right everywhere."""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from evidence.benchmarks.trust import TRUTHS, Trial, said, trial, truth
from evidence.strategies.cases import SelectionCase, chain, friction_ring, two_blades_strong, two_blades_stuck
from stickslip.response.forced.choices import RUNGS
from stickslip.response.forced.collected import collect
from stickslip.response.forced.response import forced_problem, forced_response

SYSTEMS, SEED = 12, 7
THRESHOLD = 0.05
CASES: tuple[Callable[[], SelectionCase], ...] = (two_blades_strong, two_blades_stuck, friction_ring, chain)
EVERY = 4  # points of which one is judged


@dataclass(frozen=True)
class Cost:
    """What a response of a case takes, how wrong it is at most where it is trusted, and which share of it is not trusted."""

    unknowns: int
    seconds: float
    worst: float
    doubted: float


def cost(case: SelectionCase, **changes: Any) -> Cost:
    """Solve a case and judge every fourth point."""
    sweep = case.sweep(**changes)
    next(iter(forced_response(case.system, case.load, sweep)))
    began = process_time()
    points = list(forced_response(case.system, case.load, sweep))
    seconds = process_time() - began
    most = min(getattr(case.system.structure, "harmonics", TRUTHS[0]), TRUTHS[0])
    problem = forced_problem(case.system, case.load, sweep)
    wide = case.sweep(low=1, high=most, selection="jacobian_alert")
    true = forced_problem(case.system, case.load, wide)
    solved = [a for a in collect(problem, points, 0).accepted if a.point.converged]
    # a fixed number of harmonics says nothing of its error: all of it is asked to be right
    trusted = [a for a in solved if not sweep.auto or said(a) <= THRESHOLD]
    worst = float(np.nanmax([truth(true, a.point) for a in trusted[::EVERY]], initial=0.0))
    doubted = 1.0 - len(trusted) / len(solved)
    return Cost(sum(2 * p.harmonics.size - 1 for p in points), seconds, worst, doubted)


def smallest_right(case: SelectionCase) -> tuple[int, Cost]:
    """Return the smallest highest harmonic, the same at all frequencies, that is right everywhere, or the last one, and its cost."""
    for order in (1, *RUNGS):
        if order > getattr(case.system.structure, "harmonics", order):
            break
        found = order, cost(case, low=1, high=order, selection="always_high")
        if found[1].worst <= THRESHOLD:
            break
    return found


def of_cases() -> list[dict[str, Any]]:
    """Compare the default with the smallest number of harmonics that is right, case by case."""
    rows: list[dict[str, Any]] = []
    ours, theirs = 0.0, 0.0
    for make in CASES:
        case = make()
        order, fixed = smallest_right(case)
        auto = cost(case, high="auto")
        ours, theirs = ours + auto.seconds, theirs + fixed.seconds
        goal = 1.5 if order == 1 else 1.0
        ratio = auto.unknowns / fixed.unknowns
        rows.append(
            {
                "name": f"selection/auto_unknowns/{case.name}",
                "value": ratio,
                "goal": f"<= {goal}",
                "holds": ratio <= goal and auto.worst <= THRESHOLD,
                "note": f"against H = {order}; worst error {auto.worst:.2g} against {fixed.worst:.2g}; "
                f"{100 * auto.doubted:.0f} % doubted; CPU {auto.seconds:.2f} against {fixed.seconds:.2f} s",
            }
        )
    share = ours / theirs
    rows.append(
        {
            "name": "selection/auto_cpu",
            "value": share,
            "goal": "<= 0.8",
            "holds": share <= 0.8,
            "note": f"sum over the cases, {ours:.1f} against {theirs:.1f} s",
        }
    )
    return rows


def of_trials(trials: list[Trial]) -> list[dict[str, Any]]:
    """Count what was found, and what was trusted wrongly."""
    points, failed = sum(t.points for t in trials), sum(t.failed for t in trials)
    known = [j for t in trials for j in t.judged if not np.isnan(j.true)]
    trusted = [j for j in known if j.said <= THRESHOLD]
    wrong = sum(j.true > THRESHOLD for j in trusted)
    right = sum(j.true <= THRESHOLD for j in known)
    doubts = sum(j.true <= THRESHOLD for j in known if not j.said <= THRESHOLD)
    note = f"{len(trials)} systems, seed {SEED}, {len(known)} points judged"
    return [
        {
            "name": "trust/converged_share",
            "value": 1.0 - failed / points,
            "goal": ">= 0.999",
            "holds": failed <= 0.001 * points,
            "note": f"{note}; {failed} of {points} points failed",
        },
        {
            "name": "trust/wrong",
            "value": wrong,
            "goal": "0",
            "holds": wrong == 0,
            "note": f"{note}; trusted {len(trusted)}",
        },
        {
            "name": "trust/false_doubts",
            "value": doubts / max(right, 1),
            "goal": "<= 0.05",
            "holds": doubts <= 0.05 * right,
            "note": f"{note}; {doubts} of {right} right ones doubted",
        },
    ]


def run() -> list[dict[str, Any]]:
    """Count on random systems; compare the cost on the cases of the strategies page."""
    return [*of_trials([trial(SEED, "random", n) for n in range(SYSTEMS)]), *of_cases()]
