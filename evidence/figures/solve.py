"""What the figures are drawn from: responses, pairs of solutions at one frequency, and periodic motions found in time."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from time import process_time
from typing import Literal

import numpy as np

from evidence.figures.model import Model
from stickslip import forced_response
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.law import OPEN, SLIP
from stickslip.harmonic import jacobian_similarity
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.similarity import JacobianSimilarity
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.response import (
    ForcedPoint,
    ForcedProblem,
    TimeStepping,
    accepted_points,
    forced_problem,
    integrate,
    shoot,
    signals,
)
from stickslip.response.time.start import start_from_harmonics

HZ = 2 * np.pi
STEPS = 512  # of a period; the error of the step is printed
# periods that shooting takes, and the integrations that decide at which ratio there is a periodic motion
PATIENCE = 250
BRIEF = 40  # periods of the other integrations, where shooting fails
ORBIT = 1e-6  # length of shooting's last correction, relative to the vibration
Motion = Literal["periodic", "unstable", "settled", "not periodic", "overflow"]


@dataclass(frozen=True, eq=False)
class Curve:
    """A forced response.

    Attributes
    ----------
    ratio
        F_CL/F_HE.
    points
        What makes up the response, and was found.
    lost
        Frequencies that were not found, Hz.
    solved
        Every point that was solved.
    seconds
        CPU time.
    sizes
        Number of unknowns of every evaluation of contact forces with their Jacobian.
    """

    problem: ForcedProblem
    ratio: float
    points: tuple[ForcedPoint, ...]
    lost: tuple[float, ...]
    solved: tuple[ForcedPoint, ...]
    seconds: float
    sizes: tuple[int, ...]

    @property
    def unknowns(self) -> int:
        """Unknowns of all frequencies that were solved, those of both passages."""
        return sum(p.unknowns for p in self.solved)

    @property
    def steps(self) -> int:
        """Newton steps."""
        return sum(p.iterations for p in self.solved)

    @property
    def repeats(self) -> int:
        """Points that were solved with more harmonics than the first passage has."""
        return sum(p.stage in {"high", "branch"} for p in self.solved)

    @cached_property
    def amplitudes(self) -> FloatArray:
        """Amplitudes of the first output, m."""
        return np.array([self.problem.amplitude(p) for p in self.points])

    @property
    def hertz(self) -> FloatArray:
        """Frequencies, Hz."""
        return np.array([p.omega for p in self.points]) / HZ

    @property
    def line(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies (Hz) and amplitudes (m) in the order in which a line joins them.

        Points that resolve the peak come last; they take their place where the branch does not turn back.
        """
        branch = np.array([p.stage != "peak" for p in self.points])
        if np.any(np.diff(self.hertz[branch]) <= 0.0):
            return self.hertz[branch], self.amplitudes[branch]
        order = np.argsort(self.hertz)
        return self.hertz[order], self.amplitudes[order]

    @property
    def peak(self) -> ForcedPoint:
        """The point with the largest amplitude."""
        return self.points[int(np.argmax(self.amplitudes))]


def curve(
    model: Model,
    ratio: float,
    selection: str,
    hertz: tuple[float, float] | None = None,
    frequencies: int = 0,
    threshold: float = 0.05,
) -> Curve:
    """Compute a forced response, along the branch or at equally spaced `frequencies` from and to `hertz`."""
    sweep = replace(model.sweep, selection=selection, threshold=threshold)
    if frequencies:
        sweep = replace(sweep, frequencies=frequencies, peak_points=0)
    if hertz:
        sweep = replace(sweep, omega_range=(HZ * hertz[0], HZ * hertz[1]))
    load = model.load(ratio)
    with evaluations() as sizes:
        begun = process_time()
        solved = tuple(forced_response(model.system, load, sweep))
        seconds = process_time() - begun
    kept = accepted_points(solved)
    return Curve(
        curve_problem(model, ratio, selection),
        ratio,
        tuple(p for p in kept if p.converged),
        tuple(float(p.omega / HZ) for p in kept if not p.converged),
        solved,
        seconds,
        tuple(sizes),
    )


