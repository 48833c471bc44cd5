"""NLvib's forced responses with cubic and unilateral springs and Jenkins elements, row by row.

Both programs sum the same samples of the same laws, so that a row is a solution of ours to rounding. The bounds are those that the
source names: 1e-9 of the force for residuals, 1e-7 for the way back from a disturbed row.
"""

import numpy as np

from evidence.validation.compare import Record, bound
from evidence.validation.reference_data import NlvibCase, has_complete, nlvib
from stickslip.solve.newton_method import Newton, newton

NAMES = ("a_duffing", "b_two_dof_unilateral", "d_three_dof_mixed", "g_chain20_jenkins")
DISTURBANCE = 1e-6  # of the largest entry, random; near the folds of case b, 1e-4 already lands on the other branch


def residuals(case: NlvibCase) -> list[float]:
    """Return the largest entry of our residual at each row, over the force."""
    scale = case.balance.displacement_scale
    return [
        float(np.max(np.abs(case.balance.linearise(row / scale, float(omega)).residual)))
        for omega, row in zip(case.omega, case.rows, strict=True)
    ]


def returns(case: NlvibCase) -> list[float]:
    """Solve from each row, disturbed; return how far from the row the solution is, relative to its largest entry.

    Rows at a turning point are left out, as their source says; infinite where the solver does not converge.
    """
    noise = np.random.default_rng(1)
    found = []
    for i, (omega, row) in enumerate(zip(case.omega, case.rows, strict=True)):
        if i in case.turning:
            continue
        x = row / case.balance.displacement_scale
        start = x + DISTURBANCE * np.max(np.abs(x)) * noise.uniform(-1, 1, x.size) * (np.abs(x) > 0)
        solution = newton(
            lambda v, w=float(omega): case.balance.linearise(v, w), start, Newton(tolerance=1e-12, max_iterations=60)
        )
        gone = np.max(np.abs(solution.x - x)) / np.max(np.abs(x))
        found.append(float(gone) if solution.status.converged else np.inf)
    return found


def run() -> list[Record]:
    """Compare all rows at hand."""
    records = []
    for name in NAMES:
        case = nlvib(name, complete=has_complete())
        label, source = f"NLvib {name}", "NLvib 1.3, commit 69598c5"
        rows = len(case.omega)
        moved = returns(case)
        records += [
            bound(label, f"largest residual over the force, {rows} rows", max(residuals(case)), 1e-9, source),
            bound(label, f"largest distance of the solution from the row, {len(moved)} rows", max(moved), 1e-7, source),
        ]
    return records
