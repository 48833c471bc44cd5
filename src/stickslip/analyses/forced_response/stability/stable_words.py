"""The stability of a response in words: point by point for few points, else in ranges along the branch."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.records.columns import CaseNumbers, ExaminedRows, PointStability, each, read
from stickslip.analyses.forced_response.stability.stable import Examined
from stickslip.response.forced.collected import Response
from stickslip.response.stability.found import modulus_text
from stickslip.study.verdict import said
from stickslip.units import HZ

FEW = 6  # points of a case with a sentence each
BASES = ("not examined", "examined", "carried", "by sign")  # in the order of their numbers in the dataset
MOST_RUNS = 12
MOST_SENTENCES = 10


@dataclass(frozen=True)
class Point:
    """Stability of a point, as texts and numbers of the dataset.

    Parameters
    ----------
    hz
        Frequency, Hz.
    verdict
        One word.
    multiplier, error
        Modulus of the decisive multiplier and its error; NaN if unknown.
    sentence
        Verdict and reason.
    basis
        Whether the point was examined or its verdict was inferred.
    """

    hz: float
    verdict: str
    multiplier: float
    error: float
    sentence: str
    basis: str = "examined"


def point_of(examined: Examined) -> Point:
    """Return texts and numbers of an examined point."""
    e = examined
    return Point(e.omega / HZ, e.verdict, e.multiplier, e.error, e.sentence, e.basis)


def peak_word(response: Response, examined: Sequence[Examined]) -> str:
    """Return the stability of the peak in a word or two."""
    return next((said_of(e.verdict) for e in examined if e.position == response.peak), said_of(""))


def said_of(verdict: str) -> str:
    """Return a stability verdict as a phrase beside a peak."""
    return (
        {"undecided": "stability undecided"}.get(verdict, verdict)
        if verdict not in ("", "not examined")
        else "stability not examined"
    )


def stability_log(points: Sequence[Point]) -> list[str]:
    """Return the log lines on the stability of a case: a sentence for each of few points, ranges for many."""
    return [p.sentence for p in points] if len(points) <= FEW else [runs_line(points)]


def stability_lines(points: Sequence[Point], peak_hz: float) -> tuple[str, ...]:
    """Return the lines on the stability of a case: a sentence for each of few points; for many, ranges and sentences on the peak and on unstable points."""
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
    """Return the ranges of points with equal verdicts, in the order of the branch or of the frequency, whichever is shorter."""
    by_hz = sorted(points, key=lambda p: p.hz)
    own = min((_runs(points), _runs(by_hz)), key=len)
    told = "; ".join(map(_run, own[:MOST_RUNS]))
    more = f"; and {len(own) - MOST_RUNS} more changes" if len(own) > MOST_RUNS else ""
    return f"{len(points)} points: {told}{more}"


def of_case(data: xr.Dataset, case: int) -> list[Point]:
    """Return the examined points of a case."""
    return [
        Point(
            float(own.stability_frequency_hz),
            str(own.stability_verdict),
            float(own.stability_multiplier),
            float(own.stability_multiplier_error),
            str(own.stability_sentence),
        )
        for own in each(read(ExaminedRows, data, case))
    ]


def counts_line(data: xr.Dataset, case: int) -> str:
    """State the number of points with known stability and its basis; empty if unknown, or if every point was examined."""
    own = read(PointStability, data, case).motion_stability_basis
    counts = {word: int(np.sum(own == k)) for k, word in enumerate(BASES)}
    if counts["examined"] == own.size or not np.any(own >= 0):
        return ""
    told = ", ".join(f"{n} {word}" for word, n in counts.items() if n and word != "not examined")
    none = counts["not examined"]
    return f"Of {own.size} points {told or 'none examined'}" + f"; {none} not examined" * bool(none)


def all_lines(data: xr.Dataset, labels: Sequence[str]) -> tuple[str, ...]:
    """Return the lines of all cases, each with the label of its case."""
    return tuple(
        said(label, line)
        for i, label in enumerate(labels)
        for line in (
            *filter(None, [counts_line(data, i)]),
            *stability_lines(of_case(data, i), read(CaseNumbers, data, i).peak_frequency_hz),
        )
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
