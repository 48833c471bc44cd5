"""Everything that the pictures and the table are made from, computed once."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np

from evidence.figures.model import Model
from evidence.figures.solve import HZ, STEPS, Curve, Orbit, Pair, curve, nearest, orbit, pairs
from stickslip.arrays import FloatArray
from stickslip.harmonic import harmonic_block_norms
from stickslip.response import ForcedPoint

Say = Callable[[str], None]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What is computed.

    Attributes
    ----------
    ratios
        F_CL/F_HE of the errors (fig. 6, 7a), largest first; at those below `periodic` no periodic motion is known to exist.
    weak, strong
        Two of them, of fig. 4, 5 and 6.
    paper_weak
        The weak ratio of the paper.
    all_ratios, timing_ratios
        Of the optimisation curves (fig. 9) and of the timing (fig. 7b).
    hertz, frequencies
        Equally spaced frequencies of the errors.
    timing_hertz, timing_frequencies
        Those of the timing.
    markers
        Number of time integrations of fig. 4.
    marker_hertz
        Their range, from below to above the peak.
    glued_ratios
        Of fig. 10, largest first; the last is that of fig. 11.
    glued_more
        Further ratios at which the alert is asked for the second damper.
    """

    ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 7.0, 5.0, 4.0)
    weak: float = 50.0
    strong: float = 5.0
    paper_weak: float = 20.0
    periodic: float = 4.0
    all_ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 5.0, 4.0, 3.0)
    timing_ratios: tuple[float, ...] = (250.0, 100.0, 50.0, 20.0, 10.0, 5.0, 4.0, 3.0)
    hertz: tuple[float, float] = (165.0, 184.0)
    frequencies: int = 39
    timing_hertz: tuple[float, float] = (160.25, 184.0)
    timing_frequencies: int = 20
    markers: int = 9
    marker_hertz: tuple[float, float] = (-6.0, 3.0)
    glued_ratios: tuple[float, float] = (23.4, 11.7)
    glued_more: tuple[float, ...] = (5.0, 2.0)


class Marker(NamedTuple):
    """A motion in time and the solution of the balance from which it began."""

    orbit: Orbit
    balance: float  # amplitude, m
    low: float  # amplitude with few harmonics at the same frequency, m; NaN where it is not known


@dataclass(frozen=True, eq=False)
class Timing:
    """Responses over the same few frequencies, and the motions in time near their peaks (fig. 7b)."""

    ratio: float
    low: Curve
    high: Curve
    alert: Curve
    repeated_all: Curve  # a double passage that repeats every frequency
    orbits: tuple[Orbit, ...]

    @property
    def reference(self) -> float:
        """Largest amplitude in time, m; NaN if there is none."""
        return max((o.amplitude for o in self.orbits if np.isfinite(o.amplitude)), default=np.nan)

    @property
    def reference_hertz(self) -> float:
        """Its frequency, Hz."""
        return max(self.orbits, key=lambda o: o.amplitude).hertz if self.orbits else np.nan

    @property
    def periodic(self) -> bool:
        """Whether all the motions in time are periodic."""
        return bool(self.orbits) and all(o.found for o in self.orbits)

    def error(self, which: str) -> float:
        """Return the signed error of the peak of ``low``, ``high`` or ``alert``, a fraction."""
        response: Curve = getattr(self, which)
        return float(response.amplitudes.max() / self.reference - 1.0)


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
    weak: FloatArray
    missing: FloatArray  # of ΔJ, in the strong case


@dataclass(frozen=True, eq=False)
class Evidence:
    """All of it."""

    plan: Plan
    model: Model
    pairs: dict[float, list[Pair]]
    unsolved: dict[float, list[float]]
    peaks: list[Peaks]
    markers: list[Marker]
    weak_markers: list[Marker]
    at_peak: Pair  # fig. 5
    at_peak_orbit: Orbit
    step_error: float  # of time integration: change of the amplitude with half the step
    norms: Norms
    timing: list[Timing]
    glued_model: Model
    glued: list[Peaks]
    glued_pairs: dict[float, list[Pair]]

    @property
    def every_pair(self) -> list[Pair]:
        """Pairs of all ratios."""
        return list(chain.from_iterable(self.pairs.values()))

    def strongest(self) -> Peaks:
        """Return the whole responses at the strong ratio."""
        return next(p for p in self.peaks if p.ratio == self.plan.strong)


