"""The harmonics towards which solutions are judged, and what is said of solutions that are silent on fewer."""

import math
from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from evidence.models.lumped import chain_stiffness, jenkins, lumped, system
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.harmonic.judging import UNSEEN, covers, judging_balance, judging_set, loudest, ringing
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.response.forced.amplitude import amplitudes
from stickslip.response.nonlinear_modes import Backbone, ModeSweep, nonlinear_mode
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions.bounds import TractionBounds, traction_bounds
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.verification import own_error

HERTZ = (10.5, 12.5)
STEPS = 9


def chain(harmonic: int) -> tuple[ss.System, ss.HarmonicLoad]:
    """Return four masses in a row with two sliders of constant limits, whose forces are odd, under a force in one harmonic."""
    k = chain_stiffness(4, 4e4)
    gaps = np.zeros((6, 4))
    gaps[0, 1] = gaps[3, 3] = 1.0
    gaps[3, 2] = -1.0
    made = system(lumped(np.eye(4), 1.5e-4 * k, k), [jenkins(2e4, 2.0), jenkins(1e4, 1.0)], gaps)
    force = np.zeros(4, dtype=complex)
    force[0] = 5.0
    return replace(made, outputs=np.array([3])), ss.HarmonicLoad(np.zeros(4), {harmonic: force})


def response(harmonic: int = 1, **how: object) -> tuple[object, list[object]]:
    """Return problem and accepted points around the first resonance."""
    span = tuple(2 * np.pi * f / harmonic for f in HERTZ)
    sweep = ss.Sweep(omega_range=span, frequencies=STEPS, peak_points=0, **{"low": (0, harmonic), **how})  # type: ignore[arg-type]
    made, load = chain(harmonic)
    points = ss.response.accepted_points(list(ss.forced_response(made, load, sweep)))
    return ss.response.forced_problem(made, load, sweep), points


@pytest.mark.parametrize("kept", [(0, 1), (0, 2), (0, 1, 2), (0, 3, 5), (0, *range(1, 8))])
@pytest.mark.parametrize("driven", [(), (1,), (4,)])
def test_set_holds_what_quadratic_and_cubic_forces_feed(kept, driven):
    """Products of two and of three equal harmonics, by multiplication of the time series."""
    time = np.linspace(0, 2 * np.pi, 256, endpoint=False)
    found = judging_set(kept, driven)
    assert 0 in found
    own = sorted({*kept, *driven} - {0})
    assert found[-1] == 3 * own[-1]
    for a in own:
        for signal in (np.cos(a * time) ** 3, *(np.cos(a * time) * np.sin(b * time + 0.3) for b in own)):
            fed = np.flatnonzero(np.abs(np.fft.rfft(signal)) > 1e-9 * time.size)
            assert set(fed.tolist()) <= set(found)


def test_set_is_all_multiples_of_what_is_kept_up_to_three_times_the_highest():
    assert judging_set((0, 2), (2,)) == (0, 2, 4, 6)
    assert judging_set((0, 1)) == (0, 1, 2, 3)
    assert judging_set((0, 4, 6)) == tuple(range(0, 19, 2))
    assert judging_set((0,)) == (0,)


def test_harmonics_of_auto_follow_the_load():
    sweep = ss.Sweep(omega_range=(1.0, 2.0), low=(0, 2), cap=82)
    assert sweep.supports[1] == (0, 2, 4, 6, 8, 10)
    assert [s[-1] for s in sweep.supports] == [2, 10, 18, 30, 50, 82]
    assert replace(sweep, cap=41).supports[-1] == tuple(range(0, 41, 2))
    assert replace(sweep, low=(0, 1, 2), cap=41).supports[1] == harmonics_of(5)


def test_force_in_harmonic_2_is_that_of_harmonic_1_at_twice_the_frequency():
    """The same motion with the same judgement: a period may be called half of another."""
    (_, ones), (_, twos) = response(1), response(2)
    assert len(ones) == len(twos)
    for one, two in zip(ones, twos, strict=True):
        assert two.support == tuple(2 * h for h in one.support)
        size = np.max(np.abs(one.coefficients))
        np.testing.assert_allclose(two.coefficients[::2], one.coefficients, atol=1e-7 * size)
        assert two.predicted_error == pytest.approx(one.predicted_error, rel=1e-3, abs=1e-6)


def test_even_silence_is_not_exact():
    """Of harmonic 1 alone odd forces feed 3: twice the order hears nothing, the judging set hears an error that is the true one."""
    problem, few = response(1, high=1)
    _, many = response(1, low=15, high=15, selection="always_high")
    said = np.array([own_error(problem, p) for p in few])
    true = np.array([problem.real_error(p, m) for p, m in zip(few, many, strict=True)])
    assert max(true) > 0.2
    assert np.all(said[true > 0.05] > 0.05)
    checks = ss.response.check_support(problem, few)
    assert checks[0].harmonics == (0, 1, 2, 3)
    assert max(c.error for c in checks) > 0.2


