"""Motions with two frequencies against judges of their own: a march with friction sliders by hand, and SciPy's integrator."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stickslip as ss
from stickslip.errors import InputError
from stickslip.harmonic.judging import judging_indices
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.two_frequency import closed_path, half_plane, torus_basis
from stickslip.model.matrices import lumped
from stickslip.response.quasi_periodic import in_time
from stickslip.response.quasi_periodic.in_time import course, statistics
from stickslip.response.quasi_periodic.problem import TorusMotion, TwoTones, envelope, off_by, two_tones, with_enough
from stickslip.response.quasi_periodic.tone import (
    beginnings,
    distinct,
    forced_motion,
    over_amplitude,
    second_tone,
    solve_free,
    swept,
    tones_of_multipliers,
)
from stickslip.response.stability import stability
from stickslip.response.time.start import rest, start_from_harmonics
from stickslip.response.time.stepping.marcher import step_work
from stickslip.solve.krylov import Krylov

MASS = np.eye(2)
STIFFNESS = np.array([[3e4, -1e4], [-1e4, 4e4]])
DAMPING = 1e-4 * STIFFNESS + 4.0 * np.eye(2)
SPRING, LIMIT = 1e4, 5.0
BOTH = np.array([0, 1])
NONE = ss.HarmonicLoad(np.zeros(2))


def rubbing_pair(damping: np.ndarray) -> ss.System:
    """Two masses with a friction spring between them."""
    structure = replace(lumped(MASS, STIFFNESS), damping=damping)
    operator = np.zeros((3, 2))
    operator[0] = 1.0, -1.0
    law = ss.Jenkins(k_t=SPRING, limit=LIMIT)
    return ss.System(structure, ss.Interface(("joint",), (law,), operator), BOTH)


def tone(*newton: float) -> ss.HarmonicLoad:
    return ss.HarmonicLoad(np.zeros(2), {1: np.array(newton, dtype=complex)})


def by_hand(damping: np.ndarray, tones: list, seconds: float, step: float):
    """March the pair from rest by Runge-Kutta steps with a slider that is dragged along: shares no code with the package."""
    steps = round(seconds / step)
    q, v, slider = np.zeros(2), np.zeros(2), 0.0
    out = np.zeros((steps + 1, 2))

    def acceleration(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        friction = min(max(SPRING * (q[0] - q[1] - slider), -LIMIT), LIMIT)
        force = np.array([-friction, friction])
        for omega, amplitude in tones:
            force = force + np.cos(omega * t) * np.asarray(amplitude)
        return force - damping @ v - STIFFNESS @ q

    for i in range(steps):
        t = i * step
        a1 = acceleration(t, q, v)
        a2 = acceleration(t + step / 2, q + step / 2 * v, v + step / 2 * a1)
        a3 = acceleration(t + step / 2, q + step / 2 * (v + step / 2 * a1), v + step / 2 * a2)
        a4 = acceleration(t + step, q + step * (v + step / 2 * a2), v + step * a3)
        q = q + step * v + step**2 / 6 * (a1 + a2 + a3)
        v = v + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        stretch = SPRING * (q[0] - q[1] - slider)
        if abs(stretch) > LIMIT:
            slider = q[0] - q[1] - np.sign(stretch) * LIMIT / SPRING
        out[i + 1] = q
    return step * np.arange(steps + 1), out


def off(found: np.ndarray, judge: np.ndarray) -> float:
    return float(np.linalg.norm(found - judge) / np.linalg.norm(judge - judge.mean(axis=0)))


def change_of(one: TorusMotion, other: TorusMotion, dofs: np.ndarray) -> float:
    """Return the root mean square of the difference of two motions at the outputs, relative to the second."""
    every = dict.fromkeys((*one.indices[1:], *other.indices[1:]))
    none = np.zeros(len(dofs), dtype=complex)
    rows = [dict(zip(m.indices, m.coefficients[:, dofs], strict=True)) for m in (one, other)]
    apart = [rows[0].get(i, none) - rows[1].get(i, none) for i in every]
    size = float(np.linalg.norm(other.coefficients[1:, dofs]))
    return float(np.linalg.norm(apart)) / size if size > 0.0 else np.inf


def with_all(problem: TwoTones, motion: TorusMotion, tolerance: float) -> TorusMotion:
    def solve(wider, start, path):
        return wider.solve(motion.omegas, start, path)

    return with_enough(problem, motion, 15, tolerance, solve)[1]


def test_indices_are_half_of_the_plane() -> None:
    indices = half_plane(3)
    assert indices[0] == (0, 0)
    every = {(j, k) for j in range(-3, 4) for k in range(-3, 4) if 0 < abs(j) + abs(k) <= 3}
    assert {*indices[1:], *((-j, -k) for j, k in indices[1:])} == every
    assert 2 * len(indices[1:]) == len(every)
    with pytest.raises(InputError, match="harmonics"):
        half_plane(0)


@pytest.mark.parametrize("ratio", [np.sqrt(2.0), 1.5, 0.0837, 7.3, 1.0213])
def test_functions_are_orthogonal_on_a_closed_path(ratio: float) -> None:
    indices = half_plane(5)
    path = closed_path(ratio, 5)
    assert path.slip(ratio) < 0.01
    product = sum(torus_basis(path, indices, w).T @ torus_basis(path, indices, w) for w in range(path.ways))
    size = path.ways * path.samples / 2
    wanted = np.diag([2.0, *np.ones(2 * len(indices) - 2)])
    assert np.abs(product / size - wanted).max() < 1e-10


@pytest.mark.parametrize("ratio", [1.0003, 1.5003])
def test_a_slow_beat_is_one_characteristic(ratio: float) -> None:
    """A slider that sticks in a part of the beat keeps what it was left with in another: with ways of their own its mean was 9 % off."""
    path = closed_path(ratio, 15)
    assert path.ways == 1
    assert path.slip(ratio) < 0.03
    assert closed_path(1.5, 15).ways > 1  # time itself comes back there
    structure = lumped(np.eye(1), np.array([[1e4]]), np.array([[6.0]]))
    operator = np.zeros((3, 1))
    operator[0] = 1.0
    system = ss.System(structure, ss.Interface(("joint",), (ss.Jenkins(k_t=SPRING, limit=LIMIT),), operator), BOTH[:1])
    loads = [ss.HarmonicLoad(np.array([s]), {1: np.array([f + 0j])}) for s, f in ((3.0, 6.0), (0.0, 5.5))]
    if ratio < 1.1:
        motion = two_tones(system, *loads, 5).solve((110.0, 110.0 * ratio))
        # in time the mean is that of the spring alone: slip in the strong part of the beat takes the traction away
        assert motion.coefficients[0, 0].real == pytest.approx(3e-4, rel=0.03)


@pytest.mark.parametrize("ratio", [1.5, 4 / 3, np.sqrt(2.0)])
def test_a_cubic_spring_has_the_harmonics_of_the_closed_form(ratio: float) -> None:
    """κ (a cos θ1 + b cos θ2)³, on any number of characteristics, and with a share of the contact's area."""
    cubic, share, a, b = 2e8, 0.7, 2e-3, 3e-3
    operator = np.zeros((3, 1))
    operator[0] = 1.0
    interface = ss.Interface(("joint",), (ss.CubicSpring(cubic_t=cubic),), operator, np.array([share]))
    system = ss.System(lumped(np.eye(1), np.array([[1e4]]), np.array([[6.0]])), interface, BOTH[:1])
    load = ss.HarmonicLoad(np.zeros(1), {1: np.array([1.0 + 0j])})
    balance = two_tones(system, load, load, 1).balance
    more = ((0, 0), (3, 0), (2, 1), (-1, 2), (0, 3))
    path = closed_path(ratio, 3)
    assert (path.ways > 1) == (ratio in (1.5, 4 / 3))
    motion = np.array([[0.0], [a], [b]], dtype=complex)
    found = balance.forces(balance.unknowns(motion), (100.0, 100.0 * ratio), path, more)
    k = share * cubic
    # rows: static, cosine and sine of each
    own = [0.75 * a**3 + 1.5 * a * b**2, 0.75 * b**3 + 1.5 * a**2 * b]
    far = [a**3 / 4, 0.75 * a**2 * b, 0.75 * a * b**2, b**3 / 4]
    size = k * (a + b) ** 3
    np.testing.assert_allclose(found.coefficients[:, 0], k * np.array([0, own[0], 0, own[1], 0]), atol=1e-12 * size)
    cosines = found.beyond[1::2, 0]
    np.testing.assert_allclose(cosines, k * np.array(far), atol=1e-12 * size)
    assert np.abs(found.beyond[[0, 2, 4, 6, 8], 0]).max() < 1e-12 * size
    # derivatives: 3 κ x² against the basis
    by_first, by_second = 2.25 * a**2 + 1.5 * b**2, 2.25 * b**2 + 1.5 * a**2
    sines = 0.75 * a**2 + 1.5 * b**2, 0.75 * b**2 + 1.5 * a**2
    mean = 1.5 * (a**2 + b**2)
    block = np.diag([mean, by_first, sines[0], by_second, sines[1]])
    block[1, 3] = block[3, 1] = 3 * a * b
    np.testing.assert_allclose(found.blocks[0, 0], k * block, atol=1e-12 * k * (a + b) ** 2)
    assert found.unsettled == 0
    assert not found.rates


