"""A nonlinear mode of tmdsimpy: mode 1 of the chain of 20 masses with 6 Jenkins elements, which folds back four times, H = 5, 256 samples.

Compared by distance in the plane, amplitude against frequency and damping ratio, each over its range: between folds several motions have the same amplitude.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from evidence.models.lumped import small_chain
from evidence.validation.compare import Record, bound, left_out, record
from evidence.validation.reference_data import chain_mode, has_complete
from stickslip.arrays import FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.continuation.branch import Followed, Judged
from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint, ModeSweep, mode_point, nonlinear_mode
from stickslip.response.nonlinear_modes.harmonic_levels import ModeCurve, by_energy
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import Solution, newton
from stickslip.solve.status import Status
from stickslip.solve.steps import across

SOURCE = "tmdsimpy, commit 17d5fc3"
CASE = "chain of 20 masses, mode 1"
HOW = Discretisation(order=5, samples=256, evaluator="intervals")
FINE = 600  # points, from which motions beside the rows are solved
CORRECTIONS = 12  # of what is solved, until it is the nearest to the row
AHEAD = 1e-6  # of the ranges, to a second motion that tells the direction of the curve
CLOSE = 1e-8  # of the ranges, along the curve
LARGEST = 1e-3  # distance, in ranges
PLAIN = 30


def mode() -> SelfExcited:
    """Return the mode, its amplitude that of the tip."""
    system, load = small_chain(), HarmonicLoad(np.zeros(20))
    return self_excited_motions(system, load, stuck_modes(system, 1)[0], 19, HOW)


def ours(points: int) -> Backbone:
    """Return the mode as it is followed."""
    own = mode()
    sweep = ModeSweep(span=tuple(abs(own.mode.shape[19]) * np.array([1e-3, 12.0])), points=points)
    return nonlinear_mode(own.system, own.load, own.mode, 19, HOW, sweep)


def plane(point: ModePoint) -> FloatArray:
    """Return log10 of the modal amplitude, frequency and damping ratio."""
    return np.array([np.log10(point.modal_amplitude), point.omega, point.ratio])


def folds(log: FloatArray) -> FloatArray:
    """Return log10 of the amplitude where it turns back."""
    turned = np.diff(np.sign(np.diff(log))) != 0
    return np.asarray(log[1:-1][turned])


def nearest(row: FloatArray, curve: FloatArray) -> tuple[int, float]:
    """Return the segment of a curve that a row lies nearest to, and at which share of it."""
    way = np.diff(curve, axis=0)
    share = np.sum((row - curve[:-1]) * way, axis=1) / np.sum(way**2, axis=1)
    share = np.clip(share, 0.0, 1.0)
    away = np.linalg.norm(curve[:-1] + share[:, None] * way - row, axis=1)
    segment = int(np.argmin(away))
    return segment, float(share[segment])


def distances(rows: FloatArray, found: Backbone) -> FloatArray:
    """Return how far each row is from the nearest motion of ours that is solved, in ranges of the rows; infinite where none is found.

    A chord of our curve tells where to begin, and in which direction of the plane a motion is asked for; it is no part of the distance. The equations
    are those of the mode with one condition more, no row's amplitude being held, since at folds that decides nothing.
    """
    size = np.ptp(rows, axis=0)
    curve = np.array([plane(p) for p in found.solutions]) / size
    beside = Beside.of(found)
    return np.array([beside.distance(row, curve, size) for row in rows])


@dataclass(frozen=True, eq=False)
class Beside:
    """Solves motions beside points of the plane."""

    curve: ModeCurve
    known: tuple[tuple[FloatArray, float], ...]  # unknowns and ln of the size of the points

    @classmethod
    def of(cls, found: Backbone) -> "Beside":
        """Return what solves beside a mode that was followed."""
        own, known = mode(), []
        weight = by_energy(own)[0].weight
        for point in found.solutions:
            motion = point.coefficients[:, own.balance.linear.retained]
            a = float(np.sqrt(np.vdot(motion[1:], motion[1:] @ weight.T).real))
            y = own.unknowns(motion / a, point.omega, own.level(point.ratio, point.omega))
            known.append((y, float(np.log(a))))
        return cls(ModeCurve.of(own, (1.0, np.e), 1), tuple(known))

    def distance(self, row: FloatArray, curve: FloatArray, size: FloatArray) -> float:
        """Return how far our motion nearest to a row is from it; every one that is solved bounds that."""
        at, share = nearest(row / size, curve)
        way = curve[at + 1] - curve[at]
        way /= np.linalg.norm(way)
        (one, p), (other, q) = self.known[at : at + 2]
        v = np.append(one, p) + share * (np.append(other, q) - np.append(one, p))
        row_of = np.zeros(v.size)
        own = self.curve.problems[0]
        # of ln ω, the level and ln a, which change frequency, damping ratio and amplitude
        omega, ratio = own.omega(v[:-1]), own.ratio(v[:-1])
        row_of[-3] = way[1] * omega / size[1] - way[2] * ratio / size[2]
        row_of[-2] = way[2] * own.level(1.0, omega) ** -1 / size[2]
        row_of[-1] = way[0] / size[0] / np.log(10.0)
        value, best = float(row_of @ v), np.inf
        for _ in range(CORRECTIONS):
            ends = []
            for ahead in (0.0, AHEAD):
                equation = partial(across, self.curve.problem(0), row=row_of, value=value + ahead)
                solved = newton(equation, v, HOW.newton)
                if not solved.status.converged:
                    return best
                v = solved.x
                ends.append(self.in_plane(v) / size)
            off, way = row / size - ends[0], ends[1] - ends[0]
            best = min(best, float(np.linalg.norm(off)))
            along = float(off @ way) / float(way @ way) * AHEAD
            if abs(along) < CLOSE:
                break
            value += along
        return best

    def in_plane(self, v: FloatArray) -> FloatArray:
        """Return what unknowns and ln of the size are in the plane."""
        solution = Solution(v[:-1], Status.CONVERGED, 0, 0.0, 0.0, 0.0)
        point = Point(v[:-1], float(v[-1]), np.zeros(v.size), 0.0, solution, 0.0)
        return plane(mode_point(self.curve, Followed("found", 0, 0, point, Judged(), 0.0)))


def run() -> list[Record]:
    """Compare all rows, and the folds with few points."""
    if not has_complete():
        return [left_out(CASE, "the curve is not at hand", SOURCE)]
    rows = chain_mode()
    fine = ours(FINE)
    away = distances(rows[:, [0, 2, 4]], fine)
    theirs = folds(rows[:, 0])
    plain, close = (folds(np.array([plane(p)[0] for p in f.solutions])) for f in (ours(PLAIN), fine))
    records = [
        bound(CASE, f"largest distance of {len(rows)} rows", float(away.max()), LARGEST, SOURCE),
        bound(CASE, "median distance", float(np.median(away)), 5e-5, SOURCE),
        record(CASE, f"folds with {PLAIN} points asked for", len(plain), len(theirs), 0.0, SOURCE),
    ]
    return records + [
        record(CASE, f"log10 a of fold {i + 1}", float(one), float(other), 2e-3, SOURCE)
        for i, (one, other) in enumerate(zip(close, theirs, strict=True))
    ]
