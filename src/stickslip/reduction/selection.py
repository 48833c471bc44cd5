"""Rows and columns of matrices, and sets of dofs, that a reduction takes over."""

import numpy as np
import scipy.sparse

from stickslip.arrays import IntArray, Matrix
from stickslip.model.structure import Structure


def selection(rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> Matrix:
    """Return the CSR matrix with ones at ``(rows, columns)``."""
    return scipy.sparse.csr_array((np.ones(len(rows)), (rows, columns)), shape=shape)


def surviving_sets(structure: Structure, keep: IntArray, offset: int = 0) -> dict[str, IntArray]:
    """Return the sets whose dofs are all kept, by their places among `keep`, shifted by `offset`."""
    place = np.full(structure.n, -1)
    place[keep] = offset + np.arange(len(keep))
    moved = {name: place[index] for name, index in structure.sets.items()}
    return {name: index for name, index in moved.items() if np.all(index >= 0)}
