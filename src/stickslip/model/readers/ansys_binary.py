"""ANSYS's binary files: nodes, the matrices of ``.full``, natural frequencies and modes of ``.rst``.

A file is a chain of records of 32-bit words: the number of words, a word of flags, the words, the number again. The flags say
whether the words are integers or real numbers, in half or full precision, and which of two sparse forms they are packed in
(Programmer's Reference of ANSYS, file formats ``fdfull`` and ``fdresu``). Every pointer, length and window is checked before use:
the compiled reader of other packages crashes the whole program on a truncated file.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.readers.ansys_blocks import read_blocks
from stickslip.model.readers.node_table import rotation_to_global
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure

HEADER = 103  # first word of the header record that is specific to the kind of file
HEADER_WORDS = 1000  # more words than any release writes there
KINDS = {2: ".emat", 4: ".full", 8: ".sub", 9: ".mode", 10: ".rdsp", 11: ".tri", 12: ".rst"}
# bits of the flags word
INTEGER, HALF, ZLIB, WINDOWS, BITS = 1 << 31, 1 << 30, 1 << 29, 1 << 28, 1 << 27
CUT_SHORT = "Was the file copied whole, in binary mode? Write or copy it again."


@dataclass(frozen=True, eq=False)
class Records:
    """A binary ANSYS file that is mapped, not loaded.

    Parameters
    ----------
    path
        Path of the file.
    words
        (n,) 32-bit words.
    """

    path: Path
    words: IntArray

    def record(self, pointer: int, most: int, what: str) -> tuple[FloatArray, int]:
        """Return the numbers of the record at word `pointer`, unpacked, and the word at which the next record starts.

        Parameters
        ----------
        pointer
            Word at which the record starts.
        most
            Largest allowed count of numbers; it limits the allocated memory.
        what
            Expected content, for messages.

        Raises
        ------
        InputError
            If the record does not lie within the file, its two lengths differ, or it unpacks to more than `most`.
        """
        total = len(self.words)
        if not 0 <= pointer < total - 2:
            raise self.damaged(what, f"stands at word {pointer} of {total}")
        length, flags = int(self.words[pointer]), int(self.words[pointer + 1])
        start, end = pointer + 2, pointer + 2 + length
        if length < 0 or end >= total:
            raise self.damaged(what, f"at word {pointer} has {length} words, the file ends at {total}")
        if self.words[end] != length:
            raise self.damaged(
                what, f"at word {pointer} has {length} words by its start and {self.words[end]} by its end"
            )
        numbers = self._unpacked(self.words[start:end], flags, most, what)
        if len(numbers) > most:
            raise self.damaged(what, f"has {len(numbers)} numbers, at most {most} can be")
        return numbers, end + 1

    def integers(self, pointer: int, most: int, what: str) -> IntArray:
        """Return a record of whole numbers; see `record`."""
        numbers, _ = self.record(pointer, most, what)
        if numbers.dtype.kind != "i":
            raise self.damaged(what, "holds real numbers where whole ones belong")
        return np.asarray(numbers, dtype=np.int64)

    def reals(self, pointer: int, most: int, what: str) -> FloatArray:
        """Return a record of finite real numbers; see `record`."""
        numbers, _ = self.record(pointer, most, what)
        if numbers.dtype.kind != "f":
            raise self.damaged(what, "holds whole numbers where real ones belong")
        if not np.isfinite(numbers).all():
            raise self.damaged(what, "holds numbers that are not finite")
        return np.asarray(numbers, dtype=float)

    def header(self, what: str) -> IntArray:
        """Return the header record of this kind of file, filled up with zeros."""
        read = self.integers(HEADER, HEADER_WORDS, what)
        return np.concatenate([read, np.zeros(HEADER_WORDS - len(read), dtype=np.int64)])

    def damaged(self, what: str, problem: str) -> InputError:
        """Build the error for a damaged file."""
        return input_error(f"{self.path}: {what}", problem, CUT_SHORT)

    def _unpacked(self, words: IntArray, flags: int, most: int, what: str) -> FloatArray:
        kind = np.dtype(("<i2" if flags & HALF else "<i4") if flags & INTEGER else ("<f4" if flags & HALF else "<f8"))
        if flags & ZLIB:
            raise input_error(
                f"{self.path}: {what}",
                "is packed with zlib, which this reader does not unpack",
                "Write the file again after /FCOMP,RST,0.",
            )
        if flags & (WINDOWS | BITS) and len(words) < 2:
            raise self.damaged(what, "is packed, but shorter than the head of a packed record")
        if flags & BITS:
            return self._from_bits(words, kind, what)
        if flags & WINDOWS:
            return self._from_windows(words, kind, most, what)
        if kind.itemsize == 8 and len(words) % 2:
            raise self.damaged(what, f"holds real numbers, but {len(words)} words")
        return np.frombuffer(words.tobytes(), kind)

    def _from_bits(self, words: IntArray, kind: np.dtype, what: str) -> FloatArray:
        """Unpack a record of up to 32 numbers; one bit for each number says whether it is stored or zero."""
        size, bits = int(words[0]), int(words[1])
        stored = np.array([i for i in range(32) if bits >> i & 1])
        packed = words[2:].tobytes()
        values = np.frombuffer(packed, kind, count=len(packed) // kind.itemsize)
        if not 0 <= size <= 32 or (stored >= size).any() or len(values) < len(stored):
            raise self.damaged(what, f"is packed by {size} bits, of which it holds {len(values)}")
        numbers = np.zeros(size, kind)
        numbers[stored.astype(int)] = values[: len(stored)]
        return numbers

    def _from_windows(self, words: IntArray, kind: np.dtype, most: int, what: str) -> FloatArray:
        """Unpack a record of windows: single numbers, runs of numbers, and runs of one number."""
        size, windows = int(words[0]), int(words[1])
        if not 0 <= size <= most or not 0 <= windows <= len(words) or kind.itemsize < 4:
            raise self.damaged(what, f"is packed to {size} numbers in {windows} windows")
        numbers = np.zeros(size, kind)
        width, at = kind.itemsize // 4, 2
        for _ in range(windows):
            place = int(words[at]) if at < len(words) else size
            length, stored, at = 1, 1, at + 1
            if place <= 0:
                length = int(words[at]) if at < len(words) else 0
                stored, at = (length if length > 0 else 1), at + 1
            first, last = abs(place), abs(place) + abs(length)
            if not length or last > size or at + stored * width > len(words):
                raise self.damaged(what, f"has a window from {first} to {last} of {size} numbers")
            numbers[first:last] = np.frombuffer(words[at : at + stored * width].tobytes(), kind)
            at += stored * width
        return numbers


def long_pointer(low: int, high: int) -> int:
    """Return the 64-bit number that is stored as two 32-bit ones."""
    return (int(high) << 32) + (int(low) & 0xFFFFFFFF)


def open_records(path: Path | str, kind: int) -> Records:
    """Map a binary ANSYS file of a known kind.

    Parameters
    ----------
    path
        The file.
    kind
        4 for ``.full``, 12 for ``.rst``.

    Raises
    ------
    InputError
        If the file is missing, not from ANSYS, of another kind or of another byte order.
    """
    path = Path(path)
    if not path.is_file():
        near = did_you_mean(path.name, [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else [])
        raise input_error(str(path), "there is no such file", near if near.startswith("Did") else "Check the path.")
    count = path.stat().st_size // 4
    if count <= HEADER:
        raise input_error(str(path), f"has {count} words, a header needs more than {HEADER}", CUT_SHORT)
    try:
        words = np.memmap(path, dtype="<i4", mode="r", shape=(count,))
    except OSError as error:
        raise input_error(str(path), f"cannot be read ({error.strerror})", "Check the path.") from error
    if words[0] != 100:
        raise _not_ansys(path, words)
    records = Records(path, np.asarray(words))
    head = records.integers(0, HEADER_WORDS, "standard header")
    written = int(head[0])
    if written != kind:
        raise input_error(
            str(path),
            f"is a file of kind {written} ({KINDS.get(written, 'unknown')}), not {KINDS[kind]}",
            "Use read_ansys_full for .full and read_ansys_results for .rst.",
        )
    return records


def _not_ansys(path: Path, words: IntArray) -> InputError:
    if int(words[0:1].byteswap()[0]) == 100:
        return input_error(
            str(path),
            "has the byte order of a big-endian machine",
            "Write it on a machine with the usual byte order, or in text: the .cdb by CDWRITE.",
        )
    return input_error(
        str(path),
        f"is no binary file of ANSYS: it starts with {words[0]}, not with 100",
        "Use read_ansys_archive for .cdb.",
    )


RESULT = 12
COMPONENTS = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}  # ANSYS's numbers of the components
NODE_FIELDS = 7  # number, x, y, z, and three angles


@dataclass(frozen=True, eq=False)
class AnsysNodes:
    """Nodes with the numbers of ANSYS, in the model's units.

    Parameters
    ----------
    numbers
        (n,) node numbers, ascending.
    points
        (n, 3) positions.
    angles
        (n, 3) angles of the nodal coordinate systems in degrees: about z, then about the new x, then about the new y.
    node_sets
        Node component -> node numbers.
    """

    numbers: IntArray
    points: FloatArray
    angles: FloatArray
    node_sets: Mapping[str, IntArray]

    def of_dofs(self, node: IntArray, place: str) -> tuple[FloatArray, dict[str, IntArray]]:
        """Return the positions of coordinates of the nodes `node`, and the sets as indices into them.

        A component without any of these coordinates is left out.
        """
        if not len(self.numbers):
            return np.full((len(node), 3), np.nan), {}
        at = np.minimum(np.searchsorted(self.numbers, node), len(self.numbers) - 1)
        unknown = np.unique(node[self.numbers[at] != node])
        if len(unknown):
            raise input_error(
                place,
                f"has {len(unknown)} nodes that the file of nodes lacks, e.g. {unknown[0]}",
                "Give the .cdb or .rst of the same model.",
            )
        sets = {name: np.flatnonzero(np.isin(node, members)) for name, members in self.node_sets.items()}
        return self.points[at], {name: members for name, members in sets.items() if len(members)}


def no_nodes() -> AnsysNodes:
    """Return an empty table, for matrices without a file of nodes."""
    return AnsysNodes(np.empty(0, dtype=np.int64), np.empty((0, 3)), np.empty((0, 3)), {})


def read_ansys_nodes(path: Path | str) -> AnsysNodes:
    """Read the nodes of a ``.cdb`` (text) or ``.rst`` (binary) file.

    Raises
    ------
    InputError
        If the file is neither, or damaged.
    """
    path = Path(path)
    if path.suffix.lower() in {".rst", ".rth"}:
        return _nodes_of_results(open_records(path, RESULT))
    blocks = read_blocks(path)
    return _sorted(blocks.numbers, blocks.points, blocks.angles, blocks.node_sets)


def _nodes_of_results(file: Records) -> AnsysNodes:
    header = file.header("header of the results")
    read = file.integers(long_pointer(header[15], header[45]), 1000, "header of the geometry")
    geometry = np.concatenate([read, np.zeros(100, dtype=np.int64)])
    n = int(geometry[3])
    at = long_pointer(geometry[26], geometry[27]) or int(geometry[8])
    if not 0 < n <= len(file.words) // NODE_FIELDS:
        raise file.damaged("header of the geometry", f"tells of {n} nodes")
    table = np.zeros((n, NODE_FIELDS))
    for row in range(n):
        fields, at = file.record(at, 4 * NODE_FIELDS, f"node {row + 1} of {n}")
        if fields.dtype.kind != "f" or len(fields) < 4 or not np.isfinite(fields).all():
            raise file.damaged(f"node {row + 1} of {n}", "holds no number and position")
        table[row, : min(len(fields), NODE_FIELDS)] = fields[:NODE_FIELDS]
    return _sorted(table[:, 0].astype(np.int64), table[:, 1:4], table[:, 4:7], {})


def _sorted(numbers: IntArray, points: FloatArray, angles: FloatArray, sets: Mapping[str, IntArray]) -> AnsysNodes:
    order = np.argsort(numbers, kind="stable")
    return AnsysNodes(numbers[order], points[order], angles[order], sets)


def rotations(known: AnsysNodes, node: IntArray) -> FloatArray:
    """Return (k, 3, 3) matrices from the nodal systems of the nodes `node` to the global axes."""
    angles = np.radians(known.angles[np.searchsorted(known.numbers, node)])
    cosine, sine = np.cos(angles), np.sin(angles)

    def about(axis: int, column: int) -> FloatArray:
        turn = np.tile(np.eye(3), (len(node), 1, 1))
        a, b = (axis + 1) % 3, (axis + 2) % 3
        turn[:, a, a] = turn[:, b, b] = cosine[:, column]
        turn[:, a, b], turn[:, b, a] = -sine[:, column], sine[:, column]
        return turn

    return np.asarray(about(2, 0) @ about(0, 1) @ about(1, 2))


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


MODAL = 2
ANALYSES = {0: "static", 1: "buckling", 2: "modal", 3: "harmonic", 4: "transient", 7: "substructure"}
UNDEFINED = 2.0**100  # ANSYS's value for a node without result


@dataclass(frozen=True, eq=False)
class AnsysResults:
    """Modes in a result file of ANSYS.

    Parameters
    ----------
    frequencies_hz
        (k,) natural frequencies.
    shapes
        (n, k) modes in the global axes, mass-normalised in SI where ANSYS normalised them to mass (``MODOPT``); zero
        if the file has none.
    dofs
        Table of the n coordinates.
    harmonic_indices
        (k,) nodal diameters of a cyclic analysis, the second mode of a pair negative; all zero for other analyses.
    sectors
        Number of sectors of a cyclic analysis, else 1. In a cyclic analysis the shapes belong to the modelled sector and are
        real as in the file: the two modes of a pair are the real and the imaginary part of a travelling wave.
    """

    frequencies_hz: FloatArray
    shapes: FloatArray
    dofs: Dofs
    harmonic_indices: IntArray
    sectors: int


def read_ansys_results(path: Path | str, *, units: Units | None = None) -> AnsysResults:
    """Read natural frequencies and modes from the ``.rst`` file of a modal analysis.

    Parameters
    ----------
    path
        The file.
    units
        Unit system of the model, SI by default; it is not in the file.

    Raises
    ------
    InputError
        If the file is damaged, of another kind or analysis, one part of a distributed analysis, or contains complex modes.
    """
    units = Units.si() if units is None else units
    file = open_records(path, RESULT)
    header = file.header("header of the results")
    _modal(file, header)
    count, room = int(header[8]), int(header[3])
    times = file.reals(long_pointer(header[11], header[41]), room, "list of frequencies")
    sets = file.integers(long_pointer(header[10], header[40]), 2 * room, "list of results")
    if not 0 <= count <= min(len(times), len(sets) - room):
        raise file.damaged("list of results", f"has {count} results in {len(times)} places")
    known = read_ansys_nodes(path)
    numbers = file.integers(long_pointer(header[14], header[46]), len(file.words), "node numbers")
    pointers = [long_pointer(sets[i], sets[room + i]) for i in range(count)]
    components = _components(file, pointers)
    modes = [_mode(file, pointer, len(numbers), len(components)) for pointer in pointers]
    order = np.argsort(numbers, kind="stable")
    shapes = np.array(modes).reshape(count, len(numbers), len(components))[:, order]
    node = np.repeat(numbers[order], len(components))
    position, _ = known.of_dofs(node, str(path))
    shapes = _turned(shapes, components, rotations(known, numbers[order]))
    dofs = Dofs(node, tuple(COMPONENTS[c] for c in components) * len(numbers), units.length * position)
    # φᵀMφ = 1 in the file's units and in SI; rotations have the unit of a displacement over a length
    scale = units.lengths(dofs) / (np.sqrt(units.mass) * units.length)
    cyclic = long_pointer(header[16], header[43])
    indices = (
        _harmonic_indices(file, cyclic, room, times[:count], int(header[20]))
        if cyclic
        else np.zeros(count, dtype=np.int64)
    )
    return AnsysResults(
        times[:count] / units.time,
        scale[:, None] * shapes.reshape(count, -1).T,
        dofs,
        indices,
        max(int(header[20]), 1) if cyclic else 1,
    )


def _modal(file: Records, header: IntArray) -> None:
    """Refuse parts of distributed analyses, and analyses that are not modal."""
    if header[7] != MODAL:
        raise input_error(
            str(file.path),
            f"holds a {ANALYSES.get(int(header[7]), 'different')} analysis, not a modal one",
            "Give the .rst of a modal analysis (ANTYPE,MODAL with MXPAND).",
        )
    if header[48] not in (0, header[2]):
        raise input_error(
            str(file.path),
            f"holds {header[2]} of the model's {header[48]} nodes, one part of a distributed analysis",
            "Give the combined result file (COMBINE,RST).",
        )


def _components(file: Records, pointers: list[int]) -> list[int]:
    """Return the kinds of degrees of freedom of the first result."""
    if not pointers:
        raise input_error(str(file.path), "holds no result", "Expand the modes: MXPAND.")
    head = file.integers(pointers[0], 1000, "header of result 1")
    kinds = [int(k) for k in head[20 : 20 + max(int(head[19]), 0)]] if len(head) > 150 else []
    if not kinds or not set(kinds) <= set(COMPONENTS):
        raise input_error(
            str(file.path),
            f"has degrees of freedom of the kinds {kinds}; 1 to 6 are displacements and rotations",
            "Give a structural model: no temperatures, pressures or potentials.",
        )
    return kinds


def _mode(file: Records, pointer: int, n_nodes: int, n_components: int) -> FloatArray:
    """Return one mode (n_nodes, n_components) in nodal axes, nodes in the file's order."""
    head = file.integers(pointer, 1000, "header of a result")
    if len(head) < 150:
        raise file.damaged("header of a result", f"has {len(head)} numbers")
    if head[18]:
        raise input_error(str(file.path), "holds complex modes", "Give undamped modes: MODOPT,LANB.")
    width = int(head[19]) + int(head[97])
    at = pointer + (long_pointer(head[104], head[105]) or int(head[10]))
    values, after = file.record(at, n_nodes * max(width, 1), "displacements of a mode")
    if width != n_components or values.dtype.kind != "f" or len(values) % width:
        raise file.damaged("displacements of a mode", f"has {len(values)} numbers, {width} a node")
    found = np.array(values, dtype=float).reshape(-1, width)
    if not np.isfinite(found).all():
        raise file.damaged("displacements of a mode", "holds numbers that are not finite")
    mode = np.zeros((n_nodes, width))
    rows: IntArray = np.arange(n_nodes)
    if len(found) < n_nodes:  # only some nodes: their indices follow
        rows = file.integers(after, n_nodes, "nodes of a mode") - 1
    if len(rows) != len(found) or rows.min(initial=0) < 0 or rows.max(initial=0) >= n_nodes:
        raise file.damaged("nodes of a mode", f"{len(rows)} nodes for {len(found)} displacements")
    mode[rows] = np.where(found == UNDEFINED, 0.0, found)
    return mode


