"""Lumped systems of the literature and of other solvers' examples."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure
from stickslip.response.system import System


def lumped(mass: FloatArray, damping: FloatArray, stiffness: FloatArray) -> Structure:
    """Return a structure of point masses, each with one coordinate."""
    n = len(mass)
    dofs = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    return Structure(np.asarray(mass), np.asarray(damping), np.asarray(stiffness), dofs)


def system(structure: Structure, laws: Sequence[ContactLaw], gap: FloatArray) -> System:
    """Return a system whose every dof is an output."""
    names = tuple(f"contact{i + 1}" for i in range(len(laws)))
    return System(structure, Interface(names, tuple(laws), gap), np.arange(structure.n))


def jenkins(stiffness: float, limit: float) -> ElasticCoulomb:
    """Return a Jenkins element along t: a spring in series with a slider of constant limit."""
    return ElasticCoulomb(k_t=stiffness, k_w=0.0, k_n=0.0, mu=1.0, preload=limit)


def unilateral(stiffness: float, clearance: float) -> ElasticCoulomb:
    """Return a frictionless spring that acts beyond a clearance."""
    return ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=stiffness, mu=0.0, preload=-stiffness * clearance)


# ---- B3: one blade with a friction damper -----------------------------------------------------------------------------


def griffin(limit: float) -> tuple[System, HarmonicLoad]:
    """B3, after Griffin (1980): unit mass and spring, dashpot 0.02, friction damper of spring 0.5 and `limit`, force 0.1."""
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    alone = lumped(np.eye(1), 0.02 * np.eye(1), np.eye(1))
    return system(alone, [jenkins(0.5, limit)], gap), force_at(1, 0, 0.1)


# ---- B6: blade, damper, blade -----------------------------------------------------------------------------------------

Y2 = 3  # dof of which the tables speak


def blades_and_damper(
    *,
    m: float | tuple[float, float] | None = 0.0,
    excitation: float = 1.0,
    length: float = 1.0,
    force: float = 1.0,
    phase: float = 0.0,
    mirrored: bool = False,
) -> tuple[System, HarmonicLoad]:
    """B6, after Ferhatoglu & Zucca (2021): two planar blades and a wedge between them, dofs x1 y1 x2 y2 xD yD.

    120 N on the damper, `excitation` times (0, -20, 5, 0, 0, 0) sin(ωt) on the blades. `m` holds the tangential forces of the two
    contacts just before t = 0, as shares of their limits. `length` and `force` are the sizes of the units in m and N; `phase` shifts
    the excitation; `mirrored` swaps left and right.
    """
    mass = np.diag([1.0, 1, 1, 1, 0.1, 0.1])
    damping = np.diag([20.0, 20, 20, 20, 0, 0])
    stiffness = np.diag([3e5] * 4 + [0.0, 0.0])
    for a, b, k in ((0, 1, 3e5), (2, 3, 3e5), (0, 2, 7e5), (1, 3, 7e5), (4, 5, 3e5)):
        stiffness[[a, b], [a, b]] += k
        stiffness[[a, b], [b, a]] -= k
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    flip = np.diag([1.0, -1.0])  # the source's normal is positive in compression
    one, none = np.eye(2), np.zeros((2, 2))
    gap = np.zeros((6, 6))
    gap[[0, 2]] = flip @ np.array([[c, s], [-s, c]]) @ np.hstack([-one, none, one])
    gap[[3, 5]] = flip @ np.array([[c, -s], [s, c]]) @ np.hstack([none, -one, one])
    if mirrored:  # the tangents turn round, the physics must not notice
        gap = np.diag([-1.0, 1, 1, -1, 1, 1]) @ gap
    per_length = length / force
    laws = tuple(
        ElasticCoulomb(k_t=3e5 * per_length, k_w=0.0, k_n=3e5 * per_length, mu=0.5, residual_traction=share)
        for share in (m if isinstance(m, tuple) else (m, m))
    )
    shake = excitation * np.array([0, -20, 5, 0, 0, 0.0]) * (-1j) * np.exp(1j * phase)
    static = np.array([0, 0, 0, 0, 0, 120.0])
    parts = ("blades",) * 4 + ("damper",) * 2
    dofs = Dofs(np.array([1, 1, 2, 2, 3, 3]), ("x", "y") * 3, np.zeros((6, 3)), parts)
    structure = Structure(mass * per_length, damping * per_length, stiffness * per_length, dofs)
    contacts = Interface(("1", "2"), laws, gap)
    made = System(structure, contacts, np.array([3, 0, 1, 2]), free=np.array([4, 5]))
    return made, HarmonicLoad(static / force, {1: shake / force})


# ---- chain ------------------------------------------------------------------------------------------------------------


def chain_stiffness(n: int, k: float) -> FloatArray:
    """Return the stiffness of `n` masses in a row, the first one grounded and the last one free."""
    matrix = k * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    matrix[-1, -1] = k
    return matrix


def small_chain() -> System:
    """Twenty masses, Jenkins elements from the first six to ground; the output is the free end."""
    stiffness = chain_stiffness(20, 1e4)
    gap = np.zeros((18, 20))
    gap[3 * np.arange(6), np.arange(6)] = 1.0
    structure = lumped(np.eye(20), 2e-3 * stiffness, stiffness)
    made = system(structure, [jenkins(2e3, 10.0)] * 6, gap)
    return replace(made, outputs=np.array([19]))


def force_at(n: int, dof: int, size: float) -> HarmonicLoad:
    """Return a load ``size cos(ωt)`` on one of `n` dofs."""
    force = np.zeros(n, dtype=complex)
    force[dof] = size
    return HarmonicLoad(np.zeros(n), {1: force})
