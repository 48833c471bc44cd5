r"""Sides of rigid dampers: positions and frames of their contact points.

Dampers are prisms along y between two platforms, and are pressed outward (+z) against their undersides. Both sides are
described from the apex, the point of a section where the planes of the two undersides meet::

             apex
              /\
       left  /  \  right
            /    \
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.units import quantity


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """Contact points on a damper.

    Parameters
    ----------
    names
        n names such as ``L1.1`` (line and section).
    side
        n words: the surface of each point, ``flat`` or ``curved``, or ``left`` or ``right``.
    position
        (n, 3) positions in metres.
    frame
        (n, 3, 3) frames; columns t, w, n: two tangents and the outward normal of the damper,
        which points into the blade.
    area
        (n,) area of each point in m²; NaN if unknown.
    """

    names: tuple[str, ...]
    side: tuple[str, ...]
    position: FloatArray
    frame: FloatArray
    area: FloatArray

    def __len__(self) -> int:
        return len(self.names)

    def on_line(self, line: str) -> IntArray:
        """Return the indices of the points of ``L1``, ``L2`` or ``R``, in order of y."""
        return np.array([i for i, name in enumerate(self.names) if name.split(".")[0] == line])

    def on_sides(self, sides: Collection[str]) -> "ContactPoints":
        """Return the points on the surfaces `sides`."""
        own = [i for i, side in enumerate(self.side) if side in sides]
        names, words = (tuple(given[i] for i in own) for given in (self.names, self.side))
        return ContactPoints(names, words, self.position[own], self.frame[own], self.area[own])


@dataclass(frozen=True)
class Line:
    """A line of contact points along y.

    Parameters
    ----------
    name, side
        Name such as ``L1``, and surface of the line.
    angle
        Inclination in rad of the side from x.
    left
        Whether the line is on the left side.
    distance
        Distance from the apex along the side, in metres.
    width
        Width of the contact strip of the line, in metres; NaN if unknown.
    """

    name: str
    side: str
    angle: float
    left: bool
    distance: float
    width: float = math.nan


def strip_width() -> Any:
    """Return the field of the width of a line contact."""
    about = "width of the strip along y in which the curved side touches, for laws per area"
    return quantity(about, "m", default=None, above=0, usual=1)


def side_frame(angle: float, *, left: bool) -> FloatArray:
    """Return the columns t, w, n of a side inclined by `angle` (rad) from x: t to the apex, w along y (left) or against it, n outward."""
    sign = 1.0 if left else -1.0
    normal = np.array([-sign * math.sin(angle), 0.0, math.cos(angle)])
    along = np.array([0.0, sign, 0.0])
    return np.column_stack([np.cross(along, normal), along, normal])


def points_of_lines(
    lines: Sequence[Line], sections: Sequence[float], extent: float | None, apex: tuple[float, float] = (0.0, 0.0)
) -> ContactPoints:
    """Return the points of `lines` at the `sections` (y in metres), line by line; the `apex` is at (x, z).

    The side has the length `extent` along y, centred at y = 0; None: unknown.
    """
    names, sides, positions, frames = [], [], [], []
    for line in lines:
        frame = side_frame(line.angle, left=line.left)
        for i, y in enumerate(sections):
            names.append(f"{line.name}.{i + 1}")
            sides.append(line.side)
            positions.append(np.array([apex[0], y, apex[1]]) - line.distance * frame[:, 0])
            frames.append(frame)
    half = math.nan if extent is None else extent / 2
    area = np.outer([line.width for line in lines], nearest(sections, -half, half)).ravel()
    return ContactPoints(tuple(names), tuple(sides), np.array(positions), np.array(frames), area)


def nearest(places: Sequence[float], low: float, high: float) -> FloatArray:
    """Divide the interval from `low` to `high` among the ascending `places`; return the length nearest to each."""
    between = np.asarray(places, dtype=float)
    return np.diff([low, *(between[:-1] + between[1:]) / 2, high])


def grow_within(places: Sequence[float], low: float, high: float) -> bool:
    """Whether places ascend and lie between `low` and `high`, up to rounding."""
    slack = 1e-9 * (high - low)
    rising = bool(np.all(np.diff(places) > 0))
    return rising and low - slack <= places[0] and places[-1] <= high + slack


def middles(low: float, high: float, count: int = 3) -> tuple[float, ...]:
    """Return the midpoints of `count` equal intervals between `low` and `high`."""
    edges = np.linspace(low, high, count + 1)
    return tuple(float(v) for v in (edges[:-1] + edges[1:]) / 2)
