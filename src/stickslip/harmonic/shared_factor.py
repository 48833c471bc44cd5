"""One real factor for all harmonics and frequencies, corrected in the low modes.

``A = Z_0 + Bᵀ k B``, where k is the mean over the harmonics of their contact stiffness.
``D_h = A + ihω C - (hω)² M + ...`` differs from A by inertia and damping. These matter little in modes far above the
harmonics, but dominate in the low modes V:

``D_h⁻¹ ≈ (1 - V Vᵀ M) A⁻¹ (1 - M V Vᵀ) + V (Vᵀ D_h V)⁻¹ Vᵀ``.

A is factorised in single precision; a Krylov method corrects the error. Compared with one complex matrix per harmonic,
this takes a fortieth of the arithmetic and, with H = 5, a twenty-fourth of the memory.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.contact.interface import SparseRows
from stickslip.harmonic.condensed_product import CondensedProduct
from stickslip.harmonic.factors import AnyFactors, factorise
from stickslip.harmonic.linear import Shareable

Solve = Callable[[FloatArray | ComplexArray], FloatArray | ComplexArray]
LEAST_MODES = 24
MODE_RANGE = 1.2  # modes are needed up to this multiple of the highest harmonic's frequency ...
SHARP_MODE_SHARE = 0.75  # ... within this share of the computed modes: the last ones are inaccurate
MIN_COORDINATES_PER_MODE = 4  # smallest number of coordinates per mode
SUBSPACE_ITERATIONS = 4  # of the subspace iteration for the modes
MAX_SINGLE_RESIDUAL = 0.01  # largest residual of single precision with a random right side


@dataclass(frozen=True, eq=False)
class SharedFactor:
    """The factor of A and the low modes; build it with `shared_factor`.

    Attributes
    ----------
    linear
        The dynamic stiffness with the static part of A.
    factor
        Factor of A, in the scale of the Jacobian.
    modes
        (n, k) V, of unit mass.
    weighted
        (n, k) M V.
    gaps
        (n_contacts, 3, k) gaps of the modes at the contacts.
    projected
        The dynamic stiffness projected on the modes.
    """

    linear: Shareable
    factor: AnyFactors
    modes: FloatArray
    weighted: FloatArray
    gaps: FloatArray
    projected: CondensedProduct

    def of(self, linear: Shareable, means: ComplexArray, scale: float) -> "SharedInverses":
        """Return the approximate inverses at the frequency of `linear`.

        The contact stiffness `means` (H+1, n_contacts, 3, 3) is included only in the low modes.
        """
        at = self.projected.moved_to(linear)
        inverses = []
        for place, h in enumerate(linear.harmonics):
            own = at.block(h)
            local = np.matmul(means[place], self.gaps)
            own += np.tensordot(self.gaps, local, axes=((0, 1), (0, 1)))
            inverses.append(np.linalg.pinv(scale * own))
        return SharedInverses(self, tuple(inverses))


@dataclass(frozen=True, eq=False)
class SharedInverses:
    """Approximate inverses ``D_h⁻¹`` of all harmonics."""

    kept: SharedFactor
    inner: tuple[ComplexArray, ...]  # of each harmonic, (k, k), in the low modes

    def solve(self, place: int, rows: FloatArray) -> FloatArray:
        """Solve harmonic number `place` for its one or two rows (k, n)."""
        kept, inner = self.kept, self.inner[place]
        return _solve(kept.factor.solve, kept, inner, rows)

    def solve_transposed(self, place: int, rows: FloatArray) -> FloatArray:
        """Solve with the transpose of the real form of harmonic number `place`."""
        # the transpose of the real form of A is the real form of Aᴴ
        return _solve(self.kept.factor.solve_transposed, self.kept, self.inner[place].conj().T, rows)


def _solve(solve: Solve, kept: SharedFactor, inner: ComplexArray, rows: FloatArray) -> FloatArray:
    low = rows @ kept.modes
    high = rows - low @ kept.weighted.T
    out = _in_its_precision(kept.factor, solve, high.T).T
    if len(rows) == 1:
        low = low @ inner.real.T
    else:
        moved = inner @ (low[0] - 1j * low[1])
        low = np.stack([moved.real, -moved.imag])
    return out + (low - out @ kept.weighted) @ kept.modes.T


def _in_its_precision(factor: AnyFactors, solve: Solve, right: FloatArray) -> FloatArray:
    single = factor.dtype == np.float32
    return np.asarray(solve(right.astype(np.float32) if single else right), dtype=float)


def shared_factor(linear: Shareable, means: ComplexArray, rows: SparseRows, scale: float) -> SharedFactor | None:
    """Factorise A and compute its low modes.

    None if A is singular, too many modes are low, or fewer coordinates have mass than modes are needed.

    Parameters
    ----------
    linear
        Dynamic stiffness at the frequency.
    means
        (H+1, n_contacts, 3, 3) contact stiffness of each harmonic, N/m.
    rows
        Gap operator by contact.
    scale
        Displacement scale over force scale.
    """
    matrix = scale * linear.static(means.real.mean(axis=0), rows)
    for single in (True, False):
        if single and abs(matrix).max() > np.finfo(np.float32).max:
            continue
        factor = factorise(_copied(matrix, single))
        found = None if factor is None else _enough_modes(linear, factor, scale)
        if factor is None or found is None:
            continue
        modes, weighted = found
        right = np.random.default_rng(1).standard_normal(linear.n)
        high = right - weighted @ (modes.T @ right)
        left = matrix @ _in_its_precision(factor, factor.solve, high) - high
        if np.linalg.norm(left) <= MAX_SINGLE_RESIDUAL * np.linalg.norm(high):
            count = modes.shape[1]
            gaps = rows.gaps(modes.T.copy()).reshape(count, -1, 3).transpose(1, 2, 0)
            projected = linear.projected(modes)
            return SharedFactor(linear, factor, modes, weighted, np.ascontiguousarray(gaps), projected)
    return None


def _copied(matrix: Matrix, single: bool) -> Matrix:
    """Return a copy to be factorised, in single or double precision."""
    kind = np.float32 if single else np.float64
    if scipy.sparse.issparse(matrix):
        return matrix.astype(kind)
    return np.array(matrix, dtype=kind, order="F")


def _enough_modes(linear: Shareable, factor: AnyFactors, scale: float) -> tuple[FloatArray, FloatArray] | None:
    """Return the modes to above the highest harmonic, and M times them; None if too many, or more than have mass."""
    wanted = scale * (MODE_RANGE * linear.harmonics[-1] * linear.omega) ** 2
    most = linear.n // MIN_COORDINATES_PER_MODE
    count = min(LEAST_MODES, most)
    while True:
        found = _low_modes(linear, factor, count)
        if found is None:
            return None
        sizes, modes, weighted = found
        if sizes[int(SHARP_MODE_SHARE * (count - 1))] >= wanted:
            return modes, weighted
        if count == most:
            return None
        count = min(2 * count, most)


def _low_modes(linear: Shareable, factor: AnyFactors, count: int) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return approximate low eigenvalues (k,), modes (n, k) of unit mass, and M times them.

    The method is subspace iteration (Bathe & Wilson 1973). None if fewer than `count` modes have mass.
    """
    weighted: FloatArray = np.random.default_rng(0).standard_normal((linear.n, count))
    sizes, modes = np.zeros(count), weighted
    for _ in range(SUBSPACE_ITERATIONS):
        modes = _in_its_precision(factor, factor.solve, weighted)
        stiffness = modes.T @ weighted
        weighted = linear.mass_product(modes)
        mass = modes.T @ weighted
        # scaled to unit mass; the stiffness is symmetric except for friction that depends on the normal force
        try:
            sizes, turn = scipy.linalg.eigh(stiffness + stiffness.T, mass + mass.T)
        except np.linalg.LinAlgError:
            return None
        turn *= np.sqrt(2.0)
        modes, weighted = modes @ turn, weighted @ turn
    return sizes, modes, weighted