def test_two_loads_are_what_a_march_by_hand_comes_to() -> None:
    omegas = 140.0, 140.0 * 0.93 * np.sqrt(2.0)
    problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), tone(0.0, 8.0), 3)
    motion = problem.solve(omegas)
    assert motion.converged
    assert motion.unsettled == 0
    better = with_all(problem, motion, 0.01)
    assert better.left_out < 0.01
    times, judge = by_hand(DAMPING, [(omegas[0], (10.0, 0.0)), (omegas[1], (0.0, 8.0))], 2.5, 3e-4)
    late = times > 1.8
    few, more = (off(m.at_times(BOTH, times[late]), judge[late]) for m in (motion, better))
    assert more < 0.5 * few
    # a Newton step with more combined frequencies tells how far off the few are
    wider = tuple(i for i in half_plane(11) if i not in motion.indices)
    told = off_by(problem, motion, closed_path(omegas[1] / omegas[0], 11, 0.5), wider)
    assert 0.5 * few < told < 2.0 * few
    assert more < 0.01


def test_derivatives_are_those_of_the_residual() -> None:
    omegas = 140.0, 180.0
    operator = np.zeros((6, 2))
    operator[0], operator[3] = (1.0, -1.0), (0.0, 1.0)
    laws = (ss.CubicSpring(k_t=1e3, cubic_t=1e10), ss.RegularisedCoulomb(mu=0.3, preload=10.0, transition_velocity=0.1))
    structure = replace(lumped(MASS, STIFFNESS), damping=DAMPING)
    system = ss.System(structure, ss.Interface(("cubic", "rub"), laws, operator), BOTH)
    problem = two_tones(system, tone(10.0, 0.0), tone(0.0, 8.0), 3)
    x, path = problem.solve(omegas).x, problem.path(omegas[1] / omegas[0])
    rng = np.random.default_rng(3)
    step = 1e-5 * rng.normal(size=x.size) * np.abs(x).max()

    def residual(x: np.ndarray, first: float, second: float) -> np.ndarray:
        return problem.balance.linearise(x, (first, second), path).residual

    at = problem.balance.linearise(x, omegas, path)
    for found, ends in (
        (at.jac @ step, [residual(x + s * step, *omegas) for s in (1, -1)]),
        (1e-2 * at.by_first, [residual(x, omegas[0] + s * 1e-2, omegas[1]) for s in (1, -1)]),
        (1e-2 * at.by_second, [residual(x, omegas[0], omegas[1] + s * 1e-2) for s in (1, -1)]),
    ):
        assert found == pytest.approx((ends[0] - ends[1]) / 2, abs=1e-5 * np.abs(found).max())


