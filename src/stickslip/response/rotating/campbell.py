"""Campbell diagram: natural frequencies over rotor speed, tracked by mode shape, and their engine-order crossings.

A wheel has one for each travelling wave: an engine order meets only modes of the wave that it excites.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import cast

import numpy as np
import scipy.optimize

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.modes import gyroscopic_modes, natural_frequencies, normal_modes, with_springs
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates
from stickslip.reduction.contact_coordinates import own_motions
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.speed_line import SpeedLine
from stickslip.reduction.waves import excited_wave
from stickslip.response.system import System
from stickslip.units import HZ

CLEAR = 0.7  # modal assurance below which a step in speed is halved
HALVINGS = 5  # of a step: a veering narrower than a thirtieth of it counts as a crossing
SPARE = 4  # additional modes, so that a tracked mode may leave the lowest ones
NEARNESS = 1e-3  # weight of a relative step in frequency against the assurance: it decides between equal shapes
# relative distance up to which frequencies are equal and their shapes span a space: equal blades, pairs of a wheel
EQUAL_FREQUENCY_RTOL = 1e-6

StructureAt = Callable[[float], Structure]


@dataclass(frozen=True)
class Crossing:
    """Speed at which an engine order meets a natural frequency.

    Parameters
    ----------
    engine_order
        Oscillations per revolution.
    mode
        Column of `Campbell.frequencies_hz`, from 0.
    speed
        Rotor speed, rad/s.
    frequency_hz
        ``engine_order * speed / (2π)``.
    """

    engine_order: int
    mode: int
    speed: float
    frequency_hz: float


@dataclass(frozen=True, eq=False)
class Campbell:
    """Natural frequencies over speed; each column is a mode tracked by its shape.

    Parameters
    ----------
    speeds
        (s,) ascending rotor speeds, rad/s.
    frequencies_hz
        (s, n_modes) in the rotating frame; columns in the order of the first speed. Negative where a motion diverges
        instead of vibrating.
    agreement
        (s, n_modes) smallest modal assurance (1: same shape) since the previous speed; ones at the first speed.
    engine_orders
        Engine orders of the crossings.
    crossings
        Crossings by engine order, then by speed.
    wave_number, sectors
        Wave number of the structure and number of sectors; 0 and 1 for a structure that is not cyclic.
    """

    speeds: FloatArray
    frequencies_hz: FloatArray
    agreement: FloatArray
    engine_orders: tuple[int, ...]
    crossings: tuple[Crossing, ...]
    wave_number: int = 0
    sectors: int = 1

    @property
    def nodal_diameter(self) -> int:
        """Nodal diameter, between 0 and half the number of sectors."""
        return min(self.wave_number, self.sectors - self.wave_number)

    @property
    def stationary_hz(self) -> FloatArray:
        """(s, n_modes) frequencies in the stationary frame, Hz.

        They are ``|f - kΩ/2π|`` for backward waves, and ``f + kΩ/2π`` for forward ones.

        A backward wave slower than the rotation runs forward in this frame.
        """
        k = self.wave_number if 2 * self.wave_number <= self.sectors else self.wave_number - self.sectors
        return np.abs(self.frequencies_hz - k * self.speeds[:, None] / HZ)

    def engine_order_hz(self, engine_order: int) -> FloatArray:
        """Return the (s,) frequencies of an engine order."""
        return engine_order * self.speeds / HZ


@dataclass(frozen=True, eq=False)
class _Spectrum:
    """Frequencies and comparable shapes at one speed."""

    speed: float
    hertz: FloatArray  # (c,)
    shapes: FloatArray | ComplexArray  # (n, c)
    weighted: FloatArray | ComplexArray  # (n, c), shapes times the mass
    agreement: FloatArray  # (c,)

    def take(self, index: IntArray, agreement: FloatArray) -> "_Spectrum":
        return _Spectrum(self.speed, self.hertz[index], self.shapes[:, index], self.weighted[:, index], agreement)


@dataclass(eq=False)
class _Speeds:
    """Spectra of a structure over speed, each computed once."""

    structure_at: StructureAt
    n_modes: int
    coriolis: bool
    known: dict[float, _Spectrum] = field(default_factory=dict)

    def at(self, speed: float) -> _Spectrum:
        if speed not in self.known:
            self.known[speed] = _spectrum(self.structure_at(speed), speed, self.n_modes, self.coriolis)
        return self.known[speed]

    def forget(self, below: float) -> None:
        """Drop spectra below a speed: shapes of large models take much memory."""
        for speed in [s for s in self.known if s < below]:
            del self.known[speed]


def campbell(
    structure_at: StructureAt,
    speeds: Sequence[float] | FloatArray,
    n_modes: int,
    engine_orders: Sequence[int] = (),
    *,
    coriolis: bool = False,
    tolerance: float = 1e-6,
    progress: Callable[[float], None] | None = None,
) -> Campbell:
    """Track the lowest modes of a structure over rotor speed and find their crossings with engine orders.

    Parameters
    ----------
    structure_at
        Function of the speed, rad/s, that returns the structure in the rotating frame, with centrifugal stiffening and
        spin softening where they matter. Coordinates must be the same at all speeds, or the structures must expand to
        the same full model.
    speeds
        Ascending speeds, rad/s. A crossing is found if the sign of frequency minus engine-order frequency changes from
        one to the next.
    n_modes
        Number of modes, counted at the first speed.
    engine_orders
        Positive engine orders.
    coriolis
        Whether to include the skew part of the structure's damping (`gyroscopic_modes`). Dissipation is never included.
    tolerance
        Relative tolerance of the speed of a crossing.
    progress
        Function called with each finished speed.

    Returns
    -------
    Campbell
        A step with a large change of a shape, or with an exchange of two modes, is halved up to five times: veering
        modes keep their order, crossing modes keep their shapes. `agreement` shows the remaining doubt.

    Raises
    ------
    InputError
        If speeds do not ascend, or a number is invalid.
    """
    speeds = _checked(speeds, n_modes, engine_orders)
    family = _Speeds(structure_at, n_modes, coriolis)
    first = family.at(float(speeds[0]))
    if first.hertz.size < n_modes:
        raise input_error("campbell: n_modes", f"{n_modes} of a structure with {first.hertz.size}", "Ask for fewer.")
    here = first.take(np.arange(n_modes), np.ones(n_modes))
    rows: list[_Spectrum] = [_without_shapes(here)]
    crossings = _crossings_at(here, engine_orders)
    for speed in speeds[1:]:
        after = _follow(family, here, float(speed), HALVINGS)
        crossings += _crossings(family, here, after, engine_orders, tolerance)
        here = after
        rows.append(_without_shapes(here))
        family.forget(here.speed)
        if progress is not None:
            progress(here.speed)
    return Campbell(
        speeds,
        np.array([row.hertz for row in rows]),
        np.array([row.agreement for row in rows]),
        tuple(engine_orders),
        tuple(sorted(crossings, key=lambda c: (c.engine_order, c.speed))),
    )


def _checked(speeds: Sequence[float] | FloatArray, n_modes: int, engine_orders: Sequence[int]) -> FloatArray:
    values = np.asarray(speeds, dtype=float)
    if (
        values.ndim != 1
        or not values.size
        or not np.all(np.isfinite(values))
        or values[0] < 0
        or np.any(np.diff(values) <= 0)
    ):
        raise input_error(
            "campbell: speeds",
            f"must ascend from 0 or more, got {values[:6].tolist() if values.ndim else values}",
            "Give rad/s.",
        )
    if n_modes < 1:
        raise input_error("campbell: n_modes", f"must be positive, got {n_modes}", "Ask for one.")
    wrong = [m for m in engine_orders if m < 1 or m != int(m)]
    if wrong:
        raise input_error(
            "campbell: engine_orders",
            f"must be positive whole numbers, got {wrong[0]}",
            "The static load is order 0 and excites nothing.",
        )
    return values


def _spectrum(structure: Structure, speed: float, n_modes: int, coriolis: bool) -> _Spectrum:
    count = min(n_modes + SPARE, int(np.count_nonzero(structure.mass.diagonal())))
    if coriolis:
        modes = gyroscopic_modes(structure, count)
        hertz = modes.frequencies_hz
        shapes: FloatArray | ComplexArray = modes.shapes
    else:
        at_rest = normal_modes(structure, count)
        hertz, shapes = at_rest.frequencies_hz, at_rest.shapes
    # reduced coordinates may differ between two speeds, coordinates of the full model do not
    whole = structure.expand(shapes)
    weighted = structure.mass @ shapes if structure.basis is None else whole
    return _Spectrum(speed, hertz, whole, weighted, np.ones(hertz.size))


def _without_shapes(spectrum: _Spectrum) -> _Spectrum:
    empty = np.zeros((0, spectrum.hertz.size), dtype=complex)
    return _Spectrum(spectrum.speed, spectrum.hertz, empty, empty, spectrum.agreement)


def _assurance(before: _Spectrum, after: _Spectrum) -> FloatArray:
    """Return the modal assurance of all pairs of shapes."""
    cross = before.weighted.conj().T @ after.shapes
    own = np.sum(before.weighted.conj() * before.shapes, axis=0).real
    other = np.sum(after.weighted.conj() * after.shapes, axis=0).real
    return np.asarray(np.abs(cross) ** 2 / np.outer(own, other))


def _matched(before: _Spectrum, after: _Spectrum) -> _Spectrum:
    """Return the modes `after` that continue the modes `before`, in the same order."""
    assurance = _assurance(before, after)
    distance = np.abs(before.hertz[:, None] - after.hertz)
    total = np.abs(before.hertz[:, None]) + np.abs(after.hertz)
    step = distance / np.where(total > 0.0, total, 1.0)
    _, chosen = scipy.optimize.linear_sum_assignment(NEARNESS * step - assurance)
    # shapes of equal frequencies are arbitrary within their space: the share in the whole space counts
    spread = np.sum(assurance * _equal(after.hertz[chosen], after.hertz), axis=1)
    gathered = np.diagonal(_equal(before.hertz, before.hertz) @ assurance[:, chosen])
    return after.take(chosen, np.minimum(np.maximum(spread, gathered), 1.0))


def _equal(one: FloatArray, other: FloatArray) -> BoolArray:
    return np.abs(one[:, None] - other) <= EQUAL_FREQUENCY_RTOL * (np.abs(one[:, None]) + np.abs(other))


def _follow(family: _Speeds, before: _Spectrum, speed: float, halvings: int) -> _Spectrum:
    """Track the modes `before` to another speed, with intermediate speeds where shapes or the order of modes change."""
    matched = _matched(before, family.at(speed))
    clear = np.all(matched.agreement >= CLEAR) and not _exchanged(before.hertz, matched.hertz)
    if halvings == 0 or clear:
        return matched
    between = _follow(family, before, 0.5 * (before.speed + speed), halvings - 1)
    after = _follow(family, between, speed, halvings - 1)
    least = np.minimum(between.agreement, after.agreement)
    return after.take(np.arange(least.size), least)


def _exchanged(before: FloatArray, after: FloatArray) -> bool:
    """Whether two modes seem to have crossed: with a long step, a veering looks the same."""
    gaps = [np.where(_equal(f, f), 0.0, f[:, None] - f) for f in (before, after)]
    return bool(np.any(gaps[0] * gaps[1] < 0.0))


def _crossings_at(here: _Spectrum, engine_orders: Sequence[int]) -> list[Crossing]:
    """Return the crossings exactly at the first speed."""
    return [
        Crossing(int(order), int(mode), here.speed, float(here.hertz[mode]))
        for order in engine_orders
        for mode in np.flatnonzero(here.hertz == order * here.speed / HZ)
        if here.speed > 0.0
    ]


def _crossings(
    family: _Speeds, before: _Spectrum, after: _Spectrum, engine_orders: Sequence[int], tolerance: float
) -> list[Crossing]:
    """Return the crossings in the interval between two speeds, its end included."""
    found = []
    for order in engine_orders:
        low, high = (s.hertz - order * s.speed / HZ for s in (before, after))
        for mode in np.flatnonzero((low * high < 0) | ((high == 0.0) & (low != 0.0))):
            speed = _crossing_speed(family, before, after, order, int(mode), tolerance)
            found.append(Crossing(int(order), int(mode), speed, order * speed / HZ))
    return found


def _crossing_speed(
    family: _Speeds, before: _Spectrum, after: _Spectrum, order: int, mode: int, tolerance: float
) -> float:
    def distance(speed: float) -> float:
        followed = _follow(family, before, speed, HALVINGS)
        return float(followed.hertz[mode] - order * speed / (2 * math.pi))

    # relative to the crossing, which may lie far below the end of the interval
    least = float(np.finfo(float).eps)
    rtol, xtol = max(tolerance, 4 * least), least * after.speed
    return float(scipy.optimize.brentq(distance, before.speed, after.speed, xtol=xtol, rtol=rtol))


def cyclic_campbell(
    sector_at: Callable[[float], CyclicSector],
    speeds: Sequence[float] | FloatArray,
    n_modes: int,
    engine_orders: Sequence[int],
    *,
    wave_numbers: Sequence[int] | None = None,
    coriolis: bool = False,
    tolerance: float = 1e-6,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[Campbell, ...]:
    """Track the modes of a wheel over rotor speed, wave by wave.

    Parameters
    ----------
    sector_at
        Function of the speed, rad/s, that returns the sector. It is called for each wave and speed, so it should cache
        expensive results.
    speeds
        Ascending speeds, rad/s.
    n_modes
        Number of modes of each wave.
    engine_orders
        Positive engine orders. On n_s equal sectors, engine order m excites wave number ``m mod n_s`` and has crossings
        in its diagram only.
    wave_numbers
        Wave numbers of the diagrams; None: the ones excited by the engine orders. Without Coriolis forces, waves k and
        n_s - k have the same frequencies and one diagram, with the smaller number.
    coriolis, tolerance
        As in `campbell`.
    progress
        Function called with wave number and speed.

    Returns
    -------
    tuple of Campbell
        Diagrams by wave number.

    Raises
    ------
    InputError
        If a wave number is not between 0 and n_s - 1, or `campbell` refuses its arguments.
    """
    sectors = sector_at(float(speeds[0])).sectors

    def name(wave: int) -> int:
        return wave if coriolis else min(wave, sectors - wave)

    by_order = {m: name(excited_wave(m, sectors)) for m in engine_orders}
    asked = by_order.values() if wave_numbers is None else wave_numbers
    wrong = [k for k in asked if not 0 <= k < sectors]
    if wrong:
        raise input_error(
            "cyclic_campbell: wave_numbers",
            f"must be from 0 to {sectors - 1}, got {wrong[0]}",
            "A forward wave of d nodal diameters has the number of sectors minus d.",
        )
    diagrams = []
    for wave in sorted({name(k) for k in asked}):
        found = campbell(
            partial(_wave_at, sector_at, wave),
            speeds,
            n_modes,
            [m for m, own in by_order.items() if own == wave],
            coriolis=coriolis,
            tolerance=tolerance,
            progress=None if progress is None else partial(progress, wave),
        )
        diagrams.append(replace(found, wave_number=wave, sectors=sectors))
    return tuple(diagrams)


def _wave_at(sector_at: Callable[[float], CyclicSector], wave: int, speed: float) -> Structure:
    return travelling_wave(sector_at(speed), wave)


def stiffening_of(
    structure: Structure, hertz: FloatArray, vectors: Matrix, by_square: Matrix, speed: float, *, turning: bool
) -> FloatArray:
    """Return the (m,) derivatives of ω² by Ω², from ``φᴴ (K + iωD − ω²M) φ = 0``; changes of φ are of second order.

    Parameters
    ----------
    structure
        The structure at the speed.
    hertz, vectors
        (m,) natural frequencies, Hz, and (n, m) shapes.
    by_square
        Derivative of the stiffness by Ω² on the dofs of all parts, N s²/m: cyclic faces, joins and springs do not change.
    speed
        Ω, rad/s, above zero.
    turning
        Whether Coriolis forces act. They grow with Ω; the real part of the damping dissipates, and does not count.
    """
    by_x = _form(by_square, structure.expand(vectors))
    mass, omega = _form(structure.mass, vectors), 2 * np.pi * hertz
    if not turning:
        return np.asarray((by_x / mass).real)
    coriolis = -_form(structure.damping, vectors).imag
    by_omega = 2 * omega * mass - coriolis
    return np.asarray((2 * omega * (by_x + omega * coriolis / (2 * speed**2)) / by_omega).real)


def _form(matrix: Matrix, vectors: Matrix) -> ComplexArray:
    """Return ``φᴴ A φ`` of each column."""
    return np.asarray(np.sum(vectors.conj() * (matrix @ vectors), axis=0), dtype=complex)


def frequencies_along(system: System, speeds: FloatArray, n_modes: int, *, stuck: bool, coriolis: bool) -> FloatArray:
    """Return (s, n_modes) natural frequencies along an engine order, Hz; NaN for missing modes.

    Parameters
    ----------
    system
        The system along the engine order.
    speeds
        (s,) in rad/s.
    n_modes
        Number of modes.
    stuck
        Whether all contacts stick, instead of being open.
    coriolis
        Whether the damping holds Coriolis forces.
    """
    line = cast("SpeedLine", system.structure)
    found = np.full((len(speeds), n_modes), np.nan)
    for i, speed in enumerate(speeds):
        structure = line.at(float(speed)).of_harmonic(1)
        if stuck:
            structure = with_springs(structure, system.interface.gap_operator, system.springs.stuck_stiffness())
        way = own_motions(structure, line.multipliers)  # what its constraints allow
        structure = in_coordinates(structure, way, structure.dofs.take(np.arange(way.shape[1])), {})
        count = min(n_modes, structure.n)
        own = gyroscopic_modes(structure, count).frequencies_hz if coriolis else natural_frequencies(structure, count)
        found[i, : len(own)] = own
    return found
