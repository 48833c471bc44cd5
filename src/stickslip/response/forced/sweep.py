"""What a forced response is asked for and what it consists of."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.compiled import Evaluator, check_evaluator
from stickslip.contact.event_integrals import Events
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.selection import STRATEGIES, strategy_named
from stickslip.harmonic.selection.strategy import (
    ErrorMeasure,
    Solve,
    Step,
    Strategy,
    check_strategy,
)
from stickslip.harmonic.support import Harmonics, harmonics_of
from stickslip.response.system import System
from stickslip.solve.continuation import Following, Point, StepControl
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.newton_method import Newton, Solution
from stickslip.solve.status import Rung, Status

FIXED = ("always_low", "always_high")  # the same harmonics at every frequency
Passages = Literal["double", "single"]
Direction = Literal["up", "down"]
Stage = Literal["low", "high", "branch", "peak"]
# arc length: a quarter of the size of the vibration, or `1 / points` of the range
LARGEST_STEP = 0.25
FAINTEST = 1e-6  # excitation over static load: below, the residual tolerance swallows the vibration
ALERT_TOLERANCE = 1e-6  # relative residual of the alert's step where it is found by iteration
BRANCH_ITERATIONS = 10  # of a corrector along a branch


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """How a forced response is computed.

    Parameters
    ----------
    omega_range
        First and last excitation frequency, rad/s, in growing order.
    low, high
        Harmonics of the first passage and of the reference, that of the repeats: the highest of all, or a list such as (1, 3, 5).
        The static term is always kept.
    samples
        Samples per period of the contact forces.
    evaluator
        How piecewise-linear laws are evaluated; ``events`` has no sampling error, which would put small corners and folds into branches.
    threshold
        Predicted error (fraction) above which a frequency is repeated.
    selection
        Name of a strategy of `stickslip.harmonic.selection` (``guarded_alert``, the published ``jacobian_alert``, ...), one with parameters of your own, or the
        same harmonics at every frequency (``always_low``, ``always_high``).
    passages
        ``double``: finish the response with few harmonics first, then repeat what needs more; ``single``: settle each of
        the equally spaced frequencies before the next one. Strategies that foretell the harmonics of the next frequency always
        take the single one.
    error_harmonics
        Harmonics over which the predicted error is taken; None: those that the load drives.
    points
        Smallest number of points of the first passage; more are taken where the response turns.
    frequencies
        Number of equally spaced frequencies to step through instead of following the branch by arc length; 0: arc length.
    at
        Frequencies of your own to step through instead, rad/s, growing (falling too if the direction is ``down``), all in the range.
    direction
        ``up``: from the first frequency to the last; ``down``: from the last to the first, which finds other motions beside folds.
    peak_points
        Most points added to resolve the peak.
    newton
        Corrector options.
    """

    omega_range: tuple[float, float]
    low: int | Sequence[int] = 1
    high: int | Sequence[int] = 5
    samples: int = 256
    evaluator: Evaluator = "events"
    threshold: float = 0.05
    selection: str | Strategy = "guarded_alert"
    passages: Passages = "double"
    error_harmonics: Sequence[int] | None = None
    points: int = 40
    frequencies: int = 0
    at: tuple[float, ...] = ()
    direction: Direction = "up"
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
        if isinstance(self.selection, str) and self.selection not in (*STRATEGIES, *FIXED):
            raise input_error(
                "Sweep.selection",
                f"{self.selection!r} is none of {', '.join((*STRATEGIES, *FIXED))}",
                "'guarded_alert' repeats where it matters.",
            )
        if not isinstance(self.selection, str):
            check_strategy(self.selection)
        _check_steps(self)
        if self.passages not in get_args(Passages):
            raise input_error(
                "Sweep.passages",
                f"{self.passages!r} is none of {', '.join(get_args(Passages))}",
                "'double' repeats what needs more harmonics.",
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
        low, high = self.low_harmonics, self.high_harmonics
        if len(low) < 2 or not set(low) <= set(high):  # the static term and another
            raise input_error(
                "Sweep",
                f"harmonics low = {self.low}, high = {self.high}",
                "Give low at least harmonic 1, and high all of low and more.",
            )
        taken = self.error_harmonics
        if taken is not None and (len(taken) == 0 or not set(taken) <= set(low)):
            raise input_error(
                "Sweep.error_harmonics",
                f"are {taken}, the first passage keeps {', '.join(map(str, low))}",
                "A relative change needs harmonics that the first passage has; 0 is the static part.",
            )

    @property
    def low_harmonics(self) -> Harmonics:
        """Harmonics of the first passage."""
        return harmonics_of(self.low, "Sweep.low")

    @property
    def high_harmonics(self) -> Harmonics:
        """Harmonics of the reference."""
        return harmonics_of(self.high, "Sweep.high")

    @property
    def strategy(self) -> Strategy | None:
        """How harmonics are chosen; None where they are the same at every frequency."""
        if not isinstance(self.selection, str):
            return self.selection
        if self.selection in FIXED:
            return None
        strategy = strategy_named(self.selection)
        # the indicators of the others are no errors
        return strategy_named(self.selection, self.threshold) if strategy.verifies else strategy

    @property
    def single(self) -> bool:
        """Whether each frequency is settled before the next one."""
        strategy = self.strategy
        return strategy is not None and (self.passages == "single" or not strategy.verifies)

    @property
    def ends(self) -> tuple[float, float]:
        """Where the response begins and ends, rad/s, in the direction in which it is gone through."""
        first, last = self.omega_range
        return (first, last) if self.direction == "up" else (last, first)

    @property
    def forward(self) -> float:
        """1 where frequencies grow on the way, -1 where they fall."""
        return 1.0 if self.direction == "up" else -1.0

    @property
    def grid(self) -> FloatArray:
        """Frequencies to step through, rad/s, in their order; empty where the branch is followed by arc length."""
        return np.sort(self.at)[:: int(self.forward)] if self.at else self.spaced(self.frequencies)

    def spaced(self, count: int) -> FloatArray:
        """Return `count` equally spaced frequencies in the order of the way, rad/s."""
        return np.linspace(*self.omega_range, count)[:: int(self.forward)]

    @property
    def control(self) -> StepControl:
        """Step control of the branch: a step is at most a `points`-th of the range."""
        first, last = self.omega_range
        largest = 0.25
        return StepControl(
            scale=(last - first) / (self.points * largest), first=0.05, largest=largest
        )

    @property
    def first_harmonics(self) -> Harmonics:
        """Harmonics with which the first passage is made."""
        return self.high_harmonics if self.selection == "always_high" else self.low_harmonics


def _check_steps(sweep: Sweep) -> None:
    """Refuse frequencies that are no list to step through, and a direction that is none."""
    if sweep.direction not in get_args(Direction):
        raise input_error(
            "Sweep.direction",
            f"{sweep.direction!r} is none of {', '.join(get_args(Direction))}",
            "'up' goes from the first frequency to the last.",
        )
    if not sweep.at:
        return
    if sweep.frequencies:
        raise input_error("Sweep", "has both frequencies and at", "Give one of them.")
    first, last = sweep.omega_range
    steps = np.diff(sweep.at)
    inside = all(first <= omega <= last for omega in sweep.at)
    if not (inside and (np.all(steps > 0.0) or np.all(steps < 0.0))):
        raise input_error(
            "Sweep.at",
            f"must grow or fall strictly within {first:g} to {last:g} rad/s, got {len(sweep.at)} frequencies",
            "Sort them, leave out what is twice, and widen omega_range to hold them.",
        )
    if steps.size and steps[0] < 0.0 and sweep.direction == "up":
        raise input_error(
            "Sweep.at", "falls, and the direction is up", "Give direction='down', or sort it."
        )


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
        Indicator of the strategy: of an alert the predicted error, as a fraction; NaN where it was not asked.
    seconds_contact, seconds_linear, seconds_total
        Time in contact forces, in factorisations, and in all.
    rescue
        What it took to find the solution.
    harmonics
        Harmonics kept, growing from 0.
    asked
        Harmonics with which the strategy wants this frequency solved again; empty: none.
    start
        (H+1, n_retained) coefficients from which it is solved again, m; empty: the strategy has none, or asks for nothing.
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
    harmonics: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    asked: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    start: ComplexArray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))

    @property
    def order(self) -> int:
        """Highest harmonic kept at this point."""
        return int(self.coefficients.shape[0]) - 1

    @property
    def support(self) -> Harmonics:
        """Harmonics kept, as a tuple."""
        return tuple(int(h) for h in self.harmonics)

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
    others: dict[Harmonics, HarmonicBalance] = field(default_factory=dict)  # made when first needed

    @property
    def strategy(self) -> Strategy | None:
        """How harmonics are chosen; None where they are the same at every frequency."""
        return self.sweep.strategy

    @property
    def measure(self) -> ErrorMeasure:
        """What an error is taken of."""
        system, chosen = self.system, self.sweep.error_harmonics
        driven = tuple(h for h, f in sorted(self.low.linear.load.harmonics.items()) if np.any(f))
        dofs = system.outputs if system.alert_dofs is None else system.alert_dofs
        return ErrorMeasure(dofs, (driven or (1,)) if chosen is None else tuple(chosen))

    @property
    def alert_solve(self) -> Solve:
        """Solver of the alert's enlarged system: that of Newton, but exact enough for an error of a thousandth."""
        return to_tolerance(self.sweep.newton.linear, ALERT_TOLERANCE).solve

    def balance(self, harmonics: Harmonics) -> HarmonicBalance:
        """Return the periodic problem with these harmonics."""
        for own in (self.low, self.high):
            if own.harmonics == harmonics:
                return own
        if harmonics not in self.others:
            self.others[harmonics] = self.high.with_harmonics(harmonics)
        return self.others[harmonics]

    def step(
        self,
        balance: HarmonicBalance,
        x: FloatArray,
        omega: float,
        next_omega: float | None = None,
        left: Events | None = None,
    ) -> Step:
        """Return a scaled solution of `balance` as a strategy sees it, with the events that its evaluation `left`."""
        smallest = self.sweep.low_harmonics
        following = omega if next_omega is None else next_omega
        return Step(
            balance,
            self.high,
            smallest,
            x,
            omega,
            following,
            self.measure,
            self.alert_solve,
            left=left,
        )

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
        strategy = self.strategy
        return (
            strategy is not None
            and point.converged
            and bool(point.predicted_error > strategy.threshold)
        )

    def asks_again(self, point: ForcedPoint) -> bool:
        """Whether a point of the first passage is repeated: alerted, or not found although its neighbours may lead to it."""
        lost = not point.converged and self.sweep.selection != "always_low"
        return lost or self.alerted(point)

    def branch_point(self, point: ForcedPoint) -> Point:
        """Return a point of a branch as one that it goes on from."""
        x = self.balance(point.support).unknowns(point.coefficients)
        solution = Solution(x, point.status, 0, 0.0, 0.0, 0.0)
        return Point(x, point.omega, point.tangent, point.step, solution, point.orientation)

    def real_error(self, point: ForcedPoint, reference: ForcedPoint) -> float:
        """Return the largest relative error of a point against another at its frequency (eq. 29), a fraction."""
        linear = self.low.linear
        rows = min(len(point.coefficients), len(reference.coefficients))
        motion, exact = (
            linear.recover(point.omega, p.coefficients[:rows]) for p in (point, reference)
        )
        return self.measure.change(motion, exact - motion)[0]

    def amplitude(self, point: ForcedPoint, output: int = 0) -> float:
        """First-harmonic amplitude of output number `output`, m."""
        motion = self.low.linear.recover(point.omega, point.coefficients)
        return float(np.abs(motion[1, self.system.outputs[output]]))


def forced_problem(system: System, load: HarmonicLoad, sweep: Sweep) -> ForcedProblem:
    """Set up the forced response of `system` under `load`."""
    first, reference = sweep.first_harmonics, sweep.high_harmonics
    for h, force in load.harmonics.items():
        if h not in first and np.any(force):
            raise input_error(
                "HarmonicLoad",
                f"excites harmonic {h}, but the first passage keeps {', '.join(map(str, first))}",
                f"Give Sweep(low={h}, high={max(h, reference[-1])}) or more.",
            )
    linear = system.condensed(load, reference[-1])
    low = harmonic_balance(linear, system.interface, first, sweep.samples, sweep.evaluator)
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
    return ForcedProblem(system, sweep, low, low.with_harmonics(reference))


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
        harmonics=np.array(balance.harmonics),
    )  # fmt: skip
