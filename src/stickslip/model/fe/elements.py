"""Isoparametric cells: shape functions, quadrature, Jacobians, and assembly of their node blocks.

Shape functions and quadrature rules of tetrahedra and hexahedra come from scikit-fem, which is imported at first use. Wedges (6 and
15 nodes) and pyramids (5 and 13 nodes) are here, with nodes in VTK's order: a wedge has the triangle ``r, s >= 0, r + s <= 1`` and the
axis ``-1 <= t <= 1``; a pyramid has the base ``-1 <= r, s <= 1`` at ``t = 0`` and its top at ``t = 1``.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error, missing_package
from stickslip.model.mesh.solid_mesh import (
    CORNERS,
    HEX_EDGES,
    PYRAMID_EDGES,
    TET_EDGES,
    WEDGE_EDGES,
    SolidMesh,
    by_kind,
)

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


CHUNK = 200_000  # cells x quadrature points x nodes in one chunk: 20 to 100 MB
TET_PLACES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
HEX_PLACES = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)


InnerModes = Literal["", "mean", "centre"]
# each entry of ``1 − ξ²``, ``1 − η²``, ``1 − ζ²``: the incompatible modes of a brick of 8 nodes
N_INNER = 3


@dataclass(frozen=True)
class Quadrature:
    """Integration of the matrices of a cell: quadrature rules, and what some bricks of 8 nodes have beside them.

    A rule is told by the polynomial degree that it integrates exactly on a straight-edged cell. Degrees on tetrahedra: 2 has 4
    points, 4 has 11. On hexahedra degree d has a Gauss rule of ⌈(d + 1) / 2⌉ points a direction: 3 is the 2 x 2 x 2 rule, 4 and 5
    the 3 x 3 x 3 rule. On wedges the degree counts in the triangle and along the axis: 2 has 3 points in the triangle.

    Parameters
    ----------
    stiffness
        Degree for the stiffness and all other terms of strain energy.
    mass
        Degree for the mass and all other terms of inertia.
    axial
        Degree along the axis of a wedge; 0: as in its triangle.
    inner
        Incompatible modes of a brick of 8 nodes, condensed cell by cell, with their mass. ``"mean"``: their mean strain vanishes, so
        that distorted bricks pass the patch test (Taylor, Beresford and Wilson 1976); ``"centre"``: as CalculiX's C3D8I, with the
        Jacobian at the centre alone, which is the same for parallelepipeds; ``""``: none.
    hourglass
        Factor of the hourglass stiffness of a brick of 8 nodes with one integration point; None: a brick without.
    """

    stiffness: int = 4
    mass: int = 4
    axial: int = 0
    inner: InnerModes = ""
    hourglass: float | None = None

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass", "axial"):
            if not (0 if name == "axial" else 1) <= getattr(self, name) <= 12:
                raise input_error(
                    f"Quadrature.{name}",
                    f"must be a degree from 1 to 12, got {getattr(self, name)}",
                    "4 integrates straight-edged second-order cells exactly.",
                )

    @classmethod
    def calculix(cls) -> "Quadrature":
        """Return the rules of CalculiX for C3D10 cells: its 4-point rule for stiffness and mass.

        Its mass is therefore not the exactly integrated consistent mass.
        """
        return cls(stiffness=2, mass=2)


EXACT = Quadrature()
Rules = Quadrature | Sequence[Quadrature]  # one for all cells, or one for each


@dataclass(frozen=True, eq=False)
class Shape:
    """Shape functions at the q points of a quadrature rule on the reference cell.

    Parameters
    ----------
    values
        (q, k) values.
    slopes
        (q, k, 3) derivatives with respect to the reference coordinates.
    weights
        (q,) weights, whose sum is the volume of the reference cell.
    inner
        Incompatible modes, as in `Quadrature`; they stand behind the k nodes in `values` and `slopes`.
    mean
        Whether slopes in space are averaged over the cell: one integration point.
    """

    values: FloatArray
    slopes: FloatArray
    weights: FloatArray
    inner: InnerModes = ""
    mean: bool = False

    @property
    def width(self) -> int:
        """Number of nodes of the cell."""
        return int(self.slopes.shape[1]) - (N_INNER if self.inner else 0)


@dataclass(frozen=True, eq=False)
class CellGroup:
    """The cells of a mesh of one kind that have the same quadrature.

    Parameters
    ----------
    mesh
        These cells with all points of the whole mesh.
    rows
        Their places among the cells of the whole mesh.
    rule
        Their quadrature.
    """

    mesh: SolidMesh
    rows: IntArray
    rule: Quadrature

    @property
    def strain(self) -> Shape:
        """Shape functions at the points of the rule for the stiffness."""
        return self._shape(self.rule.stiffness)

    @property
    def inertia(self) -> Shape:
        """Shape functions at the points of the rule for the mass."""
        found = self._shape(self.rule.mass)
        return replace(found, mean=False) if self.rule.mass > 1 else found

    def _shape(self, degree: int) -> Shape:
        plain = shape_functions(self.mesh.cells.shape[1], degree, self.rule.axial)
        if self.rule.inner:
            return _with_inner_modes(plain, degree, self.rule.inner)
        if self.rule.hourglass is None or degree > 1:
            return plain
        eight = shape_functions(8, 3)
        return Shape(brick_centre().values, eight.slopes, eight.weights, mean=True)


def cell_groups(mesh: SolidMesh, rules: Rules) -> list[CellGroup]:
    """Return the groups of cells of a mesh; one group is the mesh itself.

    Raises
    ------
    InputError
        If there is not one rule for each cell, or a rule for bricks of 8 nodes is given to other cells.
    """
    each = [rules] if isinstance(rules, Quadrature) else list(dict.fromkeys(rules))
    which = np.zeros(len(mesh.cells), dtype=np.int64)
    if not isinstance(rules, Quadrature):
        if len(rules) != len(mesh.cells):
            raise input_error(
                "quadrature",
                f"is a list of {len(rules)} for {len(mesh.cells)} cells",
                "Give one, or one for each cell.",
            )
        place = {rule: i for i, rule in enumerate(each)}
        which = np.array([place[rule] for rule in rules], dtype=np.int64)
    found = []
    for width, rows in by_kind(mesh.cells):
        for i in np.unique(which[rows]):
            own = rows[which[rows] == i]
            if width != 8 and (each[i].inner or each[i].hourglass is not None):
                raise input_error(
                    "quadrature",
                    f"gives incompatible modes or hourglass control to cells of {width} nodes",
                    "Bricks of 8 nodes alone have them: give each cell its own Quadrature.",
                )
            whole = len(own) == len(mesh.cells)
            part = (
                mesh
                if whole
                else SolidMesh(mesh.points, mesh.cells[own, :width], {}, mesh.numbers, mesh.cell_numbers[own])
            )
            found.append(CellGroup(part, own, each[i]))
    return found


def _with_inner_modes(plain: Shape, degree: int, inner: InnerModes) -> Shape:
    """Add ``1 − ξ²``, ``1 − η²`` and ``1 − ζ²`` on the cube from −1 to 1 to the shape functions of a brick."""
    places, _ = library().quadrature.get_quadrature(library_element(8)[0], degree)
    cube = 2 * places.T - 1  # scikit-fem's reference cube is [0, 1]³
    slopes = -4 * cube[:, :, None] * np.eye(3)
    values = np.hstack([plain.values, 1 - cube**2])
    return Shape(values, np.concatenate([plain.slopes, slopes], axis=1), plain.weights, inner)


def reference_places(width: int) -> FloatArray:
    """Return the (k, 3) reference coordinates of the nodes of a tetrahedron or hexahedron with `width` nodes in VTK order."""
    places, edges = (TET_PLACES, TET_EDGES) if width in (4, 10) else (HEX_PLACES, HEX_EDGES)
    if width == len(places):
        return places
    return np.vstack([places, places[np.array(edges)].mean(axis=1)])


def library() -> Any:
    """Return the module scikit-fem; if it is missing, a `StickslipError` says how to install it."""
    try:
        import skfem
    except ModuleNotFoundError as error:
        raise missing_package("scikit-fem", error, "fe") from error
    return skfem


def library_element(width: int) -> tuple[Any, IntArray]:
    """Return scikit-fem's element with `width` nodes, and the (k,) VTK node at each of its nodes."""
    skfem = library()
    element = {4: skfem.ElementTetP1, 10: skfem.ElementTetP2, 8: skfem.ElementHex1, 20: skfem.ElementHexS2}[width]()
    distance = np.abs(element.doflocs[:, None] - reference_places(width)).sum(axis=2)
    return element, np.asarray(distance.argmin(axis=1), dtype=np.int64)


