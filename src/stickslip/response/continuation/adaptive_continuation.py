"""Continuation of periodic motions with adaptive harmonics: start, predict, correct, judge, adapt, recover.

A branch is followed by arc length, or from one listed value of the parameter to the next. Each point is solved on one
of a few *levels*: the same equation with increasing harmonics (with one level, harmonics are fixed). A point is *quiet*
if its estimated error is below the threshold. The level changes along the branch:

- A point that is not quiet is solved on the next level. If both solutions agree, the point is kept. Otherwise the
  previous point, which was quiet, is solved on the next level, too, and the branch continues from there: where both
  levels agree, the branch stays on the same sheet.
- Such second solutions are *audits*. Further audits are made at every tenth point and near each maximum, unless the
  level is the last one or no force acts on the neglected harmonics. After a failed audit, the branch goes back to the
  last point that passed, and continues from there with more harmonics.
- After a few quiet points fewer harmonics are tried. A trial that disagrees doubles the number of points until the next
  one.

A branch that is lost, or that makes no progress in the parameter for long, is restarted a little further on. A branch
that runs back beside itself without new information is deleted and restarted, too. Failed values are tried once more
when their neighbours are known.
"""

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from time import perf_counter

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.response.continuation.branch import Curve, Followed, Judged, Kind, Route
from stickslip.solve.branch import Latest, upward
from stickslip.solve.continuation import Point, advance, reversed_point, start_point, step_to
from stickslip.solve.fallbacks import steps_at_most
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import Solution, charged, first_converged, newton
from stickslip.solve.status import Status

PATIENT = 16  # iterations from a solution with other harmonics
RECENT = 12  # number of last points along which a step may return
RUN_BACK = 8  # smallest number of points for a branch that runs back beside itself
BACK = 0.3  # distance from the known branch, over the step, up to which a step returns along it

# budget of a branch for each point, in Newton steps with the most harmonics; its second half allows fewer levels.
# Every point adds its share, so that the result does not depend on the number of requested points
EFFORT = 8.0
MIN_LEVELS = 2  # levels that are always allowed
AUDITED = 10  # largest number of points between audits
CALM = 3  # quiet points with many harmonics before fewer are tried
LEAPS = (1.0, 0.25, 0.05)  # distances of a restart beyond a lost branch, in steps
LADDER = (
    1  # last level with all globalisations: on higher levels they cost too much, and solutions follow from lower ones
)
MOST_PATIENT = 16  # largest number of points between attempts to raise harmonics where higher levels have no branch
LATER = 0.2  # share of the effort at a value that is reserved until its neighbours are known, and for time integration
STRETCHES = 3.0  # budget of a whole branch over the budget of a stretch
LONGEST_CALM = 48  # largest such number after failed trials
MAX_BRANCH_LENGTH = 40  # largest number of solutions on a branch, over the smallest number of points


def follow(curve: Curve, route: Route, done: Iterable[Followed] = ()) -> Iterator[Followed]:
    """Follow a branch with adaptive harmonics; the module describes the method.

    Parameters
    ----------
    curve
        Equations of the branch with each set of harmonics.
    route
        Range and steps of the parameter.
    done
        Results of an interrupted run, in their order. They are not computed again, and the remaining results are the
        same.

    Yields
    ------
    Followed
        Results that are not in `done`.
    """
    yield from _Walk(curve, route, iter(done)).run()


@dataclass(slots=True, eq=False)
class _Stop:
    """Point of the branch, start of its continuation, and whether more harmonics have confirmed it."""

    point: Followed
    ahead: Followed
    audited: bool = False
    more: Followed | None = None  # audit, if it was made in advance
    begins: bool = False  # whether a stretch of the branch begins here


Taken = Generator[Followed, None, Followed]


