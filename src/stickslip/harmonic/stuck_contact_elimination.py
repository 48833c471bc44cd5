"""Elimination, harmonic by harmonic, of the unknowns that contacts do not couple.

``J = D + Bᵀ L B``: L contains the derivatives of the contact forces that depend on other harmonics, and D all other
terms; D is block-diagonal. An equation without a force in L contains only its own harmonic. This holds at contacts that
stick or are open throughout the period, at normal gaps that stay closed, and at coordinates without contacts. With R
these unknowns and A the others, ``J_RR`` and ``J_RA`` are parts of D, one complex matrix per harmonic. Thus
``x_R = J_RR⁻¹ (b_R - J_RA x_A)`` costs little, and ``S = J_AA - J_AR J_RR⁻¹ J_RA`` remains to be solved. The uncoupled
forces are identified from the derivatives at each motion, and the solution equals the one of the full array to
rounding. At one frequency, the elimination of D is reused while the same forces stay uncoupled.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import lapack

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.contact.coupling import add_coupling, couplings, touched
from stickslip.contact.interface import SparseRows
from stickslip.contact.product import contact_product
from stickslip.harmonic.factors import as_array
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.harmonic.linear import StiffnessProducts
from stickslip.operators import Elimination

Entries = FloatArray | ComplexArray

ROUNDING = 1e-13  # relative to a contact's largest derivative; smaller ones couple nothing
SINGULAR = 1e-12  # ratio of smallest to largest pivot below which a harmonic is not eliminated ...
GROWTH = 1e6  # ... nor if eliminated unknowns over kept ones, or entries of the matrix, grow by more than this


@dataclass(frozen=True, eq=False)
class Coupling:
    """Contact forces that depend on other harmonics (coupled forces), and uncoupled ones; build it with `coupling`.

    Attributes
    ----------
    means
        (H+1, n_contacts, 3, 3) stiffness of uncoupled forces, N/m.
    left
        (n_contacts, P, m, m) derivatives of coupled forces, N/m.
    coupled
        (n_contacts, 3, H+1) whether a force is coupled.
    kept
        (H+1, n) whether the equation of a coordinate contains a coupled force.
    """

    means: ComplexArray
    left: FloatArray
    coupled: BoolArray
    kept: BoolArray

    @cached_property
    def counts(self) -> IntArray:
        """(H+1,) coordinates kept in each harmonic."""
        return np.asarray(self.kept.sum(axis=1))

    def same_rest(self, other: "Coupling") -> bool:
        """Whether the same forces are uncoupled, with the same stiffness."""
        if not np.array_equal(self.coupled, other.coupled):
            return False
        each = np.abs(self.means).max(axis=(0, 2, 3), initial=0.0)
        moved = np.abs(self.means - other.means).max(axis=(0, 2, 3), initial=0.0)
        return bool(np.all(moved <= ROUNDING * each))


def coupling(blocks: FloatArray, rows: SparseRows, n: int) -> Coupling:
    """Find the contact forces that couple harmonics.

    Parameters
    ----------
    blocks
        (n_contacts, P, m, m) derivatives of the contact forces, N/m.
    rows
        Gap operator by contact.
    n
        Coordinates.
    """
    harmonics = (blocks.shape[2] + 1) // 2
    means = np.empty((harmonics, len(blocks), 3, 3), dtype=complex)
    left = np.empty(blocks.shape)
    coupled = np.empty((len(blocks), 3, harmonics), dtype=bool)
    couplings(blocks, ROUNDING, means, left, coupled)
    kept = np.empty((harmonics, n), dtype=bool)
    touched(coupled, rows.columns, rows.values, kept)
    return Coupling(means, left, coupled, kept)


@dataclass(frozen=True, eq=False)
class _Harmonic:
    """One harmonic: eliminated and kept coordinates, and the Schur complement of the eliminated ones."""

    rest: IntArray  # (r,)
    kept: IntArray  # (k,)
    lu: Entries  # of D_RR; real for the static harmonic
    pivots: IntArray
    onto: Entries  # (k, r) D_AR
    follow: Entries  # (r, k) D_RR⁻¹ D_RA
    reduced: Entries  # (k, k) D_AA - D_AR D_RR⁻¹ D_RA

    def solve(self, right: ComplexArray, *, transposed: bool) -> ComplexArray:
        """Solve with D_RR, or with the transpose of its real form (the real form of D_RRᴴ), for (r, j)."""
        if not self.rest.size:
            return right
        if self.lu.dtype == float:
            solved, _ = lapack.dgetrs(self.lu, self.pivots, right.real, trans=int(transposed))
        else:
            solved, _ = lapack.zgetrs(self.lu, self.pivots, right, trans=2 * int(transposed))
        return np.asarray(solved)

    @property
    def sign(self) -> float:
        """Sign of the determinant of the real form of D_RR: always positive, except for the static harmonic."""
        if np.iscomplexobj(self.lu):
            return 1.0
        swaps = np.count_nonzero(self.pivots != np.arange(self.pivots.size))
        flips = swaps + np.count_nonzero(np.diagonal(self.lu) < 0.0)
        return 1.0 if flips % 2 == 0 else -1.0


def _eliminated(matrix: Entries, kept: BoolArray) -> _Harmonic:
    """Eliminate the coordinates of a harmonic that are not `kept`; none if that would lose accuracy."""
    rest, own = np.flatnonzero(~kept), np.flatnonzero(kept)
    found = _split(matrix, rest, own) if rest.size else None
    if found is None:
        all_of_it = np.arange(len(matrix))
        none = all_of_it[:0]
        return _Harmonic(none, all_of_it, matrix[:0, :0], none, matrix[:, :0], matrix[:0], matrix)
    return found


def _split(matrix: Entries, rest: IntArray, own: IntArray) -> _Harmonic | None:
    real = matrix.dtype == float
    getrf, getrs = (lapack.dgetrf, lapack.dgetrs) if real else (lapack.zgetrf, lapack.zgetrs)
    turned = matrix.T  # columns picked from the transpose are back in Fortran order when transposed again
    below, beside = turned[rest], turned[own]
    lu, pivots, info = getrf(below[:, rest].T, overwrite_a=True)
    size = np.abs(lu.diagonal())
    if info != 0 or not size.min() > SINGULAR * size.max():
        return None
    onto, follow, reduced = below[:, own].T, beside[:, rest].T, beside[:, own].T
    if own.size:
        follow, _ = getrs(lu, pivots, follow, overwrite_b=True)
        reduced -= onto @ follow
        grown = np.abs(reduced).max() / np.abs(matrix).max()
        if not max(grown, np.abs(follow).max()) <= GROWTH:
            return None
    return _Harmonic(rest, own, lu, pivots, onto, follow, reduced)


@dataclass(frozen=True, eq=False)
class Resting:
    """A Jacobian after elimination of the unknowns that contacts do not couple; build it with `Known.without_resting`.

    Attributes
    ----------
    harmonics
        Elimination of each harmonic.
    contacts
        Contact forces that couple harmonics.
    rows
        Gap operator by contact.
    scale
        Displacement scale over force scale.
    """

    harmonics: tuple[_Harmonic, ...]
    contacts: Coupling
    rows: SparseRows
    scale: float

    @property
    def n(self) -> int:
        """Number of coordinates."""
        return int(self.contacts.kept.shape[1])

    @cached_property
    def kept(self) -> IntArray:
        """Positions of the kept unknowns among all, harmonic-major."""
        rows = [self.harmonics[0].kept]
        for h, own in enumerate(self.harmonics[1:], start=1):
            rows += [(2 * h - 1) * self.n + own.kept, 2 * h * self.n + own.kept]
        return np.concatenate(rows)

    @property
    def size(self) -> int:
        """Number of kept unknowns."""
        return int(self.kept.size)

    @property
    def sign(self) -> float:
        """Sign of the determinant of the eliminated block."""
        return self.harmonics[0].sign

    def array(self) -> FloatArray:
        """Return ``S = J_AA - J_AR J_RR⁻¹ J_RA`` as a new array in Fortran order."""
        counts = np.array([own.kept.size for own in self.harmonics])
        first = np.concatenate([[0], counts[0] + 2 * np.cumsum(counts[1:]) - 2 * counts[1:]])
        out = np.zeros((self.size, self.size))
        amplitudes = np.zeros((len(counts), self.n, counts.max(initial=0)), dtype=complex)
        for h, (own, k, at) in enumerate(zip(self.harmonics, counts, first, strict=True)):
            amplitudes[h, own.kept, np.arange(k)] = 1.0
            amplitudes[h, own.rest, :k] = -own.follow
            cos, sin = slice(at, at + k), slice(at + k, at + 2 * k)
            out[cos, cos] = own.reduced.real
            if h > 0:
                out[sin, sin] = own.reduced.real
                out[cos, sin] = own.reduced.imag
                out[sin, cos] = -own.reduced.imag
        place = np.full(self.n * (2 * len(counts) - 1), -1)
        place[self.kept] = np.arange(self.size)
        add_coupling(
            self.scale * self.contacts.left,
            self.contacts.coupled,
            self.rows.columns,
            self.rows.values,
            np.ascontiguousarray(amplitudes.real),
            np.ascontiguousarray(amplitudes.imag),
            counts,
            first,
            place.reshape(-1, self.n),
            out,
        )
        return np.asfortranarray(out)

    def reduced(self, right: FloatArray, *, transposed: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the right side (size, j) of S from `right` (N, j), and ``J_RR⁻¹ b_R`` (N, j).

        The latter is zero for kept unknowns; see `Elimination`.
        """
        q = to_complex(right.reshape(-1, self.n, right.shape[1]))
        inner = np.zeros_like(q)
        for x, b, own in zip(inner, q, self.harmonics, strict=True):
            if own.rest.size:
                x[own.rest] = own.solve(b[own.rest], transposed=transposed)
                if transposed:
                    b[own.kept] -= own.follow.conj().T @ b[own.rest]
                else:
                    b[own.kept] -= own.onto @ x[own.rest]
        left, solved = (to_real(v).reshape(right.shape) for v in (q, inner))
        if not transposed:
            self._add_coupling(solved, -self.scale, left, transposed=False)
        return left[self.kept], solved

    def spread(self, x: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return all unknowns (N, j) from the kept ones (size, j), without right side for the eliminated ones."""
        out = np.zeros((self.n * (2 * len(self.harmonics) - 1), x.shape[1]))
        out[self.kept] = x
        q = to_complex(out.reshape(-1, self.n, x.shape[1]))
        if not transposed:
            for a, own in zip(q, self.harmonics, strict=True):
                a[own.rest] = -own.follow @ a[own.kept]
            return to_real(q).reshape(out.shape)
        force = np.zeros_like(out)
        self._add_coupling(out, self.scale, force, transposed=True)
        f = to_complex(force.reshape(-1, self.n, x.shape[1]))
        for a, b, own in zip(q, f, self.harmonics, strict=True):
            if own.rest.size:
                given = own.onto.conj().T @ a[own.kept] + b[own.rest]
                a[own.rest] = -own.solve(given, transposed=True)
        return to_real(q).reshape(out.shape)

    def _add_coupling(self, v: FloatArray, factor: float, out: FloatArray, *, transposed: bool) -> None:
        """Add ``factor Bᵀ L B v`` to `out`, (N, j) both."""
        m = 2 * len(self.harmonics) - 1
        for column in range(v.shape[1]):
            rows = np.ascontiguousarray(v[:, column].reshape(m, self.n))
            added = np.zeros_like(rows)
            contact_product(
                self.contacts.left,
                self.rows.columns,
                self.rows.values,
                rows,
                transposed,
                np.empty((3, m)),
                np.empty((3, m)),
                added,
            )
            out[:, column] += factor * added.reshape(-1)


@dataclass(eq=False)
class Known:
    """Cache of a dynamic stiffness at one frequency: its matrices, and the last elimination; build it with `known`."""

    linear: StiffnessProducts
    _last: tuple[Coupling, float, tuple[_Harmonic, ...]] | None = None

    @cached_property
    def matrices(self) -> list[ComplexArray]:
        """``Z_h`` of each harmonic, N/m."""
        return [as_array(self.linear.block(h)) for h in self.linear.harmonics]

    def knows(self, contacts: Coupling, scale: float) -> bool:
        """Whether the last elimination still holds for `contacts`."""
        return self._last is not None and self._last[1] == scale and contacts.same_rest(self._last[0])

    def without_resting(self, contacts: Coupling, rows: SparseRows, scale: float) -> Resting:
        """Eliminate the unknowns that contacts do not couple.

        Parameters
        ----------
        contacts
            Contact forces that couple harmonics.
        rows
            Gap operator by contact, the same at each call.
        scale
            Displacement scale over force scale.
        """
        if self._last is None or not self.knows(contacts, scale):
            local = rows.values.transpose(0, 2, 1) @ contacts.means @ rows.values
            first, second = rows.columns[:, :, None], rows.columns[:, None, :]
            own = []
            for h, (matrix, stiffness) in enumerate(zip(self.matrices, local, strict=True)):
                block: Entries = matrix.copy(order="F") if h else matrix.real.copy(order="F")
                np.add.at(block, (first, second), stiffness if h else stiffness.real)
                block *= scale
                own.append(_eliminated(block, contacts.kept[h]))
            self._last = contacts, scale, tuple(own)
        return Resting(self._last[2], contacts, rows, scale)


@lru_cache(maxsize=2)
def known(linear: StiffnessProducts, _rows: SparseRows) -> Known:
    """Return the cache of a dynamic stiffness at one frequency, for contacts with the gap operator `_rows`."""
    return Known(linear)


@dataclass(frozen=True, eq=False)
class TransposedElimination:
    """The transpose of an elimination."""

    inside: Elimination

    @property
    def size(self) -> int:
        """Number of remaining unknowns."""
        return self.inside.size

    @property
    def sign(self) -> float:
        """Sign of the determinant of the eliminated block."""
        return self.inside.sign

    def array(self) -> FloatArray:
        """Return the Schur complement, (size, size)."""
        return np.asfortranarray(self.inside.array().T)

    def reduced(self, right: FloatArray, *, transposed: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the right sides of the Schur complement, and their part of the eliminated unknowns; see `Elimination`."""
        return self.inside.reduced(right, transposed=not transposed)

    def spread(self, x: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return all unknowns from the remaining ones; see `Elimination`."""
        return self.inside.spread(x, transposed=not transposed)
