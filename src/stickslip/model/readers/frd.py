"""CalculiX results, ASCII ``.frd``: the mesh, and fields on its nodes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import InputError, input_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.node_table import COMPONENTS, NodeTable, csv_columns, csv_numbers, node_table
from stickslip.model.readers.text import CUT_SHORT, SHOWN, read_text, whole_numbers
from stickslip.model.readers.units import SI, Units
from stickslip.model.structure import Dofs

# element type -> position of each of VTK's nodes in the file, which lists vertical edges before top ones
HEX20 = (*range(12), 16, 17, 18, 19, 12, 13, 14, 15)
WEDGE15 = (*range(9), 12, 13, 14, 9, 10, 11)
CELLS: dict[int, tuple[int, ...]] = {
    1: tuple(range(8)),
    2: tuple(range(6)),
    3: tuple(range(4)),
    4: HEX20,
    5: WEDGE15,
    6: tuple(range(10)),
}
WIDTHS = {0: 5, 1: 10}  # characters of a node number in the short and the long format
VALUE = 12  # characters of a value
PER_LINE = 6  # values on a line
MODAL = 2  # kind of a result: 0 static, 1 time step, 2 frequency, 3 load step
RESPONSE = "RESPONSE"  # text of a block with a motion in m instead of a mode shape


@dataclass(frozen=True, eq=False)
class NodalField:
    """Results on nodes at one step.

    Parameters
    ----------
    name
        Name in the file: ``DISP``, ``STRESS``, ...
    components
        Names of the columns, e.g. ``("D1", "D2", "D3")``.
    values
        (n, k) in SI for ``DISP`` and ``DISPI`` (m), ``STRESS`` (Pa) and ``FORC`` (N), else as in the file. Mode shapes have
        unit modal mass in SI; a response written by stickslip is in m.
    nodes
        (n,) node numbers.
    step
        Number of the step in the file.
    frequency_hz
        Frequency of a mode, Hz; None for other fields.
    nodal_diameter
        Nodal diameter of a mode of a cyclic analysis, whose fields ``DISP`` and ``DISPI`` are the real and the imaginary part; None
        for other fields.
    """

    name: str
    components: tuple[str, ...]
    values: FloatArray
    nodes: IntArray
    step: int
    frequency_hz: float | None = None
    nodal_diameter: int | None = None


@dataclass(frozen=True, eq=False)
class FrdResults:
    """Content of an ``.frd`` file, in SI.

    Parameters
    ----------
    mesh
        Nodes and cells; None if there are shells or beams.
    nodes
        Node numbers and positions in metres.
    fields
        In the file's order.
    """

    mesh: SolidMesh | None
    nodes: NodeTable
    fields: tuple[NodalField, ...]

    def field(self, name: str, step: int | None = None) -> NodalField:
        """Return the first field `name`, or the field `name` of `step`; an `InputError` lists the available ones."""
        for candidate in self.fields:
            if candidate.name == name and step in (None, candidate.step):
                return candidate
        raise input_error(
            self.nodes.place,
            f"has no field {name!r}" + ("" if step is None else f" at step {step}"),
            "It has " + (", ".join(f"{f.name} at step {f.step}" for f in self.fields) or "none") + ".",
        )


def read_frd(path: Path | str, *, units: Units = SI) -> FrdResults:
    """Read an ASCII ``.frd`` file of CalculiX.

    Parameters
    ----------
    path
        The file, plain or gzipped.
    units
        Unit system of the model.

    Raises
    ------
    InputError
        If the file is binary, cut short or damaged; the message names the line.
    """
    path = Path(path)
    reader = _Frd(path)
    reader.read()
    nodes = reader.nodes()
    nodes = replace(nodes, points=units.length * nodes.points)
    fields = tuple(_in_si(field, modal, units) for field, modal in reader.fields)
    return FrdResults(_mesh(nodes, reader.cells), nodes, fields)


def read_displacement(path: Path, dofs: Dofs, units: Units) -> FloatArray:
    """Return the static displacement of dofs from a file.

    Parameters
    ----------
    path
        An ``.frd`` file of CalculiX, of which the last static field ``DISP`` counts, or CSV with the columns ``node, x, y, z``, and ``rx, ry,
        rz`` in rad where the matrices have rotations.
    dofs
        Displacements and rotations of nodes.
    units
        Unit system of the file.

    Returns
    -------
    FloatArray
        (n,) m and rad.

    Raises
    ------
    InputError
        If a node or a component is missing in the file.
    """
    if ".frd" in "".join(path.suffixes[-2:]).lower():
        results = read_frd(path, units=units)
        fields = [f for f in results.fields if f.name == "DISP" and f.frequency_hz is None]
        if not fields:
            raise input_error(
                str(path), "has no static field DISP", "Write the displacements of the static step (*NODE FILE, U)."
            )
        known: tuple[str, ...] = COMPONENTS[:3]
        numbers, values = fields[-1].nodes, fields[-1].values[:, :3]
    else:
        columns = csv_columns(path, ("node", "x", "y", "z"))
        known = tuple(c for c in COMPONENTS if c in columns)
        numbers = whole_numbers(path, csv_numbers(path, "node", columns["node"])[:, None], ("node",))[:, 0]
        factor = [units.length if c in COMPONENTS[:3] else 1.0 for c in known]
        values = np.column_stack([csv_numbers(path, c, columns[c]) for c in known]) * factor
    lacking = [c for c in dict.fromkeys(dofs.component) if c not in known]
    if lacking:
        raise input_error(
            str(path),
            f"has no {lacking[0]}, which the matrices have",
            "Give CSV with the columns node, x, y, z, rx, ry, rz; rotations in rad.",
        )
    node_table(numbers, np.zeros((len(numbers), 3)), str(path)).index(dofs.node)  # refuses missing nodes
    order = np.argsort(numbers, kind="stable")
    row = order[np.searchsorted(numbers[order], dofs.node)]
    return np.asarray(values[row, [known.index(c) for c in dofs.component]])


def frd_nodes(path: Path) -> NodeTable:
    """Return the nodes of an ASCII ``.frd`` file, in its unit of length."""
    reader = _Frd(path)
    reader.read()
    return reader.nodes()


def _mesh(nodes: NodeTable, cells: dict[int, list[list[int]]]) -> SolidMesh | None:
    if not cells or not set(cells) <= set(CELLS):
        return None
    widest = max(len(CELLS[kind]) for kind in cells)
    parts, numbers = [], []
    for kind, rows in cells.items():
        table = np.array(rows, dtype=np.int64)
        connected = nodes.index(table[:, 1:].ravel()).reshape(len(rows), -1)[:, list(CELLS[kind])]
        parts.append(np.pad(connected, ((0, 0), (0, widest - connected.shape[1])), constant_values=-1))
        numbers.append(table[:, 0])
    return SolidMesh(nodes.points, np.vstack(parts), {}, numbers=nodes.numbers, cell_numbers=np.concatenate(numbers))


def _in_si(field: NodalField, modal: bool, units: Units) -> NodalField:
    displacement = 1 / math.sqrt(units.mass) if modal else units.length
    factor = {"DISP": displacement, "DISPI": displacement, "STRESS": units.stress, "FORC": units.force}.get(
        field.name, 1.0
    )
    frequency = None if field.frequency_hz is None else field.frequency_hz / units.time
    return replace(field, values=factor * field.values, frequency_hz=frequency)


class _Frd:
    """One pass over the lines of a file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines = read_text(path).splitlines()
        self.at = 0  # index of the next line
        self.tables: list[tuple[IntArray, FloatArray]] = []
        self.cells: dict[int, list[list[int]]] = {}
        self.fields: list[tuple[NodalField, bool]] = []
        self.diameter: int | None = None  # nodal diameter of the fields that follow

    def read(self) -> None:
        while self.at < len(self.lines):
            line = self.lines[self.at]
            self.at += 1
            key = line[:6].strip()
            if key == "9999":
                return
            if key == "2C":
                self.tables.append(self._rows(line, 3, self._format(line[73:74])))
            elif key == "3C":
                self._read_cells(WIDTHS[self._format(line[73:74])])
            elif line.startswith("    1PHID"):
                number = self._whole(line[9:])
                self.diameter = number if number >= 0 else None
            elif key == "100C":
                self._read_field(line)
        raise input_error(str(self.path), "does not end with 9999", CUT_SHORT)

    def nodes(self) -> NodeTable:
        if not self.tables:
            raise input_error(str(self.path), "holds no nodes", "Ask for output with *NODE FILE in the deck.")
        numbers, points = (np.concatenate(parts) for parts in zip(*self.tables, strict=True))
        return node_table(numbers, points, str(self.path))

    def _wrong(self, problem: str) -> InputError:
        line = self.lines[self.at - 1] if 0 < self.at <= len(self.lines) else ""
        return input_error(
            f"{self.path}: line {self.at}",
            f"{problem}: {line[:SHOWN]!r}",
            "Check that the file is a whole ASCII .frd of CalculiX.",
        )

    def _format(self, digit: str) -> int:
        if digit.strip() not in {"", "0", "1"}:
            raise self._wrong("binary .frd files are not read")
        return int(digit.strip() or 0)

    def _whole(self, text: str) -> int:
        try:
            return int(text)
        except ValueError as error:
            raise self._wrong(f"{text!r} is no whole number") from error

    def _block(self) -> list[str]:
        """Return the lines up to the next ``-3``."""
        first = self.at
        while self.at < len(self.lines) and self.lines[self.at][:3] in {" -1", " -2"}:
            self.at += 1
        block = self.lines[first : self.at]
        self.at += 1
        if self.at > len(self.lines) or self.lines[self.at - 1].strip() != "-3":
            raise self._wrong("a block does not end with -3")
        return block

    def _rows(self, header: str, columns: int, layout: int) -> tuple[IntArray, FloatArray]:
        """Read a block of fixed columns; return node numbers and `columns` values for each."""
        count = self._whole(header[24:36])
        first, width = self.at, WIDTHS[layout]
        block = self._block()
        each = -(-columns // PER_LINE)
        if len(block) != each * count:
            raise self._wrong(f"a block has {len(block)} lines, its header says {each * count}")
        try:
            numbers = np.array([line[3 : 3 + width] for line in block[::each]], dtype="U10")
            start, texts = 3 + width, []
            for part in range(each):
                here = min(PER_LINE, columns - PER_LINE * part)
                for i in range(here):
                    span = slice(start + VALUE * i, start + VALUE * (i + 1))
                    texts.append([line[span] for line in block[part::each]])
            values = np.array(texts, dtype="U12").astype(float).T.reshape(count, columns)
            found = numbers.astype(np.int64), values
        except (ValueError, OverflowError):
            found = np.empty(0, dtype=np.int64), np.full((1, columns), np.nan)
        if not np.isfinite(found[1]).all():
            raise self._spoiled(block, first, width)
        return found

    def _spoiled(self, block: Sequence[str], first: int, width: int) -> InputError:
        """Return the error that names the line with an invalid number."""
        for i, line in enumerate(block):
            rest = line[3 + width :].rstrip()
            fields = [line[3 : 3 + width].strip() or "0"]
            fields += [rest[k : k + VALUE] for k in range(0, max(len(rest), 1), VALUE)]
            for text in fields:
                try:
                    fine = math.isfinite(float(text))
                except ValueError:
                    fine = False
                if not fine:
                    self.at = first + i + 1
                    return self._wrong(f"{text!r} is no finite number")
        return self._wrong("a block is no table of numbers")

    def _read_cells(self, width: int) -> None:
        """Read the element block: a line with number and type, then lines of nodes."""
        first = self.at
        block = self._block()
        after = self.at
        row: list[int] = []
        for self.at, line in enumerate(block, first + 1):  # messages name this line
            if line.startswith(" -1"):
                row = [self._whole(line[3 : 3 + width])]
                kind = self._whole(line[3 + width : 8 + width])
                self.cells.setdefault(kind, []).append(row)
            elif not row:
                raise self._wrong("nodes before the first element")
            else:
                text = line[3:].rstrip()
                row += [self._whole(text[k : k + width]) for k in range(0, len(text), width)]
        self.at = after
        for kind, rows in self.cells.items():
            wanted = len(CELLS.get(kind, rows[0][1:])) + 1
            if any(len(row) != wanted for row in rows):
                raise self._wrong(f"an element of type {kind} has another number of nodes")

    def _read_field(self, header: str) -> None:
        layout = self._format(header[74:75])
        at_frequency = header[56:58].strip() == str(MODAL)
        try:
            value = float(header[12:24])
        except ValueError as error:
            raise self._wrong("no step value") from error
        step = self._whole(header[58:63])
        if self.at >= len(self.lines) or not self.lines[self.at].startswith(" -4"):
            self.at += 1
            raise self._wrong("a result block without its -4 line")
        name = self.lines[self.at][5:13].strip()
        components = []
        self.at += 1
        while self.at < len(self.lines) and self.lines[self.at].startswith(" -5"):
            line = self.lines[self.at]
            if line[33:38].strip() != "1":  # 1: derived by the viewer, not in the file
                components.append(line[5:13].strip())
            self.at += 1
        nodes, values = self._rows(header, len(components), layout)
        frequency = value if at_frequency else None
        modal = at_frequency and header[36:56].strip() != RESPONSE
        field = NodalField(name, tuple(components), values, nodes, step, frequency, self.diameter)
        self.fields.append((field, modal))
