"""Dynamic stiffness condensed exactly to the retained coordinates (Gastaldi & Berruti 2017, eq. 2-5).

``D(Ω) = K + iΩ C - Ω² M``; structural damping L adds ``iL`` above harmonic 0. The interior is transformed once to its
undamped modes or, if these do not diagonalise the damping, to its state-space eigenvectors. Each frequency then costs a
few products and no factorisation (`harmonic.spectral`). The interior is solved at each frequency only if the
eigenvectors are ill-conditioned, the interior is very large, or structural damping makes its stiffness complex.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.condensed_product import CondensedProduct, at_frequency, onto_interior
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics, padded
from stickslip.harmonic.matrices import SYMMETRY, asymmetry, is_diagonal, real_symmetric
from stickslip.harmonic.spectral import Blocks, Interior, Terms, summed
from stickslip.model.blas_threads import threads_for
from stickslip.model.structure import Structure

DIAGONAL_TOLERANCE = 1e-10  # largest share of off-diagonal modal damping that still counts as proportional
LARGEST_INTERIOR = 5000  # dense eigenproblem of the interior; reduce larger structures first


@dataclass(frozen=True, eq=False)
class Condensed:
    """Condensed matrices at one frequency, for harmonics 0..H."""

    stiffness: ComplexArray  # (H+1, n, n)
    derivative: ComplexArray  # (H+1, n, n), by ω
    load: ComplexArray  # (H+1, n)
    load_derivative: ComplexArray  # (H+1, n), by ω

    def kept(self, harmonics: list[int]) -> "Condensed":
        """Return the matrices of some harmonics."""
        own = (self.stiffness, self.derivative, self.load, self.load_derivative)
        return Condensed(*(a[harmonics] for a in own))


@dataclass(frozen=True, eq=False)
class _Sums:
    """The spectral decomposition and the modal load in each harmonic; see `summed`."""

    terms: Terms
    load: ComplexArray  # statically condensed
    source: ComplexArray
    direct: ComplexArray | None


@dataclass(frozen=True, eq=False)
class CondensedStiffness:
    """A structure and its load, condensed to the retained coordinates; build it with `condense`.

    Retained blocks have the index ``n``, interior ones ``l``; the interior is in undamped modes of unit stiffness. Only
    the damping may lack symmetry, by Coriolis forces.
    """

    retained: IntArray
    interior: IntArray
    nn: Blocks  # K, C, M on the retained coordinates
    nl: Blocks
    ll: Blocks
    modes: FloatArray  # interior displacement = modes @ interior coordinates
    diagonal: bool
    load: HarmonicLoad
    spectral: Interior  # the same blocks, with decompositions that are computed at first use
    ln: Blocks | None = None  # transposed blocks from retained coordinates to interior, if damping is not symmetric
    loss: Blocks | None = None  # structural damping on nn, nl, ll

    @cached_property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    @property
    def most(self) -> None:
        """Highest available harmonic; None: any."""

    def load_at(self, _omega: float) -> HarmonicLoad:
        """Return the load, N, which is the same at all frequencies."""
        return self.load

    def with_load(self, load: HarmonicLoad) -> "CondensedStiffness":
        """Return the same structure under another load."""
        return replace(self, load=load)

    def with_mass_damping(self, rate: float) -> "CondensedStiffness":
        """Return the same structure with `rate` (1/s) times its mass added to its damping; the rate may be negative."""
        nn, nl, ll = (_mass_damped(blocks, rate) for blocks in (self.nn, self.nl, self.ll))
        back = None if self.ln is None else _mass_damped(self.ln, rate)
        interior = Interior(nn, nl, ll, self.diagonal, back, self.loss)
        return replace(self, nn=nn, nl=nl, ll=ll, ln=back, spectral=interior)

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        # the static problem alone does not justify decomposing the interior
        sums = self._sums if order > 0 and omega != 0.0 else None
        return self._factorised(omega, order) if sums is None else self._summed(sums, omega, order)

    def products(self, omega: float, harmonics: Harmonics) -> CondensedProduct:
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        return at_frequency(self.spectral, self.modal_loads(harmonics[-1]), omega, harmonics)

    def _summed(self, sums: "_Sums", omega: float, order: int) -> Condensed:
        """Condense by the spectral decomposition of the interior."""
        matrices, loads = summed(sums.terms, omega, order, sums.source, sums.direct)
        own = min(order + 1, len(sums.load))
        loads[0, :own] += sums.load[:own]
        return Condensed(matrices[0], matrices[1], loads[0], loads[1])

    def _factorised(self, omega: float, order: int) -> Condensed:
        """Condense by solving the interior at each harmonic."""
        h = np.arange(order + 1)
        s = (h * omega)[:, None, None]
        f_n, f_l = self.modal_loads(order)
        d_nn, g_nn = _dynamic(self.nn, s, self.loss and self.loss[0])
        d_nl, g_nl = _dynamic(self.nl, s, self.loss and self.loss[1])
        d_ln, g_ln = (d_nl, g_nl) if self.ln is None else self._back(s)
        solved = self._solve_interior(s, np.concatenate([d_ln.transpose(0, 2, 1), f_l[:, :, None]], axis=2))
        _, g_ll = self._interior_dynamic(s)
        g_x = g_ll * solved if self.diagonal else g_ll @ solved
        x_nt = (
            solved[:, :, :-1] if self.ln is None else self._solve_interior(s, d_nl.transpose(0, 2, 1), True)
        ).transpose(0, 2, 1)
        d_x = d_nl @ solved
        g_nl_x = g_nl @ solved
        stiffness = d_nn - d_x[:, :, :-1]
        cross = g_nl_x[:, :, :-1]
        other = cross.transpose(0, 2, 1) if self.ln is None else x_nt @ g_ln.transpose(0, 2, 1)
        inner = x_nt @ g_x
        derivative = g_nn - cross - other + inner[:, :, :-1]
        load = f_n - d_x[:, :, -1]
        load_derivative = inner[:, :, -1] - g_nl_x[:, :, -1]
        h_ = h[:, None]
        return Condensed(stiffness, h_[:, :, None] * derivative, load, h_ * load_derivative)

    def _back(self, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the transpose of D from the retained coordinates to the interior, and its derivative by s."""
        return _dynamic(self.spectral.far, s, self.loss and self.loss[1])

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from the retained coordinates (eq. 5 with corrected sign).

        Parameters
        ----------
        omega
            Frequency, rad/s.
        q
            (H+1, n) coefficients of the retained coordinates.
        """
        return self._spread(omega, q, self.modal_loads(q.shape[0] - 1)[1])

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        return self._spread(omega, dq, np.zeros((dq.shape[0], self.interior.size), dtype=complex))

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        place = np.full(self.retained.size + self.interior.size, -1)
        place[self.retained] = np.arange(self.n)
        rows = np.zeros((dofs.size, self.n), dtype=complex)
        near = place[dofs] >= 0
        rows[near, place[dofs[near]]] = 1.0
        s = np.full((1, 1, 1), harmonic * omega)
        read = self.modes[np.searchsorted(self.interior, dofs[~near])].T.astype(complex)
        states = self.spectral.states if harmonic > 0 else None
        if states is None:
            solved = self._solve_interior(s, read[None], True)[0]
        else:
            solved = states.solve_transposed(1j * harmonic * omega, read)
        rows[~near] = -(self._back(s)[0][0] @ solved).T
        return rows

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of the whole structure in each harmonic, mean over the period, J."""
        inner = self._inside(omega, q, self.modal_loads(q.shape[0] - 1)[1])
        outer = np.sum(q.conj() * (q @ self.nn[0].T + 2.0 * inner @ self.nl[0].T), axis=1).real
        # interior modes have unit stiffness
        share = 0.25 + 0.25 * (np.arange(len(q)) == 0)
        return np.asarray(share * (outer + np.sum(np.abs(inner) ** 2, axis=1)))

    def _spread(self, omega: float, q: ComplexArray, f_l: ComplexArray) -> ComplexArray:
        out = np.empty((q.shape[0], self.retained.size + self.interior.size), dtype=complex)
        out[:, self.retained] = q
        out[:, self.interior] = self._inside(omega, q, f_l) @ self.modes.T
        return out

    def _inside(self, omega: float, q: ComplexArray, f_l: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_interior) modal coordinates of the interior."""
        s = (np.arange(q.shape[0]) * omega)[:, None, None]
        right = (f_l - self._onto(s[:, 0], q))[:, :, None]
        states = self.spectral.states if np.any(s) else None
        if states is None:
            return self._solve_interior(s, right)[:, :, 0]
        return states.solve_each(1j * s[:, 0, 0], right[:, :, 0])

    def _onto(self, s: FloatArray, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_interior) forces of retained coordinates `q` on the interior.

        The matrices of the harmonics are not formed.
        """
        k, c, m, loss = onto_interior(self.spectral, np.concatenate([q.real, q.imag]))
        size, twice = len(q), np.concatenate([s, s])
        even, odd = k - twice**2 * m, twice * c
        if loss is not None:
            odd += (twice != 0.0) * loss
        return np.asarray((even[:size] - odd[size:]) + 1j * (even[size:] + odd[:size]))

    def modal_loads(self, order: int) -> tuple[ComplexArray, ComplexArray]:
        """Return the load on the retained coordinates (H+1, n) and on the modes of the interior (H+1, l), N."""
        f_n, f_l = self._modal_load
        return padded(f_n, order), padded(f_l, order)

    @cached_property
    def _modal_load(self) -> tuple[ComplexArray, ComplexArray]:
        """Load on the retained coordinates and on the interior's modes, for the harmonics of the load."""
        f = self.load.coefficients(max(self.load.harmonics, default=0))
        inner = f[:, self.interior]
        return f[:, self.retained], inner.real @ self.modes + 1j * (inner.imag @ self.modes)

    @cached_property
    def _sums(self) -> "_Sums | None":
        terms = self.spectral.terms
        if terms is None:
            return None
        f_n, f_l = self._modal_load
        direct = None if terms.direct is None else f_l @ terms.direct.T
        return _Sums(terms, f_n - f_l @ self.nl[0].T, terms.source(f_l), direct)

    def _interior_dynamic(self, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return interior D and dD/dΩ at Ω = `s`; as columns where they are diagonal."""
        loss = None if self.loss is None else self.loss[2]
        if self.diagonal:
            k, c, m = (np.diagonal(a)[None, :, None] for a in self.ll)
            return _dynamic((k, c, m), s, None if loss is None else np.diagonal(loss)[:, None])
        return _dynamic(self.ll, s, loss)

    def _solve_interior(self, s: FloatArray, right: ComplexArray, transposed: bool = False) -> ComplexArray:
        d_ll, _ = self._interior_dynamic(s)
        if self.diagonal:
            return right / d_ll
        if not np.any(s):
            return right  # modes of unit stiffness
        return np.linalg.solve(d_ll.transpose(0, 2, 1) if transposed else d_ll, right)


def _dynamic(blocks: Blocks, s: FloatArray, loss: FloatArray | None = None) -> tuple[ComplexArray, ComplexArray]:
    """Return K + is C - s² M and its derivative by s, stacked over the frequencies `s` (H+1, 1, 1).

    Structural damping adds i loss where s > 0.
    """
    k, c, m = blocks
    stiffness: ComplexArray = np.asarray(k + 1j * s * c - s**2 * m)
    if loss is not None:
        stiffness += 1j * (s != 0.0) * loss
    slope: ComplexArray = np.asarray(1j * c - 2.0 * s * m)
    return stiffness, slope


def _mass_damped(blocks: Blocks, rate: float) -> Blocks:
    k, c, m = blocks
    return k, c + rate * m, m


def condense(structure: Structure, retained: IntArray, load: HarmonicLoad) -> CondensedStiffness:
    """Prepare the exact condensation of `structure` to the dofs `retained`.

    Parameters
    ----------
    structure
        Reduced or lumped structure; mass, stiffness and loss must be symmetric, damping may have Coriolis terms.
    retained
        Retained dofs, the unknowns: contact coordinates and free rigid bodies.
    load
        Load on all dofs of the structure, N.

    Raises
    ------
    InputError
        If a matrix is not real, a matrix other than the damping is not symmetric, `retained` has repeated dofs, or the
        interior is too large or can move freely.
    """
    if load.static.size != structure.n:
        raise input_error("HarmonicLoad", f"{load.static.size} entries for {structure.n} dofs", "Give one a dof.")
    retained = _checked_dofs(retained, structure.n)
    interior = np.setdiff1d(np.arange(structure.n), retained)
    if interior.size > LARGEST_INTERIOR:
        raise input_error("condense", f"{interior.size} interior dofs", "Reduce the structure first (craig_bampton).")
    full = tuple(real_symmetric(structure, name) for name in ("stiffness", "damping", "mass"))
    nn = _three(a[np.ix_(retained, retained)] for a in full)
    nl = tuple(a[np.ix_(retained, interior)] for a in full)
    ll = tuple(a[np.ix_(interior, interior)] for a in full)
    modes = _interior_modes(ll[0], ll[2])
    to_modes = _three(a @ modes for a in nl)
    back = None
    if asymmetry(full[1]) > SYMMETRY:
        back = to_modes[0], full[1].T[np.ix_(retained, interior)] @ modes, to_modes[2]
    damping = modes.T @ ll[1] @ modes
    loss = _loss(structure, retained, interior, modes)
    diagonal = is_diagonal(damping, DIAGONAL_TOLERANCE) and (loss is None or is_diagonal(loss[2], DIAGONAL_TOLERANCE))
    own = _modal(modes, ll[2], np.diag(np.diagonal(damping)) if diagonal else damping)
    return CondensedStiffness(
        retained,
        interior,
        nn,
        to_modes,
        own,
        modes,
        diagonal,
        load,
        Interior(nn, to_modes, own, diagonal, back, loss),
        back,
        loss,
    )


def _loss(structure: Structure, retained: IntArray, interior: IntArray, modes: FloatArray) -> Blocks | None:
    """Return the blocks nn, nl and ll of the structural damping, the interior in its modes; None if there is none."""
    if structure.loss is None:
        return None
    matrix = real_symmetric(structure, "loss")
    if not np.any(matrix):
        return None
    across, own = matrix[np.ix_(retained, interior)], matrix[np.ix_(interior, interior)]
    return matrix[np.ix_(retained, retained)], across @ modes, modes.T @ own @ modes


def _checked_dofs(retained: IntArray, n: int) -> IntArray:
    """Return dof indices after checking that they exist and differ."""
    dofs = np.asarray(retained)
    whole = dofs.size == 0 or np.issubdtype(dofs.dtype, np.integer)
    if not whole or dofs.ndim != 1 or np.any((dofs < 0) | (dofs >= n)) or np.unique(dofs).size != dofs.size:
        raise input_error(
            "condense: retained",
            f"must be different integers from 0 to {n - 1}, got {dofs[:8].tolist() if dofs.ndim else dofs}",
            "Of a mask, take np.flatnonzero(mask).",
        )
    return dofs.astype(np.int64)


def _three(blocks: Iterable[FloatArray]) -> Blocks:
    k, c, m = blocks
    return k, c, m


def _modal(modes: FloatArray, mass: FloatArray, damping: FloatArray) -> Blocks:
    """Return K = 1, C and the diagonal M in the interior's modes."""
    own = np.einsum("ij,ij->j", modes, mass @ modes)
    return np.eye(modes.shape[1]), damping, np.diag(np.maximum(own, 0.0))


def _interior_modes(stiffness: FloatArray, mass: FloatArray) -> FloatArray:
    """Return the undamped modes of unit stiffness.

    With this scaling massless modes are regular, and slow modes are the most accurate.
    """
    if stiffness.shape[0] == 0:
        return np.eye(0)
    size = np.sqrt(np.maximum(np.abs(np.diagonal(stiffness)), np.finfo(float).tiny))
    softest = float(np.linalg.eigvalsh(stiffness / np.outer(size, size))[0])
    if softest <= 1e-12:
        raise input_error(
            "condense",
            f"the coordinates that are condensed can move without stiffness (smallest scaled eigenvalue {softest:.3g})",
            "Retain the dofs of free bodies, or clamp them.",
        )
    with threads_for(len(mass)):
        return np.asarray(scipy.linalg.eigh(mass, stiffness)[1])
