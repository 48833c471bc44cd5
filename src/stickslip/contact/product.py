"""Product of the contact stiffness ``Bᵀ K B`` with a vector, contact by contact, without forming it.

The derivative of a contact's forces by its gaps is a few (m, m) blocks, m = 2H+1, in the order of `PAIRS`.
"""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.cache import njit
from stickslip.contact.law import PAIRS

_PAIRS = np.array(PAIRS)  # force and gap direction of each block
_SUMS = {"reassoc", "contract"}  # sums may be reordered: otherwise they are not vectorised


@njit(cache=True, nogil=True)
def _gap(columns, values, vector, gap):  # type: ignore[no-untyped-def]
    """Set `gap` (3, m) to the gap of coordinates `vector` (m, n) at one contact."""
    gap[:] = 0.0
    for j in range(columns.size):
        for d in range(3):
            value = values[d, j]
            if value != 0.0:
                for q in range(gap.shape[1]):
                    gap[d, q] += value * vector[q, columns[j]]


@njit(cache=True, nogil=True, fastmath=_SUMS)
def _force(blocks, gap, transposed, force):  # type: ignore[no-untyped-def]
    """Set `force` (3, m) to the product of the blocks of one contact with `gap`."""
    m = gap.shape[1]
    force[:] = 0.0
    for b in range(blocks.shape[0]):
        row, col = _PAIRS[b, 0], _PAIRS[b, 1]
        for p in range(m):
            if transposed:
                for q in range(m):
                    force[col, q] += blocks[b, p, q] * gap[row, p]
            else:
                total = 0.0
                for q in range(m):
                    total += blocks[b, p, q] * gap[col, q]
                force[row, p] += total


@njit(cache=True, nogil=True)
def contact_product(blocks, columns, values, vector, transposed, gap, force, out):  # type: ignore[no-untyped-def]
    """Add ``Bᵀ K B v`` to `out`, or ``Bᵀ Kᵀ B v`` if `transposed`.

    Parameters
    ----------
    blocks
        (n_contacts, P, m, m) derivatives of the contact forces, N/m.
    columns, values
        The gap operator by contact, from `sparse_rows`.
    vector
        (m, n) harmonic-major coefficients of the coordinates.
    transposed
        Whether the transposed stiffness acts.
    gap, force
        Work: (3, m) each.
    out
        In and out: (m, n).
    """
    for c in range(blocks.shape[0]):
        _gap(columns[c], values[c], vector, gap)
        _force(blocks[c], gap, transposed, force)
        for j in range(columns.shape[1]):
            for d in range(3):
                value = values[c, d, j]
                if value != 0.0:
                    for p in range(out.shape[0]):
                        out[p, columns[c, j]] += value * force[d, p]


@njit(cache=True, nogil=True, fastmath=_SUMS)
def subtract_lower(blocks, columns, values, vector, before, first, last, factor, gap, out):  # type: ignore[no-untyped-def]
    """Subtract the part of ``factor Bᵀ K B v`` due to coefficients before `first` from rows `first` to `last` of `out`.

    Parameters
    ----------
    blocks, columns, values
        As in `contact_product`.
    vector
        (m, n) coefficients of the coordinates; only those before `first` are read.
    before, first, last
        `gap` already contains the gaps of the rows before `before`; the gaps of the rows from there to `first` are
        added.
    factor
        Scale of the result.
    gap
        In and out: (n_contacts, 3, m).
    out
        In and out: (m, n).
    """
    for c in range(blocks.shape[0]):
        _gap(columns[c], values[c], vector[before:first], gap[c, :, before:first])
        for b in range(blocks.shape[1]):
            row, col = _PAIRS[b, 0], _PAIRS[b, 1]
            for p in range(first, last):
                total = 0.0
                for q in range(first):
                    total += blocks[c, b, p, q] * gap[c, col, q]
                if total != 0.0:
                    for j in range(columns.shape[1]):
                        out[p, columns[c, j]] -= factor * values[c, row, j] * total


