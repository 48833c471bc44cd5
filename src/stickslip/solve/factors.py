"""LU factors of arrays, and of the Schur complement of a Jacobian, borders included."""

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeGuard

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.model.blas_threads import threads_for
from stickslip.operators import Bordered, Elimination, Jacobian, JacobianOperator

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


class Eliminating(JacobianOperator, Protocol):
    """A Jacobian from which cheap unknowns can be eliminated."""

    def eliminated(self) -> Elimination | None:
        """Return the elimination of cheap unknowns; None where it costs as much as the whole array."""
        ...


@dataclass(frozen=True, eq=False)
class BorderedElimination:
    """Elimination in a bordered matrix; the border remains.

    Parameters
    ----------
    inside
        The elimination without the border.
    columns, rows, corner
        (n, m), (m, n) and (m, m).
    """

    inside: Elimination
    columns: FloatArray
    rows: FloatArray
    corner: FloatArray

    @property
    def size(self) -> int:
        """Number of remaining unknowns, border included."""
        return self.inside.size + len(self.corner)

    @property
    def sign(self) -> float:
        """Sign of the determinant of the eliminated block."""
        return self.inside.sign

    @cached_property
    def _across(self) -> tuple[FloatArray, FloatArray]:
        return self.inside.reduced(self.columns)

    @cached_property
    def _down(self) -> tuple[FloatArray, FloatArray]:
        return self.inside.reduced(self.rows.T, transposed=True)

    def array(self) -> FloatArray:
        """Return the Schur complement (size, size)."""
        n = self.inside.size
        columns, inner = self._across
        out = np.empty((self.size, self.size), order="F")
        out[:n, :n], out[:n, n:] = self.inside.array(), columns
        out[n:, :n], out[n:, n:] = self._down[0].T, self.corner - self.rows @ inner
        return out

    def reduced(self, right: FloatArray, *, transposed: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return the right sides of the Schur complement, and their part of the eliminated unknowns; see `Elimination`."""
        n = len(self.columns)
        rows = self.columns.T if transposed else self.rows
        left, inner = self.inside.reduced(right[:n], transposed=transposed)
        return np.vstack([left, right[n:] - rows @ inner]), np.vstack([inner, np.zeros_like(right[n:])])

    def spread(self, x: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Return all unknowns from the remaining ones; see `Elimination`."""
        inner = (self._down if transposed else self._across)[1]
        n = self.inside.size
        all_of_it = self.inside.spread(x[:n], transposed=transposed)
        return np.vstack([all_of_it - inner @ x[n:], x[n:]])


@dataclass(frozen=True, eq=False)
class Reduced:
    """LU factors of the Schur complement of a matrix; None where no unknown remains."""

    elimination: Elimination
    factors: Factored | None

    @property
    def sign(self) -> float:
        """Sign of its determinant."""
        return self.elimination.sign * (1.0 if self.factors is None else self.factors.sign)

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Solve; see `Inverse`."""
        left, inner = self.elimination.reduced(right[:, None], transposed=transposed)
        if self.factors is None:
            return inner[:, 0]
        x = self.factors(left[:, 0], transposed=transposed)
        return (inner + self.elimination.spread(x[:, None], transposed=transposed))[:, 0]


def _is_eliminating(jac: Jacobian) -> TypeGuard[Eliminating]:
    return hasattr(type(jac), "eliminated")


def elimination_of(jac: Jacobian) -> Elimination | None:
    """Return the elimination of cheap unknowns from a Jacobian, borders included; None where there are none."""
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if not _is_eliminating(inside):
        return None
    own = inside.eliminated()
    if own is None or not isinstance(jac, Bordered):
        return own
    return BorderedElimination(own, *jac.flat.borders)


def reduced_factors(elimination: Elimination) -> Reduced | None:
    """Factorise the Schur complement; None if it is singular to working precision."""
    if elimination.size == 0:
        return Reduced(elimination, None)
    factors = lu_factors(elimination.array())
    return None if factors is None else Reduced(elimination, factors)
