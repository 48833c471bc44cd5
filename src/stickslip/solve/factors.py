"""LU factors of arrays."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.model.blas_threads import threads_for

SINGULAR = 1e-15  # smallest pivot over largest; below, the matrix has no usable inverse


@dataclass(frozen=True, eq=False)
class Factored:
    """LU factors of an array."""

    lu: FloatArray
    pivots: FloatArray

    @property
    def sign(self) -> float:
        """Sign of the determinant."""
        swaps = np.count_nonzero(self.pivots != np.arange(self.pivots.size))
        flips = swaps + np.count_nonzero(self.lu.diagonal() < 0.0)
        return 1.0 if flips % 2 == 0 else -1.0

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Solve; see `Inverse`."""
        solution, _ = scipy.linalg.lapack.dgetrs(self.lu, self.pivots, right, trans=int(transposed))
        return np.asarray(solution)


def lu_factors(matrix: FloatArray) -> Factored | None:
    """Factorise an array, which is overwritten; None if it is singular to working precision."""
    with threads_for(len(matrix)):
        lu, pivots, info = scipy.linalg.lapack.dgetrf(matrix, overwrite_a=True)
    size = np.abs(lu.diagonal())
    size.sort()
    # neither NaN, which is sorted to the end, nor infinity passes
    usable = info == 0 and size[0] > SINGULAR * size[-1]
    return Factored(lu, pivots) if usable else None
