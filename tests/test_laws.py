"""The contract of contact laws: one line of example parameters a law, and everything a law owes its users."""

import pickle
import subprocess
import sys
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from models import OPEN, SLIP, basis

import stickslip as ss
from evidence.validation import case_b1_iwan, case_b1_planar
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.law import PAIRS, PiecewiseLinear
from stickslip.contact.laws import LAWS
from stickslip.contact.march import period_march
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces

stiff = st.floats(-1, 1).map(lambda e: 10**e)
some = st.floats(-1, 1)
share = st.floats(0, 1)
three = st.tuples(some, some, some)
populations = (
    st.builds(
        ss.contact.UniformBand,
        n_sliders=st.integers(1, 6),
        half_width=st.floats(0.1, 1),
        elastic_share=st.floats(0, 0.5),
    )
    | st.builds(ss.contact.FourParameter, chi=st.floats(-0.9, 0), beta=st.floats(0, 3), n_sliders=st.integers(2, 6))
    | st.just(ss.contact.FirstLoading(displacement=(1.0, 2.0, 4.0), force=(2.0, 3.0, 3.5)))
)
EXAMPLES = {
    "bonded": st.builds(ss.Bonded, k_t=stiff, k_w=stiff, k_n=stiff),
    "unilateral_spring": st.builds(ss.UnilateralSpring, k_n=stiff, preload=share)
    | st.builds(ss.UnilateralSpring, k_n=stiff, initial_gap=share),
    "cubic_spring": st.builds(
        ss.CubicSpring, cubic_t=some, cubic_w=some, cubic_n=some, k_t=stiff, k_w=stiff, k_n=stiff
    ),
    "polynomial_spring": st.builds(ss.PolynomialSpring, along_t=three, along_w=st.tuples(stiff), along_n=three),
    "jenkins": st.builds(ss.Jenkins, k_t=stiff, limit=share, k_w=stiff, k_n=stiff),
    "elastic_coulomb": st.builds(ss.ElasticCoulomb, k_t=stiff, k_w=stiff, k_n=stiff, mu=share, preload=some),
    "coupled_coulomb": st.builds(
        ss.CoupledCoulomb, k_t=stiff, k_w=st.none() | stiff, k_n=stiff, mu=share, preload=some
    ),
    "regularised_coulomb": st.builds(
        ss.RegularisedCoulomb, mu=share, transition_velocity=st.floats(0.1, 3), k_n=stiff, preload=some
    ),
    "dahl": st.builds(ss.Dahl, k_t=stiff, limit=st.floats(0.1, 3), k_w=stiff, k_n=stiff),
    "bouc_wen": st.builds(
        lambda beta, ratio, **others: ss.BoucWen(beta=beta, gamma=ratio * beta, **others),
        beta=stiff,
        ratio=st.floats(-0.5, 1),
        k_t=stiff,
        alpha=st.floats(0, 0.9),
        a=st.floats(0.3, 3),
        exponent=st.sampled_from([1.0, 1.5, 2.0, 4.0]),
        k_w=stiff,
        k_n=stiff,
    ),
    "iwan": st.builds(ss.Iwan, k_t=stiff, limit=share, k_w=stiff, k_n=stiff, population=populations),
}
ELASTIC = ("bonded", "unilateral_spring", "cubic_spring", "polynomial_spring")
WITH_MEMORY = ("coupled_coulomb", "dahl", "bouc_wen")
every_law = pytest.mark.parametrize("name", list(LAWS))
seeds = st.integers(0, 2**32 - 1)


def random_gap(seed, order, size=1.0):
    """(2 order + 1, 3) coefficients in the range in which the examples stick, slip and open."""
    decay = np.repeat(1.0 / np.maximum(np.arange(order + 1), 1), 2)[1:, None]
    return size * decay * np.random.default_rng(seed).standard_normal((2 * order + 1, 3))


def evaluate(coefficients, law, samples, omega=1.0, evaluator="march"):
    return contact_forces(coefficients, compile_contacts([law], None, evaluator), samples, omega)


def stiffness_of(law):
    """Largest stiffness near gaps of size one: what forces and derivatives are measured by."""
    if isinstance(law, ss.PolynomialSpring):
        return 100.0
    others = [abs(getattr(law, name, None) or 0.0) for name in ("k_t", "k_w", "k_n", "cubic_t", "cubic_w", "cubic_n")]
    return max(*others, 1.0) * (30.0 if isinstance(law, ss.CubicSpring) else 1.0)


