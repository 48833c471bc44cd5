"""What a forced response is asked for and what it consists of."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.compiled import Evaluator, check_evaluator
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.selection import Solve
from stickslip.response.system import System
from stickslip.solve.continuation import Following, Point, StepControl
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.newton import Newton, Solution
from stickslip.solve.status import Rung, Status

Selection = Literal["jacobian_alert", "always_low", "always_high"]
Stage = Literal["low", "high", "branch", "peak"]
# arc length: a quarter of the size of the vibration, or `1 / points` of the range
LARGEST_STEP = 0.25
FAINTEST = 1e-6  # excitation over static load: below, the residual tolerance swallows the vibration
ALERT_TOLERANCE = 1e-6  # relative residual of the alert's step where it is found by iteration
BRANCH_ITERATIONS = 10  # of a corrector along a branch
ALIKE = (
    0.25  # relative difference of two vibrations below which a branch has come back to the other
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """How a forced response is computed.

    Parameters
    ----------
    omega_range
        First and last excitation frequency, rad/s, in growing order.
    low, high
        Harmonics of the first passage and of the repeats; the static term is always kept.
    samples
        Samples per period of the contact forces.
    evaluator
        How piecewise-linear laws are evaluated; ``events`` has no sampling error, which would put small corners and folds into branches.
    threshold
        Predicted error (fraction) above which a frequency is repeated with `high`.
    selection
        ``jacobian_alert``, or the same number of harmonics at every frequency.
    points
        Smallest number of points of the first passage; more are taken where the response turns.
    frequencies
        Number of equally spaced frequencies to step through instead of following the branch by arc length; 0: arc length.
    peak_points
        Most points added to resolve the peak.
    newton
        Corrector options.
    """

    omega_range: tuple[float, float]
    low: int = 1
    high: int = 5
    samples: int = 256
    evaluator: Evaluator = "events"
    threshold: float = 0.05
    selection: Selection = "jacobian_alert"
    points: int = 40
    frequencies: int = 0
    peak_points: int = 12
    newton: Newton = Newton()  # noqa: RUF009  # frozen

    def __post_init__(self) -> None:
        first, last = self.omega_range
        if not 0.0 < first < last < np.inf:
            raise input_error(
                "Sweep.omega_range",
                f"must be positive and growing, got {first:g} to {last:g} rad/s",
                "Swap the two ends.",
            )
        check_evaluator(self.evaluator)
        if self.selection not in get_args(Selection):
            raise input_error(
                "Sweep.selection",
                f"{self.selection!r} is none of {', '.join(get_args(Selection))}",
                "'jacobian_alert' repeats where it matters.",
            )
        if np.isnan(self.threshold):
            raise input_error("Sweep.threshold", "is not a number", "0.05 is 5 %.")
        for name in ("samples", "points", "frequencies", "peak_points"):
            value, least = getattr(self, name), 0 if name in {"frequencies", "peak_points"} else 1
            if not isinstance(value, (int, np.integer)) or value < least:
                raise input_error(
                    f"Sweep.{name}",
                    f"must be an integer of at least {least}, got {value!r}",
                    "Give a count.",
                )
        if not 1 <= self.low <= self.high:
            raise input_error(
                "Sweep", f"harmonics low = {self.low}, high = {self.high}", "Give 1 <= low <= high."
            )

    @property
    def control(self) -> StepControl:
        """Step control of the branch: a step is at most a `points`-th of the range."""
        first, last = self.omega_range
        largest = 0.25
        return StepControl(
            scale=(last - first) / (self.points * largest), first=0.05, largest=largest
        )

    @property
    def first_order(self) -> int:
        """Harmonics of the first passage."""
        return self.high if self.selection == "always_high" else self.low


@dataclass(frozen=True, eq=False)
class ForcedPoint:
    """One frequency of a forced response: arrays and numbers only, so that it can be written down and given back.

    Attributes
    ----------
    stage
        ``low``: first passage; ``high``: repeated with more harmonics; ``branch``: on the branch with more harmonics, where
        repeats failed; ``peak``: added to resolve the peak.
    index
        Position in the stage; a ``high`` point has the index of the ``low`` point it repeats, a ``branch`` point that of the
        first repeat that it replaces.
    omega
        Frequency, rad/s.
    coefficients
        (order+1, n_retained) complex displacement of the retained coordinates, m.
    tangent, step, orientation
        Where the branch goes on (scaled); empty and 0 outside the first passage.
    status
        How the solver ended; a point that did not converge is no solution.
    iterations
        Newton steps.
    predicted_error
        Of the Jacobian Alert, as a fraction; NaN where it was not asked.
    seconds_contact, seconds_linear, seconds_total
        Time in contact forces, in factorisations, and in all.
    rescue
        What it took to find the solution.
    """

    stage: Stage
    index: int
    omega: float
    coefficients: ComplexArray
    tangent: FloatArray
    step: float
    status: Status
    iterations: int
    predicted_error: float
    seconds_contact: float
    seconds_linear: float
    seconds_total: float
    orientation: float = 0.0
    rescue: Rung = Rung.FULL_STEPS

    @property
    def order(self) -> int:
        """Harmonics kept at this point."""
        return int(self.coefficients.shape[0]) - 1

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


@dataclass(frozen=True, eq=False)
class ForcedProblem:
    """A system under a load, set up for both passages."""

    system: System
    sweep: Sweep
    low: HarmonicBalance
    high: HarmonicBalance

    @property
    def alert_dofs(self) -> IntArray:
        """Structure dofs over which the alert takes its error."""
        chosen = self.system.alert_outputs
        return self.system.outputs if chosen is None else self.system.outputs[chosen]

    @property
    def alert_solve(self) -> Solve:
        """Solver of the alert's enlarged system: that of Newton, but exact enough for an error of a thousandth."""
        return to_tolerance(self.sweep.newton.linear, ALERT_TOLERANCE).solve

    def balance(self, order: int) -> HarmonicBalance:
        """Return the periodic problem with `order` harmonics, one of the two."""
        return self.low if order == self.low.order else self.high

    def following(self, balance: HarmonicBalance) -> Following:
        """Return how a branch of `balance` is followed."""
        weights = np.ones(balance.size)
        # the static part is left out of the arc length, or it would hide the growth of the vibration
        weights[: balance.linear.n] = 0.0
        # along a branch a shorter step is cheaper than a long correction
        few = replace(
            self.sweep.newton,
            max_iterations=min(BRANCH_ITERATIONS, self.sweep.newton.max_iterations),
        )
        return Following(newton=few, control=self.sweep.control, weights=weights)

    def alerted(self, point: ForcedPoint) -> bool:
        """Whether the alert asks for more harmonics at a point of the first passage."""
        return point.converged and bool(point.predicted_error > self.sweep.threshold)

    def asks_again(self, point: ForcedPoint) -> bool:
        """Whether a point of the first passage is repeated: alerted, or not found although its neighbours may lead to it."""
        lost = not point.converged and self.sweep.selection != "always_low"
        return lost or self.alerted(point)

    def branch_point(self, point: ForcedPoint) -> Point:
        """Return a point of a branch as one that it goes on from."""
        x = self.balance(point.order).unknowns(point.coefficients)
        solution = Solution(x, point.status, 0, 0.0, 0.0, 0.0)
        return Point(x, point.omega, point.tangent, point.step, solution, point.orientation)

    def amplitude(self, point: ForcedPoint, output: int = 0) -> float:
        """First-harmonic amplitude of output number `output`, m."""
        motion = self.low.linear.recover(point.omega, point.coefficients)
        return float(np.abs(motion[1, self.system.outputs[output]]))


