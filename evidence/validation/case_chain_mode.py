"""A nonlinear mode of tmdsimpy: mode 1 of the chain of 20 masses with 6 Jenkins elements, which folds back four times, H = 5, 256 samples.

Compared by distance in the plane, amplitude against frequency and damping ratio, each over its range: between folds several motions have the same amplitude.
"""

import itertools

import numpy as np

from evidence.models.lumped import small_chain
from evidence.validation.compare import Record, bound, left_out, record
from evidence.validation.reference_data import chain_mode, has_complete
from stickslip.arrays import FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.nonlinear_modes.backbone import ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import stuck_modes

SOURCE = "tmdsimpy, commit 17d5fc3"
CASE = "chain of 20 masses, mode 1"
HOW = Discretisation(order=5, samples=256, evaluator="intervals")
FINE = 600  # points, so that chords between them are no part of the distance
CHORD = 1.5e-3  # what a chord beside a corner of the curve is off, of the ranges; half of the rows lie thirty times nearer
PLAIN = 30


def ours(points: int) -> tuple[FloatArray, str]:
    """Return log10 of modal amplitude, frequency, damping ratio and tip amplitude along the mode, and how it ended."""
    system, load = small_chain(), HarmonicLoad(np.zeros(20))
    mode = stuck_modes(system, 1)[0]
    sweep = ModeSweep(span=tuple(abs(mode.shape[19]) * np.array([1e-3, 12.0])), points=points)
    found = nonlinear_mode(system, load, mode, 19, HOW, sweep)
    each = [(np.log10(p.modal_amplitude), p.omega, p.ratio, p.amplitude) for p in found.solutions]
    return np.array(each), found.end


def folds(log: FloatArray) -> FloatArray:
    """Return log10 of the amplitude where it turns back."""
    turned = np.diff(np.sign(np.diff(log))) != 0
    return np.asarray(log[1:-1][turned])


def distances(rows: FloatArray, curve: FloatArray) -> FloatArray:
    """Return how far each row is from a curve, in ranges of the rows."""
    size = np.ptp(rows, axis=0)
    rows, curve = rows / size, curve / size
    best = np.full(len(rows), np.inf)
    for start, end in itertools.pairwise(curve):
        way = end - start
        share = np.clip(((rows - start) @ way) / (way @ way), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(rows - start - share[:, None] * way, axis=1))
    return best


def run() -> list[Record]:
    """Compare all rows, and the folds with few points."""
    if not has_complete():
        return [left_out(CASE, "the curve is not at hand", SOURCE)]
    rows = chain_mode()
    fine, _ = ours(FINE)
    away = distances(rows[:, [0, 2, 4]], fine[:, :3])
    plain, _ = ours(PLAIN)
    theirs = folds(rows[:, 0])
    records = [
        bound(CASE, f"largest distance of {len(rows)} rows", float(away.max()), CHORD, SOURCE),
        bound(CASE, "median distance", float(np.median(away)), 5e-5, SOURCE),
        record(CASE, f"folds with {PLAIN} points asked for", len(folds(plain[:, 0])), len(theirs), 0.0, SOURCE),
    ]  # fmt: skip
    return records + [
        record(CASE, f"log10 a of fold {i + 1}", float(one), float(other), 2e-3, SOURCE)
        for i, (one, other) in enumerate(zip(folds(fine[:, 0]), theirs, strict=True))
    ]
