"""Fields for CalculiX's viewer and other readers of ``.frd``: for each harmonic a block of the real and of the imaginary part."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.readers.frd import CELLS, MODAL, RESPONSE
from stickslip.model.readers.units import Units
from stickslip.study.exchange.motion import Motion, numbers_of
from stickslip.study.exchange.stress import SurfaceFields, at_nodes
from stickslip.study.store.atomic_write import write_whole

KINDS = {len(places): kind for kind, places in CELLS.items()}  # nodes of a cell -> element type
# the format has no pyramids: they are bricks whose upper face is one node
BRICKS = {
    5: (0, 1, 2, 3, 4, 4, 4, 4),
    13: (0, 1, 2, 3, 4, 4, 4, 4, 5, 6, 7, 8, 4, 4, 4, 4, 9, 10, 11, 12),
}
PER_LINE = 10  # nodes of an element in a line
OF_MOTION = [(f"D{k}", 2, k, 0) for k in (1, 2, 3)]
OF_STRESS = [
    ("SXX", 4, 1, 1),
    ("SYY", 4, 2, 2),
    ("SZZ", 4, 3, 3),
    ("SXY", 4, 1, 2),
    ("SYZ", 4, 2, 3),
    ("SZX", 4, 3, 1),
]
MARGIN = {"alternating_pa": "ALTERN", "mean_pa": "MEAN", "allowed_pa": "ALLOWED", "utilisation": "UTILIS"}


VOID = -1.0  # written for a utilisation that is not known, as the format has no such number
UNBOUNDED = 1e9  # written for an infinite one


def write_frd(motion: Motion, path: Path, units: Units, stress: SurfaceFields | None = None) -> Path:
    """Write the motion of all nodes: the mean displacement as step 1, then one step for each harmonic with ``DISP`` and ``DISPI``.

    Step 1 has ``STRESS``, the static one, and ``MARGIN`` on the nodes of surfaces, if there is stress.

    Parameters
    ----------
    motion
        The motion at one point of a response.
    path
        The file.
    units
        Unit system of lengths, stresses and frequencies.
    stress
        Stress at the peak, of the sectors of the motion.
    """
    lines = [*_head(), *_mesh(motion, units)]
    numbers = np.concatenate(numbers_of(motion)[0])
    for step, h in enumerate([0, *(h for h in motion.harmonics if h > 0)], 1):
        own = np.vstack([body.amplitudes[h] for body in motion.bodies]) / units.length
        hertz = h * motion.hz * units.time
        lines += _block("DISP", own.real, (step, hertz), numbers)
        if h > 0:
            lines += _block("DISPI", own.imag, (step, hertz), numbers)
        if h == 0 and stress is not None:
            lines += _of_stress(stress, motion, units)
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


def _of_stress(stress: SurfaceFields, motion: Motion, units: Units) -> Iterator[str]:
    place, numbers = at_nodes(stress, motion, numbers_of(motion)[0])
    yield from _block("STRESS", stress.static[place] / units.stress, (1, 0.0), numbers, OF_STRESS)
    own = [stress.values[name][place] / factor for name, factor in zip(MARGIN, (*[units.stress] * 3, 1.0), strict=True)]
    known = np.nan_to_num(np.stack(own, axis=1), nan=VOID, posinf=UNBOUNDED)
    yield from _block("MARGIN", known, (1, 0.0), numbers, [(name, 1, 0, 0) for name in MARGIN.values()])


def _block(
    name: str,
    values: FloatArray,
    at: tuple[int, float],
    numbers: IntArray,
    components: Sequence[tuple[str, int, int, int]] = OF_MOTION,
) -> Iterator[str]:
    """Yield the lines of a field of nodes; a component has a name, its kind (1 scalar, 2 vector, 4 tensor) and two indices."""
    step, hertz = at
    kind = MODAL if hertz else 0
    whole = name.startswith("DISP")
    yield f"    1PSTEP{step:26d}{1:12d}{1:12d}"
    yield f"  100CL{100 + step:5d}{_ten_digits(hertz or 1.0):>12}{len(values):12d}{RESPONSE if hertz else '':20}{kind:2d}{step:5d}{'1':>12}"
    yield f" -4  {name:8}{len(components) + whole:5d}{1:5d}"
    for label, form, first, second in components:
        yield f" -5  {label:8}{1:5d}{form:5d}{first:5d}{second:5d}"
    if whole:
        yield f" -5  {'ALL':8}{1:5d}{2:5d}{0:5d}{0:5d}{1:5d}ALL"
    yield from _rows(numbers, values)
    yield " -3"


def _ten_digits(value: float) -> str:
    """Write a number in eleven characters."""
    return f"{value:#.10g}"[:11] if 1e-4 <= value < 1e10 else f"{value:.5E}"


def _rows(numbers: IntArray, values: FloatArray) -> Iterator[str]:
    for number, row in zip(numbers, values, strict=True):
        yield f" -1{number:10d}" + "".join(f"{value:12.5E}" for value in row)
