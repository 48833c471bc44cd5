"""Products of a dynamic stiffness whose coordinates are all retained: the structure's matrices as they are, sparse."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.interface import SparseRows
from stickslip.harmonic.condensed_product import (
    CondensedProduct,
    at_frequency,
    by_omega,
    by_row,
    dynamic_rows,
    slope_rows,
)
from stickslip.harmonic.factors import with_contacts
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.matrices import SYMMETRY, asymmetry
from stickslip.harmonic.spectral import Blocks, Interior


@dataclass(frozen=True, eq=False)
class SparseMatrices:
    """Stiffness, damping, mass and structural damping (None for none), (n, n) CSR; only damping may lack symmetry."""

    stiffness: Matrix
    damping: Matrix
    mass: Matrix
    loss: Matrix | None

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.stiffness.shape[0])

    @property
    def entries(self) -> int:
        """Entries of the stiffness, for costs."""
        return int(self.stiffness.nnz)

    @cached_property
    def coriolis(self) -> bool:
        """Whether the damping lacks symmetry."""
        return asymmetry(self.damping) > SYMMETRY

    @cached_property
    def transposed(self) -> "SparseMatrices":
        """The same with the transposed damping; itself where that is symmetric."""
        if not self.coriolis:
            return self
        return SparseMatrices(self.stiffness, self.damping.T.tocsr(), self.mass, self.loss)

    def times(self, rows: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:
        """Return the products of stiffness, damping, mass and loss with the `rows` (m, n) of q."""
        columns = np.ascontiguousarray(rows.T)

        def product(matrix: Matrix) -> FloatArray:
            return np.ascontiguousarray((matrix @ columns).T)

        loss = None if self.loss is None else product(self.loss)
        return product(self.stiffness), product(self.damping), product(self.mass), loss


@dataclass(frozen=True, eq=False)
class SparseProduct:
    """A sparse structure and its load at one frequency; rows as those of `CondensedProduct`."""

    matrices: SparseMatrices
    omega: float
    harmonics: Harmonics
    load: FloatArray  # (m, n), N

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.matrices.n

    @property
    def entries(self) -> int:
        """Entries of the stiffness, for costs."""
        return self.matrices.entries

    @cached_property
    def frequencies(self) -> FloatArray:
        """(m, 1) h ω of each row, rad/s."""
        return self.omega * by_row(self.harmonics)

    @property
    def inner(self) -> ComplexArray:
        """(H+1, 0) interior dynamic stiffness: nothing is condensed."""
        return np.zeros((len(self.harmonics), 0), dtype=complex)

    @property
    def load_slope(self) -> FloatArray:
        """(m, n) derivative of the load by ω: none."""
        return np.zeros_like(self.load)

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, SparseProduct)
            and self.omega == other.omega
            and self.harmonics == other.harmonics
            and self.matrices is other.matrices
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return dynamic_rows(self.matrices.times(rows), self.frequencies)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z, the conjugate of the product of Zᵀ and the conjugate."""
        mirrored = rows.copy()
        mirrored[2::2] *= -1.0
        out = dynamic_rows(self.matrices.transposed.times(mirrored), self.frequencies)
        out[2::2] *= -1.0
        return out

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        parts, s = self.matrices.times(rows), self.frequencies
        return dynamic_rows(parts, s), by_omega(slope_rows(parts, s), self.harmonics)

    def static(self, springs: FloatArray, rows: SparseRows) -> Matrix:
        """Return ``Z_0 + Bᵀ k B``, sparse, with the springs (n_contacts, 3, 3) of the contacts."""
        return with_contacts(self.matrices.stiffness, springs, rows)

    def mass_product(self, vectors: FloatArray) -> FloatArray:
        """Return the mass times `vectors` (n, k)."""
        return np.asarray(self.matrices.mass @ vectors)

    def projected(self, vectors: FloatArray) -> CondensedProduct:
        """Return the same seen from the columns of `vectors` (n, k) alone, without a load."""
        own, k = self.matrices, vectors.shape[1]

        def seen(matrix: Matrix) -> FloatArray:
            return np.asarray(vectors.T @ (matrix @ vectors))

        across, inside = np.zeros((k, 0)), np.zeros((0, 0))
        near: Blocks = (seen(own.stiffness), seen(own.damping), seen(own.mass))
        none: Blocks = (across, across, across)
        interior = Interior(
            near,
            none,
            (inside, inside, inside),
            True,
            none if own.coriolis else None,
            None if own.loss is None else (seen(own.loss), across, inside),
        )
        unloaded = np.zeros((1, k), dtype=complex), np.zeros((1, 0), dtype=complex)
        return at_frequency(interior, unloaded, self.omega, self.harmonics)

    def block(self, harmonic: int) -> Matrix:
        """Return ``Z_h``, (n, n) complex and sparse."""
        own, s = self.matrices, harmonic * self.omega
        out = own.stiffness - s**2 * own.mass + 1j * s * own.damping
        if own.loss is not None and s > 0.0:
            out = out + 1j * own.loss
        return scipy.sparse.csc_array(out)
