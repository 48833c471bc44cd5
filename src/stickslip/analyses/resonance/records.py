"""Records of resonances over a parameter: the curve of each peak, overtakings, and the record of a case."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.response.resonances.point import Overtaking, PeakPoint, along_span, heights, overtakings
from stickslip.study.analysis import Solved
from stickslip.units import DEG, HZ

NO_POINT = -2  # `PeakCurve.maximum` of the padding after the points of a shorter curve


@dataclass(frozen=True, eq=False, kw_only=True)
class PeakCurve:
    """Curve of a peak: its points in the order of the visited values, or along the arc length."""

    value: FloatArray = column("1", "value of the parameter", along="point")
    frequency_hz: FloatArray = column("Hz", "frequency of the peak", along="point")
    amplitude: FloatArray = column("m", "amplitude of the output", along="point")
    phase_deg: FloatArray = column("deg", "phase of the output against the force", along="point")
    energy: FloatArray = column("J", "work of the loads over a period: what is dissipated", along="point")
    friction_energy: FloatArray = column("J", "part of it that the contacts take", along="point")
    slope: FloatArray = column("m", "change of the amplitude with the parameter, over its unit", along="point")
    below: FloatArray = column("1", "how much higher the maximum beside the peak is, relatively", along="point")
    maximum: IntArray = column("1", "1: a maximum; 0: a minimum or a saddle; -1: no solution", along="point")

    @property
    def known(self) -> BoolArray:
        """Mask of the entries that are points."""
        return np.asarray(self.maximum > NO_POINT)


@dataclass(frozen=True, eq=False, kw_only=True)
class Resonances:
    """Record of a case."""

    output: str = column("1", "output whose amplitude peaks")
    parameter: str = column("1", "what varies")
    by: str = column("1", "what makes a peak")
    smallest_value: float | None = column(
        "1", "value of the parameter at which the highest peak is lowest", default=None
    )
    smallest_amplitude: float | None = column("m", "amplitude there", default=None)
    smallest_frequency_hz: float | None = column(
        "Hz", "frequency there; NaN where two peaks are equally high", default=None
    )
    peaks: tuple[PeakCurve, ...] = rows("peak")
    overtakings: tuple[Overtaking, ...] = rows("overtaking", "overtaking_")

    @property
    def smallest(self) -> tuple[float, float, float] | None:
        """Minimum of the highest peak: value, amplitude (m), and frequency (Hz; NaN if two peaks are equally high)."""
        value, amplitude, hertz = self.smallest_value, self.smallest_amplitude, self.smallest_frequency_hz
        if value is None or amplitude is None or hertz is None or not np.isfinite(value):
            return None
        return value, amplitude, hertz


def answer(solved: Solved) -> Resonances:
    """Return the record of a case from the points and notes of its job."""
    points: Sequence[PeakPoint] = solved.records
    asked = solved.case.settings.resonance
    found: dict[str, Any] = {
        "output": str(solved.notes.get("model", {}).get("output", "")),
        "parameter": asked.parameter,
        "by": asked.by,
    }
    if not points:
        return Resonances(**found)
    values = asked.values
    amplitude, places = (heights(points, values), values) if values else along_span(points)
    met = tuple(overtakings(amplitude, places))
    least = np.nanmin(np.fmax.reduce(amplitude, axis=0), initial=np.inf)
    found |= _lowest(solved.notes.get("smallest", {}), met, float(least))
    return Resonances(**found, peaks=_curves(points, values), overtakings=met)


def _lowest(noted: Mapping[str, Any], met: Sequence[Overtaking], least: float) -> dict[str, float]:
    """Return the minimum of the highest peak: the valley of one peak, or an overtaking; empty if a visited value is lower."""
    places = [(m.amplitude, m.value, np.nan) for m in met]
    if "value" in noted:
        places.insert(0, (float(noted["amplitude"]), float(noted["value"]), float(noted["omega"]) / HZ))
    if not places or not min(places)[0] <= least:
        return {}
    amplitude, value, hertz = min(places)
    return {"smallest_value": value, "smallest_amplitude": amplitude, "smallest_frequency_hz": hertz}


def _curves(points: Sequence[PeakPoint], values: Sequence[float] | None) -> tuple[PeakCurve, ...]:
    each = [[p for p in points if p.peak == i] for i in range(1 + max(p.peak for p in points))]
    if values is not None:
        place = {v: k for k, v in enumerate(values)}
        each = [sorted(own, key=lambda p: place[p.value]) for own in each]
    most = max(map(len, each))
    return tuple(_curve(own, most) for own in each)


def _curve(points: Sequence[PeakPoint], most: int) -> PeakCurve:
    """Return the curve of a peak, padded to `most` points."""
    rest = [np.nan] * (most - len(points))

    def along(number: Callable[[PeakPoint], float]) -> FloatArray:
        return np.array([*(number(p) if p.converged else np.nan for p in points), *rest])

    kinds = [int(p.is_maximum) if p.converged else -1 for p in points]
    return PeakCurve(
        value=np.array([*(p.value for p in points), *rest]),
        frequency_hz=along(lambda p: p.omega / HZ),
        amplitude=along(lambda p: p.amplitude),
        phase_deg=along(lambda p: p.phase / DEG),
        energy=along(lambda p: p.energy),
        friction_energy=along(lambda p: p.friction),
        slope=along(lambda p: p.slope),
        below=along(lambda p: p.below),
        maximum=np.array(kinds + [NO_POINT] * len(rest), dtype=np.int64),
    )
