"""Rotation of the coordinates of nodes: vectors are rotated, scalar coordinates stay."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.structure import Dofs

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
ROUNDING = 1e-14  # smaller entries of a rotation matrix are zero: sines of multiples of pi with rounding


def node_table(dofs: Dofs) -> IntArray:
    """Return the rows of the dof table that belong to each node.

    Parameters
    ----------
    dofs
        Any table. Nodes of different parts are different nodes; coordinates without a node number (-1) belong to one node if they
        have the same position.

    Returns
    -------
    numpy.ndarray
        (p, 6) rows of the components ``x y z rx ry rz``, -1 for missing components; modal and other scalar coordinates are left
        out.

    Raises
    ------
    InputError
        If a node has the same component twice.
    """
    code = {name: i for i, name in enumerate(COMPONENTS)}
    component = np.array([code.get(name, -1) for name in dofs.component], dtype=np.int64)
    vector = np.flatnonzero(component >= 0)
    part = np.unique(np.array(dofs.part)[vector], return_inverse=True)[1].reshape(-1)
    place = np.zeros(vector.size, dtype=np.int64)
    loose = dofs.node[vector] < 0
    if loose.any():
        at = dofs.position[vector[loose]]
        place[loose] = np.unique(at, axis=0, return_inverse=True)[1].reshape(-1)
    keys = np.column_stack([part, dofs.node[vector], place])
    first, owner = np.unique(keys, axis=0, return_index=True, return_inverse=True)[1:]
    # nodes in the order of their first occurrence in the table
    rank = np.empty(first.size, dtype=np.int64)
    rank[np.argsort(first)] = np.arange(first.size)
    table = np.full((first.size, 6), -1, dtype=np.int64)
    table[rank[owner.reshape(-1)], component[vector]] = vector
    if np.count_nonzero(table >= 0) != vector.size:
        twice = np.setdiff1d(vector, table)[0]
        raise input_error(
            "Dofs", f"{dofs.labels[twice]} appears twice", "Number the nodes differently, or give the parts names."
        )
    return table


def dof_rotation(dofs: Dofs, rotation: FloatArray, place: str) -> Matrix:
    """Return the matrix that rotates the displacement vector of `dofs`.

    Parameters
    ----------
    dofs
        Table of n coordinates.
    rotation
        (3, 3) rotation of vectors.
    place
        Name of the caller, for messages.

    Returns
    -------
    scipy.sparse.csr_array
        (n, n), with ones on the diagonal for coordinates that are no components of a vector.

    Raises
    ------
    InputError
        If a node lacks a component that the rotation couples with one it has.
    """
    R = np.where(np.abs(rotation) < ROUNDING, 0.0, rotation)
    table = node_table(dofs)
    scalar = np.setdiff1d(np.arange(len(dofs)), table)
    rows, columns, values = [scalar], [scalar], [np.ones(scalar.size)]
    for vector in (table[:, :3], table[:, 3:]):
        for a, b in zip(*np.nonzero(R), strict=True):
            both = (vector[:, a] >= 0) & (vector[:, b] >= 0)
            torn = (vector[:, a] >= 0) & ~both
            if torn.any():
                raise _torn(dofs, int(vector[torn, a][0]), COMPONENTS[b], place)
            rows.append(vector[both, a])
            columns.append(vector[both, b])
            values.append(np.full(np.count_nonzero(both), R[a, b]))
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.csr_array(entries, shape=(len(dofs), len(dofs)))


def _torn(dofs: Dofs, row: int, missing: str, place: str) -> Exception:
    return input_error(
        place,
        f"node {dofs.node[row]} at {_point(dofs.position[row])} has {dofs.component[row]} without "
        f"{missing}, and the rotation from sector to sector mixes the two",
        "Clamp all components of a node or none, or give the sector identity frames (axis=None).",
    )


def _point(position: FloatArray) -> str:
    return "(" + ", ".join(f"{v:.6g}" for v in position) + ") m"
