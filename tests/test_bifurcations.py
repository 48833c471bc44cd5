"""Bifurcations of a branch against SciPy's integration of the same oscillators, which shares nothing with the package."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.integrate

import stickslip as ss
from evidence.models.lumped import griffin
from evidence.validation.case_bifurcations import absorber
from stickslip.errors import InputError
from stickslip.reduction.tuned import TunedWheel
from stickslip.response.bifurcations import bifurcations, side_branches, subharmonic_branch
from stickslip.response.bifurcations.period_multiplied import in_periods, over_periods
from stickslip.response.forced.response import forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.stability import Stability, stability
from stickslip.response.stability.found import Floquet
from stickslip.solve.status import Status

DAMPING, STOP = 0.05, 10.0  # of a mass that meets a stop ten times as stiff as its spring


def impacting(omega_range, *, highest=15, points=20):
    """Return the response of a mass of 1 kg on a spring of 1 N/m, driven by 1 N, with an elastic stop at rest: problem and points."""
    structure = ss.model.lumped(np.ones(1), np.ones((1, 1)), damping=np.array([[2 * DAMPING]]), names=("mass",))
    stop = ss.Interface(("stop",), (ss.UnilateralSpring(k_n=STOP),), np.array([[0.0], [0.0], [1.0]]))
    system = ss.System(structure, stop, outputs=structure.sets["mass"])
    load = ss.HarmonicLoad(np.zeros(1), {1: np.ones(1, dtype=complex)})
    sweep = ss.Sweep(omega_range=omega_range, low=highest, high=highest, selection="always_high", points=points)
    problem = ss.response.forced_problem(system, load, sweep)
    return problem, ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))


@cache
def doubling():
    """Return the response from 1.5 to 2.6 rad/s and its bifurcations."""
    problem, points = impacting((1.5, 2.6))
    return problem, points, bifurcations(problem, points)


def marched(omega, state, periods=1):
    """Return state and its derivative after some periods, by SciPy, begun anew where the stop is met or left."""

    def rate(stiffness):
        matrix = np.array([[0.0, 1.0], [-stiffness, -2 * DAMPING]])
        return lambda t, y: np.append(matrix @ y[:2] + [0.0, np.cos(omega * t)], (matrix @ y[2:].reshape(2, 2)).ravel())

    def crossing(t, y):
        return y[0]

    crossing.terminal = True
    t, y, end = 0.0, np.append(state, [1.0, 0.0, 0.0, 1.0]), 2 * np.pi / omega * periods
    touches = state[0] < 0.0
    while t < end:
        crossing.direction = 1.0 if touches else -1.0
        found = scipy.integrate.solve_ivp(
            rate(1.0 + STOP * touches), (t, end), y, "DOP853", events=crossing, rtol=1e-9, atol=1e-11
        )
        t, y, touches = found.t[-1], found.y[:, -1], touches ^ (found.status == 1)
    return y[:2], y[2:].reshape(2, 2)


def periodic(omega, state, periods=1):
    """Return the periodic motion near a state and its derivative, by Newton's method."""
    for _ in range(20):
        after, matrix = marched(omega, state, periods)
        change = np.linalg.solve(matrix - np.eye(2), state - after)
        state = state + change
        if np.abs(change).max() < 1e-7:
            break
    return state, matrix


def start_of(point):
    """Return displacement and velocity of the only mass at t = 0."""
    row = point.coefficients[:, 0]
    return np.array([row.real.sum(), (1j * np.arange(row.size) * point.omega * row).real.sum()])


def test_period_doubling_of_an_impacting_mass_lies_where_scipy_finds_it():
    _, _, all_of_it = doubling()
    (found,) = all_of_it.found
    assert (found.kind, found.multiplicity) == ("period doubling", 1)
    assert found.certain
    state = start_of(found.point)

    def above(omega):
        return float(1.0 + np.linalg.eigvals(periodic(omega, state)[1]).real.min())

    assert found.omega_error < 1e-3
    assert above(found.omega - found.omega_error) > 0.0 > above(found.omega + found.omega_error)
    assert abs(found.multiplier + 1.0) < 1e-4


def test_multipliers_are_asked_for_within_what_is_allowed():
    problem, points, _ = doubling()
    few = bifurcations(problem, points, most=20)
    assert few.examined <= 20
    assert [b.kind for b in few.found] == ["period doubling"] or few.unseen


def test_bad_requests_are_refused():
    problem, points, _ = doubling()
    with pytest.raises(InputError, match="tolerance"):
        bifurcations(problem, points, tolerance=0.0)
    with pytest.raises(InputError, match="most"):
        bifurcations(problem, points, most=3)


