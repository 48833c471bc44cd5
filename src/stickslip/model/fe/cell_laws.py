"""Elastic laws of cells at their integration points: Lamé's constants, or matrices in global axes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.fe.elements import Shape
from stickslip.model.fe.material import (
    TENSOR,
    AnyMaterial,
    ElasticMaterial,
    Expansion,
    Material,
    Materials,
    Orientation,
    stress_rotation,
)
from stickslip.model.mesh.solid_mesh import SolidMesh


@dataclass(frozen=True, eq=False)
class Temperature:
    """Temperatures of the nodes of a mesh, in the scale of the materials' tables.

    Parameters
    ----------
    values
        (nodes,) temperatures.
    start
        (nodes,) temperatures without thermal strain.
    """

    values: FloatArray
    start: FloatArray

    def take(self, nodes: IntArray) -> "Temperature":
        """Return the temperatures of some nodes."""
        return Temperature(self.values[nodes], self.start[nodes])

    def uniform(self, nodes: IntArray) -> float | None:
        """Return the temperature of nodes that all have the same; None for others."""
        own = self.values[nodes]
        return float(own[0]) if np.all(own == own[0]) else None


@dataclass(frozen=True, eq=False)
class CellLaws:
    """Materials of the cells of a mesh, evaluated at integration points; `cell_laws` makes one.

    Parameters
    ----------
    mesh
        m cells of one kind.
    each
        The different materials.
    which
        (m,) place of each cell's material among these.
    temperature
        Temperatures of the nodes; None: no material depends on it.
    expansions
        Thermal expansion and axes of each material; None without expansion.
    """

    mesh: SolidMesh
    each: tuple[AnyMaterial, ...]
    which: IntArray
    temperature: Temperature | None = None
    expansions: tuple[tuple[Expansion, Orientation] | None, ...] = ()

    def only(self, index: int, mesh: SolidMesh, nodes: IntArray) -> "CellLaws":
        """Return the law of one material for all cells of a mesh whose points are `nodes` of the own mesh."""
        temperature = None if self.temperature is None else self.temperature.take(nodes)
        which = np.zeros(len(mesh.cells), dtype=np.int64)
        return CellLaws(mesh, (self.each[index],), which, temperature, (self.expansions[index],))

    @property
    def isotropic(self) -> bool:
        """Whether Lamé's constants of each cell say all."""
        return all(isinstance(one, Material) for one in self.each)

    def elastic(self, shape: Shape, piece: slice) -> FloatArray:
        """Return Lamé's constants (m, 2) in Pa of a piece of the cells, or matrices (m, q, 6, 6) in global axes."""
        which = self.which[piece]
        if self.isotropic:
            return np.asarray(self._lame[which])
        found = np.empty((len(which), len(shape.weights) if not shape.mean else 1, 6, 6))
        for index in np.unique(which):
            one, rows = self.each[index], np.flatnonzero(which == index)
            found[rows] = self._matrices(one, shape, np.arange(piece.start, piece.stop)[rows], found.shape[1])
        return found

    @property
    def _lame(self) -> FloatArray:
        return np.array([one.lame for one in self.each if isinstance(one, Material)])

    def density(self, piece: slice) -> FloatArray:
        """Return the density (m,) of a piece of the cells in kg/m³."""
        found = np.array([one.density for one in self.each])[self.which[piece]]
        for index, one in enumerate(self.each):
            if isinstance(one, ElasticMaterial) and one.density_table.varies and self.temperature is not None:
                rows = np.flatnonzero(self.which[piece] == index)
                mean = self.temperature.values[self.mesh.cells[piece][rows]].mean(axis=1)
                found[rows] = one.density_table.at(mean)[:, 0]
        return np.asarray(found)

    def modulus(self, piece: slice) -> FloatArray:
        """Return Young's modulus (m,) of a piece of the cells in Pa, of anisotropic ones the largest along an axis."""
        if self.isotropic:
            first, second = self._lame[self.which[piece]].T
            return np.asarray(second * (3 * first + 2 * second) / (first + second))
        return np.array([one.young_modulus for one in self.each])[self.which[piece]]

    def _matrices(self, one: AnyMaterial, shape: Shape, cells: IntArray, points: int) -> FloatArray:
        here = None
        if isinstance(one, ElasticMaterial) and one.elastic.varies and self.temperature is not None:
            here = self._at_points(self.temperature.values, shape, cells, points)
        plain = np.broadcast_to(one.matrices(here), (len(cells), points, 6, 6))
        if isinstance(one, Material) or one.is_isotropic:
            return plain
        turn = stress_rotation(one.orientation.at(self._places(shape, cells, points)))
        return np.asarray(turn @ plain @ np.swapaxes(turn, -1, -2))

    def thermal_strain(self, shape: Shape, piece: slice) -> FloatArray | None:
        """Return the free thermal strain (m, q, 3, 3) of a piece of the cells in global axes; None without any."""
        if self.temperature is None or not any(self.expansions):
            return None
        which = self.which[piece]
        points = len(shape.weights) if not shape.mean else 1
        found = np.zeros((len(which), points, 3, 3))
        for index in np.unique(which):
            given, rows = self.expansions[index], np.flatnonzero(which == index)
            if given is None:
                continue
            cells = np.arange(piece.start, piece.stop)[rows]
            start, end = (
                self._at_points(field, shape, cells, points)
                for field in (self.temperature.start, self.temperature.values)
            )
            vector = given[0].strain(start, end)
            tensor = vector[..., TENSOR] * np.where(np.eye(3, dtype=bool), 1.0, 0.5)
            axes = given[1].at(self._places(shape, cells, points)) if _directed(given[0]) else np.eye(3)
            found[rows] = axes @ tensor @ np.swapaxes(axes, -1, -2)
        return found

    def _at_points(self, field: FloatArray, shape: Shape, cells: IntArray, points: int) -> FloatArray:
        """Return a field (nodes,) at the integration points (m, q); bricks of 8 nodes take the mean of their corners.

        Their displacement does not follow a strain that changes within the brick.
        """
        own = field[self.mesh.cells[cells]]
        if own.shape[1] == 8:
            return np.repeat(own.mean(axis=1)[:, None], points, axis=1)
        return np.asarray(own @ shape.values[:points, : shape.width].T)

    def _places(self, shape: Shape, cells: IntArray, points: int) -> FloatArray:
        """Return the positions (m, q, 3) of the integration points in m."""
        corners = self.mesh.points[self.mesh.cells[cells]]
        return np.asarray(np.einsum("qk,mkx->mqx", shape.values[:points, : shape.width], corners, optimize=True))


