"""The tables of analyses by waves: [modes], [campbell], [safe] and [flutter]."""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from stickslip.study.file.section import FilePath, Section, custom_error, once, rising_pair
from stickslip.units import RPM

Speed = Annotated[float, Field(ge=0, le=1e7)]  # rpm
Order = Annotated[int, Field(ge=1, le=1000)]
Diameter = Annotated[int, Field(ge=0, le=1000)]


class WaveTable(Section):
    """Table of an analysis of small vibrations."""

    contacts: Literal["static", "stuck", "open"] = Field(
        "static",
        description="what contacts do: static (those pressed by the static loads stick, the others are open), stuck or open",
    )


class ModesTable(WaveTable):
    """Natural frequencies and mode shapes for each nodal diameter."""

    number: int = Field(6, ge=1, le=200, description="number of modes of each nodal diameter, 1 to 200")
    nodal_diameters: list[Diameter] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="nodal diameters, a list of whole numbers from 0 to half the number of sectors; left out: all",
    )
    shapes: bool = Field(True, description="store the mode shapes on the skin: true or false")
    reference: FilePath | None = Field(
        None,
        description="CSV file of frequencies to compare with, relative to the study; columns nodal_diameter, mode (1 is the "
        "lowest), frequency_hz, and speed_rpm if it shall be told where that is another speed",
    )
    reference_case: str | None = Field(
        None, max_length=100, description="keep only the rows of the reference whose column 'case' has this value"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        once(self.nodal_diameters or [], "nodal_diameters")
        if self.reference_case is not None and self.reference is None:
            raise custom_error("is given without a reference", "Name the CSV file, or leave it out.", "reference_case")
        return self


class CampbellTable(WaveTable):
    """Frequencies against rotor speed and their crossings with engine orders."""

    speeds_rpm: list[Speed] = Field(
        min_length=2, max_length=2, description="the range [lowest, highest] of the speed in rpm, the lower first"
    )
    points: int = Field(9, ge=2, le=1000, description="number of speeds in the range, 2 to 1000")
    engine_orders: list[Order] = Field(
        min_length=1, max_length=200, description="engine orders, a list of whole numbers from 1"
    )
    modes: int = Field(4, ge=1, le=100, description="number of modes that are followed, 1 to 100")
    nodal_diameters: list[Diameter] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="nodal diameters; left out: the ones that the engine orders excite",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        once(self.engine_orders, "engine_orders")
        once(self.nodal_diameters or [], "nodal_diameters")
        rising_pair(self.speeds_rpm, "speeds_rpm", "speed")
        return self

    @property
    def speeds(self) -> tuple[float, ...]:
        """Speeds in rad/s."""
        return tuple(RPM * np.linspace(self.speeds_rpm[0], self.speeds_rpm[1], self.points))


class SafeTable(WaveTable):
    """Modes that engine orders can excite at one speed (SAFE or interference diagram)."""

    speed_rpm: Speed | None = Field(None, description="speed in rpm, above zero; left out: as in [rotation]")
    engine_orders: list[Order] = Field(
        min_length=1, max_length=200, description="engine orders, a list of whole numbers from 1"
    )
    margin_percent: float = Field(
        5.0,
        gt=0,
        lt=100,
        description="a mode that an engine order would meet within this change of speed is called a near resonance, in percent",
    )
    modes: int = Field(6, ge=1, le=200, description="number of modes of each nodal diameter, 1 to 200")

    @model_validator(mode="after")
    def _differ(self) -> Self:
        once(self.engine_orders, "engine_orders")
        return self


class FlutterTable(WaveTable):
    """Aerodynamic damping and flutter margin of each wave, by the energy method and by eigenvalues."""

    number: int | None = Field(
        None,
        ge=1,
        le=200,
        description="number of modes of each wave, 1 to 200; left out: up to the highest that [aero] has coefficients of",
    )
    nodal_diameters: list[Diameter] | None = Field(
        None,
        min_length=1,
        max_length=501,
        description="nodal diameters, a list of whole numbers from 0 to half the number of sectors; left out: all. Both directions of each are looked at",
    )
    required_percent: float = Field(
        0.0,
        ge=-100,
        le=100,
        description="damping ratio in % that every wave must have, structural damping included; 0: none may grow",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        once(self.nodal_diameters or [], "nodal_diameters")
        return self
