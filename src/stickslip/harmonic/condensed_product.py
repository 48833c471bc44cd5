"""Products of the condensed dynamic stiffness at one frequency with vectors, without forming the matrix.

``Z_h q = D_NN q - D_NL D_LL⁻¹ D_LN q`` needs only the real matrices of the structure, which all harmonics share, so
that a new frequency costs no condensation. The matrix of a harmonic is formed only for its factorisation.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import SparseRows
from stickslip.harmonic.factors import with_contacts
from stickslip.harmonic.harmonic_set import Harmonics, real_rows, to_complex, to_real
from stickslip.harmonic.spectral import Blocks, Interior, StateSpace

Parts = tuple[FloatArray, FloatArray, FloatArray]  # K, C, M, or their products with the same rows
Lossy = tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]  # products with K, C, M and structural damping
# interior dynamic stiffness of each harmonic: its diagonal, or its state-space eigenvectors and ihω, or its LU factors
InnerOne = ComplexArray | tuple[StateSpace, complex] | tuple[ComplexArray, IntArray]
Inner = ComplexArray | tuple[InnerOne, ...]  # an array: diagonals


class Interiors(Protocol):
    """Protocol of objects that have the dynamic stiffness of their interior at one frequency."""

    @property
    def omega(self) -> float: ...  # noqa: D102

    @property
    def frequencies(self) -> FloatArray: ...  # noqa: D102

    @property
    def inner(self) -> Inner: ...  # noqa: D102


@dataclass(frozen=True, eq=False)
class CondensedProduct:
    """The condensed structure and its load at one frequency; build it with `at_frequency`.

    Vectors are real and harmonic-major: (m, n) rows, the static one and two for each other harmonic of the support.
    """

    linear: Interior
    omega: float
    harmonics: Harmonics
    frequencies: FloatArray  # (m, 1) h ω of each row, rad/s
    inner: Inner
    load: FloatArray  # (m, n), N
    load_slope: FloatArray  # (m, n), by ω

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.linear.nn[0].shape[0])

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, CondensedProduct)
            and self.omega == other.omega
            and self.harmonics == other.harmonics
            and self.linear.nn is other.linear.nn
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        s = self.frequencies
        moved = _solve_inner(self.inner, dynamic_rows(onto_interior(self.linear, rows), s))
        return dynamic_rows(_near(self.linear, rows), s) - dynamic_rows(_back(self.linear, moved), s)

    @cached_property
    def transposed(self) -> "CondensedProduct":
        """The structure with transposed Z; the same object if the damping is symmetric."""
        if self.linear.ln is None:
            return self
        sizes = (self.n, self.linear.ll[0].shape[0])
        near, inner = (np.zeros((1, size), dtype=complex) for size in sizes)
        return at_frequency(self.linear.transposed, (near, inner), self.omega, self.harmonics)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z.

        It is the conjugate of Zᵀ times the conjugate of q.
        """
        mirrored = rows.copy()
        mirrored[2::2] *= -1.0
        out = self.transposed.product(mirrored)
        out[2::2] *= -1.0
        return out

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        s = self.frequencies
        near, far = _near(self.linear, rows), onto_interior(self.linear, rows)
        moved = _solve_inner(self.inner, dynamic_rows(far, s))
        back = _back(self.linear, moved)
        turned = _solve_inner(self.inner, slope_rows(far, s) - slope_rows(_inner_parts(self.linear, moved), s))
        slope = slope_rows(near, s) - slope_rows(back, s)
        slope -= dynamic_rows(_back(self.linear, turned), s)
        return dynamic_rows(near, s) - dynamic_rows(back, s), by_omega(slope, self.harmonics)

    def static(self, springs: FloatArray, rows: SparseRows) -> FloatArray:
        """Return ``Z_0 + Bᵀ k B``, (n, n), with the springs (n_contacts, 3, 3) of the contacts."""
        own = np.asarray(self.linear.nn[0] - self.linear.nl[0] @ self.linear.far[0].T)
        return np.asarray(with_contacts(own, springs, rows))

    def mass_product(self, vectors: FloatArray) -> FloatArray:
        """Return the mass times `vectors` (n, k), condensed with the static response of the interior.

        The interior modes have unit stiffness.
        """
        k, _, m = self.linear.nl
        moved = k.T @ vectors
        inner = m.T @ vectors - self.linear.ll[2] @ moved
        return np.asarray(self.linear.nn[2] @ vectors - m @ moved - k @ inner)

    def projected(self, vectors: FloatArray) -> "CondensedProduct":
        """Return the products projected on the columns of `vectors` (n, k), without a load.

        The columns are motions of the retained coordinates.
        """
        own, none = self.linear, np.zeros((len(self.load), vectors.shape[1]))

        def near(matrix: FloatArray) -> FloatArray:
            return np.asarray(vectors.T @ (matrix @ vectors))

        def across(matrix: FloatArray) -> FloatArray:
            return np.asarray(vectors.T @ matrix)

        (k, c, m), (to_k, to_c, to_m) = own.nn, own.nl
        seen = replace(
            own,
            nn=(near(k), near(c), near(m)),
            nl=(across(to_k), across(to_c), across(to_m)),
            ln=None if own.ln is None else (across(own.ln[0]), across(own.ln[1]), across(own.ln[2])),
            loss=None if own.loss is None else (near(own.loss[0]), across(own.loss[1]), own.loss[2]),
        )
        return replace(self, linear=seen, load=none, load_slope=none)

    def moved_to(self, other: "Interiors") -> "CondensedProduct":
        """Return the products at the frequency of `other`, which has the same interior."""
        if self.omega == other.omega:
            return self
        return replace(self, omega=other.omega, frequencies=other.frequencies, inner=other.inner)

    def block(self, harmonic: int) -> ComplexArray:
        """Return ``Z_h``, (n, n) complex in Fortran order."""
        s = harmonic * self.omega
        k, c, m = self.linear.nn
        # the matrices are symmetric, and their transposes are in Fortran order
        out = np.empty(k.shape, dtype=complex, order="F")
        np.multiply(m.T, -(s**2), out=out.real)
        out.real += k.T
        np.multiply(c.T if self.linear.ln is None else c, s, out=out.imag)
        loss = self.linear.loss if s > 0.0 else None
        if loss is not None:
            out.imag += loss[0].T
        far = _across(self.linear.nl, loss, s)
        if far.shape[1] == 0:
            return out
        onto = far if self.linear.ln is None else _across(self.linear.ln, loss, s)
        moved = _solve_one(self.inner[self.harmonics.index(harmonic)], onto.T)
        # in place: with thousands of coordinates this is the largest array
        return np.asarray(scipy.linalg.blas.zgemm(-1.0, far, moved, beta=1.0, c=out, overwrite_c=True))


