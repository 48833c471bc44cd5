"""More points of a backbone where interpolation is poor: damping has a corner where slip begins."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.continuation.branch import Followed, Judged
from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint, mode_point
from stickslip.response.nonlinear_modes.harmonic_levels import ModeCurve, Size, by_energy
from stickslip.response.nonlinear_modes.sdof_oscillator import MIN_BACKBONE_POINTS, modal_oscillator
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.problem import self_excited_motions
from stickslip.solve.branch import Point
from stickslip.solve.newton_method import newton

FAINT_RATIO = 1e-4  # smallest reference of relative changes of the damping ratio
DOUBT = 4.0  # factor on the tolerance for interpolation without the point itself, over twice the distance
SHORTEST = 1e-3  # smallest distance of points in ln a


@by_one_thread
def refined(
    backbone: Backbone, load: HarmonicLoad, how: Discretisation | None = None, tolerance: float = 5e-3, most: int = 80
) -> Backbone:
    """Return a backbone with points added until interpolation between them predicts damping and modal force.

    Parameters
    ----------
    backbone
        Result of `nonlinear_mode`.
    load
        Static and harmonic load, N.
    how
        Samples and solver; the highest harmonic is taken from the backbone.
    tolerance
        Relative error of the interpolation midway between two points.
    most
        Largest number of added points; the largest errors come first.
    """
    known = list(backbone.solutions)
    if len(known) < MIN_BACKBONE_POINTS:
        return backbone
    own = _Solver.of(backbone, how or Discretisation())
    wanted = _doubted(backbone, load, known, tolerance)
    added = 0
    while wanted and added < most:
        _, before, after = wanted.pop()
        here = own.between(before, after)
        if here is None or not here.converged:
            continue
        foretold = _numbers(backbone, load, known, here.modal_amplitude, known.index(before))
        known.insert(known.index(before) + 1, here)
        added += 1
        off = _distance(foretold, _own_numbers(load, here))
        if off > tolerance:
            wanted += [(off, a, b) for a, b in ((before, here), (here, after)) if _far(a, b)]
            wanted.sort(key=lambda one: one[0])
    return replace(backbone, points=tuple(known))


@dataclass(frozen=True, eq=False)
class _Solver:
    """Solver of the mode with one set of harmonics."""

    curve: ModeCurve
    size: Size

    @classmethod
    def of(cls, backbone: Backbone, how: Discretisation) -> "_Solver":
        own = self_excited_motions(backbone.system, backbone.load, backbone.mode, backbone.dof, how).with_order(
            max(p.order for p in backbone.points)
        )
        return cls(ModeCurve.of(own, (1.0, np.e), 1), by_energy(own)[0])

    def between(self, before: ModePoint, after: ModePoint) -> ModePoint | None:
        """Return the motion at the geometric mean of two points' amplitudes."""
        own, equation = self.curve.problems[0], self.curve.problem(0)
        sizes = [self._size(p) for p in (before, after)]
        motions = [self._retained(p) / s for p, s in zip((before, after), sizes, strict=True)]
        omega = float(np.sqrt(before.omega * after.omega))
        level = own.level(0.5 * (before.ratio + after.ratio), omega)
        mean: ComplexArray = np.asarray(0.5 * (motions[0] + motions[1]))
        start = own.unknowns(mean, omega, level)
        p = float(np.log(sizes[0] * sizes[1])) / 2
        found = newton(lambda y: equation.linearise(y, p), start, own.how.newton)
        point = Point(found.x, p, np.zeros(found.x.size + 1), 0.0, found, 0.0)
        return mode_point(self.curve, Followed("found", 0, 0, point, Judged(), 0.0))

    def _retained(self, point: ModePoint) -> ComplexArray:
        balance = self.curve.problems[0].balance
        out = np.zeros((balance.order + 1, balance.linear.n), dtype=complex)
        out[: point.order + 1] = point.coefficients[:, balance.linear.retained]
        return out

    def _size(self, point: ModePoint) -> float:
        x = self._retained(point)[1:]
        return float(np.sqrt(np.vdot(x, x @ self.size.weight.T).real))


def _doubted(
    backbone: Backbone, load: HarmonicLoad, known: Sequence[ModePoint], tolerance: float
) -> list[tuple[float, ModePoint, ModePoint]]:
    """Return pairs of neighbours between which interpolation is doubtful, with its error, the worst pair last.

    A pair is doubtful if interpolation between the other points misses one of the two.
    """
    off = np.zeros(len(known))
    for i in range(1, len(known) - 1):
        others = [*known[:i], *known[i + 1 :]]
        foretold = _numbers(backbone, load, others, known[i].modal_amplitude, i - 1)
        off[i] = _distance(foretold, _own_numbers(load, known[i]))
    found = [
        (max(off[i], off[i + 1]), known[i], known[i + 1])
        for i in range(len(known) - 1)
        if max(off[i], off[i + 1]) > DOUBT * tolerance and _far(known[i], known[i + 1])
    ]
    return sorted(found, key=lambda one: one[0])


def _numbers(
    backbone: Backbone, load: HarmonicLoad, known: Sequence[ModePoint], amplitude: float, first: int
) -> FloatArray:
    """Interpolate frequency, damping ratio and modal force at an amplitude after the point `first`."""
    own = modal_oscillator(replace(backbone, points=tuple(known)), load)
    logs = np.log([known[first].modal_amplitude, amplitude])
    before = float(np.sum(np.abs(np.diff(np.log([p.modal_amplitude for p in known[: first + 1]])))))
    here = own.at(np.array([own.begins + before + abs(logs[1] - logs[0])]))
    return np.array([here.omega[0], here.ratio[0], abs(here.force[0])])


def _own_numbers(load: HarmonicLoad, point: ModePoint) -> FloatArray:
    force = abs(np.vdot(point.coefficients[1], load.harmonics[1])) / point.modal_amplitude
    return np.array([point.omega, point.ratio, force])


def _distance(foretold: FloatArray, found: FloatArray) -> float:
    """Return the largest relative difference of two sets of numbers."""
    size = np.maximum(np.abs(found), [0.0, FAINT_RATIO, 0.0])
    return float(np.max(np.abs(foretold - found) / np.maximum(size, 1e-300)))


def _far(one: ModePoint, other: ModePoint) -> bool:
    return abs(float(np.log(one.modal_amplitude / other.modal_amplitude))) > SHORTEST
