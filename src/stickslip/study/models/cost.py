"""Estimated cost of a model, from its tables."""

from math import prod
from pathlib import Path
from typing import Any

from stickslip.errors import InputError, input_error
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.model.mesh.sector import BladedSector
from stickslip.study.file.model.loads import Limits
from stickslip.study.file.model.parts import BeamTable, FileModel, Lumped, PrismBlades, Sector
from stickslip.study.file.quantities import build
from stickslip.study.file.tables import Tables
from stickslip.study.models.files import MESHES

BYTES_A_NODE = 35e3  # assembly and factorisation of second-order tetrahedra, measured at 10 to 30 thousand nodes
# modes of five waves: 4.3 GB at 37 683 nodes, 14.9 GB at 99 500
BYTES_OF_MATRICES, BYTES_OF_FACTORS = 20e3, 2700.0
BASE_GB = 0.35  # memory of interpreter and libraries
SECONDS_A_NODE = 2e-3  # assembly, reduction and the full model's frequencies
SECONDS_A_WAVE = 1e-3  # reduction of one wave, for each node: 0.9 to 1.1 ms at 1548 and 1767 nodes
NODES_A_CUBE = 8.0  # nodes of second-order tetrahedra in a cube of one element size, measured at 600 to 35000 nodes
OF_A_MESH, OF_MATRICES = 95.0, 4000.0  # bytes of a file for each node
PACKED = 3.5  # size of a file over its size with gzip
ADVICE = "Take a coarser mesh, fewer points, contacts or harmonics, or raise the limit."


def memory_gb(nodes: float) -> float:
    """Return the memory in GB for building and reducing parts with `nodes` nodes."""
    return BASE_GB + nodes * BYTES_A_NODE / 1e9


def waves_gb(nodes: float) -> float:
    """Return the memory in GB for the modes of several waves of a sector: matrices, and factors shared by the waves."""
    factors = BYTES_OF_FACTORS * float(nodes ** (4 / 3))
    return BASE_GB + (nodes * BYTES_OF_MATRICES + factors) / 1e9


def too_large(tables: Tables, home: Path) -> InputError | None:
    """Return the error about parts above the limits of the study; None if there is none."""
    nodes = nodes_of_tables(tables, home)
    what = f"the parts, some {max(round(nodes), 1):.2g} nodes, are estimated"
    memory = max(memory_gb(nodes), waves_gb(nodes) if _asks_for_waves(tables) else 0.0)
    return above(tables.limits, what, memory, nodes * SECONDS_A_NODE)


def nodes_of_tables(tables: Tables, home: Path) -> float:
    """Estimate the number of nodes of all parts, from sizes of files and elements."""
    return sum(_nodes(table, home) for table in tables.part.values())


def _asks_for_waves(tables: Tables) -> bool:
    """Whether the study needs modes of the waves of a sector."""
    asked = any(getattr(tables, name, None) is not None for name in ("modes", "safe"))
    sectors: list[Any] = [getattr(table, "sectors", None) for table in tables.part.values()]
    return asked and any(count is not None and count > 1 for count in sectors)


def above(limits: Limits, what: str, memory: float, seconds: float) -> InputError | None:
    """Return the error about a limit that an estimate exceeds, None if it exceeds none; `what` begins the sentence."""
    found = {"memory_gb": (memory, ".1f", "GB"), "work_s": (seconds, ".0f", "s")}
    for key, (needed, digits, unit) in found.items():
        allowed = getattr(limits, key)
        if needed > allowed:
            problem = f"{what} at {needed:{digits}} {unit}, the limit is {allowed:g} {unit}"
            return input_error(f"limits.{key}", problem, ADVICE)
    return None


def _nodes(table: Any, home: Path) -> float:
    """Estimate the number of nodes of a part; a copy has none, since it shares its original's."""
    if isinstance(table, PrismBlades):
        return blade_nodes(build(BladePair, table))
    if isinstance(table, Sector):
        return sector_nodes(build(BladedSector, table))
    if isinstance(table, FileModel):
        return file_nodes(home / table.file)
    if isinstance(table, BeamTable):
        return float(table.elements)  # type: ignore[attr-defined]
    return float(len(table.masses_kg)) if isinstance(table, Lumped) else 0.0


def blade_nodes(b: BladePair) -> float:
    """Estimate the number of nodes in the mesh of both blades."""
    chord, thickness = (b.hub_chord + b.tip_chord) / 2, (b.hub_thickness + b.tip_thickness) / 2
    one = (
        _block(b.airfoil_size, b.airfoil_length, chord, thickness)
        + _block(b.platform_size, b.pitch, b.platform_depth, 2 * b.platform_edge)
        + _block(b.foot_size, b.platform_height, b.platform_depth, b.shank_thickness)
        + _block(b.foot_size, b.foot_width, b.foot_depth, b.foot_height)
    )
    return 2 * one


def sector_nodes(sector: BladedSector) -> float:
    """Estimate the number of nodes in the mesh of a sector."""
    d, a, p, s = sector.disk, sector.airfoil, sector.platform, sector.shroud
    chord, thickness = (a.hub_chord + a.tip_chord) / 2, (a.hub_thickness + a.tip_thickness) / 2
    middle, width = (d.rim_radius + d.bore_radius) / 2, (d.bore_width + d.web_width) / 2
    around, top = sector.pitch * d.rim_radius, sector.platform_size
    return (
        _block(sector.disk_size, sector.pitch * middle, d.rim_radius - d.bore_radius, width)
        + _block(sector.airfoil_size, a.airfoil_length, chord, thickness)
        + (0.0 if p is None else _block(top, around, p.depth, 2 * p.thickness))
        + (0.0 if s is None else _block(top, around, s.depth, s.thickness))
    )


def file_nodes(path: Path) -> float:
    """Estimate the number of nodes in a file from its size."""
    name = path.name.lower()
    size = path.stat().st_size * (PACKED if name.endswith(".gz") else 1.0)
    return size / (OF_A_MESH if name.endswith(MESHES) else OF_MATRICES)


def _block(size: float, *lengths: float) -> float:
    """Estimate the number of nodes of a block, with its faces, from the element size; at least one element across."""
    return NODES_A_CUBE * prod(max(length / size, 1.0) + 1.0 for length in lengths)
