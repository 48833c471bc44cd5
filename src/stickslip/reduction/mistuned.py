"""A mistuned wheel: matrices of all sectors from the tuned wheel's waves, plus low-rank deviations of single sectors.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendix 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix, as_array
from stickslip.model.structure import Dofs, Structure

ROUNDING = 1e-12  # imaginary part over the largest entry: less is rounding, and the matrix is real


def couplings(waves: Sequence[Matrix]) -> Matrix:
    """Return the coupling of sector n with sector n - d, for each distance d (eq. 41).

    Parameters
    ----------
    waves
        The (a, b) matrices of the wave numbers 0 to n_s - 1.

    Returns
    -------
    numpy.ndarray
        (n_s, a, b), entry d for the sector d places behind; real if opposite waves are conjugates.
    """
    dense = np.array([as_array(w) for w in waves])
    found = np.fft.ifft(dense, axis=0)
    real = np.abs(found.imag).max(initial=0.0) <= ROUNDING * np.abs(found.real).max(initial=0.0)
    return np.ascontiguousarray(found.real) if real else found


def circulant(blocks: Matrix) -> Matrix:
    """Return the (n_s a, n_s b) matrix of all sectors from their `couplings` (n_s, a, b)."""
    count, rows, columns = blocks.shape
    behind = (np.arange(count)[:, None] - np.arange(count)) % count
    return blocks[behind].transpose(0, 2, 1, 3).reshape(count * rows, count * columns)


def strip(blocks: Matrix, sector: int) -> Matrix:
    """Return the rows (a, n_s b) of one sector of `circulant`."""
    behind = (sector - np.arange(len(blocks))) % len(blocks)
    rows, columns = blocks.shape[1:]
    return blocks[behind].transpose(1, 0, 2).reshape(rows, len(blocks) * columns)


def repeated(operators: Sequence[Matrix], sectors: int, ahead: Sequence[int] | None = None) -> Matrix:
    """Return the CSR operator of all sectors from a sector's operators on itself and on others.

    Parameters
    ----------
    operators
        (r, m) operators on the sectors `ahead`.
    sectors
        Number of sectors n_s; rows and columns go sector by sector.
    ahead
        Sectors by which these lie ahead; None: 0, 1, 2, ...
    """
    rows, columns = operators[0].shape
    entries: list[tuple[FloatArray, IntArray, IntArray]] = []
    for step, operator in zip(range(len(operators)) if ahead is None else ahead, operators, strict=True):
        own = scipy.sparse.csr_array(operator).tocoo()
        for n in range(sectors):
            other = (n + step) % sectors
            entries.append((own.data, own.row + n * rows, own.col + other * columns))
    data, row, column = (np.concatenate(part) for part in zip(*entries, strict=True))
    shape = (sectors * rows, sectors * columns)
    return scipy.sparse.csr_array((data, (row, column)), shape=shape)


def travelling(force: Matrix, phase_angle: float, sectors: int) -> ComplexArray:
    """Return the load (n_s m,) of a wave on all sectors from the load (m,) on sector 0.

    Each sector leads the previous one by `phase_angle` (rad).
    """
    return np.asarray(np.outer(np.exp(1j * phase_angle * np.arange(sectors)), force).ravel())


def of_alike(blocks: Matrix, gram: Matrix, factors: FloatArray) -> FloatArray:
    """Return ``Σ_n factors_n T_nᵀ A T_n`` for a matrix A that is the same in all sectors.

    Parameters
    ----------
    blocks
        (n_s, r, m) `couplings` of T: T_n gives the r quantities of sector n on which A acts from all coordinates.
    gram
        (r, r) symmetric A, or a function ``rows -> A @ rows``.
    factors
        (n_s,) factor of each sector.
    """
    count, _, m = blocks.shape
    first = strip(blocks, 0)
    product = gram(first) if callable(gram) else gram @ first
    whole = (first.T @ product).reshape(count, m, count, m)  # contribution of sector 0
    out = np.zeros_like(whole)
    for n in np.flatnonzero(factors):
        place = (np.arange(count) - n) % count  # sector p acts on sector n as sector p - n acts on sector 0
        out += factors[n] * whole[place][:, :, place]
    return np.asarray(out.reshape(count * m, count * m))


KINDS = ("stiffness", "damping", "mass", "loss")


@dataclass(frozen=True, eq=False)
class MistunedWheel:
    """All sectors of a mistuned wheel, each with its own m coordinates (`LinearSide`).

    Parameters
    ----------
    structure
        The mistuned wheel: real matrices with the deviations, sector by sector.
    waves
        Stiffness, damping, mass and structural damping (n_s, m, m) of the waves 0 to n_s - 1 of the tuned wheel.
    shares
        (n_s, r, m) by wave number: rows that give, from a sector's motion, the r quantities on which the deviations act.
    factors
        (n_s, r) deviation of the stiffness for each of these quantities from the tuned wheel, N/m.
    springs
        (n_s m, n_s m) CSR matrix of springs to the ground, N/m, which `structure` has and `waves` lack.
    """

    structure: Structure
    waves: tuple[Matrix, Matrix, Matrix, Matrix]
    shares: Matrix
    factors: FloatArray
    springs: Matrix = field(default_factory=lambda: scipy.sparse.csr_array((0, 0)))

    def __repr__(self) -> str:
        """Describe the wheel in a line, without its matrices."""
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
        """Indices of constraint forces among the coordinates: none."""
        return self.structure.multipliers

    @property
    def wheel(self) -> None:
        """None: the wheel is not tuned (see `LinearSide`)."""
        return None

    @property
    def speed_follows_frequency(self) -> bool:
        """Whether the speed changes with the frequency: no (see `LinearSide`)."""
        return False

    @property
    def reduced(self) -> bool:
        """Whether coordinates away from the contacts are condensed: yes (see `LinearSide`)."""
        return True

    @property
    def harmonics(self) -> None:
        """None: the matrices apply to any harmonic (see `LinearSide`)."""

    def at_frequency(self, omega: float) -> "MistunedWheel":
        """Return the wheel, which is the same at every frequency (see `LinearSide`)."""
        return self

    def of_harmonic(self, harmonic: int) -> Structure:
        """Return the structure of the wheel, which is the same in every harmonic."""
        return self.structure

    def feedback_of(self, harmonic: int) -> None:
        """Return None: aerodynamic forces are in the matrices."""

    def grounded(self, springs: Matrix) -> "MistunedWheel":
        """Return the wheel with springs, a sparse matrix (n, n) in N/m, from its coordinates to the ground."""
        more = springs if not self.springs.shape[0] else self.springs + springs
        return replace(self, structure=self.structure.grounded(springs), springs=more)

    @cached_property
    def active(self) -> tuple[IntArray, IntArray]:
        """Sector and index of each nonzero deviation."""
        sector, share = np.nonzero(self.factors)
        return sector, share


def mistuned_wheel(waves: list[Structure], shares: list[Matrix], factors: FloatArray, dofs: Dofs) -> MistunedWheel:
    """Assemble all sectors of a mistuned wheel.

    Parameters
    ----------
    waves
        Structures of the wave numbers 0 to n_s - 1, all on the same coordinates.
    shares, factors
        (r, m) for each wave, and (n_s, r); see `MistunedWheel`.
    dofs
        Table of the coordinates of all sectors.
    """
    size = (len(waves), waves[0].n, waves[0].n)
    lossy = waves[0].loss is not None
    k, c, m = (np.array([as_array(getattr(w, kind)) for w in waves]) for kind in KINDS[:3])
    loss = np.array([as_array(w.loss) for w in waves]) if lossy else np.zeros(size)
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
