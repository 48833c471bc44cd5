"""The check inside a run (``--verify``): the same reduced model integrated in time at the peak, and beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import one_structure
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.time.sectors import all_sectors
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.response.time.transient import (
    TimeStepping,
    TransientResult,
    integrate,
)
from stickslip.solve.newton_method import newton
from stickslip.study.analyses.forced.points import Accepted, Response
from stickslip.study.analyses.forced.question import Question
from stickslip.units import HZ

PATIENCE = 600  # periods; a blade damped by 0.3 % forgets its start to 1e-5, undamped ringing of a damper never ends
LARGE = 1.0  # percent: above it the balance is repeated with more harmonics, to tell which of the two is wrong
NAMED = 3  # drifting coordinates that a sentence names
MORE = 3  # times the harmonics, and the samples, of that repeat
STEPS = 1024  # of a period
MOST_STEPS = (
    8 * STEPS
)  # of an integration that is repeated with twice the steps for as long as these change it by more than `LARGE`


@dataclass(frozen=True)
class Check:
    """First-harmonic amplitude of the report output by balance and by time integration.

    Parameters
    ----------
    frequency_hz
        Where.
    balance, transient
        Amplitudes in m; of the integration the average over its last third where it did not become periodic.
    settled
        Whether the integration became periodic.
    periods
        Periods integrated.
    scatter
        Largest distance of a period's first harmonic from that average, relative to it; over all outputs.
    drifting
        Names of the coordinates whose mean moves on from period to period, with commas between them.
    order
        Harmonics of the balance.
    steps
        Steps in a period of the integration: more than usual where these were too few.
    step_percent
        By how much the amplitude changed with the last doubling of the steps; 0 where it was not needed.
    refined_order, refined
        Harmonics and amplitude of the balance repeated with more of them; NaN where it was not needed or failed.
    """

    frequency_hz: float
    balance: float
    transient: float
    settled: bool
    periods: int
    scatter: float = 0.0
    drifting: str = ""
    order: int = 0
    steps: int = STEPS
    step_percent: float = 0.0
    refined_order: int = 0
    refined: float = float("nan")

    @property
    def difference_percent(self) -> float:
        """Of the balance against the integration."""
        return 100 * (self.balance - self.transient) / self.transient

    @property
    def sentence(self) -> str:
        """What was compared and what happened."""
        return (
            f"{self.frequency_hz:.3f} Hz: balance {self.balance:.5e} m (H = {self.order}), "
            f"time integration {self.transient:.5e} m, difference {self.difference_percent:+.2f} %; "
            f"{self._motion}{self._step}{self._verdict}"
        )

    @property
    def _motion(self) -> str:
        if not np.isfinite(self.transient):
            return f"the integration overflowed after {self.periods} periods"
        if self.settled:
            return f"periodic after {self.periods} periods"
        drifting = f", and these coordinates drift: {self.drifting}" if self.drifting else ""
        return (
            f"not periodic after {self.periods} periods: average over the last third, "
            f"scatter {100 * self.scatter:.2g} %{drifting}"
        )

    @property
    def _step(self) -> str:
        if self.steps == STEPS:
            return ""
        if abs(self.step_percent) <= LARGE:
            return f", with {self.steps} steps a period (half of them: {-self.step_percent:+.2g} %)"
        return f"; {self.steps} steps a period are still too few for it: the last doubling moved it by {self.step_percent:+.2g} %"

    @property
    def _verdict(self) -> str:
        if self.refined_order == 0:
            return ""
        if not np.isfinite(self.refined):
            return f"; the balance with {self.refined_order} harmonics does not converge"
        left = 100 * (self.refined - self.transient) / self.transient
        return f"; the balance with {self.refined_order} harmonics gives {self.refined:.5e} m ({left:+.2f} %)"


def chosen(question: Question, response: Response) -> list[Accepted]:
    """Return the points that are integrated: the peak of each case, and where there is one case alone its flanks, too."""
    if response.top is None:
        return []
    beside = () if question.label else response.flanks
    return sorted((response.top, *beside), key=lambda a: a.point.omega)


def check_in_time(question: Question, response: Response, accepted: Accepted) -> Check:
    """Integrate in time at a point of the response, and compare.

    Parameters
    ----------
    question, response
        The model, and its finished response.
    accepted
        One of its points.
    """
    problem, point = question.problem, accepted.point
    found = integrated(problem, point, question.model.load)
    check = _compared(response, accepted, found, STEPS)
    if found.settled and not abs(check.difference_percent) <= LARGE:
        check = _with_steps_enough(question, response, accepted, found)
    if abs(check.difference_percent) <= LARGE:
        return check
    order = MORE * max(question.sweep.high_harmonics[-1], point.order)
    many = refined(question, point, order)
    if many is None:
        return replace(check, refined_order=order)
    return replace(check, refined_order=order, refined=problem.amplitude(many, response.output))


def _compared(response: Response, accepted: Accepted, found: TransientResult, steps: int) -> Check:
    """Return the comparison with an integration."""
    known = found.harmonics[1] if found.settled else found.average
    return Check(
        frequency_hz=accepted.point.omega / HZ,
        balance=response.amplitude(accepted),
        transient=float(np.abs(known[response.output])),
        settled=bool(found.settled),
        periods=int(found.periods),
        scatter=float(found.scatter),
        drifting=listed(found.drifting),
        order=accepted.point.order,
        steps=steps,
    )


def _with_steps_enough(
    question: Question, response: Response, accepted: Accepted, found: TransientResult
) -> Check:
    """Go on from a settled motion with twice the steps until these do not change it: too long a step is the first to suspect."""
    steps, coarse = STEPS, _compared(response, accepted, found, STEPS)
    while True:
        steps *= 2
        found = integrated(
            question.problem, accepted.point, question.model.load, begin=found.final, steps=steps
        )
        fine = _compared(response, accepted, found, steps)
        moved = 100 * (fine.transient / coarse.transient - 1.0)
        if abs(moved) <= LARGE and coarse.steps == STEPS:
            return coarse
        coarse = replace(fine, step_percent=moved)
        if abs(moved) <= LARGE or not found.settled or steps >= MOST_STEPS:
            return coarse


def listed(names: Sequence[str]) -> str:
    """Return the first few of many names as text."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def integrated(
    problem: ForcedProblem,
    point: ForcedPoint,
    load: HarmonicLoad,
    periods: int = PATIENCE,
    *,
    begin: TransientStart | None = None,
    steps: int = STEPS,
) -> TransientResult:
    """Integrate in time from the balance's state at t = 0: near what is judged, so that little has to settle.

    Parameters
    ----------
    problem, point
        What was solved, and the solution.
    load
        Its loads.
    periods
        Give up settling after so many.
    begin
        Where to begin instead, as where an integration with fewer steps has ended.
    steps
        Steps in a period.
    """
    system = problem.system
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    structure, contacts = system.structure, system.interface
    if isinstance(structure, TunedWheel):
        whole = all_sectors(system, load)
        motion, structure, contacts = whole.spread(motion), whole.structure, whole.contacts
        load = whole.load
    return integrate(
        one_structure(structure, "time integration"),
        contacts.gap_operator,
        contacts.laws,
        load,
        point.omega,
        system.outputs,
        start=begin
        or start_from_harmonics(motion, point.omega, contacts.gap_operator, contacts.laws),
        stepping=TimeStepping(steps_per_period=steps, max_periods=periods),
        weights=contacts.weights,
    )


def refined(question: Question, point: ForcedPoint, order: int) -> ForcedPoint | None:
    """Solve the balance with `order` harmonics; None if it does not converge.

    Parameters
    ----------
    question
        The model and how it is solved.
    point
        A solution with fewer harmonics, where Newton begins.
    order
        Harmonics; the samples grow with them.
    """
    sweep = replace(question.sweep, high=order, samples=(MORE + 1) * question.sweep.samples)
    balance = forced_problem(question.model.system, question.model.load, sweep).high
    start = balance.unknowns(point.coefficients)
    solution = newton(lambda x: balance.linearise(x, point.omega), start, sweep.newton)
    if not solution.status.converged:
        return None
    return replace(point, coefficients=balance.coefficients(solution.x))
