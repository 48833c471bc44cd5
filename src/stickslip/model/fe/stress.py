"""Stress of displacement fields of a solid, at the integration points of its cells and at its nodes, and what the mesh leaves in it.

Small strain, linear elastic, global axes. The six components stand in the order xx, yy, zz, xy, yz, xz (`PAIRS`).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.fe.cell_laws import CellLaws, laws_of_group
from stickslip.model.fe.cell_matrices import cell_stiffness, inner_motion, strain_operator
from stickslip.model.fe.elements import N_INNER, CellGroup, Quadrature, Shape, chunks, gradients, shape_functions
from stickslip.model.fe.material import PAIRS
from stickslip.model.fe.prestress import elasticity, inner_start
from stickslip.model.fe.rotation import RotatingSolid
from stickslip.model.mesh.solid_mesh import CORNERS, EDGES

FIELDS = 24  # real fields at a time: bounds the memory of a chunk of cells
MOST_EXACT = Quadrature(stiffness=2)  # 4 points in a tetrahedron, 6 in a wedge, 8 in a brick or a pyramid: Barlow 1976


@dataclass(frozen=True, eq=False)
class StressPlaces:
    """Nodes at which stress is told; a node between materials stands once for each of them. `stress_places` makes one.

    Parameters
    ----------
    node
        (k,) indices into the points of the mesh, rising.
    material
        (k,) indices into `CellLaws.each`.
    """

    node: IntArray
    material: IntArray


@dataclass(frozen=True, eq=False)
class PointStress:
    """Stress at the integration points of a group of cells of one kind.

    Parameters
    ----------
    rows
        (m,) places of the cells among the cells of the mesh.
    positions
        (m, q, 3) integration points in m.
    values
        (f, m, q, 6) stress in Pa.
    """

    rows: IntArray
    positions: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class StressError:
    """Estimated error of the stress by the mesh, in the energy norm.

    Parameters
    ----------
    local
        (f, k) error in the cells of a place's material around its node, relative to the stress there.
    whole
        (f,) error in the whole solid, relative to its stress.
    """

    local: FloatArray
    whole: FloatArray


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Cells of the neighbouring sectors of a wheel around the nodes of the cyclic faces.

    Parameters
    ----------
    nodes
        (p, 2) indices of nodes of the low face and of their partners on the high face; nodes on the axis are left out.
    rotation
        (3, 3) matrix that turns the low face to the high one.
    phase
        (f,) factor of each field between a sector and the one before, each in its own axes; None: 1, as of a static field.
    """

    nodes: IntArray
    rotation: FloatArray
    phase: ComplexArray | None = None

    def at(self, phase: ComplexArray) -> "Neighbours":
        """Return the same with the factors (f,) of fields."""
        return replace(self, phase=phase)

    def part(self, fields: slice) -> "Neighbours":
        """Return the same for some of the fields."""
        return self if self.phase is None else replace(self, phase=self.phase[fields])

    def added(self, own: Matrix, pairs: IntArray) -> Matrix:
        """Return values (k, 6, f) at places with those of the neighbours added at pairs (m, 2) of places."""
        low, high = pairs.T
        phase = np.ones(1) if self.phase is None else self.phase
        onward, back = _turn(self.rotation), _turn(self.rotation.T)
        found = own.astype(np.result_type(own, phase))
        found[high] += phase * np.einsum("ij,kjf->kif", onward, own[low])
        found[low] += phase.conj() * np.einsum("ij,kjf->kif", back, own[high])
        return found


def _turn(rotation: FloatArray) -> FloatArray:
    """Return the (6, 6) matrix that turns the components of a stress."""
    found = np.empty((6, 6))
    for column, (i, j) in enumerate(PAIRS):
        unit = np.zeros((3, 3))
        unit[i, j] = unit[j, i] = 1.0
        turned = rotation @ unit @ rotation.T
        found[:, column] = [turned[a, b] for a, b in PAIRS]
    return found


def stress_places(laws: CellLaws) -> StressPlaces:
    """Return the pairs of node and material that cells have."""
    found = np.unique(np.concatenate([np.unique(keys) for keys in _keys(laws, laws.mesh.cells, laws.which)]))
    return StressPlaces(*np.divmod(found, len(laws.each)))


