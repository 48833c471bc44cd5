"""Jacobians with few and with many harmonics compared at a solved point (Gastaldi & Berruti 2017, section 6.2)."""

from dataclasses import dataclass, fields

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import SingularError
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.selection.similarity import (
    JacobianSimilarity,
    Part,
    harmonic_block_norms,
    jacobian_similarity,
)
from stickslip.response.forced.choices import PUBLISHED
from stickslip.response.forced.collected import Accepted
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness
from stickslip.response.forced.sweep import Sweep
from stickslip.solve.newton_method import newton

MAX_COMPARED_ROWS = 2000  # rows of dense Jacobians: some seconds a point
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


def compared_at(problem: ForcedProblem, large: HarmonicBalance, accepted: Accepted) -> Compared | None:
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


def block_norms(large: HarmonicBalance, compared: Compared | None, kept: Harmonics | None = None) -> FloatArray:
    """Return the block norms of J, or with `kept` of ΔJ, by harmonic from 0; NaN for harmonics left out."""
    norms = np.full((large.order + 1, large.order + 1), np.nan)
    if compared is not None:
        part: Part = "jacobian" if kept is None else "missing"
        at = np.ix_(large.harmonics, large.harmonics)
        norms[at] = harmonic_block_norms(large, compared.few, compared.omega, part, kept)
    return norms
