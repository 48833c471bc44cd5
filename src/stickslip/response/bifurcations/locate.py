"""Location of bifurcations: between points with different numbers of multipliers outside the unit circle.

Multipliers are sorted to be continuous along the branch; its segments that bracket a bifurcation are then narrowed.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import StickslipError, input_error
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.bifurcations.found import Bifurcation, BifurcationKind, Bifurcations
from stickslip.response.forced.problem import Balance, ForcedPoint, ForcedProblem, forced_point
from stickslip.response.stability.found import UNIT_TOLERANCE, Stability
from stickslip.response.stability.multipliers import stability
from stickslip.solve.branch import Following, Point, measure_at, reversed_point
from stickslip.solve.branch_events import FOLD, Mark, located
from stickslip.solve.continuation import start_point

SAME_SHEET = 0.3  # relative change of a motion by more harmonics above which it is another motion
APART = 100.0  # largest distance of the last two neighbours on a branch without a gap, in tolerances
Examine = Callable[[ForcedProblem, ForcedPoint], Stability]
ON_AXIS = 1e-6  # imaginary part below which a multiplier is real: real multipliers of real matrices have exactly zero
CIRCLE = 1.0 + UNIT_TOLERANCE
TOLERANCE = 1e-6  # tolerance of the location, as a length along the branch
MAX_EXAMINED_MOTIONS = 300  # largest number of motions with computed multipliers
LOOKING = 2 / 3  # share of these for points of the branch; the others serve the location of bifurcations
JUMP = 5e-3  # change of a modulus within the last bracket that is a jump; smooth changes are a hundred times smaller
BESIDE = (
    0.5,
    0.2,
    0.08,
    0.03,
    0.01,
)  # distances from a fold, over the parts of its step, at which multipliers are computed if another one crosses, too
NO_CORNER = "no solution with the harmonics of both ends is found at one of them"
GAP = "the branch has a gap there, and goes on elsewhere"
NO_MOTION = "no motion was found there"
UNKNOWN = "no multipliers are known at one of its ends"
ROUGH = 0.1  # largest error of a multiplier whose crossing is reported if it is uncertain
ROUGHLY = "multipliers seem to cross the unit circle, and more harmonics change them by more than 0.1: solve with more of these"
SPENT = "the multipliers of as many motions were asked for as was allowed"


@dataclass(frozen=True, eq=False)
class Stretch:
    """Segment of a branch between two neighbouring points with the same harmonics.

    Parameters
    ----------
    problem
        The forced response.
    balance, following
        Equations with these harmonics, and their continuation options.
    before, after
        The two points, with tangents along the branch.
    """

    problem: ForcedProblem
    balance: Balance
    following: Following
    before: Point
    after: Point

    @property
    def folds(self) -> bool:
        """Whether the segment has a fold."""
        return bool(self.before.tangent[-1] * self.after.tangent[-1] < 0.0)

    @cached_property
    def length(self) -> float:
        """Length of the chord."""
        return measure_at(self.before.x, self.following).of(self.after.y - self.before.y)

    def along(self, point: Point) -> float:
        """Return the position of a point along the chord, as a share of its length."""
        row = measure_at(self.before.x, self.following).row(self.after.y - self.before.y)
        return float(row @ (point.y - self.before.y)) / self.length**2

    def between(self, before: Point, after: Point) -> "Stretch":
        """Return the segment between two of its points."""
        return Stretch(self.problem, self.balance, self.following, before, after)

    def fold(self) -> Point:
        """Return the fold of the segment."""
        return located(self.balance, self.before, self.after, FOLD, self.following)

    def where(self, value: Callable[[Point], float], tolerance: float) -> Point:
        """Return the point at which a function of the point changes its sign, continuously or by a jump."""
        mark = Mark(name="bifurcation", value=value, tolerance=tolerance)
        return located(self.balance, self.before, self.after, mark, self.following)

    def at(self, share: float, tolerance: float) -> Point:
        """Return the point at a share of the chord."""
        return self.where(lambda point: self.along(point) - share, tolerance)

    def connected(self, low: Point, high: Point, tolerance: float) -> bool:
        """Whether the two neighbours of a located point are close enough to belong to one connected branch."""
        measure = measure_at(low.x, self.following)
        return measure.of(high.y - low.y) <= APART * tolerance

    def forced(self, point: Point) -> ForcedPoint:
        """Return a point of the segment as a point of the response."""
        return forced_point(self.balance, point.solution, "check", 0, point.p, 0.0)


def stretch(problem: ForcedProblem, before: ForcedPoint, after: ForcedPoint) -> Stretch | None:
    """Return the segment between two neighbouring points, both solved with the larger set of harmonics.

    It is None without such solutions.
    """
    support = max(before, after, key=lambda p: p.harmonics.size).support
    balance = problem.balance(support)
    following = problem.following(balance)
    ends = [_solved(balance, following, point) for point in (before, after)]
    if ends[0] is None or ends[1] is None:
        return None
    first, last = ends[0], ends[1]
    measure, chord = measure_at(first.x, following), last.y - first.y
    if measure.of(chord) == 0.0:
        return None
    towards = [p if measure.row(chord) @ p.tangent >= 0.0 else reversed_point(p) for p in (first, last)]
    return Stretch(problem, balance, following, towards[0], towards[1])


def _solved(balance: Balance, following: Following, point: ForcedPoint) -> Point | None:
    """Return a point solved with the harmonics of a balance; None without a nearby solution.

    Its tangent points towards growing frequency.
    """
    x = balance.unknowns(point.coefficients)
    found = start_point(balance, x, point.omega, following)
    if not found.solution.status.converged:
        return None
    near = np.linalg.norm(found.x - x) <= SAME_SHEET * np.linalg.norm(x)
    return found if near else None


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Multipliers of a motion, the largest first.

    Parameters
    ----------
    values, errors
        (k,) multipliers, and their error bounds.
    """

    values: ComplexArray
    errors: FloatArray

    @property
    def outside(self) -> int:
        """Number of multipliers outside the unit circle."""
        return int(np.count_nonzero(np.abs(self.values) > CIRCLE))

    def excess(self, k: int) -> float:
        """Return the k-th modulus (from 0) minus 1."""
        return float(abs(self.values[k])) - CIRCLE if k < self.values.size else -1.0

    def known(self, k: int) -> bool:
        """Whether the k-th multiplier, with its error, lies on one side of the unit circle."""
        if k >= self.values.size:
            return True
        return bool(self.errors[k] < abs(self.excess(k)))

    def rough(self, k: int, error: float) -> bool:
        """Whether the k-th multiplier may lie on either side of the unit circle and has an error above `error`."""
        return k < self.values.size and not self.known(k) and bool(self.errors[k] > error)

    def of_place(self, k: int) -> tuple[complex, float]:
        """Return the k-th multiplier and its error; zero where there are fewer."""
        if k >= self.values.size:
            return 0.0j, 0.0
        return complex(self.values[k]), float(self.errors[k])


