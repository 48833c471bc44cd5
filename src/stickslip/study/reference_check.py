"""Whether the harmonics of a study are enough at all: each accepted solution against twice as many (``--verify-harmonics``)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.harmonic.support import Harmonics
from stickslip.response.forced.response import forced_problem
from stickslip.response.verification import verify_reference
from stickslip.study.build import Case
from stickslip.study.chooser import error_text
from stickslip.study.collect import HZ, CaseResult
from stickslip.study.harmonics_table import HIGHEST, named
from stickslip.study.netcdf import variable

FACTOR = 2  # times the highest harmonic of the reference


@dataclass(frozen=True, eq=False)
class ReferenceDoubt:
    """What twice as many harmonics would change in a load case.

    Parameters
    ----------
    ratio
        F_CL/F_HE.
    harmonics
        Highest harmonic against which the solutions are held.
    high
        Harmonics that the study keeps at most.
    limit
        Predicted change that is tolerated, a fraction.
    errors
        (accepted points,) predicted change, a fraction; NaN where there is no solution.
    frequency_hz
        Where it is largest; NaN without a solution.
    kept
        Harmonics of the solution there, as text.
    label
        Where the change is taken that is largest there.
    """

    ratio: float
    harmonics: int
    high: Harmonics
    limit: float
    errors: FloatArray
    frequency_hz: float = float("nan")
    kept: str = ""
    label: str = ""

    @property
    def worst(self) -> float:
        """Largest predicted change, a fraction; NaN without a solution."""
        return float(np.nanmax(self.errors, initial=-np.inf)) if self.known else float("nan")

    @property
    def known(self) -> int:
        """Number of solutions that were checked."""
        return int(np.sum(~np.isnan(self.errors)))

    @property
    def above(self) -> int:
        """Number of solutions that would change by more than is tolerated."""
        return int(np.sum(self.errors > self.limit))

    @property
    def sentence(self) -> str:
        """What was checked and what came out."""
        ratio = f"F_CL/F_HE = {self.ratio:g}"
        if not self.known:
            return f"{ratio}: no solution that could be checked."
        size = error_text(self.worst)
        return (
            f"{ratio}: against {self.harmonics} harmonics, {self.above} of {self.known} solutions are predicted to change by more than "
            f"{100 * self.limit:g} % of their complex amplitude, phase included; the largest change is {size} of {self.label} at {self.frequency_hz:.2f} Hz, solved with H = {self.kept}."
        )

    @property
    def warning(self) -> str:
        """What to do about it; empty where nothing needs to be done."""
        if not self.above:
            return ""
        return (
            f"F_CL/F_HE = {self.ratio:g}: at {self.above} of {self.known} frequencies more harmonics than the study keeps are predicted to "
            f"change the response, in amplitude or phase, by more than {100 * self.limit:g} %. {self.advice}"
        )

    @property
    def advice(self) -> str:
        """Which harmonics to keep instead, and what that costs."""
        left_out = [h for h in range(1, self.high[-1]) if h not in self.high]
        more = self.high[-1] if left_out else min(self.harmonics, HIGHEST)
        if left_out:
            told = (
                f"harmonics.high leaves out {', '.join(map(str, left_out))}: keep them, and compare"
            )
        elif more > self.high[-1]:
            told = f"Raise harmonics.high, for instance to {more}, and compare"
        else:
            return (
                f"No study keeps more than {HIGHEST} harmonics: judge the result with that in mind."
            )
        return (
            f"{told}; a solution then has {2 * more + 1} unknowns a coordinate instead of {2 * len(self.high) - 1}, and its cost "
            "grows at least as much."
        )


def check_reference(
    case: Case, results: Sequence[CaseResult], limit: float
) -> list[ReferenceDoubt]:
    """Predict for every load case what twice as many harmonics would change.

    Parameters
    ----------
    case, results
        The model, and its finished load cases.
    limit
        Predicted change that is tolerated, a fraction.
    """
    return [_doubt(case, result, limit) for result in results]


def _doubt(case: Case, result: CaseResult, limit: float) -> ReferenceDoubt:
    problem = forced_problem(case.system, case.load(result.ratio), case.sweep)
    checks = verify_reference(problem, [a.point for a in result.accepted], FACTOR)
    solved = np.array([a.point.converged for a in result.accepted], dtype=bool)
    errors = np.full(solved.size, np.nan)
    errors[solved] = [c.error for c in checks]
    high = case.sweep.high_harmonics
    highest = FACTOR * high[-1]
    if not checks:
        return ReferenceDoubt(result.ratio, highest, high, limit, errors)
    worst = max(checks, key=lambda c: c.error)
    place = problem.measure.dofs.tolist().index(worst.dof)
    return ReferenceDoubt(
        result.ratio,
        highest,
        high,
        limit,
        errors,
        float(worst.omega / HZ),
        named(worst.kept),
        case.error_labels[place],
    )


def reference_variables(doubts: Sequence[ReferenceDoubt]) -> dict[str, xr.Variable]:
    """Return the checks as variables of the dataset."""
    return {
        "reference_error_percent": variable(
            "point",
            100 * np.concatenate([d.errors for d in doubts]),
            "percent",
            "change of the complex amplitude that twice as many harmonics are predicted to make, NaN without a solution",
        ),
        "reference_worst_percent": variable(
            "load_case", [100 * d.worst for d in doubts], "percent", "largest such change"
        ),
        "reference_worst_hz": variable(
            "load_case", [d.frequency_hz for d in doubts], "Hz", "where it is"
        ),
        "reference_above": variable(
            "load_case", [d.above for d in doubts], "1", "solutions above the threshold"
        ),
        "reference_sentence": variable(
            "load_case", [d.sentence for d in doubts], "1", "what the check says, in words"
        ),
    }
