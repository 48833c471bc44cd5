"""Modes in a frequency range: damping without friction, largest damping by friction, and the parts that move.

Each contact law is replaced by its Coulomb limit. A slipping contact is a spring with the complex stiffness ``k η(x)``,
with the same slip ratio x for all contacts: the gap amplitude over the amplitude at the onset of slip. From stuck (x =
1) to sliding (x large), each mode is tracked by its shape. The result is an estimate, no bound: for chains of masses
with constant normal loads it was right within a factor of 1.5. Coriolis forces are included.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import pressed_by
from stickslip.response.self_excited.modes import StuckMode, sprung_modes
from stickslip.response.system import System
from stickslip.units import HZ

UNDAMPED_RATIO = 1e-5  # damping ratio below which a mode is undamped
SPANNED = 60  # coordinates up to which all eigenvalues are computed
UNDRIVEN = 1e-9  # modal force over the norms of force and shape, below which the load acts at a node
FIRST_MODES = 4  # initial number of modes; doubled until they exceed the range
ALONE = 0.99  # share of the strain energy in contact springs, and of the kinetic energy in one part
TRAVEL_M = 1e6  # amplitude of a cycle with full slip in every slider, also for dimensionless models
SAMPLES = 256  # of the cycle, for sampled laws
ROUNDING = 1e-13  # slip limit over the force of a parallel spring, below which it is rounding
SLIP_RATIOS = np.geomspace(1.0, 1e4, 20)  # amplitude over the amplitude at the onset of slip
BEYOND = 1.3  # highest frequency of the modes in the basis, over the highest of the range
INDEPENDENT = 1e-10  # smallest relative eigenvalue of independent basis motions
SMALLEST_DAMPING = 1e-4  # smallest reported damping ratio by friction


@dataclass(frozen=True, eq=False)
class Friction:
    """Friction of contacts under their static loads.

    Attributes
    ----------
    limits
        (n_contacts, 2) slip force along t and w, N: a quarter of the dissipation in a long cycle over its amplitude.
    variable
        (n_contacts,) whether the limit changes with the normal gap.
    """

    limits: FloatArray
    variable: BoolArray

    @property
    def slips(self) -> BoolArray:
        """(3 n_contacts,) directions t, w, n in which contacts slip."""
        along = np.zeros((len(self.limits), 3), dtype=bool)
        along[:, :2] = self.limits > 0.0
        return along.reshape(-1)

    @property
    def any(self) -> bool:
        """Whether any contact slips at all."""
        return bool(np.any(self.limits > 0.0))


def friction_of(interface: Interface, static_gap: FloatArray, static_force: FloatArray) -> Friction:
    """Return the friction of contacts at static gaps (n_contacts, 3), m, under static forces (n_contacts, 3), N.

    Each law is evaluated over a cycle of large amplitude in t and then in w, with its static normal gap. The
    dissipation is four times the slip force times the amplitude. Springs without slip, and open contacts, have no
    limit.
    """
    n = interface.n_contacts
    compiled = interface.compiled()
    limits = np.zeros((n, 2))
    for axis in range(2):
        cycle = np.zeros((3, n, 3))
        cycle[0] = static_gap
        cycle[1, :, axis] = TRAVEL_M
        force = contact_forces(cycle.reshape(3, -1), compiled, SAMPLES).coefficients.reshape(3, n, 3)
        work = np.pi * TRAVEL_M * force[2, :, axis]
        size = np.linalg.norm(force[1:, :, axis], axis=0)
        limit = np.abs(work) / (4.0 * TRAVEL_M)
        limits[:, axis] = np.where(limit > ROUNDING * size, limit, 0.0)
    follows = np.array([hasattr(law, "mu") and law.stuck_stiffness()[2] > 0 for law in interface.laws], dtype=bool)
    pressed = static_force[:, 2] < 0.0
    return Friction(limits, np.asarray(follows & pressed, dtype=bool))


@dataclass(frozen=True)
class Range:
    """Range of excitation frequencies, rad/s."""

    lowest: float
    highest: float

    def holds(self, omega: float) -> bool:
        """Whether an excitation frequency lies within the range."""
        return self.lowest <= omega <= self.highest

    @property
    def middle(self) -> float:
        """Mean of both ends, rad/s."""
        return 0.5 * (self.lowest + self.highest)


@dataclass(frozen=True, eq=False)
class RangeMode:
    """Mode that a harmonic of the load meets within the range.

    Attributes
    ----------
    harmonic
        Harmonic of the load.
    number
        Number of the mode, from 1.
    omega
        Excitation frequency at which this harmonic meets the mode, rad/s.
    ratio
        Damping ratio without friction.
    force
        Modal force of the harmonic, N for unit modal mass; 0 where the load acts at a node of the mode.
    gaps
        (n_contacts, 3) motion of the contacts at unit modal mass.
    strain
        Share of the strain energy in contact springs.
    part, kinetic
        Part with the largest kinetic energy, and its share of the total.
    """

    harmonic: int
    number: int
    omega: float
    ratio: float
    force: float
    gaps: ComplexArray
    strain: float
    part: str
    kinetic: float

    @property
    def undamped(self) -> bool:
        """Whether the load drives the mode and it has no damping without slip."""
        return self.force > 0.0 and self.ratio < UNDAMPED_RATIO

    @property
    def resonance(self) -> float:
        """Modal amplitude at the resonance of the mode, m √kg, with at least the damping ratio `UNDAMPED_RATIO`."""
        return self.force / (2.0 * (self.harmonic * self.omega) ** 2 * max(self.ratio, UNDAMPED_RATIO))

    @property
    def hz(self) -> float:
        """Frequency of the excitation, Hz."""
        return self.omega / HZ

    @property
    def on_contacts(self) -> bool:
        """Whether only one part moves, as a rigid body on its contact springs."""
        return self.strain > ALONE and self.kinetic > ALONE

    def excess(self, friction: Friction) -> float:
        """Return the modal force over 4/π times the modal Coulomb limit.

        Above 1, friction alone cannot bound the resonance.

        It is infinite without friction, and zero if the limit grows with the normal motion of the mode.
        """
        size, along = np.abs(self.gaps), np.abs(self.gaps[:, :2])
        grows = size[:, 2] * along.max(axis=1, initial=0.0)
        if np.any(grows[friction.variable] > UNDRIVEN * size.max(initial=0.0) ** 2):
            return 0.0
        bound = 4.0 / np.pi * float(np.sum(friction.limits * along))
        return self.force / bound if bound > 0.0 else np.inf


def springs_of(system: System, holds: BoolArray, sliding: BoolArray | None = None) -> FloatArray:
    """Return the (3 n_contacts,) spring stiffnesses of sticking contacts, N/m.

    `holds` (n_contacts,) marks the sticking contacts; `sliding` directions have no stiffness.
    """
    springs = np.where(np.repeat(holds, 3), system.springs.stuck_stiffness(), 0.0)
    return springs if sliding is None else np.where(sliding, 0.0, springs)


def range_modes(system: System, load: HarmonicLoad, within: Range, springs: FloatArray) -> list[RangeMode]:
    """Return the modes that harmonics of a load meet in a frequency range, with linear springs in place of contacts.

    Parameters
    ----------
    system
        System; along an engine-order line it is taken at the middle of the range.
    load
        Periodic load.
    within
        Frequencies of the excitation.
    springs
        (3 n_contacts,) stiffnesses from `springs_of`, N/m.
    """
    here, found = system.at(within.middle), []
    for h, force in sorted(load.harmonics.items()):
        if h < 1 or not np.any(force):
            continue
        structure = here.structure.of_harmonic(h)
        for mode in modes_up_to(here, h * within.highest, springs, h):
            if within.holds(mode.omega / h):
                on_mode = float(abs(np.vdot(mode.shape, force)))
                size = float(np.linalg.norm(force) * np.linalg.norm(mode.shape))
                gaps = np.asarray(here.interface.gap_operator @ mode.shape)
                part, kinetic = _most_moved(structure, mode)
                in_springs = float(np.sum(springs * np.abs(gaps) ** 2))
                found.append(
                    RangeMode(
                        harmonic=h,
                        number=mode.number,
                        omega=mode.omega / h,
                        ratio=mode.ratio,
                        force=on_mode if on_mode > UNDRIVEN * size else 0.0,
                        gaps=gaps.reshape(-1, 3),
                        strain=_share(in_springs, structure, mode),
                        part=part,
                        kinetic=kinetic,
                    )
                )
    return found


def modes_up_to(system: System, highest: float, springs: FloatArray, harmonic: int) -> list[StuckMode]:
    """Return all modes of a harmonic up to a frequency in rad/s, and the next one."""
    most = int(np.count_nonzero(system.structure.of_harmonic(harmonic).mass.diagonal()))
    count = min(FIRST_MODES, most)
    while True:
        modes = sprung_modes(system, count, springs, harmonic, SPANNED)
        above = [k for k, mode in enumerate(modes) if mode.omega > highest][:1]
        if above or count >= most:
            return modes[: above[0] + 1] if above else modes
        count = min(2 * count, most)


def _share(in_springs: float, structure: Structure, mode: StuckMode) -> float:
    own = float(np.real(np.vdot(mode.shape, structure.stiffness @ mode.shape)))
    every = in_springs + max(own, 0.0)
    return in_springs / every if every > 0.0 else 0.0


def _most_moved(structure: Structure, mode: StuckMode) -> tuple[str, float]:
    """Return the part with the largest kinetic energy and its share; an empty name if the model has one part."""
    energy = np.real(np.conj(mode.shape) * (structure.mass @ mode.shape))
    whose = np.array(structure.dofs.part)
    each = {str(part): float(energy[whose == part].sum()) for part in np.unique(whose)}
    if len(each) < 2:
        return "", 0.0
    part = max(each, key=lambda name: each[name])
    return part, each[part] / sum(each.values())


def complex_stiffness(ratio: float) -> complex:
    """Return the describing function of a spring with a slider, over its stiffness.

    `ratio` is the amplitude over the amplitude at the onset of slip.
    """
    if ratio <= 1.0:
        return 1.0 + 0.0j
    angle = np.arccos(1.0 - 2.0 / ratio)
    return complex((angle - 0.5 * np.sin(2.0 * angle)) / np.pi, 4.0 / np.pi * (ratio - 1.0) / ratio**2)


@dataclass(frozen=True)
class DampedMode:
    """Largest damping of a mode by friction.

    Attributes
    ----------
    stuck, ends
        Frequency of the excitation with stuck contacts and with freely sliding contacts, rad/s.
    best
        Frequency of the largest damping, rad/s.
    ratio
        Largest damping ratio by friction.
    """

    stuck: float
    best: float
    ratio: float
    ends: float

    def apart(self, omega: float) -> float:
        """Return the distance of a frequency, rad/s, from the range between sticking and sliding."""
        low, high = sorted((self.stuck, self.ends))
        return max(low - omega, omega - high, 0.0)

    @property
    def sentences(self) -> tuple[str, str]:
        """What friction does to the mode, and where it is without sticking."""
        stuck, best, ends = (omega / HZ for omega in (self.stuck, self.best, self.ends))
        damping = f"up to {100 * self.ratio:.2g} % of critical, at {best:.2f} Hz"
        return (
            f"friction damps the mode at {stuck:.2f} Hz by {damping}",
            f"sliding freely, this mode is at {ends:.2f} Hz",
        )


def damped_modes(
    system: System, friction: Friction, springs: FloatArray, harmonic: int, within: Range
) -> list[DampedMode]:
    """Return the largest damping by friction of the modes in a range of frequencies.

    Parameters
    ----------
    system
        System; along an engine-order line it is taken at the middle of the range.
    friction
        Coulomb limits of the contacts.
    springs
        (3 n_contacts,) stiffnesses with stuck contacts, N/m.
    harmonic
        Harmonic of the load that drives the modes.
    within
        Range of excitation frequencies.

    Notes
    -----
    The basis consists of the modes with stuck contacts and with sliding contacts, up to `BEYOND` times the highest
    frequency.
    """
    here = system.at(within.middle)
    slips = friction.slips & (springs > 0.0)
    if not slips.any():
        return []
    highest = BEYOND * harmonic * within.highest
    shapes = [
        m.shape for own in (springs, np.where(slips, 0.0, springs)) for m in modes_up_to(here, highest, own, harmonic)
    ]
    if not shapes:
        return []
    structure, gaps = here.structure.of_harmonic(harmonic), here.interface.gap_operator
    way = _spanned(structure.mass, np.array(shapes).T)
    moved = gaps @ way
    stiffness = way.conj().T @ (structure.stiffness @ way)
    rest, slider = (
        (moved.conj().T * own) @ moved for own in (np.where(slips, 0.0, springs), np.where(slips, springs, 0.0))
    )
    coriolis = way.conj().T @ (structure.coriolis @ way) if structure.turns else None
    roots = _followed(0.5 * (stiffness + stiffness.conj().T) + rest, slider, coriolis) / harmonic
    damping = roots.imag / np.abs(roots)
    found = []
    for omega, ratio in zip(np.abs(roots).T, damping.T, strict=True):
        top = int(np.argmax(ratio))
        inside = [within.holds(omega[k]) for k in (0, top)]
        if any(inside) and ratio[top] > SMALLEST_DAMPING:
            found.append(DampedMode(float(omega[0]), float(omega[top]), float(ratio[top]), float(omega[-1])))
    return found


def _spanned(mass: ComplexArray, shapes: ComplexArray) -> ComplexArray:
    """Return motions of unit mass that span the shapes."""
    square, turn = np.linalg.eigh(shapes.conj().T @ (mass @ shapes))
    kept = square > INDEPENDENT * square[-1]
    return np.asarray(shapes @ (turn[:, kept] / np.sqrt(square[kept])))


def _followed(rest: ComplexArray, slider: ComplexArray, coriolis: ComplexArray | None) -> ComplexArray:
    """Return the (20, m) complex frequencies of each mode from stuck to sliding, rad/s."""
    values, vectors = _complex_modes(rest + slider, coriolis, undamped=True)
    every = [values]
    for ratio in SLIP_RATIOS[1:]:
        own, shapes = _complex_modes(rest + complex_stiffness(float(ratio)) * slider, coriolis)
        order = _partners(np.abs(vectors.conj().T @ shapes))
        vectors = shapes[:, order]
        every.append(own[order])
    return np.array(every)


def _complex_modes(
    stiffness: ComplexArray, coriolis: ComplexArray | None, *, undamped: bool = False
) -> tuple[ComplexArray, ComplexArray]:
    """Return complex frequencies and shapes of unit length of ``K + iω G - ω²``: one of each pair ±ω, by rising frequency if undamped."""
    if coriolis is None:
        squares, shapes = np.linalg.eigh(stiffness) if undamped else np.linalg.eig(stiffness)
        return np.sqrt(squares.astype(complex)), shapes / np.linalg.norm(shapes, axis=0)
    n = len(stiffness)
    rates, states = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -coriolis]]))
    positive = np.argsort(-rates.imag, kind="stable")[:n][::-1]
    shapes = states[:n, positive]
    return -1j * rates[positive], shapes / np.linalg.norm(shapes, axis=0)


def _partners(alike: FloatArray) -> IntArray:
    """Assign to each row its most similar column, none twice."""
    order = np.zeros(len(alike), dtype=np.int64)
    alike = alike.copy()
    for _ in order:
        row, column = np.unravel_index(int(np.argmax(alike)), alike.shape)
        order[row] = column
        alike[row, :] = alike[:, column] = -1.0
    return order


@dataclass(frozen=True, eq=False)
class ModesInRange:
    """The excited modes in a range of frequencies, and what friction does to them, known without a response.

    Attributes
    ----------
    stuck, sliding
        Excited modes in the range, with stuck contacts, and with contacts sliding freely where they can.
    friction
        Friction forces of the contacts under the static loads.
    damped
        Effect of friction on each mode.
    touching
        Whether there are contacts.
    springs
        (n_contacts, 3) stiffnesses of the contacts that the static loads press, stuck, N/m.
    """

    stuck: tuple[RangeMode, ...]
    sliding: tuple[RangeMode, ...]
    friction: Friction
    damped: tuple[DampedMode, ...]
    touching: bool
    springs: FloatArray

    @property
    def undamped(self) -> list[RangeMode]:
        """Excited modes without damping while contacts stick."""
        return [m for m in self.stuck if m.undamped]

    @property
    def unbounded(self) -> list[tuple[RangeMode, float]]:
        """Undamped modes whose load exceeds the bound on friction, with the ratio of both."""
        each = [(m, m.excess(self.friction)) for m in self.sliding if m.undamped]
        return [(m, excess) for m, excess in each if 1.0 < excess < np.inf]

    @property
    def driven(self) -> RangeMode | None:
        """The mode with the largest linear resonance with contacts stuck; None if the load excites none in the range."""
        known = [m for m in self.stuck if m.force > 0.0]
        return max(known, key=lambda m: m.resonance) if known else None

    @property
    def slip_ratio(self) -> float:
        """Largest tangential force over its limit at the largest resonance with stuck contacts; NaN without friction or resonance."""
        top = self.driven
        if top is None or not self.friction.any:
            return float("nan")
        motion = np.abs(top.gaps[:, :2]) * top.resonance
        force, limits = motion * self.springs[:, :2], self.friction.limits
        return float(np.max(force[limits > 0.0] / limits[limits > 0.0]))

    def ends(self, mode: RangeMode) -> float:
        """Return the frequency of a mode with contacts sliding freely, rad/s; its own frequency if friction does not change it."""
        near = [d for d in self.damped if abs(d.stuck - mode.omega) <= 1e-6 * mode.omega]
        return near[0].ends if near else mode.omega


def modes_in_range(
    system: System, load: HarmonicLoad, within: Range, static_gap: FloatArray, static_force: FloatArray
) -> ModesInRange | None:
    """Return the excited modes in a range; None without a reduction, or if aerodynamic coefficients end inside the range.

    Parameters
    ----------
    system
        System; along an engine-order line it is taken at the middle of the range.
    load
        Periodic load.
    within
        Frequencies of the excitation.
    static_gap, static_force
        (n_contacts, 3) static gaps, m, and forces, N, of the contacts.
    """
    if not system.structure.reduced:
        return None
    friction = friction_of(system.springs, static_gap, static_force)
    holds = pressed_by(system.springs.laws, static_force)
    stuck, sliding = springs_of(system, holds), springs_of(system, holds, friction.slips)
    try:
        modes = [tuple(range_modes(system, load, within, own)) for own in (stuck, sliding)]
        harmonics = sorted(h for h, force in load.harmonics.items() if h and np.any(force))
        damped = [d for h in harmonics for d in damped_modes(system, friction, stuck, h, within)]
    except InputError:  # the range exceeds the table of aerodynamic coefficients
        return None
    touching = bool(system.interface.n_contacts)
    return ModesInRange(modes[0], modes[1], friction, tuple(damped), touching, np.reshape(stuck, (-1, 3)))
