"""Within which frequencies a level answers alone, and how far its curve is from the direct solution there."""

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.study.analyses.modal_synthesis.records import SynthesisLevel

NOTHING = (np.nan, np.nan)


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