def _turned(shapes: FloatArray, components: list[int], turn: FloatArray) -> FloatArray:
    """Rotate modes (k, nodes, components) from the nodal systems (nodes, 3, 3) to the global axes."""
    if (turn == np.eye(3)).all():
        return shapes
    turned = shapes.copy()
    for triple in ([1, 2, 3], [4, 5, 6]):
        if set(triple) <= set(components):
            places = [components.index(c) for c in triple]
            turned[:, :, places] = np.einsum("nab,knb->kna", turn, shapes[:, :, places])
        elif set(triple) & set(components):
            raise input_error(
                "nodal coordinate systems",
                "are turned, but not all three components are there",
                "Solve again with NROTAT undone, or with all displacements.",
            )
    return turned


def _harmonic_indices(file: Records, pointer: int, room: int, frequencies: FloatArray, sectors: int) -> IntArray:
    """Return the signed harmonic index of each mode.

    Old releases write no signs; then the second of two equal frequencies gets the negative index.
    """
    read = file.integers(pointer, max(room, len(frequencies)), "harmonic indices")
    indices = read[: len(frequencies)].copy()
    if len(indices) < len(frequencies) or np.abs(indices).max(initial=0) > sectors / 2:
        raise file.damaged("harmonic indices", f"{indices[:10]} for {sectors} sectors")
    if (indices >= 0).all():
        for i in range(1, len(indices)):
            double = np.isclose(frequencies[i], frequencies[i - 1], rtol=1e-6)
            if double and indices[i] == indices[i - 1] and 0 < 2 * indices[i] < sectors:
                indices[i] *= -1
    return np.asarray(indices)
