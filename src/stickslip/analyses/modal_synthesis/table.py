"""The table [modal_synthesis] of a study file."""

from typing import Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import Positive, Range, Section, once, rising_pair


class ModalSynthesisTable(Section):
    """The forced response at many levels of the loads from one nonlinear mode, as long as that mode answers alone."""

    mode: int = Field(1, ge=1, le=999, description="number of the mode, by frequency with contacts stuck, from 1")
    levels: list[Positive] = Field(
        [1.0], min_length=1, max_length=1000, description="factors on the harmonic loads, one response each"
    )
    frequency_hz: Range | None = Field(
        None,
        description="the range [lowest, highest] of the responses; left out: around their peaks",
    )
    direct: bool = Field(
        False,
        description="whether each response is solved directly as well, as [forced_response] does, to show the error",
    )
    passage_hz_per_s: list[Positive] = Field(
        [],
        max_length=20,
        description="rates at which the frequency is swept through the range, each level at each of them; left out: none",
    )
    passage_down: bool = Field(False, description="whether the frequency falls in these passages")
    amplitude_mm: Range | None = Field(
        None,
        description="the range [lowest, highest] of the amplitude of the nonlinear mode at the peak output; left out: from where nothing slips to "
        "300 times where slip begins",
    )
    points: int = Field(30, ge=5, le=1000, description="least number of points of the nonlinear mode, 5 to 1000")
    harmonics: int = Field(5, ge=1, le=HIGHEST, description=f"harmonics of the nonlinear mode, 1 to {HIGHEST}")
    most_harmonics: int = Field(
        23,
        ge=1,
        le=HIGHEST,
        description=f"up to which harmonics are raised where they change the nonlinear mode or the direct response, 1 to {HIGHEST}",
    )
    accuracy_percent: Positive = Field(
        0.1, description="relative change of frequency or damping ratio by more harmonics below which these are enough"
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        once(self.levels, "levels")
        once(self.passage_hz_per_s, "passage_hz_per_s")
        rising_pair(self.amplitude_mm or [], "amplitude_mm", "amplitude")
        rising_pair(self.frequency_hz or [], "frequency_hz", "frequency")
        return self