def forced_problem(system: System, load: HarmonicLoad, sweep: Sweep) -> ForcedProblem:
    """Set up the forced response of `system` under `load`."""
    top = max((h for h, f in load.harmonics.items() if np.any(f)), default=0)
    if top > sweep.first_order:
        raise input_error(
            "HarmonicLoad",
            f"excites harmonic {top}, but the first passage keeps {sweep.first_order}",
            f"Give Sweep(low={top}, high={max(top, sweep.high)}) or more.",
        )
    linear = system.condensed(load, sweep.high)
    low = harmonic_balance(
        linear, system.interface, sweep.first_order, sweep.samples, sweep.evaluator
    )
    dynamic = max(
        (float(np.max(np.abs(f), initial=0.0)) for f in load.harmonics.values()), default=0.0
    )
    if 0.0 < dynamic < FAINTEST * low.force_scale:
        raise input_error(
            "HarmonicLoad",
            f"the excitation of {dynamic:.3g} N is less than a millionth of the static load or preload of {low.force_scale:.3g} N, "
            "too faint for the tolerance of the solver",
            "Solve the stuck structure, which is linear, or raise the excitation.",
        )
    return ForcedProblem(system, sweep, low, low.with_order(sweep.high))


def accepted_pairs(points: Sequence[ForcedPoint]) -> list[tuple[ForcedPoint, ForcedPoint | None]]:
    """Return the points that make up the response, each with the low-order point it repeats or is.

    In the order of the branch: points of the first passage, their repeats in their place, and in place of a run of repeats that did not
    all converge the branch with many harmonics, where that reached the other side. Peak points come last.
    """
    low = [p for p in points if p.stage == "low"]
    high = {p.index: p for p in points if p.stage == "high"}
    kept: list[tuple[ForcedPoint, ForcedPoint | None]] = []
    passed = -1
    for first, last in runs_of_repeats(high):
        branch = branch_points(points, first, last)
        if reached(branch, low, last):
            kept += [(high.get(p.index, p), p) for p in low[passed + 1 : branch[0].index]]
            kept += [(p, None) for p in branch]
            passed = last
    kept += [(high.get(p.index, p), p) for p in low[passed + 1 :]]
    peak = [p for p in points if p.stage == "peak"]
    again = {p.omega: p for p in peak if p.converged}
    # a peak that was solved again with more harmonics takes the place of what it was
    kept = [
        (again.pop(p.omega) if p.omega in again and p.order < again[p.omega].order else p, low)
        for p, low in kept
    ]
    return kept + [(p, None) for p in peak if again.get(p.omega) is p or not p.converged]


