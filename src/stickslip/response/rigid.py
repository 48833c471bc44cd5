"""Forced response with rigid contacts, by the dynamic Lagrangian method; other contacts may have a stiffness."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.dlft import DynamicLagrangian, dynamic_lagrangian
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.starting_solutions import plain_sweep
from stickslip.response.parameter import Discretisation
from stickslip.response.system import System
from stickslip.solve.continuation import Point
from stickslip.solve.status import Status


@dataclass(frozen=True, eq=False)
class RigidPoint:
    """Point of a response with rigid contacts.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    coefficients
        (order+1, n) complex displacement of all dofs of the structure, m.
    contact_force
        (n_contacts, 3, samples) forces over one period along t, w, n, N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open, for t and w.
    status
        How the solver ended; a point that did not converge is no solution.
    iterations
        Newton steps.
    """

    omega: float
    coefficients: ComplexArray
    contact_force: FloatArray
    state: IntArray
    status: Status
    iterations: int

    @property
    def converged(self) -> bool:
        """Whether the point is a solution."""
        return self.status.converged


@by_one_thread
def rigid_response(
    system: System,
    load: HarmonicLoad,
    omega_range: tuple[float, float],
    points: int = 40,
    discretisation: Discretisation | None = None,
    penalty: float | None = None,
) -> Iterator[RigidPoint]:
    """Compute the forced response of a system with `RigidCoulomb` contacts over a frequency range, by arc length.

    All harmonics are kept everywhere. There is no Jacobian Alert, because the force of a rigid contact is no function
    of its gap.

    Parameters
    ----------
    system
        Structure, contacts and outputs. Each gap of a rigid contact must be a coordinate: see
        `in_relative_coordinates`.
    load
        Static and harmonic forces on all dofs, N.
    omega_range
        Smallest and largest frequency, rad/s; twice the same for one frequency.
    points
        Smallest number of points; curved parts of the branch get more.
    discretisation
        Harmonics, samples, solver. With as many samples as coefficients, ``2 order + 1``, the laws hold exactly at the
        samples; eight or more samples for each harmonic are more accurate.
    penalty
        Penalty of the method, N/m; see `dynamic_lagrangian`. It is no stiffness of the contacts.

    Yields
    ------
    RigidPoint
        Points in the order of the branch, the last one at the end of the range. Where the branch is lost, a point
        without convergence follows, and a restart a little further on.

    Raises
    ------
    InputError
        If the range is empty, no contact is rigid, or a gap of a rigid contact is no coordinate.
    """
    first, last = omega_range
    if not 0.0 < first <= last < np.inf:
        raise input_error("omega_range", f"goes from {first:g} to {last:g} rad/s", "Give 0 < first <= last.")
    how = discretisation or Discretisation()
    # coordinates of permanently sticking contacts are zero and cannot measure a step
    linear = system.condensed(load, how.order, system.outputs)
    problem = dynamic_lagrangian(linear, system.interface, how.order, how.samples, penalty, how.evaluator)
    for found in plain_sweep(system, problem, omega_range, points, how.newton):
        yield _rigid_point(problem, found.point)


def _rigid_point(problem: DynamicLagrangian, point: Point) -> RigidPoint:
    at = problem.contacts(point.x, point.p)
    return RigidPoint(
        point.p,
        problem.linear.recover(point.p, problem.coefficients(point.x)),
        at.force,
        at.state,
        point.solution.status,
        point.solution.iterations,
    )
