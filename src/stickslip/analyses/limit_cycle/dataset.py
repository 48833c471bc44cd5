"""The node ``/limit_cycle`` of a result."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, described, each, of_cases, rows
from stickslip.analyses.limit_cycle.records import CycleBranch
from stickslip.analyses.limit_cycle.verdicts import case_verdicts
from stickslip.analyses.vibrating import KEPT, kept_motions
from stickslip.arrays import FloatArray
from stickslip.reduction.waves import NO_WAVE, wave
from stickslip.study.analysis import Solved
from stickslip.units import HZ

ABOUT = {
    "output": ("", "1", "output whose amplitude is given"),
    "linear_wave": ("linear", "1", "wave number of the modes looked at; -1 for a single structure"),
    "linear_frequency_hz": ("linear mode", "Hz", "frequency of the modes with contacts stuck"),
    "linear_damping_ratio": ("linear mode", "1", "their damping ratio; negative: they grow"),
    "wave_number": ("branch", "1", "wave number of the modes followed; -1 for a single structure"),
    "nodal_diameter": ("branch", "1", "its nodal diameters; -1 for a single structure"),
    "mode": ("branch", "1", "number of the mode, by frequency"),
    "mode_frequency_hz": ("branch", "Hz", "frequency with contacts stuck"),
    "mode_damping_ratio": ("branch", "1", "damping ratio with contacts stuck"),
    "slip_amplitude": ("branch", "m", "amplitude at which slip begins"),
    "largest_damping_ratio": ("branch", "1", "largest damping ratio over the amplitude"),
    "largest_damping_amplitude": ("branch", "m", "amplitude there"),
    "problem": ("branch", "1", "why there is no curve"),
    "lost_cycles": ("branch", "1", "zeros of the damping that were not solved as limit cycles"),
    "amplitude": ("branch point", "m", "amplitude of the output in the first harmonic"),
    "frequency_hz": ("branch point", "Hz", "frequency of the motion"),
    "damping_ratio": ("branch point", "1", "damping ratio of the motion; negative: it grows"),
    "cycle_branch": ("cycle", "1", "index of the branch of a limit cycle"),
    "cycle_amplitude": ("cycle", "m", "its amplitude"),
    "cycle_frequency_hz": ("cycle", "Hz", "its frequency"),
    "cycle_slope": (
        "cycle",
        "1",
        "growth of the damping ratio with the logarithm of the amplitude; positive: attracting",
    ),
    "cycle_harmonics": ("cycle", "1", "its highest harmonic"),
    "cycle_change": ("cycle", "1", "relative change by the last raise of the harmonics"),
    "cycle_enough": ("cycle", "1", "1 where the harmonics are enough"),
    "cycle_stability": ("cycle", "1", "stable, unstable, undecided or not examined"),
    "cycle_reason": ("cycle", "1", "what that rests on"),
    "cycle_multiplier": ("cycle", "1", "modulus of the multiplier that decides"),
    "cycle_multiplier_error": ("cycle", "1", "its error"),
    "cycle_along": ("cycle", "1", "distance of the multiplier along the motion from 1"),
    "cycle_growing_wave": ("cycle", "1", "wave number of the disturbance that decides; -1 where unknown"),
    "cycle_growing_frequency_hz": ("cycle", "Hz", "its frequency"),
    "cycle_time_amplitude": ("cycle", "m", "amplitude that time integration goes to"),
    "cycle_time_frequency_hz": ("cycle", "Hz", "its frequency"),
    **KEPT,
    "retained_displacement": (
        "cycle harmonic coordinate part",
        "m",
        "its motion in each harmonic: the real and the imaginary part",
    ),
    "output_displacement": ("cycle harmonic reported part", "m", "the same of the outputs"),
    "time": ("window", "s", "time since the mixed start of all unstable waves"),
    "wave_amplitude": ("window wave", "m", "amplitude of each wave number at the output"),
    "outcome": ("", "1", "what became of the mixed start"),
    "outcome_missing": ("", "1", "why there is no mixed start; empty where there is one or it was not asked for"),
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the limit cycles of all cases."""
    return of_cases(solved, _of_case, case_verdicts, _lost)


