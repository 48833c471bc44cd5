"""Periodic motions with one rigid contact under a constant normal load, and what they tend to as the harmonics grow."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.harmonic.dlft import DynamicLagrangian, dynamic_lagrangian
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.solve.newton_method import Newton, newton

SAMPLES = 128  # a harmonic: the sampling error stays well below that of the missing harmonics


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """One solution: all dofs, and the share of the period in which the contact sticks."""

    order: int
    harmonics: ComplexArray  # (H+1, n)
    stick: float


@dataclass(frozen=True, eq=False)
class Rubbing:
    """A structure of which one dof rubs on the ground with the friction force `limit`."""

    structure: Structure
    load: HarmonicLoad
    dof: int
    limit: float
    penalty: float | None = None

    def problem(self, order: int, samples: int | None = None) -> DynamicLagrangian:
        """Return the periodic problem with harmonics up to `order`."""
        gap = np.zeros((3, self.structure.n))
        gap[0, self.dof] = 1.0
        interface = Interface(("rub",), (RigidCoulomb(mu=1.0, preload=self.limit),), gap)
        linear = condense(self.structure, np.array([self.dof]), self.load)
        wanted = max(SAMPLES * order, 64) if samples is None else samples
        return dynamic_lagrangian(linear, interface, order, wanted, self.penalty)


def growing(case: Rubbing, omega: float, orders: Sequence[int]) -> list[RigidMotion]:
    """Solve with each number of harmonics, from the solution with the last one.

    Raises
    ------
    RuntimeError
        If Newton does not converge.
    """
    q = np.zeros((1, 1), dtype=complex)
    motions = []
    for order in orders:
        made = case.problem(order)
        solution = newton(lambda v, made=made: made.linearise(v, omega), made.unknowns(q), Newton(max_iterations=60))
        if not solution.status.converged:
            raise RuntimeError(f"omega = {omega}, H = {order}: {solution.status.advice}")
        q = made.coefficients(solution.x)
        state = made.contacts(solution.x, omega).state[0, 0]
        motions.append(RigidMotion(order, made.linear.recover(omega, q), float(np.mean(state == 0))))
    return motions


def extrapolated(values: Sequence[FloatArray]) -> FloatArray:
    """Return the limit of values at H, 2H and 4H whose error is a power series in 1/H (Richardson)."""
    coarse, middle, fine = values
    return np.asarray((8.0 * fine - 6.0 * middle + coarse) / 3.0)
