"""Journal records at one first frequency."""

from dataclasses import dataclass
from typing import Literal

from stickslip.arrays import FloatArray, IntArray

Kind = Literal["two loads", "second tone", "no second tone", "not found"]


@dataclass(frozen=True, eq=False)
class TwoFrequencies:
    """A motion with two frequencies, or why there is none.

    Parameters
    ----------
    first, second
        rad/s; `second` NaN where there is no second tone.
    kind
        What the second frequency is.
    why
        What it rests on, or why none was found.
    indices
        (K, 2) of the combined frequencies.
    unknown
        Where there is no second tone: why it is not known that nothing else grows; empty where it is.
    coefficients
        (K, outputs, 2) real and imaginary part, m.
    unknowns
        (K, n_retained, 2) of the retained coordinates, where the next one begins, m.
    largest, least, rms, extreme
        (outputs,) envelope, root mean square about the mean, largest distance from it, m.
    envelope
        (PHASES,) amplitude of the first output over the phase of the second frequency, m.
    left_out, slip
        As of `TorusMotion`.
    iterations
        Newton steps of the last solution.
    time_largest, time_least
        (outputs,) of time integration, m; NaN where it was not asked.
    time_off
        Root mean square difference of time integration and balance, relative; NaN where phases are not comparable.
    """

    first: float
    second: float
    kind: str
    why: str
    unknown: str
    indices: IntArray
    coefficients: FloatArray
    unknowns: FloatArray
    largest: FloatArray
    least: FloatArray
    rms: FloatArray
    extreme: FloatArray
    envelope: FloatArray
    left_out: float
    slip: float
    iterations: int
    time_largest: FloatArray
    time_least: FloatArray
    time_off: float

    @property
    def solved(self) -> bool:
        """Whether there is a motion."""
        return self.kind != "not found"
