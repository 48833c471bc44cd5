"""Write the two decks of this example, blade.inp and disk.inp: a dovetail root in its slot, of 20-node bricks.

The flanks of root and slot lie on each other; their meshes do not match.
"""

from pathlib import Path

import numpy as np

from stickslip import Material
from stickslip.model import CalculixRun, SolidMesh, write_deck

HALF_WIDTH = (0.012, 0.007)  # m, of the root at its foot and at its neck
ROOT_HEIGHT, BLADE_HEIGHT, DEPTH, LUG = 0.008, 0.07, 0.02, 0.01  # m
CORNERS = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 2], [2, 0, 2], [2, 2, 2], [0, 2, 2]])
EDGES = ((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7))


def block(lines, place=lambda at: at, sets=None, quadratic=True):
    """Return a mesh of bricks on a grid.

    Parameters
    ----------
    lines
        Three growing lists: where the grid lines stand.
    place
        From places on the grid (n, 3) to those in space, m.
    sets
        Name of a node set -> function that tells which places on the grid (n, 3) belong to it.
    quadratic
        Bricks of 20 nodes instead of 8.
    """
    fine = [np.interp(np.arange(2 * len(s) - 1) / 2, np.arange(len(s)), s) for s in lines]
    number = np.arange(np.prod([len(s) for s in fine])).reshape([len(s) for s in fine])
    first = np.stack(np.meshgrid(*(np.arange(0, len(s) - 1, 2) for s in fine), indexing="ij"), -1)
    steps = [*CORNERS, *((CORNERS[a] + CORNERS[b]) // 2 for a, b in EDGES if quadratic)]
    cells = np.stack([number[tuple((first.reshape(-1, 3) + step).T)] for step in steps], axis=1)
    used, cells = np.unique(cells, return_inverse=True)
    at = np.stack(np.meshgrid(*fine, indexing="ij"), -1).reshape(-1, 3)[used]
    found = {name: np.flatnonzero(inside(at)) for name, inside in (sets or {}).items()}
    return SolidMesh(place(at), cells.reshape(-1, len(steps)), found)


def joined(*meshes):
    """Return meshes side by side as one; sets of the same name become one."""
    offsets = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    sets = {}
    for mesh, offset in zip(meshes, offsets, strict=False):
        for name, nodes in mesh.node_sets.items():
            sets[name] = np.concatenate([sets.get(name, nodes[:0]), nodes + offset])
    cells = [mesh.cells + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return SolidMesh(np.vstack([mesh.points for mesh in meshes]), np.vstack(cells), sets)


def half_width(z):
    """Return half the width of the blade at a height; its root is a dovetail."""
    return np.interp(z, [0.0, ROOT_HEIGHT], HALF_WIDTH)


def blade(across=2, along=2, up=2, above=4):
    """Return the mesh of the blade: x over its half width, y, z."""

    def place(at):
        return np.column_stack([at[:, 0] * half_width(at[:, 2]), at[:, 1:]])

    def flank(side):
        return lambda at: (at[:, 0] == side) & (at[:, 2] <= ROOT_HEIGHT)

    heights = [*np.linspace(0, ROOT_HEIGHT, up + 1)]
    heights += [*np.linspace(ROOT_HEIGHT, BLADE_HEIGHT, above + 1)][1:]
    lines = (np.linspace(-1, 1, across + 1), np.linspace(0, DEPTH, along + 1), heights)
    return block(lines, place, {"left": flank(-1), "right": flank(1), "tip": lambda at: at[:, 2] == BLADE_HEIGHT})


def lug(side, across=1, along=3, up=1):
    """Return the mesh of the disk's lug on one side of the slot: x from the flank outwards."""

    def place(at):
        x = half_width(at[:, 2]) + LUG * at[:, 0]
        return np.column_stack([side * x, at[:, 1:]])

    # from the outer face inwards on the left, or bricks would be inside out
    x = np.linspace(0, 1, across + 1)
    lines = (x if side > 0 else x[::-1], np.linspace(0, DEPTH, along + 1), np.linspace(0, ROOT_HEIGHT, up + 1))
    name = "right" if side > 0 else "left"
    return block(lines, place, {name: lambda at: at[:, 0] == 0, "held": lambda at: at[:, 0] == 1})


if __name__ == "__main__":
    here, steel = Path(__file__).parent, Material()
    write_deck(blade(), steel, here / "blade.inp", clamped=(), run=CalculixRun(n_modes=3))
    disk = joined(lug(-1), lug(1))
    write_deck(disk, steel, here / "disk.inp", clamped=("held",), run=CalculixRun(n_modes=3))
