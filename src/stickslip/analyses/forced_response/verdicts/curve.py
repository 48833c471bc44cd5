"""One case of a finished dataset, as the rules of its verdicts see it; missing variables are NaN or empty."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.forced_response.problem import RIGID
from stickslip.analyses.forced_response.records.columns import (
    MOTION,
    Blades,
    CaseNumbers,
    ExaminedRows,
    Kind,
    ModelFacts,
    MoreHarmonics,
    OperatingRange,
    PointFields,
    Points,
    PointStability,
    Shots,
    TimeChecks,
    each,
    read,
)
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.harmonic.harmonic_set import named
from stickslip.response.forced.amplitude import amplitudes
from stickslip.response.forced.collected import stored_energy
from stickslip.solve.status import Status

DEFAULT_LIMIT = 5.0  # percent, for datasets without a limit
ATTAINED = 1.0  # percent: largest difference between a settled time integration and the balance
HUMP = 1.05  # least ratio of a distinct maximum to the least amplitude on either side
UNSTABLE = MOTION["unstable"]
CARRIED = 2  # code of motion_stability_basis
FREQUENCY_RTOL = 1e-9  # relative difference of equal frequencies


def motion_of(said: TimeChecks) -> str:
    """Return the outcome of an integration from a row of a check; older files hold only whether it settled."""
    return str(said.verify_motion) or ("attained" if said.verify_settled else "not settled")


def branch_length(refinement: FloatArray | IntArray) -> int:
    """Return the number of points along the branch; points added to resolve the peak are stored behind them.

    Parameters
    ----------
    refinement
        (n,) 1 for points added at the peak; one that replaces a point of the branch keeps its place.
    """
    along = np.flatnonzero(~(refinement > 0))
    return int(along[-1]) + 1 if along.size else 0


def peak_output(data: xr.Dataset, case: int) -> int:
    """Return the index of the output with the peak of a case; on a mistuned wheel the blade that attains it."""
    labels = [str(x) for x in data["output"].values] if "output" in data.coords else []
    wanted = str(data.attrs.get("report_output", ""))
    named = labels.index(wanted) if wanted in labels else 0
    own = read(CaseNumbers, data, case)
    if read(Blades, data, case).largest_blade < 0 or own.peak_point < 0:
        return named
    off = np.abs(read(PointFields, data).amplitude[own.peak_point] - own.peak_amplitude)
    return named if off[named] <= off.min() else int(np.argmin(off))


def of_largest_blade(data: xr.Dataset, case: int) -> bool:
    """Return whether the output with the peak is on the largest blade of a mistuned wheel."""
    own = read(Blades, data, case)
    if own.largest_blade < 0 or not own.blade_peak_amplitude.size:
        return False
    return peak_output(data, case) // (data.sizes["output"] // own.blade_peak_amplitude.size) == own.largest_blade


@dataclass(frozen=True, eq=False)
class Curve:
    """One case of the dataset.

    Parameters
    ----------
    data
        The dataset of all cases.
    case
        Index along ``case``.
    """

    data: xr.Dataset
    case: int

    @cached_property
    def _records(self) -> dict[type[Any], Any]:
        return {}

    def read(self, kind: type[Kind]) -> Kind:
        """Return the record of a kind of this case, read once."""
        if kind not in self._records:
            self._records[kind] = read(kind, self.data, self.case)
        record: Kind = self._records[kind]
        return record

    @property
    def numbers(self) -> CaseNumbers:
        """Peak and work."""
        return self.read(CaseNumbers)

    @property
    def points(self) -> Points:
        """The (n) points of the case."""
        return self.read(Points)

    @property
    def fields(self) -> PointFields:
        """Amplitudes and harmonics of the points."""
        return self.read(PointFields)

    @property
    def stability(self) -> PointStability:
        """Stability of the points."""
        return self.read(PointStability)

    @cached_property
    def at(self) -> IntArray:
        """(n,) indices of the case's points along ``point``."""
        owner = read(Points, self.data).point_case
        return np.zeros(0, dtype=np.int64) if owner is None else np.flatnonzero(owner == self.case)

    @property
    def steps(self) -> int:
        """Time steps in a period of a case solved by shooting; 0 for one by balance."""
        own = self.read(Shots).shot_steps
        return int(own[0]) if own.size else 0

    @property
    def hz(self) -> FloatArray:
        """(n,) frequencies."""
        return self.points.frequency_hz

    @cached_property
    def converged(self) -> BoolArray:
        """(n,) whether there is a solution."""
        return np.asarray(self.points.status <= Status.CONVERGED)  # negative: status unknown

    @cached_property
    def branch(self) -> IntArray:
        """Indices of the points in the order of the branch, without the peak refinements behind its end."""
        return np.arange(branch_length(self.points.refinement))

    @cached_property
    def output(self) -> str:
        """Label of the output with the peak."""
        return str(self.data["output"].values[peak_output(self.data, self.case)])

    @cached_property
    def amplitude(self) -> FloatArray:
        """(n,) amplitude of that output, m; on a mistuned wheel of the largest blade at each point."""
        column, size = peak_output(self.data, self.case), self.fields.amplitude
        if not of_largest_blade(self.data, self.case):
            return np.asarray(size[:, column])
        each = self.data.sizes["output"] // self.data.sizes["blade"]
        return np.asarray(np.fmax.reduce(size[:, column % each :: each], axis=1))

    @cached_property
    def dissipation(self) -> FloatArray:
        """(n,) energy dissipated by all contacts in a cycle, J; zero if the dataset has none."""
        return np.asarray(np.nansum(self.fields.dissipated_energy, axis=1))

    @cached_property
    def elastic(self) -> float:
        """Largest energy stored by the contacts, J: a scale for the rounding of `dissipation`."""
        gap, force = self.fields.gap[:, 1:], self.fields.contact_force[:, 1:]
        return stored_energy(gap, force) if gap.size and force.size else 0.0

    @cached_property
    def peak(self) -> int:
        """Index of the peak; -1 for none."""
        found = np.flatnonzero(self.at == self.numbers.peak_point)
        return int(found[0]) if found.size else -1

    @cached_property
    def hump(self) -> int:
        """Index of the largest maximum inside the sweep; -1 if none is distinct on both sides."""
        order = np.flatnonzero(self.converged & np.isfinite(self.amplitude))
        order = order[np.argsort(self.hz[order], kind="stable")]
        size = self.amplitude[order]
        inner = np.arange(1, len(size) - 1)
        inner = inner[(size[inner] >= size[inner - 1]) & (size[inner] >= size[inner + 1])]
        for k in sorted(inner, key=lambda k: -size[k]):
            if order[k] != self.peak and size[k] > HUMP * max(size[:k].min(), size[k:].min()):
                return int(order[k])
        return -1

    @property
    def peak_hz(self) -> float:
        """Frequency of the peak; NaN for none."""
        return float(self.hz[self.peak]) if self.peak >= 0 else float("nan")

    @cached_property
    def largest_in_operation(self) -> tuple[float, float]:
        """Largest amplitude (m) in the operating range and its frequency (Hz): at a stable point, or between two at an end; NaN for none."""
        own = self.read(OperatingRange)
        known = self.converged & np.isfinite(self.amplitude)
        known[self.unstable] = False
        at = self.branch[known[self.branch]]
        hz, size = self.hz[at], self.amplitude[at]
        found = [(float(self.amplitude[i]), float(self.hz[i])) for i in np.flatnonzero(known)]
        for end in (own.operating_lowest_hz, own.operating_highest_hz):
            crossed = np.flatnonzero((hz[:-1] - end) * (hz[1:] - end) < 0.0)
            share = (end - hz[crossed]) / (hz[crossed + 1] - hz[crossed])
            found += [(float(y), end) for y in size[crossed] + share * (size[crossed + 1] - size[crossed])]
        inside = [one for one in found if own.operating_lowest_hz <= one[1] <= own.operating_highest_hz]
        return max(inside, default=(float("nan"), float("nan")))

    @cached_property
    def supports(self) -> list[tuple[int, ...]]:
        """Harmonics that each point keeps."""
        return [tuple(int(h) for h in np.flatnonzero(row)) for row in self.fields.harmonic_kept]

    @cached_property
    def kept(self) -> list[str]:
        """Harmonics of each point as text."""
        return [named(own) for own in self.supports]

    @cached_property
    def few(self) -> BoolArray:
        """(n,) whether a point keeps the harmonics of the first passage."""
        own = tuple(int(h) for h in np.atleast_1d(self.data.attrs.get("low_harmonics", [0, 1])))
        return np.array([s == own for s in self.supports], dtype=bool)

    @property
    def low(self) -> str:
        """Harmonics of the first passage as text."""
        return named(np.atleast_1d(self.data.attrs.get("low_harmonics", [0, 1])))

    @property
    def decides(self) -> bool:
        """Whether the strategy chose the harmonics."""
        return bool(np.isfinite(self.data.attrs.get("selection_threshold", np.nan)))

    @property
    def limit(self) -> float:
        """Error above which an answer is doubtful, a fraction."""
        return float(self.data.attrs.get("error_limit_percent", DEFAULT_LIMIT)) / 100

    @cached_property
    def own_error(self) -> FloatArray:
        """(n,) predicted error of each point's own solution, a fraction; NaN if not evaluated."""
        return self.points.own_error_percent / 100

    @property
    def exact(self) -> BoolArray:
        """(n,) whether no force acts on the harmonics that a point leaves out."""
        return np.asarray(self.own_error == 0.0)

    @cached_property
    def audit(self) -> FloatArray:
        """(n,) relative difference from a solution with more harmonics; NaN without an audit."""
        return self.points.audit_error_percent / 100

    @property
    def audits(self) -> bool:
        """Whether solutions could be audited; unknown in results of early versions."""
        return "audit_error_percent" in self.data

    @cached_property
    def reference(self) -> FloatArray:
        """(n,) predicted relative change by the largest judging set; NaN if not requested."""
        return self.read(MoreHarmonics).reference_error_percent / 100

    @cached_property
    def unstable(self) -> IntArray:
        """Indices of points known to be unstable."""
        off = self.stability.motion_stability == UNSTABLE
        for point, row in self.examined:
            off[point] |= str(row.stability_verdict) == "unstable"
        return np.flatnonzero(off)

    @cached_property
    def sure(self) -> BoolArray:
        """(n,) whether a point is known to be stable with enough harmonics, by an audit, a prediction or a time integration."""
        error = np.where(np.isnan(self.audit), self.own_error, self.audit)
        return np.asarray(
            (self.stability.motion_stability == MOTION["stable"]) & (self.attained | (error <= self.limit))
        )

    @cached_property
    def known(self) -> frozenset[int]:
        """Indices of points whose stability is inferred from others, even if their own multipliers leave it open."""
        carried = self.stability.motion_stability_basis == CARRIED
        return frozenset(np.flatnonzero(carried).tolist())

    @property
    def peak_stability(self) -> str:
        """Stability of the peak in one word; in older files from the row of the examined point."""
        known = [str(row.stability_verdict) for point, row in self.examined if point == self.peak]
        word = self.stability.motion_stability[self.peak] if self.peak >= 0 else -1
        return next(iter(known), next((name for name, k in MOTION.items() if k == word), ""))

    @cached_property
    def rigid(self) -> bool:
        """Whether a contact is rigid."""
        return RIGID in list(self.read(ModelFacts).contact_law)

    @property
    def forward(self) -> float:
        """1 for an upward sweep, -1 for a downward one."""
        return -1.0 if self.data.attrs.get("direction", "up") == "down" else 1.0

    @property
    def auto(self) -> bool:
        """Whether harmonics were raised along the branch."""
        return bool(self.data.attrs.get("passages", "") == "auto")

    @property
    def cap(self) -> int:
        """Highest harmonic allowed in the response."""
        return int(self.data.attrs.get("high_order", max(s[-1] for s in self.supports)))

    @property
    def stepped(self) -> bool:
        """Whether the frequencies were listed; no branch is followed then."""
        return bool(self.data.attrs.get("stepped", 0))

    @property
    def outside(self) -> bool:
        """Whether the peak lies outside the requested frequencies, where a branch turns round a fold."""
        low, high = self.numbers.lowest_hz, self.numbers.highest_hz
        return bool(self.peak_hz < low * (1 - FREQUENCY_RTOL) or self.peak_hz > high * (1 + FREQUENCY_RTOL))

    @property
    def at_the_end(self) -> bool:
        """Whether the peak is at the end of the sweep, or at the last point found."""
        ends = [self.hz.min(), self.hz.max(), self.numbers.lowest_hz, self.numbers.highest_hz]
        return bool(np.any(np.abs(np.array(ends) - self.peak_hz) <= FREQUENCY_RTOL * self.peak_hz))

    @property
    def range_key(self) -> str:
        """Key of the study for the range of the response."""
        known = "speed_rpm" if np.isfinite(self.points.speed_rpm).any() else "frequency_hz"
        return str(self.data.attrs.get("range_key", known))

    @property
    def nearer(self) -> str:
        """Keys that give more points."""
        listed = self.range_key == "frequencies_hz"
        return "nearer forced_response.frequencies_hz" if listed else "more forced_response.points"

    @cached_property
    def examined(self) -> tuple[tuple[int, ExaminedRows], ...]:
        """Points whose stability was examined, each with its row."""
        own = self.read(ExaminedRows)
        words = [MOTION.get(str(word), -1) for word in own.stability_verdict]
        return tuple(self._with_points(own, own.stability_frequency_hz, words))

    @cached_property
    def checks(self) -> tuple[tuple[int, TimeChecks], ...]:
        """Points that were integrated in time, each with its row."""
        own = self.read(TimeChecks)
        return tuple(self._with_points(own, own.verify_frequency_hz, [-1] * own.verify_frequency_hz.size))

    def _with_points(self, rows: Kind, hz: FloatArray, words: Sequence[int]) -> Iterator[tuple[int, Kind]]:
        """Yield each row with the index of its point, found by frequency and stability code (-1: unknown)."""
        for row, own, word in zip(each(rows), hz, words, strict=True):
            off = np.abs(self.hz - own) / self.hz
            near = np.flatnonzero(self.converged & (off <= FREQUENCY_RTOL))
            # of several points at a frequency, prefer the same stability, then the peak, then the first
            other = self.stability.motion_stability != word
            for point in sorted(map(int, near), key=lambda i: (off[i], other[i], i != self.peak))[:1]:
                yield point, row

    @cached_property
    def attained(self) -> BoolArray:
        """(n,) whether a time integration settled to the same amplitude and, within the tolerated error, to the same outputs."""
        near = [abs(off) <= self.allowed_in_time(i) for i, off in enumerate(self.integrated)]
        return np.array(near, dtype=bool) & ~(self.outputs_off > self.limit)

    def allowed_in_time(self, point: int) -> float:
        """Return the difference from time integration that a point may have, percent: `ATTAINED` at the peak, elsewhere the error limit."""
        return ATTAINED if point == self.peak else 100 * self.limit

    @cached_property
    def left_out(self) -> tuple[int, float, float] | None:
        """The largest harmonic at the peak outside its amplitude (mean excluded), its ratio to half of peak to peak, and that value, m; None for none."""
        if self.data.attrs.get("amplitude_of", "first") != "first" or not self.fields.output_displacement.size:
            return None
        parts = self.fields.output_displacement[self.peak]
        column = peak_output(self.data, self.case)
        motion = parts[:, column, 0] + 1j * parts[:, column, 1]
        driven = [int(h) for h in np.atleast_1d(self.data.attrs.get("driven_harmonics", [1]))]
        rest = np.abs(motion)
        rest[[0, *(h for h in driven if h < rest.size)]] = 0.0
        whole = float(amplitudes(motion[:, None], (), "half_peak_to_peak")[0])
        if not whole > 0.0:
            return None
        return int(rest.argmax()), float(rest.max()) / whole, whole

    @cached_property
    def outputs_off(self) -> FloatArray:
        """(n,) largest relative difference of an output, phase included, from a time integration that attains the motion; NaN without one."""
        found = np.full(self.at.size, np.nan)
        for point, said in self.checks:
            if motion_of(said) == "attained":
                found[point] = said.verify_outputs_percent / 100
        return found

    @cached_property
    def integrated(self) -> FloatArray:
        """(n,) difference from a time integration that attains the motion, percent; NaN without one."""
        found = np.full(self.at.size, np.nan)
        for point, said in self.checks:
            if motion_of(said) == "attained":
                found[point] = said.verify_difference_percent
        return found
