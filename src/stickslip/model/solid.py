"""Linear elastic solids: consistent mass and stiffness of second-order tetrahedra.

scikit-fem is imported only when a solid is assembled.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import StickslipError, input_error
from stickslip.model.dofs import nodal_dofs
from stickslip.model.mesh import SolidMesh
from stickslip.model.structure import Structure


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic elastic material.

    Parameters
    ----------
    young_modulus
        In Pa.
    poisson_ratio
        Between 0 (included) and 1/2.
    density
        In kg/m³.
    """

    young_modulus: float = 210e9
    poisson_ratio: float = 0.3
    density: float = 7850.0

    def __post_init__(self) -> None:
        for name in ("young_modulus", "density"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise input_error(
                    f"Material.{name}", f"must be positive, got {value}", "Use SI units."
                )
        if not 0 <= self.poisson_ratio < 0.5:
            raise input_error(
                "Material.poisson_ratio",
                f"must be at least 0 and below 1/2, got {self.poisson_ratio}",
                "Steel has about 0.3.",
            )

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and G in Pa."""
        e, nu = self.young_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


def assemble_solid(mesh: SolidMesh, material: Material) -> Structure:
    """Assemble mass and stiffness, with the nodes of the set ``root`` clamped (removed).

    Parameters
    ----------
    mesh
        Any mesh of second-order tetrahedra; a mesh without ``root`` stays free.
    material
        Its material.

    Returns
    -------
    Structure
        Sparse, undamped. Each other node set becomes a set of dofs, node-major (x, y, z).

    Raises
    ------
    InputError
        If the mesh has nodes without elements, or a set has clamped nodes.
    """
    n_nodes = len(mesh.points)
    orphans = np.setdiff1d(np.arange(n_nodes), mesh.cells)
    if orphans.size:
        raise input_error(
            "mesh", f"{orphans.size} nodes belong to no element, e.g. {orphans[0]}", "Remove them."
        )
    mass, stiffness = _integrate(mesh, material)
    clamped = np.zeros(n_nodes, dtype=bool)
    clamped[mesh.node_sets.get("root", [])] = True
    nodes = np.flatnonzero(~clamped)
    free = _node_dofs(nodes)
    new = np.cumsum(~clamped) - 1
    sets = {}
    for name, members in mesh.node_sets.items():
        if name == "root":
            continue
        if clamped[members].any():
            raise input_error(
                f"mesh: node set {name!r}",
                f"holds clamped nodes, e.g. {members[clamped[members]][0]}",
                "Take them out of 'root' or out of the set.",
            )
        sets[name] = _node_dofs(new[members])
    mass, stiffness = mass[free][:, free], stiffness[free][:, free]
    damping = scipy.sparse.csr_array(mass.shape)
    return Structure(mass, damping, stiffness, nodal_dofs(mesh.points[nodes], nodes), sets)


def _node_dofs(nodes: IntArray) -> IntArray:
    return np.asarray((3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def _integrate(mesh: SolidMesh, material: Material) -> tuple[Matrix, Matrix]:
    """Return mass and stiffness of the free body, dofs node-major in the mesh's own order."""
    try:
        import skfem
        from skfem.models.elasticity import linear_elasticity
    except ModuleNotFoundError as error:
        message = f"{error.name}: not installed. Use: pip install 'stickslip[fe]'"
        raise StickslipError(message) from error

    @skfem.BilinearForm
    def inertia(u, v, _):  # type: ignore[no-untyped-def]  # scikit-fem calls it with its own fields
        return material.density * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])

    grid = skfem.MeshTet2(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.cells.T))
    basis = skfem.Basis(grid, skfem.ElementVector(skfem.ElementTetP2()), intorder=4)
    # scikit-fem renumbers mid-side nodes: go from its dofs back to 3 node + component
    ours = np.empty(3 * len(mesh.points), dtype=np.int64)
    for k in range(10):
        for c in range(3):
            ours[basis.element_dofs[3 * k + c]] = 3 * mesh.cells[:, k] + c
    theirs = np.argsort(ours)
    matrices = []
    for form in (inertia, linear_elasticity(*material.lame)):
        matrix = scipy.sparse.csr_array(form.assemble(basis))
        matrices.append((matrix[theirs][:, theirs] + matrix[theirs][:, theirs].T) / 2)
    return matrices[0].tocsr(), matrices[1].tocsr()
