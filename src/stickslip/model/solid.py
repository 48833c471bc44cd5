"""Linear elastic solids: consistent mass and stiffness of tetrahedra and hexahedra.

scikit-fem is imported only when a solid is assembled.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.dofs import nodal_dofs
from stickslip.model.elements import (
    EXACT,
    Quadrature,
    check_jacobians,
    library,
    library_element,
    shape_functions,
)
from stickslip.model.mesh import SolidMesh
from stickslip.model.structure import Structure

CUT_FACES = ("cyclic_low", "cyclic_high")  # these sets may lose nodes to a clamp


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


def assemble_solid(
    mesh: SolidMesh,
    material: Material,
    *,
    clamped: tuple[str, ...] = ("root",),
    quadrature: Quadrature = EXACT,
) -> Structure:
    """Assemble mass and stiffness, with the nodes of the sets `clamped` removed.

    Parameters
    ----------
    mesh
        Any mesh; one without ``root`` stays free unless `clamped` names other sets.
    material
        Its material.
    clamped
        Names of node sets.
    quadrature
        The rules; the default integrates straight-edged cells exactly.

    Returns
    -------
    Structure
        Sparse, undamped; `Dofs.node` holds the mesh's node numbers. Each other node set becomes a set of dofs,
        node-major (x, y, z); ``cyclic_low`` and ``cyclic_high`` without their clamped nodes.

    Raises
    ------
    InputError
        If the mesh has nodes without elements or cells inside out, neighbours that do not share their mid-side nodes,
        `clamped` names an unknown set, or a set has clamped nodes.
    """
    mass, stiffness = integrate(mesh, material, quadrature)
    return clamp(mesh, mass, stiffness, clamped_nodes(mesh, clamped), clamped)


def clamped_nodes(mesh: SolidMesh, clamped: tuple[str, ...]) -> BoolArray:
    """Return which nodes (n,) belong to the node sets named `clamped`; ``root`` need not be there."""
    held = np.zeros(len(mesh.points), dtype=bool)
    for name in clamped:
        if name in mesh.node_sets:
            held[mesh.node_sets[name]] = True
        elif name != "root":
            raise input_error(
                "clamped",
                f"there is no node set {name!r}",
                did_you_mean(name, list(mesh.node_sets)),
            )
    return held


def clamp(
    mesh: SolidMesh, mass: Matrix, stiffness: Matrix, held: BoolArray, clamped: tuple[str, ...]
) -> Structure:
    """Return the structure without the nodes that are `held` (n,), from matrices of the free body."""
    nodes = np.flatnonzero(~held)
    free = node_dofs(nodes)
    new = np.cumsum(~held) - 1
    sets = {}
    for name, members in mesh.node_sets.items():
        if name in clamped:
            continue
        if held[members].any() and name not in CUT_FACES:
            raise input_error(
                f"mesh: node set {name!r}",
                f"holds clamped nodes, e.g. {mesh.numbers[members[held[members]][0]]}",
                f"Take them out of {' or '.join(repr(c) for c in clamped)} or out of the set.",
            )
        sets[name] = node_dofs(new[members[~held[members]]])
    mass, stiffness = mass[free][:, free], stiffness[free][:, free]
    damping = scipy.sparse.csr_array(mass.shape)
    table = nodal_dofs(mesh.points[nodes], mesh.numbers[nodes])
    return Structure(mass, damping, stiffness, table, sets)


def node_dofs(nodes: IntArray) -> IntArray:
    """Return the x, y, z dofs of `nodes` (node-major)."""
    return np.asarray((3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def integrate(mesh: SolidMesh, material: Material, quadrature: Quadrature) -> tuple[Matrix, Matrix]:
    """Return mass and stiffness of the free body, dofs node-major in the mesh's own order.

    Both are put together from scalar integrals, ``∫ φ_p φ_q`` and ``∫ ∂_a φ_p ∂_b φ_q``:
    ``K_ab = λ D_ab + G D_ba + G δ_ab Σ_c D_cc``. That costs a fraction of the vector-valued form.
    """
    check_nodes(mesh)
    width = mesh.cells.shape[1]
    for degree in {quadrature.stiffness, quadrature.mass}:
        check_jacobians(mesh, shape_functions(width, degree))
    bases, theirs = _bases(mesh, quadrature)

    def assemble(integrand: Callable[..., FloatArray], degree: int) -> Matrix:
        form = library().BilinearForm(integrand)
        matrix = scipy.sparse.csr_array(form.assemble(bases[degree]))
        return matrix[theirs][:, theirs]

    gram = assemble(lambda u, v, _: u * v, quadrature.mass)
    D = {}
    for a in range(3):
        for b in range(a, 3):
            D[a, b] = assemble(
                lambda u, v, _, a=a, b=b: v.grad[a] * u.grad[b], quadrature.stiffness
            )
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


def check_nodes(mesh: SolidMesh) -> None:
    """Refuse nodes that belong to no cell."""
    orphans = np.setdiff1d(np.arange(len(mesh.points)), mesh.cells)
    if orphans.size:
        raise input_error(
            "mesh",
            f"{orphans.size} nodes belong to no element, e.g. {mesh.numbers[orphans[0]]}",
            "Remove them.",
        )


def _bases(mesh: SolidMesh, quadrature: Quadrature) -> tuple[dict[int, Any], IntArray]:
    """Return scikit-fem's basis for each degree, and its dof of each of our nodes (n,)."""
    skfem = library()
    width = mesh.cells.shape[1]
    element, order = library_element(width)
    # the geometry has the shape functions of the displacement: affine on linear tetrahedra alone
    grid = (skfem.MeshTet1 if width in (4, 10) else skfem.MeshHex1)(
        np.ascontiguousarray(mesh.points.T),
        np.ascontiguousarray(mesh.cells[:, order].T),
        elem=type(element),
        affine=width == 4,
    )
    degrees = {quadrature.stiffness, quadrature.mass}
    bases = {degree: skfem.Basis(grid, element, intorder=degree) for degree in degrees}
    # scikit-fem renumbers mid-side nodes: go from its dofs back to our nodes
    dofs = bases[quadrature.mass].element_dofs
    theirs = np.empty(len(mesh.points), dtype=np.int64)
    theirs[mesh.cells[:, order].T] = dofs
    _check_shared(mesh, theirs, dofs[np.argsort(order)].T)
    return bases, theirs


def _check_shared(mesh: SolidMesh, theirs: IntArray, dofs: IntArray) -> None:
    """Refuse nodes (n,) that do not stand for one of scikit-fem's dofs (m, k) each, in every cell the same."""
    used = np.bincount(theirs, minlength=len(theirs))
    wrong = (theirs[mesh.cells] != dofs) | (used[theirs] > 1)[mesh.cells]
    if wrong.any():
        cell, place = np.argwhere(wrong)[0]
        raise input_error(
            "mesh",
            f"neighbours do not share their mid-side nodes, or a corner of one is a mid-side node of another, e.g. node "
            f"{mesh.numbers[mesh.cells[cell, place]]} of cell {mesh.cell_numbers[cell]}",
            "Merge coincident nodes, and use cells of one order.",
        )


def _unit(a: int, b: int) -> FloatArray:
    unit = np.zeros((3, 3))
    unit[a, b] = 1.0
    return unit
