"""The whole wheel from one sector: its assembled structure, and shapes of travelling waves on all sectors."""

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.structure import Dofs, Structure
from stickslip.reduction.basis import ones_at, surviving_sets
from stickslip.reduction.cyclic import CyclicSector, travelling_wave
from stickslip.reduction.turning import dof_rotation
from stickslip.reduction.waves import wave


def wheel(sector: CyclicSector) -> Structure:
    """Assemble all sectors into the whole wheel, in global axes.

    Parameters
    ----------
    sector
        Sector 0; sector n is its copy, rotated by n pitches.

    Returns
    -------
    Structure
        CSR. Coordinates: sector by sector the dofs without the face that follows, then the dofs that all sectors share. A set of the
        sector becomes a set of the whole wheel, sector by sector, and a set of each sector, such as ``sector3.tip``. `basis` is
        None, since the coordinates are the full field. For a reduced sector it leads to the stacked full models of the
        sectors, each in the axes of its own sector.

    Raises
    ------
    InputError
        If a node lacks a component that the rotation couples with another one.
    """
    structure, free = sector.structure, sector.independent
    maps = [_from_wheel(sector, n) for n in range(sector.sectors)]

    def assembled(matrix: Matrix) -> Matrix:
        sector_matrix = scipy.sparse.csr_array(matrix)
        return scipy.sparse.csr_array(sum(m.T @ sector_matrix @ m for m in maps))

    sets = {}
    for name, index in surviving_sets(structure, free).items():
        copies = [index + n * free.size for n in range(sector.sectors)]
        sets[name] = np.concatenate(copies)
        sets.update({f"sector{n}.{name}": copy for n, copy in enumerate(copies)})
    basis = None
    if structure.basis is not None:
        parts = [scipy.sparse.csr_array(structure.expand(m)) for m in maps]
        basis = scipy.sparse.vstack(parts, format="csr")
    return Structure(
        assembled(structure.mass),
        assembled(structure.damping),
        assembled(structure.stiffness),
        _wheel_dofs(sector),
        sets,
        basis,
        None if structure.loss is None else assembled(structure.loss),
    )


def wheel_shape(
    sector: CyclicSector,
    wave_number: int,
    vector: Matrix,
    *,
    structure: Structure | None = None,
    dofs: Dofs | None = None,
) -> ComplexArray:
    """Return the motion of every sector in a travelling wave, in global axes.

    Parameters
    ----------
    sector
        The sector.
    wave_number
        Wave number k.
    vector
        (m,) coordinates on `structure`.
    structure
        The travelling-wave structure, full or reduced; None for ``travelling_wave(sector, wave_number)``.
    dofs
        Table of the full model that `structure` expands to; None for the sector's table. Needed if the sector itself is a reduced
        model.

    Returns
    -------
    numpy.ndarray
        (n_s, n) complex; the displacement at time t is the real part of ``shape * exp(iωt)``. Sectors are not scaled: row 0 is
        the sector's own displacement, and the norm is √n_s times the norm from `to_sectors`.

    Raises
    ------
    InputError
        If lengths do not fit.
    """
    source = travelling_wave(sector, wave_number) if structure is None else structure
    vector = np.asarray(vector)
    if vector.shape != (source.n,):
        raise input_error(
            "wheel_shape: vector",
            f"has shape {vector.shape} for a structure of {source.n} coordinates",
            "Name the structure that the vector belongs to.",
        )
    own = np.asarray(source.expand(vector), dtype=complex)
    table = sector.structure.dofs if dofs is None else dofs
    if own.shape != (len(table),):
        raise input_error(
            "wheel_shape: dofs",
            f"the full field has {own.size} coordinates, the table {len(table)}",
            "Give the dofs of the model that was reduced to the sector.",
        )
    phases = np.exp(1j * wave(wave_number, sector.sectors).phase_angle * np.arange(sector.sectors))
    shape = np.outer(phases, own)
    if sector.axis is not None:
        turn = dof_rotation(table, sector.axis.rotation(sector.pitch), "wheel_shape")
        for n in range(1, sector.sectors):
            shape[n] = phases[n] * phases[n - 1].conjugate() * (turn @ shape[n - 1])
    return shape


def _from_wheel(sector: CyclicSector, number: int) -> Matrix:
    """Return the (n, N) matrix from the wheel's coordinates to a sector's displacements in its own axes."""
    structure, free, shared = sector.structure, sector.independent, sector.shared
    size = sector.sectors * free.size + shared.size
    own = np.concatenate([free, shared])
    column = number * free.size + np.arange(free.size)
    column = np.concatenate([column, sector.sectors * free.size + np.arange(shared.size)])
    glob = ones_at(own, column, (structure.n, size))
    follow, lead, weights = sector.following
    neighbour = (number + sector.ahead) % sector.sectors * free.size + np.searchsorted(free, lead)
    followed = ones_at(np.arange(lead.size), neighbour, (lead.size, size))
    glob = glob + ones_at(follow, np.arange(follow.size), (structure.n, follow.size)) @ weights @ followed
    return sector.turn(-number) @ glob


def _wheel_dofs(sector: CyclicSector) -> Dofs:
    own, shared = (sector.structure.dofs.take(i) for i in (sector.independent, sector.shared))
    positions: list[FloatArray] = []
    parts: list[str] = []
    for n in range(sector.sectors):
        turned = own.position
        if sector.axis is not None:
            turned = sector.axis.turned(own.position, n * sector.pitch)
        positions.append(turned)
        parts += [f"sector{n}.{part}" if part else f"sector{n}" for part in own.part]
    return Dofs(
        np.concatenate([np.tile(own.node, sector.sectors), shared.node]),
        own.component * sector.sectors + shared.component,
        np.vstack([*positions, shared.position]),
        (*parts, *shared.part),
    )
