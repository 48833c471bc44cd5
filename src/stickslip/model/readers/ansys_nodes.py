"""Nodes of an ANSYS model, from a ``.cdb`` or ``.rst`` file: positions, components, nodal coordinate systems."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.readers.ansys_blocks import read_blocks
from stickslip.model.readers.ansys_records import Records, long_pointer, open_records

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
