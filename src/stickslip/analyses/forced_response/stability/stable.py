"""Stability of a motion of a response: by multipliers, and by time integration."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from stickslip.analyses.forced_response.problem import Question, too_large
from stickslip.analyses.forced_response.stability.examination import (
    FLOPS,
    by_hill,
    examination_work,
    hill_work,
    too_long,
)
from stickslip.analyses.forced_response.stability.in_time import Check, seconds_in_time
from stickslip.arrays import ComplexArray
from stickslip.errors import InputError, StickslipError
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.collected import Accepted, Response
from stickslip.response.forced.problem import ForcedPoint
from stickslip.response.stability import Stability, hill_stability, settled_stability
from stickslip.response.stability.found import UNIT_TOLERANCE, Floquet, modulus_text
from stickslip.response.stability.hill_method.hill_segment import Keep, not_kept
from stickslip.response.stability.missing_harmonics import with_more
from stickslip.response.stability.waves import WaveDisturbance, growing_wave, point_disturbances
from stickslip.units import HZ

Word = Literal["stable", "unstable", "neutral", "undecided", "not examined"]
Basis = Literal["not examined", "examined", "carried", "by sign"]
MOST_IN_TIME = 20.0  # largest estimated seconds of an integration without request
FAR = 50.0  # percent: a motion farther than this has left a balance that could not be solved with more harmonics
ONE_SECTOR = "what vibrates is one sector of a tuned wheel, which sees one family of disturbances only"
BY_MOTION: dict[str, Word] = {"attained": "stable", "left": "unstable", "not periodic": "unstable"}


@dataclass(frozen=True, eq=False)
class Examined:
    """Stability of one point.

    Parameters
    ----------
    omega
        Frequency, rad/s.
    verdict
        One of the words of `Word`.
    multiplier, error
        Modulus of the decisive multiplier and its error; NaN if unknown.
    reason
        Basis of the verdict, in words.
    motion
        Outcome of a time integration, made if the multipliers left the verdict undecided; else empty.
    large
        Why the model cannot be integrated in time; empty if it can.
    basis
        Whether the point itself was examined or its verdict was inferred: from two examined points around it, or from the sign of the
        determinant of the balance's Jacobian.
    position
        Index of the point in the response.
    work
        Floating point operations of the examination.
    multipliers
        (m,) all known multipliers, for the check that none crosses the unit circle between two points.
    raised
        The solution with more harmonics to which the verdict applies, if it differs from the point as solved; else None.
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
    multipliers: ComplexArray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    raised: ForcedPoint | None = None

    @property
    def doubted(self) -> bool:
        """Whether the verdict is unstable or undecided."""
        return self.verdict in ("unstable", "undecided")

    def linear(self, size: float) -> str:
        """Return the reason why another point with the same contact states is stable; `size`: modulus of its largest multiplier."""
        return (
            f"no contact changes its state, as at {self.omega / HZ:.3f} Hz, so that the exponents are the same: the largest multiplier has the "
            f"modulus {modulus_text(size)}"
        )

    @property
    def sentence(self) -> str:
        """Verdict and reason as a sentence."""
        told = f"{self.omega / HZ:.3f} Hz: {self.verdict}"
        if self.verdict == "undecided" and not self.motion:
            if self.large:
                return f"{told}: {self.reason}; not integrated in time ({self.large})"
            return f"{told}: {self.reason}; an integration in time (--verify) tells more"
        if not self.motion:
            return f"{told}: {self.reason}"
        return f"{told}, the motion in time being {self.motion}; by the multipliers undecided: {self.reason}"


def examine(question: Question, accepted: Accepted, keep: Keep = not_kept) -> Examined:
    """Return the stability of a point by its multipliers, or why there are none; `keep` stores pieces of a long examination."""
    if accepted.point.shot:
        return _of_shot(accepted.point)
    omega = accepted.point.omega
    why, hill = why_not(question), by_hill(question.model.system)
    if why:
        return Examined(omega, "not examined", np.nan, np.nan, why, basis="not examined")
    try:
        if hill:
            return _by_hill(question, accepted, keep)
        settled = settled_stability(question.problem, accepted.point, accepted.audit)
        found = settled.stability
        wave = _of_wave(question, accepted, found)
    except InputError as error:
        return Examined(omega, "not examined", np.nan, np.nan, error.problem, basis="not examined")
    except (StickslipError, FloatingPointError, np.linalg.LinAlgError) as error:
        why = f"no multipliers ({error})"
        return Examined(omega, "not examined", np.nan, np.nan, why, basis="not examined")
    seen = _seen(question, accepted, found, f"{found.reason}{wave}")
    return seen if settled.motion is None else _of_motion(question, seen, settled.motion)


