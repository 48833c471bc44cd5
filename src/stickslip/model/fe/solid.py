"""Linear elastic solids: consistent mass and stiffness.

scikit-fem is imported only when a solid is assembled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error, nearest_and_known
from stickslip.model.fe.cell_laws import CellLaws, Temperature, cell_laws
from stickslip.model.fe.cell_matrices import assemble_cells, is_plain
from stickslip.model.fe.elements import (
    EXACT,
    CellGroup,
    Quadrature,
    Rules,
    cell_groups,
    check_jacobians,
    library,
    library_element,
)
from stickslip.model.fe.links import Links, eliminate
from stickslip.model.fe.material import Material, Materials
from stickslip.model.mesh.solid_mesh import CORNERS, EDGES, SolidMesh, by_kind
from stickslip.model.structure import Structure, nodal_dofs

CUT_FACES = ("cyclic_low", "cyclic_high")  # sets whose clamped nodes are removed; other sets must have none


def assemble_solid(
    mesh: SolidMesh,
    material: Materials,
    *,
    clamped: tuple[str, ...] = ("root",),
    held: BoolArray | None = None,
    quadrature: Rules = EXACT,
    links: Links | None = None,
    temperature: Temperature | None = None,
) -> Structure:
    """Assemble mass and stiffness, with the nodes of the sets `clamped` removed.

    Parameters
    ----------
    mesh
        Any mesh; without the set ``root`` it stays free unless `clamped` names other sets.
    material
        Its material, or a list of m materials, one for each cell.
    clamped
        Names of node sets whose nodes do not move.
    held
        (nodes, 3) further supported components x, y, z.
    quadrature
        Quadrature, or a list of m, one for each cell; the default integrates straight-edged cells exactly.
    links
        Equations between nodes, point masses, springs and dashpots; None: none.
    temperature
        Temperatures of the nodes, at which materials are taken; None: no material depends on it. Stress is not considered here.

    Returns
    -------
    Structure
        Sparse, undamped but for dashpots; `Dofs.node` holds the mesh's node numbers. Each other node set becomes a set of dofs,
        node-major (x, y, z) without supported components; ``cyclic_low`` and ``cyclic_high`` lose their clamped nodes.

    Raises
    ------
    InputError
        If the mesh has nodes without elements or cells inside out, neighbours that do not share their mid-side nodes,
        `clamped` names an unknown set, or another set has clamped nodes.
    """
    mass, stiffness = integrate(mesh, material, quadrature, links, temperature)
    return support(mesh, mass, stiffness, clamped, held, links)[0]


def _clamped_nodes(mesh: SolidMesh, clamped: tuple[str, ...]) -> BoolArray:
    """Return a mask (n,) of the nodes in the node sets named `clamped`; ``root`` may be missing."""
    held = np.zeros(len(mesh.points), dtype=bool)
    for name in clamped:
        if name in mesh.node_sets:
            held[mesh.node_sets[name]] = True
        elif name != "root":
            raise input_error(
                "clamped", f"there is no node set {name!r}", nearest_and_known(name, list(mesh.node_sets))
            )
    return held


def support(
    mesh: SolidMesh,
    mass: Matrix,
    stiffness: Matrix,
    clamped: tuple[str, ...],
    held: BoolArray | None,
    links: Links | None = None,
) -> tuple[Structure, IntArray, Matrix | None]:
    """Remove supported components, and those that follow others by links, from the matrices of a free body.

    Returns
    -------
    tuple[Structure, IntArray, Matrix or None]
        The structure, the index (n,) of each of its dofs in the free body, and the CSR matrix (3 nodes, n) from them to all; None
        if no dof follows others.
    """
    still = _clamped_nodes(mesh, clamped)
    fixed = np.repeat(still[:, None], 3, axis=1)
    if held is not None:
        if held.shape != fixed.shape:
            raise input_error("held", f"has shape {held.shape} for {len(still)} nodes", "Give x, y, z of each node.")
        fixed = fixed | held
    moving, onto = np.flatnonzero(~fixed.ravel()), None
    damping = scipy.sparse.csr_array(mass.shape)
    if links is not None:
        damping = damping + links.dashpots
        members = np.concatenate([np.zeros(0, np.int64), *(np.unique(own) for own in mesh.node_sets.values())])
        counts = np.bincount(members, minlength=len(still))
        loose = np.setdiff1d(np.arange(len(still)), mesh.cells)  # as reference nodes, which loads act on
        counts[loose] += len(mesh.node_sets) + 1
        found = eliminate(links, fixed.ravel() | _idle(mass, stiffness, links), counts)
        # a rotation that one equation determines leaves a massless reference node without a direction that anything resists
        inert = sum(abs(scipy.sparse.csr_array(m)) @ np.ones(m.shape[0]) for m in (mass, damping, stiffness)) == 0
        felt = scipy.sparse.csr_array(abs(found.onto).T @ scipy.sparse.diags_array(1.0 - inert)).sum(axis=1) > 0
        moving, onto = found.moving[felt], found.onto[:, felt]
    new = np.full(fixed.size, -1)
    new[moving] = np.arange(len(moving))
    sets = {}
    for name, members in mesh.node_sets.items():
        if name in clamped:
            continue
        if still[members].any() and name not in CUT_FACES:
            raise input_error(
                f"mesh: node set {name!r}",
                f"holds clamped nodes, e.g. {mesh.numbers[members[still[members]][0]]}",
                f"Take them out of {' or '.join(repr(c) for c in clamped)} or out of the set.",
            )
        index = new[node_dofs(members)]
        sets[name] = index[index >= 0]
    own = [
        matrix[moving][:, moving] if onto is None else scipy.sparse.csr_array(onto.T @ matrix @ onto)
        for matrix in (mass, damping, stiffness)
    ]
    table = nodal_dofs(mesh.points, mesh.numbers).take(moving)
    return Structure(own[0], own[1], own[2], table, sets), moving, onto


def _idle(mass: Matrix, stiffness: Matrix, links: Links) -> BoolArray:
    """Return a mask (3 n,) of components of nodes without cells that have neither mass nor stiffness nor an equation."""
    used = abs(links.equations[:, : mass.shape[0]]).sum(axis=0)
    return np.asarray((mass.diagonal() == 0) & (stiffness.diagonal() == 0) & (used == 0))


def node_dofs(nodes: IntArray) -> IntArray:
    """Return the x, y, z dofs of `nodes` (node-major)."""
    return np.asarray((3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel(), dtype=np.int64)


def integrate(
    mesh: SolidMesh,
    material: Materials,
    quadrature: Rules,
    links: Links | None = None,
    temperature: Temperature | None = None,
) -> tuple[Matrix, Matrix]:
    """Return mass and stiffness of the free body with its links, dofs node-major in the mesh's own order."""
    check_nodes(mesh, () if links is None else links.nodes)
    mass, stiffness = _integrate_cells(mesh, material, quadrature, temperature)
    if links is None:
        return mass, stiffness
    points = scipy.sparse.diags_array(np.repeat(links.mass, 3))
    return scipy.sparse.csr_array(mass + points), scipy.sparse.csr_array(stiffness + links.springs)


