"""Factorisations of structural matrices: one function from a matrix to the map that solves with it."""

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from stickslip.arrays import Matrix
from stickslip.errors import SingularError

DENSE = 400  # below this many rows dense algebra is faster than sparse
SINGULAR = 1e13  # a condition number above which nothing of a solution is known

Solve = Callable[[Matrix], Matrix]
Say = Callable[[str], None]


def silent(_: str) -> None:
    """Say nothing: the default of functions that report their progress."""


def factorise(matrix: Matrix, *, say: Say = silent) -> Solve:
    """Factorise a square matrix; return the map from right-hand sides to solutions.

    Parameters
    ----------
    matrix
        (n, n), dense or sparse, real or complex: symmetric, Hermitian or general.
    say
        Called with a sentence before a long factorisation.

    Returns
    -------
    Solve
        Takes (n,) or (n, k), real or complex, and returns the same shape.

    Raises
    ------
    SingularError
        If a pivot vanishes, or if the condition number exceeds `SINGULAR`.
    """
    if matrix.shape[0] <= DENSE or not scipy.sparse.issparse(matrix):
        solve = _dense(matrix.toarray() if scipy.sparse.issparse(matrix) else np.asarray(matrix))
    else:
        say(f"factorising {matrix.shape[0]} equations")
        solve = _superlu(matrix)
    solve = _of_complex(solve, np.iscomplexobj(matrix))
    _refuse_singular(matrix, solve)
    return solve


def _dense(matrix: Matrix) -> Solve:
    if not np.all(np.isfinite(matrix)):
        raise SingularError("factorise: the matrix has entries that are not finite")
    factors = scipy.linalg.lapack.get_lapack_funcs("getrf", (matrix,))(matrix)
    if factors[2] != 0:
        raise SingularError("factorise: the matrix is singular")
    return lambda b: np.asarray(scipy.linalg.lu_solve(factors[:2], b))


def _superlu(matrix: Matrix) -> Solve:
    try:
        lu = scipy.sparse.linalg.splu(
            scipy.sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.01,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SingularError(f"factorise: {error}") from error
    kind = complex if np.iscomplexobj(matrix) else float
    return lambda b: np.asarray(lu.solve(np.asarray(b, dtype=kind)))


def _of_complex(solve: Solve, complex_matrix: bool) -> Solve:
    """Let the factors of a real matrix take complex right-hand sides."""
    if complex_matrix:
        return solve

    def both(b: Matrix) -> Matrix:
        return solve(b.real) + 1j * solve(b.imag) if np.iscomplexobj(b) else solve(b)

    return both


def _refuse_singular(matrix: Matrix, solve: Solve) -> None:
    """Raise where two steps of inverse iteration find a condition number above `SINGULAR`.

    Rows are scaled by their sums, so that units do not count.
    """
    size = np.sqrt(np.asarray(abs(matrix).sum(axis=1)).ravel())
    vector = np.random.default_rng(0).standard_normal(len(size))
    for _ in range(2):
        vector = vector / np.linalg.norm(vector)
        with np.errstate(all="ignore"):  # an overflow is judged below
            vector = size * solve(size * vector)
        growth = float(np.linalg.norm(vector))
        if not growth < SINGULAR:
            raise SingularError(
                f"factorise: the matrix of {len(size)} equations is singular to working precision "
                f"(condition number above {growth:.1g})"
            )
