"""The check ``--verify``: time integration of the same reduced model at the peak and beside it, in numbers and words."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, isfinite, log
from typing import Literal

import numpy as np

from stickslip.analyses.forced_response.problem import Question
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.harmonic.linear import one_structure
from stickslip.response.forced.amplitude import amplitudes
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.stability.missing_harmonics import (
    HARMONICS_FACTOR,
    HARMONICS_MORE,
    MOST_ROWS,
    solved_with,
    with_more,
)
from stickslip.response.system import System
from stickslip.response.time.sectors import all_sectors, sectors_in_time
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.response.time.transient import TimeStepping, TransientResult, integrate
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import newton
from stickslip.units import HZ, LARGEST_PERCENT, metres

PATIENCE = 600  # periods; a blade damped by 0.3 % forgets its start to 1e-5, undamped ringing of a damper never ends
LARGE = 1.0  # percent, above which the balance is repeated with more harmonics to find the cause of the difference
STEPS = 1024  # time steps of a period

Motion = Literal["attained", "next to it", "left", "not periodic", "not settled"]
TOLD: dict[str, str] = {
    "attained": "attained: the motion in time stays on the balanced motion",
    "next to it": "next to it: the motion in time ends next to the balanced motion, which comes no nearer with more harmonics",
    "left": "left: the motion in time leaves the balanced motion",
    "not periodic": "the motion in time does not repeat with the period of the load",
    "not settled": "where the motion in time goes is not known yet",
}


def off_percent(value: float, true: float) -> float:
    """Return the difference of an amplitude from the true one in percent; infinite if the true one alone is zero."""
    if true == 0.0:
        return 0.0 if value == 0.0 else float("inf")
    return 100 * (value - true) / true


@dataclass(frozen=True)
class Check:
    """Amplitude of the report output in the driven harmonics, by harmonic balance and by time integration.

    Parameters
    ----------
    frequency_hz
        Frequency of the point.
    balance, transient
        Amplitudes, m; for an integration that did not become periodic, the average over its last third.
    settled
        Whether the integration became periodic.
    periods
        Periods integrated.
    outputs_percent
        Largest difference of an output in percent, driven harmonics with their phases, in the error norm; NaN if not evaluated.
    scatter
        Largest distance of a period's harmonics from this average over all outputs, relative to the average.
    drifting
        Names of the coordinates whose mean drifts from period to period, separated by commas.
    order
        Highest harmonic of the balance.
    steps
        Time steps a period; more than usual if these were too few.
    step_percent
        Change of the amplitude by the last doubling of the steps, percent; 0 if there was none.
    refined_order, refined
        Highest harmonic and amplitude of a balance repeated with more harmonics; NaN if not needed or failed.
    motion
        Outcome of an integration from the balance's state: it *attained* that motion, ended on another one *next to it*, *left* it for one far
        away or without bound, is *not periodic*, or has *not settled*.
    shows_after
        Periods in which a disturbance changes a thousandfold by the multiplier; 0 if not requested.
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
    motion: Motion | Literal[""] = ""
    shows_after: int = 0
    outputs_percent: float = float("nan")

    @property
    def difference_percent(self) -> float:
        """Difference of the balance from the integration, percent."""
        return off_percent(self.balance, self.transient)

    @property
    def wanders_near(self) -> bool:
        """Whether a motion that is not periodic stays within 1 % of the balance's amplitude."""
        near = max(100 * self.scatter, abs(self.difference_percent)) <= LARGE
        return self.motion == "not periodic" and near

    @property
    def sentence(self) -> str:
        """The comparison and its outcome as a sentence."""
        return (
            f"{self.frequency_hz:.3f} Hz: balance {metres(self.balance)} (H = {self.order}), "
            f"time integration {metres(self.transient)}{self._difference}; "
            f"{self._outputs}{self._motion}{self._step}{self._verdict}{self._became}"
        )

    @property
    def _difference(self) -> str:
        percent = self.difference_percent
        return f", difference {percent:+.3g} %" if abs(percent) < LARGEST_PERCENT else ""

    @property
    def _outputs(self) -> str:
        known = self.outputs_percent > LARGE
        return f"largest difference of an output, with its phase, {self.outputs_percent:.2g} %; " * known

    @property
    def _motion(self) -> str:
        if not np.isfinite(self.transient):
            return f"the integration overflowed after {self.periods} periods"
        if self.settled:
            return f"periodic after {self.periods} periods"
        drifting = f", and these coordinates drift: {self.drifting}" if self.drifting else ""
        word = "not settled" if self.motion == "not settled" else "not periodic"
        if self.motion == "attained":
            word = "periodic but for the scatter"
        return (
            f"{word} after {self.periods} periods: average over the last third, "
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
        left = off_percent(self.refined, self.transient)
        difference = f" ({left:+.2f} %)" if isfinite(left) else ""
        return f"; the balance with {self.refined_order} harmonics gives {metres(self.refined)}{difference}"

    @property
    def _became(self) -> str:
        if not self.motion:
            return ""
        capped = (
            f" (followed for {self.periods} periods at most, of {self.shows_after} in which a disturbance would show)"
            if self.shows_after > PATIENCE
            else ""
        )
        return f"; {TOLD[self.motion]}{capped}"


NAMED = 3  # drifting coordinates that a sentence names
MORE = 3  # factor on harmonics and samples of a repeated balance
LEAST_HARMONICS, MOST_HARMONICS = 15, 63  # of a repeated balance
APART = 10.0  # percent: a motion in time farther than this from every balance is another motion
KICK = 1e-3  # disturbance of velocities relative to their amplitude, for motions not known to be stable
SHOWN = 1e3  # growth or decay of a disturbance that shows the stability
RINGS = 1e-3  # largest scatter of a motion that is periodic except for undamped ringing
# scatter up to which an integration ends early if it neither decays nor grows; a fifth of the disturbance
RINGS_ON = 2e-4
DECAYS, GROWS = 0.5, 1.1  # change within the last third of an integration over the change within the third before
GROWS_CLEARLY = 1.5  # the same for ringing within `RINGS_ON`, whose largest changes vary from third to third; 0.2 % a period over 200 periods
MOST_TOLD = 10**6  # largest number of periods that is stated
GOLDEN = 2.399963  # golden angle, rad: phases of all coordinates differ
WHOLE = 41  # harmonics of an integration, if amplitudes are of the whole motion
REPORTED = 7  # least harmonics of an integration
FLOPS = 4e9  # operations of time integration a second
STEP_FLOPS = 2e4  # operations that last as long as a step of the smallest system, 5 µs
RAISED = (9, 15, 21, 31, 41)  # highest harmonics of a balance that starts from the motion in time
RAISED_AGREE = 0.5  # its difference from that motion over the tolerated error
RAISED_APART = 0.2  # its difference from the point as solved: two masses on stiff contacts, H = 5, 0.16; another motion is farther away
APPROACH = 0.5  # largest ratio of distances from the motion in time, after and before the harmonics are doubled
SAME_RTOL = 1e-3  # distance from the motion in time that its steps may make, 1024 a period
MAX_APPROACH_ROWS = 1000  # of the balance solved for this comparison
MOST_STEPS = 8 * STEPS  # steps are doubled as long as this changes the motion by more than `LARGE`


def chosen(question: Question, response: Response) -> list[Accepted]:
    """Return the points to integrate: the peak of each case; for a single case also its flanks."""
    if response.top is None:
        return []
    beside = () if question.label else response.flanks
    return sorted((response.top, *beside), key=lambda a: a.point.omega)


def check_in_time(
    question: Question, response: Response, accepted: Accepted, multiplier: float | None = None, *, raises: bool = False
) -> tuple[Check, ForcedPoint | None]:
    """Integrate in time at a point of the response, and compare.

    Parameters
    ----------
    question, response
        The case and its finished response.
    accepted
        One point of the response.
    multiplier
        Modulus of the multiplier of a point not known to be stable, NaN if unknown. The motion then starts with disturbed velocities and is
        followed until the disturbance shows. None: without a disturbance.
    raises
        Whether a balance that differs from the motion in time is solved again from that motion, with more harmonics.

    Returns
    -------
    tuple
        The comparison, and the balance with more harmonics that it is about; None: it is about the point itself.
    """
    point = accepted.point
    after = 0 if multiplier is None else shows_after(multiplier)
    least = max(1, min(after, PATIENCE))
    found = integrated(
        question.problem,
        point,
        question.model.load,
        kick=0.0 if multiplier is None else KICK,
        least=least,
    )
    check = _compared(question, response, point, found, STEPS)
    if found.settled and not abs(check.difference_percent) <= LARGE:
        check, found = _with_steps_enough(question, response, point, found, check)
    limit = 100 * question.problem.strategy.threshold
    if raises and _repeats(found) and not max(abs(check.difference_percent), check.outputs_percent) <= limit:
        raised = balance_from_time(question, point, found, check.steps)
        if raised is not None:
            own = _compared(question, response, raised, found, check.steps)
            own = replace(own, step_percent=check.step_percent, motion="attained", shows_after=after)
            return own, replace(raised, predicted_error=own.outputs_percent / 100)
    known = _driven(question, _known(found)[:, response.output])
    balances = [_of_balance(question, response, point)]
    # a check on request explains its difference; one for stability only tells the motions apart
    explains = multiplier is None and not abs(check.difference_percent) <= LARGE
    if explains or not _apart(balances[0], known) <= APART:
        order = max(min(max(MORE * point.order, LEAST_HARMONICS), MOST_HARMONICS), point.order + 1)
        check = replace(check, refined_order=order)
        better = refined(question, point, order)
        if better is not None:
            balances.append(_of_balance(question, response, better))
            check = replace(check, refined=_amplitude(question, response, better))

    def motion_of(one: Check, motion: TransientResult) -> Motion:
        there = _driven(question, _known(motion)[:, response.output])
        return _motion(one, motion, min(_apart(balance, there) for balance in balances))

    motion = motion_of(check, found)
    close = multiplier is not None and isfinite(multiplier) and (after > PATIENCE or multiplier > 1.0)
    if motion == "attained" and close:
        # close to the unit circle the error of the steps may decide on which side of it a multiplier lies
        steps = 2 * check.steps
        finer = integrated(question.problem, point, question.model.load, kick=KICK, least=least, steps=steps)
        fine = _compared(question, response, point, finer, steps)
        if motion_of(fine, finer) != motion:
            check = replace(fine, refined_order=check.refined_order, refined=check.refined)
            motion, found = motion_of(fine, finer), finer
    if motion == "attained" and multiplier is not None and multiplier > 1.0 and not _approached(question, point, found):
        motion = "next to it"
    return replace(check, motion=motion, shows_after=after), None


def _approached(question: Question, point: ForcedPoint, found: TransientResult) -> bool:
    """Whether the balance with more harmonics comes nearer to the motion in time; also if it is near, large, or not found.

    Of two periodic motions within a percent, one stable and one unstable, the motion in time ends on the stable one. A balance of the
    unstable one stays as far away with more harmonics.
    """
    problem, system = question.problem, question.model.system
    known = _known(found)

    def off(one: ForcedPoint) -> float:
        return _of_outputs(problem, known, problem.low.linear.recover(one.omega, one.coefficients)[:, system.outputs])

    before = off(point)
    order = HARMONICS_FACTOR * point.order + HARMONICS_MORE
    if before <= SAME_RTOL or system.retained.size * (2 * order + 1) > MAX_APPROACH_ROWS:
        return True
    more = solved_with(problem, point, order)
    return more is None or off(more.point) <= max(SAME_RTOL, APPROACH * before)


def balance_from_time(
    question: Question, point: ForcedPoint, found: TransientResult, steps: int = STEPS
) -> ForcedPoint | None:
    """Solve the balance again with more harmonics, from the motion in time.

    Newton's method finds a balance with many harmonics from there where it does not from one with few: a stick-slip
    motion on stiff contacts (1e5 times the structure's stiffness) has as many nearby solutions as it has short stops.

    Parameters
    ----------
    question, point
        The case, and the point whose balance differs from the motion in time.
    found
        The settled motion in time.
    steps
        Its time steps a period.

    Returns
    -------
    ForcedPoint or None
        The balance with the fewest harmonics of `RAISED` whose outputs differ from the motion in time by less than half
        the tolerated error, phases included. If no balance is so near, it is the nearest within the tolerated error.
        None without such a balance, and for another motion than the point's.
    """
    problem, system = question.problem, question.model.system
    highest = min(RAISED[-1], MOST_ROWS // (2 * system.retained.size))
    if system.structure.wheel is not None or highest <= point.order:
        return None
    limit = problem.strategy.threshold
    last = integrate(
        one_structure(system.structure, "time integration"),
        system.interface.gap_operator,
        system.interface.laws,
        question.model.load,
        point.omega,
        np.arange(system.structure.n),
        start=found.final,
        stepping=TimeStepping(steps_per_period=steps, max_periods=2, harmonics=highest),
        weights=system.interface.weights,
    )
    best, nearest = None, limit
    for order in (order for order in RAISED if point.order < order <= highest):
        balance = problem.balance(harmonics_of(order))
        start = balance.unknowns(last.harmonics[: order + 1, balance.linear.retained])
        for level in (None, NaturalLevel()):
            solution = newton(lambda x, b=balance: b.linearise(x, point.omega), start, problem.sweep.newton, level)  # type: ignore[misc]
            if solution.status.converged:
                break
        else:
            continue
        more = with_more(point, balance.coefficients(solution.x), np.array(balance.harmonics), np.nan)
        outputs = balance.linear.recover(point.omega, more.coefficients)[:, system.outputs]
        apart = _of_outputs(problem, _known(found), outputs)
        if apart <= nearest:
            best, nearest = more, apart
        if apart <= RAISED_AGREE * limit:
            break
    return best if best is not None and problem.real_error(point, best) <= RAISED_APART else None


def shows_after(multiplier: float) -> int:
    """Return the number of periods in which a disturbance changes a thousandfold, at most `MOST_TOLD`.

    Parameters
    ----------
    multiplier
        Modulus of the multiplier; NaN: unknown.
    """
    rate = abs(log(multiplier)) if isfinite(multiplier) and multiplier > 0.0 else float("nan")
    if multiplier == 0.0:
        return 1
    return ceil(log(SHOWN) / rate) if rate > log(SHOWN) / MOST_TOLD else MOST_TOLD


def seconds_in_time(system: System, steps: int = PATIENCE * STEPS) -> float:
    """Return the estimated time of an integration, s, by the size of all integrated sectors.

    Parameters
    ----------
    system
        The vibrating system.
    steps
        Number of time steps; left out: those of an integration that does not settle.
    """
    sectors = sectors_in_time(system)
    rows, gaps = 2 * sectors * system.structure.n, 3 * sectors * system.interface.n_contacts
    return steps * (STEP_FLOPS + 2.0 * rows**2 + float(gaps) ** 3) / FLOPS


def _motion(check: Check, found: TransientResult, apart: float) -> Motion:
    """Return the outcome of the motion in time; `apart` is its distance from the nearest balance in percent."""
    if not isfinite(check.transient):
        return "left"
    if not found.settled and found.scatter > RINGS:
        return "not settled" if found.decay < DECAYS else "not periodic"
    if not _repeats(found):
        return "not settled"
    return "attained" if apart <= APART else "left"


def _repeats(found: TransientResult) -> bool:
    """Whether a motion in time is periodic, but for ringing that does not grow."""
    if found.settled:
        return True
    return found.scatter <= RINGS and not found.decay > (GROWS_CLEARLY if found.scatter <= RINGS_ON else GROWS)


def _apart(balance: ComplexArray, known: ComplexArray) -> float:
    """Return the distance of a balance from the integration, phases included, in percent of the integration."""
    size = float(np.linalg.norm(known))
    return 100 * float(np.linalg.norm(balance - known)) / size if size > 0.0 else float("inf")


def _of_balance(question: Question, response: Response, point: ForcedPoint) -> ComplexArray:
    """Return the driven harmonics of the report output, m."""
    motion = question.problem.low.linear.recover(point.omega, point.coefficients)
    return _driven(question, motion[:, question.problem.system.outputs[response.output]])


def _amplitude(question: Question, response: Response, point: ForcedPoint) -> float:
    return question.problem.amplitude(point, response.output)


def _size(question: Question, harmonics: ComplexArray) -> float:
    """Return the amplitude of an output from its harmonics, m."""
    of = question.sweep.amplitude_of
    return float(amplitudes(harmonics[:, None], question.driven, of)[0])


def _driven(question: Question, harmonics: ComplexArray) -> ComplexArray:
    """Return the driven harmonics of an output; the amplitude is their norm."""
    return np.array([harmonics[h] if h < len(harmonics) else 0.0 for h in question.driven])


def _known(found: TransientResult) -> ComplexArray:
    """Return (n_h + 1, n_outputs) harmonics of an integration, m; the average if it did not settle."""
    return found.harmonics if found.settled else found.averages


def _compared(question: Question, response: Response, point: ForcedPoint, found: TransientResult, steps: int) -> Check:
    """Return the comparison with an integration."""
    every = _known(found)
    known = every[:, response.output]
    motion = question.problem.low.linear.recover(point.omega, point.coefficients)
    outputs = motion[:, question.problem.system.outputs]
    return Check(
        frequency_hz=point.omega / HZ,
        balance=_amplitude(question, response, point),
        transient=_size(question, known),
        settled=bool(found.settled),
        periods=int(found.periods),
        scatter=float(found.scatter),
        drifting=listed(found.drifting),
        order=point.order,
        steps=steps,
        outputs_percent=100 * _of_outputs(question.problem, every, outputs),
    )


def _of_outputs(problem: ForcedProblem, true: ComplexArray, found: ComplexArray) -> float:
    """Return the largest relative difference of outputs (H+1, n_outputs) from an integration, in the error norm."""
    if not np.all(np.isfinite(true)):
        return float("nan")
    rows = min(len(true), len(found))
    measure = problem.of_outputs
    return measure.change(true[:rows], found[:rows] - true[:rows])[0]


def _with_steps_enough(
    question: Question, response: Response, point: ForcedPoint, found: TransientResult, coarse: Check
) -> tuple[Check, TransientResult]:
    """Continue a settled motion with twice the steps until the steps no longer change it."""
    steps = STEPS
    while True:
        steps *= 2
        finer = integrated(question.problem, point, question.model.load, begin=found.final, steps=steps)
        fine = _compared(question, response, point, finer, steps)
        before = coarse.transient
        moved = 100 * (fine.transient / before - 1.0) if before else off_percent(fine.transient, before)
        if abs(moved) <= LARGE and coarse.steps == STEPS:
            return coarse, found
        coarse, found = replace(fine, step_percent=moved), finer
        if abs(moved) <= LARGE or not found.settled or steps >= MOST_STEPS:
            return coarse, found


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
    kick: float = 0.0,
    least: int = 1,
) -> TransientResult:
    """Integrate in time from the balance's state at t = 0, which is close to the periodic motion.

    Parameters
    ----------
    problem, point
        The problem and its solution.
    load
        Loads of the model.
    periods
        Largest number of periods to settle.
    begin
        Other initial state, such as the end of an integration with fewer steps.
    steps
        Time steps a period.
    kick
        Disturbance of each initial velocity, as a fraction of its amplitude.
    least
        Smallest number of periods.
    """
    system = problem.system
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    structure, contacts = system.structure, system.interface
    wheel = system.structure.wheel
    if wheel is not None:
        # with every wave, sectors may move differently, so that a disturbance can leave the tuned motion
        whole = all_sectors(system, load, every=wheel.has_every_wave)
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
        or disturbed(
            start_from_harmonics(motion, point.omega, contacts.gap_operator, contacts.laws),
            kick * _speeds(motion, point.omega),
        ),
        stepping=TimeStepping(
            steps_per_period=steps,
            max_periods=periods,
            min_periods=least,
            rings=RINGS_ON,
            harmonics=max(REPORTED if problem.sweep.amplitude_of == "first" else WHOLE, *load.harmonics),
        ),
        weights=contacts.weights,
    )