def neutral_of(found: Stability) -> int:
    """Return the number of multipliers that are 1."""
    return found.floquet.neutral


def spectrum(found: Stability, neutral: int) -> Spectrum:
    """Return the multipliers of a motion without the `neutral` ones nearest to 1."""
    values, errors = found.floquet.multipliers, found.errors
    left = np.sort(np.argsort(np.abs(values - 1.0), kind="stable")[neutral:])
    order = left[np.argsort(-np.abs(values[left]), kind="stable")]
    return Spectrum(values[order], errors[order])


def nearest_to_one(found: Stability) -> tuple[complex, float]:
    """Return the multiplier nearest to 1, which belongs to a fold, and its error."""
    values = found.floquet.multipliers
    if found.unknown or not values.size:
        return complex(np.nan), np.inf
    at = int(np.argmin(np.abs(values - 1.0)))
    return complex(values[at]), float(found.errors[at])


@by_one_thread
def bifurcations(
    problem: ForcedProblem,
    points: Sequence[ForcedPoint],
    *,
    examine: Examine | None = stability,
    tolerance: float = TOLERANCE,
    most: int = MAX_EXAMINED_MOTIONS,
) -> Bifurcations:
    """Locate the bifurcations along a branch of a forced response.

    Folds are found where the tangent of the branch turns back. Other bifurcations lie between two points with different
    numbers of multipliers outside the unit circle. The branch is solved on planes across the chord until the crossing
    modulus is 1 (Brent's method), or until the two sides of a jump are within the tolerance. Multipliers that leave the
    circle and return within one step are missed.

    Parameters
    ----------
    problem
        The forced response of the points.
    points
        Points in the order of the branch, without peak points at its end. Points that did not converge interrupt the
        branch.
    examine
        Function that returns the multipliers of a solution; None: folds only.
    tolerance
        Tolerance of the location, a length along the branch, see `StepControl`.
    most
        Largest number of motions whose multipliers are computed. If the branch has more than two thirds as many points,
        only every second, third, ... point is examined, and points between where the numbers of multipliers outside the
        circle differ.

    Raises
    ------
    InputError
        If the tolerance is not positive, or fewer than 20 motions are allowed; also raised by `examine`.
    """
    if not 0.0 < tolerance < 1.0:
        raise input_error("bifurcations: tolerance", f"must be between 0 and 1, got {tolerance:g}", "1e-6 is usual.")
    if most < 20:
        raise input_error(
            "bifurcations: most", f"must be at least 20, got {most}", "One bifurcation takes about ten motions."
        )
    walk = _Walk(problem, examine, tolerance, most)
    branch = list(points)
    while branch and branch[-1].stage == "peak":
        branch.pop()
    runs = list(_runs(branch))
    for run in runs:
        walk.through(branch, run)
    last = len(branch) - 1
    for before, after in pairwise([range(0), *runs, range(last + 1, last + 1)]):
        if before.stop < after.start:
            walk.lost(branch[max(before.stop - 1, 0)].omega, branch[min(after.start, last)].omega, NO_MOTION)
    known = [walk.seen.get(id(point), (point, None))[1] for point in points]
    found = tuple(walk.ordered())
    return Bifurcations(found, tuple(walk.unseen), walk.examined, tuple(known), walk.stride)


