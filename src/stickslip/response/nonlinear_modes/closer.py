"""Refinement of a nonlinear mode at knees, at extremes, and where a harmonic meets another mode.

The continuation controls its steps by the change of the shape and may step over narrow features. Three tests find them:

- knee: interpolation between the neighbours misses a point;
- extreme: the vertex of the parabola through an extreme value and its neighbours differs from that value;
- internal resonance: the negative eigenvalues of the symmetric part of the Jacobian's block of a harmonic h > 1 change
  in number where another mode has the frequency hω.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import scipy.linalg
from scipy.interpolate import PchipInterpolator

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.harmonic.factors import as_array
from stickslip.operators import array_of
from stickslip.response.continuation.branch import Followed
from stickslip.response.nonlinear_modes.harmonic_levels import FAINT_RATIO, ModeCurve
from stickslip.response.self_excited.problem import SelfExcited
from stickslip.solve.branch import Latest
from stickslip.solve.continuation import Point
from stickslip.solve.newton_method import newton

KNEE = 0.02  # relative difference of frequency or damping ratio from interpolation between the neighbours
EXTREME = 1e-3  # relative difference of a parabola's vertex from the known extreme value
LOCATED = 0.01  # width in ln a at which a crossing counts as located
SILENT = 1e-6  # velocity of a harmonic over the first, up to which no force acts on it
TAKES_PART = 0.03  # velocity change at a crossing, over the first harmonic, above which the other mode takes part
# velocity of a harmonic outside the mode's shape, over the first harmonic, above which it takes part as well:
# a damped resonance extends over many points with small changes
AMPLIFIED = 0.1
REACHES = 0.05  # such a velocity above which neighbouring points belong to the internal resonance, too
MOST_ROWS = 400  # largest block of a harmonic whose eigenvalues are counted
SHORTEST = 1e-3  # smallest distance of points in ln a


@dataclass(frozen=True)
class Crossing:
    """Crossing of a harmonic of a mode with the frequency of another mode.

    Attributes
    ----------
    harmonic
        Number of the harmonic.
    first, last
        Indices of the points on either side.
    share
        Change of the harmonic's velocity amplitude between them, over the first harmonic; a mode that takes part
        reverses its sign.
    width
        Length of the interval in ln a.
    level
        Velocity amplitude of the harmonic outside the mode's own shape, over the first harmonic.
    mode
        Number of the other mode, by frequency.
    same_waves
        Whether the other mode is one of the same structure; on a wheel, harmonics are other waves.
    """

    harmonic: int
    first: int
    last: int
    share: float
    width: float
    level: float
    mode: int
    same_waves: bool

    @property
    def takes_part(self) -> bool:
        """Whether the other mode takes part in the motion."""
        return self.share > TAKES_PART or self.level > AMPLIFIED


@dataclass(frozen=True, eq=False)
class _Place:
    """Quantities of a point for the tests.

    They are ln a, frequency and damping ratio, the motion (H + 1, n) over a, and for each harmonic from 2 on the number
    of modes below it.
    """

    p: float
    numbers: FloatArray
    motion: ComplexArray
    negative: tuple[int, ...]


@dataclass(eq=False)
class Closer:
    """Refinement of a branch by intermediate points.

    Parameters
    ----------
    curve
        Equations of the motions.
    branch
        Points of the branch in their order; new points are inserted.
    """

    curve: ModeCurve
    branch: list[Followed]
    _places: dict[int, _Place] = field(default_factory=dict, repr=False)
    _left: set[tuple[float, float]] = field(default_factory=set, repr=False)
    _inside: dict[int, FloatArray] = field(default_factory=dict, repr=False)

    def run(self, most: int, done: Sequence[Followed] = ()) -> Iterator[Followed]:
        """Insert up to `most` points, and yield those not in `done`; each follows the point of its index."""
        stored, added = list(done), 0
        while added < most:
            need, i = max(self._needs(), default=(0.0, -1))
            if need <= 1.0:
                return
            made = stored.pop(0) if stored and stored[0].index == i else self._between(i)
            if made is None:
                self._left.add((self.branch[i].p, self.branch[i + 1].p))
                continue
            self.branch.insert(i + 1, made)
            added += 1
            if not any(made is one for one in done):
                yield made

    def crossings(self) -> list[Crossing]:
        """Return the crossings of moving harmonics with frequencies of other modes."""
        found = []
        for i, (one, other) in enumerate(self._pairs()):
            for k, (a, b) in enumerate(zip(one.negative, other.negative, strict=False), 2):
                if a != b and max(self._speed(k, m.motion[k]) for m in (one, other)) > SILENT:
                    share = self._speed(k, other.motion[k] - one.motion[k])
                    level = max(self._beside(k, m) for m in (one, other))
                    width = abs(other.p - one.p)
                    found.append(Crossing(k, i, i + 1, share, width, level, max(a, b), self._same_waves(k)))
        return found

    def resonant(self) -> list[int]:
        """Return for each point the harmonic in internal resonance with another mode; 0 without any."""
        found = [0] * len(self.branch)
        for one in self.crossings():
            if not one.takes_part:
                continue
            low, high = one.first, one.last
            while low > 0 and self._reached(low - 1, one.harmonic):
                low -= 1
            while high < len(self.branch) - 1 and self._reached(high + 1, one.harmonic):
                high += 1
            found[low : high + 1] = [one.harmonic] * (high + 1 - low)
        return found

    # --- tests ----------------------------------------------------------------------------------

    def _needs(self) -> Iterator[tuple[float, int]]:
        """Yield the need for a point after an index, by each test; above 1 a point is inserted."""
        wanted = [*self._of_knees(), *self._of_extremes()]
        wanted += [(c.width / LOCATED, c.first) for c in self.crossings()]
        for need, i in wanted:
            a, b = self.branch[i].p, self.branch[i + 1].p
            if abs(a - b) > SHORTEST and (a, b) not in self._left:
                yield need, i

    def _of_knees(self) -> Iterator[tuple[float, int]]:
        places = [self._place(f) for f in self.branch if f.converged]
        if len(places) < len(self.branch) or len(places) < 5:
            return
        along = np.append(0.0, np.cumsum(np.abs(np.diff([p.p for p in places]))))
        numbers = np.array([p.numbers for p in places])
        size = np.maximum(np.abs(numbers), [0.0, FAINT_RATIO])
        for i in range(1, len(places) - 1):
            others = np.delete(np.arange(len(places)), i)
            if np.any(np.diff(along[others]) <= 0.0):
                continue
            foretold = PchipInterpolator(along[others], numbers[others])(along[i])
            off = float(np.max(np.abs(foretold - numbers[i]) / size[i]))
            yield off / KNEE, i - 1
            yield off / KNEE, i

    def _of_extremes(self) -> Iterator[tuple[float, int]]:
        values = np.array([self._place(f).numbers if f.converged else [np.nan] * 2 for f in self.branch])
        for column, tests in ((1, (1.0,)), (0, (1.0, -1.0))):
            for sign in tests:
                own = sign * values[:, column]
                if not np.any(np.isfinite(own)):
                    continue
                i = int(np.nanargmax(own))
                if not 0 < i < len(own) - 1 or abs(own[i]) < (FAINT_RATIO if column else 0.0):
                    continue
                p = np.array([f.p for f in self.branch[i - 1 : i + 2]])
                yield from _of_top(p, own[i - 1 : i + 2], i)

    # --- quantities of a point ------------------------------------------------------------------

    def _reached(self, i: int, harmonic: int) -> bool:
        """Whether an internal resonance of a harmonic reaches a point."""
        one = self.branch[i]
        return one.converged and self._beside(harmonic, self._place(one)) > REACHES

    def _beside(self, harmonic: int, place: _Place) -> float:
        """Return the velocity amplitude of a harmonic outside the shape of the first harmonic, over the first."""
        if harmonic >= len(place.motion):
            return 0.0
        moving, own = place.motion[harmonic], place.motion[1]
        if self._same_waves(harmonic):
            mass = self.curve.problems[0].system.structure.of_harmonic(1).mass
            moving = moving - own * (np.vdot(own, mass @ moving) / np.vdot(own, mass @ own))
        return self._speed(harmonic, moving)

    def _same_waves(self, harmonic: int) -> bool:
        """Whether a harmonic has the same structural matrices as the first one."""
        structure = self.curve.problems[0].system.structure
        return structure.of_harmonic(harmonic) is structure.of_harmonic(1)

    def _pairs(self) -> Iterator[tuple[_Place, _Place]]:
        nothing = _Place(0.0, np.full(2, np.nan), np.zeros((0, 0), dtype=complex), ())
        every = [self._place(f) if f.converged else nothing for f in self.branch]
        return pairwise(every)

    def _place(self, found: Followed) -> _Place:
        if id(found) not in self._places:
            own, x = self.curve.problems[found.level], found.point.x
            numbers = np.array(self.curve.frequency_and_damping(found.level, x))
            omega = own.omega(x)
            motion = self.curve.linear(found.level, x).recover(omega, own.relative(x))
            motion = motion / self._speed(1, motion[1])
            self._places[id(found)] = _Place(found.p, numbers, motion, self._negative(found))
        return self._places[id(found)]

    def _speed(self, harmonic: int, moving: ComplexArray) -> float:
        """Return ``h sqrt(X^H M X)`` of a harmonic (n,)."""
        mass = self.curve.problems[0].system.structure.of_harmonic(harmonic).mass
        return harmonic * float(np.sqrt(max(np.vdot(moving, mass @ moving).real, 0.0)))

    def _negative(self, found: Followed) -> tuple[int, ...]:
        """Return the number of modes below the frequency of each harmonic from 2 on.

        By Haynsworth's rule these are the modes of the condensed block and of the interior together.
        """
        own = self.curve.problems[found.level]
        n, omega = own.balance.linear.n, own.omega(found.point.x)
        if max(2 * n, own.system.structure.n) > MOST_ROWS:
            return ()
        whole = array_of(self.curve.problem(found.level).linearise(found.point.x, found.p).jac)
        if whole is None:
            return ()
        counts = []
        for h in range(2, own.balance.order + 1):
            place = n * (2 * h - 1)
            block = whole[place : place + 2 * n, place : place + 2 * n]
            below = np.linalg.eigvalsh(block + block.T) < 0.0
            inside = (h * omega) ** 2 * self._interior(own, h) > 1.0
            counts.append(int(np.sum(below)) // 2 + int(np.sum(inside)))
        return tuple(counts)

    def _interior(self, own: SelfExcited, harmonic: int) -> FloatArray:
        """Return the inverse squares of the fixed-interface frequencies, s²/rad²: the retained coordinates are held."""
        if harmonic not in self._inside:
            side = own.system.structure.of_harmonic(harmonic)
            inner = np.setdiff1d(np.arange(own.system.structure.n), own.balance.linear.retained)
            K, M = (as_array(m)[np.ix_(inner, inner)] for m in (side.stiffness, side.mass))
            squares = scipy.linalg.eigvalsh(M, K) if inner.size else np.zeros(0)
            self._inside[harmonic] = np.asarray(squares, dtype=float)
        return self._inside[harmonic]

    def _between(self, i: int) -> Followed | None:
        """Return the motion midway between a point and the next; None unless it is near both."""
        one, other = self.branch[i], self.branch[i + 1]
        level, p = max(one.level, other.level), 0.5 * (one.p + other.p)
        problem = self.curve.problems[level]
        latest = Latest(self.curve.problem(level))
        ends = [self.curve.lifted(f.point.x, f.level, level) for f in (one, other)]
        solution = newton(lambda y: latest.linearise(y, p), 0.5 * (ends[0] + ends[1]), problem.how.newton)
        if not solution.status.converged:
            return None
        point = Point(solution.x, p, np.zeros(solution.x.size + 1), 0.0, solution, 0.0)
        made = Followed("between", i, level, point, self.curve.judge(level, point, latest), 0.0)
        return made if all(self.curve.near(f, made) for f in (one, other)) else None


def _of_top(p: FloatArray, values: FloatArray, i: int) -> Iterator[tuple[float, int]]:
    """Yield the need for a point near the largest value, and the index after which it is inserted.

    The largest value has the index `i`.

    The need is the distance of the vertex of the parabola through it and its neighbours from this value.
    """
    if not np.all(np.isfinite(values)) or not (p[0] < p[1] < p[2] or p[0] > p[1] > p[2]):
        return
    a, b, c = np.polyfit(p - p[1], values, 2)
    if a >= 0.0:
        return
    top = c - 0.25 * b * b / a
    place = -0.5 * b / a
    need = float(abs(top - values[1]) / max(abs(values[1]), 1e-300)) / EXTREME
    yield need, i if place * (p[2] - p[1]) > 0.0 else i - 1
