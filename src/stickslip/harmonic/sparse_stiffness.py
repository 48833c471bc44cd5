"""An unreduced structure: all dofs are unknowns, its matrices are sparse, and nothing is condensed.

With thousands of contacts, reduction to their coordinates costs more than it saves: the constraint modes have n ×
n_contacts entries, and the reduced matrices are full.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.interface import SparseRows
from stickslip.errors import input_error
from stickslip.harmonic.condensed_product import (
    CondensedProduct,
    at_frequency,
    by_omega,
    by_row,
    dynamic_rows,
    slope_rows,
)
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.factors import as_array, with_contacts
from stickslip.harmonic.harmonic_set import Harmonics, real_rows, to_complex
from stickslip.harmonic.matrices import SYMMETRY, asymmetry
from stickslip.harmonic.spectral import Blocks, Interior
from stickslip.model.structure import Dofs, Structure


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
        """Number of entries of the stiffness, for cost estimates."""
        return int(self.stiffness.nnz)

    @cached_property
    def coriolis(self) -> bool:
        """Whether the damping lacks symmetry."""
        return asymmetry(self.damping) > SYMMETRY

    @cached_property
    def transposed(self) -> "SparseMatrices":
        """The matrices with transposed damping; the same object if the damping is symmetric."""
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
    """Products of a sparse structure and its load at one frequency; rows as in `CondensedProduct`."""

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
        """Number of entries of the stiffness, for cost estimates."""
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
        """(m, n) derivative of the load by ω: zero."""
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
        """Return the product of the `rows` with the transpose of the real form of Z.

        It is the conjugate of Zᵀ times the conjugate of q.
        """
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
        """Return the products projected on the columns of `vectors` (n, k), without a load."""
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


LEAST_SPARSE = 150  # dofs below which arrays are as fast


@dataclass(frozen=True, eq=False)
class Unreduced:
    """A structure of which no dofs are condensed, for `System` with thousands of contacts.

    Parameters
    ----------
    structure
        Structure with real matrices, which stay sparse; mass, stiffness and loss are symmetric.
    """

    structure: Structure

    @property
    def n(self) -> int:
        """Number of dofs."""
        return self.structure.n

    @property
    def dofs(self) -> Dofs:
        """Table of the dofs."""
        return self.structure.dofs

    @property
    def multipliers(self) -> IntArray:
        """Dofs that are never condensed: all of them."""
        return np.arange(self.n)

    @property
    def wheel(self) -> None:
        """The tuned wheel: none (see `LinearSide`)."""
        return None

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency (see `LinearSide`)."""
        return False

    @property
    def reduced(self) -> bool:
        """Whether coordinates are condensed: no (see `LinearSide`)."""
        return False

    @property
    def harmonics(self) -> None:
        """Highest available harmonic; None: any (see `LinearSide`)."""

    def at_frequency(self, omega: float) -> "Unreduced":
        """Return itself at every frequency (see `LinearSide`)."""
        return self

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure, the same one for every harmonic."""
        return self.structure.of_harmonic(harmonic)

    def feedback_of(self, harmonic: int) -> None:
        """Return None: there is no aerodynamic force."""

    def grounded(self, springs: Matrix) -> "Unreduced":
        """Return the structure with springs, a sparse matrix (n, n) in N/m, to the ground."""
        return Unreduced(self.structure.grounded(springs))


@dataclass(frozen=True, eq=False)
class SparseStiffness:
    """A sparse structure and its load, all dofs retained; build it with `keep_all`."""

    matrices: SparseMatrices
    load: HarmonicLoad

    @property
    def n(self) -> int:
        """Number of dofs."""
        return self.matrices.n

    @property
    def entries(self) -> int:
        """Number of entries of the stiffness, for cost estimates."""
        return self.matrices.entries

    @property
    def retained(self) -> IntArray:
        """All dofs."""
        return np.arange(self.n)

    @property
    def nn(self) -> tuple[Matrix, Matrix, Matrix]:
        """Stiffness, damping and mass, for scaling."""
        return self.matrices.stiffness, self.matrices.damping, self.matrices.mass

    @property
    def most(self) -> None:
        """Highest available harmonic; None: any."""

    def load_at(self, _omega: float) -> HarmonicLoad:
        """Return the load, N, which is the same at all frequencies."""
        return self.load

    def with_load(self, load: HarmonicLoad) -> "SparseStiffness":
        """Return the same structure under another load."""
        return replace(self, load=load)

    def with_mass_damping(self, rate: float) -> "SparseStiffness":
        """Return the same structure with `rate` (1/s) times its mass added to its damping; the rate may be negative."""
        own = self.matrices
        return replace(self, matrices=replace(own, damping=own.damping + rate * own.mass))

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return the matrices as arrays, and the load, for harmonics 0..`order` at `omega` (rad/s).

        Raises
        ------
        InputError
            If they are too large for arrays.
        """
        at = self.products(omega, tuple(range(order + 1)))
        stiffness = np.array([as_array(at.block(h)) for h in at.harmonics])
        slope = np.zeros_like(stiffness)
        damping, mass = (as_array(a) for a in (self.matrices.damping, self.matrices.mass))
        for h in at.harmonics:
            slope[h] = 1j * h * damping - 2.0 * h**2 * omega * mass
        load = to_complex(at.load)
        return Condensed(stiffness, slope, load, np.zeros_like(load))

    def products(self, omega: float, harmonics: Harmonics) -> SparseProduct:
        """Return the dynamic stiffness as products, at `omega` (rad/s) and for `harmonics`."""
        load = real_rows(self.load.coefficients(harmonics[-1]), harmonics)
        return SparseProduct(self.matrices, omega, harmonics, load)

    def recover(self, _omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n) coefficients of every dof, which is `q`."""
        return q

    def recover_change(self, _omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n), which is `dq`."""
        return dq

    def output_rows(self, _omega: float, _harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) matrix that selects the motion of `dofs` (k,)."""
        rows = scipy.sparse.csr_array(
            (np.ones(dofs.size, dtype=complex), (np.arange(dofs.size), dofs)), shape=(dofs.size, self.n)
        )
        return np.asarray(as_array(rows))

    def strain_energy(self, _omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        twice = np.sum(q.conj() * (self.matrices.stiffness @ q.T).T, axis=1).real
        return np.asarray((0.25 + 0.25 * (np.arange(len(q)) == 0)) * twice)


def keep_all(structure: Structure, load: HarmonicLoad) -> SparseStiffness:
    """Return the dynamic stiffness of a structure with all of its dofs retained.

    Parameters
    ----------
    structure
        Mass, stiffness and loss must be symmetric, damping may have Coriolis terms.
    load
        Load on all dofs of the structure, N.

    Raises
    ------
    InputError
        If a matrix is not real or not finite, or a matrix other than the damping is not symmetric.
    """
    if load.static.size != structure.n:
        raise input_error("HarmonicLoad", f"{load.static.size} entries for {structure.n} dofs", "Give one a dof.")
    whole = (_sparse(structure, name) for name in ("stiffness", "damping", "mass"))
    loss = None if structure.loss is None else _sparse(structure, "loss")
    stiffness, damping, mass = whole
    return SparseStiffness(SparseMatrices(stiffness, damping, mass, loss), load)


def _sparse(structure: Structure, name: str) -> Any:
    matrix = scipy.sparse.csr_array(getattr(structure, name))
    wrong = ""
    if np.iscomplexobj(matrix):
        wrong = "is complex"
    elif not np.all(np.isfinite(matrix.data)):
        wrong = "contains NaN or infinite entries"
    elif name != "damping" and asymmetry(matrix) > SYMMETRY:
        wrong = "is not symmetric"
    if wrong:
        raise input_error(f"Structure.{name}", wrong, "An unreduced structure takes real, symmetric matrices.")
    return matrix
