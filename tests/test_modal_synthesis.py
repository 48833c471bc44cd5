"""Nonlinear modal synthesis: forced responses and passages from one backbone, against closed forms, direct solutions and small steps in time."""

from dataclasses import replace

import numpy as np
import pytest
from test_envelope import oscillator, swept_by_quadrature
from test_limit_cycles import ONE
from test_limit_cycles import oscillator as damped_by_friction

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.nonlinear_modes.backbone import Backbone, ModePoint, ModeSweep, nonlinear_mode
from stickslip.response.nonlinear_modes.more_points import refined
from stickslip.response.nonlinear_modes.passage import CELLS, Swept, _Table, passage_through_resonance
from stickslip.response.nonlinear_modes.sdof_oscillator import ModalOscillator, modal_oscillator
from stickslip.response.nonlinear_modes.single_mode_validity import (
    along,
    isolation,
    other_modes,
    slips_from,
    with_others,
)
from stickslip.response.nonlinear_modes.synthesis import (
    free_motions,
    is_homogeneous,
    motions_at,
    peak_curve,
    resonances,
    synthesise,
)
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.tracking import track_peak
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.system import System
from stickslip.solve.status import Status

# literature benchmark B3: friction limit, then peak and its frequency with one harmonic
PEAKS = (
    (0.02, 3.7388820, 1.000334),
    (0.05, 1.9693838, 1.004519),
    (0.1, 0.6260618, 1.065886),
    (0.14, 0.5509276, 1.119652),
    (0.5, 1.1288107, 1.211484),
)
EXACT = ((1.10, 0.56839426), (1.15, 0.46660338), (1.20, 0.38916153))  # of B3 at fc = 0.1: |X1|
PUSH = HarmonicLoad(np.zeros(1), {1: np.array([0.1])})


def point(amplitude, omega, ratio):
    motion = np.array([[0.0], [amplitude]], dtype=complex)
    return ModePoint(amplitude, omega, ratio, motion, amplitude, np.nan, 1, Status.CONVERGED)


def one_mass(amplitudes, omega, ratio, c=0.02):
    """Return the backbone of a unit mass from closed forms."""
    system, load = damped_by_friction(c)
    mode = replace(stuck_modes(system, 1)[0], omega=float(omega[0]), ratio=float(ratio[0]))
    points = tuple(point(*p) for p in zip(amplitudes, omega, ratio, strict=True))
    return Backbone(system, load, mode, 0, points, "")


def b4(limit, c=0.02, count=300):
    """Return the nonlinear mode of the oscillator of B3 and B4 with one harmonic, in closed form."""
    slips = limit / 0.5
    a = slips * np.geomspace(0.5, 300.0, count)
    theta = np.arccos(1.0 - 2.0 * np.minimum(slips / a, 1.0))
    stiffness = np.where(a > slips, 0.5 / np.pi * (theta - np.sin(2 * theta) / 2), 0.5)
    loss = np.where(a > slips, 4 * limit / (np.pi * a) * (1 - slips / a), 0.0)
    omega = np.sqrt(1.0 + stiffness)
    return one_mass(a, omega, (c + loss / omega) / (2.0 * omega), c)


def amplitude_at(own: ModalOscillator, omega: float) -> float:
    """Return the amplitude of the only steady motion at a frequency."""
    (place,) = motions_at(own, 1.0, omega)
    return float(own.at(np.array([place])).amplitude[0])


@pytest.mark.parametrize(("limit", "peak", "omega"), PEAKS)
def test_the_peaks_of_b3_come_out_of_the_mode_of_b4(limit, peak, omega):
    (found,) = resonances(modal_oscillator(b4(limit), PUSH), 1.0)
    assert found.amplitude == pytest.approx(peak, rel=1e-5)
    assert found.omega == pytest.approx(omega, rel=1e-5)


def test_a_followed_mode_gives_the_exact_response_to_a_thousandth():
    system, load = damped_by_friction(0.02)
    mode = stuck_modes(system, 1)[0]
    sweep = ModeSweep(span=(0.1, 20.0), points=60)
    backbone = nonlinear_mode(system, load, mode, 0, Discretisation(order=11), sweep)
    own = modal_oscillator(backbone, PUSH)
    for omega, exact in EXACT:
        place = motions_at(own, 1.0, omega)
        motion = own.displacement(place, np.array([0]))
        assert abs(motion[0, 1, 0]) == pytest.approx(exact, rel=1.5e-3)
        np.testing.assert_allclose(own.gaps(place)[:, :, 0], motion[:, :, 0])
    response = synthesise(own, 1.0)
    assert response.stable.all()
    assert response.amplitude.max() == pytest.approx(resonances(own, 1.0)[0].amplitude)


