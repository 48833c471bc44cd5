"""The linear systems of Newton and continuation: what a solver of them is, and the dense one."""

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.operators import (
    Bordered,
    Corner,
    Costs,
    Inverse,
    Jacobian,
    JacobianOperator,
    array_of,
    transpose_of,
)

SINGULAR = 1e-15  # smallest pivot over largest; below, the matrix has no usable inverse


SOLUTIONS, PRODUCTS = (
    5,
    10,
)  # that follow where a matrix is to be factorised, and products of each by a Krylov method
MOST = 8000  # unknowns of an array, which then takes half a GB


@runtime_checkable
class Assembling(JacobianOperator, Protocol):
    """A Jacobian known by its products that can be had as an array."""

    @property
    def costs(self) -> Costs:
        """What its linear systems cost."""
        ...

    def dense(self) -> FloatArray:
        """Return the array."""
        ...


class LinearSolver(Protocol):
    """How the linear systems of a corrector are solved. `Dense` factorises; iterative solvers need products only."""

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``.

        Parameters
        ----------
        jac
            (n, n) Jacobian; an array may be overwritten.
        right
            (n,) right side.

        Returns
        -------
        ndarray or None
            (n,) solution; None if the Jacobian is singular or no solution was found.
        """
        ...

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve ``[[jac, column], [row, corner]] x = right``; `jac` itself may be singular, as at a fold.

        Parameters
        ----------
        jac
            (n, n) Jacobian; it is left as it is.
        column, row, corner
            (n,), (n,) and a number, or (n, m), (m, n) and (m, m): the border.
        right
            (n + m,) right side.

        Returns
        -------
        solution
            (n + m,) solution; None if the bordered matrix is singular or no solution was found.
        sign
            Sign of the determinant of the bordered matrix, 0 if it is singular, NaN where the solver cannot tell.
        """
        ...


@dataclass(frozen=True, slots=True)
class Dense:
    """LU with partial pivoting; the Jacobian is an array. The right choice up to about a thousand unknowns."""

    def solve(self, jac: Jacobian, right: FloatArray) -> FloatArray | None:
        """Solve ``jac x = right``; see `LinearSolver`."""
        return solve_dense(_array(jac), right)

    def solve_bordered(
        self, jac: Jacobian, column: FloatArray, row: FloatArray, corner: Corner, right: FloatArray
    ) -> tuple[FloatArray | None, float]:
        """Solve the bordered system and return the sign of its determinant; see `LinearSolver`."""
        if isinstance(jac, np.ndarray) and isinstance(corner, float) and corner and not row.any():
            return _last_known(jac, column, corner, right)
        return solve_signed(_array(Bordered(jac, column, row, corner)), right)


def _last_known(
    jac: FloatArray, column: FloatArray, corner: float, right: FloatArray
) -> tuple[FloatArray | None, float]:
    """Solve a bordered system whose last row prescribes the last unknown alone: what is inside needs no border."""
    last = right[-1] / corner
    inside, sign = solve_signed(np.array(jac, order="F"), right[:-1] - last * column)
    if inside is None or not np.isfinite(inside).all():
        return None, 0.0
    return np.append(inside, last), sign if corner > 0.0 else -sign


def solve_with(linear: LinearSolver, jac: Jacobian, right: FloatArray) -> FloatArray | None:
    """Solve ``jac x = right`` by `linear`, which is given a border apart from its matrix."""
    if isinstance(jac, Bordered):
        flat = jac.flat
        return linear.solve_bordered(flat.jac, flat.column, flat.row, flat.corner, right)[0]
    return linear.solve(jac, right)


def solve_dense(matrix: FloatArray, right: FloatArray) -> FloatArray | None:
    """Solve a dense system by LU; None if the matrix is singular to working precision. `matrix` is overwritten."""
    lu, pivots = _factors(matrix)
    return None if lu is None else Factored(lu, pivots)(right)


def factorised(linear: LinearSolver, jac: Jacobian) -> Inverse | None:
    """Return how systems with `jac` and with its transpose are solved; None if `jac` is singular.

    An array is factorised once, and overwritten. So is a Jacobian known by its products where that costs less than some solutions, for several
    right sides follow; others are solved by `linear` for each of them.
    """
    matrix = array_of(jac)
    if matrix is None and isinstance(jac, Assembling) and _array_pays(jac):
        matrix = jac.dense()
    if matrix is None:
        return _Iterated(linear, jac)
    lu, pivots = _factors(matrix)
    return None if lu is None else Factored(lu, pivots)


def _array_pays(jac: Assembling) -> bool:
    costs = jac.costs
    return costs.array < costs.factors + SOLUTIONS * PRODUCTS * costs.product


def assembled(jac: Jacobian) -> FloatArray | None:
    """Return a Jacobian known by its products as a new array, borders included; None where it cannot be put together, or is too large."""
    inside = jac.flat.jac if isinstance(jac, Bordered) else jac
    if not isinstance(inside, Assembling) or inside.shape[0] > MOST:
        return None
    array = inside.dense()
    return replace(jac.flat, jac=array).array() if isinstance(jac, Bordered) else array


@dataclass(frozen=True, eq=False)
class _Iterated:
    linear: LinearSolver
    jac: Jacobian

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray | None:
        jac = transpose_of(self.jac) if transposed else self.jac
        return solve_with(self.linear, jac, right)


@dataclass(frozen=True, eq=False)
class Factored:
    """An array by its LU factors."""

    lu: FloatArray
    pivots: FloatArray

    @property
    def sign(self) -> float:
        """Sign of its determinant."""
        swaps = np.count_nonzero(self.pivots != np.arange(self.pivots.size))
        flips = swaps + np.count_nonzero(np.diagonal(self.lu) < 0.0)
        return 1.0 if flips % 2 == 0 else -1.0

    def __call__(self, right: FloatArray, *, transposed: bool = False) -> FloatArray:
        """Solve; see `Inverse`."""
        solution, _ = scipy.linalg.lapack.dgetrs(self.lu, self.pivots, right, trans=int(transposed))
        return np.asarray(solution)


def _factors(matrix: FloatArray) -> tuple[FloatArray | None, FloatArray]:
    """Return LU factors and pivots; None if the matrix is singular to working precision. `matrix` is overwritten."""
    lu, pivots, info = scipy.linalg.lapack.dgetrf(matrix, overwrite_a=True)
    size = np.abs(lu.diagonal())
    # neither NaN nor infinity passes
    usable = info == 0 and size.min() > SINGULAR * size.max()
    return (lu if usable else None), pivots


def solve_signed(matrix: FloatArray, right: FloatArray) -> tuple[FloatArray | None, float]:
    """Solve a dense system by LU and return the sign of its determinant too (0 if singular). `matrix` is overwritten."""
    lu, pivots = _factors(matrix)
    if lu is None:
        return None, 0.0
    known = Factored(lu, pivots)
    return known(right), known.sign


def _array(jac: Jacobian) -> FloatArray:
    array = array_of(jac)
    if array is not None:
        return array
    raise input_error(
        "Newton.linear",
        "Dense needs the Jacobian as an array, and this one is known by its products only",
        "Give a Krylov solver.",
    )
