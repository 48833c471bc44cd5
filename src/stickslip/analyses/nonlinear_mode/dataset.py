"""The node ``/nonlinear_mode`` of a result."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, described, each, of_cases, rows
from stickslip.analyses.columns import described as described_columns
from stickslip.analyses.nonlinear_mode.records import ModeBranch, branches_of
from stickslip.analyses.nonlinear_mode.verdicts import case_verdicts
from stickslip.analyses.vibrating import KeptMotions, kept_motions
from stickslip.arrays import FloatArray
from stickslip.reduction.waves import NO_WAVE, wave
from stickslip.study.analysis import Solved
from stickslip.units import HZ

ABOUT = {
    "output": ("", "1", "output whose amplitude is told"),
    "wave_number": ("branch", "1", "wave number of the modes; -1 for a single structure"),
    "nodal_diameter": ("branch", "1", "its nodal diameters; -1 for a single structure"),
    "mode": ("branch", "1", "number of the mode, by frequency with contacts stuck"),
    "mode_frequency_hz": ("branch", "Hz", "frequency with contacts stuck"),
    "mode_damping_ratio": ("branch", "1", "damping ratio with contacts stuck"),
    "accuracy": ("branch", "1", "relative change by more harmonics that was asked for"),
    "end": ("branch", "1", "how the mode ends"),
    "problem": ("branch", "1", "why there is none"),
    "gross_slip_amplitude": (
        "branch",
        "m",
        "amplitude from which on all contacts, and all their sliders, slip or open at some time",
    ),
    "largest_damping_ratio": ("branch", "1", "largest damping ratio"),
    "largest_damping_amplitude": ("branch", "m", "amplitude there"),
    "amplitude": ("branch point", "m", "amplitude of the output in the first harmonic"),
    "frequency_hz": ("branch point", "Hz", "frequency of the motion"),
    "damping_ratio": ("branch point", "1", "damping ratio of the motion; negative: it grows"),
    "modal_amplitude": ("branch point", "kg^0.5 m", "root of X^H M X of the first harmonic"),
    "energy": ("branch point", "J", "twice the mean kinetic energy of all harmonics, of a wheel of one sector"),
    "harmonics": ("branch point", "1", "highest harmonic"),
    "status": ("branch point", "1", "how the solver ended: 0 is a solution"),
    "slipping": (
        "branch point",
        "1",
        "share of the contact points that slip or open at some time; of a contact of several sliders the share that slips",
    ),
    "open_for": ("branch point", "1", "largest share of the period for which a contact point is open"),
    "change": (
        "branch point",
        "1",
        "relative change of frequency or damping ratio that more harmonics are foretold to make; with the most harmonics that of fewer; NaN with one set alone",
    ),
    **{name: (" ".join(dims), unit, about) for name, dims, unit, about in described_columns(KeptMotions)},
    "retained_displacement": (
        "branch point harmonic coordinate part",
        "m",
        "the motion in each harmonic: the real and the imaginary part",
    ),
    "output_displacement": ("branch point harmonic reported part", "m", "the same of the outputs"),
    "concept": ("", "1", "which motions the modes are made of"),
}
POINTS = {
    "amplitude": "amplitude",
    "damping_ratio": "motion_ratio",
    "modal_amplitude": "modal_amplitude",
    "energy": "energy",
    "slipping": "slipping",
    "open_for": "open_for",
    "change": "change",
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the modes of all cases."""
    return of_cases(solved, _of_case, case_verdicts, _lost)


def _lost(case: Variables) -> int:
    return int(np.count_nonzero(case["status"].values > 0)) if "status" in case else 0


def _of_case(solved: Solved) -> Variables:
    branches = branches_of(solved.records)
    model = solved.notes.get("model", {})
    sectors = int(model.get("sectors", 1))
    values: dict[str, Any] = {"output": str(model.get("output", ""))}
    if branches:
        values |= _of_branches(branches, sectors)
        if "coordinates" in solved.notes:
            known = solved.notes["coordinates"]
            values |= {"concept": str(known["concept"])}
            values |= kept_motions(_motions(branches), known)
    return described(ABOUT, values, model)


def _motions(branches: Sequence[ModeBranch]) -> FloatArray:
    """Return (branches, most points, most harmonics, n, 2) the motions of all modes, NaN where there is none."""
    most = np.max([b.motions.shape for b in branches], axis=0)
    out = np.full((len(branches), *most), np.nan)
    for own, branch in zip(out, branches, strict=True):
        points, harmonics, n, _ = branch.motions.shape
        own[:points, :, :n] = 0.0
        own[:points, :harmonics, :n] = branch.motions
    return out


def _of_branches(branches: Sequence[ModeBranch], sectors: int) -> dict[str, Any]:
    waves, ratios, amplitudes = (
        each(branches, "wave_number"),
        rows(branches, "motion_ratio"),
        rows(branches, "amplitude"),
    )
    top = [int(np.nanargmax(r)) if np.any(np.isfinite(r)) else -1 for r in ratios]
    gross = rows(branches, "slipping") == 1.0
    return {
        "wave_number": waves,
        "nodal_diameter": np.array([wave(int(k), sectors).nodal_diameter if k >= 0 else NO_WAVE for k in waves]),
        "mode": each(branches, "mode"),
        "mode_frequency_hz": each(branches, "omega") / HZ,
        "mode_damping_ratio": each(branches, "ratio"),
        "accuracy": each(branches, "tolerance"),
        "end": each(branches, "end"),
        "problem": each(branches, "problem"),
        "gross_slip_amplitude": np.array(
            [a[g][0] if np.any(g) else np.nan for a, g in zip(amplitudes, gross, strict=True)]
        ),
        "largest_damping_ratio": np.array([r[i] if i >= 0 else np.nan for r, i in zip(ratios, top, strict=True)]),
        "largest_damping_amplitude": np.array(
            [a[i] if i >= 0 else np.nan for a, i in zip(amplitudes, top, strict=True)]
        ),
        "frequency_hz": rows(branches, "motion_omega") / HZ,
        "harmonics": rows(branches, "order", -1.0).astype(np.int64),
        "status": rows(branches, "status", -1.0).astype(np.int64),
        **{name: rows(branches, own) for name, own in POINTS.items()},
    }
