"""A small blisk with a friction ring whose waves a fluid feeds: six sectors of four masses, for tests of self-excited vibration."""

from dataclasses import replace

import numpy as np

from evidence.models.lumped_disks import DISK, RING, TIP, blisk_with_ring
from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import modal_damping
from stickslip.model.matrices import lumped
from stickslip.model.structure import Structure
from stickslip.reduction.aerodynamics import Feedback, InfluenceCoefficients
from stickslip.reduction.tuned import tuned_wheel
from stickslip.response.system import System

SECTORS = 6
ROOT, MOVED = 1, 3  # root mass of a blade; coordinate of the tip in the wheel
HOLD = 1e3  # N/m of the ring to the ground
REFERENCE = 2.0 * np.pi * 620.0  # rad/s
MODE = 3  # root against tip, near 620 Hz in all waves
PATTERN = (1.372, -1.155)  # of the force on root and tip: none of it along the first mode of a blade


def influence(own: float, near: float, far: float) -> InfluenceCoefficients:
    """Coefficients of blades two places around: ``Im G(θ) = -own + 2 near sin θ + 2 far sin 2θ``."""
    values = np.array([-1j * own, near, -near, far, -far], dtype=complex)
    return InfluenceCoefficients(np.array([0, 1, -1, 2, -2]), values.reshape(1, 1, 5, 1, 1))


ONE_UNSTABLE = influence(3e3, 4.5e3, -3.5e3)  # wave 2 alone
TWO_UNSTABLE = influence(2e3, 6e3, 0.0)  # waves 1 and 2


def flutter_wheel(
    wave: int, harmonics: int, fluid: InfluenceCoefficients, force: float = 0.0
) -> tuple[System, HarmonicLoad]:
    """The wheel in a wave, with all waves for its disturbances, and a force (N) on the tips that travels with it."""
    free = blisk_with_ring(SECTORS, springs=(6e5, 5e6, 1e6, 2e6), ring=(0.25, 8e5))
    stiffness = np.asarray(free.structure.stiffness).copy()
    stiffness[RING, RING] += HOLD
    sector = replace(free, structure=replace(free.structure, stiffness=stiffness))
    own = np.zeros((3, sector.structure.n))
    own[0, [DISK, RING]] = 1.0, -1.0
    wheel, operator = tuned_wheel(
        sector, wave, harmonics, (own, None), keep=sector.independent, reduce=_damped, waves=range(SECTORS)
    )
    pattern = np.zeros(sector.structure.n)
    pattern[[ROOT, TIP]] = PATTERN
    feedback = {
        k: Feedback(np.asarray(s.project(pattern))[:, None], 2 * np.pi * k / SECTORS, fluid, REFERENCE)
        for k, s in wheel.waves.items()
    }
    wheel = wheel.with_aerodynamics(feedback)
    contacts = Interface(("ring",), (Jenkins(k_t=2e7, limit=4.0),), operator)
    load = HarmonicLoad(np.zeros(wheel.n))
    if force:
        at_tip = np.zeros(sector.structure.n)
        at_tip[TIP] = force
        load = HarmonicLoad(load.static, {1: wheel.project(at_tip, 1)})
    return System(wheel, contacts, np.array([MOVED])), load


def _damped(wave: Structure, _keep: object, _n_modes: int) -> Structure:
    alone = lumped(*(np.real(m[:3, :3]) for m in (wave.mass, wave.stiffness)))
    damping = np.zeros((4, 4))
    damping[:3, :3] = modal_damping(alone, 1e-3).damping
    return wave.with_damping(damping)
