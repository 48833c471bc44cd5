"""The node ``/nonlinear_mode`` of a result."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray
from stickslip.reduction.waves import wave
from stickslip.study.analyses.analysis import Solved
from stickslip.study.analyses.backbones.records import ModeBranch
from stickslip.study.analyses.backbones.words import case_verdicts
from stickslip.study.analyses.verdict import ATTRIBUTE, of_all_cases, to_json
from stickslip.study.analyses.vibrating import ONE
from stickslip.study.analyses.waves.about import told
from stickslip.study.keep.netcdf import stacked, variable
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
    "gross_slip_amplitude": ("branch", "m", "amplitude from which on all contacts, and all their sliders, slip or open at some time"),
    "largest_damping_ratio": ("branch", "1", "largest damping ratio"),
    "largest_damping_amplitude": ("branch", "m", "amplitude there"),
    "amplitude": ("branch point", "m", "amplitude of the output in the first harmonic"),
    "frequency_hz": ("branch point", "Hz", "frequency of the motion"),
    "damping_ratio": ("branch point", "1", "damping ratio of the motion; negative: it grows"),
    "modal_amplitude": ("branch point", "kg^0.5 m", "root of X^H M X of the first harmonic"),
    "energy": ("branch point", "J", "twice the mean kinetic energy of all harmonics, of a wheel of one sector"),
    "harmonics": ("branch point", "1", "highest harmonic"),
    "status": ("branch point", "1", "how the solver ended: 0 is a solution"),
    "slipping": ("branch point", "1", "share of the contact points that slip or open at some time; of a contact of several sliders the share that slips"),
    "open_for": ("branch point", "1", "largest share of the period for which a contact point is open"),
    "change": ("branch point", "1", "relative change of frequency or damping ratio that more harmonics are foretold to make; with the most harmonics that of fewer; NaN with one set alone"),
}  # fmt: skip
POINTS = {
    "amplitude": "amplitude", "damping_ratio": "motion_ratio", "modal_amplitude": "modal_amplitude", "energy": "energy",
    "slipping": "slipping", "open_for": "open_for", "change": "change",
}  # fmt: skip


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the modes of all cases."""
    cases = [_of_case(one) for one in solved]
    labels = [one.case.label for one in solved]
    doubts = [v for label, own in zip(labels, cases, strict=True) for v in case_verdicts(label, own)]  # fmt: skip
    failed = sum(int(np.count_nonzero(own["status"].values > 0)) for own in cases if "status" in own)  # fmt: skip
    attributes = {ATTRIBUTE: to_json(of_all_cases(doubts, labels)), "failed": failed}
    return xr.Dataset(stacked(cases), attrs=attributes)


def _of_case(solved: Solved) -> dict[str, xr.Variable]:
    branches: Sequence[ModeBranch] = solved.records
    model = solved.notes.get("model", {})
    sectors = int(model.get("sectors", 1))
    values: dict[str, Any] = {"output": str(model.get("output", ""))}
    if branches:
        values |= _of_branches(branches, sectors)
    known = {name: value for name, value in values.items() if np.size(value) > 0}
    return told(model) | {
        name: variable(ABOUT[name][0], value, *ABOUT[name][1:]) for name, value in known.items()
    }


def _of_branches(branches: Sequence[ModeBranch], sectors: int) -> dict[str, Any]:
    most = max(b.amplitude.size for b in branches)

    def rows(name: str, missing: float = np.nan) -> FloatArray:
        out = np.full((len(branches), most), missing)
        for row, branch in zip(out, branches, strict=True):
            own = getattr(branch, name)
            row[: own.size] = own
        return out

    def each(name: str) -> Any:
        return np.array([getattr(b, name) for b in branches])

    waves, ratios, amplitudes = each("wave_number"), rows("motion_ratio"), rows("amplitude")
    top = [int(np.nanargmax(r)) if np.any(np.isfinite(r)) else -1 for r in ratios]
    gross = rows("slipping") == 1.0
    return {
        "wave_number": waves,
        "nodal_diameter": np.array([wave(int(k), sectors).nodal_diameter if k >= 0 else ONE for k in waves]),
        "mode": each("mode"),
        "mode_frequency_hz": each("omega") / HZ,
        "mode_damping_ratio": each("ratio"),
        "accuracy": each("tolerance"),
        "end": each("end"),
        "problem": each("problem"),
        "gross_slip_amplitude": np.array([a[g][0] if np.any(g) else np.nan for a, g in zip(amplitudes, gross, strict=True)]),
        "largest_damping_ratio": np.array([r[i] if i >= 0 else np.nan for r, i in zip(ratios, top, strict=True)]),
        "largest_damping_amplitude": np.array([a[i] if i >= 0 else np.nan for a, i in zip(amplitudes, top, strict=True)]),
        "frequency_hz": rows("motion_omega") / HZ,
        "harmonics": rows("order", -1.0).astype(np.int64),
        "status": rows("status", -1.0).astype(np.int64),
        **{name: rows(own) for name, own in POINTS.items()},
    }  # fmt: skip
