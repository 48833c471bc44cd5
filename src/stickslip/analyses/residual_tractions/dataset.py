"""The node ``/residual_tractions`` of a result."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, described, of_cases
from stickslip.analyses.residual_tractions.records import Stage, TractionRecord
from stickslip.analyses.residual_tractions.verdicts import case_verdicts
from stickslip.study.analysis import Solved
from stickslip.units import HZ

ABOUT = {
    "output": ("", "1", "output whose amplitude is bounded"),
    "excitation_n": ("", "N", "amplitude of the harmonic force"),
    "harmonics": ("", "1", "highest harmonic of the motions"),
    "frequency_hz": ("traction_point", "Hz", "frequency"),
    "reference_amplitude": ("traction_point", "m", "amplitude from the model's own start"),
    "least_amplitude": ("traction_point", "m", "smallest amplitude over all residual tractions"),
    "most_amplitude": ("traction_point", "m", "largest amplitude over all residual tractions"),
    "stuck_springs": (
        "traction_point bound",
        "1",
        "tangential springs that stick all the time: own start, smallest, largest amplitude",
    ),
    "solves": ("traction_point", "1", "motions that were solved for"),
    "failures": ("traction_point", "1", "starts from which no motion was found"),
    "branches": (
        "traction_point",
        "1",
        "motions from the model's own start that sweeps up and down met; the bounds hold them all",
    ),
    "resonance_hz": ("bound", "Hz", "where the curve of each bound is highest: own start, smallest, largest amplitude"),
    "resonance_amplitude": ("bound", "m", "its height there"),
    "harmonics_error": (
        "traction_point bound",
        "1",
        "relative change of the output that more harmonics are predicted to make, phase included; 0 where nothing acts on them, NaN where nobody can tell",
    ),
    "resonance_harmonics_error": ("bound", "1", "the same at the resonance of each bound"),
    "resonance_inside": ("bound", "1", "1 where that is within the range, 0 at its ends"),
    "spring": ("traction_spring", "1", "contact of each spring that has a start"),
    "multiplier": (
        "bound traction_spring tangent",
        "1",
        "traction at t = 0 over the friction limit there, at the resonance of each bound; NaN: it does not stick",
    ),
    "resolved_amplitude": ("end", "m", "smallest and largest resonance solved again, forces marched over samples"),
    "time_amplitude": ("end", "m", "smallest and largest resonance followed in time from their tractions"),
    "time_status": ("end", "1", "how that ended; empty where it was not followed"),
    "confirmed": ("end", "1", "1 where both agree with the bound"),
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the bounds of all cases."""
    return of_cases(solved, _of_case, case_verdicts, _lost)


def _lost(case: Variables) -> int:
    known = case.get("reference_amplitude")
    return 0 if known is None else int(np.count_nonzero(np.isnan(known.values)))


def _of_case(solved: Solved) -> Variables:
    records: Sequence[TractionRecord] = solved.records
    model = solved.notes.get("model", {})
    values: dict[str, Any] = {name: model[name] for name in ("output", "excitation_n", "harmonics") if name in model}
    points = [r for r in records if r.stage == "point"]
    if points:
        # the resonances belong to the curves, or these would pass below them
        every = {r.omega: r for r in (*points, *(r for r in records if r.stage != "point"))}
        values |= _of_points([every[omega] for omega in sorted(every)])
    by_stage = {r.stage: r for r in records}
    if points and {"least", "most"} <= set(by_stage):
        values |= _of_resonance(points, by_stage)
    if "confirmed" in solved.notes:
        values |= dict(solved.notes["confirmed"])
    return described(ABOUT, values, model)


def _of_points(points: Sequence[TractionRecord]) -> dict[str, Any]:
    amplitude = np.array([r.amplitude for r in points])
    stuck = np.array([np.isfinite(r.multipliers).sum(axis=(1, 2)) for r in points])
    return {
        "frequency_hz": np.array([r.omega for r in points]) / HZ,
        "reference_amplitude": amplitude[:, 0],
        "least_amplitude": amplitude[:, 1],
        "most_amplitude": amplitude[:, 2],
        "stuck_springs": stuck,
        "solves": np.array([r.solves for r in points]),
        "failures": np.array([r.failures for r in points]),
        "branches": np.array([r.branches for r in points]),
        "harmonics_error": np.array([r.errors for r in points]),
    }


def _of_resonance(points: Sequence[TractionRecord], by_stage: Mapping[Stage, TractionRecord]) -> dict[str, Any]:
    known = [r for r in points if np.isfinite(r.amplitude[0])]
    every = [*known, by_stage["least"], by_stage["most"]]
    own = max(every, key=lambda r: float(r.amplitude[0]))
    tops = [own, by_stage["least"], by_stage["most"]]
    ends = known[0].omega, known[-1].omega
    return {
        "resonance_hz": np.array([r.omega for r in tops]) / HZ,
        "resonance_amplitude": np.array([r.amplitude[k] for k, r in enumerate(tops)]),
        "resonance_harmonics_error": np.array([r.errors[k] for k, r in enumerate(tops)]),
        "resonance_inside": np.array([int(r.omega not in ends) for r in tops]),
        "spring": np.array(json.loads(own.springs), dtype=str),
        "multiplier": np.array([r.multipliers[k] for k, r in enumerate(tops)]),
    }
