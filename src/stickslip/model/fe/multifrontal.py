"""Multifrontal Cholesky factors of large sparse matrices, and Schur complements.

J. W. H. Liu, "The multifrontal method for sparse matrix solution: theory and practice", SIAM Review 34 (1992) 82-109.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import SingularError
from stickslip.model.fe.dissection import Dissection, Front, dissected

COLUMNS = 32  # right-hand sides of one pass
BLOCK = 256  # columns added at a time


@dataclass(frozen=True, eq=False)
class Multifrontal:
    """Factors of a Hermitian positive definite matrix, with a Schur complement on the kept rows; `multifrontal` makes them.

    Parameters
    ----------
    dissection
        The order of elimination.
    lower
        For each front the (p, p) Cholesky factor of its pivots, in Fortran order.
    below
        For each front the (u, p) rows below this factor.
    rest
        (k, k) Schur complement on the kept rows, in their order.
    """

    dissection: Dissection
    lower: tuple[Matrix, ...]
    below: tuple[Matrix, ...]
    rest: Matrix

    def forward(self, right: Matrix) -> Matrix:
        """Return the right-hand sides (n, m) after elimination, in the order of elimination; the last rows belong to the Schur complement.

        Parameters
        ----------
        right
            (n, m) in the matrix's own order.
        """
        x: Matrix = np.array(right[self.dissection.order], order="C", dtype=self._kind(right))
        flat = self._flat(x)
        for front, lower, below in self._each:
            own = flat[front.first : front.last]
            _solve(lower, own, False)
            if front.update.size:
                flat[front.update] -= below @ own
        return x

    def backward(self, forward: Matrix) -> Matrix:
        """Return the solutions (n, m), in the order of the matrix, from the result of `forward` with the solution in the kept rows."""
        x: Matrix = np.array(forward, order="C")
        flat = self._flat(x)
        for front, lower, below in reversed(self._each):
            own = flat[front.first : front.last]
            if front.update.size:
                own -= below.conj().T @ flat[front.update]
            _solve(lower, own, True)
        out = np.empty_like(x)
        out[self.dissection.order] = x
        return out

    def solve(self, right: Matrix) -> Matrix:
        """Return the solutions for right-hand sides (n,) or (n, m), if no row is kept."""
        columns = right.reshape(len(right), -1)
        found: Matrix = np.empty(columns.shape, dtype=self._kind(columns))
        for first in range(0, columns.shape[1], COLUMNS):
            some = slice(first, first + COLUMNS)
            found[:, some] = self.backward(self.forward(columns[:, some]))
        return found.reshape(right.shape)

    @property
    def _each(self) -> list[tuple[Front, Matrix, Matrix]]:
        return list(zip(self.dissection.fronts, self.lower, self.below, strict=True))

    def _kind(self, right: Matrix) -> Any:
        return complex if np.iscomplexobj(right) or np.iscomplexobj(self.rest) else float

    def _flat(self, x: Matrix) -> Matrix:
        """Return complex columns as pairs of real ones if the factors are real, without a copy."""
        return x if np.iscomplexobj(self.rest) else x.view(float)


def multifrontal(matrix: Matrix, kept: IntArray | None = None, dissection: Dissection | None = None) -> Multifrontal:
    """Factorise a sparse Hermitian matrix whose eliminated rows are positive definite.

    Parameters
    ----------
    matrix
        (n, n) CSR matrix with a complete diagonal.
    kept
        (k,) rows that are not eliminated; None: no such rows.
    dissection
        The order of elimination, if known.

    Raises
    ------
    SingularError
        If a pivot is not positive.
    """
    if dissection is None:
        dissection = dissected(matrix, np.zeros(0, dtype=np.int64) if kept is None else kept)
    kind = complex if np.iscomplexobj(matrix) else float
    own = scipy.sparse.tril(matrix[dissection.order][:, dissection.order], format="csc")
    own.sort_indices()
    n = matrix.shape[0]
    begin = n - dissection.kept
    rest = np.zeros((dissection.kept,) * 2, dtype=kind, order="F")
    rest += own[begin:, begin:].toarray()
    waiting: dict[int, Matrix] = {}
    lower, below = [], []
    parents = {child for front in dissection.fronts for child in front.children}
    for i, front in enumerate(dissection.fronts):
        pivots, update = _assembled(own, front, dissection.fronts, waiting)
        factor, under = _eliminated(pivots, front.pivots)
        lower.append(factor)
        below.append(under)
        if front.update.size:
            _subtract_square(update, under)
            if i in parents:
                waiting[i] = update
            else:
                place = front.update - begin
                _add(rest, place, place, update)
    return Multifrontal(dissection, tuple(lower), tuple(below), _mirrored(rest))


def _assembled(
    own: Matrix, front: Front, fronts: tuple[Front, ...], waiting: dict[int, Matrix]
) -> tuple[Matrix, Matrix]:
    """Return the columns of the pivots, and the lower triangle of the update matrix."""
    p, u = front.pivots, front.update.size
    kind = own.dtype
    pivots = np.zeros((p + u, p), dtype=kind, order="F")
    update = np.zeros((u, u), dtype=kind, order="F")
    begin, end = own.indptr[front.first], own.indptr[front.last]
    rows = own.indices[begin:end]
    columns = np.repeat(np.arange(p), np.diff(own.indptr[front.first : front.last + 1]))
    pivots[_local(front, rows), columns] = own.data[begin:end]
    for child in front.children:
        if child not in waiting:
            continue
        moved = waiting.pop(child)
        place = _local(front, fronts[child].update)
        here = int(np.searchsorted(place, p))
        later = place[here:] - p
        _add(pivots, place, place[:here], moved[:, :here])
        _add(update, later, later, moved[here:, here:])
    return pivots, update


def _add(to: Matrix, rows: IntArray, columns: IntArray, values: Matrix) -> None:
    """Add `values` to rows and columns of an array, `BLOCK` columns at a time, so that no large copy is made."""
    for first in range(0, columns.size, BLOCK):
        some = slice(first, first + BLOCK)
        to[np.ix_(rows, columns[some])] += values[:, some]


def _local(front: Front, rows: IntArray) -> IntArray:
    """Return the positions of rows in a front."""
    inside = rows < front.last
    after = front.pivots + np.searchsorted(front.update, rows)
    return np.where(inside, rows - front.first, after)


def _eliminated(columns: Matrix, p: int) -> tuple[Matrix, Matrix]:
    """Return the Cholesky factor of the pivots and the rows below it."""
    lapack, blas = scipy.linalg.lapack, scipy.linalg.blas
    is_complex = np.iscomplexobj(columns)
    potrf, trsm = (lapack.zpotrf, blas.ztrsm) if is_complex else (lapack.dpotrf, blas.dtrsm)
    factor, info = potrf(np.asfortranarray(columns[:p]), lower=1, clean=1, overwrite_a=1)
    if info != 0:
        raise SingularError("factorise: the matrix is not positive definite")
    under: Matrix = np.asfortranarray(columns[p:])
    if len(under):
        under = trsm(1.0, factor, under, side=1, lower=1, trans_a=2, overwrite_b=1)
    return factor, under


def _subtract_square(update: Matrix, under: Matrix) -> None:
    """Subtract ``under underᴴ`` from the lower triangle of `update`."""
    if np.iscomplexobj(update):
        scipy.linalg.blas.zherk(-1.0, under, beta=1.0, c=update, lower=1, overwrite_c=1)
    else:
        scipy.linalg.blas.dsyrk(-1.0, under, beta=1.0, c=update, lower=1, overwrite_c=1)


def _mirrored(lower: Matrix) -> Matrix:
    """Complete a lower triangle to the Hermitian matrix, row by row, since it may be large."""
    for i in range(1, len(lower)):
        lower[:i, i] = lower[i, :i].conj()
    return lower


def _solve(lower: Matrix, rows: Matrix, transposed: bool) -> None:
    """Solve with a triangle, or its conjugate transpose; the solution overwrites `rows` (p, m) in C order."""
    trsm = scipy.linalg.blas.ztrsm if np.iscomplexobj(lower) else scipy.linalg.blas.dtrsm
    if not transposed:
        # xᵀ Lᵀ = bᵀ
        trsm(1.0, lower, rows.T, side=1, lower=1, trans_a=1, overwrite_b=1)
    elif np.iscomplexobj(lower):
        # xᵀ conj(L) = bᵀ
        np.conj(rows, out=rows)
        trsm(1.0, lower, rows.T, side=1, lower=1, overwrite_b=1)
        np.conj(rows, out=rows)
    else:
        trsm(1.0, lower, rows.T, side=1, lower=1, overwrite_b=1)