def _of_case(solved: Solved) -> Variables:
    branches: Sequence[CycleBranch] = solved.records
    notes = solved.notes
    model = notes.get("model", {})
    sectors = int(model.get("sectors", 1))
    values: dict[str, Any] = {"output": str(model.get("output", ""))}
    if "linear" in notes:
        linear = notes["linear"]
        values |= {
            "linear_wave": linear["wave"],
            "linear_frequency_hz": linear["hertz"],
            "linear_damping_ratio": linear["ratio"],
        }
    if branches:
        values |= _of_branches(branches, sectors)
        values |= _of_cycles(branches)
        if "coordinates" in notes:
            values |= kept_motions(_motions(branches), notes["coordinates"])
        values |= _in_time(branches, notes)
    return described(ABOUT, values, model)


def _of_branches(branches: Sequence[CycleBranch], sectors: int) -> dict[str, Any]:
    waves = each(branches, "wave_number")
    return {
        "wave_number": waves,
        "nodal_diameter": np.array([wave(int(k), sectors).nodal_diameter if k >= 0 else NO_WAVE for k in waves]),
        "mode": each(branches, "mode"),
        "mode_frequency_hz": each(branches, "omega") / HZ,
        "mode_damping_ratio": each(branches, "ratio"),
        "slip_amplitude": each(branches, "slips"),
        "largest_damping_ratio": each(branches, "largest_ratio"),
        "largest_damping_amplitude": each(branches, "largest_at"),
        "problem": each(branches, "problem"),
        "lost_cycles": each(branches, "lost"),
        "amplitude": rows(branches, "amplitude"),
        "frequency_hz": rows(branches, "motion_omega") / HZ,
        "damping_ratio": rows(branches, "motion_ratio"),
    }


def _of_cycles(branches: Sequence[CycleBranch]) -> dict[str, Any]:
    def every(name: str) -> Any:
        return np.concatenate([getattr(b, name) for b in branches])

    def texts(name: str) -> Any:
        return np.array([t for b in branches for t in json.loads(getattr(b, name))], dtype=str)

    which = np.repeat(np.arange(len(branches)), [b.cycle_amplitude.size for b in branches])
    return {
        "cycle_branch": which,
        "cycle_amplitude": every("cycle_amplitude"),
        "cycle_frequency_hz": every("cycle_omega") / HZ,
        "cycle_slope": every("slope"),
        "cycle_harmonics": every("order"),
        "cycle_change": every("change"),
        "cycle_enough": every("enough"),
        "cycle_stability": texts("stable"),
        "cycle_reason": texts("reason"),
        "cycle_multiplier": every("multiplier"),
        "cycle_multiplier_error": every("error"),
        "cycle_along": every("along"),
        "cycle_growing_wave": every("grows_as"),
        "cycle_growing_frequency_hz": every("grows_omega") / HZ,
    }


def _motions(branches: Sequence[CycleBranch]) -> FloatArray:
    """Return (cycles, most harmonics + 1, n, 2) the motions of all limit cycles."""
    every = [b.coefficients for b in branches if len(b.cycle_amplitude)]
    if not every:
        return np.zeros((0, 1, 0, 2))
    out = np.zeros((sum(map(len, every)), max(c.shape[1] for c in every), *every[0].shape[2:]))
    first = 0
    for own in every:
        out[first : first + len(own), : own.shape[1]] = own
        first += len(own)
    return out


def _in_time(branches: Sequence[CycleBranch], notes: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    found = [notes.get(f"in_time.{i}") for i in range(len(branches))]
    values: dict[str, Any] = {}
    if all(own is not None for own in found):
        for name, key, unit in (("cycle_time_amplitude", "amplitude", 1.0), ("cycle_time_frequency_hz", "omega", HZ)):
            values[name] = np.concatenate([np.atleast_1d(own[key]) / unit for own in found if own])
    if "competition" in notes:
        own = notes["competition"]
        values |= {
            "time": own["time"],
            "wave_amplitude": own["amplitude"],
            "outcome": str(own["sentence"]),
            "outcome_missing": str(own["left_out"]),
        }
    return values


def _lost(case: Variables) -> int:
    if "amplitude" not in case:
        return 0
    wanted, found = (np.isfinite(case[name].values) for name in ("amplitude", "damping_ratio"))
    return int(np.count_nonzero(wanted & ~found))
