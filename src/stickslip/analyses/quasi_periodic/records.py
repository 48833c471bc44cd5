"""Records of motions with two frequencies: one for each first frequency, and the record of a case."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.study.analysis import Solved
from stickslip.units import HZ

Kind = Literal["two loads", "second tone", "no second tone", "not found"]
NOT_FOUND = "not found"


@dataclass(frozen=True, eq=False, kw_only=True)
class TwoFrequencies:
    """A motion with two frequencies, or the reason why there is none; NaN for values not found or not requested.

    Attributes
    ----------
    unknowns
        (K, n_retained, 2) real and imaginary part of the retained coordinates, m; the next motion starts from them.
    """

    first: float = column("Hz", "first frequency", "first_hz", per=HZ)
    second: float = column("Hz", "second frequency; NaN where there is none", "second_hz", per=HZ)
    kind: str = column("1", "two loads, second tone, no second tone or not found")
    why: str = column("1", "what that rests on")
    unknown: str = column("1", "reason why other tones may grow where no second tone was found; empty where none can")
    combined: int = column("1", "combined frequencies that are kept")
    left_out: float = column(
        "1",
        "what those left out would change the motion by, root mean square over it, of the coordinate that they change most",
    )
    slip: float = column("rad", "by how much the second phase in the contacts is off after a turn of the first")
    newton_iterations: int = column("1", "Newton steps of the last solution")
    largest: FloatArray = column(
        "m", "largest amplitude, half of peak to peak in a period of the first frequency", along="output"
    )
    least: FloatArray = column("m", "least such amplitude", along="output")
    rms: FloatArray = column("m", "root mean square about the mean", along="output")
    extreme: FloatArray = column("m", "largest distance from the mean", along="output")
    envelope: FloatArray = column(
        "m",
        "such an amplitude of the first output over the phase of the second frequency where the period begins",
        along="phase",
    )
    indices: IntArray = column("1", "j and k of the combined frequencies j f1 + k f2", "index", along="index tone")
    amplitude: FloatArray = column(
        "m", "amplitude of each combined frequency; of (0, 0) the mean", along="index output"
    )
    time_largest: FloatArray | None = column("m", "largest amplitude in time", along="output", default=None)
    time_least: FloatArray | None = column("m", "least amplitude in time", along="output", default=None)
    time_off: float | None = column(
        "1",
        "difference of the motion in time from the balance, root mean square over the motion's; of two loads",
        default=None,
    )
    unknowns: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 2)))

    @property
    def solved(self) -> bool:
        """Whether a motion was found."""
        return self.kind != NOT_FOUND


@dataclass(frozen=True, eq=False, kw_only=True)
class QuasiPeriodic:
    """Record of a case."""

    output_name: Any = column("1", "output", along="output", default=None)
    accuracy: float | None = column("1", "accuracy that is asked for, of the same measure as left_out", default=None)
    points: tuple[TwoFrequencies, ...] = rows("point")


def answer(solved: Solved) -> QuasiPeriodic:
    """Return the record of a case from the motions and notes of its job."""
    model = solved.notes.get("model", {})
    return QuasiPeriodic(
        output_name=np.array([str(name) for name in np.atleast_1d(model.get("output", []))], dtype=str),
        accuracy=model.get("accuracy"),
        points=_alike(solved.records),
    )


def _alike(points: Sequence[TwoFrequencies]) -> tuple[TwoFrequencies, ...]:
    """Return motions padded by (0, 0) to the same number of combined frequencies; without any result in time these are None."""
    most = max((len(p.indices) for p in points), default=0)
    points = [replace(p, indices=np.pad(p.indices, ((0, most - len(p.indices)), (0, 0)))) for p in points]
    if any(p.time_largest is not None and np.any(np.isfinite(p.time_largest)) for p in points):
        return tuple(points)
    return tuple(replace(p, time_largest=None, time_least=None, time_off=None) for p in points)
