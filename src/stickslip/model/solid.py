"""Linear elastic solids: consistent mass and stiffness of second-order tetrahedra.

scikit-fem is imported only when a solid is assembled.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error, missing_package
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
    """Return mass and stiffness of the free body, dofs node-major in the mesh's own order.

    Both are put together from scalar integrals, ``∫ φ_p φ_q`` and ``∫ ∂_a φ_p ∂_b φ_q``:
    ``K_ab = λ D_ab + G D_ba + G δ_ab Σ_c D_cc``. That costs a fraction of the vector-valued form.
    """
    try:
        import skfem
    except ModuleNotFoundError as error:
        raise missing_package("scikit-fem", error, "fe") from error

    grid = skfem.MeshTet2(np.ascontiguousarray(mesh.points.T), np.ascontiguousarray(mesh.cells.T))
    basis = skfem.Basis(grid, skfem.ElementTetP2(), intorder=4)
    # scikit-fem renumbers mid-side nodes: go from its dofs back to our nodes
    theirs = np.empty(len(mesh.points), dtype=np.int64)
    theirs[mesh.cells.T] = basis.element_dofs

    def assemble(integrand: Callable[..., FloatArray]) -> Matrix:
        matrix = scipy.sparse.csr_array(skfem.BilinearForm(integrand).assemble(basis))
        return matrix[theirs][:, theirs]

    gram = assemble(lambda u, v, _: u * v)
    D = {}
    for a in range(3):
        for b in range(a, 3):
            D[a, b] = assemble(lambda u, v, _, a=a, b=b: v.grad[a] * u.grad[b])
            D[b, a] = D[a, b].T
    first, second = material.lame
    trace = second * (D[0, 0] + D[1, 1] + D[2, 2])
    blocks = [
        (first * D[a, b] + second * D[b, a] + (trace if a == b else 0 * trace), a, b)
        for a in range(3)
        for b in range(3)
    ]
    mass = scipy.sparse.kron(material.density * gram, np.eye(3), format="csr")
    stiffness = sum(scipy.sparse.kron(block, _unit(a, b), format="csr") for block, a, b in blocks)
    return mass, scipy.sparse.csr_array((stiffness + stiffness.T) / 2)


def _unit(a: int, b: int) -> FloatArray:
    unit = np.zeros((3, 3))
    unit[a, b] = 1.0
    return unit
