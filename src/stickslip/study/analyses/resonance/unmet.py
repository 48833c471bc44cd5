"""Peaks followed backwards that a sweep at their own value does not meet."""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.response.resonances.first import PeakSearch, met_by_a_sweep
from stickslip.response.resonances.point import PeakPoint

SWEEPS = 8  # at most, at values spread over those that are in question


def unmet_peaks(
    search: PeakSearch, points: Sequence[PeakPoint], values: Sequence[float], later: int
) -> dict[str, FloatArray]:
    """Return number and value of the peaks that no sweep was seen to reach.

    Parameters
    ----------
    search
        Of what.
    points
        All that was found.
    values
        In the order in which they were visited; the peaks of the last one were found by a sweep.
    later
        Number of the first peak that was followed back.
    """
    back = [p for p in points if p.peak >= later and p.converged and p.is_maximum]
    places = [i for i, v in enumerate(values[:-1]) if any(p.value == v for p in back)]
    share = np.linspace(0, len(places) - 1, min(SWEEPS, len(places)))
    swept = sorted({places[int(i)] for i in share})
    met: dict[tuple[int, int], bool] = {}
    for i in swept:
        here = [p for p in back if p.value == values[i]]
        met |= {(p.peak, i): own for p, own in zip(here, met_by_a_sweep(search, here), strict=True)}

    def reached(peak: int, i: int) -> bool:
        # what sweeps meet on both sides of a value, one would meet there
        before = max((j for j in swept if j <= i), default=-1)
        after = min((j for j in swept if j >= i), default=len(values) - 1)
        return met.get((peak, before), False) and met.get((peak, after), False)

    unmet = [(p.peak, p.value) for p in back if p.value != values[-1] and not reached(p.peak, values.index(p.value))]
    return {
        "peak": np.array([peak for peak, _ in unmet], dtype=float),
        "value": np.array([v for _, v in unmet], dtype=float),
    }
