"""Products with one small complex matrix a harmonic, all harmonics in one compiled loop.

With a hundred unknowns a harmonic or fewer, a call from Python for each harmonic costs several times what it computes.
"""

from dataclasses import dataclass
from functools import lru_cache

import numba
import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.product import subtract_lower
from stickslip.harmonic.linear import Products

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
        _products(self.real, self.imaginary, rows, out)
        return out


def small_blocks(matrices: list[ComplexArray]) -> SmallBlocks:
    """Return (n, n) matrices, one a harmonic, in the form that the compiled loops read."""
    stacked = np.stack([matrix.T for matrix in matrices])
    return SmallBlocks(np.ascontiguousarray(stacked.real), np.ascontiguousarray(stacked.imag))


@lru_cache(maxsize=2)
def dynamic_stiffness(linear: Products) -> SmallBlocks:
    """Return the dynamic stiffness of all harmonics at one frequency, N/m; kept, because a Krylov method multiplies with it many times."""
    return small_blocks([linear.block(h) for h in linear.harmonics])


@numba.njit(cache=True, nogil=True)
def _multiply(real, imaginary, h, rows, out):  # type: ignore[no-untyped-def]
    """Set the rows of harmonic `h` of `out` to the product with those of `rows`; both may be the same array for one row alone."""
    n = rows.shape[1]
    first = max(2 * h - 1, 0)
    if h == 0:
        out[0] = 0.0
        for k in range(n):
            c = rows[0, k]
            for j in range(n):
                out[0, j] += real[0, k, j] * c
        return
    out[first : first + 2] = 0.0
    for k in range(n):
        c, s = rows[first, k], rows[first + 1, k]
        for j in range(n):
            a, b = real[h, k, j], imaginary[h, k, j]
            out[first, j] += a * c + b * s
            out[first + 1, j] += a * s - b * c


@numba.njit(cache=True, nogil=True)
def _products(real, imaginary, rows, out):  # type: ignore[no-untyped-def]
    """Set `out` (m, n) to the products with `rows` (m, n); see `SmallBlocks`."""
    for h in range(real.shape[0]):
        _multiply(real, imaginary, h, rows, out)


@numba.njit(cache=True, nogil=True)
def sweep(real, imaginary, blocks, columns, values, scale, rows, gap, out):  # type: ignore[no-untyped-def]
    """Solve harmonic by harmonic, from the static one up, each with what those below it do at the contacts.

    Parameters
    ----------
    real, imaginary
        The inverses, as in `SmallBlocks`.
    blocks, columns, values, scale
        As in `subtract_lower`.
    rows
        (m, n) right side; overwritten.
    gap
        Work: (n_contacts, 3, m).
    out
        Out: (m, n) solution.
    """
    before = first = 0
    for h in range(real.shape[0]):
        last = 2 * h + 1
        if first > 0:
            # what is subtracted comes from solved rows; it goes into rows that are not solved yet
            subtract_lower(blocks, columns, values, out, before, first, last, scale, gap, rows)
        _multiply(real, imaginary, h, rows, out)
        before, first = first, last