def test_a_level_is_met_at_every_point_and_the_phase_is_that_of_the_force():
    own = modal_oscillator(b4(0.1), PUSH)
    for level in (0.3, 1.0, 6.0):
        found = synthesise(own, level)
        here = own.at(found.place)
        motion = found.amplitude * np.exp(1j * found.phase)
        np.testing.assert_allclose(here.stiffness(found.omega) * motion, level * 0.1, rtol=2e-6)


def test_a_curve_passes_its_resonances_at_their_frequency_once_at_a_top():
    """A top is one point, between the rising and the falling side; a closed curve begins and ends at its least amplitude."""
    c, *_ = ONE[-1]
    for own, level in ((modal_oscillator(b4(0.1), PUSH), 1.0), (modal_oscillator(b4(0.1, c, 2000), PUSH), 0.05)):
        found, met = synthesise(own, level), resonances(own, level)
        assert met
        for one in met:
            assert found.omega[found.place == one.place].tolist() == [one.omega] * (1 if one.top else 2)


def test_a_hardening_spring_has_an_unstable_branch_between_its_folds():
    ratio, cubic = 0.01, 0.2
    a = np.geomspace(1e-3, 20.0, 300)
    omega = np.sqrt(1.0 + 0.75 * cubic * a**2)
    own = modal_oscillator(one_mass(a, omega, ratio / omega, c=2 * ratio), PUSH)
    found = synthesise(own, 1.0)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(found.omega))))
    assert turns.size == 2
    # squares of the amplitudes solve a cubic; folds are where its discriminant changes sign
    grid = np.linspace(1.05, 2.2, 4_000)
    q = (1 - grid**2) ** 2 + (2 * ratio * grid) ** 2
    three = np.array([2 * (1 - w**2) * 0.75 * cubic for w in grid])
    roots = [np.roots([(0.75 * cubic) ** 2, b, c, -0.01]) for b, c in zip(three, q, strict=True)]
    several = np.array([np.sum((r.real > 0) & (abs(r.imag) < 1e-9 * abs(r))) == 3 for r in roots])
    folds = grid[several][[0, -1]]
    assert sorted(found.omega[turns + 1]) == pytest.approx(folds, rel=3e-3)
    between = np.zeros(found.omega.size, dtype=bool)
    between[turns[0] + 3 : turns[1] - 1] = True
    assert not found.stable[between].any()
    assert found.stable[: turns[0] - 1].all()
    assert found.stable[turns[1] + 3 :].all()


def test_limit_cycles_are_zeros_of_the_damping_and_a_small_force_has_curves_around_them():
    for c, small, _, large, _ in ONE:
        own = modal_oscillator(b4(0.1, c, 2000), PUSH)
        amplitudes = own.at(free_motions(own)).amplitude
        assert amplitudes == pytest.approx([small, large], rel=1e-4)
    found = synthesise(own, 0.05)
    assert set(found.curve) == {0, 1, 2}
    tops = [r.top for r in resonances(own, 0.05)]
    assert tops == [True, False, True, False, True]
    attracting = (found.curve == 1) & (found.amplitude > small)
    assert found.stable[attracting].any()
    assert not found.stable[found.curve == 2].any()


@pytest.mark.parametrize("seconds", [5.0, 20.0])
def test_a_linear_passage_is_that_of_the_quadrature(seconds):
    system, load = oscillator(100.0, 0.01)
    ends = (70.0, 130.0)
    points = tuple(point(a, 100.0, 0.01) for a in np.geomspace(1e-6, 1.0, 8))
    own = modal_oscillator(Backbone(system, HarmonicLoad(load.static), stuck_modes(system, 1)[0], 0, points, ""), load)
    found = passage_through_resonance(own, 1.0, Swept(ends=ends, rate=60.0 / seconds))
    time, exact = swept_by_quadrature(100.0, 0.01, ends, seconds)
    assert found.finished
    assert found.amplitude.max() == pytest.approx(abs(exact).max(), rel=1e-4)
    assert found.amplitude == pytest.approx(np.interp(found.time, time, abs(exact)), abs=1e-4 * abs(exact).max())


