"""Stability of a solved point, computed with more harmonics until the verdict is clear."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.errors import input_error
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.along import SAFETY
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.found import Stability, changes, may_leave
from stickslip.response.stability.missing_harmonics import corrected_by_step, more_harmonics, with_more
from stickslip.response.stability.multipliers import stability_in_time
from stickslip.response.time.sectors import all_in_time

ROUGHLY = 3.0  # error of a multiplier over its change by one Newton step
FIRST = 2.0  # error of a multiplier over its change from the motion as solved
SAME_MOTION = 0.1  # distance over the threshold, up to which a motion with more harmonics is the same motion
MOST_FURTHER_ROWS = 1000  # of the balance that is solved to see whether multipliers meet
OTHER = 2.0  # additional factor on both errors if the numbers of transitions differ


@dataclass(frozen=True, eq=False)
class _Rung:
    """Motion with its stability, and its relative change from the previous motion with fewer harmonics."""

    point: ForcedPoint
    stability: Stability
    change: float = float("nan")


@dataclass(frozen=True, eq=False)
class Settled:
    """Stability of a point, and the motion that has it if this is not the point as solved.

    Parameters
    ----------
    stability
        Stability of the motion with more harmonics.
    motion
        The motion with more harmonics, if the point as solved differs in stability or is another motion; its predicted
        error is its change from fewer harmonics. Otherwise None.
    """

    stability: Stability
    motion: ForcedPoint | None = None


@by_one_thread
def stability(problem: ForcedProblem, point: ForcedPoint, more: ForcedPoint | None = None) -> Stability:
    """Return the stability of a solved point of a forced response; `settled_stability` also returns the motion."""
    return settled_stability(problem, point, more).stability


@by_one_thread
def settled_stability(problem: ForcedProblem, point: ForcedPoint, more: ForcedPoint | None = None) -> Settled:
    """Return the stability of a solved point of a forced response.

    The multipliers belong to the motion after a Newton step with more harmonics, since few harmonics give transition
    times less accurately than amplitudes. Their error is their change by this step times `ROUGHLY`. If the verdict
    stays open, the motion is solved repeatedly with about twice the harmonics, and the change from one solution to the
    next is the error.

    Near a fold, or where contacts bounce, several motions lie within a few percent, and more harmonics may lead to
    another one. The verdict then belongs to the returned motion. A motion farther away than the threshold of the
    strategy gives no verdict on the point.

    Parameters
    ----------
    problem
        The forced response that the point belongs to.
    point
        A converged point.
    more
        The same motion solved with more harmonics, if known; it replaces the Newton step.

    Raises
    ------
    InputError
        If the point did not converge, a contact is rigid, or the structure is a sector of a tuned wheel without all its
        waves.
    """
    if not point.converged:
        raise input_error(
            "stability: point",
            f"did not converge at {point.omega:g} rad/s ({point.status.advice})",
            "Ask for the stability of solutions only.",
        )
    first = _Rung(point, of_point(problem, point))
    if more is not None:
        found = of_point(problem, more)
        best = _unsure(first) if found.unknown else _compared(found, first, FIRST)
        rung = _Rung(more, found, problem.real_error(point, more))
        open_ = _open(problem, first, found, more.order)
        settled = _settled(problem, rung, 1.0, best, first.stability.work + found.work, open_=open_)
        return _beside(problem, first, *settled)
    step = corrected_by_step(problem, point)
    if step is not None and step.point is point:
        return Settled(first.stability)
    work, best, open_ = first.stability.work, _unsure(first), False
    if step is not None:
        found = of_point(problem, step.point)
        work += found.work + step.work
        if not found.unknown:
            best = _compared(found, first, ROUGHLY)
            open_ = _open(problem, first, found, step.point.order)
    return _beside(problem, first, *_settled(problem, first, FIRST, best, work, open_=open_))


def _beside(problem: ForcedProblem, first: _Rung, found: Stability, last: _Rung) -> Settled:
    """Return the stability, with its motion if this is not the point as solved.

    The motion is given if the point differs in stability or lies away; the stability is unknown if it lies too far
    away.

    Near a fold, a stable and an unstable motion may lie within a percent. A point with few harmonics may be closer to
    one of them while more harmonics lead to the other; the verdict then belongs to the motion with more harmonics.
    """
    if last is first or found.verdict not in ("stable", "unstable"):
        return Settled(found)
    threshold, away = problem.strategy.threshold, problem.real_error(first.point, last.point)
    same_side = first.stability.grows == (found.verdict == "unstable")
    raises = problem.sweep.auto and problem.strategy.verifies
    if same_side and not (raises and away > SAME_MOTION * threshold):
        return Settled(found)
    if away > threshold:
        return Settled(replace(_unsure(first), work=found.work))
    bound = SAFETY[1] * last.change
    own = last.point
    return Settled(found, with_more(first.point, own.coefficients, own.harmonics, bound))


def _open(problem: ForcedProblem, first: _Rung, found: Stability, order: int) -> bool:
    """Return whether a stable verdict needs one more motion: few harmonics move multipliers far, and a meeting may follow.

    Not for large systems, whose next motion costs more than `MOST_FURTHER_ROWS` rows.
    """
    rows = problem.system.retained.size * (2 * (2 * order + 3) + 1)
    worse = first.stability
    if rows > MOST_FURTHER_ROWS or found.unknown or worse.unknown:
        return False
    return may_leave(found.floquet.multipliers, worse.floquet.multipliers)


def _unsure(rung: _Rung) -> Stability:
    """Return the stability of a motion whose change with more harmonics is unknown."""
    own = rung.stability
    return replace(own, errors=np.full_like(own.errors, np.inf), moduli=None)


def _settled(
    problem: ForcedProblem, last: _Rung, times: float, best: Stability, work: float, *, open_: bool = False
) -> tuple[Stability, _Rung]:
    """Return the stability with increasing harmonics until it is settled, and the last motion.

    The first error is `times` the change. `open_`: one more motion is solved, whatever the verdict.
    """
    rungs = more_harmonics(problem, last.point)
    while (open_ or not best.settled) and (more := next(rungs, None)) is not None:
        found = of_point(problem, more.point)
        work += found.work + more.work
        if found.unknown:
            continue
        best = _compared(found, last, times)
        last = _Rung(more.point, found, problem.real_error(last.point, more.point))
        times, open_ = 1.0, False
    return replace(best, work=work), last


def of_point(problem: ForcedProblem, point: ForcedPoint) -> Stability:
    """Return the stability of a point as solved; for a wheel with independent disturbances of all sectors."""
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    return stability_in_time(all_in_time(problem.system, gaps), point.omega)


def _compared(found: Stability, other: _Rung, times: float) -> Stability:
    """Return the stability of a motion; its errors are `times` its change from a less accurate one."""
    worse = other.stability
    if worse.unknown:
        return replace(found, errors=np.full_like(found.errors, np.inf), moduli=None)
    if times > 1.0 and worse.transitions != found.transitions:
        times *= OTHER
    distance, modulus = changes(found.floquet.multipliers, worse.floquet.multipliers)
    own = found.errors if found.moduli is None else found.moduli
    return replace(found, errors=found.errors + times * distance, moduli=own + times * modulus)
