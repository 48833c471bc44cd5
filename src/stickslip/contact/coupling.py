"""Coupling of harmonics by contacts: the coupled rows of the derivatives, and their contribution to the Jacobian.

A contact that sticks or is open throughout the period responds to each harmonic of a gap with the same harmonic of a
force, by a complex factor. A slipping contact couples the harmonics of its tangential forces with those of all gaps;
its normal force couples nothing while it stays closed.
"""

import numpy as np

from stickslip.contact.cache import njit
from stickslip.contact.law import PAIRS

_PAIRS = np.array(PAIRS)  # force and gap direction of each block


@njit(cache=True, nogil=True)
def _strays(block, p):  # type: ignore[no-untyped-def]
    """Return the deviation of the rows of a harmonic in a block from the form of a complex number.

    Row `p` is the cosine row of the harmonic, and the sine row follows.
    """
    h, rest = (p + 1) // 2, 0.0
    for row in range(p, p + (1 if p == 0 else 2)):
        for q in range(block.shape[1]):
            if (q + 1) // 2 != h:
                rest = max(rest, abs(block[row, q]))
    if p > 0:
        rest = max(rest, abs(block[p, p] - block[p + 1, p + 1]))
        rest = max(rest, abs(block[p, p + 1] + block[p + 1, p]))
    return rest


@njit(cache=True, nogil=True)
def _split(block, coupled, mean, left):  # type: ignore[no-untyped-def]
    """Copy the `coupled` (H+1,) rows of a block to `left` (m, m), the complex numbers of others to `mean` (H+1,)."""
    left[:] = 0.0
    for h in range(coupled.size):
        p = max(2 * h - 1, 0)
        if coupled[h]:
            left[p : 2 * h + 1] = block[p : 2 * h + 1]
        elif h == 0:
            mean[0] = block[0, 0]
        else:
            real = 0.5 * (block[p, p] + block[p + 1, p + 1])
            mean[h] = real + 0.5j * (block[p, p + 1] - block[p + 1, p])


@njit(cache=True, nogil=True)
def couplings(blocks, rounding, means, left, coupled):  # type: ignore[no-untyped-def]
    """Separate contact forces that depend on other harmonics from forces that do not.

    Parameters
    ----------
    blocks
        (n_contacts, P, m, m) derivatives of the contact forces, N/m, in the order of `PAIRS`.
    rounding
        Share of a contact's largest derivative that counts as zero.
    means
        Out: (H+1, n_contacts, 3, 3) complex derivatives of a harmonic of a force by the same harmonic of a gap, N/m;
        zero if the force is coupled.
    left
        Out: (n_contacts, P, m, m) derivatives of coupled forces, N/m, else zero.
    coupled
        Out: (n_contacts, 3, H+1) whether a harmonic of a force depends on other harmonics of the gaps.
    """
    n_contacts, n_pairs = blocks.shape[:2]
    coupled[:] = False
    means[:] = 0.0
    for c in range(n_contacts):
        least = rounding * np.abs(blocks[c]).max()
        for b in range(n_pairs):
            row = _PAIRS[b, 0]
            for h in range(means.shape[0]):
                # NaN counts as coupled, so that nothing is eliminated wrongly
                if not _strays(blocks[c, b], max(2 * h - 1, 0)) <= least:
                    coupled[c, row, h] = True
        for b in range(n_pairs):
            row, col = _PAIRS[b, 0], _PAIRS[b, 1]
            _split(blocks[c, b], coupled[c, row], means[:, c, row, col], left[c, b])


@njit(cache=True, nogil=True)
def touched(coupled, columns, values, out):  # type: ignore[no-untyped-def]
    """Fill `out` (H+1, n): whether the equation of a coordinate in a harmonic contains a `coupled` force.

    `columns` and `values` come from `sparse_rows`.
    """
    out[:] = False
    for c in range(columns.shape[0]):
        for d in range(3):
            for h in range(coupled.shape[2]):
                if coupled[c, d, h]:
                    for j in range(columns.shape[1]):
                        if values[c, d, j] != 0.0:
                            out[h, columns[c, j]] = True


@njit(cache=True, nogil=True)
def _followed(columns, values, real, imaginary, kept, gap):  # type: ignore[no-untyped-def]
    """Set `gap` (2, 3, H+1, most) to the gaps of one contact due to unit amplitudes of the kept coordinates.

    The first index is for real and imaginary parts.
    """
    gap[:] = 0.0
    for d in range(3):
        for j in range(columns.size):
            value = values[d, j]
            if value != 0.0:
                for h in range(kept.size):
                    for a in range(kept[h]):
                        gap[0, d, h, a] += value * real[h, columns[j], a]
                        gap[1, d, h, a] += value * imaginary[h, columns[j], a]


@njit(cache=True, nogil=True)
def _add_row(derivative, gap, kept, first, line):  # type: ignore[no-untyped-def]
    """Add to `line` (N,) the derivatives of a force by the kept unknowns.

    They follow from the derivatives by the gaps (m,) and the `gap` (2, H+1, most) due to each unknown.
    """
    for a in range(kept[0]):
        line[a] += derivative[0] * gap[0, 0, a]
    for h in range(1, kept.size):
        start, count = first[h], kept[h]
        cos, sin = derivative[2 * h - 1], derivative[2 * h]
        for a in range(count):
            re, im = gap[0, h, a], gap[1, h, a]
            line[start + a] += cos * re - sin * im
            line[start + count + a] += cos * im + sin * re


@njit(cache=True, nogil=True)
def _add_force(columns, values, line, place, out):  # type: ignore[no-untyped-def]
    """Add a force, as a row of derivatives by the kept unknowns, to the equations of its coordinates."""
    for j in range(columns.size):
        if values[j] != 0.0:
            equation = out[place[columns[j]]]
            for q in range(line.size):
                equation[q] += values[j] * line[q]


@njit(cache=True, nogil=True)
def add_coupling(left, coupled, columns, values, real, imaginary, kept, first, place, out):  # type: ignore[no-untyped-def]
    """Add the coupled forces as functions of the kept unknowns: ``Bᵀ left B P``.

    Parameters
    ----------
    left, coupled
        Results of `couplings`, in the scale of `out`.
    columns, values
        The gap operator by contact, from `sparse_rows`.
    real, imaginary
        (H+1, n, most) P: all coordinates for unit amplitudes of the kept ones, harmonic by harmonic.
    kept, first
        (H+1,) number of kept coordinates of each harmonic, and position of the first among all kept unknowns.
    place
        (m, n) position of an unknown among the kept ones.
    out
        In and out: (N, N) in C order, a row for each kept equation.
    """
    n_contacts, n_pairs, m, _ = left.shape
    gap = np.empty((2, 3, real.shape[0], real.shape[2]))
    line = np.empty(out.shape[1])
    for c in range(n_contacts):
        if not coupled[c].any():
            continue
        _followed(columns[c], values[c], real, imaginary, kept, gap)
        for row in range(3):
            for p in range(m):
                if not coupled[c, row, (p + 1) // 2]:
                    continue
                line[:] = 0.0
                for b in range(n_pairs):
                    if _PAIRS[b, 0] == row:
                        _add_row(left[c, b, p], gap[:, _PAIRS[b, 1]], kept, first, line)
                _add_force(columns[c], values[c, row], line, place[p], out)
