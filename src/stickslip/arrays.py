"""Array types used in signatures, and matrices as arrays."""

from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.floating[Any]]
ComplexArray = npt.NDArray[np.complexfloating[Any, Any]]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
TextArray = npt.NDArray[np.str_]
Matrix = Any  # dense ndarray or scipy.sparse.csr_array, for which scipy has no types


def as_array(matrix: Matrix) -> Matrix:
    """Return a matrix (n, m), dense or sparse, as an ndarray."""
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix)
