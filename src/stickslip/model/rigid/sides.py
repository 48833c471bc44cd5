r"""Sides of rigid dampers: where their points lie, and their frames.

Dampers are prisms along y between two platforms, and are pressed outward (+z) against their undersides. Both sides are
described from the apex, the point of a section where the planes of the two undersides meet::

             apex
              /\
       left  /  \  right
            /    \
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Contact points on a damper.

    Parameters
    ----------
    names
        n names such as ``L1.1`` (line and section).
    side
        n words: the surface that each point is of, ``flat`` and ``curved``, or ``left`` and ``right``.
    position
        (n, 3) positions in metres.
    frame
        (n, 3, 3) frames; columns t, w, n: two tangents and the outward normal of the damper,
        which points into the blade.
    """

    names: tuple[str, ...]
    side: tuple[str, ...]
    position: FloatArray
    frame: FloatArray

    def __len__(self) -> int:
        return len(self.names)

    def on_line(self, line: str) -> IntArray:
        """Return the indices of the points of ``L1``, ``L2`` or ``R``, in order of y."""
        return np.array([i for i, name in enumerate(self.names) if name.split(".")[0] == line])


@dataclass(frozen=True)
class Line:
    """A line of contact points along y.

    Parameters
    ----------
    name, side
        ``L1``, and the surface that it is of.
    angle
        Inclination in rad of the side from x.
    left
        Whether it is the left one.
    distance
        From the apex along the side, in metres.
    """

    name: str
    side: str
    angle: float
    left: bool
    distance: float


def side_frame(angle: float, *, left: bool) -> FloatArray:
    """Return the columns t, w, n of a side inclined by `angle` (rad) from x: t to the apex, w along y (left) or against it, n outward."""
    sign = 1.0 if left else -1.0
    normal = np.array([-sign * math.sin(angle), 0.0, math.cos(angle)])
    along = np.array([0.0, sign, 0.0])
    return np.column_stack([np.cross(along, normal), along, normal])


def points_of_lines(
    lines: Sequence[Line], sections: Sequence[float], apex: tuple[float, float] = (0.0, 0.0)
) -> ContactPoints:
    """Return the points of `lines` at the `sections` (y in metres), line by line; the `apex` is at (x, z)."""
    names, sides, positions, frames = [], [], [], []
    for line in lines:
        frame = side_frame(line.angle, left=line.left)
        for i, y in enumerate(sections):
            names.append(f"{line.name}.{i + 1}")
            sides.append(line.side)
            positions.append(np.array([apex[0], y, apex[1]]) - line.distance * frame[:, 0])
            frames.append(frame)
    return ContactPoints(tuple(names), tuple(sides), np.array(positions), np.array(frames))


def middles(low: float, high: float, count: int = 3) -> tuple[float, ...]:
    """Return the middles of `count` equal stretches between two places."""
    edges = np.linspace(low, high, count + 1)
    return tuple(float(v) for v in (edges[:-1] + edges[1:]) / 2)
