r"""Rigid dampers whose mass and inertia follow from their section and length: a wedge with two flat sides, and a cylinder.

Body axes: the origin is the apex, where the planes of the two platforms' undersides meet, in the middle of the length; x points
from left to right, y along the prism, z outward. Mass or density is given, and the body is homogeneous: a designer finds these
numbers on the drawing. For a body that is not homogeneous use a `RigidBody` with its own points.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import InputError, input_error
from stickslip.model.rigid.body import RigidBody, body_of_tensor
from stickslip.model.rigid.sides import (
    ContactPoints,
    Line,
    grow_within,
    middles,
    nearest,
    points_of_lines,
    side_frame,
    strip_width,
)
from stickslip.units import check_quantities, quantity
from stickslip.units import length as metres

Places = tuple[float, ...]


def _own_mass() -> Any:
    return quantity("mass; or give the density", "kg", default=None, above=0)


def _density() -> Any:
    return quantity("density; or give the mass", "kg_per_m3", default=None, above=0)


def _axial() -> Any:
    about = "axial positions y of the sections, growing; each holds one point a line; left out: three, evenly"
    return quantity(about, "m", default=None, entries=(1, 100), usual=100)


@dataclass(frozen=True, kw_only=True)
class WedgeDamper:
    """A rigid wedge: its section is a trapezoid whose two flat sides touch the platforms.

    Parameters
    ----------
    left_angle, right_angle
        Inclination in rad of either side from x: the underside angle of the platform it touches. `right_angle` None: equal to
        the left one.
    top_width, height
        Width of the section's outer end (0: sharp) and its extent along z, in metres.
    length
        Extent along y in metres.
    mass, density
        Mass in kg or density in kg/m³; give one of them.
    left_distances, right_distances
        Distances in metres of the lines of contact points from the apex along the side; None: three, in the middle of each third
        of the side.
    sections
        Axial positions y in metres; each line has a point at each. None: three, in the middle of each third of the length.

    Raises
    ------
    InputError
        If the sides do not meet, lines or sections lie outside of the body, or mass and density are both given or both missing.
    """

    left_angle: float = quantity("inclination of the left side from x", "deg", above=0, most=90)
    right_angle: float | None = quantity(
        "inclination of the right side from x (left out: as the left side)", "deg", default=None, above=0, most=90
    )
    top_width: float = metres("width of the section's outer end; 0: it is sharp", least=0)
    height: float = metres("extent of the section along z")
    length: float = metres("extent along y")
    mass: float | None = _own_mass()
    density: float | None = _density()
    left_distances: tuple[float, ...] | None = quantity(
        "distances of the lines [L1, L2, ...] from the apex along the left side; left out: three, evenly",
        "m",
        default=None,
        above=0,
        entries=(1, 100),
    )
    right_distances: tuple[float, ...] | None = quantity(
        "the same of the lines [R1, R2, ...] on the right side", "m", default=None, above=0, entries=(1, 100)
    )
    sections: tuple[float, ...] | None = _axial()

    def __post_init__(self) -> None:
        check_quantities(self)
        _check_mass(self)
        if 1 / math.tan(self.left_angle) + 1 / math.tan(self.angles[1]) < 1e-6:
            raise _bad(self, "right_angle", "is upright like the left side: the two never meet", "Incline one.")
        for side, angle in zip(("left", "right"), self.angles, strict=True):
            given = getattr(self, f"{side}_distances")
            low, high = (depth / math.sin(angle) for depth in self.depths)
            if given is not None and not grow_within(given, low, high):
                raise _bad(
                    self,
                    f"{side}_distances",
                    f"must grow and lie on the side, from {low:.6g} to {high:.6g} m from the apex, got {given}",
                    "The apex is where the two sides meet, outside of a section with a width at its top.",
                )
        _check_sections(self, self.sections, self.length)
        self.body()

    @property
    def angles(self) -> tuple[float, float]:
        """Inclination of the left and of the right side."""
        return self.left_angle, self.left_angle if self.right_angle is None else self.right_angle

    @property
    def depths(self) -> tuple[float, float]:
        """Depths of the section's top and base below the apex, in metres."""
        left, right = self.angles
        top = self.top_width / (1 / math.tan(left) + 1 / math.tan(right))
        return top, top + self.height

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest y of the prism, in metres."""
        return -self.length / 2, self.length / 2

    def outline(self) -> FloatArray:
        """Return the section's corners (4, 2) in x and z, metres: top right, base right, base left, top left."""
        left, right = (1 / math.tan(angle) for angle in self.angles)
        top, base = self.depths
        return np.array([[top * right, -top], [base * right, -base], [-base * left, -base], [-top * left, -top]])

    def body(self) -> RigidBody:
        """Return the wedge as a rigid body, with centre and inertia of a homogeneous prism."""
        area, centre, second = section_moments(self.outline())
        mass = self.mass if self.mass is not None else (self.density or 0.0) * area * self.length
        xx, zz, xz = mass * second
        along = mass * self.length**2 / 12
        tensor = np.array([[zz + along, 0, -xz], [0, xx + zz, 0], [-xz, 0, xx + along]])
        return body_of_tensor(mass, tensor, np.array([centre[0], 0.0, centre[1]]))

    def contact_points(self) -> ContactPoints:
        """Return the points of the surfaces ``left`` (lines L1, L2, ...) and ``right`` (R1, R2, ...), each line in order of y."""
        lines = []
        for side, angle in zip(("left", "right"), self.angles, strict=True):
            low, high = (depth / math.sin(angle) for depth in self.depths)
            places = getattr(self, f"{side}_distances") or middles(low, high)
            lines += [
                Line(f"{side[0].upper()}{i + 1}", side, angle, side == "left", place, width)
                for i, (place, width) in enumerate(zip(places, nearest(places, low, high), strict=True))
            ]
        return points_of_lines(lines, self.sections or _evenly(self.length), self.length)