def _integrate_cells(
    mesh: SolidMesh, material: Materials, quadrature: Rules, temperature: Temperature | None
) -> tuple[Matrix, Matrix]:
    groups = cell_groups(mesh, quadrature)
    for group in groups:
        for degree in {group.rule.stiffness: group.strain, group.rule.mass: group.inertia}.values():
            check_jacobians(group.mesh, degree)
    check_shared(mesh)
    everywhere = len(np.unique(mesh.cells[mesh.cells >= 0])) == len(mesh.points)
    laws = cell_laws(mesh, material, temperature)
    if len(laws.each) == 1 and len(groups) == 1 and everywhere:
        return _integrate(groups[0], laws)
    n = 3 * len(mesh.points)
    mass, stiffness = scipy.sparse.csr_array((n, n)), scipy.sparse.csr_array((n, n))
    for index in range(len(laws.each)):
        for group in groups:
            cells = group.mesh.cells[laws.which[group.rows] == index]
            if not len(cells):
                continue
            nodes, local = np.unique(cells, return_inverse=True)
            part = SolidMesh(mesh.points[nodes], local.reshape(cells.shape), {})
            rows = node_dofs(nodes)
            place = scipy.sparse.csr_array((np.ones(len(rows)), (rows, np.arange(len(rows)))), shape=(n, len(rows)))
            own = cell_groups(part, group.rule)[0]
            M, K = _integrate(own, laws.only(index, own.mesh, nodes))
            mass, stiffness = mass + place @ M @ place.T, stiffness + place @ K @ place.T
    return scipy.sparse.csr_array(mass), scipy.sparse.csr_array(stiffness)


def _integrate(group: CellGroup, laws: CellLaws) -> tuple[Matrix, Matrix]:
    """Integrate a body of one material.

    Both matrices are built from scalar integrals, ``∫ φ_p φ_q`` and ``D_ab = ∫ ∂_a φ_p ∂_b φ_q``:
    ``K_ab = λ D_ab + G D_ba + G δ_ab Σ_c D_cc``. This costs a fraction of the vector-valued form.
    """
    mesh, quadrature, material = group.mesh, group.rule, laws.each[0]
    if not (is_plain(group) and isinstance(material, Material)):
        return assemble_cells(group, laws)
    bases, theirs = _bases(mesh, quadrature)

    def assemble(integrand: Callable[..., FloatArray], degree: int) -> Matrix:
        form = library().BilinearForm(integrand)
        matrix = scipy.sparse.csr_array(form.assemble(bases[degree]))
        return matrix[theirs][:, theirs]

    gram = assemble(lambda u, v, _: u * v, quadrature.mass)
    D = {}
    for a in range(3):
        for b in range(a, 3):
            D[a, b] = assemble(lambda u, v, _, a=a, b=b: v.grad[a] * u.grad[b], quadrature.stiffness)
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


