"""Rigid contacts by the dynamic Lagrangian method: exact derivatives, laws that hold, an answer that knows no penalty."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import table
from newton_bounds import unknowns_bound

from evidence.models.rigid_beams import rubbing_beams
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb, weighted_products
from stickslip.errors import InputError
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dlft import RigidJacobian, dynamic_lagrangian
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import to_complex
from stickslip.model.matrices import lumped
from stickslip.model.structure import Structure
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.krylov import Krylov
from stickslip.solve.newton_method import Newton, newton

TWO_MASSES = lumped(np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([[0.04, -0.02], [-0.02, 0.02]]))


def rubbing(order, samples, penalty=None, law=None, force=20.0, static=0.0, retained=(1,)):
    """Benchmark B5: the second of two masses rubs on the ground."""
    load = HarmonicLoad(np.array([0.0, static]), {1: np.array([force + 0j, 0.0])})
    gap = np.zeros((3, 2))
    gap[0, 1] = 1.0
    law = law or RigidCoulomb(mu=0.9, preload=9.0)
    return dynamic_lagrangian(
        condense(TWO_MASSES, np.array(retained), load), Interface(("c",), (law,), gap), order, samples, penalty
    )


def pressed(order, samples, penalty=None, shake=1.5, law=None, static=(0.3, -2.0)):
    """One mass pressed on a rigid floor: the normal force, and with it the limit, is a reaction."""
    stiffness = np.array([[2.0, 0.3], [0.3, 1.5]])
    structure = Structure(np.eye(2), 0.05 * stiffness, stiffness, table(("x", "z")))
    load = HarmonicLoad(np.array(static), {1: np.array([1.5 + 0j, shake * np.exp(0.7j)])})
    gap = np.zeros((3, 2))
    gap[0, 0], gap[2, 1] = 1.0, 1.0
    interface = Interface(("c",), (law or RigidCoulomb(mu=0.4),), gap)
    return dynamic_lagrangian(condense(structure, np.arange(2), load), interface, order, samples, penalty)


def solution(problem, omega, start=None, iterations=100):
    x = np.zeros(problem.size) if start is None else problem.unknowns(start)
    found = newton(lambda v: problem.linearise(v, omega), x, Newton(max_iterations=iterations))
    assert found.status.converged, found.status
    return problem.coefficients(found.x), found


def answered(problem, omega, start=None):
    """Return the amplitudes, m, and how far Newton's method may have left them from the solution."""
    amplitudes, found = solution(problem, omega, start)
    off = np.sqrt(2.0) * unknowns_bound(found.x, problem.linearise(found.x, omega))
    return amplitudes, off * problem.displacement_scale


def assert_derivatives(problem, x, omega, step=1e-6):
    at = problem.linearise(x, omega)
    jac = at.dense_jac().copy()
    sides = [
        (problem.linearise(x + step * e, omega).residual - problem.linearise(x - step * e, omega).residual) / (2 * step)
        for e in np.eye(problem.size)
    ]
    size = np.abs(jac).max()
    np.testing.assert_allclose(jac, np.array(sides).T, atol=1e-7 * size)
    by_omega = (problem.linearise(x, omega + step).residual - problem.linearise(x, omega - step).residual) / (2 * step)
    np.testing.assert_allclose(at.jac_p, by_omega, atol=1e-7 * max(size, np.abs(at.jac_p).max()))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.sampled_from([0.05, 1.0, 5.0]))
def test_jacobian_in_stick_slip_and_lift_off(seed, size):
    x = size * np.random.default_rng(seed).standard_normal(2 * 7)
    assert_derivatives(pressed(3, 32, 2.0, shake=4.0), x, 0.7)


def by_products(problem):
    return replace(problem, balance=replace(problem.balance, jacobian="structured"))


