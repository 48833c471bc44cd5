"""Products ``Z q`` of a condensed dynamic stiffness at one frequency, in the cheapest way for its size and damping.

`MatrixProducts` and `products` multiply by known matrices. `SmallBlocks` multiplies all harmonics in one compiled loop:
up to about a hundred unknowns per harmonic, a Python call for each harmonic costs several times its arithmetic.
`linear_force` multiplies without forming matrices if the interior's modes diagonalise its damping. A corrector whose
frequency changes at every step needs the residual of each trial, but the condensed matrices only of accepted ones.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.product import multiply_blocks
from stickslip.harmonic.dynamic_stiffness import Condensed, CondensedStiffness
from stickslip.harmonic.harmonic_set import Harmonics, is_full, to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness, Products, StiffnessProducts
from stickslip.harmonic.spectral import Blocks

MAX_SMALL_BLOCK = 96  # unknowns per harmonic up to which this is faster than LAPACK and BLAS calls


@dataclass(frozen=True, eq=False)
class SmallBlocks:
    """One complex matrix per harmonic, the static one first; build it with `small_blocks`.

    Attributes
    ----------
    real, imaginary
        (len(harmonics), n, n) parts of the transposed matrices.
    """

    real: FloatArray
    imaginary: FloatArray

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the products with complex coefficients ``C - iS`` in the form of real (m, n) `rows`."""
        out = np.empty_like(rows)
        multiply_blocks(self.real, self.imaginary, rows, out)
        return out


def small_blocks(matrices: list[ComplexArray]) -> SmallBlocks:
    """Return (n, n) matrices, one for each harmonic, in the layout of the compiled loops."""
    stacked = np.stack([matrix.T for matrix in matrices])
    return SmallBlocks(np.ascontiguousarray(stacked.real), np.ascontiguousarray(stacked.imag))


@lru_cache(maxsize=2)
def dynamic_stiffness(linear: StiffnessProducts) -> SmallBlocks:
    """Return the dynamic stiffness of all harmonics at one frequency, N/m.

    It is cached for the many products of a Krylov method.
    """
    return small_blocks([linear.block(h) for h in linear.harmonics])


@dataclass(frozen=True, eq=False)
class MatrixProducts:
    """The condensed matrices and load of a structure at one frequency; see `Products`.

    Parameters
    ----------
    condensed
        Matrices and load of `harmonics`.
    harmonics
        Kept harmonics.
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
        """(m, n) derivative of the load by ω."""
        return to_real(self.condensed.load_derivative)

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return isinstance(other, MatrixProducts) and other.condensed is self.condensed

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return _times(self.condensed.stiffness, rows)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z."""
        return _times(self.condensed.stiffness.conj().transpose(0, 2, 1), rows)

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        return self.product(rows), _times(self.condensed.derivative, rows)

    def block(self, harmonic: int) -> ComplexArray:
        """Return a copy of ``Z_h``, (n, n) complex in Fortran order."""
        return np.array(self.condensed.stiffness[self.harmonics.index(harmonic)], order="F")


def _times(matrices: ComplexArray, rows: FloatArray) -> FloatArray:
    return to_real((matrices @ to_complex(rows)[:, :, None])[..., 0])


@lru_cache(maxsize=4)
def matrices(linear: DynamicStiffness, harmonics: Harmonics, omega: float) -> MatrixProducts:
    """Condense the linear side at one frequency.

    The result is cached, because a Newton iteration at fixed frequency needs it at every step.
    """
    part = linear.condensed(omega, harmonics[-1])
    if not is_full(harmonics):
        part = part.kept(list(harmonics))
    return MatrixProducts(part, harmonics)


@lru_cache(maxsize=2)
def products(linear: DynamicStiffness, harmonics: Harmonics, omega: float) -> Products:
    """Return the products of the linear side with vectors, at one frequency."""
    # small matrices are all needed eventually, and are cheaper to form together
    if isinstance(linear, CondensedStiffness) and linear.n <= MAX_SMALL_BLOCK:
        return matrices(linear, harmonics, omega)
    return linear.products(omega, harmonics)


def known_by_vectors(linear: DynamicStiffness) -> CondensedStiffness | None:
    """Return a condensed structure if its interior is diagonal; None otherwise.

    Structural damping and Coriolis forces are excluded, too.
    """
    if isinstance(linear, CondensedStiffness) and linear.diagonal and linear.loss is None:
        return linear if linear.ln is None else None
    return None


def linear_force(linear: CondensedStiffness, omega: float, q: ComplexArray) -> ComplexArray:
    """Return ``Z q - F``, (H+1, n), of a motion (H+1, n) at `omega` (rad/s)."""
    s = _frequencies(omega, q)
    near, far = linear.modal_loads(len(q) - 1)
    moved = (far - _forward(linear.nl, s, q)) / _own(linear, s)
    return _forward(linear.nn, s, q) + _back(linear.nl, s, moved) - near


def mass_damping_slope(linear: CondensedStiffness, omega: float, q: ComplexArray) -> ComplexArray:
    """Return the derivative of ``Z q``, (H+1, n), by the rate (1/s) of a damping proportional to the mass."""
    s = _frequencies(omega, q)
    own = _own(linear, s)
    moved = -_forward(linear.nl, s, q) / own
    across, inner = linear.nl[2], np.diagonal(linear.ll[2])
    pulled = 1j * s * (q @ across + moved * inner)
    direct = 1j * s * (q @ linear.nn[2].T + moved @ across.T)
    return np.asarray(direct - _back(linear.nl, s, pulled / own))


def _frequencies(omega: float, q: ComplexArray) -> FloatArray:
    return omega * np.arange(len(q))[:, None]


def _own(linear: CondensedStiffness, s: FloatArray) -> ComplexArray:
    k, c, m = (np.diagonal(block) for block in linear.ll)
    return np.asarray(k + 1j * s * c - s**2 * m)


def _forward(blocks: Blocks, s: FloatArray, q: ComplexArray) -> ComplexArray:
    """Return the force of the retained coordinates on the coordinates of the columns."""
    k, c, m = blocks
    return np.asarray(q @ k + 1j * s * (q @ c) - s**2 * (q @ m))


def _back(blocks: Blocks, s: FloatArray, q: ComplexArray) -> ComplexArray:
    """Return the force of the interior on the retained coordinates."""
    k, c, m = blocks
    return np.asarray(q @ k.T + 1j * s * (q @ c.T) - s**2 * (q @ m.T))
