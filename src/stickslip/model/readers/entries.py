"""Symmetric matrices from lists of entries (row, column, value), checked."""

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error

SYMMETRY = 1e-9  # relative to the largest entry: the text formats carry 14 digits or more


def check_range(rows: IntArray, columns: IntArray, n: int, place: str) -> None:
    """Refuse entries outside an (n, n) matrix, before memory of its size is allocated."""
    wrong = np.flatnonzero((rows < 0) | (rows >= n) | (columns < 0) | (columns >= n))
    if wrong.size:
        i = wrong[0]
        raise input_error(
            f"{place}: entry {i + 1}",
            f"row {rows[i] + 1}, column {columns[i] + 1} is outside a matrix of {n} equations",
            "The matrix and the list of its dofs belong to different runs, or one is cut short.",
        )


def check_unique(rows: IntArray, columns: IntArray, n: int, place: str) -> None:
    """Refuse entries that are given twice."""
    key = np.sort(np.asarray(rows, dtype=np.int64) * n + columns)  # 32-bit indices of files would overflow
    twice = np.flatnonzero(np.diff(key) == 0)
    if twice.size:
        row, column = divmod(int(key[twice[0]]), n)
        raise input_error(
            place,
            f"gives row {row + 1}, column {column + 1} more than once ({twice.size} such entries)",
            "Write each entry once; the file may hold several matrices.",
        )


def from_triangle(rows: IntArray, columns: IntArray, values: FloatArray, n: int, place: str) -> Matrix:
    """Return the symmetric (n, n) CSR matrix from one triangle or from all entries.

    Parameters
    ----------
    rows, columns
        (k,) indices from 0; the upper triangle, the lower, or both.
    values
        (k,) entries.
    n
        Size.
    place
        Place of the matrix, for messages.

    Raises
    ------
    InputError
        If an entry is out of range or given twice, or two mirrored entries differ.
    """
    check_range(rows, columns, n, place)
    check_unique(rows, columns, n, place)
    matrix = scipy.sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()
    above, below = bool((rows < columns).any()), bool((rows > columns).any())
    if above and below:
        check_symmetric(matrix, place)
        return matrix
    diagonal = scipy.sparse.diags_array(matrix.diagonal())
    return scipy.sparse.csr_array(matrix + matrix.T - diagonal)


def asymmetry(matrix: Matrix) -> float:
    """Return the largest difference between mirrored entries, over the largest entry."""
    largest = float(abs(matrix).max()) if matrix.shape[0] else 0.0
    return float(abs(matrix - matrix.conj().T).max()) / largest if largest else 0.0


def check_symmetric(matrix: Matrix, place: str) -> None:
    """Refuse a matrix that is not Hermitian; the message names the worst pair."""
    if asymmetry(matrix) <= SYMMETRY:
        return
    if np.iscomplexobj(matrix) and abs(matrix - matrix.T).max() == 0:
        raise input_error(
            place,
            "is complex and symmetric, as K (1 + i η) is; a matrix without loss is Hermitian",
            "Write its real part, and give the loss as loss_factor in the damping of the part.",
        )
    difference = scipy.sparse.csr_array(abs(matrix - matrix.conj().T))
    row, column = divmod(int(difference.argmax()), matrix.shape[0])
    raise input_error(
        place,
        f"is not symmetric: row {row + 1}, column {column + 1} and its mirror are "
        f"{matrix[row, column]:.6g} and {matrix[column, row]:.6g}",
        "Export symmetric matrices; a Coriolis or bearing matrix belongs into the damping.",
    )
