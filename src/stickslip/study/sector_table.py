"""The table [model.sector]: a parametric sector of a bladed disk, and the library object it becomes."""

from typing import Annotated, Self

from pydantic import BaseModel, Field, model_validator
from pydantic_core import PydanticCustomError

from stickslip.errors import InputError
from stickslip.model.mesh.sector import BladedSector
from stickslip.model.mesh.sector_parts import Airfoil, DiskProfile, Platform, Shroud
from stickslip.study.geometry import NODES_A_CUBE, Length, arguments
from stickslip.study.messages import custom_error, library_error
from stickslip.study.sections import Section

Clearance = Annotated[float, Field(ge=0, le=100)]  # m
Inclination = Annotated[float, Field(ge=-75, le=75)]  # degrees
FINEST = 2_000_000  # nodes of a sector that a study may ask for


class DiskTable(Section):
    """Cross-section of the disk: a hub that narrows to a web, which carries a rim."""

    bore_radius_m: Length = Field(description="inner radius in m; the bore is clamped")
    hub_radius_m: Length = Field(description="radius where the hub has narrowed to the web, in m")
    rim_radius_m: Length = Field(description="outer radius of the disk in m")
    rim_height_m: Length = Field(description="extent of the rim along the radius in m")
    bore_width_m: Length = Field(description="extent of the hub along the axis at the bore in m")
    web_width_m: Length = Field(description="extent of the web along the axis in m")
    rim_width_m: Length = Field(description="extent of the rim along the axis in m")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        return self

    def library(self) -> DiskProfile:
        """Return the cross-section."""
        try:
            return DiskProfile(**arguments(self))
        except InputError as error:
            raise library_error(type(self), error) from None


