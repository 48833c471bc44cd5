"""Write sector.cdb, the archive of this example: bricks and wedges of second order, as ANSYS writes them with CDWRITE since 2023 R1.

A plane mesh of quadrilaterals and triangles is extruded along the axis: a disk, a fillet, an airfoil and a shroud. Triangles, where the
fillet and the shroud widen, become wedges: SOLID186 with repeated nodes. Run it in this folder: ``python make_archive.py``.
"""

import itertools
import math
from pathlib import Path

import numpy as np

SECTORS = 18
LAYERS, WIDTH = 2, 30.0  # along the axis, mm
DISK = (90.0, 105.0, 120.0, 135.0)  # radii in mm
FILLET = 143.0
AIRFOIL = (160.0, 178.0, 196.0, 214.0)
NECK, SHROUD = 221.0, 227.0
HALF_THICKNESS = 3.5
AROUND = 6  # cells of disk and shroud across a sector


def plane_mesh() -> tuple[np.ndarray, list[tuple[int, ...]], dict[str, list[int]]]:
    """Return points (n, 2) in the plane of rotation, cells of three or four points, anticlockwise, and rows of points."""
    points: list[tuple[float, float]] = []

    def wide(radius: float) -> list[int]:
        angles = np.linspace(-1, 1, AROUND + 1) * math.pi / SECTORS
        points.extend((radius * math.cos(a), radius * math.sin(a)) for a in angles)
        return list(range(len(points) - AROUND - 1, len(points)))

    def narrow(x: float) -> list[int]:
        points.extend((x, y) for y in np.linspace(-HALF_THICKNESS, HALF_THICKNESS, 3))
        return list(range(len(points) - 3, len(points)))

    disk = [wide(radius) for radius in DISK]
    blade = [narrow(x) for x in (FILLET, *AIRFOIL)]
    shroud = [wide(radius) for radius in (NECK, SHROUD)]
    cells: list[tuple[int, ...]] = []
    for rows in (disk, blade, shroud):
        for below, above in itertools.pairwise(rows):
            cells += [(a, c, d, b) for a, b, c, d in zip(below, below[1:], above, above[1:], strict=False)]
    middle = AROUND // 2
    for wide_row, narrow_row, turn in ((disk[-1], blade[0], 1), (shroud[0], blade[-1], -1)):
        left, mid, right = narrow_row
        w = wide_row[middle - 2 : middle + 3]
        own = [(w[1], left, mid, w[2]), (w[2], mid, right, w[3]), (w[0], left, w[1]), (w[3], right, w[4])]
        cells += [cell[::turn] for cell in own]
    ends = {"bore": disk[0], "low": [row[0] for row in disk], "high": [row[-1] for row in disk], "tip": blade[-1][1:2]}
    ends |= {"shroud_low": [row[0] for row in shroud], "shroud_high": [row[-1] for row in shroud]}
    return np.array(points), cells, ends


def solid_mesh() -> tuple[np.ndarray, list[list[int]], dict[str, np.ndarray]]:
    """Return points (n, 3), 20 nodes of each cell as SOLID186 counts them, and node sets; indices from 0."""
    plane, cells, ends = plane_mesh()
    levels = np.linspace(-WIDTH / 2, WIDTH / 2, LAYERS + 1)
    corner = np.vstack([np.column_stack([plane, np.full(len(plane), z)]) for z in levels])
    points, known = list(corner), dict[tuple[int, int], int]()

    def between(a: int, b: int) -> int:
        if a == b:
            return a
        key = (min(a, b), max(a, b))
        if key not in known:
            known[key] = len(points)
            points.append((points[a] + points[b]) / 2)
        return known[key]

    solids = []
    for layer in range(LAYERS):
        for cell in cells:
            flat = [*cell, cell[2]][:4] if len(cell) == 3 else list(cell)
            low, high = ([node + (layer + k) * len(plane) for node in flat] for k in (0, 1))
            around = [between(row[i], row[(i + 1) % 4]) for row in (low, high) for i in range(4)]
            solids.append([*low, *high, *around, *(between(a, b) for a, b in zip(low, high, strict=True))])
    used = np.unique(solids)
    place = np.array(points)[used]
    sets = {}
    for name, row in ends.items():
        corners = {node + k * len(plane) for node in row for k in range(LAYERS + 1)}
        inside = corners | {mid for (a, b), mid in known.items() if a in corners and b in corners}
        sets[name] = np.searchsorted(used, sorted(inside & set(used.tolist())))
    return place, [np.searchsorted(used, cell).tolist() for cell in solids], sets


def write_archive(path: Path) -> None:
    """Write nodes, elements, components and the material; mm, t, s."""
    points, cells, sets = solid_mesh()
    names = {"low": "CYCLIC_M01L", "high": "CYCLIC_M01H"}
    lines = ["/COM, written by make_archive.py", "/PREP7"]
    lines += ["ETBLOCK,        1,        1", "(2i9,19a9)", f"{1:9d}{186:9d}" + f"{0:9d}" * 18, f"{-1:9d}"]
    lines += [f"NBLOCK,6,SOLID,{len(points):9d},{len(points):9d}", "(3i9,6e21.13e3)"]
    lines += [f"{n:9d}{0:9d}{0:9d}" + "".join(f"{x:21.13E}" for x in p) for n, p in enumerate(points, 1)]
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(cells):9d},{len(cells):9d}", "(19i9)"]
    for number, cell in enumerate(cells, 1):
        nodes = [f"{node + 1:9d}" for node in cell]
        head = [1, 1, 1, 1, 0, 0, 0, 0, 20, 0, number]
        lines += ["".join(f"{i:9d}" for i in head) + "".join(nodes[:8]), "".join(nodes[8:])]
    lines.append(f"{-1:9d}")
    for name, nodes in sets.items():
        lines += [f"CMBLOCK,{names.get(name, name.upper()):<32},NODE,{len(nodes):8d}", "(8i10)"]
        lines += ["".join(f"{n + 1:10d}" for n in nodes[i : i + 8]) for i in range(0, len(nodes), 8)]
    for word, value in (("EX", 2.0e5), ("NUXY", 0.3), ("DENS", 7.8e-9)):
        lines.append(f"MPDATA,R5.0, 1,{word:<4},       1, 1, {value:.9E}")
    path.write_text("\n".join([*lines, "FINISH"]) + "\n", encoding="ascii")


if __name__ == "__main__":
    write_archive(Path("sector.cdb"))
