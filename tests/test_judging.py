"""The harmonics towards which solutions are judged, and what is said of solutions that are silent on fewer."""

import math
from dataclasses import replace

import numpy as np
import pytest

import stickslip as ss
from evidence.models.lumped import chain_stiffness, jenkins, lumped, system
from stickslip.harmonic.judging import UNSEEN, covers, judging_balance, judging_set
from stickslip.harmonic.support import harmonics_of, multiples
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
    sweep = ss.Sweep(
        omega_range=span, frequencies=STEPS, peak_points=0, **{"low": (0, harmonic), **how}
    )  # type: ignore[arg-type]
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
        for signal in (
            np.cos(a * time) ** 3,
            *(np.cos(a * time) * np.sin(b * time + 0.3) for b in own),
        ):
            fed = np.flatnonzero(np.abs(np.fft.rfft(signal)) > 1e-9 * time.size)
            assert set(fed.tolist()) <= set(found)


def test_set_stays_among_the_multiples_of_what_is_kept():
    assert judging_set((0, 2), (2,)) == (0, 2, 4, 6)
    assert judging_set((0, 1)) == (0, 1, 2, 3)
    assert set(judging_set((0, 4, 6))) <= set(multiples((4, 6), 18))


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
    soft = replace(
        problem.low.linear.load, harmonics={1: 1e-3 * problem.low.linear.load.harmonics[1]}
    )
    sweep = problem.sweep
    quiet = ss.response.forced_problem(problem.system, soft, sweep)
    for p in ss.response.accepted_points(list(ss.forced_response(problem.system, soft, sweep))):
        assert own_error(quiet, p) == 0.0
    assert own_error(problem, points[0]) > 0.0


def test_reference_without_the_odd_harmonics_is_not_enough():
    """A strategy that is asked for a reference of 0, 1, 2 looks at 3 by itself."""
    made, load = chain(1)
    sweep = ss.Sweep(
        omega_range=(60.0, 80.0), low=1, high=2, at=(2 * math.pi * 11.3,), peak_points=0
    )
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