def mixed(order=3, samples=64):
    """A rigid contact beside one with a stiffness."""
    load = HarmonicLoad(np.zeros(2), {1: np.array([20.0 + 0j, 0.0])})
    gap = np.zeros((6, 2))
    gap[0, 1], gap[3, 0] = 1.0, 1.0
    spring = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=0.0, mu=1.0, preload=2.0)
    laws = (RigidCoulomb(mu=0.9, preload=9.0), spring)
    interface = Interface(("r", "s"), laws, gap)
    return dynamic_lagrangian(condense(TWO_MASSES, np.arange(2), load), interface, order, samples)


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    size=st.sampled_from([1e-4, 0.05, 1.0, 5.0]),
    made=st.sampled_from([lambda: pressed(3, 32, 2.0, shake=4.0), mixed]),
)
def test_products_of_the_jacobian_are_those_of_the_array(seed, size, made):
    problem, rng = made(), np.random.default_rng(seed)
    x, v = rng.standard_normal((2, problem.size)) * [[size], [1.0]]
    at, other = by_products(problem).linearise(x, 0.7), problem.linearise(x, 0.7)
    jac, array = at.jac, other.jac
    assert isinstance(jac, RigidJacobian)
    assert isinstance(array, np.ndarray)
    for found, expected in (
        (at.residual, other.residual),
        (at.jac_p, other.jac_p),
        (jac.dense(), array),
        (at.dense_jac(), array),
        (jac.matvec(v), array @ v),
        (jac.rmatvec(v), v @ array),
        (jac.transposed.matvec(v), v @ array),
    ):
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    if np.linalg.cond(array) < 1e6:
        exact = Krylov(tolerance=1e-13)
        for one, matrix in ((jac, array), (jac.transposed, array.T)):
            expected = np.linalg.solve(matrix, v)
            size = np.abs(expected).max()
            np.testing.assert_allclose(exact.solve(one, v), expected, atol=1e-9 * size)


@pytest.mark.parametrize("made", [mixed, lambda: pressed(7, 64), lambda: rubbing(7, 64)])
def test_newton_by_products_finds_the_same_motion(made):
    problem, krylov = made(), Krylov()
    options = Newton(max_iterations=100, tolerance=1e-12, linear=krylov)
    expected, _ = solution(problem, 1.5)
    for order in (problem.order, problem.order + 2):  # factors are those of each number of harmonics
        own = by_products(problem.with_order(order))
        found = newton(lambda v: own.linearise(v, 1.5), own.unknowns(expected), options)  # noqa: B023
        assert found.status.converged
    start = np.zeros(problem.size)
    own = by_products(problem)
    found = newton(lambda v: own.linearise(v, 1.5), start, options)
    assert found.status.converged
    assert krylov.counts.products > 0
    motion = own.coefficients(found.x)
    np.testing.assert_allclose(motion, expected, atol=1e-9 * np.abs(expected).max())


def test_jacobian_of_a_contact_that_sticks_throughout():
    problem = rubbing(3, 32, law=RigidCoulomb(mu=1.0, preload=1e3))
    x = 0.1 * np.random.default_rng(1).standard_normal(problem.size)
    assert np.all(problem.contacts(x, 1.0).state[0, 0] == 0)
    assert_derivatives(problem, x, 1.0)


def test_products_with_a_weight_are_those_of_the_samples():
    rng = np.random.default_rng(0)
    for samples in (9, 10, 32):  # as few samples as coefficients: the products alias
        weight = rng.standard_normal((2, samples))
        problem = rubbing(4, max(samples, 9))
        basis = np.array(
            [np.ones(samples)]
            + [f(h * 2 * np.pi * np.arange(samples) / samples) for h in range(1, 5) for f in (np.cos, np.sin)]
        ).T
        analysis = basis.T * 2.0 / samples
        analysis[0] /= 2.0
        expected = [analysis @ (w[:, None] * basis) for w in weight]
        np.testing.assert_allclose(weighted_products(weight, problem.order), expected, atol=1e-13)


@pytest.mark.parametrize("case", [lambda p: pressed(7, 15, p), lambda p: rubbing(7, 15, p)])
def test_answer_does_not_depend_on_the_penalty_over_four_decades(case):
    # as many samples as coefficients: the laws hold at the samples to rounding; each penalty starts from rest
    answers = [answered(case(p), 0.7) for p in (0.1, 1.0, 10.0, 100.0, 1000.0)]
    for answer, off in answers[1:]:
        assert np.max(np.abs(answer - answers[0][0])) <= off + answers[0][1]


def test_with_more_samples_the_penalty_matters_less_than_the_missing_harmonics():
    soft, hard = (solution(rubbing(15, 960, p), 1.5)[0][1, 0] for p in (2.0, 8.0))
    finer = solution(rubbing(60, 3840), 1.5)[0][1, 0]
    assert abs(soft - hard) < abs(hard - finer)


def beams(coordinates, preload, order=7, samples=224, penalty=None):
    system, load = rubbing_beams(coordinates, preload)
    linear = system.condensed(load, order, system.outputs)
    return dynamic_lagrangian(linear, system.interface, order, samples, penalty)


