"""Conversion of the tables [part.NAME] to parts; equal tables share one part."""

import json
import logging
from collections.abc import Callable, MutableMapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.assembly.contact import NEXT
from stickslip.assembly.part_copies import copy_of, place_of, placed_body
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.beam import Beam, beam
from stickslip.model.fe.material import AnyMaterial, Material
from stickslip.model.matrices import lumped, lumped_sector
from stickslip.model.mesh.blade_pair import BladePair, mesh_blade_pair
from stickslip.model.mesh.sector import BladedSector
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import BodyPoints, Part, Place, Reducing, damper_part, rigid_part, solid_part, structure_part
from stickslip.model.rigid.body import RigidBody
from stickslip.model.rigid.dampers import ContactPoints, CylinderDamper, FlatCurvedDamper, WedgeDamper
from stickslip.model.structure import Structure
from stickslip.study.file.model.bodies import AXES, BODIES, Cylinder, FlatCurved, Placed, RigidBodyTable, Surface, Wedge
from stickslip.study.file.model.material import ReductionTable
from stickslip.study.file.model.parts import BeamTable, Copy, FileModel, Lumped, PrismBlades, Sector
from stickslip.study.file.quantities import build
from stickslip.study.file.section import Section
from stickslip.study.file.tables import Tables
from stickslip.study.models.files import file_part, with_companions
from stickslip.study.models.temperature import doubts_of_temperature, temperature_of
from stickslip.study.own_code import is_address, made, state_of
from stickslip.study.questions import loaded
from stickslip.units import DEG

LOG = logging.getLogger("stickslip")
REMEMBERED = 16  # number of parts kept in memory
CHUNK = 1 << 20  # bytes of a file hashed at a time

Memo = MutableMapping[str, Part]


@dataclass(frozen=True)
class OwnReduction:
    """A user's reduction.

    Parameters
    ----------
    made
        The reduction: a dataclass with `of` and `in_words`.
    code
        State of its code, which is part of the key of reduced parts on disk.
    """

    made: Reducing
    code: str

    def of(self, structure: Structure, keep: IntArray) -> Structure:
        """Return a structure reduced to the dofs `keep` and the user's further coordinates."""
        return self.made.of(structure, keep)

    @property
    def in_words(self) -> str:
        """Name of the method."""
        return self.made.in_words


