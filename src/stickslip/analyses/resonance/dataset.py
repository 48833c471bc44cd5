"""The node ``/resonance`` of a result."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, of_cases
from stickslip.analyses.resonance.envelope import along_span, heights, overtakings
from stickslip.analyses.resonance.verdicts import case_verdicts
from stickslip.analyses.waves.records.about import told
from stickslip.arrays import FloatArray
from stickslip.response.resonances.point import PeakPoint
from stickslip.study.analysis import Solved
from stickslip.study.store.netcdf import variable
from stickslip.study.verdict import Verdict
from stickslip.units import DEG, HZ

CURVES = {
    "value": ("1", "value of the parameter"),
    "frequency_hz": ("Hz", "frequency of the peak"),
    "amplitude": ("m", "amplitude of the output"),
    "phase_deg": ("deg", "phase of the output against the force"),
    "energy": ("J", "work of the loads over a period: what is dissipated"),
    "friction_energy": ("J", "part of it that the contacts take"),
    "slope": ("m", "change of the amplitude with the parameter, over its unit"),
    "below": ("1", "how much higher the maximum beside the peak is, relatively"),
    "maximum": ("1", "1: a maximum; 0: a minimum or a saddle; -1: no solution"),
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the peaks of all cases."""
    by_label = {one.case.label: one for one in solved}

    def verdicts(label: str, own: Variables) -> Sequence[Verdict]:
        one = by_label[label]
        return case_verdicts(label, own, one.notes, one.case.settings.resonance.values or ())

    return of_cases(solved, _of_case, verdicts, _lost)


def _lost(case: Variables) -> int:
    return int(np.sum(case["maximum"].values == -1)) if "maximum" in case else 0


def _of_case(solved: Solved) -> Variables:
    points: Sequence[PeakPoint] = solved.records
    model = solved.notes.get("model", {})
    asked = solved.case.settings.resonance
    found = told(model) | {
        "output": variable("", str(model.get("output", "")), "1", "output whose amplitude peaks"),
        "parameter": variable("", asked.parameter, "1", "what varies"),
        "by": variable("", asked.by, "1", "what makes a peak"),
    }
    if not points:
        return found
    curves = _curves(points, asked.values)
    found |= {name: variable("peak point", curves[name], *about) for name, about in CURVES.items()}
    values = asked.values
    amplitude, places = (heights(points, values), values) if values else along_span(points)
    if met := overtakings(amplitude, places):
        columns = {
            "value": ([m.value for m in met], "1", "where another peak becomes the highest"),
            "before": ([m.before for m in met], "1", "number of the peak that was"),
            "after": ([m.after for m in met], "1", "number of the peak that is from there on"),
            "amplitude": ([m.amplitude for m in met], "m", "amplitude of both there"),
        }
        found |= {f"overtaking_{k}": variable("overtaking", *own) for k, own in columns.items()}
    least = np.nanmin(np.fmax.reduce(amplitude, axis=0), initial=np.inf)
    return found | _lowest(solved.notes.get("smallest", {}), found, float(least))


def _lowest(noted: Mapping[str, Any], found: Variables, least: float) -> Variables:
    """Return where the highest peak is lowest: in the valley of one peak, or where one overtakes another; nothing if a visited value is lower than both."""
    places = []
    if "value" in noted:
        places.append((float(noted["amplitude"]), float(noted["value"]), float(noted["omega"]) / HZ))
    if "overtaking_value" in found:
        met = zip(found["overtaking_amplitude"].values, found["overtaking_value"].values, strict=True)
        places += [(float(a), float(v), np.nan) for a, v in met]
    if not places or not min(places)[0] <= least:
        return {}
    amplitude, value, hertz = min(places)
    return {
        "smallest_value": variable("", value, "1", "value of the parameter at which the highest peak is lowest"),
        "smallest_amplitude": variable("", amplitude, "m", "amplitude there"),
        "smallest_frequency_hz": variable("", hertz, "Hz", "frequency there; NaN where two peaks are equally high"),
    }


def _curves(points: Sequence[PeakPoint], values: Sequence[float] | None) -> dict[str, FloatArray]:
    """Return (peaks, points) of each quantity: at the values as they were visited, or along each curve."""
    count = 1 + max(p.peak for p in points)
    each = [[p for p in points if p.peak == i] for i in range(count)]
    if values is not None:
        place = {v: k for k, v in enumerate(values)}
        each = [sorted(own, key=lambda p: place[p.value]) for own in each]
    most = max(map(len, each))
    out = {name: np.full((count, most), np.nan) for name in CURVES}
    out["maximum"] = np.full((count, most), -2)  # no point at all
    for i, own in enumerate(each):
        for k, point in enumerate(own):
            for name, value in _told(point).items():
                out[name][i, k] = value
    return out


def _told(point: PeakPoint) -> dict[str, Any]:
    if not point.converged:
        return {"value": point.value, "maximum": -1}
    return {
        "value": point.value,
        "frequency_hz": point.omega / HZ,
        "amplitude": point.amplitude,
        "phase_deg": point.phase / DEG,
        "energy": point.energy,
        "friction_energy": point.friction,
        "slope": point.slope,
        "below": point.below,
        "maximum": int(point.is_maximum),
    }
