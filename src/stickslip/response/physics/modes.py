"""Modes in a frequency range: damping without friction, damping by friction, and the parts that move."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.physics.friction import Friction
from stickslip.response.self_excited.modes import StuckMode, sprung_modes
from stickslip.response.system import System
from stickslip.units import HZ

UNDAMPED_RATIO = 1e-5  # damping ratio below which nothing damps a mode
SPANNED = 60  # coordinates up to which eigenvalues are those of all motions
UNDRIVEN = 1e-9  # force on a mode over the norms of force and shape: below, the load stands at a node
FIRST_MODES = 4  # asked for at first; twice as many until they pass the range
ALONE = 0.99  # share of the strain energy in contact springs, and of the kinetic energy in one part


@dataclass(frozen=True)
class Range:
    """Frequencies of the excitation from `lowest` to `highest`, rad/s."""

    lowest: float
    highest: float

    def holds(self, omega: float) -> bool:
        """Whether a frequency of the excitation lies within."""
        return self.lowest <= omega <= self.highest

    @property
    def middle(self) -> float:
        """Mean of both ends, rad/s."""
        return 0.5 * (self.lowest + self.highest)


@dataclass(frozen=True, eq=False)
class RangeMode:
    """A mode that a harmonic of a load passes within the range.

    Attributes
    ----------
    harmonic
        Of the load.
    number
        Of the mode, from 1.
    omega
        Frequency of the excitation whose harmonic is that of the mode, rad/s.
    ratio
        Damping ratio without friction.
    force
        Of the harmonic on the mode, N on unit modal mass; 0 where the load stands at a node.
    gaps
        (n_contacts, 3) motion of the contacts at unit modal mass.
    strain
        Share of its strain energy in contact springs.
    part, kinetic
        The part that moves most, and its share of the kinetic energy.
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
        """Whether the load drives it and nothing damps it while no contact slips."""
        return self.force > 0.0 and self.ratio < UNDAMPED_RATIO

    @property
    def resonance(self) -> float:
        """Modal amplitude at its resonance, m √kg, with at least the damping ratio `UNDAMPED_RATIO`."""
        return self.force / (2.0 * (self.harmonic * self.omega) ** 2 * max(self.ratio, UNDAMPED_RATIO))

    @property
    def hz(self) -> float:
        """Frequency of the excitation, Hz."""
        return self.omega / HZ

    @property
    def on_contacts(self) -> bool:
        """Whether one part alone moves, as a rigid body on the springs of its contacts."""
        return self.strain > ALONE and self.kinetic > ALONE

    def excess(self, friction: Friction) -> float:
        """Return the force over 4/π of the Coulomb limit projected on the mode: above 1 friction bounds no mode without damping.

        Infinite without friction, zero where the limit follows a normal gap that moves in the mode, as it then grows with the motion.
        """
        size, along = np.abs(self.gaps), np.abs(self.gaps[:, :2])
        grows = size[:, 2] * along.max(axis=1, initial=0.0)
        if np.any(grows[friction.variable] > UNDRIVEN * size.max(initial=0.0) ** 2):
            return 0.0
        bound = 4.0 / np.pi * float(np.sum(friction.limits * along))
        return self.force / bound if bound > 0.0 else np.inf


def springs_of(system: System, holds: BoolArray, sliding: BoolArray | None = None) -> FloatArray:
    """Return the (3 n_contacts,) springs of contacts that hold (n_contacts,), N/m, without those of `sliding` directions (3 n_contacts,)."""
    springs = np.where(np.repeat(holds, 3), system.springs.stuck_stiffness(), 0.0)
    return springs if sliding is None else np.where(sliding, 0.0, springs)


def range_modes(system: System, load: HarmonicLoad, within: Range, springs: FloatArray) -> list[RangeMode]:
    """Return the modes that harmonics of a load pass in a range, with linear springs in place of the contacts.

    Parameters
    ----------
    system
        What vibrates; along an engine-order line at the middle of the range.
    load
        Periodic load.
    within
        Frequencies of the excitation.
    springs
        (3 n_contacts,) stiffnesses, N/m: `springs_of`.
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
    """Return the part with most kinetic energy and its share; no part where the model has one alone."""
    energy = np.real(np.conj(mode.shape) * (structure.mass @ mode.shape))
    whose = np.array(structure.dofs.part)
    each = {str(part): float(energy[whose == part].sum()) for part in np.unique(whose)}
    if len(each) < 2:
        return "", 0.0
    part = max(each, key=lambda name: each[name])
    return part, each[part] / sum(each.values())
