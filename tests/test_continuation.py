"""Continuation on curves that are known in closed form."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from stickslip.solve.continuation import StepControl, start_point, step_to, trace
from stickslip.solve.newton import Newton
from stickslip.solve.status import Status

NEWTON = Newton(tolerance=1e-12)


@dataclass(frozen=True, eq=False)
class At:
    residual: np.ndarray
    jac: np.ndarray
    jac_p: np.ndarray
    seconds_contact: float = 0.0


@dataclass(frozen=True, eq=False)
class Curve:
    """x ↦ f(x, p) with derivatives, for two unknowns: the second one is 1 and gives the first a size to be measured by."""

    f: object
    f_x: object
    f_p: object

    def linearise(self, x, p):
        return At(
            np.array([self.f(x[0], p), x[1] - 1.0]),
            np.array([[self.f_x(x[0], p), 0.0], [0.0, 1.0]], order="F"),
            np.array([self.f_p(x[0], p), 0.0]),
        )


CIRCLE = Curve(lambda x, p: x * x + p * p - 1, lambda x, _: 2 * x, lambda _, p: 2 * p)
FOLD = Curve(
    lambda x, p: p - x**3 + x, lambda x, _: -3 * x * x + 1, lambda _x, _p: 1.0
)  # folds at x = ±1/√3


def follow(curve, x, p, end, control, weights=None):
    weights = np.ones(2) if weights is None else weights
    start = start_point(curve, np.array([x, 1.0]), p, NEWTON, control, weights)
    assert start.solution.status.converged
    return start, list(trace(curve, start, end, options=NEWTON, control=control, weights=weights))


@pytest.mark.parametrize("end", [0.8, -0.8])
def test_circle_without_folds(end):
    start, points = follow(CIRCLE, 1.0, 0.0, end, StepControl(scale=1.0))
    assert start.x[0] == pytest.approx(1.0)
    for point in points:
        assert point.solution.status.converged
        assert point.x[0] ** 2 + point.p**2 == pytest.approx(1.0, abs=1e-11)
    assert points[-1].p == end
    ps = [start.p, *(point.p for point in points)]
    assert np.all(np.diff(ps) * np.sign(end) > 0)
    assert points[-1].x[0] == pytest.approx(0.6, abs=1e-11)


def test_circle_round_both_ends():
    # the branch that starts to the right turns at p = 1 and comes back on the other side of the circle; its end is so far away that
    # the way back does not count as leaving the range
    control = StepControl(scale=1.0, max_points=60)
    start = start_point(CIRCLE, np.array([0.8, 1.0]), 0.6, NEWTON, control, np.ones(2))
    angles = [np.arctan2(start.x[0], start.p)]
    for point in trace(CIRCLE, start, 50.0, options=NEWTON, control=control, weights=np.ones(2)):
        assert point.solution.status.converged
        assert point.x[0] ** 2 + point.p**2 == pytest.approx(1.0, abs=1e-11)
        angles.append(np.arctan2(point.x[0], point.p))
    turned = np.diff(np.unwrap(angles))
    assert np.all(turned < 0)
    assert turned.sum() < -2 * np.pi


def test_a_branch_that_falls_back_behind_its_start_is_left():
    control = StepControl(scale=1.0)
    start = start_point(CIRCLE, np.array([0.8, 1.0]), 0.6, NEWTON, control, np.ones(2))
    points = list(trace(CIRCLE, start, 1.6, options=NEWTON, control=control, weights=np.ones(2)))
    assert all(point.solution.status.converged for point in points)
    assert all(point.p >= 0.5 for point in points[:-1])
    assert 0.0 < points[-1].p < 0.5
    assert points[-1].x[0] < 0.0, "round the fold, not back the way it came"


@pytest.mark.parametrize("slope", [0.2, 0.4, 0.6])
def test_a_corner_is_gone_round(slope):
    # p = 1 - slope |x|: contact laws make such corners. From a right angle on (slope 1), no plane across the old direction
    # meets the rest of the branch, and the branch ends with STEP_TOO_SMALL
    curve = Curve(
        lambda x, p: p - 1 + slope * abs(x),
        lambda x, _: slope * (1.0 if x > 0 else -1.0),
        lambda _x, _p: 1.0,
    )
    control = StepControl(scale=1.0, max_points=80)
    start = start_point(curve, np.array([-0.7 / slope, 1.0]), 0.3, NEWTON, control, np.ones(2))
    points = list(trace(curve, start, 9.0, options=NEWTON, control=control, weights=np.ones(2)))
    assert all(point.solution.status.converged for point in points)
    xs = np.array([point.x[0] for point in points])
    assert np.all(np.diff(xs) > 0)
    assert xs[-1] > 0.2 / slope


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
        start = start_point(
            problem, np.array([0.3 * x_size, 0.0]), 0.3 * p_size, NEWTON, control, np.ones(2)
        )
        branches.append(
            [(*(q.x / x_size), q.p / p_size) for q in branch(problem, start, 3.0 * p_size, control)]
        )
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
            [
                [k + stretch * a * a, stretch * a * b - self.c * p],
                [stretch * a * b + self.c * p, k + stretch * b * b],
            ],
            order="F",
        )
        return At(r, jac, np.array([-2 * p * a - self.c * b, -2 * p * b + self.c * a]))


def test_duffing_lies_on_its_closed_form():
    problem = Duffing()
    control = StepControl(scale=0.4, first=0.05)
    start = start_point(problem, np.array([0.3, 0.0]), 0.3, NEWTON, control, np.ones(2))
    points = list(trace(problem, start, 3.0, options=NEWTON, control=control, weights=np.ones(2)))
    ps = np.array([point.p for point in points])
    amplitude = np.array([np.hypot(*point.x) for point in points])
    closed = amplitude**2 * (
        (1 - ps**2 + 0.75 * problem.beta * amplitude**2) ** 2 + (problem.c * ps) ** 2
    )
    assert np.allclose(closed, problem.force**2, rtol=0, atol=1e-10)
    assert np.sum(np.diff(np.sign(np.diff(ps))) != 0) == 2
    # on the backbone the phase is 90° and c ω A = F: no point is higher
    assert np.all(problem.c * ps * amplitude <= problem.force * (1 + 1e-12))
    assert np.max(problem.c * ps * amplitude) > 0.9 * problem.force
    assert points[-1].p == 3.0


def test_step_too_small_where_the_curve_ends():
    # x = sqrt(1 - p) drawn with a wall: beyond p = 0.5 the residual is not a number
    def wall(x, p):
        return x - 1.0 if p < 0.5 else np.nan

    curve = Curve(wall, lambda _x, _p: 1.0, lambda _x, _p: 0.0)
    _, points = follow(curve, 1.0, 0.0, 1.0, StepControl(scale=1.0))
    assert points[-1].solution.status is Status.STEP_TOO_SMALL
    assert all(point.solution.status.converged for point in points[:-1])
    assert points[-1].p == points[-2].p < 0.5
    assert points[-1].p > 0.4
    assert np.array_equal(points[-1].x, points[-2].x)


def test_start_that_does_not_converge_says_so():
    curve = Curve(lambda x, _: x * x + 1, lambda x, _: 2 * x, lambda _x, _p: 0.0)
    start = start_point(
        curve, np.array([0.3, 1.0]), 0.0, NEWTON, StepControl(scale=1.0), np.ones(2)
    )
    assert not start.solution.status.converged


def test_a_branch_without_end_stops_after_its_points():
    start = start_point(
        CIRCLE, np.array([1.0, 1.0]), 0.0, NEWTON, StepControl(scale=1.0), np.ones(2)
    )
    control = StepControl(scale=1.0, max_points=7)
    assert (
        len(list(trace(CIRCLE, start, 5.0, options=NEWTON, control=control, weights=np.ones(2))))
        == 7
    )


def branch(problem, start, end, control):
    return list(trace(problem, start, end, options=NEWTON, control=control, weights=np.ones(2)))


def same(a, b):
    return (
        np.array_equal(a.x, b.x) and a.p == b.p and np.array_equal(a.tangent, b.tangent) and a.step == b.step
        and a.solution.iterations == b.solution.iterations
    )  # fmt: skip


def test_a_branch_before_its_folds_goes_on_bitwise():
    control = StepControl(scale=0.4, first=0.05)
    start = start_point(Duffing(beta=0.0), np.array([0.3, 0.0]), 0.3, NEWTON, control, np.ones(2))
    points = branch(Duffing(beta=0.0), start, 2.0, control)
    for k in range(0, len(points) - 1, 3):
        rest = branch(Duffing(beta=0.0), replace(points[k]), 2.0, control)
        assert len(rest) == len(points) - k - 1
        assert all(same(a, b) for a, b in zip(rest, points[k + 1 :], strict=True))


@pytest.mark.parametrize("to", [0.31, 0.5, 0.29, 1.9])
def test_step_to_a_parameter(to):
    problem = Duffing(beta=0.0)
    control = StepControl(scale=0.4)
    start = start_point(problem, np.array([0.3, 0.0]), 0.3, NEWTON, control, np.ones(2))
    point = step_to(problem, start, to, NEWTON, control, np.ones(2))
    assert point.solution.status.converged
    assert point.p == to
    q = problem.force / (1 - to**2 + 1j * problem.c * to)
    assert np.allclose(point.x, [q.real, q.imag], atol=1e-10)


def test_step_to_where_one_step_is_too_far():
    # a step in which Newton from the prediction fails: a steep bump lies between
    curve = Curve(
        lambda x, p: np.arctan(20 * (x - np.tanh(40 * (p - 0.5)))),
        lambda x, p: 20 / (1 + (20 * (x - np.tanh(40 * (p - 0.5)))) ** 2),
        lambda x, p: (
            -20
            / (1 + (20 * (x - np.tanh(40 * (p - 0.5)))) ** 2)
            * 40
            / np.cosh(40 * (p - 0.5)) ** 2
        ),
    )
    few = Newton(tolerance=1e-12, max_iterations=6)
    control = StepControl(scale=0.1)
    start = start_point(curve, np.array([-1.0, 1.0]), 0.0, few, control, np.ones(2))
    direct = start_point(curve, start.x, 1.0, few, control, np.ones(2))
    assert not direct.solution.status.converged
    point = step_to(curve, start, 1.0, few, control, np.ones(2))
    assert point.solution.status.converged
    assert point.p == 1.0
    assert point.x[0] == pytest.approx(1.0, abs=1e-10)
    assert point.solution.iterations > direct.solution.iterations


def test_step_to_a_place_that_cannot_be_reached():
    start = start_point(
        CIRCLE, np.array([0.8, 1.0]), 0.6, NEWTON, StepControl(scale=1.0, max_points=30), np.ones(2)
    )
    point = step_to(CIRCLE, start, 1.2, NEWTON, StepControl(scale=1.0, max_points=30), np.ones(2))
    assert not point.solution.status.converged
    assert point.p == 1.2


def test_step_to_here_is_the_same_point():
    start = start_point(
        CIRCLE, np.array([0.8, 1.0]), 0.6, NEWTON, StepControl(scale=1.0), np.ones(2)
    )
    assert step_to(CIRCLE, start, 0.6, NEWTON, StepControl(scale=1.0), np.ones(2)) is start
