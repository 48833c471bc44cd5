"""Meshes of solids, their skin, fine and coarse, and mesh files for ParaView and gmsh; meshio is imported only to write a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error, missing_package

# number of nodes -> VTK's name: each kind of cell has its own number
CELL_NAMES = {
    4: "tetra",
    10: "tetra10",
    5: "pyramid",
    13: "pyramid13",
    6: "wedge",
    15: "wedge15",
    8: "hexahedron",
    20: "hexahedron20",
}
CORNERS = {4: 4, 10: 4, 5: 5, 13: 5, 6: 6, 15: 6, 8: 8, 20: 8}
# edges of second-order cells in the order of their mid nodes, which follow the corners
TET_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
PYRAMID_EDGES = (*((0, 1), (1, 2), (2, 3), (0, 3)), *((0, 4), (1, 4), (2, 4), (3, 4)))
WEDGE_EDGES = (*((0, 1), (1, 2), (0, 2)), *((3, 4), (4, 5), (3, 5)), *((0, 3), (1, 4), (2, 5)))
HEX_EDGES = (*((0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7)), *((0, 4), (1, 5), (2, 6), (3, 7)))
EDGES = {4: TET_EDGES, 5: PYRAMID_EDGES, 6: WEDGE_EDGES, 8: HEX_EDGES}  # by number of corners
# corners of the faces, anticlockwise seen from outside
FACES: dict[int, tuple[tuple[int, ...], ...]] = {
    4: ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    5: ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    6: ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    8: ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A mesh of tetrahedra, pyramids, wedges and hexahedra of first or second order, of one kind or of several.

    Parameters
    ----------
    points
        (n, 3) nodes in metres.
    cells
        (m, k) nodes of each cell in VTK order: 4 or 10 for a tetrahedron, 5 or 13 for a pyramid, 6 or 15 for a wedge, 8 or 20
        (serendipity) for a hexahedron. With cells of several kinds, -1 fills the ends of shorter rows.
    node_sets
        Name -> nodes, as indices into `points`; ``root`` is clamped.
    numbers
        (n,) node numbers of the program that wrote the mesh; 0 ... n − 1 by default.
    cell_numbers
        (m,) cell numbers of that program; 0 ... m − 1 by default.

    Raises
    ------
    InputError
        If the cells have another number of nodes or refer to missing nodes, or the counts of numbers differ from those
        of nodes and cells.
    """

    points: FloatArray
    cells: IntArray
    node_sets: Mapping[str, IntArray]
    numbers: IntArray = None  # type: ignore[assignment]  # counted in __post_init__
    cell_numbers: IntArray = None  # type: ignore[assignment]  # counted in __post_init__

    def __post_init__(self) -> None:
        if self.cells.ndim != 2 or not set(np.unique(widths_of(self.cells))) <= CELL_NAMES.keys():
            raise input_error(
                "SolidMesh.cells",
                "needs rows of 4, 5, 6, 8, 10, 13, 15 or 20 nodes, got "
                + (
                    f"{sorted(set(widths_of(self.cells).tolist()))}"
                    if self.cells.ndim == 2
                    else f"an array of shape {self.cells.shape}"
                ),
                "Use tetrahedra, pyramids, wedges or hexahedra of first or second order; -1 fills the ends of shorter rows.",
            )
        n, m = len(self.points), len(self.cells)
        own = np.arange(self.cells.shape[1]) < widths_of(self.cells)[:, None]
        nodes = self.cells[own]
        if m and not (0 <= nodes.min() <= nodes.max() < n and (self.cells[~own] == -1).all()):
            raise input_error(
                "SolidMesh.cells",
                f"name nodes from {nodes.min()} to {nodes.max()}, but there are {n} points",
                "Cells hold indices into points, counted from 0, not node numbers; -1 fills the ends of shorter rows.",
            )
        for name, count in (("numbers", n), ("cell_numbers", m)):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.arange(count))
            elif getattr(self, name).shape != (count,):
                raise input_error(
                    f"SolidMesh.{name}", f"has shape {getattr(self, name).shape} for {count}", "Give one number each."
                )

    @property
    def surface(self) -> IntArray:
        """(k, 3) corner nodes of the skin's triangles, oriented outward; a quadrilateral gives two."""
        skin = _skin(self)
        three = np.isin(widths_of(skin), (3, 6))
        if three.all():
            return np.asarray(skin[:, :3], dtype=np.int64)
        halves = skin[:, [[0, 1, 2], [0, 2, 3]]]
        kept = np.ones(halves.shape[:2], dtype=bool)
        kept[three, 1] = False
        return np.asarray(halves[kept], dtype=np.int64)