@pytest.mark.parametrize("node", [0, 1, 2900, 3000, 3500, CELLS])  # it slips from about 2700 on
def test_a_steady_motion_does_not_change_on_the_grid_of_a_passage(node):
    """Any amplitude is steady at any frequency under the force that its stiffness needs; between nodes to the cell's square."""
    own = modal_oscillator(b4(0.1), PUSH)
    table = _Table.of(own)
    first, last = own.ends
    for beside, within in ((0.0, 1e-12), (0.5, 5e-6)):
        here = own.at(np.array([min(first + (last - first) * (node + beside) / CELLS, last)]))
        for omega in (0.9, 1.0, 1.2):
            stiffness = here.stiffness(np.array([omega]))[0]
            level = abs(stiffness) * here.amplitude[0] / abs(here.force[0])
            steady = level * here.force[0] / stiffness
            assert abs(table.slope(omega, complex(steady), level)) <= within * omega * abs(steady)
    assert table.largest == own.at(np.array([last])).amplitude[0]


def in_small_steps(limit, ends, seconds):
    """Return the motion of the mass of `oscillator` with 0.2 % damping and 30 % of its stiffness in the contact under a chirp of 10 N."""
    steps = int(seconds * max(ends) / (2 * np.pi) * 300)
    dt = seconds / steps
    time = np.arange(steps) * dt
    force = 10.0 * np.cos(ends[0] * time + (ends[1] - ends[0]) / seconds * time**2 / 2)
    place = speed = friction = largest = 0.0
    for f in force.tolist():
        speed += dt * (f - 0.4 * speed - 7e3 * place - friction)
        place += dt * speed
        friction = min(max(friction + 3e3 * dt * speed, -limit), limit)
        largest = max(largest, abs(place))
    return largest


@pytest.mark.parametrize(("limit", "ends", "away"), [(8.0, (115.0, 75.0), 0.008), (30.0, (75.0, 115.0), 0.004)])
def test_a_passage_with_friction_peaks_as_small_steps_in_time_do(limit, ends, away):
    system, _ = oscillator(100.0, 0.002, 0.3, limit)
    rest, mode = HarmonicLoad(np.zeros(1)), stuck_modes(system, 1)[0]
    backbone = nonlinear_mode(system, rest, mode, 0, Discretisation(order=5), ModeSweep(points=50))
    own = modal_oscillator(backbone, HarmonicLoad(np.zeros(1), {1: np.array([10.0])}))
    found = passage_through_resonance(own, 1.0, Swept(ends=ends, rate=4.0))
    turn = np.exp(1j * np.outer(np.arange(6), np.linspace(0.0, 2 * np.pi, 65)))
    size = np.abs((own.displacement(found.place)[:, :, 0] @ turn).real).max(axis=1)
    in_time = in_small_steps(limit, ends, 10.0)
    assert size.max() == pytest.approx(in_time, rel=away)
    assert size.max() < own.displacement(np.array([resonances(own, 1.0)[0].place]))[0, 1, 0].real


def test_what_the_synthesis_has_no_form_for_is_refused():
    backbone = b4(0.1)
    with pytest.raises(InputError, match="harmonic 3"):
        modal_oscillator(backbone, HarmonicLoad(np.zeros(1), {1: np.ones(1), 3: np.ones(1)}))
    with pytest.raises(InputError, match="no load"):
        modal_oscillator(backbone, HarmonicLoad(np.zeros(1)))
    with pytest.raises(InputError, match="static load"):
        modal_oscillator(replace(backbone, load=HarmonicLoad(np.ones(1))), PUSH)
    with pytest.raises(InputError, match="fewest"):
        modal_oscillator(replace(backbone, points=backbone.points[:3]), PUSH)
    own = modal_oscillator(backbone, PUSH)
    with pytest.raises(InputError, match="above zero"):
        resonances(own, -1.0)
    with pytest.raises(InputError, match="above zero"):
        Swept(ends=(1.0, 2.0), rate=-1.0)


def pair(spring: float):
    """Return two masses on a weak or strong spring between them, one with a slider to the ground, and a force on the other."""
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    stiffness = np.array([[1.0 + spring, -spring], [-spring, 1.0 + spring]])
    contacts = Interface(("c",), (Jenkins(k_t=0.2, limit=0.1),), gap)
    system = System(lumped(np.eye(2), stiffness, 0.01 * np.eye(2)), contacts, np.array([1]))
    return system, HarmonicLoad(np.zeros(2), {1: np.array([0.0, 0.02])})


def synthesis_of(system: System, load: HarmonicLoad) -> ModalOscillator:
    rest, how = HarmonicLoad(load.static), Discretisation(order=5)
    found = nonlinear_mode(system, rest, stuck_modes(system, 1)[0], 1, how, ModeSweep(points=30))
    return modal_oscillator(refined(found, load, how), load)