@njit(cache=True, nogil=True)
def _multiply(real, imaginary, h, rows, out):  # type: ignore[no-untyped-def]
    """Set the rows of harmonic `h` of `out` to the product with the same rows of `rows`.

    Both may be the same array, for one row only.
    """
    n = rows.shape[1]
    first = max(2 * h - 1, 0)
    if h == 0:
        out[0] = 0.0
        for k in range(n):
            c = rows[0, k]
            for j in range(n):
                out[0, j] += real[0, k, j] * c
        return
    out[first : first + 2] = 0.0
    for k in range(n):
        c, s = rows[first, k], rows[first + 1, k]
        for j in range(n):
            a, b = real[h, k, j], imaginary[h, k, j]
            out[first, j] += a * c + b * s
            out[first + 1, j] += a * s - b * c


@njit(cache=True, nogil=True)
def multiply_blocks(real, imaginary, rows, out):  # type: ignore[no-untyped-def]
    """Set `out` (m, n) to the products with `rows` (m, n); see `stickslip.harmonic.matrix_products`."""
    for h in range(real.shape[0]):
        _multiply(real, imaginary, h, rows, out)


@njit(cache=True, nogil=True)
def _own_less_mean(block, real, imaginary, p, q):  # type: ignore[no-untyped-def]
    """Return an entry of a block within one harmonic, minus the mean of that harmonic."""
    if p == q:
        return block[p, q] - real
    return block[p, q] - imaginary if q > p else block[p, q] + imaginary


