"""Everything that the pictures and the table are made from, computed once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np

from evidence.figures.model import SHARES, Model, Plan, SecondPlan
from evidence.figures.reasons import Truncation, truncation
from evidence.figures.solve import HZ, PATIENCE, STEPS, Curve, Orbit, Pair, curve, curve_problem, nearest, orbit, pairs
from evidence.figures.timing import Timing, timed
from stickslip.arrays import FloatArray
from stickslip.harmonic import harmonic_block_norms

UNCOUPLED = 1e-9  # largest block off the diagonal, beside a stuck contact
Say = Callable[[str], None]
NAMES = ("always_low", "always_high", "jacobian_alert")


class Marker(NamedTuple):
    """A motion in time and the solutions of the balance at the same frequency."""

    orbit: Orbit
    balance: float  # amplitude of that from which it began, m
    low: float  # amplitude with few harmonics, m


@dataclass(frozen=True, eq=False)
class Peaks:
    """Whole responses at one ratio, each followed along its branch (fig. 4, 9)."""

    ratio: float
    low: Curve
    high: Curve
    alert: Curve
    orbit: Orbit | None  # at the peak with many harmonics


@dataclass(frozen=True, eq=False)
class Norms:
    """Norms of the Jacobian's blocks between harmonics (fig. 1)."""

    stuck: FloatArray
    frozen: FloatArray  # in full stick, with sliders that start from the static state
    share: float  # of the friction with which that was found
    weak: FloatArray
    missing_weak: FloatArray  # of ΔJ, in the weak case
    missing: FloatArray  # of ΔJ, in the strong case


@dataclass(frozen=True, eq=False)
class InTime:
    """Five harmonics against the motion in time, at the lowest ratio that has a periodic one (fig. 4, 5).

    Attributes
    ----------
    ratio
        That ratio.
    refused
        Lower ones, with what became of the motion at their peak.
    markers
        Beside the peak.
    pair, orbit
        At the equally spaced frequency next to the peak.
    step_error
        Change of the amplitude with half the time step.
    truncation
        What the harmonics above five do there.
    """

    ratio: float
    refused: tuple[tuple[float, str], ...]
    markers: list[Marker]
    pair: Pair
    orbit: Orbit
    step_error: float
    truncation: Truncation


@dataclass(frozen=True, eq=False)
class Evidence:
    """All of it."""

    plan: Plan
    second_plan: SecondPlan
    model: Model
    pairs: dict[float, list[Pair]]
    unsolved: dict[float, list[float]]
    peaks: list[Peaks]
    in_time: InTime
    weak_markers: list[Marker]
    norms: Norms
    timing: list[Timing]
    second: Model
    second_peaks: list[Peaks]
    second_pairs: dict[float, list[Pair]]

    @property
    def every_pair(self) -> list[Pair]:
        """Pairs of all ratios."""
        return list(chain.from_iterable(self.pairs.values()))

    @property
    def slipping(self) -> list[Pair]:
        """Those of them at which a contact slips or opens, so that there is an error."""
        return [p for p in self.every_pair if not p.stuck and p.predicted > 1e-9]

    def at(self, ratio: float) -> Peaks:
        """Return the whole responses at a ratio."""
        return next(p for p in self.peaks if p.ratio == ratio)


def gather(model: Model, second: Model, plan: Plan, second_plan: SecondPlan, say: Say) -> Evidence:
    """Compute everything, from the largest ratio to the smallest.

    Parameters
    ----------
    model, second
        The first and the second damper.
    plan, second_plan
        What is computed of each.
    say
        Takes a line of progress.
    """
    found: dict[float, list[Pair]] = {}
    lost: dict[float, list[float]] = {}
    for ratio in plan.ratios:
        say(f"errors at F_CL/F_HE = {ratio:g}")
        found[ratio], lost[ratio] = pairs(model, ratio, plan.hertz, plan.frequencies)
    peaks = []
    for ratio in sorted({*plan.all_ratios, plan.weak, plan.strong, *plan.time_ratios}, reverse=True):
        say(f"whole responses at {ratio:g}")
        peaks.append(whole(model, ratio, plan.branch_hertz, judged=True))
    say("motions in time")
    in_time = against_time(model, found, peaks, plan)
    weak = next(p for p in peaks if p.ratio == plan.weak)
    weak_markers = markers_of(model, weak, found[plan.weak], plan)
    timing = []
    for ratio in plan.timing_ratios:
        say(f"costs at {ratio:g}")
        timing.append(timed(model, ratio, plan))
    second_pairs: dict[float, list[Pair]] = {}
    second_peaks = []
    for ratio in second_plan.named:
        say(f"the second damper at {ratio:g}")
        second_peaks.append(whole(second, ratio, second_plan.hertz, judged=False))
        grid = second_plan.hertz, second_plan.frequencies
        second_pairs[ratio] = pairs(second, ratio, *grid)[0]
    return Evidence(
        plan,
        second_plan,
        model,
        found,
        lost,
        peaks,
        in_time,
        weak_markers,
        norms_of(model, found, plan),
        timing,
        second,
        second_peaks,
        second_pairs,
    )


