"""The table [stress]: strength of the materials, and how stress is judged."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from stickslip.model.strength import StrengthCard, criterion_doubt, margin
from stickslip.model.strength.cycle import Criterion
from stickslip.model.strength.haigh import NO_COMPRESSION
from stickslip.study.file.quantities import refused_by
from stickslip.study.file.section import Name, Positive, Section, custom_error

LIMITS = (
    "fatigue_limit_pa",
    "fatigue_limit_r0_pa",
    "torsion_limit_pa",
    "ultimate_pa",
    "yield_pa",
    "fracture_pa",
    "walker_exponent",
)
MeanStress = Literal["goodman", "gerber", "soderberg", "morrow", "walker"]
OF_A_LINE = {"fracture_pa": "morrow", "walker_exponent": "walker"}
OF_CRITERIA = ("torsion_limit_pa", "fatigue_limit_r0_pa")


class _Limits(Section):
    """Limits of a material."""

    fatigue_limit_pa: Positive | None = Field(
        None, description="stress amplitude in Pa that is endured at R = -1; it asks for stress and margin"
    )
    fatigue_limit_r0_pa: Positive | None = Field(
        None, description="stress amplitude in Pa, half of the range, that is endured at R = 0, for a criterion"
    )
    torsion_limit_pa: Positive | None = Field(
        None, description="shear stress amplitude in Pa that is endured under alternating torsion, for a criterion"
    )
    ultimate_pa: Positive | None = Field(None, description="tensile strength in Pa, for goodman and gerber")
    yield_pa: Positive | None = Field(
        None,
        description="0.2 % proof stress in Pa: where the static stress is larger there is no margin; for soderberg",
    )
    fracture_pa: Positive | None = Field(None, description="true fracture strength in Pa, for morrow")
    walker_exponent: Positive | None = Field(None, le=1, description="Walker's exponent γ, for walker, up to 1")

    @property
    def given(self) -> list[str]:
        """Names of the limits that it has."""
        return [name for name in LIMITS if getattr(self, name) is not None]


class StrengthRow(_Limits):
    """Limits of a material at one temperature, of the kinds of [stress]."""

    temperature_c: float = Field(ge=-273.15, le=5000, description="temperature in °C")


class StrengthTable(_Limits):
    """Strength of the material of one part, instead of the limits of [stress]."""

    over_temperature: list[StrengthRow] | None = Field(
        None,
        min_length=2,
        max_length=200,
        description="the tables [[stress.over_temperature]]: limits at rising temperatures of the nodes; linear between, constant below, refused above",
    )

    @model_validator(mode="after")
    def _rows_agree(self) -> Self:
        rows = self.over_temperature or []
        if any(second.temperature_c <= first.temperature_c for first, second in pairwise(rows)):
            told = [row.temperature_c for row in rows]
            raise custom_error(f"has temperatures {told}", "Give rising ones.", "over_temperature")
        every = {name for row in rows for name in row.given}
        if rows and not every:
            raise custom_error("has temperatures and no limit", "Give limits in each row.", "over_temperature")
        for name in LIMITS:
            if name in every and getattr(self, name) is not None:
                raise custom_error("is given beside over_temperature", "Give it in one of both.", name)
            lacking = [row.temperature_c for row in rows if name in every and name not in row.given]
            if lacking:
                problem = f"lacks {name} at {lacking[0]:g} °C"
                raise custom_error(problem, "Give it in each row, or once for all.", "over_temperature")
        return self

    @property
    def has_limit(self) -> bool:
        """Whether it gives the fatigue limit."""
        return any("fatigue_limit_pa" in own.given for own in (self, *(self.over_temperature or ())))

    @property
    def known(self) -> set[str]:
        """Names of the limits that it has, at one temperature or over it."""
        return {name for own in (self, *(self.over_temperature or ())) for name in own.given}

    def strength(self) -> StrengthCard:
        """Return the strength of the material."""
        own: dict[str, Any] = {name: getattr(self, name) for name in self.given}
        rows = self.over_temperature or []
        own |= {name: tuple(getattr(row, name) for row in rows) for name in (rows[0].given if rows else ())}
        return StrengthCard(temperatures=tuple(row.temperature_c for row in rows), **own)


class Stress(StrengthTable):
    """Strength of the material. With a fatigue limit, every peak of [forced_response] gets its stress and its margin."""

    card: dict[Name, StrengthTable] = Field(
        default_factory=dict,
        description="the tables [stress.card.NAME], limits of the part NAME; the limits of [stress] hold for all other parts",
    )
    mean_stress: MeanStress = Field(
        "goodman", description="line of the Haigh diagram from the fatigue limit to the static limit"
    )
    criterion: Criterion | None = Field(
        None,
        description="criterion for multiaxial fatigue instead of a line of the Haigh diagram: crossland, dang_van or findley (with torsion_limit_pa or fatigue_limit_r0_pa), or sines (with fatigue_limit_r0_pa)",
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

    @property
    def asked(self) -> bool:
        """Whether stress and margin are asked for."""
        return self.has_limit or bool(self.card)

    @property
    def rule(self) -> str:
        """Name of the criterion, or of the line of the Haigh diagram."""
        return self.criterion or self.mean_stress

    def table_of(self, part: str) -> StrengthTable | None:
        """Return the limits of a part; None if it has none."""
        return self.card.get(part, self if self.has_limit else None)

    @property
    def idle(self) -> str:
        """What has no effect, as a sentence; empty: nothing."""
        given = {name for own in (self, *self.card.values()) for name in own.known}
        unused = [name for name, line in OF_A_LINE.items() if name in given and self.rule != line]
        unused += [name for name in OF_CRITERIA if name in given and self.criterion is None]
        verb = "has" if len(unused) == 1 else "have"
        return f"{' and '.join(unused)} of [stress] {verb} no effect with {self.rule}" if unused else ""

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.model_fields_set and not self.asked:
            raise custom_error(
                "is missing", "Give the fatigue limit at R = -1, or remove the table.", "fatigue_limit_pa"
            )
        if self.known and not self.has_limit:
            raise custom_error(
                "is missing beside other limits", "Give it, or limits in [stress.card.NAME] alone.", "fatigue_limit_pa"
            )
        if self.criterion is not None:
            for key, meant in (("mean_stress", "has its own mean stress"), ("above_yield", "voids places above yield")):
                if key in self.model_fields_set and (key == "mean_stress" or self.above_yield != "void"):
                    raise custom_error(f"is given, and {self.criterion} {meant}", "Leave one of both out.", key)
        if self.credit_in_compression and self.rule in NO_COMPRESSION:
            problem = f"is true, and {self.rule} has no branch in compression"
            raise custom_error(problem, "Leave it out, or choose goodman.", "credit_in_compression")
        for path, table in self._cards():
            self._judged(path, table)
        return self

    def _cards(self) -> Iterator[tuple[str, StrengthTable]]:
        if self.has_limit:
            yield "", self
        for name, table in self.card.items():
            if not table.has_limit:
                raise custom_error("is missing", "Give the fatigue limit at R = -1.", f"card.{name}.fatigue_limit_pa")
            yield f"card.{name}.", table

    def _judged(self, path: str, table: StrengthTable) -> None:
        """Judge without stress: the card and the rule refuse what does not fit."""
        try:
            card = refused_by(StrengthCard, table.strength)
            refused_by(StrengthCard, lambda: self._tried(card.at(np.array(card.temperatures or (0.0,)))))
        except PydanticCustomError as error:
            told: dict[str, Any] = dict(error.context or {})
            key = told["key"] or "over_temperature"
            raise custom_error(told["problem"], told["remedy"], f"{path}{key}") from None

    def _tried(self, card: StrengthCard) -> object:
        if self.criterion is not None:
            return criterion_doubt(self.criterion, card)
        return margin(
            self.mean_stress,
            card,
            np.zeros(1),
            np.zeros(1),
            above_yield=self.above_yield,
            credit_in_compression=self.credit_in_compression,
        )
