"""Lumped bladed disks of the literature, one sector each; `wheel` makes the whole of one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray, Matrix
from stickslip.model.damping import modal_damping
from stickslip.model.matrices import lumped
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.full_wheel import wheel
from stickslip.reduction.tuned import TunedWheel, tuned_wheel

DISK, TIP, RING = 0, 2, 3  # coordinates of `blisk_with_ring`
RING_HOLD = 0.1  # N/m to ground: nothing else tells a slipping ring where its mean is


def blade_ring(
    sectors: int, *, mass: float = 1.0, stiffness: float = 1.0, coupling: float = 0.02, damping: float = 0.0
) -> CyclicSector:
    """Return a ring of blades, each one mass on a spring and a dashpot, with springs between neighbours.

    ``ω_k² = (stiffness + 2 coupling (1 - cos(2πk/n_s))) / mass``; at least two sectors.
    """
    springs = {(0, None): stiffness, (0, 1): coupling}
    structure = _assembled(("blade",), (mass,), springs, 1)
    dashpots = structure.stiffness * 0.0
    dashpots[0, 0] = damping
    return CyclicSector(structure.with_damping(dashpots), sectors, np.array([0]), np.array([1]), axis=None)


def mistuned_blade_ring(deviations: Sequence[float] | FloatArray, damping: float = 0.0) -> Structure:
    """Return the whole `blade_ring`; blade n stands on ``1 + deviations[n]``."""
    shares = np.asarray(deviations, dtype=float)
    tuned = wheel(blade_ring(shares.size, damping=damping))
    return replace(
        tuned,
        mass=tuned.mass.toarray(),
        damping=tuned.damping.toarray(),
        stiffness=tuned.stiffness.toarray() + np.diag(shares),
    )


def blisk_with_ring(
    sectors: int = 24,
    *,
    masses: tuple[float, float, float] = (1.2, 0.35, 0.25),
    springs: tuple[float, float, float, float] = (6e5, 5e7, 1e6, 2e6),
    ring: tuple[float, float] | None = (0.25, 8e6),
) -> CyclicSector:
    """Return a blisk of disk, blade root and blade tip masses, and the masses of a friction ring in its groove.

    Parameters
    ----------
    sectors
        Number of blades.
    masses
        Of disk, blade root and blade tip, kg.
    springs
        From the disk to the ground, to the neighbour's disk, to the root, and from root to tip, N/m.
    ring
        Mass of a ring's piece, kg, and its spring to the neighbour's, N/m; None leaves the ring out.

    Returns
    -------
    CyclicSector
        With the sets ``disk``, ``root``, ``tip`` and ``ring``. Nothing holds the ring: friction between ``ring`` and ``disk`` does.

    Notes
    -----
    Source: Laxalde, Thouverez, Sinou and Lombard, "Qualitative analysis of forced response of blisks with friction ring dampers",
    European Journal of Mechanics A 26 (2007) 676-687. Its ring is not published in full; the default one is ours.
    """
    to_ground, to_neighbour, to_root, to_tip = springs
    names: tuple[str, ...] = ("disk", "root", "tip")
    table: dict[tuple[int, int | None], float] = {(0, None): to_ground}
    heavy: tuple[float, ...] = masses
    if ring is None:
        table[0, 3] = to_neighbour
        faces = ([0], [3])
    else:
        names, heavy = (*names, "ring"), (*masses, ring[0])
        table |= {(0, 4): to_neighbour, (3, 5): ring[1]}
        faces = ([0, 3], [4, 5])
    table |= {(0, 1): to_root, (1, 2): to_tip}
    structure = _assembled(names, heavy, table, len(faces[1]))
    return CyclicSector(structure, sectors, np.array(faces[0]), np.array(faces[1]), axis=None)


def friction_ring(harmonics: int) -> tuple[TunedWheel, Matrix]:
    """Return literature benchmark B9: the tuned wheel under engine order 2, and the gap operator of ring against disk.

    The modes of the blisk without its ring are damped by 0.1 %.
    """
    free = blisk_with_ring()
    stiffness = np.asarray(free.structure.stiffness).copy()
    stiffness[RING, RING] += RING_HOLD
    sector = replace(free, structure=replace(free.structure, stiffness=stiffness))
    own = np.zeros((3, sector.structure.n))
    own[0, [DISK, RING]] = 1.0, -1.0
    return tuned_wheel(sector, 2, harmonics, (own, None), keep=sector.independent, reduce=_damped)


def _damped(wave: Structure, _keep: object, _n_modes: int) -> Structure:
    alone = lumped(*(np.real(m[:3, :3]) for m in (wave.mass, wave.stiffness)))
    damping = np.zeros((4, 4))
    damping[:3, :3] = modal_damping(alone, 1e-3).damping
    return wave.with_damping(damping)


def _assembled(
    names: tuple[str, ...], masses: tuple[float, ...], springs: dict[tuple[int, int | None], float], copies: int
) -> Structure:
    """Return a sector from its springs, by pairs of coordinates (None: the ground), with massless copies of a neighbour's coordinates last."""
    n = len(names) + copies
    stiffness = np.zeros((n, n))
    for (one, other), value in springs.items():
        elongation = np.zeros(n)
        elongation[one] = 1.0
        if other is not None:
            elongation[other] = -1.0
        stiffness += value * np.outer(elongation, elongation)
    mass = np.diag([*masses, *[0.0] * copies])
    dofs = Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3)))
    sets = {name: np.array([i]) for i, name in enumerate(names)}
    return Structure(mass, np.zeros((n, n)), stiffness, dofs, sets)
