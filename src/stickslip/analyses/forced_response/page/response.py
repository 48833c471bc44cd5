"""The dataset of a forced response with the accesses that figures and tables need."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from stickslip.analyses.forced_response.records.columns import (
    MOTION,
    Attempts,
    Blades,
    CaseNumbers,
    Kind,
    ModelFacts,
    PeakPeriod,
    PointFields,
    Points,
    PointStability,
    Shots,
    Verdicts,
    each,
    read,
)
from stickslip.analyses.forced_response.stability.stable_words import said_of
from stickslip.analyses.forced_response.summary import MEASURED
from stickslip.analyses.forced_response.verdicts.curve import Curve, branch_length, of_largest_blade, peak_output
from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.harmonic_set import named
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.report.cases import ShownCase, cases_of
from stickslip.report.quantities import Scale, number, predicted, scale_for
from stickslip.report.result import Node
from stickslip.report.section import Table
from stickslip.solve.status import Status
from stickslip.study.file.case_names import CASE
from stickslip.study.verdict import LEVELS, said

NEEDED = ("point_case", "frequency_hz", "order", "status", "amplitude", "harmonic_kept")
_TURNS = (".rx", ".ry", ".rz")
_BLADE = re.compile(r"\[\d+\]")  # number of the blade in the label of an output


@dataclass(frozen=True, eq=False)
class Alert:
    """The judged solution of each frequency. An alert judges the first solution, every other strategy the accepted one."""

    case: IntArray
    hz: FloatArray
    error: FloatArray  # predicted, percent; for a strategy without predicted errors its indicator


@dataclass(frozen=True, eq=False)
class Response(Node):
    """Accepted points of all cases. Only the variables in `NEEDED` must exist."""

    @cached_property
    def cases(self) -> tuple[ShownCase, ...]:
        """All cases, in the order of the study."""
        return cases_of(self.data)

    @cached_property
    def of_points(self) -> Points:
        """Accepted points of all cases."""
        return read(Points, self.data)

    @cached_property
    def fields(self) -> PointFields:
        """Harmonics, amplitudes and forces of these points."""
        return read(PointFields, self.data)

    @cached_property
    def numbers_of(self) -> tuple[CaseNumbers, ...]:
        """Peak and work of each case."""
        return tuple(read(CaseNumbers, self.data, c.index) for c in self.cases)

    @cached_property
    def periods(self) -> tuple[PeakPeriod, ...]:
        """Contacts of each case over a period at its peak."""
        return tuple(read(PeakPeriod, self.data, c.index) for c in self.cases)

    @cached_property
    def blades(self) -> tuple[Blades, ...]:
        """The wheel of each case; NaN and empty where it is not mistuned."""
        return tuple(read(Blades, self.data, c.index) for c in self.cases)

    @cached_property
    def model(self) -> ModelFacts:
        """The contacts of the model."""
        return read(ModelFacts, self.data)

    @cached_property
    def verdicts(self) -> Verdicts:
        """Verdicts on cases and points; empty and None for results without."""
        return read(Verdicts, self.data)

    @property
    def steps(self) -> int:
        """Time steps in a period where every case was solved by shooting; else 0."""
        own = read(Shots, self.data).shot_steps
        return int(own[0]) if own.size and own.size == self.hz.size else 0

    @property
    def point_case(self) -> IntArray:
        """(point,) the case of each point."""
        found = self.of_points.point_case
        return np.zeros(0, dtype=np.int64) if found is None else found

    @property
    def hz(self) -> FloatArray:
        """(point,) frequency of each point."""
        return self.of_points.frequency_hz

    @cached_property
    def outputs(self) -> IntArray:
        """(case,) index along ``output`` of the output with the peak; on a mistuned wheel this is the largest blade."""
        return np.array([peak_output(self.data, c.index) for c in self.cases])

    @property
    def mistuned(self) -> bool:
        """Whether the peak belongs to the largest blade of a mistuned wheel."""
        return bool(self.peaked) and all(of_largest_blade(self.data, c.index) for c in self.peaked)

    @property
    def output_name(self) -> str:
        """Label of the output with the peak; for several cases of a mistuned wheel it names no single blade."""
        labels = self.labels("output")
        own = labels[int(self.outputs[0])]
        if not self.mistuned:
            return own
        if len(self.cases) == 1:
            return f"{own}, the largest blade at the peak"
        return f"{_BLADE.sub('', own)} of the blade that is largest at the peak of each case"

    def blade_at_peak(self, case: ShownCase) -> str:
        """Return the blade at the peak as `` (tip[7].y)`` for a mistuned wheel, else an empty text."""
        return f" ({self.labels('output')[self.outputs[case.index]]})" if self.mistuned else ""

    def at_outputs(self, values: FloatArray) -> FloatArray:
        """Select from values (point, ..., output) the output with the peak of each point's case."""
        return np.asarray(values[np.arange(len(values)), ..., self.outputs[self.point_case]])

    @property
    def length(self) -> str:
        """Unit of the output's motion."""
        return "rad" if self.labels("output")[self.outputs[0]].endswith(_TURNS) else "m"

    @property
    def per_force(self) -> bool:
        """Whether responses are divided by the excitation; true if every case has one."""
        return all(c.excitation > 0 for c in self.cases)

    @property
    def unit(self) -> str:
        """Unit of `response`."""
        return f"{self.length}/N" if self.per_force else self.length

    @property
    def quantity(self) -> str:
        """Name of `response` on an axis."""
        own = MEASURED.get(str(self.data.attrs.get("amplitude_of", "first")), "amplitude")
        return f"{own} / force" if self.per_force else own

    @cached_property
    def converged(self) -> npt.NDArray[np.bool_]:
        """(point,) True for accepted points."""
        return np.asarray(self.of_points.status == Status.CONVERGED)

    @property
    def of_sector(self) -> str:
        """`` of one sector`` for a tuned wheel solved by one sector; else empty."""
        tuned = int(self.data.attrs.get("sectors", 1)) > 1 and not self.blades[0].blade_peak_amplitude.size
        return " of one sector" if tuned else ""

    @cached_property
    def levels(self) -> IntArray:
        """(point,) level of the verdict on each point; results without verdicts trust converged points."""
        found = self.verdicts.verdict
        return np.where(self.converged, 0, 2) if found is None else found

    @cached_property
    def unstable(self) -> npt.NDArray[np.bool_]:
        """(point,) True for motions known to be unstable."""
        return np.asarray(self._stability == MOTION["unstable"])

    @cached_property
    def unknown_stability(self) -> npt.NDArray[np.bool_]:
        """(point,) True for motions that were not examined, or remain undecided; false everywhere in results without stability."""
        return np.isin(self._stability, (MOTION["undecided"], MOTION["not examined"]))

    @cached_property
    def _stability(self) -> IntArray:
        """(point,) stability of each motion, as in `MOTION`; -1 in results without it."""
        found = read(PointStability, self.data).motion_stability
        return found if found.size else np.full(self.hz.size, -1)

    def peak_is(self, case: ShownCase) -> str:
        """Return the stability of a case's peak in a word or two."""
        return said_of(Curve(self.data, case.index).peak_stability)

    def level(self, case: ShownCase) -> str:
        """Return the level of the verdict on a case; empty for results without verdicts."""
        found = np.atleast_1d(self.verdicts.case_verdict)  # a result without verdicts has a single missing number
        return LEVELS[int(found[case.index])] if found[0] >= 0 else ""

    def trust(self, case: ShownCase) -> int:
        """Return the index of a case's verdict in `LEVELS`: 0 if it is trusted or the result has no verdicts."""
        return LEVELS.index(self.level(case)) if self.level(case) else 0

    @cached_property
    def alert(self) -> Alert:
        """Solutions judged by the strategy; with raised harmonics and in older files, the accepted points with an indicator."""
        asked, own = read(Attempts, self.data), self.of_points
        if asked.alert_case is not None and not self.auto:
            return Alert(asked.alert_case, asked.alert_frequency_hz, asked.alert_error_percent)
        error = own.own_error_percent if self.auto else self.first_error
        at = np.flatnonzero(~np.isnan(error))
        return Alert(self.point_case[at], self.hz[at], error[at])

    @property
    def first_error(self) -> FloatArray:
        """(point,) value compared with the threshold: predicted error of the first solution in percent, or own indicator."""
        own = self.of_points
        return own.predicted_error_percent if self.is_error else own.indicator

    @property
    def selection(self) -> str:
        """Name of the strategy."""
        return self.text("selection", "jacobian_alert")

    @property
    def is_error(self) -> bool:
        """Whether the strategy's indicator is the predicted error of a solution."""
        return self.text("indicator_name", "predicted error") == "predicted error"

    @property
    def decides(self) -> bool:
        """Whether the strategy chooses; false with the same harmonics at every point."""
        known = self.selection in STRATEGIES
        return not known or always_kept(strategy_named(self.selection)) is None

    @property
    def auto(self) -> bool:
        """Whether harmonics were raised along the branch until the error of each point was small enough."""
        return self.text("passages") == "auto"

    @property
    def threshold(self) -> float:
        """Threshold of the strategy; in percent if it limits an error."""
        if self.is_error:
            return self.scalar("alert_threshold_percent", 5.0)
        return self.scalar("selection_threshold")

    def shown(self, indicator: float) -> str:
        """Write a value of `alert`; errors in percent."""
        if self.is_error:
            return predicted(indicator)
        return "beyond all bounds" if np.isinf(indicator) else number(indicator)

    @property
    def low_harmonics(self) -> IntArray:
        """Harmonics of the first passage, from 0."""
        return self._support("low", 1)

    @property
    def high_harmonics(self) -> IntArray:
        """Harmonics of the reference, from 0."""
        return self._support("high", 5)

    def _support(self, which: str, default: int) -> IntArray:
        given = self.numbers(f"{which}_harmonics")
        full = np.arange(int(self.scalar(f"{which}_order", default)) + 1)
        return (given if given.size else full).astype(np.int64)

    @property
    def low_name(self) -> str:
        """Low harmonics as text."""
        return named(self.low_harmonics)

    @property
    def first_name(self) -> str:
        """Harmonics of the first passage as text."""
        return self.high_name if self.selection == "always_high" else self.low_name

    @property
    def high_name(self) -> str:
        """Harmonics of the reference as text."""
        return named(self.high_harmonics)

    @cached_property
    def kept(self) -> IntArray:
        """(point, harmonic) 1 where the solution keeps the harmonic."""
        return self.fields.harmonic_kept.astype(np.int64)

    @cached_property
    def more(self) -> npt.NDArray[np.bool_]:
        """(point,) True where the solution keeps harmonics that the first passage does not."""
        own = np.isin(np.arange(self.kept.shape[1]), self.low_harmonics)
        return np.asarray((self.kept[:, ~own] > 0).any(axis=1))

    @property
    def more_name(self) -> str:
        """Harmonics of these points as text; the reference harmonics if all points keep them all."""
        some = self.kept[self.more]
        own = np.isin(np.arange(self.kept.shape[1]), self.high_harmonics)
        return f"H = {self.high_name}" if bool((some == own).all()) else "more harmonics"

    def response(self, of: FloatArray | None = None) -> FloatArray:
        """Return (point,) amplitude of the report output, divided by the excitation if every case has one; `of` amplitudes (point, output)."""
        values = self.at_outputs(self.fields.amplitude if of is None else of)
        force = np.array([c.excitation for c in self.cases])[self.point_case]
        return np.asarray(values / force) if self.per_force else values

    @cached_property
    def accepted(self) -> FloatArray:
        """(point,) response; NaN at unconverged points."""
        return np.where(self.converged, self.response(), np.nan)

    @property
    def scale(self) -> Scale:
        """Engineering unit of the accepted responses."""
        return scale_for(self.accepted, self.unit)

    def table(
        self,
        heading: str,
        told: Sequence[str],
        head: Sequence[str],
        rows: Sequence[Sequence[str]],
        *,
        numeric: bool = True,
        items: Sequence[str] = (),
        folded: str = "",
    ) -> Table:
        """Return a table whose first column names the case; without this column for a single case."""
        first = 0 if len(self.cases) > 1 or self.cases[0].label else 1
        cells = [list(row)[first:] for row in rows]
        return Table([CASE, *head][first:], cells, heading, told, numeric, items=items, folded=folded)

    def rows(self, kind: type[Kind]) -> list[tuple[ShownCase, Kind]]:
        """Return the rows of all cases, such as checks of single points, each with its case."""
        return [(c, row) for c in self.cases for row in each(read(kind, self.data, c.index))]

    def sentences(self, told: Iterable[tuple[ShownCase, object]]) -> list[str]:
        """Return sentences with the labels of their cases; empty ones are left out."""
        return [said(case.label, str(text)) for case, text in told if str(text)]

    def points(self, case: ShownCase) -> IntArray:
        """Return the points of a case in the order of the curve, unconverged ones included.

        A folded branch keeps its order and leaves out the peak refinements stored behind its end, whose place on the branch is
        unknown. Other branches are sorted by frequency.
        """
        index = np.flatnonzero(self.point_case == case.index)
        branch = index[: branch_length(self.of_points.refinement[index])]
        along = np.diff(self.hz[branch])
        if np.any(along > 0) and np.any(along < 0):
            return branch
        return index[np.argsort(self.hz[index], kind="stable")]

    def peak(self, case: ShownCase) -> int:
        """Position of the peak along ``point``; -1 if there is none."""
        value = self.numbers_of[case.index].peak_point
        return value if value < self.hz.size else -1

    def peak_response(self, case: ShownCase) -> float:
        """Response at the peak; NaN without a peak."""
        return float(self.response()[self.peak(case)]) if self.peak(case) >= 0 else float("nan")

    def peak_hz(self, case: ShownCase) -> float:
        """Frequency of the peak in Hz; NaN without a peak."""
        return float(self.hz[self.peak(case)]) if self.peak(case) >= 0 else float("nan")

    def place(self, case: ShownCase) -> str:
        """Return the speed of the peak of a case for a response over speed, else its frequency."""
        speed = float(self.of_points.speed_rpm[self.peak(case)]) if self.of_points.speed_rpm.size else np.nan
        hz = f"{number(self.peak_hz(case), 5)} Hz"
        return f"{number(speed, 5)} rpm ({hz})" if np.isfinite(speed) else hz

    def resonates(self, case: ShownCase) -> bool:
        """Return whether the peak of a case lies inside its sweep; at an end of the sweep the largest amplitude is no resonance."""
        own = Curve(self.data, case.index)
        known = self.peak(case) >= 0 and np.isfinite(self.peak_response(case))
        return bool(known and not own.at_the_end and not own.outside)

    @cached_property
    def peaked(self) -> tuple[ShownCase, ...]:
        """The cases with a peak."""
        return tuple(c for c in self.cases if self.peak(c) >= 0)

    @property
    def chosen(self) -> int:
        """Index of the case shown first: the smallest resonance peak among the best verdicts; -1 for none."""
        if not self.peaked:
            return -1

        def rank(case: ShownCase) -> tuple[int, bool, float]:
            return self.trust(case), not self.resonates(case), self.peak_response(case)

        return min(self.peaked, key=rank).index

    @cached_property
    def groups(self) -> dict[str, list[int]]:
        """Contact points by contact of the model; by contact line in older files."""
        names = [f"{group}." for group in self.model.contact_group if group] or self.labels("contact")
        found: dict[str, list[int]] = {}
        for index, name in enumerate(names):
            found.setdefault(name.partition(".")[0], []).append(index)
        return found
