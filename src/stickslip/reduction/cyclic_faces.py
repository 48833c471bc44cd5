"""Pairs of nodes on the two cut faces of a sector, found by geometry."""

import math
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import InputError, input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Dofs
from stickslip.reduction.turning import COMPONENTS, node_table

TOLERANCE = 1e-5  # distance of partners over the faces' size: coordinates in text files have six digits or more
PARTNERED_NODES_SHARE = 0.8  # fraction of nodes with partners, above which the faces match except for some nodes
LISTED = 6  # largest number of unmatched nodes in a message


@dataclass(frozen=True, eq=False)
class Face:
    """Nodes of a cut face.

    Parameters
    ----------
    name
        Name of the set.
    node
        (p,) node numbers.
    position
        (p, 3) positions in metres.
    table
        (p, 6) dofs by component; -1 for missing components.
    """

    name: str
    node: IntArray
    position: FloatArray
    table: IntArray

    def take(self, index: IntArray) -> "Face":
        """Return the face with only the nodes `index`."""
        return Face(self.name, self.node[index], self.position[index], self.table[index])


def face(dofs: Dofs, members: IntArray, name: str) -> Face:
    """Return the face made of the nodes with the dofs `members`."""
    here = dofs.take(members)
    table = node_table(here)
    if np.count_nonzero(table >= 0) != members.size:
        odd = np.setdiff1d(np.arange(members.size), table)[0]
        raise input_error(
            f"cyclic_sector: set {name!r}",
            f"holds {here.labels[odd]}, which is no component of a node",
            "Pair coordinates without geometry by hand: CyclicSector(structure, sectors, low, high, axis=None).",
        )
    first = table.max(axis=1)
    whole = np.where(table >= 0, members[table], -1)
    return Face(name, here.node[first], here.position[first], whole)


def refuse_torn_axis(dofs: Dofs, pairs: tuple[IntArray, IntArray], axis: Axis) -> None:
    """Refuse nodes on the axis that are in neither face, since each sector would have its own copy of them.

    Parameters
    ----------
    dofs
        Table of the sector's dofs.
    pairs
        Dofs of both faces.
    axis
        Axis of the wheel.

    Raises
    ------
    InputError
        If there are such nodes; the message names them.
    """
    others = np.setdiff1d(np.flatnonzero(dofs.node >= 0), np.concatenate(pairs))
    faces = dofs.position[pairs[0]]
    size = float(np.max(np.ptp(faces, axis=0), initial=0.0)) if len(faces) else 0.0
    near = np.linalg.norm(axis.arm(dofs.position[others]), axis=1) <= TOLERANCE * size
    torn = np.unique(dofs.node[others[near]])
    if torn.size:
        raise input_error(
            "cyclic_sector",
            f"{torn.size} nodes on the axis are in neither face, e.g. node {torn[0]}",
            "They belong to all sectors: put them into the set of one face or of both, or check the axis.",
        )


def pair_faces(low: Face, high: Face, sectors: int, axis: Axis, tolerance: float | None) -> tuple[IntArray, IntArray]:
    """Return the dofs of `low` and, in the same order, their partners on `high`.

    Parameters
    ----------
    low, high
        The faces; `high` is `low` turned by one pitch about `axis`.
    sectors
        Number of sectors of the wheel.
    axis
        Axis of the wheel.
    tolerance
        Largest distance of partners in metres; None: 1e-5 of the size of the faces.

    Returns
    -------
    tuple of numpy.ndarray
        (m,) dofs each. Nodes on the axis are their own partners and come last.

    Raises
    ------
    InputError
        If a node has no partner, or its partner has other components. The message lists the nodes, and detects
        swapped faces and a wrong number of sectors.
    """
    points = np.vstack([low.position, high.position])
    if not np.all(np.isfinite(points)):
        raise input_error("cyclic_sector", "nodes of the faces have no position", "Give positions.")
    size = float(np.max(np.ptp(points, axis=0), initial=0.0))
    reach = TOLERANCE * size if tolerance is None else tolerance
    # a wide tolerance for partners must not move nodes to the axis
    hub, low, high = _split(low, high, axis, TOLERANCE * size if sectors > 1 else -1.0)
    partner, ok = _match(low, high, 2 * math.pi / sectors, axis, reach)
    if not (ok.all() and len(set(partner.tolist())) == len(high.node)):
        raise _unmatched(low, high, sectors, axis, reach)
    there = high.table[partner]
    differ = np.flatnonzero(np.any((low.table >= 0) != (there >= 0), axis=1))
    if differ.size:
        raise _other_components(low, high, differ[0], partner[differ[0]])
    present = low.table >= 0
    shared = hub[hub >= 0]
    return (np.concatenate([low.table[present], shared]), np.concatenate([there[present], shared]))


def _split(low: Face, high: Face, axis: Axis, reach: float) -> tuple[IntArray, Face, Face]:
    """Return the dofs of nodes on the axis, which all sectors share, and the faces without them."""
    tables = []
    sides = []
    for side in (low, high):
        on = np.linalg.norm(axis.arm(side.position), axis=1) <= reach
        tables.append(side.table[on])
        sides.append(side.take(np.flatnonzero(~on)))
    hub = np.unique(np.vstack(tables), axis=0)
    return hub, sides[0], sides[1]