@contextmanager
def evaluations() -> Iterator[list[int]]:
    """Note the number of unknowns of every linearisation while it lasts."""
    sizes: list[int] = []
    plain = HarmonicBalance.linearise

    def linearise(self, *args, **values):  # type: ignore[no-untyped-def]
        sizes.append(self.size)
        return plain(self, *args, **values)

    HarmonicBalance.linearise = linearise  # type: ignore[method-assign]
    try:
        yield sizes
    finally:
        HarmonicBalance.linearise = plain  # type: ignore[method-assign]


def curve_problem(model: Model, ratio: float, selection: str) -> ForcedProblem:
    """Return what a response was solved with."""
    return forced_problem(model.system, model.load(ratio), replace(model.sweep, selection=selection))


@dataclass(frozen=True, eq=False)
class Pair:
    """One frequency solved with few and with many harmonics.

    Attributes
    ----------
    predicted, real
        Err1 (eq. 22) and its actual counterpart (eq. 29) over the outputs, fractions.
    predicted0, real0
        The same of the static part (eq. 23).
    predicted_contact, real_contact
        (k,) the same as `predicted` and `real` of the blades' dofs at the contacts, one by one.
    stuck
        Whether every contact sticks all the time at both solutions.
    states
        Share of contact directions and samples whose state differs between the two.
    slip, opened
        Share of contact directions and samples that slip, and of contacts and samples that are open, with many.
    higher, higher_predicted
        Largest harmonic above one over the first one at the output of the peak, with many harmonics and in q + Δq.
    similarity
        Of the two Jacobians, in units in which every stuck contact weighs the same.
    change_si
        ΔJ of the two in metres and radians.
    """

    problem: ForcedProblem
    ratio: float
    low: ForcedPoint
    high: ForcedPoint
    predicted: float
    real: float
    predicted0: float
    real0: float
    predicted_contact: FloatArray
    real_contact: FloatArray
    stuck: bool
    states: float
    slip: float
    opened: float
    higher: float
    higher_predicted: float
    similarity: JacobianSimilarity
    change_si: float

    @property
    def hertz(self) -> float:
        """Frequency, Hz."""
        return float(self.low.omega / HZ)


def pairs(model: Model, ratio: float, hertz: tuple[float, float], frequencies: int) -> tuple[list[Pair], list[float]]:
    """Solve equally spaced frequencies with few and with many harmonics, each as a response of its own.

    Returns the pairs, and the frequencies (Hz) at which one of the two was not found.
    """
    low, high = (curve(model, ratio, name, hertz, frequencies) for name in ("always_low", "always_high"))
    problem = curve_problem(model, ratio, "jacobian_alert")
    many = {p.omega: p for p in high.points}
    found = [_pair(model, problem, ratio, p, many[p.omega]) for p in low.points if p.omega in many]
    wanted = np.linspace(*hertz, frequencies)
    known = np.array([p.hertz for p in found])
    lost = [float(f) for f in wanted if not np.any(np.isclose(known, f, rtol=1e-9))]
    return found, lost


def _pair(model: Model, problem: ForcedProblem, ratio: float, low: ForcedPoint, high: ForcedPoint) -> Pair:
    outputs = problem.measure.dofs
    x = problem.low.unknowns(low.coefficients)
    alert = jacobian_alert(problem.low, problem.high, x, low.omega, ErrorMeasure(outputs, (1,)))
    linear = problem.low.linear
    few, predicted, many = (
        linear.recover(low.omega, c)
        for c in (low.coefficients, problem.high.coefficients(alert.start), high.coefficients)
    )
    states = [signals(problem, p).state for p in (low, high)]
    errors = [_errors(few, other, outputs, model.contact_dofs) for other in (predicted, many)]
    padded, reference = (problem.high.unknowns(p.coefficients) for p in (low, high))
    where = problem.high, padded, reference, low.omega
    top = outputs[0]
    higher = [float(np.max(np.abs(v[2:, top])) / np.abs(v[1, top])) for v in (many, predicted)]
    return Pair(
        problem,
        ratio,
        low,
        high,
        *(errors[i][j] for j in range(3) for i in range(2)),
        stuck=not any(np.any(s) for s in states),
        states=float(np.mean(states[0] != states[1])),
        slip=float(np.mean(states[1] == SLIP)),
        opened=float(np.mean(states[1] == OPEN)),
        higher=higher[0],
        higher_predicted=higher[1],
        similarity=jacobian_similarity(*where),
        change_si=jacobian_similarity(*where, scales=np.ones(problem.high.linear.n)).change,
    )


