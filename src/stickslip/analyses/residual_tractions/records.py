"""Journal records of bounds at a frequency, and the record of a case."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.response.residual_tractions.bounds import Bound, TractionBounds
from stickslip.study.analysis import Solved
from stickslip.units import HZ

Stage = Literal["point", "least", "most"]


@dataclass(frozen=True, eq=False, kw_only=True)
class TractionRecord:
    """Bounds at a frequency.

    Parameters
    ----------
    stage
        ``point``: a frequency of the range; ``least`` and ``most``: the resonance of this bound.
    omega
        Frequency, rad/s.
    each
        The motion from the model's own start, the smallest motion, the largest motion.
    springs
        Names of the contacts to which the rows of sliders belong.
    solves, failures, branches
        As in `TractionBounds`.
    """

    stage: Stage
    omega: float
    each: tuple[Bound, ...]
    springs: Any
    solves: int
    failures: int
    branches: int = 1

    @property
    def bounds(self) -> TractionBounds:
        """The bounds of the record."""
        reference, least, most = self.each
        names = tuple(str(name) for name in self.springs)
        return TractionBounds(self.omega, reference, least, most, names, self.solves, self.failures, self.branches)


def to_record(bounds: TractionBounds, stage: Stage) -> TractionRecord:
    """Return bounds as a record."""
    return TractionRecord(
        stage=stage,
        omega=bounds.omega,
        each=(bounds.reference, bounds.least, bounds.most),
        springs=np.array(bounds.springs, dtype=str),
        solves=bounds.solves,
        failures=bounds.failures,
        branches=bounds.branches,
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class TractionPoint:
    """Bounds at a frequency, as results have them."""

    frequency_hz: float = column("Hz", "frequency")
    reference_amplitude: float = column("m", "amplitude from the model's own start")
    least_amplitude: float = column("m", "smallest amplitude over all residual tractions")
    most_amplitude: float = column("m", "largest amplitude over all residual tractions")
    stuck_springs: IntArray = column(
        "1", "tangential springs that stick all the time: own start, smallest, largest amplitude", along="bound"
    )
    solves: int = column("1", "motions that were solved for")
    failures: int = column("1", "starts from which no motion was found")
    branches: int = column(
        "1", "motions from the model's own start that sweeps up and down met; the bounds hold them all"
    )
    harmonics_error: FloatArray = column(
        "1",
        "relative change of the output that more harmonics are predicted to make, phase included; 0 where nothing acts on them, NaN where nobody can tell",
        along="bound",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class TractionResonance:
    """Resonance of a bound: the largest amplitude of its curve."""

    frequency_hz: float = column(
        "Hz", "where the curve of each bound is highest: own start, smallest, largest amplitude", "resonance_hz"
    )
    amplitude: float = column("m", "its height there", "resonance_amplitude")
    harmonics_error: float = column("1", "the same at the resonance of each bound", "resonance_harmonics_error")
    inside: bool = column("1", "1 where that is within the range, 0 at its ends", "resonance_inside")
    multiplier: FloatArray = column(
        "1",
        "traction at t = 0 over the friction limit there, at the resonance of each bound; NaN: it does not stick",
        along="traction_spring tangent",
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class ConfirmedEnd:
    """The smallest or the largest resonance, solved again and integrated in time."""

    resolved_amplitude: float = column("m", "smallest and largest resonance solved again, forces marched over samples")
    time_amplitude: float = column("m", "smallest and largest resonance followed in time from their tractions")
    time_status: str = column("1", "how that ended; empty where it was not followed")
    confirmed: bool = column("1", "1 where both agree with the bound")


@dataclass(frozen=True, eq=False, kw_only=True)
class ResidualTractions:
    """Record of a case.

    Attributes
    ----------
    resonances
        Resonance from the model's own start, smallest and largest resonance; empty if no motion was found.
    ends
        Smallest and largest resonance; empty if they were not followed in time.
    """

    output: str | None = column("1", "output whose amplitude is bounded", default=None)
    excitation_n: float | None = column("N", "amplitude of the harmonic force", default=None)
    harmonics: int | None = column("1", "highest harmonic of the motions", default=None)
    spring: Any = column("1", "contact of each spring that has a start", along="traction_spring", default=None)
    points: tuple[TractionPoint, ...] = rows("traction_point")
    resonances: tuple[TractionResonance, ...] = rows("bound")
    ends: tuple[ConfirmedEnd, ...] = rows("end")

    @property
    def solves(self) -> int:
        """Number of solved motions."""
        return sum(point.solves for point in self.points)


def answer(solved: Solved) -> ResidualTractions:
    """Return the record of a case from the records and notes of its job."""
    model = solved.notes.get("model", {})
    found: dict[str, Any] = {name: model.get(name) for name in ("output", "excitation_n", "harmonics")}
    records: Sequence[TractionRecord] = solved.records
    points = [r.bounds for r in records if r.stage == "point"]
    by_stage = {r.stage: r.bounds for r in records}
    if points:
        # resonances are points of the curves, which would otherwise pass below them
        every = {b.omega: b for b in (*points, *(b for stage, b in by_stage.items() if stage != "point"))}
        found["points"] = tuple(_point(every[omega]) for omega in sorted(every))
    if points and {"least", "most"} <= set(by_stage):
        found |= _of_resonances(points, by_stage)
    if "confirmed" in solved.notes:
        found["ends"] = tuple(_ends(solved.notes["confirmed"]))
    return ResidualTractions(**found)


def _point(bounds: TractionBounds) -> TractionPoint:
    each = (bounds.reference, bounds.least, bounds.most)
    return TractionPoint(
        frequency_hz=bounds.omega / HZ,
        reference_amplitude=bounds.reference.amplitude,
        least_amplitude=bounds.least.amplitude,
        most_amplitude=bounds.most.amplitude,
        stuck_springs=np.array([bound.stuck for bound in each]),
        solves=bounds.solves,
        failures=bounds.failures,
        branches=bounds.branches,
        harmonics_error=np.array([bound.error for bound in each]),
    )


def _of_resonances(points: Sequence[TractionBounds], by_stage: Mapping[Stage, TractionBounds]) -> dict[str, Any]:
    known = [bounds for bounds in points if np.isfinite(bounds.reference.amplitude)]
    least, most = by_stage["least"], by_stage["most"]
    own = max([*known, least, most], key=lambda bounds: bounds.reference.amplitude)
    ends = known[0].omega, known[-1].omega
    tops = ((own, own.reference), (least, least.least), (most, most.most))
    return {
        "spring": np.array(own.springs, dtype=str),
        "resonances": tuple(
            TractionResonance(
                frequency_hz=bounds.omega / HZ,
                amplitude=bound.amplitude,
                harmonics_error=bound.error,
                inside=bounds.omega not in ends,
                multiplier=bound.multipliers,
            )
            for bounds, bound in tops
        ),
    }


def _ends(note: Mapping[str, Any]) -> list[ConfirmedEnd]:
    return [
        ConfirmedEnd(
            resolved_amplitude=float(note["resolved_amplitude"][i]),
            time_amplitude=float(note["time_amplitude"][i]),
            time_status=str(note["time_status"][i]),
            confirmed=bool(note["confirmed"][i]),
        )
        for i in range(len(note["confirmed"]))
    ]
