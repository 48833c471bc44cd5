"""The resonance peak followed directly while a design parameter varies, without a sweep for each value.

Each peak is the solution of one equation (see `harmonic.peak`), started from the peak before. A damper optimisation curve costs a few
Newton steps a point, and its lowest point is the root of the exact slope of the peak amplitude.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import get_args

import numpy as np
import scipy.optimize

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import check_choice, input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import ParameterLinearisation
from stickslip.harmonic.peak import EVALUATIONS, Driven, Peak, PeakProblem, driven_by
from stickslip.response.ladder import plain_sweep
from stickslip.response.parameter import (
    Discretisation,
    Parameter,
    parameter_family,
    system_at,
)
from stickslip.response.system import System
from stickslip.solve.continuation import Point
from stickslip.solve.krylov import to_tolerance
from stickslip.solve.linear import factorised
from stickslip.solve.newton_method import Newton, Solution, charged, newton
from stickslip.solve.status import Status

SWEEP_POINTS = 40  # at least, of the one sweep that finds the first peak
HALVINGS = 6  # of a step of the parameter that does not converge
STEPS = 12  # of Newton from peak to peak
FARTHEST = 0.1  # change of ln ω in one step beyond which another peak was found
EVALUATIONS_BESIDE = 2  # of a point of a sweep, beside one a Newton step: the start and the tangent
BRACKET = 1e-12  # width in ln ω at which a peak on a kink counts as found
SEARCH = 60  # solutions that may be spent on a bracket
EXACT = 1e-12  # relative residual of sensitivities that are found by iteration ...
STEP = 1e-6  # ... and of Newton steps, each of which costs three evaluations and two sensitivities


@dataclass(frozen=True, eq=False)
class PeakPoint:
    """A resonance peak at one value of the design parameter.

    Attributes
    ----------
    value
        Of the parameter.
    omega
        Frequency of the peak, rad/s.
    amplitude
        Amplitude of the output in the harmonic that the load drives, m; with several, the norm over them.
    phase
        Phase of the output against the force, rad, in the harmonic of the largest force; -π/2 in quadrature.
    slope
        Derivative of the amplitude by the parameter along the curve of peaks, m over the parameter's unit.
    curvature
        ``d² ln(amplitude) / d(ln ω)²`` of the response: negative at a maximum.
    coefficients
        (order+1, n) complex displacement of all dofs of the structure, m.
    status
        How the solver ended; a point that did not converge is no peak.
    iterations
        Newton steps.
    evaluations
        Evaluations of the periodic problem that were needed; those of slope and curvature are included, and in the first point
        those of the sweep.
    """

    value: float
    omega: float
    amplitude: float
    phase: float
    slope: float
    curvature: float
    coefficients: ComplexArray
    status: Status
    iterations: int
    evaluations: int

    @property
    def converged(self) -> bool:
        """Whether the point fulfils the condition of a peak."""
        return self.status.converged

    @property
    def is_maximum(self) -> bool:
        """Whether the amplitude falls on both sides: a horizontal tangent may also be a minimum or a saddle."""
        return self.curvature < 0.0


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
    """Follow a resonance peak through the values of a design parameter.

    Parameters
    ----------
    system
        Structure, contacts and outputs.
    load
        Static and harmonic forces on all dofs, N.
    parameter
        As in `branch_in_parameter`: a factor on a load, a field of the contact laws, or a function of the value.
    values
        Values of the parameter, in the order in which they are to be visited.
    omega_range
        Frequencies between which the first peak is searched for by a sweep, rad/s.
    by
        ``horizontal_tangent``: the largest amplitude; ``phase_quadrature``: the output lags the force by 90°, which is close to it for
        a lightly damped resonance, and cheaper.
    output
        Position among the outputs of the dof whose amplitude peaks.
    discretisation
        Harmonics, samples, solver.

    Yields
    ------
    PeakPoint
        One a value. After one that is not found the next is tried from the last that was.

    Raises
    ------
    InputError
        If there are no values, the parameter, the condition or the output is unknown, the load drives no harmonic, or the range holds no
        peak at the first value.
    """
    tracker = _tracker(system, load, parameter, float(values[0]) if len(values) else np.nan, omega_range, by, output, discretisation)  # fmt: skip
    for value in values:
        yield tracker.point(float(value))


def smallest_peak(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    span: tuple[float, float],
    omega_range: tuple[float, float],
    output: int = 0,
    discretisation: Discretisation | None = None,
) -> PeakPoint:
    """Return the design with the smallest resonance peak: the value of the parameter at which the peak amplitude is stationary.

    Parameters
    ----------
    system, load, parameter, omega_range, output, discretisation
        As in `track_peak`.
    span
        Two values between which the peak falls first and then rises.

    Raises
    ------
    InputError
        If the peak is not found at an end, or its amplitude has a slope of the same sign at both.
    """
    tracker = _tracker(system, load, parameter, span[0], omega_range, "horizontal_tangent", output, discretisation)  # fmt: skip
    ends = [tracker.point(value) for value in span]
    for end in (e for e in ends if not e.status.converged):
        raise input_error(
            "span",
            f"the peak at {end.value:g} was not found ({end.status.advice})",
            "Take another end.",
        )
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


@dataclass(slots=True)
class _Tracker:
    """The peaks found so far, from which the next ones start."""

    problem: PeakProblem
    newton: Newton
    known: list[tuple[float, FloatArray]]
    evaluations: int = 0
    corner: bool = False  # whether the last peak sits on a corner of the response

    def point(self, value: float) -> PeakPoint:
        """Find the peak at a value of the parameter, from those known."""
        solution = self._reach(value, HALVINGS)
        y, problem = solution.x, self.problem
        balance = problem.family(value)
        slope, curvature = np.nan, np.nan
        if solution.status.converged:
            state = problem.state(y, value)
            slope, curvature = problem.amplitude_slope(state), problem.curvature(state)
            self.problem = problem.aligned(state)
            self.evaluations += 2 + EVALUATIONS["horizontal_tangent"]
        driven, omega = problem.motion(y, value), problem.omega(y)
        amplitude = float(np.linalg.norm(driven))
        lag = float(np.angle(driven[0] * np.exp(-1j * problem.phase)))
        motion = balance.linear.recover(omega, balance.coefficients(y[:-1]))
        spent, self.evaluations = self.evaluations, 0
        return PeakPoint(
            value, omega, amplitude, lag, amplitude * slope, curvature, motion, solution.status, solution.iterations, spent
        )  # fmt: skip

    def _reach(self, value: float, halvings: int) -> Solution:
        """Solve from the predicted peak; through the values between, or in a bracket, if that fails."""
        solution, last = self._solved(value), self.known[-1][0]
        if not solution.status.converged and halvings > 0 and last != value:
            between = self._reach(0.5 * (last + value), halvings - 1)
            if between.status.converged and not self.corner:
                return self._reach(value, halvings - 1)
            if between.status.converged:
                solution = self._solved(value)
        if solution.status.converged:
            self.corner = False
        elif self.problem.by == "horizontal_tangent":
            solution, self.corner = self._bracketed(value), True
        if solution.status.converged:
            self.known = [*self.known[-1:], (value, solution.x)]
        return solution

    def _predicted(self, value: float) -> FloatArray:
        """Go on through the last two peaks, or along the tangent at the only one; the last one, where that would go far."""
        (before, earlier), (p, y) = self.known[0], self.known[-1]
        if p != before:
            share = (value - p) / (p - before)
            return y + share * (y - earlier) if abs(share) <= 2.0 else y
        if value == p or self.corner:
            return y
        self.evaluations += 3 * EVALUATIONS[self.problem.by]
        at = self.problem.linearise(y, p)
        inverse = self.problem.invert(at.jac)
        change = None if inverse is None else inverse((p - value) * at.jac_p)
        return y if change is None or abs(change[-1]) > FARTHEST else y + change

    def _solved(self, value: float) -> Solution:
        """Solve from the predicted peak; another peak than the one that was followed is none."""
        guess = self._predicted(value)

        def evaluate(v: FloatArray) -> ParameterLinearisation:
            self.evaluations += EVALUATIONS[self.problem.by]
            return self.problem.linearise(v, value)

        solution = newton(evaluate, guess, self.newton)
        if not solution.status.converged or self._is_same(solution.x, guess, value):
            return solution
        return replace(solution, status=Status.STALLED)

    def _is_same(self, y: FloatArray, guess: FloatArray, value: float) -> bool:
        """Whether a solution is the peak that was followed: near, and no minimum between two peaks."""
        if abs(y[-1] - guess[-1]) > FARTHEST:
            return False
        if self.problem.by == "phase_quadrature":
            return True
        self.evaluations += EVALUATIONS["horizontal_tangent"]
        return not self.problem.curvature(self.problem.state(y, value)) > 0.0

    def _bracketed(self, value: float) -> Solution:
        """Find the top of a response whose slope jumps there: a kink, or the steps that samples make."""
        balance, y = self.problem.family(value), self._predicted(value)
        spent = [Solution(y[:-1], Status.STALLED, 0, np.nan, 0.0, 0.0)]

        def rate(place: float) -> float:
            """Solve at ``ln(ω / omega_scale) = place`` from the last solution, and return the slope there."""
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
    """Climb until the slope changes its sign, then close the bracket."""
    slope = rate(at)
    step = step if slope > 0.0 else -step
    for _ in range(SEARCH):
        if rate(at + step) * slope <= 0.0:
            return float(scipy.optimize.brentq(rate, at, at + step, xtol=BRACKET))
        at, step = at + step, 1.3 * step
    raise ArithmeticError("no maximum")


def _tracker(
    system: System,
    load: HarmonicLoad,
    parameter: Parameter,
    first: float,
    omega_range: tuple[float, float],
    by: Peak,
    output: int,
    discretisation: Discretisation | None,
) -> _Tracker:
    """Find the first peak by a sweep."""
    if not np.isfinite(first):
        raise input_error("values", "are empty or not finite", "Give numbers.")
    check_choice("by", by, get_args(Peak))
    if not 0 <= output < system.outputs.size:
        have = system.outputs.size
        raise input_error("output", f"is {output}, of {have} outputs", f"Give 0 to {have - 1}.")
    begin, end = omega_range
    if not 0.0 < begin < end < np.inf:
        raise input_error(
            "omega_range", f"must be positive and growing, got {begin} to {end} rad/s", "Swap them."
        )
    how = discretisation or Discretisation()
    dof = int(system.outputs[output])
    family = parameter_family(
        system, load, parameter, first, lambda s, f: how.balance(s, f, np.array([dof]))
    )
    balance = family(first)
    changed = system_at(system, parameter, first, balance)
    harmonics, phase = driven_by(balance.linear.load)
    driven = Driven(int(np.searchsorted(balance.linear.retained, dof)), harmonics)
    invert = partial(factorised, to_tolerance(how.newton.linear, EXACT))
    problem = PeakProblem(family, by, driven, phase, omega_range[1], invert)
    found = plain_sweep(changed, balance, omega_range, SWEEP_POINTS, how.newton)
    points = [f.point for f in found if f.converged]
    x, omega = _first_peak(problem, first, points)
    y = np.append(x, 0.0)
    problem = replace(problem, omega_scale=omega)
    here = problem.state(y, first)
    problem = problem.sharpened(here).aligned(here)
    few = replace(
        how.newton,
        max_iterations=min(STEPS, how.newton.max_iterations),
        linear=to_tolerance(how.newton.linear, STEP),
    )
    spent = sum(p.solution.iterations + EVALUATIONS_BESIDE for p in points)
    return _Tracker(problem, few, [(first, y)], spent)


def _first_peak(
    problem: PeakProblem, value: float, points: list[Point]
) -> tuple[FloatArray, float]:
    """Return state and frequency near the highest peak of a sweep, or near the quadrature next to it."""
    motions = np.array([problem.driven.motion(problem.family(value), p.x) for p in points])
    top = int(np.argmax(np.linalg.norm(motions, axis=1))) if points else 0
    if top in (0, len(points) - 1):
        raise input_error(
            "omega_range",
            f"holds no peak at the first value: of {len(points)} solutions the first or the last is the highest",
            "Widen it, or choose another output.",
        )
    if problem.by == "horizontal_tangent":
        return points[top].x, points[top].p
    in_phase = np.real(motions[:, 0] * np.exp(-1j * problem.phase))
    crossings = np.flatnonzero(in_phase[:-1] * in_phase[1:] <= 0.0)
    if crossings.size == 0:
        raise input_error(
            "omega_range",
            "holds no frequency at which the output is in quadrature with the force",
            "Track the horizontal tangent.",
        )
    i = int(crossings[np.argmin(np.abs(crossings + 0.5 - top))])
    share = in_phase[i] / (in_phase[i] - in_phase[i + 1])
    a, b = points[i], points[i + 1]
    return a.x + share * (b.x - a.x), a.p + share * (b.p - a.p)
