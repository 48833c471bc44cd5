r"""Rigid underplatform dampers: prisms along y between two platforms, pressed outward (+z) against their undersides.

Both sides are described from the apex, the point of a section where the planes of the two undersides meet::

             apex
              /\
       left  /  \  right
            /    \

Body axes of the wedge and the cylinder: the origin is the apex in the middle of the length; x points from left to right, y along
the prism, z outward. Mass or density is given, and the body is homogeneous: a designer finds these numbers on the drawing. For a
body that is not homogeneous use a `RigidBody` with its own points.

The flat side of the asymmetric flat-curved damper touches the left blade along the lines L1 (near the apex) and L2 (near the
base), its curved side touches the right blade along the line R::

             apex
         L1  /--\  R
            /    \
           /      )
      L2  /________)

Geometry of this family of dampers: Gola & Gastaldi, "Understanding complexities in underplatform damper mechanics", ASME Turbo
Expo 2014.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import InputError, input_error
from stickslip.model.rigid.body import RigidBody, body_of_tensor
from stickslip.units import angle, check_quantities, length, quantity
from stickslip.units import length as metres


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


CURVED_SEGMENTS = 24
RISE = 0.001 * math.sqrt(3) / (1 + math.sqrt(3))  # m: height above edges 1 mm apart where planes of 45° and 60° meet


@dataclass(frozen=True, kw_only=True)
class FlatCurvedDamper:
    """A rigid damper with one flat and one curved side.

    Parameters
    ----------
    apex
        (x, z) in metres of the point where the two contact planes meet.
    flat_angle, curved_angle
        Inclination in rad of the contact plane on either side, measured from the circumferential
        direction x: the underside angle of the platform it touches.
    flat_distances
        Distances in metres from the apex of the lines L1, L2 and further ones, along the flat side.
    curved_distance
        Distance in metres of R from the apex along the right platform's underside.
    curved_radius
        Radius in metres of the curved side.
    sections
        Axial positions y in metres of the sections, increasing; each section has one point of each line.
    length
        Length in metres along y over which the sides touch, centred at y = 0.
    flat_between
        Distances in metres from the apex between which the flat side touches.
    curved_width
        Width in metres of the strip in which the curved side touches. The area of each point, for laws per area, follows from
        `length`, `flat_between` and `curved_width`; None: unknown.
    mass
        Mass in kg.
    inertia
        Moments of inertia about x, y, z through the centre of mass, in kg m².
    centre
        Centre of mass in metres: offset (x, y, z) from the apex at y = 0.
    """

    apex: tuple[float, float] = quantity(
        "the point [x, z] where the contact planes meet", "m", default=(0.0275 + RISE, 0.106 + RISE), usual=100
    )
    flat_angle: float = angle("inclination of the flat side from x", 45, above=0, below=90)
    curved_angle: float = angle("inclination from x of the plane that touches the curved side", 60, above=0, below=90)
    flat_distances: tuple[float, ...] = length(
        "distances of the lines [L1, L2, ...] from the apex, the nearest first",
        (0.002, 0.029),
        above=0,
        entries=(2, 100),
    )
    curved_distance: float = length("distance of the line R from the apex", 0.0105)
    curved_radius: float = length("radius of the curved side", 0.05)
    sections: tuple[float, ...] = quantity(
        "axial positions y of the sections, growing; each holds one point a line",
        "m",
        default=(-0.016, 0.0, 0.016),
        entries=(1, 100),
        usual=100,
    )
    length: float | None = quantity(
        "extent along y over which the sides touch, with y = 0 in its middle, for laws per area",
        "m",
        default=None,
        above=0,
        usual=100,
    )
    flat_between: tuple[float, float] | None = quantity(
        "distances from the apex between which the flat side touches, for laws per area",
        "m",
        default=None,
        least=0,
        usual=100,
    )
    curved_width: float | None = strip_width()
    mass: float = quantity("mass of the damper", "kg", default=0.057, above=0)
    inertia: tuple[float, float, float] = quantity(
        "moments of inertia [x, y, z] about the centre of mass", "kg_m2", default=(8.83e-6, 3.66e-6, 9.99e-6), above=0
    )
    centre: tuple[float, float, float] = quantity(
        "centre of mass [x, y, z], from the apex", "m", default=(-0.0032, 0.0, -0.0137), usual=100
    )

    def __post_init__(self) -> None:
        check_quantities(self)
        if not np.all(np.diff(self.flat_distances) > 0):
            raise input_error(
                "FlatCurvedDamper.flat_distances",
                f"need 0 < L1 < L2 (metres from the apex), got {self.flat_distances}",
                "L1 is the line nearest to the apex.",
            )
        if not np.all(np.diff(self.sections) > 0):
            raise input_error(
                "FlatCurvedDamper.sections",
                f"need axial positions in increasing order, got {self.sections}",
                "Give metres.",
            )
        self._check_extents()
        self.body()  # checks mass, inertia and centre

    def _check_extents(self) -> None:
        """Refuse points outside the contact areas."""
        if self.length is not None and not grow_within(self.sections, -self.length / 2, self.length / 2):
            raise input_error(
                "FlatCurvedDamper.length",
                f"must hold all sections within half of it, {self.length / 2:.6g} m, of y = 0; they are {self.sections}, got {self.length}",
                "Give the whole length, or move the sections.",
            )
        if self.flat_between is not None and not grow_within(self.flat_distances, *self.flat_between):
            raise input_error(
                "FlatCurvedDamper.flat_between",
                f"must hold all lines of the flat side, at {self.flat_distances} m from the apex, got {self.flat_between}",
                "Give the nearer and the farther end of the flat that touches.",
            )

    @property
    def flat_normal(self) -> FloatArray:
        """Outward normal (3,) of the flat side: into the left blade."""
        return np.asarray(side_frame(self.flat_angle, left=True)[:, 2])

    @property
    def curved_normal(self) -> FloatArray:
        """Outward normal (3,) of the curved side at R: into the right blade."""
        return np.asarray(side_frame(self.curved_angle, left=False)[:, 2])

    @property
    def centre_of_mass(self) -> FloatArray:
        """Centre of mass (3,) in metres, in the coordinates of the blades."""
        return np.array([self.apex[0], 0.0, self.apex[1]]) + self.centre

    def body(self) -> RigidBody:
        """Return the damper as a rigid body."""
        x, y, z = (float(c) for c in self.centre_of_mass)
        return RigidBody(mass=self.mass, inertia=self.inertia, centre=(x, y, z))

    def contact_points(self) -> ContactPoints:
        """Return the points in the order L1, L2, ..., R, each line in order of y.

        The tangent t points towards the apex on both sides, so w = +y on the flat side and −y on
        the curved one.
        """
        widths = nearest(self.flat_distances, *(self.flat_between or (math.nan, math.nan)))
        lines = [
            Line(f"L{i + 1}", "flat", self.flat_angle, True, distance, float(widths[i]))
            for i, distance in enumerate(self.flat_distances)
        ]
        width = math.nan if self.curved_width is None else self.curved_width
        lines.append(Line("R", "curved", self.curved_angle, False, self.curved_distance, width))
        return points_of_lines(lines, self.sections, self.length, self.apex)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest y of the prism in metres; without a length, from the spacing of the sections."""
        if self.length is not None:
            return -self.length / 2, self.length / 2
        first, last = self.sections[0], self.sections[-1]
        half = (last - first) / (2 * (len(self.sections) - 1)) if len(self.sections) > 1 else self.curved_distance
        return first - half, last + half

    def outline(self) -> FloatArray:
        """Return the section's polygon (k, 2) in x and z, metres, from L1 clockwise.

        The polygon consists of a horizontal cut at L1, the arc that touches the right platform at R, the base at the height of
        the last line of the flat side, and the flat side from there to L1. It serves pictures and estimates of the mass; contact
        uses the points only.
        """
        corner = self.contact_points()
        first, *_, second, right = corner.position[:: len(self.sections)][:, [0, 2]]
        centre = right - self.curved_radius * self.curved_normal[[0, 2]]
        # the arc holds R even if R lies above L1 or below L2; it ends at the circle's top or bottom
        heights = np.array([max(first[1], right[1]), min(second[1], right[1])])
        ends = np.arcsin(np.clip((heights - centre[1]) / self.curved_radius, -1.0, 1.0))
        angle = np.linspace(ends[0], ends[1], CURVED_SEGMENTS + 1)
        arc = centre + self.curved_radius * np.column_stack([np.cos(angle), np.sin(angle)])
        inside = (arc - first) @ self.flat_normal[[0, 2]] < 0.0
        return np.vstack([first, arc[inside], second])


