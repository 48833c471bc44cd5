"""One wave of a wheel condensed to the retained coordinates, at any frequency.

If stiffness and mass are Hermitian and the interior modes decouple the damping, the interior is transformed once to
these modes, and each frequency costs only products (`ModalWave`; Krack et al. 2017, app. 5). All other waves, complex
and unsymmetric, are solved at each frequency (`SolvedWave`).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.linalg

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.matrices import SYMMETRY, checked_matrix
from stickslip.harmonic.spectral import PARALLEL
from stickslip.model.blas_threads import threads_for
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback

Array = FloatArray | ComplexArray
Four = tuple[Array, Array, Array, Array]  # of stiffness, damping, mass and structural damping
LARGEST_MODAL = 1500  # interior coordinates; above, the modes cost more than direct solutions at dozens of frequencies
HELD = 1e-12  # smallest eigenvalue of the scaled interior stiffness for which its modes are accurate
DIAGONAL = 1e-10  # largest share of off-diagonal damping that still counts as none


class WaveAt(Protocol):
    """A wave condensed at one frequency; derivatives are by ``s = hω``."""

    @property
    def stiffness(self) -> ComplexArray:
        """(n, n), N/m."""
        ...

    def slope(self, q: Array) -> ComplexArray:
        """Return the derivative of the stiffness times `q` (n,) or (n, k)."""
        ...

    def load(self, near: ComplexArray, far: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the (n,) load, N, and its derivative, from loads on the retained dofs (n,) and on the interior (l,)."""
        ...

    def inside(self, q: Array, far: Array) -> ComplexArray:
        """Return the (l,) displacements of the interior from the retained ones `q` (n,) and the interior load (l,).

        From (n, k) and (l, k), return (l, k).
        """
        ...


@dataclass(frozen=True, eq=False)
class SolvedWave:
    """A wave whose interior is solved at each frequency.

    Parameters
    ----------
    matrices
        Stiffness, damping, mass and structural damping of all dofs.
    near, far
        Retained dofs and interior.
    feedback
        Aerodynamic force that depends on the frequency, whose frozen form is in the matrices; None: no force.
    """

    matrices: Four
    near: IntArray
    far: IntArray
    feedback: Feedback | None = None

    def with_mass_damping(self, rate: float) -> "SolvedWave":
        """Return the same wave with `rate` (1/s) times its mass added to its damping."""
        k, c, m, loss = self.matrices
        return replace(self, matrices=(k, c + rate * m, m, loss))

    def at(self, s: float) -> WaveAt:
        """Return the wave at ``s = hω`` in rad/s."""
        k, c, m, loss = self.matrices
        D, G = k, 1j * c - 2 * s * m
        if s != 0:
            D = k + 1j * (s * c + loss) - s**2 * m
        if self.feedback is not None:
            P = self.feedback.patterns
            force, slope = self.feedback.beyond_frozen(s)
            D, G = D - P @ force @ P.conj().T, G - P @ slope @ P.conj().T
        return _SolvedAt(_blocks(D, self.near, self.far), _blocks(G, self.near, self.far))


