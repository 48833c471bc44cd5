"""Hot sectors of a disk: properties over temperature, thermal strain and its prestress, with and without speed, on our decks.

The temperatures change along the radius, around and along the axis; they are fields of the nodes in the deck.
"""

import tempfile
from pathlib import Path

import numpy as np

from evidence.models.annulus import annular_sector
from evidence.validation.calculix import MISSING, available, displacements, run_deck
from evidence.validation.calculix_stored import waves_compared
from evidence.validation.compare import Record, bound, left_out
from stickslip.arrays import FloatArray
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.material import Material
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.reduction.cyclic import cyclic_sector
from stickslip.units import RPM

SOURCE = "CalculiX, run on a deck that we wrote"
SECTORS, DIAMETERS, MODES = 12, 2, 4
DIGITS = 1e-6
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
ISOTROPIC = """*ELASTIC
2.1e+11, 0.29, 20.
1.9e+11, 0.30, 300.
1.5e+11, 0.32, 700.
*EXPANSION, ZERO=25.
1.15e-5, 20.
1.40e-5, 700.
"""
ORTHOTROPIC = """*ELASTIC, TYPE=ENGINEERING CONSTANTS
1.2e+11, 3.0e+10, 1.2e+10, 0.28, 0.31, 0.35, 6.0e+09, 5.0e+09,
4.0e+09, 20.
0.9e+11, 2.0e+10, 1.0e+10, 0.25, 0.30, 0.33, 5.5e+09, 4.0e+09,
3.0e+09, 700.
*EXPANSION, TYPE=ORTHO, ZERO=25.
0.3e-5, 0.5e-5, 0.8e-5, 20.
0.4e-5, 0.6e-5, 0.8e-5, 700.
"""
SKEWED = "\n1., 0.5, 0.2, -0.3, 1., 0.4"
CASES = {
    # name -> nodes of a cell, material, orientation, speed
    "tetrahedra C3D10, steel, 6000 rpm": (10, ISOTROPIC, "", 6000.0),
    "wedges C3D15, orthotropic in cylindrical axes, 6000 rpm": (
        15,
        ORTHOTROPIC,
        ", SYSTEM=CYLINDRICAL\n0., 0., 0., 0., 0., 1.",
        6000.0,
    ),
    "tetrahedra C3D10, orthotropic in skewed axes, 3000 rpm": (10, ORTHOTROPIC, SKEWED, 3000.0),
}


def temperatures(points: FloatArray) -> FloatArray:
    """Return the temperatures (n,) of nodes (n, 3) in m; the same on both cyclic faces."""
    radius, angle = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
    around = np.cos(SECTORS * angle)
    return np.asarray(250 + 1500 * (radius - 0.1) + 20 * around + 300 * points[:, 2])


def write_case(path: Path, cell: int, material: str, axes: str, rpm: float) -> None:
    """Write the deck: a static step of heat and speed, and the modes on it."""
    mesh = annular_sector(0.1, 0.2, 0.03, sectors=SECTORS, divisions=(3, 2, 1), cell=cell)
    run = CalculixRun(n_modes=MODES, nodal_diameters=(0, DIAMETERS), speed=RPM * rpm)
    write_deck(mesh, STEEL, path, sectors=SECTORS, run=run)
    text = path.read_text()
    head, _, rest = text.partition("*ELASTIC\n")
    text = f"{head}{material}*DENSITY{rest.partition('*DENSITY')[2]}"
    if axes:
        text = text.replace("*SOLID SECTION", f"*ORIENTATION, NAME=AXES{axes}\n*SOLID SECTION")
        text = text.replace("MATERIAL=MATERIAL", "MATERIAL=MATERIAL, ORIENTATION=AXES")
    first = int(max(0, 1 - mesh.numbers.min()))
    rows = "".join(f"{n + first}, {t:.10e}\n" for n, t in zip(mesh.numbers, temperatures(mesh.points), strict=True))
    text = text.replace("*STEP\n", "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nNALL, 40.\n*STEP\n", 1)
    path.write_text(text.replace("*STATIC\n", f"*STATIC\n*TEMPERATURE\n{rows}", 1))


def run() -> list[Record]:
    """Compare static displacements and frequencies of a few nodal diameters; without CalculiX the comparison is left out."""
    if not available():
        return [left_out("hot sectors", MISSING, SOURCE)]
    return [one for name, given in CASES.items() for one in compared(f"hot sector of 12, {name}", given)]


def compared(case: str, given: tuple[int, str, str, float]) -> list[Record]:
    """Return the records of a case."""
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "hot.inp"
        write_case(path, *given)
        printed = run_deck(path)
        deck = read_deck(path)
    assert deck.speed is not None
    solid = rotating_solid(
        deck.mesh, deck.material, deck.axis, held=deck.held, quadrature=deck.quadrature, temperature=deck.temperature
    )
    tie = cyclic_sector(solid.structure, SECTORS, axis=deck.axis).tie
    ours, theirs = solid.at_nodes(solid.displacement(deck.speed, tie=tie)), displacements(printed)
    off = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    records = [bound(case, "static displacement: largest difference over its largest", off, DIGITS, SOURCE)]
    turning = solid.at_speed(deck.speed, tie=tie)
    return [*records, *waves_compared(case, "", turning, deck.axis, SECTORS, printed, DIGITS, SOURCE)]
