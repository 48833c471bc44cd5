"""More harmonics than the study keeps: what they would change at each accepted solution, and in its Jacobian.

``--verify-harmonics`` predicts the change by twice the harmonics. ``[harmonics] similarity = true`` compares Jacobians with few and with many:
ΔJ and Γ along the response, and the blocks between harmonics at the peak (Gastaldi & Berruti 2017, section 6.2 and figure 1).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.analyses.forced_response.chooser import error_text
from stickslip.analyses.forced_response.problem import MORE_THAN_LOW, Question
from stickslip.analyses.forced_response.records.columns import Jacobians, MoreHarmonics, stored
from stickslip.analyses.forced_response.records.values import Values
from stickslip.arrays import FloatArray
from stickslip.harmonic.harmonic_set import Harmonics, named
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.collected import Response
from stickslip.response.forced.compared_jacobians import NO_SIMILARITY, block_norms, compared_at, reference_of
from stickslip.response.forced.problem import with_stiffness
from stickslip.response.verification import check_support
from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.store.progress import LOG
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


def of_doubt(doubt: ReferenceDoubt) -> Values:
    """Return the variables of the check with more harmonics."""
    return stored(
        MoreHarmonics(
            reference_error_percent=100 * doubt.errors,
            reference_worst_percent=100 * doubt.worst,
            reference_worst_hz=doubt.frequency_hz,
            reference_above=doubt.above,
            reference_sentence=doubt.sentence,
        )
    )


@by_one_thread
def of_jacobians(question: Question, response: Response) -> Values:
    """Return ΔJ and Γ of every accepted point, and the block norms at the peak and where ΔJ is largest."""
    problem, sweep = question.problem, question.problem.sweep
    solved = max((a.point.order for a in response.accepted if a.point.converged), default=0)
    reference = reference_of(sweep, problem.system.retained.size, solved)
    large = with_stiffness(problem.balance(reference))
    found = [compared_at(problem, large, accepted) for accepted in response.accepted]
    each = [NO_SIMILARITY if one is None else one.similarity for one in found]
    change = np.array([one.change for one in each])
    worst = int(np.nanargmax(change)) if np.any(np.isfinite(change)) else -1
    peak, missing = (found[at] if at >= 0 else None for at in (response.peak, worst))
    record = Jacobians(
        jacobian_reference=reference[-1],
        jacobian_rows=large.size,
        jacobian_change_percent=100 * change,
        gamma_mean_diagonal=np.array([one.mean_diagonal for one in each]),
        gamma_zero_percent=100 * np.array([one.zero_share for one in each]),
        jacobian_block_norm=block_norms(large, peak),
        neglected_block_norm=block_norms(large, missing, sweep.low_harmonics),
        neglected_frequency_hz=float("nan") if missing is None else missing.omega / HZ,
    )
    for line in _lines(record, sweep.low_harmonics, reference):
        LOG.info(f"similarity: {question.said(line)}")
    return stored(record)


def _lines(record: Jacobians, low: Harmonics, reference: Harmonics) -> Iterator[str]:
    if not np.isfinite(record.jacobian_change_percent).any():
        yield "no point has solutions with few and with many harmonics"
        return
    gamma = record.gamma_mean_diagonal
    yield (
        f"from H = {named(low)} to H = {named(reference)} the Jacobian changes by up to "
        f"{np.nanmax(record.jacobian_change_percent):.3g} %, at {record.neglected_frequency_hz:.2f} Hz; "
        f"the mean of the diagonal of Γ is {np.nanmin(gamma):.4g} to {np.nanmax(gamma):.4g}"
    )
