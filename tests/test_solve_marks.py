"""Folds and marks located on known curves; parametrisations and predictors that agree on where a branch leads."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from closed_curves import CUBIC, Curve, corner, wall

from stickslip.errors import InputError
from stickslip.solve.branch import Following, StepControl, reversed_point
from stickslip.solve.branch_events import FOLD, Mark, located
from stickslip.solve.continuation import advance, start_point, trace
from stickslip.solve.linear import Dense
from stickslip.solve.newton_method import Newton
from stickslip.solve.status import Rung, Status

TOLERANCE = 1e-12
WAYS = [("arc_length", "tangent"), ("arc_length", "secant"), ("local", "tangent"), ("local", "secant")]


FOLDS = [(-1 / np.sqrt(3), 2 / np.sqrt(27)), (1 / np.sqrt(3), -2 / np.sqrt(27))]


def along(parametrisation="arc_length", predictor="tangent", linear=None, **control):
    return Following(
        newton=Newton(tolerance=TOLERANCE, linear=linear or Dense()),
        control=StepControl(scale=1.0, **control),
        weights=np.ones(2),
        parametrisation=parametrisation,
        predictor=predictor,
    )


def begin(problem, x, p, following):
    start = start_point(problem, np.array([x, 1.0]), p, following)
    assert start.solution.status.converged
    return start


# ---- marks -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("parametrisation", "predictor"), WAYS)
@pytest.mark.parametrize("largest", [0.05, 0.25])
def test_folds_of_the_cubic_are_located(parametrisation, predictor, largest):
    following = along(parametrisation, predictor, largest=largest)
    points = list(trace(CUBIC, begin(CUBIC, -1.5, -1.875, following), 1.0, following, [FOLD]))
    folds = [point for point in points if point.mark]
    assert [point.mark for point in folds] == ["fold", "fold"]
    for point, (x, p) in zip(folds, FOLDS, strict=True):
        assert point.solution.status.converged
        assert point.x[0] == pytest.approx(x, abs=1e-8)
        # p is flat there: an error of 1e-8 in x moves it by 1e-16
        assert point.p == pytest.approx(p, abs=1e-12)
        assert abs(point.tangent[-1]) < 1e-8


@pytest.mark.parametrize("slope", [0.5, 1.0, 5.0, 20.0])
def test_a_fold_at_a_corner_is_located(slope):
    # the tangent jumps: there is no zero to find, only the place of the jump
    problem, following = corner(slope), along()
    points = list(trace(problem, begin(problem, -0.7 / slope, 0.3, following), 0.2, following, [FOLD]))
    (fold,) = [point for point in points if point.mark]
    assert fold.x[0] == pytest.approx(0.0, abs=1e-8 / min(slope, 1.0))
    assert fold.p == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize(("parametrisation", "predictor"), [*WAYS, ("natural", "tangent")])
def test_a_mark_of_the_user_is_located(parametrisation, predictor):
    following = along(parametrisation, predictor)
    level = Mark(name="level", value=lambda point: point.x[0] - 1.2)
    points = list(trace(CUBIC, begin(CUBIC, 0.8, -0.288, following), 2.0, following, [level]))
    assert points[-1].p == 2.0
    (found,) = [point for point in points if point.mark == "level"]
    assert found.x[0] == pytest.approx(1.2, abs=1e-9)
    assert found.p == pytest.approx(1.2**3 - 1.2, abs=1e-8)


def test_marks_come_in_the_order_of_travel_and_change_no_step():
    following = along(first=0.25)
    start = begin(CUBIC, -1.5, -1.875, following)
    marks = [Mark(name=str(x), value=lambda point, x=x: point.x[0] - x) for x in (-0.9, -1.1, -1.0)]
    with_marks = list(trace(CUBIC, start, 1.0, following, [FOLD, *marks]))
    names = [point.mark for point in with_marks if point.mark]
    assert names == ["-1.1", "-1.0", "-0.9", "fold", "fold"]
    x = [point.x[0] for point in with_marks]
    assert np.all(np.diff(x) > 0), "each mark between its neighbours"
    without = list(trace(CUBIC, start, 1.0, following))
    steps = [point for point in with_marks if not point.mark]
    assert [point.p for point in steps] == [point.p for point in without]


def test_a_branch_goes_on_from_a_located_fold():
    following = along()
    points = list(trace(CUBIC, begin(CUBIC, -1.5, -1.875, following), 1.0, following, [FOLD]))
    fold = next(point for point in points if point.mark)
    onward = list(trace(CUBIC, fold, 1.0, following))
    assert onward[-1].p == 1.0
    assert onward[-1].x[0] == pytest.approx(points[-1].x[0], abs=1e-10)


def test_on_a_straight_branch_a_mark_is_searched_without_a_correction():
    line = Curve(lambda x, p: x - 2.0 * p, lambda _x, _p: 1.0, lambda _x, _p: -2.0)
    following = along()
    before, after = begin(line, 0.0, 0.0, following), begin(line, 2.0, 1.0, following)
    bent = Mark(name="bent", value=lambda point: point.p**3 - 0.2)
    found = located(line, before, after, bent, following)
    assert found.p == pytest.approx(0.2 ** (1 / 3), abs=1e-9)
    assert found.solution.iterations == 0, "the guess between two known points is the solution"


def test_a_mark_that_cannot_be_located_says_why():
    # between the two points the residual is not a number
    hole = Curve(lambda x, p: np.nan if 0.1 < p < 0.9 else x - 1.0, lambda _x, _p: 1.0, lambda _x, _p: 0.0)
    following = along()
    before, after = begin(hole, 1.0, 0.0, following), begin(hole, 1.0, 1.0, following)
    middle = Mark(name="middle", value=lambda point: point.p - 0.4)
    point = located(hole, before, after, middle, following)
    assert point.mark == "middle"
    assert point.solution.status is Status.NOT_FINITE
    assert np.array_equal(point.x, before.x)


# ---- parametrisations and predictors ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("parametrisation", "predictor"), WAYS[1:])
def test_all_ways_lead_to_the_same_end(parametrisation, predictor):
    ends = []
    for way in (WAYS[0], (parametrisation, predictor)):
        following = along(*way)
        points = list(trace(CUBIC, begin(CUBIC, -1.5, -1.875, following), 1.0, following))
        assert all(point.solution.status.converged for point in points)
        assert sum(np.diff(np.sign(np.diff([point.p for point in points]))) != 0) == 2
        ends.append(points[-1])
    assert ends[0].p == ends[1].p == 1.0
    # Newton's tolerance over the slope at the end, 4.26
    assert ends[1].x[0] == pytest.approx(ends[0].x[0], abs=1e-12)


def test_secants_cost_no_system_for_a_direction_and_tangents_no_evaluation():
    systems = {}
    for predictor in ("tangent", "secant"):
        evaluations, solves = [], []

        class Counted:
            def linearise(self, x, p, log=evaluations):
                log.append(p)
                return CUBIC.linearise(x, p)

        class Solver:
            solve = Dense().solve

            def solve_bordered(self, *system, log=solves):
                log.append(1)
                return Dense().solve_bordered(*system)

        following = along(predictor=predictor, largest=0.05, linear=Solver())
        start = begin(CUBIC, 1.0, 0.0, following)
        evaluations.clear()
        solves.clear()
        points = list(trace(Counted(), start, 3.0, following))
        steps = sum(point.solution.iterations for point in points)
        assert len(evaluations) == steps + len(points)
        systems[predictor] = (len(solves) - steps) / len(points)
    assert systems == {"tangent": 1.0, "secant": 0.0}


def test_natural_parametrisation_stops_at_a_fold():
    following = along("natural")
    start = begin(CUBIC, -1.5, -1.875, following)
    points = list(trace(CUBIC, start, 1.0, following))
    assert points[-1].solution.status is Status.STEP_TOO_SMALL
    assert all(point.solution.status.converged for point in points[:-1])
    assert np.all(np.diff([point.p for point in points[:-1]]) > 0)
    x, p = FOLDS[0]
    # steps of p below the smallest, or a way in x beyond the largest step, are left
    assert 0.0 <= p - points[-1].p < 0.01
    assert points[-1].x[0] < x


def test_natural_parametrisation_steps_in_the_parameter():
    following = along("natural", first=0.1, largest=0.1)
    start = begin(CUBIC, 1.0, 0.0, following)
    points = [start, *trace(CUBIC, start, 2.0, following)]
    steps = np.diff([point.p for point in points])
    assert np.allclose(steps[:-1], 0.1, rtol=0, atol=1e-12)
    assert points[-1].p == 2.0


def test_local_parametrisation_fixes_what_changes_most():
    following = along("local", first=0.05, largest=0.05)
    start = begin(CUBIC, -0.58, 0.3848, following)
    point = advance(CUBIC, start, 1.0, following)
    # next to the fold x changes most: its step is the step, in units of the size of the state
    size = np.hypot(start.x[0], 1.0)
    unit = abs(start.tangent[0])
    assert abs(point.x[0] - start.x[0]) == pytest.approx(0.05 * unit, rel=1e-9)
    assert unit / size == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("predictor", ["tangent", "secant"])
@pytest.mark.parametrize("slope", [0.2, 0.6, 1.0, 2.0, 5.0, 20.0])
@pytest.mark.parametrize("parametrisation", ["arc_length", "local"])
def test_corners_are_gone_round_in_every_way(slope, parametrisation, predictor):
    problem, following = corner(slope), along(parametrisation, predictor, max_points=80)
    start = begin(problem, -0.7 / slope, 0.3, following)
    points = list(trace(problem, start, 9.0, following))
    assert all(point.solution.status.converged for point in points)
    x = np.array([start.x[0], *(point.x[0] for point in points)])
    assert np.all(np.diff(x) > 0), "never back the way it came"
    assert x[-1] > 0.2 / slope


class Blind:
    """LU that keeps the determinant to itself, as iterative solvers do."""

    def solve(self, jac, right):
        return Dense().solve(jac, right)

    def solve_bordered(self, jac, column, row, corner, right):
        solution, sign = Dense().solve_bordered(jac, column, row, corner, right)
        return solution, np.nan if sign else 0.0


@pytest.mark.parametrize("slope", [0.2, 0.6, 2.0, 5.0, 20.0])
def test_corners_are_gone_round_without_a_determinant(slope):
    problem, following = corner(slope), along(linear=Blind(), max_points=80)
    start = begin(problem, -0.7 / slope, 0.3, following)
    assert np.isnan(start.orientation)
    points = list(trace(problem, start, 9.0, following))
    assert all(point.solution.status.converged for point in points)
    x = np.array([start.x[0], *(point.x[0] for point in points)])
    assert np.all(np.diff(x) > 0), "never back the way it came"
    assert x[-1] > 0.2 / slope


@pytest.mark.parametrize(("parametrisation", "predictor"), WAYS)
def test_every_way_goes_on_bitwise(parametrisation, predictor):
    following = along(parametrisation, predictor)
    points = [begin(CUBIC, -1.5, -1.875, following)]
    points += trace(CUBIC, points[0], 1.0, following)
    for before, after in pairwise(points):
        again = advance(CUBIC, replace(before), 1.0, following)
        assert np.array_equal(again.y, after.y)
        assert np.array_equal(again.tangent, after.tangent)
        assert again.step == after.step


def test_backward_is_forward_reversed():
    following = along("local", "secant")
    start = begin(CUBIC, -1.5, -1.875, following)
    end = list(trace(CUBIC, start, 1.0, following))[-1]
    back = list(trace(CUBIC, reversed_point(end), start.p, following))[-1]
    assert back.x[0] == pytest.approx(-1.5, abs=1e-11)


def test_a_step_that_had_to_be_shortened_is_counted():
    problem = Curve(wall, lambda _x, _p: 1.0, lambda _x, _p: 0.0)
    following = along(first=0.25)
    start = begin(problem, 1.0, 0.0, following)
    points = list(trace(problem, start, 1.0, following))
    assert points[0].solution.rung is Rung.FULL_STEPS
    assert Rung.SHORTER_STEP in {point.solution.rung for point in points[1:-1]}


@pytest.mark.parametrize("what", ["parametrisation", "predictor"])
def test_unknown_ways_are_refused(what):
    with pytest.raises(InputError, match=rf"Following\.{what}: is 'sideways'.*Give one of"):
        along(**{what: "sideways"})
