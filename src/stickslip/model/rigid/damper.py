r"""The rigid underplatform damper with an asymmetric flat-curved cross-section.

The damper is a prism along y that sits between two platforms and is pressed outward (+z) against
their undersides. Its flat side touches the left blade along the lines L1 (near the apex) and L2
(near the base), its curved side touches the right blade along the line R::

             apex
         L1  /--\  R
            /    \
           /      )
      L2  /________)

Both sides are described from the apex, the point where the two underside planes meet. Geometry of
this family of dampers: Gola & Gastaldi, "Understanding complexities in underplatform damper
mechanics", ASME Turbo Expo 2014.
"""

import math
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.rigid.body import RigidBody
from stickslip.model.rigid.sides import (
    ContactPoints,
    Line,
    grow_within,
    nearest,
    points_of_lines,
    side_frame,
    strip_width,
)
from stickslip.units import angle, check_quantities, length, quantity

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
