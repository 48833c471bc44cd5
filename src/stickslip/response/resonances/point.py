"""A resonance peak; and of several peaks over the parameter the highest: crossings, and its minimum."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.column import column
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.peak import PeakProblem
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Status


@dataclass(frozen=True, eq=False)
class PeakPoint:
    """Resonance peak at one value of the design parameter.

    Attributes
    ----------
    value
        Value of the parameter.
    omega
        Frequency of the peak, rad/s; for a subharmonic resonance, the frequency of the load.
    amplitude
        Amplitude of the output in the driven harmonic or the requested one, m; for several driven harmonics, the norm.
    phase
        Phase of the output relative to the force, rad, in the first of these harmonics; -π/2 in quadrature. For a
        harmonic h that the load does not drive, relative to h times the phase of the force.
    slope
        Derivative of the amplitude by the parameter along the curve of peaks, m over the parameter's unit.
    curvature
        ``d² ln(amplitude) / d(ln ω)²`` of the response: negative at a maximum.
    energy
        Work of the harmonic load per period of the first harmonic, J, equal to the total dissipation.
    friction
        Dissipation of the contacts, J.
    below
        Relative height of the nearby maximum above this point, from slope and curvature of the response; 0 at a
        horizontal tangent, NaN without a maximum.
    coefficients
        (order+1, n) complex displacement of all dofs of the structure, m.
    status
        How the solver ended; a point that did not converge is no peak.
    iterations
        Newton steps.
    evaluations
        Number of evaluations of the periodic problem, including slope and curvature, and for the first point the sweep.
    peak
        Number of the peak from 0, if several are followed; 0 is the highest at the first value.
    """

    value: float
    omega: float
    amplitude: float
    phase: float
    slope: float
    curvature: float
    energy: float
    friction: float
    below: float
    coefficients: ComplexArray
    status: Status
    iterations: int
    evaluations: int
    peak: int = 0

    @property
    def converged(self) -> bool:
        """Whether the point fulfils the condition of a peak."""
        return self.status.converged

    @property
    def is_maximum(self) -> bool:
        """Whether the point is a maximum; a horizontal tangent may also be a minimum or a saddle."""
        return self.curvature < 0.0


def peak_point(
    problem: PeakProblem, force: float, value: float, solution: Solution, evaluations: int, peak: int = 0
) -> PeakPoint:
    """Return a solution of the peak problem as a `PeakPoint`.

    Parameters
    ----------
    problem
        The equation.
    force
        Phase of the force in the first of the peaking harmonics, rad.
    value
        Value of the parameter.
    solution
        Solution of the equation.
    evaluations
        Number of evaluations.
    peak
        Number of the peak.
    """
    y, slope, curvature, below = solution.x, np.nan, np.nan, np.nan
    balance, omega = problem.family(value), problem.omega(y)
    if solution.status.converged:
        state = problem.state(y, value)
        slope, curvature = problem.amplitude_slope(state), problem.curvature(state)
        _, below = problem.top(state)
    driven = problem.motion(y, value)
    amplitude = float(np.linalg.norm(driven))
    lag = float(np.angle(driven[0] * np.exp(-1j * force)))
    motion = balance.linear.recover(omega, balance.coefficients(y[:-1]))
    return PeakPoint(
        value,
        omega,
        amplitude,
        lag,
        amplitude * slope,
        curvature,
        put_in(balance, motion, omega),
        taken(balance, y[:-1], omega),
        below,
        motion,
        solution.status,
        solution.iterations,
        evaluations,
        peak,
    )


def put_in(balance: HarmonicBalance, motion: ComplexArray, omega: float) -> float:
    """Return the work of the harmonic load over a period of the first harmonic, J.

    `motion` (order+1, n) has all dofs.
    """
    load = balance.linear.load_at(omega)
    return float(sum(-np.pi * h * np.imag(np.vdot(f, motion[h])) for h, f in load.harmonics.items()))


def taken(balance: HarmonicBalance, x: FloatArray, omega: float) -> float:
    """Return the dissipation of the contacts over a period of the first harmonic, J, at the unknowns `x`."""
    force = np.zeros((balance.n_rows, balance.linear.n))
    balance.rows.add_forces(balance.forces(x, omega).coefficients, force)
    motion = balance.displacement_scale * x.reshape(force.shape)
    work = [
        h * float(force[2 * i + 1] @ motion[2 * i + 2] - force[2 * i + 2] @ motion[2 * i + 1])
        for i, h in enumerate(balance.harmonics[1:])
    ]
    return np.pi * float(sum(work))


@dataclass(frozen=True, eq=False, kw_only=True)
class Overtaking:
    """A value of the parameter at which another peak becomes the highest, interpolated between two visited values."""

    value: float = column("1", "where another peak becomes the highest")
    before: int = column("1", "number of the peak that was")
    after: int = column("1", "number of the peak that is from there on")
    amplitude: float = column("m", "amplitude of both there")


def heights(points: Sequence[PeakPoint], values: Sequence[float]) -> FloatArray:
    """Return (peaks, values) amplitudes of the maxima at the visited values; NaN for missing ones."""
    known = {(p.peak, p.value): p.amplitude for p in points if p.converged and p.is_maximum}
    count = 1 + max((p.peak for p in points), default=-1)
    return np.array([[known.get((i, v), np.nan) for v in values] for i in range(count)])


def along_span(points: Sequence[PeakPoint]) -> tuple[FloatArray, list[float]]:
    """Return (peaks, values) amplitudes of curves by arc length up to their first fold, interpolated, and the values."""
    count = 1 + max((p.peak for p in points), default=-1)
    curves = [_before_fold([p for p in points if p.peak == i]) for i in range(count)]
    values = np.unique([p.value for own in curves for p in own])
    amplitude = np.full((count, values.size), np.nan)
    for row, own in zip(amplitude, curves, strict=True):
        if len(own) > 1:
            order = sorted(own, key=lambda p: p.value)
            known = [p.value for p in order]
            row[:] = np.interp(values, known, [p.amplitude for p in order], np.nan, np.nan)
    falling = len(points) > 1 and points[1].value < points[0].value
    return (amplitude[:, ::-1], values[::-1].tolist()) if falling else (amplitude, values.tolist())


def _before_fold(curve: Sequence[PeakPoint]) -> list[PeakPoint]:
    """Return the maxima of a curve up to the first reversal of the value."""
    found: list[PeakPoint] = []
    for point in curve:
        if not (point.converged and point.is_maximum):
            continue
        if len(found) > 1 and (point.value - found[-1].value) * (found[1].value - found[0].value) <= 0.0:
            break
        found.append(point)
    return found


def highest(amplitude: FloatArray) -> IntArray:
    """Return the number of the highest peak at each value; -1 for none."""
    filled = np.where(np.isfinite(amplitude), amplitude, -np.inf)
    return np.where(np.any(np.isfinite(amplitude), axis=0), np.argmax(filled, axis=0), -1)


def overtakings(amplitude: FloatArray, values: Sequence[float]) -> list[Overtaking]:
    """Return the values at which another peak becomes the highest.

    Parameters
    ----------
    amplitude
        (peaks, values) in m.
    values
        Values in the order of visits.
    """
    top = highest(amplitude)
    found = []
    for i, j in pairwise(map(int, np.flatnonzero(top >= 0))):
        a, b = int(top[i]), int(top[j])
        if a == b:
            continue
        gap = amplitude[a, [i, j]] - amplitude[b, [i, j]]
        if not np.all(np.isfinite(gap)) or gap[0] == gap[1]:
            continue  # one peak is not known on both sides, or both are the same peak
        share = gap[0] / (gap[0] - gap[1])
        value = values[i] + share * (values[j] - values[i])
        there = amplitude[b, i] + share * (amplitude[b, j] - amplitude[b, i])
        found.append(Overtaking(value=float(value), before=a, after=b, amplitude=float(there)))
    return found


def valley(points: Sequence[PeakPoint], amplitude: FloatArray, values: Sequence[float]) -> tuple[float, float] | None:
    """Return two visited values between which the highest peak has its minimum without changing to another peak; None for none."""
    top = highest(amplitude)
    if not np.any(top >= 0):
        return None
    envelope = np.where(top >= 0, np.nanmax(np.where(np.isnan(amplitude), -np.inf, amplitude), axis=0), np.inf)
    lowest = int(np.argmin(envelope))
    slopes = {(p.peak, p.value): p.slope for p in points if p.converged}
    for i, j in ((lowest - 1, lowest), (lowest, lowest + 1)):
        if i < 0 or j >= len(values) or top[i] != top[j]:
            continue
        falls, rises = (slopes[int(top[k]), values[k]] * (values[j] - values[i]) for k in (i, j))
        if falls < 0.0 < rises:
            return values[i], values[j]
    return None
