"""Waves of a wheel that a fluid feeds and a friction ring bounds: limit cycles, stability against every wave, and who wins in time."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from flutter_wheel import MODE, MOVED, ONE_UNSTABLE, REFERENCE, SECTORS, TWO_UNSTABLE, flutter_wheel

import stickslip as ss
from stickslip.errors import InputError
from stickslip.reduction.aerodynamics import InfluenceCoefficients
from stickslip.response.nonlinear_modes import ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.curve import damping_over_amplitude, slip_amplitude
from stickslip.response.self_excited.cycles import LimitCycle, cycle_stability, limit_cycles
from stickslip.response.self_excited.in_time import Marched, march_periods, wave_history
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import SelfExcited, self_excited_motions
from stickslip.response.stability import multipliers, stability
from stickslip.response.stability.waves import growing_wave, point_disturbances
from stickslip.response.time.sectors import all_in_time, all_sectors, whole_wheel
from stickslip.response.time.start import start_from_harmonics

TIPS = MOVED + 4 * np.arange(SECTORS)


@cache
def cycles_of(two: bool) -> tuple[SelfExcited, list[LimitCycle]]:
    """The limit cycles of wave 2, in a fluid that feeds it alone, or wave 1 too."""
    system, load = flutter_wheel(2, 11, TWO_UNSTABLE if two else ONE_UNSTABLE)
    mode = stuck_modes(system, MODE)[-1]
    assert mode.unstable
    problem = self_excited_motions(system, load, mode, MOVED, Discretisation(order=11, samples=256))
    slips = slip_amplitude(problem)
    return problem, limit_cycles(problem, damping_over_amplitude(problem, (0.6 * slips, 15.0 * slips), 10))


def marched(whole, motion: np.ndarray, omega: float, periods: int, kick: float) -> Marched:
    """March all sectors from a motion, speeds disturbed in another share for each coordinate."""
    start = start_from_harmonics(whole.spread(motion), omega, whole.contacts.gap_operator, whole.contacts.laws)
    shares = 1.0 + kick * np.cos(2.4 * np.arange(whole.structure.n))
    start = replace(start, velocity=start.velocity * shares)
    return march_periods(whole.structure, whole.contacts, whole.load, omega, TIPS, start, periods, 256)


def test_modes_of_all_waves_have_the_damping_that_the_fluid_gives_them() -> None:
    ratios = [stuck_modes(flutter_wheel(k, 1, ONE_UNSTABLE)[0], MODE)[-1].ratio for k in range(SECTORS)]
    assert [k for k, ratio in enumerate(ratios) if ratio < 0] == [2]
    still = [stuck_modes(flutter_wheel(k, 1, TWO_UNSTABLE)[0], MODE)[-1].ratio for k in range(SECTORS)]
    assert [k for k, ratio in enumerate(still) if ratio < 0] == [1, 2]


@pytest.mark.parametrize("wave", [0, 5])
def test_a_mode_has_the_force_of_its_own_frequency(wave: int) -> None:
    """A force in quadrature and in proportion to the frequency is a dashpot, which the matrices hold without a table."""
    span = np.array([0.1, 3.0])
    rising = np.concatenate([share * ONE_UNSTABLE.values for share in span], axis=1)
    table = replace(ONE_UNSTABLE, values=rising, frequencies=REFERENCE * span)
    mode, other = (stuck_modes(flutter_wheel(wave, 1, fluid)[0], MODE)[-1] for fluid in (table, ONE_UNSTABLE))
    assert mode.omega == pytest.approx(other.omega, rel=1e-5)
    assert mode.ratio == pytest.approx(other.ratio, rel=1e-3)


@pytest.mark.validation
def test_the_smaller_cycle_of_the_only_unstable_wave_is_that_of_all_sectors_in_time() -> None:
    problem, cycles = cycles_of(False)
    small, large = cycles
    found = cycle_stability(problem, small)
    assert found.stability.verdict == "stable"
    assert abs(found.along - 1.0) < 1e-4
    grown = cycle_stability(problem, large)
    assert grown.stability.verdict == "unstable"
    assert grown.wave is not None
    assert grown.wave.wave == 2  # its own: friction cannot hold it any more
    full = problem.balance.linear.recover(small.omega, small.coefficients)
    after = marched(whole_wheel(problem.system), full, small.omega, 700, 1e-3)
    assert after.amplitude == pytest.approx(np.full(SECTORS, small.amplitude), rel=1e-4)
    assert after.frequency == pytest.approx(np.full(SECTORS, small.omega), rel=1e-4)
    history = wave_history(after)
    assert history.outcome == "one wave"
    assert history.waves == (2,)


def test_another_unstable_wave_is_named_and_leaves_the_cycle_in_time() -> None:
    problem, cycles = cycles_of(True)
    found = cycle_stability(problem, cycles[0])
    assert found.stability.verdict == "unstable"
    assert found.wave is not None
    assert found.wave.wave == 1
    assert found.wave.omega == pytest.approx(2 * math.pi * 620, rel=5e-3)
    full = problem.balance.linear.recover(cycles[0].omega, cycles[0].coefficients)
    periods = 320
    after = marched(whole_wheel(problem.system), full, cycles[0].omega, periods, 1e-5)
    history = wave_history(after)
    # wave 1 grows by as much as its multiplier says, as long as it is small
    gained = (history.amplitude[-1, 1] / history.amplitude[9, 1]) ** (1.0 / (periods - 10 * 16))
    assert gained == pytest.approx(found.stability.multiplier, abs=4e-4)
    assert history.amplitude[-1, 1] < 0.02 * history.amplitude[-1, 2]


def forced(force: float, fluid: InfluenceCoefficients = ONE_UNSTABLE):
    """A forced motion of wave 1, near its resonance."""
    system, load = flutter_wheel(1, 9, fluid, force)
    omega = 2 * math.pi * 619.5
    sweep = ss.Sweep(
        omega_range=(omega, 1.0001 * omega), low=9, high=9, selection="always_low", frequencies=2, peak_points=0
    )
    problem = ss.response.forced_problem(system, load, sweep)
    point = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))[0]
    assert point.converged
    return problem, point, load


def test_a_forced_motion_is_left_by_an_unstable_wave_unless_it_slips_enough() -> None:
    """Where the forced wave 1 sticks, wave 2 grows out of it; where it slips, its friction damps wave 2 and keeps the tuned motion."""
    for force, word in ((0.3, "unstable"), (2.0, "stable")):
        problem, point, load = forced(force)
        found = stability(problem, point)
        assert found.verdict == word
        whole = all_sectors(problem.system, load, every=True)
        full = problem.low.linear.recover(point.omega, point.coefficients)
        history = wave_history(marched(whole, full, point.omega, 480, 1e-3))
        others = history.amplitude.copy()
        others[:, 1] = 0.0
        if word == "stable":
            assert found.transitions > 0
            assert history.waves == (1,)
            assert others[-1].max() < 0.3 * others[0].max()
        else:
            decisive = growing_wave(point_disturbances(problem, point), found.multiplier)
            assert decisive is not None
            assert decisive.wave == 2
            assert decisive.nodal_diameter(SECTORS) == 2
            gained = (others[-1, 2] / others[10, 2]) ** (1.0 / (16 * (len(others) - 11)))
            assert gained == pytest.approx(found.multiplier, abs=1e-3)


def test_a_share_of_the_period_has_the_multipliers_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wave 2 of six sectors makes three shares; force 2 N on wave 1 six, with slip in all sectors."""
    problem, cycles = cycles_of(False)
    forced_problem, point, _ = forced(2.0)
    gaps = [
        (problem.system, cycles[0].coefficients @ problem.balance.interface.gap_operator.T, cycles[0].omega),
        (forced_problem.system, point.coefficients @ forced_problem.low.interface.gap_operator.T, point.omega),
    ]
    for (system, own, omega), shares in zip(gaps, (3, 6), strict=True):
        found = all_in_time(system, own)
        assert found.shares == shares
        _, matrix, powers = multipliers.period_matrix(found, omega)
        assert powers == shares
        few = np.sort(np.abs(np.linalg.eigvals(matrix)) ** powers)[::-1]
        monkeypatch.setattr(multipliers, "share_of_monodromy", lambda *_: None)
        _, matrix, powers = multipliers.period_matrix(found, omega)
        monkeypatch.undo()
        assert powers == 1
        every = np.sort(np.abs(np.linalg.eigvals(matrix)))[::-1]
        np.testing.assert_allclose(few[:40], every[:40], rtol=1e-10)