def _directed(expansion: Expansion) -> bool:
    """Whether an expansion differs along the axes of the material."""
    return len(expansion.coefficients.values[0]) > 1


def cell_laws(mesh: SolidMesh, material: Materials, temperature: Temperature | None = None) -> CellLaws:
    """Return the laws of the cells of a mesh from one material, or from one for each cell, at a temperature.

    Raises
    ------
    InputError
        If there is not one material for each cell, or a material depends on temperature.
    """
    if not isinstance(material, Sequence):
        return _laws(mesh, (material,), np.zeros(len(mesh.cells), dtype=np.int64), temperature)
    if len(material) != len(mesh.cells):
        raise input_error(
            "material",
            f"is a list of {len(material)} for {len(mesh.cells)} cells",
            "Give one material, or one for each cell.",
        )
    place: dict[AnyMaterial, int] = {}
    which = np.array([place.setdefault(one, len(place)) for one in material], dtype=np.int64)
    return _laws(mesh, tuple(place), which, temperature)


def _laws(
    mesh: SolidMesh, given: tuple[AnyMaterial, ...], which: IntArray, temperature: Temperature | None
) -> CellLaws:
    used = np.unique(mesh.cells[mesh.cells >= 0])
    uniform = None if temperature is None else temperature.uniform(used)
    each, expansions = list[AnyMaterial](), list[tuple[Expansion, Orientation] | None]()
    for one in given:
        if isinstance(one, Material):
            each.append(one)
            expansions.append(None)
            continue
        if one.varies and temperature is None:
            raise input_error(
                "material", "depends on temperature, and none is given", "Give a temperature, or constants alone."
            )
        each.append(one if one.varies and uniform is None else one.fixed(uniform))
        expansions.append(None if one.expansion is None else (one.expansion, one.orientation))
    return CellLaws(mesh, tuple(each), which, temperature, tuple(expansions))


def laws_of_group(laws: CellLaws, mesh: SolidMesh, rows: IntArray) -> CellLaws:
    """Return the laws of the cells `rows` alone, which are those of `mesh`."""
    return replace(laws, mesh=mesh, which=laws.which[rows])