def three_in_a_row() -> ss.System:
    """Three masses; a friction spring holds the first to the ground, and the others are condensed."""
    stiffness = np.array([[3e4, -1e4, 0.0], [-1e4, 4e4, -2e4], [0.0, -2e4, 2.5e4]])
    structure = replace(lumped(np.diag([1.0, 2.0, 0.5]), stiffness), damping=1e-4 * stiffness + 2.0 * np.eye(3))
    operator = np.zeros((3, 3))
    operator[0, 0] = 1.0
    law = ss.Jenkins(k_t=SPRING, limit=1e9)  # it never slips
    return ss.System(structure, ss.Interface(("joint",), (law,), operator), np.arange(3))


def test_loads_on_condensed_coordinates_act_at_their_own_frequencies() -> None:
    """Without slip each frequency has the answer of the linear structure, its contact stuck; the derivatives are those of the loads."""
    system, omegas = three_in_a_row(), (140.0, 185.0)
    forces = np.array([[0.0, 0.0, 10.0], [0.0, 6.0j, 0.0], [0.0, 0.0, 0.0], [4.0, 0.0, 3.0]])
    static = np.array([0.0, 2.0, 0.0])
    first = ss.HarmonicLoad(static, {1: forces[0], 2: forces[1]})
    second = ss.HarmonicLoad(np.zeros(3), {1: forces[3]})
    problem = two_tones(system, first, second, 2)
    assert problem.balance.side.n == 1
    motion = problem.solve(omegas)
    assert motion.converged
    structure = system.structure
    held = structure.stiffness + np.diag([SPRING, 0.0, 0.0])
    mass, damping = np.diag([1.0, 2.0, 0.5]), structure.damping
    for index, force in (
        ((0, 0), static),
        ((1, 0), forces[0]),
        ((2, 0), forces[1]),
        ((0, 1), forces[3]),
        ((0, 2), 0 * static),
        ((1, 1), 0 * static),
    ):
        omega = index[0] * omegas[0] + index[1] * omegas[1]
        exact = np.linalg.solve(held - omega**2 * mass + 1j * omega * damping, force)
        own = motion.coefficients[motion.indices.index(index)]
        assert own == pytest.approx(exact, abs=1e-9 * np.abs(motion.coefficients).max())
    side, indices, step = problem.balance.side, problem.balance.indices, 1e-3
    _, by_first, by_second = side.load(indices, omegas)
    for found, ends in (
        (by_first, [side.load(indices, (omegas[0] + s, omegas[1]))[0] for s in (step, -step)]),
        (by_second, [side.load(indices, (omegas[0], omegas[1] + s))[0] for s in (step, -step)]),
    ):
        assert np.abs(found).max() > 0.0
        assert found == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6 * np.abs(found).max())