@dataclass(frozen=True, eq=False)
class Workshop:
    """Builder of the parts of one case.

    Parameters
    ----------
    tables
        Tables of one case.
    home
        Folder to which file names are relative.
    memo
        Parts built before, by the digest of everything they depend on.
    """

    tables: Tables
    home: Path
    memo: Memo

    def parts(self) -> dict[str, Part]:
        """Return all parts, in the order of the file."""
        return {name: self.part(name) for name in self.tables.part}

    def part(self, name: str) -> Part:
        """Return a part; a part that an earlier case has built from equal input is used again."""
        key = digest(self.tables, name, self.home)
        if key not in self.memo:
            made = self._made(name, self.tables.part[name])
            while len(self.memo) >= REMEMBERED:
                self.memo.pop(next(iter(self.memo)))
            self.memo[key] = made
        return self.memo[key]

    def _made(self, name: str, table: Any) -> Part:
        if isinstance(table, Copy):
            return copy_of(self.part(table.of), place_in_steps(table.placed))
        made = _MAKERS[type(table)](self, name, table)
        if isinstance(table, BODIES) and table.placed:  # type: ignore[attr-defined]
            return placed_body(made, place_in_steps(table.placed))  # type: ignore[attr-defined]
        return made

    def material(self, table: Any) -> AnyMaterial | None:
        """Return the material of a part; None if the study names none."""
        given = table.material or self.tables.material
        return None if given is None else given.library()

    def _material(self, name: str, table: Any) -> AnyMaterial:
        found = self.material(table)
        if found is None:
            raise input_error(f"part.{name}.material", "is missing", "Add the table [material], or one of the part.")
        return found

    def _heat(self, name: str, table: Any, mesh: SolidMesh, material: AnyMaterial) -> dict[str, Any]:
        """Return temperature and warnings of a meshed part."""
        given, place = table.temperature or self.tables.temperature, f"part.{name}"
        found = temperature_of(place, given, mesh, material, Axis(), home=self.home)
        return {
            "temperature": found,
            "warnings": doubts_of_temperature(place, given, mesh, material, Axis(), found),
        }

    def others(self, table: Any, *, reduced: bool = True) -> dict[str, Any]:
        """Return damping and reduction of a part; `reduced`: whether it is reduced if the study specifies no reduction."""
        reduction = table.reduction or self.tables.reduction or ReductionTable()
        found: dict[str, Any] = {}
        if reduced or table.reduction is not None:
            own = is_address(reduction.method)
            found["reduction"] = _own_reduction(reduction.method) if own else reduction.library()
        damping = table.damping or self.tables.damping
        if damping is not None:
            found["damping"] = damping.library()
        return found

    def blades(self, name: str, table: Any) -> Part:
        """Mesh a pair of prismatic blades with nodes at the contact points of a damper."""
        points = contact_nodes(self.tables, table)
        LOG.info("meshing the part %s", name)
        mesh = mesh_blade_pair(build(BladePair, table), points)
        material = self._material(name, table)
        return solid_part(mesh, material, **self._heat(name, table, mesh, material), **self.others(table))

    def sector(self, name: str, table: Any) -> Part:
        """Mesh a sector of a bladed disk."""
        LOG.info("meshing the part %s, one of %d sectors", name, table.sectors)
        mesh = mesh_sector(build(BladedSector, table))
        material = self._material(name, table)
        heat = self._heat(name, table, mesh, material)
        return solid_part(mesh, material, sectors=table.sectors, **heat, **self.others(table))

    def beam(self, name: str, table: Any) -> Part:
        """Make a beam along x."""
        material = self._material(name, table)
        if not isinstance(material, Material):
            raise input_error(
                f"part.{name}.material", "is anisotropic, and beams are not", "Give Young's modulus, or mesh the part."
            )
        shape = build(Beam, table, material=material)
        structure = beam(shape, table.elements, bending=table.bending, axial=table.axial)
        return structure_part(structure, **self.others(table, reduced=False))

    def lumped(self, name: str, table: Lumped) -> Part:
        """Make a structure of masses, springs and dashpots."""
        behind = _behind(table)
        labels = [*table.labels, *(NEXT + name for name in behind)]
        stiffness, damping = (_links(links, labels) for links in (table.springs_n_per_m, table.dashpots_n_s_per_m))
        if behind:
            structure = lumped_sector(table.masses_kg, stiffness, damping, table.labels, behind)
        else:
            structure = lumped(np.array(table.masses_kg), stiffness, damping, table.labels)
        others = self.others(table, reduced=False)
        if table.dashpots_n_s_per_m and table.damping is None:  # the dashpots are its damping
            others.pop("damping", None)
        return structure_part(structure, sectors=table.sectors, **others)

    def rigid(self, name: str, table: Any) -> Part:
        """Make a rigid body with its surfaces."""
        surfaces = {word: _body_points(word, surface) for word, surface in table.surfaces.items()}
        return rigid_part(build(RigidBody, table), surfaces)

    def flat_curved(self, name: str, table: Any) -> Part:
        """Make a damper with a flat and a curved side."""
        return damper_part(damper_of(self.tables, name))

    def wedge(self, name: str, table: Any) -> Part:
        """Make a wedge."""
        return damper_part(build(WedgeDamper, table))

    def cylinder(self, name: str, table: Any) -> Part:
        """Make a cylinder."""
        return damper_part(build(CylinderDamper, table))

    def from_file(self, name: str, table: FileModel) -> Part:
        """Read a part from its files."""
        LOG.info("reading %s", table.file)
        others = self.others(table)
        heat = table.temperature or self.tables.temperature
        part = file_part(f"part.{name}", table, self.home, self.material(table), heat=heat, **others)
        return replace(part, warnings=(*part.warnings, *self._steel_by_default(name, table)))

    def _steel_by_default(self, name: str, table: FileModel) -> tuple[str, ...]:
        """Return a warning if a material replaces that of a file and leaves out constants, as one with an expansion alone."""
        given = table.material or self.tables.material
        if given is None:
            return ()
        keys = given.model_fields_set.union(*(row.model_fields_set for row in given.over_temperature or []))
        elastic = {"shear_modulus_pa", "young_moduli_pa", "elasticity_pa"} & keys
        wanted = ["density_kg_per_m3", *([] if elastic else ["young_modulus_pa", "poisson_ratio"])]
        missing = [key for key in wanted if key not in keys]
        if not missing:
            return ()
        return (
            (
                f"part.{name}: its material replaces the file's, and {', '.join(missing)}, left out, are taken from steel. "
                "Give all constants."
            ),
        )


_MAKERS: dict[type[Section], Callable[[Workshop, str, Any], Part]] = {
    PrismBlades: Workshop.blades,
    Sector: Workshop.sector,
    BeamTable: Workshop.beam,
    Lumped: Workshop.lumped,
    RigidBodyTable: Workshop.rigid,
    FlatCurved: Workshop.flat_curved,
    Wedge: Workshop.wedge,
    Cylinder: Workshop.cylinder,
    FileModel: Workshop.from_file,
}


def _own_reduction(address: str) -> OwnReduction:
    return OwnReduction(made(loaded(address), address), state_of(address))


def place_in_steps(steps: Sequence[Placed]) -> Place:
    """Return the placement of a part from steps of mirroring, turning and moving."""
    place = Place(np.eye(3), np.zeros(3))
    for step in steps:
        x, y, z = step.move_m
        mirrored = place_of(mirror=None if step.mirror is None else AXES[step.mirror])
        turned = place_of(turn=step.turn_deg * DEG, axis=Axis(AXES[step.axis]), move=(x, y, z))
        whole = mirrored.then(Place(step.new_axes, np.zeros(3))).then(turned)
        place = place.then(whole)
    return place


