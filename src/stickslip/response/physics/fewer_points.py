"""The interface with half as many contact points: each stands for two neighbours and sees the mean of their gaps."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import sparse

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.response.system import System

FEWEST_HALVED = 8  # points of a contact below which half of them would hold it otherwise


def halved(system: System, groups: Sequence[str], position: FloatArray, area: FloatArray) -> tuple[System, int] | None:
    """Return a system with half the points of its meshed contacts, and how many points are left out; None where none is meshed finely enough.

    Parameters
    ----------
    system
        With contacts on meshes.
    groups
        (p,) which contact each point belongs to.
    position
        (p, 3) in m.
    area
        (p,) in m²; NaN where a point stands for no facets.

    Notes
    -----
    A point that stays takes the weight of the neighbour that goes, by their stuck stiffness, and its gap is the mean of both by that weight: it lies
    between them, so that a contact is as stiff as before against displacements and does not move to one side.
    """
    own = system.interface
    stiffness = own.stuck_stiffness().reshape(-1, 3).sum(axis=1)
    takes: IntArray = np.arange(own.n_contacts)
    for group in dict.fromkeys(groups):
        points = np.flatnonzero(np.array(groups) == group)
        meshed = np.all(np.isfinite(area[points])) and np.all(np.isfinite(position[points]))
        if points.size >= FEWEST_HALVED and meshed and np.all(stiffness[points] > 0.0):
            takes[points] = points[_pairs(position[points])]
    stays = np.flatnonzero(takes == np.arange(takes.size))
    if stays.size == takes.size:
        return None
    whole = np.zeros(own.n_contacts)
    np.add.at(whole, takes, stiffness)
    row = np.searchsorted(stays, takes)
    mean = sparse.csr_array((stiffness / whole[takes], (row, np.arange(takes.size))))
    few = Interface(
        tuple(own.names[i] for i in stays),
        tuple(own.laws[i] for i in stays),
        sparse.kron(mean, np.eye(3), format="csr") @ own.gap_operator,
        (own.factors * whole / stiffness)[stays],
    )
    return replace(system, interface=few), int(takes.size - stays.size)


def _pairs(position: FloatArray) -> IntArray:
    """Return for each point that which stands for it: itself, or the nearest of the points before it that stands for itself alone."""
    takes = np.arange(len(position))
    open_to = np.ones(len(position), dtype=bool)
    for i in range(len(position)):
        if not open_to[i]:
            continue
        others = np.flatnonzero(open_to)
        others = others[others > i]
        if not others.size:
            break
        near = others[np.argmin(np.linalg.norm(position[others] - position[i], axis=1))]
        takes[near] = i
        open_to[[i, near]] = False
    return takes
