"""The check of the reference harmonics, five, against solutions with those that it asks for: what it predicts and what they change."""

import numpy as np

from evidence.strategies.cases import CASES, SelectionCase
from evidence.validation.compare import Record, bound, record
from stickslip.arrays import FloatArray
from stickslip.harmonic.selection.guarded_alert import GuardedAlert
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.verification import check_support
from stickslip.solve.newton_method import Newton

SOURCE = "own solution with the harmonics of the check"
MATTERS = 1e-4  # errors below which a ratio says nothing
LIMIT = GuardedAlert().threshold  # above it a point is doubted
ERROR = "relative change from 5 harmonics to those of the check"


EXACT = Newton(tolerance=1e-13)  # at a resonance the residual counts a hundredfold


def predicted_and_real(case: SelectionCase) -> FloatArray:
    """Return (points, 2): the error that the harmonics of the check are predicted to make and the one that they make."""
    sweep = case.sweep(selection="always_high")
    problem = forced_problem(case.system, case.load, sweep)
    five = accepted_points(list(forced_response(case.system, case.load, sweep)))
    solved = [p for p in five if p.converged]
    checks = check_support(problem, solved)
    asked = checks[0].harmonics
    more = case.sweep(low=asked, high=asked, selection="always_low", newton=EXACT)
    points = accepted_points(list(forced_response(case.system, case.load, more)))
    exact = {p.omega: p for p in points if p.converged}
    return np.array(
        [
            [check.error, problem.real_error(p, exact[p.omega])]
            for p, check in zip(solved, checks, strict=True)
            if p.omega in exact
        ]
    )


def run() -> list[Record]:
    """Compare point by point: a friction ring, a chain of sliders, two blades that slip and lift off, and two that stick."""
    case = "reference check"
    records = []
    # where no contact changes its state for long the prediction is right to fourth order
    for name in ("friction_ring", "chain"):
        both = predicted_and_real(CASES[name]())
        worst = both[np.argmax(both[:, 0])]
        ratio = both[both[:, 1] > MATTERS]
        ratio = ratio[:, 0] / ratio[:, 1]
        records += [
            record(case, f"largest predicted {ERROR}, {name}", worst[0], worst[1], 1e-3, SOURCE),
            record(case, f"smallest predicted over real, {name}", ratio.min(), 1.0, 1e-3, SOURCE),
            record(case, f"largest predicted over real, {name}", ratio.max(), 1.0, 1e-3, SOURCE),
        ]
    return [*records, *_of_blades(case)]


def _of_blades(case: str) -> list[Record]:
    """Compare where contacts change their states."""
    name = "two_blades_strong"
    both = predicted_and_real(CASES[name]())
    found, real = both[both[:, 1] > MATTERS].T
    ratio = found / real
    far = np.mean((ratio < 0.5) | (ratio > 2.0))
    under = np.max((real / found)[real > 0.01])
    missed = np.count_nonzero((both[:, 1] > LIMIT) & (both[:, 0] < LIMIT))
    false = np.mean((both[:, 1] < LIMIT) & (both[:, 0] > LIMIT))
    stuck = predicted_and_real(CASES["two_blades_stuck"]())
    of = f"{LIMIT:.0%}"
    return [
        record(case, f"median of predicted over real, {name}", np.median(ratio), 1.0, 0.01, SOURCE),
        bound(case, f"share of predictions off by more than a factor of two, {name}", far, 0.1, SOURCE),
        bound(case, f"real over predicted at most, errors above 1 %, {name}", under, 2.0, SOURCE),
        bound(case, f"points whose error exceeds {of} and is predicted below, {name}", missed, 0.0, SOURCE),
        bound(case, f"share of points whose error is below {of} and predicted above, {name}", false, 0.1, SOURCE),
        bound(case, "predicted error, two_blades_stuck", stuck[:, 0].max(), 1e-12, SOURCE),
        bound(case, "real error, two_blades_stuck", stuck[:, 1].max(), 1e-9, SOURCE),
    ]
