"""Matrices from ANSYS's binary file ``.full``.

`ansys_records` reads them with NumPy and checks every record first. The compiled reader of other packages crashes the whole
program on a truncated file.
"""

from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import BoolArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.readers.ansys_nodes import COMPONENTS, AnsysNodes, no_nodes, read_ansys_nodes, rotations
from stickslip.model.readers.ansys_records import HEADER, Records, long_pointer, open_records
from stickslip.model.readers.node_table import rotation_to_global
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure

FULL = 4


def read_ansys_full(
    path: Path | str, *, nodes: Path | str | None = None, units: Units | None = None, plausible: bool = True
) -> Structure:
    """Read mass, stiffness and, where written, damping from the ``.full`` file of an ANSYS analysis.

    Constrained coordinates are left out, as are those with neither mass nor stiffness.

    Parameters
    ----------
    path
        The file. In ANSYS: a modal analysis by Block Lanczos after ``LUMPM,OFF``, or ``WRFULL,1``.
    nodes
        The ``.cdb`` or ``.rst`` file of the same model: positions, node components as sets, and nodal coordinate
        systems, from which the matrices are then rotated to the global axes. Without it positions are NaN, sets are missing, and
        ``x, y, z`` are the axes of each node's own system.
    units
        Unit system of the model, SI by default; it is not in the file.
    plausible
        Whether mass and size are checked for plausibility.

    Returns
    -------
    Structure
        Sparse, in SI, sorted by node number. The set ``massless`` contains the coordinates without mass, if any: the mass
        matrix is then singular.

    Raises
    ------
    InputError
        If the file is damaged or of another kind, or has unsupported content: a lumped or unsymmetric matrix,
        constraint equations, other coordinates than displacements and rotations.
    """
    units = Units.si() if units is None else units
    file = open_records(path, FULL)
    header = file.header("header of the matrices")
    n = _supported(file, header)
    node, component, free = _coordinates(file, header, n)
    stiffness = _matrix(file, header, (18, 19), (8, 9), "stiffness")
    mass = _matrix(file, header, (26, 27), (33, 21), "mass")
    damping = _matrix(file, header, (28, 29), (34, 39), "damping")
    if mass is None or stiffness is None:
        raise input_error(
            str(path), "lacks the mass or the stiffness matrix", "Run a modal analysis, then read its .full."
        )
    used = (abs(stiffness) + abs(mass)).sum(axis=1) > 0
    order = np.lexsort((component, node))
    kept = order[(free & used)[order]]
    known = no_nodes() if nodes is None else read_ansys_nodes(nodes)
    if damping is None:
        damping = scipy.sparse.csr_array(mass.shape)
    matrices = [m[kept][:, kept] for m in (mass, damping, stiffness)]
    structure = _structure(matrices, node[kept], component[kept], known, str(path))
    structure = in_si(structure, units)
    if plausible:
        check_units(structure, units, str(path))
    return structure


def _supported(file: Records, header: IntArray) -> int:
    """Return the number of equations; refuse unsupported content."""
    refused = {
        "was written by the frontal solver": header[0] >= 0,
        "holds a lumped mass matrix": header[10] != 0,
        "holds unsymmetric matrices": header[13] != 0,
        "is one part of a distributed analysis": header[62] != 0,
        f"holds {header[20]} constraint equations, apart from the matrices": header[20] != 0,
    }
    remedies = (
        "Use a sparse solver: MODOPT,LANB.",
        "Run again after LUMPM,OFF.",
        "Turn gyroscopic terms (CORIOLIS) and other unsymmetric ones off: this package makes its own.",
        "Give the combined file (COMBINE,FULL), or solve on shared memory (-smp).",
        "Remove CE, CP and MPC contacts, or tie the parts by common nodes.",
    )
    for (problem, found), remedy in zip(refused.items(), remedies, strict=True):
        if found:
            raise input_error(str(file.path), problem, remedy)
    n, end = int(header[1]), long_pointer(header[22], header[23])
    if not 0 < n <= len(file.words) or not 0 < end <= len(file.words):
        raise file.damaged(
            "header of the matrices", f"tells of {n} equations and {end} words, the file has {len(file.words)}"
        )
    return n


