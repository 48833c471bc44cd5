"""Damping over amplitude of a self-excited mode, from stick to large slip."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.harmonic.bordered import PeriodicProblem
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.adaptive_continuation import follow
from stickslip.response.continuation.branch import Followed, OneLevel, Route, branch_of, steps_through
from stickslip.response.equilibrium import preload
from stickslip.response.parameter import Parameter
from stickslip.response.self_excited.problem import SelfExcited, contacts_of, levels
from stickslip.solve.branch import Following
from stickslip.solve.chord_newton import KeptFactors
from stickslip.solve.linear import Signed
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, Solution, first_converged, newton
from stickslip.solve.status import Status

FAINT = 1e-11  # m: smallest gap motion that may slip
STATIC_SHARE = 1e-5  # vibration over static displacement, below which it is lost in rounding
NOISE = 10.0  # factor on the residual of a sticking motion, above which a contact has changed its state
MOST_DOUBLINGS = 80
SLIPS = 1e-6  # residual over the elastic force of the mode, above which a contact has changed its state
ONSET = 1.01  # largest ratio of the bounds on the amplitude at the onset of slip
LARGEST = 0.25
QUICK = 10  # Newton steps to a sticking motion about another mean
PATIENT = Newton(max_iterations=60, globalisation="levenberg_marquardt")


@dataclass(frozen=True, eq=False)
class AmplitudePoint:
    """Periodic motion of given amplitude.

    Parameters
    ----------
    amplitude
        Amplitude of the prescribed coordinate in the first harmonic, m.
    omega
        Frequency, rad/s.
    level
        Damping ratio of the motion, negative if its amplitude grows; or the value of the parameter for which it is a
        limit cycle.
    order
        Highest harmonic.
    unknowns
        Unknowns of the periodic problem.
    status
        How the solver ended; a point that did not converge is no motion.
    iterations
        Newton steps.
    """

    amplitude: float
    omega: float
    level: float
    order: int
    unknowns: FloatArray
    status: Status
    iterations: int

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


def slip_amplitude(problem: SelfExcited) -> float:
    """Return the amplitude at the onset of slip or lift-off, m, within one percent.

    Contacts at their slip limit under the static load slip at once, but stick again about another mean; this is no
    onset.

    Raises
    ------
    InputError
        If no contact slips or opens.
    """
    static = preload(problem.system, problem.load.static)
    mode = problem.relative(problem.guess(static, 1.0))[1]
    largest = float(np.max(np.abs(problem.balance.interface.gap_operator @ mode), initial=0.0))
    # smaller vibrations are lost in the rounding of the static state
    least = STATIC_SHARE * float(np.max(np.abs(static), initial=0.0))
    amplitude = max(FAINT / largest, least) if largest > 0.0 else np.inf
    equation = problem.over_amplitude()
    known = _Sticking.at(problem, equation, min(amplitude, 1.0), [])
    if known is None and np.isfinite(amplitude):
        return amplitude
    for _ in range(MOST_DOUBLINGS if np.isfinite(amplitude) else 0):
        assert known is not None
        if known.leaves(amplitude):
            again = known.beyond(2.0 * amplitude)
            if again is None:
                return _onset(known, 0.5 * amplitude, 2.0 * amplitude)
            known = again
        amplitude *= 2.0
    raise input_error(
        f"mode {problem.mode.number}",
        "no contact slips or opens, however large its amplitude",
        "Nothing bounds the motion: look at the linear stability alone, or give a range of amplitudes.",
    )


def _onset(known: "_Sticking", below: float, amplitude: float) -> float:
    """Return the amplitude at the onset of slip between two amplitudes, within one percent."""
    while amplitude > ONSET * below:
        middle = float(np.sqrt(below * amplitude))
        slips = known.leaves(middle) and known.beyond(middle) is None
        below, amplitude = (below, middle) if slips else (middle, amplitude)
    return amplitude


@dataclass(frozen=True, eq=False)
class _Sticking:
    """Motion in which no contact changes its state.

    Its vibration is proportional to the amplitude, about a constant mean.
    """

    problem: SelfExcited
    equation: PeriodicProblem
    amplitude: float
    y: FloatArray
    noise: float
    inverse: Signed | None

    @classmethod
    def at(
        cls,
        problem: SelfExcited,
        equation: PeriodicProblem,
        amplitude: float,
        near: Sequence[FloatArray],
        known: Signed | None = None,
    ) -> "_Sticking | None":
        """Return the sticking motion at an amplitude, from nearby motions; None without one."""
        p = float(np.log(amplitude))
        how = problem.how.newton
        kept = KeptFactors(how.tolerance, GLOBALISATIONS[how.globalisation](), known)
        found = (
            newton(lambda y: equation.linearise(y, p), near[0], replace(how, max_iterations=QUICK), kept)
            if near
            else _solved(problem, equation, p, near)
        )
        if not found.status.converged or contacts_of(problem, found.x, amplitude).slipping > 0.0:
            return None
        left = equation.residual(found.x, p)
        noise = NOISE * float(np.max(np.abs(left)))
        return cls(problem, equation, amplitude, found.x, noise, kept.inverse)

    def grown(self, amplitude: float) -> FloatArray:
        """Return the unknowns scaled to another amplitude."""
        out = self.y.copy()
        out[: self.problem.balance.linear.n] *= self.amplitude / amplitude
        return out

    def beyond(self, amplitude: float) -> "_Sticking | None":
        """Return the sticking motion at a larger amplitude, about another mean; None without one."""
        start = self.grown(amplitude)
        return self.at(self.problem, self.equation, amplitude, [start], self.inverse)

    def leaves(self, amplitude: float) -> bool:
        """Whether a contact changes its state below an amplitude."""
        left = self.equation.residual(self.grown(amplitude), float(np.log(amplitude)))
        return bool(np.max(np.abs(left)) > max(SLIPS, self.noise))


@by_one_thread
def damping_over_amplitude(problem: SelfExcited, span: tuple[float, float], points: int = 30) -> list[AmplitudePoint]:
    """Follow the motions of a mode and their damping over the amplitude.

    Parameters
    ----------
    problem
        The mode.
    span
        First and last amplitude, m.
    points
        Smallest number of points.
    """
    return [_of_point(problem, f) for f in _followed(problem, problem.over_amplitude(), span, points)]


@by_one_thread
def parameter_over_amplitude(
    problem: SelfExcited,
    parameter: Parameter,
    near: float,
    cycle: FloatArray,
    span: tuple[float, float],
    points: int = 40,
) -> list[AmplitudePoint]:
    """Follow limit cycles over their amplitude, with a parameter as the unknown.

    Parameters
    ----------
    problem
        The mode.
    parameter
        As in `branch_in_parameter`: a field of the contact laws, or a function of the value, such as a factor on the
        aerodynamic forces.
    near
        Approximate value of the parameter at the first amplitude.
    cycle
        Unknowns of a nearby limit cycle.
    span
        First and last amplitude, m.
    points
        Smallest number of points.
    """
    scale = abs(near) or 1.0
    equation = problem.over_amplitude(levels(problem, parameter, near), scale)
    start = np.append(cycle[:-1], near / scale)
    found = _followed(problem, equation, span, points, start)
    return [replace(_of_point(problem, f), level=scale * float(f.point.x[-1])) for f in found]


def at_amplitude(problem: SelfExcited, amplitude: float, near: Sequence[FloatArray] = ()) -> AmplitudePoint:
    """Return the motion of an amplitude, m, and its damping.

    The starts are unknowns of nearby motions, or the linear mode.
    """
    found = _solved(problem, problem.over_amplitude(), float(np.log(amplitude)), near)
    return _point(problem, amplitude, found)


def _of_point(problem: SelfExcited, followed: Followed) -> AmplitudePoint:
    """Return a point of a curve over the amplitude, with its level as a damping ratio."""
    return _point(problem, float(np.exp(followed.p)), followed.point.solution)


def _point(problem: SelfExcited, amplitude: float, found: Solution) -> AmplitudePoint:
    y = found.x
    omega, level, order = problem.omega(y), problem.ratio(y), problem.balance.order
    return AmplitudePoint(amplitude, omega, level, order, y, found.status, found.iterations)


def _followed(
    problem: SelfExcited,
    equation: PeriodicProblem,
    span: tuple[float, float],
    points: int,
    start: FloatArray | None = None,
) -> list[Followed]:
    first, last = (float(np.log(a)) for a in span)
    control = replace(steps_through(abs(last - first), points), largest=LARGEST)
    way = Following(newton=problem.how.newton, control=control, weights=_weights(problem))

    def begin(p: float, near: Sequence[FloatArray], _effort: float) -> Solution:
        own = [] if start is None else [start]
        return _solved(problem, equation, p, [*near, *own])

    route = Route(first=first, last=last, points=points, leaves=False)
    return branch_of(follow(OneLevel(equation, way, begin), route))


def _solved(problem: SelfExcited, equation: PeriodicProblem, p: float, near: Sequence[FloatArray]) -> Solution:
    """Solve at an amplitude from nearby motions, or from the linear mode about the static state."""
    static = preload(problem.system, problem.load.static)
    starts = [*near, problem.guess(static, float(np.exp(p)))]
    attempts = (
        newton(lambda y: equation.linearise(y, p), start, options)
        for options in (problem.how.newton, replace(PATIENT, linear=problem.how.newton.linear))
        for start in starts
    )
    return first_converged(attempts)


def _weights(problem: SelfExcited) -> FloatArray:
    """Return the weight of each unknown in the step length: vibration, frequency and level count, the mean does not."""
    weights = np.ones(problem.balance.size + 2)
    weights[: problem.balance.linear.n] = 0.0
    return weights