def test_a_doubled_period_is_followed_and_closes_in_time_after_two_periods():
    problem, _, all_of_it = doubling()
    (branch,) = side_branches(problem, all_of_it.found[0], points=12)
    assert branch.periods == 2
    middle = branch.points[6]
    sizes = [branch.subharmonic(p) for p in branch.points]
    assert sizes[0] < 0.1 < sizes[6] < sizes[-1]
    omega, state = 2 * middle.omega, start_of(middle)
    once, _ = marched(omega, state)
    twice, matrix = marched(omega, state, periods=2)
    assert np.abs(once - state).max() > 0.3
    assert np.abs(twice - state).max() < 1e-3
    known = np.abs(stability(branch.problem, middle).floquet.multipliers).max()
    assert known == pytest.approx(np.abs(np.linalg.eigvals(matrix)).max(), abs=2e-3)


def test_a_doubled_branch_between_two_doublings_is_followed_from_one_to_the_other():
    # its first point lies near its top, where its tangent is across the direction in which it left
    stiffness = np.array([[1.5051, -0.2573], [-0.2573, 1.5127]])
    damping = np.array([[0.1096, -0.0153], [-0.0153, 0.1101]])
    structure = ss.model.lumped(np.ones(2), stiffness, damping=damping, names=("first", "second"))
    stops = (ss.UnilateralSpring(k_n=7.5928, initial_gap=0.3367), ss.UnilateralSpring(k_n=3.1849, initial_gap=0.5688))
    gaps = np.zeros((6, 2))
    gaps[2, 0], gaps[5, 1] = 1.0, -1.0
    system = ss.System(structure, ss.Interface(("below", "above"), stops, gaps), np.array([0]))
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([0.6086 + 0j, 0.0])})
    sweep = ss.Sweep(omega_range=(0.6, 0.7), low=21, high=21, selection="always_high", points=8, peak_points=0)
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    lower, upper = bifurcations(problem, points).found
    (branch,) = side_branches(problem, upper, points=20)
    assert lower.kind == upper.kind == "period doubling"
    assert lower.omega < branch.omegas.min() < lower.omega + 0.004
    assert branch.end == "it comes back to the branch that it left"
    (other,) = side_branches(problem, lower, points=20)  # leaves by less than a hundredth
    assert other.omegas.max() > upper.omega - 0.004


SECTORS, COUPLING, CLEARANCE = 4, 0.03, 0.1


def ring():
    """Return problem and points of a wheel of four masses coupled in a ring, each between two stops, neighbours driven against each other."""

    def of_wave(k):
        stiffness = 1.0 + 2 * COUPLING * (1 - np.cos(2 * np.pi * k / SECTORS))
        return ss.model.lumped(np.ones(1), np.array([[stiffness]]), damping=np.array([[0.02]]), names=("mass",))

    wheel = TunedWheel({k: of_wave(k) for k in range(SECTORS)}, SECTORS, SECTORS // 2, 8)
    stop = ss.UnilateralSpring(k_n=1.0, initial_gap=CLEARANCE)
    gaps = np.zeros((6, 1))
    gaps[[2, 5], 0] = 1.0, -1.0
    system = ss.System(wheel, ss.Interface(("above", "below"), (stop, stop), gaps), np.array([0]))
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([0.008 + 0j])})
    sweep = ss.Sweep(omega_range=(1.0, 1.06), low=[1, 3, 5], high=[1, 3, 5], selection="always_high", points=12)
    problem = ss.response.forced_problem(system, load, sweep)
    return problem, ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))


def marched_ring(omega, state, periods):
    """Return the state of all masses after some periods, by SciPy."""
    turn = np.roll(np.eye(SECTORS), 1, axis=0)
    stiffness = np.eye(SECTORS) + COUPLING * (2 * np.eye(SECTORS) - turn - turn.T)
    against = (-1.0) ** np.arange(SECTORS)

    def rate(t, y):
        x, v = np.split(y, 2)
        stop = np.sign(x) * np.maximum(np.abs(x) - CLEARANCE, 0.0)
        return np.append(v, 0.008 * against * np.cos(omega * t) - 0.02 * v - stiffness @ x - stop)

    end = 2 * np.pi / omega * periods
    return scipy.integrate.solve_ivp(rate, (0.0, end), state, "DOP853", rtol=1e-6, atol=1e-9).y[:, -1]