def _speeds(motion: ComplexArray, omega: float) -> FloatArray:
    """Return (n,) amplitudes of the velocities of a motion (H + 1, n), summed over its harmonics."""
    orders = np.arange(len(motion))[:, None]
    return np.asarray(np.sum(np.abs(orders * omega * motion), axis=0))


def disturbed(start: TransientStart, speeds: FloatArray, kick: float = 1.0) -> TransientStart:
    """Return an initial state with velocities changed by up to `kick` times `speeds`, differently in each coordinate, so that no symmetry hides a disturbance."""
    shares = kick * np.cos(GOLDEN * np.arange(speeds.size))
    return replace(start, velocity=start.velocity + shares * speeds)


def refined(question: Question, point: ForcedPoint, order: int) -> ForcedPoint | None:
    """Solve the balance with harmonics up to `order`; None if it does not converge.

    Parameters
    ----------
    question
        The case.
    point
        A solution with fewer harmonics, the start of Newton's method.
    order
        Highest harmonic; the number of samples grows with it.
    """
    sweep = replace(question.sweep, high=order, samples=(MORE + 1) * question.sweep.samples)
    balance = forced_problem(question.model.system, question.model.load, sweep).high
    start = balance.unknowns(point.coefficients)
    solution = newton(lambda x: balance.linearise(x, point.omega), start, sweep.newton)
    if not solution.status.converged:
        return None
    return replace(point, coefficients=balance.coefficients(solution.x))
