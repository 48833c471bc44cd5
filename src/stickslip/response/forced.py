"""Forced response with the double-passage Jacobian Alert (Gastaldi & Berruti 2017, section 4.4).

First passage: the branch with few harmonics, each point with the error that the missing harmonics are predicted to make. Second
passage: the frequencies where that error exceeds the threshold, solved again with many harmonics from ``q + Δq``. Last, a few points
that resolve the resonance peak.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.selection import jacobian_alert
from stickslip.response.preload import bonded_start, preload
from stickslip.response.system import System
from stickslip.solve.continuation import Point, StepControl, start_point, step_to, trace
from stickslip.solve.newton import Newton, Solution, newton
from stickslip.solve.status import Status

Selection = Literal["jacobian_alert", "always_low", "always_high"]
Stage = Literal["low", "high", "peak"]
LOAD_SHARES = (
    0.05,
    0.1,
    0.2,
    0.4,
    0.6,
    0.8,
    1.0,
)  # excitation ramp where the first point does not converge at once
PEAK_RESOLUTION = 5e-4  # width of the bracket of the peak, relative to its frequency, at which it counts as resolved
RESTARTS = 10  # gaps that a branch may have before it is given up


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
    threshold: float = 0.05
    selection: Selection = "jacobian_alert"
    points: int = 40
    frequencies: int = 0
    peak_points: int = 12
    newton: Newton = Newton()  # noqa: RUF009  # frozen

    def __post_init__(self) -> None:
        first, last = self.omega_range
        if not 0.0 < first < last:
            raise input_error(
                "Sweep.omega_range",
                f"must be positive and growing, got {first:g} to {last:g} rad/s",
                "Swap the two ends.",
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
        ``low``: first passage; ``high``: repeated with more harmonics; ``peak``: added to resolve the peak.
    index
        Position in the stage; a ``high`` point has the index of the ``low`` point it repeats.
    omega
        Frequency, rad/s.
    coefficients
        (order+1, n_retained) complex displacement of the retained coordinates, m.
    tangent, step
        Where the branch goes on (scaled); empty and 0 outside the first passage.
    status
        How the solver ended; a point that did not converge is no solution.
    iterations
        Newton steps.
    predicted_error
        Of the Jacobian Alert, as a fraction; NaN where it was not asked.
    seconds_contact, seconds_linear, seconds_total
        Time in contact forces, in factorisations, and in all.
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

    @property
    def order(self) -> int:
        """Harmonics kept at this point."""
        return self.coefficients.shape[0] - 1

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

    def weights(self, balance: HarmonicBalance) -> FloatArray:
        """Weights of the arc length: the static part is left out, or it would hide the growth of the vibration."""
        weights = np.ones(balance.size)
        weights[: balance.linear.n] = 0.0
        return weights

    def amplitude(self, point: ForcedPoint, output: int = 0) -> float:
        """First-harmonic amplitude of output number `output`, m."""
        motion = self.low.linear.recover(point.omega, point.coefficients)
        return float(np.abs(motion[1, self.system.outputs[output]]))


def forced_problem(system: System, load: HarmonicLoad, sweep: Sweep) -> ForcedProblem:
    """Set up the forced response of `system` under `load`."""
    linear = condense(system.structure, system.retained, load)
    low = harmonic_balance(linear, system.interface, sweep.first_order, sweep.samples)
    return ForcedProblem(system, sweep, low, low.with_order(sweep.high))


def forced_response(
    system: System, load: HarmonicLoad, sweep: Sweep, done: Sequence[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Compute the steady forced response over a frequency range.

    Parameters
    ----------
    system
        Structure, contacts and outputs; the first output decides where the peak is.
    load
        Static and harmonic forces on all dofs, N.
    sweep
        Range, harmonics, alert.
    done
        Points of an interrupted run, in the order in which they came; none of them is computed again.

    Yields
    ------
    ForcedPoint
        Points not in `done`, as they are found.

    Raises
    ------
    SingularError
        If the static load finds no equilibrium.
    """
    problem = forced_problem(system, load, sweep)
    low = {p.index: p for p in done if p.stage == "low"}
    for point in _first_passage(problem, load, list(low.values())):
        low[point.index] = point
        yield point
    high = {p.index: p for p in done if p.stage == "high"}
    for index, point in low.items():
        if _alerted(problem, point) and index not in high:
            high[index] = _repeat(problem, point, _nearest_high(high, index))
            yield high[index]
    accepted = [high.get(i, p) for i, p in low.items()]
    yield from _resolve_peak(problem, accepted, [p for p in done if p.stage == "peak"])


