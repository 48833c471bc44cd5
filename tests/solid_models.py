"""Boxes of every kind of cell, their matrices by plain loops, and exact rigid motions."""

import itertools
import math

import numpy as np

from stickslip.model.mesh.solid_mesh import SolidMesh

# a 2 x 2 x 2 cell of a fine grid: VTK's places of the nodes, written out (0, 1, 2 = low, middle, high)
HEX20 = [
    *[(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
    *[(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
    *[(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
]
# six tetrahedra that fill the cell, by its corners
TETS = [
    [(0, 0, 0), *path, (2, 2, 2)]
    for path in [
        [(2, 0, 0), (2, 2, 0)],
        [(2, 2, 0), (0, 2, 0)],
        [(0, 2, 0), (0, 2, 2)],
        [(0, 2, 2), (0, 0, 2)],
        [(0, 0, 2), (2, 0, 2)],
        [(2, 0, 2), (2, 0, 0)],
    ]
]
TET_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
KINDS = [4, 10, 8, 20]


def places(width):
    """Steps of the nodes of each cell that fills one 2 x 2 x 2 piece of the grid: (cells, width, 3)."""
    if width in (8, 20):
        return np.array([HEX20[:width]])
    corners = np.array(TETS)
    if width == 4:
        return corners
    middles = [(corners[:, a] + corners[:, b]) // 2 for a, b in TET_EDGES]
    return np.concatenate([corners, np.stack(middles, axis=1)], axis=1)


def box(width, size, divisions, bend=0.0):
    """Mesh a box with a corner at the origin; `bend` is the size of a smooth distortion, in metres.

    Node sets: ``root`` at x = 0, ``tip`` at the far end.
    """
    steps = 2 * np.array(divisions) + 1
    starts = 2 * np.array(list(itertools.product(*(range(d) for d in divisions))))
    cells = (starts[:, None, None] + places(width)).reshape(-1, width, 3)
    used, cells = np.unique(np.ravel_multi_index(tuple(cells.transpose(2, 0, 1)), tuple(steps)), return_inverse=True)
    grid = np.stack(np.unravel_index(used, tuple(steps)), axis=1)
    points = grid * np.array(size) / (steps - 1)
    wave = np.sin(2 * points[:, [1, 2, 0]] / np.max(size)) + np.cos(3 * points[:, [2, 0, 1]] / np.max(size))
    sets = {"root": np.flatnonzero(grid[:, 0] == 0), "tip": np.flatnonzero(grid[:, 0] == steps[0] - 1)}
    return SolidMesh(points + bend * wave, cells.reshape(-1, width), sets)


def without_sets(mesh):
    return SolidMesh(mesh.points, mesh.cells, {})


def rigid_motions(points):
    """(3n, 6): three shifts and three turns about the origin."""
    shifts = np.tile(np.eye(3), (len(points), 1))
    turns = np.stack([np.cross(axis, points).ravel() for axis in np.eye(3)], axis=1)
    return np.hstack([shifts, turns])


# ---- the same integrals by plain loops: polynomials through the nodes, Gauss points of our own -------------------------


def exponents(width):
    """Monomials that span the shape functions: P1, P2, trilinear, serendipity (superlinear degree 2)."""
    powers = list(itertools.product(range(3), repeat=3))
    keep = {
        4: lambda p: sum(p) <= 1,
        10: lambda p: sum(p) <= 2,
        8: lambda p: max(p) <= 1,
        20: lambda p: sum(e for e in p if e > 1) <= 2 and p.count(2) <= 1,
    }[width]
    return np.array([p for p in powers if keep(p)])


def monomials(x, powers):
    """Values and (…, 3) slopes of monomials at a point x."""
    value = np.prod(x**powers, axis=1)
    slopes = np.empty((len(powers), 3))
    for axis in range(3):
        lower = powers.copy()
        lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
        slopes[:, axis] = powers[:, axis] * np.prod(x**lower, axis=1)
    return value, slopes


def gauss(width):
    """Three Gauss points a direction on the unit cube; collapsed on the tetrahedron, where four make second order exact."""
    n = 4 if width == 10 else 3
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    for i, j, k in itertools.product(range(n), repeat=3):
        a, b, c = x[i], x[j], x[k]
        weight = w[i] * w[j] * w[k]
        if width in (8, 20):
            yield np.array([a, b, c]), weight
        else:  # Duffy's map of the cube on the tetrahedron
            yield (np.array([a, b * (1 - a), c * (1 - a) * (1 - b)]), weight * (1 - a) ** 2 * (1 - b))


def reference(width):
    """Places of the nodes on the unit cube or the unit tetrahedron, VTK order."""
    if width in (8, 20):
        return np.array(HEX20[:width]) / 2
    corners = np.vstack([np.zeros(3), np.eye(3)])
    middles = [(corners[a] + corners[b]) / 2 for a, b in TET_EDGES]
    return np.vstack([corners, middles])[:width]


def plain_matrices(mesh, material):
    """Mass and stiffness (3n, 3n) by loops over cells and Gauss points, dense."""
    width = mesh.cells.shape[1]
    powers = exponents(width)
    assert len(powers) == width
    coefficients = np.linalg.inv(np.array([monomials(x, powers)[0] for x in reference(width)]))
    first, second = material.lame
    law = np.diag([2 * second] * 3 + [second] * 3)
    law[:3, :3] += first
    n = 3 * len(mesh.points)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    for cell in mesh.cells:
        rows = (3 * cell[:, None] + np.arange(3)).ravel()
        for x, weight in gauss(width):
            value, slopes = monomials(x, powers)
            N, dN = value @ coefficients, coefficients.T @ slopes
            jacobian = dN.T @ mesh.points[cell]
            g = dN @ np.linalg.inv(jacobian).T
            dV = weight * np.linalg.det(jacobian)
            B = np.zeros((6, 3 * width))
            for i in range(width):
                gx, gy, gz = g[i]
                B[:, 3 * i : 3 * i + 3] = [
                    *[(gx, 0, 0), (0, gy, 0), (0, 0, gz)],
                    *[(gy, gx, 0), (0, gz, gy), (gz, 0, gx)],
                ]
            K[np.ix_(rows, rows)] += dV * B.T @ law @ B
            M[np.ix_(rows, rows)] += dV * material.density * np.kron(np.outer(N, N), np.eye(3))
    return M, K


def beam_root(n):
    """The n-th root of cos x cosh x = −1, from 1: a cantilever's wave number times its length."""
    x = (n - 0.5) * math.pi
    for _ in range(50):
        f = math.cos(x) + 1 / math.cosh(x)
        x -= f / (-math.sin(x) - math.tanh(x) / math.cosh(x))
    return x
