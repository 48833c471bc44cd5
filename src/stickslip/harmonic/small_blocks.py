"""Products with one small complex matrix a harmonic, all harmonics in one compiled loop.

With a hundred unknowns a harmonic or fewer, a call from Python for each harmonic costs several times what it computes.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.product import multiply_blocks
from stickslip.harmonic.linear import StiffnessProducts

SMALL = 96  # unknowns a harmonic up to which this is faster than LAPACK and BLAS for each


@dataclass(frozen=True, eq=False)
class SmallBlocks:
    """One complex matrix a harmonic, the static one first; build it with `small_blocks`.

    Attributes
    ----------
    real, imaginary
        (len(harmonics), n, n) parts of the transposed matrices.
    """

    real: FloatArray
    imaginary: FloatArray

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the products with the coefficients ``C - iS`` that the (m, n) `rows` stand for."""
        out = np.empty_like(rows)
        multiply_blocks(self.real, self.imaginary, rows, out)
        return out


def small_blocks(matrices: list[ComplexArray]) -> SmallBlocks:
    """Return (n, n) matrices, one a harmonic, in the form that the compiled loops read."""
    stacked = np.stack([matrix.T for matrix in matrices])
    return SmallBlocks(np.ascontiguousarray(stacked.real), np.ascontiguousarray(stacked.imag))


@lru_cache(maxsize=2)
def dynamic_stiffness(linear: StiffnessProducts) -> SmallBlocks:
    """Return the dynamic stiffness of all harmonics at one frequency, N/m; kept, because a Krylov method multiplies with it many times."""
    return small_blocks([linear.block(h) for h in linear.harmonics])
