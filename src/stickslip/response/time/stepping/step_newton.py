"""Newton matrix of a time step: derivatives of the contact forces, LU factors and steps; compiled, without allocations.

In a step, only few of many contacts change their state. The LU is then kept, and the Woodbury formula corrects changed
rows, until they are a quarter of all rows.
"""

# mypy: disallow-untyped-decorators=False

from typing import NamedTuple

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.response.time.stepping.contact_step import JAC, STATES, inner, large

SHARE = 4  # at most one row in SHARE may differ from the LU


class Changes(NamedTuple):
    """Rows in which the Newton matrix differs from the factorised one, at most `most`."""

    base: FloatArray  # (k, 6): slopes in the LU; NaN before the first
    taken: IntArray  # (1,) number of changed rows
    place: IntArray  # (k,) position of a row among the changed ones; -1: unchanged
    row: IntArray  # (most,) indices of the changed rows
    unit: FloatArray  # (most, k): solution by the LU for the unit vector of a changed row
    less: FloatArray  # (most, k): factorised minus present matrix in the changed rows
    cross: FloatArray  # (most, most): less unitᵀ
    small: FloatArray  # (most, most): LU of I - cross, transposed
    pivot: IntArray  # (most,)
    share: FloatArray  # (most,)


class NewtonWork(NamedTuple):
    """Work arrays of the contact solution, so that no step allocates."""

    moved: FloatArray  # (m,) motion at the end of the step, with r held zero there
    free: FloatArray  # (2k,) gaps and rates of this motion
    r: FloatArray  # (k,) iterate
    defect: FloatArray  # (k,)
    moves: FloatArray  # (k,) change of the gaps by the defect
    slope: FloatArray  # (k, 6): derivative of r by gap and rate of its contact
    factored: FloatArray  # (k, 6): slopes in the factors, changed rows included; NaN before the first
    factor: FloatArray  # (k, k) LU of the Newton matrix, transposed for contiguous columns
    pivot: IntArray  # (k,)
    diagonal: FloatArray  # (k,) of the Newton matrix
    stiff: FloatArray  # (1,) largest diagonal entry, at least 1: factor on the rounding of the gaps
    changes: Changes


@inner
def slopes(table, laws, work):  # type: ignore[no-untyped-def]
    """Write the derivatives of r; return whether the factors already contain them."""
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