def accepted_points(points: Sequence[ForcedPoint]) -> list[ForcedPoint]:
    """Return the points that make up the response: repeats in place of the points they repeat, then peak points."""
    high = {p.index: p for p in points if p.stage == "high"}
    kept = [high.get(p.index, p) for p in points if p.stage == "low"]
    return kept + [p for p in points if p.stage == "peak"]


def _alerted(problem: ForcedProblem, point: ForcedPoint) -> bool:
    return point.converged and bool(point.predicted_error > problem.sweep.threshold)


# ---- first passage ----------------------------------------------------------------------------------------------------


def _first_passage(
    problem: ForcedProblem, load: HarmonicLoad, done: list[ForcedPoint]
) -> Iterator[ForcedPoint]:
    balance, sweep = problem.low, problem.sweep
    weights = problem.weights(balance)
    end = sweep.omega_range[1]
    index = len(done)
    if done:
        start = _as_branch_point(balance, done[-1])
    else:
        began = perf_counter()
        start = _first_point(problem, load, sweep.omega_range[0])
        yield _low_point(problem, start, index, began)
        index += 1
    restarts = sum(not p.converged for p in done)
    while start.p < end and restarts <= RESTARTS:
        began = perf_counter()
        for point in _steps(balance, start, sweep, weights):
            yield _low_point(problem, point, index, began)
            index += 1
            start = point
            began = perf_counter()
        if start.p < end:
            # the branch is lost here: take it up again a little further on
            omega = min(start.p + sweep.control.largest * sweep.control.scale, end)
            start = _first_point(problem, load, omega)
            yield _low_point(problem, start, index, began)
            index += 1
            restarts += 1


def _steps(
    balance: HarmonicBalance, start: Point, sweep: Sweep, weights: FloatArray
) -> Iterator[Point]:
    first, last = sweep.omega_range
    if not sweep.frequencies:
        yield from trace(
            balance, start, last, options=sweep.newton, control=sweep.control, weights=weights
        )
        return
    for omega in np.linspace(first, last, sweep.frequencies):
        if omega > start.p:
            start = step_to(balance, start, float(omega), sweep.newton, sweep.control, weights)
            yield start
            if not start.solution.status.converged:
                return


def _first_point(problem: ForcedProblem, load: HarmonicLoad, omega: float) -> Point:
    """Solve from the static equilibrium plus the bonded vibration; ramp the excitation if that is too far away."""
    balance, sweep = problem.low, problem.sweep
    weights = problem.weights(balance)
    bonded = balance.coefficients(bonded_start(balance, omega, problem.system))
    guess = bonded.copy()
    guess[0] = preload(problem.system, load.static)
    point = start_point(
        balance, balance.unknowns(guess), omega, sweep.newton, sweep.control, weights
    )
    if point.solution.status.converged:
        return point
    x = balance.unknowns(np.concatenate([guess[:1], LOAD_SHARES[0] * guess[1:]]))
    for share in LOAD_SHARES:
        ramped = HarmonicLoad(load.static, {h: share * f for h, f in load.harmonics.items()})
        eased = replace(balance, linear=balance.linear.with_load(ramped))
        point = start_point(eased, x, omega, sweep.newton, sweep.control, weights)
        x = point.x
    return point


def _low_point(problem: ForcedProblem, point: Point, index: int, began: float) -> ForcedPoint:
    error, seconds = np.nan, 0.0
    if point.solution.status.converged and problem.sweep.selection == "jacobian_alert":
        alert = jacobian_alert(problem.low, problem.high, point.x, point.p, problem.alert_dofs)
        error, seconds = alert.error, alert.seconds_contact
    made = _forced_point(problem.low, point.solution, "low", index, point.p, perf_counter() - began)
    return replace(
        made,
        tangent=point.tangent,
        step=point.step,
        predicted_error=error,
        seconds_contact=made.seconds_contact + seconds,
    )


def _as_branch_point(balance: HarmonicBalance, point: ForcedPoint) -> Point:
    x = balance.unknowns(point.coefficients)
    return Point(
        x, point.omega, point.tangent, point.step, Solution(x, point.status, 0, 0.0, 0.0, 0.0)
    )


def _forced_point(
    balance: HarmonicBalance,
    solution: Solution,
    stage: Stage,
    index: int,
    omega: float,
    seconds: float,
) -> ForcedPoint:
    return ForcedPoint(
        stage, index, omega, balance.coefficients(solution.x), np.zeros(0), 0.0, solution.status, solution.iterations,
        np.nan, solution.seconds_contact, solution.seconds_linear, seconds,
    )  # fmt: skip


