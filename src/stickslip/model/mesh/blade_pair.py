"""Geometry of two equal cantilever blades with platforms.

Coordinates: x circumferential (the blades bend this way), y axial, z radial. Blade 1 stands at
x = 0, blade 2 at x = `pitch`.
"""

import math
from dataclasses import dataclass

from stickslip.errors import InputError, input_error
from stickslip.units import angle, check_quantities, length, quantity


@dataclass(frozen=True, kw_only=True)
class BladePair:
    """Geometry of two equal blades; lengths in metres, angles in rad.

    A foot block (z < 0) carries a shank, which widens into a platform whose two undersides are
    inclined; a tapered, twisted, cambered lens section is lofted on the platform's top.

    Parameters
    ----------
    pitch
        Distance of the blades along x.
    foot_width, foot_depth, foot_height
        Extent of the foot block along x, y, z; its bottom and its x-flanks are clamped.
    shank_thickness
        Extent of the shank along x.
    platform_gap
        Clearance along x between the platforms of neighbours.
    platform_depth
        Extent of shank and platform along y.
    platform_height
        Height z of the platform's top.
    platform_edge
        Thickness of the platform at its edges.
    flat_angle, curved_angle
        Inclination from x of the underside that faces +x (blade 1: the damper's flat side) and of
        the one that faces −x (blade 2: its curved side).
    airfoil_length
        From the platform's top to the tip.
    hub_chord, tip_chord, hub_thickness, tip_thickness
        Size of the airfoil's end sections.
    camber
        Height of the camber line's arc over the chord's length.
    twist
        Rotation of the tip section against the hub section about z.
    force_span
        Place of the force node on blade 1: on the airfoil, as a fraction of the span from hub to tip; below zero on the shank, as a
        fraction of its height from the platform down to the foot.
    airfoil_size, platform_size, foot_size
        Element sizes.

    Raises
    ------
    InputError
        If a length is not positive or the parts do not fit together.
    """

    pitch: float = length("distance of the two blades along x", 0.056)
    foot_width: float = length("extent of the foot along x", 0.034)
    foot_depth: float = length("extent of the foot along y", 0.048)
    foot_height: float = length("extent of the foot along z; its bottom and flanks are clamped", 0.020)
    shank_thickness: float = length("extent of the shank along x", 0.0132)
    platform_gap: float = length("clearance between neighbouring platforms along x", 0.001)
    platform_depth: float = length("extent of shank and platform along y", 0.048)
    platform_height: float = length("height of the platform's top above the foot", 0.110)
    platform_edge: float = length("thickness of the platform at its edges", 0.004)
    flat_angle: float = angle("inclination from x of the underside of blade 1", 45, above=0, below=90)
    curved_angle: float = angle("inclination from x of the underside of blade 2", 60, above=0, below=90)
    airfoil_length: float = length("length of the airfoil from the platform to the tip", 0.160)
    hub_chord: float = length("chord of the airfoil at the platform", 0.046)
    tip_chord: float = length("chord of the airfoil at the tip", 0.040)
    hub_thickness: float = length("thickness of the airfoil at the platform", 0.0065)
    tip_thickness: float = length("thickness of the airfoil at the tip", 0.0055)
    camber: float = quantity("height of the camber line over the chord", default=0.04, usual=0.3)
    twist: float = angle("rotation of the tip against the hub", 8, usual=90)
    force_span: float = quantity(
        "place of the node set force on blade 1: on the airfoil, a fraction of the span from the hub; below zero on the shank, "
        "a fraction of its height from the platform down",
        default=0.0,
        above=-1,
        below=0.5,
    )
    airfoil_size: float = length("element size in the airfoil", 0.0060)
    platform_size: float = length("element size in the platform", 0.0055)
    foot_size: float = length("element size in shank and foot", 0.0080)

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.shank_thickness >= 2 * self.half_width:
            raise _bad(
                "pitch",
                f"{self.pitch} m leaves no room for platforms: they would overlap "
                f"(shank {self.shank_thickness} m, gap {self.platform_gap} m)",
                "Make the pitch larger than shank_thickness + platform_gap.",
            )
        if min(self.shank_tops) <= 0:
            raise _bad(
                "platform_height",
                f"{self.platform_height} m puts the undersides' lower end at {min(self.shank_tops)} m",
                "It must lie above the foot (z = 0): raise the platform or flatten its angles.",
            )
        self._check_supports()
        self._check_force()

    def _check_force(self) -> None:
        """Refuse a place on the shank so near to one of its ends that only slivers fit between."""
        top = self.shank_tops[1]
        place, least = (1.0 + self.force_span) * top, self.foot_size / 20
        if self.force_span < 0.0 and not least <= place <= top - least:
            raise _bad(
                "force_span",
                f"{self.force_span:.9g} puts the force {min(place, top - place):.3g} m from an end of the shank, with elements of {self.foot_size} m",
                f"Keep it between {1.1 * least / top - 1:.3g} and {-1.1 * least / top:.3g} on the shank, or give zero: the hub.",
            )

    def _check_supports(self) -> None:
        reach = abs(self.camber) * self.hub_chord + self.hub_thickness / 2
        if self.hub_chord >= self.platform_depth or reach >= self.half_width:
            raise _bad(
                "hub_chord",
                f"the airfoil's hub section ({self.hub_chord} m × {2 * reach} m) overhangs the platform",
                "Make it smaller than the platform.",
            )
        if self.foot_width < self.shank_thickness or self.foot_depth < self.platform_depth:
            raise _bad(
                "foot_width",
                f"the foot ({self.foot_width} × {self.foot_depth} m) is smaller than the shank "
                f"({self.shank_thickness} × {self.platform_depth} m)",
                "Make the foot at least as large as what it carries.",
            )
        if self.foot_width >= self.pitch:
            raise _bad("foot_width", f"{self.foot_width} m: the feet overlap", "Lower it.")

    @property
    def half_width(self) -> float:
        """Half the platform's extent along x, in metres."""
        return (self.pitch - self.platform_gap) / 2

    @property
    def shank_tops(self) -> tuple[float, float]:
        """Height z at which the shank meets the flat and the curved side's underside."""
        reach = self.half_width - self.shank_thickness / 2
        edge = self.platform_height - self.platform_edge
        return edge - reach * math.tan(self.flat_angle), edge - reach * math.tan(self.curved_angle)

    @property
    def wedge_apex(self) -> tuple[float, float]:
        """(x, z) where blade 1's underside plane meets blade 2's: the apex of a damper."""
        flat, curved = math.tan(self.flat_angle), math.tan(self.curved_angle)
        rise = self.platform_gap * flat * curved / (flat + curved)
        return self.half_width + rise / flat, self.platform_height - self.platform_edge + rise


def _bad(name: str, problem: str, remedy: str) -> InputError:
    return input_error(f"BladePair.{name}", problem, remedy)
