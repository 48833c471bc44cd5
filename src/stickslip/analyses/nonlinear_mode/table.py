"""The table [nonlinear_mode] of a study file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import ModeNumbers, Positive, Range, Section, WaveNumbers, once, rising_pair


class NonlinearModeTable(Section):
    """Frequency and damping ratio of modes over their amplitude, contacts stuck, slipping and lifting off."""

    modes: ModeNumbers = Field(
        [1],
        description="numbers of the modes that are followed, by frequency with contacts stuck, from 1",
    )
    wave_numbers: WaveNumbers | None = Field(
        None,
        description="wave numbers of a wheel, 0 to n - 1 with n sectors (k below n/2 travels backward, n - k forward); left out: the wave of the loads' engine order, without loads all",
    )
    amplitude_mm: Range | None = Field(
        None,
        description="the range [lowest, highest] of the amplitude of the peak output, as long as the motion has the shape of the linear mode; left "
        "out: from where nothing slips to 300 times where slip begins, or on to gross slip; springs that neither slip nor open need it",
    )
    points: int = Field(30, ge=5, le=1000, description="least number of points, 5 to 1000")
    harmonics: int = Field(5, ge=1, le=HIGHEST, description=f"least number of harmonics, 1 to {HIGHEST}")
    most_harmonics: int = Field(
        23,
        ge=1,
        le=HIGHEST,
        description=f"up to which harmonics are raised where frequency or damping ratio ask for it, 1 to {HIGHEST}",
    )
    accuracy_percent: Positive = Field(
        0.1, description="relative change of frequency or damping ratio by more harmonics below which these are enough"
    )
    to_gross_slip: bool = Field(
        False,
        description="whether a mode ends where every contact that can slip has slipped, of several sliders all of them, or opened",
    )
    concept: Literal["periodic", "decaying"] = Field(
        "periodic",
        description="definition of the mode, by periodic motions sustained by mass-proportional negative damping (Krack 2015) or by decaying motions (Laxalde and Thouverez 2009); both agree for small damping",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for key in ("wave_numbers", "modes"):
            once(getattr(self, key) or [], key)
        rising_pair(self.amplitude_mm or [], "amplitude_mm", "amplitude")
        return self
