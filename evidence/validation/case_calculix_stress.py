"""Stress of a hot rotating block in all solid elements against CalculiX: at integration points and at nodes, static, on our decks.

Cells are twisted. CalculiX's extrapolation and averaging were measured: fields of single distorted cells, its ``.frd`` against its ``.dat``.
Stress of its displacement shows the recovery, stress of our displacement the whole. Two things of CalculiX are not followed: temperature at
the 27 points of C3D20, whose centre takes -1/8 of the corners and 1/6 of the mid-side nodes (compared at one temperature therefore), and
the nodes of C3D6.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evidence.models.annulus import filled_grid
from evidence.validation.calculix import MISSING, available, displacements, integration_stresses, run_deck
from evidence.validation.compare import Record, bound, left_out
from stickslip.arrays import FloatArray
from stickslip.model.axis import Axis
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.material import Material
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.fe.stress import PointStress, integration_stress, nodal_stress
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.readers.frd import read_frd
from stickslip.units import RPM

SOURCE = "CalculiX, run on a deck that we wrote"
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
SIZE, DIVISIONS = (0.06, 0.03, 0.02), (6, 3, 2)
AXIS = Axis((0.0, 1.0, 0.0), (-0.05, 0.0, 0.0))
FRD = ("SXX", "SYY", "SZZ", "SXY", "SYZ", "SZX")
DIGITS = 1e-5
FOUR_DIGITS = 5e-5  # its coefficients of 8 points have four digits and the sum 0.99996; those of 27 points six
SPEED = 12000.0  # rpm


@dataclass(frozen=True)
class Compared:
    """An element: its nodes, the bounds at nodes of its displacement and of ours, and whether temperature is uneven."""

    nodes: int
    at_nodes: float = DIGITS
    whole: float = DIGITS
    uneven: bool = True


CELLS = {
    "C3D4": Compared(4),
    "C3D6": Compared(6),
    "C3D8": Compared(8, FOUR_DIGITS, FOUR_DIGITS),
    "C3D8I": Compared(8, FOUR_DIGITS, FOUR_DIGITS),
    "C3D8R": Compared(8, DIGITS, 1e-2),
    "C3D10": Compared(10),
    "C3D15": Compared(15),
    "C3D20": Compared(20, FOUR_DIGITS, FOUR_DIGITS, uneven=False),
    "C3D20R": Compared(20, FOUR_DIGITS, FOUR_DIGITS),
}


def twisted_block(cell: int) -> SolidMesh:
    """Return a bowed and twisted block, clamped at one end."""
    place, cells = filled_grid(DIVISIONS, cell)
    x, y, z = (place / (2 * np.array(DIVISIONS)) * np.array(SIZE)).T
    along = x / SIZE[0]
    angle = 0.5 * along + 0.15 * np.sin(3 * y / SIZE[1])
    y, z = y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)
    points = np.column_stack([x + 0.003 * np.sin(5 * along + y / 0.007), y, z + 0.006 * along**2])
    return SolidMesh(points, cells, {"root": np.flatnonzero(place[:, 0] == 0)})


def write_case(path: Path, kind: str, rpm: float) -> None:
    """Write the deck: one static step of speed and heat."""
    own = CELLS[kind]
    mesh = twisted_block(own.nodes)
    write_deck(mesh, STEEL, path, axis=AXIS, run=CalculixRun(n_modes=0, speed=RPM * rpm))
    text = path.read_text().replace(f"TYPE=C3D{own.nodes}", f"TYPE={kind}")
    text = text.replace("*DENSITY", "*EXPANSION, ZERO=20.\n1.2e-5\n*DENSITY")
    x, y, z = (mesh.points / SIZE[0]).T
    heat = 200 + own.uneven * (300 * x + 100 * y**2 + 50 * x * z)
    rows = "".join(f"{n + 1}, {t:.10e}\n" for n, t in enumerate(heat))
    text = text.replace("*STEP\n", "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 20.\n*STEP\n", 1)
    text = text.replace("*STATIC\n", f"*STATIC\n*TEMPERATURE\n{rows}", 1)
    asked = "*EL PRINT, ELSET=EALL\nS\n*NODE FILE\nU\n*EL FILE\nS\n*END STEP"
    path.write_text(text.replace("*END STEP", asked, 1))


def in_its_order(ours: FloatArray, theirs: FloatArray) -> tuple[FloatArray, list[int]]:
    """Return our stresses (m, q, 6) with CalculiX's order of the points, the same in all cells."""
    off = np.abs(ours[:, :, None] - theirs[:, None]).max(axis=(0, 3))
    order = off.argmin(axis=0).tolist()
    assert sorted(order) == list(range(len(order)))
    return ours[:, order], order


