"""The tables [blades], [material] and [damper], and the library objects they become."""

import math
from collections.abc import Callable
from typing import Annotated, Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from stickslip.errors import InputError
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.blade_pair import BladePair
from stickslip.model.readers.units import MODULI, SOLIDS
from stickslip.model.rigid.damper import FlatCurvedDamper
from stickslip.study.messages import custom_error, library_error
from stickslip.study.sections import Positive, Section

Length = Annotated[float, Field(gt=0, le=100)]  # m
Place = Annotated[float, Field(ge=-100, le=100)]  # m
Angle = Annotated[float, Field(gt=0, lt=90)]  # degrees
NODES_A_CUBE = (
    14.0  # nodes of second-order tetrahedra in a cube of one element size, measured on the example
)


def _keep(value: float) -> float:
    return value


# longest first: a key is cut at the first that fits
UNITS: tuple[tuple[str, Callable[[float], float]], ...] = (
    ("_kg_per_m3", _keep),
    ("_kg_m2", _keep),
    ("_kg", _keep),
    ("_pa", _keep),
    ("_deg", math.radians),
    ("_m", _keep),
)


def arguments(section: Section) -> dict[str, Any]:
    """Return the keys of `section` as library arguments: SI values, names without their unit, None left out."""
    found: dict[str, Any] = {}
    for key, value in section:
        if value is None:
            continue
        suffix, convert = next(((s, c) for s, c in UNITS if key.endswith(s)), ("", _keep))
        name = key.removesuffix(suffix)
        found[name] = (
            tuple(convert(v) for v in value) if isinstance(value, list) else convert(value)
        )
    return found


class Blades(Section):
    """Two equal cantilever blades: foot, platform with inclined undersides, tapered plate."""

    pitch_m: Length = Field(description="distance of the two blades along x in m")
    foot_width_m: Length = Field(description="extent of the foot along x in m")
    foot_depth_m: Length = Field(description="extent of the foot along y in m")
    foot_height_m: Length = Field(
        description="extent of the foot along z in m; its bottom and flanks are clamped"
    )
    shank_thickness_m: Length = Field(description="extent of the shank along x in m")
    platform_gap_m: Length = Field(
        description="clearance between neighbouring platforms along x in m"
    )
    platform_depth_m: Length = Field(description="extent of shank and platform along y in m")
    platform_height_m: Length = Field(
        description="height of the platform's top above the foot in m"
    )
    platform_edge_m: Length = Field(description="thickness of the platform at its edges in m")
    flat_angle_deg: Angle = Field(
        description="inclination of the underside that the damper's flat side touches, in degrees from x, between 0 and 90"
    )
    curved_angle_deg: Angle = Field(
        description="inclination of the underside that the damper's curved side touches, in degrees from x, between 0 and 90"
    )
    airfoil_length_m: Length = Field(
        description="length of the airfoil from the platform to the tip in m"
    )
    hub_chord_m: Length = Field(description="chord of the airfoil at the platform in m")
    tip_chord_m: Length = Field(description="chord of the airfoil at the tip in m")
    hub_thickness_m: Length = Field(description="thickness of the airfoil at the platform in m")
    tip_thickness_m: Length = Field(description="thickness of the airfoil at the tip in m")
    camber: float = Field(
        0.0, ge=-0.3, le=0.3, description="height of the camber line over the chord, -0.3 to 0.3"
    )
    twist_deg: float = Field(
        0.0, ge=-90, le=90, description="rotation of the tip against the hub in degrees, -90 to 90"
    )
    force_span: float = Field(
        0.0,
        ge=0.0,
        lt=0.5,
        description="place of the force on blade 1's airfoil, as a fraction of the span from the hub, 0 to 0.5",
    )
    airfoil_size_m: Length = Field(description="element size in the airfoil in m")
    platform_size_m: Length = Field(description="element size in the platform in m")
    foot_size_m: Length = Field(description="element size in shank and foot in m")

    @model_validator(mode="after")
    def _fits(self) -> Self:
        self.library()
        return self

    def library(self) -> BladePair:
        """Return the geometry."""
        try:
            return BladePair(**arguments(self))
        except InputError as error:
            raise library_error(type(self), error) from None

    def nodes(self) -> float:
        """Return about how many nodes the mesh of both blades will have."""
        thickness = (self.hub_thickness_m + self.tip_thickness_m) / 2
        airfoil = self.airfoil_length_m * thickness * (self.hub_chord_m + self.tip_chord_m) / 2
        # a thin plate has at least one element across
        airfoil *= max(1.0, self.airfoil_size_m / thickness)
        shank = self.shank_thickness_m * self.platform_depth_m * self.platform_height_m
        platform = self.pitch_m * self.platform_depth_m * self.platform_edge_m * 2
        foot = self.foot_width_m * self.foot_depth_m * self.foot_height_m
        cubes = airfoil / self.airfoil_size_m**3 + platform / self.platform_size_m**3
        return 2 * NODES_A_CUBE * (cubes + (shank + foot) / self.foot_size_m**3)


