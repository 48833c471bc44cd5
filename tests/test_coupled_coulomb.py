"""Planar friction: the step of second order against the judge, its derivatives from every state to every other, and one big step."""

from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy

import stickslip as ss
from evidence.judges.planar_contact import Contact, growing, judged
from stickslip.assembly.joints.pairs import direction, told_apart
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.law import OPEN, PAIRS, SLIP, STICK
from stickslip.contact.steps.coupled_coulomb import turned
from stickslip.harmonic.aft import contact_forces

STIFFNESSES = [None, 0.4, 2.5]


def law_of(k_w, preload=1.5):
    return ss.CoupledCoulomb(k_t=1.0, k_w=k_w, k_n=1.0, mu=0.5, preload=preload)


def drawn_gaps(seed):
    size = np.array([[1.0], [1], [1], [2], [2], [3], [3]])
    return np.random.default_rng(seed).standard_normal((7, 3)) * [1.0, 1.0, 0.8] / size


def stepped(law, displacement, state):
    force, new, jac, status = np.empty(3), np.empty(5), np.zeros((8, 11)), np.zeros(2, int)
    law.kernel(displacement, np.zeros(3), state, law.parameters(), force, new, jac, status)
    return np.concatenate([force, new]), jac, int(status[0])


@pytest.mark.validation
@pytest.mark.parametrize("k_w", STIFFNESSES)
def test_the_march_is_of_second_order(k_w):
    samples, errors = 2 ** np.arange(7, 13), np.zeros(6)
    for seed, preload in (
        (3, 1.5),
        (1, 3.0),
        (5, 1.5),
    ):  # where in a step the states change makes single errors rise and fall
        gaps = drawn_gaps(seed)
        exact = judged(gaps, Contact(1.0, 1.0, 0.5, preload, k_w)).coefficients
        law = compile_contacts([law_of(k_w, preload)], evaluator="march")
        found = [contact_forces(gaps, law, int(n)) for n in samples]
        errors += [np.max(np.abs(one.coefficients - exact)) for one in found]
        assert not any(one.unsettled for one in found)
    assert -np.polyfit(np.log(samples), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.15)
    assert errors[-1] < 6e-6


@pytest.mark.parametrize("k_w", [*STIFFNESSES, 0.0])
def test_derivatives_between_all_states(k_w):
    """Whatever the state before, a step that does not end on a kink has the derivatives of its differences."""
    rng = np.random.default_rng(7)
    law = ss.CoupledCoulomb(k_t=1.3, k_w=k_w, k_n=0.8, mu=0.6, preload=0.5)
    ways, kinks, total = Counter(), 0, 0
    for _ in range(400):
        state, size = law.initial_state(), rng.choice([0.2, 1.0, 3.0])
        for _ in range(3):
            out, _, before = stepped(law, size * rng.standard_normal(3), state)
            state = out[3:]
        if rng.random() < 0.7 and state[4] > 0:  # inside the limit
            state[:2] = state[2:4] - (state[2:4] - state[:2]) * rng.random()
        displacement = size * rng.standard_normal(3)
        _, jac, after = stepped(law, displacement, state)
        ways[before, after] += 1
        point, h = np.concatenate([displacement, np.zeros(3), state]), 1e-6

        def outcome(p):
            return stepped(law, p[:3], p[6:])[0]

        for column in (0, 1, 2, 6, 7, 8, 9, 10):
            there, back = point.copy(), point.copy()
            there[column] += h
            back[column] -= h
            here, there, back = outcome(point), outcome(there), outcome(back)
            total += 1
            if np.max(np.abs(there - 2 * here + back)) / h > 1e-3:
                kinks += 1
                continue
            assert np.max(np.abs((there - back) / (2 * h) - jac[:, column])) < 1e-5
    assert kinks < 0.02 * total
    assert set(ways) == {(a, b) for a in (STICK, SLIP, OPEN) for b in (STICK, SLIP, OPEN)}


