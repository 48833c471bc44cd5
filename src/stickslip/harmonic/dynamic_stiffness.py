"""Dynamic stiffness condensed exactly to the retained coordinates (Gastaldi & Berruti 2017, eq. 2-5).

``D(Ω) = K + iΩ C - Ω² M``. The interior is written once in its own undamped modes, in which its dynamic stiffness is diagonal when the
damping is proportional; a frequency then costs a few products and no factorisation. With any other damping matrix the interior,
already small after reduction, is solved at each frequency.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure

DIAGONAL_TOLERANCE = (
    1e-10  # off-diagonal modal damping below this share of the largest counts as proportional
)
LARGEST_INTERIOR = 5000  # dense eigenproblem of the interior; reduce larger structures first


@dataclass(frozen=True, eq=False)
class Condensed:
    """Condensed matrices at one frequency, for harmonics 0..H."""

    stiffness: ComplexArray  # (H+1, n, n)
    derivative: ComplexArray  # (H+1, n, n), by ω
    load: ComplexArray  # (H+1, n)
    load_derivative: ComplexArray  # (H+1, n), by ω


@dataclass(frozen=True, eq=False)
class CondensedStiffness:
    """A structure and its load, seen from the retained coordinates.

    Build it with `condense`. Retained blocks carry ``n``, interior ones ``l`` (modal where that is possible).
    """

    retained: IntArray
    interior: IntArray
    nn: tuple[FloatArray, FloatArray, FloatArray]  # K, C, M on the retained coordinates
    nl: tuple[FloatArray, FloatArray, FloatArray]
    ll: tuple[FloatArray, FloatArray, FloatArray]
    modes: FloatArray  # interior displacement = modes @ interior coordinates
    diagonal: bool
    load: HarmonicLoad

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    def with_load(self, load: HarmonicLoad) -> "CondensedStiffness":
        """Return the same structure under another load."""
        return CondensedStiffness(
            self.retained, self.interior, self.nn, self.nl, self.ll, self.modes, self.diagonal, load
        )

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        h = np.arange(order + 1)
        s = (h * omega)[:, None, None]
        f_n, f_l = self._loads(order)
        d_nn, g_nn = _dynamic(self.nn, s)
        d_nl, g_nl = _dynamic(self.nl, s)
        solved = self._solve_interior(
            s, np.concatenate([d_nl.transpose(0, 2, 1), f_l[:, :, None]], axis=2)
        )
        _, g_ll = self._interior_dynamic(s)
        g_x = g_ll * solved if self.diagonal else g_ll @ solved
        x_nt = solved[:, :, :-1].transpose(0, 2, 1)
        d_x = d_nl @ solved
        g_nl_x = g_nl @ solved
        stiffness = d_nn - d_x[:, :, :-1]
        cross = g_nl_x[:, :, :-1]
        inner = x_nt @ g_x
        derivative = g_nn - cross - cross.transpose(0, 2, 1) + inner[:, :, :-1]
        load = f_n - d_x[:, :, -1]
        load_derivative = inner[:, :, -1] - g_nl_x[:, :, -1]
        h_ = h[:, None]
        return Condensed(stiffness, h_[:, :, None] * derivative, load, h_ * load_derivative)

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (eq. 5 with the sign mended).

        Parameters
        ----------
        omega
            Frequency, rad/s.
        q
            (H+1, n) coefficients of the retained coordinates.
        """
        order = q.shape[0] - 1
        _, f_l = self._loads(order)
        return self._spread(omega, q, f_l)

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        return self._spread(omega, dq, np.zeros((dq.shape[0], self.interior.size), dtype=complex))

    def _spread(self, omega: float, q: ComplexArray, f_l: ComplexArray) -> ComplexArray:
        s = (np.arange(q.shape[0]) * omega)[:, None, None]
        d_nl, _ = _dynamic(self.nl, s)
        right = f_l[:, :, None] - d_nl.transpose(0, 2, 1) @ q[:, :, None]
        out = np.empty((q.shape[0], self.retained.size + self.interior.size), dtype=complex)
        out[:, self.retained] = q
        out[:, self.interior] = self._solve_interior(s, right)[:, :, 0] @ self.modes.T
        return out

    def _loads(self, order: int) -> tuple[ComplexArray, ComplexArray]:
        f = self.load.coefficients(order)
        return f[:, self.retained], f[:, self.interior] @ self.modes

    def _interior_dynamic(self, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Interior D and dD/dΩ at Ω = `s`; as columns where they are diagonal."""
        if self.diagonal:
            k, c, m = (np.diagonal(a)[None, :, None] for a in self.ll)
            return _dynamic((k, c, m), s)
        return _dynamic(self.ll, s)

    def _solve_interior(self, s: FloatArray, right: ComplexArray) -> ComplexArray:
        d_ll, _ = self._interior_dynamic(s)
        if self.diagonal:
            return right / d_ll
        return np.linalg.solve(d_ll, right)


def _dynamic(
    blocks: tuple[FloatArray, FloatArray, FloatArray], s: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return K + is C - s² M and its derivative by s, stacked over the frequencies `s` (H+1, 1, 1)."""
    k, c, m = blocks
    stiffness: ComplexArray = np.asarray(k + 1j * s * c - s**2 * m)
    slope: ComplexArray = np.asarray(1j * c - 2.0 * s * m)
    return stiffness, slope


def condense(structure: Structure, retained: IntArray, load: HarmonicLoad) -> CondensedStiffness:
    """Prepare the exact condensation of `structure` to the dofs `retained`.

    Parameters
    ----------
    structure
        Reduced or lumped structure; matrices must be symmetric.
    retained
        Dof indices that stay unknown: contact coordinates and free rigid bodies.
    load
        Load on all dofs of the structure, N.

    Raises
    ------
    InputError
        If a matrix is not symmetric, the interior is too large, or it can move freely.
    """
    if load.static.size != structure.n:
        raise input_error(
            "HarmonicLoad", f"{load.static.size} entries for {structure.n} dofs", "Give one a dof."
        )
    interior = np.setdiff1d(np.arange(structure.n), retained)
    if interior.size > LARGEST_INTERIOR:
        raise input_error(
            "condense",
            f"{interior.size} interior dofs",
            "Reduce the structure first (craig_bampton).",
        )
    full = tuple(_dense_symmetric(structure, name) for name in ("stiffness", "damping", "mass"))
    nn = tuple(a[np.ix_(retained, retained)] for a in full)
    nl = tuple(a[np.ix_(retained, interior)] for a in full)
    ll = tuple(a[np.ix_(interior, interior)] for a in full)
    modes, diagonal = _interior_modes(*ll)
    ll = tuple(modes.T @ a @ modes for a in ll)
    return CondensedStiffness(
        np.asarray(retained),
        interior,
        _three(nn),
        _three(tuple(a @ modes for a in nl)),
        _three(ll),
        modes,
        diagonal,
        load,
    )


def _three(blocks: tuple[FloatArray, ...]) -> tuple[FloatArray, FloatArray, FloatArray]:
    k, c, m = blocks
    return k, c, m


def _interior_modes(
    stiffness: FloatArray, damping: FloatArray, mass: FloatArray
) -> tuple[FloatArray, bool]:
    """Return mass-normalised interior modes and whether they diagonalise the damping too; unit vectors if M is singular."""
    if stiffness.shape[0] == 0:
        return np.eye(0), True
    size = np.sqrt(np.maximum(np.abs(np.diagonal(stiffness)), np.finfo(float).tiny))
    softest = float(np.linalg.eigvalsh(stiffness / np.outer(size, size))[0])
    if softest <= 1e-12:
        raise input_error(
            "condense",
            f"the coordinates that are condensed can move without stiffness (smallest scaled eigenvalue {softest:.3g})",
            "Retain the dofs of free bodies, or clamp them.",
        )
    try:
        _, modes = scipy.linalg.eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        return np.eye(stiffness.shape[0]), False
    modal = modes.T @ damping @ modes
    off = np.max(np.abs(modal - np.diag(np.diagonal(modal))))
    return modes, bool(off <= DIAGONAL_TOLERANCE * max(np.max(np.abs(modal)), np.finfo(float).tiny))


def _dense_symmetric(structure: Structure, name: str) -> FloatArray:
    matrix = getattr(structure, name)
    dense = np.asarray(matrix.toarray() if scipy.sparse.issparse(matrix) else matrix, dtype=float)
    if not np.all(np.isfinite(dense)):
        raise input_error(
            f"Structure.{name}",
            "contains NaN or infinite entries",
            "Check the model that was read.",
        )
    if np.max(np.abs(dense - dense.T), initial=0.0) > 1e-8 * np.max(np.abs(dense), initial=0.0):
        raise input_error(
            f"Structure.{name}",
            "is not symmetric",
            "Give both triangles; gyroscopic terms are not supported yet.",
        )
    return dense
