"""The tables [mistuning.NAME]: differences between blades, contacts and sectors."""

from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from stickslip.study.file.section import FilePath, Name, Positive, Section, custom_error, refuse_all

MODES = 6  # default number of blade-alone modes to which a deviation applies
MOST_MODES = 200  # largest number of a blade's mode in a study or a file
Deviation = Annotated[float, Field(ge=-0.5, le=0.5)]
KINDS = ("of", "contact", "part")
WAYS = ("deviations", "gaps_m", "distribution", "file")
# key -> the key without which it has no meaning
BESIDE = {
    "beyond_radius_m": "of",
    "modes": "of",
    "sector": "part",
    "by": "part",
    "standard_deviation": "distribution",
    "standard_deviation_m": "distribution",
    "seed": "distribution",
    "relative_to": "file",
}


class MistuningTable(Section):
    """Mistuning: sectors differ in their blades (`of`), in a contact (`contact`), or one sector in a part (`part`)."""

    of: Name | None = Field(
        None, description='blades that differ: a part, or a node set of one such as "blade.airfoil"'
    )
    beyond_radius_m: Positive | None = Field(
        None,
        description="distance from the axis of rotation in m, greater than zero, beyond which blades are mistuned; left out: everywhere",
    )
    contact: Name | None = Field(None, description="name of the contact that differs")
    part: Name | None = Field(None, description="part that is another one in a single sector")
    sector: int | None = Field(None, ge=0, le=10_000, description="of part: number of that sector, from 0")
    by: Name | None = Field(
        None,
        description="of part: the part [part.NAME] that stands there instead, with the same nodes; it is nowhere else",
    )
    quantity: Literal["frequency", "stiffness", "friction_coefficient", "slip_limit", "preload", "gap"] | None = Field(
        None,
        description="what differs: of blades frequency (the default) or stiffness; of contacts friction_coefficient, slip_limit, "
        "stiffness, preload or gap",
    )
    deviations: list[Deviation] | None = Field(
        None,
        min_length=1,
        max_length=10_000,
        description="relative deviation of each sector from the first one on, -0.5 to 0.5; a shorter list is repeated",
    )
    gaps_m: list[float] | None = Field(
        None,
        min_length=1,
        max_length=10_000,
        description='of quantity = "gap": clearance in m that each sector has more; a shorter list is repeated',
    )
    distribution: Literal["normal", "uniform"] | None = Field(
        None, description="of random deviations: normal or uniform"
    )
    standard_deviation: Annotated[float, Field(gt=0, le=0.2)] | None = Field(
        None, description="of random deviations but gaps, relative, above 0 to 0.2"
    )
    standard_deviation_m: Positive | None = Field(None, description="of random gaps in m, greater than zero")
    seed: int = Field(1, ge=0, le=2**31, description="of random deviations: the same seed gives the same")
    file: FilePath | None = Field(
        None,
        description="CSV file of measured blade-alone frequencies, relative to the study; columns blade (from 0), mode (from 1), "
        "frequency_hz",
    )
    relative_to: Literal["mean", "model"] = Field(
        "mean",
        description="of a file: deviations are taken from the mean of each mode over the blades, or from the frequencies of the model's "
        "blade by itself",
    )
    modes: Annotated[int, Field(ge=1, le=MOST_MODES)] | Literal["all"] = Field(
        MODES,
        description="of blades: number of blade-alone modes that carry the deviation, or all (whatever the blade does; long for wheels "
        "of many blades); a file says it itself",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        kinds = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(kinds) != 1:
            found = " and ".join(kinds) or "neither"
            raise custom_error(
                f"needs one of of, contact and part, got {found}",
                'Say what differs: of = "blade.airfoil", contact = "shroud", or part = "blade".',
            )
        if self.part is None:
            self._quantity()
            self._pattern()
        refuse_all([*self._missing_of_part(), *self._idle()])
        return self

    def _quantity(self) -> None:
        wanted = ("frequency", "stiffness") if self.of else None
        known = wanted or ("friction_coefficient", "slip_limit", "stiffness", "preload", "gap")
        if (self.quantity is None and not self.of) or (self.quantity is not None and self.quantity not in known):
            raise custom_error(
                "is missing" if self.quantity is None else f"is {self.quantity}",
                f"Give one of {', '.join(known)}.",
                "quantity",
            )

    def _pattern(self) -> None:
        given = [key for key in WAYS if getattr(self, key) is not None]
        if len(given) != 1:
            raise custom_error(
                f"needs one of {', '.join(WAYS)}, got {' and '.join(given) or 'neither'}",
                'For example distribution = "normal" with standard_deviation = 0.01.',
            )
        gap = self.quantity == "gap"
        if (given[0] == "deviations" and gap) or (given[0] == "gaps_m" and not gap):
            raise custom_error(
                f"does not go with quantity = {self.quantity!r}",
                "Gaps are gaps_m, everything else deviations.",
                given[0],
            )
        spread, other = "standard_deviation", "standard_deviation_m"
        spread, other = (other, spread) if gap else (spread, other)
        if self.distribution is not None and getattr(self, other) is not None:
            raise custom_error(
                f"is {getattr(self, other):g} beside quantity = {self.quantity or 'frequency'!r}",
                f"Give {spread} instead: gaps scatter by standard_deviation_m, everything else by standard_deviation.",
                other,
            )
        if self.distribution is not None and getattr(self, spread) is None:
            raise custom_error("is missing beside distribution", "Say how much it scatters.", spread)
        if self.file is not None and (self.of is None or self.quantity == "stiffness"):
            raise custom_error("is of blades' frequencies", "Give a list of deviations.", "file")

    def _missing_of_part(self) -> Iterator[PydanticCustomError]:
        if self.part is None:
            return
        for key in ("sector", "by"):
            if getattr(self, key) is None:
                yield custom_error("is missing beside part", "Say which sector, and what stands there.", key)
        for key in ("quantity", *WAYS):
            if getattr(self, key) is not None:
                yield custom_error("is given beside part", "A part of its own has no pattern.", key)

    def _idle(self) -> Iterator[PydanticCustomError]:
        """Yield errors about keys without any effect."""
        for key, needed in BESIDE.items():
            if key in self.model_fields_set and getattr(self, needed) is None:
                yield custom_error(
                    f"is {getattr(self, key)!r} without {needed}, and means nothing there",
                    f"Leave it out, or give {needed}.",
                    key,
                )
        for key in ("quantity", "modes"):
            if self.file is not None and key in self.model_fields_set:
                yield custom_error(
                    f"is {getattr(self, key)!r} beside file, which says it itself",
                    "Leave it out: the file has frequencies, of the modes it names.",
                    key,
                )
