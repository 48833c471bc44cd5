"""One random machine: asked, and some of its points judged."""

import contextlib
import io
import re
from dataclasses import dataclass, field
from time import process_time

import numpy as np

from evidence.trust.ask import Told, asked
from evidence.trust.draw import Machine, draw
from evidence.trust.march import Judge, Orbit

TRUSTED_POINTS, DOUBTED_POINTS = 12, 8  # of a machine that are judged
LIMIT = 0.05  # relative error above which a trusted point is wrong
SURE = 3.0  # times the judge's own error that a multiplier must be off the unit circle
ACTS = 1e-6  # share of the other harmonics above which contacts act


@dataclass(frozen=True)
class Judged:
    """One point: what is told and what is true."""

    hz: float
    level: int
    stability: str
    off: float
    motion_error: float
    multiplier: float
    multiplier_error: float
    is_peak: bool
    reason: str

    @property
    def unstable(self) -> bool:
        """Whether the judge is sure that the motion is unstable."""
        return self.multiplier - 1.0 > max(SURE * self.multiplier_error, 1e-6)

    @property
    def wrong(self) -> bool:
        """Whether it is off by more than the limit, the judge's own error left out."""
        return self.off > LIMIT + SURE * self.motion_error


@dataclass(frozen=True)
class Outcome:
    """What became of one machine."""

    number: int
    family: str
    points: int
    unsolved: int
    levels: tuple[int, int, int]
    not_examined: int
    peak_level: int
    peak_stability: str
    seconds: float
    acting: int
    unjudged: int
    judged: list[Judged] = field(default_factory=list)
    error: str = ""


def outcome(seed: int, number: int) -> Outcome:
    """Ask and judge one machine."""
    machine = draw(seed, number)
    began = process_time()
    try:
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            told = asked(machine)
    except Exception as error:  # noqa: BLE001 - a crash is a finding
        return Outcome(
            number, machine.family, 0, 0, (0, 0, 0), 0, 2, "", process_time() - began, 0, 0, error=repr(error)[:300]
        )
    seconds = process_time() - began
    judged, unjudged = [], 0
    for i in chosen(machine, told, np.random.default_rng([seed, number, 7])):
        orbit = Judge(machine, 2 * np.pi * told.hz[i]).orbit(told.motion[i])
        if orbit is None:
            unjudged += 1
        else:
            judged.append(compared(machine, told, i, orbit))
    levels = np.bincount(told.level, minlength=3)
    trusted_blind = int(np.sum((told.level == 0) & np.array([s == "not examined" for s in told.stability])))
    return Outcome(
        number,
        machine.family,
        len(told.hz),
        int((~told.solved).sum()),
        (int(levels[0]), int(levels[1]), int(levels[2])),
        trusted_blind,
        told.peak_level,
        told.stability[told.peak] if told.peak >= 0 else "",
        seconds,
        int(acting(machine, told).sum()),
        unjudged,
        judged,
    )


def acting(machine: Machine, told: Told) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    """Return at which points contacts do more than a spring."""
    size = np.abs(told.motion[:, machine.harmonic]).max(axis=1)
    rest = np.delete(np.abs(told.motion), [0, machine.harmonic], axis=1).max(axis=(1, 2), initial=0.0)
    order_one = np.array([m.shape[0] <= machine.harmonic + 1 for m in told.motion])
    return np.asarray(told.solved & ((rest > ACTS * size) | order_one))


def chosen(machine: Machine, told: Told, rng: np.random.Generator) -> list[int]:
    """Return the points that are judged."""
    acts = acting(machine, told)
    every = rng.permutation(np.flatnonzero(told.solved & (told.level != 1)))
    first = sorted(every.tolist(), key=lambda i: not acts[i])[:TRUSTED_POINTS]
    doubted = rng.permutation(np.flatnonzero(told.solved & (told.level == 1)))[:DOUBTED_POINTS]
    peak = [told.peak] if told.peak >= 0 and told.solved[told.peak] else []
    return list(dict.fromkeys([*peak, *first, *doubted.tolist()]))


def compared(machine: Machine, told: Told, i: int, orbit: Orbit) -> Judged:
    """Hold a point against its orbit."""
    ours, true = told.motion[i][machine.harmonic], orbit.motion[machine.harmonic]
    size = np.maximum(np.abs(true), 0.01 * np.max(np.abs(true)))
    off = float(np.max(np.abs(ours - true) / size))
    return Judged(
        float(told.hz[i]),
        int(told.level[i]),
        told.stability[i],
        off,
        orbit.motion_error,
        orbit.multiplier,
        orbit.multiplier_error,
        i == told.peak,
        re.sub(r"[-+]?\d[\d.e+-]*", "#", told.reasons[i])[:160],
    )
