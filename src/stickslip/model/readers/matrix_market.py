"""Matrix Market files. SciPy's reader ends the whole program on some damaged files, so this one is our own."""

from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.readers.entries import check_range, check_unique
from stickslip.model.readers.text import CUT_SHORT, SHOWN, number_table, read_text, whole_numbers

MOST_EMPTY = 10  # rows an entry above which a size is not believed
FIELDS = {"real": 1, "integer": 1, "double": 1, "complex": 2}  # numbers of a value
SYMMETRIES = ("general", "symmetric", "hermitian", "skew-symmetric")


def read_matrix_market(path: Path, n: int | None) -> Matrix:
    """Return the (n, n) matrix of a Matrix Market file, CSR for the layout ``coordinate``, dense for ``array``.

    Parameters
    ----------
    path
        The file, or the same gzipped.
    n
        Its size, so that nothing is made before the file has said the same; None: the one that it says, if its entries fill it.

    Raises
    ------
    InputError
        If the file is of another kind or size, is cut short, or holds an entry twice.
    """
    text = read_text(path)
    first, _, rest = text.partition("\n")
    words = first.lower().split()
    known = len(words) == 5 and words[3] in FIELDS and words[4] in SYMMETRIES
    if not known or words[:2] != ["%%matrixmarket", "matrix"]:
        raise input_error(
            f"{path}: line 1",
            f"is no Matrix Market matrix of numbers: {first[:SHOWN]!r}",
            "Its first line is %%MatrixMarket matrix coordinate real symmetric, or the like; "
            "matrices of Abaqus are read by read_abaqus_matrices.",
        )
    # comments become empty lines, so that line numbers stay
    lines = ["" if line.startswith("%") else line for line in rest.split("\n")]
    at = next((i for i, line in enumerate(lines) if line.strip()), 0)
    sparse, width = words[2] == "coordinate", FIELDS[words[3]]
    counts = _counts(path, lines[at] if lines else "", at + 2, 3 if sparse else 2)
    if n is None:
        n = _own_size(path, counts)
    if counts[:2] != [n, n]:
        raise input_error(
            str(path),
            f"is of {counts[0]} x {counts[1]}, the model has {n} dofs",
            "Give matrices and dofs of the same model.",
        )
    columns = 2 + width if sparse else width
    table = number_table(path, "\n".join(lines[at + 1 :]), columns, first_line=at + 3)
    expected = counts[2] if sparse else _stored(n, words[4])
    if len(table) != expected:
        raise input_error(str(path), f"has {len(table)} entries, its header says {expected}", CUT_SHORT)
    values = table[:, -2] + 1j * table[:, -1] if width == 2 else table[:, -1]
    if sparse:
        return _coordinate(path, table, values, n, words[4])
    return _array(values, n, words[4])


def _counts(path: Path, line: str, number: int, count: int) -> list[int]:
    fields = line.split()
    try:
        found = [int(f) for f in fields]
    except ValueError:
        found = []
    if len(found) != count or min(found, default=-1) < 0:
        raise _bad_counts(path, line, number, count)
    return found


def _own_size(path: Path, counts: list[int]) -> int:
    """Return the size that a file says, which its entries must fill as those of a stiffness do."""
    n, columns = counts[:2]
    stored = counts[2] if len(counts) > 2 else n * columns
    if n != columns or not 0 < n <= MOST_EMPTY * stored:
        raise input_error(
            str(path), f"is of {n} x {columns} with {stored} entries, no stiffness of a model", "Give a square matrix."
        )
    return n


def _bad_counts(path: Path, line: str, number: int, count: int) -> InputError:
    return input_error(f"{path}: line {number}", f"needs {count} counts, got {line[:SHOWN]!r}", CUT_SHORT)


def _stored(n: int, symmetry: str) -> int:
    """Return how many values the layout ``array`` has: one triangle of a symmetric matrix."""
    triangle = n * (n + 1) // 2
    return {"general": n * n, "skew-symmetric": triangle - n}.get(symmetry, triangle)


def _coordinate(path: Path, table: FloatArray, values: FloatArray, n: int, symmetry: str) -> Matrix:
    rows, columns = whole_numbers(path, table, ("row", "column")).T - 1
    check_range(rows, columns, n, str(path))
    check_unique(rows, columns, n, str(path))
    matrix = scipy.sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()
    if symmetry == "general":
        return matrix
    if (rows < columns).any() and (rows > columns).any():
        raise input_error(str(path), f"is {symmetry}, but has entries on both sides of the diagonal", CUT_SHORT)
    other = _mirrored(matrix, symmetry)
    return scipy.sparse.csr_array(matrix + other - scipy.sparse.diags_array(other.diagonal()))


def _array(values: FloatArray, n: int, symmetry: str) -> Matrix:
    """Return the dense matrix of values column by column."""
    if symmetry == "general":
        return values.reshape(n, n).T
    matrix = np.zeros((n, n), dtype=values.dtype)
    # the lower triangle column by column is the upper one of the transpose, row by row
    rows, columns = np.triu_indices(n, 1 if symmetry == "skew-symmetric" else 0)
    matrix[columns, rows] = values
    other = _mirrored(matrix, symmetry)
    return matrix + other - np.diag(np.diag(other))


def _mirrored(matrix: Matrix, symmetry: str) -> Matrix:
    if symmetry == "skew-symmetric":
        return -matrix.T
    return matrix.conj().T if symmetry == "hermitian" else matrix.T
