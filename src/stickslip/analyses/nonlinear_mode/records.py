"""Journal records of nonlinear modes, and the modes made of them."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.response.continuation.branch import Followed, Judged, Kind, branch_of
from stickslip.response.nonlinear_modes.backbone import ModeWay, mode_point
from stickslip.response.self_excited.modes import StuckMode
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Solution
from stickslip.solve.status import Status

END = "end"  # kind of the record behind the last one of a mode
NUMBERS = ("amplitude", "omega", "ratio", "modal_amplitude", "energy", "slipping", "open_for", "change")


def _nothing() -> FloatArray:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class ModeRecord:
    """What was found in one solve on the way along a nonlinear mode, or how the mode ended.

    Parameters
    ----------
    wave_number, mode
        -1 for a single structure; from 1, by frequency with contacts stuck.
    kind
        As of `stickslip.response.continuation.branch.Followed`, or ``end``.
    index, level, seconds, bound
        As of `Followed`, and of its judgement.
    x, p, tangent, step, orientation, bend
        Of its point, with all digits: an interrupted run goes on from them.
    status, iterations, residual_norm
        How the solver ended.
    told
        (8,) what results tell of a motion, in the order of `NUMBERS`; NaN of what is no point of the mode.
    motion
        (order + 1, n, 2) displacement of all coordinates, real and imaginary, m; empty of what is no point of the mode.
    order
        Highest harmonic.
    mode_omega, mode_ratio, tolerance, end, problem
        Of the end, as of `ModeBranch`.
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
    told: FloatArray = field(default_factory=_nothing)
    motion: FloatArray = field(default_factory=_nothing)
    order: int = -1
    mode_omega: float = np.nan
    mode_ratio: float = np.nan
    tolerance: float = np.nan
    end: str = ""
    problem: str = ""

    @property
    def followed(self) -> Followed:
        """What was found, as it was on the way."""
        kind: Kind = self.kind  # type: ignore[assignment]  # any but that of the end
        solution = Solution(self.x, self.status, self.iterations, self.residual_norm, 0.0, 0.0)
        point = Point(self.x, self.p, self.tangent, self.step, solution, self.orientation, bend=self.bend)
        return Followed(kind, self.index, self.level, point, Judged(self.bound), self.seconds)


def record_of(wave: int, mode: StuckMode, way: ModeWay, found: Followed) -> ModeRecord:
    """Return what is kept of what was found on the way along a mode of a wave."""
    point, solution = found.point, found.point.solution
    told, moved = np.full(len(NUMBERS), np.nan), _nothing()
    if found.converged and found.kind in ("point", "found", "between"):
        motion = mode_point(way.curve, found)
        told[:] = [getattr(motion, name) for name in NUMBERS]
        moved = np.stack([motion.coefficients.real, motion.coefficients.imag], axis=-1)
    return ModeRecord(
        wave,
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
        told,
        moved,
        way.curve.problems[found.level].balance.order,
    )


@dataclass(frozen=True, eq=False)
class ModeBranch:
    """A nonlinear mode of a wave.

    Parameters
    ----------
    wave_number
        -1 for a single structure.
    mode
        From 1, by frequency with contacts stuck.
    omega, ratio
        Of the linear mode: rad/s and damping ratio.
    amplitude, motion_omega, motion_ratio
        (points,) m, rad/s, damping ratio; NaN where none was found.
    modal_amplitude, energy
        (points,) kg^0.5 m and J.
    order, status
        (points,) highest harmonic, and how the solver ended.
    slipping, open_for, change
        (points,) share of contact points that slip or open (of several sliders the share that slips), largest share of the period for which one is open, and relative change that
        more harmonics are foretold to make.
    motions
        (points, harmonics, n, 2) displacement of all coordinates, real and imaginary, m; NaN where none was found.
    tolerance
        Relative change of frequency or damping ratio that was asked for.
    end
        How the curve ended.
    problem
        Why there is none; empty where there is one.
    """

    wave_number: int
    mode: int
    omega: float
    ratio: float
    amplitude: FloatArray
    motion_omega: FloatArray
    motion_ratio: FloatArray
    modal_amplitude: FloatArray
    energy: FloatArray
    order: IntArray
    status: IntArray
    slipping: FloatArray
    open_for: FloatArray
    change: FloatArray
    motions: FloatArray
    tolerance: float
    end: str
    problem: str = ""


def branches_of(records: Sequence[ModeRecord]) -> list[ModeBranch]:
    """Return the modes whose ends are among the records."""
    found = []
    for _, group in groupby(records, lambda r: (r.wave_number, r.mode)):
        *way, last = group
        if last.kind == END:
            found.append(_branch(way, last))
    return found


def _branch(way: Sequence[ModeRecord], last: ModeRecord) -> ModeBranch:
    points = [] if last.problem else branch_of(way)
    told = np.array([r.told for r in points]).reshape(-1, len(NUMBERS)).T
    amplitude, omega, ratio, modal_amplitude, energy, slipping, open_for, change = told
    order, status = (np.array([int(getattr(r, name)) for r in points], dtype=np.int64) for name in ("order", "status"))
    return ModeBranch(
        last.wave_number,
        last.mode,
        last.mode_omega,
        last.mode_ratio,
        amplitude,
        omega,
        ratio,
        modal_amplitude,
        energy,
        order,
        status,
        slipping,
        open_for,
        change,
        _motions(points),
        last.tolerance,
        last.end,
        last.problem,
    )


def _motions(points: Sequence[ModeRecord]) -> FloatArray:
    found = [r.motion for r in points if r.motion.ndim == 3]
    shape = max((m.shape[0] for m in found), default=1), *(found[0].shape[1:] if found else (0, 2))
    out = np.full((len(points), *shape), np.nan)
    for own, record in zip(out, points, strict=True):
        if record.motion.ndim == 3:
            own[:] = 0.0
            own[: len(record.motion)] = record.motion
    return out
