"""The table [residual_tractions] of a study file."""

from typing import Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import Range, Section, rising_pair


class ResidualTractionsTable(Section):
    """Bounds of the response over the residual tractions that sticking contacts may have kept from before."""

    frequency_hz: Range = Field(
        description="the range [lowest, highest] in which the bounds are computed, Hz; it should hold the resonance",
    )
    points: int = Field(25, ge=3, le=2000, description="frequencies in the range, 3 to 2000")
    harmonics: int = Field(5, ge=1, le=HIGHEST, description=f"harmonics of the motions, 1 to {HIGHEST}")
    starts: int = Field(
        4,
        ge=0,
        le=10_000,
        description="random starts of the search at each frequency, beside its fixed starts, 0 to 10000",
    )
    seed: int = Field(0, ge=0, le=2**32 - 1, description="seed of the random starts")
    in_time: bool = Field(
        True,
        description="whether both ends of the resonance are followed in time with the tractions they stand for; a tuned wheel is not",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.frequency_hz, "frequency_hz")
        return self
