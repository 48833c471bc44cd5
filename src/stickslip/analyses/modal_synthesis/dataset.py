"""The node ``/modal_synthesis`` of a result."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, described, each, of_cases, rows
from stickslip.analyses.modal_synthesis.records import SynthesisLevel
from stickslip.analyses.modal_synthesis.verdicts import case_verdicts
from stickslip.arrays import BoolArray, FloatArray
from stickslip.study.analysis import Solved
from stickslip.units import HZ

NOTHING = (np.nan, np.nan)


ABOUT = {
    "output": ("", "1", "output whose amplitude is told"),
    "mode": ("", "1", "number of the mode, by frequency with contacts stuck"),
    "mode_frequency_hz": ("", "Hz", "its frequency with contacts stuck"),
    "mode_damping_ratio": ("", "1", "its damping ratio with contacts stuck"),
    "homogeneous": (
        "",
        "1",
        "1 where all contact forces double with all displacements: static and vibration loads then scale together",
    ),
    "mode_seconds": ("", "s", "time of the processor for the nonlinear mode"),
    "backbone_amplitude": ("place", "m", "amplitude of the output along the nonlinear mode"),
    "backbone_frequency_hz": ("place", "Hz", "its frequency"),
    "backbone_damping_ratio": ("place", "1", "its damping ratio"),
    "resonance_level": ("place", "1", "level of the loads that has its peak there"),
    "resonance_frequency_hz": ("place", "Hz", "frequency of that peak"),
    "cycle_amplitude": ("cycle", "m", "amplitudes at which the damping is zero: limit cycles"),
    "level": ("level", "1", "factor on the harmonic loads"),
    "answer": ("level", "1", "trusted, doubtful, refused or beyond"),
    "why": ("level", "1", "what that rests on"),
    "peak_amplitude": (
        "level",
        "m",
        "largest amplitude of the output in the first harmonic, on the curve that a sweep meets",
    ),
    "detached_peak_amplitude": ("level", "m", "the same of the detached curves, which a sweep does not meet"),
    "detached_peak_frequency_hz": ("level", "Hz", "its frequency"),
    "peak_frequency_hz": ("level", "Hz", "its frequency"),
    "foreign": ("level", "1", "relative error of the peak that the other modes make, about"),
    "others_in_output": ("level", "1", "motion of the other modes over that of the mode, at the output"),
    "others_in_gaps": ("level", "1", "the same in the gaps of the contacts"),
    "next_frequency": ("level", "1", "relative distance of the next frequency"),
    "overlap": ("level", "1", "damping ratio over that distance"),
    "growth": ("level", "1", "relative growth of the peak with the level: 1 where nothing slips"),
    "higher_harmonics": ("level", "1", "higher harmonics over the first, at the output"),
    "resolved": ("level", "1", "relative change of the peak if every second point of the nonlinear mode is left out"),
    "by_harmonics": (
        "level",
        "1",
        "relative change of frequency or damping ratio of the nonlinear mode at the peak that more harmonics are foretold to make",
    ),
    "detached": ("level", "1", "number of curves that do not hang together with small amplitudes"),
    "seconds": ("level", "s", "time of the processor for the response"),
    "frequency_hz": ("level point", "Hz", "frequency of the response"),
    "amplitude": ("level point", "m", "amplitude of the output in the first harmonic"),
    "curve": ("level point", "1", "0: hangs together with small amplitudes; others are detached"),
    "stable": ("level point", "1", "1 where slow changes of this mode die out"),
    "others": ("level point", "1", "motion of the other modes over that of the mode, at the output or in the gaps"),
    "alone": (
        "level point",
        "1",
        "1 where the mode answers alone: nothing slips, or the others change motion and amplitude by at most 5 %",
    ),
    "alone_from_hz": (
        "level",
        "Hz",
        "lowest frequency around the peak at which the mode answers alone; NaN where it does not at the peak",
    ),
    "alone_to_hz": ("level", "Hz", "highest such frequency"),
    "direct_frequency_hz": ("level direct_point", "Hz", "frequency of the direct solution"),
    "direct_amplitude": ("level direct_point", "m", "amplitude of the output in the first harmonic, solved directly"),
    "direct_peak_amplitude": ("level", "m", "peak of the direct solution"),
    "direct_peak_frequency_hz": ("level", "Hz", "its frequency"),
    "direct_error": ("level", "1", "synthesised peak over the direct one, less one"),
    "along_error": (
        "level",
        "1",
        "largest difference of synthesised and direct curve, over the direct one, where the mode answers alone around the peak",
    ),
    "along_error_hz": ("level", "Hz", "its frequency"),
    "direct_seconds": ("level", "s", "time of the processor for the direct solution"),
    "passage_hz_per_s": ("rate", "Hz/s", "rates of the passages"),
    "passage_frequency_hz": ("level rate moment", "Hz", "frequency of the load during a passage"),
    "passage_amplitude": ("level rate moment", "m", "amplitude of the output then"),
    "passage_peak_amplitude": ("level rate", "m", "its largest"),
    "passage_peak_frequency_hz": ("level rate", "Hz", "frequency of the load then"),
    "passage_share": ("level rate", "1", "that amplitude over the steady peak"),
    "passage_finished": ("level rate", "1", "1 where a passage came to its end"),
    "passage_change": (
        "level rate",
        "1",
        "relative change of the amplitude in a radian of the vibration, while it is above half its peak",
    ),
}
PLAIN = {
    "level": "level",
    "answer": "answer",
    "why": "why",
    "peak_amplitude": "peak",
    "foreign": "foreign",
    "others_in_output": "output",
    "others_in_gaps": "gaps",
    "next_frequency": "distance",
    "overlap": "overlap",
    "growth": "growth",
    "higher_harmonics": "harmonics",
    "resolved": "resolved",
    "by_harmonics": "changed",
    "detached": "detached",
    "seconds": "seconds",
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the responses of all cases."""
    return of_cases(solved, _of_case, case_verdicts)


