"""Whether a motion of a response is stable: what its multipliers say, and what a motion in time adds."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.errors import InputError, StickslipError
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.stability import Stability, hill_stability, stability
from stickslip.response.stability.hill_segment import Keep, not_kept
from stickslip.response.stability.modulus import modulus_text
from stickslip.response.stability.waves import (
    WaveDisturbance,
    growing_wave,
    point_disturbances,
)
from stickslip.study.analyses.forced.comparison import Check
from stickslip.study.analyses.forced.examination import (
    FLOPS,
    by_hill,
    examination_work,
    hill_work,
    too_long,
)
from stickslip.study.analyses.forced.in_time import seconds_in_time
from stickslip.study.analyses.forced.points import Accepted, Response
from stickslip.study.analyses.forced.question import Question, too_large
from stickslip.units import HZ

Word = Literal["stable", "unstable", "neutral", "undecided", "not examined"]
Basis = Literal["not examined", "examined", "carried", "by sign"]
MOST_IN_TIME = 20.0  # seconds estimated of an integration that nobody asked for
FAR = 50.0  # percent off: what a motion in time is that has left a balance of which no better one is known
ONE_SECTOR = (
    "what vibrates is one sector of a tuned wheel, which sees one family of disturbances only"
)
BY_MOTION: dict[str, Word] = {"attained": "stable", "left": "unstable", "not periodic": "unstable"}


@dataclass(frozen=True)
class Examined:
    """What was found of the stability of a point.

    Parameters
    ----------
    omega
        Where, rad/s.
    verdict
        In one of four words.
    multiplier, error
        Modulus of the multiplier that decides and its error; NaN where none is known.
    reason
        What the verdict rests on.
    motion
        What the motion in time did where the multipliers left the verdict undecided; empty where it was not asked.
    large
        Why the model is not integrated in time; empty where it can be.
    basis
        Whether the point itself was examined, or its verdict follows from others: carried along between two of them, or by the sign of the
        determinant of the balance's Jacobian.
    position
        Of the point in the response.
    work
        Floating point operations that the examination took.
    """

    omega: float
    verdict: Word
    multiplier: float
    error: float
    reason: str
    motion: str = ""
    large: str = ""
    basis: Basis = "examined"
    position: int = -1
    work: float = 0.0

    @property
    def doubted(self) -> bool:
        """Whether the multipliers were looked at and do not show that disturbances die."""
        return self.verdict in ("unstable", "undecided")

    def linear(self, size: float) -> str:
        """Return why another point is stable whose contacts rest in the states of this one, its largest multiplier having a modulus."""
        return (
            f"no contact changes its state, as at {self.omega / HZ:.3f} Hz, so that the exponents are the same: the largest multiplier has the "
            f"modulus {modulus_text(size)}"
        )

    @property
    def sentence(self) -> str:
        """What was found and why."""
        told = f"{self.omega / HZ:.3f} Hz: {self.verdict}"
        if self.verdict == "undecided" and not self.motion:
            if self.large:
                return f"{told}: {self.reason}; not integrated in time: {self.large}"
            return f"{told}: {self.reason}; an integration in time (--verify) tells more"
        if not self.motion:
            return f"{told}: {self.reason}"
        return f"{told}, the motion in time being {self.motion}; by the multipliers undecided: {self.reason}"


def examine(question: Question, accepted: Accepted, keep: Keep = not_kept) -> Examined:
    """Return what the multipliers say of a point, or why they say nothing; `keep` keeps pieces of a long examination."""
    omega = accepted.point.omega
    why, hill = why_not(question), by_hill(question.model.system)
    if why:
        return Examined(omega, "not examined", np.nan, np.nan, why, basis="not examined")
    try:
        if hill:
            return _by_hill(question, accepted, keep)
        found = stability(question.problem, accepted.point, accepted.audit)
        wave = _of_wave(question, accepted, found)
    except InputError as error:
        return Examined(omega, "not examined", np.nan, np.nan, error.problem, basis="not examined")
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        why = f"no multipliers ({error})"
        return Examined(omega, "not examined", np.nan, np.nan, why, basis="not examined")
    return _seen(question, accepted, found, f"{found.reason}{wave}")


def _by_hill(question: Question, accepted: Accepted, keep: Keep) -> Examined:
    """Return what Hill's method says of a point of a wheel, against every wave."""
    hill = hill_stability(question.problem, accepted.point, keep)
    found, said = hill.stability, hill.reason
    wheel = isinstance(question.model.system.structure, TunedWheel)
    if wheel and hill.disturbance is not None and found.verdict != "stable":
        said += _named(question, hill.disturbance)
    return _seen(question, accepted, found, said)