# ---- second passage ---------------------------------------------------------------------------------------------------


def _nearest_high(high: dict[int, ForcedPoint], index: int) -> ForcedPoint | None:
    converged = [p for p in high.values() if p.converged]
    return min(converged, key=lambda p: abs(p.index - index), default=None)


def _repeat(
    problem: ForcedProblem, point: ForcedPoint, neighbour: ForcedPoint | None
) -> ForcedPoint:
    """Solve a frequency with more harmonics: from q + Δq, from q, or along the branch from a repeated neighbour."""
    began = perf_counter()
    balance, options = problem.high, problem.sweep.newton
    x_low = problem.low.unknowns(point.coefficients)
    alert = jacobian_alert(problem.low, balance, x_low, point.omega, problem.alert_dofs)
    spent: list[Solution] = []
    for start in (alert.start, balance.unknowns(point.coefficients)):
        spent.append(newton(lambda v: balance.linearise(v, point.omega), start, options))
        if spent[-1].status.converged:
            break
    if not spent[-1].status.converged and neighbour is not None:
        spent.append(_along_branch(problem, neighbour, point.omega))
    made = _forced_point(
        balance, spent[-1], "high", point.index, point.omega, perf_counter() - began
    )
    return replace(
        made,
        iterations=sum(s.iterations for s in spent),
        seconds_contact=sum(s.seconds_contact for s in spent) + alert.seconds_contact,
        seconds_linear=sum(s.seconds_linear for s in spent),
        predicted_error=point.predicted_error,
    )


def _along_branch(problem: ForcedProblem, point: ForcedPoint, omega: float) -> Solution:
    balance, sweep = problem.high, problem.sweep
    weights = problem.weights(balance)
    x = balance.unknowns(point.coefficients)
    start = start_point(balance, x, point.omega, sweep.newton, sweep.control, weights)
    return step_to(balance, start, omega, sweep.newton, sweep.control, weights).solution


# ---- peak -------------------------------------------------------------------------------------------------------------


def _resolve_peak(
    problem: ForcedProblem, accepted: list[ForcedPoint], done: list[ForcedPoint]
) -> Iterator[ForcedPoint]:
    """Add points at the vertex of the parabola through the highest point and its neighbours on the branch."""
    known = [p for p in accepted if p.converged]
    heights = [problem.amplitude(p) for p in known]
    for index in range(problem.sweep.peak_points):
        omega = _vertex(known, heights)
        if omega is None:
            return
        top = int(np.argmax(heights))
        if index < len(done):
            point = done[index]
        else:
            point = _peak_point(problem, known[top], omega, index)
            yield point
        if not point.converged:
            return
        place = top if omega < known[top].omega else top + 1
        known.insert(place, point)
        heights.insert(place, problem.amplitude(point))


def _vertex(known: list[ForcedPoint], heights: list[float]) -> float | None:
    """Where to look next for the peak; None when it is resolved, at the ends of the branch, or where it folds."""
    top = int(np.argmax(heights)) if heights else 0
    if top in (0, len(known) - 1):
        return None
    a, b, c = (known[i].omega for i in (top - 1, top, top + 1))
    u, v, w = (heights[i] for i in (top - 1, top, top + 1))
    if not a < b < c or c - a < PEAK_RESOLUTION * b:
        return None
    below, above = (b - a) * (v - w), (b - c) * (v - u)
    # a kink holds the parabola on one side of the peak: halve the other side once it is three times as wide
    if max(c - b, b - a) > 3.0 * min(c - b, b - a) or below == above:
        return 0.5 * (b + c) if c - b > b - a else 0.5 * (a + b)
    return float(b - 0.5 * ((b - a) * below - (b - c) * above) / (below - above))


def _peak_point(problem: ForcedProblem, top: ForcedPoint, omega: float, index: int) -> ForcedPoint:
    began = perf_counter()
    sweep = problem.sweep
    balance = problem.low if top.order == problem.low.order else problem.high
    weights = problem.weights(balance)
    start = start_point(
        balance, balance.unknowns(top.coefficients), top.omega, sweep.newton, sweep.control, weights
    )
    point = step_to(balance, start, omega, sweep.newton, sweep.control, weights)
    if balance is problem.low:
        made = replace(
            _low_point(problem, point, index, began), stage="peak", tangent=np.zeros(0), step=0.0
        )
        if not _alerted(problem, made):
            return made
        repeated = _repeat(problem, made, None)
        return replace(repeated, stage="peak", seconds_total=perf_counter() - began)
    return _forced_point(balance, point.solution, "peak", index, omega, perf_counter() - began)
