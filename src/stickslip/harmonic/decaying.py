"""Dynamic stiffness of a decaying motion: ``D(s) = K + s C + s² M`` at ``s = hλ`` with ``λ = -β + iω``.

The motion is ``Re sum_h X_h e^{hλt}``, a power series of ``e^{λt}`` (Laxalde & Thouverez, Journal of Sound and
Vibration 322 (2009) 1009-1025). Its condensation is the one of a steady motion at the complex frequency ``ω + iβ``; the
mean has the static stiffness.
"""

from dataclasses import dataclass, replace

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.linear import DynamicStiffness
from stickslip.harmonic.matrix_products import MatrixProducts
from stickslip.harmonic.spectral import Blocks


@dataclass(frozen=True, eq=False)
class DecayingStiffness:
    """A condensed structure at frequencies ``ω + iβ``.

    Parameters
    ----------
    steady
        The condensed structure for steady motions.
    rate
        β, 1/s; negative where the motion grows.
    """

    steady: DynamicStiffness
    rate: float

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.steady.n

    @property
    def retained(self) -> IntArray:
        """Retained dofs."""
        return self.steady.retained

    @property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass on the retained coordinates, for scaling."""
        return self.steady.nn

    @property
    def load(self) -> HarmonicLoad:
        """Load on all dofs, N."""
        return self.steady.load

    @property
    def most(self) -> int | None:
        """Highest harmonic for which there are matrices; None: any."""
        return self.steady.most

    def load_at(self, omega: float) -> HarmonicLoad:
        """Return the load at a frequency, N."""
        return self.steady.load_at(omega)

    def with_load(self, load: HarmonicLoad) -> "DecayingStiffness":
        """Return the same structure under another load."""
        return replace(self, steady=self.steady.with_load(load))

    def with_mass_damping(self, rate: float) -> "DecayingStiffness":
        """Return the same structure with `rate` (1/s) times its mass added to its damping."""
        return replace(self, steady=self.steady.with_mass_damping(rate))

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        return self.steady.condensed(self._at(omega), order)

    def products(self, omega: float, harmonics: Harmonics) -> MatrixProducts:
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        return MatrixProducts(self.condensed(omega, harmonics[-1]).kept(list(harmonics)), harmonics)

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        return self.steady.recover(self._at(omega), q)

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        return self.steady.recover_change(self._at(omega), dq)

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        return self.steady.output_rows(self._at(omega), harmonic, dofs)

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        return self.steady.strain_energy(self._at(omega), q)

    def _at(self, omega: float) -> float:
        # complex, because all functions of the frequency used here are analytic
        return complex(omega, self.rate)  # type: ignore[return-value]