def widths_of(rows: IntArray) -> IntArray:
    """Return the number of nodes of each cell or facet in `rows` (m, k), whose short rows -1 fills."""
    return np.asarray(np.count_nonzero(rows >= 0, axis=-1), dtype=np.int64)


def by_kind(cells: IntArray) -> list[tuple[int, IntArray]]:
    """Return the number of nodes of each kind of cell in `cells` (m, k), and the rows of its cells."""
    widths = widths_of(cells)
    return [(int(width), np.flatnonzero(widths == width)) for width in np.unique(widths)]


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """Write the mesh for ParaView (``.vtu``) or gmsh (``.msh``); node sets become point data."""
    if path.suffix not in {".vtu", ".msh"}:
        raise input_error(str(path), f"unknown mesh format {path.suffix!r}", "Use .vtu or .msh.")
    meshio = mesh_writer()
    flags = {}
    for name, nodes in mesh.node_sets.items():
        flags[name] = np.zeros(len(mesh.points))
        flags[name][nodes] = 1.0
    tags = {}
    if path.suffix == ".msh":
        ones = [np.ones(len(rows), dtype=np.int32) for _, rows in by_kind(mesh.cells)]
        tags = {"gmsh:physical": ones, "gmsh:geometrical": ones}
    data = meshio.Mesh(mesh.points, cell_blocks(mesh.cells), point_data=flags, cell_data=tags)
    if path.suffix == ".msh":
        meshio.write(path, data, file_format="gmsh22", binary=True)
    else:
        meshio.write(path, data)


def mesh_writer() -> Any:
    """Return the module meshio; if it is missing, a `StickslipError` says how to install it."""
    try:
        import meshio
        from meshio._mesh import topological_dimension
    except ModuleNotFoundError as error:
        raise missing_package("meshio", error, "fe") from error
    # meshio 5.3.5 writes these cells, but its list of dimensions lacks them
    for kind in ("wedge15", "pyramid13"):
        topological_dimension.setdefault(kind, 3)
    return meshio


def cell_blocks(cells: IntArray) -> list[tuple[str, IntArray]]:
    """Return VTK's name and the nodes of the cells of each kind."""
    return [(CELL_NAMES[width], cells[rows, :width]) for width, rows in by_kind(cells)]


def facets_of(mesh: SolidMesh, nodes: IntArray) -> IntArray:
    """Return the facets of the skin whose nodes all belong to a set.

    Parameters
    ----------
    mesh
        The mesh.
    nodes
        Indices into ``mesh.points``.

    Returns
    -------
    numpy.ndarray
        (m, k) indices into ``mesh.points``: corners anticlockwise seen from outside, then the mid node of each edge in turn;
        k = 3 or 6 for triangles, 4 or 8 for quadrilaterals. If both occur, -1 fills the ends of shorter rows.
    """
    inside = np.zeros(len(mesh.points) + 1, dtype=bool)
    inside[nodes] = True
    touched = np.count_nonzero(inside[mesh.cells], axis=1) >= 3
    if not touched.any():
        return np.zeros(
            (0, max(pattern.shape[1] for w, _ in by_kind(mesh.cells) for pattern in _patterns(w))), dtype=np.int64
        )
    skin = _skin(mesh)
    inside[-1] = True
    return np.asarray(skin[inside[skin].all(axis=1)], dtype=np.int64)


def _skin(mesh: SolidMesh) -> IntArray:
    """Return the faces that belong to one cell alone, as in `facets_of`."""
    faces = faces_of(mesh)[0]
    corners = np.where(np.isin(widths_of(faces), (3, 6)), 3, 4)
    widest = int(corners.max(initial=3))
    key = np.where(np.arange(widest) < corners[:, None], faces[:, :widest], -1)
    _, first, count = np.unique(np.sort(key, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[count == 1])])


