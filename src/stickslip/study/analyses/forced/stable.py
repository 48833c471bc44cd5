"""Whether the motions of a response are stable: the multipliers at its peak and at points that are doubtful, and what a motion in time adds."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.errors import InputError, StickslipError
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.stability import Stability, hill_stability, stability
from stickslip.response.stability.waves import (
    WaveDisturbance,
    growing_wave,
    point_disturbances,
)
from stickslip.study.analyses.forced.comparison import Check
from stickslip.study.analyses.forced.curve import branch_length
from stickslip.study.analyses.forced.examination import (
    FLOPS,
    by_hill,
    examination_work,
    hill_work,
    too_long,
)
from stickslip.study.analyses.forced.in_time import seconds_in_time
from stickslip.study.analyses.forced.jumps import jumps, stored_energy
from stickslip.study.analyses.forced.points import Accepted, Response
from stickslip.study.analyses.forced.question import Question, too_large
from stickslip.units import HZ

Word = Literal["stable", "unstable", "undecided", "not examined"]
DOUBTFUL = 4  # points beside the peak, the nearest to it
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
    """

    omega: float
    verdict: Word
    multiplier: float
    error: float
    reason: str
    motion: str = ""
    large: str = ""

    @property
    def doubted(self) -> bool:
        """Whether the multipliers were looked at and do not show that disturbances die."""
        return self.verdict in ("unstable", "undecided")

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


def to_examine(question: Question, response: Response) -> list[int]:
    """Return positions of the points that are examined: the peak, and doubtful ones as near to it as possible; or all.

    A point is doubtful where its own predicted error or its audit is above the threshold, or a jump lies beside it. Where nothing can be
    examined the peak stands for all.
    """
    if question.examine == "off" or response.top is None:
        return []
    if why_not(question) or by_hill(question.model.system):
        return [response.peak]
    known = [i for i, a in enumerate(response.accepted) if a.point.converged]
    if question.examine == "all":
        return known
    peak, beside = response.top.point.omega, _beside_jumps(response)
    doubtful = [
        i
        for i in known
        if i != response.peak and (i in beside or _off(question, response.accepted[i]))
    ]
    nearest = sorted(doubtful, key=lambda i: abs(response.accepted[i].point.omega - peak))
    return sorted([response.peak, *nearest[:DOUBTFUL]])


def examine(question: Question, accepted: Accepted) -> Examined:
    """Return what the multipliers say of a point, or why they say nothing."""
    omega = accepted.point.omega
    why, hill = why_not(question), by_hill(question.model.system)
    if why:
        return Examined(omega, "not examined", np.nan, np.nan, why)
    try:
        if hill:
            return _by_hill(question, accepted)
        found = stability(question.problem, accepted.point)
        wave = _of_wave(question, accepted, found)
    except InputError as error:
        return Examined(omega, "not examined", np.nan, np.nan, error.problem)
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        return Examined(omega, "not examined", np.nan, np.nan, f"no multipliers ({error})")
    return _seen(question, accepted, found, f"{found.reason}{wave}")


def _by_hill(question: Question, accepted: Accepted) -> Examined:
    """Return what Hill's method says of a point of a wheel, against every wave."""
    hill = hill_stability(question.problem, accepted.point)
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
        and any(e.omega == top.point.omega and e.verdict == "undecided" for e in examined)
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
    points = (
        "every point"
        if question.examine == "all"
        else f"the peak and at most {DOUBTFUL} doubtful points"
    )
    seconds = seconds_in_time(question.model.system)
    motion = (
        f"up to {seconds:.1f} s of integration in time"
        if seconds < MOST_IN_TIME
        else f"it stays undecided without --verify (about {seconds:.0f} s)"
    )
    return f"stability: {points} of a case, about {examination_work(question.model.system) / FLOPS:.1g} s each; where the peak is undecided, {motion}"


def _off(question: Question, accepted: Accepted) -> bool:
    """Whether the own error of a point, or its difference from its audit, is above the threshold."""
    return bool(accepted.own_error > question.limit or accepted.audit_error > question.limit)


def _beside_jumps(response: Response) -> set[int]:
    """Return positions of the points on either side of a jump."""
    every = response.accepted
    along = branch_length(np.array([a.point.stage == "peak" for a in every], dtype=float))
    branch = [i for i, a in enumerate(every[:along]) if a.fields is not None]
    shown = [f for f in (every[i].fields for i in branch) if f is not None]
    amplitude = np.array([response.amplitude(every[i]) for i in branch])
    few = np.array([every[i].point.support == response.low_harmonics for i in branch], dtype=bool)
    loss = np.array([f.energy.sum() for f in shown])
    elastic = max((stored_energy(f.gaps[None, 1:], f.forces[None, 1:]) for f in shown), default=0.0)
    found = jumps(amplitude, loss, few, elastic)
    return {i for jump in found for i in branch[jump.step : jump.step + 2]}
