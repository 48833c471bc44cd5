"""Orthotropic and anisotropic sectors of a disk in fixed and in cylindrical axes, at rest and at speed: CalculiX run on our decks.

Axes of a material turn with the sector, in CalculiX as here: the cyclic tie says nothing about the material.
"""

import tempfile
from pathlib import Path

import numpy as np

from evidence.models.annulus import annular_sector
from evidence.validation.calculix import MISSING, available, displacements, run_deck
from evidence.validation.calculix_stored import waves_compared
from evidence.validation.compare import Record, bound, left_out
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.material import Material
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.reduction.cyclic import cyclic_sector
from stickslip.units import RPM

SOURCE = "CalculiX, run on a deck that we wrote"
SECTORS, DIAMETERS, MODES = 12, 2, 4
SPEED_RPM = 6000.0
DIGITS = 1e-6
STEEL = Material(young_modulus=210e9, poisson_ratio=0.3, density=7850.0)
ORTHO = "1.33e+11, 1.6e+10, 4.1e+10, 9.0e+09, 8.0e+09, 1.7e+10, 8.2e+09, 7.1e+09,\n6.3e+09"
ENGINEERING = "1.2e+11, 3.0e+10, 1.2e+10, 0.28, 0.31, 0.35, 6.0e+09, 5.0e+09,\n4.0e+09"
# a matrix without any symmetry
ANISO = (
    "3.0e+11, 1.1e+11, 3.2e+11, 1.3e+11, 1.4e+11, 3.5e+11, 1.6e+10, 1.7e+10,\n"
    "1.8e+10, 9.0e+10, 2.0e+10, 2.1e+10, 2.2e+10, 2.3e+10, 1.1e+11, 2.5e+10,\n"
    "2.6e+10, 2.7e+10, 2.8e+10, 2.9e+10, 1.3e+11"
)
SKEWED = "\n1., 0.5, 0.2, -0.3, 1., 0.4"
CASES = {
    # name -> nodes of a cell, type and constants, orientation
    "bricks C3D20, ORTHO, skewed axes": (20, "ORTHO", ORTHO, SKEWED),
    "tetrahedra C3D10, engineering constants, axes turned once more": (
        10,
        "ENGINEERING CONSTANTS",
        ENGINEERING,
        f"{SKEWED}\n2, 33.",
    ),
    "wedges C3D15, ANISO, cylindrical axes": (
        15,
        "ANISO",
        ANISO,
        ", SYSTEM=CYLINDRICAL\n0.01, -0.02, 0., 0.012, -0.02, 0.1",
    ),
    "bricks C3D20, ANISO, global axes": (20, "ANISO", ANISO, ""),
}


def write_case(path: Path, cell: int, kind: str, constants: str, axes: str) -> None:
    """Write the deck of a sector with a static and a modal step, its material in the words of the deck."""
    mesh = annular_sector(0.1, 0.2, 0.03, sectors=SECTORS, divisions=(3, 2, 1), cell=cell)
    run = CalculixRun(n_modes=MODES, nodal_diameters=(0, DIAMETERS), speed=RPM * SPEED_RPM)
    write_deck(mesh, STEEL, path, sectors=SECTORS, run=run)
    text = path.read_text()
    head, _, rest = text.partition("*ELASTIC\n")
    _, _, rest = rest.partition("*DENSITY")
    text = f"{head}*ELASTIC, TYPE={kind}\n{constants}\n*DENSITY{rest}"
    if axes:
        text = text.replace("*SOLID SECTION", f"*ORIENTATION, NAME=AXES{axes}\n*SOLID SECTION")
        text = text.replace("MATERIAL=MATERIAL", "MATERIAL=MATERIAL, ORIENTATION=AXES")
    path.write_text(text)


def run() -> list[Record]:
    """Compare static displacements and frequencies of a few nodal diameters; without CalculiX the comparison is left out."""
    if not available():
        return [left_out("anisotropic sectors", MISSING, SOURCE)]
    return [one for name, given in CASES.items() for one in compared(f"sector of 12, {name}", given)]


def compared(case: str, given: tuple[int, str, str, str]) -> list[Record]:
    """Return the records of a case."""
    with tempfile.TemporaryDirectory() as name:
        at_speed, rest = Path(name) / "speed.inp", Path(name) / "rest.inp"
        write_case(at_speed, *given)
        text = at_speed.read_text()
        static, modal = text.index("*STEP"), text.index("*STEP, PERTURBATION")
        rest.write_text(text[:static] + text[modal:].replace(", PERTURBATION", ""))
        printed = {"at rest": run_deck(rest), f"at {SPEED_RPM:.0f} rpm": run_deck(at_speed)}
        deck = read_deck(at_speed)
    assert deck.speed is not None
    solid = rotating_solid(deck.mesh, deck.material, deck.axis, held=deck.held, quadrature=deck.quadrature)
    tie = cyclic_sector(solid.structure, SECTORS, axis=deck.axis).tie
    ours, theirs = solid.at_nodes(solid.displacement(deck.speed, tie=tie)), displacements([*printed.values()][1])
    off = float(np.abs(ours - theirs).max() / np.abs(theirs).max())
    records = [bound(case, "static displacement at speed: largest difference over its largest", off, DIGITS, SOURCE)]
    states = [solid.structure, solid.at_speed(deck.speed, tie=tie)]
    for (where, text), structure in zip(printed.items(), states, strict=True):
        records += waves_compared(case, f"{where}, ", structure, deck.axis, SECTORS, text, DIGITS, SOURCE)
    return records
