"""Shape functions and quadrature of wedges (6 and 15 nodes) and pyramids (5 and 13 nodes).

Nodes are in VTK's order. A wedge has the triangle ``r, s >= 0, r + s <= 1`` and the axis ``-1 <= t <= 1``. A pyramid has the base
``-1 <= r, s <= 1`` at ``t = 0`` and its top at ``t = 1``.
"""

from functools import cache

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray
from stickslip.model.mesh.solid_mesh import CORNERS, PYRAMID_EDGES, WEDGE_EDGES

WEDGE_PLACES = np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, 1], [1, 0, 1], [0, 1, 1]], dtype=float)
PYRAMID_PLACES = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1]], dtype=float)
TRIANGLE = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


def _with_middles(places: FloatArray, edges: tuple[tuple[int, int], ...]) -> FloatArray:
    return np.vstack([places, places[np.array(edges)].mean(axis=1)])


OWN_SHAPES = {
    6: WEDGE_PLACES,
    15: _with_middles(WEDGE_PLACES, WEDGE_EDGES),
    5: PYRAMID_PLACES,
    13: _with_middles(PYRAMID_PLACES, PYRAMID_EDGES),
}
# Exponents of r, s, t and 1 / (1 - t) of the functions that span the shape functions. A pyramid's are rational: with a square
# base they fit the bilinear or serendipity functions of the neighbour there, and hold all linear or quadratic polynomials
# (Bedrosian 1992).
POWERS = {
    6: np.array([(i, j, k, 0) for k in (0, 1) for i, j in TRIANGLE[:3]]),
    15: np.array([(i, j, k, 0) for k in (0, 1) for i, j in TRIANGLE] + [(i, j, 2, 0) for i, j in TRIANGLE[:3]]),
    5: np.array([(0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 1, 0, 1)]),
    13: np.array(
        [(i, j, k, 0) for k in range(3) for i, j in TRIANGLE if i + j + k <= 2]
        + [(1, 1, 0, 1), (2, 1, 0, 1), (1, 2, 0, 1)]
    ),
}


def own_shape_functions(width: int, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return values (q, k) and slopes (q, k, 3) of the k = `width` shape functions at reference points (q, 3).

    Slopes of a pyramid do not exist at its top.
    """
    coefficients = _coefficients(width)
    powers = POWERS[width]
    values = _terms(points, powers) @ coefficients
    slopes = np.empty((len(points), width, 3))
    for axis in range(3):
        lower = powers.copy()
        lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
        terms = powers[:, axis] * _terms(points, lower)
        if axis == 2:  # the derivative of 1 / (1 - t)^l
            terms += powers[:, 3] * _terms(points, powers + np.array([0, 0, 0, 1]))
        slopes[:, :, axis] = terms @ coefficients
    return values, slopes


@cache
def _coefficients(width: int) -> FloatArray:
    """Return the (k, k) coefficients of the terms (rows) in the shape functions (columns)."""
    return np.asarray(np.linalg.inv(_terms(OWN_SHAPES[width], POWERS[width])))


def _terms(points: FloatArray, powers: IntArray) -> FloatArray:
    below = 1.0 - points[:, 2:]
    top = below == 0.0  # where r = s = 0: rational terms vanish
    rational = np.where(top, powers[:, 3] == 0, 1.0 / np.where(top, 1.0, below) ** powers[:, 3])
    return np.asarray(np.prod(points[:, None] ** powers[:, :3], axis=2) * rational)


def own_rule(width: int, degree: int, axial: int) -> tuple[FloatArray, FloatArray]:
    """Return points (q, 3) and weights (q,) of a rule on the wedge or the pyramid.

    On a wedge `degree` is exact in the triangle and `axial` along the axis. On a pyramid the cube's Gauss points are collapsed
    towards the top, exact to `degree`.
    """
    if CORNERS[width] == 6:
        flat, area = _triangle_rule(degree)
        t, length = np.polynomial.legendre.leggauss(axial // 2 + 1)
        points = np.hstack([np.repeat(flat, len(t), axis=0), np.tile(t, len(flat))[:, None]])
        return points, np.outer(area, length).ravel()
    n = degree // 2 + 1
    x, w = np.polynomial.legendre.leggauss(n)
    down, v = scipy.special.roots_jacobi(n, 0, 2)  # weight (1 + z)², z = 1 - 2 t
    below = (1 + down) / 2
    a, b, c = (grid.ravel() for grid in np.meshgrid(x, x, below, indexing="ij"))
    weights = (w[:, None, None] * w[:, None] * v / 8).ravel()
    return np.column_stack([a * c, b * c, 1 - c]), weights


def _triangle_rule(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return points (q, 2) and weights (q,) on the triangle: 1 or 3 points, above degree 2 a collapsed square."""
    if degree == 1:
        return np.full((1, 2), 1 / 3), np.array([0.5])
    if degree == 2:
        return np.array([[1, 1], [4, 1], [1, 4]]) / 6, np.full(3, 1 / 6)
    n = degree // 2 + 1
    x, w = np.polynomial.legendre.leggauss(n)
    down, v = scipy.special.roots_jacobi(n, 0, 1)
    below = (1 + down) / 2
    a, c = (grid.ravel() for grid in np.meshgrid((1 + x) / 2, below, indexing="ij"))
    return np.column_stack([a * c, 1 - c]), np.outer(w / 2, v / 4).ravel()