def test_a_wheel_loses_its_symmetry_where_a_localised_branch_leaves():
    problem, points = ring()
    found = bifurcations(problem, points).found
    (first,) = (b for b in found if b.kind == "branch point")
    assert (first.before, first.after) == (0, 1)
    (branch,) = side_branches(problem, first, points=20)
    sizes = np.array([np.abs(p.coefficients[1]) for p in branch.points])
    ratio = sizes.max(axis=1) / sizes.min(axis=1)
    assert ratio[0] < 1.2
    there = int(np.argmax(ratio > 2.5))
    assert branch.localisation(branch.points[there]) > 0.4
    # stable by the multipliers of all sectors; in time a disturbance of a hundredth dies, and the localised motion stays
    point = branch.points[there]
    assert stability(branch.problem, point).verdict == "stable"
    rows = np.arange(len(point.coefficients))[:, None] * 1j * point.omega
    state = np.concatenate([point.coefficients.real.sum(axis=0), (rows * point.coefficients).real.sum(axis=0)])
    after = marched_ring(point.omega, 1.01 * state, 30)
    assert np.abs(after - state).max() < 3e-3 * np.abs(state).max()


def cubic_mass(omega_range, *, force, highest, points):
    """Return the forced response of a damped mass on a spring with a cubic part."""
    structure = ss.model.lumped(np.ones(1), np.ones((1, 1)), damping=np.array([[0.02]]), names=("mass",))
    spring = ss.Interface(("spring",), (ss.CubicSpring(cubic_t=1.0),), np.array([[1.0], [0.0], [0.0]]))
    system = ss.System(structure, spring, outputs=structure.sets["mass"])
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})
    sweep = ss.Sweep(omega_range=omega_range, low=highest, high=highest, selection="always_high", points=points)
    return ss.response.forced_problem(system, load, sweep)


def test_a_subharmonic_motion_closes_after_three_periods():
    problem = cubic_mass((3.0, 4.5), force=3.0, highest=5, points=20)
    omega = 3.6
    guess = np.zeros((4, 1), dtype=complex)
    guess[1], guess[3] = np.sqrt(((omega / 3) ** 2 - 1) / 0.75), 3.0 / (1 - omega**2)
    branch = subharmonic_branch(problem, omega, 3, guess, points=40)
    assert branch.omegas.min() > 3.1  # it folds there: subharmonic motions have an onset
    point = max(branch.points, key=branch.subharmonic)
    state = start_of(point)
    period = 2 * np.pi / point.omega

    def rate(t, y):
        return [y[1], 3.0 * np.cos(3 * point.omega * t) - 0.02 * y[1] - y[0] - y[0] ** 3]

    course = scipy.integrate.solve_ivp(rate, (0.0, period), state, "DOP853", rtol=1e-9, t_eval=[period / 3, period]).y
    assert np.abs(course[:, 0] - state).max() > 0.3
    assert np.abs(course[:, 1] - state).max() < 1e-3


def test_nothing_leaves_a_fold_or_a_torus():
    problem, _, all_of_it = doubling()
    for kind in ("fold", "Neimark-Sacker"):
        with pytest.raises(InputError, match=kind):
            side_branches(problem, replace(all_of_it.found[0], kind=kind))


def test_folds_of_one_harmonic_lie_where_the_closed_form_has_them():
    force = 0.02
    problem, points, _ = folded()
    found = bifurcations(problem, points, examine=None)
    # ((1 + 3/4 A^2 - w^2)^2 + (c w)^2) A^2 = F^2 is quadratic in w^2; its larger root over A turns twice
    size = np.linspace(0.05, 0.99, 400_001)
    spring = 1 + 0.75 * size**2
    middle = spring - 0.5 * 0.02**2
    square = middle**2 - spring**2 + (force / size) ** 2
    omega = np.sqrt(middle[square > 0] + np.sqrt(square[square > 0]))
    lowest = int(np.argmin(omega))
    true = [omega[lowest], omega[lowest:].max()]
    assert [b.kind for b in found.found] == ["fold", "fold"]
    assert sorted(b.omega for b in found.found) == pytest.approx(true, abs=1e-6)
    assert found.examined == 0


@cache
def folded():
    """Return a response of one harmonic with two folds, its points, and a phase that falls along the whole branch at both and their neighbours."""
    problem = cubic_mass((0.8, 1.6), force=0.02, highest=1, points=30)
    load = problem.low.linear.load
    every = ss.response.accepted_points(list(ss.forced_response(problem.system, load, problem.sweep)))
    points = [p for p in every if p.stage != "peak"]
    return problem, points, bifurcations(problem, points, examine=None).found


def phase(point):
    return float(np.angle(point.coefficients[1, 0]))


def with_multipliers(*values, error):
    return Stability(Floquet(np.array(values, dtype=complex)), np.full(len(values), error), 0, 0, 0)


