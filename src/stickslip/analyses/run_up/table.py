"""The table [run_up] of a study file."""

from typing import Literal, Self

from pydantic import Field, model_validator

from stickslip.analyses.waves.tables import Order
from stickslip.study.file.section import Positive, Range, Section, once, rising_pair
from stickslip.units import RPM


class RunUpTable(Section):
    """The response over a range of speeds along engine orders, each speed with its own stiffness and preload."""

    speeds_rpm: Range = Field(
        description="the range [lowest, highest] of the speed in rpm, above zero, the lower first"
    )
    engine_orders: list[Order] | None = Field(
        None,
        min_length=1,
        max_length=100,
        description="engine orders, a list of whole numbers from 1; all harmonic loads take each in turn. Left out: the loads act together, with their own orders",
    )
    points: int = Field(40, ge=2, le=10_000, description="smallest number of points of each engine order, 2 to 10000")
    peak_points: int = Field(8, ge=0, le=100, description="most points added to resolve the peak of each, 0 to 100")
    direction: Literal["up", "down"] = Field(
        "up", description="up: from the lowest speed to the highest; down: back, which finds other motions beside folds"
    )
    modes: int = Field(4, ge=1, le=100, description="number of natural frequencies shown beside the response, 1 to 100")

    rate_rpm_per_s: list[Positive] | None = Field(
        None,
        min_length=1,
        max_length=20,
        description="list of rates in rpm a second at which the speed is swept in addition. The peak of a fast run-up is as a rule lower than the steady peak, and comes later in the direction of the sweep; it may be slightly above where the steady curve "
        "has a notch that a sweep passes over; left out: steady motions alone",
    )
    tolerance: float = Field(
        1e-6,
        gt=0,
        le=1e-2,
        description="largest relative error of squares of natural frequencies, and of the static load, between the speeds at which the model "
        "is assembled; a smaller one takes more speeds, above 0 to 0.01",
    )

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        rising_pair(self.speeds_rpm, "speeds_rpm", "speed")
        once(self.engine_orders or [], "engine_orders")
        once(self.rate_rpm_per_s or [], "rate_rpm_per_s")
        return self

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed, rad/s."""
        lowest, highest = (RPM * n for n in self.speeds_rpm)
        return lowest, highest
