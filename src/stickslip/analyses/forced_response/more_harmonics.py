"""``--verify-harmonics``: the predicted change of each accepted solution by twice the harmonics of the study."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.analyses.forced_response.chooser import error_text
from stickslip.analyses.forced_response.problem import MORE_THAN_LOW, Question
from stickslip.analyses.forced_response.records.points import Response
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import Harmonics, named
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.response.verification import check_support
from stickslip.study.file.harmonics import HIGHEST
from stickslip.units import HZ


@dataclass(frozen=True, eq=False)
class ReferenceDoubt:
    """Predicted changes of a response by the harmonics of the judging set.

    Parameters
    ----------
    harmonics
        Highest harmonic of the judging set.
    high
        Highest harmonic that the study keeps.
    limit
        Tolerated change, a fraction.
    errors
        (accepted points,) predicted change, a fraction; NaN at points without a solution.
    frequency_hz
        Frequency of the largest change; NaN without a solution.
    kept
        Harmonics of the solution at this frequency, as text.
    label
        Dof with the largest change at this frequency.
    only
        Harmonics of every solution, if the selection keeps the low ones everywhere; else None.
    """

    harmonics: int
    high: Harmonics
    limit: float
    errors: FloatArray
    frequency_hz: float = float("nan")
    kept: str = ""
    label: str = ""
    only: Harmonics | None = None

    @property
    def worst(self) -> float:
        """Largest predicted change, a fraction; NaN without a solution."""
        return float(np.nanmax(self.errors, initial=-np.inf)) if self.known else float("nan")

    @property
    def known(self) -> int:
        """Number of solutions checked."""
        return int(np.sum(~np.isnan(self.errors)))

    @property
    def above(self) -> int:
        """Number of solutions whose predicted change exceeds the limit."""
        return int(np.sum(self.errors > self.limit))

    @property
    def sentence(self) -> str:
        """The check and its outcome as a sentence."""
        if not self.known:
            return "no solution that could be checked."
        told = (
            f"against harmonics up to {self.harmonics}, where harmonics.high stands for {named(self.high)}, {self.above} of {self.known} solutions are predicted to change by more than "
            f"{100 * self.limit:g} % of their complex amplitude, phase included; the largest change is {error_text(self.worst)} "
            f"of {self.label} at {self.frequency_hz:.2f} Hz, solved with H = {self.kept}."
        )
        return f"{told} {self.advice}" if self.above else told

    @property
    def advice(self) -> str:
        """The harmonics to keep instead, and their cost."""
        if self.only is not None:
            return (
                f'With harmonics.selection = "always_low" every solution keeps H = {named(self.only)}, whatever harmonics.high says. {MORE_THAN_LOW}, '
                f"and compare; with H = {self.high[-1]} a solution has {2 * self.high[-1] + 1} unknowns a coordinate instead of "
                f"{2 * len(self.only) - 1}, and its cost grows at least as much."
            )
        left_out = [h for h in range(1, self.high[-1]) if h not in self.high]
        more = self.high[-1] if left_out else min(self.harmonics, HIGHEST)
        if left_out:
            told = f"harmonics.high leaves out {', '.join(map(str, left_out))}: keep them, and compare"
        elif more > self.high[-1]:
            told = f"Raise harmonics.high, for instance to {more}, and compare"
        else:
            return f"No study keeps more than {HIGHEST} harmonics: judge the result with that in mind."
        return (
            f"{told}; a solution then has up to {2 * more + 1} unknowns a coordinate instead of up to {2 * len(self.high) - 1}, and its "
            "cost grows at least as much."
        )


def check_harmonics(question: Question, response: Response) -> ReferenceDoubt:
    """Predict the change of a response by the judging set of the study's highest harmonics.

    Parameters
    ----------
    question, response
        The case and its finished response.
    """
    problem = question.problem
    checks = check_support(problem, [a.point for a in response.accepted])
    solved = np.array([a.point.converged for a in response.accepted], dtype=bool)
    errors = np.full(solved.size, np.nan)
    errors[solved] = [c.error for c in checks]
    high = question.sweep.high_harmonics
    low = always_kept(question.problem.strategy) == "low"
    only = question.sweep.low_harmonics if low else None
    doubt = ReferenceDoubt(JUDGED_MULTIPLE * high[-1], high, question.limit, errors, only=only)
    if not checks:
        return doubt
    worst = max(checks, key=lambda c: c.error)
    place = problem.measure.dofs.tolist().index(worst.dof)
    return replace(
        doubt, frequency_hz=float(worst.omega / HZ), kept=named(worst.kept), label=question.model.error_labels[place]
    )
