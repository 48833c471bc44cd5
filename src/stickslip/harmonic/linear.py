"""The linear side as the harmonic balance sees it."""

from typing import Protocol, Self

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.dynamic_stiffness import Condensed
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.spectral import Blocks


class DynamicStiffness(Protocol):
    """A structure and its load, condensed to the retained coordinates.

    `CondensedStiffness` is that of one structure; `TravellingStiffness` that of a tuned wheel, whose harmonics have wave
    numbers of their own.
    """

    def __hash__(self) -> int:
        """Condensed structures are told apart by what they are, not by what they hold."""
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
        """Stiffness, damping and mass on the retained coordinates; for scales."""
        ...

    @property
    def load(self) -> HarmonicLoad:
        """Load on all dofs, N."""
        ...

    def with_load(self, load: HarmonicLoad) -> Self:
        """Return the same structure under another load."""
        ...

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        ...

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        ...

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        ...

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) matrix that makes of a change of the retained coordinates in one harmonic that of `dofs` (k,)."""
        ...

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        ...