def _of_shot(point: ForcedPoint) -> Examined:
    """Return the stability of a motion found by shooting from its multipliers; the time step gives their error."""
    (shot,) = point.shot
    floquet = Floquet(shot.multipliers)
    neutral = np.abs(floquet.multipliers - 1.0) <= UNIT_TOLERANCE
    found = Stability(floquet, np.where(neutral, 0.0, shot.growth_error), floquet.neutral, 0, 0)
    reason = found.reason
    if np.isinf(shot.growth_error):
        reason = f"the largest multiplier has the modulus {found.multiplier:.4g} with {shot.steps} steps a period; its error is not known, as contacts change their state within a step"
    more = f"forced_response.steps_per_period above {shot.steps} makes the error smaller"
    return Examined(
        point.omega,
        found.verdict,
        found.multiplier,
        found.multiplier_error,
        reason,
        large=more,
        multipliers=floquet.multipliers,
    )


def _of_motion(question: Question, seen: Examined, motion: ForcedPoint) -> Examined:
    """Return the stability with the solution to which it applies; undecided if the study fixes fewer harmonics."""
    if question.sweep.auto and question.problem.strategy.verifies:
        return replace(seen, raised=motion)
    more = f"with H = {motion.order} it is {seen.verdict}; the harmonics asked for are too few for its stability"
    return replace(seen, verdict="undecided", reason=f"{seen.reason}: {more}")


def with_raised(points: Sequence[ForcedPoint], examined: Sequence[Examined]) -> list[ForcedPoint]:
    """Return the solutions with more harmonics that the verdicts apply to; they replace the points as solved.

    Parameters
    ----------
    points
        Points of the response.
    examined
        Stability of the points.
    """
    raised = []
    for one in examined:
        if one.raised is not None:
            own = points[one.position]
            stage: Stage = "peak" if own.stage == "peak" else "settled"
            raised.append(replace(one.raised, stage=stage, index=own.index))
    return raised


def as_note(examined: Examined) -> dict[str, Any]:
    """Return an examined point as a note of the job."""
    note = asdict(replace(examined, raised=None))
    del note["raised"], note["multipliers"]
    note |= {"re": examined.multipliers.real, "im": examined.multipliers.imag}
    return note | note_of_raised(examined.raised)


def from_note(note: Mapping[str, Any], point: ForcedPoint) -> Examined:
    """Return an examined point from a note of the job."""
    own = Examined(**{name: value for name, value in without_raised(note).items() if name not in ("re", "im")})
    return replace(own, multipliers=_complex(note, ""), raised=raised_of(note, point))


def note_of_raised(raised: ForcedPoint | None) -> dict[str, Any]:
    """Return the solution that replaces a point as part of a note of the job; empty if there is none."""
    if raised is None:
        return {}
    return {
        "raised_re": raised.coefficients.real,
        "raised_im": raised.coefficients.imag,
        "raised_harmonics": raised.harmonics,
        "raised_error": raised.predicted_error,
    }


def without_raised(note: Mapping[str, Any]) -> dict[str, Any]:
    """Return a note of the job without the solution that replaces the point."""
    return {name: value for name, value in note.items() if not name.startswith("raised_")}


def raised_of(note: Mapping[str, Any], point: ForcedPoint) -> ForcedPoint | None:
    """Return the solution that replaces a point from a note of the job; None if there is none."""
    if "raised_re" not in note:
        return None
    harmonics, error = np.asarray(note["raised_harmonics"]), float(note["raised_error"])
    return with_more(point, _complex(note, "raised_"), harmonics, error)


def _complex(note: Mapping[str, Any], of: str) -> ComplexArray:
    return np.asarray(note[f"{of}re"]) + 1j * np.asarray(note[f"{of}im"])


def _by_hill(question: Question, accepted: Accepted, keep: Keep) -> Examined:
    """Return the stability of a point of a wheel by Hill's method, for every wave."""
    hill = hill_stability(question.problem, accepted.point, keep)
    found, said = hill.stability, hill.reason
    wheel = question.model.system.structure.wheel
    if wheel is not None and hill.disturbance is not None and found.verdict != "stable":
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
        multipliers=found.floquet.multipliers,
    )


def _of_wave(question: Question, accepted: Accepted, found: Stability) -> str:
    """Return the wave of the decisive multiplier of a wheel; empty if disturbances decay."""
    if question.model.system.structure.wheel is None or found.verdict == "stable":
        return ""
    wave = growing_wave(point_disturbances(question.problem, accepted.point), found.multiplier)
    return "" if wave is None else _named(question, wave)


