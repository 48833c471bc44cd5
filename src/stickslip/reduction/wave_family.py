"""All waves of one sector, with one factorisation of their common part.

The matrix of a wave with the phase angle θ is ``A_k = A_0 + e^{iθ} A_1 + e^{-iθ} A_1ᵀ``, with real matrices for a real sector. A_1
couples the sector with a few dofs of its neighbour, on the low face and in contacts. With these dofs, and copies of them for
the neighbour, kept, the rest of the sector is real and the same in all waves. It is eliminated once. Each wave then
needs only the factors of a dense Schur complement of the coupling dofs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, IntArray, Matrix
from stickslip.errors import SingularError
from stickslip.model.fe.factorisation import Factorisation, Say, factorise, refuse_singular, silent
from stickslip.model.fe.multifrontal import COLUMNS, Multifrontal, multifrontal
from stickslip.model.modes import Factors, connected_parts, usual_shift
from stickslip.model.structure import Structure
from stickslip.reduction.basis import is_hermitian
from stickslip.reduction.waves import wave

MIN_SHARED_DOFS = 20_000  # with fewer dofs each wave is factorised alone, which takes about a second
ROUNDING_OF_TERMS = 1e-12  # difference of entries over these entries: less is rounding
ALIKE = 1e-14  # largest difference of two equal matrices, scaled by the diagonal


@dataclass(frozen=True, eq=False)
class SharedInterior:
    """The sector without the dofs that couple it to its neighbours, factorised; `shared_interior` makes it.

    Parameters
    ----------
    sectors
        Number of sectors.
    parts
        A_0 and A_1 in CSR.
    coupling
        (m,) dofs that couple with the sector behind: columns of A_1.
    factors
        Factors of all other dofs, with the Schur complement on `coupling` and its copies.
    """

    sectors: int
    parts: tuple[Matrix, Matrix]
    coupling: IntArray
    factors: Multifrontal

    def factorise(self, wave_number: int, matrix: Matrix) -> Factorisation | None:
        """Return the factorisation of a wave's matrix; None if it does not belong to the family or is not positive definite."""
        phase = wave(wave_number, self.sectors).phase
        if not _alike(self._of_wave(phase), matrix):
            return None
        dense = self._complement(phase)
        try:
            lower = scipy.linalg.cholesky(dense, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            return None
        solve = self._solver(phase, lower)
        found = Factorisation(solve, "shared interior", lambda: 0)
        refuse_singular(matrix, found)
        return found

    def _of_wave(self, phase: complex) -> Matrix:
        first, second = self.parts
        ahead = phase * second
        return first + ahead + ahead.conj().T

    def _complement(self, phase: complex) -> ComplexArray:
        """Return the Schur complement of a wave, computed in blocks of columns to save memory."""
        m, rest = self.coupling.size, self.factors.rest
        dense = np.empty((m, m), dtype=np.result_type(rest, phase), order="F")
        for first in range(0, m, COLUMNS):
            mine = np.arange(first, min(first + COLUMNS, m))
            dense[:, mine] = rest[:m, mine] + rest[m:, m + mine]
            dense[:, mine] += phase * rest[:m, m + mine] + np.conj(phase) * rest[m:, mine]
        return dense

    def _solver(self, phase: complex, lower: ComplexArray) -> Callable[[Matrix], Matrix]:
        n, m = self.parts[0].shape[0], self.coupling.size

        def some(right: Matrix) -> Matrix:
            wide = np.zeros((n + m, right.shape[1]), dtype=np.result_type(right, phase))
            wide[:n] = right
            eliminated = self.factors.forward(wide)
            mine, theirs = eliminated[n - m : n], eliminated[n:]
            own = scipy.linalg.cho_solve((lower, True), mine + np.conj(phase) * theirs, check_finite=False)
            eliminated[n - m : n], eliminated[n:] = own, phase * own
            return self.factors.backward(eliminated)[:n]

        def solve(right: Matrix) -> Matrix:
            columns = np.asarray(right).reshape(n, -1)
            blocks = [some(columns[:, first : first + COLUMNS]) for first in range(0, columns.shape[1], COLUMNS)]
            return np.hstack(blocks).reshape(np.shape(right))

        return solve


def shared_interior(
    standing: Matrix, travelling: Matrix, wave_number: int, sectors: int, *, say: Say = silent
) -> SharedInterior | None:
    """Factorise the common interior of all waves of a sector.

    Parameters
    ----------
    standing
        (n, n) real CSR matrix of wave number 0.
    travelling
        Matrix of a wave that is not standing; a phase angle near 90° loses the fewest digits.
    wave_number
        Wave number of `travelling`.
    sectors
        Number of sectors.
    say
        Called with a sentence before the long step.

    Returns
    -------
    SharedInterior or None
        None if the two matrices do not belong to a family of real matrices, or the interior is not positive definite.
    """
    parts = _parts(standing, travelling, wave(wave_number, sectors).phase)
    if parts is None:
        return None
    first, second = parts
    n = first.shape[0]
    coupling = np.unique(second.indices)
    m = coupling.size
    copies = scipy.sparse.csr_array(second[:, coupling])
    unit = scipy.sparse.csr_array((m, m))
    whole = scipy.sparse.block_array([[first, copies], [copies.T, unit]], format="csr")
    kept = np.concatenate([coupling, n + np.arange(m)])
    say(f"factorising the {n - m} equations that all waves share")
    try:
        factors = multifrontal(whole, kept)
    except SingularError:
        return None
    return SharedInterior(sectors, parts, coupling, factors)


def _parts(standing: Matrix, travelling: Matrix, phase: complex) -> tuple[Matrix, Matrix] | None:
    """Return A_0 and A_1 from ``A_0 + A_1 + A_1ᵀ`` and one travelling wave; None if there is no such family, or A_1 vanishes."""
    if np.iscomplexobj(standing) or standing.shape != travelling.shape:
        return None
    even = _without_rounding((standing - travelling.real) / (1 - phase.real), standing, travelling)
    odd = _without_rounding(travelling.imag / phase.imag, standing, travelling)
    ahead = _without_rounding((even + odd) / 2, abs(even), abs(odd))
    first = scipy.sparse.csr_array(standing - _without_rounding(even, standing, travelling))
    if not ahead.nnz:
        return None
    return first, ahead


def _without_rounding(matrix: Matrix, *terms: Matrix) -> Matrix:
    """Return `matrix`, a difference of `terms`, without entries that are rounding."""
    size = scipy.sparse.csr_array(sum(abs(term) for term in terms))
    found = scipy.sparse.coo_array(matrix)
    at = np.asarray(size[found.coords[0], found.coords[1]]).ravel()
    keep = np.abs(found.data) > ROUNDING_OF_TERMS * at
    entries = (found.data[keep], (found.coords[0][keep], found.coords[1][keep]))
    return scipy.sparse.csr_array(entries, shape=matrix.shape)


def _alike(one: Matrix, other: Matrix) -> bool:
    """Whether two matrices are equal up to rounding."""
    if one.shape != other.shape:
        return False
    size = scipy.sparse.diags_array(1 / np.sqrt(np.abs(other.diagonal())))
    return bool((size @ abs(one - other) @ size).max() <= ALIKE)


@dataclass(frozen=True, eq=False)
class WaveFamily:
    """The waves of one sector at one speed, with shared factors for the computation of modes.

    Parameters
    ----------
    at
        Function from a wave number to the structure.
    sectors
        Number of sectors.
    numbers
        Wave numbers whose modes will be computed.
    say
        Called with a sentence before long steps.
    """

    at: Callable[[int], Structure]
    sectors: int
    numbers: tuple[int, ...]
    say: Say = silent

    def shifted(self, wave_number: int, structure: Structure) -> tuple[float | None, Factors | None]:
        """Return the common shift of all waves, and the function that factorises ``K − shift M`` of this wave.

        Both are None if factorising each wave alone is faster.
        """
        if structure.n <= MIN_SHARED_DOFS or len(self.numbers) < 2 or self._shared is None:
            return None, None
        shift, shared = self._shared

        def factors(matrix: Matrix) -> Factorisation:
            return shared.factorise(wave_number, matrix) or factorise(matrix, say=self.say)

        return shift, factors

    @cached_property
    def _shared(self) -> tuple[float, SharedInterior] | None:
        """The common shift of all waves, from wave 0, and their shared factors."""
        number = max(round(self.sectors / 4), 1)
        if 2 * number >= self.sectors:
            return None
        pair = self.at(0), self.at(number)
        real = all(scipy.sparse.issparse(m) and is_hermitian(m) for s in pair for m in (s.stiffness, s.mass))
        if not real or len(connected_parts(pair[0].stiffness, pair[0].mass)) > 1:
            return None
        shift = usual_shift(pair[0])
        matrices = [scipy.sparse.csr_array(s.stiffness - shift * s.mass) for s in pair]
        found = shared_interior(matrices[0], matrices[1], number, self.sectors, say=self.say)
        return None if found is None else (shift, found)
