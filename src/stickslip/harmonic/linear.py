"""Protocols of the linear structure: before and after condensation."""

from collections.abc import Hashable
from typing import Protocol, Self, runtime_checkable

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.interface import SparseRows
from stickslip.errors import input_error
from stickslip.harmonic.condensed_product import CondensedProduct, Inner
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.sparse_stiffness import Unreduced
from stickslip.harmonic.spectral import Blocks
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.tuned import TunedWheel


class LinearSide(Protocol):
    """A linear structure before condensation: one structure, or a wheel with one wave per temporal harmonic.

    All waves have the same coordinates.

    Matrices may be complex and unsymmetric, as for waves and aerodynamic forces.
    """

    @property
    def n(self) -> int:
        """Number of coordinates."""
        ...

    @property
    def dofs(self) -> Dofs:
        """Table of the coordinates."""
        ...

    @property
    def multipliers(self) -> IntArray:
        """Coordinates that are never condensed: constraint forces, or all coordinates if nothing is reduced."""
        ...

    @property
    def reduced(self) -> bool:
        """Whether coordinates away from the contacts are condensed."""
        ...

    @property
    def wheel(self) -> TunedWheel | None:
        """The tuned wheel if the harmonics are its waves; None otherwise."""
        ...

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the rotor speed follows the frequency along an engine-order line, and with it the matrices."""
        ...

    @property
    def harmonics(self) -> int | None:
        """Highest available temporal harmonic; None: any."""
        ...

    def at_frequency(self, omega: float) -> "LinearSide":
        """Return the side at a frequency in rad/s: itself, unless the speed follows the frequency."""
        ...

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure of temporal harmonic `harmonic` (0: the mean); equal structures are the same object."""
        ...

    def feedback_of(self, harmonic: int) -> Feedback | None:
        """Return the aerodynamic force on a harmonic, or None. The structure of `of_harmonic` contains its frozen form."""
        ...

    def grounded(self, springs: Matrix) -> Self:
        """Return the side with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        ...


def full_structure(side: LinearSide, analysis: str) -> Structure:
    """Return the one structure of all harmonics, reduced or not; see `one_structure`."""
    return one_structure(side.structure if isinstance(side, Unreduced) else side, analysis)


def one_structure(side: LinearSide, analysis: str) -> Structure:
    """Return the one structure of all harmonics, for an `analysis` without harmonics.

    Raises
    ------
    InputError
        If the harmonics have different structures, or if the structure has complex matrices or is not reduced.
    """
    if isinstance(side, Unreduced):
        raise input_error(
            analysis,
            f"has no form for an unreduced structure (of {side.n} dofs)",
            "Reduce it (craig_bampton), or take the forced response.",
        )
    structure = side.of_harmonic(0)
    if side.of_harmonic(1) is not structure:
        raise input_error(
            analysis,
            "has no form for a tuned wheel, whose harmonics are different travelling waves",
            "Take the wheel of all sectors (reduced_wheel), or the forced response.",
        )
    if structure.is_complex:
        raise input_error(analysis, "needs real matrices", "The forced response takes complex ones.")
    return structure


class StiffnessProducts(Hashable, Protocol):
    """Products of a condensed dynamic stiffness with vectors, at one frequency.

    For two-frequency motions, each position in `harmonics` has a combined frequency instead.

    Vectors are real and harmonic-major: (m, n) rows, one for the static term and two for each other harmonic of the
    support.
    """

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        ...

    @property
    def harmonics(self) -> Harmonics:
        """The support."""
        ...

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        ...

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        ...

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z."""
        ...

    def block(self, harmonic: int) -> Matrix:
        """Return a copy of ``Z_h``, (n, n) complex: an array in Fortran order, or sparse if nothing is condensed."""
        ...


class Products(StiffnessProducts, Protocol):
    """Products of a condensed dynamic stiffness with vectors, and its load, at one frequency."""

    @property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        ...

    @property
    def load_slope(self) -> FloatArray:
        """(m, n) derivative of the load by ω."""
        ...

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        ...


@runtime_checkable
class Shareable(Products, Protocol):
    """Products of one real structure whose harmonics can share one real factor (`harmonic.shared_factor`)."""

    @property
    def omega(self) -> float:
        """Frequency, rad/s."""
        ...

    @property
    def frequencies(self) -> FloatArray:
        """(m, 1) h ω of each row, rad/s."""
        ...

    @property
    def inner(self) -> Inner:
        """Dynamic stiffness of the interior."""
        ...

    def static(self, springs: FloatArray, rows: SparseRows) -> Matrix:
        """Return ``Z_0 + Bᵀ k B``, (n, n), with the springs (n_contacts, 3, 3) of the contacts."""
        ...

    def mass_product(self, vectors: FloatArray) -> FloatArray:
        """Return the mass times `vectors` (n, k)."""
        ...

    def projected(self, vectors: FloatArray) -> CondensedProduct:
        """Return the products projected on the columns of `vectors` (n, k), without a load."""
        ...


class DynamicStiffness(Protocol):
    """A structure and its load, condensed to the retained coordinates.

    `CondensedStiffness` is for one structure; `TravellingStiffness` for a tuned wheel, whose harmonics have different wave
    numbers; `TurningStiffness` for either of them along an engine-order line, at the speed of each frequency.
    """

    def __hash__(self) -> int:
        """Hash by identity, not by content."""
        ...

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        ...

    @property
    def retained(self) -> IntArray:
        """Retained dofs."""
        ...

    @property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass on the retained coordinates, for scaling."""
        ...

    @property
    def load(self) -> HarmonicLoad:
        """Load on all dofs, N."""
        ...

    @property
    def most(self) -> int | None:
        """Highest available harmonic; None: any."""
        ...

    def load_at(self, omega: float) -> HarmonicLoad:
        """Return the load at a frequency, N. It is constant unless it depends on the speed."""
        ...

    def with_load(self, load: HarmonicLoad) -> Self:
        """Return the same structure under another load."""
        ...

    def with_mass_damping(self, rate: float) -> Self:
        """Return the same structure with `rate` (1/s) times its mass added to its damping; the rate may be negative."""
        ...

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        ...

    def products(self, omega: float, harmonics: Harmonics) -> Products:
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        ...

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        ...

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        ...

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        ...

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        ...