@njit(cache=True, nogil=True)
def _any_below(block):  # type: ignore[no-untyped-def]
    """Return whether a force depends on harmonics below its own."""
    for p in range(1, block.shape[0]):
        for q in range(2 * ((p + 1) // 2) - 1):
            if block[p, q] != 0.0:
                return True
    return False


@njit(cache=True, nogil=True)
def _any_above(block, real, imaginary):  # type: ignore[no-untyped-def]
    """Return whether a force depends on its own harmonic (beyond the means (H+1,)) or on higher ones."""
    for p in range(block.shape[0]):
        h = (p + 1) // 2
        for q in range(max(2 * h - 1, 0), 2 * h + 1):
            if _own_less_mean(block, real[h], imaginary[h], p, q) != 0.0:
                return True
        for q in range(2 * h + 1, block.shape[0]):
            if block[p, q] != 0.0:
                return True
    return False


@njit(cache=True, nogil=True)
def _filled(blocks, real, imaginary, below, above):  # type: ignore[no-untyped-def]
    """Fill, for each block (n_contacts, P), whether it has entries in the lower and in the upper triangle.

    The upper triangle includes the diagonal harmonics, except for the means.
    """
    for c in range(blocks.shape[0]):
        for b in range(blocks.shape[1]):
            row, col = _PAIRS[b, 0], _PAIRS[b, 1]
            below[c, b] = _any_below(blocks[c, b])
            above[c, b] = _any_above(blocks[c, b], real[:, c, row, col], imaginary[:, c, row, col])


@njit(cache=True, nogil=True)
def _laid_out(blocks, real, imaginary, below, lower, above, upper):  # type: ignore[no-untyped-def]
    """Copy the entries of the pairs `below` and `above`, (k, 2) each, in the order of `sweep` and `add_upper`."""
    m = blocks.shape[2]
    i = 0
    for h in range(1, (m + 1) // 2):
        first = 2 * h - 1
        for k in range(below.shape[0]):
            block = blocks[below[k, 0], below[k, 1]]
            for p in range(first, first + 2):
                lower[i : i + first] = block[p, :first]
                i += first
    i = 0
    for k in range(above.shape[0]):
        c, b = above[k, 0], above[k, 1]
        row, col = _PAIRS[b, 0], _PAIRS[b, 1]
        for p in range(m):
            h = (p + 1) // 2
            first = max(2 * h - 1, 0)
            upper[i : i + m - first] = blocks[c, b, p, first:]
            for q in range(first, 2 * h + 1):
                upper[i + q - first] = _own_less_mean(
                    blocks[c, b], real[h, c, row, col], imaginary[h, c, row, col], p, q
                )
            i += m - first


@dataclass(frozen=True, eq=False)
class Triangles:
    """Lower and upper triangle of the contact Jacobian by harmonics, stored for repeated products of a Krylov method.

    Attributes
    ----------
    below, above
        (k, 2) contacts and blocks with entries in each triangle; stuck and open contacts have none.
    lower, upper
        The entries in sequence: of `lower` harmonic by harmonic, of `upper` block by block; N/m.
    """

    below: IntArray
    lower: FloatArray
    above: IntArray
    upper: FloatArray


def triangles(blocks: FloatArray, means: ComplexArray) -> Triangles:
    """Split the derivatives of contact forces into both triangles.

    Parameters
    ----------
    blocks
        (n_contacts, P, m, m), N/m.
    means
        (H+1, n_contacts, 3, 3) part of each harmonic's own entries that is left out, see `harmonic_means`.
    """
    real, imaginary = np.ascontiguousarray(means.real), np.ascontiguousarray(means.imag)
    m = blocks.shape[2]
    filled = np.empty((2, *blocks.shape[:2]), dtype=bool)
    _filled(blocks, real, imaginary, *filled)
    below, above = (np.argwhere(which) for which in filled)
    lower = np.empty(len(below) * (m - 1) ** 2 // 2)
    upper = np.empty(len(above) * (m * m - (m - 1) ** 2 // 2))
    _laid_out(blocks, real, imaginary, below, lower, above, upper)
    return Triangles(below, lower, above, upper)


@njit(cache=True, nogil=True, fastmath=_SUMS)
def _product_of(one, other):  # type: ignore[no-untyped-def]
    """Return the sum of the products of the entries of `one` with the first entries of `other`."""
    total = 0.0
    for q in range(one.size):
        total += one[q] * other[q]
    return total


@njit(cache=True, nogil=True, fastmath=_SUMS)
def _push(force, columns, values, factor, first, last, out):  # type: ignore[no-untyped-def]
    """Add the forces (n_contacts, 3, m) on the coordinates, times a factor, to the rows `first` to `last` of `out`."""
    for c in range(columns.shape[0]):
        for j in range(columns.shape[1]):
            for d in range(3):
                value = factor * values[c, d, j]
                if value != 0.0:
                    for p in range(first, last):
                        out[p, columns[c, j]] += value * force[c, d, p]


@njit(cache=True, nogil=True, fastmath=_SUMS)
def add_upper(above, upper, columns, values, scale, vector, gap, force, out):  # type: ignore[no-untyped-def]
    """Add to `out` the contact forces of each harmonic due to gaps of the same and of higher harmonics.

    Parameters
    ----------
    above, upper
        Fields of `Triangles`.
    columns, values, scale
        As in `subtract_lower`.
    vector
        (m, n) coefficients of the coordinates.
    gap, force
        Work: (n_contacts, 3, m) each.
    out
        In and out: (m, n).
    """
    m = vector.shape[0]
    for c in range(columns.shape[0]):
        _gap(columns[c], values[c], vector, gap[c])
    force[:] = 0.0
    i = 0
    for k in range(above.shape[0]):
        c, row, col = above[k, 0], _PAIRS[above[k, 1], 0], _PAIRS[above[k, 1], 1]
        for p in range(m):
            first = max(2 * ((p + 1) // 2) - 1, 0)
            force[c, row, p] += _product_of(upper[i : i + m - first], gap[c, col, first:])
            i += m - first
    _push(force, columns, values, scale, 0, m, out)


@njit(cache=True, nogil=True, fastmath=_SUMS)
def sweep(real, imaginary, below, lower, columns, values, scale, rows, gap, force, out):  # type: ignore[no-untyped-def]
    """Solve harmonic by harmonic, from the static one up, including the contact forces due to lower harmonics.

    Parameters
    ----------
    real, imaginary
        Inverses of the harmonics' matrices, in the form of `harmonic.matrix_products.SmallBlocks`.
    below, lower
        Fields of `Triangles`.
    columns, values, scale
        As in `subtract_lower`.
    rows
        (m, n) right side; overwritten.
    gap, force
        Work: (n_contacts, 3, m) each.
    out
        Out: (m, n) solution.
    """
    before = first = i = 0
    for h in range(real.shape[0]):
        last = 2 * h + 1
        if first > 0:
            for c in range(columns.shape[0]):
                _gap(columns[c], values[c], out[before:first], gap[c, :, before:first])
            force[:, :, first:last] = 0.0
            for k in range(below.shape[0]):
                c, row, col = below[k, 0], _PAIRS[below[k, 1], 0], _PAIRS[below[k, 1], 1]
                for p in range(first, last):
                    force[c, row, p] += _product_of(lower[i : i + first], gap[c, col])
                    i += first
            # forces due to solved rows are subtracted from rows that are not solved yet
            _push(force, columns, values, -scale, first, last, rows)
        _multiply(real, imaginary, h, rows, out)
        before, first = first, last


def harmonic_means(blocks: FloatArray) -> ComplexArray:
    """Return the complex factors by which each harmonic of a force depends on the same harmonic of a gap.

    A block acts on ``(C_h, S_h)`` as a real 2 × 2 matrix ``[a b; c d]``; the closest multiplication of ``C_h - i S_h``
    by a complex number has the factor ``(a + d)/2 + i (b - c)/2``.

    Parameters
    ----------
    blocks
        (n_contacts, P, 2H+1, 2H+1) derivatives of the contact forces, N/m.

    Returns
    -------
    ndarray
        (H+1, n_contacts, 3, 3) by harmonic, contact, force and gap, N/m; harmonic 0 is real.
    """
    n_contacts, n_pairs, m, _ = blocks.shape
    diagonal = np.diagonal(blocks, axis1=2, axis2=3)
    above = np.diagonal(blocks, offset=1, axis1=2, axis2=3)[:, :, 1::2]
    below = np.diagonal(blocks, offset=-1, axis1=2, axis2=3)[:, :, 1::2]
    real = 0.5 * (diagonal[:, :, 1::2] + diagonal[:, :, 2::2])
    mean = np.concatenate([diagonal[:, :, :1], real + 0.5j * (above - below)], axis=2)
    means = np.zeros(((m + 1) // 2, n_contacts, 3, 3), dtype=complex)
    for pair, (force, gap) in enumerate(_PAIRS[:n_pairs]):
        means[:, :, force, gap] = mean[:, pair].T
    return means


def less_means(blocks: FloatArray, means: ComplexArray) -> FloatArray:
    """Return `blocks` minus the part that `means` represent.

    The means come from `harmonic_means`, possibly of other blocks.
    """
    left = blocks.copy()
    for pair, (force, gap) in enumerate(_PAIRS[: blocks.shape[1]]):
        mean = means[:, :, force, gap].T
        block = left[:, pair]
        block[:, 0, 0] -= mean[:, 0].real
        for h in range(1, means.shape[0]):
            cos, sin = 2 * h - 1, 2 * h
            block[:, cos, cos] -= mean[:, h].real
            block[:, sin, sin] -= mean[:, h].real
            block[:, cos, sin] -= mean[:, h].imag
            block[:, sin, cos] += mean[:, h].imag
    return left


@njit(cache=True, nogil=True)
def _add_stiffness(stiffness, columns, values, forces, out):  # type: ignore[no-untyped-def]
    """Add ``Bᵀ k B`` of all contacts to `out` (n, n).

    `forces` (3, k) is a work array: forces at one contact due to unit coordinates.
    """
    for c in range(columns.shape[0]):
        for d in range(3):
            for j in range(columns.shape[1]):
                total = stiffness[c, d, 0] * values[c, 0, j]
                total += stiffness[c, d, 1] * values[c, 1, j]
                forces[d, j] = total + stiffness[c, d, 2] * values[c, 2, j]
        for j in range(columns.shape[1]):
            for i in range(columns.shape[1]):
                own = values[c, 0, i] * forces[0, j] + values[c, 1, i] * forces[1, j] + values[c, 2, i] * forces[2, j]
                out[columns[c, i], columns[c, j]] += own


def add_stiffness(
    stiffness: FloatArray | ComplexArray, columns: IntArray, values: FloatArray, out: FloatArray | ComplexArray
) -> None:
    """Add ``Bᵀ k B`` to the (n, n) matrix `out`, with one (3, 3) matrix ``k`` per contact.

    Parameters
    ----------
    stiffness
        (n_contacts, 3, 3) by contact, force and gap.
    columns, values
        The gap operator by contact, from `sparse_rows`.
    out
        In and out: (n, n).
    """
    forces = np.empty((3, columns.shape[1]), dtype=stiffness.dtype)
    _add_stiffness(stiffness, columns, values, forces, out)
