"""The table [quasi_periodic] of a study file."""

from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from stickslip.study.file.section import Positive, Range, Section, custom_error, rising_pair

MOST_ORDER = 31


class QuasiPeriodicTable(Section):
    """Motions with two frequencies that are no multiples of each other."""

    frequency_hz: Range | None = Field(
        None,
        description="the range [lowest, highest] in Hz of the first frequency, the frequency of all loads without their own",
    )
    frequencies_hz: Annotated[list[Positive], Field(min_length=1, max_length=1000)] | None = Field(
        None, description="first frequencies of your own in Hz instead of a range, growing"
    )
    points: int = Field(10, ge=2, le=1000, description="first frequencies in the range, 2 to 1000")
    second_hz: Positive | None = Field(
        None,
        description="frequency in Hz near which a second tone is sought where no load has its own frequency; left out: near modes that grow with contacts stuck and near the multipliers of the forced motion",
    )
    second_wave: int | None = Field(
        None,
        ge=0,
        le=999,
        description="wave number of the second tone on a tuned wheel; left out: the wave that grows most",
    )
    harmonics: int = Field(
        3,
        ge=1,
        le=MOST_ORDER,
        description=f"sums |j| + |k| of combined frequencies j f1 + k f2 that are kept at first, 1 to {MOST_ORDER}",
    )
    most_harmonics: int = Field(
        15,
        ge=1,
        le=MOST_ORDER,
        description=f"up to which sum combined frequencies are added where contact forces move them, 1 to {MOST_ORDER}",
    )
    accuracy_percent: Positive = Field(
        1.0,
        description="root mean square of what is left out, in percent of the motion of the contacts, below which combined frequencies are enough",
    )
    in_time: bool | None = Field(
        None,
        description="whether each motion is compared with time integration, which also tells whether it is left; for single structures; left out: "
        "where that is estimated to take less than half a minute",
    )

    @property
    def first_hz(self) -> list[float]:
        """First frequencies, Hz."""
        if self.frequencies_hz is not None:
            return list(self.frequencies_hz)
        low, high = self.frequency_hz or (1.0, 1.0)
        return [float(f) for f in np.linspace(low, high, self.points)]

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        given = [k for k in ("frequency_hz", "frequencies_hz") if getattr(self, k) is not None]
        if len(given) != 1:
            problem = "is missing" if not given else "cannot stand beside frequency_hz"
            raise custom_error(problem, "Give one of frequency_hz and frequencies_hz.", (given or ["frequency_hz"])[-1])
        rising_pair(self.frequency_hz or [], "frequency_hz")
        own = self.frequencies_hz or []
        if any(b <= a for a, b in pairwise(own)):
            raise custom_error("must grow", "Sort them, and give each once.", "frequencies_hz")
        if self.most_harmonics < self.harmonics:
            raise custom_error("is less than harmonics", "Raise it.", "most_harmonics")
        return self
