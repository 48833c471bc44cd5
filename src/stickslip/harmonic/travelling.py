"""Dynamic stiffness of the waves of a wheel: complex, unsymmetric matrices for each temporal harmonic, condensed to the retained coordinates.

If stiffness and mass are Hermitian and the interior modes decouple the damping, the interior is transformed once to these modes, and
each frequency costs only products (`ModalWave`). All other waves, complex and unsymmetric, are solved at each frequency (`SolvedWave`).

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, section 3 and appendices 1, 2 and 5.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b
from typing import Protocol
from weakref import WeakKeyDictionary

import numpy as np
import scipy.linalg
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import Condensed, CondensedStiffness, condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics, to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness, LinearSide
from stickslip.harmonic.matrices import SYMMETRY, checked_matrix, is_diagonal, is_real_symmetric
from stickslip.harmonic.mistuned import by_sectors, condense_mistuned
from stickslip.harmonic.sparse_stiffness import LEAST_SPARSE, Unreduced, keep_all
from stickslip.harmonic.spectral import PARALLEL, Blocks
from stickslip.model.blas_threads import threads_for
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.mistuned import MistunedWheel
from stickslip.reduction.tuned import TunedWheel

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
    if not (is_diagonal(own[0], DIAGONAL) and is_diagonal(own[2], DIAGONAL)):
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


def _blocks(matrix: Array, near: IntArray, far: IntArray) -> Four:
    n, f = near[:, None], far[:, None]
    return matrix[n, near], matrix[n, far], matrix[f, near], matrix[f, far]


MIN_CACHED_DOFS = 300  # dofs above which the eigenproblem of the interior takes much longer than hashing the matrices

_last: "WeakKeyDictionary[Structure, tuple[bytes, CondensedStiffness]]" = WeakKeyDictionary()


def condensed_once(structure: Structure, retained: IntArray, load: HarmonicLoad) -> CondensedStiffness:
    """Prepare the exact condensation as `condense` does, or reuse the last one.

    It is reused if matrices and retained dofs are the same. A hash of the contents detects matrices that were changed
    in place.
    """
    if structure.n < MIN_CACHED_DOFS or load.static.size != structure.n:
        return condense(structure, retained, load)
    contents = _contents(structure, retained)
    known = _last.get(structure)
    if known is None or known[0] != contents:
        known = _last[structure] = contents, condense(structure, retained, load)
    return known[1].with_load(load)


def _contents(structure: Structure, retained: IntArray) -> bytes:
    digest = blake2b(np.asarray(retained, dtype=np.int64).tobytes())
    for matrix in (structure.mass, structure.damping, structure.stiffness, structure.loss):
        for own in _arrays(matrix):
            digest.update(own.tobytes())
    return digest.digest()


def _arrays(matrix: Matrix | None) -> tuple[np.ndarray, ...]:
    if matrix is None:
        return ()
    if scipy.sparse.issparse(matrix):
        plain = scipy.sparse.csr_array(matrix)
        return plain.data, plain.indices, plain.indptr
    return (np.asarray(matrix),)


ANY = 100  # harmonics for which a wheel with all wave numbers is set up


@dataclass(frozen=True, eq=False)
class Waves:
    """The waves of the harmonics; each is condensed at first use and cached.

    Parameters
    ----------
    structures
        Structures of the harmonics 0, 1, ...
    near, far
        Retained dofs and interior.
    feedback
        Aerodynamic force on each wave, whose frozen form is in the structures; empty: none.
    """

    structures: tuple[Structure, ...]
    near: IntArray
    far: IntArray
    feedback: tuple[Feedback | None, ...] = ()
    known: dict[tuple[int, bool], SolvedWave | ModalWave] = field(default_factory=dict)

    def of_harmonic(self, h: int) -> SolvedWave | ModalWave:
        """Return the wave of a harmonic."""
        if h >= len(self.structures):
            raise input_error(
                "TravellingStiffness",
                f"has waves for harmonics up to {len(self.structures) - 1}, asked for {h}",
                "Give tuned_wheel as many harmonics as the sweep's `high`.",
            )
        structure = self.structures[h]
        key = id(structure), h == 0
        if key not in self.known:
            self.known[key] = condense_wave(structure, self.near, self.far, mean=h == 0, feedback=self.force_on(h))
        return self.known[key]

    def force_on(self, h: int) -> Feedback | None:
        """Return the aerodynamic force on a harmonic, or None."""
        return self.feedback[h] if self.feedback else None

    def at(self, omega: float, harmonics: Sequence[int]) -> list[WaveAt]:
        """Return the waves of some harmonics at `omega` (rad/s); the mean has one frequency, zero."""
        return [self._mean if h == 0 else self.of_harmonic(h).at(h * omega) for h in harmonics]

    def with_mass_damping(self, rate: float) -> "Waves":
        """Return the same waves with `rate` (1/s) times their mass added to their damping; condensed waves are reused."""
        return _Damped(self.structures, self.near, self.far, self.feedback, plain=self, rate=rate)

    @cached_property
    def _mean(self) -> WaveAt:
        return self.of_harmonic(0).at(0.0)


@dataclass(frozen=True, eq=False)
class _Damped(Waves):
    plain: Waves | None = None
    rate: float = 0.0

    def of_harmonic(self, h: int) -> SolvedWave | ModalWave:
        plain: Waves = self.plain  # type: ignore[assignment]  # `Waves.with_mass_damping` gives it
        key = id(self.structures[h]), h == 0
        if key not in self.known:
            self.known[key] = plain.of_harmonic(h).with_mass_damping(self.rate)
        return self.known[key]


@dataclass(frozen=True, eq=False)
class TravellingStiffness:
    """The waves of a wheel and its load, condensed to the retained coordinates; build it with `condense_waves`.

    The mean of a real motion has the real part of the matrices. Aerodynamic coefficients that depend on the frequency
    are taken at the frequency of each harmonic; the mean has their frozen form.
    """

    waves: Waves
    load: HarmonicLoad

    @property
    def retained(self) -> IntArray:
        """Retained dofs, the unknowns."""
        return self.waves.near

    @property
    def interior(self) -> IntArray:
        """Condensed dofs."""
        return self.waves.far

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return int(self.retained.size)

    @cached_property
    def nn(self) -> Blocks:
        """Stiffness, damping and mass of the first harmonic on the retained coordinates, for scaling."""
        one = self.waves.structures[min(1, len(self.waves.structures) - 1)]
        own = np.ix_(self.retained, self.retained)
        k, c, m = (checked_matrix(one, name)[own] for name in ("stiffness", "damping", "mass"))
        return np.abs(k), np.abs(c), np.abs(m)

    @property
    def most(self) -> int:
        """Highest harmonic with a wave."""
        return len(self.waves.structures) - 1

    def load_at(self, _omega: float) -> HarmonicLoad:
        """Return the load, N, which is the same at all frequencies."""
        return self.load

    def with_load(self, load: HarmonicLoad) -> "TravellingStiffness":
        """Return the same waves under another load."""
        return replace(self, load=load)

    def with_mass_damping(self, rate: float) -> "TravellingStiffness":
        """Return the same waves with `rate` (1/s) times their mass added to their damping; the rate may be negative."""
        return replace(self, waves=self.waves.with_mass_damping(rate))

    def condensed(self, omega: float, order: int) -> Condensed:
        """Return stiffness, load and their ω-derivatives for harmonics 0..`order` at `omega` (rad/s)."""
        waves = self.at(omega, range(order + 1))
        h = np.arange(order + 1)
        slopes = np.array([wave.slope(np.eye(self.n)) for wave in waves])
        loads, load_slopes = self.loads(waves, range(order + 1))
        stiffness = np.array([wave.stiffness for wave in waves])
        return Condensed(stiffness, h[:, None, None] * slopes, loads, h[:, None] * load_slopes)

    def products(self, omega: float, harmonics: Harmonics) -> "CondensedWaves":
        """Return the condensed matrices as products, at `omega` (rad/s) and for `harmonics`."""
        return CondensedWaves(self, omega, harmonics)

    def at(self, omega: float, harmonics: Sequence[int]) -> list[WaveAt]:
        """Return the waves of some harmonics at `omega` (rad/s)."""
        return self.waves.at(omega, harmonics)

    def loads(self, waves: Sequence[WaveAt], harmonics: Sequence[int]) -> tuple[ComplexArray, ComplexArray]:
        """Return the condensed loads (k, n) of some harmonics and their derivatives by hω."""
        f = self.load.coefficients(harmonics[-1])
        found = [wave.load(f[h, self.retained], f[h, self.interior]) for wave, h in zip(waves, harmonics, strict=True)]
        return np.array([load for load, _ in found]), np.array([slope for _, slope in found])

    def recover(self, omega: float, q: ComplexArray) -> ComplexArray:
        """Return the (H+1, n_all) coefficients of every dof from those of the retained ones (H+1, n)."""
        return self._spread(omega, q, self.load.coefficients(q.shape[0] - 1))

    def recover_change(self, omega: float, dq: ComplexArray) -> ComplexArray:
        """Return the change of every dof (H+1, n_all) that a change `dq` of the retained coordinates causes."""
        all_dofs = self.retained.size + self.interior.size
        return self._spread(omega, dq, np.zeros((dq.shape[0], all_dofs), dtype=complex))

    def output_rows(self, omega: float, harmonic: int, dofs: IntArray) -> ComplexArray:
        """Return the (k, n) derivatives of `dofs` (k,) by the retained coordinates, in one harmonic."""
        (wave,) = self.at(omega, [harmonic])
        spread = np.zeros((self.n + self.interior.size, self.n), dtype=complex)
        spread[self.retained] = np.eye(self.n)
        spread[self.interior] = wave.inside(np.eye(self.n), np.zeros((self.interior.size, self.n)))
        return spread[dofs]

    def strain_energy(self, omega: float, q: ComplexArray) -> FloatArray:
        """Return the (H+1,) strain energy of a sector in each harmonic, mean over the period, J.

        Aerodynamic stiffness stores no energy.
        """
        twice = []
        for h, x in enumerate(self.recover(omega, q)):
            stiffness, force = self.waves.structures[h].stiffness, self.waves.force_on(h)
            if force is not None:
                stiffness = stiffness + force.stiffness()
            twice.append(np.vdot(x, (stiffness if h else stiffness.real) @ x).real)
        return np.asarray((0.25 + 0.25 * (np.arange(len(twice)) == 0)) * twice)

    def _spread(self, omega: float, q: ComplexArray, f: ComplexArray) -> ComplexArray:
        out = np.empty(f.shape, dtype=complex)
        out[:, self.retained] = q
        for h, wave in enumerate(self.at(omega, range(len(q)))):
            out[h, self.interior] = wave.inside(q[h], f[h, self.interior])
        return out


@dataclass(frozen=True, eq=False)
class CondensedWaves:
    """The condensed matrices of the waves at one frequency, as products with vectors."""

    linear: TravellingStiffness
    omega: float
    harmonics: Harmonics

    @cached_property
    def waves(self) -> list[WaveAt]:
        """Condensed wave of each harmonic."""
        return self.linear.at(self.omega, self.harmonics)

    @property
    def n(self) -> int:
        """Number of retained coordinates."""
        return self.linear.n

    @cached_property
    def _loads(self) -> tuple[ComplexArray, ComplexArray]:
        return self.linear.loads(self.waves, self.harmonics)

    @cached_property
    def load(self) -> FloatArray:
        """(m, n) load, N."""
        return to_real(self._loads[0])

    @cached_property
    def load_slope(self) -> FloatArray:
        """(m, n) derivative of the load by ω."""
        return to_real(np.array(self.harmonics)[:, None] * self._loads[1])

    def same(self, other: object) -> bool:
        """Whether `other` has the same dynamic stiffness; loads may differ."""
        return (
            isinstance(other, CondensedWaves)
            and self.omega == other.omega
            and self.harmonics == other.harmonics
            and self.linear.waves is other.linear.waves
        )

    def product(self, rows: FloatArray) -> FloatArray:
        """Return the rows of ``Z q`` for the `rows` of q."""
        return self._each(rows, lambda wave, q: wave.stiffness @ q)

    def transposed_product(self, rows: FloatArray) -> FloatArray:
        """Return the product of the `rows` with the transpose of the real form of Z, which is the real form of Zᴴ."""
        return self._each(rows, lambda wave, q: (q.conj() @ wave.stiffness).conj())

    def product_and_slope(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return ``Z q`` and ``∂Z/∂ω q``."""
        slope = [wave.slope(q) for wave, q in zip(self.waves, to_complex(rows), strict=True)]
        return self.product(rows), to_real(np.array(self.harmonics)[:, None] * np.array(slope))

    def block(self, harmonic: int) -> ComplexArray:
        """Return a copy of ``Z_h``, (n, n) complex in Fortran order."""
        return np.array(self.waves[self.harmonics.index(harmonic)].stiffness, order="F")

    def _each(self, rows: FloatArray, times: Callable[[WaveAt, ComplexArray], Array]) -> FloatArray:
        pairs = zip(self.waves, to_complex(rows), strict=True)
        return to_real(np.array([times(wave, q) for wave, q in pairs]))


