"""Lumped bladed disks of the literature, one sector each; `wheel` makes the whole of one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.dofs import Dofs
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.full_wheel import wheel


def blade_ring(
    sectors: int,
    *,
    mass: float = 1.0,
    stiffness: float = 1.0,
    coupling: float = 0.02,
    damping: float = 0.0,
) -> CyclicSector:
    """Return a ring of blades, each one mass, with springs between neighbours.

    Parameters
    ----------
    sectors
        Number of blades.
    mass
        Of a blade, kg.
    stiffness
        Of the spring from each blade to the ground, N/m.
    coupling
        Of the spring between neighbours, N/m.
    damping
        Of the dashpot from each blade to the ground, N s/m.

    Returns
    -------
    CyclicSector
        With the set ``blade``.

    Raises
    ------
    InputError
        If mass or stiffness are not positive, or others negative.

    Notes
    -----
    ``ω_k² = (stiffness + 2 coupling (1 - cos(2πk/n_s))) / mass``; at least two sectors.
    """
    _check("blade_ring", {"mass": mass, "stiffness": stiffness})
    _check("blade_ring", {"coupling": coupling, "damping": damping}, zero=True)
    springs = {(0, None): stiffness, (0, 1): coupling}
    structure = _assembled(("blade",), (mass,), springs, 1)
    dashpots = structure.stiffness * 0.0
    dashpots[0, 0] = damping
    return CyclicSector(
        structure.with_damping(dashpots), sectors, np.array([0]), np.array([1]), axis=None
    )


def mistuned_blade_ring(
    deviations: Sequence[float] | FloatArray,
    *,
    mass: float = 1.0,
    stiffness: float = 1.0,
    coupling: float = 0.02,
    damping: float = 0.0,
) -> Structure:
    """Return the whole `blade_ring` with other ground springs.

    Parameters
    ----------
    deviations
        (n_s,) relative: blade n stands on ``stiffness * (1 + deviations[n])``.
    mass, stiffness, coupling, damping
        As of `blade_ring`.

    Returns
    -------
    Structure
        Dense, one coordinate a blade, with the sets ``blade``, ``sector0.blade`` and so on.

    Raises
    ------
    InputError
        If a blade has no stiffness left.
    """
    shares = np.asarray(deviations, dtype=float)
    if shares.ndim != 1 or not np.all(shares > -1.0):
        raise input_error(
            "mistuned_blade_ring: deviations",
            f"must be above -1, got {shares.tolist()}",
            "They are relative to the tuned stiffness.",
        )
    tuned = wheel(
        blade_ring(shares.size, mass=mass, stiffness=stiffness, coupling=coupling, damping=damping)
    )
    return replace(
        tuned,
        mass=tuned.mass.toarray(),
        damping=tuned.damping.toarray(),
        stiffness=tuned.stiffness.toarray() + stiffness * np.diag(shares),
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

    Raises
    ------
    InputError
        If a value is not positive.

    Notes
    -----
    Source: Laxalde, Thouverez, Sinou and Lombard, "Qualitative analysis of forced response of blisks with friction ring dampers",
    European Journal of Mechanics A 26 (2007) 676-687. Its ring is not published in full; the default one is ours.
    """
    values = [*masses, *springs, *(ring or ())]
    _check("blisk_with_ring", {f"value {i + 1}": value for i, value in enumerate(values)})
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


def _assembled(
    names: tuple[str, ...],
    masses: tuple[float, ...],
    springs: dict[tuple[int, int | None], float],
    copies: int,
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


def _check(place: str, values: dict[str, float], *, zero: bool = False) -> None:
    for name, value in values.items():
        if not (0 < value < np.inf or (zero and value == 0)):
            raise input_error(f"{place}: {name}", f"got {value}", "It must be positive.")
