"""The table [forced_response] of a study file."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from stickslip.study.file.section import Positive, Range, Section, custom_error, rising_pair

STEPS = 1024  # time steps of a period, by shooting
RANGES = ("frequency_hz", "frequencies_hz", "speed_rpm")


class ForcedResponse(Section):
    """Steady vibration under harmonic loads."""

    frequency_hz: Range | None = Field(None, description="the range [lowest, highest] in Hz, the lower frequency first")
    frequencies_hz: Annotated[list[Positive], Field(min_length=1, max_length=10_000)] | None = Field(
        None, description="frequencies of your own in Hz instead of a range, growing"
    )
    method: Literal["balance", "shooting"] = Field(
        "balance",
        description="balance: harmonic balance; shooting: each motion is found in time, as a state that repeats after a period, with multipliers "
        "and without harmonics, at equally spaced or listed frequencies",
    )
    steps_per_period: int | None = Field(
        None,
        ge=64,
        le=65_536,
        description=f'time steps in a period for method = "shooting", 64 to 65536; left out: {STEPS}',
    )
    over: Literal["frequency", "speed"] = Field(
        "frequency",
        description="frequency: at the one speed of [rotation]; speed: along speed_rpm, at the engine order times the speed, with matrices and static loads from [rotation]",
    )
    speed_rpm: Range | None = Field(
        None, description='the range [lowest, highest] of speeds in rpm, for over = "speed"'
    )
    direction: Literal["up", "down"] = Field(
        "up",
        description="up: from the lowest frequency to the highest; down: back, which finds other motions beside folds",
    )
    points: int = Field(40, ge=2, le=10_000, description="smallest number of points of the first passage, 2 to 10000")
    peak_points: int = Field(8, ge=0, le=100, description="most points added to resolve the peak, 0 to 100")
    frequencies: int | None = Field(
        None,
        ge=2,
        le=10_000,
        description="number of equally spaced frequencies to step through, 2 to 10000; left out: the branch is followed, with "
        "more points where it turns (a single passage then steps through as many as points says)",
    )
    stability: Literal["auto", "peak", "off", "all"] = Field(
        "auto",
        description="where stability is examined, by Floquet multipliers. auto: at the peak, the ends, beside folds and where the transitions of the cycle change, then at all other points up to 500 rows of the matrices, for larger ones within the work of the solutions; peak: at the peak alone; all: at every point; off: nowhere",
    )
    stability_s: Positive = Field(
        60.0,
        description="estimated time of an examination of stability, in seconds, above which none is begun; a wheel has its own limits. Greater than zero",
    )
    bifurcations: Literal["off", "folds", "all", "branches"] = Field(
        "off",
        description="bifurcations located along the branch. folds: where it turns back; all: period doublings, Neimark-Sacker bifurcations "
        "and branch points, too, by the multipliers at every point; branches: all, and the periodic motions that leave there are followed",
    )

    not_periodic: Literal["in_time", "off"] = Field(
        "in_time",
        description="what to do where no stable periodic motion is found. in_time: give envelope, statistics and spectrum of the motion in time, at the peak or the nearest such points; off: nothing",
    )
    not_periodic_s: Positive = Field(
        5.0,
        description="work that each such motion may take, in seconds of 4e9 operations, counted in steps and rows: as many periods on a busy machine "
        "as on an idle one; greater than zero",
    )
    not_periodic_points: int = Field(
        2,
        ge=1,
        le=10_000,
        description="most points of a case that are marched so, 1 to 10000: the peak first, then the nearest to it",
    )
    static_friction_share: float | None = Field(
        None,
        gt=0,
        le=1,
        description="share of the friction coefficients, above 0 to 1, that carries the static load in a static solution first; sliders then stay there, and the rest is left for the vibration. Left out: springs start unstretched, and static and dynamic part are found together",
    )

    @property
    def range_key(self) -> str:
        """The key that defines the range, one of three."""
        return next(key for key in RANGES if getattr(self, key) is not None)

    @model_validator(mode="after")
    def _agree(self) -> Self:
        given = [key for key in RANGES if getattr(self, key) is not None]
        wanted = ("speed_rpm",) if self.over == "speed" else RANGES[:2]
        strange = [key for key in given if key not in wanted]
        if strange:
            raise custom_error(f"is not for over = {self.over!r}", f"Give {' or '.join(wanted)} instead.", strange[0])
        if len(given) != 1:
            problem = "is missing" if not given else f"cannot stand beside {given[0]}"
            raise custom_error(problem, f"Give one of {' and '.join(wanted)}.", (given or wanted)[-1])
        rising_pair(self.frequency_hz or [], "frequency_hz")
        rising_pair(self.speed_rpm or [], "speed_rpm", "speed")
        _check_list(self.frequencies_hz, self.frequencies)
        _check_method(self)
        return self


def _check_list(own: list[float] | None, count: int | None) -> None:
    if own is None:
        return
    if count is not None:
        raise custom_error("cannot stand beside frequencies_hz", "Remove one of them.", "frequencies")
    if any(b <= a for a, b in pairwise(own)):
        raise custom_error("must grow", "Sort them, and give each once.", "frequencies_hz")


def _check_method(table: ForcedResponse) -> None:
    if table.method == "balance":
        if table.steps_per_period is not None:
            raise custom_error(
                f"is for method = 'shooting', and method is 'balance', got {table.steps_per_period}",
                'Remove it, or give method = "shooting".',
                "steps_per_period",
            )
        return
    for key, wanted, why in (
        ("over", "frequency", "integrates at one speed"),
        ("bifurcations", "off", "follows no branch"),
    ):
        if getattr(table, key) != wanted:
            raise custom_error(
                f"is {getattr(table, key)!r}, and method = 'shooting' {why}",
                f'Give {key} = "{wanted}", or method = "balance".',
                key,
            )
