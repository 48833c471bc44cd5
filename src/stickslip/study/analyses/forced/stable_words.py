"""What is told of the stability of a response: point by point where few were examined, else in runs along the branch."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import xarray as xr

from stickslip.response.stability.modulus import modulus_text
from stickslip.study.analyses.verdict import said

FEW = 6  # points of a case that are told one by one
MOST_RUNS = 12
MOST_SENTENCES = 10


@dataclass(frozen=True)
class Point:
    """What was found of the stability of a point.

    Parameters
    ----------
    hz
        Where.
    verdict
        In a word.
    multiplier, error
        Modulus of the multiplier that decides and its error; NaN where none is known.
    sentence
        What was found and why.
    """

    hz: float
    verdict: str
    multiplier: float
    error: float
    sentence: str


def stability_lines(points: Sequence[Point], peak_hz: float) -> tuple[str, ...]:
    """Return what is told of a case: a sentence for each of few points; of many their runs, and sentences for the peak and what is not stable."""
    if len(points) <= FEW:
        return tuple(p.sentence for p in points)
    at = int(np.argmin([abs(p.hz - peak_hz) for p in points])) if np.isfinite(peak_hz) else -1
    off = [i for i, p in enumerate(points) if p.verdict != "stable" and i != at]
    off.sort(key=lambda i: (points[i].verdict != "unstable", abs(points[i].hz - peak_hz)))
    chosen = ([at] if at >= 0 else []) + off
    shown, left = sorted(chosen[:MOST_SENTENCES]), len(chosen) - MOST_SENTENCES
    more = (f"{left} more points that are not stable are in the result file",) * (left > 0)
    return (runs_line(points), *(points[i].sentence for i in shown), *more)


def runs_line(points: Sequence[Point]) -> str:
    """Return from where to where points are alike, in the order of the branch, or of the frequency where that is shorter."""
    by_hz = sorted(points, key=lambda p: p.hz)
    own = min((_runs(points), _runs(by_hz)), key=len)
    told = "; ".join(map(_run, own[:MOST_RUNS]))
    more = f"; and {len(own) - MOST_RUNS} more changes" if len(own) > MOST_RUNS else ""
    return f"{len(points)} points: {told}{more}"


def of_case(data: xr.Dataset, case: int) -> list[Point]:
    """Return the points of a case that were examined."""
    if "stability_sentence" not in data:
        return []
    names = ("frequency_hz", "verdict", "multiplier", "multiplier_error", "sentence")
    at = np.flatnonzero(data["stability_case"].values == case)
    columns = [data[f"stability_{name}"].values[at] for name in names]
    return [
        Point(float(hz), str(word), float(size), float(error), str(text))
        for hz, word, size, error, text in zip(*columns, strict=True)
    ]


def all_lines(data: xr.Dataset, labels: Sequence[str]) -> tuple[str, ...]:
    """Return what is told of all cases, each line with the label of its case."""
    return tuple(
        said(label, line)
        for i, label in enumerate(labels)
        for line in stability_lines(of_case(data, i), float(data["peak_frequency_hz"].values[i]))
    )


def _runs(points: Sequence[Point]) -> list[list[Point]]:
    return [list(run) for _, run in groupby(points, key=lambda p: p.verdict)]


def _run(run: Sequence[Point]) -> str:
    low, high = min(p.hz for p in run), max(p.hz for p in run)
    place = f"{low:.3f} to {high:.3f} Hz" if len(run) > 1 else f"{low:.3f} Hz"
    known = [p for p in run if np.isfinite(p.multiplier)]
    if run[0].verdict not in ("unstable", "undecided") or not known:
        return f"{run[0].verdict} {place}"
    worst = max(known, key=lambda p: p.multiplier)
    where = f" at {worst.hz:.3f} Hz" if len(run) > 1 else ""
    error = worst.error if np.isfinite(worst.error) else 0.0
    return f"{run[0].verdict} {place} (largest multiplier {modulus_text(worst.multiplier, error)}{where})"
