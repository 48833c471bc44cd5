"""Displacements of steady rotation common to joined parts."""

import numpy as np
import scipy

from stickslip.arrays import IntArray
from stickslip.assembly.coordinates import Coordinates
from stickslip.assembly.joints.ties import Ties
from stickslip.assembly.locations import Places, picked
from stickslip.assembly.parts.reduced import Steady, steady_of
from stickslip.assembly.sides.wheel import Neighbours
from stickslip.model.fe.factorisation import factorise
from stickslip.model.structure import join


def joined_displacements(
    places: Places, at: Coordinates, tied: tuple[Neighbours | None, Ties], loose: IntArray
) -> dict[str, Steady]:
    """Solve the linear statics of all joined parts at rest under the centrifugal load at 1 rad/s.

    Parameters
    ----------
    places, at
        The parts, and the coordinates that their joins leave.
    tied
        How they meet their neighbours on a wheel, None for a single structure; and what joins tie.
    loose
        Dofs that nothing holds, which stay where they are.
    """
    parts, (here, _) = places.parts, tied
    free = _free_solids(places, *tied)
    loose = np.concatenate([loose, *(places.own(name) for name in free)])
    rest = at.tied(join(**{name: part.structure for name, part in parts.items()}))
    tie = picked(np.arange(at.ids.size), at.ids.size) if at.tie is None else at.tie
    if here is not None:
        tie = tie @ here.sector(rest, at).wave_tie(0)
    moves = np.setdiff1d(np.arange(tie.shape[1]), tie[loose].nonzero()[1])
    tie = scipy.sparse.csr_array(tie[:, moves])
    stiffness = scipy.sparse.block_diag([scipy.sparse.csr_array(part.structure.stiffness) for part in parts.values()])
    load = [np.zeros(p.structure.n) if p.solid is None else p.solid.centrifugal for p in parts.values()]
    solve = factorise(scipy.sparse.csr_array(tie.T @ stiffness @ tie))
    moved = tie @ solve(tie.T @ np.concatenate(load))
    shared = {name: Steady(unit=np.asarray(moved[places.own(name)])) for name in parts}
    return shared | free


def _free_solids(places: Places, here: Neighbours | None, joins: Ties) -> dict[str, Steady]:
    """Return what the displacements of parts obey that neither a support nor a join holds."""
    cyclic = {} if here is None else here.ties
    tied = np.union1d(joins.followers, joins.weights.nonzero()[1])
    own = {
        name: steady_of(part, cyclic.get(name))
        for name, part in places.parts.items()
        if not np.isin(places.own(name), tied).any()
    }
    return {name: steady for name, steady in own.items() if steady.carried is not None}
