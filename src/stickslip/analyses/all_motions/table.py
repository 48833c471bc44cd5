"""The table [all_motions] of a study file."""

from typing import Any, Self

from pydantic import Field, model_validator

from stickslip.study.file.harmonics import HIGHEST
from stickslip.study.file.section import Positive, Range, Section, custom_error, once, rising_pair


class AllMotionsTable(Section):
    """Search, within a budget, for motions that a sweep does not meet, and for the basins of attraction of all motions."""

    frequency_hz: Range = Field(description="the range [lowest, highest] in Hz of the sweep and of all branches")
    at_hz: list[Positive] | None = Field(
        None,
        min_length=1,
        max_length=200,
        description="frequencies in Hz that are searched; left out: `frequencies` of them, in the middle of equal parts of the range",
    )
    frequencies: int = Field(5, ge=1, le=200, description="number of frequencies that are searched, 1 to 200")
    solves: int = Field(
        10_000,
        ge=1,
        le=10_000_000,
        description="budget of deflated solves, starts in time and points of branches together: nothing new begins after it, branches end; deflation leaves half of it to time integration",
    )
    harmonics: int = Field(7, ge=1, le=HIGHEST, description=f"harmonics that are kept, 1 to {HIGHEST}")
    points: int = Field(40, ge=5, le=1000, description="least number of points of the sweep")
    tries: int = Field(
        12,
        ge=1,
        le=10_000,
        description="deflated solves in a row that find nothing new before a frequency is left, 1 to 10000",
    )
    starts: int = Field(
        20,
        ge=0,
        le=100_000,
        description="random states at each frequency that are integrated in time; 0: none, and no basins",
    )
    modes: int = Field(
        2,
        ge=1,
        le=1000,
        description="lowest modes, contacts stuck, in which the random states are drawn; no more than there are degrees of freedom",
    )
    spread: Positive = Field(
        1.5,
        description="largest modal amplitude of a random state, in units of the largest of the motions that are known",
    )
    periods: int = Field(
        1,
        ge=1,
        le=20,
        description="periods of the loads in one of the motion, 1 to 20: 3 to search motions of a third of the frequency, too",
    )
    most_periods: int = Field(
        1000, ge=10, le=1_000_000, description="periods after which a start that does not settle is given up"
    )
    steps: int = Field(512, ge=32, le=100_000, description="time steps in a period of the motion")
    seed: int = Field(0, ge=0, description="a whole number that the random states and starts are made from")

    @model_validator(mode="before")
    @classmethod
    def _no_clock(cls, given: Any) -> Any:
        if isinstance(given, dict) and "budget_s" in given:
            raise custom_error(
                "is no key any more: seconds of the clock gave other motions on a busy machine",
                "Give solves, a budget of deflated solves, starts in time and points of branches; 10000 is the default.",
                "budget_s",
            )
        return given

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.frequency_hz, "frequency_hz")
        once(self.at_hz or [], "at_hz")
        low, high = self.frequency_hz
        outside = [f for f in self.at_hz or [] if not low <= f <= high]
        if outside:
            raise custom_error(
                f"holds {outside[0]:g} Hz, outside frequency_hz = [{low:g}, {high:g}]",
                "Widen the range, or leave it out.",
                "at_hz",
            )
        least = 2 * self.periods * self.harmonics
        if least >= self.steps:
            over = f" over periods = {self.periods}" if self.periods > 1 else ""
            raise custom_error(
                f"is {self.steps}, too few for {self.harmonics} harmonics{over}", f"Give more than {least}.", "steps"
            )
        return self