def _of_case(solved: Solved) -> Variables:
    levels: Sequence[SynthesisLevel] = solved.records
    model = solved.notes.get("model", {})
    values: dict[str, Any] = {"output": str(model.get("output", ""))}
    if "design" in solved.notes:
        own = solved.notes["design"]
        values |= {
            "mode": int(own["mode"]),
            "mode_frequency_hz": float(own["mode_omega"]) / HZ,
            "mode_damping_ratio": float(own["mode_ratio"]),
            "homogeneous": int(own["homogeneous"]),
            "mode_seconds": float(own["seconds"]),
            "backbone_amplitude": own["amplitude"],
            "backbone_frequency_hz": own["omega"] / HZ,
            "backbone_damping_ratio": own["ratio"],
            "resonance_level": own["level"],
            "resonance_frequency_hz": own["peak_omega"] / HZ,
            "cycle_amplitude": own["cycles"],
        }
    if levels:
        values |= _of_levels(levels, np.asarray(solved.case.settings.modal_synthesis.passage_hz_per_s))
    return described(ABOUT, values, model)


def _of_levels(levels: Sequence[SynthesisLevel], rates: FloatArray) -> dict[str, Any]:
    values = {name: each(levels, own) for name, own in PLAIN.items()} | {
        "peak_frequency_hz": each(levels, "peak_omega") / HZ,
        "detached_peak_amplitude": each(levels, "detached_peak"),
        "detached_peak_frequency_hz": each(levels, "detached_peak_omega") / HZ,
        "frequency_hz": rows(levels, "omega") / HZ,
        "amplitude": rows(levels, "amplitude"),
        "curve": rows(levels, "curve", -1.0).astype(np.int64),
        "stable": rows(levels, "stable", -1.0).astype(np.int64),
        "others": rows(levels, "others"),
        "alone": rows(levels, "alone", -1.0).astype(np.int64),
        "alone_from_hz": np.array([around_peak(one)[0] for one in levels]) / HZ,
        "alone_to_hz": np.array([around_peak(one)[1] for one in levels]) / HZ,
    }
    if any(one.direct_omega.size for one in levels):
        values |= {
            "direct_frequency_hz": rows(levels, "direct_omega") / HZ,
            "direct_amplitude": rows(levels, "direct_amplitude"),
            "direct_peak_amplitude": each(levels, "direct_peak"),
            "direct_peak_frequency_hz": each(levels, "direct_peak_omega") / HZ,
            "direct_error": each(levels, "peak") / each(levels, "direct_peak") - 1.0,
            "along_error": np.array([along_error(one)[0] for one in levels]),
            "along_error_hz": np.array([along_error(one)[1] for one in levels]) / HZ,
            "direct_seconds": each(levels, "direct_seconds"),
        }
    if rates.size:
        values |= _of_passages(levels, rates)
    return values


def _of_passages(levels: Sequence[SynthesisLevel], rates: FloatArray) -> dict[str, Any]:
    omega, amplitude = (np.array([getattr(one, n) for one in levels]) for n in ("passage_omega", "passage_amplitude"))
    known = np.isfinite(amplitude)
    top = np.argmax(np.where(known, amplitude, -np.inf), axis=2)[:, :, None]
    peak, at = (np.take_along_axis(v, top, axis=2)[:, :, 0] for v in (amplitude, omega))
    return {
        "passage_hz_per_s": rates,
        "passage_frequency_hz": omega / HZ,
        "passage_amplitude": amplitude,
        "passage_peak_amplitude": peak,
        "passage_peak_frequency_hz": at / HZ,
        "passage_share": peak / np.array([one.peak for one in levels])[:, None],
        "passage_finished": np.array([one.passage_finished for one in levels]),
        "passage_change": np.array([one.passage_change for one in levels]),
    }


def around_peak(level: SynthesisLevel) -> tuple[float, float]:
    """Return the first and last frequency, rad/s, around the peak between which the mode answers alone; NaN where it does not at the peak."""
    held = _around(level)
    return (float(level.omega[held].min()), float(level.omega[held].max())) if held.any() else NOTHING


def along_error(level: SynthesisLevel) -> tuple[float, float]:
    """Return the largest relative difference from the direct solution around the peak where the mode answers alone, and its frequency, rad/s.

    Each direct point is held against the synthesised motion of its frequency that is nearest.
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
    """Return the points next to the peak and along the curve from there, as far as the mode answers alone."""
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