def faces_of(mesh: SolidMesh) -> tuple[IntArray, IntArray]:
    """Return all faces of all cells (f, k), as in `facets_of`, and the cell (f,) of each; neighbours both list their common face."""
    found, owners = [], []
    for width, rows in by_kind(mesh.cells):
        for pattern in _patterns(width):
            found.append(mesh.cells[rows][:, pattern].reshape(-1, pattern.shape[1]))
            owners.append(np.repeat(rows, len(pattern)))
    widest = max((block.shape[1] for block in found), default=3)
    filled = [np.pad(block, ((0, 0), (0, widest - block.shape[1])), constant_values=-1) for block in found]
    return np.vstack(filled), np.concatenate(owners)


def _patterns(width: int) -> list[IntArray]:
    """Return the local nodes of the faces of a cell with `width` nodes, corners first: one array for each kind of face."""
    corners = CORNERS[width]
    place = {pair: corners + i for i, pair in enumerate(EDGES[corners])}
    found = []
    for count in (3, 4):
        rows = np.array([face for face in FACES[corners] if len(face) == count])
        if not len(rows):
            continue
        if width > corners:
            middles = [
                [place[min(a, b), max(a, b)] for a, b in zip(row, np.roll(row, -1), strict=True)] for row in rows
            ]
            rows = np.hstack([rows, np.array(middles)])
        found.append(rows)
    return found


def mirrored_cells(cells: IntArray) -> IntArray:
    """Return cells (m, k) after a mirror operation, with corners reordered so that volumes stay positive."""
    order = {
        4: [1, 0, 2, 3],
        10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9],
        5: [0, 3, 2, 1, 4],
        13: [0, 3, 2, 1, 4, 8, 7, 6, 5, 9, 12, 11, 10],
        6: [0, 2, 1, 3, 5, 4],
        15: [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13],
        8: [*range(4, 8), *range(4)],
        20: [*range(4, 8), *range(4), *range(12, 16), *range(8, 12), *range(16, 20)],
    }
    found = cells.copy()
    for width, rows in by_kind(cells):
        found[rows, :width] = cells[rows][:, order[width]]
    return found


_GROWTH = 1.12  # growth of the cell size from one trial to the next


def coarse_skin(points: FloatArray, triangles: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Merge points that lie in the same cell of a grid, with the smallest cell that leaves at most `most` of them.

    Parameters
    ----------
    points
        (n, 3) positions.
    triangles
        (k, 3) points of each triangle; points without a triangle are dropped.
    most
        Number of points that may remain.

    Returns
    -------
    kept
        (m,) points of the fine skin that remain, one of each cell, the nearest to its centroid.
    triangles
        (j, 3) points of each triangle, as indices into `kept`; triangles that have shrunk to a line or coincide are dropped.
    """
    used = np.unique(triangles)
    place = np.full(len(points), -1, dtype=np.int64)
    place[used] = np.arange(len(used))
    faces = place[triangles]
    if len(used) <= most:
        return used, faces
    at = points[used] - points[used].min(axis=0)
    cell = 0.5 * np.sqrt(_area(points, triangles) / most)
    while True:
        _, label = np.unique(np.floor(at / cell).astype(np.int64), axis=0, return_inverse=True)
        count = int(label.max()) + 1
        if count <= most:
            break
        cell *= _GROWTH
    label = label.ravel()
    nearest = _representatives(at, label, count)
    merged = label[faces]
    a, b, c = merged.T
    merged = merged[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(merged, axis=1), axis=0, return_index=True)
    return used[nearest], merged[np.sort(first)]


def _representatives(points: FloatArray, label: IntArray, count: int) -> IntArray:
    """Return, for each label, the labelled point nearest to their centroid."""
    size = np.bincount(label, minlength=count)
    centroid = np.stack([np.bincount(label, points[:, k], count) for k in range(3)], axis=1)
    off = np.linalg.norm(points - (centroid / size[:, None])[label], axis=1)
    order = np.lexsort((off, label))
    return np.asarray(order[np.searchsorted(label[order], np.arange(count))])


def _area(points: FloatArray, triangles: IntArray) -> float:
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal, axis=1).sum() / 2)
