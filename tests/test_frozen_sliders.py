"""Static state first, then frozen sliders: a block in a groove of two 45° contacts, whose static load exceeds the friction cone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_preload import K_N, LOAD, groove

import stickslip as ss
from evidence.models.lumped import blades_and_damper
from stickslip.arrays import FloatArray
from stickslip.contact.compiled import compile_contacts
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response import TimeStepping, TransientStart, frozen_sliders, integrate
from stickslip.response.equilibrium import preload
from stickslip.response.forced.response import forced_problem
from stickslip.response.system import System
from stickslip.response.time.start import rest
from stickslip.solve.newton_method import Newton, newton

MU, K_T, OMEGA = 0.6, 0.87 * K_N, 100.0
PULL = np.array([0.0, LOAD])  # k_t/k_n = 0.87 > mu: both sides slip in
SHAKE = np.array([2.0, 0.6])


def wedged(damping: float = 0.0) -> System:
    system = groove(K_T, MU)
    return replace(system, structure=replace(system.structure, damping=damping * np.eye(2)))


def balance_of(system: System, shake: FloatArray, order: int = 1, evaluator: str = "events") -> HarmonicBalance:
    linear = system.condensed(HarmonicLoad(PULL, {1: shake}), order)
    return harmonic_balance(linear, system.interface, order, 256, evaluator)


def solved(balance: HarmonicBalance, system: System) -> FloatArray:
    start = balance.unknowns(preload(system, PULL)[None].astype(complex))
    found = newton(lambda x: balance.linearise(x, OMEGA), start, Newton(max_iterations=60))
    assert found.status.converged
    return found.x


def static_by_dynamic(balance: HarmonicBalance, x: FloatArray) -> float:
    """Return the largest derivative of the static residual by the first harmonic, over that by the static part."""
    jac = balance.linearise(x, OMEGA).dense_jac()
    n = balance.linear.n
    return float(np.abs(jac[:n, n:]).max() / np.abs(jac[:n, :n]).max())


@pytest.mark.parametrize("evaluator", ["events", "intervals", "march"])
def test_full_stick_couples_no_static_part_with_friction_to_spare(evaluator):
    # eq. 17 of Gastaldi & Berruti 2017
    plain, frozen = wedged(), frozen_sliders(wedged(), PULL, 0.5)
    for system, coupled in ((plain, True), (frozen, False)):
        balance = balance_of(system, SHAKE, evaluator=evaluator)
        x = solved(balance, system)
        assert not np.any(balance.contacts(x, OMEGA).state), "full stick"
        coupling = static_by_dynamic(balance, x)
        mean = balance.coefficients(x)[0].real
        moved = np.abs(mean - preload(system, PULL)).max() / LOAD * K_N
        if coupled:
            assert coupling > 0.1
            assert moved > 1e-3
        else:
            assert coupling < 1e-14
            assert moved < 1e-14


def test_the_static_state_is_that_of_the_share_in_closed_form():
    # as that of a block that slips in with the friction coefficient m mu, and sqrt(2) N (1 + m mu) = P
    for share in (0.25, 0.5, 1.0):
        frozen = frozen_sliders(wedged(), PULL, share)
        assert preload(frozen, PULL)[1] == pytest.approx(LOAD / (K_N * (1 + share * MU)), rel=1e-10)
        normal = LOAD / (np.sqrt(2.0) * (1 + share * MU))
        depth = normal / K_N
        for law in frozen.interface.laws:
            assert abs(law.slider[0]) == pytest.approx(depth - share * MU * normal / K_T, rel=1e-10)


def test_the_static_state_is_kept_at_vanishing_excitation():
    frozen = frozen_sliders(wedged(), PULL, 0.9)
    balance = balance_of(frozen, 1e-5 * SHAKE)
    q = balance.coefficients(solved(balance, frozen))
    assert np.abs(q[0].real - preload(frozen, PULL)).max() < 1e-14 * np.abs(q[0]).max()
    assert np.abs(q[1]).max() > 0.0


def test_all_the_friction_leaves_a_contact_on_its_limit_and_changes_nothing():
    # the least vibration moves the slider on, to where the springs' own start is dragged; numbers of docs/theory/contact.md
    found = []
    for system in (wedged(), frozen_sliders(wedged(), PULL)):
        balance = balance_of(system, SHAKE)
        x = solved(balance, system)
        found.append(balance.coefficients(x))
        assert found[-1][0, 1].real == pytest.approx(31.74e-6, abs=5e-9)
        assert static_by_dynamic(balance, x) == pytest.approx(0.919, abs=5e-4)
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-12 * np.abs(found[0]).max())


def test_inside_the_cone_the_sliders_stay_at_zero():
    stuck = groove(0.5 * K_N, MU)
    frozen = frozen_sliders(stuck, PULL)
    assert np.allclose([law.slider for law in frozen.interface.laws], 0.0, atol=1e-20)


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_it_sticks_up_to_what_the_residual_traction_leaves(share):
    # |T_0| <= mu N_0 - |k_t g_t ± mu k_n g_n|: the range of docs/theory/contact.md
    frozen = frozen_sliders(wedged(), PULL, share)
    balance = balance_of(frozen, SHAKE)
    q = balance.coefficients(solved(balance, frozen))[1]
    tangent, _, normal = (frozen.interface.gap_operator @ q).reshape(2, 3).T
    pressed = LOAD / (np.sqrt(2.0) * (1 + share * MU))
    room = (1.0 - share) * MU * pressed
    # both sides are held in the sense in which their spring pulls
    sense = np.sign([law.slider[0] for law in frozen.interface.laws])
    amplitude = np.abs(sense * K_T * tangent + MU * K_N * normal)
    other = np.abs(sense * K_T * tangent - MU * K_N * normal)
    assert np.all(other < (1.0 + share) / (1.0 - share) * room)
    limit = room / amplitude.max()
    for factor, dragged in ((0.999, False), (1.001, True)):
        larger = balance_of(frozen, factor * limit * SHAKE)
        x = solved(larger, frozen)
        # beyond, a slider slips once, and sticks where the vibration has dragged it: its mean depends on the amplitude
        assert not np.any(larger.contacts(x, OMEGA).state)
        assert (static_by_dynamic(larger, x) > 0.1) == dragged


def test_gross_slip_forgets():
    # at 163 Hz both contacts of blade, damper, blade slip in every cycle (benchmark B6)
    plain, load = blades_and_damper(m=None)
    frozen = frozen_sliders(plain, load.static, 0.3)
    assert abs(frozen.interface.laws[0].slider[0]) > 1e-4
    omega = 2 * np.pi * 163.0
    sweep = ss.Sweep(
        omega_range=(omega, 1.01 * omega), at=(omega,), low=5, high=5, selection="always_high", peak_points=0
    )
    problems = [forced_problem(s, load, sweep) for s in (plain, frozen)]
    (point,) = ss.forced_response(plain, load, sweep)
    assert point.converged
    x = problems[0].high.unknowns(point.coefficients)
    one, other = (problem.high.linearise(x, omega) for problem in problems)
    states = problems[0].high.contacts(x, omega).state[:, 0]
    assert all(1 in own for own in states.tolist())
    scale = np.abs(one.dense_jac()).max()
    np.testing.assert_allclose(other.dense_jac(), one.dense_jac(), rtol=0, atol=1e-12 * scale)
    np.testing.assert_allclose(other.residual, one.residual, rtol=0, atol=1e-12)


def test_time_integration_from_the_static_state_attains_the_same_stuck_motion():
    frozen = frozen_sliders(wedged(damping=200.0), PULL, 0.5)
    interface, laws = frozen.interface, frozen.interface.laws
    static = preload(frozen, PULL)
    start = TransientStart(static, np.zeros(2), rest(2, laws).states)
    load = HarmonicLoad(PULL, {1: SHAKE})
    result = integrate(
        frozen.structure,
        interface.gap_operator,
        laws,
        load,
        OMEGA,
        np.array([0, 1]),
        start,
        TimeStepping(steps_per_period=4096, tolerance=1e-9),
    )
    balance = balance_of(frozen, SHAKE)
    q = balance.coefficients(solved(balance, frozen))
    assert result.settled
    np.testing.assert_allclose(result.harmonics[1], q[1], rtol=0, atol=1e-6 * np.abs(q[1]).max())
    np.testing.assert_allclose(result.harmonics[0].real, static, rtol=0, atol=1e-9 * static[1])


LAWS = [
    (ss.ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.4, preload=5.0), "events"),
    (ss.ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.4, preload=5.0), "intervals"),
    (ss.ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.4, preload=5.0), "march"),
    (ss.CoupledCoulomb(k_t=1e6, k_n=3e6, mu=0.4, preload=5.0), "events"),
    (ss.CoupledCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.4, preload=5.0), "march"),
]


@pytest.mark.parametrize(("law", "evaluator"), LAWS)
@pytest.mark.parametrize("size", [1e-7, 3e-6])
def test_a_slider_moves_the_place_from_which_its_springs_are_stretched(law, evaluator, size):
    # stuck about a mean gap, and slipping: the same forces as of gaps that are measured from the slider
    rng = np.random.default_rng(7)
    gap = size * rng.standard_normal((5, 3))
    slider = (3e-6, -2e-6)
    there = gap.copy()
    there[0, :2] += slider
    moved = replace(law, slider=slider)
    expected = contact_forces(gap, compile_contacts([law], None, evaluator), 128)
    found = contact_forces(there, compile_contacts([moved], None, evaluator), 128)
    scale = np.abs(expected.force).max()
    np.testing.assert_allclose(found.force, expected.force, rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(found.blocks, expected.blocks, rtol=0, atol=1e-3)
    np.testing.assert_allclose(
        found.gap[0, :2].mean(axis=1), there[0, :2], rtol=0, atol=1e-18, err_msg="gaps as they are"
    )


def test_what_cannot_be_frozen_is_refused():
    for share in (0.0, 1.1, float("nan")):
        with pytest.raises(InputError, match="friction_share: must be above 0 to 1"):
            frozen_sliders(wedged(), PULL, share)
    system = wedged()
    law = system.interface.laws[0]
    for other, message in (
        (ss.Iwan(k_t=1e6, limit=10.0), "contact left: is Iwan, which has no single slider"),
        (replace(law, residual_traction=0.1), "contact left: has a residual traction"),
    ):
        interface = replace(system.interface, laws=(other, law))
        with pytest.raises(InputError, match=message):
            frozen_sliders(replace(system, interface=interface), PULL)
    with pytest.raises(InputError, match="both a slider and a residual traction"):
        replace(law, slider=(0.0, 0.0), residual_traction=0.1)
    with pytest.raises(InputError, match=r"slider: must be finite, got \(nan, 0.0\)"):
        replace(law, slider=(float("nan"), 0.0))


STUDY = """
schema_version = 2
title = "Two masses, pulled along a rubbing joint"
[part.chain]
shape = "lumped"
masses_kg = [1.0, 1.0]
springs_n_per_m = [["ground", 1, 4e4], [1, 2, 4e4]]
dashpots_n_s_per_m = [["ground", 1, 6.0], [1, 2, 6.0]]
[contact.joint]
between = ["chain.m2", "ground"]
law = "elastic_coulomb"
tangential_stiffness_n_per_m = 2e4
axial_stiffness_n_per_m = 0.0
normal_stiffness_n_per_m = 0.0
friction_coefficient = 0.5
preload_n = 20.0
[load.pull]
on = "chain.m2"
harmonic = 0
force_n = 100.0
[load.shaker]
on = "chain.m1"
force_n = 0.2
[forced_response]
frequency_hz = [8.0, 12.0]
points = 4
peak_points = 0
stability = "off"
static_friction_share = 0.5
[harmonics]
high = 3
[output]
points = { last = "chain.m2" }
peak = "last.x"
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_study_freezes_its_sliders(tmp_path):
    frozen = ss.Study.from_file(written(tmp_path, STUDY)).run().data
    # the pull wants more than the joint holds: half of mu N stays in the spring
    force = frozen["forced_response"]["static_force"].values.reshape(-1)
    assert abs(force[0]) == pytest.approx(0.5 * 0.5 * 20.0)
    without = STUDY.replace("static_friction_share = 0.5\n", "")
    plain = ss.Study.from_file(written(tmp_path, without)).run().data
    assert abs(plain["forced_response"]["static_force"].values.reshape(-1)[0]) == pytest.approx(10.0)


def test_a_study_that_cannot_freeze_says_which_contact(tmp_path):
    law = """law = "jenkins"
slip_limit_n = 10.0"""
    text = STUDY.replace('law = "elastic_coulomb"', law)
    text = text.replace("friction_coefficient = 0.5\npreload_n = 20.0\n", "")
    study = ss.Study.from_file(written(tmp_path, text))
    with pytest.raises(InputError, match=r"static_friction_share: contact joint.*is Jenkins"):
        study.run()
