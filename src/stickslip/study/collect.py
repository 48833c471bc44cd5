"""The points of one load case, put in order: what was accepted, its fields, its peak, its counts."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.support import Harmonics
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, accepted_pairs
from stickslip.response.recovery import Fields, Signals, fields, signals

HZ = 2 * np.pi
NO_SHIFT = (float("nan"), float("nan"))
JUMP = 2.0  # ratio of neighbouring amplitudes that no step of a branch makes


@dataclass(frozen=True, eq=False)
class Accepted:
    """A frequency of the response, with the solution that stands for it.

    Parameters
    ----------
    point
        The solution with most harmonics; not a solution where its status says so.
    low
        The first solution at the same frequency, or None (peak refinements, points of a branch with many harmonics).
    fields, low_fields
        What they look like everywhere; None where the point did not converge.
    real_error
        Difference between both, a fraction; NaN unless the point repeats the first one.
    """

    point: ForcedPoint
    low: ForcedPoint | None
    fields: Fields | None
    low_fields: Fields | None
    real_error: float

    @property
    def indicator(self) -> float:
        """What the strategy said of the first solution: of an alert the predicted error, a fraction; NaN where it was not asked."""
        return (self.low or self.point).predicted_error

    def amplitudes(self, n_outputs: int) -> FloatArray:
        """Return the (n_outputs,) amplitudes of harmonic 1, m; NaN where the point did not converge."""
        return _amplitudes(self.fields, n_outputs)

    def first_amplitudes(self, n_outputs: int, harmonics: Harmonics) -> FloatArray:
        """Return the same of the first solution, NaN where that had other harmonics than these."""
        known = self.low is not None and self.low.support == harmonics
        return _amplitudes(self.low_fields if known else None, n_outputs)


@dataclass(frozen=True, eq=False)
class CaseResult:
    """A finished load case.

    Parameters
    ----------
    ratio, excitation
        F_CL/F_HE, and F_HE in N.
    solved
        Every point that was solved, accepted or not, in the order of solution.
    accepted
        One entry a frequency, along the branch, peak refinements last.
    peak
        Position of the largest amplitude of the report output in `accepted`, -1 if nothing converged.
    signals
        One period at the peak; None if nothing converged.
    report_output
        Position of the output whose peak counts.
    low_harmonics
        Harmonics of the first passage.
    retention_shift
        Relative change of the peak amplitude and change of its frequency (Hz) with a tenth of the retention; NaN: not computed.
    """

    ratio: float
    excitation: float
    solved: tuple[ForcedPoint, ...]
    accepted: tuple[Accepted, ...]
    peak: int
    signals: Signals | None
    report_output: int
    low_harmonics: Harmonics
    retention_shift: tuple[float, float] = NO_SHIFT

    @property
    def points_low(self) -> int:
        """Number of accepted points with few harmonics."""
        return sum(a.point.support == self.low_harmonics for a in self.accepted)

    @property
    def peak_amplitude(self) -> float:
        """Largest amplitude of the report output, m; NaN if nothing converged."""
        if self.peak < 0:
            return float("nan")
        return float(
            self.accepted[self.peak].amplitudes(self.report_output + 1)[self.report_output]
        )

    @property
    def peak_frequency_hz(self) -> float:
        """Frequency of the peak, Hz."""
        return float("nan") if self.peak < 0 else self.accepted[self.peak].point.omega / HZ

    @property
    def peak_at_end(self) -> bool:
        """Whether the largest amplitude stands at an end of the frequency range."""
        omega = [a.point.omega for a in self.accepted]
        return self.peak >= 0 and omega[self.peak] in (min(omega), max(omega))

    @property
    def jumps_hz(self) -> list[float]:
        """Frequencies at which neighbours of the response differ more than `JUMP` times, in Hz.

        Steps of the branch are far smaller: there, accepted points with few and with many harmonics stand on different solutions.
        """
        branch = [a for a in self.accepted if a.point.stage != "peak" and a.point.converged]
        height = [a.amplitudes(self.report_output + 1)[self.report_output] for a in branch]
        return [
            float(branch[i].point.omega / HZ)
            for i in range(1, len(branch))
            if max(height[i - 1], height[i]) > JUMP * min(height[i - 1], height[i])
            and branch[i - 1].point.support != branch[i].point.support
        ]

    @property
    def folded_hz(self) -> tuple[float, float] | None:
        """Lowest and highest frequency (Hz) between which the response runs backwards somewhere; None: it does not."""
        hz = [a.point.omega / HZ for a in self.accepted if a.point.stage != "peak"]
        back = [(b, a) for a, b in pairwise(hz) if b < a]
        return (min(b for b, _ in back), max(a for _, a in back)) if back else None

    @property
    def failed(self) -> int:
        """Number of accepted points that did not converge."""
        return sum(not a.point.converged for a in self.accepted)

    @property
    def unknowns(self) -> int:
        """Unknowns of all solutions together, accepted or not: the work in harmonics, whatever chose them."""
        return sum(unknowns(p) for p in self.solved)

    @property
    def newton_steps(self) -> int:
        """Newton iterations of all points solved."""
        return sum(p.iterations for p in self.solved)

    @property
    def seconds(self) -> tuple[float, float, float]:
        """Seconds in contact, linear algebra and the rest, over all points solved."""
        contact = sum(p.seconds_contact for p in self.solved)
        linear = sum(p.seconds_linear for p in self.solved)
        return contact, linear, sum(p.seconds_total for p in self.solved) - contact - linear


def collect(
    problem: ForcedProblem,
    points: Sequence[ForcedPoint],
    *,
    ratio: float,
    excitation: float,
    report_output: int,
) -> CaseResult:
    """Put the points of a load case in order and recover what they look like.

    Parameters
    ----------
    problem
        What was solved.
    points
        All points in the order of solution.
    ratio, excitation
        F_CL/F_HE, and F_HE in N.
    report_output
        Position of the output whose peak counts.
    """
    accepted = tuple(_accept(problem, point, low) for point, low in accepted_pairs(points))
    peak = _peak(accepted, report_output)
    period = None if peak < 0 else signals(problem, accepted[peak].point)
    return CaseResult(
        ratio,
        excitation,
        tuple(points),
        accepted,
        peak,
        period,
        report_output,
        problem.sweep.first_harmonics,
    )


def unknowns(point: ForcedPoint) -> int:
    """Return the number of real unknowns of a solution."""
    return int(point.coefficients.shape[1] * (2 * point.harmonics.size - 1))


def _accept(problem: ForcedProblem, point: ForcedPoint, low: ForcedPoint | None) -> Accepted:
    found = fields(problem, point) if point.converged else None
    if low is None or not low.converged:
        return Accepted(point, low, found, None, float("nan"))
    if low is point:
        return Accepted(point, low, found, found, float("nan"))
    error = problem.real_error(low, point) if point.converged else float("nan")
    return Accepted(point, low, found, fields(problem, low), error)


def _peak(accepted: Sequence[Accepted], output: int) -> int:
    amplitude = np.array([a.amplitudes(output + 1)[output] for a in accepted])
    return int(np.nanargmax(amplitude)) if np.any(np.isfinite(amplitude)) else -1


def _amplitudes(found: Fields | None, n_outputs: int) -> FloatArray:
    if found is None:
        return np.full(n_outputs, np.nan)
    return np.abs(found.outputs[1, :n_outputs])
