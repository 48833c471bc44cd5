"""Dynamic stiffness of the waves of a wheel: complex, unsymmetric matrices for each temporal harmonic.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, section 3 and appendices 1, 2 and 5.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import blake2b
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.harmonic.dynamic_stiffness import Condensed, CondensedStiffness, condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import Harmonics, to_complex, to_real
from stickslip.harmonic.linear import DynamicStiffness, LinearSide
from stickslip.harmonic.matrices import checked_matrix, is_real_symmetric
from stickslip.harmonic.mistuned import by_sectors, condense_mistuned
from stickslip.harmonic.sparse_stiffness import LEAST_SPARSE, Unreduced, keep_all
from stickslip.harmonic.spectral import Blocks
from stickslip.harmonic.wave_condensation import Array, ModalWave, SolvedWave, WaveAt, condense_wave
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback
from stickslip.reduction.mistuned import MistunedWheel
from stickslip.reduction.tuned import TunedWheel

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