def test_how_far_off_few_frequencies_are_is_a_newton_step_with_more() -> None:
    """With a second load both frequencies are given; a tone that nothing drives has its own among the unknowns, and its phase stays."""
    omegas = 140.0, 180.0
    path = closed_path(omegas[1] / omegas[0], 4, 0.5)
    more = tuple(i for i in half_plane(4) if i not in half_plane(2))
    for second in (tone(0.0, 8.0), NONE):
        problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), second, 2)
        motion = problem.solve(omegas)
        moved = np.where([k == 1 for _, k in motion.indices], 1e-4, 0.0)[:, None]
        motion = replace(motion, x=problem.balance.unknowns(problem.balance.coefficients(motion.x) + moved))
        wider = problem.balance.with_indices((*motion.indices, *more))
        x = wider.from_other(problem.balance, motion.x)
        at = wider.linearise(x, omegas, path)
        jac, right, n = np.asarray(at.jac), at.residual, x.size
        if second is NONE:
            own = wider.coefficients(x)
            along = wider.unknowns(np.array([1j * k * row for (_, k), row in zip(wider.indices, own, strict=True)]))
            jac = np.block([[jac, at.by_second[:, None]], [along[None, :], np.zeros((1, 1))]])
            right = np.append(right, 0.0)
        step = wider.coefficients(np.linalg.solve(jac, right)[:n])[1:]
        size = np.linalg.norm(wider.coefficients(x)[1:], axis=0)
        expected = np.max(np.linalg.norm(step, axis=0) / np.maximum(size, 0.01 * size.max()))
        assert off_by(problem, motion, path, more) == pytest.approx(expected, rel=1e-8)