def test_a_pair_that_more_harmonics_bring_together_at_a_fold_is_that_of_the_fold():
    # as two masses near 1:2 showed it: without its error the pair would be a torus beside each fold
    problem, points, folds = folded()
    ends = [phase(b.point) for b in folds]

    def examine(problem, point):
        beyond = 0.01 * (ends[0] - phase(point)) * (phase(point) - ends[1])
        return with_multipliers(1.0 + beyond + 0.003j, 0.99 - 0.003j, error=0.03)

    found = bifurcations(problem, points, examine=examine).found
    assert [(b.kind, b.before, b.after) for b in found] == [("fold", 0, 1), ("fold", 1, 0)]


def test_a_branch_point_in_the_step_of_a_fold_is_found():
    # as a chain of masses showed it: both change the number of multipliers outside, and the two ends of the step have the same
    problem, points, folds = folded()
    ends = [phase(b.point) for b in folds]
    after = phase(points[folds[0].place[1]])
    there = ends[0] + 0.3 * (after - ends[0])

    def examine(problem, point):
        beyond = (ends[0] - phase(point)) * (phase(point) - ends[1])
        return with_multipliers(1.0 + 0.1 * beyond, 1.0 + 0.1 * (phase(point) - there), error=1e-9)

    found = bifurcations(problem, points, examine=examine).found
    assert [(b.kind, b.before, b.after) for b in found] == [("fold", 1, 2), ("branch point", 2, 1), ("fold", 1, 0)]
    assert phase(found[1].point) == pytest.approx(there, abs=1e-5)


def test_points_without_a_motion_and_points_that_are_skipped_are_told():
    problem, points, _ = doubling()
    lost = [*points[:4], replace(points[4], status=Status.STALLED), *points[5:]]
    (told,) = bifurcations(problem, lost, examine=None).unseen
    assert told == (points[3].omega, points[5].omega, "no motion was found there")
    few = bifurcations(problem, points, most=20)
    assert few.stride > 1
    assert any("points of the branch was looked at" in line for line in few.limits)


def test_a_torus_of_an_absorber_lies_where_shooting_has_it():
    # the vibration absorber of that case, which finds 1.1092820 by SciPy
    mass, damping, stiffness, cubic = absorber()
    structure = ss.model.lumped(mass, stiffness, damping=damping, names=("primary", "absorber"))
    gaps = np.zeros((6, 2))
    gaps[0], gaps[3] = (1.0, 0.0), (1.0, -1.0)
    springs = tuple(ss.CubicSpring(cubic_t=float(value)) for value in cubic)
    system = ss.System(structure, ss.Interface(("ground", "link"), springs, gaps), np.array([0]))
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([0.11, 0.0j])})
    odd = [1, 3]
    sweep = ss.Sweep(omega_range=(1.08, 1.13), low=odd, high=odd, selection="always_high", points=2, peak_points=0)
    problem = ss.response.forced_problem(system, load, sweep)
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    ends = [points[0], points[-1]]
    (found,) = bifurcations(problem, ends).found
    assert (found.kind, found.before, found.after) == ("Neimark-Sacker", 0, 2)
    assert abs(found.omega - 1.1092820) <= max(found.omega_error, 1e-6) < 1e-3
    assert 0.0 < found.beat < found.omega / 2


@pytest.mark.parametrize("more", [{"frequencies": 5}, {"at": (0.9, 1.0)}, {"points": 7}])
def test_a_problem_over_several_periods_has_their_harmonics_and_no_frequencies_of_its_own(more):
    """Three periods of the load are one: a third of the frequency, harmonics up to three times the highest."""
    system, load = griffin(0.1)
    problem = forced_problem(system, load, Sweep(omega_range=(0.8, 1.3), samples=64, high=3, **more))
    own = over_periods(problem, 3, 5)
    assert own.sweep.grid.size == 0
    assert own.sweep.omega_range == pytest.approx((0.8 / 3, 1.3 / 3))
    assert own.low.harmonics == own.high.harmonics == tuple(range(16))
    assert own.low.samples == 192
    point = next(iter(forced_response(system, load, problem.sweep)))
    long = in_periods(point, 3)
    assert long.omega == point.omega / 3
    np.testing.assert_array_equal(long.coefficients[::3], point.coefficients)
    assert np.count_nonzero(long.coefficients) == np.count_nonzero(point.coefficients)
    assert long.harmonics.tolist() == list(range(3 * point.order + 1))
    assert (long.kept.size, long.kept.dtype) == (0, np.int64)
    # the same motion: the residual over three periods is that over one
    balance = over_periods(problem, 3, point.order).low
    assert np.abs(balance.linearise(balance.unknowns(long.coefficients), long.omega).residual).max() < 1e-6