def step(law, displacement, velocity, state):
    """Call the compiled step: (force, new state), jac, status."""
    n = state.size
    force, new, jac, status = np.empty(3), np.empty(n), np.zeros((3 + n, 6 + n)), np.zeros(2, int)
    law.kernel(displacement, velocity, state, law.parameters(), force, new, jac, status)
    return np.concatenate([force, new]), jac, status


def test_every_law_has_an_example():
    assert list(EXAMPLES) == list(LAWS)


# ---- what the seam asks for -----------------------------------------------------------------------------------------------


@every_law
@settings(max_examples=15)
@given(data=st.data())
def test_law_is_a_value(name, data):
    law = data.draw(EXAMPLES[name])
    assert type(law) is LAWS[name]
    assert law == pickle.loads(pickle.dumps(law))
    assert hash(law) == hash(replace(law))
    with pytest.raises(FrozenInstanceError):
        setattr(law, fields(law)[0].name, 9.0)
    assert law.stuck_stiffness().shape == (3,)
    assert np.all(law.stuck_stiffness() >= 0.0) or name == "polynomial_spring"
    if isinstance(law, PiecewiseLinear):
        assert law.elements().shape[1] == 7


@every_law
@settings(max_examples=15)
@given(data=st.data())
def test_a_small_motion_from_rest_meets_the_stuck_stiffness(name, data):
    law = data.draw(EXAMPLES[name])
    pressed = {"preload": 1.0, "initial_gap": 0.0}
    law = replace(law, **{key: value for key, value in pressed.items() if hasattr(law, key)})
    for parameter in ("limit", "mu"):
        if hasattr(law, parameter) and name != "bouc_wen":
            law = replace(law, **{parameter: 1.0})
    before = step(law, np.zeros(3), np.zeros(3), law.initial_state())[0][:3]
    for d in range(3):
        moved = np.zeros(3)
        moved[d] = 1e-7
        after = step(law, moved, np.zeros(3), law.initial_state())[0][:3]
        # smooth laws bend by 1e-7 on the way, and faster below an exponent of 2
        assert (after - before)[d] / 1e-7 == pytest.approx(law.stuck_stiffness()[d], rel=2e-5, abs=1e-7)


# ---- derivatives ------------------------------------------------------------------------------------------------------------


def one_sided(function, point, column, h):
    """Backward and forward difference of `function` along one coordinate."""
    ahead, behind = point.copy(), point.copy()
    ahead.flat[column] += h
    behind.flat[column] -= h
    here = function(point)
    return (here - function(behind)) / h, (function(ahead) - here) / h


@every_law
@settings(max_examples=25, deadline=None)
@given(data=st.data(), seed=seeds)
def test_derivatives_of_the_step_in_every_state_reached(name, data, seed):
    law = data.draw(EXAMPLES[name])
    rng = np.random.default_rng(seed)
    state, used, total = law.initial_state(), 0, 0
    scale = stiffness_of(law) * np.ones(3 + state.size)
    for _ in range(12):
        point = np.concatenate([rng.standard_normal(6), state])
        after, jac, _ = step(law, point[:3], point[3:6], state)

        def outcome(p):
            return step(law, p[:3], p[3:6], p[6:])[0]

        for column in range(point.size):
            h = 1e-6
            behind, ahead = one_sided(outcome, point, column, h)
            total += 1
            # at a kink the two sides differ, whatever the law says; curvature makes them differ by 1e-6 of the size
            if np.max(np.abs(ahead - behind) / scale) > 1e-3:
                continue
            used += 1
            wrong = np.abs(0.5 * (ahead + behind) - jac[:, column]) / scale
            assert np.max(wrong) < 2e-5, (column, point)
        state = after[3:]
    assert used >= 0.9 * total


@every_law
@settings(max_examples=12, deadline=None)
@given(data=st.data(), seed=seeds, omega=st.floats(0.3, 3))
def test_derivatives_of_the_coefficients(name, data, seed, omega):
    law = data.draw(EXAMPLES[name])
    coefficients = random_gap(seed, 2)
    period = evaluate(coefficients, law, 40, omega)
    assert period.unsettled == 0
    scale = stiffness_of(law) * (1.0 + omega / getattr(law, "transition_velocity", np.inf)) ** 2
    m, used, total = 5, 0, 0
    for q in range(m):
        for b in range(3):
            behind, ahead = one_sided(lambda p: evaluate(p, law, 40, omega).coefficients, coefficients, 3 * q + b, 1e-5)
            total += 1
            if np.max(np.abs(ahead - behind)) > 1e-3 * scale:
                continue
            used += 1
            central = 0.5 * (ahead + behind)
            for k, (a, by) in enumerate(PAIRS[: law.pairs]):
                if by == b:
                    wrong = np.abs(period.blocks[0, k, :, q] - central[:, a])
                    assert np.max(wrong) < 5e-5 * scale, f"block {k}, column {q}"
            uncovered = [a for a in range(3) if (a, b) not in PAIRS[: law.pairs]]
            assert np.max(np.abs(central[:, uncovered]), initial=0.0) < 5e-5 * scale
    assert used >= 0.7 * total
    h = 1e-5 * omega
    slope = (
        evaluate(coefficients, law, 40, omega + h).coefficients
        - evaluate(coefficients, law, 40, omega - h).coefficients
    ) / (2 * h)
    assert np.max(np.abs(slope - period.by_omega)) < 1e-4 * scale
    closed = np.array([0.0, 0.0, -1.0])  # however far the contact is open at rest
    at_rest, moving = (step(law, closed, v, law.initial_state())[0] for v in (np.zeros(3), np.full(3, 0.1)))
    if np.array_equal(at_rest, moving):  # no force of a velocity
        assert not np.any(period.by_omega)


