"""Fields for ParaView: one ``.vtu`` for each instant, a ``.pvd`` with their times, and one file with the harmonics."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.mesh.solid_mesh import by_kind, cell_blocks, mesh_writer
from stickslip.study.exchange.contacts import ContactMotion
from stickslip.study.exchange.motion import Motion
from stickslip.study.store.atomic_write import whole_file, write_whole

Cells = list[tuple[str, IntArray]]


def write_vtu(motion: Motion, contacts: Sequence[ContactMotion], folder: Path, steps: int) -> tuple[Path, ...]:
    """Write the motion of all nodes and contact points over one period; return the files.

    Parameters
    ----------
    motion, contacts
        The motion at one point of a response.
    folder
        An existing folder.
    steps
        Number of instants in the period.
    """
    points = np.vstack([body.nodes.points for body in motion.bodies])
    cells, numbers = _cells(motion)
    still = {
        "part": _each(motion, [b.nodes.part for b in motion.bodies]),
        "sector": _each(motion, [b.sector for b in motion.bodies]),
        "node": np.concatenate([body.nodes.numbers for body in motion.bodies]),
    }
    mean = np.vstack([body.mean for body in motion.bodies])
    shares = np.arange(steps) / steps
    files, times = [], shares / motion.hz
    for k, share in enumerate(shares):
        moved = np.vstack([body.at(2 * np.pi * share) for body in motion.bodies])
        fields = {"displacement_m": mean + moved, "vibration_m": moved, **still}
        files.append(folder / f"motion_{k:03d}.vtu")
        _write(files[-1], points, cells, fields, numbers)
    written = [_collection(folder / "motion.pvd", files, times)]
    written.append(folder / "harmonics.vtu")
    _write(written[-1], points, cells, still | _harmonics(motion, mean), numbers)
    if contacts:
        own = []
        position = np.vstack([c.position for c in contacts])
        vertices = [("vertex", np.arange(len(position))[:, None])]
        for k, share in enumerate(shares):
            each = [c.at(float(share)) for c in contacts]
            fields = {name: np.concatenate([one[name] for one in each]) for name in each[0]}
            own.append(folder / f"contacts_{k:03d}.vtu")
            _write(own[-1], position, vertices, fields, {})
        written.append(_collection(folder / "contacts.pvd", own, times))
        files += own
    return (*written, *files)


def _harmonics(motion: Motion, mean: FloatArray) -> dict[str, FloatArray]:
    """Return the complex amplitude of each harmonic, its absolute value, and the mean displacement."""
    found = {"mean_m": mean}
    for h in (h for h in motion.harmonics if h > 0):
        own = np.vstack([body.amplitudes[h] for body in motion.bodies])
        found |= {
            f"harmonic_{h}_real_m": own.real,
            f"harmonic_{h}_imag_m": own.imag,
            f"harmonic_{h}_size_m": np.linalg.norm(own, axis=1),
        }
    return found


def _each(motion: Motion, values: Sequence[Any]) -> IntArray:
    """Return for each node the value of its body as a number; texts are numbered in the order of occurrence."""
    known = {value: k for k, value in enumerate(dict.fromkeys(values))}
    own = [known[v] if isinstance(v, str) else int(v) for v in values]
    return np.repeat(own, [len(b.nodes.points) for b in motion.bodies])


def _cells(motion: Motion) -> tuple[Cells, dict[str, list[IntArray]]]:
    cells: Cells = []
    numbers: list[IntArray] = []
    first = 0
    for body in motion.bodies:
        own, count = body.nodes, len(body.nodes.points)
        if own.cells is None or own.cell_numbers is None:
            cells.append(("vertex", np.arange(count)[:, None] + first))
            numbers.append(own.numbers)
        else:
            for (name, nodes), (_, rows) in zip(cell_blocks(own.cells), by_kind(own.cells), strict=True):
                cells.append((name, nodes + first))
                numbers.append(own.cell_numbers[rows])
        first += count
    return cells, {"element": numbers}


def _write(
    path: Path, points: FloatArray, cells: Cells, fields: Mapping[str, Any], numbers: Mapping[str, list[IntArray]]
) -> None:
    meshio = mesh_writer()
    data = meshio.Mesh(points, cells, point_data=dict(fields), cell_data=dict(numbers))
    with whole_file(path) as temporary:
        meshio.write(temporary, data, file_format="vtu")


def _collection(path: Path, files: Sequence[Path], times: FloatArray) -> Path:
    """Write the collection file with names and times for ParaView; return its path."""
    rows = "".join(
        f'    <DataSet timestep="{time:.17g}" part="0" file="{file.name}"/>\n'
        for file, time in zip(files, times, strict=True)
    )
    text = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n{rows}  </Collection>\n</VTKFile>\n'
    write_whole(path, text.encode())
    return path