def nodal_stress(
    solid: RotatingSolid, displacement: Matrix, *, heated: bool = False, neighbours: Neighbours | None = None
) -> Matrix:
    """Return the stress at the nodes, extrapolated from the integration points of each cell and averaged over cells of one material.

    Within a cell the stress fits the integration points (least squares): with the shape functions of all nodes if there are as many
    points (C3D20), else linearly between corners, so that a mid-side node has the mean of its edge. All cells around a node count
    alike. CalculiX does the same, save for C3D6, where two of the six nodes have the stress of the other end.

    Parameters
    ----------
    solid
        The solid.
    displacement
        (f, nodes, 3) displacement fields in m, real or complex.
    heated
        Whether the thermal strain belongs to the fields, which are static then: it is subtracted from their strain.
    neighbours
        Of one sector of a wheel: the cells on the other side of its cyclic faces count as well; None: those of the solid alone.

    Returns
    -------
    FloatArray
        (f, k, 6) stress in Pa at `stress_places`, order xx, yy, zz, xy, yz, xz; complex if the displacement is.

    Raises
    ------
    InputError
        If the displacement has another shape, or is complex and `heated`.
    """
    blocks = [
        _averaged(solid, fields, heated, None if neighbours is None else neighbours.part(some))
        for some, fields in _real_fields(solid, displacement, heated=heated)
    ]
    return _as_given(np.concatenate(blocks, axis=2), displacement)


def integration_stress(solid: RotatingSolid, displacement: Matrix, *, heated: bool = False) -> list[PointStress]:
    """Return the stress at the integration points for the stiffness, one entry for each of the solid's `cell_groups`.

    Bricks with one integration point have one stress; hourglass control has none.

    Parameters
    ----------
    solid, displacement, heated
        As in `nodal_stress`.
    """
    blocks = [fields for _, fields in _real_fields(solid, displacement, heated=heated)]
    found = []
    for group in solid.cell_groups:
        laws, shape = laws_of_group(solid.laws, group.mesh, group.rows), group.strain
        corners = group.mesh.points[group.mesh.cells]
        positions = np.einsum("qk,mkx->mqx", shape.values[:, : shape.width], corners, optimize=True)
        parts = [
            np.concatenate([_stress(laws, shape, piece, fields, heated=heated) for piece in chunks(group.mesh, shape)])
            for fields in blocks
        ]
        found.append(PointStress(group.rows, positions, _as_given(np.concatenate(parts, axis=3), displacement)))
    return found


def stress_error(
    solid: RotatingSolid, displacement: Matrix, *, heated: bool = False, neighbours: Neighbours | None = None
) -> StressError:
    """Estimate the error of the stress from the difference of an averaged stress and that of each cell.

    ``‖e‖² = ∫ (σ* − σ)ᵀ C⁻¹ (σ* − σ) dV`` over ``‖σ‖² + ‖e‖²`` (Zienkiewicz and Zhu 1987). σ* is averaged as in `nodal_stress`; in cells
    of second order from the points where stress is most exact (2 x 2 x 2 in a brick), whatever their rule. A complex field counts
    with both parts.

    Parameters
    ----------
    solid, displacement, heated, neighbours
        As in `nodal_stress`; the error in the cells of the neighbours is not added.
    """
    places = stress_places(solid.laws)
    local, whole = [], []
    for some, fields in _real_fields(solid, displacement, heated=heated):
        beside = None if neighbours is None else neighbours.part(some)
        averaged = _averaged(solid, fields, heated, beside, exact=True)
        around, total = np.zeros((2, len(places.node), fields.shape[2])), np.zeros((2, fields.shape[2]))
        for group, laws, piece, stress in _cells(solid, fields, heated, exact=True):
            place = _places_of(solid.laws, places, group, piece)
            squares = _squares(laws, piece, averaged[place], stress, fields, heated)
            for i, own in enumerate(squares):
                total[i] += own.sum(axis=0)
                _add(around[i], place, np.repeat(own[:, None], place.shape[1], axis=1))
        local.append(around)
        whole.append(total)
    return StressError(
        _relative(np.concatenate(local, axis=2), displacement), _relative(np.concatenate(whole, axis=1), displacement)
    )


def _relative(squares: FloatArray, displacement: Matrix) -> FloatArray:
    """Return (f, ...) errors from squares of error and stress (2, ..., real fields); zero where there is neither."""
    if np.iscomplexobj(displacement):
        squares = squares.reshape(*squares.shape[:-1], -1, 2).sum(axis=-1)
    error, stress = np.moveaxis(squares, -1, 1)
    whole = error + stress
    return np.asarray(np.sqrt(np.divide(error, whole, out=np.zeros_like(whole), where=whole > 0)))