@dataclass(slots=True, eq=False)
class _Walk:
    curve: Curve
    route: Route
    stored: Iterator[Followed]
    branch: list[_Stop] = field(default_factory=list)
    quiet_for: int = 0  # points since harmonics were raised
    calm: int = CALM  # number of them before fewer are tried
    hold: int = 0  # index up to which fewer are not tried
    given_up: set[int] = field(default_factory=set)  # indices with a finally failed audit
    patience: int = 1  # points between attempts to raise harmonics after failures
    patient_until: int = 0  # index of the next attempt
    looked: int = 0  # index of the last audit
    anew_from: int = 0  # index from which solutions without a branch are sought again
    taken: int = 0
    tried: dict[tuple[float, int], float] = field(default_factory=dict)  # effort at a value, level
    spent: float = 0.0  # work, in the unit of `Curve.cost`
    forgotten: int = 0  # deleted points, whose work is included
    before: int = 0  # points before the present stretch of the branch,
    spent_before: float = 0.0  # and their work

    def run(self) -> Iterator[Followed]:
        """Yield the branch from the first value of the parameter to the last."""
        listed = self.route.listed
        yield from self._begun(listed[0] if listed else self.route.first)
        while not self._over():
            here = self.branch[-1]
            if not here.ahead.converged or self._idle():
                yield from self._begun(self.route.onward([s.point.p for s in self.branch]))
                continue
            yield from self._cheaper(here)
            made = yield from self._take(lambda at=here: self._onward(at))  # type: ignore[misc]
            raised = not made.converged or not self.curve.quiet(made.level, made.judged)
            trying = raised and (not made.converged or len(self.branch) >= self.patient_until)
            if trying and (yield from self._raised(made)):
                self.patience = 1
                continue
            if made.converged:
                anew = (yield from self._anew(made)) if trying else None
                if trying:  # no solution with more harmonics is near: attempts become rarer
                    self.patience = min(2 * self.patience, MOST_PATIENT)
                    self.patient_until = len(self.branch) + self.patience
                yield from self._kept(anew or made)
            else:
                yield from self._begun(self.route.onward([s.point.p for s in self.branch]))
        if not listed and self.branch[-1].point.p != self.route.last:
            yield from self._begun(self.route.last)
        yield from self._looked_for()

    # --- one step -----------------------------------------------------------------------------

    def _take(self, make: Callable[[], Followed]) -> Taken:
        """Return the stored result of an interrupted run, or compute and yield it."""
        self.taken += 1
        known = next(self.stored, None)
        if known is None:
            began = perf_counter()
            made = without_more(self.curve, self._levels(), make())
            known = made.taking(perf_counter() - began)
            yield known
            known = self.curve.stored(known)
        steps, place = known.point.solution.iterations, (known.p, known.level)
        before = 0.0 if known.kind == "found" else self.tried.get(place, 0.0)  # a found solution includes earlier steps
        self.tried[place] = before + steps / steps_at_most(known.point.x.size)
        self.spent += steps * self.curve.cost(known.level)
        return known

    def _onward(self, here: _Stop) -> Followed:
        """Take a step along the branch; a step back along the known branch counts as failed."""
        made = onward(self.curve, here.ahead, len(self.branch), self._target(), self.route.last)
        before = [] if self.route.listed else [s.point for s in self.branch if s.point.converged]
        return lost(made) if retraced(self.curve, before, made) else made

    def _kept(self, made: Followed, audit: Followed | None = None, *, begins: bool = False) -> Iterator[Followed]:
        """Accept a point, and audit it or the previous one where due."""
        silent = made.judged.bound == 0.0
        self.branch.append(_Stop(made, made, silent or audit is not None, audit, begins))
        if not made.converged or self.curve.levels == 1:  # nothing to compare with
            return
        if audit is not None or self.curve.quiet(made.level, made.judged):
            self.quiet_for += 1
        if self._due():
            yield from self._audited(len(self.branch) - 1)
        elif passed_maximum(self.curve, [s.point for s in self.branch[-3:]]):
            yield from self._audited(len(self.branch) - 2)
        if self.branch and self.branch[-1].point is made:
            yield from self._lowered()

    # --- work ---------------------------------------------------------------------------------

    def _levels(self) -> int:
        """Return the number of allowed levels by the budgets of the present stretch and of all stretches together.

        Each stretch has its own budget, so that a hard one leaves enough for later ones; all together have `STRETCHES`
        times as much.
        """
        points = len(self.branch) + self.forgotten + 1
        own = levels_left(self.curve, self.route, max(points - self.before, 1), self.spent - self.spent_before)
        return min(own, levels_left(self.curve, self.route, points, self.spent / STRETCHES))

    def _spent_up(self) -> bool:
        return self._levels() <= MIN_LEVELS < self.curve.levels

    def _cheaper(self, here: _Stop) -> Iterator[Followed]:
        """Continue with fewer harmonics if the budget of higher levels is spent."""
        level, index = self._levels() - 1, len(self.branch) - 1
        if here.ahead.level > level and index >= self.hold:
            known = here.ahead
            trial = yield from self._take(lambda: again(self.curve, "trial", known, index, level))
            if trial.converged:
                here.ahead = trial
            else:
                self.hold = index + CALM

    # --- harmonics ----------------------------------------------------------------------------

    def _raised(self, made: Followed) -> Generator[Followed, None, bool]:
        """Raise the harmonics of a point that needs more or failed; return whether the branch continues."""
        level, index = made.level + 1, len(self.branch)
        if level >= self._levels():
            return False
        check = None
        if made.converged:
            check = yield from self._take(lambda: again(self.curve, "audit", made, index, level))
            if check.converged and self.curve.agree(made, check):
                yield from self._kept(made, check)
                return True
        last = index - 1
        held = yield from self._compared(last, level)
        if not held:
            return (yield from self._thrown_back(last, level))
        if check is None or not check.converged or not self.curve.near(made, check):
            return True  # the branch continues from the last point with more harmonics
        known = check
        more = yield from self._take(lambda: accepted(self.curve, known, index))
        if not self.curve.quiet(more.level, more.judged) and (yield from self._raised(more)):
            return True
        yield from self._kept(more)
        return True

    def _compared(self, index: int, level: int) -> Generator[Followed, None, bool]:
        """Audit a point on a level; if it passes, continue from the audit; return whether it passed."""
        stop = self.branch[index]
        if stop.ahead.level >= level:
            return True
        audit = stop.more
        if audit is None or audit.level != level:
            audit = yield from self._take(lambda: again(self.curve, "audit", stop.ahead, index, level))
            stop.more = audit
        if audit.converged and (stop.audited or self.curve.agree(stop.point, audit)):
            stop.audited, stop.ahead = True, audit
            self.quiet_for = 0
            return True
        return False

    def _audited(self, index: int) -> Iterator[Followed]:
        """Audit a point of the branch; go back if it fails."""
        stop = self.branch[index]
        level = stop.point.level + 1
        if stop.audited or level >= self._levels() or index in self.given_up:
            return
        self.looked = index
        audit = yield from self._take(lambda: again(self.curve, "audit", stop.ahead, index, level))
        stop.more = audit
        if audit.converged and self.curve.agree(stop.point, audit):
            stop.audited = True
            return
        back = yield from self._thrown_back(index, level)
        if not back:
            self.given_up.add(index)

    def _thrown_back(self, index: int, level: int) -> Generator[Followed, None, bool]:
        """Go back to the last point before `index` that more harmonics have confirmed; return whether there is one."""
        if index in self.given_up:
            return False
        begin = self._beginning(index)
        for place in range(index - 1, begin - 1, -1):
            stop = self.branch[place]
            if not stop.audited:
                continue
            held = yield from self._compared(place, level)
            if held:
                del self.branch[place + 1 :]
                self.quiet_for, self.hold = 0, index + CALM
                return True
            break
        # no earlier point is confirmed: restart at the beginning of this stretch
        known = self.branch[begin].ahead
        if known.level < level and begin not in self.given_up:
            audit = yield from self._take(lambda: again(self.curve, "audit", known, begin, level))
            if audit.converged:
                made = yield from self._take(lambda: accepted(self.curve, audit, begin))
                del self.branch[begin:]
                self.branch.append(_Stop(made, made, made.judged.bound == 0.0, begins=True))
                self.quiet_for, self.hold = 0, index + CALM
                return True
        self.given_up |= {begin, index}
        return False

    def _beginning(self, index: int) -> int:
        """Return the index of the beginning of the stretch that contains `index`."""
        for place in range(index, 0, -1):
            if self.branch[place].begins:
                return place
        return 0

    def _lowered(self) -> Iterator[Followed]:
        """Try fewer harmonics after some quiet points."""
        stop, index = self.branch[-1], len(self.branch) - 1
        level = stop.ahead.level - 1
        if level < 0 or self.quiet_for < self.calm or index < self.hold:
            return
        trial = yield from self._take(lambda: again(self.curve, "trial", stop.ahead, index, level))
        if trial.converged and self.curve.agree(trial, stop.point):
            stop.ahead, stop.audited = trial, True
        else:
            self.calm = min(2 * self.calm, LONGEST_CALM)
        self.quiet_for = 0

    # --- audits -------------------------------------------------------------------------------

    def _due(self) -> bool:
        """Whether an audit is due: after many points without one, and at the first and the last point."""
        last = len(self.branch) - 1
        recent = any(stop.audited for stop in self.branch[max(last - AUDITED + 1, 0) :])
        ends = last == 0 or self.branch[-1].point.p == self.route.last
        return ends or not (recent or self.looked > last - AUDITED)

    # --- route --------------------------------------------------------------------------------

    def _target(self) -> float | None:
        """Return the next listed value; None for continuation by arc length."""
        listed = self.route.listed
        return listed[len(self.branch)] if listed else None

    def _over(self) -> bool:
        if self.route.listed:
            return len(self.branch) >= len(self.route.listed)
        reached = self.branch[-1].point.p == self.route.last
        return reached or self.taken > MAX_BRANCH_LENGTH * self.route.points

    def _idle(self) -> bool:
        """Whether to leave the branch; points that run back beside it are deleted."""
        if self.route.listed or not self.route.leaves:
            return False
        begin = self._beginning(len(self.branch) - 1)
        back = turned_for_nothing(self.curve, self.route, [s.point for s in self.branch[begin:]])
        del self.branch[len(self.branch) - back :]
        self.forgotten += back
        return back > 0 or self.route.idle([s.point.p for s in self.branch])

    def _begun(self, p: float) -> Iterator[Followed]:
        """Restart where no branch leads, and raise the harmonics until the point is quiet.

        The first attempts start from the last point a little further on, the last one uses all globalisations.
        """
        index, near = len(self.branch), self._last()
        self.before, self.spent_before = index + self.forgotten, self.spent
        here = near[0].level if near and not self._spent_up() else 0
        made: Followed | None = None
        for share in LEAPS if near and not self.route.listed else ():
            ahead = p + (share - 1.0) * self.route.gap
            if not self.route.before(self.route.farthest([s.point.p for s in self.branch]), ahead):
                break
            made = yield from self._fresh(index, here, ahead, near, 0)
            if made.converged:
                break
        if made is None or not made.converged:
            level = min(here, LADDER)
            made = yield from self._fresh(index, level, p, near, self._left(p, level, LATER))
        while made.converged and not self.curve.quiet(made.level, made.judged):
            more = yield from self._in_place(made)
            if more is None:
                break
            made = more
        self.quiet_for = 0
        yield from self._kept(made, begins=True)

    def _in_place(self, made: Followed) -> Generator[Followed, None, Followed | None]:
        """Solve the first point of a stretch on the next level; None without a solution."""
        index, level = len(self.branch), made.level + 1
        if level >= self._levels():
            return None
        more = yield from self._take(lambda: again(self.curve, "audit", made, index, level))
        if more.converged:
            return (yield from self._take(lambda: accepted(self.curve, more, index)))
        return (yield from self._anew(made))

    def _anew(self, made: Followed) -> Generator[Followed, None, Followed | None]:
        """Solve a point on the next level by all methods after a failure; in a row of such points only occasionally."""
        index, level = len(self.branch), made.level + 1
        if level >= self._levels() or index < self.anew_from or self._spent_up():
            return None
        self.anew_from = index + AUDITED
        effort = self._left(made.p, level, LATER) if level <= LADDER else 0.0
        found = yield from self._fresh(index, level, made.p, [made], effort)
        if found.converged:
            return found
        return (yield from self._take(lambda: made))

    def _fresh(self, index: int, level: int, p: float, near: Sequence[Followed], effort: float) -> Taken:
        make = partial(fresh, self.curve, self.route, index, level, p, near, effort)
        return (yield from self._take(make))

    def _left(self, p: float, level: int, reserved: float = 0.0) -> float:
        """Return the remaining share of the effort at a value, without the `reserved` part."""
        return max(1.0 - reserved - self.tried.get((p, level), 0.0), 0.0)

    def _last(self) -> list[Followed]:
        """Return the last solution, if there is one."""
        return [stop.ahead for stop in self.branch if stop.ahead.converged][-1:]

    def _looked_for(self) -> Iterator[Followed]:
        """Search again for missing points from their neighbours on both sides, the last ones first."""
        for index in reversed(range(len(self.branch))):
            if self.branch[index].point.converged:
                continue
            sides = [s.point for s in (*self.branch[index + 1 : index + 2], *self.branch[max(index - 1, 0) : index])]
            near = [p for p in sides if p.converged]
            missing = self.branch[index].point
            effort = self._left(missing.p, missing.level)
            if not near or not effort:
                continue
            found = yield from self._take(
                lambda n=near, m=missing, e=effort: beside(self.curve, n, m, e)  # type: ignore[misc]
            )
            if found.converged:
                self.branch[index] = _Stop(found, found)


