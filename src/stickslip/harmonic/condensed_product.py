"""Products of the condensed dynamic stiffness at one frequency, without forming it.

``Z_h q = D_NN q - D_NL D_LL⁻¹ D_LN q`` needs the structure's real matrices only, which all harmonics share, so that a frequency costs no
condensation; one harmonic at a time is formed where it is to be factorised.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.dynamic_stiffness import CondensedStiffness
from stickslip.harmonic.fourier import to_complex, to_real
from stickslip.harmonic.spectral import StateSpace

Parts = tuple[FloatArray, FloatArray, FloatArray]  # K, C, M, or their products with the same rows
# interior dynamic stiffness of each harmonic: its diagonal, or its state-space eigenvectors and ihω, or its LU factors
InnerOne = ComplexArray | tuple[StateSpace, complex] | tuple[ComplexArray, IntArray]
Inner = tuple[InnerOne, ...]


@dataclass(frozen=True, eq=False)
class CondensedProduct:
    """The condensed structure and its load at one frequency; build it with `at_frequency`.

    Vectors are real and harmonic-major: (2 order + 1, n) rows.
    """

    linear: CondensedStiffness
    omega: float
    order: int
    frequencies: FloatArray  # (2 order + 1, 1) h ω of each row, rad/s
    inner: Inner
    load: FloatArray  # (2 order + 1, n), N
    load_slope: FloatArray  # (2 order + 1, n), by ω

    def same(self, other: "CondensedProduct") -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            self.omega == other.omega
            and self.order == other.order
            and (self.linear.nn is other.linear.nn)
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        s = self.frequencies
        moved = _solve_inner(self.inner, _dynamic(_times(self.linear.nl, rows), s))
        return _dynamic(_times(self.linear.nn, rows), s) - _dynamic(
            _times_transposed(self.linear.nl, moved), s
        )

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z, whose complex blocks are symmetric."""
        mirrored = rows.copy()
        mirrored[2::2] *= -1.0
        out = self.product(mirrored)
        out[2::2] *= -1.0
        return out

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        s = self.frequencies
        near, far = _times(self.linear.nn, rows), _times(self.linear.nl, rows)
        moved = _solve_inner(self.inner, _dynamic(far, s))
        back = _times_transposed(self.linear.nl, moved)
        turned = _solve_inner(
            self.inner, _slope(far, s) - _slope(_inner_parts(self.linear, moved), s)
        )
        slope = _slope(near, s) - _slope(back, s)
        slope -= _dynamic(_times_transposed(self.linear.nl, turned), s)
        return _dynamic(near, s) - _dynamic(back, s), _by_omega(slope)

    def block(self, harmonic: int) -> ComplexArray:
        """Return ``Z_h``, (n, n) complex in Fortran order."""
        s = harmonic * self.omega
        (k, c, m), (k_nl, c_nl, m_nl) = self.linear.nn, self.linear.nl
        # symmetric: their transposes are in Fortran order
        out = np.empty(k.shape, dtype=complex, order="F")
        np.multiply(m.T, -(s**2), out=out.real)
        out.real += k.T
        np.multiply(c.T, s, out=out.imag)
        far = k_nl + 1j * s * c_nl - s**2 * m_nl
        if far.shape[1] == 0:
            return out
        moved = _solve_one(self.inner[harmonic], far.T)
        # in place: for thousands of coordinates this is the largest array there is
        return np.asarray(
            scipy.linalg.blas.zgemm(-1.0, far, moved, beta=1.0, c=out, overwrite_c=True)
        )


