"""Constraints of decks against CalculiX: equations, rigid bodies, couplings, ties, turned supports, point masses, springs.

Each deck is a bar of quadratic bricks, or two of them, that we wrote. CalculiX 2.20 runs no frequency step with ``*MPC`` (it ends without a
word), and leaves out the mass on a ``*DISTRIBUTING`` coupling, so that these are not compared.
"""

import tempfile
from pathlib import Path

import numpy as np
import scipy.linalg

from evidence.models.annulus import annular_sector
from evidence.validation.calculix import MISSING, available, run_deck
from evidence.validation.calculix_stored import waves_compared
from evidence.validation.case_calculix_matrices_at_speed import frequencies
from evidence.validation.compare import Record, left_out, record
from stickslip.arrays import FloatArray
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.material import Material
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.readers.calculix_deck import assemble_deck, read_deck
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import cyclic_sector

SOURCE = "CalculiX, run on a deck that we wrote"
DIGITS = 1e-6
MODES = 6
SECTORS = 12
EDGES = ((0, 1), (1, 2), (3, 2), (0, 3), (4, 5), (5, 6), (7, 6), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7))
CORNERS = ((0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2))
MATERIAL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1E11, 0.3\n*DENSITY\n7850.\n*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n"
STEP = f"*STEP\n*FREQUENCY\n{MODES}\n*END STEP\n"


def block(name: str, cells: tuple[int, int, int], low: FloatArray, high: FloatArray, first: int = 0) -> str:
    """Return a box of C3D20, with the node sets and surfaces of its ends in x and the set of all its nodes; numbers begin after `first`."""
    grid = 2 * np.array(cells) + 1
    place: dict[tuple[int, ...], int] = {}
    lines = [f"*NODE, NSET=N{name}"]
    for index in np.ndindex(*grid):
        if sum(i % 2 for i in index) < 2:
            place[index] = first + len(place) + 1
            point = low + (high - low) * np.array(index) / (grid - 1)
            lines.append(f"{place[index]}, " + ", ".join(f"{x:.12e}" for x in point))
    lines.append(f"*ELEMENT, TYPE=C3D20, ELSET=E{name}")
    number, ends = first, {0: list[int](), cells[0] - 1: list[int]()}
    for cell in np.ndindex(*cells):
        number += 1
        corners = [tuple(2 * np.array(cell) + c) for c in CORNERS]
        middles = [tuple((np.array(corners[a]) + corners[b]) // 2) for a, b in EDGES]
        nodes = [str(place[index]) for index in (*corners, *middles)]
        lines += [", ".join([str(number), *nodes[:15]]) + ",", ", ".join(nodes[15:])]
        if cell[0] in ends:
            ends[cell[0]].append(number)
    for end, x, face, own in (("LOW", 0, "S6", ends[0]), ("HIGH", grid[0] - 1, "S4", ends[cells[0] - 1])):
        lines += [f"*NSET, NSET={name}{end}", *(f"{n}," for index, n in place.items() if index[0] == x)]
        lines += [f"*SURFACE, NAME=S{name}{end}", *(f"{e}, {face}" for e in own)]
    return "\n".join(lines) + "\n"


BAR = block("A", (4, 2, 1), np.zeros(3), np.array([0.4, 0.06, 0.04]))
OTHER = block("B", (3, 1, 2), np.array([0.4, 0.0, 0.0]), np.array([0.7, 0.06, 0.04]), first=1000)
APART = block("B", (3, 1, 2), np.array([0.4005, 0.0, 0.0]), np.array([0.7, 0.06, 0.04]), first=1000)
ALL = "*ELSET, ELSET=EALL\nEA\n"
BOTH = ALL + "EB\n"
HELD = "*BOUNDARY\nALOW, 1, 3\n"
REFERENCE = "*NODE\n5001, 0.5, 0.1, 0.03\n5002, 0.5, 0.1, 0.03\n"
HEAVY = "*ELEMENT, TYPE=MASS, ELSET=M\n5001, 5001\n*MASS, ELSET=M\n1.7\n"
TIE = "*TIE, NAME=T\nSBLOW, SAHIGH\n"
# numbers of nodes: 1 and 9 are corners of the held end, 77 and further lie on the free one
DECKS = {
    "two bars, ends that do not match, tied": BAR + OTHER + BOTH + TIE + HELD,
    "the same with a gap that the tie closes": BAR
    + APART
    + BOTH
    + TIE.replace("NAME=T", "NAME=T, POSITION TOLERANCE=0.001")
    + HELD,
    "a rigid end": BAR + ALL + REFERENCE + HELD + "*RIGID BODY, NSET=AHIGH, REF NODE=5001, ROT NODE=5002\n",
    "a rigid end with a point mass": BAR
    + ALL
    + REFERENCE
    + HEAVY
    + HELD
    + "*RIGID BODY, NSET=AHIGH, REF NODE=5001, ROT NODE=5002\n",
    "a rigid end that does not turn about z": BAR
    + ALL
    + REFERENCE
    + "*RIGID BODY, NSET=AHIGH, REF NODE=5001, ROT NODE=5002\n"
    + HELD
    + "5002, 3, 3\n",
    "an end coupled to a point mass": BAR
    + ALL
    + REFERENCE
    + HEAVY
    + HELD
    + "*COUPLING, REF NODE=5001, SURFACE=SAHIGH, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3\n",
    "equations with three terms": BAR
    + ALL
    + HELD
    + "*EQUATION\n3\n60, 2, 1., 30, 2, -2., 40, 3, 0.5\n2\n62, 1, 1., 61, 2, -3.\n",
    "supports in cylindrical axes": BAR
    + ALL
    + "*TRANSFORM, NSET=ALOW, TYPE=C\n0.1, -0.2, 0., 0.1, -0.2, 1.\n*TRANSFORM, NSET=AHIGH\n1., 1., 0.2, -1., 1., 0.\n"
    + "*BOUNDARY\nALOW, 1, 1\nALOW, 3, 3\nAHIGH, 2, 2\n",
    "springs and a point mass": BAR
    + ALL
    + REFERENCE
    + HEAVY
    + HELD
    + "*ELEMENT, TYPE=SPRINGA, ELSET=P\n6001, 60, 5001\n*SPRING, ELSET=P\n\n2.E7\n"
    + "*ELEMENT, TYPE=SPRING1, ELSET=Q\n6002, 5001\n*SPRING, ELSET=Q\n2\n1.E6\n"
    + "*ELEMENT, TYPE=SPRING2, ELSET=R\n6003, 62, 5001\n*SPRING, ELSET=R\n3, 3\n3.E6\n"
    + "*BOUNDARY\n5001, 1, 1\n",
}


def our_frequencies(structure: Structure) -> FloatArray:
    """Return all natural frequencies in Hz."""
    squares = scipy.linalg.eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi))


