"""Two elastic blocks pressed on each other, meshed independently: models for the tests of contact kinematics."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

from stickslip.contact.surface import Surface, nodal_surface
from stickslip.model.structure import Structure, nodal_dofs

YOUNG, POISSON, DENSITY = 210e9, 0.3, 7850.0


@dataclass(frozen=True, eq=False)
class Block:
    """A block, its matrices (dofs node-major), and its faces at the lowest and highest z."""

    points: np.ndarray
    mass: scipy.sparse.csr_array
    stiffness: scipy.sparse.csr_array
    facets: dict[str, np.ndarray]  # "bottom", "top": outward
    pressure: np.ndarray  # loads of a unit pressure on the top

    def nodes(self, axis, value):
        return np.flatnonzero(np.abs(self.points[:, axis] - value) < 1e-12)


def block(x, y, z, element="hex"):
    """Mesh the box with grid lines `x`, `y`, `z` by linear hexahedra or tetrahedra."""
    kind, shape = (skfem.MeshHex, skfem.ElementHex1) if element == "hex" else (skfem.MeshTet, skfem.ElementTetP1)
    mesh = kind.init_tensor(np.asarray(x), np.asarray(y), np.asarray(z))
    vector = skfem.ElementVector(shape())
    basis = skfem.Basis(mesh, vector, intorder=3)
    order = basis.nodal_dofs.T.ravel()  # their dofs, node by node
    stiffness = linear_elasticity(*lame_parameters(YOUNG, POISSON)).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, _: DENSITY * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])).assemble(basis)
    top = mesh.facets_satisfying(lambda p: np.abs(p[2] - z[-1]) < 1e-12)
    push = skfem.LinearForm(lambda v, _: -v[2]).assemble(skfem.FacetBasis(mesh, vector, facets=top, intorder=3))
    points = mesh.p.T.copy()
    facets = {}
    for name, height, sign in (("bottom", z[0], -1.0), ("top", z[-1], 1.0)):
        found = mesh.facets_satisfying(lambda p, height=height: np.abs(p[2] - height) < 1e-12)
        facets[name] = outward(points, mesh.facets[:, found].T, np.array([0.0, 0.0, sign]))
    stiffness, mass = (scipy.sparse.csr_array(m.tocsr()[order][:, order]) for m in (stiffness, mass))
    return Block(points, mass, stiffness, facets, push[order])


def outward(points, facets, direction):
    """Order the corners of facets anticlockwise about `direction`."""
    first = np.cross(direction, [1.0, 0.3, 0.0])
    axes = np.stack([first, np.cross(direction, first)])
    flat = (points[facets] - points[facets].mean(axis=1, keepdims=True)) @ axes.T
    turn = np.argsort(np.arctan2(flat[..., 1], flat[..., 0]), axis=1)
    return np.take_along_axis(facets, turn, axis=1)


def surface_of(part, name, offset, n):
    """Return a face as a surface with the nodes of that face only; dofs of the block begin at `offset`."""
    nodes = np.unique(part.facets[name])
    dofs = offset + 3 * nodes[:, None] + np.arange(3)
    return nodal_surface(part.points[nodes], dofs, n, np.searchsorted(nodes, part.facets[name]))


def stacked(lower, upper):
    """Return the surfaces (A below, B above) and the structure of both blocks, uncoupled and free."""
    n_lower, n = 3 * len(lower.points), 3 * (len(lower.points) + len(upper.points))
    a, b = surface_of(lower, "top", 0, n), surface_of(upper, "bottom", n_lower, n)
    points = np.vstack([lower.points, upper.points])
    matrices = [
        scipy.sparse.block_diag([getattr(p, which) for p in (lower, upper)], format="csr")
        for which in ("mass", "stiffness")
    ]
    empty = scipy.sparse.csr_array((n, n))
    table = nodal_dofs(points, np.arange(len(points)))
    return a, b, Structure(matrices[0], empty, matrices[1], table)


@dataclass(frozen=True, eq=False)
class Patch:
    displacement: np.ndarray  # largest difference from uniform compression over the largest displacement
    pressure: np.ndarray  # at the points of the pairing, over the applied one


def patch_test(lower, upper, pairing, per_area=4e13):
    """Press the stack by a uniform pressure through springs per area and compare with uniform compression."""
    _, _, structure = stacked(lower, upper)
    n_lower = 3 * len(lower.points)
    pressure = 1e6
    G = pairing.gap_operator
    springs = np.repeat(per_area * pairing.weights, 3)
    K = (structure.stiffness + G.T @ scipy.sparse.diags_array(springs) @ G).tocsc()
    load = np.concatenate([np.zeros(n_lower), pressure * upper.pressure])
    points = structure.dofs.position[::3]
    strain = pressure / YOUNG
    x, y, z = points.T
    exact = np.column_stack([POISSON * strain * x, POISSON * strain * y, -strain * (z - z.min())])
    exact[len(lower.points) :, 2] -= pressure / per_area
    held = np.zeros((len(points), 3), dtype=bool)
    for axis in range(3):
        held[:, axis] = np.abs(points[:, axis] - points[:, axis].min()) < 1e-12
    free = np.flatnonzero(~held.ravel())
    u = np.zeros(len(load))
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free], load[free])
    off = np.abs(u - exact.ravel()).max() / np.abs(exact).max()
    return Patch(off, -per_area * (G @ u)[2::3] / pressure)


def plane(x, y, height=0.0, up=True, kind="quad", offset=0, n=None):
    """Return a plane surface on grid lines: ``tri`` or ``quad``, linear, or ``tri6`` or ``quad8``."""
    return patch(lambda u, v: np.column_stack([u, v, np.full(u.shape, height)]), x, y, up, kind, offset, n)


def patch(shape, x, y, up=True, kind="quad", offset=0, n=None) -> Surface:
    """Return a surface ``shape(u, v)`` on the grid lines `x`, `y` of its parameters."""
    half = lambda s: np.sort(np.concatenate([s, (s[1:] + s[:-1]) / 2]))  # noqa: E731
    quadratic = kind in {"tri6", "quad8"}
    step = 2 if quadratic else 1
    gx, gy = (half(np.asarray(x)), half(np.asarray(y))) if quadratic else (x, y)
    u, v = np.meshgrid(gx, gy, indexing="ij")
    number = np.arange(u.size).reshape(u.shape)

    def node(i, j):
        rows = slice(i, u.shape[0] - step + i, step)
        return number[rows, slice(j, u.shape[1] - step + j, step)].ravel()

    corner = [(0, 0), (step, 0), (step, step), (0, step)]
    middle = [(1, 0), (2, 1), (1, 2), (0, 1)]
    loops = [corner] if kind.startswith("quad") else [corner[:3], [corner[0], *corner[2:]]]
    mids = [middle] if kind == "quad8" else [[*middle[:2], (1, 1)], [(1, 1), *middle[2:]]]
    facets = []
    for loop, mid in zip(loops, mids, strict=False):
        nodes, extra = ([node(*p) for p in part] for part in (loop, mid))
        if not up:
            nodes = nodes[::-1]
            extra = [*extra[-2::-1], extra[-1]]
        facets.append(np.column_stack([*nodes, *(extra if quadratic else [])]))
    facets = np.vstack(facets)
    used = np.unique(facets)
    points = shape(u.ravel(), v.ravel())[used]
    dofs = offset + np.arange(3 * len(used)).reshape(-1, 3)
    total = offset + 3 * len(used) if n is None else n
    return nodal_surface(points, dofs, total, np.searchsorted(used, facets))


def two_planes(grid_a, grid_b, kinds=("quad", "quad"), gap=0.0):
    """Return facing planes A (up, z = 0) and B (down, z = gap) with dofs of their own."""
    count = 3 * len(plane(*grid_a, kind=kinds[0]).points)
    n = count + 3 * len(plane(*grid_b, kind=kinds[1]).points)
    a = plane(*grid_a, kind=kinds[0], n=n)
    return a, plane(*grid_b, height=gap, up=False, kind=kinds[1], offset=count, n=n)
