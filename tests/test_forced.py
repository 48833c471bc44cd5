"""Forced response: published peaks, resuming, stages, and what is refused."""

from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest
from models import lifting

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.continuation import starting_solutions
from stickslip.response.continuation.branch import BACKWARD
from stickslip.response.forced import from_time
from stickslip.response.forced.passages import _solution
from stickslip.response.forced.problem import forced_point
from stickslip.response.forced.response import Sweep, accepted_pairs, accepted_points, forced_problem, forced_response
from stickslip.solve.newton_method import Newton, newton

HZ = 2 * np.pi
SHORT = Sweep(omega_range=(155 * HZ, 166 * HZ), samples=64, points=12, peak_points=3, high=5)


def peak_of(system, load, sweep):
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    assert all(p.converged for p in points)
    heights = [problem.amplitude(p) for p in points]
    return max(heights), points[int(np.argmax(heights))].omega


@pytest.mark.parametrize(
    ("limit", "peak", "omega"),
    [
        (0.02, 3.7388820, 1.000334),
        (0.05, 1.9693838, 1.004519),
        (0.08, 0.8446513, 1.031849),
        (0.10, 0.6260618, 1.065886),
        (0.14, 0.5509276, 1.119652),
        (0.2, 0.6038447, 1.161950),
        (0.5, 1.1288107, 1.211484),
        (1.0, 2.0803123, 1.221983),
    ],
)
def test_damper_optimisation_curve(limit, peak, omega):
    """Benchmark B3 (Griffin 1980): peaks of the one-harmonic response, closed form."""
    system, load = griffin(limit)
    sweep = Sweep(omega_range=(0.8, 1.3), selection="always_low", samples=512)
    height, where = peak_of(system, load, sweep)
    # sampling of the contact (512) and a bracket of 5e-4 of the frequency: second order in both at a smooth maximum
    assert height == pytest.approx(peak, rel=5e-4)
    assert where == pytest.approx(omega, rel=1e-3)


@pytest.mark.parametrize("best", ["start", "tried"])
def test_newtons_method_begins_with_the_smallest_residual(best):
    """The solution itself is among the starts: nothing is left to do."""
    system, load = griffin(0.1)
    problem = forced_problem(system, load, Sweep(omega_range=(0.8, 1.3), samples=512, high=3))
    balance = problem.high

    def solved(omega):
        solution = newton(lambda v: balance.linearise(v, omega), np.zeros(balance.size), Newton(tolerance=1e-12))
        return forced_point(balance, solution, "high", 0, omega, 0.0)

    far, exact = solved(0.8), solved(1.1)
    assert far.converged
    assert exact.converged
    if best == "start":
        tried, start = [far], exact.coefficients
    else:
        tried, start = [far, exact], far.coefficients
    found = _solution(problem, balance, tried, 1.1, start)
    assert found.status.converged
    assert found.iterations == 0
    np.testing.assert_allclose(found.x, balance.unknowns(exact.coefficients), rtol=0, atol=1e-12)


def test_stuck_damper_is_a_spring():
    system, load = griffin(2.0)
    # the preload of the contact, 2, is what residuals are measured by: 20 times the excitation
    sweep = Sweep(
        omega_range=(0.8, 1.1), selection="always_low", points=10, peak_points=0, newton=Newton(tolerance=1e-12)
    )
    problem = forced_problem(system, load, sweep)
    for p in forced_response(system, load, sweep):
        assert problem.amplitude(p) == pytest.approx(abs(0.1 / (1.5 - p.omega**2 + 0.02j * p.omega)), rel=1e-9)


@pytest.mark.parametrize(
    ("limit", "omega", "amplitude"), [(0.1, 1.1, 0.56839426), (0.1, 1.2, 0.38916153), (0.2, 1.15, 0.59978456)]
)
def test_many_harmonics_are_the_exact_response(limit, omega, amplitude):
    """Benchmark B3, event-driven solution."""
    system, load = griffin(limit)
    sweep = Sweep(
        omega_range=(omega - 0.02, omega),
        low=11,
        high=11,
        samples=2048,
        selection="always_low",
        points=4,
        frequencies=3,
        peak_points=0,
    )
    last = list(forced_response(system, load, sweep))[-1]
    assert last.omega == omega
    assert forced_problem(system, load, sweep).amplitude(last) == pytest.approx(amplitude, rel=2e-5)


