"""Continuation on curves that are known in closed form."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from closed_curves import CUBIC as FOLD
from closed_curves import At, Curve, corner, wall

from stickslip.solve.continuation import Following, StepControl, advance, reversed_point, start_point, step_to, trace
from stickslip.solve.newton_method import Newton
from stickslip.solve.status import Status

NEWTON = Newton(tolerance=1e-12)


CIRCLE = Curve(lambda x, p: x * x + p * p - 1, lambda x, _: 2 * x, lambda _, p: 2 * p)


def along(control, newton=NEWTON):
    """Follow two unknowns that weigh the same."""
    return Following(newton=newton, control=control, weights=np.ones(2))


def begin(problem, x, p, control):
    """The branch point nearest to `x`, looking towards growing p."""
    start = start_point(problem, np.array(x), p, along(control))
    assert start.solution.status.converged
    return start


def branch(problem, start, end, control):
    return list(trace(problem, start, end, along(control)))


def follow(curve, x, p, end, control):
    """From (x, p) towards `end`."""
    start = begin(curve, [x, 1.0], p, control)
    start = start if end > p else reversed_point(start)
    return start, branch(curve, start, end, control)


def on_the_circle(point):
    return point.solution.status.converged and abs(point.x[0] ** 2 + point.p**2 - 1) < 1e-11


@pytest.mark.parametrize("end", [0.8, -0.8])
def test_circle_without_folds(end):
    start, points = follow(CIRCLE, 1.0, 0.0, end, StepControl(scale=1.0))
    assert start.x[0] == pytest.approx(1.0)
    assert all(on_the_circle(point) for point in points)
    assert points[-1].p == end
    ps = [start.p, *(point.p for point in points)]
    assert np.all(np.diff(ps) * np.sign(end) > 0)
    assert points[-1].x[0] == pytest.approx(0.6, abs=1e-11)


def test_circle_round_both_ends():
    # the branch that starts to the right turns at p = 1, comes back on the other side and goes round: its end is nowhere
    control = StepControl(scale=1.0, max_points=60)
    start = begin(CIRCLE, [0.8, 1.0], 0.6, control)
    angles = [np.arctan2(start.x[0], start.p)]
    for point in trace(CIRCLE, start, 50.0, along(control)):
        assert on_the_circle(point)
        angles.append(np.arctan2(point.x[0], point.p))
    turned = np.diff(np.unwrap(angles))
    assert np.all(turned < 0)
    assert turned.sum() < -2 * np.pi


def test_the_tangent_decides_the_direction_and_not_the_end():
    # the end lies behind: looking at growing p the branch reaches it round the fold, on the other side of the circle
    control = StepControl(scale=1.0)
    start = begin(CIRCLE, [0.8, 1.0], 0.6, control)
    assert start.tangent[-1] > 0.0
    points = branch(CIRCLE, start, 0.0, control)
    assert all(on_the_circle(point) for point in points)
    assert points[0].p > 0.6
    assert points[-1].p == 0.0
    assert points[-1].x[0] == pytest.approx(-1.0, abs=1e-11)
    back = branch(CIRCLE, reversed_point(start), 0.0, control)
    assert back[0].p < 0.6
    assert back[-1].p == 0.0
    assert back[-1].x[0] == pytest.approx(1.0, abs=1e-11)


def test_a_reversed_branch_comes_back_to_its_start():
    control = StepControl(scale=1.0)
    start, points = follow(FOLD, -1.5, -1.875, 1.0, control)
    turned = reversed_point(points[-1])
    assert np.array_equal(turned.tangent, -points[-1].tangent)
    assert turned.orientation == -points[-1].orientation != 0.0
    back = branch(FOLD, turned, start.p, control)
    assert all(point.solution.status.converged for point in back)
    assert back[-1].p == start.p
    # Newton's tolerance over the slope there, 1e-12 / 5.75
    assert back[-1].x[0] == pytest.approx(-1.5, abs=1e-11)


# ---- corners ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("slope", [0.2, 0.4, 0.6, 1.0, 2.0, 5.0, 20.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_corner_is_gone_round(slope, side):
    curve = corner(slope)
    control = StepControl(scale=1.0, max_points=80)
    start = begin(curve, [side * 0.7 / slope, 1.0], 0.3, control)
    points = branch(curve, start, 9.0, control)
    assert all(point.solution.status.converged for point in points)
    xs = -side * np.array([start.x[0], *(point.x[0] for point in points)])
    ps = np.array([start.p, *(point.p for point in points)])
    assert np.allclose(ps, 1 - slope * np.abs(xs), rtol=0, atol=1e-11)
    assert np.all(np.diff(xs) > 0), "never back the way it came"
    assert xs[-1] > 0.2 / slope


@pytest.mark.parametrize("slope", [2.0, 20.0])
def test_a_rounded_corner_lies_at_the_corner_and_is_charged(slope):
    curve = corner(slope)
    control = StepControl(scale=1.0, max_points=80)
    start = begin(curve, [-0.7 / slope, 1.0], 0.3, control)
    points = [start, *branch(curve, start, 9.0, control)]
    k = next(i for i, point in enumerate(points) if point.x[0] > 0)
    before, after = points[k - 1], points[k]
    # steps were halved to the smallest on this side, and the far side is left by at most 64 of them
    assert 1.0 - before.p < 0.05
    assert 1.0 - after.p < 65 * control.smallest
    assert after.step <= 4.0 * control.smallest
    assert after.solution.iterations > 10, "the halved steps are charged to the point"
    assert np.sign(after.tangent[0]) == np.sign(before.tangent[0])
    assert np.sign(after.tangent[-1]) == -np.sign(before.tangent[-1])


@pytest.mark.parametrize("slope", [0.6, 2.0, 20.0])
def test_a_branch_goes_on_bitwise_at_a_corner(slope):
    assert_goes_on_bitwise(corner(slope), [-0.7 / slope, 1.0], 0.3, 9.0, StepControl(scale=1.0, max_points=40))


# ---- folds --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("x_unit", "p_unit"), [(1.0, 1e5), (1e-3, 1e3), (1e3, 1.0)])
def test_units_do_not_move_the_points(x_unit, p_unit):
    plain = Duffing()

    class Scaled:
        def linearise(self, x, p):
            at = plain.linearise(x / x_unit, p / p_unit)
            return At(at.residual, np.asfortranarray(at.jac / x_unit), at.jac_p / p_unit)

    branches = []
    for problem, x_size, p_size in ((plain, 1.0, 1.0), (Scaled(), x_unit, p_unit)):
        control = StepControl(scale=0.4 * p_size, first=0.05)
        start = begin(problem, [0.3 * x_size, 0.0], 0.3 * p_size, control)
        branches.append([(*(q.x / x_size), q.p / p_size) for q in branch(problem, start, 3.0 * p_size, control)])
    assert len(branches[0]) == len(branches[1])
    assert np.allclose(branches[0], branches[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("x", "p", "end"), [(-1.5, -1.875, 1.0), (1.5, 1.875, -1.0)])
def test_cubic_passes_both_folds(x, p, end):
    _, points = follow(FOLD, x, p, end, StepControl(scale=1.0))
    xs = np.array([point.x[0] for point in points])
    ps = np.array([point.p for point in points])
    assert all(point.solution.status.converged for point in points)
    assert np.allclose(xs**3 - xs, ps, rtol=0, atol=1e-11)
    assert np.all(np.diff(xs) * np.sign(end) > 0)
    turns = np.sum(np.diff(np.sign(np.diff(ps))) != 0)
    assert turns == 2
    assert points[-1].p == end


def test_steps_obey_their_limits():
    control = StepControl(scale=1.0, first=0.05, largest=0.2)
    start, points = follow(FOLD, -1.5, -1.875, 1.0, control)
    before = start
    for point in points:
        size = np.linalg.norm(before.x)
        length = np.sqrt(np.sum(((point.x - before.x) / size) ** 2) + (point.p - before.p) ** 2)
        assert length <= 4 * control.largest
        assert control.smallest <= point.step <= control.largest
        before = point


@dataclass(frozen=True, eq=False)
class Duffing:
    """One-harmonic Duffing oscillator: (1 - ω² + 3/4 β A²) q + i c ω q = F, unknowns Re and Im of q."""

    c: float = 0.1
    beta: float = 0.5
    force: float = 0.3

    def linearise(self, x, p):
        a, b = x
        k = 1 - p * p + 0.75 * self.beta * (a * a + b * b)
        r = np.array([k * a - self.c * p * b - self.force, k * b + self.c * p * a])
        stretch = 1.5 * self.beta
        jac = np.array(
            [[k + stretch * a * a, stretch * a * b - self.c * p], [stretch * a * b + self.c * p, k + stretch * b * b]],
            order="F",
        )
        return At(r, jac, np.array([-2 * p * a - self.c * b, -2 * p * b + self.c * a]))


def test_duffing_lies_on_its_closed_form():
    problem = Duffing()
    control = StepControl(scale=0.4, first=0.05)
    points = branch(problem, begin(problem, [0.3, 0.0], 0.3, control), 3.0, control)
    ps = np.array([point.p for point in points])
    amplitude = np.array([np.hypot(*point.x) for point in points])
    closed = amplitude**2 * ((1 - ps**2 + 0.75 * problem.beta * amplitude**2) ** 2 + (problem.c * ps) ** 2)
    assert np.allclose(closed, problem.force**2, rtol=0, atol=1e-10)
    assert np.sum(np.diff(np.sign(np.diff(ps))) != 0) == 2
    # on the backbone the phase is 90° and c ω A = F: no point is higher
    assert np.all(problem.c * ps * amplitude <= problem.force * (1 + 1e-12))
    assert np.max(problem.c * ps * amplitude) > 0.9 * problem.force
    assert points[-1].p == 3.0


def test_step_too_small_where_the_curve_ends():
    # x = sqrt(1 - p) drawn with a wall: beyond p = 0.5 the residual is not a number
    curve = Curve(wall, lambda _x, _p: 1.0, lambda _x, _p: 0.0)
    _, points = follow(curve, 1.0, 0.0, 1.0, StepControl(scale=1.0))
    assert points[-1].solution.status is Status.STEP_TOO_SMALL
    assert all(point.solution.status.converged for point in points[:-1])
    assert points[-1].p == points[-2].p < 0.5
    assert points[-1].p > 0.4
    assert np.array_equal(points[-1].x, points[-2].x)


def test_start_that_does_not_converge_says_so():
    curve = Curve(lambda x, _: x * x + 1, lambda x, _: 2 * x, lambda _x, _p: 0.0)
    start = start_point(curve, np.array([0.3, 1.0]), 0.0, along(StepControl(scale=1.0)))
    assert not start.solution.status.converged


def test_a_branch_without_end_stops_after_its_points():
    control = StepControl(scale=1.0, max_points=7)
    assert len(branch(CIRCLE, begin(CIRCLE, [1.0, 1.0], 0.0, control), 5.0, control)) == 7


# ---- going on from a point ----------------------------------------------------------------------------------------------


def same(a, b):
    return (
        np.array_equal(a.x, b.x)
        and a.p == b.p
        and np.array_equal(a.tangent, b.tangent)
        and a.step == b.step
        and a.orientation == b.orientation
        and a.solution.status is b.solution.status
        and a.solution.iterations == b.solution.iterations
    )


def assert_goes_on_bitwise(problem, x, p, end, control):
    """From each of its points a branch goes on as it did, step by step; return its points."""
    points = [begin(problem, x, p, control)]
    points += branch(problem, points[0], end, control)
    for k, point in enumerate(points[:-1]):
        assert same(advance(problem, replace(point), end, along(control)), points[k + 1])
    for k in range(0, len(points) - 1, 9):
        rest = branch(problem, points[k], end, replace(control, max_points=control.max_points - k))
        assert len(rest) == len(points) - k - 1
        assert all(same(a, b) for a, b in zip(rest, points[k + 1 :], strict=True))
    return points


@pytest.mark.parametrize("end", [3.0, 50.0])
def test_a_folded_branch_goes_on_bitwise(end):
    control = StepControl(scale=0.4, first=0.05, max_points=120)
    points = assert_goes_on_bitwise(Duffing(), [0.3, 0.0], 0.3, end, control)
    falling = [point for point in points if point.tangent[-1] < 0.0]
    assert len(falling) > 3, "no point lies between the folds: nothing was shown"


def test_a_branch_that_ends_goes_on_bitwise():
    curve = Curve(lambda x, p: x - 1.0 if p < 0.5 else np.nan, lambda _x, _p: 1.0, lambda _x, _p: 0.0)
    points = assert_goes_on_bitwise(curve, [1.0, 1.0], 0.0, 1.0, StepControl(scale=1.0))
    assert points[-1].solution.status is Status.STEP_TOO_SMALL


# ---- to a parameter -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("to", [0.31, 0.5, 0.29, 1.9])
def test_step_to_a_parameter(to):
    problem = Duffing(beta=0.0)
    control = StepControl(scale=0.4)
    start = begin(problem, [0.3, 0.0], 0.3, control)
    point = step_to(problem, start, to, along(control))
    assert point.solution.status.converged
    assert point.p == to
    q = problem.force / (1 - to**2 + 1j * problem.c * to)
    assert np.allclose(point.x, [q.real, q.imag], atol=1e-10)


def test_step_to_where_one_step_is_too_far():
    # a step in which Newton from the prediction fails: a steep bump lies between
    curve = Curve(
        lambda x, p: np.arctan(20 * (x - np.tanh(40 * (p - 0.5)))),
        lambda x, p: 20 / (1 + (20 * (x - np.tanh(40 * (p - 0.5)))) ** 2),
        lambda x, p: -20 / (1 + (20 * (x - np.tanh(40 * (p - 0.5)))) ** 2) * 40 / np.cosh(40 * (p - 0.5)) ** 2,
    )
    few = along(StepControl(scale=0.1), Newton(tolerance=1e-12, max_iterations=6))
    start = start_point(curve, np.array([-1.0, 1.0]), 0.0, few)
    direct = start_point(curve, start.x, 1.0, few)
    assert not direct.solution.status.converged
    point = step_to(curve, start, 1.0, few)
    assert point.solution.status.converged
    assert point.p == 1.0
    assert point.x[0] == pytest.approx(1.0, abs=1e-10)
    assert point.solution.iterations > direct.solution.iterations


@pytest.mark.parametrize("to", [1.2, -1.2])
def test_step_to_a_place_that_cannot_be_reached(to):
    control = StepControl(scale=1.0, max_points=30)
    point = step_to(CIRCLE, begin(CIRCLE, [0.8, 1.0], 0.6, control), to, along(control))
    assert not point.solution.status.converged
    assert point.p == to


@pytest.mark.parametrize("to", [-1.0, 1.0])
def test_step_to_shows_growing_parameter(to):
    # both ways; the point can be gone on from
    control = StepControl(scale=1.0)
    start = begin(CIRCLE, [1.0, 1.0], 0.0, control)
    point = step_to(CIRCLE, start, 0.6 * to, along(control))
    assert point.tangent[-1] > 0.0
    onward = point if to > 0 else reversed_point(point)
    assert branch(CIRCLE, onward, 0.8 * to, control)[-1].x[0] == pytest.approx(0.6, abs=1e-11)


def test_step_to_here_is_the_same_point():
    control = StepControl(scale=1.0)
    start = begin(CIRCLE, [0.8, 1.0], 0.6, control)
    assert step_to(CIRCLE, start, 0.6, along(control)) is start


def test_kept_factors_lead_to_the_same_curve_with_fewer_jacobians():
    """A residual is cheap where a Jacobian is factorised: around most of a circle, and its tangents are those of the circle."""
    control = StepControl(scale=1.0, first=0.1, largest=0.2, growth=2.0)
    factorised = []

    @dataclass(frozen=True, eq=False)
    class Told(At):
        def __getattribute__(self, name):
            if name == "jac":
                factorised.append(1)
            return super().__getattribute__(name)

    class Counted(Curve):
        def linearise(self, x, p):
            at = super().linearise(x, p)
            return Told(at.residual, at.jac, at.jac_p)

    counts = []
    circle = Counted(CIRCLE.f, CIRCLE.f_x, CIRCLE.f_p)
    start = begin(CIRCLE, [-0.9, 1.0], -0.2, control)
    for how in ({}, {"corrector": "kept_factors", "predictor": "parabola"}):
        factorised.clear()
        points = list(trace(circle, start, 0.95, replace(along(control), **how)))
        assert all(on_the_circle(p) for p in points)
        assert points[-1].p == 0.95
        for point in points[:-1]:
            radius = np.append(point.x[0], point.p)
            tangent = np.append(point.tangent[0], point.tangent[-1])
            assert abs(radius @ tangent) < 0.02 * np.linalg.norm(tangent)
        counts.append(len(factorised) / len(points))
    assert counts[1] < 0.6 * counts[0]