def sector_deck(path: Path, speed: float) -> None:
    """Write a sector of a ring with equations between nodes away from its faces; at rest with a rigid tip and a point mass, too."""
    mesh = annular_sector(0.2, 0.3, 0.02, sectors=SECTORS, divisions=(3, 4, 1))
    faces = np.concatenate([mesh.node_sets[name] for name in ("cyclic_low", "cyclic_high", "root")])
    free = np.setdiff1d(np.arange(len(mesh.points)), faces)
    numbers = (free + 1).tolist()
    outer = free[np.argsort(-np.hypot(*mesh.points[free, :2].T), kind="stable")][:6] + 1
    cards = f"*EQUATION\n3\n{numbers[3]}, 1, 1., {numbers[10]}, 2, -0.7, {numbers[20]}, 1, -0.4\n"
    cards += f"*EQUATION\n2\n{numbers[-2]}, 3, 1., {numbers[20]}, 3, -1.5\n"
    if speed == 0.0:
        cards += "*NODE\n90001, 0.33, 0.02, 0.01\n*ELEMENT, TYPE=MASS, ELSET=M\n90001, 90001\n*MASS, ELSET=M\n0.4\n"
        cards += "*NSET, NSET=RIGID\n" + "".join(f"{n},\n" for n in outer) + "*RIGID BODY, NSET=RIGID, REF NODE=90001\n"
    run = CalculixRun(n_modes=4, nodal_diameters=(0, 3), speed=speed)
    write_deck(mesh, Material(), path, sectors=SECTORS, run=run)
    path.write_text(path.read_text().replace("*STEP", f"{cards}*STEP", 1))


def of_sector(path: Path, speed: float) -> list[Record]:
    """Compare the frequencies of a sector with equations, nodal diameter by nodal diameter."""
    sector_deck(path, speed)
    printed = run_deck(path)
    deck = read_deck(path)
    solid = rotating_solid(deck.mesh, deck.material, deck.axis, quadrature=deck.quadrature, links=deck.links)
    tie = cyclic_sector(solid.structure, SECTORS, axis=deck.axis).tie
    state = solid.at_speed(speed, tie=tie) if speed else solid.structure
    case = (
        f"a sector with equations at {speed:g} rad/s" if speed else "a sector with equations and a rigid tip, at rest"
    )
    return waves_compared(case, "", state, deck.axis, SECTORS, printed, DIGITS, SOURCE)


def run() -> list[Record]:
    """Compare frequencies deck by deck; without CalculiX the comparison is left out."""
    if not available():
        return [left_out("constraints of decks", MISSING, SOURCE)]
    records = []
    with tempfile.TemporaryDirectory() as name:
        for i, (case, text) in enumerate(DECKS.items()):
            deck = Path(name) / f"c{i}.inp"
            deck.write_text(text + MATERIAL + STEP)
            theirs = np.array(frequencies(run_deck(deck)))
            ours = our_frequencies(assemble_deck(read_deck(deck)))[: len(theirs)]
            worst = int(np.argmax(np.abs(ours / theirs - 1)))
            quantity = f"mode {worst + 1} (the worst of {len(theirs)}), Hz"
            records.append(record(case, quantity, ours[worst], theirs[worst], DIGITS, SOURCE))
        for speed in (0.0, 600.0):
            records += of_sector(Path(name) / f"s{speed:.0f}.inp", speed)
    return records