@pytest.mark.parametrize("k_w", STIFFNESSES)
def test_one_big_step_from_rest_returns_to_the_limit(k_w):
    """The static preload is one step: along the radius with one stiffness, to the closest point with two."""
    law = law_of(k_w)
    k = law.stuck_stiffness()[:2]
    for way in np.array([[3.0, 4.0], [-20.0, 1.0], [1e-3, 2e3], [0.1, 0.2]]):
        force, _, status = stepped(law, np.array([*way, -0.5]), law.initial_state())
        trial, limit = k * way, 0.5 * 2.0
        if status == STICK:
            assert np.linalg.norm(trial) <= limit
            assert np.allclose(force[:2], trial, rtol=1e-15)
        else:
            assert np.allclose(force[:2], limit * growing(k, way, limit), rtol=1e-12)
            if k_w is None:
                assert np.allclose(force[:2], limit * trial / np.linalg.norm(trial), rtol=1e-13)
        again, _, _ = stepped(law, np.array([*way, -0.5]), force[3:])
        assert np.allclose(again, force, rtol=1e-12)  # a step of no length changes nothing


def test_half_steps_of_one_straight_way_change_nothing_with_one_stiffness():
    law = law_of(None)
    rng = np.random.default_rng(3)
    for _ in range(50):
        begun = stepped(law, rng.standard_normal(3), law.initial_state())[0][3:]
        end = 2.0 * rng.standard_normal(3)
        start = np.array([*begun[2:4], law.preload - begun[4]])
        whole = stepped(law, end, begun)[0]
        half = stepped(law, 0.5 * (start + end), begun)[0][3:]
        assert np.allclose(stepped(law, end, half)[0][:3], whole[:3], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("scale", [1e-200, 1e-9, 1e9, 1e100])
def test_limits_far_from_the_stiffness_give_numbers(scale):
    law = ss.CoupledCoulomb(k_t=1.0, k_w=2.0, k_n=1.0, mu=scale, preload=1.0)
    rng = np.random.default_rng(0)
    state = law.initial_state()
    for _ in range(200):
        out, jac, _ = stepped(law, rng.standard_normal(3), state)
        state = out[3:]
        assert np.all(np.isfinite(out))
        assert np.all(np.isfinite(jac))


def test_two_stiffnesses_need_a_direction_and_one_does_not():
    assert told_apart(law_of(None), per_area=False) == ""
    assert told_apart(law_of(1.0), per_area=False) == ""
    assert "axial_stiffness_n_per_m = 0.4" in told_apart(law_of(0.4), per_area=False)
    assert law_of(0.4).planar() is None
    assert law_of(1.0).planar().tolist() == law_of(None).planar().tolist()


@pytest.mark.parametrize("seed", range(6))
def test_a_slider_dragged_to_where_it_sticks_for_ever_has_its_derivatives(seed):
    """The limit is a little more than the motion asks for: the slider comes to rest after some periods, where it depends on them."""
    rng = np.random.default_rng(seed)
    gaps = rng.standard_normal((5, 3)) * np.array([[1.0], [1], [1], [0.4], [0.4]])
    gaps[:, 2] *= 0.1
    gaps[0, 2] = 0.0

    def evaluated(preload, gaps=gaps):
        law = ss.CoupledCoulomb(k_t=1.0, k_n=1.0, mu=0.5, preload=preload)
        return contact_forces(gaps, compile_contacts([law], evaluator="events"), 256)

    slips, rests = 0.1, 20.0
    for _ in range(12):
        middle = 0.5 * (slips + rests)
        slips, rests = (slips, middle) if np.all(evaluated(middle).state == STICK) else (middle, rests)
    period, way = evaluated(rests), rng.standard_normal(gaps.shape)
    assert np.all(period.state == STICK)
    found = np.zeros_like(gaps)
    for block, (a, b) in zip(period.blocks[0], PAIRS, strict=False):
        found[:, a] += block @ way[:, b]
    ends = [evaluated(rests, gaps + s * 1e-6 * way).coefficients for s in (1, -1)]
    wanted = (ends[0] - ends[1]) / 2e-6
    # a step of Newton's method on the way is taken along, but not the change of its matrix
    assert np.max(np.abs(found - wanted)) < 1e-3 * np.max(np.abs(wanted))


OFFSETS = [0.0, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3]


@pytest.mark.parametrize("axis", [0.0, 0.7, -1.2])
@pytest.mark.parametrize("size", np.logspace(-3, 3, 19))
def test_a_direction_turns_as_its_equation_says_and_is_finite_against_the_way(axis, size):
    angles = np.array([0.0, 0.3, 1.5, 3.0] + [np.pi + s * d for s in (1, -1) for d in OFFSETS])
    wanted = scipy.integrate.solve_ivp(
        lambda _, angle: -size * np.sin(angle), (0, 1), angles, "LSODA", rtol=1e-13, atol=1e-14
    ).y[:, -1]
    for angle, behind in zip(angles, wanted, strict=True):
        e = np.array([np.cos(axis + angle), np.sin(axis + angle)])
        out = np.array(turned(*e, size * np.cos(axis), size * np.sin(axis)))
        assert np.all(np.isfinite(out))
        assert abs(np.hypot(*out[:2]) - 1.0) < 5e-16
        # rounding of the angle grows by up to exp(size) on the way
        if abs(angle - np.pi) > 1e-4 or size < 11.0:
            assert np.hypot(*(out[:2] - [np.cos(axis + behind), np.sin(axis + behind)])) < 1e-10


def test_exactly_against_the_way_a_direction_stays_until_its_force_has_vanished():
    for size, along in ((1e-3, 1), (1, 1), (30, 1), (38, -1), (300, -1), (800, -1), (1e6, -1)):
        e_t, e_w, kept, _, _ = turned(1.0, 0.0, -float(size), 0.0)
        assert (e_t, e_w) == (along, 0.0)
        assert kept == pytest.approx(np.exp(size * along), rel=1e-9)


@pytest.mark.parametrize("angle", [0.0, np.pi / 2, 0.6435, 2.1])
@pytest.mark.parametrize("before", [1e-30, 1e-17, 1e-16, 3.33e-16, 1e-15, 1e-13])
def test_a_step_from_a_normal_force_of_rounding_ends_along_the_way(angle, before):
    """On a line it is that of a spring along it, whichever way a force of rounding points before."""
    law, line = law_of(None), np.array([np.cos(angle), np.sin(angle)])
    for rounding in (-5, -1, 0, 1, 5):
        place = 0.22 * line
        state = np.array([*(place + rounding * 1.1e-16 * line), *place, before])
        for way in (-0.3, -0.03, 0.03, 0.3):
            for pressure in (1e-5, 0.02, 1.0):
                gap = np.array([*(place + way * line), law.preload - pressure])
                out, jac, _ = stepped(law, gap, state)
                assert np.allclose(out[:2], np.sign(way) * min(abs(way), 0.5 * pressure) * line, atol=2e-15)
                # what the force depends on within the rounding of the state before is unbounded
                assert np.max(np.abs(jac[:, :6] if before < 1e-20 else jac)) < 3.0


def test_a_march_over_samples_where_contacts_touch_is_finite():
    rng, tau = np.random.default_rng(0), 2 * np.pi * np.arange(1, 31) / 64
    for i in range(150):
        k_t, k_n, mu = 10 ** rng.uniform(-1, 1, 3)
        phase = 0.6 * (i % 2)
        gaps = rng.uniform(0.2, 2) * np.array([[0.0] * 3, [0.6, 0, 0.8], [phase, 0, phase * 4 / 3]])
        normal = gaps[1, 2] * np.cos(tau) + gaps[2, 2] * np.sin(tau)
        preload = k_n * rng.choice(normal) * (1 + rng.integers(-4, 5) * 1.1e-16)
        law = ss.CoupledCoulomb(k_t=k_t, k_n=k_n, mu=mu, preload=preload)
        period = contact_forces(gaps, compile_contacts([law], evaluator="march"), 64)
        assert np.all(np.isfinite(period.coefficients))
        assert np.all(np.isfinite(period.blocks))


@pytest.mark.parametrize("turn", range(3))
def test_the_tangent_of_a_curved_surface_is_an_axis_along_no_normal(turn: int) -> None:
    """Normals along two axes: the third one lies in the contact plane everywhere. Where each axis is near a normal the farthest one counts."""
    around = np.roll(np.eye(3), turn, axis=1)  # rows: the axes from `turn` on

    def chosen(*normals: np.ndarray) -> list[float]:
        surface: Any = SimpleNamespace(used=np.arange(len(normals)), node_normals=lambda: np.array(normals))
        anything: Any = SimpleNamespace(tangent=None, share="point", frame=None)
        law = ss.ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.5)
        return list(direction("contact.c", anything, law, anything, surface, None, None))

    assert chosen(around[0], around[1]) == around[2].tolist()
    tilted = [np.array([0.04, 1.0, 0.0]), np.array([1.0, 0.01, 0.0]), np.array([0.0, 0.02, 1.0])]
    normals = [own[np.argsort(np.roll(range(3), turn))] / np.linalg.norm(own) for own in tilted]
    sines = [min(float(np.linalg.norm(np.cross(n, axis))) for n in normals) for axis in np.eye(3)]
    assert max(sines) < 0.05
    assert chosen(*normals) == np.eye(3)[int(np.argmax(sines))].tolist()
