"""The table [resonance] of a study file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import Range, Section, custom_error, once, rising_pair


class ResonanceTable(Section):
    """Resonance peaks over a design parameter, each followed from value to value, without a sweep for each."""

    frequency_hz: Range = Field(
        description="the range [lowest, highest] in Hz in which peaks are looked for at the first and the last value"
    )
    parameter: str = Field(
        min_length=1,
        max_length=200,
        description="what varies: a key of the model, such as contact.flat.friction_coefficient, load.shaker.force_n or rotation.speed_rpm; or excitation, "
        "static_load (factors on all loads), or a field of the contact laws as Python names it, such as mu",
    )
    values: list[float] | None = Field(
        None,
        min_length=1,
        max_length=1000,
        description="values of the parameter in the order in which they are visited",
    )
    span: list[float] | None = Field(
        None,
        min_length=2,
        max_length=2,
        description="first and last value of the parameter, in place of values; the curve is followed by arc length round folds, which takes minutes over a key of the model where a contact begins to slip at the peak",
    )
    points: int = Field(30, ge=2, le=1000, description="least number of points of a span, 2 to 1000")
    by: Literal["horizontal_tangent", "phase_quadrature", "variable_phase"] = Field(
        "horizontal_tangent",
        description="what makes a peak: horizontal_tangent (the largest amplitude), phase_quadrature (90° behind the force) or variable_phase (with the "
        "phase of the largest amplitude beside the last peak)",
    )
    peaks: int = Field(3, ge=1, le=20, description="most peaks that are followed, the highest first, 1 to 20")
    harmonic: int | None = Field(
        None,
        ge=1,
        le=HIGHEST,
        description="harmonic whose amplitude peaks, such as 3 of a superharmonic resonance; left out: what the loads drive",
    )
    periods: int = Field(
        1,
        ge=1,
        le=20,
        description="periods of the loads after which the motion repeats itself, 1 to 20: 2 or more are subharmonic resonances, whose lowest harmonic peaks",
    )
    harmonics: int = Field(5, ge=1, le=HIGHEST, description=f"harmonics that are kept, 1 to {HIGHEST}")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.frequency_hz, "frequency_hz")
        if (self.values is None) == (self.span is None):
            both = "are both there" if self.values is not None else "are both missing"
            raise custom_error(f"values and span {both}", "Give one of them.", "values")
        once(self.values or [], "values")
        once(self.span or [], "span")
        self._vibrates()
        if self.harmonic is not None and self.harmonic > self.harmonics:
            raise custom_error(
                f"is {self.harmonic}, above harmonics = {self.harmonics}", "Raise harmonics.", "harmonic"
            )
        if self.periods > self.harmonics:
            raise custom_error(
                f"is {self.periods}, above harmonics = {self.harmonics}",
                "Raise harmonics: the loads are in that one.",
                "periods",
            )
        return self

    def _vibrates(self) -> None:
        key = "values" if self.values is not None else "span"
        for value in self.values or self.span or []:
            if self.parameter == "excitation" and value <= 0.0:
                raise custom_error(
                    f"holds {value:g}, and excitation is a factor on what makes the peaks",
                    "Give factors above zero.",
                    key,
                )

    @property
    def ends(self) -> tuple[float, float]:
        """First and last value of the parameter."""
        own = self.values or self.span or []
        return float(own[0]), float(own[-1])