@pytest.mark.parametrize("coordinates", ["craig_bampton", "rubin", "relative"])
@pytest.mark.parametrize("preload", [0.2, 2.0])
def test_default_penalty_converges_whatever_the_coordinates(coordinates, preload):
    # a share of the stiffness of a Rubin coordinate is a thousand times as much: with 2 N none of these was found from rest
    problem = beams(coordinates, preload)
    for omega in np.linspace(80.0, 180.0, 8):
        _, found = solution(problem, omega, iterations=60)
        assert found.iterations <= 40


@pytest.mark.parametrize("omega", [80.0, 130.0])
def test_default_penalty_does_not_depend_on_coordinates(omega):
    of_one, of_other = (
        p.penalties(omega).value * p.force_scale / p.displacement_scale
        for p in (beams("craig_bampton", 2.0), beams("rubin", 2.0))
    )
    np.testing.assert_allclose(of_one, of_other, rtol=0.01)  # but for modes left out


def test_default_penalty_changes_smoothly_with_frequency():
    problem = beams("rubin", 2.0)
    for omega in (70.0, 100.0, 127.3):  # 100: the first resonance
        step = 1e-4
        low, high = (problem.penalties(omega + d).value for d in (-step, step))
        at = problem.penalties(omega)
        np.testing.assert_allclose(at.slope, (high - low) / (2.0 * step), rtol=1e-5)
        x = np.random.default_rng(1).standard_normal(problem.size)
        by_omega = (problem.linearise(x, omega + step).residual - problem.linearise(x, omega - step).residual) / (
            2.0 * step
        )
        jac_p = problem.linearise(x, omega).jac_p
        np.testing.assert_allclose(jac_p, by_omega, atol=1e-6 * np.max(np.abs(jac_p)))
    values = np.array([problem.penalties(w).value for w in np.linspace(60.0, 200.0, 4000)])
    assert np.max(np.abs(np.diff(np.log(values), axis=0))) < 0.02


@pytest.mark.kernel
@pytest.mark.parametrize("coordinates", ["craig_bampton", "rubin", "relative"])
def test_penalties_ten_times_apart_give_the_same_answer(coordinates):
    # exactly where there are as many samples as coefficients, else by less than missing harmonics
    omega = 120.0
    problem = beams(coordinates, 0.5, samples=15)
    own = float(np.mean(problem.penalties(omega).value))
    own *= problem.force_scale / problem.displacement_scale
    start, off = answered(problem, omega)
    for factor in (10.0**-0.5, 10.0**0.5):
        other, beside = answered(beams(coordinates, 0.5, 7, 15, factor * own), omega, start)
        assert np.max(np.abs(other - start)) <= off + beside


def test_laws_hold_at_the_samples():
    problem = pressed(7, 15)
    _, found = solution(problem, 0.7)
    at = problem.contacts(found.x, 0.7)
    gap, force, state = at.gap[0], at.force[0], at.state[0, 0]
    assert set(np.unique(state)) == {0, 1}
    assert np.min(gap[2]) > -1e-8
    assert np.max(np.abs(force[2] * gap[2])) < 1e-8
    assert np.all(np.abs(force[0]) <= -0.4 * force[2] + 1e-8)
    h = np.arange(8)
    tau = 2 * np.pi * np.arange(15) / 15
    velocity = np.real(np.exp(1j * np.outer(tau, h)) @ (1j * h * problem.coefficients(found.x)[:, 0]))
    assert np.max(np.abs(velocity[state == 0])) < 1e-8  # sticks where it sticks
    assert np.all(velocity[state == 1] * force[0][state == 1] > 0)  # and is braked where it slips


def test_lift_off_opens_and_carries_nothing():
    problem = pressed(7, 15, 10.0, shake=3.0)
    _, found = solution(problem, 0.7)
    at = problem.contacts(found.x, 0.7)
    is_open = at.state[0, 0] == 2
    assert np.any(is_open)
    assert np.all(at.gap[0, 2][is_open] > 0)
    np.testing.assert_allclose(at.force[0][:, is_open], 0.0, atol=1e-12)


def test_set_valued_friction_of_two_masses():
    # benchmark B5, W = 1.5 (no sticking): first order in 1/H, so H = 15, 30, 60 extrapolate
    values, start = [], None
    for order in (15, 30, 60):
        start, _ = solution(rubbing(order, 128 * order), 1.5, start)
        values.append(abs(start[1, 0]))
    errors = np.abs(np.array(values) / 26.786093 - 1)
    assert errors[0] / errors[2] == pytest.approx(4.0, rel=0.1)
    assert (8 * values[2] - 6 * values[1] + values[0]) / 3 == pytest.approx(26.786093, rel=2e-5)


