"""Joined surfaces on a few characteristic shapes in place of their nodes."""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.assembly.coordinates import Coordinates
from stickslip.assembly.locations import picked
from stickslip.assembly.model import Model
from stickslip.errors import InputError, input_error
from stickslip.model.structure import Structure
from stickslip.reduction.fixed_interface import reduce_interface

KEY = "reduction.interface_modes"


@dataclass(frozen=True, eq=False)
class OnShapes:
    """Joined structure whose joined surfaces may move in a few shapes.

    Parameters
    ----------
    structure
        The structure, without `basis`.
    way
        (n0, n) CSR from the new to the previous coordinates; None: they are the same.
    place
        (n0,) new position of each previous coordinate; -1 where shapes replace it.
    """

    structure: Structure
    way: Matrix | None
    place: IntArray

    def columns(self, operator: Matrix) -> Matrix:
        """Return an operator (m, n0) on the previous coordinates as one (m, n) on the new ones."""
        return operator if self.way is None else scipy.sparse.csr_array(operator @ self.way)

    def load(self, force: Matrix) -> Matrix:
        """Return a load (n0,) on the previous coordinates as one (n,) on the new ones."""
        return force if self.way is None else np.asarray(self.way.T @ force)


def on_shapes(model: Model, structure: Structure, at: Coordinates, needed: IntArray) -> OnShapes:
    """Reduce joined surfaces to characteristic shapes, if the model has `interface_modes`.

    Parameters
    ----------
    model
        The model; `Model.interface_modes` is the number of shapes.
    structure
        All parts, reduced and joined.
    at
        Coordinates of the structure.
    needed
        Dofs of all parts that must stay coordinates, because contacts, loads, outputs or bodies use them.

    Raises
    ------
    InputError
        If no joined dofs are left to reduce.
    """
    same = OnShapes(structure, None, np.arange(structure.n))
    if model.interface_modes is None:
        return same
    own = at.ids[at.stays]
    joined = np.isin(own, np.union1d(model.ties.followers, model.ties.weights.nonzero()[1]))
    joined[np.unique(at.columns(picked(needed, model.places.n)).nonzero()[1])] = False
    interface = np.flatnonzero(joined & (own >= 0))
    if not interface.size:
        raise input_error(
            KEY,
            f"is {model.interface_modes}, and no joined node is free for it: contacts, loads and outputs stay physical",
            "Leave it out, or join surfaces beside them.",
        )
    try:
        few = reduce_interface(structure, interface, min(model.interface_modes, interface.size))
    except InputError as error:
        raise error.inside(KEY) from None
    others = np.setdiff1d(np.arange(structure.n), interface)
    place = np.full(structure.n, -1)
    place[others] = np.arange(others.size)
    return OnShapes(replace(few, basis=None), scipy.sparse.csr_array(few.basis), place)
