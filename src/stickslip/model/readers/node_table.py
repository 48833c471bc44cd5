"""Node numbers, positions, sets and nodal coordinate systems, for matrix files, which lack them."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.keywords import Block, keyword_blocks, members, unique_in_order
from stickslip.model.readers.text import SHOWN, read_text, whole_numbers
from stickslip.model.structure import Dofs

LARGEST_COORDINATE = 1e50  # in any unit; squares of larger ones overflow
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")  # directions 1 to 6 of the solvers


@dataclass(frozen=True, eq=False)
class NodeTable:
    """Nodes by number.

    Parameters
    ----------
    numbers
        (n,) ascending node numbers.
    points
        (n, 3) positions, in the unit of length of the file they come from.
    node_sets
        Name -> node numbers, in a meaningful order.
    place
        Source of the nodes, for messages.
    """

    numbers: IntArray
    points: FloatArray
    node_sets: Mapping[str, IntArray] = field(default_factory=dict)
    place: str = "nodes"

    def index(self, numbers: IntArray) -> IntArray:
        """Return the rows of node `numbers`; an `InputError` names the missing ones."""
        if not len(self.numbers):
            raise input_error(self.place, "holds no nodes", "Give the file with the nodes.")
        found = np.minimum(np.searchsorted(self.numbers, numbers), len(self.numbers) - 1)
        missing = np.unique(numbers[self.numbers[found] != numbers])
        if missing.size:
            raise input_error(
                self.place,
                f"lacks {missing.size} nodes, e.g. {', '.join(map(str, missing[:5]))}",
                "Give the nodes of the same model.",
            )
        return np.asarray(found, dtype=np.int64)

    def dofs(self, numbers: IntArray, components: Sequence[str]) -> Dofs:
        """Return the table of dofs of node `numbers` (n,) with `components` (n names)."""
        return Dofs(
            np.asarray(numbers, dtype=np.int64), tuple(components), self.points[self.index(numbers)].astype(float)
        )

    def dof_sets(self, dofs: Dofs) -> dict[str, IntArray]:
        """Return, for each node set, its dofs: node by node in the set's order, components in the table's order.

        Nodes without dofs (clamped nodes) are skipped; sets with such nodes only are left out.
        """
        order = np.argsort(dofs.node, kind="stable")
        nodes = dofs.node[order]
        sets = {}
        for name, numbers in self.node_sets.items():
            first, last = np.searchsorted(nodes, numbers), np.searchsorted(nodes, numbers, "right")
            ranges = [order[a:b] for a, b in zip(first, last, strict=True)]
            index = np.concatenate([*ranges, np.empty(0, dtype=np.int64)])
            if index.size:
                sets[name] = np.asarray(index, dtype=np.int64)
        return sets


def node_table(
    numbers: IntArray, points: FloatArray, place: str, node_sets: Mapping[str, IntArray] | None = None
) -> NodeTable:
    """Sort nodes by number; refuse a number with two different positions."""
    order = np.argsort(numbers, kind="stable")
    numbers, points = np.asarray(numbers[order], dtype=np.int64), points[order]
    twice = np.flatnonzero(np.diff(numbers) == 0)
    if twice.size:
        moved = twice[(points[twice] != points[twice + 1]).any(axis=1)]
        if moved.size:
            raise input_error(
                place, f"defines node {numbers[moved[0]]} twice, at different places", "Give each node once."
            )
        keep = np.append(np.diff(numbers) > 0, True)
        numbers, points = numbers[keep], points[keep]
    return NodeTable(numbers, points, node_sets or {}, place)


def mesh_nodes(mesh: SolidMesh) -> NodeTable:
    """Return the nodes of a mesh, in metres, with its node sets."""
    sets = {name: mesh.numbers[index] for name, index in mesh.node_sets.items()}
    return node_table(mesh.numbers, mesh.points, "mesh", sets)


def deck_nodes(path: Path) -> NodeTable:
    """Return nodes and node sets of a CalculiX or Abaqus deck; all else is ignored."""
    return block_nodes(keyword_blocks(path), path)


def block_nodes(blocks: list[Block], path: Path) -> NodeTable:
    """Return nodes and node sets of the blocks of a deck."""
    tables = []
    named: dict[str, list[IntArray]] = {}
    for block in blocks:
        if block.keyword != "NODE":
            continue
        block.check_parameters()
        if block.parameters.get("SYSTEM", "R").upper() != "R":
            raise input_error(
                block.place,
                f"coordinates of SYSTEM={block.parameters['SYSTEM']} are not read",
                "Write the nodes in Cartesian coordinates.",
            )
        tables.append(block.table(4, blank_is_zero=True))
        if "NSET" in block.parameters:
            numbers = whole_numbers(path, tables[-1], ("node number",))[:, 0]
            named.setdefault(block.parameters["NSET"].upper(), []).append(numbers)
    if not tables:
        raise input_error(str(path), "has no *NODE", "Give the deck with the mesh.")
    table = np.vstack(tables)
    if np.abs(table[:, 1:]).max(initial=0.0) > LARGEST_COORDINATE:
        raise input_error(str(path), f"has a coordinate beyond {LARGEST_COORDINATE:g}", "Check the lines of *NODE.")
    numbers = whole_numbers(path, table, ("node number",))[:, 0]
    sets = members(blocks, "NSET", numbers, {name: np.concatenate(parts) for name, parts in named.items()})
    return node_table(numbers, table[:, 1:], str(path), sets)


def csv_columns(path: Path, required: tuple[str, ...]) -> dict[str, list[str]]:
    """Return the columns of a CSV file with a header line; `required` columns must be present.

    Raises
    ------
    InputError
        If a column is missing, or a line has another number of fields.
    """
    try:
        rows = list(csv.reader(io.StringIO(read_text(path))))
    except csv.Error as error:
        raise input_error(str(path), f"is no CSV file ({error})", "Separate by commas.") from error
    if not rows:
        raise input_error(str(path), "is empty", f"Give a header: {','.join(required)}.")
    header = [name.strip().lower() for name in rows[0]]
    for name in required:
        if name not in header:
            raise input_error(
                str(path),
                f"has no column {name!r}",
                f"{did_you_mean(name, header)} The header is {','.join(required)}.",
            )
    for number, row in enumerate(rows[1:], 2):
        if row and len(row) != len(header):
            raise input_error(
                f"{path}: line {number}",
                f"has {len(row)} fields, the header {len(header)}",
                "Check the line; the file may be cut short.",
            )
    return {name: [row[i].strip() for row in rows[1:] if row] for i, name in enumerate(header)}


def csv_numbers(path: Path, name: str, texts: list[str]) -> FloatArray:
    """Return a column of a CSV file as finite numbers."""
    try:
        values = np.array(texts, dtype=float) if texts else np.empty(0)
    except ValueError:
        values = np.full(1, np.nan)
    if np.isfinite(values).all():
        return values
    for text in texts:
        try:
            finite = bool(np.isfinite(float(text)))
        except ValueError:
            finite = False
        if not finite:
            raise input_error(str(path), f"column {name!r} holds {text[:SHOWN]!r}, no finite number", "Mend it.")
    return values


def csv_nodes(path: Path) -> NodeTable:
    """Return the nodes of a CSV file with the columns ``node, x, y, z``; a ``set`` column names node sets.

    A node in several sets has their names separated by blanks.
    """
    columns = csv_columns(path, ("node", "x", "y", "z"))
    table = np.column_stack([csv_numbers(path, c, columns[c]) for c in ("node", "x", "y", "z")])
    numbers = whole_numbers(path, table, ("node",))[:, 0]
    sets: dict[str, list[int]] = {}
    for number, names in zip(numbers, columns.get("set", []), strict=False):
        for name in names.split():
            sets.setdefault(name, []).append(int(number))
    named = {name: unique_in_order(np.array(listed)) for name, listed in sets.items()}
    return node_table(numbers, table[:, 1:], str(path), named)


def rotation_to_global(node: IntArray, component: IntArray, turned: IntArray, turns: FloatArray, place: str) -> Matrix:
    """Return the (n, n) sparse rotation from nodal to global coordinates.

    Parameters
    ----------
    node, component
        (n,) node number and component of each coordinate: 1 ... 6, or another number for other coordinates. The components
        of a node are adjacent and ascending.
    turned
        (k,) numbers of the nodes with own axes, ascending.
    turns
        (k, 3, 3) axes of these nodes, as columns.
    place
        Name of the file, for messages.

    Raises
    ------
    InputError
        If a rotated node has only some components, because the others are constrained.
    """
    at = np.arange(len(node))
    own = np.isin(node, turned) & (component >= 1) & (component <= 6)
    rows, columns = [at[~own]], [at[~own]]
    values: list[FloatArray] = [np.ones(int((~own).sum()))]
    for kind in (0, 1):
        here = at[own & ((component - 1) // 3 == kind)]
        owners, counts = np.unique(node[here], return_counts=True)
        if (counts != 3).any():
            raise input_error(
                place,
                f"node {owners[counts != 3][0]} has axes of its own and only some free components, "
                "which cannot be turned into the global axes",
                "Constrain all three of such a node or none, or give it the global axes.",
            )
        block = here[np.argsort(node[here], kind="stable")].reshape(-1, 3)
        rows.append(np.repeat(block, 3, axis=1).ravel())
        columns.append(np.tile(block, (1, 3)).ravel())
        values.append(turns[np.searchsorted(turned, owners)].ravel())
    index = (np.concatenate(rows), np.concatenate(columns))
    shape = (len(node), len(node))
    return scipy.sparse.csr_array((np.concatenate(values), index), shape=shape)
