"""The bladed disk of 24 sectors whose CalculiX results lie beside the repository; our model of it, tied by plain loops.

The folder's README says how the numbers were made. Where it is absent, ``tests/data`` has the coarse mesh and some rows.
"""

import csv
from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from evidence.validation.calculix import frequencies_hz
from evidence.validation.compare import Record, record
from evidence.validation.reference_data import folder
from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.model.axis import Axis
from stickslip.model.fe.elements import Quadrature
from stickslip.model.fe.factorisation import factorise
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.readers.calculix_deck import read_deck
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import cyclic_sector

SECTORS = 24
DECKS = {"coarse": "n24_coarse_cyc_pre.inp", "medium": "n24_medium_prestressed.inp"}
CASES = ("free", "prestressed_8000rpm")


@dataclass(frozen=True, eq=False)
class StoredSector:
    """What CalculiX computed, and our model of the same mesh.

    ``speed`` is that of the deck, 8000 rpm in rad/s; ``pairs`` holds node numbers (p, 2) on the low and the high face, ``frequencies`` those in Hz by case and nodal
    diameter, ``static`` node number -> displacement in metres at speed.
    """

    solid: RotatingSolid
    speed: float
    pairs: IntArray
    frequencies: dict[tuple[str, int], FloatArray]
    static: dict[int, FloatArray]


def stored_sector(name: str, *, complete: bool) -> StoredSector:
    """Read one of the meshes `DECKS`; assemble it with the rule that CalculiX has."""
    place = folder("calculix", complete=complete)
    deck = read_deck(place / (DECKS[name] if complete else f"{DECKS[name]}.gz"))
    assert deck.speed is not None
    solid = rotating_solid(deck.mesh, deck.material, deck.axis, quadrature=Quadrature.calculix())
    pairs = np.loadtxt(place / f"n24_{name}_cyclic_pairs.csv", delimiter=",", skiprows=1, dtype=int)
    frequencies: dict[tuple[str, int], list[float]] = {}
    with (place / f"n24_{name}_frequencies.csv").open() as file:
        for row in csv.DictReader(file):
            if row["case"] in CASES:
                key = row["case"], int(row["nodal_diameter"])
                frequencies.setdefault(key, []).append(float(row["frequency_hz"]))
    table = np.loadtxt(place / f"n24_{name}_static_8000rpm.csv", delimiter=",", skiprows=1)
    static = {int(row[0]): row[1:] for row in table}
    found = {key: np.array(values) for key, values in frequencies.items()}
    return StoredSector(solid, deck.speed, pairs, found, static)


def plain_tie(sector: StoredSector, nodal_diameter: int) -> Matrix:
    """Return (n, m) admissible displacements, ``u_high = exp(i θ) R u_low``, by a loop over pairs of nodes.

    It shares no code with `reduction.cyclic`, which finds pairs itself and keeps other coordinates.
    """
    structure = sector.solid.structure
    first = {int(number): 3 * i for i, number in enumerate(structure.dofs.node[::3])}
    angle = 2 * np.pi / SECTORS
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    standing = nodal_diameter in (0, SECTORS // 2)
    phase = np.exp(1j * nodal_diameter * angle)
    block = (phase.real if standing else phase) * turn
    tie = scipy.sparse.eye_array(structure.n, dtype=block.dtype, format="lil")
    kept = np.ones(structure.n, dtype=bool)
    for low, high in sector.pairs.tolist():
        if low in first:
            high_dofs = slice(first[high], first[high] + 3)
            tie[high_dofs, high_dofs] = 0
            tie[high_dofs, first[low] : first[low] + 3] = block
            kept[high_dofs] = False
    return scipy.sparse.csr_array(tie)[:, kept]


def lowest_frequencies(structure: Structure, tie: Matrix, n: int) -> FloatArray:
    """Return the `n` lowest natural frequencies in Hz of the tied structure."""
    K, M = (scipy.sparse.csr_array(tie.conj().T @ matrix @ tie) for matrix in (structure.stiffness, structure.mass))
    inverse = scipy.sparse.linalg.LinearOperator(K.shape, matvec=factorise(K), dtype=K.dtype)
    squares = scipy.sparse.linalg.eigsh(K, n, M=M, sigma=0, OPinv=inverse, return_eigenvectors=False)
    return np.asarray(np.sqrt(np.sort(squares)) / (2 * np.pi))


def waves_compared(
    case: str, where: str, structure: Structure, axis: Axis, sectors: int, printed: str, digits: float, source: str
) -> list[Record]:
    """Compare the frequencies of each nodal diameter in the output of CalculiX; the worst mode of each is recorded."""
    sector = cyclic_sector(structure, sectors, axis=axis)
    records = []
    for diameter, theirs in frequencies_hz(printed).items():
        ours = lowest_frequencies(structure, sector.wave_tie(diameter), len(theirs))
        worst = int(np.argmax(np.abs(ours / theirs - 1)))
        quantity = f"{where}nodal diameter {diameter}, mode {worst + 1} (the worst of {len(theirs)}), Hz"
        records.append(record(case, quantity, ours[worst], theirs[worst], digits, source))
    return records


def static_difference(sector: StoredSector, tie: Matrix) -> float:
    """Return the largest difference of the static displacements at speed over the largest of them."""
    ours = np.zeros_like(sector.solid.mesh.points)
    ours[sector.solid.free] = sector.solid.displacement(sector.speed, tie=tie).reshape(-1, 3)
    row = {int(number): i for i, number in enumerate(sector.solid.mesh.numbers)}
    theirs = np.array(list(sector.static.values()))
    ours = ours[[row[number] for number in sector.static]]
    return float(np.abs(ours - theirs).max() / np.abs(theirs).max())