def accepted_points(points: Sequence[ForcedPoint]) -> list[ForcedPoint]:
    """Return the points that make up the response; see `accepted_pairs`."""
    return [point for point, _ in accepted_pairs(points)]


def runs_of_repeats(high: Mapping[int, ForcedPoint]) -> list[tuple[int, int]]:
    """Return first and last index of each run of neighbouring repeats."""
    runs: list[tuple[int, int]] = []
    for index in sorted(high):
        if runs and index == runs[-1][1] + 1:
            runs[-1] = (runs[-1][0], index)
        else:
            runs.append((index, index))
    return runs


def branch_points(points: Sequence[ForcedPoint], first: int, last: int) -> list[ForcedPoint]:
    """Return the points of the branch with many harmonics through the run of repeats from `first` to `last`."""
    return [p for p in points if p.stage == "branch" and first <= p.index <= last]


def branch_end(low: Sequence[ForcedPoint], last: int) -> float:
    """Return the frequency at which such a branch ends: that of the next quiet point, or of the last one."""
    return low[min(last + 1, len(low) - 1)].omega


def reached(branch: Sequence[ForcedPoint], low: Sequence[ForcedPoint], last: int) -> bool:
    """Whether a branch came to its end: to the frequency of the next quiet point, and to its motion.

    Where the branch folds it may pass that frequency several times, on its way to the other sheets.
    """
    if not branch or not branch[-1].converged or branch[-1].omega != branch_end(low, last):
        return False
    if last + 1 >= len(low) or not low[last + 1].converged:
        return True
    quiet = low[last + 1].coefficients[1:]
    here = branch[-1].coefficients[1 : len(quiet) + 1]
    return bool(np.linalg.norm(here - quiet) <= ALIKE * np.linalg.norm(quiet))


def forced_point(
    balance: HarmonicBalance,
    solution: Solution,
    stage: Stage,
    index: int,
    omega: float,
    seconds: float,
) -> ForcedPoint:
    """Return a solution as a point of the response."""
    return ForcedPoint(
        stage, index, omega, balance.coefficients(solution.x), np.zeros(0), 0.0, solution.status, solution.iterations,
        np.nan, solution.seconds_contact, solution.seconds_linear, seconds, rescue=solution.rung,
    )  # fmt: skip
