"""The circles of a flange, and the spatial harmonics of the displacement along them."""

from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.turning import node_table

TOLERANCE = 1e-4  # of the flange's size: nodes nearer in radius and height lie on one circle


@dataclass(frozen=True, eq=False)
class Circles:
    """Nodes of a sector's piece of a flange, circle by circle.

    Parameters
    ----------
    sector
        The sector.
    place
        (c, 2) radius and height of each circle, m.
    owner
        (p,) circle of each node.
    dofs
        (p, 3) dofs x, y, z of each node; -1 for supported components.
    angle
        (p,) about the axis, rad.
    weight
        (p,) share of each node in its circle's arc within a sector; the shares of a circle add up to one.
    frame
        (p, 3, 3) rows: radial, circumferential and axial unit vector.
    """

    sector: CyclicSector
    place: FloatArray
    owner: IntArray
    dofs: IntArray
    angle: FloatArray
    weight: FloatArray
    frame: FloatArray

    @property
    def count(self) -> int:
        """Number of circles."""
        return len(self.place)

    @property
    def fewest(self) -> int:
        """Fewest nodes that a sector has on a circle."""
        return int(np.bincount(self.owner).min())

    def reordered(self, order: IntArray) -> "Circles":
        """Return the circles in another order: ``order[i]`` becomes the i-th."""
        new = np.argsort(order)
        return Circles(self.sector, self.place[order], new[self.owner], self.dofs, self.angle, self.weight, self.frame)


def circles(sector: CyclicSector, members: IntArray, name: str) -> Circles:
    """Return the circles on which the nodes with the dofs `members` lie; a node on the high cut face is left out for its copy on the low one.

    Raises
    ------
    InputError
        If there are no such nodes, the stage has no axis, or nodes lie on the axis; `name` is the name of the stage.
    """
    where = f"multistage: {name}"
    if sector.axis is None:
        raise input_error(where, "has no axis", "Give the sector of a model with geometry.")
    dofs = sector.structure.dofs
    members = np.setdiff1d(members, np.setdiff1d(sector.high, sector.shared))
    table = node_table(dofs.take(members))[:, :3]
    if not len(table):
        raise input_error(where, "has no free node on the flange", "Name the nodes of the flange.")
    points = dofs.position[members[table.max(axis=1)]]
    arm = sector.axis.arm(points)
    radius = np.linalg.norm(arm, axis=1)
    size = float(np.ptp(points, axis=0).max(initial=0.0)) or float(radius.max())
    if radius.min() <= TOLERANCE * size:
        raise input_error(where, "has a node of the flange on the axis", "Take it out of the set.")
    height = points @ sector.axis.unit
    step = TOLERANCE * max(size, float(radius.max()))
    place, owner = np.unique(np.round(np.column_stack([radius, height]) / step), axis=0, return_inverse=True)
    owner = owner.reshape(-1)
    radial = arm / radius[:, None]
    frame = np.stack([radial, np.cross(sector.axis.unit, radial), np.tile(sector.axis.unit, (len(points), 1))], axis=1)
    first, second = _across(sector.axis)
    angle = np.arctan2(arm @ second, arm @ first)
    own = np.where(table >= 0, members[table], -1)
    weight = np.concatenate([np.zeros(0), _weights(angle, owner, sector.pitch)])
    mean = np.array([[radius[owner == c].mean(), height[owner == c].mean()] for c in range(len(place))])
    return Circles(sector, mean, owner, own, angle, weight, frame)


def same_circles(one: Circles, other: Circles, names: tuple[str, str]) -> tuple[Circles, Circles]:
    """Return both sides with their circles in the same order.

    Raises
    ------
    InputError
        If the stages turn about different axes, or a circle of one stage has no partner on the other.
    """
    a, b = one.sector.axis, other.sector.axis
    assert a is not None
    assert b is not None
    reach = TOLERANCE * float(max(one.place[:, 0].max(), other.place[:, 0].max())) * 3
    if not np.allclose(a.unit, b.unit) or np.linalg.norm(a.arm(np.array([b.origin]))) > reach:
        raise input_error(
            "multistage", f"{names[0]!r} and {names[1]!r} turn about different axes", "Give them one axis."
        )
    off = np.linalg.norm(one.place[:, None] - other.place[None], axis=2)
    lost = np.flatnonzero(off.min(axis=1) > reach)
    if lost.size or len(one.place) != len(other.place):
        side = (one, other, names) if lost.size else (other, one, names[::-1])
        distance = np.linalg.norm(side[0].place[:, None] - side[1].place[None], axis=2).min(axis=1)
        r, z = side[0].place[int(np.argmax(distance))]
        raise input_error(
            "multistage",
            f"the flange of {side[2][0]!r} has nodes at the radius {r:.6g} m and height {z:.6g} m, that of {side[2][1]!r} has none there",
            "Nodes of both sides lie on the same circles about the axis: name such nodes, or mesh both sides alike along radius and axis.",
        )
    return one, other.reordered(np.argmin(off, axis=1))


def projection(side: Circles, harmonic: int) -> Matrix:
    """Return the (3 c, n) CSR operator from a sector's displacements to a harmonic of the radial, circumferential and axial displacement.

    For the wave that contains this harmonic it is ``(1/2π) ∮ u e^{-imφ} dφ`` by the trapezoidal rule; it is the least-squares fit where nodes are evenly
    spaced.
    """
    factor = side.weight * np.exp(-1j * harmonic * side.angle)
    values = factor[:, None, None] * side.frame
    rows = np.broadcast_to(3 * side.owner[:, None, None] + np.arange(3)[:, None], values.shape)
    columns = np.broadcast_to(side.dofs[:, None, :], values.shape)
    there = columns >= 0
    shape = (3 * side.count, side.sector.structure.n)
    return scipy.sparse.csr_array((values[there], (rows[there], columns[there])), shape=shape)


def _weights(angle: FloatArray, owner: IntArray, pitch: float) -> FloatArray:
    """Return the share of a sector's arc that each node has of its circle."""
    weight = np.zeros(angle.size)
    for circle in range(int(owner.max()) + 1):
        own = np.flatnonzero(owner == circle)
        start = np.angle(np.mean(np.exp(1j * angle[own])))  # no cut of the angle inside a sector
        along = (angle[own] - start + np.pi) % (2 * np.pi)
        order = np.argsort(along)
        sorted_ = along[order]
        ahead = np.append(sorted_[1:], sorted_[0] + pitch)
        behind = np.insert(sorted_[:-1], 0, sorted_[-1] - pitch)
        weight[own[order]] = (ahead - behind) / (2 * pitch)
    return weight


def _across(axis: Axis) -> tuple[FloatArray, FloatArray]:
    """Return two directions across the axis, from which angles count; of parallel axes the same."""
    unit = axis.unit
    first = np.eye(3)[int(np.argmin(np.abs(unit)))]
    first = first - (first @ unit) * unit
    first = first / np.linalg.norm(first)
    return first, np.cross(unit, first)
