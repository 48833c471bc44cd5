"""Matrices in neutral files: Matrix Market, SciPy's ``.npz``, HDF5; with a CSV file of their dofs.

The reader of Matrix Market is our own: SciPy's reader crashes the whole program on some damaged files.
"""

import zipfile
from collections.abc import Collection
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.modes import LARGEST_ENTRY
from stickslip.model.npz import BROKEN, DEFLATE_RATIO, Arrays, read_npz
from stickslip.model.readers.entries import check_range, check_symmetric, check_unique
from stickslip.model.readers.node_table import COMPONENTS, csv_columns, csv_numbers
from stickslip.model.readers.text import CUT_SHORT, SHOWN, number_table, read_text, whole_numbers
from stickslip.model.readers.units import SI, Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure, numbered_dofs

MAX_ROWS_PER_ENTRY = 10  # rows per entry above which the stated size is implausible
FIELDS = {"real": 1, "integer": 1, "double": 1, "complex": 2}  # numbers in a line for one value
SYMMETRIES = ("general", "symmetric", "hermitian", "skew-symmetric")


def read_matrix_market(path: Path, n: int | None) -> Matrix:
    """Return the (n, n) matrix of a Matrix Market file, CSR for the layout ``coordinate``, dense for ``array``.

    Parameters
    ----------
    path
        The file, plain or gzipped.
    n
        Expected size, checked before memory is allocated; None: the size in the file, if its number of entries is plausible.

    Raises
    ------
    InputError
        If the file is of another kind or size, is cut short, or contains an entry twice.
    """
    text = read_text(path)
    first, _, rest = text.partition("\n")
    words = first.lower().split()
    known = len(words) == 5 and words[3] in FIELDS and words[4] in SYMMETRIES
    if not known or words[:2] != ["%%matrixmarket", "matrix"]:
        raise input_error(
            f"{path}: line 1",
            f"is no Matrix Market matrix of numbers: {first[:SHOWN]!r}",
            "Its first line begins with %%MatrixMarket matrix, for example %%MatrixMarket matrix coordinate real symmetric; "
            "matrices of Abaqus are read by read_abaqus_matrices.",
        )
    # comments become empty lines, so that line numbers are kept
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
    """Return the size stated in the file; refuse a size with implausibly few entries for a stiffness matrix."""
    n, columns = counts[:2]
    stored = counts[2] if len(counts) > 2 else n * columns
    if n != columns or not 0 < n <= MAX_ROWS_PER_ENTRY * stored:
        raise input_error(
            str(path), f"is of {n} x {columns} with {stored} entries, no stiffness of a model", "Give a square matrix."
        )
    return n


def _bad_counts(path: Path, line: str, number: int, count: int) -> InputError:
    return input_error(f"{path}: line {number}", f"needs {count} counts, got {line[:SHOWN]!r}", CUT_SHORT)


def _stored(n: int, symmetry: str) -> int:
    """Return the number of values in the layout ``array``; a symmetric matrix stores one triangle."""
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
    """Return the dense matrix from values listed column by column."""
    if symmetry == "general":
        return values.reshape(n, n).T
    matrix = np.zeros((n, n), dtype=values.dtype)
    # the lower triangle column by column is the upper triangle of the transpose row by row
    rows, columns = np.triu_indices(n, 1 if symmetry == "skew-symmetric" else 0)
    matrix[columns, rows] = values
    other = _mirrored(matrix, symmetry)
    return matrix + other - np.diag(np.diag(other))


def _mirrored(matrix: Matrix, symmetry: str) -> Matrix:
    if symmetry == "skew-symmetric":
        return -matrix.T
    return matrix.conj().T if symmetry == "hermitian" else matrix.T


HDF5 = (".h5", ".hdf5")
SPARSE = {
    "csr": ("data", "indices", "indptr", "shape"),
    "csc": ("data", "indices", "indptr", "shape"),
    "coo": ("data", "row", "col", "shape"),
}
KINDS = (*COMPONENTS, "mode")