@dataclass(frozen=True, eq=False)
class _SolvedAt:
    D: Four  # blocks nn, nl, ln, ll
    G: Four  # their derivatives

    @cached_property
    def _solve(self) -> Callable[[Array], Array]:
        if not len(self.D[3]):
            return lambda right: right
        factors = scipy.linalg.lu_factor(self.D[3])
        return lambda right: np.asarray(scipy.linalg.lu_solve(factors, right))

    @cached_property
    def _follows(self) -> Array:
        """(l, n) displacements of the interior, with reversed sign, due to displacements of the retained dofs."""
        return self._solve(self.D[2])

    @cached_property
    def stiffness(self) -> ComplexArray:
        nn, nl, _, _ = self.D
        return np.asarray(nn - nl @ self._follows, dtype=complex)

    def slope(self, q: Array) -> ComplexArray:
        (_, nl, _, _), (g_nn, g_nl, g_ln, g_ll) = self.D, self.G
        moved = self._follows @ q
        inner = self._solve(g_ln @ q - g_ll @ moved)
        return np.asarray(g_nn @ q - g_nl @ moved - nl @ inner)

    def load(self, near: ComplexArray, far: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        (_, nl, _, _), (_, g_nl, _, g_ll) = self.D, self.G
        if not np.any(far):
            return near, np.zeros_like(near)
        moved = self._solve(far)
        slope = nl @ self._solve(g_ll @ moved) - g_nl @ moved
        return np.asarray(near - nl @ moved), np.asarray(slope)

    def inside(self, q: Array, far: Array) -> ComplexArray:
        return np.asarray(self._solve(far) - self._follows @ q)


@dataclass(frozen=True, eq=False)
class ModalWave:
    """A Hermitian wave with its interior in modes of unit stiffness, after the static condensation of the interior.

    With ``p = is`` the interior has ``D_LL = diag(1 + p c + p² m + i l)`` and ``D_NL = p (κ + p) across``.

    Parameters
    ----------
    nn
        Matrices on the retained coordinates, condensed with the static shapes of the interior.
    static
        (n, l) static shapes: the static response of the interior is ``-modes @ staticᴴ q``.
    across
        (n, l) mass coupling of retained coordinates and interior.
    ratio, damping, mass, loss
        (l,) κ, c, m and l of ``D_NL`` and ``D_LL``.
    modes
        (l, l) interior displacement = modes @ interior coordinates.
    """

    nn: Four
    static: Array
    across: Array
    ratio: Array
    damping: Array
    mass: Array
    loss: Array
    modes: Array

    @cached_property
    def back(self) -> ComplexArray:
        """(l, n) conjugate transpose of `across`, used at every frequency."""
        return np.asarray(self.across.conj().T, dtype=complex, order="C")

    def with_mass_damping(self, rate: float) -> "ModalWave":
        """Return the same wave with `rate` (1/s) times its mass added to its damping; its modes do not change."""
        k, c, m, loss = self.nn
        return replace(
            self, nn=(k, c + rate * m, m, loss), ratio=self.ratio + rate, damping=self.damping + rate * self.mass
        )

    def at(self, s: float) -> WaveAt:
        """Return the wave at ``s = hω`` in rad/s."""
        return _ModalAt(self, s)


@dataclass(frozen=True, eq=False)
class _ModalAt:
    wave: ModalWave
    s: float

    @cached_property
    def _weights(self) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """``v / d``, ``v² / d`` with ``v = p (κ + p)`` and the interior stiffness ``d``, and their derivatives by s."""
        wave, p = self.wave, 1j * self.s
        v, v_slope = p * (wave.ratio + p), wave.ratio + 2 * p
        d = 1 + p * wave.damping + p**2 * wave.mass + 1j * (self.s != 0) * wave.loss
        d_slope = wave.damping + 2 * p * wave.mass
        per = v / d
        per_slope = (v_slope - per * d_slope) / d
        return per, v * per, 1j * per_slope, 1j * (v_slope * per + v * per_slope)

    @cached_property
    def stiffness(self) -> ComplexArray:
        wave, s = self.wave, self.s
        k, c, m, loss = wave.nn
        scaled = wave.across * self._weights[1]
        return np.asarray(k + 1j * (s * c + (s != 0) * loss) - s**2 * m - scaled @ wave.back)

    def slope(self, q: Array) -> ComplexArray:
        wave, by_s = self.wave, self._weights[3]
        amplitudes = wave.back @ q
        amplitudes = amplitudes * (by_s if q.ndim == 1 else by_s[:, None])
        _, c, m, _ = wave.nn
        return np.asarray(1j * (c @ q) - 2 * self.s * (m @ q) - wave.across @ amplitudes)

    def load(self, near: ComplexArray, far: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        wave, (per, _, by_s, _) = self.wave, self._weights
        if not np.any(far):
            return near, np.zeros_like(near)
        modal = wave.modes.conj().T @ far
        moved = near - wave.static @ modal - wave.across @ (per * modal)
        return moved, -wave.across @ (by_s * modal)

    def inside(self, q: Array, far: Array) -> ComplexArray:
        wave, p = self.wave, 1j * self.s
        d = 1 + p * wave.damping + p**2 * wave.mass + 1j * (self.s != 0) * wave.loss
        per = self._weights[0]
        if q.ndim > 1:
            d, per = d[:, None], per[:, None]
        modal = (wave.modes.conj().T @ far) / d
        modal = modal - per * (wave.back @ q) - wave.static.conj().T @ q
        return np.asarray(wave.modes @ modal)


def condense_wave(
    structure: Structure, near: IntArray, far: IntArray, *, mean: bool, feedback: Feedback | None = None
) -> SolvedWave | ModalWave:
    """Prepare the condensation of a wave.

    Parameters
    ----------
    structure
        The wave.
    near, far
        Retained and condensed dofs.
    mean
        Whether the wave is the mean of a real motion, with the real part of the matrices and zero frequency.
    feedback
        Aerodynamic force on the wave, whose frozen form is in the structure; None: no force.
    """
    names = ("stiffness", "damping", "mass", "loss")
    k, c, m, loss = (_matrix(structure, name, mean) for name in names)
    if feedback is not None and feedback.influence.depends_on_frequency and not mean:
        return SolvedWave((k, c, m, loss), near, far, feedback)
    solved = SolvedWave((k, c, m, loss), near, far)
    if mean or not 0 < far.size <= LARGEST_MODAL or not all(map(_hermitian, (k, c, m, loss))):
        return solved
    return _in_modes((k, c, m, loss), near, far) or solved


def _in_modes(matrices: Four, near: IntArray, far: IntArray) -> ModalWave | None:
    """Return the wave in modes of its interior; None if these do not decouple it."""
    blocks = [_blocks(matrix, near, far) for matrix in matrices]
    modes = _interior_modes(blocks[0][3], blocks[2][3])
    if modes is None:
        return None
    to_modes = [nl @ modes for _, nl, _, _ in blocks]
    own = [modes.conj().T @ ll @ modes for _, _, _, ll in blocks[1:]]
    if not (_diagonal(own[0]) and _diagonal(own[2])):
        return None
    damping, mass, loss = (np.diagonal(matrix).real for matrix in own)
    static = to_modes[0]
    left = [cross - static * d for cross, d in zip(to_modes[1:], (damping, mass, loss), strict=True)]
    c, m, lossy = left
    squares = np.sum(np.abs(m) ** 2, axis=0)
    ratio = np.sum(m.conj() * c, axis=0).real / np.where(squares > 0.0, squares, 1.0)
    for rest, cross, d in ((c - ratio * m, to_modes[1], damping), (lossy, to_modes[3], loss)):
        size = np.sum(np.abs(cross) + np.abs(static * d), axis=0)
        if np.any(np.sum(np.abs(rest), axis=0) > PARALLEL * size):
            return None
    whole = [blocks[0][0] - static @ static.conj().T]
    for (nn, _, _, _), cross, rest in zip(blocks[1:], to_modes[1:], left, strict=True):
        whole.append(nn - cross @ static.conj().T - static @ rest.conj().T)
    k_nn, c_nn, m_nn, l_nn = whole
    return ModalWave((k_nn, c_nn, m_nn, l_nn), static, m, ratio, damping, np.maximum(mass, 0.0), loss, modes)


def _interior_modes(stiffness: Array, mass: Array) -> Array | None:
    """Return the undamped modes of unit stiffness; None if the interior can move freely."""
    size = np.sqrt(np.maximum(np.abs(np.diagonal(stiffness)), np.finfo(float).tiny))
    try:
        if np.linalg.eigvalsh(stiffness / np.outer(size, size))[0] <= HELD:
            return None
        with threads_for(len(mass)):
            return np.asarray(scipy.linalg.eigh(mass, stiffness)[1])
    except np.linalg.LinAlgError:
        return None


def _matrix(structure: Structure, name: str, mean: bool) -> Array:
    if getattr(structure, name) is None:
        return np.zeros((structure.n, structure.n))
    matrix = checked_matrix(structure, name)
    return matrix.real if mean else matrix


def _hermitian(matrix: Array) -> bool:
    size = np.max(np.abs(matrix), initial=0.0)
    return bool(np.max(np.abs(matrix - matrix.conj().T), initial=0.0) <= SYMMETRY * size)


def _diagonal(matrix: Array) -> bool:
    size = np.max(np.abs(matrix), initial=0.0)
    off = np.max(np.abs(matrix - np.diag(np.diagonal(matrix))), initial=0.0)
    return bool(off <= DIAGONAL * size)


def _blocks(matrix: Array, near: IntArray, far: IntArray) -> Four:
    n, f = near[:, None], far[:, None]
    return matrix[n, near], matrix[n, far], matrix[f, near], matrix[f, far]