@inner
def _column(i, b, k):  # type: ignore[no-untyped-def]
    """Return the index in the response of the gap (b < 3) or rate on which row i depends."""
    first = 3 * (i // 3)
    return first + b if b < 3 else k + first + b - 3


@large
def factor_anew(ops, work):  # type: ignore[no-untyped-def]
    """Factor ``I - slope response``."""
    k = work.r.size
    lu, changes = work.factor, work.changes
    for i in range(k):
        for j in range(k):
            lu[j, i] = 1.0 if i == j else 0.0
        for b in range(6):
            slope = work.slope[i, b]
            work.factored[i, b] = changes.base[i, b] = slope
            if slope != 0.0:
                column = _column(i, b, k)
                for j in range(k):
                    lu[j, i] -= slope * ops.response[j, column]
        work.diagonal[i], changes.place[i] = lu[i, i], -1
    changes.taken[0] = 0
    _take_stiffest(work)
    _factor(lu, work.pivot, k)


@inner
def _take_stiffest(work):  # type: ignore[no-untyped-def]
    work.stiff[0] = 1.0
    for i in range(work.r.size):
        work.stiff[0] = max(work.stiff[0], abs(work.diagonal[i]))


@inner
def _room(work):  # type: ignore[no-untyped-def]
    """Whether all rows that differ from the LU fit into the changes."""
    changes = work.changes
    count, most = changes.taken[0], changes.row.size
    if most == 0 or np.isnan(changes.base[0, 0]):
        return False
    for i in range(work.r.size):
        if changes.place[i] < 0:
            for b in range(6):
                if work.slope[i, b] != changes.base[i, b]:
                    count += 1
                    break
    return count <= most


@inner
def _is_factored(work, i):  # type: ignore[no-untyped-def]
    same = True
    for b in range(6):
        same = same and work.slope[i, b] == work.factored[i, b]
    return same


@inner
def _change_row(ops, work, i):  # type: ignore[no-untyped-def]
    """Write the difference of row i between LU and matrix; solve for the unit vector of a new row; return its index."""
    k, changes = work.r.size, work.changes
    at = changes.place[i]
    if at < 0:
        at = changes.place[i] = changes.taken[0]
        changes.row[at] = i
        changes.taken[0] += 1
        for j in range(k):
            changes.unit[at, j] = 1.0 if i == j else 0.0
        _substitute(work.factor, work.pivot, changes.unit[at], k)
    work.diagonal[i] = 1.0
    for j in range(k):
        changes.less[at, j] = 0.0
    for b in range(6):
        slope = work.factored[i, b] = work.slope[i, b]
        change = slope - changes.base[i, b]
        column = _column(i, b, k)
        work.diagonal[i] -= slope * ops.response[i, column]
        if change != 0.0:
            for j in range(k):
                changes.less[at, j] += change * ops.response[j, column]
    return at


@large
def factor_slopes(ops, work):  # type: ignore[no-untyped-def]
    """Update the factors to the slopes: changed rows are corrected, or the matrix is factorised anew."""
    if not _room(work):
        factor_anew(ops, work)
        return
    k, changes = work.r.size, work.changes
    before = changes.taken[0]
    for i in range(k):
        if not _is_factored(work, i):
            at = _change_row(ops, work, i)
            for other in range(before):
                changes.cross[at, other] = dot(changes.less[at], changes.unit[other])
    _take_stiffest(work)
    taken = changes.taken[0]
    for at in range(taken):
        for other in range(before, taken):
            changes.cross[at, other] = dot(changes.less[at], changes.unit[other])
        for other in range(taken):
            changes.small[other, at] = (1.0 if at == other else 0.0) - changes.cross[at, other]
    _factor(changes.small, changes.pivot, taken)


@inner
def dot(a, b):  # type: ignore[no-untyped-def]
    """Return the product of two vectors."""
    whole = a.size - a.size % 4
    p, q, r, s = 0.0, 0.0, 0.0, 0.0  # four independent sums for instruction-level parallelism
    for i in range(0, whole, 4):
        p += a[i] * b[i]
        q += a[i + 1] * b[i + 1]
        r += a[i + 2] * b[i + 2]
        s += a[i + 3] * b[i + 3]
    for i in range(whole, a.size):
        p += a[i] * b[i]
    return p + q + r + s


@large
def _factor(lu, pivot, k):  # type: ignore[no-untyped-def]
    """Factorise the first k rows and columns of a transposed matrix by LU with row pivoting."""
    for j in range(k):
        best = j
        for i in range(j + 1, k):
            if abs(lu[j, i]) > abs(lu[j, best]):
                best = i
        pivot[j] = best
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


@large
def _substitute(lu, pivot, x, k):  # type: ignore[no-untyped-def]
    for j in range(k):
        x[j], x[pivot[j]] = x[pivot[j]], x[j]
    for j in range(k):
        known = x[j]
        for i in range(j + 1, k):
            x[i] -= lu[j, i] * known
    for j in range(k - 1, -1, -1):
        x[j] /= lu[j, j]
        known = x[j]
        for i in range(j):
            x[i] -= lu[j, i] * known


@inner
def back_substitute(work):  # type: ignore[no-untyped-def]
    """Overwrite the defect with the Newton step that removes it."""
    k, x, changes = work.r.size, work.defect, work.changes
    _substitute(work.factor, work.pivot, x, k)
    count, share = changes.taken[0], changes.share
    if count == 0:
        return
    for at in range(count):
        share[at] = dot(changes.less[at], x)
    _substitute(changes.small, changes.pivot, share, count)
    for at in range(count):
        for i in range(k):
            x[i] += changes.unit[at, i] * share[at]


def newton_work(m: int, k: int) -> NewtonWork:
    """Return arrays for m coordinates of motion and k gaps."""
    most = k // SHARE
    changes = Changes(
        np.full((k, 6), np.nan),
        np.zeros(1, dtype=np.int64),
        np.full(k, -1),
        np.zeros(most, dtype=np.int64),
        np.zeros((most, k)),
        np.zeros((most, k)),
        np.zeros((most, most)),
        np.zeros((most, most)),
        np.zeros(most, dtype=np.int64),
        np.zeros(most),
    )
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
        np.zeros(k),
        np.ones(1),
        changes,
    )
