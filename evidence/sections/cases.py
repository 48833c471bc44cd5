"""What is solved: peaks of three motions with 1 to 15 sections, with more lines, and with other ways to share the stiffness."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from time import process_time
from typing import Any, Literal

import numpy as np
import scipy.optimize

from evidence.models.two_blades import TwoBlades
from evidence.sections.model import blades_with, example
from stickslip.arrays import FloatArray, IntArray
from stickslip.assembly.build import static_state
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import ForcedPoint, forced_problem
from stickslip.response.forced.response import forced_response

SECTIONS = (1, 2, 3, 5, 7, 9, 11, 15)
MOST = SECTIONS[-1]
EXAMPLE = 3  # sections, as in the paper
FEWER = (1, 3, 7, 15)  # sections that are solved with harmonics by need, too, and with stiffness per point
LINES = (2, 3, 5, 9)  # of the flat side, in the middles of equal strips
UNEVEN = 7  # sections that crowd at one end
OFF = 1 / 6  # of the length: how far from the middle the pull acts; there the pressure at the other end would vanish
SWEPT = {"bending": (0.95, 1.02), "leaning": (0.9, 1.02), "lines": (0.9, 1.02)}  # over the lowest stuck frequency
TORSION = (1350.0, 1600.0)  # Hz
POINTS, PEAK_POINTS = 24, 20  # of a sweep
ORDERS, FITS = (0.1, 6.0), 0.2  # of convergence that are looked for; misfit that is let pass
HZ = 2 * np.pi
Kept = Literal["5", "auto"]
Say = Callable[[str], None]


@dataclass(frozen=True)
class Case:
    """A motion.

    Attributes
    ----------
    name, title
        A word, and the words of tables.
    ratios
        Static over harmonic load.
    kept
        Harmonics.
    """

    name: str
    title: str
    ratios: tuple[float, ...]
    kept: tuple[Kept, ...] = ("5",)

    @property
    def changed(self) -> dict[str, Any]:
        """Keys of the study that differ."""
        if self.name == "torsion":
            return {"load.shaker.on": "blades.edge1", "output.peak": "edge1.x"}
        if self.name == "leaning":
            study, patch = example()
            damper: Any = study.tables.part["damper"]
            x, y, z = damper.centre_m
            return {"part.damper.centre_m": [x, y + OFF * patch.length, z]}
        return {}

    def hertz(self, blades: TwoBlades) -> tuple[float, float]:
        """Return the range that is swept."""
        if self.name == "torsion":
            return TORSION
        lowest = float(blades.question.model.frequencies.stuck_reduced[0])
        low, high = SWEPT[self.name]
        return low * lowest, high * lowest


CASES = (
    Case("bending", "bending", (20.0, 5.0), ("5", "auto")),
    Case("leaning", "bending, the pull a sixth of the length off the middle", (20.0, 5.0)),
    Case("torsion", "torsion of the airfoils", (20.0, 5.0)),
)


@dataclass(frozen=True, eq=False)
class Peak:
    """A resonance with so many contact points.

    Attributes
    ----------
    count
        Of sections, or of lines.
    hertz, metres
        Of the peak.
    curve
        (2, k) frequencies in Hz and amplitudes in m, as a line joins them.
    lost
        Points of the sweep that were not found.
    highest
        Harmonic of all accepted points.
    seconds
        CPU time of the sweep.
    """

    count: int
    hertz: float
    metres: float
    curve: FloatArray
    lost: int
    highest: int
    seconds: float


def peak(blades: TwoBlades, case: Case, ratio: float, kept: Kept, count: int) -> Peak:
    """Sweep through the resonance; refuse a sweep whose peak is at its end."""
    low, high = case.hertz(blades)
    five: dict[str, Any] = {"low": 5, "high": 5, "selection": "always_high"}
    how = five if kept == "5" else {"high": "auto"}
    sweep = replace(blades.sweep, omega_range=(HZ * low, HZ * high), points=POINTS, peak_points=PEAK_POINTS, **how)
    load, begun = blades.load(ratio), process_time()
    solved = list(forced_response(blades.system, load, sweep))
    seconds = process_time() - begun
    found = [p for p in accepted_points(solved) if p.converged]
    of = blades.question.model.peak_output
    problem = forced_problem(blades.system, load, sweep)
    amplitudes = np.array([problem.amplitude(p, of) for p in found])
    hertz = np.array([p.omega for p in found]) / HZ
    top = int(np.argmax(amplitudes))
    if hertz[top] in (hertz.min(), hertz.max()):
        raise SystemExit(
            f"{case.name}, ratio {ratio:g}, {count}: the peak is at the end of {low:.5g} to {high:.5g} Hz; widen the range in evidence/sections/cases.py"
        )
    return Peak(
        count,
        float(hertz[top]),
        float(amplitudes[top]),
        np.array([hertz, amplitudes])[:, _in_line(found)],
        sum(not p.converged for p in solved),
        max(len(p.coefficients) - 1 for p in found),
        seconds,
    )


def _in_line(points: list[ForcedPoint]) -> IntArray:
    """Return the order in which a line joins points: by frequency, or along the branch alone where that turns back."""
    branch = np.flatnonzero([p.stage != "peak" for p in points])
    omega = np.array([p.omega for p in points])
    return branch if np.any(np.diff(omega[branch]) <= 0.0) else np.argsort(omega)


@dataclass(frozen=True, eq=False)
class Series:
    """The same motion with growing numbers of points."""

    case: Case
    ratio: float
    kept: Kept
    peaks: tuple[Peak, ...]

    def of(self, count: int) -> Peak:
        """Return the peak with so many."""
        return next(p for p in self.peaks if p.count == count)

    @property
    def counts(self) -> tuple[int, ...]:
        """How many points there are."""
        return tuple(p.count for p in self.peaks)

    def off(self, count: int) -> tuple[float, float]:
        """Return by which fractions amplitude and frequency differ from those with the most."""
        one, best = self.of(count), self.peaks[-1]
        return one.metres / best.metres - 1, one.hertz / best.hertz - 1

    def order(self, which: int, start: int = 3) -> float:
        """Return the order p with which amplitude (0) or frequency (1) converge: differences from the most are ``a (n^-p - most^-p)``.

        Found by least squares from `start` sections on; NaN where they do not fit such a law within a fifth.
        """
        n = np.array([float(count) for count in self.counts if count >= start])
        off = np.array([self.off(int(count))[which] for count in n])

        def misfit(p: float) -> float:
            shape = n**-p - n[-1] ** -p
            return float(np.linalg.norm(off - shape * (shape @ off) / (shape @ shape)))

        found = scipy.optimize.minimize_scalar(misfit, bounds=ORDERS, method="bounded")
        fits = found.fun < FITS * np.linalg.norm(off) and found.x < 0.99 * ORDERS[1]
        return float(found.x) if fits else np.nan


@dataclass(frozen=True, eq=False)
class Found:
    """All that the page tells.

    Attributes
    ----------
    series
        Stiffness per area, growing numbers of sections.
    per_point
        Stiffness per point: of bending with the least ratio.
    lines
        Growing numbers of lines on the flat side, with the example's sections.
    uneven
        Crowded sections: of stiffness per area, and of the whole side's in equal parts.
    resultant
        Of the flat side with the example's lines: where it acts, m from the apex.
    """

    series: tuple[Series, ...]
    per_point: Series
    lines: tuple[Series, ...]
    uneven: tuple[Peak, Peak]
    resultant: float

    def get(self, name: str, ratio: float, kept: Kept = "5") -> Series:
        """Return a series."""
        return next(s for s in self.series if (s.case.name, s.ratio, s.kept) == (name, ratio, kept))

    @property
    def strong(self) -> Series:
        """Bending with the least ratio, five harmonics."""
        return self.get("bending", min(CASES[0].ratios))


def resultant(blades: TwoBlades) -> float:
    """Return how far from the apex, m, the resultant normal force of the flat side acts at rest."""
    model = blades.question.model
    _, force = static_state(blades.system, model.load.static)
    damper: Any = example()[0].tables.part["damper"]
    away = np.linalg.norm(model.contacts.position[:, [0, 2]] - damper.apex_m, axis=1)
    normal = np.where(np.array(model.contacts.groups) == "flat", -force[:, 2], 0.0)
    return float(normal @ away / normal.sum())


MORE_LINES = Case("lines", "bending", (20.0,))


def solve(say: Say) -> Found:
    """Solve all of it."""
    _, patch = example()
    bending = CASES[0]
    strong = min(bending.ratios)
    series = [s for case in CASES for s in _of_case(case, say)]

    def told(what: str, made: Peak) -> Peak:
        say(f"{what}: {made.hertz:.3f} Hz, {1e6 * made.metres:.3f} um, {made.seconds:.1f} s")
        return made

    at = partial(peak, case=bending, kept="5")
    per_point = tuple(
        told(f"per point, {n}", at(blades_with(patch.sections(n), per="point"), ratio=strong, count=n)) for n in FEWER
    )
    sections = patch.sections(EXAMPLE)
    more = [(n, blades_with(sections, patch.lines(n))) for n in LINES]
    lines = tuple(
        Series(
            MORE_LINES,
            ratio,
            "5",
            tuple(told(f"{n} lines", peak(blades, MORE_LINES, ratio, "5", n)) for n, blades in more),
        )
        for ratio in MORE_LINES.ratios
    )
    crowded = patch.crowded(UNEVEN)
    ways = [blades_with(crowded, per=per) for per in ("area", "interface")]
    uneven = [told("crowded", peak(way, MORE_LINES, strong, "5", UNEVEN)) for way in ways]
    return Found(
        tuple(series), Series(bending, strong, "5", per_point), lines, (uneven[0], uneven[1]), resultant(ways[0])
    )


def _of_case(case: Case, say: Say) -> Iterator[Series]:
    """Solve a motion with all numbers of sections."""
    peaks: dict[tuple[float, Kept], list[Peak]] = {(r, k): [] for r in case.ratios for k in case.kept}
    for count in SECTIONS:
        blades = blades_with(example()[1].sections(count), **case.changed)
        for (ratio, kept), own in peaks.items():
            if kept == "auto" and count not in FEWER:
                continue
            own.append(peak(blades, case, ratio, kept, count))
            last = own[-1]
            say(
                f"{case.name}, ratio {ratio:g}, H = {kept}, {count} sections: {last.hertz:.3f} Hz, {1e6 * last.metres:.3f} um, "
                f"{last.lost} lost, up to {last.highest}, {last.seconds:.1f} s"
            )
    for (ratio, kept), own in peaks.items():
        yield Series(case, ratio, kept, tuple(own))
