"""Beams on rigid contacts, in the coordinates of three reductions: one answer, whatever they are."""

from typing import Literal

import numpy as np

from evidence.models.random_machines import cantilever, modal_damping, modes_of
from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure, join
from stickslip.reduction.contact_coordinates import in_relative_coordinates
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.free_interface import rubin
from stickslip.response.system import System

Coordinates = Literal["craig_bampton", "rubin", "relative"]
ELEMENTS = 10
NODES = (5, 8)  # that rub
TIP = 3 * (ELEMENTS - 1) + 1  # transverse, shaken
FORCE = 1.0


def beam(omega: float) -> Structure:
    """Return a cantilever of unit mass whose first mode vibrates at `omega` (rad/s), damped by half a percent."""
    mass, stiffness = cantilever(ELEMENTS)
    stiffness *= omega**2 / modes_of(mass, stiffness)[0][0]
    n = len(mass)
    dofs = Dofs(np.repeat(np.arange(ELEMENTS), 3), ("x", "z", "ry") * ELEMENTS, np.zeros((n, 3)))
    return Structure(mass, modal_damping(mass, stiffness, 0.005), stiffness, dofs)


def rubbing_beams(coordinates: Coordinates, preload: float) -> tuple[System, HarmonicLoad]:
    """Return a beam that rubs on the ground at two nodes, or, in relative coordinates, two that rub on each other."""
    keep = np.array([*(3 * node + 1 for node in NODES), TIP])
    two = len(NODES)
    if coordinates == "craig_bampton":
        whole = craig_bampton(beam(100.0), keep, 6)
    elif coordinates == "rubin":
        whole = rubin(beam(100.0), keep, 8)
    else:
        whole = join(a=rubin(beam(100.0), keep, 8), b=rubin(beam(130.0), keep, 8))
    force = np.zeros(whole.n, dtype=complex)
    force[two] = FORCE
    gap = np.zeros((3 * two, whole.n))
    gap[3 * np.arange(two), np.arange(two)] = 1.0
    if coordinates == "relative":
        gap[3 * np.arange(two), whole.n // 2 + np.arange(two)] = -1.0
        return _system(*in_relative_coordinates(whole, gap), force, preload)
    return _system(whole, gap, force, preload)


def _system(structure: Structure, gap: FloatArray, force: FloatArray, preload: float) -> tuple[System, HarmonicLoad]:
    if structure.basis is not None and structure.basis.shape[0] == force.size:
        force = structure.basis.T @ force
    laws = (RigidCoulomb(mu=0.5, preload=preload),) * len(NODES)
    output = np.array([int(np.argmax(np.abs(force)))])
    system = System(structure, Interface(tuple("ab"), laws, gap), output)
    return system, HarmonicLoad(np.zeros(structure.n), {1: force})
