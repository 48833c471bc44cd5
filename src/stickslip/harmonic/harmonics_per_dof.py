"""Harmonic balance in which each coordinate has its own set of harmonics.

With ``P`` the columns of the unit matrix for the kept pairs of harmonic and coordinate, the motion is ``x = P y`` and
Galerkin's equations are ``Pᵀ r(P y) = 0``. Harmonics that a coordinate does not keep are zero, and their equilibrium at
this coordinate is not enforced.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.interface import Interface, SparseRows
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.dlft import DynamicLagrangian
from stickslip.harmonic.harmonic_set import ByDof, Harmonics, kept_by_dof
from stickslip.harmonic.linear import DynamicStiffness


@dataclass(frozen=True, eq=False)
class LocalBalance:
    """A periodic problem in which each coordinate has its own harmonics.

    Parameters
    ----------
    balance
        The same problem with the union of all harmonics.
    by_dof
        Support of each retained coordinate.
    """

    balance: HarmonicBalance
    by_dof: ByDof

    @cached_property
    def own(self) -> IntArray:
        """Positions of the unknowns among those of `balance`."""
        kept = kept_by_dof(self.by_dof, self.harmonics)
        rows = np.concatenate([kept[:1], np.repeat(kept[1:], 2, axis=0)])
        return np.flatnonzero(rows)

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return int(self.own.size)

    @property
    def order(self) -> int:
        """Highest harmonic of any coordinate."""
        return self.balance.order

    @property
    def harmonics(self) -> Harmonics:
        """Union of the harmonics of all coordinates."""
        return self.balance.harmonics

    @property
    def linear(self) -> DynamicStiffness:
        """The condensed structure and its load."""
        return self.balance.linear

    @property
    def rows(self) -> SparseRows:
        """Gap operator, sorted by contact."""
        return self.balance.rows

    @property
    def springs(self) -> Interface:
        """The interface, which gives the stiffness where no contact slips or opens."""
        return self.balance.springs

    @property
    def displacement_scale(self) -> float:
        """Displacement of a scaled unknown of one, m."""
        return self.balance.displacement_scale

    @property
    def force_scale(self) -> float:
        """Force of a scaled residual of one, N."""
        return self.balance.force_scale

    def whole(self, x: FloatArray) -> FloatArray:
        """Return the unknowns of `balance`, zeros for harmonics that a coordinate does not keep."""
        out = np.zeros(self.balance.size)
        out[self.own] = x
        return out

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients in metres of scaled unknowns `x`."""
        return self.balance.coefficients(self.whole(x))

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients`, padded or cut to the harmonics of each coordinate."""
        return np.asarray(self.balance.unknowns(coefficients)[self.own])

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s)."""
        return self.balance.contacts(self.whole(x), omega)

    def linearise(self, x: FloatArray, omega: float) -> Linearisation:
        """Return residual, Jacobian and ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s)."""
        at = self.balance.linearise(self.whole(x), omega)
        jac = np.asfortranarray(at.dense_jac()[np.ix_(self.own, self.own)])
        return replace(at, residual=at.residual[self.own], by_x=jac, by_omega=at.jac_p[self.own], events=None)

    def linear_load(self, omega: float) -> FloatArray:
        """Return the (m, n) real coefficients of the condensed load at `omega` (rad/s)."""
        return self.balance.linear_load(omega)

    def linear_block(self, omega: float, harmonic: int) -> Matrix:
        """Return the (n, n) condensed dynamic stiffness of a harmonic at `omega` (rad/s), as a copy."""
        return self.balance.linear_block(omega, harmonic)

    def with_harmonics(self, harmonics: Harmonics) -> "LocalBalance":
        """Return the same problem; each coordinate keeps those of its harmonics that are in `harmonics`."""
        few = tuple(tuple(h for h in own if h in harmonics) for own in self.by_dof)
        return LocalBalance(self.balance.with_harmonics(harmonics), few)


AnyBalance = HarmonicBalance | DynamicLagrangian | LocalBalance
