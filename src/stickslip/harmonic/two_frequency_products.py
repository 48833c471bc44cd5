"""The dynamic stiffness of all combined frequencies, as the Jacobian by its parts takes it."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.fourier import to_complex, to_real
from stickslip.harmonic.harmonic_set import Harmonics


@dataclass(frozen=True, eq=False)
class CombinedProducts:
    """One matrix for each combined frequency, by products; `StiffnessProducts` whose harmonics are the places of combined frequencies.

    Parameters
    ----------
    stiffness
        (k, n, n) of each, the static one first, N/m.
    """

    stiffness: ComplexArray

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.stiffness.shape[1])

    @property
    def harmonics(self) -> Harmonics:
        """Their places."""
        return tuple(range(len(self.stiffness)))

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness."""
        return isinstance(other, CombinedProducts) and self.stiffness is other.stiffness

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return to_real((self.stiffness @ to_complex(rows)[:, :, None])[..., 0])

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z, which is that of the conjugate transpose."""
        return to_real((to_complex(rows).conj()[:, None, :] @ self.stiffness)[:, 0].conj())

    def block(self, harmonic: int) -> ComplexArray:
        """Return the matrix at a place, (n, n) in Fortran order, to be changed at will."""
        return np.array(self.stiffness[harmonic], order="F")