# ---- stages -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run():
    system, load = blades_and_damper()
    return system, load, list(forced_response(system, load, SHORT))


def test_stages_in_order(run):
    system, _, points = run
    # last the peak is compared with more harmonics
    assert {p.stage for p in points[-2:]} <= {"peak", "check"}
    stages = [p.stage for p in points if p.stage not in ("check", "compared")]
    assert stages == sorted(stages, key=["low", "high", "peak"].index)
    assert set(stages) == {"low", "high", "peak"}
    assert points[-1].stage == "check"
    assert points[-1].order == 9
    low = [p for p in points if p.stage == "low"]
    assert [p.index for p in low] == list(range(len(low)))
    assert low[0].omega == SHORT.omega_range[0]
    assert low[-1].omega == SHORT.omega_range[1]
    assert all(p.order == 1 for p in low)
    for p in low:
        assert p.coefficients.shape == (2, system.retained.size)
    high = [p for p in points if p.stage == "high"]
    assert [p.index for p in high] == [p.index for p in low if p.predicted_error > SHORT.threshold]
    for p in high:
        assert p.order == 5
        assert p.omega == low[p.index].omega
        # the alert spoke of the point that is repeated, not of the repeat
        assert np.isnan(p.predicted_error)
    assert [p.index for p in points if p.stage == "peak"] == list(range(stages.count("peak")))


def test_accepted_points_replace_what_was_repeated(run):
    _, _, points = run
    accepted = accepted_points(points)
    low = sum(p.stage == "low" for p in points)
    omega = {p.omega for p in points if p.stage == "low"}
    # a peak point at a frequency of the first passage is that point with more harmonics, in its place
    again = {p.omega for p in points if p.stage == "peak" and p.omega in omega}
    peaks = sum(p.stage == "peak" and p.omega not in again for p in points)
    assert len(accepted) == low + peaks
    repeated = {p.index for p in points if p.stage == "high"}
    for index, point in enumerate(accepted[:low]):
        assert (point.order == 5) == (index in repeated or point.omega in again)


def test_every_point_solves_its_equations(run):
    system, load, points = run
    problem = forced_problem(system, load, SHORT)
    for p in points:
        balance = problem.balance(p.support)
        residual = balance.linearise(balance.unknowns(p.coefficients), p.omega).residual
        assert np.max(np.abs(residual)) <= 1.01 * SHORT.newton.tolerance


def test_peak_points_raise_the_peak(run):
    system, load, points = run
    problem = forced_problem(system, load, SHORT)
    top = max(accepted_points(points), key=problem.amplitude)
    # against points with as many harmonics: one with fewer may stand higher, and is then solved again
    before = max(
        problem.amplitude(p) for p in accepted_points([p for p in points if p.stage != "peak"]) if p.order == top.order
    )
    assert problem.amplitude(top) >= before


@pytest.mark.parametrize(("selection", "order"), [("always_low", 1), ("always_high", 5)])
def test_one_order_everywhere(selection, order):
    system, load = blades_and_damper()
    points = list(forced_response(system, load, replace(SHORT, selection=selection, points=6)))
    assert {p.order for p in points} == {order}
    assert {p.stage for p in points} == {"low", "peak"}
    assert all(np.isnan(p.predicted_error) for p in points)


def test_stepping_through_frequencies():
    system, load = blades_and_damper()
    sweep = replace(SHORT, frequencies=8, peak_points=0, selection="always_low")
    points = list(forced_response(system, load, sweep))
    assert [p.omega for p in points] == np.linspace(*SHORT.omega_range, 8).tolist()
    assert all(p.converged for p in points)
    # the same solutions as along the branch: solutions are unique where all contacts slip, and here in stick
    problem = forced_problem(system, load, sweep)
    branch = list(forced_response(system, load, replace(SHORT, selection="always_low", peak_points=0, points=40)))
    curve = np.interp([p.omega for p in points], [p.omega for p in branch], [problem.amplitude(p) for p in branch])
    assert [problem.amplitude(p) for p in points] == pytest.approx(curve.tolist(), rel=2e-2)  # linear interpolation


