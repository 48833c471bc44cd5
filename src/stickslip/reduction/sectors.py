"""All sectors of a wheel, each on its own coordinates in its own axes, from the waves.

M. Krack, L. Salles and F. Thouverez, "Vibration prediction of bladed disks coupled by friction joints", Archives of
Computational Methods in Engineering 24 (2017) 589-636, appendix 1.
"""

from collections.abc import Sequence

import numpy as np
import scipy

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix

ROUNDING = 1e-12  # imaginary part over the largest entry: below, what waves make of real sectors is real


def couplings(waves: Sequence[Matrix]) -> Matrix:
    """Return what sector n feels of sector n - d, for each distance d (eq. 41).

    Parameters
    ----------
    waves
        The (a, b) matrices of the wave numbers 0 to n_s - 1.

    Returns
    -------
    numpy.ndarray
        (n_s, a, b), entry d for the sector d places behind; real where opposite waves are conjugates.
    """
    dense = np.array([w.toarray() if scipy.sparse.issparse(w) else w for w in waves])
    found = np.fft.ifft(dense, axis=0)
    real = np.abs(found.imag).max(initial=0.0) <= ROUNDING * np.abs(found.real).max(initial=0.0)
    return np.ascontiguousarray(found.real) if real else found


def circulant(blocks: Matrix) -> Matrix:
    """Return the (n_s a, n_s b) matrix of all sectors from their `couplings` (n_s, a, b)."""
    count, rows, columns = blocks.shape
    behind = (np.arange(count)[:, None] - np.arange(count)) % count
    return blocks[behind].transpose(0, 2, 1, 3).reshape(count * rows, count * columns)


def strip(blocks: Matrix, sector: int) -> Matrix:
    """Return the rows (a, n_s b) of one sector of `circulant`."""
    behind = (sector - np.arange(len(blocks))) % len(blocks)
    rows, columns = blocks.shape[1:]
    return blocks[behind].transpose(1, 0, 2).reshape(rows, len(blocks) * columns)


def repeated(operators: Sequence[Matrix], sectors: int) -> Matrix:
    """Return the CSR operator of all sectors from that of one on itself, on the next sector, on the one after it and so on.

    Parameters
    ----------
    operators
        (r, m) each, on the sectors 0, 1, 2, ... places ahead.
    sectors
        Their number n_s; rows and columns go sector by sector.
    """
    rows, columns = operators[0].shape
    entries: list[tuple[FloatArray, IntArray, IntArray]] = []
    for ahead, operator in enumerate(operators):
        own = scipy.sparse.csr_array(operator).tocoo()
        for n in range(sectors):
            other = (n + ahead) % sectors
            entries.append((own.data, own.row + n * rows, own.col + other * columns))
    data, row, column = (np.concatenate(part) for part in zip(*entries, strict=True))
    shape = (sectors * rows, sectors * columns)
    return scipy.sparse.csr_array((data, (row, column)), shape=shape)


def travelling(force: Matrix, phase_angle: float, sectors: int) -> ComplexArray:
    """Return the load on all sectors of a load (m,) on one, of which each leads the one before it by a phase."""
    return np.asarray(np.outer(np.exp(1j * phase_angle * np.arange(sectors)), force).ravel())


def of_alike(blocks: Matrix, gram: Matrix, factors: FloatArray) -> FloatArray:
    """Return ``Σ_n factors_n T_nᵀ A T_n`` of a matrix A that is the same in all sectors.

    Parameters
    ----------
    blocks
        (n_s, r, m) couplings that lead from all coordinates to the r rows on which A acts, T_n of sector n.
    gram
        (r, r) symmetric A, or a function ``rows -> A @ rows``.
    factors
        (n_s,) of each sector.
    """
    count, _, m = blocks.shape
    first = strip(blocks, 0)
    product = gram(first) if callable(gram) else gram @ first
    whole = (first.T @ product).reshape(count, m, count, m)  # of sector 0
    out = np.zeros_like(whole)
    for n in np.flatnonzero(factors):
        place = (np.arange(count) - n) % count  # what sector 0 sees of sector p - n, sector n sees of p
        out += factors[n] * whole[place][:, :, place]
    return np.asarray(out.reshape(count * m, count * m))