# ---- physics ----------------------------------------------------------------------------------------------------------------


def work(period, coefficients):
    """Work done on the contact in one period, by the spectrum."""
    h = np.repeat(np.arange(1, (len(coefficients) - 1) // 2 + 1), 1)[:, None]
    cos, sin = coefficients[1::2], coefficients[2::2]
    return np.pi * np.sum(h * (period.coefficients[1::2] * sin - period.coefficients[2::2] * cos))


@every_law
@settings(max_examples=20, deadline=None)
@given(data=st.data(), seed=seeds, size=st.floats(-1, 1))
def test_friction_takes_energy_and_elasticity_returns_it(name, data, seed, size):
    law = data.draw(EXAMPLES[name])
    coefficients = random_gap(seed, 3, 10**size)
    samples = 512
    period = evaluate(coefficients, law, samples)
    largest = np.max(np.abs(period.force)) * np.max(np.abs(period.gap)) * 2 * np.pi * 9
    energy = work(period, coefficients)
    if name in ELASTIC and name != "unilateral_spring":
        assert abs(energy) <= 1e-13 * samples * largest
    elif name == "unilateral_spring":
        # each kink at lift-off and contact adds an error of (2 pi / samples)² / 12 times the jump of the slope
        assert abs(energy) <= 1e-4 * largest
    else:
        # sampled jumps, as those of a tangential force at re-contact, are off by one sample
        assert energy >= -1.0 / samples * largest


def shifted(coefficients, shift, samples):
    """Coefficients of the signal delayed by `shift` samples."""
    out = coefficients.copy()
    for h in range(1, (len(coefficients) - 1) // 2 + 1):
        angle = 2 * np.pi * h * shift / samples
        c, s = coefficients[2 * h - 1], coefficients[2 * h]
        out[2 * h - 1] = c * np.cos(angle) - s * np.sin(angle)
        out[2 * h] = c * np.sin(angle) + s * np.cos(angle)
    return out


@every_law
@settings(max_examples=20, deadline=None)
@given(data=st.data(), seed=seeds, shift=st.integers(1, 47))
def test_the_steady_state_does_not_know_when_time_began(name, data, seed, shift):
    law = data.draw(EXAMPLES[name])
    coefficients = random_gap(seed, 2, 2.0)
    early = evaluate(coefficients, law, 48)
    if name == "coupled_coulomb":
        # one that has shaken down keeps a memory of the order of its first slips
        assume(np.mean(early.state[0] == SLIP) > 0.1)
    late = evaluate(shifted(coefficients, shift, 48), law, 48)
    size = stiffness_of(law) * max(1.0, np.max(np.abs(early.gap))) ** (3 if name in ELASTIC else 1)
    # a sample whose trial force lies on the limit to rounding may count as either: no jump follows from it; an open one does jump
    assert np.max(np.abs(late.force[0] - np.roll(early.force[0], shift, axis=1))) <= 1e-9 * size


@pytest.mark.parametrize("name", [n for n in LAWS if n != "polynomial_spring"])
@settings(max_examples=20, deadline=None)
@given(data=st.data(), seed=seeds)
def test_mirrored_motion_mirrored_friction(name, data, seed):
    law = data.draw(EXAMPLES[name])
    coefficients = random_gap(seed, 2)
    mirror = np.array([-1.0, -1.0, 1.0])
    a, b = evaluate(coefficients, law, 48), evaluate(mirror * coefficients, law, 48)
    assert np.array_equal(b.force[0], mirror[:, None] * a.force[0])
    assert np.array_equal(b.state, a.state)
    for k, (i, j) in enumerate(PAIRS[: law.pairs]):
        assert np.array_equal(b.blocks[0, k], mirror[i] * mirror[j] * a.blocks[0, k])


def scaled(law, factor):
    """The same law for gaps and forces larger by `factor`."""
    if isinstance(law, ss.CubicSpring):
        return replace(law, **{n: getattr(law, n) / factor**2 for n in ("cubic_t", "cubic_w", "cubic_n")})
    if isinstance(law, ss.PolynomialSpring):
        return replace(
            law,
            **{
                n: tuple(c / factor**i for i, c in enumerate(getattr(law, n)))
                for n in ("along_t", "along_w", "along_n")
            },
        )
    if isinstance(law, ss.BoucWen):
        return replace(law, beta=law.beta / factor**law.exponent, gamma=law.gamma / factor**law.exponent)
    lengths_and_forces = ("limit", "preload", "initial_gap", "transition_velocity")
    return replace(law, **{n: factor * getattr(law, n) for n in lengths_and_forces if hasattr(law, n)})


@every_law
@settings(max_examples=20, deadline=None)
@given(data=st.data(), seed=seeds, power=st.integers(-12, 12))
def test_forces_scale_with_the_unit_of_length(name, data, seed, power):
    law = data.draw(EXAMPLES[name])
    factor = 2.0**power  # no rounding, but in broken powers
    coefficients = random_gap(seed, 2)
    a, b = evaluate(coefficients, law, 48), evaluate(factor * coefficients, scaled(law, factor), 48)
    size = stiffness_of(law) * max(1.0, np.max(np.abs(a.gap))) ** (3 if name in ELASTIC else 1)
    assert np.max(np.abs(b.force / factor - a.force)) <= 1e-11 * size
    assert np.max(np.abs(b.blocks - a.blocks)) <= 1e-8 * size


@pytest.mark.parametrize("name", ["bonded", "unilateral_spring", "jenkins", "elastic_coulomb", "iwan"])
@settings(max_examples=30, deadline=None)
@given(data=st.data(), seed=seeds, order=st.integers(0, 4), samples=st.integers(20, 100))
def test_intervals_are_the_march_of_a_piecewise_linear_law(name, data, seed, order, samples):
    law = data.draw(EXAMPLES[name])
    assert isinstance(law, PiecewiseLinear)
    coefficients = random_gap(seed, order)
    fast = evaluate(coefficients, law, samples, evaluator="intervals")
    slow = evaluate(coefficients, law, samples)
    size = stiffness_of(law) * max(1.0, np.max(np.abs(fast.gap)))
    assert np.max(np.abs(fast.force - slow.force)) <= 1e-12 * size
    if np.array_equal(fast.state, slow.state):  # else a force lies on its limit to rounding
        assert np.max(np.abs(fast.blocks - slow.blocks)) <= 1e-10 * size


@pytest.mark.parametrize(
    "name", [n for n in LAWS if n not in ("bonded", "unilateral_spring", "jenkins", "elastic_coulomb", "iwan")]
)
def test_other_laws_do_not_claim_to_be_piecewise_linear(name):
    assert not hasattr(LAWS[name], "elements")


# ---- the periodic state -----------------------------------------------------------------------------------------------------


def plain_march(law, gap, state, periods=1):
    """Forces of the last of some periods from `state`, by the compiled step alone."""
    force = np.empty_like(gap)
    for _ in range(periods):
        for i in range(gap.shape[1]):
            out, _, _ = step(law, np.ascontiguousarray(gap[:, i]), np.zeros(3), state)
            force[:, i], state = out[:3], out[3:]
    return force, state


def state_behind(law, gap, force):
    """State that goes with the force at the end of a period."""
    x, f = gap[:2, -1], force[:2, -1]
    if isinstance(law, ss.CoupledCoulomb):
        pressure = law.preload - law.k_n * gap[2, -1]
        return np.array([*(x - f / law.stuck_stiffness()[:2]), *x, pressure])
    if isinstance(law, ss.Dahl):
        return np.array([x[0], f[0], x[1], f[1]])
    k, largest = np.array([law.k_t, law.k_w]), law.parameters()[3]
    y = (f - law.alpha * k * x) / ((1 - law.alpha) * k * largest)
    return np.array([x[0], y[0], x[1], y[1]])


@pytest.mark.parametrize("name", WITH_MEMORY)
@settings(max_examples=30, deadline=None)
@given(data=st.data(), seed=seeds, size=st.floats(-3, 1))
def test_accepted_states_repeat(name, data, seed, size):
    law = data.draw(EXAMPLES[name])
    coefficients = random_gap(seed, 2, 10**size)
    period = evaluate(coefficients, law, 48)
    assert period.unsettled == 0
    gap, force = period.gap[0], period.force[0]
    again, _ = plain_march(law, gap, state_behind(law, gap, force))
    spring = np.max(law.stuck_stiffness()[:2])
    largest = max(np.max(np.abs(force)), spring * np.max(np.abs(gap)))
    assert np.max(np.abs(again - force)) <= 1e-10 * largest


@pytest.mark.parametrize("excess", [1e-1, 1e-2, 1e-3, 1e-5])
def test_planar_friction_near_incipient_slip(excess):
    # the smallest disc that the path fits into needs no slip; one that is smaller by `excess` slips a little in every cycle,
    # and the start is forgotten the more slowly the smaller that is
    coefficients = np.zeros((7, 3))
    coefficients[1, 0], coefficients[2, 1], coefficients[3, 1], coefficients[4, 0] = 1.0, 0.7, 0.3, 0.2
    path = (basis(3, 128) @ coefficients)[:, :2]
    law = ss.CoupledCoulomb(k_t=1.0, k_n=0.0, mu=1.0, preload=smallest_disc(path) * (1.0 - excess))
    period = evaluate(coefficients, law, 128)
    assert period.unsettled == 0
    two, _ = plain_march(law, period.gap[0], law.initial_state(), 2)
    many, _ = plain_march(law, period.gap[0], law.initial_state(), 400)
    if excess <= 1e-2:
        assert np.max(np.abs(two - many)) > 1e-3  # two periods are not enough
    assert np.max(np.abs(period.force[0] - many)) <= 1e-10


def smallest_disc(path):
    """Radius of the smallest disc around points of the plane."""
    from scipy.optimize import minimize

    centre = np.zeros(2)
    for _ in range(3):
        found = minimize(
            lambda c: np.max(np.hypot(*(path - c).T)),
            centre,
            method="Nelder-Mead",
            options={"xatol": 1e-13, "fatol": 1e-15, "maxiter": 2000},
        )
        centre = found.x
    return found.fun


def test_micro_slip_of_a_dahl_contact_settles_though_it_forgets_in_ten_thousand_periods():
    coefficients = np.zeros((3, 3))
    coefficients[0, 0], coefficients[1, 0] = 0.3, 1.0
    law = ss.Dahl(k_t=1.0, limit=1e4)
    period = evaluate(coefficients, law, 64)
    assert period.unsettled == 0
    # symmetric in its steady state: the mean force has relaxed
    assert abs(np.mean(period.force[0, 0])) < 1e-9
    begun, _ = plain_march(law, period.gap[0], law.initial_state(), 100)
    assert abs(np.mean(begun[0])) > 0.1


def test_a_stuck_planar_contact_keeps_its_start():
    law = ss.CoupledCoulomb(k_t=2.0, k_n=0.0, mu=1.0, preload=1e3)
    coefficients = random_gap(3, 2)
    period = evaluate(coefficients, law, 32)
    assert np.allclose(period.force[0, :2], 2.0 * period.gap[0, :2], rtol=0, atol=1e-13)
    assert np.allclose(period.blocks[0, 0], 2.0 * np.eye(5), atol=1e-12)


# ---- planar friction --------------------------------------------------------------------------------------------------------


def turned(values, angle):
    """Tangential components of (..., 3) or of blocks in a frame turned about the normal."""
    c, s = np.cos(angle), np.sin(angle)
    return values @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@settings(max_examples=40, deadline=None)
@given(law=EXAMPLES["coupled_coulomb"], seed=seeds, angle=st.floats(-3, 3))
def test_planar_friction_of_one_stiffness_does_not_know_the_frame(law, seed, angle):
    law = replace(law, k_w=None)
    coefficients = random_gap(seed, 2)
    a = evaluate(coefficients, law, 48)
    b = evaluate(turned(coefficients, angle), law, 48)
    size = stiffness_of(law) * np.max(np.abs(a.gap))
    # what opens in one frame opens in the other: the normal gap is the same number
    assert np.array_equal(a.state == OPEN, b.state == OPEN)
    assert np.max(np.abs(b.force[0].T - turned(a.force[0].T, angle))) <= 1e-9 * size


@pytest.mark.parametrize("k_w", [None, 0.0, 5.0])
def test_planar_friction_along_a_line_is_that_of_one_tangent(k_w):
    # it never opens: where a contact closes within a step the two differ by the second order in the samples
    plane = ss.CoupledCoulomb(k_t=2.0, k_w=k_w, k_n=0.15, mu=0.5, preload=1.5)
    line = ss.ElasticCoulomb(k_t=2.0, k_w=0.0, k_n=0.15, mu=0.5, preload=1.5)
    for seed in range(20):
        coefficients = random_gap(seed, 3)
        coefficients[:, 1] = 0.0
        a, b = evaluate(coefficients, plane, 64), evaluate(coefficients, line, 64)
        assert np.max(np.abs(a.force - b.force)) < 1e-13 * 20
        assert np.max(np.abs(a.blocks[0, [0, 2, 3]] - b.blocks[0, [0, 2, 3]])) < 1e-12 * 20


@settings(max_examples=30, deadline=None)
@given(law=EXAMPLES["coupled_coulomb"], seed=seeds)
def test_planar_friction_stays_in_its_disc(law, seed):
    period = evaluate(random_gap(seed, 3, 3.0), law, 64)
    limit = -law.mu * period.force[0, 2]
    assert np.all(np.hypot(period.force[0, 0], period.force[0, 1]) <= limit * (1 + 1e-12))
    assert np.all(period.force[0, 2] <= 0.0)


# ---- smooth laws against other ways to compute them ---------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 5.0])
def test_bouc_wen_steps_are_exact(exponent):
    from scipy.integrate import solve_ivp

    law = ss.BoucWen(k_t=3.0, beta=0.7, gamma=-0.2, alpha=0.1, a=1.3, exponent=exponent)

    def rate(sign):
        def of(_, z):
            memory = law.beta * np.sign(z * sign) + law.gamma
            return sign * (law.a - memory * np.abs(z) ** exponent)

        return of

    x, z, state = 0.0, np.zeros(1), law.initial_state()
    for move in (0.4, 1.0, -0.2, -3.0, 0.05, 9.0, -30.0, 2.0):
        want = solve_ivp(rate(np.sign(move)), (0, abs(move)), z, rtol=1e-10, atol=1e-12, max_step=0.02)
        x, z = x + move, want.y[:, -1]
        out, _, _ = step(law, np.array([x, 0.0, 0.0]), np.zeros(3), state)
        state = out[3:]
        # the solver steps across the kink of |z|^n at z = 0
        assert out[0] == pytest.approx(3.0 * (0.1 * x + 0.9 * z[0]), abs=1e-6)


def test_bouc_wen_of_exponent_one_with_equal_shapes_is_dahl():
    k, limit = 2.0, 0.8
    # dz = (1 - (k/limit) (sign(z dx) + 1) |z| / 2) dx is not Dahl's law; dz = (1 - (k/limit) sign(dx) z) dx, with gamma = 0, is
    smooth = ss.BoucWen(k_t=k, k_w=k, beta=k / limit, gamma=0.0)
    dahl = ss.Dahl(k_t=k, k_w=k, limit=limit)
    coefficients = random_gap(5, 3)
    a, b = evaluate(coefficients, smooth, 64), evaluate(coefficients, dahl, 64)
    assert np.max(np.abs(a.force - b.force)) < 1e-9
    assert np.max(np.abs(a.blocks - b.blocks)) < 1e-8


def test_dahl_nears_its_limit_and_loops_as_published():
    # steady loop between -A and A with exponent one: T(A) = F tanh(k A / F) (Dahl 1976)
    law = ss.Dahl(k_t=2.0, limit=0.8)
    coefficients = np.zeros((3, 3))
    coefficients[1, 0] = 0.6
    period = evaluate(coefficients, law, 64)
    assert period.force[0, 0, 0] == pytest.approx(0.8 * np.tanh(2.0 * 0.6 / 0.8), abs=1e-12)


def test_regularised_friction_tends_to_coulombs():
    coefficients = np.zeros((3, 3))
    coefficients[2, 0] = 1.0  # velocity cos
    law = ss.RegularisedCoulomb(mu=0.5, preload=2.0, transition_velocity=1e-4)
    first = evaluate(coefficients, law, 1000).coefficients[1, 0]
    # 4/pi of the limit, less what is smoothed: of the order of the transition velocity over that of the motion, and of a sample
    assert first == pytest.approx(4 / np.pi, abs=2 * np.pi / 1000)
    assert evaluate(coefficients, law, 1000, 2.0).coefficients[1, 0] == pytest.approx(first)


# ---- bad parameters, by message -----------------------------------------------------------------------------------------------

REFUSED = [
    (lambda: ss.Bonded(k_t=0.0, k_w=0.0, k_n=0.0), "Bonded: all contact stiffnesses are zero"),
    (lambda: ss.Bonded(k_t=-1.0, k_w=0.0, k_n=0.0), r"Bonded\.k_t: must be finite and not negative, got -1"),
    (lambda: ss.CoupledCoulomb(k_t="4e5", k_n=0.0, mu=0.3), r"CoupledCoulomb\.k_t: .* got '4e5'"),
    (lambda: ss.UnilateralSpring(k_n=0.0), r"UnilateralSpring\.k_n: must be positive, got 0"),
    (
        lambda: ss.UnilateralSpring(k_n=1.0, initial_gap=-1.0),
        r"UnilateralSpring\.initial_gap: must be finite and not negative",
    ),
    (
        lambda: ss.UnilateralSpring(k_n=1.0, preload=1.0, initial_gap=1.0),
        "has a preload of 1.0 N and an initial gap of 1.0 m.*give one of them",
    ),
    (ss.CubicSpring, "CubicSpring: all contact stiffnesses are zero"),
    (lambda: ss.CubicSpring(cubic_n=np.nan), r"CubicSpring\.cubic_n: must be finite, got nan"),
    (lambda: ss.PolynomialSpring(along_t=(0.0,)), "PolynomialSpring: all coefficients are zero"),
    (lambda: ss.PolynomialSpring(along_w=(np.inf,)), r"PolynomialSpring\.along_w: must be finite, got"),
    (lambda: ss.Jenkins(k_t=1.0, limit=-1.0), r"Jenkins\.limit: must be finite and not negative, got -1"),
    (lambda: ss.Jenkins(k_t=0.0, limit=1.0), "Jenkins: all contact stiffnesses are zero"),
    (
        lambda: ss.CoupledCoulomb(k_t=1.0, k_n=1.0, mu=-0.1),
        r"CoupledCoulomb\.mu: must be finite and not negative, got -0.1",
    ),
    (
        lambda: ss.CoupledCoulomb(k_t=1.0, k_n=1.0, mu=0.1, preload=np.inf),
        r"CoupledCoulomb\.preload: must be finite, got inf",
    ),
    (
        lambda: ss.RegularisedCoulomb(mu=0.1, transition_velocity=0.0),
        r"RegularisedCoulomb\.transition_velocity: must be positive",
    ),
    (lambda: ss.Dahl(k_t=1.0, limit=0.0), r"Dahl\.limit: must be positive, got 0"),
    (lambda: ss.BoucWen(k_t=1.0, beta=0.0, gamma=0.0), r"BoucWen\.beta: must be positive"),
    (
        lambda: ss.BoucWen(k_t=1.0, beta=1.0, gamma=1.5),
        r"BoucWen\.gamma: must be above -beta and at most beta = 1.0, got 1.5",
    ),
    (lambda: ss.BoucWen(k_t=1.0, beta=1.0, gamma=-1.0), r"BoucWen\.gamma: must be above -beta"),
    (lambda: ss.BoucWen(k_t=1.0, beta=1.0, gamma=0.0, alpha=1.5), r"BoucWen\.alpha: must lie in \[0, 1\], got 1.5"),
    (
        lambda: ss.BoucWen(k_t=1.0, beta=1.0, gamma=0.0, exponent=0.5),
        r"BoucWen\.exponent: must lie in \[1, 20\], got 0.5",
    ),
    (lambda: ss.Iwan(k_t=1.0, limit=np.nan), r"Iwan\.limit: must be finite and not negative, got nan"),
    (lambda: ss.contact.UniformBand(n_sliders=0), r"UniformBand\.n_sliders: must be at least 1, got 0"),
    (lambda: ss.contact.UniformBand(half_width=1.1), r"UniformBand\.half_width: must lie in \(0, 1\], got 1.1"),
    (lambda: ss.contact.UniformBand(elastic_share=1.0), r"UniformBand\.elastic_share: must lie in \[0, 1\), got 1.0"),
    (lambda: ss.contact.FourParameter(chi=-1.0, beta=0.0), r"FourParameter\.chi: must lie in \(-1, 0\], got -1.0"),
    (
        lambda: ss.contact.FourParameter(chi=0.0, beta=-1.0),
        r"FourParameter\.beta: must be finite and not negative, got -1.0",
    ),
    (
        lambda: ss.contact.FirstLoading(displacement=(1.0,), force=(1.0,)),
        "FirstLoading: got 1 displacements and 1 forces",
    ),
    (
        lambda: ss.contact.FirstLoading(displacement=(2.0, 1.0), force=(1.0, 1.5)),
        r"FirstLoading\.displacement: must rise from above zero",
    ),
    (
        lambda: ss.contact.FirstLoading(displacement=(1.0, 2.0), force=(1.0, 3.0)),
        r"FirstLoading\.force: must rise ever more slowly",
    ),
]


@pytest.mark.parametrize(("make", "message"), REFUSED, ids=[m for _, m in REFUSED])
def test_bad_parameters_are_refused_by_name(make, message):
    with pytest.raises(InputError, match=message):
        make()


# ---- the compiled code --------------------------------------------------------------------------------------------------------

LOAD = """
from stickslip.contact.laws import LAWS
from stickslip.contact.march import period_march
kernels = {law.kernel for law in LAWS.values()} | {period_march()}
print(sum(sum(k.stats.cache_misses.values()) for k in kernels), sum(sum(k.stats.cache_hits.values()) for k in kernels), len(kernels))
"""


def test_a_second_process_compiles_no_law():
    assert all(law.kernel is not None for law in LAWS.values())  # compiled now, or before
    period_march()
    done = subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, check=True)
    misses, hits, kernels = (int(word) for word in done.stdout.split())
    assert misses == 0
    assert hits == kernels


# ---- numbers of the literature (B1), quickly; `make validate` compares them in full -------------------------------------------


@pytest.mark.parametrize("row", case_b1_planar.TABLE, ids=lambda row: f"A/xc={row[0]}")
def test_planar_friction_on_a_circle(row):
    ratio = float(row[0])
    few, many = (case_b1_planar.circle_force(ratio, "march", n)[0] for n in (1024, 2048))
    force = (4.0 * many - few) / 3.0
    exact = complex(float(row[1]), float(row[2]))
    # what extrapolation of the second order leaves is of the fourth; the table has eight digits
    assert force[1, 0] / ratio == pytest.approx(exact, abs=1e-5)
    assert 1j * force[1, 1] / ratio == pytest.approx(exact, abs=1e-5)


@pytest.mark.parametrize("row", case_b1_iwan.ENERGY, ids=lambda row: f"A={row[0]}")
def test_energy_lost_in_an_iwan_element(row):
    amplitude, sliders = float(row[0]), 100
    law = ss.Iwan(k_t=1.0, limit=1.0, population=ss.contact.UniformBand(n_sliders=sliders))
    # midpoint rule over the sliders in cells of 2 / n, and 30 / samples² from sampling
    tolerance = (2.0 / sliders / amplitude) ** 2 + 30.0 / 1024**2
    assert case_b1_iwan.energy(law, amplitude, 1024) == pytest.approx(float(row[1]), rel=tolerance)


def test_first_loading_of_an_iwan_element():
    x = np.array([0.1, 0.5, 1.0, 2.0, 3.0])
    law = ss.Iwan(k_t=1.0, limit=1.0, population=ss.contact.UniformBand(n_sliders=20))
    want = np.where(x < 2.0, x - x**2 / 4.0, 1.0)
    assert case_b1_iwan.first_loading(law, x) == pytest.approx(want, abs=1e-13)


@pytest.mark.parametrize("chi", [0.0, -0.4, -0.8])
def test_micro_slip_grows_with_the_power_of_its_population(chi):
    law = ss.Iwan(k_t=1.0, limit=1.0, population=ss.contact.FourParameter(chi=chi, beta=0.5, n_sliders=200))
    assert case_b1_iwan.slope(law, np.array([0.1, 0.2, 0.4])) == pytest.approx(3 + chi, abs=5e-3)


@settings(max_examples=40)
@given(population=populations)
def test_sliders_add_up_to_the_element(population):
    law = ss.Iwan(k_t=3.0, limit=0.7, k_w=2.0, k_n=5.0, population=population)
    rows = law.elements()
    assert np.sum(rows[:, :3], axis=0) == pytest.approx([3.0, 2.0, 5.0], rel=1e-12)
    limits = rows[:, 3] * rows[:, 4]
    assert np.sum(limits[np.isfinite(limits)]) == pytest.approx(0.7, rel=1e-12)


def test_first_loading_follows_the_curve_it_was_made_of():
    x, f = (1.0, 2.0, 4.0), (2.0, 3.0, 3.5)
    law = ss.Iwan(k_t=2.0, limit=3.0, population=ss.contact.FirstLoading(displacement=x, force=f))
    got = case_b1_iwan.first_loading(law, np.array(x) * 3.0 / 3.5)
    assert got == pytest.approx(np.array(f) * 3.0 / 3.5, rel=1e-13)
    # at the last corner all have slipped: a curve that goes on level is the same one
    level = ss.contact.FirstLoading(displacement=(*x, 9.0), force=(*f, 3.5))
    assert level.sliders() == pytest.approx(law.population.sliders(), rel=1e-13)
    assert case_b1_iwan.first_loading(law, np.array([100.0])) == pytest.approx([3.0], rel=1e-13)
