"""Elastic laws of cells at their integration points: Lamé's constants, or matrices in global axes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.fe.elements import Shape
from stickslip.model.fe.material import ElasticMaterial, Material, Materials, stress_rotation
from stickslip.model.mesh.solid_mesh import SolidMesh


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
    """

    mesh: SolidMesh
    each: tuple[Material | ElasticMaterial, ...]
    which: IntArray

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
        return np.asarray(np.array([one.density for one in self.each])[self.which[piece]])

    def modulus(self, piece: slice) -> FloatArray:
        """Return Young's modulus (m,) of a piece of the cells in Pa, of anisotropic ones the largest along an axis."""
        if self.isotropic:
            first, second = self._lame[self.which[piece]].T
            return np.asarray(second * (3 * first + 2 * second) / (first + second))
        return np.array([one.young_modulus for one in self.each])[self.which[piece]]

    def _matrices(self, one: Material | ElasticMaterial, shape: Shape, cells: IntArray, points: int) -> FloatArray:
        plain = np.broadcast_to(one.matrices(None), (len(cells), points, 6, 6))
        if isinstance(one, Material) or one.is_isotropic:
            return plain
        turn = stress_rotation(one.orientation.at(self._places(shape, cells, points)))
        return np.asarray(turn @ plain @ np.swapaxes(turn, -1, -2))

    def _places(self, shape: Shape, cells: IntArray, points: int) -> FloatArray:
        """Return the positions (m, q, 3) of the integration points in m."""
        corners = self.mesh.points[self.mesh.cells[cells]]
        return np.asarray(np.einsum("qk,mkx->mqx", shape.values[:points, : shape.width], corners, optimize=True))


def cell_laws(mesh: SolidMesh, material: Materials) -> CellLaws:
    """Return the laws of the cells of a mesh from one material, or from one for each cell.

    Raises
    ------
    InputError
        If there is not one material for each cell, or a material depends on temperature.
    """
    each = material if isinstance(material, Sequence) else [material]
    if any(isinstance(one, ElasticMaterial) and one.varies for one in each):
        raise input_error(
            "material", "depends on temperature, and none is given", "Give a material of one temperature."
        )
    if not isinstance(material, Sequence):
        return CellLaws(mesh, (material,), np.zeros(len(mesh.cells), dtype=np.int64))
    if len(material) != len(mesh.cells):
        raise input_error(
            "material",
            f"is a list of {len(material)} for {len(mesh.cells)} cells",
            "Give one material, or one for each cell.",
        )
    place: dict[Material | ElasticMaterial, int] = {}
    which = np.array([place.setdefault(one, len(place)) for one in material], dtype=np.int64)
    return CellLaws(mesh, tuple(place), which)


def laws_of_group(laws: CellLaws, mesh: SolidMesh, rows: IntArray) -> CellLaws:
    """Return the laws of the cells `rows` alone, which are those of `mesh`."""
    return replace(laws, mesh=mesh, which=laws.which[rows])