def whole(model: Model, ratio: float, hertz: tuple[float, float], judged: bool) -> Peaks:
    """Follow the response with few, with many and with the alert's harmonics."""
    low, high, alert = (curve(model, ratio, name, hertz) for name in NAMES)
    found = orbit(model, high.problem, high.peak) if judged else None
    return Peaks(ratio, low, high, alert, found)


def against_time(model: Model, known: dict[float, list[Pair]], peaks: Sequence[Peaks], plan: Plan) -> InTime:
    """Hold five harmonics against time at the lowest ratio whose peak is periodic; at the highest if none is."""
    refused: list[tuple[float, str]] = []
    for ratio in plan.time_ratios:
        own = next(p for p in peaks if p.ratio == ratio)
        grid = plan.hertz, plan.frequencies
        near = known.get(ratio) or pairs(model, ratio, *grid)[0]
        pair = min(near, key=lambda p: abs(p.hertz - own.high.peak.omega / HZ))
        found = orbit(model, pair.problem, pair.high, patience=PATIENCE)
        if found.found or ratio == plan.time_ratios[-1]:
            break
        refused.append((ratio, found.motion))
    finer = orbit(model, pair.problem, pair.high, steps=2 * STEPS)
    return InTime(
        ratio,
        tuple(refused),
        markers_of(model, own, near, plan),
        pair,
        found,
        abs(found.amplitude / finer.amplitude - 1.0),
        truncation(model, pair, found),
    )


def markers_of(model: Model, peaks: Peaks, known: Sequence[Pair], plan: Plan) -> list[Marker]:
    """Find the motions in time at frequencies around a peak, from the solutions with many harmonics there."""
    centre = peaks.high.peak.omega / HZ
    wanted = np.linspace(*(centre + np.array(plan.marker_hertz)), plan.markers)
    chosen: dict[float, Pair] = {}
    for hertz in wanted:
        pair = min(known, key=lambda p: abs(p.hertz - hertz))
        chosen[pair.hertz] = pair
    return [
        Marker(orbit(model, p.problem, p.high), p.problem.amplitude(p.high), p.problem.amplitude(p.low))
        for p in chosen.values()
    ]


def norms_of(model: Model, found: dict[float, list[Pair]], plan: Plan) -> Norms:
    """Return the block norms in full stick, at the worst weak pair below the threshold, and of ΔJ there and at the worst of all."""
    stuck = max(found[plan.ratios[0]], key=lambda p: p.problem.amplitude(p.low))
    weak = weakest_alarm(found)
    strong = max(found[plan.strong], key=lambda p: p.real)

    def norms(pair: Pair, part: str) -> FloatArray:
        kept = pair.problem.low.harmonics
        high = pair.problem.high
        x = high.unknowns(pair.low.coefficients)
        return harmonic_block_norms(high, x, pair.low.omega, part, kept if part == "missing" else None)

    return Norms(
        norms(stuck, "jacobian"),
        *frozen_norms(model, plan.ratios[0], stuck.hertz),
        norms(weak, "jacobian"),
        norms(weak, "missing"),
        norms(strong, "missing"),
    )


def frozen_norms(model: Model, ratio: float, hertz: float) -> tuple[FloatArray, float]:
    """Return the block norms in full stick where sliders start from the static state, and the share of friction with which it was found.

    The largest share is taken that leaves the vibration its amplitude, so that nothing but springs is left.
    """
    for share in SHARES:
        frozen = model.frozen(share)
        response = curve(frozen, ratio, "always_low", (0.99 * hertz, hertz), 3)
        high = curve_problem(frozen, ratio, "jacobian_alert").high
        point = nearest(response.points, hertz)
        x = high.unknowns(point.coefficients)
        norms = harmonic_block_norms(high, x, point.omega, "jacobian")
        if np.max(norms[~np.eye(len(norms), dtype=bool)]) < UNCOUPLED:
            break
    return norms, share


def weakest_alarm(found: dict[float, list[Pair]]) -> Pair:
    """Return the pair with the largest predicted error that is still accepted."""
    every = list(chain.from_iterable(found.values()))
    quiet = [p for p in every if 0.0 < p.predicted < 0.05]
    return max(quiet or every, key=lambda p: p.predicted)
