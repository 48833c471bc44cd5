"""A resonance peak."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.peak import PeakProblem
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Status


@dataclass(frozen=True, eq=False)
class PeakPoint:
    """A resonance peak at one value of the design parameter.

    Attributes
    ----------
    value
        Value of the parameter.
    omega
        Frequency of the peak, rad/s; of a subharmonic resonance that of the load.
    amplitude
        Amplitude of the output in the harmonic that the load drives, m; with several, the norm over them; or in the harmonic asked for.
    phase
        Phase of the output against the force, rad, in the first of these harmonics; -π/2 in quadrature. Of a harmonic h that the load
        does not drive, against h times the phase of the force.
    slope
        Derivative of the amplitude by the parameter along the curve of peaks, m over the parameter's unit.
    curvature
        ``d² ln(amplitude) / d(ln ω)²`` of the response: negative at a maximum.
    energy
        Work of the harmonic load per period of the first harmonic, J, equal to the total dissipation.
    friction
        Dissipation of the contacts, J.
    below
        Relative amount by which the nearby maximum is higher, from slope and curvature of the response; 0 at a horizontal tangent, NaN
        without a maximum.
    coefficients
        (order+1, n) complex displacement of all dofs of the structure, m.
    status
        How the solver ended; a point that did not converge is no peak.
    iterations
        Newton steps.
    evaluations
        Number of evaluations of the periodic problem, including those of slope and curvature, and in the first point those of the sweep.
    peak
        Number of the peak, from 0, where several are followed: 0 is the highest at the first value.
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
        """Whether the amplitude falls on both sides: a horizontal tangent may also be a minimum or a saddle."""
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
        Phase of the force in the first of the harmonics that peak, rad.
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
    """Return the work of the harmonic load over a period of the first harmonic, J, for the (order+1, n) motion of all dofs."""
    load = balance.linear.load_at(omega)
    return float(sum(-np.pi * h * np.imag(np.vdot(f, motion[h])) for h, f in load.harmonics.items()))


def taken(balance: HarmonicBalance, x: FloatArray, omega: float) -> float:
    """Return the work that the contacts take over such a period, J, at the unknowns `x`."""
    force = np.zeros((balance.n_rows, balance.linear.n))
    balance.rows.add_forces(balance.forces(x, omega).coefficients, force)
    motion = balance.displacement_scale * x.reshape(force.shape)
    work = [
        h * float(force[2 * i + 1] @ motion[2 * i + 2] - force[2 * i + 2] @ motion[2 * i + 1])
        for i, h in enumerate(balance.harmonics[1:])
    ]
    return np.pi * float(sum(work))
