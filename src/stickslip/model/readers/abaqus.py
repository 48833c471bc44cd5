"""Matrices that Abaqus writes as text with ``*MATRIX GENERATE`` and ``*MATRIX OUTPUT``."""

from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.entries import from_triangle
from stickslip.model.readers.node_table import COMPONENTS
from stickslip.model.readers.positions import find_nodes
from stickslip.model.readers.text import number_table, read_text, whole_numbers
from stickslip.model.readers.units import SI, Units, check_units, in_si
from stickslip.model.structure import Structure

HELD = 1e36  # diagonal entry of a supported dof in Abaqus
DIRECTIONS = 6


def read_abaqus_matrices(
    stiffness: Path | str,
    mass: Path | str,
    *,
    damping: Path | str | None = None,
    nodes: SolidMesh | Path | str,
    units: Units = SI,
    plausible: bool = True,
) -> Structure:
    """Read matrices in the text format of Abaqus' ``*MATRIX INPUT``: row node, row dof, column node, column dof, value.

    Parameters
    ----------
    stiffness, mass, damping
        Files such as ``job_STIF2.mtx``, ``job_MASS2.mtx``, ``job_DMPV2.mtx`` of ``FORMAT=MATRIX INPUT``; upper triangle,
        lower, or both.
    nodes
        Source of the node positions, which the matrix files lack: the deck ``.inp``, a CSV file with the columns
        ``node, x, y, z``, or a mesh in metres. Its node sets become sets of dofs.
    units
        Unit system of the model.
    plausible
        False accepts implausible mass and size.

    Returns
    -------
    Structure
        Sparse, in SI, dofs by node and direction. Supported dofs, which carry 1e36 on their diagonal, are left out.

    Raises
    ------
    InputError
        If a file is damaged or of another format, is not symmetric, or names nodes whose positions are unknown.
    """
    files = {"stiffness": Path(stiffness), "mass": Path(mass)}
    if damping is not None:
        files["damping"] = Path(damping)
    entries = {name: _read_entries(path) for name, path in files.items()}
    keys = np.unique(np.concatenate([e[0].ravel() for e in entries.values()]))
    matrices = {name: _matrix(entries[name], keys, files[name], supports=name == "stiffness") for name in entries}
    held = matrices["stiffness"].diagonal() >= HELD
    free = np.flatnonzero(~held)
    cut = {name: matrix[free][:, free] for name, matrix in matrices.items()}
    node, direction = np.divmod(keys[free], DIRECTIONS)
    table = find_nodes(nodes, units)
    dofs = table.dofs(node, [COMPONENTS[i] for i in direction])
    none = scipy.sparse.csr_array((len(free), len(free)))
    raw = Structure(cut["mass"], cut.get("damping", none), cut["stiffness"], dofs, table.dof_sets(dofs))
    structure = in_si(raw, units)
    if plausible:
        check_units(structure, units, str(stiffness))
    return structure


def read_coordinate_matrix(path: Path | str) -> Matrix:
    """Read a matrix of ``FORMAT=COORDINATE``: lines row, column, value, counted from 1, any triangle.

    Such a file does not contain the dofs of the equations: pass its matrices with a table of dofs to `read_matrix_files`.

    Returns
    -------
    csr_array
        Symmetric matrix in the units of the file.
    """
    path = Path(path)
    table = _table(path, 3)
    index = whole_numbers(path, table, ("row", "column")) - 1
    if len(index) and index.min() < 0:
        raise input_error(str(path), f"has row or column {index.min() + 1}", "Rows are counted from 1.")
    n = int(index.max()) + 1 if len(index) else 0
    if n > len(index):
        raise input_error(
            str(path),
            f"is of {n} equations, but has {len(index)} entries",
            "Each equation has its diagonal: the file is cut short or of another format.",
        )
    return from_triangle(index[:, 0], index[:, 1], table[:, 2], n, str(path))


def _read_entries(path: Path) -> tuple[IntArray, FloatArray]:
    """Return keys of row and column, (k, 2), and values; a key is ``6 node + direction``, directions counted from 0."""
    table = _table(path, 5)
    whole = whole_numbers(path, table, ("row node", "row dof", "column node", "column dof"))
    nodes, directions = whole[:, [0, 2]], whole[:, [1, 3]]
    internal = np.flatnonzero((nodes < 1).any(axis=1))
    if internal.size:
        raise input_error(
            f"{path}: entry {internal[0] + 1}",
            f"names the internal node {nodes[internal[0]].min()}",
            "Abaqus gives such numbers to dofs that it adds (Lagrange multipliers, incompatible modes). Use elements without them.",
        )
    other = np.flatnonzero((directions < 1).any(axis=1) | (directions > DIRECTIONS).any(axis=1))
    if other.size:
        raise input_error(
            f"{path}: entry {other[0] + 1}",
            f"names the directions {directions[other[0], 0]} and {directions[other[0], 1]}",
            "Directions 1 to 6 are displacements and rotations; others are not read.",
        )
    return DIRECTIONS * nodes + directions - 1, table[:, 4]


def _table(path: Path, columns: int) -> FloatArray:
    """Return the numbers of a file, whose comments start with a star."""
    lines = read_text(path).splitlines()
    kept = "\n".join("" if line.lstrip().startswith("*") else line.rstrip().rstrip(",") for line in lines)
    separator = "," if "," in kept else None
    table = number_table(path, kept, columns, separator=separator)
    if not len(table):
        raise input_error(str(path), "holds no entries", "Give the .mtx file of Abaqus.")
    return table


def _matrix(entries: tuple[IntArray, FloatArray], keys: IntArray, path: Path, *, supports: bool) -> Matrix:
    """Return the matrix on the dofs `keys`; 1e36 is left out of the symmetry check, as it dwarfs all other entries."""
    index, values = np.searchsorted(keys, entries[0]), entries[1]
    held = np.zeros(len(values), dtype=bool)
    if supports:
        held = (index[:, 0] == index[:, 1]) & (values >= HELD)
    rows, columns = index[~held].T
    matrix = from_triangle(rows, columns, values[~held], len(keys), str(path))
    diagonal = np.zeros(len(keys))
    diagonal[index[held, 0]] = values[held]
    return scipy.sparse.csr_array(matrix + scipy.sparse.diags_array(diagonal))
