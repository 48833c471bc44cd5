"""A condensed dynamic stiffness at one frequency: by its matrices, where these are known, or by its products."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.dynamic_stiffness import Condensed, CondensedStiffness
from stickslip.harmonic.fourier import to_complex, to_real
from stickslip.harmonic.harmonic_set import Harmonics, is_full
from stickslip.harmonic.linear import DynamicStiffness, Products
from stickslip.harmonic.small_blocks import SMALL


@dataclass(frozen=True, eq=False)
class MatrixProducts:
    """A condensed structure by its matrices at one frequency; see `Products`.

    Parameters
    ----------
    condensed
        Matrices and load of the harmonics of the support.
    harmonics
        The support.
    """

    condensed: Condensed
    harmonics: Harmonics

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.condensed.load.shape[1])

    @cached_property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        return to_real(self.condensed.load)

    @cached_property
    def load_slope(self) -> FloatArray:
        """(m, n) its derivative by ω."""
        return to_real(self.condensed.load_derivative)

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return isinstance(other, MatrixProducts) and other.condensed is self.condensed

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return _times(self.condensed.stiffness, rows)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z."""
        return _times(self.condensed.stiffness.conj().transpose(0, 2, 1), rows)

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        return self.product(rows), _times(self.condensed.derivative, rows)

    def block(self, harmonic: int) -> ComplexArray:
        """Return ``Z_h``, (n, n) complex in Fortran order, to be changed at will."""
        return np.array(self.condensed.stiffness[self.harmonics.index(harmonic)], order="F")


def _times(matrices: ComplexArray, rows: FloatArray) -> FloatArray:
    return to_real((matrices @ to_complex(rows)[:, :, None])[..., 0])


@lru_cache(maxsize=4)
def matrices(linear: DynamicStiffness, harmonics: Harmonics, omega: float) -> MatrixProducts:
    """Condense the linear side at one frequency; kept, because a Newton iteration at fixed frequency asks for it at every step."""
    part = linear.condensed(omega, harmonics[-1])
    if not is_full(harmonics):
        part = part.kept(list(harmonics))
    return MatrixProducts(part, harmonics)


@lru_cache(maxsize=2)
def products(linear: DynamicStiffness, harmonics: Harmonics, omega: float) -> Products:
    """Return the linear side at one frequency by its products."""
    # small matrices are all formed sooner or later, and cost less at once
    if isinstance(linear, CondensedStiffness) and linear.n <= SMALL:
        return matrices(linear, harmonics, omega)
    return linear.products(omega, harmonics)