def levels_left(curve: Curve, route: Route, points: int, spent: float) -> int:
    """Return the number of allowed levels after `points` points and `spent` work.

    All levels are allowed during the first half of the budget, then fewer.
    """
    levels = curve.levels
    if levels <= MIN_LEVELS:
        return levels
    most = EFFORT * max(route.points, points) * curve.cost(levels - 1)
    over = int((spent / most - 0.5) * 2.0 * levels) + 1 if spent > 0.5 * most else 0
    return max(levels - over, min(levels, MIN_LEVELS))


def without_more(curve: Curve, levels: int, made: Followed) -> Followed:
    """Return a solution with its error estimated from fewer harmonics if no audit can follow.

    Predictions without a confirmation are not reliable enough.
    """
    last = made.kind != "audit" and 0 < made.level == levels - 1 < curve.levels - 1
    if not (last and made.converged) or made.judged.bound == 0.0:
        return made
    return replace(made, judged=curve.at_the_cap(made.level, made.point))


def onward(curve: Curve, here: Followed, index: int, target: float | None, last: float) -> Followed:
    """Take a step along the branch towards `last`, or solve at the listed value `target`."""
    latest = Latest(curve.problem(here.level))
    following = curve.following(here.level)
    if target is None:
        point = advance(latest, here.point, last, following)
    else:
        point = step_to(latest, here.point, target, following)
    return _made(curve, "point", index, here.level, point, latest)