class PlatformTable(Section):
    """A neck on the rim that widens into a platform; without this table the airfoil stands on the rim."""

    top_radius_m: Length = Field(description="distance of the plane top from the axis in m")
    thickness_m: Length = Field(description="thickness at the sides in m")
    neck_width_m: Length = Field(description="extent of the neck around the wheel in m")
    depth_m: Length = Field(description="extent of neck and platform along the axis in m")
    underside_angle_deg: float = Field(
        ge=0, le=75, description="inclination of the undersides in degrees, 0 to 75"
    )
    gap_m: Clearance = Field(
        description="clearance to the neighbour's platform in m; 0 lets them touch"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        return self

    def library(self) -> Platform:
        """Return the platform."""
        try:
            return Platform(**arguments(self))
        except InputError as error:
            raise library_error(type(self), error) from None


class AirfoilTable(Section):
    """A tapered, twisted, cambered lens section along the radius."""

    airfoil_length_m: Length = Field(
        description="from the platform's top (without platform: from the rim) to the tip in m"
    )
    hub_chord_m: Length = Field(description="chord at the hub in m")
    tip_chord_m: Length = Field(description="chord at the tip in m")
    hub_thickness_m: Length = Field(description="thickness at the hub in m")
    tip_thickness_m: Length = Field(description="thickness at the tip in m")
    camber: float = Field(
        ge=-0.3, le=0.3, description="height of the camber line over the chord, -0.3 to 0.3"
    )
    stagger_deg: float = Field(
        ge=-90, le=90, description="angle of the hub's chord from the axis in degrees, -90 to 90"
    )
    twist_deg: float = Field(
        ge=-90, le=90, description="rotation of the tip against the hub in degrees, -90 to 90"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        return self

    def library(self) -> Airfoil:
        """Return the airfoil."""
        try:
            return Airfoil(**arguments(self))
        except InputError as error:
            raise library_error(type(self), error) from None


class ShroudTable(Section):
    """A ring segment on the blade; without this table the blades do not touch each other."""

    span: float = Field(
        gt=0, le=1, description="place as a fraction of the airfoil's length, above 0; 1 is the tip"
    )
    thickness_m: Length = Field(description="extent along the radius in m")
    depth_m: Length = Field(description="extent along the axis in m")
    gap_m: Clearance = Field(
        description="clearance to the neighbour's shroud in m; 0 makes one closed ring of them"
    )
    face_angle_deg: Inclination = Field(
        description="inclination of the contact faces from the axial plane in degrees, -75 to 75"
    )
    joined: bool = Field(
        description="whether neighbouring shrouds stick together (true, needs gap_m = 0) or slide freely (false)"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        if self.joined and self.gap_m > 0:
            raise custom_error(
                f"needs shrouds that touch, got gap_m = {self.gap_m}",
                "Give gap_m = 0, or joined = false.",
                "joined",
            )
        return self

    def library(self) -> Shroud:
        """Return the shroud."""
        try:
            return Shroud(**{k: v for k, v in arguments(self).items() if k != "joined"})
        except InputError as error:
            raise library_error(type(self), error) from None


class SectorTable(Section):
    """One sector of a bladed disk, meshed with second-order tetrahedra; its bore is clamped."""

    sectors: int = Field(
        ge=3, le=500, description="number of sectors (blades) of the wheel, 3 to 500"
    )
    disk: DiskTable = Field(description="the table [model.sector.disk]")
    platform: PlatformTable | None = Field(
        None, description="the table [model.sector.platform]; left out: none"
    )
    airfoil: AirfoilTable = Field(description="the table [model.sector.airfoil]")
    shroud: ShroudTable | None = Field(
        None, description="the table [model.sector.shroud]; left out: none"
    )
    disk_size_m: Length = Field(description="element size in the disk in m")
    platform_size_m: Length = Field(description="element size in platform and shroud in m")
    airfoil_size_m: Length = Field(description="element size in the airfoil in m")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        if self.nodes() > FINEST:
            raise custom_error(
                f"ask for some {self.nodes():.2g} nodes, more than {FINEST:.0e}",
                "Give larger element sizes.",
                "disk_size_m, platform_size_m, airfoil_size_m",
            )
        return self

    def library(self) -> BladedSector:
        """Return the geometry."""
        try:
            return BladedSector(
                sectors=self.sectors,
                disk=self.disk.library(),
                platform=None if self.platform is None else self.platform.library(),
                airfoil=self.airfoil.library(),
                shroud=None if self.shroud is None else self.shroud.library(),
                disk_size=self.disk_size_m,
                platform_size=self.platform_size_m,
                airfoil_size=self.airfoil_size_m,
            )
        except InputError as error:
            raise _nested_error(type(self), error) from None

    def nodes(self) -> float:
        """Return about how many nodes the mesh will have."""
        d, a = self.disk, self.airfoil
        pitch = 6.283185307179586 / self.sectors
        disk = (
            pitch
            / 2
            * (d.rim_radius_m**2 - d.bore_radius_m**2)
            * (d.bore_width_m + d.web_width_m)
            / 2
        )
        # thin plates have at least one element across
        disk *= max(1.0, self.disk_size_m / d.web_width_m)
        thickness = (a.hub_thickness_m + a.tip_thickness_m) / 2
        blade = a.airfoil_length_m * (a.hub_chord_m + a.tip_chord_m) / 2 * thickness
        blade *= max(1.0, self.airfoil_size_m / thickness)
        return NODES_A_CUBE * (disk / self.disk_size_m**3 + blade / self.airfoil_size_m**3)


def _nested_error(section: type[BaseModel], error: InputError) -> PydanticCustomError:
    """Return the geometry's complaint about ``BladedSector.part.field`` with the key of that field."""
    _, *names = error.place.split(".")
    tables: dict[str, type[BaseModel]] = {
        "disk": DiskTable, "platform": PlatformTable, "airfoil": AirfoilTable, "shroud": ShroudTable
    }  # fmt: skip
    key, model = [], section
    for name in names:
        fields = [f for f in model.model_fields if f == name or f.startswith(name + "_")]
        if not fields:
            break
        key.append(name if name in fields else fields[0])
        model = tables.get(name, model)
    return custom_error(error.problem, error.remedy, ".".join(key))
