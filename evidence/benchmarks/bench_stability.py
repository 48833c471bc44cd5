"""What the stability of a point costs against the Newton solve of the same point, two blades with 33 retained dofs and H = 5.

Points of sweeps of 20 frequencies from 165 to 184 Hz at three ratios of static load and excitation, in stick, micro-slip (fewer than half of
the tangential springs slide), gross slip (at least half) and lift-off (a contact opens), three points of each. The Newton solve starts
from the solution at a neighbouring frequency and ends at the sweep's tolerance; the farther that is, the dearer the solve. Two
spacings are compared: 1 Hz, that of such a sweep, and 0.05 Hz, as refinement near a peak has it, where Newton needs an iteration or two.

Stability takes all 70 reduced dofs and the sliders: of the motion as it was solved (`multipliers`), and with the Newton step of more
harmonics and the multipliers behind it that make the verdict (`verdict`). `fold` is the sign of the determinant of the factors that a Newton
step has, one linearisation and one factorisation. `exponents` are those near the imaginary axis by Hill's method with 2 H + 3 harmonics,
those right of it counted; where this could not be done the note says so. They take seconds and are timed once; all else are medians of CPU
time, taken in turns with both Newton solves in one process on one thread.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np

from evidence.benchmarks.bench_newton import medians
from evidence.models.two_blades import TwoBlades, two_blades
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import to_real
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.forced.response import accepted_points
from stickslip.response.stability import hill_exponents, motion_stability, stability
from stickslip.response.stability.flow_map.contact_states import located_states
from stickslip.solve.newton_method import newton

HERTZ = (165.0, 184.0)
RATIOS = (20.0, 5.0, 3.0)
DENSE = 2.0 * np.pi * 0.05  # rad/s
GOALS = {"fold": 1.0, "multipliers": 5.0, "verdict": 5.0, "exponents": 20.0}
SPACINGS = ("1_hz", "0.05_hz")
REGIMES = ("stick", "micro_slip", "gross_slip", "lift_off")
POINTS, ROUNDS = 3, 5


@dataclass(frozen=True)
class _Case:
    """A point, the one before it, and what its contacts do."""

    problem: ForcedProblem
    before: ForcedPoint
    point: ForcedPoint
    regime: str
    transitions: int


def _cases(blades: TwoBlades, ratio: float) -> list[_Case]:
    """Return the points of a sweep."""
    problem, points = blades.stepped(ratio, HERTZ, "always_high")
    solved = sorted((p for p in accepted_points(points) if p.converged), key=lambda p: p.omega)
    operator, found = problem.low.interface.gap_operator, []
    for before, point in pairwise(solved):
        gaps = to_real(point.coefficients @ operator.T)
        states = located_states(problem.system.interface, gaps)
        if states is None or point.omega - before.omega > 4.0 * np.pi:
            continue
        closed = states.stiffness[:, :, 2, 2]
        slide = states.rows.size + states.always_slipping
        if np.any((closed.min(axis=0) == 0.0) & (closed.max(axis=0) > 0.0)):
            regime = "lift_off"
        elif not states.transitions:
            regime = "stick"
        else:
            regime = "gross_slip" if slide >= states.resting else "micro_slip"
        found.append(_Case(problem, before, point, regime, states.transitions))
    return found


def _times(case: _Case) -> tuple[FloatArray, bool] | None:
    """Return what both Newton solves and all ways cost, and whether exponents were counted; None where a Newton solve fails."""
    problem, point = case.problem, case.point
    balance, omega = problem.balance(point.support), point.omega
    gaps = point.coefficients @ balance.interface.gap_operator.T

    def solved(start: FloatArray, at: float) -> Any:
        return newton(lambda x: balance.linearise(x, at), start, problem.sweep.newton)

    far = balance.unknowns(case.before.coefficients)
    near = solved(balance.unknowns(point.coefficients), omega - DENSE)
    if not near.status.converged or not all(solved(start, omega).status.converged for start in (far, near.x)):
        return None
    structure, interface = problem.system.structure, problem.system.interface
    real = to_real(gaps)
    ways: list[Callable[[], object]] = [
        lambda: solved(far, omega),
        lambda: solved(near.x, omega),
        lambda: np.linalg.slogdet(balance.linearise(far, omega).jac),
        lambda: motion_stability(structure, interface, real, omega),
        lambda: stability(problem, point),
    ]
    for way in ways:  # once without the clock
        way()
    quick = medians(ways, ROUNDS)
    began = process_time()
    found = hill_exponents(problem.system, gaps, omega, 2 * balance.order + 3)
    return np.array([*quick, process_time() - began]), found.missing is not None


def _rows(regime: str, cases: list[_Case]) -> list[dict[str, Any]]:
    """Compare at points of one regime, spread over all that there are."""
    every = max(1, len(cases) // POINTS)
    timed = [(c, made) for c in cases[every // 2 :: every][:POINTS] if (made := _times(c))]
    if not timed:
        return []
    times = np.array([made[0] for _, made in timed])
    transitions = [case.transitions for case, _ in timed]
    milliseconds = 1e3 * np.median(times, axis=0)
    note = (
        "{} points with {} to {} transitions; medians in ms: Newton from 1 Hz away {:.1f}, from 0.05 Hz away {:.1f}, fold {:.1f}, "
        "multipliers {:.1f}, verdict {:.1f}, exponents {:.0f}; exponents counted at {}"
    ).format(len(timed), min(transitions), max(transitions), *milliseconds, sum(made[1] for _, made in timed))
    rows = []
    for column, (kind, goal) in enumerate(GOALS.items(), start=2):
        for of, spacing in enumerate(SPACINGS):
            value = float(np.median(times[:, column] / times[:, of]))
            rows.append(
                {
                    "name": f"stability/{kind}_{regime}_over_newton_{spacing}",
                    "value": value,
                    "goal": f"<= {goal:g}",
                    "holds": value <= goal,
                    "note": note,
                }
            )
    return rows


def run() -> list[dict[str, Any]]:
    """Compare in every regime."""
    blades = two_blades()
    cases = [case for ratio in RATIOS for case in _cases(blades, ratio)]
    return [row for regime in REGIMES for row in _rows(regime, [c for c in cases if c.regime == regime])]
