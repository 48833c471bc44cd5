"""Journal records of nonlinear modes, the modes assembled from them, and the record of a case."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

from stickslip.analyses.vibrating import KeptMotions, kept_motions, mode_name
from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.column import column, rows
from stickslip.reduction.waves import NO_WAVE, wave
from stickslip.response.continuation.branch import Followed, Judged, Kind, branch_of
from stickslip.response.nonlinear_modes.backbone import ModeWay, mode_point, most_damped
from stickslip.response.self_excited.modes import StuckMode
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Status
from stickslip.study.analysis import Solved
from stickslip.units import HZ

END = "end"  # kind of the record after the last point of a mode


def _nothing() -> FloatArray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class ModeRecord:
    """Result of one solve along a nonlinear mode, or the end of the mode.

    Parameters
    ----------
    wave_number, mode
        Wave number, -1 for a single structure; number of the mode from 1, by frequency with contacts stuck.
    kind
        As in `stickslip.response.continuation.branch.Followed`, or ``end``.
    index, level, seconds, bound
        As in `Followed` and its judgement.
    x, p, tangent, step, orientation, bend
        State of the continuation at the point with all digits; an interrupted run continues from it.
    status, iterations, residual_norm
        Outcome of the solver.
    amplitude, omega, ratio, modal_amplitude, energy, slipping, open_for, change
        Properties of the motion as in `ModePoint`; NaN if it is no point of the mode.
    motion
        (order + 1, n, 2) displacement of all coordinates, real and imaginary, m; empty if it is no point of the mode.
    order
        Highest harmonic.
    mode_omega, mode_ratio, tolerance, end, problem, resonant, other_ratio
        Properties of the end, as in `ModeBranch`.
    """

    wave_number: int
    mode: int
    kind: str
    index: int = -1
    level: int = -1
    seconds: float = 0.0
    bound: float = np.nan
    x: FloatArray = field(default_factory=_nothing)
    p: float = np.nan
    tangent: FloatArray = field(default_factory=_nothing)
    step: float = np.nan
    orientation: float = np.nan
    bend: FloatArray | None = None
    status: Status = Status.CONVERGED
    iterations: int = 0
    residual_norm: float = np.nan
    amplitude: float = np.nan
    omega: float = np.nan
    ratio: float = np.nan
    modal_amplitude: float = np.nan
    energy: float = np.nan
    slipping: float = np.nan
    open_for: float = np.nan
    change: float = np.nan
    motion: FloatArray = field(default_factory=_nothing)
    order: int = -1
    mode_omega: float = np.nan
    mode_ratio: float = np.nan
    tolerance: float = np.nan
    end: str = ""
    problem: str = ""
    resonant: tuple[int, ...] = ()
    other_ratio: float = np.nan

    @property
    def followed(self) -> Followed:
        """The point as the continuation stored it."""
        kind: Kind = self.kind  # type: ignore[assignment]  # any kind but the end
        solution = Solution(self.x, self.status, self.iterations, self.residual_norm, 0.0, 0.0)
        point = Point(self.x, self.p, self.tangent, self.step, solution, self.orientation, bend=self.bend)
        return Followed(kind, self.index, self.level, point, Judged(self.bound), self.seconds)


def mode_record(wave_number: int, mode: StuckMode, way: ModeWay, found: Followed) -> ModeRecord:
    """Return the journal record of a point along a mode of a wave."""
    point, solution = found.point, found.point.solution
    return ModeRecord(
        wave_number,
        mode.number,
        found.kind,
        found.index,
        found.level,
        found.seconds,
        found.judged.bound,
        point.x,
        point.p,
        point.tangent,
        point.step,
        point.orientation,
        point.bend,
        solution.status,
        solution.iterations,
        solution.residual_norm,
        order=way.curve.problems[found.level].balance.order,
        **_motion(way, found),
    )


def _motion(way: ModeWay, found: Followed) -> dict[str, Any]:
    """Return the motion at a point of a mode, by the names of the fields of `ModeRecord`; empty if it is no point."""
    if not found.converged or found.kind not in ("point", "found", "between"):
        return {}
    motion = mode_point(way.curve, found)
    return {
        "amplitude": motion.amplitude,
        "omega": motion.omega,
        "ratio": motion.ratio,
        "modal_amplitude": motion.modal_amplitude,
        "energy": motion.energy,
        "slipping": motion.slipping,
        "open_for": motion.open_for,
        "change": motion.change,
        "motion": np.stack([motion.coefficients.real, motion.coefficients.imag], axis=-1),
    }


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeBranch:
    """A nonlinear mode of a wave; NaN at points without a solution.

    Attributes
    ----------
    motions
        (points, harmonics, n, 2) displacement of all coordinates, real and imaginary, m; NaN without a solution. A result holds retained
        coordinates and outputs.
    """

    wave_number: int = column("1", "wave number of the modes; -1 for a single structure")
    nodal_diameter: int = column("1", "its nodal diameters; -1 for a single structure")
    mode: int = column("1", "number of the mode, by frequency with contacts stuck")
    mode_frequency_hz: float = column("Hz", "frequency with contacts stuck")
    mode_damping_ratio: float = column("1", "damping ratio with contacts stuck")
    accuracy: float = column("1", "relative change by more harmonics that was asked for")
    end: str = column("1", "how the mode ends")
    problem: str = column("1", "why there is none")
    gross_slip_amplitude: float = column(
        "m", "amplitude from which on all contacts, and all their sliders, slip or open at some time"
    )
    largest_damping_ratio: float = column("1", "largest damping ratio without internal resonances")
    largest_damping_amplitude: float = column("m", "amplitude there")
    other_damping_ratio: float | None = column(
        "1", "damping ratio there by the other concept; NaN without a motion near", default=None
    )
    amplitude: FloatArray = column("m", "amplitude of the output in the first harmonic", along="point")
    frequency_hz: FloatArray = column("Hz", "frequency of the motion", along="point")
    damping_ratio: FloatArray = column("1", "damping ratio of the motion; negative: it grows", along="point")
    modal_amplitude: FloatArray = column("kg^0.5 m", "root of X^H M X of the first harmonic", along="point")
    energy: FloatArray = column(
        "J", "twice the mean kinetic energy of all harmonics, of a wheel of one sector", along="point"
    )
    harmonics: IntArray = column("1", "highest harmonic", along="point")
    status: IntArray = column("1", "how the solver ended: 0 is a solution", along="point")
    slipping: FloatArray = column(
        "1",
        "share of the contact points that slip or open at some time; of a contact of several sliders the share that slips",
        along="point",
    )
    open_for: FloatArray = column("1", "largest share of the period for which a contact point is open", along="point")
    change: FloatArray = column(
        "1",
        "relative change of frequency or damping ratio predicted for more harmonics; with the most harmonics, the change from fewer; NaN with one set alone",
        along="point",
    )
    resonant_harmonic: IntArray | None = column(
        "1",
        "harmonic by which another mode takes part (internal resonance); 0 without any",
        along="point",
        default=None,
    )
    motions: FloatArray = field(default_factory=lambda: np.zeros((0, 1, 0, 2)))

    @property
    def name(self) -> str:
        """Name of the mode."""
        return mode_name(self.wave_number, self.mode)

    @property
    def known(self) -> BoolArray:
        """Mask of the valid points; results pad shorter modes."""
        return np.asarray(self.status >= 0)

    @property
    def resonant(self) -> BoolArray:
        """Mask of the points on an internal resonance."""
        own = self.resonant_harmonic
        return np.zeros(self.status.shape, dtype=bool) if own is None else np.asarray(own > 0)

    @property
    def most_on_resonance(self) -> int | None:
        """Index of the largest damping ratio if it lies on an internal resonance; otherwise None."""
        ratio = self.damping_ratio
        if not np.any(self.resonant) or not np.any(np.isfinite(ratio)):
            return None
        most = int(np.nanargmax(ratio))
        return most if self.resonant[most] and ratio[most] > self.largest_damping_ratio else None


@dataclass(frozen=True, eq=False, kw_only=True)
class NonlinearModes(KeptMotions):
    """Record of a case."""

    output: str = column("1", "output whose amplitude is told", default="")
    retained_displacement: FloatArray | None = column(
        "m",
        "the motion in each harmonic: the real and the imaginary part",
        along="branch point harmonic coordinate part",
        default=None,
    )
    output_displacement: FloatArray | None = column(
        "m", "the same of the outputs", along="branch point harmonic reported part", default=None
    )
    concept: str | None = column("1", "which motions the modes are made of", default=None)
    branches: tuple[ModeBranch, ...] = rows("branch")


def answer(solved: Solved) -> NonlinearModes:
    """Return the record of a case from the records and notes of its job."""
    notes, model = solved.notes, solved.notes.get("model", {})
    output = str(model.get("output", ""))
    branches = branches_of(solved.records, int(model.get("sectors", 1)))
    if not branches or "coordinates" not in notes:
        return NonlinearModes(output=output, branches=branches)
    known = notes["coordinates"]
    kept = kept_motions(_every_motion(branches), known)
    return NonlinearModes(output=output, branches=branches, concept=str(known["concept"]), **kept)


def branches_of(records: Sequence[ModeRecord], sectors: int) -> tuple[ModeBranch, ...]:
    """Return the finished modes, whose ends are among the records."""
    ways = [list(group) for _, group in groupby(records, lambda r: (r.wave_number, r.mode))]
    return tuple(_branch(way, last, sectors) for *way, last in ways if last.kind == END)


def _branch(way: Sequence[ModeRecord], last: ModeRecord, sectors: int) -> ModeBranch:
    points = [] if last.problem else branch_of(way)
    amplitude, ratio, slipping = (_along(points, name) for name in ("amplitude", "ratio", "slipping"))
    most = most_damped(ratio, last.resonant)
    gross = amplitude[slipping == 1.0]
    return ModeBranch(
        wave_number=last.wave_number,
        nodal_diameter=wave(last.wave_number, sectors).nodal_diameter if last.wave_number >= 0 else NO_WAVE,
        mode=last.mode,
        mode_frequency_hz=last.mode_omega / HZ,
        mode_damping_ratio=last.mode_ratio,
        accuracy=last.tolerance,
        end=last.end,
        problem=last.problem,
        gross_slip_amplitude=float(gross[0]) if gross.size else np.nan,
        largest_damping_ratio=np.nan if most is None else float(ratio[most]),
        largest_damping_amplitude=np.nan if most is None else float(amplitude[most]),
        other_damping_ratio=last.other_ratio,
        amplitude=amplitude,
        frequency_hz=_along(points, "omega") / HZ,
        damping_ratio=ratio,
        modal_amplitude=_along(points, "modal_amplitude"),
        energy=_along(points, "energy"),
        harmonics=np.array([r.order for r in points], dtype=np.int64),
        status=np.array([int(r.status) for r in points], dtype=np.int64),
        slipping=slipping,
        open_for=_along(points, "open_for"),
        change=_along(points, "change"),
        resonant_harmonic=np.array(
            last.resonant if len(last.resonant) == len(points) else [0] * len(points), dtype=np.int64
        ),
        motions=_motions(points),
    )


def _along(points: Sequence[ModeRecord], name: str) -> FloatArray:
    return np.array([getattr(r, name) for r in points], dtype=np.float64)


def _motions(points: Sequence[ModeRecord]) -> FloatArray:
    found = [r.motion for r in points if r.motion.ndim == 3]
    shape = max((m.shape[0] for m in found), default=1), *(found[0].shape[1:] if found else (0, 2))
    out = np.full((len(points), *shape), np.nan)
    for own, record in zip(out, points, strict=True):
        if record.motion.ndim == 3:
            own[:] = 0.0
            own[: len(record.motion)] = record.motion
    return out


def _every_motion(branches: Sequence[ModeBranch]) -> FloatArray:
    """Return the motions (branches, most points, most harmonics, n, 2) of all modes; NaN in the padding."""
    most = np.max([b.motions.shape for b in branches], axis=0)
    out = np.full((len(branches), *most), np.nan)
    for own, branch in zip(out, branches, strict=True):
        points, harmonics, n, _ = branch.motions.shape
        own[:points, :, :n] = 0.0
        own[:points, :harmonics, :n] = branch.motions
    return out
