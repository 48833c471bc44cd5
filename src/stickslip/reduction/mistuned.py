"""A mistuned wheel: waves of the tuned wheel, and low-rank deviations of single sectors."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.reduction.sectors import circulant, couplings

KINDS = ("stiffness", "damping", "mass", "loss")


@dataclass(frozen=True, eq=False)
class MistunedWheel:
    """All sectors of a wheel, each with m coordinates of its own (`LinearSide`).

    Parameters
    ----------
    structure
        The wheel: real matrices, sector by sector.
    waves
        Stiffness, damping, mass and structural damping (n_s, m, m) of the waves 0 to n_s - 1 of the tuned wheel.
    shares
        (n_s, r, m) by wave number: what of a sector's motion the deviations act on.
    factors
        (n_s, r) stiffness of each share that a sector has beyond the tuned one.
    springs
        (n_s m, n_s m) CSR further stiffness.
    """

    structure: Structure
    waves: tuple[Matrix, Matrix, Matrix, Matrix]
    shares: Matrix
    factors: FloatArray
    springs: Matrix = field(default_factory=lambda: scipy.sparse.csr_array((0, 0)))

    def __repr__(self) -> str:
        """Return what it is in a line, without its matrices."""
        own, active = self.n // self.sectors, np.count_nonzero(self.factors)
        return f"<MistunedWheel: {self.sectors} sectors of {own} coordinates; {active} deviations>"

    @property
    def sectors(self) -> int:
        """Number of sectors."""
        return len(self.factors)

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return self.structure.n

    @property
    def dofs(self) -> Dofs:
        """Table of the coordinates."""
        return self.structure.dofs

    @property
    def multipliers(self) -> IntArray:
        """No coordinate is the force of a constraint."""
        return self.structure.multipliers

    @property
    def wheel(self) -> None:
        """No tuned wheel (see `LinearSide`)."""
        return None

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency (see `LinearSide`)."""
        return False

    @property
    def reduced(self) -> bool:
        """Whether coordinates are condensed: those that no contact touches (see `LinearSide`)."""
        return True

    @property
    def harmonics(self) -> None:
        """There are matrices for any harmonic (see `LinearSide`)."""

    def at_frequency(self, omega: float) -> "MistunedWheel":
        """Return itself at every frequency (see `LinearSide`)."""
        return self

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the wheel: it vibrates as itself in every harmonic."""
        return self.structure

    def feedback_of(self, harmonic: int) -> None:
        """Return no aerodynamic force beside that in the matrices."""

    def grounded(self, springs: Matrix) -> "MistunedWheel":
        """Return the wheel with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        more = springs if not self.springs.shape[0] else self.springs + springs
        return replace(self, structure=self.structure.grounded(springs), springs=more)

    @cached_property
    def active(self) -> tuple[IntArray, IntArray]:
        """Sector and number of each share that deviates."""
        sector, share = np.nonzero(self.factors)
        return sector, share


def mistuned_wheel(waves: list[Structure], shares: list[Matrix], factors: FloatArray, dofs: Dofs) -> MistunedWheel:
    """Put all sectors together.

    Parameters
    ----------
    waves
        Of the wave numbers 0 to n_s - 1, all on the same coordinates.
    shares, factors
        (r, m) of each wave, and (n_s, r); see `MistunedWheel`.
    dofs
        Table of all sectors.
    """
    size = (len(waves), waves[0].n, waves[0].n)
    lossy = waves[0].loss is not None
    k, c, m = (np.array([_dense(getattr(w, kind)) for w in waves]) for kind in KINDS[:3])
    loss = np.array([_dense(w.loss) for w in waves]) if lossy else np.zeros(size)
    motion = circulant(couplings(shares))
    stiffness = circulant(couplings(list(k))) + motion.T @ (factors.reshape(-1, 1) * motion)
    structure = Structure(
        circulant(couplings(list(m))),
        circulant(couplings(list(c))),
        stiffness,
        dofs,
        loss=circulant(couplings(list(loss))) if lossy else None,
    )
    return MistunedWheel(structure, (k, c, m, loss), np.array(shares), factors)


def _dense(matrix: Matrix) -> Matrix:
    return matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix)
