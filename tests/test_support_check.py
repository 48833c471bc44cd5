"""The reference support held against more harmonics: against solutions that have them, and published ones."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_tuned_wheel import TABLE

import stickslip as ss
from evidence.models.lumped import blades_and_damper
from evidence.models.lumped_disks import TIP, friction_ring
from stickslip.errors import InputError
from stickslip.harmonic.judging import judging_balance, judging_set
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.response.verification import own_error
from stickslip.solve.status import Status

HERTZ = (2 * np.pi * 159, 2 * np.pi * 164)


def response(low, high, selection, span=HERTZ, count=11, **others):
    """Return problem and points of B6 at equally spaced frequencies."""
    system, load = blades_and_damper()
    sweep = ss.Sweep(
        omega_range=span, low=low, high=high, selection=selection, frequencies=count, peak_points=0, **others
    )
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    return ss.response.forced_problem(system, load, sweep), points


def test_error_of_five_harmonics_against_those_of_the_check():
    """Two Newton steps say it to four digits."""
    problem, points = response(1, 5, "always_high")
    checks = ss.response.check_support(problem, points)
    asked = checks[0].harmonics
    assert asked == tuple(range(16))
    _, exact = response(asked, asked, "always_high")
    real = np.array([problem.real_error(p, e) for p, e in zip(points, exact, strict=True)])
    found = np.array([c.error for c in checks])
    assert [c.omega for c in checks] == [p.omega for p in points]
    assert all(c.kept == (0, 1, 2, 3, 4, 5) for c in checks)
    assert np.count_nonzero(real > 1e-5) >= 7
    # both sides end in Newton's method, whose residuals of 1e-8 are 1e-4 of the smallest of these errors
    np.testing.assert_allclose(found, real, rtol=1e-4)
    # B6 at five harmonics is good to a thousandth: an error that the reference need not fear
    assert max(found) < 2e-3


def test_points_with_few_harmonics_are_held_against_the_same():
    """Solved with one harmonic they change as by those of the check; the alert, one step, takes 7.3 % at 163 Hz for 1.4 %."""
    problem, points = response(1, 5, "jacobian_alert")
    checks = ss.response.check_support(problem, points)
    asked = checks[0].harmonics
    _, exact = response(asked, asked, "always_high")
    few = [(c, p, e) for c, p, e in zip(checks, points, exact, strict=True) if c.kept == (0, 1)]
    assert 3 < len(few) < len(checks)
    for check, point, true in few:
        assert check.error == pytest.approx(problem.real_error(point, true), rel=0.05)
    missed = [(c, p) for c, p, _ in few if c.error > 3 * p.predicted_error]
    assert [round(c.omega / 2 / np.pi) for c, _ in missed] == [163]
    assert missed[0][1].predicted_error < 0.02
    assert missed[0][0].error > 0.07


def test_own_error_sees_contacts_that_change_their_states():
    """One harmonic at 163 Hz is 7.3 % off: towards its judging set one step says 1.4 %, two say it."""
    problem, points = response(1, 1, "always_low", span=(2 * np.pi * 162.5, HERTZ[1]), count=4)
    point = min(points, key=lambda p: abs(p.omega - 2 * np.pi * 163))
    fed = judging_set(point.support)
    _, exact = response(fed, fed, "always_low", span=(point.omega, HERTZ[1]), count=2)
    real = problem.real_error(point, exact[0])
    low, high = problem.low, judging_balance(problem.low)
    one = jacobian_alert(low, high, low.unknowns(point.coefficients), point.omega, problem.measure)
    assert one.error < 0.5 * real
    assert own_error(problem, point) == pytest.approx(real, rel=0.1)


def test_even_harmonics_that_the_reference_lacks_are_found_missing():
    problem, points = response((1, 3, 5), (1, 3, 5), "always_low", count=6)
    checks = ss.response.check_support(problem, points)
    _, exact = response(10, 10, "always_high", count=6)
    worst = max(checks, key=lambda c: c.error)
    real = {p.omega: problem.real_error(p, e) for p, e in zip(points, exact, strict=True)}
    assert worst.kept == (0, 1, 3, 5)
    assert worst.error > 0.05
    assert worst.error == pytest.approx(real[worst.omega], rel=0.15)


def test_worst_dof_is_one_of_those_asked_for():
    problem, points = response(1, 5, "always_low", count=3)
    chosen = replace(problem, system=replace(problem.system, alert_dofs=np.array([4, 2])))
    for check in ss.response.check_support(chosen, points):
        assert check.dof in {4, 2}
        assert check.label == problem.system.structure.dofs.labels[check.dof]
        assert check.harmonic == 1


def test_more_samples_where_more_harmonics_ask_for_them():
    problem, points = response(1, 5, "always_high", count=3, samples=32)
    assert problem.high.samples == 32
    checks = ss.response.check_support(problem, points, factor=4)
    assert checks[0].harmonics == tuple(range(21))
    assert all(0.0 <= c.error < 0.05 for c in checks)


def test_what_was_not_solved_is_passed_over():
    problem, points = response(1, 5, "always_low", count=3)
    lost = [replace(points[0], status=Status.TOO_MANY_ITERATIONS), *points[1:]]
    assert len(ss.response.check_support(problem, lost)) == 2
    assert ss.response.check_support(problem, []) == ()


@pytest.mark.parametrize("factor", [1, 0, 2.5])
def test_factors_that_add_nothing_are_refused(factor):
    problem, points = response(1, 5, "always_low", count=2)
    with pytest.raises(InputError, match="check_support: factor: must be an integer"):
        ss.response.check_support(problem, points, factor=factor)


def ring(waves, low, high):
    """Return problem and points of literature benchmark B9 at 622 to 627 Hz; errors are those of the tip."""
    wheel, operator = friction_ring(waves)
    contacts = ss.Interface(("ring",), (ss.Jenkins(k_t=2e7, limit=4.0),), operator)
    force = np.zeros(6)
    force[TIP] = 1.0
    load = ss.HarmonicLoad(np.zeros(wheel.n), {1: wheel.project(force, 1)})
    tip = np.flatnonzero(np.abs(wheel.project(force, 1)) > 0.5)
    system = ss.System(wheel, contacts, outputs=np.arange(wheel.n), alert_dofs=tip)
    sweep = ss.Sweep(
        omega_range=(2 * math.pi * 622, 2 * math.pi * 627),
        low=low,
        high=high,
        selection="always_low",
        frequencies=6,
        peak_points=0,
    )
    points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
    return ss.response.forced_problem(system, load, sweep), points


def test_friction_ring_lacks_what_the_literature_says():
    """From harmonic 3 to 6 and to 12, against 13, whose amplitudes are published: the tip changes by 0.8 to 1.1 %, more with its phase."""
    problem, points = ring(12, 3, 3)
    reference, exact = ring(13, 13, 13)
    real = [reference.real_error(p, e) for p, e in zip(points, exact, strict=True)]
    for factor in (2, 4):
        checks = ss.response.check_support(problem, points, factor)
        for check, change, (_, three, many) in zip(checks, real, TABLE.values(), strict=True):
            assert check.error == pytest.approx(change, rel=0.15, abs=3e-4)
            assert check.error >= 0.9 * abs(many / three - 1.0)
            assert check.label == "node2.x"


def test_wheel_without_waves_for_the_check_is_refused():
    problem, points = ring(3, 3, 3)
    with pytest.raises(InputError, match="harmonics up to 3, asked for 4"):
        ss.response.check_support(problem, points)
