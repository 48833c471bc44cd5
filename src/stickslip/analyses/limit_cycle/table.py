"""The table [limit_cycle] of a study file."""

from typing import Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import ModeNumbers, Positive, Range, Section, WaveNumbers, once, rising_pair

MODES = 6  # modes of each wave that are examined, unless the study names modes


class LimitCycleTable(Section):
    """Self-excited motions: the amplitudes to which friction limits them, and the modes that it cannot limit."""

    wave_numbers: WaveNumbers | None = Field(
        None,
        description="wave numbers of a wheel, 0 to n - 1 with n sectors (k below n/2 travels backward, n - k forward); left out: waves that are unstable with contacts stuck",
    )
    modes: ModeNumbers | None = Field(
        None,
        description=f"numbers of modes, by frequency with contacts stuck, from 1; left out: the unstable ones among the first {MODES}, of a mistuned wheel "
        f"{MODES} of each sector",
    )
    amplitude_mm: Range | None = Field(
        None,
        description="the range [lowest, highest] of the amplitude of the peak output; left out: from where nothing slips to 300 times "
        "where slip begins",
    )
    points: int = Field(30, ge=5, le=1000, description="least number of amplitudes in the range, 5 to 1000")
    harmonics: int = Field(
        5, ge=1, le=HIGHEST, description=f"harmonics of the curve over the amplitude, 1 to {HIGHEST}"
    )
    most_harmonics: int = Field(
        41,
        ge=1,
        le=HIGHEST,
        description=f"up to which harmonics of each limit cycle are raised until it stays, 1 to {HIGHEST}",
    )
    accuracy_percent: Positive = Field(
        0.001, description="change of amplitude and frequency by twice the harmonics below which these are enough"
    )
    in_time: bool = Field(
        False,
        description="compare stable limit cycles with time integration, and integrate all unstable waves together to see which one wins; --verify does the same",
    )
    periods: int = Field(400, ge=50, le=100_000, description="most periods of a time integration, 50 to 100000")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        for key in ("wave_numbers", "modes"):
            once(getattr(self, key) or [], key)
        rising_pair(self.amplitude_mm or [], "amplitude_mm", "amplitude")
        return self