def test_the_jacobian_by_its_parts_is_the_array() -> None:
    """Two masses have few coordinates: the parts are asked for, and they and their borders lead to the same motions."""
    omegas = 140.0, 180.0
    problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), tone(0.0, 8.0), 3)
    x, path = problem.solve(omegas).x, problem.path(omegas[1] / omegas[0])
    forms = [replace(problem.balance, jacobian=form) for form in ("dense", "structured")]
    whole, parts = (form.linearise(x, omegas, path).jac for form in forms)
    assert isinstance(parts, StructuredJacobian)
    v = np.random.default_rng(5).normal(size=x.size)
    size = np.abs(whole).max()
    assert parts.matvec(v) == pytest.approx(whole @ v, abs=1e-13 * size)
    assert parts.rmatvec(v) == pytest.approx(v @ whole, abs=1e-13 * size)
    krylov = Krylov(tolerance=1e-10)
    found = krylov.solve(parts, v)
    assert found == pytest.approx(np.linalg.solve(whole, v), rel=1e-7, abs=1e-8 * np.abs(found).max())
    assert krylov.counts.products < 40


def test_a_second_tone_by_parts_is_that_with_arrays() -> None:
    stuck = STIFFNESS + SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    squares, shapes = np.linalg.eigh(stuck)
    fed = shapes @ np.diag([3.0, -2.0]) @ shapes.T
    problem = two_tones(rubbing_pair(fed), tone(6.0, 0.0), NONE, 3)
    motions = []
    for form in ("dense", "structured"):
        own = replace(problem, balance=replace(problem.balance, jacobian=form))
        begin = beginnings(own, forced_motion(own, 135.0), [float(np.sqrt(squares[1]))])[0]
        motion = second_tone(begin)
        assert motion is not None
        told = off_by(own, motion, closed_path(motion.omegas[1] / 135.0, 5), half_plane(5)[12:])
        motions.append((motion.omegas[1], told, np.abs(motion.coefficients)))
    for one, other in zip(*motions, strict=True):
        assert one == pytest.approx(other, rel=1e-3, abs=1e-6 * np.max(other))
    assert motions[0][0] == pytest.approx(motions[1][0], rel=1e-8)


@pytest.mark.parametrize("most", [1, 3])
def test_what_lies_beyond_the_most_harmonics_is_left_out_too(most: int) -> None:
    """A run that may take no more than it has must not say that nothing is left out."""
    omegas = 140.0, 1.3152 * 140.0
    problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), tone(0.0, 8.0), most)

    def solve(wider, start, path):
        return wider.solve(omegas, start, path)

    few = with_enough(problem, problem.solve(omegas), most, 0.01, solve)[1]
    more = with_enough(problem, problem.solve(omegas), 9, 0.002, solve)[1]
    assert {abs(j) + abs(k) for j, k in few.indices} == set(range(most + 1))
    missing = change_of(few, more, BOTH)
    assert missing > 0.004
    assert 0.4 * missing < few.left_out < 4.0 * missing


def test_frequencies_in_a_ratio_of_small_numbers_are_no_exception() -> None:
    """At 3 to 2 the motion is periodic for each phase between the loads, and the balance is that of all of them."""
    problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), tone(0.0, 8.0), 3)
    exact, near = (problem.solve((130.0, 130.0 * r)) for r in (1.5, 1.5 + 1e-9))
    assert exact.slip == 0.0
    assert exact.coefficients == pytest.approx(near.coefficients, abs=1e-4 * np.abs(exact.coefficients).max())
    one = ss.HarmonicLoad(np.zeros(2), {2: np.array([10.0, 0.0j]), 3: np.array([0.0j, 8.0])})
    sweep = ss.Sweep(omega_range=(65.0, 65.0001), low=21, high=21, selection="always_low", frequencies=2, peak_points=0)
    system = rubbing_pair(DAMPING)
    point = ss.response.accepted_points(list(ss.forced_response(system, one, sweep)))[0]
    times = np.arange(512) * 2 * np.pi / 65.0 / 512
    turns = np.exp(1j * np.outer(65.0 * times, np.arange(22)))
    periodic = (turns @ point.coefficients).real
    better = with_all(problem, exact, 0.005)
    assert off(better.at_times(BOTH, times), periodic) < 0.01


