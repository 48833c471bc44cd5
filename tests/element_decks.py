"""Decks of clamped plates and blocks in any solid element of CalculiX, for comparisons with its frequencies.

``python -m tests.element_decks FOLDER`` writes them all; ``ccx`` then gives the numbers of ``tests/data/calculix_2_20_elements.csv``.
"""

import math
import sys
from pathlib import Path

import numpy as np

# name -> size (mm), divisions, bend (mm): the last is a bowed and twisted plate, its cells no parallelepipeds
MESHES = {
    "plate": ((100.0, 12.0, 2.0), (25, 3, 2), 0.0),
    "thin": ((100.0, 12.0, 2.0), (12, 2, 1), 0.0),
    "block": ((60.0, 30.0, 20.0), (6, 4, 3), 0.0),
    "twisted": ((100.0, 20.0, 4.0), (20, 4, 2), 6.0),
}
BRICK_EDGES = [*[(0, 1), (1, 2), (2, 3), (3, 0)], *[(4, 5), (5, 6), (6, 7), (7, 4)], *[(0, 4), (1, 5), (2, 6), (3, 7)]]
WEDGE_EDGES = [*[(0, 1), (1, 2), (2, 0)], *[(3, 4), (4, 5), (5, 3)], *[(0, 3), (1, 4), (2, 5)]]
TET_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
EDGES = {"C3D20": BRICK_EDGES, "C3D20R": BRICK_EDGES, "C3D15": WEDGE_EDGES, "C3D10": TET_EDGES}


def corner_grid(divisions):
    """Half steps (n, 3) of the corners of all bricks, (m, 8, 3)."""
    corner = 2 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    cells = np.array(
        [(2 * i, 2 * j, 2 * k) for k in range(divisions[2]) for j in range(divisions[1]) for i in range(divisions[0])]
    )
    return cells[:, None] + corner


def cells_of(kind, bricks):
    """Cells of one kind, in half steps (m, k, 3): whole bricks, or two wedges of each."""
    corners = bricks
    if kind in ("C3D6", "C3D15"):
        corners = np.concatenate([bricks[:, [0, 1, 2, 4, 5, 6]], bricks[:, [0, 2, 3, 4, 6, 7]]])
    if kind not in EDGES:
        return corners
    middles = np.stack([(corners[:, a] + corners[:, b]) // 2 for a, b in EDGES[kind]], axis=1)
    return np.concatenate([corners, middles], axis=1)


def moved(grid, size, divisions, bend):
    """Places in mm of half steps (n, 3)."""
    x, y, z = (grid / (2 * np.array(divisions)) * np.array(size)).T
    if not bend:
        return np.column_stack([x, y, z])
    along = x / size[0]
    angle = 0.5 * along + 0.15 * np.sin(3 * y / size[1])
    y, z = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    return np.column_stack([x + 0.1 * bend * np.sin(5 * along + y / 7), y, z + bend * along**2])


def deck(mesh, kinds, step="*STEP\n*FREQUENCY\n6\n*END STEP\n", extra=""):
    """Text of a deck; `kinds` names one kind, or two: bricks for the first half of the length and wedges for the rest."""
    size, divisions, bend = MESHES[mesh]
    bricks = corner_grid(divisions)
    half = bricks[:, 0, 0] < divisions[0]
    parts = [(kinds[0], bricks)] if len(kinds) == 1 else [(kinds[0], bricks[half]), (kinds[1], bricks[~half])]
    cells = [(kind, cells_of(kind, own)) for kind, own in parts]
    steps = np.unique(np.concatenate([own.reshape(-1, 3) for _, own in cells]), axis=0)
    number = {tuple(step): i for i, step in enumerate(steps.tolist(), 1)}
    lines = ["*NODE, NSET=NALL"]
    lines += [
        f"{i}, {x:.12e}, {y:.12e}, {z:.12e}" for i, (x, y, z) in enumerate(moved(steps, size, divisions, bend), 1)
    ]
    count = 0
    for kind, own in cells:
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=EALL")
        for cell in own.tolist():
            count += 1
            row = [str(count), *(str(number[tuple(node)]) for node in cell)]
            lines += [
                ", ".join(row[first : first + 12]) + ("," if first + 12 < len(row) else "")
                for first in range(0, len(row), 12)
            ]
    root = [str(number[tuple(step)]) for step in steps.tolist() if step[0] == 0]
    tip = [str(number[tuple(step)]) for step in steps.tolist() if step[0] == 2 * divisions[0]]
    for name, nodes in (("ROOT", root), ("TIP", tip)):
        lines += [f"*NSET, NSET={name}", *nodes]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.85e-9"]
    lines += ["*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL", "*BOUNDARY", "ROOT, 1, 3"]
    return "\n".join(lines) + "\n" + extra + step


def speed_step(rpm):
    """Steps of the static state under rotation about the y axis and of the modes on it."""
    square = (rpm * math.pi / 30) ** 2
    return (
        f"*STEP\n*STATIC\n*DLOAD\nEALL, CENTRIF, {square:.12e}, -50., 0., 0., 0., 1., 0.\n*END STEP\n"
        "*STEP, PERTURBATION\n*FREQUENCY\n6\n*END STEP\n"
    )


CASES = [
    *[(mesh, (kind,), 0) for mesh in MESHES for kind in ("C3D8I", "C3D8R", "C3D6", "C3D15")],
    *[
        ("twisted", kinds, 0)
        for kinds in (("C3D8", "C3D6"), ("C3D8I", "C3D6"), ("C3D20", "C3D15"), ("C3D20R", "C3D15"))
    ],
    *[("twisted", kinds, 6000) for kinds in (("C3D8I",), ("C3D8R",), ("C3D15",), ("C3D20R", "C3D15"))],
]


def name_of(mesh, kinds, rpm):
    """Name of a case, as in the table."""
    return "_".join([mesh, *kinds, *([str(rpm)] if rpm else [])])


def text_of(mesh, kinds, rpm):
    return deck(mesh, kinds, speed_step(rpm)) if rpm else deck(mesh, kinds)


if __name__ == "__main__":
    for case in CASES:
        Path(sys.argv[1], name_of(*case) + ".inp").write_text(text_of(*case))
