"""Small studies of schema 2 for the tests: each function writes one into a folder, which is made, and returns its path.

Keys are changed by their full names, with TOML text for values: ``write_two_blades(folder, {"forced_response.points": "8"})``.
"""

import math
import shutil
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from stickslip.model.deck import CalculixRun, write_deck
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.sector import BladedSector, Shroud
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.mesh.solid_mesh import SolidMesh

EXAMPLES = Path(__file__).parents[1] / "examples"

TWO_BLADES = {
    "part.blades.airfoil_size_m": "0.05",
    "part.blades.platform_size_m": "0.02",
    "part.blades.foot_size_m": "0.05",
    "vary.load.shaker.ratio": "[2000]",
    "forced_response.frequency_hz": "[185.0, 207.0]",
    "forced_response.points": "8",
    "forced_response.peak_points": "2",
    "harmonics.samples": "64",
}
FOUR_MASSES = {
    "forced_response.points": "10",
    "forced_response.peak_points": "2",
    "forced_response.stability": '"peak"',
}

SECTOR_DECK = {
    "modes.number": "1",
    "modes.nodal_diameters": "[6]",
    "modes.shapes": "false",
    "campbell.points": "2",
    "campbell.engine_orders": "[6]",
    "campbell.modes": "1",
    "safe.engine_orders": "[6]",
    "safe.modes": "1",
    "reduction.fixed_interface_modes": "8",
    "harmonics.high": "1",
    "harmonics.selection": '"always_low"',
    "forced_response.frequencies": "4",
    "forced_response.peak_points": "0",
    "forced_response.stability": '"off"',
}

SECTOR = """
[part.blade]
shape = "bladed_sector"
sectors = 8
disk_size_m = 0.05
platform_size_m = 0.03
airfoil_size_m = 0.04
[part.blade.shroud]
depth_m = 0.026
face_angle_deg = -20.0
"""
DECK = """
[part.blade]
file = "sector.inp"
units = "SI"
"""
WHEEL = """
schema_version = 2
title = "A small shrouded wheel"
[material]
young_modulus_pa = 2.1e11
poisson_ratio = 0.3
density_kg_per_m3 = 7850.0
[damping]
ratio = 0.002
between_hz = [100.0, 1000.0]
[reduction]
fixed_interface_modes = 6
[contact.shroud]
between = ["blade.shroud_high", "next.blade.shroud_low"]
pairing = "node_to_node"
law = "elastic_coulomb"
normal_stiffness_n_per_m = 1e6
tangential_stiffness_n_per_m = 5e5
axial_stiffness_n_per_m = 5e5
friction_coefficient = 0.3
preload_n = 300.0
[load.gas]
on = "blade.tip"
force_n = 2.0
direction = "y"
engine_order = 2
[rotation]
speed_rpm = 600.0
[output]
points = { tip = "blade.tip" }
peak = "tip.y"
[harmonics]
high = 3
samples = 64
[modes]
number = 2
nodal_diameters = [0, 2]
[campbell]
speeds_rpm = [0.0, 6000.0]
points = 3
engine_orders = [2, 6]
modes = 2
[safe]
engine_orders = [2, 6]
modes = 2
[forced_response]
frequency_hz = [200.0, 260.0]
points = 8
peak_points = 2
stability = "off"
"""


def write_two_blades(folder: Path, changes: Mapping[str, str] | None = None) -> Path:
    """J1: two blades and a damper on a coarse mesh, one load case that sticks."""
    return _written(folder, _example("two_blades"), TWO_BLADES | dict(changes or {}))


def write_four_masses(folder: Path, changes: Mapping[str, str] | None = None) -> Path:
    """J6: four masses, two friction elements and a gap, at one load."""
    text = _example("four_masses").partition("[vary]")[0]
    return _written(folder, text, FOUR_MASSES | dict(changes or {}))


def write_shrouded_sector(folder: Path, changes: Mapping[str, str] | None = None) -> Path:
    """J3 on the parametric sector: shrouds that rub, modes, Campbell, SAFE and forced response."""
    return _written(folder, WHEEL + SECTOR, changes or {})