def test_exact_is_what_nothing_acts_on():
    """Below the onset of slip a solution is exact with one harmonic; a mean that never slips changes nothing of it."""
    problem, points = response(1, high=1)
    soft = replace(problem.low.linear.load, harmonics={1: 1e-3 * problem.low.linear.load.harmonics[1]})
    sweep = problem.sweep
    quiet = ss.response.forced_problem(problem.system, soft, sweep)
    for p in ss.response.accepted_points(list(ss.forced_response(problem.system, soft, sweep))):
        assert own_error(quiet, p) == 0.0
    assert own_error(problem, points[0]) > 0.0


def test_reference_without_the_odd_harmonics_is_not_enough():
    """A strategy that is asked for a reference of 0, 1, 2 looks at 3 by itself."""
    made, load = chain(1)
    sweep = ss.Sweep(omega_range=(60.0, 80.0), low=1, high=2, at=(2 * math.pi * 11.3,), peak_points=0)
    for name in ("guarded_alert", "goal_oriented"):
        named = replace(sweep, selection=name)
        first = next(p for p in ss.forced_response(made, load, named) if p.stage == "low")
        assert first.predicted_error > 0.05


def test_wheel_with_too_few_waves_is_not_called_exact():
    """A balance that cannot hold its judging set does not cover it, and an error of nothing is not exactness."""
    problem, _ = response(1, high=1)
    low = problem.low
    assert covers(low, judging_balance(low))
    assert not covers(low, low.with_harmonics((0, 1, 2)))
    assert UNSEEN > 0.0


def test_mode_of_one_and_two_harmonics_hears_the_third():
    """Friction of a mode is odd: with up to two harmonics the difference is nothing, and the damping a third off."""
    made, load = chain(1)
    mode = stuck_modes(made, 1)[0]
    rest = ss.HarmonicLoad(load.static)
    span = (1e-4, 3e-3)

    def backbone(order: int, most: int) -> Backbone:
        sweep = ModeSweep(span=span, points=5, most_harmonics=most)
        return nonlinear_mode(made, rest, mode, 3, Discretisation(order=order), sweep)

    few = backbone(1, 2)
    said = np.array([p.change for p in few.solutions])
    assert np.max(said) > 0.02
    more = np.array([p.change for p in backbone(5, 23).solutions])
    slips = 1e-10  # of what sticks nothing acts on any harmonic
    assert np.median(said[said > slips]) > 20 * np.median(more[more > slips])


# ---- what an error is relative to, and what an amplitude is ------------------------------------------------------------


def test_largest_change_of_an_output_decides():
    """As vectors, relative to the output or to 1 % of the largest of its unit: an output that stands still is no doubt, rotations stand apart."""
    before = np.zeros((3, 5), dtype=complex)
    before[1] = [1.0, 0.5j, 1e-4, 1e-5, 2e-5]
    moved = np.zeros((3, 5), dtype=complex)
    moved[1] = [0.01, 0.02, 1e-4, 1e-6, 0.0]
    units = np.array([0, 0, 0, 1, 1])
    measure = ErrorMeasure(np.arange(5), (1,), units)
    # 0.01 / 1, 0.02 / 0.5, 1e-4 / 0.01, and of the rotations 1e-6 / 1e-5
    error, place, harmonic = measure.change(before, moved)
    assert (error, place, harmonic) == (pytest.approx(0.1), 3, 1)
    assert ErrorMeasure(np.arange(3), (1,), units[:3]).change(before, moved)[0] == pytest.approx(0.04)
    assert ErrorMeasure(np.array([2, 0]), (1,), units[:2]).change(before, moved)[0] == pytest.approx(0.01)
    # a unit in which nothing moves at all
    before[1, 3:] = moved[1, 3:] = 0.0
    assert measure.change(before, moved)[0] == pytest.approx(0.04)


def test_several_driven_harmonics_are_one_vector():
    before, moved = np.zeros((3, 1), dtype=complex), np.zeros((3, 1), dtype=complex)
    before[1:, 0], moved[1:, 0] = [3.0, 4.0], [0.0, 1.0]
    assert ErrorMeasure(np.array([0]), (1, 2), np.array([0])).change(before, moved)[0] == pytest.approx(0.2)
    assert ErrorMeasure(np.array([0]), (1, 2)).change(before, moved)[0] == pytest.approx(0.25)


def test_units_do_not_change_an_error():
    rng = np.random.default_rng(3)
    before, moved = (rng.normal(size=(4, 6)) + 1j * rng.normal(size=(4, 6)) for _ in range(2))
    measure = ErrorMeasure(np.arange(6), (1, 3), np.array([0, 1, 0, 1, 1, 0]))
    scale = np.where(measure.units == 0, 1e3, 2.0)
    assert measure.change(before * scale, moved * scale) == pytest.approx(measure.change(before, moved))


def test_change_of_the_whole_motion_counts_harmonics_that_were_missing():
    before, moved = np.zeros((2, 1), dtype=complex), np.zeros((4, 1), dtype=complex)
    before[1], moved[3] = 1.0, 0.3
    whole = ErrorMeasure(np.array([0]), None, np.array([0]))
    assert whole.rows(2, 4) == 4
    assert whole.change(before, moved) == (pytest.approx(0.3), 0, 3)