def test_of_a_wheel_without_all_its_waves_nothing_is_said() -> None:
    problem, point, _ = forced(0.3)
    wheel = problem.system.structure
    few = replace(wheel, waves={k: s for k, s in wheel.waves.items() if k % 2 == 0})
    with pytest.raises(InputError, match="has no wave"):
        stability(replace(problem, system=replace(problem.system, structure=replace(few, engine_order=2))), point)


@pytest.mark.validation
@pytest.mark.parametrize("concept", ["periodic", "decaying"])
def test_nonlinear_modes_of_each_wave_begin_with_its_damping_in_the_flow_and_cross_zero_at_its_limit_cycle(
    concept,
) -> None:
    begun = []
    for k in (2, 4):
        system, load = flutter_wheel(k, 3, ONE_UNSTABLE)
        mode = stuck_modes(system, MODE)[-1]
        problem = self_excited_motions(system, load, mode, MOVED, Discretisation(order=3))
        slips = slip_amplitude(problem)
        last = 15.0 if concept == "periodic" else 0.8
        sweep = ModeSweep(span=(0.6 * slips, last * slips), points=6, concept=concept)
        found = nonlinear_mode(system, load, mode, MOVED, Discretisation(order=3), sweep)
        assert found.end.startswith("amplitude reached")
        begun.append(found.points[0].ratio)
        # a decaying linear motion is that of the eigenvalue, a steady one to the square of the damping
        assert found.points[0].ratio == pytest.approx(mode.ratio, rel=1e-8 if concept == "decaying" else 1e-3)
        assert found.points[0].omega == pytest.approx(mode.omega, rel=1e-4)
        if k == 2 and concept == "periodic":
            assert "gross slip from" in found.end
            a, z = np.array([(p.amplitude, p.ratio) for p in found.solutions]).T
            at = int(np.flatnonzero((z[:-1] < 0.0) & (z[1:] >= 0.0))[0])
            curve = damping_over_amplitude(problem, (0.5 * a[at], 2.0 * a[at + 1]), 5)
            cycle = limit_cycles(problem, curve)[0]
            assert a[at] < cycle.amplitude < a[at + 1]
    assert begun[0] < 0.0 < begun[1]
