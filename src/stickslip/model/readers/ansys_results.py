"""Natural frequencies and modes from ANSYS's binary result file ``.rst``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.readers.ansys_nodes import COMPONENTS, read_ansys_nodes, rotations
from stickslip.model.readers.ansys_records import Records, long_pointer, open_records
from stickslip.model.readers.units import Units
from stickslip.model.structure import Dofs

RESULT = 12
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