def _errors(
    few: ComplexArray, other: ComplexArray, outputs: FloatArray, contact: FloatArray
) -> tuple[float, float, FloatArray]:
    """Return the errors of harmonic 1 and 0 over the outputs, and that of harmonic 1 of each contact dof."""
    few, other = few[:2], other[:2]
    moved = other - few
    first, static = (ErrorMeasure(outputs, (h,)).change(few, moved)[0] for h in (1, 0))
    return first, static, np.abs(moved[1, contact]) / np.abs(few[1, contact])


@dataclass(frozen=True, eq=False)
class Orbit:
    """A motion found by time integration.

    Attributes
    ----------
    motion
        ``periodic`` or ``unstable`` (by shooting), ``settled`` (by integration), ``not periodic`` (an average over periods),
        ``overflow``.
    amplitude
        First harmonic of the first output, m.
    rotation
        (steps,) of the damper, rad, in the last period.
    gap, force
        (steps, n_contacts, 3) in m and N.
    seconds
        CPU time.
    """

    hertz: float
    motion: Motion
    amplitude: float
    rotation: FloatArray
    gap: FloatArray
    force: FloatArray
    seconds: float

    @property
    def found(self) -> bool:
        """Whether it is a periodic motion."""
        return self.motion in {"periodic", "unstable", "settled"}


def orbit(model: Model, problem: ForcedProblem, point: ForcedPoint, steps: int = STEPS, patience: int = BRIEF) -> Orbit:
    """Find the motion in time that begins at a solution of the balance: by shooting, or by at most `patience` periods where that fails."""
    begun = process_time()
    system = model.system
    motion = problem.low.linear.recover(point.omega, point.coefficients)
    gaps, laws = system.interface.gap_operator, system.interface.laws
    start = start_from_harmonics(motion, point.omega, gaps, laws)
    outputs = np.array([*system.outputs, model.rotation])
    where = (system.plain_structure, gaps, laws, problem.low.linear.load, point.omega, outputs, start)
    shot = shoot(*where, TimeStepping(steps_per_period=steps, tolerance=ORBIT, max_periods=PATIENCE))
    kind: Motion
    if shot.converged:
        kind, found = "periodic" if shot.stable else "unstable", shot
        amplitude = shot.harmonics[1, 0]
    else:
        found = integrate(*where, TimeStepping(steps_per_period=steps, max_periods=patience))
        kind = "settled" if found.settled else "not periodic"
        amplitude = (found.harmonics[1] if found.settled else found.average)[0]
        if not np.isfinite(amplitude):
            kind = "overflow"
    return Orbit(
        float(point.omega / HZ),
        kind,
        float(np.abs(amplitude)),
        found.outputs[:, -1],
        found.gap,
        found.contact_force,
        process_time() - begun,
    )


def nearest(points: Sequence[ForcedPoint], hertz: float) -> ForcedPoint:
    """Return the point next to a frequency."""
    return min(points, key=lambda p: abs(p.omega / HZ - hertz))


def time_signal(problem: ForcedProblem, point: ForcedPoint, dof: int, samples: int) -> FloatArray:
    """Return the displacement of a dof over a period that begins with the load's."""
    motion = problem.low.linear.recover(point.omega, point.coefficients)[:, dof]
    phase = np.arange(1, samples + 1) / samples * 2j * np.pi
    orders = np.arange(len(motion))
    return np.real(np.exp(phase[:, None] * orders) @ motion)
