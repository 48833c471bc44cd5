"""The check of the reference harmonics, five, against solutions with ten: what it predicts and what ten harmonics change."""

import numpy as np

from evidence.strategies.cases import CASES, SelectionCase
from evidence.validation.compare import Record, bound, record
from stickslip.arrays import FloatArray
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.verification import check_support
from stickslip.solve.newton_method import Newton

SOURCE = "own solution with ten harmonics"
MATTERS = 1e-4  # errors below which a ratio says nothing
ERROR = "relative change from 5 to 10 harmonics"


EXACT = Newton(tolerance=1e-13)  # at a resonance the residual counts a hundredfold


def predicted_and_real(case: SelectionCase) -> FloatArray:
    """Return (points, 2): the error that ten harmonics are predicted to make and the one that they make."""
    sweep = case.sweep(selection="always_high")
    problem = forced_problem(case.system, case.load, sweep)
    five = accepted_points(list(forced_response(case.system, case.load, sweep)))
    ten = accepted_points(
        list(
            forced_response(
                case.system,
                case.load,
                case.sweep(low=10, high=10, selection="always_low", newton=EXACT),
            )
        )
    )
    exact = {p.omega: p for p in ten if p.converged}
    solved = [p for p in five if p.converged and p.omega in exact]
    checks = check_support(problem, solved)
    real = [problem.real_error(p, exact[p.omega]) for p in solved]
    return np.array([[c.error, r] for c, r in zip(checks, real, strict=True)])


def run() -> list[Record]:
    """Compare point by point: a friction ring, a chain of sliders, two blades that slip and lift off, and two that stick."""
    case = "reference check"
    records = []
    # where no contact changes its state for long the prediction is right to second order
    for name in ("friction_ring", "chain"):
        both = predicted_and_real(CASES[name]())
        worst = both[np.argmax(both[:, 0])]
        ratio = both[both[:, 1] > MATTERS]
        ratio = ratio[:, 0] / ratio[:, 1]
        records += [
            record(case, f"largest predicted {ERROR}, {name}", worst[0], worst[1], 0.05, SOURCE),
            record(case, f"smallest predicted over real, {name}", ratio.min(), 1.0, 0.15, SOURCE),
            record(case, f"largest predicted over real, {name}", ratio.max(), 1.0, 0.15, SOURCE),
        ]
    both = predicted_and_real(CASES["two_blades_strong"]())
    ratio = both[both[:, 1] > MATTERS]
    ratio = ratio[:, 0] / ratio[:, 1]
    name = "two_blades_strong"
    far = float(np.mean((ratio < 0.5) | (ratio > 2.0)))
    large = both[both[:, 1] > 0.01]
    under = float(np.max(large[:, 1] / large[:, 0]))
    records += [
        record(case, f"median of predicted over real, {name}", np.median(ratio), 1.0, 0.1, SOURCE),
        bound(case, f"share of points off by more than a factor of two, {name}", far, 0.25, SOURCE),
        # contacts change their states: an error is not missed by more than this
        bound(case, f"real over predicted at most, errors above 1 %, {name}", under, 2.5, SOURCE),
    ]
    stuck = predicted_and_real(CASES["two_blades_stuck"]())
    return [
        *records,
        bound(case, "predicted error, two_blades_stuck", stuck[:, 0].max(), 1e-12, SOURCE),
        bound(case, "real error, two_blades_stuck", stuck[:, 1].max(), 1e-9, SOURCE),
    ]
