"""Parts of a bladed-disk sector: disk, platform, airfoil, shroud."""

import math
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.units import angle, check_quantities, length, quantity

SECTION_POINTS = 7  # on either face of the airfoil


@dataclass(frozen=True, kw_only=True)
class DiskProfile:
    """Cross-section of the disk: a hub that narrows to a web, which carries a rim; lengths in metres.

    Parameters
    ----------
    bore_radius
        Inner radius; the bore is clamped.
    hub_radius
        Where the hub has narrowed to the web.
    rim_radius
        Outer radius.
    rim_height
        Extent of the rim along the radius.
    bore_width, web_width, rim_width
        Extents along the axis.

    Raises
    ------
    InputError
        If a length is not positive, or the radii do not follow each other.
    """

    bore_radius: float = length("inner radius; the bore is clamped", 0.060)
    hub_radius: float = length("radius where the hub has narrowed to the web", 0.095)
    rim_radius: float = length("outer radius of the disk", 0.170)
    rim_height: float = length("extent of the rim along the radius", 0.014)
    bore_width: float = length("extent of the hub along the axis at the bore", 0.050)
    web_width: float = length("extent of the web along the axis", 0.014)
    rim_width: float = length("extent of the rim along the axis", 0.034)

    def __post_init__(self) -> None:
        check_quantities(self)
        if not self.bore_radius < self.hub_radius < self.rim_radius - self.rim_height:
            raise input_error(
                "DiskProfile",
                f"bore_radius {self.bore_radius} m, hub_radius {self.hub_radius} m and the rim's inner radius "
                f"{self.rim_radius - self.rim_height:.6g} m do not grow in this order",
                "Make the rim lower or its radius larger.",
            )

    @property
    def outline(self) -> FloatArray:
        """(p, 2) corners (r, z) of the cross-section, without repeated ones."""
        inner = self.rim_radius - self.rim_height
        radius = [self.bore_radius, self.hub_radius, inner, inner, self.rim_radius]
        width = [self.bore_width, self.web_width, self.web_width, self.rim_width, self.rim_width]
        upper = np.column_stack([radius, np.array(width) / 2])
        upper = upper[np.r_[True, np.any(np.diff(upper, axis=0) != 0, axis=1)]]
        return np.vstack([upper, upper[::-1] * [1, -1]])


@dataclass(frozen=True, kw_only=True)
class Platform:
    """A neck on the rim that widens into a platform with plane, inclined undersides; metres and rad.

    Parameters
    ----------
    top_radius
        Distance of the plane top from the axis.
    thickness
        Of the platform at its sides.
    neck_width
        Extent of the neck around the wheel.
    depth
        Extent of neck and platform along the axis.
    underside_angle
        Inclination of the undersides: they fall towards the neck.
    gap
        Clearance to the neighbour's platform at the top; 0 lets them touch.

    Raises
    ------
    InputError
        If a length is not positive, or the angle is too steep.
    """

    top_radius: float = length("distance of the plane top from the axis", 0.187)
    thickness: float = length("thickness at the sides", 0.004)
    neck_width: float = length("extent of the neck around the wheel", 0.018)
    depth: float = length("extent of neck and platform along the axis", 0.034)
    underside_angle: float = angle("inclination of the undersides", 20, least=0, most=75)
    gap: float = length("clearance to the neighbour's platform; 0 lets them touch", 0.0008, least=0)

    def __post_init__(self) -> None:
        check_quantities(self)


@dataclass(frozen=True, kw_only=True)
class Airfoil:
    """A tapered, twisted, cambered lens section, lofted along the radius; metres and rad.

    Parameters
    ----------
    airfoil_length
        From the platform's top (without platform: from the rim) to the tip.
    hub_chord, tip_chord, hub_thickness, tip_thickness
        Size of the end sections.
    camber
        Height of the camber line's arc over the chord's length.
    stagger
        Angle of the hub's chord from the axis.
    twist
        Rotation of the tip section against the hub section.

    Raises
    ------
    InputError
        If a length is not positive, or a thickness exceeds its chord.
    """

    airfoil_length: float = length("from the platform's top (without platform: from the rim) to the tip", 0.105)
    hub_chord: float = length("chord at the hub", 0.030)
    tip_chord: float = length("chord at the tip", 0.026)
    hub_thickness: float = length("thickness at the hub", 0.0050)
    tip_thickness: float = length("thickness at the tip", 0.0028)
    camber: float = quantity("height of the camber line over the chord", default=0.08, usual=0.3)
    stagger: float = angle("angle of the hub's chord from the axis", 15, usual=90)
    twist: float = angle("rotation of the tip against the hub", 25, usual=90)

    def __post_init__(self) -> None:
        check_quantities(self)
        for end in ("hub", "tip"):
            chord, thickness = getattr(self, f"{end}_chord"), getattr(self, f"{end}_thickness")
            if thickness >= chord:
                raise input_error(
                    f"Airfoil.{end}_thickness",
                    f"{thickness} m is not below the chord {chord} m",
                    "Make the section thinner.",
                )

    def section(self, span: float) -> FloatArray:
        """Return the outline (2 `SECTION_POINTS`, 2) in (y, z) at the fraction `span` of the length.

        The first half runs along one face from the leading to the trailing edge, the second half back along the other; the
        edges are blunt.
        """
        chord = (1 - span) * self.hub_chord + span * self.tip_chord
        thickness = (1 - span) * self.hub_thickness + span * self.tip_thickness
        s = np.linspace(-1.0, 1.0, SECTION_POINTS)
        half = thickness / 2 * (0.3 + 0.7 * (1 - s**2))
        line = self.camber * chord * (1 - s**2)
        along = np.concatenate([s, s[::-1]]) * chord / 2
        across = np.concatenate([line + half, (line - half)[::-1]])
        angle = self.stagger + self.twist * span
        y = across * math.cos(angle) + along * math.sin(angle)
        z = along * math.cos(angle) - across * math.sin(angle)
        return np.column_stack([y, z])


@dataclass(frozen=True, kw_only=True)
class Shroud:
    """A ring segment on the blade whose faces meet, or almost meet, the neighbours'; metres and rad.

    Parameters
    ----------
    span
        Where its middle lies, as a fraction of the airfoil's length; 1 is the tip.
    thickness
        Extent along the radius.
    depth
        Extent along the axis.
    gap
        Clearance to the neighbour's face along the circumference; 0 lets them touch.
    face_angle
        Inclination of the contact faces from the axial plane, as in an interlocked (Z) shroud.

    Raises
    ------
    InputError
        If a length is not positive, the span is outside (0, 1], or the angle is too steep.
    """

    span: float = quantity("place as a fraction of the airfoil's length; 1 is the tip", default=1.0, above=0, most=1)
    thickness: float = length("extent along the radius", 0.004)
    depth: float = length("extent along the axis", 0.026)
    gap: float = length("clearance to the neighbour's shroud; 0 lets them touch", 0.0, least=0)
    face_angle: float = angle("inclination of the contact faces from the axial plane", 20, least=-75, most=75)

    def __post_init__(self) -> None:
        check_quantities(self)