def _runs(branch: Sequence[ForcedPoint]) -> Iterator[range]:
    """Yield the ranges of consecutive converged points."""
    begin = 0
    for place, point in enumerate(branch):
        if not point.converged:
            if begin < place:
                yield range(begin, place)
            begin = place + 1
    if begin < len(branch):
        yield range(begin, len(branch))


_Seen = tuple[Point, Spectrum]


@dataclass(frozen=True, eq=False)
class _Crossing:
    """Bifurcation and its position within its step."""

    share: float
    found: Bifurcation


@dataclass(eq=False)
class _Walk:
    """Search along a branch for bifurcations."""

    problem: ForcedProblem
    examine: Examine | None
    tolerance: float
    most: int
    unseen: list[tuple[float, float, str]] = field(default_factory=list)
    crossings: list[_Crossing] = field(default_factory=list)
    examined: int = 0
    seen: dict[int, tuple[ForcedPoint, Stability | None]] = field(default_factory=dict)
    stride: int = 1

    def through(self, branch: Sequence[ForcedPoint], run: range) -> None:
        """Search the segments between consecutive points for bifurcations."""
        steps = {i: stretch(self.problem, branch[i], branch[i + 1]) for i in run[:-1]}
        for i, step in steps.items():
            if step is None:
                self.lost(branch[i].omega, branch[i + 1].omega, NO_CORNER)
            elif step.folds:
                self._fold(step, i)
        if self.examine is None or len(run) < 2:
            return
        stride = max(1, int(np.ceil(len(run) / (LOOKING * self.most))))
        self.stride = max(self.stride, stride)
        looked = sorted({*run[::stride], run[-1]})
        for a, b in pairwise(looked):
            self._compare(branch, steps, a, b)

    def ordered(self) -> list[Bifurcation]:
        """Return the bifurcations in the order of the branch, without a second entry for the multiplier of a fold."""
        own = sorted(self.crossings, key=lambda c: (c.found.place, c.share))
        taken: set[int] = set()
        counted: dict[int, Bifurcation] = {}
        for fold in (c for c in own if c.found.kind == "fold"):
            near = [c for c in own if id(c) not in taken and _at_one_beside(fold.found, c.found)]
            single = [c for c in near if c.found.multiplicity == 1]
            if single:
                way = fold.found.place[0] + fold.share
                its = min(single, key=lambda c: abs(c.found.place[0] + c.share - way))
                both = [c for c in near if c is its or _not_told_apart(fold.found, c.found)]
                taken.update(map(id, both))
                before, after = both[0].found.before, both[-1].found.after
                counted[id(fold)] = replace(fold.found, before=before, after=after)
        return [counted.get(id(c), c.found) for c in own if id(c) not in taken]

    def lost(self, first: float, last: float, why: str) -> None:
        """Record an unexamined segment; consecutive segments with the same reason become one."""
        if self.unseen and self.unseen[-1][2] == why:
            begin, end, _ = self.unseen[-1]
            if np.isclose(first, end, rtol=1e-9) or begin <= first <= last <= end:
                self.unseen[-1] = (begin, max(end, last) if end >= begin else last, why)
                return
        self.unseen.append((first, last, why))

    def _look(self, point: ForcedPoint) -> Stability | None:
        """Return the multipliers of a point; None where they are unknown or the budget is spent."""
        known = self.seen.get(id(point))
        if known is None:
            if self.examine is None or self.examined >= self.most:
                return None
            self.examined += 1
            found: Stability | None
            try:
                found = self.examine(self.problem, point)
            except np.linalg.LinAlgError:
                found = None
            known = (point, None if found is None or found.unknown else found)
            self.seen[id(point)] = known
        return known[1]

    def _fold(self, step: Stretch, place: int) -> None:
        at = step.fold()
        if not at.solution.status.converged:
            self.lost(step.before.p, step.after.p, GAP)
            return
        point = step.forced(at)
        found = None
        try:
            found = self._look(point)
        except StickslipError:  # reported by the search for other bifurcations
            self.examine = None if self.examined <= 1 else self.examine
        value, error = (complex(np.nan), np.inf) if found is None else nearest_to_one(found)
        made = Bifurcation(
            "fold",
            point,
            self.problem.amplitude(point),
            value,
            error,
            self._fold_error(step, at),
            0,
            0,
            (place, place + 1),
        )
        self.crossings.append(_Crossing(step.along(at), made))

    def _fold_error(self, step: Stretch, at: Point) -> float:
        """Return the distance of a fold from the same fold with more harmonics, rad/s; infinite if it is not found."""
        order = 2 * step.balance.order + 3
        more = self.problem.balance(tuple(range(order + 1)))
        ends = [step.forced(p) for p in (step.before, step.after)]
        padded = [replace(p, harmonics=np.array(more.harmonics)) for p in ends]
        again = stretch(self.problem, padded[0], padded[1])
        if again is None or not again.folds:
            return np.inf
        found = again.fold()
        return abs(found.p - at.p) if found.solution.status.converged else np.inf

    def _compare(self, branch: Sequence[ForcedPoint], steps: dict[int, Stretch | None], a: int, b: int) -> None:
        """Find the steps between two points in which the number of multipliers outside the circle changes."""
        first, last = self._look(branch[a]), self._look(branch[b])
        if first is None or last is None:
            spent = self.examined >= self.most
            self.lost(branch[a].omega, branch[b].omega, SPENT if spent else UNKNOWN)
            return
        neutral = min(neutral_of(first), neutral_of(last))
        more = spectrum(last, neutral).outside - spectrum(first, neutral).outside
        another = more % 2 == 0 and sum(s.folds for i in range(a, b) if (s := steps[i])) % 2 == 1
        if more == 0 and not another:
            return
        if b > a + 1:
            middle = (a + b) // 2
            self._compare(branch, steps, a, middle)
            self._compare(branch, steps, middle, b)
            return
        step = steps[a]
        if step is not None:
            self._locate(step, a, beside_fold=another)

    def _locate(self, step: Stretch, place: int, *, beside_fold: bool) -> None:
        """Locate all crossings within a step, one by one in the remaining parts.

        A fold divides the step first.
        """
        at = [step.before, step.after]
        if beside_fold:
            at[1:1] = self._around(step)
        ends = [self._look(step.forced(p)) for p in at]
        if any(end is None for end in ends):
            self.lost(step.before.p, step.after.p, SPENT if self.examined >= self.most else UNKNOWN)
            return
        known = [end for end in ends if end is not None]
        neutral = min(map(neutral_of, known))
        spectra = [spectrum(end, neutral) for end in known]
        for i, (low, high) in enumerate(pairwise(at)):
            self._within(step, step.between(low, high), place, spectra[i], spectra[i + 1], neutral)

    def _around(self, step: Stretch) -> list[Point]:
        """Return two points about a fold between which an odd number of multipliers crosses, as at a fold.

        The list is empty without such points.
        """
        fold = step.fold()
        if not fold.solution.status.converged:
            return []
        share = step.along(fold)
        for near in BESIDE:
            shares = (share - near * share, share + near * (1.0 - share))
            pair = [step.at(s, self.tolerance) for s in shares]
            low, high = (self._look(step.forced(p)) for p in pair)
            if low is None or high is None:
                return []
            neutral = min(neutral_of(low), neutral_of(high))
            if (spectrum(high, neutral).outside - spectrum(low, neutral).outside) % 2 == 1:
                return pair
        return []

    def _within(self, whole: Stretch, step: Stretch, place: int, first: Spectrum, last: Spectrum, neutral: int) -> None:
        if first.outside == last.outside or step.length <= 10.0 * self.tolerance:
            return
        k = min(first.outside, last.outside)
        found = self._root(step, k, first, last, neutral)
        if isinstance(found, str):
            self.lost(step.before.p, step.after.p, found)
            return
        at, low, high = found
        if not step.connected(low[0], high[0], self.tolerance):
            self.lost(low[0].p, high[0].p, GAP)
        else:
            made = self._described(step, place, k, (first, last), (low, high), at)
            if made.certain or made.multiplier_error <= ROUGH:
                self.crossings.append(_Crossing(whole.along(at), made))
            else:
                self.lost(step.before.p, step.after.p, ROUGHLY)
        self._within(whole, step.between(step.before, low[0]), place, first, low[1], neutral)
        self._within(whole, step.between(high[0], step.after), place, high[1], last, neutral)

    def _root(
        self, step: Stretch, k: int, first: Spectrum, last: Spectrum, neutral: int
    ) -> tuple[Point, _Seen, _Seen] | str:
        """Return the point at which the k-th modulus passes the circle, and its neighbours on both sides.

        After a failure, return its reason.
        """
        if first.rough(k, ROUGH) and last.rough(k, ROUGH):
            return ROUGHLY
        known: list[_Seen] = [(step.before, first), (step.after, last)]

        def value(point: Point) -> float:
            for had, own in known:
                if had is point:
                    return own.excess(k)
            found = self._look(step.forced(point))
            if found is None:
                raise _NoMultipliersError
            known.append((point, spectrum(found, neutral)))
            return known[-1][1].excess(k)

        try:
            at = step.where(value, self.tolerance)
        except _NoMultipliersError:
            return SPENT if self.examined >= self.most else UNKNOWN
        if not at.solution.status.converged:
            return GAP
        here, side = step.along(at), np.sign(first.excess(k))
        ways = [(step.along(point), np.sign(own.excess(k)) == side, (point, own)) for point, own in known]
        low = max((w for w in ways if w[1] and w[0] <= here), key=lambda w: w[0])
        high = min((w for w in ways if not w[1] and w[0] >= here), key=lambda w: w[0])
        return at, low[2], high[2]

    def _described(
        self, step: Stretch, place: int, k: int, ends: tuple[Spectrum, Spectrum], sides: tuple[_Seen, _Seen], at: Point
    ) -> Bifurcation:
        """Return the bifurcation between two neighbours of a located point."""
        (low, before), (high, after) = sides
        larger, smaller = (before, after) if before.excess(k) > after.excess(k) else (after, before)
        value, error = larger.of_place(k)
        jumps = larger.excess(k) - smaller.excess(k) > JUMP
        kind: BifurcationKind
        if jumps:
            kind = "jump of multipliers"
        elif abs(value.imag) > ON_AXIS and (before.outside - after.outside) % 2 == 0:
            kind = "Neimark-Sacker"
        else:
            kind = "period doubling" if value.real < 0.0 else "branch point"
        across = abs(ends[1].excess(k) - ends[0].excess(k))
        slope = abs(step.after.p - step.before.p) / across if across > 0.0 else np.inf
        bracket = abs(high.p - low.p)
        off = bracket if jumps or error == 0.0 else bracket + slope * error
        point = step.forced(at)
        return Bifurcation(
            kind,
            point,
            self.problem.amplitude(point),
            value,
            error,
            off,
            before.outside,
            after.outside,
            (place, place + 1),
            all(own.known(k) for own in ends),
        )


def _at_one_beside(fold: Bifurcation, other: Bifurcation) -> bool:
    """Whether a crossing near a fold may be the multiplier of the fold."""
    real = other.kind in ("branch point", "jump of multipliers") and other.multiplicity == 1
    return (
        other.kind != "fold"
        and other.multiplier.real > 0.0
        and (real or _not_told_apart(fold, other))
        and abs(other.place[0] - fold.place[0]) <= 1
    )


def _not_told_apart(fold: Bifurcation, other: Bifurcation) -> bool:
    """Whether a crossing, within its errors, lies at 1 and at a fold.

    Two multipliers that meet there may look like a complex pair.
    """
    at_one = abs(other.multiplier - 1.0) <= other.multiplier_error
    return at_one and abs(other.omega - fold.omega) <= other.omega_error + fold.omega_error


class _NoMultipliersError(Exception):
    """An intermediate motion has no multipliers, or the budget is spent."""
