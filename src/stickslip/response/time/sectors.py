"""All sectors of a tuned wheel in time: each sector is integrated, since only harmonics have waves.

The coordinates and gaps of a tuned wheel have the same meaning in every wave. The motion of sector s is the sum of its
waves, ``y_s = Σ_k exp(2πi k s / n_s) y_k``, and the matrices between sectors are discrete Fourier transforms of the
waves' matrices. If the engine order m and the number of sectors n_s have the greatest common divisor g, the motion
repeats after n_s/g sectors, which represent all. Aerodynamic forces enter in their frozen form, with real matrices for
the whole wheel.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import gcd

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, Matrix, as_array
from stickslip.contact.interface import Interface
from stickslip.errors import input_error
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import to_real
from stickslip.harmonic.linear import one_structure
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.reduction.tuned import TunedWheel
from stickslip.reduction.waves import excited_wave
from stickslip.response.system import System

REAL = 1e-8  # imaginary part over the largest entry, below which it is rounding


@dataclass(frozen=True, eq=False)
class WaveMotion:
    """Travelling motion: all sectors move alike with time shifts of T/n.

    Parameters
    ----------
    sectors
        Number n of sectors, and of shares of the period T.
    ahead
        After T/n a sector has the present state of the sector `ahead` places further on.
    """

    sectors: int
    ahead: int

    def shifted(self, rows: Matrix) -> Matrix:
        """Return (sectors · p, ...) rows, sector by sector, shifted to the represented sectors."""
        parts = np.asarray(rows).reshape(self.sectors, -1, *np.shape(rows)[1:])
        return np.roll(parts, self.ahead, axis=0).reshape(np.shape(rows))


@dataclass(frozen=True, eq=False)
class SectorsInTime:
    """Tuned wheel for `integrate` and `shoot`; `all_sectors` makes one.

    Parameters
    ----------
    structure, contacts, load
        Structure, contacts and load of all sectors in sequence. Dofs of sector 0 have the same numbers as in the wheel.
    motion
        Symmetry of the travelling motion.
    wheel
        The tuned wheel, described by one sector.
    """

    structure: Structure
    contacts: Interface
    load: HarmonicLoad
    motion: WaveMotion
    wheel: TunedWheel

    def spread(self, coefficients: ComplexArray) -> ComplexArray:
        """Return the (H + 1, sectors · n) amplitudes of all sectors from the wheel's harmonics (H + 1, n).

        Harmonics whose waves travel against the wave of the matrices are omitted: their modal coordinates may differ.
        """
        rows = []
        for h, row in enumerate(coefficients[:, : _kept(self.wheel)]):
            kept = h <= self.wheel.harmonics and _agrees(self.wheel, h)
            moved = row if kept else np.zeros_like(row)
            rows.append(_travelling(self.wheel, h, moved, self.count))
        return np.array(rows)

    def travelling(self, rows: ComplexArray) -> ComplexArray:
        """Return the (H + 1, sectors · p) amplitudes of quantities (H + 1, p) in all sectors.

        The quantities have the same meaning in every wave, as gaps do.
        """
        return np.array([_travelling(self.wheel, h, r, self.count) for h, r in enumerate(rows)])

    @property
    def count(self) -> int:
        """Number of integrated sectors; without `every` only the representatives."""
        return self.structure.n // _kept(self.wheel)


def all_sectors(system: System, load: HarmonicLoad, *, every: bool = False) -> SectorsInTime:
    """Return the wheel of all sectors of a system with a tuned wheel.

    Parameters
    ----------
    system
        System with a `TunedWheel` whose waves reach half the number of distinct sectors.
    load
        Loads on the coordinates of its harmonics.
    every
        Whether to include all sectors, with independent motions, and not only the distinct ones under the engine order.
        The wheel then needs all its waves (`TunedWheel.has_every_wave`).

    Raises
    ------
    InputError
        If waves are missing, their matrices allow no equations in time, or the load drives a wave that travels against
        another one.
    """
    wheel, interface = system.structure.wheel, system.interface
    if wheel is None:
        raise input_error("all_sectors", "got no tuned wheel", "Integrate its one structure.")
    alike = different_sectors(wheel)
    sectors, common = (wheel.sectors, 1) if every else alike
    own = _kept(wheel)
    loads: dict[int, ComplexArray] = {}
    for h, amplitude in load.harmonics.items():
        if not _agrees(wheel, h):
            raise input_error(
                "all_sectors",
                f"harmonic {h} of the load drives a wave that turns against another one of its wave number",
                "Leave gyroscopic terms out, or the load.",
            )
        loads[h] = _travelling(wheel, h, amplitude[:own], sectors)
    waves = [_wave(wheel, common * k) for k in range(sectors)]
    weights = None if interface.weights is None else np.tile(interface.weights, sectors)
    gaps = _circulant([as_array(interface.gap_operator) @ own_motions(w, wheel.multipliers) for w in waves])
    turns = sectors > 1 and alike == (sectors, common)
    motion = WaveMotion(1, 0)
    if turns:
        step = pow(wheel.engine_order // common % sectors, -1, sectors)
        motion = WaveMotion(sectors, step)
    static = np.tile(load.static[:own], sectors)
    structure = Structure(
        _circulant([as_array(w.mass)[:own, :own] for w in waves]),
        _circulant([as_array(w.damping)[:own, :own] for w in waves]),
        _circulant([as_array(w.stiffness)[:own, :own] for w in waves]),
        _dofs(wheel.dofs.take(np.arange(own)), sectors),
        loss=None if waves[0].loss is None else _circulant([as_array(w.loss)[:own, :own] for w in waves]),
    )
    names = tuple(f"sector{s}.{name}" for s in range(sectors) for name in interface.names)
    contacts = Interface(names, interface.laws * sectors, gaps, weights)
    return SectorsInTime(structure, contacts, HarmonicLoad(static, loads), motion, wheel)


@lru_cache(maxsize=1)  # needed for each examined point
def whole_wheel(system: System) -> SectorsInTime:
    """Return all sectors of an unloaded tuned wheel with every wave, with independent motions of the sectors."""
    still = HarmonicLoad(np.zeros(system.structure.n))
    return all_sectors(system, still, every=True)


@dataclass(frozen=True, eq=False)
class InTime:
    """Structure and gaps of a periodic motion, to compute its disturbances; `all_in_time` makes one.

    Parameters
    ----------
    structure, contacts
        One structure, or all sectors of a wheel.
    gaps
        (2H+1, 3 n_contacts) real coefficients of the gaps of the motion, m.
    sectors
        Number of sectors; 1 for a single structure.
    shares, ahead
        After a period over `shares`, each sector has the present state of the sector `ahead` places further on.
    """

    structure: Structure
    contacts: Interface
    gaps: FloatArray
    sectors: int = 1
    shares: int = 1
    ahead: int = 0

    def shifted(self, rows: Matrix) -> Matrix:
        """Return (sectors · p, ...) rows, sector by sector, shifted by a share of the period."""
        return WaveMotion(self.sectors, self.ahead).shifted(rows)


def all_in_time(system: System, gaps: ComplexArray) -> InTime:
    """Return the structure to integrate in time, and the gaps of a motion on it.

    Parameters
    ----------
    system
        System; for a wheel with every wave (`TunedWheel.has_every_wave`), all sectors are included.
    gaps
        (H+1, 3 n_contacts) complex coefficients, m.
    """
    wheel = system.structure.wheel
    if wheel is None:
        return InTime(one_structure(system.structure, "stability"), system.interface, to_real(gaps))
    whole = whole_wheel(system)
    shares, common = different_sectors(wheel)
    ahead = pow(wheel.engine_order // common % shares, -1, shares) if shares > 1 else 0
    return InTime(whole.structure, whole.contacts, to_real(whole.travelling(gaps)), wheel.sectors, shares, ahead)


def different_sectors(wheel: TunedWheel) -> tuple[int, int]:
    """Return the number of sectors with distinct motions.

    The second result is the greatest common divisor of engine order and number of sectors.
    """
    common = gcd(wheel.engine_order, wheel.sectors)
    return wheel.sectors // common, common


def sectors_in_time(system: System) -> int:
    """Return the number of sectors in time.

    These are all of a tuned wheel with every wave, the distinct ones of other tuned wheels, otherwise 1.
    """
    wheel = system.structure.wheel
    if wheel is None:
        return 1
    return wheel.sectors if wheel.has_every_wave else different_sectors(wheel)[0]


def _kept(wheel: TunedWheel) -> int:
    """Return the number of a sector's own coordinates.

    Copies of neighbours' coordinates and their constraints follow these.
    """
    return wheel.n - 2 * wheel.multipliers.size


def _travelling(wheel: TunedWheel, harmonic: int, row: Matrix, sectors: int) -> ComplexArray:
    """Return a row (n,) of a harmonic, given for sector 0, for `sectors` sectors."""
    k = excited_wave(wheel.engine_order, wheel.sectors, harmonic)
    phases = np.exp(2j * np.pi * k * np.arange(sectors) / wheel.sectors)
    return np.asarray((phases[:, None] * row).ravel())


def _wave(wheel: TunedWheel, k: int) -> Structure:
    """Return the structure of a wave number, or the conjugate for the opposite direction.

    The one with the lower harmonic is used.
    """
    chosen = _chosen(wheel.waves, k % wheel.sectors, wheel)
    structure = wheel.waves[chosen]
    return structure if chosen == k % wheel.sectors else _conjugate(structure)


def _chosen(waves: Mapping[int, Structure], k: int, wheel: TunedWheel) -> int:
    """Return k or the wave number of the opposite direction, whichever belongs to the lower harmonic."""
    excited = (excited_wave(wheel.engine_order, wheel.sectors, h) for h in range(wheel.harmonics + 1))
    for found in (*excited, *sorted(waves)):
        if found in waves and found in (k, (wheel.sectors - k) % wheel.sectors):
            return found
    raise input_error(
        "all_sectors",
        f"the wheel has no wave {k}: it was made for harmonics up to {wheel.harmonics}",
        f"Give tuned_wheel {different_sectors(wheel)[0] // 2} harmonics.",
    )


def _agrees(wheel: TunedWheel, harmonic: int) -> bool:
    """Whether a harmonic's wave is the wave of the matrices, or its conjugate."""
    k = excited_wave(wheel.engine_order, wheel.sectors, harmonic)
    chosen = _chosen(wheel.waves, k, wheel)
    if chosen == k:
        return True
    own, other = (as_array(wheel.waves[number].stiffness) for number in (k, chosen))
    return bool(np.allclose(own, np.conj(other), rtol=0, atol=REAL * np.abs(own).max()))


