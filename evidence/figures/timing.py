"""What responses cost (fig. 7b): counts, which are the same in every run, and CPU times of interleaved repeats with their spread."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from evidence.figures.model import Model, Plan
from evidence.figures.solve import HZ, Curve, Orbit, curve, nearest, orbit
from stickslip.arrays import FloatArray
from stickslip.response import ForcedPoint

NAMES = {"low": "always_low", "high": "always_high", "alert": "jacobian_alert"}
LEAST = 0.25  # of a median: beside other work the same counts took 43 % in one run and 53 % in the next, with quartiles of 7 % in each


class Share(NamedTuple):
    """Quotient of two times: median of the repeats, and quartiles, at least `LEAST` from it."""

    median: float
    first: float
    last: float

    def said(self) -> str:
        """Return it in per cent with its spread."""
        return f"{100 * self.median:.0f} % ({100 * self.first:.0f} to {100 * self.last:.0f})"


@dataclass(frozen=True, eq=False)
class Timing:
    """Responses over the same few frequencies, and the motions in time near their peaks.

    Attributes
    ----------
    repeated_all
        A double passage that repeats every frequency.
    seconds
        CPU times of the repeats of each response, in the order in which they were run, one of each after the other.
    orbits
        Motions in time where a response peaks.
    """

    ratio: float
    low: Curve
    high: Curve
    alert: Curve
    repeated_all: Curve
    seconds: dict[str, FloatArray]
    orbits: tuple[Orbit, ...]

    @property
    def reference(self) -> float:
        """Largest amplitude in time, m; NaN if there is none."""
        return max((o.amplitude for o in self.orbits if o.found), default=np.nan)

    @property
    def reference_hertz(self) -> float:
        """Its frequency, Hz."""
        known = [o for o in self.orbits if o.found]
        return max(known, key=lambda o: o.amplitude).hertz if known else np.nan

    @property
    def periodic(self) -> bool:
        """Whether all the motions in time are periodic."""
        return bool(self.orbits) and all(o.found for o in self.orbits)

    @property
    def whole(self) -> bool:
        """Whether every frequency was found in all responses."""
        return not any(c.lost for c in (self.low, self.high, self.alert))

    @property
    def repeats(self) -> int:
        """Frequencies that the alert has solved again."""
        return len({p.index for p in self.alert.solved if p.stage == "high"})

    def error(self, which: str) -> float:
        """Return the signed error of the peak of ``low``, ``high`` or ``alert``, a fraction."""
        response: Curve = getattr(self, which)
        return float(response.amplitudes.max() / self.reference - 1.0)

    def median(self, which: str) -> float:
        """Return the median CPU time of a response, s."""
        return float(np.median(self.seconds[which]))

    def share(self, one: str, other: str) -> Share:
        """Return the time of one response over that of another, repeat by repeat."""
        quotient = self.seconds[one] / self.seconds[other]
        first, median, last = np.quantile(quotient, (0.25, 0.5, 0.75))
        return Share(float(median), float(min(first, (1 - LEAST) * median)), float(max(last, (1 + LEAST) * median)))


def timed(model: Model, ratio: float, plan: Plan) -> Timing:
    """Compute the responses over the same frequencies again and again, and the motions in time at their peaks."""
    grid = plan.timing_hertz, plan.timing_frequencies
    runs: dict[str, list[Curve]] = {which: [] for which in (*NAMES, "repeated_all")}
    for _ in range(plan.repeats):
        for which, name in NAMES.items():
            runs[which].append(curve(model, ratio, name, *grid))
        runs["repeated_all"].append(curve(model, ratio, "jacobian_alert", *grid, threshold=-1.0))
    seconds = {which: np.array([c.seconds for c in found]) for which, found in runs.items()}
    low, high, alert, again = (found[0] for found in runs.values())
    return Timing(ratio, low, high, alert, again, seconds, _around_peaks(model, low, high, alert))


def _around_peaks(model: Model, low: Curve, high: Curve, alert: Curve) -> tuple[Orbit, ...]:
    """Find the motions in time where a response peaks, and on both sides of the peak with many harmonics."""
    place = int(np.argmax(high.amplitudes))
    chosen: dict[float, ForcedPoint] = {p.omega: p for p in high.points[max(place - 1, 0) : place + 2]}
    for other in (low, alert):
        begin = nearest(high.points, other.peak.omega / HZ)
        if all(abs(begin.omega - omega) > 1e-9 * omega for omega in chosen):
            chosen[begin.omega] = begin
    return tuple(orbit(model, high.problem, p) for p in chosen.values())
