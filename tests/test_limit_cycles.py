"""Limit cycles of motions that nothing drives: published numbers of flutter that friction bounds, their stability, and motions in time."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.contact.interface import Interface
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.travelling import condense_side
from stickslip.model.matrices import lumped
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited import modes
from stickslip.response.self_excited.curve import (
    AmplitudePoint,
    damping_over_amplitude,
    parameter_over_amplitude,
    slip_amplitude,
)
from stickslip.response.self_excited.cycles import cycle_stability, limit_cycles
from stickslip.response.self_excited.in_time import march_periods, wave_history
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.response.system import System
from stickslip.response.time.start import start_from_harmonics
from stickslip.solve.newton_method import Newton

# literature benchmark B13: c, then amplitude and frequency of the stable and of the unstable cycle
ONE = (
    (-0.01, 0.2040000019, 1.2237986674, 12.5183020, 1.0008525857),
    (-0.05, 0.2238745559, 1.2130143566, 2.3008975711, 1.0105328175),
    (-0.10, 0.2656867890, 1.1848086907, 0.9773932296, 1.0361251606),
)
MANY = (
    (-0.01, 0.2040575334, 1.2237911854, 12.5224067, 1.0008431708),
    (-0.05, 0.2244016171, 1.2128768722, 2.3074466413, 1.0103586781),
    (-0.10, 0.2671717597, 1.1843531238, 0.9840322764, 1.0355537241),
)
LARGEST, AT = 0.1429382, 2.137483 * 0.2  # the most that friction bounds, and the amplitude there


def oscillator(c: float) -> tuple[System, HarmonicLoad]:
    """A mass on a spring with a damper that slips, and a dashpot that feeds it."""
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    contacts = Interface(("damper",), (Jenkins(k_t=0.5, limit=0.1),), gap)
    return System(lumped(np.eye(1), np.eye(1), c * np.eye(1)), contacts, np.array([0])), HarmonicLoad(np.zeros(1))


def motions(c: float, how: Discretisation) -> SelfExcited:
    system, load = oscillator(c)
    return self_excited_motions(system, load, stuck_modes(system, 1)[0], 0, how)


def curve(problem: SelfExcited, last: float = 100.0) -> list[AmplitudePoint]:
    slips = slip_amplitude(problem)
    assert slips == pytest.approx(0.2, rel=0.02)
    points = damping_over_amplitude(problem, (0.5 * slips, last * slips), 30)
    assert all(p.converged for p in points)
    return points


@pytest.mark.parametrize("whole", [400, 10])
def test_modes_that_grow_are_those_of_the_eigenvalues_with_coriolis_and_flow(whole, monkeypatch):
    monkeypatch.setattr(modes, "WHOLE", whole)
    rng = np.random.default_rng(4)
    n, number = 60, 5
    turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
    stiffness = turn @ np.diag(np.linspace(1.0, 60.0, n) ** 2) @ turn.T
    skew, flow = rng.standard_normal((2, n, n))
    damping = 1e-3 * np.eye(n) + 0.1 * (skew - skew.T)
    stiffness += 0.02 * flow
    gap = np.zeros((3, n))
    gap[0, 3] = 1.0
    contacts = Interface(("damper",), (Jenkins(k_t=0.5, limit=0.1),), gap)
    own = replace(lumped(np.eye(n), np.eye(n)), stiffness=stiffness.copy(), damping=damping)
    found = stuck_modes(System(own, contacts, np.array([0])), number)
    stiffness[3, 3] += 0.5
    values = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]]))
    values = values[values.imag > 0]
    values = values[np.argsort(values.imag)][:number]
    assert np.any(values.real > 0)
    assert np.any(values.real < 0)
    np.testing.assert_allclose([m.omega for m in found], np.abs(values), rtol=1e-6)
    np.testing.assert_allclose([m.ratio for m in found], -values.real / np.abs(values), rtol=1e-3, atol=1e-7)


@pytest.mark.parametrize(("rows", "order"), [(ONE, 1), (MANY, 21)])
def test_both_limit_cycles_of_the_benchmark_to_its_digits(rows, order):
    """Its numbers with 21 harmonics are those of 4096 samples a period: with no sampling error at all they differ by up to 3e-7."""
    how = Discretisation(order=order, newton=Newton(tolerance=1e-13))
    if order > 1:
        how = replace(how, samples=4096, evaluator="intervals")
    for c, small, fast, large, slow in rows:
        problem = motions(c, how)
        stable, unstable = limit_cycles(problem, curve(problem))
        assert stable.amplitude == pytest.approx(small, abs=6e-11)
        assert unstable.amplitude == pytest.approx(large, abs=6e-11 if large < 10 else 6e-8)
        assert stable.omega == pytest.approx(fast, abs=6e-11)
        assert unstable.omega == pytest.approx(slow, abs=6e-11)
        assert stable.attracting
        assert not unstable.attracting


def test_there_is_none_beyond_what_friction_can_dissipate():
    # ζ = c / 2ω of the mode alone, where nothing slips
    problem = motions(-1.0001 * LARGEST, Discretisation(order=1))
    points = curve(problem)
    assert points[0].level == pytest.approx(-0.5 * 1.0001 * LARGEST / np.sqrt(1.5), rel=1e-9)
    assert limit_cycles(problem, points) == []
    # just below it both lie close beside the motion of most damping, which no point of the curve need be
    problem = motions(-0.99999 * LARGEST, Discretisation(order=1))
    assert len(limit_cycles(problem, curve(problem))) == 2


def test_the_damping_that_a_cycle_of_given_amplitude_needs_has_the_published_maximum():
    problem = motions(-0.1, Discretisation(order=1))
    cycle = limit_cycles(problem, curve(problem))[0]
    points = parameter_over_amplitude(problem, oscillator, -0.1, cycle.unknowns, (cycle.amplitude, AT), 10)
    assert points[-1].amplitude == pytest.approx(AT, rel=1e-12)
    assert points[-1].level == pytest.approx(-LARGEST, abs=6e-8)
    # the limit of the damper scales all amplitudes: with c as it is, that of a cycle is proportional to it
    scaled = parameter_over_amplitude(problem, "limit", 0.1, cycle.unknowns, (cycle.amplitude, 3 * cycle.amplitude), 5)
    assert [p.level for p in scaled] == pytest.approx([0.1 * p.amplitude / cycle.amplitude for p in scaled], rel=1e-7)


def test_harmonics_are_raised_until_the_amplitude_stays_and_multipliers_say_what_the_slope_says():
    few = motions(-0.1, Discretisation(order=1, samples=512))
    points = curve(few)
    one, _ = limit_cycles(few, points)
    assert np.isnan(one.change)
    assert not one.enough
    first, second = limit_cycles(few, points, most_harmonics=70)
    assert abs(one.amplitude / first.amplitude - 1.0) > 1e-3  # though its energy closes
    for cycle, word in ((first, "stable"), (second, "unstable")):
        assert cycle.enough
        assert cycle.order >= 15
        found = cycle_stability(few.with_order(cycle.order), cycle)
        assert abs(found.along - 1.0) < 3e-5
        assert found.stability.verdict == word
        # the growth over a period by the slope of the damping, which is one of small changes
        rate = np.exp(-2.0 * np.pi * cycle.slope)
        assert (found.stability.multiplier > 1.0) == (rate > 1.0)
    # the limited search says that it was not enough
    short = limit_cycles(few, points, most_harmonics=3)[0]
    assert not short.enough


@pytest.mark.parametrize("c", [-0.01, -0.1])
def test_time_integration_goes_to_the_stable_cycle_and_away_from_the_unstable_one(c):
    problem = motions(c, Discretisation(order=5, samples=512))
    small, large = limit_cycles(problem, curve(problem), most_harmonics=60)
    system, load = oscillator(c)

    def marched(cycle, factor, periods, settles=0.0):
        start = start_from_harmonics(
            factor * cycle.coefficients, cycle.omega, system.interface.gap_operator, system.interface.laws
        )
        return march_periods(
            system.structure, system.interface, load, cycle.omega, np.array([0]), start, periods, 1024, settles=settles
        )

    for factor in (0.8, 1.3):
        found = marched(small, factor, 60)
        assert found.amplitude[0] == pytest.approx(small.amplitude, rel=2e-5)
        assert found.frequency[0] == pytest.approx(small.omega, rel=2e-5)
    assert wave_history(marched(small, 1.05, 120)).outcome == "one wave"
    # away from the unstable one, to either side, over a range of 2e-4
    below, above = (marched(large, f, 12) for f in (0.9999, 1.0001))
    assert below.amplitude[0] < 0.99995 * large.amplitude
    assert above.amplitude[0] > 1.00005 * large.amplitude


def test_where_slip_begins_is_found_beside_a_large_static_displacement():
    """A second mass that never slips is pushed away by ten thousand times the amplitude at which the first one does."""
    gap = np.zeros((6, 2))
    gap[0, 0] = gap[3, 1] = 1.0
    laws = Jenkins(k_t=0.5, limit=0.1), Jenkins(k_t=0.5, limit=1e9)
    structure = lumped(np.eye(2), np.diag([1.0, 4.0]), np.diag([-0.1, 0.1]))
    system = System(structure, Interface(("slips", "sticks"), laws, gap), np.array([0]))
    load = HarmonicLoad(np.array([0.0, 1e4]))
    problem = self_excited_motions(system, load, stuck_modes(system, 1)[0], 0, Discretisation(order=1))
    slips = slip_amplitude(problem)
    assert slips == pytest.approx(0.2, rel=0.02)
    points = damping_over_amplitude(problem, (0.5 * slips, 100.0 * slips), 20)
    assert all(p.converged for p in points)
    small, large = limit_cycles(problem, points)
    assert small.amplitude == pytest.approx(ONE[2][1], rel=1e-7)
    assert large.amplitude == pytest.approx(ONE[2][3], rel=1e-7)


def test_what_has_no_limit_cycle_is_refused():
    system, load = oscillator(-0.1)
    mode, how = stuck_modes(system, 1)[0], Discretisation()
    driven = HarmonicLoad(np.zeros(1), {1: np.ones(1)})
    with pytest.raises(InputError, match="a harmonic load acts"):
        self_excited_motions(system, driven, mode, 0, how)
    rigid = replace(system.interface, laws=(RigidCoulomb(mu=0.3, preload=1.0),))
    with pytest.raises(InputError, match="a contact is rigid"):
        self_excited_motions(replace(system, interface=rigid), load, mode, 0, how)
    still = replace(mode, shape=np.array([0.0, 1.0], dtype=complex))
    with pytest.raises(InputError, match="hardly moves"):
        self_excited_motions(system, load, still, 0, how)
    held = replace(system.interface, laws=(Jenkins(k_t=0.5, limit=1e30),))
    problem = self_excited_motions(replace(system, interface=held), load, mode, 0, how)
    with pytest.raises(InputError, match="no contact slips"):
        slip_amplitude(problem)


@pytest.mark.parametrize("how", ["one structure", "modal waves", "solved waves"])
def test_damping_by_mass_is_that_of_matrices_with_it(how):
    rng, rate = np.random.default_rng(3), 0.07
    root = rng.normal(size=(7, 7)) + (0j if how == "one structure" else 1j) * rng.normal(size=(7, 7))
    root = root.real if how == "one structure" else root
    stiffness, mass = root @ root.conj().T + np.eye(7), np.diag(rng.uniform(1, 2, 7))
    damping = 0.02 * stiffness + (0.05 * rng.normal(size=(7, 7)) if how == "solved waves" else 0.0)
    plain = replace(lumped(np.eye(7), np.eye(7)), mass=mass, stiffness=stiffness, damping=damping)
    shifted = replace(plain, damping=damping + rate * mass)
    force = HarmonicLoad(np.ones(7), {1: np.ones(7) * (1 + 0.5j)})
    kept = np.array([0, 3])
    ours = condense_side(plain, kept, force, 2).with_mass_damping(rate)
    theirs = condense_side(shifted, kept, force, 2)
    for name in ("stiffness", "derivative", "load", "load_derivative"):
        own, other = (getattr(side.condensed(0.9, 2), name) for side in (ours, theirs))
        np.testing.assert_allclose(own, other, rtol=1e-10, atol=1e-12)
    moved = np.ones((3, 2), dtype=complex)
    np.testing.assert_allclose(ours.recover(0.9, moved), theirs.recover(0.9, moved), rtol=1e-10)