def again(curve: Curve, kind: Kind, known: Followed, index: int, level: int) -> Followed:
    """Solve at the value of a known solution on another level, with the same direction along the branch."""
    following, p = curve.following(level), known.p
    latest = Latest(curve.problem(level))
    patient = replace(following.newton, max_iterations=PATIENT)
    near = first_converged(
        newton(lambda v: latest.linearise(v, p), x, patient, NaturalLevel()) for x in curve.starts(known, level)
    )
    point = start_point(latest, near.x, p, following)
    solution = charged(point.solution, [near, point.solution])
    if point.solution.status.converged and _against(curve, known, point, level):
        point = reversed_point(point)
    point = replace(point, step=known.point.step, solution=solution)
    return _made(curve, kind, index, level, point, latest)


def accepted(curve: Curve, audit: Followed, index: int) -> Followed:
    """Return an audit as a point of the branch, with its estimated error."""
    latest = Latest(curve.problem(audit.level))
    return _made(curve, "point", index, audit.level, audit.point, latest)


def fresh(
    curve: Curve, route: Route, index: int, level: int, p: float, near: Sequence[Followed], effort: float
) -> Followed:
    """Solve at a value that no branch reached.

    `effort` is the share of the Newton steps of `steps_at_most`; 0: Newton's method only.
    """
    solution = curve.fresh(level, p, near, effort)
    latest = Latest(curve.problem(level))
    following = curve.following(level)
    growing = upward(solution.x.size + 1)
    point = Point(solution.x, p, growing, following.control.first, solution, 0.0)
    if solution.status.converged:
        point = replace(start_point(latest, solution.x, p, following), solution=solution)
        if route.forward < 0.0 and not route.listed:
            point = reversed_point(point)
    return _made(curve, "point", index, level, point, latest)


