"""The periodic problem in displacements: ``q + H (B λ(Bᵀ q) - F) = 0`` with the compliance H (Krack et al. 2017, eq. 28, 62 and 64).

The force form weighs harmonic h by its dynamic stiffness, which grows as h²; this one weighs all harmonics alike. It needs the inverse
of every ``Z_h``, which a free body does not have at h = 0. Eq. 64 is printed without the excitation; it is kept here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import SingularError
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import HarmonicBalance, Linearisation
from stickslip.harmonic.dlft import DynamicLagrangian
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.harmonic_set import to_complex, to_real

SINGULAR = 1e-13  # smallest singular value of a scaled dynamic stiffness over the largest


@dataclass(frozen=True, eq=False)
class ComplianceForm:
    """A periodic problem whose residual is a displacement; same unknowns and same solutions as `balance`.

    Parameters
    ----------
    balance
        The problem in forces.
    labels
        Names of the retained coordinates, for messages; numbers where none are given.
    """

    balance: HarmonicBalance | DynamicLagrangian
    labels: Sequence[str] = ()

    @property
    def size(self) -> int:
        """Number of real unknowns."""
        return self.balance.size

    @property
    def order(self) -> int:
        """Highest harmonic."""
        return self.balance.order

    def coefficients(self, x: FloatArray) -> ComplexArray:
        """Return the (order+1, n) complex coefficients in metres of scaled unknowns `x`."""
        return self.balance.coefficients(x)

    def unknowns(self, coefficients: ComplexArray) -> FloatArray:
        """Return the scaled unknowns of complex `coefficients`, padded or cut to the order."""
        return self.balance.unknowns(coefficients)

    def contacts(self, x: FloatArray, omega: float) -> ContactPeriod:
        """Return gaps, forces and states of all contacts over one period, at the scaled unknowns `x` and `omega` (rad/s)."""
        return self.balance.contacts(x, omega)

    def linearise(self, x: FloatArray, omega: float) -> Linearisation:
        """Return ``H r``, ``I + H K̂`` and the ω-derivative at scaled unknowns `x` (size,) and `omega` (rad/s).

        Raises
        ------
        SingularError
            If a dynamic stiffness is singular; the message names harmonic and coordinate.
        """
        at = self.balance.linearise(x, omega)
        condensed = self.balance.linear.condensed(omega, self.order)
        self._check(condensed, omega)
        factor = self.balance.force_scale / self.balance.displacement_scale
        residual = factor * self._compliant(condensed, at.residual[:, None])
        moved = to_complex(residual.reshape(2 * self.order + 1, -1))[:, :, None]
        stiffer = to_real((condensed.derivative @ moved)[:, :, 0]).reshape(-1)
        return Linearisation(
            residual[:, 0],
            factor * self._compliant(condensed, at.dense_jac()),
            factor * self._compliant(condensed, (at.jac_p - stiffer / factor)[:, None])[:, 0],
            at.seconds_contact,
        )

    def _compliant(self, condensed: Condensed, columns: FloatArray) -> FloatArray:
        """Return the columns (size, k) multiplied by the compliance of each harmonic."""
        rows = columns.reshape(2 * self.order + 1, -1, columns.shape[1])
        return to_real(np.linalg.solve(condensed.stiffness, to_complex(rows))).reshape(columns.shape)

    def _check(self, condensed: Condensed, omega: float) -> None:
        diagonal = np.abs(np.diagonal(condensed.stiffness, axis1=1, axis2=2)).max(axis=0)
        size = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scaled = condensed.stiffness / np.outer(size, size)
        _, values, rows = np.linalg.svd(scaled)
        for h in np.flatnonzero(values[:, -1] <= SINGULAR * values[:, 0]):
            at = int(np.argmax(np.abs(rows[h, -1])))
            name = self.labels[at] if self.labels else f"number {at}"
            raise SingularError(
                f"ComplianceForm: the dynamic stiffness of harmonic {h} at {omega:g} rad/s is singular: nothing but contact "
                f"holds retained coordinate {name}. Solve in forces (harmonic_balance), or give it a retention stiffness."
            )
