"""Rotation of nodal coordinate systems into the global axes."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error


def rotation_to_global(node: IntArray, component: IntArray, turned: IntArray, turns: FloatArray, place: str) -> Matrix:
    """Return the (n, n) sparse rotation from nodal to global coordinates.

    Parameters
    ----------
    node, component
        (n,) node number and component of each coordinate, 1 ... 6, any other number for none of these; the components
        of a node stand together, ascending.
    turned
        (k,) numbers of the nodes that have axes of their own, ascending.
    turns
        (k, 3, 3) columns: their axes.
    place
        For messages.

    Raises
    ------
    InputError
        If a turned node has only some components (the others are constrained): these cannot be turned alone.
    """
    at = np.arange(len(node))
    own = np.isin(node, turned) & (component >= 1) & (component <= 6)
    rows, columns = [at[~own]], [at[~own]]
    values: list[FloatArray] = [np.ones(int((~own).sum()))]
    for kind in (0, 1):
        here = at[own & ((component - 1) // 3 == kind)]
        owners, counts = np.unique(node[here], return_counts=True)
        if (counts != 3).any():
            raise input_error(
                place,
                f"node {owners[counts != 3][0]} has axes of its own and only some free components, "
                "which cannot be turned into the global axes",
                "Constrain all three of such a node or none, or give it the global axes.",
            )
        block = here[np.argsort(node[here], kind="stable")].reshape(-1, 3)
        rows.append(np.repeat(block, 3, axis=1).ravel())
        columns.append(np.tile(block, (1, 3)).ravel())
        values.append(turns[np.searchsorted(turned, owners)].ravel())
    index = (np.concatenate(rows), np.concatenate(columns))
    shape = (len(node), len(node))
    return scipy.sparse.csr_array((np.concatenate(values), index), shape=shape)
