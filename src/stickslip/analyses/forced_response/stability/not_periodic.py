"""Time integration at points without a periodic motion, or without a stable one."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from stickslip.analyses.forced_response.problem import Question, too_large
from stickslip.analyses.forced_response.records.columns import MotionsInTime, stored
from stickslip.analyses.forced_response.stability.in_time import KICK, disturbed
from stickslip.analyses.forced_response.stability.stable import Examined
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import StickslipError
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.quasi_periodic.in_time import KEPT, MAX_PERIODS, MIN_PERIODS, PEAKS, Course, course, statistics
from stickslip.response.time.sectors import all_sectors
from stickslip.response.time.start import rest, start_from_harmonics
from stickslip.units import HZ, millimetres, millimetres_between

STEPS = 512  # least number in a period
AGREE = 0.1  # largest relative difference of a root mean square with half the step
TURNS = 128  # periods whose amplitudes are kept for the figure
EQUAL_AMPLITUDE_RTOL = 1e-3  # relative difference of equal amplitudes
# largest relative distance of a motion that has not left the balance, before and after a disturbance can have grown
ESTIMATED_DISTANCE, ATTAINED_DISTANCE = 0.05, 0.01
MARGIN = 1.5  # factor on the periods in which a kick grows to the size of the motion, since the later half is compared
MOST_PERIODS = 20_000
MULTIPLE = 0.02  # share of the frequency: a spectral line farther than this from every multiple is another frequency


@dataclass(frozen=True)
class Answer:
    """The motion in time at a frequency without a valid balance solution.

    Parameters
    ----------
    omega
        Frequency, rad/s.
    why
        Reason for the integration.
    largest, least, mean, rms, extreme
        (n_outputs,) statistics, see `Statistics`; NaN if unknown.
    spread, periods, seconds
        Relative difference between windows in the later half; number of periods integrated; time of the computation, s.
    settled
        Whether the windows agree.
    periodic
        Whether every period equals the one before; the integration has then found a periodic motion other than the balance's.
    line_hz, line_amplitude
        Peaks of the spectrum of the report output, Hz and m.
    amplitudes
        (TURNS,) amplitudes of the report output in the last periods, m; NaN if there are fewer periods.
    sentence
        The result as a sentence.
    """

    omega: float
    why: str
    largest: FloatArray
    least: FloatArray
    mean: FloatArray
    rms: FloatArray
    extreme: FloatArray
    spread: float
    periods: int
    seconds: float
    settled: bool
    periodic: bool
    line_hz: FloatArray
    line_amplitude: FloatArray
    amplitudes: FloatArray
    sentence: str


@dataclass(frozen=True)
class _March:
    """A time integration: its distance from the initial balance (NaN without one), periods needed to leave it, and the result with half the step."""

    course: Course
    away: float
    needed: float
    finer: Course | None = None

    @property
    def stayed(self) -> bool:
        """Whether the motion is still the initial one, as far as known."""
        return self.away < (ESTIMATED_DISTANCE if self.course.periods < self.needed else ATTAINED_DISTANCE)


def without_periodic(
    question: Question, response: Response, examined: Sequence[Examined]
) -> list[tuple[float, str, float]]:
    """Return points without a valid balance solution, the nearest to the peak first: rad/s, reason, multiplier modulus."""
    found = {
        a.point.omega: ("no periodic motion was found", np.nan) for a in response.accepted if not a.point.converged
    }
    for one in examined:
        if one.verdict == "unstable" and _alone(response, examined, one):
            found[one.omega] = "the periodic motion is unstable", one.multiplier
        elif one.verdict == "undecided" and not one.motion and not np.isfinite(one.error):
            found[one.omega] = ("no motion with more harmonics was found near the balance", one.multiplier)
    middle = sum(question.sweep.omega_range) / 2 if response.top is None else response.top.point.omega
    nearest = sorted(found, key=lambda omega: abs(omega - middle))
    return [(omega, *found[omega]) for omega in nearest[: question.not_periodic_points]]


def _alone(response: Response, examined: Sequence[Examined], one: Examined) -> bool:
    """Whether an unstable motion is the largest one, or has no stable motion of the response at its frequency."""
    if one.position == response.unstable_peak:
        return True
    known = {e.position: e.verdict == "stable" for e in examined}
    omega = [a.point.omega for a in response.accepted]
    between = (
        min(omega[i], omega[i + 1]) <= one.omega <= max(omega[i], omega[i + 1])
        for i in range(len(omega) - 1)
        if known.get(i) and known.get(i + 1)
    )
    return not any(between)


def in_time_instead(
    question: Question, response: Response, omega: float, why: str, work: float, multiplier: float = np.nan
) -> Answer:
    """Integrate in time at a frequency and describe the motion.

    Parameters
    ----------
    question, response
        The case and its finished response.
    omega
        Frequency, rad/s.
    why
        Reason for the integration.
    work
        Floating point operations allowed, for the integration and for the check with half the step.
    multiplier
        Modulus of the multiplier of the balance's motion, which gives the growth time of disturbances; NaN if unknown.
    """
    count = question.problem.system.outputs.size
    if large := too_large(question):
        return _nothing(omega, why, count, f"not integrated: {large}")
    try:
        found = _marched(question, response, omega, work, multiplier)
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return _nothing(omega, why, count, f"not integrated: {error}")
    return _told(question, response, omega, why, found)


def _marched(question: Question, response: Response, omega: float, work: float, multiplier: float) -> _March:
    system, load = question.problem.system, question.model.load
    structure, contacts = system.structure, system.interface
    known = [a for a in response.accepted if a.point.converged]
    near: Accepted | None = min(known, key=lambda a: abs(a.point.omega - omega), default=None)
    motion = None
    if near is not None:
        own = near.point
        motion = question.problem.low.linear.recover(own.omega, own.coefficients)
    wheel = system.structure.wheel
    if wheel is not None:
        whole = all_sectors(system, load, every=wheel.has_every_wave)
        motion = None if motion is None else whole.spread(motion)
        structure, contacts, load = whole.structure, whole.contacts, whole.load
    start = rest(structure.n, contacts.laws)
    if motion is not None:
        start = start_from_harmonics(motion, omega, contacts.gap_operator, contacts.laws)
        start = disturbed(start, omega * np.abs(motion[1:]).sum(axis=0), KICK)
    needed = _needed(multiplier)
    least = MIN_PERIODS if np.isinf(needed) else int(np.clip(needed, MIN_PERIODS, MOST_PERIODS))
    march = partial(course, structure, contacts, load, omega, system.outputs)
    most = max(MAX_PERIODS, min(2 * least, MOST_PERIODS))
    found = march(start, steps=STEPS, work=work, least=least, most=most)
    finer = None
    if (
        found.angle > 0.0 and not found.overflowed
    ):  # opening and closing contacts may make the motion depend on the step
        finer = march(found.final, steps=2 * found.steps, work=work, most=MIN_PERIODS)
    away = np.nan
    if near is not None and motion is not None and near.point.omega == omega:
        away = _away(found, motion[:, system.outputs])
    return _March(found, away, needed, finer)


def _needed(multiplier: float) -> float:
    """Return the number of periods in which a disturbance is sure to have grown; infinite if no multiplier exceeds 1."""
    return MARGIN * np.log(1.0 / KICK) / np.log(multiplier) if multiplier > 1.0 else np.inf


def _away(found: Course, motion: ComplexArray) -> float:
    """Return the relative distance of the last period's vibration from coefficients (H + 1, outputs)."""
    if not found.periods:
        return np.nan
    turns = 2.0 * np.pi * np.arange(1, KEPT + 1) / KEPT
    own = (np.exp(1j * np.outer(turns, np.arange(1, len(motion)))) @ motion[1:]).real
    last = found.samples[-1] - found.samples[-1].mean(axis=0)
    size = float(np.linalg.norm(own))
    return float(np.linalg.norm(last - own)) / size if size > 0.0 else np.nan


