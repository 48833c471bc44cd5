"""Newton's matrix of a time step: derivatives of the contact forces at its end, LU, and steps with it; compiled, without allocations."""

# mypy: disallow-untyped-decorators=False

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.response.time.contact_step import JAC, STATES, inner, large


class NewtonWork(NamedTuple):
    """Arrays that the contact solve writes to, so that no step allocates."""

    moved: FloatArray  # (m,) motion at the end of the step, with r held zero there
    free: FloatArray  # (2k,) gaps and rates then
    r: FloatArray  # (k,) iterate
    defect: FloatArray  # (k,)
    moves: FloatArray  # (k,) change of the gaps by the defect
    slope: FloatArray  # (k, 6): derivative of r by gap and rate of its contact
    factored: FloatArray  # (k, 6): the slopes that the LU belongs to; NaN before the first
    factor: FloatArray  # (k, k) LU of the Newton matrix, transposed: its columns lie together
    pivot: IntArray  # (k,)
    stiff: FloatArray  # (1,) by how much more a gap would move if the laws did not hold against it: how much rounding counts


@inner
def slopes(table, laws, work):  # type: ignore[no-untyped-def]
    """Write the derivatives of r; return whether the LU belongs to them."""
    same = True
    for c in range(table.weight.size):
        columns = 6 + table.places[STATES, c + 1] - table.places[STATES, c]
        for d in range(3):
            row = 3 * c + d
            for j in range(6):
                value = laws.jac[table.places[JAC, c] + d * columns + j]
                if j == d:
                    value -= table.springs[row]
                work.slope[row, j] = value
                same = same and value == work.factored[row, j]
    return same


@large
def newton_matrix(ops, work):  # type: ignore[no-untyped-def]
    """Write the transpose of ``I - slope response`` where its LU will be."""
    k = work.r.size
    lu = work.factor
    work.stiff[0] = 1.0
    for i in range(k):
        first = 3 * (i // 3)
        for j in range(k):
            lu[j, i] = 1.0 if i == j else 0.0
        for b in range(6):
            slope = work.slope[i, b]
            work.factored[i, b] = slope
            if slope != 0.0:
                column = first + b if b < 3 else k + first + b - 3
                for j in range(k):
                    lu[j, i] -= slope * ops.response[j, column]
        work.stiff[0] = max(work.stiff[0], abs(lu[i, i]))


@large
def factor(work):  # type: ignore[no-untyped-def]
    """LU with row pivoting, transposed, kept for as long as no slope changes."""
    k = work.r.size
    lu = work.factor
    for j in range(k):
        best = j
        for i in range(j + 1, k):
            if abs(lu[j, i]) > abs(lu[j, best]):
                best = i
        work.pivot[j] = best
        if best != j:
            for col in range(k):
                lu[col, j], lu[col, best] = lu[col, best], lu[col, j]
        for i in range(j + 1, k):
            lu[j, i] /= lu[j, j]
        for col in range(j + 1, k):
            factor = lu[col, j]
            if factor != 0.0:
                for i in range(j + 1, k):
                    lu[col, i] -= lu[j, i] * factor


@inner
def back_substitute(work):  # type: ignore[no-untyped-def]
    """Overwrite the defect with the Newton step that removes it."""
    k = work.r.size
    lu, x = work.factor, work.defect
    for j in range(k):
        x[j], x[work.pivot[j]] = x[work.pivot[j]], x[j]
    for j in range(k):
        known = x[j]
        for i in range(j + 1, k):
            x[i] -= lu[j, i] * known
    for j in range(k - 1, -1, -1):
        x[j] /= lu[j, j]
        known = x[j]
        for i in range(j):
            x[i] -= lu[j, i] * known


def newton_work(m: int, k: int) -> NewtonWork:
    """Return arrays for m coordinates of motion and k gaps."""
    return NewtonWork(
        np.zeros(m),
        np.zeros(2 * k),
        np.zeros(k),
        np.zeros(k),
        np.zeros(k),
        np.zeros((k, 6)),
        np.full((k, 6), np.nan),
        np.zeros((k, k)),
        np.zeros(k, dtype=np.int64),
        np.ones(1),
    )
