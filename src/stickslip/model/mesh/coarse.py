"""Coarse skins for pictures, made of points of the fine skin."""

import numpy as np

from stickslip.arrays import FloatArray, IntArray

_GROWTH = 1.12  # growth of the cell size from one trial to the next


def coarse_skin(points: FloatArray, triangles: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Merge points that lie in the same cell of a grid, with the smallest cell that leaves at most `most` of them.

    Parameters
    ----------
    points
        (n, 3) positions.
    triangles
        (k, 3) points of each triangle; points without a triangle are dropped.
    most
        Number of points that may remain.

    Returns
    -------
    kept
        (m,) points of the fine skin that remain, one of each cell, the nearest to its centroid.
    triangles
        (j, 3) points of each triangle, as indices into `kept`; triangles that have shrunk to a line or coincide are dropped.
    """
    used = np.unique(triangles)
    place = np.full(len(points), -1, dtype=np.int64)
    place[used] = np.arange(len(used))
    faces = place[triangles]
    if len(used) <= most:
        return used, faces
    at = points[used] - points[used].min(axis=0)
    cell = 0.5 * np.sqrt(_area(points, triangles) / most)
    while True:
        _, label = np.unique(np.floor(at / cell).astype(np.int64), axis=0, return_inverse=True)
        count = int(label.max()) + 1
        if count <= most:
            break
        cell *= _GROWTH
    label = label.ravel()
    nearest = _representatives(at, label, count)
    merged = label[faces]
    a, b, c = merged.T
    merged = merged[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(merged, axis=1), axis=0, return_index=True)
    return used[nearest], merged[np.sort(first)]


def _representatives(points: FloatArray, label: IntArray, count: int) -> IntArray:
    """Return, for each label, the labelled point nearest to their centroid."""
    size = np.bincount(label, minlength=count)
    centroid = np.stack([np.bincount(label, points[:, k], count) for k in range(3)], axis=1)
    off = np.linalg.norm(points - (centroid / size[:, None])[label], axis=1)
    order = np.lexsort((off, label))
    return np.asarray(order[np.searchsorted(label[order], np.arange(count))])


def _area(points: FloatArray, triangles: IntArray) -> float:
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return float(np.linalg.norm(normal, axis=1).sum() / 2)
