"""Direct tracking of resonance peaks over a design parameter, without a sweep for each value.

Each peak is the solution of one equation (see `harmonic.peak`), started from the previous peaks. A damper optimisation
curve costs a few Newton steps for each point, and its lowest point is the root of the exact slope of the peak
amplitude. Where a step is too long, intermediate values of the parameter are inserted; or the curve is followed by arc length, around
folds at which peaks appear or merge.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.optimize

from stickslip.arrays import FloatArray
from stickslip.errors import InputError, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import ParameterLinearisation
from stickslip.harmonic.peak import EVALUATIONS, Peak, PeakProblem
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import Followed, Judged, OneLevel, Route, steps_through
from stickslip.response.parameter import Discretisation, Parameter
from stickslip.response.resonances.first import PeakSearch, Start, first_peaks
from stickslip.response.resonances.point import PeakPoint, peak_point
from stickslip.response.system import System
from stickslip.solve.branch import Following, Latest, ParameterEvaluation
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Newton, Solution, charged, newton
from stickslip.solve.status import Status

APART = 1e-5  # relative distance in frequency above which two peaks differ
HALVINGS = 6  # of a failed parameter step
FARTHEST = 0.1  # change of ln ω in one step above which the solution is another peak
BRACKET = 1e-12  # width in ln ω at which a peak on a kink is found
SEARCH = 60  # largest number of solutions for a bracket
FAR = 2.0  # largest extrapolation through the last two peaks, in steps
PEAK_FREQUENCY_RTOL = 1e-6  # relative distance in frequency up to which two solutions are the same peak


@dataclass(slots=True)
class Tracker:
    """Tracker of one peak, with the peaks so far as starts."""

    problem: PeakProblem
    newton: Newton
    known: list[tuple[float, FloatArray]]
    force: float  # phase of the load in the first harmonic that peaks, rad
    periods: int = 1  # load periods in one period of the motion
    evaluations: int = 0
    number: int = 0
    corner: bool = False  # whether the last peak lies on a corner of the response
    tops: list[tuple[float, float]] = field(
        default_factory=list
    )  # values and phases of the last two maxima, for variable_phase

    def point(self, value: float) -> PeakPoint:
        """Find the peak at a parameter value from the known peaks."""
        solution = self.reached(value)
        if solution.status.converged:
            self._turn(solution.x, value)
        spent, self.evaluations = self.evaluations, 0
        return self.told(self.problem, value, solution, spent)

    def told(self, problem: PeakProblem, value: float, solution: Solution, spent: int) -> PeakPoint:
        """Return a solution of the equation as a `PeakPoint`."""
        point = peak_point(problem, self.force, value, solution, spent, self.number)
        return replace(point, omega=self.periods * point.omega)

    def take(self, point: PeakPoint) -> None:
        """Continue from a known peak."""
        balance = self.problem.family(point.value)
        motion = balance.unknowns(point.coefficients[:, balance.linear.retained])
        y = np.append(motion, np.log(point.omega / self.periods / self.problem.omega_scale))
        self.known = [*self.known[-1:], (point.value, y)]
        self._turn(y, point.value)

    def _turn(self, y: FloatArray, value: float) -> None:
        """Align the equation with the response at a peak, and store the phase of the nearby maximum."""
        state = self.problem.state(y, value)
        self.evaluations += 2 + EVALUATIONS["horizontal_tangent"]
        self.problem = self.problem.aligned(state)
        if self.problem.by == "variable_phase":
            self.tops = [*self.tops[-1:], (value, self.problem.of_the_top(state).phase)]

    def reached(self, value: float, halvings: int = HALVINGS) -> Solution:
        """Solve from the predicted peak; if this fails, through intermediate values or by bracketing."""
        self._ask(value)
        solution, last = self._solved(value), self.known[-1][0]
        if not solution.status.converged and halvings > 0 and last != value:
            between = self.reached(0.5 * (last + value), halvings - 1)
            if between.status.converged and not self.corner:
                return self.reached(value, halvings - 1)
            if between.status.converged:
                solution = self._solved(value)
        if solution.status.converged:
            self.corner = False
        elif self.problem.by == "horizontal_tangent":
            solution, self.corner = self._bracketed(value), True
        if solution.status.converged:
            self.known = [*self.known[-1:], (value, solution.x)]
        return solution

    def _ask(self, value: float) -> None:
        """Prescribe the phase extrapolated from the last two maxima."""
        if self.problem.by != "variable_phase":
            return
        (before, earlier), (p, phase) = self.tops[0], self.tops[-1]
        share = (value - p) / (p - before) if p != before else 0.0
        change = float(np.angle(np.exp(1j * (phase - earlier))))
        phase += share * change if abs(share) <= FAR else 0.0
        self.problem = replace(self.problem, phase=phase)

    def _predicted(self, value: float) -> FloatArray:
        """Extrapolate through the last two peaks, or along the tangent of a single one.

        Return the last peak if the extrapolation is too far.
        """
        (before, earlier), (p, y) = self.known[0], self.known[-1]
        if p != before:
            share = (value - p) / (p - before)
            return y + share * (y - earlier) if abs(share) <= FAR else y
        if value == p or self.corner:
            return y
        self.evaluations += 3 * EVALUATIONS[self.problem.by]
        at = self.problem.linearise(y, p)
        inverse = self.problem.invert(at.jac)
        change = None if inverse is None else inverse((p - value) * at.jac_p)
        return y if change is None or abs(change[-1]) > FARTHEST else y + change

    def _solved(self, value: float) -> Solution:
        """Solve from the predicted peak; a solution at another peak counts as failed."""
        guess = self._predicted(value)

        def evaluate(v: FloatArray) -> ParameterEvaluation:
            self.evaluations += EVALUATIONS[self.problem.by]
            return self.problem.linearise(v, value)

        solution = newton(evaluate, guess, self.newton)
        if not solution.status.converged or self._is_same(solution.x, guess, value):
            return solution
        return replace(solution, status=Status.STALLED)

    def _is_same(self, y: FloatArray, guess: FloatArray, value: float) -> bool:
        """Whether a solution is the tracked peak: it is near, and no minimum between two peaks."""
        if abs(y[-1] - guess[-1]) > FARTHEST:
            return False
        if self.problem.by != "horizontal_tangent":
            return True
        self.evaluations += EVALUATIONS["horizontal_tangent"]
        return not self.problem.curvature(self.problem.state(y, value)) > 0.0

    def _bracketed(self, value: float) -> Solution:
        """Find the peak of a response whose slope jumps there, at a kink or by sampling errors."""
        balance, y = self.problem.family(value), self._predicted(value)
        spent = [Solution(y[:-1], Status.STALLED, 0, np.nan, 0.0, 0.0)]

        def rate(place: float) -> float:
            """Solve at ``ln(ω / omega_scale) = place`` from the last solution; return the slope."""
            omega = self.problem.omega(np.array([place]))
            spent.append(newton(lambda v: balance.linearise(v, omega), spent[-1].x, self.newton))
            self.evaluations += spent[-1].iterations + 2
            found = self.problem.rate(self.problem.state(np.append(spent[-1].x, place), value))
            if not (spent[-1].status.converged and np.isfinite(found)):
                raise ArithmeticError("lost the response, or met a fold")
            return found

        try:
            top = _sign_change(rate, float(y[-1]), 0.1 / self.problem.sharpness)
            rate(top)
        except (ArithmeticError, ValueError):
            return replace(charged(spent[-1], spent), x=y, status=Status.STALLED)
        return replace(charged(spent[-1], spent), x=np.append(spent[-1].x, top))


def _sign_change(rate: Callable[[float], float], at: float, step: float) -> float:
    """Climb until the slope changes its sign, then find the root."""
    slope = rate(at)
    step = step if slope > 0.0 else -step
    for _ in range(SEARCH):
        if rate(at + step) * slope <= 0.0:
            return float(scipy.optimize.brentq(rate, at, at + step, xtol=BRACKET))
        at, step = at + step, 1.3 * step
    raise ArithmeticError("no maximum")


def trackers(search: PeakSearch, value: float, most: int) -> list[Tracker]:
    """Return trackers of the `most` highest peaks at a parameter value.

    The first one includes the cost of the sweep.
    """
    starts, spent = first_peaks(search, value)
    made: list[Tracker] = []
    for start in starts:
        if len(made) == most:
            break
        one = _tracker(search, start)
        if made and not _is_another(one, made):
            continue
        one.number = len(made)
        made.append(one)
    made[0].evaluations += spent
    return made


def _tracker(search: PeakSearch, start: Start) -> Tracker:
    """Return the tracker of one peak; for ``variable_phase``, the maximum is found first and gives the phase."""
    force = start.problem.phase
    known = [(start.value, start.y)]
    if start.problem.by != "variable_phase":
        return Tracker(start.problem, start.newton, known, force, search.periods)
    exact = Tracker(replace(start.problem, by="horizontal_tangent"), start.newton, known, force)
    top = exact.point(start.value)
    y = exact.known[-1][1]
    problem = replace(exact.problem, by="variable_phase")
    problem = problem.of_the_top(problem.state(y, start.value))
    tops = [(start.value, problem.phase)]
    known = [(start.value, y)]
    return Tracker(problem, start.newton, known, force, search.periods, top.evaluations, tops=tops)


def _is_another(one: Tracker, made: list[Tracker]) -> bool:
    """Whether a tracker leads to another peak than all previous trackers."""
    value, _ = one.known[-1]
    found = one.reached(value)
    if not found.status.converged:
        return False
    others = [other.problem.omega(other.reached(value).x) for other in made]
    omega = one.problem.omega(found.x)
    return all(abs(omega - other) > PEAK_FREQUENCY_RTOL * other for other in others)


def represented_as(search: PeakSearch, point: PeakPoint, how: Discretisation) -> PeakPoint:
    """Return a peak solved with other harmonics, from the known one by horizontal tangent."""
    more = replace(search, how=how, by="horizontal_tangent")
    problem = more.problem(point.value)
    problem = replace(problem, omega_scale=point.omega / search.periods)
    balance = problem.family(point.value)
    y = np.append(balance.unknowns(point.coefficients[:, balance.linear.retained]), 0.0)
    state = problem.state(y, point.value)
    problem = problem.sharpened(state).aligned(state)
    tracker = Tracker(problem, how.newton, [(point.value, y)], problem.phase, search.periods)
    return tracker.point(point.value)


@by_one_thread
def track_peak(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    values: Sequence[float] | FloatArray,
    omega_range: tuple[float, float],
    by: Peak = "horizontal_tangent",
    output: int = 0,
    discretisation: Discretisation | None = None,
) -> Iterator[PeakPoint]:
    """Follow the highest resonance peak over a design parameter.

    `follow_peaks` follows several, also in harmonics that are not driven.

    Parameters
    ----------
    system
        Structure, contacts and outputs.
    load
        Static and harmonic forces on all dofs, N.
    parameter
        As in `branch_in_parameter`: a factor on a load, a field of the contact laws, or a function of the value.
    values
        Values of the parameter, in the order of the computation.
    omega_range
        Frequency range of the initial sweep for the first peak, rad/s.
    by
        ``horizontal_tangent``: the largest amplitude; ``phase_quadrature``: the output lags the force by 90°, which is
        close to the maximum of a lightly damped resonance, and cheaper; ``variable_phase``: the output has the phase of
        the maximum near the last peak, which also suits several forces and modes, and harmonics that are not driven.
    output
        Number of the output whose amplitude peaks.
    discretisation
        Harmonics, samples, solver.

    Yields
    ------
    PeakPoint
        One point for each value. After a failed value the next one starts from the last point found.

    Raises
    ------
    InputError
        If there are no values, the parameter, condition or output is unknown, the load drives no harmonic, or the range
        has no peak at the first value.
    """
    how = discretisation or Discretisation()
    one = PeakSearch(system, load, parameter, omega_range, by, output, how)
    yield from follow_peaks(one, values, 1)


@by_one_thread
def follow_peaks(
    search: PeakSearch, values: Sequence[float] | FloatArray, most: int = 3, done: Sequence[PeakPoint] = ()
) -> Iterator[PeakPoint]:
    """Follow several resonance peaks over a design parameter, each from its previous points.

    Parameters
    ----------
    search
        Resonance and condition.
    values
        Values of the parameter, in the order of the computation.
    most
        Largest number of peaks, the highest ones at the first value.
    done
        Points of an interrupted run, which are not computed again.

    Yields
    ------
    PeakPoint
        Points not in `done`, one for each value and peak, with all peaks of a value before the next value. If two peaks
        merge, the one with the larger change ends.

    Raises
    ------
    InputError
        If there are no values, or the range has no peak at the first value.
    """
    followed = trackers(search, float(values[0]) if len(values) else np.nan, most)
    yield from _through(followed, values, done)


def _through(
    followed: Sequence[Tracker],
    values: Sequence[float] | FloatArray,
    done: Sequence[PeakPoint],
    others: Sequence[PeakPoint] = (),
) -> Iterator[PeakPoint]:
    """Follow peaks over the values; a peak ends where it merges with another one, of these or of the `others`."""
    known = {(p.value, p.peak): p for p in done}
    going, last = list(followed), dict[int, PeakPoint]()
    for value in map(float, values):
        here: list[PeakPoint] = []
        for tracker in going:
            stored = known.get((value, tracker.number))
            if stored is not None and stored.converged:
                tracker.take(stored)
            here.append(tracker.point(value) if stored is None else stored)
        there = [p for p in others if p.value == value]
        kept: list[PeakPoint] = []
        # of merged peaks the one with the smallest change continues
        for point in sorted(here, key=lambda p: _way(last.get(p.peak), p)):
            if not any(_is_one(point, other) for other in (*there, *kept)):
                kept.append(point)
        numbers = {p.peak for p in kept}
        going = [tracker for tracker in going if tracker.number in numbers]
        for point in (p for p in here if p.peak in numbers):
            if point.converged:
                last[point.peak] = point
            if (value, point.peak) not in known:
                yield point


def _is_one(one: PeakPoint, other: PeakPoint) -> bool:
    """Whether two points at the same value are the same peak."""
    if not (one.converged and other.converged):
        return False
    near = abs(one.omega - other.omega) <= APART * other.omega
    return near and abs(one.amplitude - other.amplitude) <= APART * other.amplitude


def _way(before: PeakPoint | None, point: PeakPoint) -> float:
    """Return the relative change of the frequency of a peak since its last value."""
    return 0.0 if before is None else abs(point.omega / before.omega - 1.0)


@by_one_thread
def later_peaks(
    search: PeakSearch,
    values: Sequence[float] | FloatArray,
    known: Sequence[PeakPoint],
    most: int = 3,
    done: Sequence[PeakPoint] = (),
) -> Iterator[PeakPoint]:
    """Follow backwards the peaks at the last value that were not reached from the first value.

    Parameters
    ----------
    search, values, most, done
        As in `follow_peaks`.
    known
        Points from `follow_peaks`.

    Yields
    ------
    PeakPoint
        Points from the last value to the first, numbered after the known peaks. A peak ends where it merges with a
        known one.
    """
    last = float(values[-1])
    there = [p.omega for p in known if p.value == last and p.converged]
    number = 1 + max((p.peak for p in known), default=-1)
    found: list[Tracker] = []
    for tracker in trackers(search, last, most):
        omega = search.periods * tracker.problem.omega(tracker.reached(last).x)
        if all(abs(omega - other) > APART * other for other in there):
            tracker.number = number + len(found)
            found.append(tracker)
    yield from _through(found, list(values)[::-1], done, known)


@by_one_thread
def smallest_peak(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    span: tuple[float, float],
    omega_range: tuple[float, float],
    output: int = 0,
    discretisation: Discretisation | None = None,
) -> PeakPoint:
    """Return the design with the smallest resonance peak, at the parameter value with a stationary peak amplitude.

    Parameters
    ----------
    system, load, parameter, omega_range, output, discretisation
        As in `track_peak`.
    span
        Two values between which the peak amplitude first falls and then rises.

    Raises
    ------
    InputError
        If the peak is not found at an end, or its amplitude has slopes of the same sign at both ends.
    """
    how = discretisation or Discretisation()
    asked = PeakSearch(system, load, parameter, omega_range, "horizontal_tangent", output, how)
    (tracker,) = trackers(asked, float(span[0]), 1)
    ends = [tracker.point(value) for value in span]
    for end in (e for e in ends if not e.status.converged):
        raise input_error("span", f"the peak at {end.value:g} was not found ({end.status.advice})", "Take another end.")
    if not ends[0].slope * ends[1].slope < 0.0:
        raise input_error(
            "span",
            f"the peak amplitude changes by {ends[0].slope:.3g} and {ends[1].slope:.3g} per unit at its ends",
            "Give two values with the smallest peak between them.",
        )
    value = scipy.optimize.brentq(
        lambda v: tracker.point(float(v)).slope, *span, xtol=1e-12 * max(map(abs, span)), rtol=1e-12
    )
    return tracker.point(float(value))


FEW = 12  # iterations of a corrector along the curve
SHORTEST = 0.004  # step, in arc length, below which a curve is restarted further on
BEYOND = 0.5  # distance of a corrector beyond the span, over the span
MAX_CURVE_LENGTH = 10  # largest number of points, over the requested smallest number


@by_one_thread
def peak_curve(search: PeakSearch, span: tuple[float, float], points: int = 30, peak: int = 0) -> Iterator[PeakPoint]:
    """Follow the curve of a resonance peak over a design parameter by arc length, around its folds.

    Parameters
    ----------
    search
        Resonance and its condition; with ``variable_phase`` the phase follows the maximum from point to point.
    span
        First and last value of the parameter; the last may be the smaller one.
    points
        Smallest number of points over the span; more are added where the peak changes fast.
    peak
        Number of the peak, 0 for the highest at the first value.

    Yields
    ------
    PeakPoint
        Points in the order of the curve, until it leaves the span at its last value or, after a fold, at its first one.
        Where the curve is lost, a point without convergence follows, and a restart a little further on.

    Raises
    ------
    InputError
        If the span is empty, the number of points is not positive, or there are fewer peaks.
    """
    first, last = span
    if not (np.isfinite(first) and np.isfinite(last) and first != last):
        raise input_error("span", f"goes from {first} to {last}", "Give two different values.")
    if points < 1:
        raise input_error("points", f"must be positive, got {points}", "Give 30, say.")
    found = trackers(search, first, peak + 1)
    if peak >= len(found):
        raise input_error(
            "peak", f"is {peak}, of {len(found)} in the range", f"Give 0 to {len(found) - 1}, or a wider range."
        )
    tracker = found[peak]
    equation = _Equation(tracker.problem, span)
    size = tracker.known[-1][1].size
    weights = np.ones(size)
    weights[: tracker.problem.family(first).linear.n] = 0.0
    control = replace(steps_through(abs(last - first), points), smallest=SHORTEST)
    # few iterations: at a corner of the curve each trial has another parameter value, which may need a new model
    newton = replace(search.how.newton, globalisation="dogleg", max_iterations=FEW)
    way = Following(newton=newton, control=control, weights=weights)

    def begin(value: float, near: Sequence[FloatArray], _effort: float) -> Solution:
        if near:
            tracker.known = [(value, near[-1])]
        return tracker.reached(value)

    route = Route(first=first, last=last, points=points, leaves=False)
    curve = _PeakCurve(equation, way, begin, equation)
    count = 0
    for made in follow(curve, route):
        if made.kind != "point":
            continue
        if route.before(made.p, first) or (count := count + 1) > MAX_CURVE_LENGTH * points:
            return
        yield _told(equation, tracker, made)


@dataclass(eq=False)
class _Equation:
    """Equation of the peak, realigned at each point so that it stays regular at folds of the response near the peak."""

    problem: PeakProblem
    span: tuple[float, float]
    evaluations: int = 0

    def linearise(self, y: FloatArray, p: float) -> ParameterEvaluation:
        """Evaluate at (y, p); the result is infinite far beyond the span, or outside it where the model is invalid."""
        self.evaluations += EVALUATIONS[self.problem.by]
        lowest, highest = sorted(self.span)
        margin = BEYOND * (highest - lowest)
        if lowest <= p <= highest:
            return self.problem.linearise(y, p)
        try:
            if lowest - margin <= p <= highest + margin:
                return self.problem.linearise(y, p)
        except InputError:  # such as a negative friction coefficient
            pass
        nothing = np.zeros(y.size)
        return ParameterLinearisation(np.full(y.size, np.inf), np.eye(y.size), 0.0, lambda: nothing)

    def turn(self, y: FloatArray, p: float) -> None:
        """Align the equation with the response at a peak.

        With ``variable_phase``, the phase of the maximum is prescribed from here on.
        """
        # evaluated with the present row, so that the orientation of the response is kept
        self.problem = self.problem.aligned(self.problem.bordered.state(y, p))
        if self.problem.by == "variable_phase":
            self.problem = self.problem.of_the_top(self.problem.state(y, p))
        self.evaluations += 2 + EVALUATIONS["horizontal_tangent"]


@dataclass(frozen=True, eq=False)
class _PeakCurve(OneLevel):
    """Curve that realigns its equation at each point."""

    turning: _Equation

    def judge(self, level: int, point: Point, latest: Latest) -> Judged:
        """Realign the equation; no error is estimated."""
        self.turning.turn(point.x, point.p)
        return Judged()


def _told(equation: _Equation, tracker: Tracker, made: Followed) -> PeakPoint:
    tracker.problem = equation.problem
    spent, equation.evaluations = equation.evaluations + tracker.evaluations, 0
    tracker.evaluations = 0
    solution = made.point.solution
    return tracker.told(equation.problem, made.p, solution, spent)