def _told(question: Question, response: Response, omega: float, why: str, march: _March) -> Answer:
    """Return an answer with its sentence."""
    found = march.course
    of, own = statistics(found), response.output
    if found.overflowed or not np.isfinite(of.spread):
        count = question.problem.system.outputs.size
        said = (
            f"in time it grew beyond all numbers in {found.periods} periods"
            if found.overflowed
            else (f"the time was too short: {found.periods} of at least {MIN_PERIODS} periods")
        )
        return _nothing(omega, why, count, said)
    last = found.amplitude[-TURNS:, own]
    amplitudes = np.full(TURNS, np.nan)
    amplitudes[: last.size] = last
    alike = bool(np.all(of.largest - of.least <= EQUAL_AMPLITUDE_RTOL * of.largest.max(initial=0.0)))
    lines = of.hertz[own]
    strange = [f"{hz:.2f} Hz" for hz in lines if _off(hz, omega / HZ)]
    label = question.model.output_labels[own]
    head = f"{omega / HZ:.3f} Hz: {why}; in time"
    counted = f"over {of.periods} periods after {found.periods - of.periods}"
    doubt = _of_the_step(march, own)
    settled = of.settled and not (alike and march.stayed) and not doubt
    if alike and march.stayed:
        body = (
            f"it has not left the motion that it started on by more than {100 * march.away:.2g} %, {label} {millimetres(of.largest[own])} {counted}; "
            + _patience(march)
        )
    elif alike and settled:
        body = f"it settles to another periodic motion, {label} {millimetres(of.largest[own])} {counted}"
    else:
        body = (
            f"its amplitude goes from {millimetres_between(of.least[own], of.largest[own])} ({label}, half of peak to peak in a period), "
            f"root mean square {millimetres(of.rms[own])}, {counted}"
        )
        body += f"; besides multiples of the frequency {', '.join(strange)}" if strange else ""
        body += _settledness(of.spread, of.settled)
    body += doubt
    return Answer(
        omega,
        why,
        of.largest,
        of.least,
        of.mean,
        of.rms,
        of.extreme,
        of.spread,
        found.periods,
        found.seconds,
        settled,
        alike and settled,
        lines,
        of.peaks[own],
        amplitudes,
        f"{head} {body}",
    )