def _coordinates(file: Records, header: IntArray, n: int) -> tuple[IntArray, IntArray, BoolArray]:
    """Return node number and component (1 ... 6) of each equation, and whether it is free."""
    _, pointer = file.record(HEADER, len(header), "header of the matrices")
    kinds = file.integers(pointer, 64, "list of degrees of freedom")
    strange = [int(k) for k in kinds if int(k) not in COMPONENTS]
    if strange:
        raise input_error(
            str(file.path),
            f"has degrees of freedom of the kinds {strange}; 1 to 6 are displacements and rotations",
            "Give a structural model: no temperatures, pressures or potentials.",
        )
    _, pointer = file.record(pointer, 64, "list of degrees of freedom")
    numbers = file.integers(pointer, n, "node numbers")
    at = long_pointer(header[35], header[36])
    counts = file.integers(at, n, "coordinates of each node")
    _, at = file.record(at, n, "coordinates of each node")
    constrained = file.integers(at, n, "constraints") < 0
    if (
        len(numbers) != len(counts)
        or len(constrained) != n
        or counts.sum() != n
        or (counts < 0).any()
        or counts.max() > len(kinds)
    ):
        raise file.damaged(
            "coordinates of each node",
            f"{len(numbers)} node numbers, {len(counts)} counts that sum to {counts.sum()}, for {n} equations",
        )
    if not set(counts.tolist()) <= {0, 3, len(kinds)}:
        raise input_error(
            str(file.path),
            f"has nodes with {sorted(set(counts.tolist()) - {0, 3, len(kinds)})} of {len(kinds)} "
            "degrees of freedom, and does not say which",
            "Use elements with all displacements: three or six a node.",
        )
    node = np.repeat(numbers, counts)
    first = np.repeat(np.cumsum(counts) - counts, counts)
    return node, kinds[np.arange(n) - first], ~constrained


def _matrix(
    file: Records, header: IntArray, pointer: tuple[int, int], terms: tuple[int, int], name: str
) -> Matrix | None:
    """Return one full matrix from its upper triangle; None if the file has none.

    `pointer` and `terms` are positions in the header: each number is stored there as two halves.
    """
    n, at = int(header[1]), long_pointer(header[pointer[0]], header[pointer[1]])
    stored = long_pointer(header[terms[0]], header[terms[1]])
    if stored == 0 or at == 0:
        return None
    if not 0 < stored <= min(n * (n + 1) // 2, 16 * len(file.words)):
        raise file.damaged(f"{name} matrix", f"should have {stored} terms in {n} equations")
    columns, values, count = [], [], 0
    for row in range(n):
        what = f"row {row + 1} of the {name} matrix"
        index, at = file.record(at, n, what)
        value, at = file.record(at, n, what)
        count += len(index)
        if index.dtype.kind != "i" or value.dtype.kind != "f" or len(index) != len(value):
            raise file.damaged(what, f"{len(value)} numbers for {len(index)} columns")
        if count > stored:
            break
        columns.append(index)
        values.append(value)
    if count != stored:
        raise file.damaged(f"{name} matrix", f"has {count} terms or more, should have {stored}")
    rows = np.repeat(np.arange(n), [len(c) for c in columns])
    column, data = np.concatenate(columns).astype(np.int64) - 1, np.concatenate(values)
    if column.min() < 0 or column.max() >= n or not np.isfinite(data).all():
        raise file.damaged(f"{name} matrix", "names equations that are not there, or is not finite")
    half = scipy.sparse.coo_array((data, (rows, column)), shape=(n, n)).tocsr()
    return (half + half.T - scipy.sparse.diags_array(half.diagonal())).tocsr()


def _structure(matrices: list[Matrix], node: IntArray, component: IntArray, known: AnsysNodes, place: str) -> Structure:
    """Assemble the structure from mass, damping, stiffness and nodes, in the file's units and the global axes."""
    position, sets = known.of_dofs(node, place)
    turned = known.numbers[known.angles.any(axis=1)]
    if np.isin(node, turned).any():
        turns = rotations(known, turned)
        turn = rotation_to_global(node, component, turned, turns, place)
        matrices = [(turn @ matrix @ turn.T).tocsr() for matrix in matrices]
    mass, damping, stiffness = matrices
    massless = np.flatnonzero(abs(mass).sum(axis=1) == 0)
    if len(massless):
        sets["massless"] = massless
    names = tuple(COMPONENTS[int(c)] for c in component)
    return Structure(mass, damping, stiffness, Dofs(node, names, position), sets)