def _seen(question: Question, accepted: Accepted, found: Stability, said: str) -> Examined:
    return Examined(
        accepted.point.omega,
        found.verdict,
        found.multiplier,
        found.multiplier_error,
        said,
        large=too_large(question),
        work=hill_work(question.model.system) if by_hill(question.model.system) else found.work,
    )


def _of_wave(question: Question, accepted: Accepted, found: Stability) -> str:
    """Return which wave of a wheel the multiplier that decides belongs to; empty where disturbances die."""
    wheel = question.model.system.structure
    if not isinstance(wheel, TunedWheel) or found.verdict == "stable":
        return ""
    wave = growing_wave(point_disturbances(question.problem, accepted.point), found.multiplier)
    return "" if wave is None else _named(question, wave)


def _named(question: Question, wave: WaveDisturbance) -> str:
    """Return which wave a disturbance is."""
    wheel = question.model.system.structure
    diameters = wave.nodal_diameter(wheel.sectors) if isinstance(wheel, TunedWheel) else 0
    return f", in wave {wave.wave} ({diameters} nodal diameters) near {wave.omega / HZ:.5g} Hz"


def with_motion(examined: Examined, check: Check | None) -> Examined:
    """Return what was found with what the motion in time did, where the multipliers do not decide."""
    if check is None or examined.verdict != "undecided" or not check.motion:
        return examined
    verdict = BY_MOTION.get(check.motion, examined.verdict)
    alone = np.isfinite(check.transient) and not np.isfinite(check.refined)
    if check.motion == "left" and alone and abs(check.difference_percent) < FAR:
        verdict = "undecided"  # few harmonics may be so far off the motion that they stand for
    if check.wanders_near:
        verdict = "undecided"  # a machine does not leave it by more than it is known
    return replace(examined, verdict=verdict, motion=check.motion)


def to_integrate(question: Question, response: Response, examined: list[Examined]) -> bool:
    """Whether the peak is integrated in time without being asked to: where it is undecided, and soon done; not with structural damping."""
    top = response.top
    return (
        top is not None
        and question.model.system.structure.of_harmonic(1).loss is None
        and any(
            e.position == response.peak and e.verdict == "undecided" and not e.motion
            for e in examined
        )
        and seconds_in_time(question.model.system) < MOST_IN_TIME
    )


def why_not(question: Question) -> str:
    """Return why no point of a case is examined; empty where the multipliers, or Hill's method, can be had."""
    system = question.model.system
    if not by_hill(system):
        return unexaminable(question)
    wheel = system.structure
    return ONE_SECTOR if isinstance(wheel, TunedWheel) and not wheel.has_every_wave else ""


def unexaminable(question: Question) -> str:
    """Return why no point of a case has all its multipliers; empty where nothing is known against it."""
    system = question.model.system
    if system.interface.rigid:
        return "a contact is rigid: its force is no function of the gap"
    why, wheel = too_long(system, forced=True), system.structure
    if not why and isinstance(wheel, TunedWheel) and not wheel.has_every_wave:
        return ONE_SECTOR
    return why


def cost_line(question: Question) -> str:
    """Return what ``stickslip check`` says of the examination."""
    if question.examine == "off":
        return 'stability: not examined, forced_response.stability is "off"'
    why = why_not(question)
    if why:
        return f"stability: not examined, {why}"
    if by_hill(question.model.system):
        system = question.model.system
        wheel = isinstance(system.structure, TunedWheel)
        waves = " against every wave, one sector at a time" if wheel else ""
        most = max(1.0, hill_work(system) / FLOPS)
        return f"stability: the peak of a case{waves} (Hill's method), up to {most:.0f} s"
    points = {
        "all": "every point",
        "peak": "the peak",
        "auto": "the peak, and other points as far as the work of the solutions goes, all of them where matrices are small,",
    }[question.examine]
    seconds = seconds_in_time(question.model.system)
    motion = (
        f"up to {seconds:.1f} s of integration in time"
        if seconds < MOST_IN_TIME
        else f"it stays undecided without --verify (about {seconds:.0f} s)"
    )
    return f"stability: {points} of a case, about {examination_work(question.model.system) / FLOPS:.1g} s each; where the peak is undecided, {motion}"
