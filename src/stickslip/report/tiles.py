"""Patches of contact surfaces: the part of a surface nearest to each contact point."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.spatial import ConvexHull, KDTree, QhullError

from stickslip.arrays import FloatArray, IntArray

_CORNERS = 12  # corners of an uncut patch
_NEAREST = 12  # neighbours that may cut a patch
_REACH = 1.5  # radius of an uncut patch over the radius of a circle of its area; corners of a square reach 1.25
_WITHIN = 6.0  # the same within the rim of a flat face, whose nodes share its area unevenly
_FLAT = 0.95  # least cosine between the normals of a flat face
_CORNERS_OF_LINE = 2
_BEHIND = 0.2  # cosine between normals, below which a neighbour belongs to another face


def patches(position: FloatArray, frame: FloatArray, area: FloatArray, members: Sequence[int]) -> dict[int, FloatArray]:
    """Return corners (k, 3) of the patch of each contact point with a position and an area, for the points of one contact.

    Parameters
    ----------
    position
        (p, 3) positions.
    frame
        (p, 3, 3) columns t, w, n.
    area
        (p,) areas in the squared unit of the positions; NaN if unknown.
    members
        Indices of the contact's points.
    """
    known = np.isfinite(area) & (area > 0) & np.isfinite(position).all(axis=1) & np.isfinite(frame).all(axis=(1, 2))
    own = np.array([k for k in members if known[k]], dtype=np.int64)
    if not own.size:
        return {}
    count = min(_NEAREST + 1, own.size)
    beside = KDTree(position[own]).query(position[own], k=count)[1].reshape(own.size, count)
    angle = 2 * np.pi * (np.arange(_CORNERS) + 0.5) / _CORNERS
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    edges = _edges(position[own], frame[own])
    found = {}
    for k, near in zip(own, own[beside], strict=True):
        alike = np.abs(frame[near, :, 2] @ frame[k, :, 2]) > _BEHIND
        plane = (position[near[alike]] - position[k]) @ frame[k, :, :2]
        nearer = [(other, 0.5 * float(other @ other)) for other in plane if np.any(other)]
        inside = [(a @ frame[k, :, :2], -b - float(a @ position[k])) for a, b in edges]
        corners = _cut((_WITHIN if edges else _REACH) * np.sqrt(area[k] / np.pi) * circle, nearer + inside)
        if len(corners):
            found[int(k)] = position[k] + corners @ frame[k, :, :2].T
    return found


def _edges(position: FloatArray, frame: FloatArray) -> list[tuple[FloatArray, float]]:
    """Return the half-spaces ``a x + b <= 0`` of a flat face from the hull of its points; none for a curved face or a line."""
    if len(position) <= _CORNERS_OF_LINE or np.abs(frame[:, :, 2] @ frame[0, :, 2]).min() < _FLAT:
        return []
    plane = frame[0, :, :2]
    try:
        hull = ConvexHull(position @ plane)
    except QhullError:
        return []
    return [(plane @ own[:2], float(own[2])) for own in hull.equations]


def _cut(corners: FloatArray, bounds: Sequence[tuple[FloatArray, float]]) -> FloatArray:
    """Clip a convex patch by bounds ``a x <= b``."""
    for a, b in bounds:
        beyond = corners @ a - b
        if not np.any(beyond > 0):
            continue
        left = []
        for i, (here, there) in enumerate(zip(beyond, np.roll(beyond, -1), strict=True)):
            if here <= 0:
                left.append(corners[i])
            if here * there < 0:
                step = corners[(i + 1) % len(corners)] - corners[i]
                left.append(corners[i] + here / (here - there) * step)
        corners = np.array(left).reshape(-1, 2)
    return corners if len(corners) >= _CORNERS_OF_LINE + 1 else corners[:0]


def triangulated(each: Iterable[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Return the corners of all patches and the triangles that fill them."""
    points: list[FloatArray] = [np.zeros((0, 3))]
    triangles, first = [np.zeros((0, 3), dtype=np.int64)], 0
    for corners in each:
        fan = np.arange(1, len(corners) - 1)
        triangles.append(first + np.column_stack([np.zeros_like(fan), fan, fan + 1]))
        points.append(corners)
        first += len(corners)
    return np.vstack(points), np.vstack(triangles)


def outlines(each: Iterable[FloatArray]) -> FloatArray:
    """Return the closed outlines of all patches as one path, separated by NaN."""
    rims = [np.vstack([own, own[:1], np.full((1, own.shape[1]), np.nan)]) for own in each]
    return np.vstack(rims) if rims else np.zeros((0, 3))
