"""The tables of a study file: keys with their unit, ranges, and the library object each becomes."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from stickslip.contact.compiled import Evaluator
from stickslip.study.messages import custom_error

Positive = Annotated[float, Field(gt=0)]


class Section(BaseModel):
    """A table of the study file: unknown keys, non-finite numbers and quiet conversions are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def rising_pair(values: list[float], key: str) -> None:
    """Refuse a pair that does not rise."""
    if len(values) == 2 and not values[0] < values[1]:
        raise custom_error(
            f"must be the lower before the higher, got {values}",
            "Give the lower frequency first.",
            key,
        )


class Reduction(Section):
    """Craig-Bampton reduction of the blade pair."""

    fixed_interface_modes: int = Field(
        25,
        ge=1,
        le=500,
        description="number of fixed-interface modes kept beside the static ones, 1 to 500",
    )


class Damping(Section):
    """Structural damping of the blades, proportional to mass and stiffness."""

    ratio: float = Field(
        ge=0, lt=1, description="damping ratio at the two frequencies of between_hz, 0 to 1"
    )
    between_hz: list[Positive] = Field(
        min_length=2, max_length=2, description="two frequencies in Hz, the lower first"
    )

    @model_validator(mode="after")
    def _rises(self) -> Self:
        rising_pair(self.between_hz, "between_hz")
        return self


class Loads(Section):
    """Static pull on the damper and harmonic force on one blade."""

    centrifugal_n: Positive = Field(
        description="centrifugal load on the damper in N, greater than zero"
    )
    ratios: list[Annotated[float, Field(gt=0, le=1e6)]] = Field(
        min_length=1,
        max_length=100,
        description="ratios of centrifugal load to excitation amplitude, a list of 1 to 100 numbers above zero",
    )
    excitation_direction: Literal["x", "y", "z"] = Field(
        "x", description="direction of the harmonic force: x (blade bending), y or z"
    )

    @model_validator(mode="after")
    def _differ(self) -> Self:
        if len(set(self.ratios)) < len(self.ratios):
            raise custom_error(
                f"holds a number twice, got {self.ratios}", "Give every ratio once.", "ratios"
            )
        return self


class SweepTable(Section):
    """Range and step of the frequency sweep."""

    frequency_hz: list[Positive] = Field(
        min_length=2,
        max_length=2,
        description="the range [lowest, highest] in Hz, the lower frequency first",
    )
    points: int = Field(
        40,
        ge=2,
        le=10_000,
        description="smallest number of points of the first passage, 2 to 10000",
    )
    peak_points: int = Field(
        8, ge=0, le=100, description="most points added to resolve the peak, 0 to 100"
    )

    frequencies: int | None = Field(
        None,
        ge=2,
        le=10_000,
        description="number of equally spaced frequencies to step through, 2 to 10000; left out: the branch is followed, with "
        "more points where it turns (a single passage then steps through as many as points says)",
    )

    @model_validator(mode="after")
    def _rises(self) -> Self:
        rising_pair(self.frequency_hz, "frequency_hz")
        return self


class Solver(Section):
    """How contact forces are computed."""

    evaluator: Evaluator = Field(
        "events",
        description="how piecewise-linear laws are evaluated over a period: events (exact transition times, no sampling error), "
        "intervals (transitions on the time samples) or march (sample by sample, as coupled_coulomb always is)",
    )


class Retention(Section):
    """A weak spring from the damper to ground, for states in which friction leaves its mean position free."""

    stiffness_n_per_m: float = Field(
        0.0, ge=0, description="stiffness in N/m that holds the damper's mean position, 0 for none"
    )


class Limits(Section):
    """What a run may cost; a study that is estimated above is refused before it starts."""

    memory_gb: Positive = Field(
        4.0, description="memory in GB that a run may take, greater than zero"
    )
    work_s: Positive = Field(
        7200.0, description="estimated seconds that a run may take, greater than zero"
    )


class Output(Section):
    """Where the results go."""

    folder: str = Field(
        "results", min_length=1, max_length=200, description="a folder inside the study's folder"
    )

    @field_validator("folder")
    @classmethod
    def _stays_inside(cls, name: str, info: ValidationInfo) -> str:
        """Links are followed before the check; without the context of a study file only the name is judged."""
        relative, remedy = Path(name), "Give a plain relative name such as 'results'."
        if (
            not name.isprintable()
            or relative.is_absolute()
            or ".." in relative.parts
            or relative == Path()
        ):
            raise custom_error(f"must be a folder inside the study's folder, got {name!r}", remedy)
        home = (info.context or {}).get("study", Path("study.toml")).resolve().parent
        target = (home / relative).resolve()
        if target == home or not target.is_relative_to(home):
            raise custom_error(
                f"leads out of the study's folder, got {name!r}, which is {target}", remedy
            )
        return name
