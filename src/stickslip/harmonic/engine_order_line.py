"""Dynamic stiffness along an engine-order line, where the speed follows the frequency."""

from dataclasses import dataclass, field, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.linear import DynamicStiffness, LinearSide, Products
from stickslip.harmonic.spectral import Blocks
from stickslip.harmonic.travelling import condense_side
from stickslip.reduction.speed_line import SpeedLine

STEP = 1e-6  # relative step of the speed for the derivative, which only sets the direction of a branch
REMEMBERED = 8  # frequencies whose condensation is cached
PARALLEL = 1e-9  # largest relative deviation of a load from a multiple of the line's load


@dataclass(frozen=True, eq=False)
class TurningStiffness:
    """A structure or wheel and its load along an engine-order line; build it with `condense_line`.

    All values are taken at the speed ``ω / m``. Derivatives by ω include the derivative of the matrices by the speed, a
    finite difference: they determine the direction of branches, but no solution.

    Parameters
    ----------
    line
        The structure or wheel along the line.
    retained
        Retained dofs, the unknowns.
    order
        Highest condensed harmonic.
    factors
        Harmonic -> factor on the load of the line.
    rate
        Rate of a mass-proportional damping, 1/s, which is added to the damping.
    """

    line: SpeedLine
    retained: IntArray
    order: int
    factors: dict[int, complex]
    rate: float = 0.0
    known: dict[float, DynamicStiffness] = field(default_factory=dict, repr=False)

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    @property
    def most(self) -> int | None:
        """Highest available harmonic; None: any."""
        return self._at_speed(float(self.line.speeds[-1])).most

    @property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass on the retained coordinates at the highest speed, for scaling."""
        return self._at_speed(float(self.line.speeds[-1])).nn

    @property
    def load(self) -> HarmonicLoad:
        """Load on all dofs at the highest speed, N."""
        return self._load(float(self.line.speeds[-1]))

    def load_at(self, omega: float) -> HarmonicLoad:
        """Return the load at a frequency, N."""
        return self._load(self.line.speed(omega))

    def with_load(self, load: HarmonicLoad) -> "TurningStiffness":
        """Return the same structure with each load of the line scaled to `load`.

        Raises
        ------
        InputError
            If a load is not a multiple of the line's load at the highest speed.
        """
        top = float(self.line.speeds[-1])
        given = {0: load.static.astype(complex), **load.harmonics}
        factors = {h: _factor(self.line.load(h, top), given.get(h)) for h in self.line.loads}
        return replace(self, factors=factors)

    def with_mass_damping(self, rate: float) -> "TurningStiffness":
        """Return the same structure with `rate` (1/s) times the mass added to the damping; the rate may be negative."""
        return replace(self, rate=self.rate + rate, known={})

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        here, there = self.at(omega).condensed(omega, order), self.beside(omega)
        other, by_omega = there.condensed(omega, order), 1.0 / (STEP * omega)
        return Condensed(
            here.stiffness,
            here.derivative + by_omega * (other.stiffness - here.stiffness),
            here.load,
            here.load_derivative + by_omega * (other.load - here.load),
        )

    def products(self, omega: float, harmonics: Harmonics) -> "TurningProducts":
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        here = self.at(omega).products(omega, harmonics)
        return TurningProducts(here, self, omega)

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        return self.at(omega).recover(omega, q)

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        return self.at(omega).recover_change(omega, dq)

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        return self.at(omega).output_rows(omega, harmonic, dofs)

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        return self.at(omega).strain_energy(omega, q)

    def at(self, omega: float) -> DynamicStiffness:
        """Return the dynamic stiffness at the speed of a frequency, with its load."""
        return self._at_speed(self.line.speed(omega))

    def beside(self, omega: float) -> DynamicStiffness:
        """Return the dynamic stiffness at a slightly higher speed, for finite differences."""
        return self._at_speed(self.line.speed(omega) * (1 + STEP))

    def _at_speed(self, speed: float) -> DynamicStiffness:
        if speed not in self.known:
            while len(self.known) >= REMEMBERED:
                del self.known[next(iter(self.known))]
            bare = HarmonicLoad(np.zeros(self.line.n))
            made = condense_side(self.line.at(speed), self.retained, bare, self.order)
            self.known[speed] = made.with_mass_damping(self.rate) if self.rate else made
        return self.known[speed].with_load(self._load(speed))

    def _load(self, speed: float) -> HarmonicLoad:
        own = {h: f * self.line.load(h, speed) for h, f in self.factors.items()}
        return HarmonicLoad(own.pop(0).real, own)


@dataclass(frozen=True, eq=False)
class TurningProducts:
    """The condensed matrices at one speed as products with vectors, with derivatives along the line."""

    here: Products
    linear: TurningStiffness
    omega: float

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.here.n

    @property
    def harmonics(self) -> Harmonics:
        """Harmonics of the motion."""
        return self.here.harmonics

    @property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        return self.here.load

    @property
    def load_slope(self) -> FloatArray:
        """(m, n) derivative of the load by ω."""
        change = self._there().load - self.here.load
        return np.asarray(self.here.load_slope + change / (STEP * self.omega))

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, TurningProducts)
            and self.omega == other.omega
            and self.linear.known is other.linear.known
            and self.harmonics == other.harmonics
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return self.here.product(rows)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of the product with the transpose of the real form of Z."""
        return self.here.transposed_product(rows)

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        product, slope = self.here.product_and_slope(rows)
        return product, slope + (self._there().product(rows) - product) / (STEP * self.omega)

    def block(self, harmonic: int) -> ComplexArray:
        """Return ``Z_h``, (n, n) complex in Fortran order, as a copy."""
        block: ComplexArray = self.here.block(harmonic)  # never sparse: a side along a line is condensed
        return block

    def _there(self) -> Products:
        return self.linear.beside(self.omega).products(self.omega, self.harmonics)


def condensed(side: LinearSide, retained: IntArray, load: HarmonicLoad, order: int) -> DynamicStiffness:
    """Prepare the exact condensation of a linear side, at one speed or along an engine order.

    See `condense_side` and `condense_line`.
    """
    if isinstance(side, SpeedLine):
        return condense_line(side, retained, load, order)
    return condense_side(side, retained, load, order)


def condense_line(line: SpeedLine, retained: IntArray, load: HarmonicLoad, order: int) -> TurningStiffness:
    """Prepare the exact condensation along an engine-order line.

    The `load` contains multiples of the line's loads at the highest speed.
    """
    one = TurningStiffness(line, np.asarray(retained, dtype=np.int64), order, {})
    return one.with_load(load)


def _factor(own: ComplexArray, given: ComplexArray | None) -> complex:
    """Return the factor between a load and the line's load."""
    if given is None or not np.any(given):
        return 0.0
    size = float(np.vdot(own, own).real)
    factor = np.vdot(own, given) / size if size > 0.0 else 0.0
    if np.linalg.norm(given - factor * own) > PARALLEL * np.linalg.norm(given):
        raise input_error(
            "HarmonicLoad",
            "is no multiple of the load of the engine-order line",
            "Give the loads of all speeds to the line.",
        )
    return complex(factor) if abs(complex(factor) - 1.0) > PARALLEL else 1.0
