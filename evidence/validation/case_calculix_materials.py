"""Titanium blades on a steel disk, held by single directions, at rest and at 8000 rpm: CalculiX run on an edited deck.

The deck is the coarse one of the stored results, with blades of another material; the bore may move along the axis, and the blade
tips may not.
"""

import tempfile
from pathlib import Path

import numpy as np

from evidence.validation.calculix import MISSING, available, displacements, run_deck
from evidence.validation.calculix_stored import DECKS, waves_compared
from evidence.validation.compare import Record, bound, left_out
from evidence.validation.reference_data import COPIES
from stickslip.model.fe.elements import Quadrature
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.readers.calculix_deck import Deck, read_deck
from stickslip.model.readers.text import read_text
from stickslip.reduction.cyclic import cyclic_sector

SOURCE = "CalculiX, run on our edit of the stored deck"
CASE = "24 titanium blades on a steel disk, supports of single directions"
DIGITS = 1e-6
BLADE = 0.19  # m: cells whose middle lies farther out are of titanium
TITANIUM = "*MATERIAL, NAME=TITANIUM\n*ELASTIC\n1.1e+11, 0.34\n*DENSITY\n4.43e+03\n"
DIAMETERS = range(3)


def edited(text: str, cells: dict[str, list[int]]) -> str:
    """Return the deck with an element set and a section for each material, and other supports."""
    sections = TITANIUM
    for material, numbers in cells.items():
        listed = ",\n".join(str(number) for number in numbers)
        sections += f"*ELSET, ELSET=OF_{material}\n{listed}\n"
        sections += f"*SOLID SECTION, ELSET=OF_{material}, MATERIAL={material}\n"
    for old, new in {
        "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n": sections,
        "BORE_SPC, 1, 3\n": "BORE_SPC, 1, 2\nTIP, 3, 3\n",
        "NMAX=12": f"NMAX={DIAMETERS[-1]}",
    }.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def write_decks(folder: Path) -> dict[str, Path]:
    """Write the deck with its static step and the one without; return them by what they stand for."""
    source = COPIES / f"{DECKS['coarse']}.gz"
    mesh = read_deck(source).mesh
    middle = mesh.points[mesh.cells].mean(axis=1)
    blade = np.hypot(middle[:, 0], middle[:, 1]) > BLADE
    cells = {"STEEL": mesh.cell_numbers[~blade].tolist(), "TITANIUM": mesh.cell_numbers[blade].tolist()}
    text = edited(read_text(source), cells)
    static, modal = text.index("*STEP"), text.index("*STEP, PERTURBATION")
    decks = {"at 8000 rpm": folder / "speed.inp", "at rest": folder / "rest.inp"}
    decks["at 8000 rpm"].write_text(text)
    decks["at rest"].write_text(text[:static] + text[modal:].replace(", PERTURBATION", ""))
    return decks


def our_solid(deck: Deck) -> RotatingSolid:
    """Assemble what the deck says, supports of single directions included."""
    materials = [deck.materials[name] for name in deck.cell_material]
    assert len(set(materials)) == 2
    return rotating_solid(deck.mesh, materials, deck.axis, held=deck.held, quadrature=Quadrature.calculix())


def run() -> list[Record]:
    """Compare the static displacement and frequencies; without CalculiX the comparison is left out."""
    if not available():
        return [left_out(CASE, MISSING, SOURCE)]
    records = []
    with tempfile.TemporaryDirectory() as name:
        decks = write_decks(Path(name))
        printed = {where: run_deck(path) for where, path in decks.items()}
        deck = read_deck(decks["at 8000 rpm"])
    assert deck.speed is not None
    solid = our_solid(deck)
    tie = cyclic_sector(solid.structure, 24, axis=deck.axis).tie
    reference = displacements(printed["at 8000 rpm"])
    static = solid.at_nodes(solid.displacement(deck.speed, tie=tie))
    off = np.abs(static - reference).max() / np.abs(reference).max()
    records.append(
        bound(CASE, "static displacement at 8000 rpm: largest difference over its largest", off, DIGITS, SOURCE)
    )
    states = {"at rest": solid.structure, "at 8000 rpm": solid.at_speed(deck.speed, tie=tie)}
    for where, structure in states.items():
        records += waves_compared(CASE, f"{where}, ", structure, deck.axis, 24, printed[where], DIGITS, SOURCE)
    return records
