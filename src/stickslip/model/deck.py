"""CalculiX decks of a mesh, for checks with another solver.

Format: CalculiX CrunchiX user's manual 2.20. A deck is in SI units (m, kg, s, N, Pa), as everything here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import IntArray
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.material import ORDERS, AnyMaterial, ElasticMaterial, Material, stress_rotation
from stickslip.model.mesh.solid_mesh import SolidMesh, by_kind

ELEMENT_TYPES = {4: "C3D4", 6: "C3D6", 8: "C3D8", 10: "C3D10", 15: "C3D15", 20: "C3D20"}
ON_A_LINE = 10  # numbers on a line; CalculiX accepts at most 16


@dataclass(frozen=True, kw_only=True)
class CalculixRun:
    """Analyses that a deck requests from CalculiX.

    Parameters
    ----------
    n_modes
        Number of natural frequencies, for each nodal diameter; 0: static step only.
    nodal_diameters
        First and last nodal diameter of a cyclic model; None: all.
    speed
        Rotor speed in rad/s. With a speed, a linear static step under the centrifugal load precedes; its displacements
        are printed, and the frequencies belong to the loaded structure.
    matrices
        Write stiffness and mass to files (``.sti``, ``.mas``, ``.dof``) instead of computing frequencies.

    Raises
    ------
    InputError
        If no analysis is requested.
    """

    n_modes: int = 10
    nodal_diameters: tuple[int, int] | None = None
    speed: float = 0.0
    matrices: bool = False

    def __post_init__(self) -> None:
        if self.n_modes < 0 or (self.n_modes == 0 and self.speed == 0.0 and not self.matrices):
            raise input_error("CalculixRun.n_modes", f"is {self.n_modes} without a speed", "Ask for modes.")


def write_deck(
    mesh: SolidMesh,
    material: AnyMaterial,
    path: Path,
    *,
    clamped: Sequence[str] = ("root",),
    sectors: int | None = None,
    axis: Axis | None = None,
    run: CalculixRun | None = None,
) -> None:
    """Write a CalculiX deck (``.inp``) of a mesh; start it with ``ccx`` and the path without its ending.

    Parameters
    ----------
    mesh
        Any mesh; a cyclic one has the node sets ``cyclic_low`` and ``cyclic_high``.
    material
        Material of all elements.
    path
        File to write.
    clamped
        Node sets whose nodes are clamped. In a cyclic model, nodes of ``cyclic_low`` are clamped through their partners in ``cyclic_high``:
        CalculiX refuses supports of dependent nodes.
    sectors
        Number of sectors; None for a structure that is not cyclic.
    axis
        Axis of rotation; z by default.
    run
        Analyses; ten modes at rest by default.

    Raises
    ------
    InputError
        If a set is missing, the material depends on temperature, the mesh has pyramids, or nodal diameters are requested for a structure that is not cyclic.
    """
    axis, run = axis or Axis(), run or CalculixRun()
    if not {width for width, _ in by_kind(mesh.cells)} <= ELEMENT_TYPES.keys():
        raise input_error(
            "write_deck", "the mesh has pyramids, which CalculiX does not have", "Divide them into tetrahedra."
        )
    wanted = [*clamped, *(("cyclic_low", "cyclic_high") if sectors else ())]
    if isinstance(material, ElasticMaterial) and material.varies:
        raise input_error("write_deck", "the material depends on temperature", "Take it at one temperature.")
    missing = [name for name in wanted if name not in mesh.node_sets]
    if missing:
        raise input_error("write_deck", f"the mesh lacks the node sets {missing}", f"It has {[*mesh.node_sets]}.")
    if run.nodal_diameters and not sectors:
        raise input_error("CalculixRun.nodal_diameters", "asks for a cyclic model", "Give the number of sectors.")
    held = np.concatenate([np.empty(0, np.int64), *(mesh.node_sets[name] for name in clamped)])
    lines = [*_mesh_cards(mesh), *_material_cards(material)]
    if sectors:
        lines += _cyclic_cards(sectors, axis)
        held = held[~np.isin(held, mesh.node_sets["cyclic_low"])]
    if held.size:
        lines += ["*NSET, NSET=CLAMPED", *_rows(_numbers(mesh)[np.unique(held)])]
        lines += ["*BOUNDARY", "CLAMPED, 1, 3"]
    lines += _steps(run, axis, sectors)
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _numbers(mesh: SolidMesh) -> IntArray:
    """Return the mesh's node numbers, shifted to start at 1 if some are smaller, which CalculiX refuses."""
    return np.asarray(mesh.numbers + max(0, 1 - int(mesh.numbers.min())))


