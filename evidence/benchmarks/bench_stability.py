"""What the stability of a point costs against the Newton solve of the same point, two blades with 33 retained dofs and H = 5.

The Newton solve starts from the solution at the neighbouring of twenty frequencies, as a sweep has it nearly, and ends at the sweep's tolerance.
Stability takes all 70 reduced dofs and the sliders: of the motion as it was solved (`multipliers`), and with the Newton step of more
harmonics and the multipliers behind it that make the verdict (`verdict`). `fold` is the sign of the determinant of the factors that a Newton
step has, one linearisation and one factorisation. `exponents` are those near the imaginary axis by Hill's method with 2 H + 3 harmonics,
those right of it counted; where this could not be done the note says so. All are medians of CPU time, taken in turns in one process on one thread.
"""

from collections import Counter
from itertools import pairwise
from typing import Any

import numpy as np

from evidence.benchmarks.bench_newton import medians
from evidence.models.two_blades import TwoBlades, two_blades
from stickslip.harmonic.fourier import to_real
from stickslip.response.forced.response import accepted_points
from stickslip.response.stability import hill_exponents, motion_stability, stability
from stickslip.solve.newton_method import newton

HERTZ = (165.0, 184.0)
RATIOS = (20.0, 5.0)
GOALS = {"fold": 1.0, "multipliers": 5.0, "verdict": 5.0, "exponents": 20.0}
ROUNDS = 5


def rows(case: TwoBlades, ratio: float) -> list[dict[str, Any]]:
    """Compare at every frequency at which a contact changes its state."""
    problem, points = case.stepped(ratio, HERTZ, "always_high")
    solved = sorted((p for p in accepted_points(points) if p.converged), key=lambda p: p.omega)
    found = []
    for before, point in pairwise(solved):
        verdict = stability(problem, point)
        if not verdict.transitions:
            continue
        balance, omega = problem.balance(point.support), point.omega
        start = balance.unknowns(before.coefficients)

        def solve() -> Any:
            return newton(lambda x: balance.linearise(x, omega), start, problem.sweep.newton)  # noqa: B023

        if not solve().status.converged:
            continue
        gaps = to_real(point.coefficients @ balance.interface.gap_operator.T)

        def as_solved() -> Any:
            system = problem.system
            return motion_stability(system.structure, system.interface, gaps, omega)  # noqa: B023

        def fold() -> Any:
            return np.linalg.slogdet(balance.linearise(start, omega).jac)  # noqa: B023

        coefficients = point.coefficients @ balance.interface.gap_operator.T

        def exponents() -> Any:
            return hill_exponents(problem.system, coefficients, omega, 2 * balance.order + 3)  # noqa: B023

        ways = [solve, as_solved, lambda: stability(problem, point), fold, exponents]  # noqa: B023
        counted = exponents().missing is not None
        found.append((medians(ways, ROUNDS), as_solved().transitions, verdict.verdict, counted))
    times = np.array([row[0] for row in found])
    milliseconds = 1e3 * np.median(times, axis=0)
    transitions = [row[1] for row in found]
    verdicts = Counter(row[2] for row in found)
    note = (
        f"F_CL/F_HE = {ratio:g}, {len(found)} frequencies with {min(transitions)} to {max(transitions)} transitions, "
        f"{', '.join(f'{n} {word}' for word, n in sorted(verdicts.items()))} at H = 5; "
        "medians: Newton {:.0f} ms, multipliers {:.0f} ms, verdict {:.0f} ms, fold {:.1f} ms, exponents {:.0f} ms; ".format(
            *milliseconds
        )
        + f"exponents counted at {sum(row[3] for row in found)}"
    )
    return [
        {
            "name": f"stability/{kind}_{name}_over_newton_{ratio:g}",
            "value": value,
            "goal": f"<= {GOALS[kind]:g}",
            "holds": value <= GOALS[kind],
            "note": note,
        }
        for column, kind in ((1, "multipliers"), (2, "verdict"), (3, "fold"), (4, "exponents"))
        for name, value in (
            ("median", float(np.median(times[:, column] / times[:, 0]))),
            ("largest", float(np.max(times[:, column] / times[:, 0]))),
        )
    ]


def run() -> list[dict[str, Any]]:
    """Compare at both ratios of static load and excitation."""
    case = two_blades()
    return [row for ratio in RATIOS for row in rows(case, ratio)]