def check_nodes(mesh: SolidMesh, linked: IntArray | tuple[()] = ()) -> None:
    """Refuse nodes that belong neither to a cell nor to the `linked` ones."""
    orphans = np.setdiff1d(np.setdiff1d(np.arange(len(mesh.points)), mesh.cells), linked)
    if orphans.size:
        raise input_error(
            "mesh", f"{orphans.size} nodes belong to no element, e.g. {mesh.numbers[orphans[0]]}", "Remove them."
        )


def _bases(mesh: SolidMesh, quadrature: Quadrature) -> tuple[dict[int, Any], IntArray]:
    """Return scikit-fem's basis for each degree, and its dof of each of our nodes (n,)."""
    skfem = library()
    width = mesh.cells.shape[1]
    element, order = library_element(width)
    # isoparametric: geometry and displacement have the same shape functions, affine only on linear tetrahedra
    grid = (skfem.MeshTet1 if width in (4, 10) else skfem.MeshHex1)(
        np.ascontiguousarray(mesh.points.T),
        np.ascontiguousarray(mesh.cells[:, order].T),
        elem=type(element),
        affine=width == 4,
    )
    degrees = {quadrature.stiffness, quadrature.mass}
    bases = {degree: skfem.Basis(grid, element, intorder=degree) for degree in degrees}
    # scikit-fem renumbers mid-side nodes: go from its dofs back to our nodes
    theirs = np.empty(len(mesh.points), dtype=np.int64)
    theirs[mesh.cells[:, order].T] = bases[quadrature.mass].element_dofs
    return bases, theirs


def check_shared(mesh: SolidMesh) -> None:
    """Refuse edges of the same two corners with different mid-side nodes, and corners that are mid-side nodes."""
    ends, middle, owners, plain = [], [], [], []
    is_corner = np.zeros(len(mesh.points), dtype=bool)
    for width, rows in by_kind(mesh.cells):
        corners = CORNERS[width]
        is_corner[mesh.cells[rows, :corners]] = True
        edges = np.sort(mesh.cells[rows][:, np.array(EDGES[corners])].reshape(-1, 2), axis=1)
        if width > corners:
            ends.append(edges)
            middle.append(mesh.cells[rows, corners:width].ravel())
            owners.append(np.repeat(rows, width - corners))
        else:
            plain.append(edges)
    if ends:
        if plain:
            _check_orders(mesh, np.vstack(ends), np.vstack(plain))
        _check_middles(mesh, np.vstack(ends), np.concatenate(middle), np.concatenate(owners), is_corner)


def _check_orders(mesh: SolidMesh, ends: IntArray, plain: IntArray) -> None:
    """Refuse edges that cells of second order (e, 2) share with cells of first order (f, 2), where the mesh would gape."""
    n = len(mesh.points)
    both = np.intersect1d(ends[:, 0] * n + ends[:, 1], plain[:, 0] * n + plain[:, 1])
    if both.size:
        a, b = mesh.numbers[list(divmod(int(both[0]), n))]
        raise input_error(
            "mesh",
            f"cells of first and second order share {both.size} edges, e.g. that of nodes {a} and {b}, whose mid-side node only one side has",
            "Use cells of one order in each body, and tie bodies by [join].",
        )


def _check_middles(mesh: SolidMesh, ends: IntArray, middle: IntArray, owners: IntArray, is_corner: BoolArray) -> None:
    """Check the mid-side nodes (e,) of edges between corners (e, 2), of the cells `owners`."""
    key = ends[:, 0] * len(mesh.points) + ends[:, 1]
    _, first, which = np.unique(key, return_index=True, return_inverse=True)
    # a node in the middle of several edges keeps the last one here, so the others differ from it
    owner = np.zeros(len(mesh.points), dtype=np.int64)
    owner[middle] = which
    wrong = (middle[first][which] != middle) | is_corner[middle] | (owner[middle] != which)
    if wrong.any():
        edge = int(np.flatnonzero(wrong)[0])
        raise input_error(
            "mesh",
            "neighbours do not share their mid-side nodes, or one has a node that is a corner or the middle of another edge: "
            f"node {mesh.numbers[middle[edge]]} of cell {mesh.cell_numbers[owners[edge]]}",
            "Merge coincident nodes, and use cells of one order, their nodes in VTK's order.",
        )


def _unit(a: int, b: int) -> FloatArray:
    unit = np.zeros((3, 3))
    unit[a, b] = 1.0
    return unit
