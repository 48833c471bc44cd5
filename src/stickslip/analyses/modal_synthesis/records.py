"""Records of responses from one nonlinear mode: one for each level of the loads, and the record of a case."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.study.analysis import Solved
from stickslip.units import HZ

NOTHING = (np.nan, np.nan)


@dataclass(frozen=True, eq=False, kw_only=True)
class SynthesisLevel:
    """The response at a level of the loads; NaN without a response that can be shown."""

    level: float = column("1", "factor on the harmonic loads")
    answer: str = column("1", "trusted, doubtful, refused or beyond")
    why: str = column("1", "what that rests on")
    peak: float = column(
        "m", "largest amplitude of the output in the first harmonic, on the curve that a sweep meets", "peak_amplitude"
    )
    peak_omega: float = column("Hz", "its frequency", "peak_frequency_hz", per=HZ)
    detached_peak: float = column(
        "m", "the same of the detached curves, which a sweep does not meet", "detached_peak_amplitude"
    )
    detached_peak_omega: float = column("Hz", "its frequency", "detached_peak_frequency_hz", per=HZ)
    foreign: float = column("1", "relative error of the peak that the other modes make, about")
    output: float = column(
        "1", "motion of the other modes over the motion of the mode, at the output", "others_in_output"
    )
    gaps: float = column("1", "the same in the gaps of the contacts", "others_in_gaps")
    distance: float = column("1", "relative distance of the next frequency", "next_frequency")
    overlap: float = column("1", "damping ratio over that distance")
    growth: float = column("1", "relative growth of the peak with the level: 1 where nothing slips")
    harmonics: float = column("1", "higher harmonics over the first, at the output", "higher_harmonics")
    resolved: float = column("1", "relative change of the peak if every second point of the nonlinear mode is left out")
    changed: float = column(
        "1",
        "relative change of frequency or damping ratio of the nonlinear mode at the peak that more harmonics are foretold to make",
        "by_harmonics",
        default=np.nan,
    )
    detached: int = column("1", "number of curves that do not hang together with small amplitudes")
    seconds: float = column("s", "time of the processor for the response")
    omega: FloatArray = column("Hz", "frequency of the response", "frequency_hz", per=HZ, along="point")
    amplitude: FloatArray = column("m", "amplitude of the output in the first harmonic", along="point")
    curve: IntArray = column("1", "0: hangs together with small amplitudes; others are detached", along="point")
    stable: IntArray = column("1", "1 where slow changes of this mode die out", along="point")
    others: FloatArray = column(
        "1", "motion of the other modes over the motion of the mode, at the output or in the gaps", along="point"
    )
    alone: IntArray = column(
        "1",
        "1 where the mode answers alone: nothing slips, or the others change motion and amplitude by at most 5 %",
        along="point",
    )
    alone_from: float = column(
        "Hz",
        "lowest frequency around the peak at which the mode answers alone; NaN where it does not at the peak",
        "alone_from_hz",
        per=HZ,
        default=np.nan,
    )
    alone_to: float = column("Hz", "highest such frequency", "alone_to_hz", per=HZ, default=np.nan)
    direct_omega: FloatArray = column(
        "Hz", "frequency of the direct solution", "direct_frequency_hz", per=HZ, along="direct_point"
    )
    direct_amplitude: FloatArray = column(
        "m", "amplitude of the output in the first harmonic, solved directly", along="direct_point"
    )
    direct_peak: float | None = column("m", "peak of the direct solution", "direct_peak_amplitude", default=None)
    direct_peak_omega: float | None = column("Hz", "its frequency", "direct_peak_frequency_hz", per=HZ, default=None)
    direct_error: float | None = column("1", "synthesised peak over the direct one, less one", default=None)
    along_error: float | None = column(
        "1",
        "largest difference of synthesised and direct curve, over the direct one, where the mode answers alone around the peak",
        default=None,
    )
    along_error_omega: float | None = column("Hz", "its frequency", "along_error_hz", per=HZ, default=None)
    direct_seconds: float | None = column("s", "time of the processor for the direct solution", default=None)
    passage_omega: FloatArray = column(
        "Hz", "frequency of the load during a passage", "passage_frequency_hz", per=HZ, along="rate moment"
    )
    passage_amplitude: FloatArray = column("m", "amplitude of the output then", along="rate moment")
    passage_peak: FloatArray | None = column("m", "its largest", "passage_peak_amplitude", along="rate", default=None)
    passage_peak_omega: FloatArray | None = column(
        "Hz", "frequency of the load then", "passage_peak_frequency_hz", per=HZ, along="rate", default=None
    )
    passage_share: FloatArray | None = column("1", "that amplitude over the steady peak", along="rate", default=None)
    passage_finished: IntArray = column("1", "1 where a passage came to its end", along="rate")
    passage_change: FloatArray = column(
        "1",
        "relative change of the amplitude in a radian of the vibration, while it is above half its peak",
        along="rate",
    )

    @property
    def shown(self) -> bool:
        """Whether the level has a response."""
        return self.answer in ("trusted", "doubtful")


@dataclass(frozen=True)
class Passage:
    """The peak of a passage: rate (Hz/s), amplitude (m), frequency (Hz), share of the steady peak, change in a radian."""

    rate: float
    peak: float
    hertz: float
    share: float
    change: float


@dataclass(frozen=True, eq=False, kw_only=True)
class ModalSynthesis:
    """Record of a case."""

    output: str = column("1", "output whose amplitude is told", default="")
    mode: int | None = column("1", "number of the mode, by frequency with contacts stuck", default=None)
    mode_frequency_hz: float | None = column("Hz", "its frequency with contacts stuck", default=None)
    mode_damping_ratio: float | None = column("1", "its damping ratio with contacts stuck", default=None)
    homogeneous: bool | None = column(
        "1",
        "1 where all contact forces double with all displacements: static and vibration loads then scale together",
        default=None,
    )
    mode_seconds: float | None = column("s", "time of the processor for the nonlinear mode", default=None)
    backbone_amplitude: FloatArray | None = column(
        "m", "amplitude of the output along the nonlinear mode", along="place", default=None
    )
    backbone_frequency_hz: FloatArray | None = column("Hz", "its frequency", along="place", default=None)
    backbone_damping_ratio: FloatArray | None = column("1", "its damping ratio", along="place", default=None)
    resonance_level: FloatArray | None = column(
        "1", "level of the loads that has its peak there", along="place", default=None
    )
    resonance_frequency_hz: FloatArray | None = column("Hz", "frequency of that peak", along="place", default=None)
    cycle_amplitude: FloatArray | None = column(
        "m", "amplitudes at which the damping is zero: limit cycles", along="cycle", default=None
    )
    passage_hz_per_s: FloatArray | None = column("Hz/s", "rates of the passages", along="rate", default=None)
    levels: tuple[SynthesisLevel, ...] = rows("level")

    @property
    def direct(self) -> bool:
        """Whether levels were solved directly."""
        return any(level.direct_error is not None for level in self.levels)

    @property
    def passages(self) -> list[tuple[SynthesisLevel, Passage]]:
        """The passages that began, each with its level."""
        return [(level, passage) for level in self.levels for passage in self._passages_at(level)]

    def _passages_at(self, level: SynthesisLevel) -> Iterator[Passage]:
        rates, peak, omega, share = (
            self.passage_hz_per_s,
            level.passage_peak,
            level.passage_peak_omega,
            level.passage_share,
        )
        if rates is None or peak is None or omega is None or share is None:
            return
        for i in np.flatnonzero(np.isfinite(peak)):
            own = (rates[i], peak[i], omega[i] / HZ, share[i], level.passage_change[i])
            yield Passage(*map(float, own))


def answer(solved: Solved) -> ModalSynthesis:
    """Return the record of a case from the levels and notes of its job."""
    notes = solved.notes
    found: dict[str, Any] = {"output": str(notes.get("model", {}).get("output", ""))}
    if "design" in notes:
        found |= _of_design(notes["design"])
    levels: Sequence[SynthesisLevel] = solved.records
    if levels:
        direct = any(level.direct_omega.size for level in levels)
        found["levels"] = tuple(_judged(level, direct=direct) for level in levels)
        found["passage_hz_per_s"] = np.asarray(solved.case.settings.modal_synthesis.passage_hz_per_s)
    return ModalSynthesis(**found)


def _of_design(note: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "mode": int(note["mode"]),
        "mode_frequency_hz": float(note["mode_omega"]) / HZ,
        "mode_damping_ratio": float(note["mode_ratio"]),
        "homogeneous": bool(note["homogeneous"]),
        "mode_seconds": float(note["seconds"]),
        "backbone_amplitude": note["amplitude"],
        "backbone_frequency_hz": note["omega"] / HZ,
        "backbone_damping_ratio": note["ratio"],
        "resonance_level": note["level"],
        "resonance_frequency_hz": note["peak_omega"] / HZ,
        "cycle_amplitude": note["cycles"],
    }


def _judged(level: SynthesisLevel, *, direct: bool) -> SynthesisLevel:
    """Return a level with the numbers derived from its curves; without direct solutions, these numbers are None."""
    low, high = _around_peak(level)
    found: dict[str, Any] = {"alone_from": low, "alone_to": high, **_of_passages(level)}
    if direct:
        off, where = _along_error(level)
        assert level.direct_peak is not None
        error = float(np.divide(level.peak, level.direct_peak) - 1.0)
        found |= {"direct_error": error, "along_error": off, "along_error_omega": where}
    else:
        found |= {"direct_peak": None, "direct_peak_omega": None, "direct_seconds": None}
    return replace(level, **found)


def _of_passages(level: SynthesisLevel) -> dict[str, FloatArray]:
    """Return the peak of each passage, its frequency and its share of the steady peak."""
    omega, amplitude = level.passage_omega, level.passage_amplitude
    top = np.argmax(np.where(np.isfinite(amplitude), amplitude, -np.inf), axis=1)[:, None]
    peak, at = (np.take_along_axis(v, top, axis=1)[:, 0] for v in (amplitude, omega))
    return {"passage_peak": peak, "passage_peak_omega": at, "passage_share": peak / level.peak}


def _around_peak(level: SynthesisLevel) -> tuple[float, float]:
    """Return the range of frequencies, rad/s, around the peak in which the mode answers alone; NaN if not even the peak."""
    held = _around(level)
    return (float(level.omega[held].min()), float(level.omega[held].max())) if held.any() else NOTHING


def _along_error(level: SynthesisLevel) -> tuple[float, float]:
    """Return the largest relative difference from the direct solution, and its frequency, rad/s.

    The range around the peak counts in which the mode answers alone. Each direct point is compared with the nearest
    synthesised motion at its frequency.
    """
    held = _around(level)
    both = held[:-1] & held[1:] & (level.curve[:-1] == level.curve[1:])
    worst, where = NOTHING
    for omega, amplitude in zip(level.direct_omega, level.direct_amplitude, strict=True):
        low, high = level.omega[:-1], level.omega[1:]
        at = np.flatnonzero(both & ((low - omega) * (high - omega) <= 0.0) & (low != high))
        if not (at.size and amplitude > 0.0):
            continue
        share = (omega - low[at]) / (high[at] - low[at])
        own = np.exp((1.0 - share) * np.log(level.amplitude[at]) + share * np.log(level.amplitude[at + 1]))
        off = own / amplitude - 1.0
        nearest = float(off[int(np.argmin(np.abs(off)))])
        if not abs(nearest) <= abs(worst):
            worst, where = nearest, float(omega)
    return worst, where


def _around(level: SynthesisLevel) -> BoolArray:
    """Return the points along the curve on both sides of the peak, as far as the mode answers alone."""
    held = np.zeros(level.omega.size, dtype=bool)
    if not (level.omega.size and np.isfinite(level.peak)):
        return held
    at = _nearest(level)
    alone = level.alone == 1
    if not alone[at]:
        return held
    off = np.flatnonzero(~alone | (level.curve != level.curve[at]))
    first = int(off[off < at].max(initial=-1)) + 1
    last = int(off[off > at].min(initial=alone.size))
    held[first:last] = True
    return held


def _nearest(level: SynthesisLevel) -> int:
    away: FloatArray = np.abs(np.log(level.amplitude / level.peak)) + np.abs(level.omega / level.peak_omega - 1.0)
    return int(np.argmin(away))
