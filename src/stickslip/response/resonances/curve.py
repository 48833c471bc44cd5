"""Curve of a resonance over a design parameter by arc length, around folds at which peaks appear or merge."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import InputError, input_error
from stickslip.harmonic.parameters import ParameterLinearisation
from stickslip.harmonic.peak import EVALUATIONS, PeakProblem
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import Followed, Judged, OneLevel, Route, steps_through
from stickslip.response.resonances.first import PeakSearch
from stickslip.response.resonances.point import PeakPoint
from stickslip.response.resonances.tracking import Tracker, trackers
from stickslip.solve.branch import Following, Latest, ParameterEvaluation
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Solution

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