def at_frequency(
    linear: Interior, load: tuple[ComplexArray, ComplexArray], omega: float, harmonics: Harmonics
) -> CondensedProduct:
    """Prepare the products of a condensed structure at one frequency.

    Parameters
    ----------
    linear
        Matrices of the structure, the interior in modes.
    load
        Complex amplitudes on the retained coordinates (H+1, n) and on the modes of the interior (H+1, l), N.
    omega
        Frequency, rad/s.
    harmonics
        The harmonics, ascending from 0.
    """
    frequencies = omega * by_row(harmonics)
    near, inner_load = (real_rows(part, harmonics) for part in load)
    inner = _inner(linear, omega, harmonics)
    bare = CondensedProduct(linear, omega, harmonics, frequencies, inner, near, np.zeros_like(near))
    if not np.any(inner_load):
        return bare
    return _with_inner_load(bare, inner_load)


def _with_inner_load(bare: CondensedProduct, inner_load: FloatArray) -> CondensedProduct:
    """Move the load of the interior, (m, l), to the retained coordinates: ``F = F_N - D_NL D_LL⁻¹ F_L``."""
    s = bare.frequencies
    moved = _solve_inner(bare.inner, inner_load)
    back = _back(bare.linear, moved)
    turned = _solve_inner(bare.inner, slope_rows(_inner_parts(bare.linear, moved), s))
    slope = dynamic_rows(_back(bare.linear, turned), s) - slope_rows(back, s)
    return CondensedProduct(
        bare.linear,
        bare.omega,
        bare.harmonics,
        s,
        bare.inner,
        bare.load - dynamic_rows(back, s),
        by_omega(slope, bare.harmonics),
    )