def _patience(march: _March) -> str:
    if np.isinf(march.needed):
        return "how fast a disturbance grows is not known"
    if march.course.periods < march.needed:
        return f"a disturbance needs {march.needed:.0f} periods to grow"
    return "a disturbance should have grown by now"


def _settledness(spread: float, settled: bool) -> str:
    if settled:
        return f"; four windows differ by {100 * spread:.2g} %"
    return f"; not settled: four windows differ by {100 * spread:.2g} %"


def _of_the_step(march: _March, own: int) -> str:
    """Return the reason why an integration is not reliable with its time step; empty if it is."""
    if march.finer is None:
        return ""
    if march.finer.coarse:
        return f"; a contact that opens is too stiff for {march.finer.steps} steps a period"
    rms, fine = (float(statistics(c).rms[own]) for c in (march.course, march.finer))
    if not np.isfinite(fine):
        return "; there was no time to look at it with half the step (forced_response.not_periodic_s)"
    if abs(fine - rms) <= AGREE * max(fine, rms):
        return ""
    return f"; with half the step the root mean square is {millimetres(fine)}: too few steps, or too few periods"


def _off(hertz: float, own: float) -> bool:
    """Whether a line of the spectrum is no multiple of the frequency."""
    ratio = hertz / own
    return bool(np.isfinite(ratio)) and abs(ratio - round(ratio)) > MULTIPLE


def _nothing(omega: float, why: str, count: int, said: str) -> Answer:
    none, lines = np.full(count, np.nan), np.full(PEAKS, np.nan)
    return Answer(
        omega,
        why,
        none,
        none,
        none,
        none,
        none,
        np.nan,
        0,
        0.0,
        False,
        False,
        lines,
        lines,
        np.full(TURNS, np.nan),
        f"{omega / HZ:.3f} Hz: {why}; {said}",
    )


def of_answers(answers: Sequence[Answer]) -> dict[str, Any]:
    """Return the variables of the motions in time."""
    return stored(
        MotionsInTime(
            not_periodic_frequency_hz=np.array([a.omega / HZ for a in answers]),
            not_periodic_settled=np.array([a.settled for a in answers], dtype=np.int64),
            not_periodic_repeats=np.array([a.periodic for a in answers], dtype=np.int64),
            not_periodic_sentence=np.array([a.sentence for a in answers], dtype=str),
            not_periodic_largest=np.array([a.largest for a in answers]),
            not_periodic_least=np.array([a.least for a in answers]),
            not_periodic_mean=np.array([a.mean for a in answers]),
            not_periodic_rms=np.array([a.rms for a in answers]),
            not_periodic_extreme=np.array([a.extreme for a in answers]),
            not_periodic_spread=np.array([a.spread for a in answers]),
            not_periodic_periods=np.array([a.periods for a in answers]),
            not_periodic_seconds=np.array([a.seconds for a in answers]),
            not_periodic_line_hz=np.array([a.line_hz for a in answers]),
            not_periodic_line_amplitude=np.array([a.line_amplitude for a in answers]),
            not_periodic_amplitudes=np.array([a.amplitudes for a in answers]),
        )
    )