def test_a_mode_far_from_others_gives_the_peaks_of_the_direct_solution_and_says_so():
    system, load = pair(1.0)
    own = synthesis_of(system, load)
    others = other_modes(own)
    direct = track_peak(system, load, "excitation", (0.5, 1.0, 3.0), (0.9, 1.1), discretisation=Discretisation(order=5))
    for level, solved in zip((0.5, 1.0, 3.0), direct, strict=True):
        (found,) = resonances(own, level)
        amplitude = abs(own.displacement(np.array([found.place]), np.array([1]))[0, 1, 0])
        alone = isolation(others, found, 1)
        assert alone.foreign < 0.02
        assert amplitude == pytest.approx(solved.amplitude, rel=5e-3)
        assert found.omega == pytest.approx(solved.omega, rel=1e-3)


def test_a_mode_whose_neighbour_is_near_is_no_isolated_one_where_its_contact_slips():
    system, load = pair(0.03)
    own = synthesis_of(system, load)
    others = other_modes(own)
    assert others.distance(1.0) < 0.12
    (strong,) = resonances(own, 3.0)
    (direct,) = track_peak(system, load, "excitation", (3.0,), (0.9, 1.2), discretisation=Discretisation(order=5))
    amplitude = abs(own.displacement(np.array([strong.place]), np.array([1]))[0, 1, 0])
    assert abs(amplitude / direct.amplitude - 1.0) > 0.02
    assert isolation(others, strong, 1).foreign > 0.05


def test_with_the_other_modes_a_response_that_nothing_slips_in_is_exact():
    system, load = pair(0.03)
    own = synthesis_of(system, load)
    (low,) = resonances(own, 0.05)
    assert isolation(other_modes(own), low, 1).linear
    found = synthesise(own, 0.05)
    near = (found.omega > 0.8) & (found.omega < 1.4)
    motion = with_others(other_modes(own), found, np.array([0, 1]))
    matrix = system.stuck_structure().stiffness
    for omega, both in zip(found.omega[near], motion[near], strict=True):
        exact = np.linalg.solve(matrix - (omega**2 - 0.01j * omega) * np.eye(2), 0.05 * load.harmonics[1])
        np.testing.assert_allclose(both, exact, rtol=1e-5)


def test_along_a_curve_the_mode_is_alone_where_nothing_slips_or_little_of_the_others_is_felt():
    system, load = pair(1.0)
    own = synthesis_of(system, load)
    others = other_modes(own)
    low, high = (synthesise(own, level) for level in (0.05, 3.0))
    quiet, loud = (along(others, found, 1) for found in (low, high))
    np.testing.assert_allclose(loud.amplitude, np.abs(with_others(others, high, np.array([1]))[:, 0]))
    # others that move much are added exactly where nothing slips
    assert np.all(quiet.alone)
    assert np.max(quiet.share) > 0.2
    top = np.argmax(loud.amplitude)
    assert high.place[top] > slips_from(own)
    assert loud.alone[top]
    # a neighbour that is near moves as much as the mode does
    system, load = pair(0.03)
    own = synthesis_of(system, load)
    mixed = along(other_modes(own), synthesise(own, 3.0), 1)
    assert not mixed.alone[np.argmax(mixed.amplitude)]


def test_the_peaks_of_all_levels_are_one_curve_and_a_limit_of_its_own_is_no_homogeneous_law():
    own = modal_oscillator(b4(0.1), PUSH)
    curve = peak_curve(own, 0)
    assert curve.top.all()
    for limit, peak, _ in PEAKS[:4]:  # a limit s times as large is a level 1/s, s times as large
        share = limit / 0.1
        at = float(np.interp(1.0 / share, curve.level, curve.amplitude))
        assert share * at == pytest.approx(peak, rel=1e-4)
    assert not is_homogeneous(own)


def test_a_static_load_and_friction_of_a_coefficient_are_homogeneous():
    gap = np.zeros((3, 2))
    gap[0, 0] = gap[2, 1] = 1.0
    stiffness = np.diag([1.0, 0.5])
    law = ElasticCoulomb(k_t=0.5, k_w=0.5, k_n=0.5, mu=0.5, preload=0.0)
    system = System(lumped(np.eye(2), stiffness, 0.02 * np.eye(2)), Interface(("c",), (law,), gap), np.array([0]))
    rest = HarmonicLoad(np.array([0.0, -0.4]))
    mode = max(stuck_modes(system, 2), key=lambda m: abs(m.shape[0]))
    found = nonlinear_mode(system, rest, mode, 0, Discretisation(order=3), ModeSweep(span=(0.1, 4.0), points=8))
    own = modal_oscillator(found, HarmonicLoad(rest.static, {1: np.array([0.1, 0.0])}))
    assert is_homogeneous(own)