# what a number may have been meant in, for messages
STRESSES = {"GPa": 1e9, "MPa": 1e6, "kPa": 1e3}
DENSITIES = {"g/cm³": 1e3, "kg/mm³": 1e9, "t/mm³": 1e12}


class MaterialTable(Section):
    """Material of the blades."""

    plausible: bool = Field(
        True,
        description="whether stiffness and density are checked against what solids have: true, or false where the numbers are right",
    )
    young_modulus_pa: Positive = Field(
        description="Young's modulus in Pa, greater than zero (steel: 2.1e11)"
    )
    poisson_ratio: float = Field(
        ge=0, lt=0.5, description="Poisson's ratio, from 0 to below 0.5 (steel: 0.3)"
    )
    density_kg_per_m3: Positive = Field(
        description="density in kg/m³, greater than zero (steel: 7850)"
    )

    @field_validator("young_modulus_pa", "density_kg_per_m3")
    @classmethod
    def _is_of_a_solid(cls, value: float, info: ValidationInfo) -> float:
        """Refuse what no solid has, as the readers of decks do."""
        stiff = info.field_name == "young_modulus_pa"
        (low, high), unit = (MODULI, "Pa") if stiff else (SOLIDS, "kg/m³")
        if low <= value <= high or not info.data.get("plausible", True):
            return value
        meant = [
            f", which is {value * factor:.4g} {unit} if it is in {name}"
            for name, factor in (STRESSES if stiff else DENSITIES).items()
            if low <= value * factor <= high
        ]
        raise custom_error(
            f"no solid has {value:g} {unit}{meant[0] if meant else ''}",
            f"Give a value from {low:g} to {high:g} {unit}, or material.plausible = false where the number is right.",
        )

    def library(self) -> Material:
        """Return the material."""
        return Material(**{k: v for k, v in arguments(self).items() if k != "plausible"})


class Damper(Section):
    """The rigid damper with a flat and a curved side."""

    apex_m: list[Place] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="the point [x, z] in m where the damper's contact planes meet; left out: where the platforms' undersides meet",
    )
    flat_angle_deg: Angle | None = Field(
        None,
        description="inclination of the flat side in degrees, between 0 and 90; left out: that of the platform",
    )
    curved_angle_deg: Angle | None = Field(
        None,
        description="inclination of the plane that touches the curved side in degrees, between 0 and 90; "
        "left out: that of the platform",
    )
    flat_distances_m: list[Length] = Field(
        min_length=2,
        max_length=2,
        description="distances of the lines [L1, L2] from the apex in m, the nearer first",
    )
    curved_distance_m: Length = Field(description="distance of the line R from the apex in m")
    curved_radius_m: Length = Field(description="radius of the curved side in m")
    sections_m: list[Place] = Field(
        min_length=1,
        max_length=20,
        description="axial positions y of the sections in m, growing; each holds one point a line",
    )
    mass_kg: Positive = Field(description="mass of the damper in kg, greater than zero")
    inertia_kg_m2: list[Positive] = Field(
        min_length=3,
        max_length=3,
        description="moments of inertia [x, y, z] about the centre of mass in kg m², greater than zero",
    )
    centre_m: list[Place] = Field(
        min_length=3,
        max_length=3,
        description="centre of mass [x, y, z] in m, measured from the apex",
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        try:
            FlatCurvedDamper(**arguments(self))
        except InputError as error:
            raise library_error(type(self), error) from None
        return self

    def library(self, blades: BladePair) -> FlatCurvedDamper:
        """Return the damper; what the table leaves out is taken from the platforms."""
        platforms: dict[str, Any] = {
            "apex": blades.wedge_apex,
            "flat_angle": blades.flat_angle,
            "curved_angle": blades.curved_angle,
        }
        return FlatCurvedDamper(**(platforms | arguments(self)))
