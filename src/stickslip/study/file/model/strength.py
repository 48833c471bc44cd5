"""The table [stress]: strength of the material, and how stress is judged."""

from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from stickslip.model.strength import Margin, StrengthCard, margin
from stickslip.model.strength.haigh import NO_COMPRESSION
from stickslip.study.file.quantities import refused_by
from stickslip.study.file.section import Positive, Section, custom_error

LIMITS = (
    "fatigue_limit_pa",
    "ultimate_pa",
    "yield_pa",
    "fracture_pa",
    "walker_exponent",
)
MeanStress = Literal["goodman", "gerber", "soderberg", "morrow", "walker"]


class Stress(Section):
    """Strength of the material. With a fatigue limit, every peak of [forced_response] gets its stress and its margin."""

    fatigue_limit_pa: Positive | None = Field(
        None, description="stress amplitude in Pa that is endured at R = -1; it asks for stress and margin"
    )
    ultimate_pa: Positive | None = Field(None, description="tensile strength in Pa, for goodman and gerber")
    yield_pa: Positive | None = Field(
        None,
        description="0.2 % proof stress in Pa: where the static stress is larger there is no margin; for soderberg",
    )
    fracture_pa: Positive | None = Field(None, description="true fracture strength in Pa, for morrow")
    walker_exponent: Positive | None = Field(None, le=1, description="Walker's exponent γ, for walker, up to 1")
    mean_stress: MeanStress = Field(
        "goodman", description="line of the Haigh diagram from the fatigue limit to the static limit"
    )
    above_yield: Literal["void", "shakedown"] = Field(
        "void",
        description="where the elastic static stress is above yield. void: there is no margin; shakedown: the mean stress is at most yield less the amplitude",
    )
    credit_in_compression: bool = Field(
        False, description="whether a compressive mean stress raises the allowed amplitude"
    )
    apart_m: Positive | None = Field(
        None,
        description="distance in m from contacts, joins, supports and loaded nodes within which stress is listed apart, as elastic stress is singular there; left out: one element",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        given = [name for name in type(self).model_fields if name in self.model_fields_set]
        if given and self.fatigue_limit_pa is None:
            raise custom_error(
                "is missing", "Give the fatigue limit at R = -1, or remove the table.", "fatigue_limit_pa"
            )
        if self.credit_in_compression and self.mean_stress in NO_COMPRESSION:
            problem = f"is true, and {self.mean_stress} has no branch in compression"
            raise custom_error(problem, "Leave it out, or choose goodman.", "credit_in_compression")
        if self.fatigue_limit_pa is not None:
            refused_by(StrengthCard, self._judged)
        return self

    def _judged(self) -> Margin:
        """Return a margin without stress; the card and the rule refuse what does not fit."""
        none = np.zeros(1)
        return margin(
            self.mean_stress,
            self.card(),
            none,
            none,
            above_yield=self.above_yield,
            credit_in_compression=self.credit_in_compression,
        )

    def card(self) -> StrengthCard:
        """Return the strength of the material."""
        own: dict[str, Any] = {name: getattr(self, name) for name in LIMITS}
        return StrengthCard(**own)
