"""Fields for CalculiX's viewer and other readers of ``.frd``: for each harmonic a block of the real and of the imaginary part."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.readers.frd import CELLS, MODAL, RESPONSE
from stickslip.model.readers.units import Units
from stickslip.study.exchange.motion import Motion, numbers_of
from stickslip.study.store.atomic_write import write_whole

KINDS = {len(places): kind for kind, places in CELLS.items()}  # nodes of a cell -> element type
# the format has no pyramids: they are bricks whose upper face is one node
BRICKS = {
    5: (0, 1, 2, 3, 4, 4, 4, 4),
    13: (0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 4, 4, 4, 4, 9, 10, 11, 12),
}
PER_LINE = 10  # nodes of an element in a line


def write_frd(motion: Motion, path: Path, units: Units) -> Path:
    """Write the motion of all nodes: the mean displacement as step 1, then one step for each harmonic with ``DISP`` and ``DISPI``.

    Parameters
    ----------
    motion
        The motion at one point of a response.
    path
        The file.
    units
        Unit system of lengths and frequencies.
    """
    lines = [*_head(), *_mesh(motion, units)]
    for step, h in enumerate([0, *(h for h in motion.harmonics if h > 0)], 1):
        own = np.vstack([body.amplitudes[h] for body in motion.bodies]) / units.length
        hertz = h * motion.hz * units.time
        lines += _block("DISP", own.real, (step, hertz), motion)
        if h > 0:
            lines += _block("DISPI", own.imag, (step, hertz), motion)
    write_whole(path, "\n".join([*lines, " 9999", ""]).encode())
    return path


def _head() -> list[str]:
    said = ("UPGM               stickslip", "UUSER")
    return ["    1C", *(f"    1{text:<67}" for text in said)]


def _mesh(motion: Motion, units: Units) -> Iterator[str]:
    nodes, cells = numbers_of(motion)
    points = np.vstack([body.nodes.points for body in motion.bodies]) / units.length
    yield f"    2C                  {len(points):12d}{'1':>38}"
    yield from _rows(np.concatenate(nodes), points)
    yield " -3"
    yield f"    3C                  {sum(own.size for own in cells):12d}{'1':>38}"
    for body, own, numbers in zip(motion.bodies, nodes, cells, strict=True):
        if body.nodes.cells is None:
            continue
        for row_nodes, number in zip(body.nodes.cells, numbers, strict=True):
            row = row_nodes[row_nodes >= 0]
            row = row[list(BRICKS.get(len(row), range(len(row))))]
            kind = KINDS[len(row)]
            row = own[row[np.argsort(CELLS[kind])]]
            yield f" -1{number:10d}{kind:5d}{0:5d}{1:5d}"
            for first in range(0, row.size, PER_LINE):
                yield " -2" + "".join(f"{node:10d}" for node in row[first : first + PER_LINE])
    yield " -3"


def _block(name: str, values: FloatArray, at: tuple[int, float], motion: Motion) -> Iterator[str]:
    step, hertz = at
    kind = MODAL if hertz else 0
    yield f"    1PSTEP{step:26d}{1:12d}{1:12d}"
    yield f"  100CL{100 + step:5d}{_ten_digits(hertz or 1.0):>12}{len(values):12d}{RESPONSE if hertz else '':20}{kind:2d}{step:5d}{'1':>12}"
    yield f" -4  {name:8}{4:5d}{1:5d}"
    for component in (1, 2, 3):
        yield f" -5  {f'D{component}':8}{1:5d}{2:5d}{component:5d}{0:5d}"
    yield f" -5  {'ALL':8}{1:5d}{2:5d}{0:5d}{0:5d}{1:5d}ALL"
    yield from _rows(np.concatenate(numbers_of(motion)[0]), values)
    yield " -3"


def _ten_digits(value: float) -> str:
    """Write a number in eleven characters."""
    return f"{value:#.10g}"[:11] if 1e-4 <= value < 1e10 else f"{value:.5E}"


def _rows(numbers: IntArray, values: FloatArray) -> Iterator[str]:
    for number, (x, y, z) in zip(numbers, values, strict=True):
        yield f" -1{number:10d}{x:12.5E}{y:12.5E}{z:12.5E}"