def test_penalty_law_tends_to_the_rigid_one_as_the_root_of_its_flexibility():
    # after a reversal the spring turns round before it slips: x'' t²/2 = 2 mu N / k, a delay of order k^(-1/2)
    exact = 26.786093
    errors, stiffnesses = [], (16.0, 64.0, 256.0)
    gap = np.zeros((3, 2))
    gap[0, 1] = 1.0
    load = HarmonicLoad(np.zeros(2), {1: np.array([20.0 + 0j, 0.0])})
    linear = condense(TWO_MASSES, np.array([1]), load)
    start, _ = solution(rubbing(31, 2048), 1.5)
    for k in stiffnesses:
        law = RigidCoulomb(mu=0.9, preload=9.0).softened(k)
        q, _ = solution(harmonic_balance(linear, Interface(("c",), (law,), gap), 31, 2048), 1.5, start)
        errors.append(abs(abs(q[1, 0]) / exact - 1))
    slope = -np.polyfit(np.log(stiffnesses), np.log(errors), 1)[0]
    assert errors == sorted(errors, reverse=True)
    assert slope == pytest.approx(0.5, abs=0.15)


def test_a_contact_that_never_slips_stays_where_it_began():
    problem = rubbing(3, 32, law=RigidCoulomb(mu=1.0, preload=1e3), static=5.0)
    q, found = solution(problem, 1.0)
    assert np.max(np.abs(q)) < 1e-10  # at zero displacement, held against the static load
    assert np.mean(problem.contacts(found.x, 1.0).force[0, 0]) == pytest.approx(5.0)


def test_a_static_load_beyond_the_limit_drags_the_contact_to_rest():
    # without vibration at the contact, K = 1/2 seen from mass 2: it stops where spring and friction hold 5 N
    problem = rubbing(3, 32, law=RigidCoulomb(mu=1.0, preload=3.0), force=1e-3, static=5.0)
    q, found = solution(problem, 1.0)
    assert q[0, 0].real == pytest.approx((5.0 - 3.0) / 0.5, rel=1e-2)
    assert np.all(problem.contacts(found.x, 1.0).state[0, 0] == 0)


def test_initial_gap_shifts_the_floor_and_interference_presses():
    away = pressed(1, 16, law=RigidCoulomb(mu=0.0, initial_gap=5.0), shake=0.1)
    q, found = solution(away, 0.7)
    np.testing.assert_allclose(away.contacts(found.x, 0.7).force, 0.0, atol=1e-12)
    fit = pressed(1, 16, law=RigidCoulomb(mu=0.0, initial_gap=-0.2), shake=0.1, static=(0.0, 0.0))
    q, _ = solution(fit, 0.7)
    assert q[0, 1].real == pytest.approx(0.2)
    assert abs(q[1, 1]) < 1e-10


def test_contacts_with_and_without_stiffness_in_one_interface():
    problem = mixed()
    _, found = solution(problem, 1.5)
    at = problem.contacts(found.x, 1.5)
    assert np.max(np.abs(at.force[0, 0])) == pytest.approx(8.1)
    assert np.max(np.abs(at.force[1, 0])) == pytest.approx(2.0)
    assert_derivatives(problem, found.x + 1e-3, 1.5)


def test_forced_response_through_resonance_by_continuation():
    # Beyond 2.1 rad/s the contact sticks throughout, its coordinate is zero and no measure of a step: the other mass is retained too.
    problem = rubbing(5, 160, retained=(0, 1))
    _, found = solution(problem, 0.3)
    following = Following(
        newton=Newton(), control=StepControl(scale=0.2, first=0.05, largest=0.25), weights=np.ones(problem.size)
    )
    start = start_point(problem, found.x, 0.3, following)
    points = list(trace(problem, start, 2.2, following))
    assert all(p.solution.status.converged for p in points)
    assert points[-1].p == 2.2
    heights = [abs(problem.coefficients(p.x)[1, 1]) for p in points]
    stuck = [np.mean(problem.contacts(p.x, p.p).state[0, 0] == 0) for p in points]
    peak = int(np.argmax(heights))
    assert 0.55 < points[peak].p < 0.7  # first mode of the free structure: 0.618
    assert stuck[peak] < 0.1
    assert stuck[-1] == 1.0
    assert heights[-1] < 1e-8
    # stuck, the first mass alone remains: K = 2, C = 0.04
    alone = 20.0 / abs(2.0 - 2.2**2 + 0.04j * 2.2)
    assert abs(problem.coefficients(points[-1].x)[1, 0]) == pytest.approx(alone, rel=1e-8)
    there = points[peak]
    again, off = answered(problem, there.p, problem.coefficients(there.x))
    found_off = np.sqrt(2.0) * unknowns_bound(there.x, problem.linearise(there.x, there.p))
    apart = np.abs(again - problem.coefficients(there.x)).max()
    assert apart <= off + found_off * problem.displacement_scale