def at_frequency(linear: CondensedStiffness, omega: float, order: int) -> CondensedProduct:
    """Prepare the products of `linear` at one frequency.

    Parameters
    ----------
    linear
        Structure and load from `condense`.
    omega
        Frequency, rad/s.
    order
        Highest harmonic.
    """
    frequencies = omega * ((np.arange(2 * order + 1) + 1) // 2)[:, None]
    coefficients = linear.load.coefficients(order)
    load = to_real(coefficients[:, linear.retained])
    inner_load = to_real(coefficients[:, linear.interior] @ linear.modes)
    bare = CondensedProduct(
        linear, omega, order, frequencies, _inner(linear, omega, order), load, np.zeros_like(load)
    )
    if not np.any(inner_load):
        return bare
    return _with_inner_load(bare, inner_load)


def _with_inner_load(bare: CondensedProduct, inner_load: FloatArray) -> CondensedProduct:
    """Move the load of the interior, (2 order + 1, l), to the retained coordinates: ``F = F_N - D_NL D_LL⁻¹ F_L``."""
    s = bare.frequencies
    moved = _solve_inner(bare.inner, inner_load)
    back = _times_transposed(bare.linear.nl, moved)
    turned = _solve_inner(bare.inner, _slope(_inner_parts(bare.linear, moved), s))
    slope = _dynamic(_times_transposed(bare.linear.nl, turned), s) - _slope(back, s)
    return CondensedProduct(
        bare.linear, bare.omega, bare.order, s, bare.inner, bare.load - _dynamic(back, s), _by_omega(slope)
    )  # fmt: skip


def _inner(linear: CondensedStiffness, omega: float, order: int) -> Inner:
    k, c, m = linear.ll
    s = omega * np.arange(order + 1)
    if linear.diagonal:
        k, c, m = np.diagonal(k), np.diagonal(c), np.diagonal(m)
        return tuple(k + 1j * w * c - w**2 * m for w in s)
    states = linear.spectral.states if np.any(s) else None
    if states is not None:
        return tuple((states, 1j * w) for w in s)
    return tuple(scipy.linalg.lu_factor(k + 1j * w * c - w**2 * m) for w in s)


def _solve_inner(inner: Inner, rows: FloatArray) -> FloatArray:
    each = zip(inner, to_complex(rows), strict=True)
    return to_real(np.array([_solve_one(own, right) for own, right in each]))


def _solve_one(inner: InnerOne, right: ComplexArray) -> ComplexArray:
    """Solve the interior of one harmonic for `right` (l,) or (l, k)."""
    if isinstance(inner, np.ndarray):
        return np.asarray(right / (inner if right.ndim == 1 else inner[:, None]))
    first, second = inner
    if isinstance(first, StateSpace):
        return first.solve(complex(second), right)
    return np.asarray(scipy.linalg.lu_solve((first, second), right))


def _inner_parts(linear: CondensedStiffness, rows: FloatArray) -> Parts:
    if linear.diagonal:
        k, c, m = (rows * np.diagonal(a) for a in linear.ll)
        return k, c, m
    return _times(linear.ll, rows)


def _by_omega(slope: FloatArray) -> FloatArray:
    """Turn a derivative by the frequency ``hω`` of each row into one by ω."""
    return np.asarray(((np.arange(slope.shape[0])[:, None] + 1) // 2) * slope)


def _times(blocks: Parts, rows: FloatArray) -> Parts:
    k, c, m = blocks
    return rows @ k, rows @ c, rows @ m


def _times_transposed(blocks: Parts, rows: FloatArray) -> Parts:
    k, c, m = blocks
    return rows @ k.T, rows @ c.T, rows @ m.T


def _dynamic(parts: Parts, s: FloatArray) -> FloatArray:
    """Return ``K q + i s C q - s² M q`` from the products of the three matrices with the rows of q."""
    k, c, m = parts
    return k + _turned(s * c) - s**2 * m


def _slope(parts: Parts, s: FloatArray) -> FloatArray:
    """Return the derivative of `_dynamic` by s."""
    _, c, m = parts
    return _turned(c) - 2.0 * s * m


def _turned(rows: FloatArray) -> FloatArray:
    """Multiply the complex coefficients ``C - iS`` that the `rows` stand for by i."""
    out = np.zeros_like(rows)
    out[1::2] = rows[2::2]
    out[2::2] = -rows[1::2]
    return out
