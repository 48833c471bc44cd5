"""Table of everything that was solved, by load case and harmonics."""

import numpy as np

from stickslip.report.quantities import fixed
from stickslip.report.result import RATIO, Result
from stickslip.report.tables import html_table
from stickslip.study.harmonics_table import named


def attempts(result: Result) -> str:
    """One row a load case and set of harmonics: what it cost, those solutions included that nothing came of."""
    if not result.has("attempt_case", "attempt_kept"):
        return ""
    case = result.integers("attempt_case")
    kept = np.asarray(result.data["attempt_kept"].transpose("attempt", "harmonic").values)
    sets = [named(np.flatnonzero(row)) for row in kept]
    numbers = ("attempt_newton_iterations", "attempt_unknowns", "attempt_seconds")
    columns = [result.floats(name) for name in numbers]
    good = result.floats("attempt_status") == 0
    rows = []
    for load_case in result.cases:
        mine = case == load_case.index
        for own in sorted({s for s, m in zip(sets, mine, strict=True) if m}, key=_order):
            at = mine & np.array([s == own for s in sets])
            sums = [float(column[at].sum()) for column in columns]
            rows.append(
                [load_case.label, own, str(int(at.sum())), str(int((at & ~good).sum()))]
                + [fixed(total, digits) for total, digits in zip(sums, (0, 0, 2), strict=True)]
            )
    head = [RATIO, "H", "solved", "not converged", "Newton steps", "unknowns", "time (s)"]
    text = (
        "<h3>Everything that was solved</h3><p>By load case and harmonics, those solutions included in whose place others were "
        "accepted. The unknowns of all solutions together compare the work of strategies, whatever the machine.</p>"
    )
    return text + html_table(head, rows)


def _order(own: str) -> tuple[int, str]:
    return int(own.rsplit(", ", maxsplit=1)[-1]), own