@dataclass(frozen=True, kw_only=True)
class CylinderDamper:
    """A rigid cylinder along y that touches each of two platforms along a line.

    Parameters
    ----------
    radius, length
        Radius and length in metres.
    left_angle, right_angle
        Inclination in rad from x of the platform's underside on either side. `right_angle` None: equal to the left one.
    mass, density, sections
        See `WedgeDamper`.
    contact_width
        Width in metres of the contact strip on either underside, for laws per area; None: unknown.

    Raises
    ------
    InputError
        As for a `WedgeDamper`.
    """

    radius: float = metres("radius")
    length: float = metres("extent along y")
    left_angle: float = quantity(
        "inclination from x of the underside that it touches on the left", "deg", above=0, below=90
    )
    right_angle: float | None = quantity(
        "the same on the right (left out: as on the left)", "deg", default=None, above=0, below=90
    )
    mass: float | None = _own_mass()
    density: float | None = _density()
    sections: tuple[float, ...] | None = _axial()
    contact_width: float | None = strip_width()

    def __post_init__(self) -> None:
        check_quantities(self)
        _check_mass(self)
        _check_sections(self, self.sections, self.length)
        self.body()

    @property
    def angles(self) -> tuple[float, float]:
        """Inclination of the undersides on the left and on the right."""
        return self.left_angle, self.left_angle if self.right_angle is None else self.right_angle

    @property
    def axis(self) -> FloatArray:
        """(x, z) in metres of the cylinder's axis, one radius from both undersides."""
        normals = [side_frame(angle, left=i == 0)[[0, 2], 2] for i, angle in enumerate(self.angles)]
        return np.asarray(np.linalg.solve(np.array(normals), -self.radius * np.ones(2)))

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest y of the prism, in metres."""
        return -self.length / 2, self.length / 2

    def outline(self) -> FloatArray:
        """Return the section as a polygon (k, 2) in x and z, metres."""
        angle = np.linspace(0.0, 2 * math.pi, 48, endpoint=False)
        return np.asarray(self.axis - self.radius * np.column_stack([-np.cos(angle), np.sin(angle)]))

    def body(self) -> RigidBody:
        """Return the cylinder as a rigid body, homogeneous."""
        volume = math.pi * self.radius**2 * self.length
        mass = self.mass if self.mass is not None else (self.density or 0.0) * volume
        across = mass * (self.radius**2 / 4 + self.length**2 / 12)
        x, z = (float(v) for v in self.axis)
        inertia = (across, mass * self.radius**2 / 2, across)
        return RigidBody(mass=mass, inertia=inertia, centre=(x, 0.0, z))

    def contact_points(self) -> ContactPoints:
        """Return the points of the surfaces ``left`` (line L) and ``right`` (line R), each in order of y."""
        width = math.nan if self.contact_width is None else self.contact_width
        touch = [
            self.axis + self.radius * side_frame(angle, left=i == 0)[[0, 2], 2] for i, angle in enumerate(self.angles)
        ]
        lines = [
            Line(side[0].upper(), side, angle, side == "left", float(np.linalg.norm(point)), width)
            for side, angle, point in zip(("left", "right"), self.angles, touch, strict=True)
        ]
        return points_of_lines(lines, self.sections or _evenly(self.length), self.length)


def _evenly(extent: float) -> Places:
    return middles(-extent / 2, extent / 2)


def _check_mass(given: WedgeDamper | CylinderDamper) -> None:
    if (given.mass is None) == (given.density is None):
        both = "and the density are both given" if given.mass is not None else "is missing, and so is the density"
        raise _bad(given, "mass", both, "Give one of them.")


def _check_sections(given: WedgeDamper | CylinderDamper, sections: Places | None, extent: float) -> None:
    if sections is not None and not grow_within(sections, -extent / 2, extent / 2):
        raise _bad(
            given,
            "sections",
            f"must grow and lie within half the length, {extent / 2:.6g} m, of the middle, got {sections}",
            "They are positions y; y = 0 is the middle of the length.",
        )


def _bad(given: object, field: str, problem: str, remedy: str) -> InputError:
    return input_error(f"{type(given).__name__}.{field}", problem, remedy)


def section_moments(corners: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return area, centroid (2,) and the means of x², z² and x z about it (3,) of a polygon (k, 2), by its edges (Green)."""
    after = np.roll(corners, -1, axis=0)
    twice = corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]
    area = twice.sum() / 2
    centre = (twice @ (corners + after)) / (6 * area)
    (x, z), (a, b) = (corners - centre).T, (after - centre).T
    about = x * b - a * z
    second = np.array(
        [
            about @ (x * x + x * a + a * a) / 12,
            about @ (z * z + z * b + b * b) / 12,
            about @ (x * b + 2 * x * z + 2 * a * b + a * z) / 24,
        ]
    )
    return abs(float(area)), centre, np.asarray(second / area)
