"""Surfaces of rigid bodies for pictures: prisms from a section, and slabs from contact faces to the centre of mass."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class BodySolid:
    """Triangulated surface of a rigid body.

    Parameters
    ----------
    points
        (n, 3) in m.
    triangles
        (k, 3) points of each triangle.
    drawn_from
        Source of the shape, for captions: the section, or the contact faces only.
    """

    points: FloatArray
    triangles: IntArray
    drawn_from: Literal["section", "contact faces"]

    def moved(self, turn: FloatArray, move: FloatArray) -> "BodySolid":
        """Return the surface after ``turn @ x + move``."""
        return replace(self, points=self.points @ turn.T + move)


def prism(outline: FloatArray, low: float, high: float) -> BodySolid:
    """Return the prism along y from `low` to `high`, m, over a convex polygon (k, 2) in x and z, m."""
    k = len(outline)
    ends = [np.column_stack([outline[:, 0], np.full(k, y), outline[:, 1]]) for y in (low, high)]
    fan = np.arange(1, k - 1)
    cap = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    here = np.arange(k)
    after = (here + 1) % k
    sides = [np.column_stack([here, after, after + k]), np.column_stack([here, after + k, here + k])]
    return BodySolid(np.vstack(ends), np.vstack([cap, cap[:, ::-1] + k, *sides]), "section")


def from_faces(points: FloatArray, normals: FloatArray, centre: FloatArray) -> BodySolid | None:
    """Return the convex body between contact faces and parallel planes through the centre of mass.

    Parameters
    ----------
    points, normals
        (p, 3) contact points in m, and their unit normals out of the body.
    centre
        (3,) centre of mass in m.

    Returns
    -------
    BodySolid or None
        None if all points lie in a plane.
    """
    from scipy.spatial import ConvexHull, QhullError  # imported late: an invalid study file is refused sooner

    inward = np.einsum("pd,pd->p", centre - points, normals)
    every = np.vstack([points, points + inward[:, None] * normals])
    try:
        hull = ConvexHull(every)
    except QhullError:
        return None
    used, place = np.unique(hull.simplices, return_inverse=True)
    return BodySolid(every[used], place.reshape(hull.simplices.shape).astype(np.int64), "contact faces")
