"""The tables [part.NAME.sets.NAME]: node sets of a file that a study picks, by names, in a box, in a cylinder."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from stickslip.study.file.model.bodies import Triple
from stickslip.study.file.section import Section, custom_error

Pair = Annotated[list[Triple], Field(min_length=2, max_length=2)]


class SetTable(Section):
    """A node set: the nodes that all of its conditions hold for."""

    pattern: str | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="nodes of all sets of the file whose names fit, capitals aside; * stands for any letters, ? for one, "
        'such as "SHROUD_*"',
    )
    box_m: Pair | None = Field(
        None, description="two corners [[x, y, z], [x, y, z]] in m, along the axes, of the box that holds them"
    )
    cylinder_m: Pair | None = Field(
        None,
        description="two points [[x, y, z], [x, y, z]] in m on the axis of the cylinder that holds them, at its ends; goes with "
        "radius_m",
    )
    radius_m: Annotated[list[Annotated[float, Field(ge=0)]], Field(min_length=2, max_length=2)] | None = Field(
        None, description="inner and outer radius [m, m] of the cylinder; 0 inside: it is full"
    )

    @model_validator(mode="after")
    def _picks(self) -> Self:
        if self.pattern is None and self.box_m is None and self.cylinder_m is None:
            raise custom_error("picks nothing", "Give pattern, box_m, or cylinder_m with radius_m.", "pattern")
        if (self.cylinder_m is None) != (self.radius_m is None):
            key = "cylinder_m" if self.cylinder_m is None else "radius_m"
            raise custom_error("is missing beside the other", "Give both or neither.", key)
        if self.cylinder_m is not None and self.cylinder_m[0] == self.cylinder_m[1]:
            raise custom_error("has no length", "Give two points, one at each end.", "cylinder_m")
        if self.radius_m is not None and self.radius_m[0] >= self.radius_m[1]:
            raise custom_error(f"must rise, got {self.radius_m}", "Give the inner radius first.", "radius_m")
        return self