def _rows(numbers: IntArray) -> Iterator[str]:
    """Yield lines of a few numbers each; all lines but the last end in a comma."""
    for start in range(0, len(numbers), ON_A_LINE):
        end = "," if start + ON_A_LINE < len(numbers) else ""
        yield ", ".join(str(n) for n in numbers[start : start + ON_A_LINE]) + end


def _mesh_cards(mesh: SolidMesh) -> Iterator[str]:
    numbers = _numbers(mesh)
    yield "** written by stickslip; SI units: m, kg, s, N, Pa"
    yield "*NODE, NSET=NALL"
    # CalculiX reads 20 characters of a number, which leaves room for at most thirteen decimals
    for number, (x, y, z) in zip(numbers, mesh.points, strict=True):
        yield f"{number}, {x:.13e}, {y:.13e}, {z:.13e}"
    first = max(0, 1 - int(mesh.cell_numbers.min()))
    for width, rows in by_kind(mesh.cells):
        yield f"*ELEMENT, TYPE={ELEMENT_TYPES[width]}, ELSET=EALL"
        for number, cell in zip(mesh.cell_numbers[rows] + first, numbers[mesh.cells[rows, :width]], strict=True):
            yield from _rows(np.concatenate([[number], cell]))
    for name, nodes in mesh.node_sets.items():
        yield f"*NSET, NSET={name.upper()}"
        yield from _rows(numbers[nodes])


def _material_cards(material: AnyMaterial) -> list[str]:
    section, orientation = "*SOLID SECTION, ELSET=EALL, MATERIAL=MATERIAL", []
    if isinstance(material, Material):
        elastic = ["*ELASTIC", f"{material.young_modulus:.13e}, {material.poisson_ratio:.13e}"]
    else:
        own = material.orientation
        # the matrix in the axes of the cylinder or in global axes: no further turn has to be written
        turn = stress_rotation(np.asarray(own.axes, dtype=float))
        matrix = (turn @ material.matrices(None) @ turn.T)[np.ix_(ORDERS["12-13-23"], ORDERS["12-13-23"])]
        values = [f"{matrix[i, j]:.13e}" for j in range(6) for i in range(j + 1)]
        elastic = ["*ELASTIC, TYPE=ANISO", *(", ".join(values[i : i + 8]) for i in (0, 8, 16))]
        if own.around is not None:
            ends = [*own.around.origin, *(np.asarray(own.around.origin) + own.around.unit)]
            orientation = ["*ORIENTATION, NAME=AXES, SYSTEM=CYLINDRICAL", ", ".join(f"{v:.13e}" for v in ends)]
            section += ", ORIENTATION=AXES"
    cards = ["*MATERIAL, NAME=MATERIAL", *elastic, "*DENSITY", f"{material.density:.13e}"]
    return [*cards, *orientation, section]


def _cyclic_cards(sectors: int, axis: Axis) -> list[str]:
    ends = [*axis.origin, *(np.asarray(axis.origin) + axis.unit)]
    return [
        "*SURFACE, NAME=LOW, TYPE=NODE",
        "CYCLIC_LOW",
        "*SURFACE, NAME=HIGH, TYPE=NODE",
        "CYCLIC_HIGH",
        "*TIE, NAME=CYCLIC, CYCLIC SYMMETRY, POSITION TOLERANCE=1.E-6",
        "LOW, HIGH",
        f"*CYCLIC SYMMETRY MODEL, N={sectors}, NGRAPH=1, TIE=CYCLIC",
        ", ".join(f"{value:.12e}" for value in ends),
    ]


def _steps(run: CalculixRun, axis: Axis, sectors: int | None) -> list[str]:
    lines = []
    if run.speed:
        place = ", ".join(f"{value:.12e}" for value in (*axis.origin, *axis.unit))
        lines += ["*STEP", "*STATIC", "*DLOAD", f"EALL, CENTRIF, {run.speed**2:.13e}, {place}"]
        lines += ["*NODE PRINT, NSET=NALL", "U", "*END STEP"]
    if run.matrices or run.n_modes:
        # the perturbation step takes stiffness, stress stiffness and spin softening from the static one
        lines += ["*STEP, PERTURBATION" if run.speed else "*STEP"]
        lines += ["*FREQUENCY, SOLVER=MATRIXSTORAGE"] if run.matrices else ["*FREQUENCY"]
        # CalculiX finds every mode of a cyclic model twice
        lines += [] if run.matrices else [str(run.n_modes * (2 if sectors else 1))]
        if sectors and (run.nodal_diameters or not run.matrices):
            low, high = run.nodal_diameters or (0, sectors // 2)
            lines += [f"*SELECT CYCLIC SYMMETRY MODES, NMIN={low}, NMAX={high}"]
        if run.speed:
            lines += ["*NODE PRINT, NSET=NALL, FREQUENCY=0", "U"]  # mode shapes are not printed
        lines += ["*END STEP"]
    return lines
