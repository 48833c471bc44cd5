"""Single solutions of the continuation: a step, a point with other harmonics, a start without a branch."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

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