def damper_of(tables: Tables, name: str) -> FlatCurvedDamper:
    """Return the geometry of a flat_curved part; missing values come from platforms with nodes at its points.

    Raises
    ------
    InputError
        If the table is incomplete and no blades have nodes at its points.
    """
    table: Any = tables.part[name]
    given: dict[str, Any] = {}
    for blades in _blades_at(tables, name):
        given = {"apex": blades.wedge_apex, "flat_angle": blades.flat_angle, "curved_angle": blades.curved_angle}
    keys = {"apex": "apex_m", "flat_angle": "flat_angle_deg", "curved_angle": "curved_angle_deg"}
    for field, key in keys.items():
        if getattr(table, key) is not None:
            given.pop(field, None)
        elif field not in given:
            raise input_error(
                f"part.{name}.{key}",
                "is missing, and no prism_blades have nodes at the points of this part",
                f'Give it, or give blades nodes_at = ["{name}.flat", "{name}.curved"].',
            )
    damper: FlatCurvedDamper = build(FlatCurvedDamper, table, **given)
    return damper


def _blades_at(tables: Tables, name: str) -> list[BladePair]:
    """Return the geometry of the blades that have nodes at the points of a part."""
    return [
        build(BladePair, table)
        for table in tables.part.values()
        if isinstance(table, PrismBlades) and name in _owners(table)
    ]


def _owners(table: Any) -> list[str]:
    """Return the parts for which blades have nodes."""
    return list(dict.fromkeys(word.partition(".")[0] for word in table.nodes_at))


def contact_nodes(tables: Tables, table: Any) -> ContactPoints:
    """Return the points at which the blades of a table have contact nodes."""
    sides: list[str] = [word.partition(".")[2] for word in table.nodes_at]
    if not sides:
        return ContactPoints((), (), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0))
    return damper_of(tables, _owners(table)[0]).contact_points().on_sides(sides)


def digest(tables: Tables, name: str, home: Path) -> str:
    """Return the hash of everything a part depends on: tables and the content of files."""
    related = _related(tables, name)
    given = {key: tables.part[key].model_dump(mode="json") for key in related}
    shared = tables.model_dump(mode="json", include={"material", "temperature", "damping", "reduction"})
    files = [home / file for key in related for file in _files(tables.part[key])]
    content = [digest_of(path) for file in files for path in with_companions(file)]
    kinds = [type(tables.part[key]).__name__ for key in related]
    return sha256(json.dumps([name, kinds, given, shared, content]).encode()).hexdigest()


def _related(tables: Tables, name: str) -> list[str]:
    """Return the parts on whose tables a part depends, the part itself first."""
    table: Any = tables.part[name]
    if isinstance(table, Copy):
        return [name, *_related(tables, table.of)]
    if isinstance(table, PrismBlades):
        return [name, *_owners(table)]
    if isinstance(table, FlatCurved):
        blades = tables.part.items()
        return [name, *(k for k, t in blades if isinstance(t, PrismBlades) and name in _owners(t))]
    return [name]


def _files(table: Any) -> list[str]:
    return list(table.files().values()) if isinstance(table, FileModel) else []


def digest_of(path: Path) -> str:
    """Return the hash of a file's content."""
    found = sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK):
            found.update(chunk)
    return found.hexdigest()


def _behind(table: Lumped) -> list[str]:
    """Return the masses that springs and dashpots connect to the next sector."""
    links = [*table.springs_n_per_m, *table.dashpots_n_s_per_m]
    ends = {end.removeprefix(NEXT) for link in links for end in link[:2] if str(end).startswith(NEXT)}
    return [name for name in table.labels if name in ends]


def _links(links: list[list[Any]], labels: list[str]) -> FloatArray:
    """Return the matrix of springs or dashpots between labelled masses."""
    matrix = np.zeros((len(labels), len(labels)))
    for first, second, value in links:
        column = np.zeros(len(labels))
        for end, sign in ((first, 1.0), (second, -1.0)):
            if end != "ground":
                column[labels.index(end) if isinstance(end, str) else end - 1] += sign
        matrix += value * np.outer(column, column)
    return matrix


def _body_points(name: str, surface: Surface) -> BodyPoints:
    """Return the contact points of a body's surface, with frames from normals and tangent."""
    normals = surface.directions
    frames = []
    for normal in normals:
        along = np.eye(3)[np.argmin(np.abs(normal))] if surface.tangent is None else surface.tangent
        tangent = np.asarray(along, dtype=float)
        tangent = tangent - (tangent @ normal) * normal
        tangent /= np.linalg.norm(tangent)
        frames.append(np.column_stack([tangent, np.cross(normal, tangent), normal]))
    names = surface.names or [f"{name}.{i + 1}" for i in range(len(normals))]
    area = None if surface.areas_m2 is None else np.array(surface.areas_m2, dtype=float)
    places = np.array(surface.points_m, dtype=float)
    return BodyPoints(tuple(names), places, np.array(frames), area)