def test_changed_order_keeps_the_problem():
    problem = rubbing(3, 256).with_order(5)
    direct = rubbing(5, 256)
    x = np.random.default_rng(2).standard_normal(direct.size)
    np.testing.assert_array_equal(problem.linearise(x, 1.0).residual, direct.linearise(x, 1.0).residual)


def test_messages():
    linear = condense(TWO_MASSES, np.arange(2), HarmonicLoad(np.zeros(2), {1: np.ones(2) + 0j}))
    between = np.zeros((3, 2))
    between[0] = 1.0, -1.0
    rigid = RigidCoulomb(mu=0.5, preload=1.0)
    with pytest.raises(InputError, match=r"rigid contact c: has a gap between.*in_relative_coordinates"):
        dynamic_lagrangian(linear, Interface(("c",), (rigid,), between), 1, 16)
    one = np.zeros((3, 2))
    one[0, 0] = 1.0
    with pytest.raises(InputError, match="contact c: is unilateral and has no normal gap"):
        dynamic_lagrangian(linear, Interface(("c",), (RigidCoulomb(mu=0.5),), one), 1, 16)
    with pytest.raises(InputError, match="a and b: share one coordinate"):
        dynamic_lagrangian(linear, Interface(("a", "b"), (rigid, rigid), np.vstack([one, one])), 1, 16)
    with pytest.raises(InputError, match="6 samples a period for 3 harmonics"):
        dynamic_lagrangian(linear, Interface(("c",), (rigid,), one), 3, 6)
    with pytest.raises(InputError, match="penalty: must be positive"):
        dynamic_lagrangian(linear, Interface(("c",), (rigid,), one), 1, 16, -1.0)
    with pytest.raises(InputError, match="no contact is rigid"):
        dynamic_lagrangian(linear, Interface(("c",), (rigid.softened(1.0),), one), 1, 16)
    with pytest.raises(InputError, match="Solve with dynamic_lagrangian"):
        harmonic_balance(linear, Interface(("c",), (rigid,), one), 1, 16)
    with pytest.raises(InputError, match="constant normal load of 1 N and a gap"):
        RigidCoulomb(mu=0.5, preload=1.0, initial_gap=0.1)
    with pytest.raises(InputError, match="mu: must be finite and not negative"):
        RigidCoulomb(mu=-0.5)


@pytest.mark.parametrize("samples", [11, 64])
def test_reported_forces_keep_the_balance_beside_elastic_contacts(samples):
    # they were evaluated on the samples of the rigid contacts, which may be far fewer
    structure = lumped(np.ones(2), np.array([[2.0, -1.0], [-1.0, 2.0]]), np.array([[0.02, 0.0], [0.0, 0.02]]))
    gaps = np.zeros((6, 2))
    gaps[0, 0] = gaps[3, 1] = 1.0
    laws = (RigidCoulomb(mu=0.1, preload=1.0), Jenkins(k_t=1.0, limit=0.3))
    load, omega, order = HarmonicLoad(np.zeros(2), {1: np.array([1.0, 0.0])}), 0.5, 5
    linear = condense(structure, np.array([0, 1]), load)
    problem = dynamic_lagrangian(linear, Interface(("r", "s"), laws, gaps), order, samples)
    start = np.zeros(problem.size)
    found = newton(lambda v: problem.linearise(v, omega), start, Newton(max_iterations=100))
    assert found.status.converged
    motion = problem.coefficients(found.x)
    force = to_complex(problem.contacts(found.x, omega).coefficients)
    for h in range(order + 1):
        s = h * omega
        stiffness = structure.stiffness + 1j * s * structure.damping - s**2 * structure.mass
        left = stiffness @ motion[h] + gaps.T @ force[h] - load.coefficients(order)[h]
        assert np.max(np.abs(left)) < 1e-8