def _inner(linear: Interior, omega: float, harmonics: Harmonics) -> Inner:
    k, c, m = linear.ll
    loss = None if linear.loss is None else linear.loss[2]
    s = omega * np.array(harmonics)
    if linear.diagonal:
        k, c, m = np.diagonal(k), np.diagonal(c), np.diagonal(m)
        loss = None if loss is None else np.diagonal(loss)
    states = linear.states if np.any(s) else None
    if states is not None:
        return tuple((states, 1j * w) for w in s)
    each = [k + 1j * w * c - w**2 * m for w in s]
    if loss is not None:
        each = [d + 1j * (w > 0.0) * loss for d, w in zip(each, s, strict=True)]
    return np.array(each) if linear.diagonal else tuple(scipy.linalg.lu_factor(d) for d in each)


def _across(blocks: Parts, loss: Parts | None, s: float) -> ComplexArray:
    """Return D between retained coordinates and interior at one frequency."""
    k, c, m = blocks
    across: ComplexArray = np.asarray(k + 1j * s * c - s**2 * m)
    return across if loss is None else np.asarray(across + 1j * loss[1])


def _solve_inner(inner: Inner, rows: FloatArray) -> FloatArray:
    if isinstance(inner, np.ndarray):
        return to_real(to_complex(rows) / inner)
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


def _near(linear: Interior, rows: FloatArray) -> Lossy:
    """Return the products with the matrices of the retained coordinates."""
    k, c, m = linear.nn
    loss = None if linear.loss is None else rows @ linear.loss[0]
    return _products(rows, (k, c if linear.ln is None else c.T, m), linear.rayleigh, loss)


def onto_interior(linear: Interior, rows: FloatArray) -> Lossy:
    """Return the products from retained coordinates to the interior."""
    loss = None if linear.loss is None else rows @ linear.loss[1]
    return _products(rows, linear.far, linear.rayleigh_across, loss)


def _back(linear: Interior, rows: FloatArray) -> Lossy:
    """Return the products from the interior to retained coordinates."""
    k, c, m = linear.nl
    loss = None if linear.loss is None else rows @ linear.loss[1].T
    return _products(rows, (k.T, c.T, m.T), linear.rayleigh_across, loss)


def _products(rows: FloatArray, blocks: Blocks, shares: tuple[float, float] | None, loss: FloatArray | None) -> Lossy:
    """Return the products with stiffness, damping and mass.

    With Rayleigh coefficients `shares`, the damping follows from the other two.
    """
    k, c, m = blocks
    stiff, inert = rows @ k, rows @ m
    if shares is None:
        return stiff, rows @ c, inert, loss
    a, b = shares
    return stiff, a * stiff + b * inert, inert, loss


def _inner_parts(linear: Interior, rows: FloatArray) -> Lossy:
    """Return the products with the interior's matrices for the slope, which structural damping does not affect."""
    if linear.diagonal:
        k, c, m = (rows * np.diagonal(a) for a in linear.ll)
        return k, c, m, None
    k, c, m = linear.ll
    return rows @ k, rows @ (c if linear.ln is None else c.T), rows @ m, None


def by_row(harmonics: Harmonics) -> FloatArray:
    """Return the (m, 1) harmonic of each real row."""
    return np.repeat(np.array(harmonics, dtype=float), 2)[1:, None]


def by_omega(slope: FloatArray, harmonics: Harmonics) -> FloatArray:
    """Convert a derivative by the frequency ``hω`` of each row into the derivative by ω."""
    return np.asarray(by_row(harmonics) * slope)


def dynamic_rows(parts: Lossy, s: FloatArray) -> FloatArray:
    """Return ``K q + i L q + i s C q - s² M q`` from the products of the matrices with the rows of q.

    The static row has no L.
    """
    k, c, m, loss = parts
    moved = s * c
    if loss is not None:
        moved += np.where(s > 0.0, loss, 0.0)
    return k + _turned(moved) - s**2 * m


def slope_rows(parts: Lossy, s: FloatArray) -> FloatArray:
    """Return the derivative of `dynamic_rows` by s."""
    _, c, m, _ = parts
    return _turned(c) - 2.0 * s * m


def _turned(rows: FloatArray) -> FloatArray:
    """Return the `rows` of the complex coefficients ``C - iS`` after multiplication by i."""
    out = np.zeros_like(rows)
    out[1::2] = rows[2::2]
    out[2::2] = -rows[1::2]
    return out
