"""``[harmonics] similarity = true``: Jacobians with few and with many harmonics compared at every point (Gastaldi & Berruti 2017).

ΔJ and Γ of section 6.2 along the response, and the blocks between harmonics of figure 1 at the peak.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import numpy as np

from stickslip.analyses.forced_response.problem import MAX_COMPARED_ROWS, Question
from stickslip.analyses.forced_response.records.columns import Jacobians, stored
from stickslip.analyses.forced_response.records.points import Accepted, Response
from stickslip.analyses.forced_response.records.values import Values
from stickslip.arrays import FloatArray
from stickslip.errors import SingularError
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics, named
from stickslip.harmonic.selection.similarity import (
    JacobianSimilarity,
    Part,
    harmonic_block_norms,
    jacobian_similarity,
)
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.choices import PUBLISHED
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.newton_method import newton
from stickslip.study.store.progress import LOG
from stickslip.units import HZ

NO_SIMILARITY = JacobianSimilarity(*[float("nan")] * len(fields(JacobianSimilarity)))  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Compared:
    """The comparison at one point.

    Parameters
    ----------
    omega
        Frequency, rad/s.
    few
        Scaled unknowns of the solution with few harmonics, padded with zeros.
    similarity
        ΔJ and Γ.
    """

    omega: float
    few: FloatArray
    similarity: JacobianSimilarity


def reference_of(sweep: Sweep, retained: int, solved: int = 0) -> Harmonics:
    """Return the harmonics of the large Jacobian.

    They are `harmonics.high`, or with ``auto`` the harmonics of the solutions, at least five, within `MAX_COMPARED_ROWS`.

    Parameters
    ----------
    sweep
        The sweep of the response.
    retained
        Number of retained coordinates.
    solved
        Highest harmonic of the accepted solutions.
    """
    if not sweep.auto:
        return sweep.high_harmonics
    low, *more = sweep.supports
    wanted = max(solved, PUBLISHED * low[1])
    fitting = [own for own in more if _rows(own, retained) <= MAX_COMPARED_ROWS] or [*more, low][:1]
    return next((own for own in fitting if own[-1] >= wanted), fitting[-1])


def _rows(harmonics: Harmonics, retained: int) -> int:
    return (2 * len(harmonics) - 1) * retained


@by_one_thread
def of_jacobians(question: Question, response: Response) -> Values:
    """Return ΔJ and Γ of every accepted point, and the block norms at the peak and where ΔJ is largest."""
    problem, sweep = question.problem, question.problem.sweep
    solved = max((a.point.order for a in response.accepted if a.point.converged), default=0)
    reference = reference_of(sweep, problem.system.retained.size, solved)
    large = with_stiffness(problem.balance(reference))
    found = [_compared(problem, large, accepted) for accepted in response.accepted]
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
        jacobian_block_norm=_blocks(large, peak),
        neglected_block_norm=_blocks(large, missing, sweep.low_harmonics),
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


def _compared(problem: ForcedProblem, large: HarmonicBalance, accepted: Accepted) -> Compared | None:
    """Compare the Jacobians at the solutions of one frequency; None if a solution is not found, or J is singular."""
    point = accepted.point
    if not point.converged:
        return None
    small = with_stiffness(problem.balance(problem.sweep.low_harmonics))
    few, many = (_solution(problem, balance, accepted) for balance in (small, large))
    if few is None or many is None:
        return None
    padded = large.unknowns(small.coefficients(few))
    try:
        return Compared(point.omega, padded, jacobian_similarity(large, padded, many, point.omega))
    except SingularError:
        return None


def _solution(problem: ForcedProblem, balance: HarmonicBalance, accepted: Accepted) -> FloatArray | None:
    """Return the unknowns with the harmonics of `balance`, from the sweep or by Newton's method from the accepted point."""
    for known in (accepted.point, accepted.low):
        if known is not None and _holds(known, balance):
            return balance.unknowns(known.coefficients)
    start = balance.unknowns(accepted.point.coefficients)
    found = newton(lambda x: balance.linearise(x, accepted.point.omega), start, problem.sweep.newton)
    return found.x if found.status.converged else None


def _holds(point: ForcedPoint, balance: HarmonicBalance) -> bool:
    return point.converged and not point.kept.size and point.support == balance.harmonics


def _blocks(large: HarmonicBalance, compared: Compared | None, kept: Harmonics | None = None) -> FloatArray:
    """Return the block norms of J, or with `kept` of ΔJ, by harmonic from 0; NaN for harmonics left out."""
    norms = np.full((large.order + 1, large.order + 1), np.nan)
    if compared is not None:
        part: Part = "jacobian" if kept is None else "missing"
        at = np.ix_(large.harmonics, large.harmonics)
        norms[at] = harmonic_block_norms(large, compared.few, compared.omega, part, kept)
    return norms
