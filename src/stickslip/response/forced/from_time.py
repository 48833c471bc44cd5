"""Solution of failed frequencies from time integration that becomes periodic."""

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import StickslipError
from stickslip.harmonic.harmonic_set import is_full
from stickslip.response.continuation.branch import Judged
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.response.time.settling import Repetition, repetition
from stickslip.solve.branch import ParameterEvaluation
from stickslip.solve.fallbacks import steps_at_most
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import Solution, charged, newton
from stickslip.solve.status import Rung, Status

MOST_COORDINATES = 600  # larger structures need half a second for a period, or more
PATIENCE = 40  # least number of allowed Newton steps: the start is near
MORE = (2, 4, 6, 10)  # additional harmonics to try


@dataclass(frozen=True)
class Marched:
    """Time integration from rest; see `stickslip.response.time.settling.Repetition`.

    Fields with ``finer`` come from a second integration with half the step; NaN where it was not needed.

    Attributes
    ----------
    periods, steps, angle
        Number of periods; steps in a period; phase angle per step of the fastest contact that opens or closes, rad.
    every, finer_every
        Number of excitation periods after which the motion repeats; 0: it does not repeat.
    change
        Relative change of the harmonics of all gaps over the last period.
    wander, finer_wander
        Largest relative change of the first harmonic of the outputs between two of the last periods.
    growth, finer_growth
        Growth factor of a small difference in a period; NaN where it was not computed.
    opened
        Share of the time in which contacts are open.
    """

    periods: float
    steps: float
    angle: float
    every: float
    change: float
    wander: float
    growth: float
    finer_every: float
    finer_wander: float
    finer_growth: float
    opened: float

    def __str__(self) -> str:
        counted = f"{self.periods:.0f} periods of {self.steps:.0f} steps"
        if self.every == 1.0:
            return f"periodic in time after {counted}"
        if not np.isfinite(self.change):
            return f"in time it grows beyond all numbers within {counted}"
        told = _does(self.every, self.wander, self.growth)
        finer = _does(self.finer_every, self.finer_wander, self.finer_growth)
        return f"in time, {counted}, {told}; with half the step {finer}"


def _does(every: float, wander: float, growth: float) -> str:
    if every:
        return f"it repeats itself every {every:.0f} periods"
    return (
        f"its first harmonic changes by up to {wander:.2g} of its size from period to period, and a small difference grows {growth:.3g}-fold "
        "in each"
    )


def marched_of(point: ForcedPoint) -> Marched | None:
    """Return the time integration at a point; None without one."""
    return Marched(*point.marched) if point.marched.size else None


def found_in_time(
    problem: ForcedProblem, accepted: Sequence[ForcedPoint], done: Sequence[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Yield results of time integration at the failed frequencies that are not in `done`.

    A motion that repeats starts Newton's method. Structures with `MOST_COORDINATES` or more coordinates, rigid
    contacts, and structures without equations in time (tuned wheels, structural damping, coordinates without mass) are
    skipped.

    Parameters
    ----------
    problem
        The forced response.
    accepted
        Points of the response so far.
    """
    first, last = problem.sweep.omega_range
    system = problem.system
    if problem.sweep.rescue == "off" or system.interface.rigid or system.structure.n > MOST_COORDINATES:
        return
    known = {p.omega for p in done}
    for lost in accepted:
        if lost.converged or lost.omega in known or not first <= lost.omega <= last:
            continue
        known.add(lost.omega)
        try:
            found = _from_time(problem, lost)
        except (StickslipError, np.linalg.LinAlgError):
            continue
        yield found


def _from_time(problem: ForcedProblem, lost: ForcedPoint) -> ForcedPoint:
    began, omega = perf_counter(), lost.omega
    system, load = problem.system.at(omega), problem.low.linear.load_at(omega)
    order = _orders(problem, lost)[-1]
    seen = repetition(system.structure, system.interface, load, omega, system.outputs, order)
    told = np.array(astuple(_told(seen)))
    found = _solved(problem, lost, seen)
    if seen.verdict == "periodic" or (found and found[-1][1].status.converged):
        solution = charged(found[-1][1], [s for _, s in found])
        seconds = perf_counter() - began
        point = forced_point(found[-1][0], solution, "in_time", lost.index, omega, seconds, judged=Judged(np.nan))
        return replace(point, rescue=Rung.IN_TIME, marched=told)
    status = Status.NOT_PERIODIC if seen.verdict == "not periodic" else lost.status
    return replace(
        lost,
        stage="in_time",
        status=status,
        iterations=sum(s.iterations for _, s in found),
        rescue=Rung.IN_TIME,
        marched=told,
        seconds_contact=0.0,
        seconds_linear=0.0,
        seconds_total=perf_counter() - began,
    )


def _told(seen: Repetition) -> Marched:
    none, finer = np.nan, seen.finer
    return Marched(
        periods=seen.periods,
        steps=seen.steps,
        angle=seen.angle,
        every=seen.every,
        change=float(seen.change[-1]),
        wander=seen.wander,
        growth=seen.growth,
        finer_every=none if finer is None else finer.every,
        finer_wander=none if finer is None else finer.wander,
        finer_growth=none if finer is None else finer.growth,
        opened=seen.opened,
    )


def _orders(problem: ForcedProblem, lost: ForcedPoint) -> list[int]:
    """Return the orders to try, the requested one first; a few more harmonics may restore a solution lost at a fold."""
    most = problem.sweep.cap if problem.sweep.auto else lost.order + MORE[-1]
    more = [lost.order + m for m in MORE if lost.order + m <= most]
    return [lost.order, *more] if is_full(lost.support) else [lost.order]


def _solved(problem: ForcedProblem, lost: ForcedPoint, seen: Repetition) -> list[tuple[Balance, Solution]]:
    """Return Newton attempts from the motion in time, of which the last counts.

    Close to the solution the natural-level Newton method continues where the residual stalls. A motion that settles too
    slowly for a verdict is tried with the requested harmonics only.
    """
    if seen.verdict == "not periodic" or not seen.finite:
        return []
    spent: list[tuple[Balance, Solution]] = []
    size = problem.balance(lost.support).size
    left = max(steps_at_most(size) - lost.iterations, PATIENCE)
    patient = problem.sweep.newton
    patient = replace(patient, max_iterations=max(PATIENCE, patient.max_iterations))
    orders = _orders(problem, lost)
    for order in orders if seen.verdict == "periodic" else orders[:1]:
        support = lost.support if order == lost.order else tuple(range(order + 1))
        balance = problem.balance(support)
        start = balance.unknowns(seen.motion[: order + 1, balance.linear.retained])
        evaluate = partial(_at, balance, lost.omega)
        for level in (NaturalLevel(), None):
            if sum(s.iterations for _, s in spent) >= left:
                return spent
            spent.append((balance, newton(evaluate, start, patient, level)))
            if spent[-1][1].status.converged:
                return spent
    return spent


def _at(balance: Balance, omega: float, x: FloatArray) -> ParameterEvaluation:
    return balance.linearise(x, omega)
