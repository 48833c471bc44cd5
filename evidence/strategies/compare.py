"""All strategies of harmonic selection on the same cases in one process: what each costs, and how wrong it is.

``python -m evidence.strategies compare`` goes through the frequencies of the four cases with every strategy, holds what is accepted against
the solution with twice the harmonics of the reference, and writes ``docs/strategies.md`` and its figure.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from time import process_time

import numpy as np

from evidence.strategies.cases import CASES, SelectionCase
from evidence.strategies.truth import judging_problem, reference_points
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.strategy import Strategy
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.choices import Passages
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_point
from stickslip.response.forced.response import forced_response
from stickslip.solve.newton_method import Newton, newton

THRESHOLD = 0.05
LONG = 1.0  # s of CPU time after which a run is not timed again; the fastest counts
RUNS = 3  # at most
WARM = 3  # frequencies of a run that is not timed, so that everything is compiled
FEW, MANY = "always_low", "always_high"
PUBLISHED = "jacobian_alert"
FLOOR = 1e-4  # errors below are drawn at this level
NEWTON = Newton(max_iterations=25)


@dataclass(frozen=True)
class Entry:
    """A strategy and how it goes through the frequencies."""

    selection: str
    passages: Passages = "double"
    own: Strategy | None = None  # with other parameters than those of its name
    keys: str = ""  # which, in tables

    @property
    def title(self) -> str:
        """Name in tables."""
        if self.own is not None:
            return f"{self.selection}, {self.keys}"
        return f"{self.selection}, single" if self.passages == "single" else self.selection


@dataclass(frozen=True)
class Outcome:
    """What a strategy did on a case.

    Attributes
    ----------
    entry
        The strategy.
    unknowns, iterations, seconds
        Harmonic-unknowns solved, summed over all solves; Newton steps; CPU time, s.
    lost
        Frequencies without a solution.
    at_peak, largest
        Error (eq. 29) where the judge has its resonance, and the largest one; fractions, NaN where there is no solution.
    missed
        Accepted solutions with an error above the threshold.
    false
        Accepted solutions with more harmonics than the first passage where its solution is within the threshold.
    turns
        Times that the harmonics change from one frequency to the next.
    """

    entry: Entry
    unknowns: int
    iterations: int
    seconds: float
    lost: int
    at_peak: float
    largest: float
    missed: int
    false: int
    turns: int


@dataclass(frozen=True)
class Comparison:
    """All strategies on one case."""

    case: SelectionCase
    outcomes: tuple[Outcome, ...]
    unjudged: int  # frequencies without a solution of the judge

    def of(self, selection: str) -> Outcome:
        """Return the outcome of the first entry with a selection."""
        return next(o for o in self.outcomes if o.entry.selection == selection)


def entries() -> list[Entry]:
    """Return all strategies: the same harmonics everywhere, those that verify, and those that foretell or step up."""
    deciding = [n for n in STRATEGIES if n not in (FEW, MANY)]
    verifying = [n for n in deciding if strategy_named(n).verifies]
    others = sorted(n for n in deciding if n not in verifying)
    doubles = [Entry(n) for n in verifying]
    return [Entry(FEW), Entry(MANY), *doubles, Entry(PUBLISHED, "single"), *map(Entry, others)]


def compared(case: SelectionCase, chosen: Sequence[Entry] = ()) -> Comparison:
    """Run every strategy, or those `chosen` (the first keeps few harmonics everywhere), on a case and judge it."""
    judge = _Judge(case)
    runs = [(entry, *_timed(case, entry)) for entry in chosen or entries()]
    few = [judge.error(p) for p in accepted_points(runs[0][1])]
    outcomes = [_outcome(judge, few, *run) for run in runs]
    return Comparison(case, tuple(outcomes), sum(not p.converged for p in judge.references))


def _timed(case: SelectionCase, entry: Entry) -> tuple[list[ForcedPoint], float]:
    """Return all points that a strategy solves, and the CPU time of its fastest run."""
    sweep = case.sweep(selection=entry.own or entry.selection, passages=entry.passages)
    list(forced_response(case.system, case.load, replace(sweep, frequencies=WARM)))
    points: list[ForcedPoint] = []
    seconds: list[float] = []
    while len(seconds) < RUNS and sum(seconds) < LONG:
        began = process_time()
        points = list(forced_response(case.system, case.load, sweep))
        seconds.append(process_time() - began)
    return points, min(seconds)


class _Judge:
    """The solutions with twice the harmonics of the reference, and errors against them."""

    def __init__(self, case: SelectionCase) -> None:
        self.case = case
        self.problem: ForcedProblem = judging_problem(case)
        self.references = reference_points(case)
        found = [i for i, p in enumerate(self.references) if p.converged]
        self.peak = max(found, key=lambda i: self.problem.amplitude(self.references[i]))
        self._nearest: dict[tuple[float, str], float] = {}

    def error(self, point: ForcedPoint) -> float:
        """Return the error of a solution: against the judge's branch, or where that is far against its solution nearest to this one."""
        if not point.converged:
            return np.nan
        reference = next(p for p in self.references if p.omega == point.omega)
        error = self.problem.real_error(point, reference) if reference.converged else np.inf
        if error <= THRESHOLD:
            return error
        # the same solution, as Newton's method leaves it
        key = (point.omega, f"{point.support} {self.problem.amplitude(point):.4e}")
        if key not in self._nearest:
            self._nearest[key] = self._beside(point)
        return min(error, self._nearest[key])

    def _beside(self, point: ForcedPoint) -> float:
        """Return the error against the judge's solution that Newton's method finds from this one; infinite where it finds none."""
        many = self.problem.high
        start = many.unknowns(point.coefficients)
        found = newton(lambda v: many.linearise(v, point.omega), start, NEWTON)
        if not found.status.converged:
            return np.inf
        exact = forced_point(many, found, "high", point.index, point.omega, 0.0)
        return self.problem.real_error(point, exact)


def _outcome(
    judge: _Judge, few: Sequence[float], entry: Entry, points: Sequence[ForcedPoint], seconds: float
) -> Outcome:
    smallest = len(judge.problem.low.harmonics)
    accepted = accepted_points(points)
    by_omega = {p.omega: p for p in accepted}
    errors = np.array([judge.error(p) for p in accepted])
    # a branch may pass a frequency several times: the low-order solution at it tells whether more was needed
    needless = {r.omega for r, e in zip(judge.references, few, strict=True) if e <= THRESHOLD}
    more = [p for p in accepted if p.converged and p.harmonics.size > smallest]
    supports = [p.support for p in accepted]
    top = by_omega.get(judge.references[judge.peak].omega)
    return Outcome(
        entry,
        unknowns=sum(p.unknowns for p in points),
        iterations=sum(p.iterations for p in points),
        seconds=seconds,
        lost=sum(not p.converged for p in accepted),
        at_peak=np.nan if top is None else judge.error(top),
        largest=float(np.nanmax(errors, initial=0.0)),
        missed=int(np.sum(errors > THRESHOLD)),
        false=sum(p.omega in needless for p in more),
        turns=sum(a != b for a, b in pairwise(supports)),
    )


def run(say: Callable[[str], None] = print) -> list[Comparison]:
    """Compare on all cases, and tell of each."""
    found = []
    for made in CASES.values():
        comparison = compared(made())
        found.append(comparison)
        for o in comparison.outcomes:
            say(f"{comparison.case.name:18} {o}")
    return found
