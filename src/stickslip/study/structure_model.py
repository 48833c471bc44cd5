"""The model of a study of a bladed disk: from a parametric sector or from files, at any speed and wave number."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.facts import facts_of_matrices, facts_of_solid
from stickslip.model.fe.rotation import RotatingSolid, rotating_solid
from stickslip.model.mesh.sector_mesh import mesh_sector
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.structure import Structure
from stickslip.reduction.cyclic import CyclicSector, cyclic_sector, travelling_wave
from stickslip.study.file_model import (
    HIGH,
    LOW,
    ROOT,
    FileContent,
    faces_of,
    of_the_faces,
    read_file_model,
)
from stickslip.study.structure_results import Facts, Skin
from stickslip.study.structure_study import StructureStudy
from stickslip.study.structure_tables import Rotation

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class DiskModel:
    """One sector of a wheel, or a whole structure.

    Parameters
    ----------
    structure
        At rest, its cyclic faces free.
    rotating
        The solid it was assembled from; None for a model of matrices, which no speed changes.
    mesh
        For pictures; None where there is none.
    sector
        How the sector meets its neighbours; None for a whole structure.
    axis
        Of rotation.
    facts
        Mass, size and counts.
    rotation
        What of the rotation is kept.
    warnings
        What the user should know.
    """

    structure: Structure
    rotating: RotatingSolid | None
    mesh: SolidMesh | None
    sector: CyclicSector | None
    axis: Axis
    facts: Facts
    rotation: Rotation
    warnings: tuple[str, ...] = ()

    @property
    def sectors(self) -> int:
        """Number of sectors; 1 for a whole structure."""
        return 1 if self.sector is None else self.sector.sectors

    @cached_property
    def _tie(self) -> Matrix | None:
        """Tie of the static displacement; one object, by which the solid knows what it has computed."""
        return None if self.sector is None else self.sector.tie

    def at(self, speed: float, wave_number: int) -> Structure:
        """Return the structure at a speed in rad/s, as the travelling wave of a wave number where it is cyclic."""
        structure = self.structure
        if self.rotating is not None and speed > 0:
            structure = self.rotating.at_speed(
                speed,
                tie=self._tie,
                tangent=self.rotation.tangent,
                coriolis=self.rotation.coriolis,
            )
        if self.sector is None:
            return structure
        return travelling_wave(replace(self.sector, structure=structure), wave_number)

    def static_displacement(self, speed: float) -> FloatArray | None:
        """Return the (nodes, 3) static displacement in m of the mesh at a speed in rad/s; None at rest and for matrices."""
        if self.rotating is None or speed <= 0:
            return None
        return self.rotating.at_nodes(self.rotating.displacement(speed, tie=self._tie))

    @cached_property
    def skin(self) -> Skin | None:
        """The skin of the mesh by its corner nodes; None without a mesh."""
        if self.mesh is None:
            return None
        triangles = self.mesh.surface
        used, place = np.unique(triangles, return_inverse=True)
        cut = np.zeros(len(triangles), dtype=np.int64)
        if self.sector is not None:
            held = self._held
            for face in (self.sector.low, self.sector.high):
                own = self._on(face)
                inside = (own | held)[triangles].all(axis=1) & own[triangles].any(axis=1)
                cut |= inside
        return Skin(self.mesh.points[used], place.reshape(triangles.shape), cut)

    def on_skin(self, field: Matrix) -> Matrix:
        """Return displacements (m, n, 3) of the skin's points from fields (dofs, m) of the sector."""
        assert self.mesh is not None
        used = np.unique(self.mesh.surface)
        out = np.zeros((field.shape[1], len(self.mesh.points), 3), dtype=field.dtype)
        dofs, nodes, components = self._places
        out[:, nodes, components] = field[dofs].T
        return out[:, used]

    @cached_property
    def _places(self) -> tuple[IntArray, IntArray, IntArray]:
        """Dofs that are displacements of nodes of the mesh; the nodes (indices) and components (0, 1, 2)."""
        assert self.mesh is not None
        table = self.structure.dofs
        order = np.argsort(self.mesh.numbers, kind="stable")
        at = np.searchsorted(self.mesh.numbers, table.node, sorter=order)
        nodes = order[np.minimum(at, len(order) - 1)]
        known = (self.mesh.numbers[nodes] == table.node) & np.isin(table.component, ("x", "y", "z"))
        dofs = np.flatnonzero(known)
        components = np.array(["xyz".index(table.component[i]) for i in dofs], dtype=np.int64)
        return dofs, nodes[dofs], components

    @property
    def _held(self) -> BoolArray:
        """Which nodes of the mesh are clamped."""
        assert self.mesh is not None
        mask = np.zeros(len(self.mesh.points), dtype=bool)
        mask[self.mesh.node_sets.get(ROOT, np.zeros(0, dtype=np.int64))] = True
        return mask

    def _on(self, face: IntArray) -> BoolArray:
        """Return which nodes of the mesh have one of the dofs of a face; clamped ones have none."""
        assert self.mesh is not None
        dofs, nodes, _ = self._places
        mask = np.zeros(len(self.mesh.points), dtype=bool)
        mask[nodes[np.isin(dofs, face)]] = True
        return mask