def gap_operator(
    points: ContactPoints, blade_dofs: IntArray, damper_dofs: IntArray, n: int, body: RigidBody
) -> FloatArray:
    """Return the (3 p, n) operator that gives the gaps ``frameᵀ (u_blade − u_damper)``.

    Rows t, w, n of each point in turn; a positive normal gap is open.

    Parameters
    ----------
    points
        The p contact points.
    blade_dofs
        (p, 3) dof indices x, y, z of the blade's node at each point.
    damper_dofs
        (6,) dof indices of `body`.
    n
        Number of dofs of the whole structure.
    body
        The damper's rigid body.
    """
    motion = body.displacement_operator(points.position)
    operator = np.zeros((len(points), 3, n))
    to_frame = points.frame.transpose(0, 2, 1)
    rows = np.arange(len(points))[:, None]
    for axis in range(3):
        operator[rows, axis, blade_dofs] = to_frame[:, axis]
    operator[:, :, damper_dofs] -= to_frame @ motion
    return operator.reshape(-1, n)


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
    """A rigid wedge damper: its section is a trapezoid whose two flat sides touch the platforms.

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
        for side, slope in zip(("left", "right"), self.angles, strict=True):
            given = getattr(self, f"{side}_distances")
            low, high = (depth / math.sin(slope) for depth in self.depths)
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
        for side, slope in zip(("left", "right"), self.angles, strict=True):
            low, high = (depth / math.sin(slope) for depth in self.depths)
            places = getattr(self, f"{side}_distances") or middles(low, high)
            lines += [
                Line(f"{side[0].upper()}{i + 1}", side, slope, side == "left", place, width)
                for i, (place, width) in enumerate(zip(places, nearest(places, low, high), strict=True))
            ]
        return points_of_lines(lines, self.sections or _evenly(self.length), self.length)


@dataclass(frozen=True, kw_only=True)
class CylinderDamper:
    """A rigid cylindrical damper along y that touches each of two platforms along a line.

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
