"""Shooting against closed forms, exact event-driven results, finite differences and the decay that integration shows."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
from transient_models import GRIFFIN_EXACT, load_of, structure_of, stuck_motion, wedge

from stickslip.arrays import FloatArray
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.stability.found import Floquet, floquet
from stickslip.response.time import shooting
from stickslip.response.time.shooting import MOST_CORRECTIONS, RESERVE, PeriodMap, ShootingResult, period_map, shoot
from stickslip.response.time.start import TransientStart, rest
from stickslip.response.time.stepping.marcher import prepared
from stickslip.response.time.transient import TimeStepping, integrate

GRIFFIN_GAP = np.array([[1.0], [0.0], [0.0]])
GRIFFIN_LAW = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=0.0, mu=0.5, preload=0.2)


def griffin_arguments(omega: float) -> tuple:
    structure = structure_of(np.eye(1), 0.02 * np.eye(1), np.eye(1))
    return structure, GRIFFIN_GAP, [GRIFFIN_LAW], load_of(1, {1: [0.1]}), omega, np.array([0])


def wedge_arguments(hertz: float) -> tuple:
    structure, gap, laws, load = wedge()
    return structure, gap, laws, load, 2 * np.pi * hertz, np.array([3, 1])


def rattler(seed: int) -> tuple[PeriodMap, FloatArray]:
    """Three masses in space on springs, two contacts between them that stick, slip both ways and lift off."""
    random = np.random.default_rng(seed)
    stiffness = random.normal(size=(9, 9))
    structure = structure_of(
        np.diag(random.uniform(0.5, 2.0, 9)), 0.1 * np.eye(9), stiffness @ stiffness.T + 4.0 * np.eye(9)
    )
    gap = np.zeros((6, 9))
    gap[np.arange(6), np.arange(6)] = 1.0
    gap[np.arange(6), np.arange(3, 9)] = -1.0
    laws = [
        ElasticCoulomb(k_t=5.0, k_w=4.0, k_n=8.0, mu=0.5, preload=0.3),
        ElasticCoulomb(k_t=3.0, k_w=0.0, k_n=6.0, mu=0.3, preload=-0.1),
    ]
    load = load_of(9, {1: list(2 * random.normal(size=9)), 3: list(1j * random.normal(size=9))})
    mapping, state = period_map(prepared(structure, gap, laws, load, 1.7, 256), rest(9, laws))
    for _ in range(3):
        state = mapping.image(state).state
    # a slider that slips is at a kink: the force of its spring can fall, and it cannot rise
    m = mapping.n_motion
    gap = mapping.start_of(state).seen[0].reshape(-1, 3)[:, :2].ravel()
    state[m:] += 0.01 * (mapping.scale[m:] * gap - state[m:])
    return mapping, state


def states(mapping: PeriodMap, state: FloatArray) -> set[str]:
    """Return which contact states a period goes through."""
    force = mapping.image(state).record.force
    limit = -np.array([0.5, 0.3]) * force[:, :, 2]
    slips = np.abs(np.abs(force[:, :, :2]) - limit[:, :, None]) <= 1e-12 * np.max(limit)
    opened = limit == 0.0
    seen = {"open"} if np.any(opened) else set()
    seen |= {"slip +"} if np.any(slips & ~opened[:, :, None] & (force[:, :, :2] > 0.0)) else set()
    seen |= {"slip -"} if np.any(slips & ~opened[:, :, None] & (force[:, :, :2] < 0.0)) else set()
    landed = np.any(opened[:-1] & ~opened[1:])
    return seen | ({"landing"} if landed else set()) | ({"stick"} if np.any(~slips[:, 0]) else set())


@pytest.mark.parametrize("seed", range(4))
def test_monodromy_is_the_derivative_of_the_period_map(seed: int) -> None:
    mapping, state = rattler(seed)
    assert states(mapping, state) >= {"open", "slip +", "slip -", "landing", "stick"}
    derivative = mapping.derivative(state)
    np.testing.assert_array_equal(derivative.image.state, mapping.image(state).state)
    # Between switches the map is smooth but for landings, hence a difference of second order; a step whose contact state
    # changes within the difference adds a share of it, so that the best of three lengths is taken for each column.
    best = np.full(mapping.size, np.inf)
    for step in (1e-5, 1e-6, 1e-7):
        for j, unit in enumerate(np.eye(mapping.size)):
            ends = [mapping.image(state + s * step * unit).state for s in (1, -1)]
            error = np.linalg.norm((ends[0] - ends[1]) / (2 * step) - derivative.monodromy[:, j])
            best[j] = min(best[j], error)
    assert np.max(best) < 1e-6 * np.linalg.norm(derivative.monodromy)


def linear_multipliers(structure: Structure, stiffness: FloatArray, omega: float) -> np.ndarray:
    n = structure.n
    inverse = np.linalg.inv(structure.mass)
    first_order = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ structure.damping]])
    return np.exp(np.linalg.eigvals(first_order) * 2 * np.pi / omega)


def nearest(values: np.ndarray, others: np.ndarray) -> float:
    """Largest distance of a value to its partner in the best pairing of two sets."""
    distance = np.abs(values[:, None] - others)
    rows, columns = scipy.optimize.linear_sum_assignment(distance)
    return float(np.max(distance[rows, columns]))


def test_where_all_stick_the_orbit_and_the_multipliers_are_those_of_the_linear_structure() -> None:
    structure, gap, laws, load, omega, outputs = wedge_arguments(150.0)
    motion, start = stuck_motion(structure, gap, laws, load, omega)
    off = TransientStart(start.displacement * 1.05, 0.9 * start.velocity, start.states)
    stepping = TimeStepping(steps_per_period=64, tolerance=1e-9)
    result = shoot(structure, gap, laws, load, omega, outputs, off, stepping)
    assert result.status == "converged"
    # the amplitude does not depend on which residual tractions the nearest orbit has
    np.testing.assert_allclose(result.harmonics[1], motion[1, outputs], rtol=1e-9)
    springs = np.array([[law.k_t, law.k_w, law.k_n] for law in laws]).reshape(-1, 1)
    exact = linear_multipliers(structure, structure.stiffness + gap.T @ (springs * gap), omega)
    # two tangential springs have a stiffness: two residual tractions, each a multiplier of 1
    assert result.floquet.neutral == 2
    assert result.floquet.ringing == 0
    assert nearest(result.floquet.multipliers, np.concatenate([exact, [1.0, 1.0]])) < 1e-8
    assert result.stable
    assert result.floquet.growth == pytest.approx(np.max(np.abs(exact)), abs=1e-9)


def test_where_all_are_open_the_tractions_are_forgotten_at_once() -> None:
    structure, _, _, _ = wedge()
    grounded = structure_of(structure.mass, structure.damping + 5.0 * np.eye(6), structure.stiffness + 1e5 * np.eye(6))
    _, gap, _, load = wedge()
    far = [ElasticCoulomb(k_t=3e5, k_w=2e5, k_n=3e5, mu=0.5, preload=-1e6)] * 2
    exact = linear_multipliers(grounded, grounded.stiffness, 900.0)
    dynamic = grounded.stiffness - 900.0**2 * grounded.mass + 900.0j * grounded.damping
    response = np.linalg.solve(dynamic, load.harmonics[1])
    errors = []
    for steps in (512, 1024):
        stepping = TimeStepping(steps, tolerance=1e-9)
        result = shoot(grounded, gap, far, load, 900.0, np.arange(6), None, stepping)
        assert result.converged
        forgotten = np.abs(result.floquet.multipliers[-4:])
        np.testing.assert_allclose(forgotten, 0.0, atol=1e-14)
        errors.append(
            [
                nearest(result.floquet.multipliers[:-4], exact),
                np.max(np.abs(result.harmonics[1] - response)) / np.max(np.abs(response)),
            ]
        )
        # The step holds the departure from the stuck springs, here minus all of their force, as linear. The line differs
        # from the curved force by r'' h²/12 on average: a mass k h²/12 too little, and what is left is of fourth order.
        springs, step = np.tile([3e5, 2e5, 3e5], 2)[:, None], 2 * np.pi / 900.0 / steps
        lighter = grounded.mass - gap.T @ (springs * gap) * step**2 / 12
        light = linear_multipliers(replace(grounded, mass=lighter), grounded.stiffness, 900.0)
        assert nearest(result.floquet.multipliers[:-4], light) < 2e-8 * (512 / steps) ** 4
    np.testing.assert_allclose(np.divide(*errors), 4.0, rtol=0.02)


def test_an_unstable_motion_is_found_and_said_to_be_unstable() -> None:
    # Negative damping: integration leaves the motion, which exists all the same.
    structure = structure_of(np.eye(1), -0.2 * np.eye(1), np.eye(1))
    load, omega = load_of(1, {1: [1.0]}), 1.3
    result = shoot(structure, np.zeros((0, 1)), [], load, omega, np.array([0]))
    assert result.converged
    assert not result.stable
    exact = linear_multipliers(structure, structure.stiffness, omega)
    assert nearest(result.floquet.multipliers, exact) < 1e-9
    assert result.harmonics[1, 0] == pytest.approx(1.0 / (1.0 - omega**2 - 0.2j * omega), rel=1e-9)


@pytest.mark.parametrize("omega", GRIFFIN_EXACT)
def test_friction_damped_oscillator_against_exact_event_driven_values(omega: float) -> None:
    stepping = TimeStepping(steps_per_period=2048, tolerance=1e-9)
    result = shoot(*griffin_arguments(omega), stepping=stepping)
    assert result.stable
    # as for `integrate`: up to 2.3e-6 of the step
    assert abs(result.harmonics[1, 0]) == pytest.approx(GRIFFIN_EXACT[omega], rel=5e-6)
    # the spring slips both ways and forgets
    assert abs(result.floquet.multipliers[-1]) < 1e-12
    assert result.floquet.neutral == 0
    assert result.contact_failures == 0


def test_a_force_that_jumps_within_a_step_leaves_the_error_of_the_multipliers_unknown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    arguments = griffin_arguments(next(iter(GRIFFIN_EXACT)))
    assert shoot(*arguments).growth_error == 0.0
    monkeypatch.setattr(shooting, "_jumps", lambda _: True)
    assert shoot(*arguments).growth_error == np.inf


def plain_march(result: ShootingResult, arguments: tuple, start: TransientStart, periods: int):
    stepping = TimeStepping(len(result.outputs), max_periods=periods, tolerance=1e-14)
    return integrate(*arguments, start, stepping)


@pytest.mark.parametrize("omega", GRIFFIN_EXACT)
def test_a_small_disturbance_decays_as_the_multipliers_say(omega: float) -> None:
    # Three states, of which slip deletes one: the disturbance then obeys the recurrence of the other two multipliers.
    arguments = griffin_arguments(omega)
    result = shoot(*arguments, stepping=TimeStepping(512, tolerance=1e-9))
    first, second, *_ = result.floquet.multipliers
    start = TransientStart(result.final.displacement + 1e-6, result.final.velocity - 2e-6, result.final.states)
    left = [
        plain_march(result, arguments, start, periods).final.displacement[0] - result.final.displacement[0]
        for periods in (2, 3, 4, 5, 6)
    ]
    for x0, x1, x2 in zip(left, left[1:], left[2:], strict=False):
        predicted = (first + second).real * x1 - (first * second).real * x0
        # 1e-6 of disturbance moves switches by about that, and a slope that changes within a step by 1/512
        assert x2 == pytest.approx(predicted, abs=1e-3 * np.max(np.abs(left)))
    assert np.max(np.abs(left)) > 1e-8


def test_it_is_the_motion_that_integration_settles_to_in_far_fewer_periods() -> None:
    # At 163 Hz both contacts slip both ways: the periodic motion is unique.
    arguments = wedge_arguments(163.0)
    settled = integrate(*arguments, stepping=TimeStepping(256, tolerance=1e-8))
    result = shoot(*arguments, stepping=TimeStepping(256, tolerance=1e-9))
    assert settled.settled
    assert result.stable
    assert result.floquet.neutral == 0
    size = np.max(np.abs(result.harmonics[1]))
    np.testing.assert_allclose(
        settled.harmonics, result.harmonics, rtol=0, atol=1e-8 * size
    )  # the tolerance of the integration
    np.testing.assert_allclose(settled.contact_force, result.contact_force, rtol=0, atol=1e-6 * 120.0)
    assert result.periods < settled.periods / 10
    # what is left of the transient decays with the largest multiplier
    assert settled.remaining < 1e-8


@pytest.mark.parametrize("hertz", [150.0, 160.0, 170.0])
def test_a_motion_with_residual_tractions_is_one_that_integration_keeps(hertz: float) -> None:
    arguments = wedge_arguments(hertz)
    result = shoot(*arguments, stepping=TimeStepping(256, tolerance=1e-9))
    kept = integrate(*arguments, result.final, TimeStepping(256, max_periods=10, tolerance=1e-14))
    assert result.stable
    assert result.floquet.neutral >= 1
    size = np.max(np.abs(result.harmonics[1]))
    np.testing.assert_allclose(kept.harmonics, result.harmonics, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(kept.final.states, result.final.states, atol=1e-7)


def test_of_a_family_the_member_at_the_start_is_kept() -> None:
    structure, gap, laws, load, omega, outputs = wedge_arguments(150.0)
    _, start = stuck_motion(structure, gap, laws, load, omega)
    result = shoot(structure, gap, laws, load, omega, outputs, start)
    assert result.corrections == 1
    np.testing.assert_allclose(result.final.states, start.states, rtol=0, atol=1e-18)


@pytest.mark.parametrize("most", [60, 1000])
def test_a_steady_slide_has_no_periodic_motion(most: int) -> None:
    structure = structure_of(np.eye(1), 5.0 * np.eye(1), np.zeros((1, 1)))
    law = ElasticCoulomb(k_t=1e4, k_w=0.0, k_n=0.0, mu=0.5, preload=2.0)
    load = load_of(1, {1: [0.5]}, [3.0])
    stepping = TimeStepping(steps_per_period=64, max_periods=most)
    result = shoot(structure, GRIFFIN_GAP, [law], load, 10.0, np.array([0]), None, stepping)
    assert result.status == "not converged"
    # the periods are used and kept to: the last correction tries five lengths, marches eight periods, one is reported
    assert most - RESERVE <= result.periods < most + 1 + 5 + 8 + 1
    assert not result.stable
    # one period of sliding at (3 - 1)/5
    assert result.residual > 1e-3


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_what_is_left_of_a_period_is_told_relative_to_the_vibration(size: float) -> None:
    structure = structure_of(np.eye(1), 5.0 * np.eye(1), np.zeros((1, 1)))
    law = ElasticCoulomb(k_t=1e4, k_w=0.0, k_n=0.0, mu=0.5, preload=2.0 * size)
    load = load_of(1, {1: [0.5 * size]}, [3.0 * size])
    stepping = TimeStepping(steps_per_period=64, max_periods=60)
    result = shoot(structure, GRIFFIN_GAP, [law], load, 10.0, np.array([0]), None, stepping)
    # it slides along a line, whose mean square is its length over the root of 12, and the slider goes as far in the same measure;
    # the vibration of 4.5 mm on 0.25 m changes this by 2 %
    assert result.residual == pytest.approx(np.sqrt(12.0), rel=0.03)


def test_where_corrections_fail_plain_periods_lead_to_what_integration_settles_to() -> None:
    # Sliding along a wall it presses on, the mass slips and lifts off: from rest forty corrections lead nowhere.
    structure = structure_of(np.diag([1.78465]), np.diag([0.0344092]), np.diag([0.392219]))
    law = ElasticCoulomb(k_t=2.28457, k_w=0.0, k_n=4.51649, mu=0.209297, preload=0.811530)
    gap = np.array([[1.0], [0.0], [-1.0]])
    load = load_of(1, {1: [-0.122024 - 0.0229987j]}, [-0.213991])
    arguments = (structure, gap, [law], load, 0.730239, np.array([0]))
    settled = integrate(*arguments, stepping=TimeStepping(256, tolerance=1e-8))
    result = shoot(*arguments, stepping=TimeStepping(256, tolerance=1e-10))
    assert settled.settled
    assert result.corrections > MOST_CORRECTIONS
    assert result.stable
    size = np.max(np.abs(settled.harmonics[1]))
    np.testing.assert_allclose(result.harmonics, settled.harmonics, rtol=0, atol=1e-7 * size)
    # it counts as settled while 1e-8 is left to come; a search that is patient is no longer than that
    assert result.periods < settled.periods


@pytest.mark.parametrize("place", [0.0, 0.4])
def test_a_spring_without_friction_holds_nothing_whether_its_gap_moves_or_not(place: float) -> None:
    # Its force is zero: two multipliers of the structure alone, and none of 1 for a traction that would be kept.
    structure = structure_of(np.eye(1), 0.1 * np.eye(1), np.eye(1))
    law = ElasticCoulomb(k_t=2.0, k_w=1.0, k_n=3.0, mu=0.0, preload=0.5)
    gap = np.array([[place], [0.0], [0.0]])
    arguments = (structure, gap, [law], load_of(1, {1: [0.3]}), 1.2, np.array([0]))
    result = shoot(*arguments, stepping=TimeStepping(1024, tolerance=1e-10))
    assert (result.floquet.neutral, result.stable) == (0, True)
    free = linear_multipliers(structure, structure.stiffness, 1.2)
    # 1024 steps: the spring that slips is a mass k h²/12 too little, 1e-6 of the structure's
    assert nearest(result.floquet.multipliers, np.concatenate([free, [0.0, 0.0]])) < 2e-5


def test_a_motion_that_overflows_is_reported_and_gives_no_number() -> None:
    structure = structure_of(np.eye(1), -400.0 * np.eye(1), np.eye(1))
    with np.errstate(all="raise"):
        result = shoot(structure, np.zeros((0, 1)), [], load_of(1, {1: [1.0]}), 1.0, np.array([0]))
    assert result.status == "diverged"
    assert not result.stable
    for array in (result.harmonics, result.final.displacement, result.floquet.multipliers):
        assert np.all(np.isnan(array))


def test_nothing_excited_stays_at_rest() -> None:
    arguments = griffin_arguments(1.0)
    silent = HarmonicLoad(np.zeros(1))
    result = shoot(*arguments[:3], silent, 1.0, np.array([0]))
    assert result.converged
    np.testing.assert_array_equal(result.harmonics, 0.0)


def test_multipliers_are_sorted_and_judged() -> None:
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    judged = floquet(scipy.linalg.block_diag(0.5, 1.0, turn, 0.0))
    np.testing.assert_allclose(np.abs(judged.multipliers), [1.0, 1.0, 1.0, 0.5, 0.0], atol=1e-14)
    assert (judged.neutral, judged.ringing, judged.stable) == (1, 2, True)
    assert Floquet(np.array([1.0 + 0j])).growth == 0.0
    assert not floquet(np.diag([1.0, -1.01])).stable
    assert not floquet(np.full((2, 2), np.nan)).stable


def test_unusable_arguments_are_refused_by_name() -> None:
    arguments = griffin_arguments(1.0)
    with pytest.raises(InputError, match=r"outputs: got \[2\] for 1 dofs"):
        shoot(*arguments[:5], np.array([2]))
    massless = structure_of(np.zeros((1, 1)), np.eye(1), np.eye(1))
    with pytest.raises(InputError, match=r"Structure\.mass: is not positive definite"):
        shoot(massless, *arguments[1:])