def beside(curve: Curve, near: Sequence[Followed], missing: Followed, effort: float) -> Followed:
    """Solve at a failed value along the branches of its neighbours.

    `effort` is the share of the Newton steps of `steps_at_most`.
    """
    spent: list[Solution] = [missing.point.solution]
    for end in near:
        left = steps_at_most(missing.point.x.size, effort) - sum(s.iterations for s in spent[1:])
        if left <= 0:
            break
        latest = Latest(curve.problem(end.level))
        start = end.point if end.point.tangent[-1] > 0.0 else reversed_point(end.point)
        point = step_to(latest, start, missing.p, curve.following(end.level), left)
        spent.append(point.solution)
        if point.solution.status.converged:
            point = replace(point, solution=charged(point.solution, spent))
            return _made(curve, "found", missing.index, end.level, point, latest)
    solution = charged(missing.point.solution, spent)
    return replace(missing, kind="found", point=replace(missing.point, solution=solution))


def lost(made: Followed) -> Followed:
    """Return a step marked as failed."""
    solution = replace(made.point.solution, status=Status.STEP_TOO_SMALL)
    return replace(made, point=replace(made.point, solution=solution), judged=Judged())


def retraced(curve: Curve, before: Sequence[Followed], made: Followed) -> bool:
    """Whether a step past a corner of the branch returns along the known part of the branch."""
    behind = [b for b in before[-RECENT:] if b.level == made.level]
    if not made.converged or len(behind) < 3:
        return False
    last = behind[-1]
    if (made.p - last.p) * (last.p - behind[-2].p) >= 0.0:
        return False
    weights = curve.following(made.level).weights
    step = _length(weights, made.point.x - last.point.x)
    for a, b in pairwise(behind):
        if a.p != b.p and (made.p - a.p) * (made.p - b.p) <= 0.0:
            share = (made.p - a.p) / (b.p - a.p)
            there = a.point.x + share * (b.point.x - a.point.x)
            if _length(weights, made.point.x - there) < BACK * step:
                return True
    return False


