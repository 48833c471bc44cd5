"""Small wheels for the tests: rings of masses, random sectors with nodes on faces and axis, wedges of a ring."""

from itertools import permutations

import numpy as np
import scipy.sparse
import scipy.spatial

from stickslip.model.axis import Axis
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.structure import Dofs, Structure, nodal_dofs
from stickslip.reduction.cyclic import CyclicSector

Z = Axis()


def mass_ring(sectors, *, mass=1.0, stiffness=1.0, coupling=0.3, damping=0.0):
    """A ring of grounded masses, each joined to the next one by a spring; the copy of the neighbour has no mass."""
    M = np.diag([mass, 0.0])
    K = np.array([[stiffness + coupling, -coupling], [-coupling, coupling]])
    dofs = Dofs(np.arange(2), ("x", "x"), np.zeros((2, 3)))
    structure = Structure(M, damping * K, K, dofs, {"mass": np.array([0])})
    return CyclicSector(structure, sectors, np.array([0]), np.array([1]), axis=None)


def random_sector(sectors, seed=0, *, faces=2, inner=2, hub=0, axis=Z, free=False, sparse=True):
    """A sector with random matrices: `faces` nodes on each face, `inner` between, `hub` on the axis.

    Any symmetric matrices make a wheel, since its sectors are copies turned about the axis. Node numbers are shuffled.
    """
    rng = np.random.default_rng(seed)
    pitch = 2 * np.pi / sectors
    first = Axis().turned(np.column_stack([1 + rng.random(faces), np.zeros(faces), rng.random(faces)]), -pitch / 2)
    middle = np.column_stack([1 + rng.random(inner), np.zeros(inner), 2 + rng.random(inner)])
    centre = np.column_stack([np.zeros((hub, 2)), 3 + rng.random(hub)])
    points = np.vstack([first, Axis().turned(first, pitch), middle, centre])
    points = points @ turned_frame(axis).T + np.array(axis.origin)
    n_nodes = len(points)
    order = rng.permutation(n_nodes)
    place = np.argsort(order)  # of the original node in the shuffled table
    n = 3 * n_nodes
    root = rng.standard_normal((n, n if not free else n - 5))
    stiffness = root @ root.T / n
    mass = np.diag(0.5 + rng.random(n))
    mass[:6, :6] += 0.2
    skew = rng.standard_normal((n, n))
    damping = 0.01 * stiffness + 0.01 * (skew - skew.T)
    wrap = scipy.sparse.csr_array if sparse else np.asarray

    def members(nodes):
        return (3 * place[nodes][:, None] + np.arange(3)).ravel()

    shared = np.arange(2 * faces + inner, n_nodes)
    sets = {
        "cyclic_low": members(np.concatenate([np.arange(faces), shared])),
        "cyclic_high": members(np.concatenate([shared, np.arange(faces, 2 * faces)[::-1]])),
        "inner": members(np.arange(2 * faces, 2 * faces + inner)),
    }
    dofs = nodal_dofs(points[order], 10 + np.arange(n_nodes))
    return Structure(wrap(mass), wrap(damping), wrap(stiffness), dofs, sets)


def turned_frame(axis):
    """A rotation that leads z to the axis."""
    z = axis.unit
    x = np.cross(z, [0.3, 0.5, 0.8])
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def wedge(sectors, *, cells=(2, 2, 1), inner=0.5, outer=1.0, height=0.1, start=None, clamp=True):
    """One sector of a ring as quadratic tetrahedra (six to a brick, so that both faces are meshed alike).

    `root` holds the bore when it is clamped; `start` is the angle of the low face.
    """
    n_r, n_t, n_z = (2 * c + 1 for c in cells)
    pitch = 2 * np.pi / sectors
    start = -pitch / 2 if start is None else start
    i, j, k = np.meshgrid(np.arange(n_r), np.arange(n_t), np.arange(n_z), indexing="ij")
    radius = inner + (outer - inner) * i / (n_r - 1)
    angle = start + pitch * j / (n_t - 1)
    height_at = height * k / (n_z - 1)
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height_at], axis=-1)
    number = np.arange(n_r * n_t * n_z).reshape(n_r, n_t, n_z)
    tets = []
    for corner in np.ndindex(*cells):
        for path in permutations(range(3)):
            at = [2 * np.array(corner)]
            for axis in path:
                at.append(at[-1] + 2 * np.eye(3, dtype=int)[axis])
            if np.linalg.det(np.eye(3)[list(path)]) < 0:
                at[1], at[2] = at[2], at[1]
            a, b, c, d = at
            mids = [(p + q) // 2 for p, q in ((a, b), (b, c), (a, c), (a, d), (b, d), (c, d))]
            tets.append([number[tuple(p)] for p in (a, b, c, d, *mids)])
    sets = {
        "cyclic_low": number[:, 0].ravel(),
        "cyclic_high": number[:, -1].ravel(),
        "tip": number[-1, n_t // 2, :].ravel(),
    }
    if clamp:
        sets["root"] = number[0].ravel()
        sets["cyclic_low"], sets["cyclic_high"] = number[1:, 0].ravel(), number[1:, -1].ravel()
    return SolidMesh(points.reshape(-1, 3), np.array(tets), sets)


def unlike_wedge(sectors, low, high, *, inner=0.5, outer=1.0, height=0.2, seed=0, clamp=False, around=2):
    """One sector of a ring as quadratic tetrahedra, its cut faces meshed with `low` and `high` cells along radius and axis."""
    rng = np.random.default_rng(seed)
    layers = []
    for along in np.linspace(0, 1, around + 1):
        cells = np.ceil((1 - along) * np.array(low) + along * np.array(high)).astype(int)
        grids = np.meshgrid(*(np.linspace(0, 1, n + 1) for n in cells), indexing="ij")
        r, z = (grid.ravel() for grid in grids)
        for values, n in zip((r, z), cells, strict=True):
            inside = (values > 0) & (values < 1)
            values[inside] += 0.25 / n * rng.uniform(-1, 1, np.count_nonzero(inside))
        layers.append(np.column_stack([r, np.full(r.size, along), z]))
    at = np.vstack(layers)
    tets = scipy.spatial.Delaunay(at * [outer - inner, 1.0, height]).simplices
    volume = np.linalg.det(at[tets[:, 1:]] - at[tets[:, :1]])
    tets[volume < 0] = tets[volume < 0][:, [1, 0, 2, 3]]
    tets = tets[np.abs(volume) > 1e-6]  # the others lie flat in a face
    edges = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
    ends, which = np.unique(np.sort(tets[:, edges].reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    cells = np.hstack([tets, len(at) + which.reshape(-1, 6)])
    at = np.vstack([at, at[ends].mean(axis=1)])
    radius = inner + (outer - inner) * at[:, 0]
    angle = 2 * np.pi / sectors * (at[:, 1] - 0.5)
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height * at[:, 2]])

    def where(column, value):
        return np.flatnonzero(np.abs(at[:, column] - value) < 1e-12)

    sets = {"cyclic_low": where(1, 0), "cyclic_high": where(1, 1), "rim": where(0, 1)}
    if clamp:
        root = where(0, 0)
        sets = {name: np.setdiff1d(nodes, root) for name, nodes in sets.items()} | {"root": root}
    return SolidMesh(points, cells, sets)
