"""The highest of several peaks over the parameter: crossings, and its minimum."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.column import column
from stickslip.response.resonances.point import PeakPoint


@dataclass(frozen=True, eq=False, kw_only=True)
class Overtaking:
    """A value of the parameter at which another peak becomes the highest, interpolated between two visited values."""

    value: float = column("1", "where another peak becomes the highest")
    before: int = column("1", "number of the peak that was")
    after: int = column("1", "number of the peak that is from there on")
    amplitude: float = column("m", "amplitude of both there")


def heights(points: Sequence[PeakPoint], values: Sequence[float]) -> FloatArray:
    """Return (peaks, values) amplitudes of the maxima at the visited values; NaN for missing ones."""
    known = {(p.peak, p.value): p.amplitude for p in points if p.converged and p.is_maximum}
    count = 1 + max((p.peak for p in points), default=-1)
    return np.array([[known.get((i, v), np.nan) for v in values] for i in range(count)])


def along_span(points: Sequence[PeakPoint]) -> tuple[FloatArray, list[float]]:
    """Return (peaks, values) amplitudes of curves by arc length up to their first fold, interpolated, and the values."""
    count = 1 + max((p.peak for p in points), default=-1)
    curves = [_before_fold([p for p in points if p.peak == i]) for i in range(count)]
    values = np.unique([p.value for own in curves for p in own])
    amplitude = np.full((count, values.size), np.nan)
    for row, own in zip(amplitude, curves, strict=True):
        if len(own) > 1:
            order = sorted(own, key=lambda p: p.value)
            known = [p.value for p in order]
            row[:] = np.interp(values, known, [p.amplitude for p in order], np.nan, np.nan)
    falling = len(points) > 1 and points[1].value < points[0].value
    return (amplitude[:, ::-1], values[::-1].tolist()) if falling else (amplitude, values.tolist())


def _before_fold(curve: Sequence[PeakPoint]) -> list[PeakPoint]:
    """Return the maxima of a curve up to the first reversal of the value."""
    found: list[PeakPoint] = []
    for point in curve:
        if not (point.converged and point.is_maximum):
            continue
        if len(found) > 1 and (point.value - found[-1].value) * (found[1].value - found[0].value) <= 0.0:
            break
        found.append(point)
    return found


def highest(amplitude: FloatArray) -> IntArray:
    """Return the number of the highest peak at each value; -1 for none."""
    filled = np.where(np.isfinite(amplitude), amplitude, -np.inf)
    return np.where(np.any(np.isfinite(amplitude), axis=0), np.argmax(filled, axis=0), -1)


def overtakings(amplitude: FloatArray, values: Sequence[float]) -> list[Overtaking]:
    """Return the values at which another peak becomes the highest.

    Parameters
    ----------
    amplitude
        (peaks, values) in m.
    values
        Values in the order of visits.
    """
    top = highest(amplitude)
    found = []
    for i, j in pairwise(map(int, np.flatnonzero(top >= 0))):
        a, b = int(top[i]), int(top[j])
        if a == b:
            continue
        gap = amplitude[a, [i, j]] - amplitude[b, [i, j]]
        if not np.all(np.isfinite(gap)) or gap[0] == gap[1]:
            continue  # one peak is not known on both sides, or both are the same peak
        share = gap[0] / (gap[0] - gap[1])
        value = values[i] + share * (values[j] - values[i])
        there = amplitude[b, i] + share * (amplitude[b, j] - amplitude[b, i])
        found.append(Overtaking(value=float(value), before=a, after=b, amplitude=float(there)))
    return found


def valley(points: Sequence[PeakPoint], amplitude: FloatArray, values: Sequence[float]) -> tuple[float, float] | None:
    """Return two visited values between which the highest peak has its minimum without changing to another peak; None for none."""
    top = highest(amplitude)
    if not np.any(top >= 0):
        return None
    envelope = np.where(top >= 0, np.nanmax(np.where(np.isnan(amplitude), -np.inf, amplitude), axis=0), np.inf)
    lowest = int(np.argmin(envelope))
    slopes = {(p.peak, p.value): p.slope for p in points if p.converged}
    for i, j in ((lowest - 1, lowest), (lowest, lowest + 1)):
        if i < 0 or j >= len(values) or top[i] != top[j]:
            continue
        falls, rises = (slopes[int(top[k]), values[k]] * (values[j] - values[i]) for k in (i, j))
        if falls < 0.0 < rises:
            return values[i], values[j]
    return None
