"""The node ``/quasi_periodic`` of a result."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.collected import Variables, described, each, of_cases
from stickslip.analyses.quasi_periodic.records import TwoFrequencies
from stickslip.analyses.quasi_periodic.verdicts import case_verdicts
from stickslip.study.analysis import Solved
from stickslip.units import HZ

ABOUT = {
    "output_name": ("output", "1", "output"),
    "accuracy": ("", "1", "accuracy that is asked for, of the same measure as left_out"),
    "first_hz": ("point", "Hz", "first frequency"),
    "second_hz": ("point", "Hz", "second frequency; NaN where there is none"),
    "kind": ("point", "1", "two loads, second tone, no second tone or not found"),
    "why": ("point", "1", "what that rests on"),
    "unknown": (
        "point",
        "1",
        "where there is no second tone: why it is not known that nothing else grows; empty where it is",
    ),
    "combined": ("point", "1", "combined frequencies that are kept"),
    "left_out": (
        "point",
        "1",
        "what those left out would change the motion by, root mean square over it, of the coordinate that they change most",
    ),
    "slip": ("point", "rad", "by how much the second phase in the contacts is off after a turn of the first"),
    "newton_iterations": ("point", "1", "Newton steps of the last solution"),
    "largest": ("point output", "m", "largest amplitude, half of peak to peak in a period of the first frequency"),
    "least": ("point output", "m", "least such amplitude"),
    "rms": ("point output", "m", "root mean square about the mean"),
    "extreme": ("point output", "m", "largest distance from the mean"),
    "envelope": (
        "point phase",
        "m",
        "such an amplitude of the first output over the phase of the second frequency where the period begins",
    ),
    "index": ("point index tone", "1", "j and k of the combined frequencies j f1 + k f2"),
    "amplitude": ("point index output", "m", "amplitude of each combined frequency; of (0, 0) the mean"),
    "time_largest": ("point output", "m", "largest amplitude in time"),
    "time_least": ("point output", "m", "least amplitude in time"),
    "time_off": (
        "point",
        "1",
        "difference of the motion in time from the balance, root mean square over that of the motion; of two loads",
    ),
}
EACH = {
    "kind": "kind",
    "why": "why",
    "unknown": "unknown",
    "left_out": "left_out",
    "slip": "slip",
    "newton_iterations": "iterations",
    "largest": "largest",
    "least": "least",
    "rms": "rms",
    "extreme": "extreme",
    "envelope": "envelope",
    "time_largest": "time_largest",
    "time_least": "time_least",
    "time_off": "time_off",
}


def dataset(solved: Sequence[Solved]) -> xr.Dataset:
    """Return the motions of all cases."""
    return of_cases(solved, _of_case, case_verdicts, _lost)


def _lost(case: Variables) -> int:
    return int(np.count_nonzero(case["kind"].values == "not found")) if "kind" in case else 0


def _of_case(solved: Solved) -> Variables:
    points: Sequence[TwoFrequencies] = solved.records
    model = dict(solved.notes.get("model", {}))
    names = [str(name) for name in np.atleast_1d(model.pop("output", []))]
    values: dict[str, Any] = {"output_name": np.array(names, dtype=str)}
    if (accuracy := model.pop("accuracy", None)) is not None:
        values["accuracy"] = np.float64(accuracy)
    if points:
        values |= _of_points(points)
    return described(ABOUT, values, model)


def _of_points(points: Sequence[TwoFrequencies]) -> dict[str, Any]:
    found: dict[str, Any] = {name: each(points, own) for name, own in EACH.items()}
    most = max(len(p.indices) for p in points)
    outputs = points[0].largest.size
    index = np.zeros((len(points), most, 2), dtype=np.int64)
    amplitude = np.full((len(points), most, outputs), np.nan)
    for row, size, point in zip(index, amplitude, points, strict=True):
        row[: len(point.indices)] = point.indices
        size[: len(point.indices)] = np.hypot(point.coefficients[..., 0], point.coefficients[..., 1])
    if not np.any(np.isfinite(found["time_largest"])):
        found = {name: value for name, value in found.items() if not name.startswith("time_")}
    return found | {
        "first_hz": each(points, "first") / HZ,
        "second_hz": each(points, "second") / HZ,
        "combined": np.array([max(len(p.indices) - 1, 0) for p in points]),
        "index": index,
        "amplitude": amplitude,
    }
