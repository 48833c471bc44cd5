"""A structure without rigid bodies that nothing holds."""

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from stickslip.assembly.locations import picked
from stickslip.errors import input_error
from stickslip.model.structure import Structure
from stickslip.reduction.basis import in_coordinates, surviving_sets


def without_bodies(structure: Structure, names: Collection[str]) -> Structure:
    """Return a structure without the coordinates of some parts; `basis` leads back to all of them.

    Raises
    ------
    InputError
        If nothing is left.
    """
    if not names:
        return structure
    table = structure.dofs
    stays = np.array([part not in names for part in table.part])
    index = np.flatnonzero(stays)
    if not index.size:
        raise input_error(
            "part", "nothing is left without free rigid bodies", "Let contacts stick, or give a part that is held."
        )
    into = picked(np.where(stays, np.cumsum(stays) - 1, -1), index.size)
    if structure.basis is None:
        structure = replace(structure, basis=picked(np.arange(structure.n), structure.n))
    return in_coordinates(structure, into, table.take(index), surviving_sets(structure, index))