def _conjugate(own: Structure) -> Structure:
    mass, damping, stiffness = (np.conj(as_array(m)) for m in (own.mass, own.damping, own.stiffness))
    loss = None if own.loss is None else np.conj(as_array(own.loss))
    return Structure(mass, damping, stiffness, own.dofs, loss=loss)


def _circulant(waves: list[Matrix]) -> FloatArray:
    """Return the (n p, n q) matrix of n sectors from the (p, q) matrices of their waves."""
    parts = np.fft.ifft(np.array([as_array(w) for w in waves]), axis=0)
    if np.abs(parts.imag).max(initial=0.0) > REAL * np.abs(parts).max(initial=0.0):
        raise input_error("all_sectors", "the waves are those of no real matrices", "Give waves of a real sector.")
    n = len(parts)
    return np.block([[parts[(row - column) % n].real for column in range(n)] for row in range(n)])


def _dofs(own: Dofs, sectors: int) -> Dofs:
    """Return the coordinates of all sectors."""
    named = own.part or ("",) * len(own.component)
    parts = [f"sector{s}.{part}" if part else f"sector{s}" for s in range(sectors) for part in named]
    return Dofs(np.tile(own.node, sectors), own.component * sectors, np.tile(own.position, (sectors, 1)), tuple(parts))
