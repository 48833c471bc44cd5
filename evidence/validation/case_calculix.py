"""Bladed disks against CalculiX: our mesh, our deck, its frequencies for every nodal diameter, at rest and at speed.

CalculiX prints seven digits, of which the last may be off by half: 5e-7 where the first is a one.
"""

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from evidence.models.annulus import annular_sector
from evidence.validation.calculix import MISSING, available, displacements, frequencies_hz, run_deck
from evidence.validation.compare import Record, bound, left_out, record
from stickslip.arrays import FloatArray, Matrix
from stickslip.model.axis import Axis
from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.elements import Quadrature
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.sector import BladedSector, Shroud
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.readers.calculix import read_calculix_matrices
from stickslip.model.readers.units import Units
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

SOURCE = "CalculiX, run on our deck"
SPEED = 837.758  # rad/s: 8000 rpm
DIGITS = 1e-6
MATRIX_DIGITS = 1e-11
SIZES = {"disk_size": 0.020, "platform_size": 0.012, "airfoil_size": 0.015}


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel that both programs compute."""

    name: str
    mesh: SolidMesh
    sectors: int
    quadrature: Quadrature
    n_modes: int
    nodal_diameters: tuple[int, int]
    axis: Axis = field(default_factory=Axis)


def wheels() -> list[Wheel]:
    """Return the wheels: a bladed disk, one whose shrouds stick together, a plain ring of hexahedra."""
    ring = annular_sector(0.06, 0.20, 0.012, sectors=18, divisions=(4, 1, 1))
    elsewhere = Axis((1.0, 0.0, 0.0), (0.1, -0.2, 0.3))
    ring = replace(ring, points=ring.points[:, [2, 0, 1]] + elsewhere.origin)
    shrouded = stuck(mesh_sector(BladedSector(shroud=Shroud(gap=0.0), **SIZES)))
    four_points = Quadrature.calculix()
    return [
        Wheel("24 blades", mesh_sector(BladedSector(**SIZES)), 24, four_points, 6, (0, 12)),
        Wheel("24 blades, shrouds stuck", shrouded, 24, four_points, 4, (0, 4)),
        Wheel("ring of C3D20, axis elsewhere", ring, 18, Quadrature(), 5, (0, 9), elsewhere),
    ]


def stuck(mesh: SolidMesh) -> SolidMesh:
    """Return the mesh with the contact faces of its shrouds as part of the cut faces."""
    sets = dict(mesh.node_sets)
    for side in ("low", "high"):
        sets[f"cyclic_{side}"] = np.concatenate([sets[f"cyclic_{side}"], sets[f"shroud_{side}"]])
    return replace(mesh, node_sets=sets)


def our_frequencies(solid: RotatingSolid, wheel: Wheel, speed: float) -> tuple[dict[int, FloatArray], FloatArray]:
    """Return nodal diameter -> frequencies in Hz, and the static displacement (nodes, 3)."""
    tie = cyclic_sector(solid.structure, wheel.sectors, axis=wheel.axis).tie
    structure = solid.at_speed(speed, tie=tie) if speed else solid.structure
    sector = cyclic_sector(structure, wheel.sectors, axis=wheel.axis)
    low, high = wheel.nodal_diameters
    found = {k: natural_frequencies(travelling_wave(sector, k), wheel.n_modes) for k in range(low, high + 1)}
    static = np.zeros_like(wheel.mesh.points)
    if speed:
        static[solid.free] = solid.displacement(speed, tie=tie).reshape(-1, 3)
    return found, static


def compare_wheel(wheel: Wheel, folder: Path) -> list[Record]:
    """Compare frequencies of all nodal diameters at rest and at speed, and the static displacement."""
    case, material, records = f"CalculiX: {wheel.name}", Material(), []
    solid = rotating_solid(wheel.mesh, material, wheel.axis, quadrature=wheel.quadrature)
    for where, speed in (("at rest", 0.0), ("at 8000 rpm", SPEED)):
        deck = folder / "wheel.inp"
        run = CalculixRun(n_modes=wheel.n_modes, nodal_diameters=wheel.nodal_diameters, speed=speed)
        write_deck(wheel.mesh, material, deck, sectors=wheel.sectors, axis=wheel.axis, run=run)
        printed = run_deck(deck)
        theirs = frequencies_hz(printed)
        ours, static = our_frequencies(solid, wheel, speed)
        for k, values in ours.items():
            worst = int(np.argmax(np.abs(values / theirs[k] - 1)))
            quantity = f"{where}, nodal diameter {k}, mode {worst + 1} (the worst of {len(values)}), Hz"
            records.append(record(case, quantity, values[worst], theirs[k][worst], DIGITS, SOURCE))
        if speed:
            reference = displacements(printed)
            off = np.abs(static - reference).max() / np.abs(reference).max()
            records.append(
                bound(case, "largest difference of the static displacement over its largest", off, DIGITS, SOURCE)
            )
    return records


def compare_matrices(wheel: Wheel, folder: Path) -> list[Record]:
    """Compare the matrices that CalculiX stores of one untied sector, read by our reader."""
    case, records = f"CalculiX: {wheel.name}", []
    solid = rotating_solid(wheel.mesh, Material(), quadrature=wheel.quadrature)
    for where, speed in (("at rest", 0.0), ("at 8000 rpm, untied", SPEED)):
        deck = folder / ("rest.inp" if speed == 0.0 else "speed.inp")
        write_deck(wheel.mesh, Material(), deck, run=CalculixRun(matrices=True, speed=speed))
        run_deck(deck)
        theirs = read_calculix_matrices(deck.with_suffix(".sti"), units=Units.si())
        ours = solid.at_speed(speed) if speed else solid.structure
        # equations are numbered otherwise: sort both by node and component
        us, them = (np.lexsort([[str(c) for c in s.dofs.component], s.dofs.node]) for s in (ours, theirs))
        for name in ("mass", "stiffness"):
            off = difference(getattr(ours, name)[us][:, us], getattr(theirs, name)[them][:, them])
            records.append(
                bound(
                    case,
                    f"{name} {where}: Frobenius norm of the difference over that of the matrix",
                    off,
                    MATRIX_DIGITS,
                    SOURCE,
                )
            )
    return records


def difference(ours: Matrix, theirs: Matrix) -> float:
    """Return the Frobenius norm of the difference over that of `theirs`."""
    norm = scipy.sparse.linalg.norm
    return float(norm(scipy.sparse.csr_array(ours - theirs)) / norm(scipy.sparse.csr_array(theirs)))


def run() -> list[Record]:
    """Compare every wheel; without CalculiX the comparison is left out."""
    if not available():
        return [left_out("CalculiX", MISSING, SOURCE)]
    records = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for wheel in wheels():
            records += compare_wheel(wheel, folder)
        records += compare_matrices(wheels()[0], folder)
    return records