def test_flutter_beside_a_forced_vibration_is_what_a_march_by_hand_comes_to() -> None:
    stuck = STIFFNESS + SPRING * np.array([[1.0, -1.0], [-1.0, 1.0]])
    squares, shapes = np.linalg.eigh(stuck)
    damping = shapes @ np.diag([3.0, -2.0]) @ shapes.T  # the upper mode is fed
    problem = two_tones(rubbing_pair(damping), tone(6.0, 0.0), NONE, 3)
    forced = forced_motion(problem, 135.0)
    begin = beginnings(problem, forced, [float(np.sqrt(squares[1]))])[0]
    first = next(over_amplitude(begin))
    # so small a second tone slips nowhere: it grows as the mode does
    assert first.ratio == pytest.approx(-1.0 / np.sqrt(squares[1]), rel=1e-6)
    motion = second_tone(begin)
    assert motion is not None

    def solve(wider, start, path):
        return solve_free(wider, start, motion.omegas)

    motion = with_enough(problem, motion, 15, 0.01, solve)[1]
    times, judge = by_hand(damping, [(135.0, (6.0, 0.0))], 5.0, 3e-4)
    late = times > 4.0
    seen = np.hanning(late.sum()) @ (judge[late, 1] * np.exp(-1j * motion.omegas[1] * times[late]))
    phase = float(np.angle(seen / motion.coefficients[motion.indices.index((0, 1)), 1]))
    assert off(motion.at_times(BOTH, times[late], phase), judge[late]) < 0.015
    assert motion.omegas[1] < np.sqrt(squares[1])
    # the same from time integration alone: envelope, root mean square, and the second frequency among the lines of the spectrum
    system, load = problem.system, tone(6.0, 0.0)
    start = start_from_harmonics(
        np.zeros((2, 2), dtype=complex), 135.0, system.interface.gap_operator, system.interface.laws
    )
    found = statistics(
        course(system.structure, system.interface, load, 135.0, BOTH, start, steps=128, least=256, most=256)
    )
    assert found.settled
    shown = envelope(motion, BOTH)
    assert found.largest == pytest.approx(shown.largest, rel=0.02)
    assert found.least == pytest.approx(shown.least, rel=0.02)
    assert found.rms == pytest.approx(shown.rms, rel=0.01)
    lines = 2 * np.pi * found.hertz[1, :2]
    assert sorted(lines) == pytest.approx([135.0, motion.omegas[1]], rel=1e-3)


