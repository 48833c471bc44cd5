"""Geometry of one sector of a bladed disk, and of its parts: disk, platform, airfoil, shroud.

Rotation axis z, sector centred on +x, right-hand rule; the cyclic faces lie in the planes at plus and minus half the
pitch. The mesher is in `model.mesh.sector_mesh`.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.errors import InputError, input_error
from stickslip.units import angle, check_quantities, length, quantity, table

SECTION_POINTS = 7  # points on either face of an airfoil section


@dataclass(frozen=True, kw_only=True)
class DiskProfile:
    """Cross-section of the disk: a hub that narrows to a web, which carries a rim; lengths in metres.

    Parameters
    ----------
    bore_radius
        Inner radius; the bore is clamped.
    hub_radius
        Radius at which the hub has narrowed to the web.
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
        Thickness of the platform at its sides.
    neck_width
        Extent of the neck around the wheel.
    depth
        Extent of neck and platform along the axis.
    underside_angle
        Inclination of the undersides: they fall towards the neck.
    gap
        Clearance to the neighbour's platform at the top; 0: they touch.

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
        Length from the platform's top (without platform: from the rim) to the tip.
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
    """A ring segment on the blade whose faces touch, or nearly touch, the neighbours' faces; metres and rad.

    Parameters
    ----------
    span
        Position of its middle as a fraction of the airfoil's length; 1 is the tip.
    thickness
        Extent along the radius.
    depth
        Extent along the axis.
    gap
        Clearance to the neighbour's face along the circumference; 0: they touch.
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


@dataclass(frozen=True, kw_only=True)
class BladedSector:
    """One of `sectors` equal sectors of a bladed disk; the defaults are a steel wheel with 24 blades.

    Parameters
    ----------
    sectors
        Number of sectors of the wheel, at least 3.
    disk
        Cross-section of the disk.
    platform
        Platform that carries the airfoil; None: the airfoil is on the rim.
    airfoil
        The blade.
    shroud
        Shroud; None: no shroud.
    disk_size, platform_size, airfoil_size
        Element sizes in metres, from the bore outward; a shroud has the platform's size.

    Raises
    ------
    InputError
        If the parts do not fit together, or penetrate the neighbours.
    """

    sectors: int = quantity("number of sectors (blades) of the wheel", default=24, least=3, usual=500)
    disk: DiskProfile = field(default_factory=DiskProfile, metadata=table("the disk"))
    platform: Platform | None = field(
        default_factory=Platform, metadata=table("what carries the airfoil; left out: it stands on the rim")
    )
    airfoil: Airfoil = field(default_factory=Airfoil, metadata=table("the blade"))
    shroud: Shroud | None = field(default=None, metadata=table("a ring segment on the blade; left out: none"))
    disk_size: float = length("element size in the disk", 0.012)
    platform_size: float = length("element size in platform and shroud", 0.008)
    airfoil_size: float = length("element size in the airfoil", 0.010)

    def __post_init__(self) -> None:
        check_quantities(self)
        if self.sectors % 1:
            raise _bad("sectors", f"must be a whole number, got {self.sectors}", "Try 24.")
        self._check_platform()
        self._check_base()
        self._check_neighbours()
        self._check_shroud()

    @property
    def pitch(self) -> float:
        """Angle of a sector in rad."""
        return 2 * math.pi / self.sectors

    @property
    def base_radius(self) -> float:
        """Radius at which the airfoil starts, in metres."""
        return self.disk.rim_radius if self.platform is None else self.platform.top_radius

    @property
    def tip_radius(self) -> float:
        """Radius of the plane in which the airfoil ends, in metres."""
        return self.base_radius + self.airfoil.airfoil_length

    @property
    def platform_angle(self) -> float:
        """Angle from one side face of the platform to the other, in rad; needs a platform."""
        assert self.platform is not None
        return self.pitch - self.platform.gap / self.platform.top_radius

    @property
    def shroud_radius(self) -> float:
        """Radius of the shroud's middle, in metres; needs a shroud."""
        assert self.shroud is not None
        return self.base_radius + self.shroud.span * self.airfoil.airfoil_length

    @property
    def shroud_angle(self) -> float:
        """Angle from one contact face of the shroud to the other, in rad; needs a shroud."""
        assert self.shroud is not None
        return self.pitch - self.shroud.gap / self.shroud_radius

    def platform_outline(self) -> FloatArray:
        """Return the (8, 2) corners (x, y) of neck and platform, +y side from the bottom up, then the other side down."""
        assert self.platform is not None
        p, slope = self.platform, math.tan(self.platform_angle / 2)
        lower = p.top_radius - p.thickness
        neck = p.neck_width / 2
        meets = lower - (lower * slope - neck) * math.tan(p.underside_angle)
        side = np.array(
            [[self._sunk(neck), neck], [meets, neck], [lower, lower * slope], [p.top_radius, p.top_radius * slope]]
        )
        return np.vstack([side, side[::-1] * [1, -1]])

    def airfoil_sections(self) -> list[FloatArray]:
        """Return the sections (2 `SECTION_POINTS`, 3) through which the airfoil is lofted, from the base outward."""
        sections = []
        for span in (0.0, 0.5, 1.0):
            outline = self.airfoil.section(span)
            x = self.base_radius + span * self.airfoil.airfoil_length
            if span == 0.0 and self.platform is None:
                x = self._sunk(np.abs(outline[:, 0]).max())
            sections.append(np.column_stack([np.full(len(outline), x), outline]))
        return sections

    def _sunk(self, half_width: float) -> float:
        """Return the radius x at which a body `half_width` wide to either side can start, safely inside the rim."""
        rim = self.disk.rim_radius
        return math.sqrt(max(rim**2 - half_width**2, 0.0)) - 0.1 * self.disk.rim_height

    def _check_platform(self) -> None:
        p, rim = self.platform, self.disk.rim_radius
        if p is None:
            return
        if p.depth > self.disk.rim_width:
            raise _bad(
                "platform.depth",
                f"{p.depth} m exceeds the rim's width {self.disk.rim_width} m",
                "Make the rim wider or the platform less deep.",
            )
        room = 2 * (p.top_radius - p.thickness) * math.tan(self.platform_angle / 2)
        if p.neck_width >= min(room, 2 * rim * math.sin(self.pitch / 2)):
            raise _bad(
                "platform.neck_width",
                f"{p.neck_width} m reaches into the neighbours (the platform is {room:.6g} m wide)",
                "Make the neck narrower or take fewer sectors.",
            )
        meets = self.platform_outline()[1]
        if np.hypot(*meets) <= rim:
            raise _bad(
                "platform.top_radius",
                f"{p.top_radius} m: the underside meets the neck at {meets[0]:.6g} m, inside the rim of radius {rim} m",
                "Raise the platform, make it thinner, or its underside flatter.",
            )

    def _check_base(self) -> None:
        y, z = np.abs(self.airfoil.section(0.0)).max(axis=0)
        if self.platform is None:
            name, half = "rim", self.disk.rim_radius * math.sin(self.pitch / 2)
            depth, sunk = self.disk.rim_width, self._sunk(y)
        else:
            name, half = "platform", self.platform.top_radius * math.tan(self.platform_angle / 2)
            depth, sunk = self.platform.depth, self._sunk(self.platform.neck_width / 2)
        if y >= half or z >= depth / 2:
            raise _bad(
                "airfoil.hub_chord",
                f"the hub section ({2 * y:.6g} m around, {2 * z:.6g} m along the axis) overhangs the {name} "
                f"({2 * half:.6g} m, {depth:.6g} m)",
                "Make the section smaller, or turn it by the stagger.",
            )
        if sunk <= self.disk.rim_radius - self.disk.rim_height:
            raise _bad(
                "disk.rim_height",
                f"{self.disk.rim_height} m is too low for what the curved rim carries",
                "Make the rim higher or what it carries narrower.",
            )

    def _check_neighbours(self) -> None:
        for span in np.linspace(0.0, 1.0, 9):
            outline = self.airfoil.section(float(span))
            radius = self.base_radius + float(span) * self.airfoil.airfoil_length
            arc = np.column_stack([radius * np.arctan2(outline[:, 0], radius), outline[:, 1]])
            if np.any(_inside(arc + np.array([radius * self.pitch, 0.0]), arc)):
                raise _bad(
                    "airfoil",
                    f"at {span:.3g} of its length the airfoil reaches into the neighbour's",
                    "Take fewer sectors, or less stagger, chord, camber or thickness.",
                )

    def _check_shroud(self) -> None:
        s = self.shroud
        if s is None:
            return
        inner = self.shroud_radius - s.thickness / 2
        if inner <= self.base_radius:
            raise _bad("shroud.span", f"{s.span} puts the shroud into the blade's foot", "Move it outward.")
        if s.gap >= self.shroud_radius * self.pitch:
            raise _bad("shroud.gap", f"{s.gap} m leaves no shroud", "Make the gap smaller.")
        if s.span < 1 and inner + s.thickness >= self.tip_radius:
            raise _bad("shroud.span", f"{s.span} lets the shroud end at the tip", "Use 1, or move it inward.")
        outline = self.airfoil.section(s.span)
        y, z = outline.T
        ahead = _turned_y(self.shroud_radius, y, -self.shroud_angle / 2) - z * math.tan(s.face_angle)
        behind = _turned_y(self.shroud_radius, y, self.shroud_angle / 2) - z * math.tan(s.face_angle)
        if np.any(ahead >= 0) or np.any(behind <= 0):
            raise _bad(
                "shroud.face_angle",
                f"at {math.degrees(s.face_angle):.6g} degrees the contact faces cut through the airfoil",
                "Incline them towards the chord, or take fewer sectors.",
            )
        if s.span == 1.0 and np.hypot(self.tip_radius, np.abs(y).max()) >= inner + s.thickness:
            raise _bad(
                "shroud.thickness",
                f"{s.thickness} m: the corners of the plane tip stick out of the round shroud",
                "Make the shroud thicker or the tip's chord smaller.",
            )


def _turned_y(radius: float, y: FloatArray, angle: float) -> FloatArray:
    """Return y of the points (radius, y) after a turn by `angle`."""
    return radius * math.sin(angle) + y * math.cos(angle)


def _inside(points: FloatArray, polygon: FloatArray) -> BoolArray:
    """Return a mask of the `points` (n, 2) inside the `polygon` (p, 2), by counting crossings."""
    x, y = points[:, :1], points[:, 1:]
    (x0, y0), (x1, y1) = polygon.T, np.roll(polygon, -1, axis=0).T
    spans = (y0 > y) != (y1 > y)
    rise = np.where(y1 == y0, 1.0, y1 - y0)
    crossed = spans & (x < x0 + (y - y0) / rise * (x1 - x0))
    return np.asarray(crossed.sum(axis=1) % 2 == 1)


def _bad(name: str, problem: str, remedy: str) -> InputError:
    return input_error(f"BladedSector.{name}", problem, remedy)