def write_shrouded_deck(folder: Path, changes: Mapping[str, str] | None = None) -> Path:
    """J3 from a CalculiX deck: node sets of the shroud faces whose meshes do not match."""
    folder.mkdir(parents=True, exist_ok=True)
    write_sector_deck(folder / "sector.inp")
    own = {"contact.shroud.pairing": '"node_to_segment"'}
    return _written(folder, WHEEL + DECK, own | dict(changes or {}))


def write_example_deck(folder: Path, changes: Mapping[str, str] | None = None) -> Path:
    """J3 as it is shipped: its own deck, few points, one harmonic."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(EXAMPLES / "sector_deck" / "sector.inp", folder / "sector.inp")
    return _written(folder, _example("sector_deck"), SECTOR_DECK | dict(changes or {}))


def write_sector_deck(path: Path) -> None:
    """Write a deck of one of eight sectors; nodes of its low shroud face are no partners of those of the high one."""
    path.write_text(_sector_deck(), encoding="ascii")


@cache
def _sector_deck() -> str:
    """Return its text, of one mesh for all tests."""
    geometry = BladedSector(
        sectors=8,
        disk_size=0.05,
        platform_size=0.012,
        airfoil_size=0.04,
        platform=None,
        shroud=Shroud(face_angle=math.radians(-20)),
    )
    mesh = shifted(mesh_sector(geometry), "shroud_low")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "sector.inp"
        write_deck(mesh, Material(), path, sectors=geometry.sectors, run=CalculixRun(n_modes=2))
        return path.read_text(encoding="ascii")


def shifted(mesh: SolidMesh, face: str, by: float = 0.2) -> SolidMesh:
    """Return the mesh with the nodes of a plane face moved within its outline, mid-side nodes of its cells on straight edges."""
    points = mesh.points.copy()
    nodes = mesh.node_sets[face]
    centre = points[nodes].mean(axis=0)
    axes = np.linalg.svd(points[nodes] - centre, full_matrices=False)[2][:2]
    flat = (points[nodes] - centre) @ axes.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    unit = 2 * (flat - low) / (high - low) - 1
    moved = by * (1 - unit**2) * (high - low) / 2
    points[nodes] += moved @ axes
    edges = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
    touched = np.isin(mesh.cells[:, :4], nodes).any(axis=1)
    for cell in mesh.cells[touched]:
        for middle, (a, b) in zip(cell[4:], edges, strict=True):
            if cell[a] in nodes or cell[b] in nodes:
                points[middle] = (points[cell[a]] + points[cell[b]]) / 2
    return replace(mesh, points=points)


def changed(text: str, changes: Mapping[str, str]) -> str:
    """Return the text of a study with keys set by their full names; the last entry of a name that has dots may be new."""
    import tomllib

    for key, value in changes.items():
        text = _set(text, key, value)
    tomllib.loads(text)
    return text


def _set(text: str, key: str, value: str) -> str:
    """Set ``table.key``: in its table where there is one, else in a new table at the end."""
    lines = text.splitlines()
    names = key.split(".")
    for cut in range(len(names) - 1, 0, -1):
        head, rest = ".".join(names[:cut]), ".".join(names[cut:])
        if f"[{head}]" not in [line.split("#")[0].strip() for line in lines]:
            continue
        at = next(i for i, line in enumerate(lines) if line.split("#")[0].strip() == f"[{head}]")
        end = next((i for i in range(at + 1, len(lines)) if lines[i].startswith("[")), len(lines))
        found = [i for i in range(at + 1, end) if lines[i].split("=")[0].strip() == rest]
        lines[found[0] if found else at + 1 : found[0] + 1 if found else at + 1] = [f"{rest} = {value}"]
        return "\n".join(lines) + "\n"
    if len(names) == 1:
        found = [i for i, line in enumerate(lines) if line.split("=")[0].strip() == key]
        lines[found[0] if found else 0 : found[0] + 1 if found else 0] = [f"{key} = {value}"]
        return "\n".join(lines) + "\n"
    return text + f"\n[{'.'.join(names[:-1])}]\n{names[-1]} = {value}\n"


def _example(name: str) -> str:
    return (EXAMPLES / name / "study.toml").read_text(encoding="utf-8")


def _written(folder: Path, text: str, changes: Mapping[str, Any]) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "study.toml"
    path.write_text(changed(text, changes), encoding="utf-8")
    return path
