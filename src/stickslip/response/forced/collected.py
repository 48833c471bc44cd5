"""The points of a response in order: accepted solutions, their fields, the peak, counts, and where the branch jumps."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.response.forced.accepted import audits_by_frequency
from stickslip.response.forced.amplitude import amplitudes
from stickslip.response.forced.choices import AmplitudeOf
from stickslip.response.forced.response import ForcedPoint, ForcedProblem, accepted_pairs
from stickslip.response.recovery import Fields, fields
from stickslip.response.verification import own_error
from stickslip.solve.status import Status
from stickslip.units import HZ

FLANK = 0.7  # amplitude of the flanks of a peak over its amplitude
JUMP = 2.0  # ratio of neighbouring amplitudes that no step along a branch reaches
LOSS_JUMP = 10.0  # ratio of neighbouring dissipations at a jump
# step of the dissipation at a jump over the steps beside it; at the onset of slip, neighbouring steps are similar
LOSS_STEP = 4.0
LOSS_COUNTS = 0.01  # share of the largest dissipation, below which a jump does not matter
LOSS_SEEN = 1e-6  # share of the energy stored by the contacts, below which dissipation is rounding


@dataclass(frozen=True, eq=False)
class Accepted:
    """One frequency of the response with its accepted solution.

    Parameters
    ----------
    point
        The solution with the most harmonics; its status says whether it converged.
    low
        The first solution at the same frequency; None for peak refinements and for points of a branch with many harmonics.
    fields, low_fields
        Motion of all dofs of both solutions; None for an unconverged point.
    real_error
        Relative difference of both solutions; NaN unless the point is a repeat of the first one.
    driven
        Harmonics of the load, which define the amplitude.
    amplitude_of
        Definition of the amplitude, as in `Sweep`.
    own_error
        Bound of the point's own error, a fraction: 0 if no force acts on the harmonics left out, NaN if unknown.
    audit_error
        Relative difference from a solution of the same motion with more harmonics; NaN without such an audit.
    audit
        The solution of the audit.
    audit_place
        Index of the component with this difference in the error norm; -1 without an audit.
    """

    point: ForcedPoint
    low: ForcedPoint | None
    fields: Fields | None
    low_fields: Fields | None
    real_error: float
    driven: Harmonics = (1,)
    amplitude_of: AmplitudeOf = "first"
    own_error: float = float("nan")
    audit_error: float = float("nan")
    audit: ForcedPoint | None = None
    audit_place: int = -1

    @property
    def exact(self) -> bool:
        """Whether no force acts on the harmonics left out; more harmonics then change nothing, and no audit is needed."""
        return self.own_error == 0.0

    @property
    def indicator(self) -> float:
        """Indicator of the strategy at the first solution, for an alert the predicted error, a fraction; NaN if not evaluated."""
        return (self.low or self.point).predicted_error

    def amplitudes(self, n_outputs: int) -> FloatArray:
        """Return (n_outputs,) amplitudes, m; NaN for an unconverged point."""
        return _amplitudes(self.fields, n_outputs, self.driven, self.amplitude_of)

    def driven_amplitudes(self, n_outputs: int) -> FloatArray:
        """Return (driven, n_outputs) amplitudes of each driven harmonic, m; NaN for an unconverged point."""
        if self.fields is None:
            return np.full((len(self.driven), n_outputs), np.nan)
        return np.asarray(np.abs(self.fields.outputs[list(self.driven), :n_outputs]))

    def first_amplitudes(self, n_outputs: int, harmonics: Harmonics) -> FloatArray:
        """Return (n_outputs,) amplitudes of the first solution, m; NaN if it has other harmonics than these."""
        known = self.low is not None and self.low.support == harmonics
        first = self.low_fields if known else None
        return _amplitudes(first, n_outputs, self.driven, self.amplitude_of)


@dataclass(frozen=True, eq=False)
class Response:
    """The finished response of a case.

    Parameters
    ----------
    solved
        All points solved, accepted or not, in the order of solution.
    accepted
        One entry a frequency along the branch, peak refinements last.
    peak
        Index in `accepted` of the largest amplitude of the report output that is not known to be unstable; -1 if nothing converged.
    output
        Index of the output with the peak.
    low_harmonics
        Harmonics of the first passage.
    unstable_peak
        Index of a larger but unstable amplitude; -1 for none.
    """

    solved: tuple[ForcedPoint, ...]
    accepted: tuple[Accepted, ...]
    peak: int
    output: int
    low_harmonics: Harmonics
    unstable_peak: int = -1

    @property
    def top(self) -> Accepted | None:
        """The accepted point at the peak; None if nothing converged."""
        return None if self.peak < 0 else self.accepted[self.peak]

    def amplitude(self, accepted: Accepted) -> float:
        """Return the amplitude of the report output, m; NaN for an unconverged point."""
        return float(accepted.amplitudes(self.output + 1)[self.output])

    @property
    def peak_amplitude(self) -> float:
        """Largest amplitude of the report output, m; NaN if nothing converged."""
        return float("nan") if self.top is None else self.amplitude(self.top)

    @property
    def peak_hz(self) -> float:
        """Frequency of the peak, Hz."""
        return float("nan") if self.top is None else self.top.point.omega / HZ

    @property
    def points_low(self) -> int:
        """Number of accepted points with few harmonics."""
        return sum(a.point.support == self.low_harmonics for a in self.accepted)

    @property
    def failed(self) -> int:
        """Number of accepted points that did not converge."""
        return sum(not a.point.converged for a in self.accepted)

    @property
    def unknowns(self) -> int:
        """Total number of unknowns of all solutions, accepted or not: a measure of work that does not depend on the strategy."""
        return sum(p.unknowns for p in self.solved)

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

    @property
    def flanks(self) -> tuple[Accepted, ...]:
        """The points on either side of the peak whose amplitude is nearest to the fraction `FLANK` of the peak."""
        if self.top is None:
            return ()
        here, wanted = self.top.point.omega, FLANK * self.peak_amplitude
        sides = ([a for a in self.accepted if a.fields and side * (a.point.omega - here) > 0] for side in (-1, 1))
        return tuple(min(s, key=lambda a: abs(self.amplitude(a) - wanted)) for s in sides if s)


def collect(problem: ForcedProblem, points: Sequence[ForcedPoint], output: int) -> Response:
    """Sort the points of a case and expand their solutions to all dofs.

    Parameters
    ----------
    problem
        The problem of the sweep.
    points
        All points in the order of solution.
    output
        Index of the output with the peak; if the system takes the largest of several, its first output.
    """
    audits = audits_by_frequency(points)
    accepted = []
    for point, low in accepted_pairs(points):
        own = own_error(problem, point)
        more = _audit(point, audits.get(point.omega, []))
        audit, place = float("nan"), -1
        if more is not None:
            audit, place = problem.difference(point.omega, point.coefficients, more.coefficients)
        made = _accept(problem, point, low)
        of = problem.sweep.amplitude_of
        accepted.append(
            replace(
                made,
                driven=problem.driven,
                amplitude_of=of,
                own_error=own,
                audit_error=audit,
                audit=more,
                audit_place=place,
            )
        )
    some = problem.system.peak_of
    if some is not None and any(a.fields for a in accepted):
        sizes = np.array([a.amplitudes(problem.system.outputs.size)[some] for a in accepted])
        output = int(some[np.argmax(np.nanmax(sizes, axis=0))])
    amplitude = np.array([a.amplitudes(output + 1)[output] for a in accepted])
    peak = int(np.nanargmax(amplitude)) if np.any(np.isfinite(amplitude)) else -1
    return Response(tuple(points), tuple(accepted), peak, output, problem.sweep.first_harmonics)


def lost_point(problem: ForcedProblem, error: Exception) -> ForcedPoint:
    """Return an unconverged point for a response that could not start."""
    sweep, harmonics = problem.sweep, np.array(problem.sweep.first_harmonics, dtype=np.int64)
    shape = (int(harmonics[-1]) + 1, problem.system.retained.size)
    return ForcedPoint(
        stage="point" if sweep.auto else "low",
        index=0,
        omega=sweep.ends[0],
        coefficients=np.zeros(shape, dtype=complex),
        tangent=np.zeros(0),
        step=0.0,
        status=Status.NOT_FINITE if isinstance(error, FloatingPointError) else Status.SINGULAR,
        iterations=0,
        predicted_error=float("nan"),
        seconds_contact=0.0,
        seconds_linear=0.0,
        seconds_total=0.0,
        harmonics=harmonics,
    )


def _audit(point: ForcedPoint, audits: Sequence[ForcedPoint]) -> ForcedPoint | None:
    """Return the solution with the most harmonics at the frequency of a point; None if none has more than the point."""
    most = max(audits, key=lambda p: p.harmonics.size, default=point)
    return most if point.converged and most.harmonics.size > point.harmonics.size else None


def _accept(problem: ForcedProblem, point: ForcedPoint, low: ForcedPoint | None) -> Accepted:
    found = fields(problem, point) if point.converged else None
    if low is None or not low.converged:
        return Accepted(point, low, found, None, float("nan"))
    if low is point:
        return Accepted(point, low, found, found, float("nan"))
    error = problem.real_error(low, point) if point.converged else float("nan")
    return Accepted(point, low, found, fields(problem, low), error)


def _amplitudes(found: Fields | None, n_outputs: int, driven: Harmonics, of: AmplitudeOf) -> FloatArray:
    if found is None:
        return np.full(n_outputs, np.nan)
    return amplitudes(found.outputs[:, :n_outputs], driven, of)


@dataclass(frozen=True)
class Jump:
    """A step of a branch between two different motions.

    Parameters
    ----------
    step
        Index of the point before it.
    what
        Name of the quantity that jumps.
    size
        Factor of the jump.
    """

    step: int
    what: str
    size: float


def jumps(amplitude: FloatArray, loss: FloatArray, few: BoolArray, elastic: float) -> tuple[Jump, ...]:
    """Return the steps at which the response jumps.

    Parameters
    ----------
    amplitude
        (n,) amplitudes of consecutive points, m.
    loss
        (n,) energy dissipated by all contacts in a cycle, J.
    few
        (n,) whether a point keeps the harmonics of the first passage. Such points are connected by arc length; points solved with more may
        lie anywhere.
    elastic
        Largest energy stored by the contacts, J, a scale for the rounding of `loss`.
    """
    of_loss = {j.step: j for j in _jumps_of_loss(np.maximum(loss, 0.0), elastic)}
    return tuple(sorted((of_loss | _jumps_of_amplitude(amplitude, few)).values(), key=lambda j: j.step))


def _jumps_of_amplitude(amplitude: FloatArray, few: BoolArray) -> dict[int, Jump]:
    found = {}
    for k, (low, high) in enumerate(map(sorted, pairwise(amplitude))):
        if high > JUMP * low and not (few[k] and few[k + 1]):
            found[k] = Jump(k, f"amplitude {high / low:.3g} times", float(high / low))
    return found


def _jumps_of_loss(loss: FloatArray, elastic: float) -> list[Jump]:
    """Return the jumps of the dissipation. At the onset of slip it also grows from zero, but in similar steps."""
    step = np.abs(np.diff(loss))
    least = max(LOSS_COUNTS * float(loss.max(initial=0.0)), LOSS_SEEN * elastic)
    found = []
    for k, (low, high) in enumerate(map(sorted, pairwise(loss))):
        beside = max([*step[max(k - 1, 0) : k], *step[k + 1 : k + 2]], default=0.0)
        if low <= LOSS_SEEN * elastic:
            continue  # no dissipation yet: slip begins here
        if high > max(least, LOSS_JUMP * low) and step[k] > LOSS_STEP * beside:
            ratio = float(high / low)
            found.append(Jump(k, f"dissipation {ratio:.3g} times", ratio))
    return found


def stored_energy(gap: FloatArray | ComplexArray, force: FloatArray | ComplexArray) -> float:
    """Return the largest energy of all contacts together in a cycle, of order π |force| |gap|, J.

    Parameters
    ----------
    gap, force
        (point, harmonic from 1, contact, ...) coefficients, m and N.
    """
    own = [np.moveaxis(x, 2, 1) for x in (gap, force)]
    sizes = [np.sqrt(np.sum(np.abs(x) ** 2, axis=tuple(range(2, x.ndim)))) for x in own]
    each = np.sum(sizes[0] * sizes[1], axis=1)
    return float(np.pi * np.nanmax(each, initial=0.0))