def _squares(
    laws: CellLaws, piece: slice, averaged: FloatArray, stress: FloatArray, fields: FloatArray, heated: bool
) -> tuple[FloatArray, FloatArray]:
    """Return ∫ σᵀ C⁻¹ σ (m, real fields) of averaged stress minus that of the cells, and of the latter.

    `averaged` and `stress` (m, k, 6, real fields) are at the nodes of the cells.
    """
    width = laws.mesh.cells.shape[1]
    second = width > CORNERS[width]
    shape = shape_functions(width, 4 if second else 3)
    _, volume = gradients(laws.mesh, shape, piece)
    soft = np.linalg.inv(elasticity(laws.elastic(shape, piece)))
    smooth = np.einsum("qk,mkcf->mqcf", shape.values, averaged, optimize=True)
    if second:
        own = _stress(laws, shape, piece, fields, heated=heated)
    else:
        own = np.einsum("qk,mkcf->mqcf", shape.values, stress, optimize=True)
    error, of_stress = (
        np.einsum("mqcf,mqcf,mq->mf", one, soft @ one, volume, optimize=True) for one in (smooth - own, own)
    )
    return error, of_stress


def _averaged(
    solid: RotatingSolid, fields: FloatArray, heated: bool, beside: Neighbours | None, *, exact: bool = False
) -> FloatArray:
    """Return the averaged stress (k, 6, real fields) at `stress_places`."""
    places = stress_places(solid.laws)
    total = np.zeros((len(places.node), 6, fields.shape[2]))
    counts = np.zeros(len(places.node))
    for group, _, piece, stress in _cells(solid, fields, heated, exact=exact):
        place = _places_of(solid.laws, places, group, piece)
        _add(total, place, stress)
        _add(counts, place, np.ones(place.shape))
    if beside is not None:
        pairs = _pairs(solid.laws, places, beside.nodes)
        complex_ = beside.phase is not None
        whole = beside.added(total.view(np.complex128) if complex_ else total, pairs)
        total = np.ascontiguousarray(whole).view(np.float64)
        low, high = pairs.T
        both = counts[low] + counts[high]
        counts[low] = counts[high] = both
    total /= counts[:, None, None]
    return total


def _pairs(laws: CellLaws, places: StressPlaces, nodes: IntArray) -> IntArray:
    """Return the pairs (m, 2) of places of paired nodes (p, 2) that cells of the same material have."""
    numbers = places.node * len(laws.each) + places.material
    keys = (nodes[:, None] * len(laws.each) + np.arange(len(laws.each))[None, :, None]).reshape(-1, 2)
    found = np.minimum(np.searchsorted(numbers, keys), len(numbers) - 1)
    there: BoolArray = (numbers[found] == keys).all(axis=1)
    return np.asarray(found[there])


def _cells(
    solid: RotatingSolid, fields: FloatArray, heated: bool, *, exact: bool
) -> Iterator[tuple[CellGroup, CellLaws, slice, FloatArray]]:
    """Yield group, laws, piece and stress (m, k, 6, real fields) at the nodes of the cells, not averaged.

    `exact` takes the points of `MOST_EXACT` in cells of second order.
    """
    for group in solid.cell_groups:
        laws = laws_of_group(solid.laws, group.mesh, group.rows)
        width = group.mesh.cells.shape[1]
        sampled = replace(group, rule=MOST_EXACT) if exact and width > CORNERS[width] else group
        shape, onto = sampled.strain, _extrapolation(width, sampled.rule)
        for piece in chunks(group.mesh, shape):
            stress = _stress(laws, shape, piece, fields, heated=heated)
            m, q, _, f = stress.shape
            yield group, laws, piece, (onto @ stress.reshape(m, q, 6 * f)).reshape(m, len(onto), 6, f)