# ---- resuming -----------------------------------------------------------------------------------------------------------


RESULTS = ("stage", "index", "omega", "status", "iterations", "step", "orientation")


def assert_same(a, b):
    """Equal to the last bit in all but the time it took."""
    assert [getattr(a, name) for name in RESULTS] == [getattr(b, name) for name in RESULTS]
    assert np.array_equal(a.coefficients, b.coefficients)
    assert np.array_equal(a.tangent, b.tangent)
    assert np.array_equal(a.predicted_error, b.predicted_error, equal_nan=True)


WATCHED = 3  # points that are looked at after each stop: the second and third come of the first


def assert_resumes(system, load, sweep, points, stops):
    """A run that stopped after k points goes on as if it had not; that of the stop in the middle is followed to its end."""
    stops = list(stops)
    for k in stops:
        resumed = forced_response(system, load, sweep, done=points[:k])
        rest = list(resumed if k == stops[len(stops) // 2] else islice(resumed, WATCHED))
        expected = points[k:] if k == stops[len(stops) // 2] else points[k : k + WATCHED]
        assert len(rest) == len(expected), f"after {k} points"
        for a, b in zip(rest, expected, strict=True):
            assert_same(a, b)


def test_the_same_run_twice_is_the_same(run):
    system, load, points = run
    assert_resumes(system, load, SHORT, points, [0])


def test_resuming_gives_what_would_have_come(run):
    system, load, points = run
    assert_resumes(system, load, SHORT, points, range(1, len(points) + 1))


def test_resuming_does_not_change_what_was_done(run):
    system, load, points = run
    done = points[:5]
    list(islice(forced_response(system, load, SHORT, done=done), 3))
    assert len(done) == 5


FOLDED = Sweep(omega_range=(1.0, 1.6), samples=64, points=16, peak_points=2, selection="always_low")
# starts between the folds, on the lower branch
BETWEEN = replace(FOLDED, omega_range=(1.3, 1.6))


@pytest.fixture(scope="module", params=[FOLDED, BETWEEN], ids=["folded", "from between the folds"])
def folded_run(request):
    system, load = lifting()
    return system, load, request.param, list(forced_response(system, load, request.param))


def test_resuming_on_a_folded_branch(folded_run):
    system, load, sweep, points = folded_run
    low = [p for p in points if p.stage == "low"]
    falling = [p.index for p in low if p.tangent[-1] < 0.0]
    assert len(falling) > 4, "no point lies between the folds: nothing was shown"
    assert_resumes(system, load, sweep, points, range(1, len(points)))


def test_a_softening_branch_passes_its_folds():
    system, load = lifting()
    # fine in samples and in points: a coarse period makes small folds of its own at the peak
    fine = replace(FOLDED, samples=512, points=40, peak_points=0)
    problem = forced_problem(system, load, fine)
    low = [p for p in forced_response(system, load, fine) if p.stage == "low"]
    assert all(p.converged for p in low)
    omega = np.array([p.omega for p in low])
    folds = np.flatnonzero(np.diff(np.sign(np.diff(omega)))) + 1
    assert folds.size == 2
    assert omega[folds[0]] > omega[folds[1]]
    heights = [problem.amplitude(p) for p in low]
    assert folds[0] < int(np.argmax(heights)) <= folds[1] + 1
    assert (low[0].omega, low[-1].omega) == FOLDED.omega_range


def test_a_branch_that_falls_out_of_the_range_is_taken_up_further_on():
    system, load = lifting()
    low = [p for p in forced_response(system, load, BETWEEN) if p.stage == "low"]
    first, last = BETWEEN.omega_range
    omega = np.array([p.omega for p in low])
    # it is followed behind its start as far as that may lead back, and left with the first point beyond
    behind = np.flatnonzero(omega < first)
    assert np.array_equal(behind, np.arange(behind[0], behind[-1] + 1))
    assert np.all(omega[behind[:-1]] >= first - BACKWARD * (last - first))
    assert omega[behind[-1] + 1] > omega[: behind[0]].max()
    assert omega[-1] == last
    assert low[-1].converged
    assert np.any(np.diff(omega) < 0.0), "the branch turned back"
    # the gap between the farthest point of the lost branch and the first one of the next is a step of a `points`-th of the range
    reach = np.maximum.accumulate(omega)
    assert np.diff(reach).max() <= (last - first) / BETWEEN.points * (1 + 1e-9)


# too few Newton steps for a start without predictor beyond the fold
HASTY = replace(BETWEEN, newton=Newton(max_iterations=2), points=40)


@pytest.fixture
def no_rescue(monkeypatch):
    """Nothing but Newton and shorter steps: points fail that are found otherwise."""

    def newton_only(evaluate, starts, options, *_, **__):
        for start in starts:
            solution = newton(evaluate, start, options)
            if solution.status.converged:
                break
        return solution

    monkeypatch.setattr(starting_solutions, "solve_robustly", newton_only)
    monkeypatch.setattr(from_time, "MOST_COORDINATES", 0)


def test_resuming_after_points_that_failed(no_rescue):
    system, load = lifting()
    points = list(forced_response(system, load, HASTY))
    failed = [k for k, p in enumerate(points) if not p.converged]
    assert failed, "no point failed: nothing was shown"
    assert any(p.converged for p in points[failed[0] + 1 :])
    assert_resumes(system, load, HASTY, points, sorted({k + d for k in failed for d in (0, 1, 2)}))


def test_resuming_frequencies():
    system, load = blades_and_damper()
    sweep = replace(SHORT, frequencies=6)
    points = list(forced_response(system, load, sweep))
    assert {p.stage for p in points} == {"low", "high", "peak", "check"}
    assert_resumes(system, load, sweep, points, range(1, len(points)))


def test_frequencies_stay_on_their_grid_after_one_that_failed(no_rescue):
    system, load = lifting()
    sweep = replace(HASTY, newton=Newton(max_iterations=1), frequencies=24, peak_points=0)
    points = list(forced_response(system, load, sweep))
    accepted = accepted_points(points)
    failed = [k for k, p in enumerate(accepted) if not p.converged]
    assert failed, "no point failed: nothing was shown"
    assert any(p.converged for p in accepted[failed[0] + 1 :])
    assert [p.omega for p in accepted] == np.linspace(*HASTY.omega_range, 24).tolist()
    assert [p.index for p in accepted] == list(range(24))
    # a second try takes the place of the first one, and so does a last one from the neighbours
    assert len(points) > 24
    assert any(p.stage == "found" for p in points)
    assert_resumes(system, load, sweep, points, range(1, len(points)))


def test_resuming_points_from_the_motion_in_time():
    system, load = lifting()
    sweep = replace(HASTY, newton=Newton(max_iterations=1), frequencies=10, peak_points=0, rescue="in_time")
    points = list(forced_response(system, load, sweep))
    in_time = [k for k, p in enumerate(points) if p.stage == "in_time"]
    assert len(in_time) > 1, "no point was found in time: nothing was shown"
    assert_resumes(system, load, sweep, points, [in_time[0], in_time[1], len(points)])


def test_points_come_one_by_one():
    system, load = blades_and_damper()
    first = list(islice(forced_response(system, load, SHORT), 2))
    assert [p.index for p in first] == [0, 1]


# ---- the branch with many harmonics ---------------------------------------------------------------------------------------

# near its peak the folded response needs more harmonics, and repeats fail where the two orders have different folds
ALERTED = replace(FOLDED, selection="jacobian_alert", high=5)


@pytest.fixture(scope="module")
def branch_run():
    system, load = lifting()
    points = list(forced_response(system, load, ALERTED))
    assert any(p.stage == "high" and not p.converged for p in points), "no repeat failed"
    assert any(p.stage == "branch" for p in points), "no branch was followed: nothing was shown"
    return system, load, points


def repeats(points):
    """The last try of each repeat by index."""
    return {p.index: p for p in points if p.stage == "high"}


def test_repeats_stay_on_the_branch_of_their_neighbours(branch_run):
    system, load, points = branch_run
    problem = forced_problem(system, load, ALERTED)
    low = {p.index: p for p in points if p.stage == "low"}
    found = {i: p for i, p in repeats(points).items() if p.converged}
    assert len(found) > 8, "hardly a repeat converged: nothing was shown"
    for i, p in found.items():
        # the other stable solution at these frequencies is a tenth as high, the unstable one two thirds
        assert problem.amplitude(p) == pytest.approx(problem.amplitude(low[i]), rel=0.1)


def test_a_branch_replaces_the_run_of_repeats_that_failed(branch_run):
    system, load, points = branch_run
    pairs = accepted_pairs(points)
    assert accepted_points(points) == [p for p, _ in pairs]
    assert all(p.converged for p, _ in pairs)
    high = repeats(points)
    inside = [k for k, (p, _) in enumerate(pairs) if p.stage == "branch"]
    first = pairs[inside[0]][0].index
    assert inside == list(range(inside[0], inside[-1] + 1)), "the branch stands in one piece"
    run = [i for i in high if i >= first]
    last = next(i for i in range(first, max(run) + 2) if i not in high) - 1
    assert any(not high[i].converged for i in range(first, last + 1))
    # in the run's place, between the points next to it, and each point of the first passage at most once
    assert pairs[inside[0] - 1][1].index == first - 1
    assert pairs[inside[-1] + 1][1].index == last + 1
    assert all(source is None for _, source in pairs[inside[0] : inside[-1] + 1])
    sources = [source.index for _, source in pairs if source is not None]
    low = [p.index for p in points if p.stage == "low"]
    assert sources == [i for i in low if not first <= i <= last]
    problem = forced_problem(system, load, ALERTED)
    for k in inside:
        p = pairs[k][0]
        assert p.order == ALERTED.high
        at = problem.high.linearise(problem.high.unknowns(p.coefficients), p.omega)
        assert np.max(np.abs(at.residual)) <= 1.01 * ALERTED.newton.tolerance


def test_a_branch_that_did_not_come_through_leaves_the_run(branch_run):
    _, _, points = branch_run
    branch = [p for p in points if p.stage == "branch"]
    short = [p for p in points if p is not branch[-1]]
    accepted = accepted_points(short)
    assert not any(p.stage == "branch" for p in accepted)
    failed = [i for i, p in repeats(points).items() if not p.converged]
    assert [p.index for p in accepted if not p.converged] == sorted(failed)


def test_resuming_through_the_branch(branch_run):
    system, load, points = branch_run
    stages = [p.stage for p in points]
    begin, end = stages.index("branch"), len(stages) - stages[::-1].index("branch")
    # the repeats before it twice: the first try and the one with neighbours known
    stops = [begin - 12, begin - 1, *range(begin, end + 1), len(points)]
    assert_resumes(system, load, ALERTED, points, stops)


def test_the_response_through_a_branch_is_one_curve(branch_run):
    system, load, points = branch_run
    problem = forced_problem(system, load, ALERTED)
    curve = [p for p in accepted_points(points) if p.stage != "peak"]
    first = [p for p in points if p.stage == "low"]
    # steps along the curve are not much longer than those of the first passage
    longest = max(abs(problem.amplitude(b) - problem.amplitude(a)) for a, b in pairwise(first))
    for a, b in pairwise(curve):
        assert abs(problem.amplitude(b) - problem.amplitude(a)) <= 1.5 * longest


# ---- messages -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ends", [(20.0, 10.0), (10.0, 10.0), (0.0, 10.0), (-5.0, 10.0)])
def test_range_must_grow(ends):
    with pytest.raises(
        InputError, match=rf"Sweep\.omega_range: must be positive and growing, got {ends[0]:g} to {ends[1]:g}"
    ):
        Sweep(omega_range=ends)


@pytest.mark.parametrize(("low", "high"), [(0, 5), (3, 2)])
def test_harmonics_must_make_sense(low, high):
    with pytest.raises(InputError, match=rf"harmonics low = {low}, high = {high}"):
        Sweep(omega_range=(1.0, 2.0), low=low, high=high)


def test_no_load_is_refused():
    system, load = blades_and_damper()
    nothing = HarmonicLoad(np.zeros(load.static.size))
    with pytest.raises(InputError, match="HarmonicLoad: is zero"):
        next(forced_response(system, nothing, SHORT))


def test_load_of_another_system_is_refused():
    system, _ = griffin(0.1)
    with pytest.raises(InputError, match="3 entries for 1 dofs"):
        next(forced_response(system, HarmonicLoad(np.ones(3)), Sweep(omega_range=(0.5, 1.0))))
