"""The table [aero]: aerodynamic influence coefficients of a wheel."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from stickslip.study.file.model.bodies import Triple
from stickslip.study.file.model.loads import unit_direction
from stickslip.study.file.section import FilePath, Name, Positive, Section, custom_error


class AeroPoint(Section):
    """A point, or a whole node set, whose motion and force the coefficients relate."""

    on: Name = Field(
        description='a node set ("blade.tip": force shared equally, mean displacement), a node ("blade.node12") or a dof'
    )
    direction: Annotated[Triple | None, BeforeValidator(unit_direction)] = Field(
        None, description='"x", "y", "z", "-x" ... or a vector [x, y, z]; left out for single dofs'
    )


def _point(given: Any) -> Any:
    return {"on": given} if isinstance(given, str) else given


class AeroTable(Section):
    """Aerodynamic influence coefficients: forces on a blade from its own motion and its neighbours'."""

    file: FilePath = Field(
        description="CSV or TOML file of the coefficients, relative to the study: a column neighbour, recorded_on, wave_number or "
        "phase_angle_deg, and columns such as real_per_s2 and imag_per_s2"
    )
    reference_hz: Positive = Field(
        description="frequency of the vibration in Hz, greater than zero; the force is exact there where matrices represent it"
    )
    mode: int = Field(
        1,
        ge=1,
        le=200,
        description="number of the mode, from 1, where the file has no columns force_mode and motion_mode",
    )
    shapes: Literal["wave", "nodal_diameter", "blade_alone"] = Field(
        "wave",
        description="modes of the coefficients: wave (each wave has its own), nodal_diameter (modes of one nodal diameter, in all waves) or blade_alone (modes of a part with root and cyclic faces held)",
    )
    nodal_diameter: int | None = Field(None, ge=0, le=1000, description="of shapes = 'nodal_diameter': a whole number")
    clamped: Name | None = Field(
        None, description='of shapes = "blade_alone": the node set that holds it, such as "blade.root"'
    )
    largest_displacement_m: Positive | None = Field(
        None, description="largest displacement in m that the modes were scaled to; left out: they have unit mass"
    )
    over: Name | None = Field(None, description="part on which the largest displacement is looked for; left out: all")
    contacts: Literal["static", "stuck", "open"] = Field(
        "static", description="what contacts do in the modes: static, stuck or open, as in [modes]"
    )
    points: dict[Name, Annotated[AeroPoint, BeforeValidator(_point)]] = Field(
        default_factory=dict,
        description='names and places of points, where the coefficients belong to points: tip = {on = "blade.tip", direction = "x"}',
    )
    beyond: Literal["refuse", "nearest"] = Field(
        "refuse", description="frequencies outside of the table: refuse, or take the nearest of the table"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        pairs = (("nodal_diameter", "nodal_diameter"), ("clamped", "blade_alone"))
        for key, shapes in pairs:
            given = getattr(self, key) is not None
            if given and self.shapes != shapes:
                raise custom_error(
                    f"is given for shapes = {self.shapes!r}", f"Leave it out, or write shapes = {shapes!r}.", key
                )
            if not given and self.shapes == shapes:
                raise custom_error(f"is missing with shapes = {shapes!r}", "Say which it is.", key)
        of_modes = {"shapes", "mode", "largest_displacement_m", "over", "contacts"}
        strange = sorted(of_modes & self.model_fields_set) if self.points else []
        if strange:
            raise custom_error("belongs to modes, and the coefficients belong to points", "Leave one out.", strange[0])
        if self.over is not None and self.largest_displacement_m is None:
            raise custom_error("is given without largest_displacement_m", "Leave it out.", "over")
        return self