def _stress(laws: CellLaws, shape: Shape, piece: slice, fields: FloatArray, *, heated: bool) -> FloatArray:
    """Return the stress (m, q, 6, real fields) of fields (nodes, 3, real fields) at the integration points of a piece of the cells."""
    slopes, volume = gradients(laws.mesh, shape, piece)
    law = laws.elastic(shape, piece)
    m, q, k, _ = slopes.shape
    cells = laws.mesh.cells[piece]
    count = fields.shape[2]
    moved = fields[cells].reshape(m, 3 * shape.width, count)
    free = laws.thermal_strain(shape, piece) if heated else None
    motion = inner_motion(shape, cell_stiffness(law, slopes, volume)) if shape.inner else None
    if motion is not None:
        inner = np.asarray(motion @ moved)
        if free is not None:
            inner += inner_start(shape, law, slopes, volume, free).reshape(m, 3 * N_INNER, 1)
        moved = np.concatenate([moved, inner], axis=1)
    operator = strain_operator(np.broadcast_to(np.eye(3), (m, q, 3, 3)), slopes)
    strain = (operator.reshape(m, 6 * q, 3 * k) @ moved).reshape(m, q, 6, count)
    if free is not None:
        strain -= np.stack([free[..., i, j] * (1 if i == j else 2) for i, j in PAIRS], axis=-1)[..., None]
    return np.asarray(elasticity(law) @ strain)


@cache
def _extrapolation(width: int, rule: Quadrature) -> FloatArray:
    """Return the (k, q) matrix from integration points to the nodes of a cell.

    With fewer points than corners the solution of least size is constant in what the points do not tell.
    """
    corners = CORNERS[width]
    if rule.hourglass is not None and rule.stiffness == 1:
        return np.ones((width, 1))
    own = shape_functions(width, rule.stiffness, rule.axial).values
    if len(own) >= width:
        return np.asarray(np.linalg.pinv(own))
    onto = np.linalg.pinv(shape_functions(corners, rule.stiffness, rule.axial).values)
    if width == corners:
        return np.asarray(onto)
    return np.vstack([onto, onto[np.array(EDGES[corners])].mean(axis=1)])


def _real_fields(solid: RotatingSolid, displacement: Matrix, *, heated: bool) -> Iterator[tuple[slice, FloatArray]]:
    """Yield the place and (nodes, 3, at most `FIELDS`) real fields of some fields; a complex one is two, one behind the other."""
    n = len(solid.mesh.points)
    if displacement.ndim != 3 or displacement.shape[1:] != (n, 3):
        raise input_error(
            "displacement",
            f"has the shape {displacement.shape}",
            f"Give (fields, {n}, 3): x, y, z of all nodes of the mesh, as RotatingSolid.at_nodes returns them.",
        )
    if heated and np.iscomplexobj(displacement):
        raise input_error(
            "displacement",
            "is complex, and thermal strain belongs to a static field",
            "Give the static field alone, real.",
        )
    each = 2 if np.iscomplexobj(displacement) else 1
    for first in range(0, max(1, len(displacement)), FIELDS // each):
        some = slice(first, first + FIELDS // each)
        block = np.moveaxis(displacement[some], 0, 2)
        kind = np.complex128 if each == 2 else np.float64
        yield some, np.ascontiguousarray(block, dtype=kind).view(np.float64)


def _as_given(values: FloatArray, displacement: Matrix) -> FloatArray:
    """Return values (..., real fields) as (f, ...), complex if the displacement is."""
    whole = values.view(np.complex128) if np.iscomplexobj(displacement) else values
    return np.ascontiguousarray(np.moveaxis(whole, -1, 0))


def _keys(laws: CellLaws, cells: IntArray, which: IntArray) -> Iterator[IntArray]:
    """Yield numbers of the pairs of node and material of each node of the cells."""
    for column in cells.T:
        own = column >= 0
        yield column[own] * len(laws.each) + which[own]


def _places_of(laws: CellLaws, places: StressPlaces, group: CellGroup, piece: slice) -> IntArray:
    """Return the place (m, k) of each node of a piece of a group's cells among `places`."""
    numbers = places.node * len(laws.each) + places.material
    own = group.mesh.cells[piece] * len(laws.each) + laws.which[group.rows[piece], None]
    return np.searchsorted(numbers, own)


def _add(total: FloatArray, place: IntArray, values: FloatArray) -> None:
    """Add values (m, k, ...) at places (m, k) to `total` (places, ...)."""
    used, local = np.unique(place.ravel(), return_inverse=True)
    starts = np.arange(len(local) + 1)
    gather = scipy.sparse.csc_array((np.ones(len(local)), local.ravel(), starts), shape=(len(used), len(local)))
    total[used] += (gather @ values.reshape(len(local), math.prod(values.shape[2:]))).reshape(
        len(used), *total.shape[1:]
    )