def _named(question: Question, wave: WaveDisturbance) -> str:
    """Return the wave of a disturbance in words."""
    wheel = question.model.system.structure.wheel
    diameters = 0 if wheel is None else wave.nodal_diameter(wheel.sectors)
    return f", in wave {wave.wave} ({diameters} nodal diameters) near {wave.omega / HZ:.5g} Hz"


def with_motion(examined: Examined, check: Check | None) -> Examined:
    """Return the stability with the outcome of a time integration, if the multipliers left it undecided."""
    if check is None or examined.verdict != "undecided" or not check.motion:
        return examined
    verdict = BY_MOTION.get(check.motion, examined.verdict)
    alone = np.isfinite(check.transient) and not np.isfinite(check.refined)
    if check.motion == "left" and alone and abs(check.difference_percent) < FAR:
        verdict = "undecided"  # the difference may be the error of few harmonics
    if check.wanders_near:
        verdict = "undecided"  # the motion stays within the error of the balance
    return replace(examined, verdict=verdict, motion=check.motion)


def to_integrate(question: Question, response: Response, examined: list[Examined]) -> bool:
    """Return whether the peak is integrated in time without request: it is undecided, and the integration is short."""
    return (
        response.top is not None
        and any(e.position == response.peak and e.verdict == "undecided" and not e.motion for e in examined)
        and integrable(question)
    )


def integrable(question: Question) -> bool:
    """Return whether motions are integrated in time without request: possible, short, and no structural damping."""
    system = question.model.system
    can = not why_not(question) and system.structure.of_harmonic(1).loss is None
    return can and seconds_in_time(system) < MOST_IN_TIME


def why_not(question: Question) -> str:
    """Return the reason why no point of a case can be examined; empty if multipliers or Hill's method are available."""
    system = question.model.system
    if not by_hill(system):
        return unexaminable(question)
    wheel = system.structure.wheel
    return ONE_SECTOR if wheel is not None and not wheel.has_every_wave else ""


def unexaminable(question: Question) -> str:
    """Return the reason why no point of a case has all its multipliers; empty if no reason is known."""
    system = question.model.system
    if system.interface.rigid:
        return "a contact is rigid: its force is no function of the gap"
    why = too_long(system, forced=True, most_s=question.stability_s, key="forced_response.stability_s")
    wheel = system.structure.wheel
    if not why and wheel is not None and not wheel.has_every_wave:
        return ONE_SECTOR
    return why


def _instead(question: Question) -> Iterator[str]:
    """Yield what examines a case that is too large, with its cost."""
    system = question.model.system
    if not system.structure.reduced or system.interface.rigid:
        return
    needed = examination_work(system) / FLOPS
    if system.structure.wheel is None and needed > question.stability_s:
        yield f"stability: forced_response.stability_s = {_rounded_up(needed):g} examines the peak, in about {needed:.0f} s of one core"
    if not too_large(question):
        yield f"stability: run --verify integrates the peak in time, in up to {seconds_in_time(system):.0f} s"


def _rounded_up(value: float) -> float:
    step = 10.0 ** max(math.floor(math.log10(value)) - 1, 0)
    return step * math.ceil(value / step)


def cost_lines(question: Question) -> tuple[str, ...]:
    """Return the lines of ``stickslip check`` about the examination."""
    if question.examine == "off":
        return ('stability: not examined, forced_response.stability is "off"; "auto" examines it',)
    why = why_not(question)
    if why:
        first, *more = why.split(": ")
        said = (f"stability: not examined, {first}", *(f"stability: {text}" for text in more))
        return (*said, *_instead(question))
    if by_hill(question.model.system):
        system = question.model.system
        waves = "" if system.structure.wheel is None else " against every wave, one sector at a time"
        most = max(1.0, hill_work(system) / FLOPS)
        return (f"stability: the peak of a case{waves} (Hill's method), up to {most:.0f} s",)
    points = {
        "all": "every point",
        "peak": "the peak",
        "auto": "the peak, and other points for as long as solving takes",
    }[question.examine]
    seconds = seconds_in_time(question.model.system)
    motion = (
        f"is integrated in time, up to {seconds:.1f} s"
        if seconds < MOST_IN_TIME
        else f"stays so without --verify (about {seconds:.0f} s)"
    )
    which = "peak" if question.examine == "peak" else "point"
    each = f"about {examination_work(question.model.system) / FLOPS:.1g} s each"
    return (f"stability: {points}, {each}", f"stability: an undecided {which} {motion}")