def disk_model(study: StructureStudy, say: Say) -> DiskModel:
    """Build the model of a study.

    Parameters
    ----------
    study
        The study.
    say
        Takes a line of text for each step.

    Raises
    ------
    InputError
        If a file cannot be read, sets are not there, faces do not match, or units are absurd.
    """
    if study.tables.model.file is not None:
        content = read_file_model(study, say)
        return _finished(study, content, say)
    assert study.tables.model.sector is not None
    assert study.tables.material is not None
    table = study.tables.model.sector
    say(f"meshing one of {table.sectors} sectors")
    mesh = mesh_sector(table.library())
    if table.shroud is not None and table.shroud.joined:
        mesh = _with_joined_shrouds(mesh)
    content = FileContent(
        mesh, study.tables.material.library(), None, Axis(), sectors=table.sectors
    )
    return _finished(study, content, say)


def _with_joined_shrouds(mesh: SolidMesh) -> SolidMesh:
    """Return the mesh with the shroud's contact faces as parts of the cyclic faces."""
    sets = dict(mesh.node_sets)
    for side, name in (("low", LOW), ("high", HIGH)):
        both = np.concatenate([sets[name], sets[f"shroud_{side}"]])
        sets[name] = both[np.sort(np.unique(both, return_index=True)[1])]
    return replace(mesh, node_sets=sets)


def _finished(study: StructureStudy, content: FileContent, say: Say) -> DiskModel:
    """Assemble what was read, pair the faces, and say what it is."""
    rotation, sectors = study.tables.rotation, content.sectors
    rotating = None
    if content.mesh is not None and content.material is not None:
        rotating = rotating_solid(
            content.mesh,
            content.material,
            content.axis,
            held=content.held,
            quadrature=content.quadrature,
        )
        structure = rotating.structure
        facts = facts_of_solid(content.mesh, content.material, structure.n)
    else:
        assert content.structure is not None
        structure = content.structure
        facts = facts_of_matrices(structure)
        if rotation.speed_rpm > 0:
            raise input_error(
                f"{study.path}: rotation.speed_rpm",
                f"is {rotation.speed_rpm:g}, but the model is matrices, which no speed changes",
                "Give 0, or bring the mesh. Matrices that were exported at speed hold its effects already.",
            )
    say(
        f"{facts.nodes} nodes, {facts.elements} elements, {facts.dofs} free dofs; mass {facts.mass:.6g} kg"
    )
    sector = None
    if sectors > 1:
        low, high = faces_of(study, structure.sets)
        try:
            sector = cyclic_sector(structure, sectors, low=low, high=high, axis=content.axis)
        except InputError as error:
            raise of_the_faces(study, error) from None
        say(f"{len(sector.low)} pairs of dofs on the cyclic faces")
    return DiskModel(
        structure, rotating, content.mesh, sector, content.axis, facts, rotation, content.warnings
    )