def run() -> list[Record]:
    """Compare each element; left out without CalculiX."""
    if not available():
        return [left_out("stress of a hot rotating block", MISSING, SOURCE)]
    return [one for kind in CELLS for one in compared(kind)]


def compared(kind: str) -> list[Record]:
    """Return the records of an element."""
    own, case = CELLS[kind], f"stress of a hot rotating block, {kind}"
    solid, points, nodes, field = solved(kind, SPEED)
    largest = float(np.abs(nodes).max())
    ours = integration_stress(solid, field, heated=True)[0]
    in_order, order = in_its_order(ours.values[0], points.reshape(ours.values[0].shape))
    told = "nodes, of its displacement, with its factors and ends" if kind == "C3D6" else "nodes, of its displacement"
    records = [
        ("integration points, of its displacement", in_order - points.reshape(in_order.shape), DIGITS, largest),
        (told, at_nodes(kind, solid, field, order) - nodes, own.at_nodes, largest),
    ]
    field = solid.at_nodes(solid.displacement(RPM * SPEED))[None]
    records.append(("nodes, of our displacement", at_nodes(kind, solid, field, order) - nodes, own.whole, largest))
    return [
        bound(
            case, f"{what}: largest difference over the largest stress", float(np.abs(off).max()) / size, most, SOURCE
        )
        for what, off, most, size in records
    ]


def solved(kind: str, rpm: float) -> tuple[RotatingSolid, FloatArray, FloatArray, FloatArray]:
    """Return the solid, and CalculiX's stress at points (n, 6) and nodes (nodes, 6) and displacement (1, nodes, 3)."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "hot.inp"
        write_case(path, kind, rpm)
        printed = run_deck(path)
        deck, field = read_deck(path), read_frd(path.with_suffix(".frd")).field("STRESS")
    solid = rotating_solid(
        deck.mesh, deck.material, deck.axis, held=deck.held, quadrature=deck.quadrature, temperature=deck.temperature
    )
    nodes = np.asarray(field.values[:, [field.components.index(one) for one in FRD]])
    return solid, integration_stresses(printed), nodes, displacements(printed)[None]


def at_nodes(kind: str, solid: RotatingSolid, field: FloatArray, order: list[int]) -> FloatArray:
    """Return our stress at nodes (nodes, 6), of wedges of 6 nodes as CalculiX has it."""
    if kind == "C3D6":
        return exchanged(solid, integration_stress(solid, field, heated=True)[0], order)
    return np.asarray(nodal_stress(solid, field, heated=True)[0])


def exchanged(solid: RotatingSolid, points: PointStress, order: list[int]) -> FloatArray:
    """Return the nodal stress of wedges of 6 nodes as CalculiX has it: from the points ±√0.6, nodes 2 and 5 with the other end."""
    own = points.values[0][:, order]
    near = (1 + 1 / np.sqrt(0.6)) / 2
    lower, upper = (near * own[:, a] + (1 - near) * own[:, b] for a, b in ((0, 1), (1, 0)))
    cells = solid.mesh.cells
    total = np.zeros((len(solid.mesh.points), 6))
    for node, value in enumerate((lower, upper, lower, upper, lower, upper)):
        np.add.at(total, cells[:, node], value)
    return np.asarray(total / np.bincount(cells.ravel())[:, None])