def read_matrix_files(
    stiffness: Path | str,
    mass: Path | str,
    *,
    nodes: Path | str | None = None,
    damping: Path | str | None = None,
    units: Units = SI,
    plausible: bool = True,
) -> Structure:
    """Read matrices from neutral files, which any program can write.

    Parameters
    ----------
    stiffness, mass, damping
        Matrix Market (``.mtx``, ``.mtx.gz``), `scipy.sparse.save_npz` or dense arrays in ``.npz``, or HDF5 (``.h5``), where
        the matrix is the group or dataset ``stiffness``, ``mass`` or ``damping``.
    nodes
        CSV file, one line for each dof in the order of the equations, with the columns ``node, component, x, y, z``; components
        are x, y, z, rx, ry, rz and mode. A further column ``set`` names sets, separated by blanks. None: the dofs are called
        ``dof1``, ``dof2`` and so on, have no position, and count as translations.
    units
        Unit system of matrices and positions.
    plausible
        False accepts implausible mass and size.

    Returns
    -------
    Structure
        In SI; sparse or dense as in the files.

    Raises
    ------
    InputError
        If a file is damaged, sizes differ, or mass or stiffness is not symmetric.
    """
    files = {"stiffness": Path(stiffness), "mass": Path(mass)}
    if damping is not None:
        files["damping"] = Path(damping)
    found: dict[str, Matrix] = {}
    sets: dict[str, IntArray] = {}
    if nodes is None:
        found["stiffness"] = read_matrix(files["stiffness"], "stiffness", None)
        dofs = numbered_dofs(found["stiffness"].shape[0])
    else:
        dofs, sets = read_dof_table(Path(nodes))
    n = len(dofs)
    for name, path in files.items():
        if name not in found:
            found[name] = read_matrix(path, name, n)
    for name in ("stiffness", "mass"):
        check_symmetric(found[name], str(files[name]))
    none = scipy.sparse.csr_array((n, n))
    raw = Structure(found["mass"], found.get("damping", none), found["stiffness"], dofs, sets)
    structure = in_si(raw, units)
    if plausible:
        check_units(structure, units, str(stiffness))
    return structure


def names_in(path: Path) -> tuple[str, ...]:
    """Return the names of the matrices in a file (stiffness, mass, damping); empty if it has one matrix without a name."""
    suffix = path.suffix.lower()
    found: Collection[str] = ()
    if suffix == ".npz":
        found = _names_in_npz(path)
    elif suffix in HDF5:
        found = _names_in_hdf5(path)
    if "format" in found:  # a file of `save_structure`, or one sparse matrix
        return ()
    return tuple(name for name in ("stiffness", "mass", "damping") if name in found)


def refuse_other_names(path: Path) -> None:
    """Refuse an ``.npz`` file whose arrays do not have the names of matrices."""
    found = sorted(_names_in_npz(path))
    if found and "format" not in found:
        raise input_error(
            str(path),
            f"holds the arrays {', '.join(found)}, and no stiffness",
            "Its arrays must be called mass, stiffness and, if there is one, damping.",
        )


def _names_in_npz(path: Path) -> Collection[str]:
    try:
        with zipfile.ZipFile(path) as archive:
            return {name.removesuffix(".npy") for name in archive.namelist()}
    except (OSError, ValueError, RuntimeError, zipfile.BadZipFile):  # the reader reports it
        return ()


def _names_in_hdf5(path: Path) -> Collection[str]:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return set(file)
    except (OSError, RuntimeError):  # the reader reports it
        return ("mass",)


def read_dof_table(path: Path) -> tuple[Dofs, dict[str, IntArray]]:
    """Return the dofs and sets of a CSV file ``node, component, x, y, z`` and, if present, ``set``."""
    columns = csv_columns(path, ("node", "component", "x", "y", "z"))
    numbers = csv_numbers(path, "node", columns["node"])
    node = whole_numbers(path, numbers[:, None], ("node",))[:, 0]
    components = tuple(columns["component"])
    for line, component in enumerate(components, 2):
        if component not in KINDS:
            raise input_error(f"{path}: line {line}", f"component {component!r}", f"Use {', '.join(KINDS)}.")
    position = np.full((len(node), 3), np.nan)
    placed = np.array([kind != "mode" for kind in components], dtype=bool)
    for i, axis in enumerate(("x", "y", "z")):
        texts = [t for t, there in zip(columns[axis], placed, strict=True) if there]
        position[placed, i] = csv_numbers(path, axis, texts)
    pairs = [p for p in zip(node, components, strict=True) if p[1] != "mode"]
    if len(set(pairs)) < len(pairs):
        twice = next(p for p in pairs if pairs.count(p) > 1)
        raise input_error(str(path), f"lists node {twice[0]}, {twice[1]} twice", "One line a dof.")
    sets: dict[str, list[int]] = {}
    for i, names in enumerate(columns.get("set", [])):
        for name in names.split():
            sets.setdefault(name, []).append(i)
    return Dofs(node, components, position), {k: np.array(v) for k, v in sets.items()}


def read_matrix(path: Path, name: str, n: int | None) -> Matrix:
    """Return one (n, n) matrix, of any size if n is None, sparse as CSR; `name` selects it from a file with several matrices.

    Raises
    ------
    InputError
        If the file is damaged, of an unknown kind or of another size, claims more data than it can contain, or has entries
        that are not finite.
    """
    suffixes = [s.lower() for s in path.suffixes]
    last = suffixes[-2] if suffixes[-1:] == [".gz"] and suffixes[:-1] else "".join(suffixes[-1:])
    if last in (".mtx", ".mm"):
        matrix = read_matrix_market(path, n)
    elif last == ".npz":
        matrix = _from_arrays(read_npz(path), name, n, str(path))
    elif last in HDF5:
        matrix = _from_arrays(_read_hdf5(path, name), name, n, str(path))
    else:
        raise input_error(str(path), f"unknown kind of matrix file {last!r}", "Use .mtx, .npz or .h5.")
    values = matrix.data if scipy.sparse.issparse(matrix) else matrix
    if not np.isfinite(values).all():
        raise input_error(str(path), f"the {name} has entries that are not finite", "They come from a failed run.")
    if values.size and abs(values).max() > LARGEST_ENTRY:
        raise input_error(
            str(path),
            f"the {name} has entries up to {abs(values).max():.3g}, which no model has",
            "Check the program that wrote it, and its units.",
        )
    return matrix


