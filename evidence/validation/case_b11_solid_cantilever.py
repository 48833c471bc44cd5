"""B11 by solids: a slender rotating cantilever of hexahedra and of tetrahedra against the limit of Euler and Bernoulli.

The beam is a hundred times as long as deep. Shear, rotary inertia and the static strain are worth up to 4e-4 there, and are not in the reference.
"""

import math

import numpy as np

from evidence.validation.compare import Record, record
from stickslip.arrays import FloatArray, IntArray
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies

SOURCE = "Hodges & Rutkowski 1981; Wright et al. 1982; 120 Hermite elements"
SLENDER = 1e-3  # room for what the limit leaves out, and for the mesh
LENGTH, DEPTH, ELEMENTS = 1.0, 0.01, 40
MATERIAL = Material(poisson_ratio=0.0)
# (η, hub radius / length) -> flap 1, flap 2, lag 1 in units of sqrt(EI/ρA)/L²
TABLE = {
    (0, 0): (3.516015, 22.034491, 3.516015),
    (1, 0): (3.681647, 22.181011, 3.543236),
    (2, 0): (4.137319, 22.614922, 3.621796),
    (3, 0): (4.797278, 23.320264, 3.743511),
    (4, 0): (5.585002, 24.273350, 3.897723),
    (5, 0): (6.449545, 25.446080, 4.073896),
    (10, 0): (11.202328, 33.640366, 5.048974),
    (1, 1): (3.888823, 22.375014, 3.758050),
    (2, 1): (4.833689, 23.366042, 4.400516),
    (3, 1): (6.081750, 24.927745, 5.290338),
    (4, 1): (7.475048, 26.957262, 6.314771),
    (5, 1): (8.940358, 29.352835, 7.411477),
    (10, 1): (16.606363, 44.368224, 13.257876),
}
CUBE_TETS = [(0, 1, 3, 7), (0, 5, 1, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 4, 5, 7), (0, 6, 4, 7)]
TET_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
HEX_EDGES = [*[(0, 1), (1, 3), (3, 2), (2, 0), (4, 5), (5, 7), (7, 6), (6, 4)], *[(0, 4), (1, 5), (3, 7), (2, 6)]]


def beams(hub: float) -> dict[str, SolidMesh]:
    """Return the beam along x from the hub's radius on, a row of cells of either kind; ``root`` is clamped."""
    steps = np.array([ELEMENTS, 1, 1])
    grid = np.stack(np.meshgrid(*(np.arange(s + 1) for s in steps), indexing="ij"), axis=-1)
    points = grid.reshape(-1, 3) / steps * [LENGTH, DEPTH, DEPTH]
    points += [hub * LENGTH, -DEPTH / 2, -DEPTH / 2]
    # corners of a cell: bits of their number are the steps along x, y, z
    corner = np.array([4 * (i & 1) + 2 * (i >> 1 & 1) + (i >> 2 & 1) for i in range(8)])
    cubes = 4 * np.arange(ELEMENTS)[:, None] + corner
    hexahedra = cubes[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    ends = cubes[:, np.array(HEX_EDGES)]
    tets = cubes[:, CUBE_TETS].reshape(-1, 4)
    return {
        "hexahedra of 20 nodes": _second_order(points, hexahedra, ends),
        "tetrahedra of 10 nodes": _second_order(points, tets, tets[:, np.array(TET_EDGES)]),
    }


def _second_order(points: FloatArray, corners: IntArray, ends: IntArray) -> SolidMesh:
    """Put a node in the middle of each edge, whose `ends` are (m, edges, 2)."""
    unique, inverse = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    cells = np.hstack([corners, len(points) + inverse.reshape(len(corners), -1)])
    points = np.vstack([points, points[unique].mean(axis=1)])
    return SolidMesh(points, cells, {"root": np.flatnonzero(points[:, 0] < points[:, 0].min() + 1e-9)})


def run() -> list[Record]:
    """Compare flap and lag of both kinds of cells at every speed and hub radius of the table."""
    scale = math.sqrt(12 * MATERIAL.density / MATERIAL.young_modulus) * LENGTH**2 / DEPTH
    records = []
    solids = {(hub, name): rotating_solid(mesh, MATERIAL) for hub in (0, 1) for name, mesh in beams(hub).items()}
    for (eta, hub), (flap, flap2, lag) in TABLE.items():
        for name in beams(0):
            turning = solids[hub, name].at_speed(eta / scale)
            found = 2 * math.pi * scale * natural_frequencies(turning, 4)
            case = f"B11, {name}, η = {eta}, hub radius {hub} L"
            for quantity, reference in (("flap 1", flap), ("flap 2", flap2), ("lag 1", lag)):
                nearest = found[np.argmin(np.abs(found - reference))]
                records.append(record(case, quantity, nearest, reference, SLENDER, SOURCE))
    return records