def shape_functions(width: int, degree: int, axial: int = 0) -> Shape:
    """Return the shape functions of cells with `width` nodes (VTK order) at the points of the rule of `degree`.

    `axial` is the degree along the axis of a wedge; 0: `degree`.
    """
    if width in OWN_SHAPES:
        points, own = own_rule(width, degree, axial or degree)
        return Shape(*own_shape_functions(width, points), own)
    places, weights = library().quadrature.get_quadrature(library_element(width)[0], degree)
    return _at(width, places, weights)


def brick_centre() -> Shape:
    """Return the shape functions of a brick of 8 nodes at its centre; scikit-fem has no rule of one point on bricks."""
    return _at(8, np.full((3, 1), 0.5), np.ones(1))


def _at(width: int, places: FloatArray, weights: FloatArray) -> Shape:
    element, order = library_element(width)
    values = np.empty((len(weights), width))
    slopes = np.empty((len(weights), width, 3))
    for theirs, ours in enumerate(order):
        phi, gradient = element.lbasis(places, theirs)
        values[:, ours], slopes[:, ours] = phi, np.broadcast_to(gradient, places.shape).T
    return Shape(values, slopes, np.asarray(weights))


def chunks(mesh: SolidMesh, shape: Shape) -> Iterator[slice]:
    """Yield slices of the cells, each of at most `CHUNK` values."""
    step = max(1, CHUNK * 3 // shape.slopes.size)
    for start in range(0, len(mesh.cells), step):
        yield slice(start, min(start + step, len(mesh.cells)))


def gradients(mesh: SolidMesh, shape: Shape, piece: slice) -> tuple[FloatArray, FloatArray]:
    """Return gradients (m, q, k, 3) of the shape functions in space, and weights (m, q) in m³."""
    jacobian = _jacobians(mesh, shape, piece)
    slopes = np.matmul(shape.slopes, np.linalg.inv(jacobian))
    scale = np.linalg.det(jacobian)
    volume = scale * shape.weights
    if shape.inner:
        centre = mesh.points[mesh.cells[piece]].transpose(0, 2, 1) @ brick_centre().slopes[0]
        inner = np.matmul(shape.slopes[:, shape.width :], np.linalg.inv(centre)[:, None])
        if shape.inner == "mean":
            inner = inner * (np.linalg.det(centre)[:, None] / scale)[..., None, None]
        slopes[:, :, shape.width :] = inner
    if shape.mean:
        whole = volume.sum(axis=1, keepdims=True)
        return np.einsum("mqka,mq->mka", slopes, volume / whole)[:, None], whole
    return slopes, volume


def _jacobians(mesh: SolidMesh, shape: Shape, piece: slice) -> FloatArray:
    """Return (m, q, 3, 3) derivatives of positions (third axis) with respect to reference coordinates (last axis)."""
    corners = mesh.points[mesh.cells[piece]]
    return np.asarray(np.einsum("qkr,mkx->mqxr", shape.slopes[:, : shape.width], corners, optimize=True))


def check_jacobians(mesh: SolidMesh, shape: Shape) -> None:
    """Refuse cells that are inside out or flat at a quadrature point; the message names them."""
    bad: list[int] = []
    for piece in chunks(mesh, shape):
        jacobian = _jacobians(mesh, shape, piece)
        # relative to a cube with the cell's edges: small cells are then not mistaken for flat ones
        size = np.linalg.norm(jacobian, axis=(2, 3)) ** 3
        flat = np.linalg.det(jacobian) <= 1e-12 * size
        bad.extend(piece.start + np.flatnonzero(flat.any(axis=1)))
    if not bad:
        return
    named = []
    for cell in bad[:5]:
        x, y, z = mesh.points[mesh.cells[cell]].mean(axis=0)
        nodes = ", ".join(str(mesh.numbers[node]) for node in mesh.cells[cell][:4])
        named.append(f"cell {mesh.cell_numbers[cell]} (nodes {nodes}, ...) near ({x:.6g}, {y:.6g}, {z:.6g}) m")
    more = f" and {len(bad) - 5} more" if len(bad) > 5 else ""
    raise input_error(
        "mesh",
        f"{len(bad)} of {len(mesh.cells)} cells have a zero or negative Jacobian: " + "; ".join(named) + more,
        "Check the node order (VTK's) if all of them do; else move mid-side nodes to the middle of their edges "
        "(gmsh: Mesh.SecondOrderLinear = 1) or mesh finer where the surface is curved.",
    )


class NodeBlocks:
    """Assembly of blocks for node pairs of cells into sparse matrices over the kept nodes.

    Parameters
    ----------
    mesh
        Mesh whose cells define the pairs.
    kept
        (n,) True for nodes whose rows and columns are assembled.
    """

    def __init__(self, mesh: SolidMesh, kept: BoolArray) -> None:
        self.n = int(kept.sum())
        new = np.where(kept, np.cumsum(kept) - 1, -1)[mesh.cells]
        rows, columns = new[:, :, None], new[:, None, :]
        outside = self.n**2  # common index of all dropped entries
        pair = np.where((rows < 0) | (columns < 0), outside, rows * self.n + columns)
        pairs, place = np.unique(pair.ravel(), return_inverse=True)
        self._place = place.astype(np.int32).reshape(len(mesh.cells), -1)
        self._size = int(np.searchsorted(pairs, outside))
        self._columns = (pairs[: self._size] % self.n).astype(np.int32)
        counts = np.bincount(pairs[: self._size] // self.n, minlength=self.n)
        self._starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)

    def zeros(self, entries: int) -> FloatArray:
        """Return a zero array for `entries` numbers of each pair."""
        return np.zeros((self._size + 1, entries))

    def add(self, store: FloatArray, piece: slice, values: FloatArray) -> None:
        """Add the values (m, k, k, entries) of a slice of the cells to `store`."""
        place = self._place[piece].ravel()
        starts = np.arange(len(place) + 1, dtype=np.int32)
        gather = scipy.sparse.csc_array((np.ones(len(place)), place, starts), shape=(len(store), len(place)))
        store += gather @ values.reshape(len(place), -1)

    def matrix(self, store: FloatArray) -> Matrix:
        """Return the (3n, 3n) CSR matrix of 3 x 3 blocks in `store`; a single entry becomes the diagonal of its block."""
        numbers = store[: self._size]
        blocks = numbers[:, :, None] * np.eye(3) if store.shape[1] == 1 else numbers
        blocks = blocks.reshape(-1, 3, 3)
        shape = (3 * self.n, 3 * self.n)
        return scipy.sparse.bsr_array((blocks, self._columns, self._starts), shape=shape).tocsr()