def _check_size(shape: tuple[int, int], n: int | None, stored: int, place: str) -> None:
    if n is None and shape[0] == shape[1] and 0 < shape[0] <= MAX_ROWS_PER_ENTRY * stored:
        return
    if n is None:
        raise input_error(
            place,
            f"is of {shape[0]} x {shape[1]} with {stored} entries, no stiffness of a model",
            "Give a square matrix.",
        )
    if shape != (n, n):
        raise input_error(
            place, f"is of {shape[0]} x {shape[1]}, the model has {n} dofs", "Give matrices and dofs of the same model."
        )


def _read_hdf5(path: Path, name: str) -> Arrays:
    """Return dataset `name`, or the datasets of group `name`, after their sizes were checked."""
    import h5py

    if not path.is_file():
        raise input_error(str(path), "there is no such file", "Check the path.")
    try:
        with h5py.File(path, "r") as file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise input_error(str(path), f"holds no {name}, but {', '.join(file)}", "Name it so in the file.")
            item = file[name]
            if isinstance(item, h5py.Dataset):
                return {name: _dataset(item, path)}
            links = {key: item.get(key, getlink=True) for key in item}
            return {
                key: _dataset(item[key], path)
                for key, link in links.items()
                if isinstance(link, h5py.HardLink) and isinstance(item[key], h5py.Dataset)
            }
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise input_error(str(path), f"cannot be read ({error})", BROKEN) from error


def _dataset(dataset: Matrix, path: Path) -> Matrix:
    """Read one HDF5 dataset into memory; refuse external data and implausible sizes."""
    place = f"{path}: {dataset.name}"
    if dataset.external or dataset.is_virtual or dataset.dtype.kind not in "fciuSO":
        raise input_error(place, "lies in another file or is no array of numbers", "Copy it plainly.")
    if dataset.dtype.kind in "SO":
        return np.array("" if dataset.shape else dataset.asstr()[()])
    if dataset.size * dataset.dtype.itemsize > DEFLATE_RATIO * dataset.id.get_storage_size():
        raise input_error(place, f"claims {dataset.shape}, more than it can hold", BROKEN)
    return dataset[()]


def _from_arrays(arrays: Arrays, name: str, n: int | None, place: str) -> Matrix:
    """Return a matrix from its arrays: dense, or in one of SciPy's sparse layouts."""
    if name not in arrays and len(arrays) == 1:
        name = next(iter(arrays))
    if name in arrays:
        dense = arrays[name]
        if dense.ndim != 2 or dense.dtype.kind not in "fciu":
            raise input_error(place, f"{name} is an array of {dense.shape}, no matrix of numbers", "Check it.")
        _check_size((dense.shape[0], dense.shape[1]), n, dense.size, f"{place}: {name}")
        return dense
    layout = arrays.get("format", np.array("csr"))
    kind = layout.item() if layout.shape == () else ""
    kind = kind.decode(errors="replace") if isinstance(kind, bytes) else str(kind)
    if kind not in SPARSE or not set(SPARSE[kind]) <= set(arrays):
        raise input_error(
            place,
            f"holds no {name}, but {', '.join(sorted(arrays)) or 'nothing'}",
            "Write it with scipy.sparse.save_npz, or in the layout of the page on matrix files.",
        )
    data, first, second, shape = (arrays[key] for key in SPARSE[kind])
    if any(a.dtype.kind not in "iu" for a in (first, second, shape)) or data.dtype.kind not in "fciu":
        raise input_error(place, "has indices that are no integers, or no numbers", BROKEN)
    if shape.shape != (2,):
        raise input_error(place, "has a shape that is no pair", BROKEN)
    _check_size((int(shape[0]), int(shape[1])), n, data.size, place)
    n = int(shape[0])
    try:
        if kind == "coo":
            matrix = scipy.sparse.coo_array((data, (first, second)), shape=(n, n))
            check_unique(first, second, n, place)
        else:
            build = scipy.sparse.csr_array if kind == "csr" else scipy.sparse.csc_array
            matrix = build((data, first, second), shape=(n, n))
            matrix.check_format()  # all indices, too
    except (ValueError, IndexError, TypeError) as error:
        raise input_error(place, f"its arrays do not fit together ({error})", BROKEN) from error
    return scipy.sparse.csr_array(matrix)