@pytest.mark.parametrize("order", [1, 3, 9])
def test_amplitudes_are_those_of_the_time_series(order):
    rng = np.random.default_rng(order)
    motion = rng.normal(size=(order + 1, 3)) + 1j * rng.normal(size=(order + 1, 3))
    motion[0] = motion[0].real + 5.0
    angle = np.linspace(0, 2 * np.pi, 40_000, endpoint=False)
    signal = np.real(np.exp(1j * np.outer(angle, np.arange(order + 1))) @ motion)
    ptp = amplitudes(motion, (1,), "half_peak_to_peak")
    # of 40000 samples the highest is below the extreme by its curvature over half a step
    left = (np.pi / 40_000) ** 2 * (np.arange(order + 1)[:, None] ** 2 * np.abs(motion)).sum(axis=0)
    assert np.all(ptp - 0.5 * np.ptp(signal, axis=0) <= left)
    assert np.all(ptp - 0.5 * np.ptp(signal, axis=0) >= -1e-12)
    np.testing.assert_allclose(amplitudes(motion, (1,), "rms"), signal.std(axis=0), rtol=1e-12)
    np.testing.assert_allclose(amplitudes(motion, (1,), "first"), np.abs(motion[1]), rtol=1e-12)


PLANE = """schema_version = 2
title = "Sliding in the plane under a normal force that varies"
[part.mass]
shape = "lumped"
masses_kg = [1.0]
springs_n_per_m = [["ground", 1, 3e4]]
dashpots_n_s_per_m = [["ground", 1, 5.0]]
[contact.stop]
between = ["mass.m1", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 2e4
slip_limit_n = 2.0
[load.shaker]
on = "mass.m1"
force_n = 4.0
[forced_response]
frequencies_hz = [9.2]
peak_points = 0
stability = "off"
[output]
points = { p = "mass.m1" }
"""


@pytest.mark.parametrize("measure", ["first", "half_peak_to_peak", "rms"])
def test_study_tells_the_amplitude_that_it_measures(tmp_path, measure):
    """Dataset, axis and peak of each measure agree with the motion; the third harmonic near resonance is told where it is left out."""
    (tmp_path / "study.toml").write_text(f'{PLANE}measure = "{measure}"\n')
    data = ss.Study.from_file(tmp_path / "study.toml").run().data["forced_response"]
    motion = data.output_displacement.values[0, :, :, 0] + 1j * data.output_displacement.values[0, :, :, 1]
    own = amplitudes(motion, (1,), measure)
    assert data.attrs["amplitude_of"] == measure
    np.testing.assert_allclose(data.amplitude.values[0], own, rtol=1e-12)
    assert float(data.peak_amplitude[0]) == pytest.approx(float(own[0]))


def test_bounds_over_residual_tractions_hear_the_third_harmonic():
    """Near the resonance: with one harmonic the bounds are predicted to be off, as they are; with nine they are not."""
    made, load = chain(1)
    omega = 2 * math.pi * 11.4

    def bounds(order: int) -> TractionBounds:
        return next(iter(traction_bounds(made, load, [omega], 0, Discretisation(order=order))))

    few, many = bounds(1), bounds(9)
    assert abs(few.most.amplitude / many.most.amplitude - 1.0) > 0.1
    assert min(few.most.error, few.reference.error) > 0.05
    assert max(many.most.error, many.reference.error) < 0.02


def test_a_harmonic_beyond_the_set_that_meets_a_mode_is_judged() -> None:
    """A stop's harmonics fall with their order, but the 16th meets the second mode, of ratio 0.001."""
    stiff = np.diag([1.0, 256.0])
    made = system(
        lumped(np.eye(2), np.diag([0.1, 0.032]), stiff),
        [ss.UnilateralSpring(k_n=20.0, initial_gap=0.5)],
        np.array([[0.0, 0.0], [0.0, 0.0], [-1.0, -1.0]]),
    )
    load = ss.HarmonicLoad(np.zeros(2), {1: np.array([0.1 + 0j, 0.0])})
    sweep = ss.Sweep(omega_range=(0.99, 1.01), low=5, high=5, at=(1.0,), peak_points=0)
    problem = ss.response.forced_problem(made, load, sweep)
    (point,) = ss.response.accepted_points(list(ss.forced_response(made, load, sweep)))
    low = problem.balance(harmonics_of(5))
    assert 16 in ringing(low, low.unknowns(point.coefficients), point.omega)


@pytest.mark.parametrize(
    ("sizes", "found"),
    [
        ([1.0, 0.5, 0.3, 0.2, 0.1], ()),
        ([1.0, 0.5, 0.7, 0.2, 0.3], (17, 19)),
        ([1.0, 0.5e-4, 0.9e-4, 0.2e-4, 0.1e-4], ()),
        ([0.0, *(float(k % 2) * k for k in range(1, 12))], (20, 22, 24, 26)),
    ],
)
def test_harmonics_that_stand_out_are_few(sizes: list[float], found: tuple[int, ...]) -> None:
    """Maxima alone, not the fall with the order, nor what is too small, and the four largest."""
    assert loudest(tuple(range(15, 15 + len(sizes))), np.array(sizes)) == found
