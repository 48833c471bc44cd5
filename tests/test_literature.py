"""Numbers of the literature, quickly: a row or two of each benchmark that ``make validate`` compares in full."""

import numpy as np
import pytest

from evidence.models.lumped import blades_and_damper
from evidence.validation import (
    case_b1_jenkins,
    case_b3_blade_with_damper,
    case_b6_blade_damper_blade,
    case_b7_alert,
    case_b8_residual_traction,
)


@pytest.mark.parametrize("row", case_b1_jenkins.TABLE, ids=lambda row: f"A/xc={row[0]}")
def test_jenkins_describing_function_and_harmonics(row):
    ratio = float(row[0])
    force = case_b1_jenkins.element_force(ratio, 4096)
    # the sampling error falls with the square of the number of samples: some (2 pi / 4096)^2 = 2.4e-6 of the limit
    assert force[1] / ratio == pytest.approx(complex(float(row[1]), float(row[2])), abs=2.4e-6)
    for h, pair in ((3, row[3]), (5, row[4])):
        assert force[h] == pytest.approx(complex(float(pair[0]), float(pair[1])), abs=3e-5)
    assert np.max(np.abs(force[[0, 2, 4]])) < 1e-12


def test_jenkins_sampling_error_is_of_second_order():
    assert case_b1_jenkins.convergence_order(1.5) == pytest.approx(2.0, abs=0.1)


def test_two_uncoupled_springs_on_a_circle_are_not_a_planar_law():
    force = case_b1_jenkins.circle_force(2.0, 1024)
    assert force[1, 0] / 2 == pytest.approx(0.5 + 0.31831j, abs=1e-4)
    assert abs(force[1, 0] / 2 - (0.25 + 0.43301270j)) > 0.2  # the coupled law's


@pytest.mark.parametrize("row", case_b3_blade_with_damper.RESPONSE, ids=lambda row: f"fc={row[0]}-W={row[1]}")
def test_blade_with_friction_damper_at_one_and_eleven_harmonics(row):
    limit, omega = float(row[0]), float(row[1])
    # half a unit of the last digit printed
    assert case_b3_blade_with_damper.response(limit, omega, 1) == pytest.approx(float(row[2]), abs=5.01e-9)
    assert case_b3_blade_with_damper.response(limit, omega, 11) == pytest.approx(float(row[3]), abs=5.01e-9)


def test_peak_of_the_blade_with_its_best_damper():
    amplitude, omega = case_b3_blade_with_damper.peak(0.138956, 1.1186, samples=2**14)
    assert amplitude == pytest.approx(0.5509002, rel=1e-6)
    # the top is flat: the sampling error of 1e-8 moves it so far
    assert omega == pytest.approx(1.118581, abs=4e-6)


@pytest.mark.parametrize("row", case_b6_blade_damper_blade.TABLE, ids=lambda row: f"{row[0]}Hz")
def test_blade_damper_blade_with_lift_off(row):
    problem, _ = blades_and_damper()
    for (order, samples), printed in zip(case_b6_blade_damper_blade.ORDERS, row[2:], strict=True):
        ours = abs(case_b6_blade_damper_blade.y2(problem, float(row[0]), order, samples))
        assert ours == pytest.approx(float(printed), rel=2.6e-7)  # half a unit of seven digits


def test_time_integration_of_the_blade_damper_blade():
    amplitude, mean = case_b6_blade_damper_blade.time_domain(163.0)
    assert amplitude == pytest.approx(2.273072e-4, rel=2.5e-7)
    assert mean == pytest.approx(1.43807e-4, rel=4e-6)


def test_natural_frequencies_of_the_blade_damper_blade():
    for stuck, printed in ((True, case_b6_blade_damper_blade.STUCK), (False, case_b6_blade_damper_blade.FRICTIONLESS)):
        ours = case_b6_blade_damper_blade.frequencies(stuck=stuck)
        assert ours == pytest.approx([float(f) for f in printed], abs=5.1e-6)


@pytest.mark.parametrize("hertz", ["159", "161", "163", "228"])
def test_alert_prediction_and_real_error(hertz):
    _, first, fifth, predicted, real = next(row for row in case_b7_alert.TABLE if row[0] == hertz)
    problem, low, high = case_b7_alert.both_passages(float(hertz))
    assert problem.amplitude(low) == pytest.approx(float(first), rel=2.5e-7)
    assert problem.amplitude(high) == pytest.approx(float(fifth), rel=2.5e-7)
    half_unit = 0.5 * 10.0 ** -len(predicted.split(".")[1])
    assert 100 * low.predicted_error == pytest.approx(float(predicted), abs=1.001 * half_unit)
    half_unit = 0.5 * 10.0 ** -len(real.split(".")[1])
    assert 100 * case_b7_alert.real_error(problem, low, high) == pytest.approx(float(real), abs=1.001 * half_unit)


def test_below_the_threshold_does_not_mean_below_it_in_truth():
    """The known limit of the method: at 163 Hz the alert is silent and the error is 7 %."""
    problem, low, high = case_b7_alert.both_passages(163.0)
    assert low.predicted_error < 0.05 < case_b7_alert.real_error(problem, low, high)


@pytest.mark.parametrize("hertz", [160.0, 162.0, 220.0])
def test_published_form_of_the_alert_equals_the_newton_form_without_preloads(hertz):
    assert case_b7_alert.two_forms(hertz) < 1e-10  # rounding times the condition of the Jacobian


def test_continuation_crosses_the_gap_of_plain_newton():
    points = case_b7_alert.crossing()
    assert all(p.converged for p in points)
    assert points[-1].omega == pytest.approx(2 * np.pi * 229)


def test_residual_traction_changes_the_response_where_contacts_stick():
    low, _ = case_b8_residual_traction.y2(220.0, (-1.0, -1.0))
    high, _ = case_b8_residual_traction.y2(220.0, (1.0, 1.0))
    assert low == pytest.approx(3.748268e-5, rel=2e-7)
    assert high == pytest.approx(6.640432e-5, rel=2e-7)


@pytest.mark.validation
@pytest.mark.parametrize("case", [case_b7_alert, case_b8_residual_traction], ids=lambda case: case.__name__)
def test_every_row_holds(case):
    assert [r["quantity"] for r in case.run() if not r["holds"]] == []