def condense_side(side: LinearSide, retained: IntArray, load: HarmonicLoad, order: int) -> DynamicStiffness:
    """Prepare the exact condensation of a linear side, for harmonics up to `order`.

    An unreduced structure is not condensed (`keep_all`). If all harmonics have one real symmetric structure, `condense`
    needs only a few products per frequency; `condense_mistuned` serves a wheel of sectors, and `condense_waves` all
    other sides.
    """
    if isinstance(side, Unreduced) and side.n >= LEAST_SPARSE:
        return keep_all(side.structure, load)
    if isinstance(side, MistunedWheel) and by_sectors(side, retained):
        return condense_mistuned(side, retained, load)
    if isinstance(side, TunedWheel) and side.has_every_wave:
        order = max(order, ANY)  # each wave is condensed only when its harmonic is first needed
    structures = tuple(side.of_harmonic(h) for h in range(order + 1))
    feedback = tuple(side.feedback_of(h) for h in range(order + 1))
    one, still = structures[0], all(force is None for force in feedback)
    if still and all(s is one for s in structures) and is_real_symmetric(one):
        return condensed_once(one, retained, load)
    return condense_waves(structures, retained, load, () if still else feedback)


def condense_waves(
    structures: tuple[Structure, ...],
    retained: IntArray,
    load: HarmonicLoad,
    feedback: tuple[Feedback | None, ...] = (),
) -> TravellingStiffness:
    """Prepare the exact condensation of the waves of a tuned wheel.

    Parameters
    ----------
    structures
        The wave of each harmonic 0, 1, ...; the retained dofs mean the same in all.
    retained
        Dof indices that stay unknown.
    load
        Load on all dofs, each harmonic in the coordinates of its wave, N.
    feedback
        Aerodynamic force on each harmonic, whose frozen form is in the structures; empty: none.

    Raises
    ------
    InputError
        If sizes differ, or the load has more harmonics than there are waves.
    """
    n = structures[0].n
    if load.static.size != n or any(s.n != n for s in structures):
        sizes = sorted({s.n for s in structures})
        raise input_error(
            "condense_waves",
            f"a load of {load.static.size} entries for waves of {sizes} dofs",
            "Give the load in the coordinates of the waves (TunedWheel.project).",
        )
    top = max((h for h, f in load.harmonics.items() if np.any(f)), default=0)
    if top >= len(structures):
        raise input_error(
            "HarmonicLoad",
            f"excites harmonic {top}, and there are waves up to {len(structures) - 1}",
            "Give tuned_wheel more harmonics.",
        )
    retained = np.asarray(retained, dtype=np.int64)
    waves = Waves(structures, retained, np.setdiff1d(np.arange(n), retained), feedback)
    return TravellingStiffness(waves, load)