@pytest.mark.validation
def test_modulation_beyond_a_neimark_sacker_point_is_what_scipy_integrates() -> None:
    """A cubic oscillator with an absorber: between two such points its forced motion is unstable."""
    mass, force = np.diag([1.0, 0.05]), 0.15
    stiffness = np.array([[1.0454, -0.0454], [-0.0454, 0.0454]])
    damping = np.array([[0.0148, -0.0128], [-0.0128, 0.0128]])
    operator = np.zeros((6, 2))
    operator[0], operator[3] = (1.0, 0.0), (1.0, -1.0)
    laws = ss.CubicSpring(cubic_t=1.0), ss.CubicSpring(cubic_t=0.0042)
    structure = replace(lumped(mass, stiffness), damping=damping)
    system = ss.System(structure, ss.Interface(("own", "absorber"), laws, operator), BOTH)
    omega = 1.1532
    sweep = ss.Sweep(
        omega_range=(omega, 1.00001 * omega), low=7, high=7, selection="always_low", frequencies=2, peak_points=0
    )
    forced = ss.response.forced_problem(system, tone(force, 0.0), sweep)
    point = ss.response.accepted_points(list(ss.forced_response(system, tone(force, 0.0), sweep)))[0]
    found = stability(forced, point)
    assert found.verdict == "unstable"
    guesses = distinct(tones_of_multipliers(found.floquet.multipliers, point.omega, 3), point.omega)
    problem = two_tones(system, tone(force, 0.0), NONE, 4)
    periodic = forced_motion(problem, point.omega, point.coefficients)
    begin = beginnings(problem, periodic, guesses)[0]
    # below it the forced motion lies on a branch that stuck contacts do not lead to; the branch from below does
    low = 2 * np.pi * 0.1795
    assert not forced_motion(problem, low).converged
    assert forced_motion(problem, low, next(swept(problem, tone(force, 0.0), low))).converged
    angle = np.angle(found.floquet.multipliers[np.argmax(np.abs(found.floquet.multipliers))])
    apart = abs(begin.omegas[1] - point.omega)
    assert apart == pytest.approx(abs(angle) / (2 * np.pi) * point.omega, rel=1e-6)
    motion = second_tone(begin)
    assert motion is not None

    def solve(wider, start, path):
        return solve_free(wider, start, motion.omegas)

    motion = with_enough(problem, motion, 11, 0.01, solve)[1]

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:2], y[2:]
        cubic = 0.0042 * (q[0] - q[1]) ** 3
        push = np.array([force * np.cos(point.omega * t) - q[0] ** 3 - cubic, cubic])
        return np.append(v, (push - damping @ v - stiffness @ q) / np.diag(mass))

    period, turns, last = 2 * np.pi / point.omega, 240, 100
    times = np.arange((turns - last) * 32, turns * 32) * period / 32
    judge = solve_ivp(rates, (0.0, turns * period), np.zeros(4), rtol=1e-6, atol=1e-8, t_eval=times).y[:2].T
    amplitude = 0.5 * np.ptp(judge.reshape(last, 32, 2), axis=1)
    shown = envelope(motion, BOTH)
    assert shown.largest == pytest.approx(amplitude.max(axis=0), rel=0.015)
    assert shown.least == pytest.approx(amplitude.min(axis=0), rel=0.03)
    assert shown.rms == pytest.approx(judge.std(axis=0), rel=0.01)


def test_two_equal_frequencies_are_refused() -> None:
    problem = two_tones(rubbing_pair(DAMPING), tone(10.0, 0.0), tone(0.0, 8.0), 3)
    with pytest.raises(InputError, match="two different ones"):
        problem.solve((140.0, 140.0))


def test_a_load_in_a_high_harmonic_is_judged_by_what_its_own_motion_feeds() -> None:
    """The first load acts in harmonic 3, and odd friction answers in 9: beyond all sums that were looked at by order."""
    omegas = 140.0 / 3.0, 1.3152 * 140.0
    high = ss.HarmonicLoad(np.zeros(2), {3: np.array([30.0, 0.0], dtype=complex)})
    fed = judging_indices([(3, 0), (0, 1)])
    assert {(9, 0), (6, 0), (0, 2), (0, 3), (3, 1), (-3, 1), (6, 1), (-3, 2)} <= set(fed)
    assert len(fed) == len({*fed, *((-j, -k) for j, k in fed)}) // 2

    def solve(wider, start, path):
        return wider.solve(omegas, start, path)

    problem = two_tones(rubbing_pair(DAMPING), high, tone(0.0, 1e-3), 3)
    few = with_enough(problem, problem.solve(omegas), 3, 0.01, solve)[1]
    wide = problem.with_indices((*problem.balance.indices, (9, 0)))
    more = solve(wide, wide.balance.from_other(problem.balance, few.x), None)
    assert more.converged
    missing = change_of(few, more, BOTH)
    assert missing > 0.002
    assert few.left_out > 0.5 * missing


def test_a_march_takes_as_many_periods_on_a_busy_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    system, load = rubbing_pair(np.diag([4.0, -3.0])), tone(6.0, 0.0)
    start = rest(2, system.interface.laws)

    def marched(work: float):
        own = system.structure, system.interface, load, 135.0, BOTH, start
        return course(*own, steps=64, work=work, least=256, most=256)

    of_period = 64 * step_work(2, 3)
    idle = marched(20.5 * of_period)
    assert idle.periods == 21
    clock = iter(range(0, 10**9, 1000))
    monkeypatch.setattr(in_time, "perf_counter", lambda: float(next(clock)))
    busy = marched(20.5 * of_period)
    assert np.array_equal(busy.samples, idle.samples)
    assert busy.seconds >= 1000.0 > idle.seconds
