"""The problem of a job of the run-up, picklable."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, cast

from stickslip.analyses.facts import facts_of
from stickslip.analyses.forced_response.estimate import check_limits, estimate, within_limits
from stickslip.analyses.forced_response.problem import measured, peak_first, sweep_through
from stickslip.analyses.run_up.table import RunUpTable
from stickslip.arrays import FloatArray
from stickslip.assembly.assembled import Assembled
from stickslip.assembly.model import Model
from stickslip.assembly.sides.engine_order_sweep import over_speed, with_engine_order
from stickslip.errors import input_error
from stickslip.harmonic.judging import JUDGED_MULTIPLE
from stickslip.reduction.speed_line import SpeedLine
from stickslip.reduction.waves import excited_wave
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, Sweep, forced_problem
from stickslip.response.rotating.campbell import frequencies_along
from stickslip.study.analysis import Case
from stickslip.study.verdict import said

DRAWN = 9  # speeds at which natural frequencies are shown


@dataclass(frozen=True, eq=False)
class RunUpPoint(ForcedPoint):
    """A point along an engine order.

    Attributes
    ----------
    engine_order
        Engine order of the point; the speed is the frequency divided by it.
    """

    engine_order: int = 0


def of_order(point: ForcedPoint, engine_order: int) -> RunUpPoint:
    """Return a point of a forced response as a point along an engine order."""
    own = {f.name: getattr(point, f.name) for f in fields(ForcedPoint)}
    return RunUpPoint(**own, engine_order=engine_order)


@dataclass(frozen=True, eq=False)
class Along:
    """The response along one engine order.

    Parameters
    ----------
    model
        The assembled model, whose system covers all speeds.
    sweep
        Range, harmonics and solver of the response.
    error
        Error of the polynomials between speeds, see `OverSpeed`.
    static_force
        (k, p, 3) static contact forces at the speeds of the line, N.
    coriolis
        Whether Coriolis forces are in the damping.
    common
        Whether modes of several speeds are retained, see `OverSpeed`.
    """

    model: Assembled
    sweep: Sweep
    error: float
    static_force: FloatArray
    coriolis: bool
    common: bool = False

    @property
    def line(self) -> SpeedLine:
        """The linear side along the engine order."""
        return cast("SpeedLine", self.model.system.structure)

    @property
    def order(self) -> int:
        """Engine order of the first harmonic."""
        return self.line.engine_order

    @property
    def wave_number(self) -> int:
        """Wave number of the first harmonic; 0 for a single structure."""
        return excited_wave(self.order, self.model.sectors)

    @cached_property
    def problem(self) -> ForcedProblem:
        """The problem of the sweep."""
        return forced_problem(self.model.system, self.model.load, self.sweep)

    def frequencies(self, speeds: FloatArray, n_modes: int, stuck: bool) -> FloatArray:
        """Return (s, n_modes) natural frequencies, Hz, with contacts open or all stuck; NaN for missing modes."""
        return frequencies_along(self.model.system, speeds, n_modes, stuck=stuck, coriolis=self.coriolis)


@dataclass(frozen=True, eq=False)
class Question:
    """The run-up of one case.

    Parameters
    ----------
    label
        Label of the case; empty for a study without [vary].
    lines
        One response for each engine order.
    modes
        Number of natural frequencies shown.
    rates
        Rates of fast run-ups, rpm/s.
    limit
        Change by more harmonics above which there is a warning, a fraction.
    facts
        Facts about the model for the result.
    """

    label: str
    lines: tuple[Along, ...]
    modes: int
    rates: tuple[float, ...]
    limit: float
    facts: Mapping[str, Any] = field(default_factory=dict)

    def said(self, text: str) -> str:
        """Return a sentence about the case."""
        return said(self.label, text)


def sweep_along(settings: Any, engine_order: int, driven: Iterable[int] = (1,)) -> Sweep:
    """Return the sweep along an engine order, as the tables of a study define it; `driven` are the harmonics of the loads."""
    lowest, highest = (engine_order * speed for speed in settings.run_up.speeds)
    return sweep_through(settings, settings.run_up, (lowest, highest), driven)


def question_of(case: Case, model: Model) -> Question:
    """Return the problem of a job; raise all refusals before any long computation."""
    settings = case.settings
    table: RunUpTable = settings.run_up
    lines = []
    for order in table.engine_orders or (model.engine_order,):
        if not order:
            raise input_error(
                "run_up.engine_orders",
                "is missing, and the loads have no engine order above 0",
                "Give the engine orders, a list of whole numbers from 1.",
            )
        turning = model if table.engine_orders is None else with_engine_order(model, order)
        sweep = sweep_along(settings, order, turning.driven.values())
        sweep = measured(sweep, turning)
        sweep = within_limits(turning, sweep, settings.limits)
        check_limits(settings.limits, estimate(turning, sweep))
        # peaks are judged with up to three times the kept harmonics
        harmonics, tolerance = JUDGED_MULTIPLE * sweep.high_harmonics[-1], table.tolerance
        found = over_speed(turning, order, table.speeds, harmonics, case.store, tolerance)
        own = peak_first(found.assembled)
        said = found.error, found.static_force, model.coriolis, found.common
        along = Along(own, sweep, *said)
        forced_problem(own.system, own.load, sweep)  # raises the refusals of the solver now
        lines.append(along)
    return Question(
        case.label,
        tuple(lines),
        table.modes,
        tuple(table.rate_rpm_per_s or ()),
        settings.harmonics.alert_threshold_percent / 100,
        facts_of(model, float("nan")),
    )
