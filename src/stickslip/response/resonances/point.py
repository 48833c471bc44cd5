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