def gather(model: Model, glued: Model, plan: Plan, say: Say) -> Evidence:
    """Compute everything, from the largest ratio to the smallest.

    Parameters
    ----------
    model, glued
        The example, and the damper whose flat side cannot slip.
    plan
        What is computed.
    say
        Takes a line of progress.
    """
    found: dict[float, list[Pair]] = {}
    lost: dict[float, list[float]] = {}
    for ratio in plan.ratios:
        say(f"errors at F_CL/F_HE = {ratio:g}")
        found[ratio], lost[ratio] = pairs(model, ratio, plan.hertz, plan.frequencies)
    peaks = []
    for ratio in plan.all_ratios:
        say(f"whole responses at {ratio:g}")
        peaks.append(whole(model, ratio, judged=ratio >= plan.periodic))
    strong = next(p for p in peaks if p.ratio == plan.strong)
    weak = next(p for p in peaks if p.ratio == plan.weak)
    say("motions in time")
    at_peak = min(found[plan.strong], key=lambda p: abs(p.hertz - strong.high.peak.omega / HZ))
    reference = orbit(model, at_peak.problem, at_peak.high)
    finer = orbit(model, at_peak.problem, at_peak.high, steps=2 * STEPS)
    timing = []
    for ratio in plan.timing_ratios:
        say(f"times at {ratio:g}")
        timing.append(timed(model, ratio, plan))
    glued_pairs: dict[float, list[Pair]] = {}
    whole_glued = []
    for ratio in (*plan.glued_ratios, *plan.glued_more):
        say(f"the second damper at {ratio:g}")
        whole_glued.append(whole(glued, ratio, judged=False))
        glued_pairs[ratio] = pairs(glued, ratio, plan.hertz, plan.frequencies)[0]
    return Evidence(
        plan, model, found, lost, peaks,
        markers_of(model, strong, found[plan.strong], plan),
        markers_of(model, weak, found[plan.weak], plan),
        at_peak, reference, abs(reference.amplitude / finer.amplitude - 1.0),
        norms_of(found, plan), timing, glued, whole_glued, glued_pairs,
    )  # fmt: skip


def whole(model: Model, ratio: float, judged: bool) -> Peaks:
    """Follow the response with few, with many and with the alert's harmonics."""
    low, high, alert = (
        curve(model, ratio, name) for name in ("always_low", "always_high", "jacobian_alert")
    )
    found = orbit(model, high.problem, high.peak) if judged else None
    return Peaks(ratio, low, high, alert, found)


def markers_of(model: Model, peaks: Peaks, known: Sequence[Pair], plan: Plan) -> list[Marker]:
    """Find the motions in time at frequencies around a peak, from the solutions with many harmonics there."""
    centre = peaks.high.peak.omega / HZ
    wanted = np.linspace(*(centre + np.array(plan.marker_hertz)), plan.markers)
    chosen: dict[float, Pair] = {}
    for hertz in wanted:
        pair = min(known, key=lambda p: abs(p.hertz - hertz))
        chosen[pair.hertz] = pair
    return [
        Marker(
            orbit(model, p.problem, p.high), p.problem.amplitude(p.high), p.problem.amplitude(p.low)
        )
        for p in chosen.values()
    ]


def norms_of(found: dict[float, list[Pair]], plan: Plan) -> Norms:
    """Return the block norms in full stick, at the worst weak pair below the threshold, and of ΔJ at the worst of all."""
    stuck = max(found[plan.ratios[0]], key=lambda p: p.problem.amplitude(p.low))
    weak = weakest_alarm(found)
    strong = max(found[plan.strong], key=lambda p: p.real)
    kept = strong.problem.low.harmonics

    def norms(pair: Pair, part: str) -> FloatArray:
        high = pair.problem.high
        x = high.unknowns(pair.low.coefficients)
        return harmonic_block_norms(
            high, x, pair.low.omega, part, kept if part == "missing" else None
        )

    return Norms(norms(stuck, "jacobian"), norms(weak, "jacobian"), norms(strong, "missing"))


def weakest_alarm(found: dict[float, list[Pair]]) -> Pair:
    """Return the pair with the largest predicted error that is still accepted."""
    every = list(chain.from_iterable(found.values()))
    quiet = [p for p in every if 0.0 < p.predicted < 0.05]
    return max(quiet or every, key=lambda p: p.predicted)


def timed(model: Model, ratio: float, plan: Plan) -> Timing:
    """Time the responses over the same frequencies; the quickest run counts, since the short ones are easily disturbed."""
    grid = plan.timing_hertz, plan.timing_frequencies
    low, high, alert = (
        min((curve(model, ratio, name, *grid) for _ in range(times)), key=lambda c: c.seconds)
        for name, times in (("always_low", 3), ("always_high", 1), ("jacobian_alert", 2))
    )
    again = curve(model, ratio, "jacobian_alert", *grid, threshold=-1.0)
    return Timing(ratio, low, high, alert, again, _around_peaks(model, low, high, alert))


def _around_peaks(model: Model, low: Curve, high: Curve, alert: Curve) -> tuple[Orbit, ...]:
    """Find the motions in time where a response peaks, and on both sides of the peak with many harmonics."""
    place = int(np.argmax(high.amplitudes))
    chosen: dict[float, ForcedPoint] = {
        p.omega: p for p in high.points[max(place - 1, 0) : place + 2]
    }
    for other in (low, alert):
        begin = nearest(high.points, other.peak.omega / HZ)
        if all(abs(begin.omega - omega) > 1e-9 * omega for omega in chosen):
            chosen[begin.omega] = begin
    return tuple(orbit(model, high.problem, p) for p in chosen.values())