def turned_for_nothing(curve: Curve, route: Route, branch: Sequence[Followed]) -> int:
    """Return the number of points at the end of a branch that run back beside it over a step length.

    These are all points after the turn, or 0.

    Contacts that lift off many times in a period may cause such a fold on the last level; more harmonics would remove
    it.
    """
    count = 0
    for before, after in pairwise(reversed(branch)):  # the last point first
        if not route.before(before.p, after.p):
            break
        count += 1
    turn = len(branch) - count
    most = curve.levels - 1 > 0 and all(f.level == curve.levels - 1 for f in branch[turn:])
    if count < RUN_BACK or not most or not all(f.converged for f in branch):
        return 0
    far = abs(branch[-1].p - branch[turn - 1].p) >= abs(route.gap)
    return count if far and all(_beside(curve, branch[:turn], one) for one in branch[-RUN_BACK:]) else 0


def _beside(curve: Curve, before: Sequence[Followed], one: Followed) -> bool:
    """Whether a point repeats an earlier part of the branch at its value of the parameter."""
    for a, b in pairwise(before):
        if a.p != b.p and (one.p - a.p) * (one.p - b.p) <= 0.0:
            level = max(a.level, b.level, one.level)
            share = (one.p - a.p) / (b.p - a.p)
            ends = [curve.lifted(f.point.x, f.level, level) for f in (a, b)]
            x = ends[0] + share * (ends[1] - ends[0])
            there = replace(one, level=level, point=replace(one.point, x=x))
            if curve.alike(there, one):
                return True
    return False


def passed_maximum(curve: Curve, last: Sequence[Followed]) -> bool:
    """Whether the middle one of the last three points is a maximum."""
    if len(last) < 3 or not all(p.converged for p in last):
        return False
    before, top, after = map(curve.height, last)
    return before < top > after


def _length(weights: FloatArray, x: FloatArray) -> float:
    return float(np.linalg.norm(weights * x))


def _made(curve: Curve, kind: Kind, index: int, level: int, point: Point, latest: Latest) -> Followed:
    judged = Judged()
    if point.solution.status.converged and kind != "audit":
        judged = curve.judge(level, point, latest)
    return Followed(kind, index, level, point, judged, 0.0)


def _against(curve: Curve, known: Followed, point: Point, level: int) -> bool:
    """Whether the tangent of a point is opposite to a known point's of another level."""
    state = curve.lifted(known.point.tangent[:-1], known.level, level)
    before = np.append(state, known.point.tangent[-1])
    following = curve.following(level)
    size = _length(following.weights, point.x) or 1.0
    scaled = np.append(following.weights**2 / size**2, 1.0 / following.control.scale**2)
    return bool((scaled * before) @ point.tangent < 0.0)
