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
    """A joined structure in which shapes may stand for the nodes of joined surfaces.

    Parameters
    ----------
    structure
        The structure, without its way back.
    way
        (n0, n) CSR from its coordinates to those of before; None: they are the same.
    place
        (n0,) where each coordinate of before is now, -1 where shapes stand for it.
    """

    structure: Structure
    way: Matrix | None
    place: IntArray

    def columns(self, operator: Matrix) -> Matrix:
        """Return an operator on the coordinates of before as one on those of now."""
        return operator if self.way is None else scipy.sparse.csr_array(operator @ self.way)

    def load(self, force: Matrix) -> Matrix:
        """Return a load on the coordinates of before as one on those of now."""
        return force if self.way is None else np.asarray(self.way.T @ force)


def on_shapes(model: Model, structure: Structure, at: Coordinates, needed: IntArray) -> OnShapes:
    """Reduce what joins tie, where the model asks for it.

    Parameters
    ----------
    model
        The model; `Model.interface_modes` says how many shapes.
    structure
        All parts, reduced and joined.
    at
        Its coordinates.
    needed
        Dofs of all parts that stay coordinates: of contacts, loads, outputs and bodies.

    Raises
    ------
    InputError
        If nothing is joined but what contacts, loads and outputs need.
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