def _match(low: Face, high: Face, angle: float, axis: Axis, reach: float) -> tuple[IntArray, BoolArray]:
    """Return the node of `high` nearest to each rotated node of `low`, and whether it is near enough."""
    distance, partner = _nearest(axis.turned(low.position, angle), high.position)
    return partner, np.asarray(distance <= reach)


def _nearest(points: FloatArray, among: FloatArray) -> tuple[FloatArray, IntArray]:
    if not len(among):
        return np.full(len(points), np.inf), np.zeros(len(points), dtype=np.int64)
    if not len(points):
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    from scipy.spatial import cKDTree

    distance, index = cKDTree(among).query(points)
    return np.asarray(distance), np.asarray(index)


def _unmatched(low: Face, high: Face, sectors: int, axis: Axis, reach: float) -> InputError:
    """Return the error that names nodes without a partner, or explains why no node has one."""
    pitch = 360 / sectors
    names = f"{low.name!r} and {high.name!r}"
    shares = [_share(low, high, sign * 2 * math.pi / sectors, axis, reach) for sign in (1.0, -1.0)]
    if sectors > 2 and shares[1] > PARTNERED_NODES_SHARE and shares[1] > 2 * shares[0]:
        return input_error(
            f"cyclic_sector: {names}",
            f"are swapped: {high.name!r} lies {pitch:.6g}° behind {low.name!r} about the axis {axis.direction}",
            "Swap them, or turn the axis round.",
        )
    found = _angle_between(low, high, axis)
    partner, ok = _match(low, high, found, axis, reach)
    if ok.all() and len(set(partner.tolist())) == len(low.node) == len(high.node):
        degrees = math.degrees(found)
        fits = round(360 / abs(degrees)) if degrees else 0
        near = fits > 0 and math.isclose(360 / fits, abs(degrees), rel_tol=1e-3)
        return input_error(
            f"cyclic_sector: {names}",
            f"are {degrees:.5g}° apart, {sectors} sectors need {pitch:.5g}°",
            f"Say sectors={fits}{', and swap them' if degrees < 0 else ''}, or check the axis {axis.direction}."
            if near
            else "Check the number of sectors and the axis.",
        )
    return input_error(
        f"cyclic_sector: {names}",
        _missing(low, high, 2 * math.pi / sectors, axis, reach)
        + _missing(high, low, -2 * math.pi / sectors, axis, reach)
        + f"sectors={sectors}, axis {axis.direction} through {axis.origin}, tolerance {reach:.3g} m",
        'Mesh both faces alike or tie them in the mean, cyclic = "segment_to_segment"; clamp the nodes of both or of neither, check the axis.',
    )


def _share(low: Face, high: Face, angle: float, axis: Axis, reach: float) -> float:
    """Return the number of nodes with partners after a rotation, over the number of nodes of the smaller face."""
    _, ok = _match(low, high, angle, axis, reach)
    return float(np.count_nonzero(ok)) / max(min(len(low.node), len(high.node)), 1)


def _missing(here: Face, there: Face, angle: float, axis: Axis, reach: float) -> str:
    """List the nodes of one face whose rotated positions match no node of the other face."""
    distance, nearest = _nearest(axis.turned(here.position, angle), there.position)
    lost = np.flatnonzero(distance > reach)
    if not lost.size:
        shared = np.unique(nearest).size < nearest.size
        return f"several nodes of {here.name!r} meet one of {there.name!r}; " if shared else ""
    named = [_one_missing(here, there, i, distance[i], nearest[i]) for i in lost[:LISTED]]
    more = f", and {lost.size - LISTED} more" if lost.size > LISTED else ""
    return (
        f"{lost.size} of {len(here.node)} nodes of {here.name!r}, turned by {math.degrees(angle):.6g}°, "
        f"meet none of {there.name!r}: {', '.join(named)}{more}; "
    )


def _one_missing(here: Face, there: Face, i: int, distance: float, nearest: int) -> str:
    at = ", ".join(f"{v:.6g}" for v in here.position[i])
    if not math.isfinite(distance):
        return f"node {here.node[i]} at ({at}) m"
    return f"node {here.node[i]} at ({at}) m, nearest node {there.node[nearest]} off by {distance:.3g} m"


def _angle_between(low: Face, high: Face, axis: Axis) -> float:
    """Return the angle about the axis, in rad, from the mean position of one face to the mean position of the other."""
    if not (len(low.node) and len(high.node)):
        return 0.0
    a, b = (axis.arm(low.position.mean(axis=0)[None])[0], axis.arm(high.position.mean(axis=0)[None])[0])
    return math.atan2(float(axis.unit @ np.cross(a, b)), float(a @ b))


def _other_components(low: Face, high: Face, here: int, there: int) -> InputError:
    def has(table: IntArray) -> str:
        return " ".join(c for c, row in zip(COMPONENTS, table, strict=True) if row >= 0)

    return input_error(
        f"cyclic_sector: {low.name!r} and {high.name!r}",
        f"node {low.node[here]} has {has(low.table[here])}, its partner {high.node[there]} has "
        f"{has(high.table[there])}",
        "Constrain both faces alike, or constrain neither.",
    )
