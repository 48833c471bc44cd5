"""The judge in time: closed forms and exact values, and that it shares no law with what it judges."""

from pathlib import Path

import numpy as np
import pytest
from transient_models import GRIFFIN_EXACT, bounce, griffin, load_of, structure_of

import evidence.integrator
from evidence.integrator import time_step
from evidence.integrator.propagator import step_operators
from evidence.integrator.transient import TimeStepping, TransientStart, integrate
from evidence.models.solving import integrate_refined
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError


def test_it_shares_no_law_and_no_step_with_what_it_judges() -> None:
    for file in Path(evidence.integrator.__path__[0]).glob("*.py"):
        text = file.read_text(encoding="utf-8")
        for package in ("contact", "response"):
            assert f"stickslip.{package}" not in text


def test_it_refuses_laws_that_it_has_no_step_for() -> None:
    structure, gap = structure_of(np.eye(1), np.eye(1), np.eye(1)), np.array([[1.0], [0.0], [0.0]])
    with pytest.raises(InputError, match="integrate: laws: got Jenkins"):
        integrate(structure, gap, [Jenkins(k_t=1.0, limit=1.0)], load_of(1, {}), 1.0, np.array([0]))


@pytest.mark.validation
@pytest.mark.parametrize("omega", GRIFFIN_EXACT)
def test_friction_damped_oscillator_against_exact_event_driven_values(omega: float) -> None:
    result = griffin(integrate, omega, TimeStepping(steps_per_period=2048, tolerance=1e-8))
    assert result.settled
    assert result.contact_failures == 0
    assert abs(result.harmonics[1, 0]) == pytest.approx(GRIFFIN_EXACT[omega], rel=5e-6)


@pytest.mark.validation
def test_bouncing_mass_follows_parabola_and_half_sine() -> None:
    # Closed form over two landings; an error in a landing would shift all that comes after it.
    errors = np.array([bounce(integrate, n, TransientStart, TimeStepping) for n in (250, 1000, 4000)])
    assert errors[0] < 2e-2
    assert np.all(errors[1:] < errors[:-1] / 8)  # second order would be 16, at unlucky phases less


@pytest.mark.validation
def test_refinement_reports_an_error_that_covers_the_true_one() -> None:
    law = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=0.0, mu=0.5, preload=0.2)
    structure = structure_of(np.eye(1), 0.02 * np.eye(1), np.eye(1))
    gap, load = np.array([[1.0], [0.0], [0.0]]), load_of(1, {1: [0.1]})
    stepping = TimeStepping(steps_per_period=128, tolerance=1e-7)
    for omega, exact in GRIFFIN_EXACT.items():
        refined = integrate_refined(structure, gap, [law], load, omega, np.array([0]), stepping=stepping)
        true = abs(abs(refined.first_harmonic[0]) / exact - 1)
        assert refined.fine.settled
        assert true <= refined.error < 1e-3


@pytest.mark.validation
def test_refinement_of_an_unsettled_motion_does_not_extrapolate_and_widens_its_error() -> None:
    structure = structure_of(np.eye(1), 0.02 * np.eye(1), np.eye(1))
    load, stepping = load_of(1, {1: [0.1]}), TimeStepping(steps_per_period=32, max_periods=12)
    refined = integrate_refined(structure, np.zeros((0, 1)), [], load, 1.1, np.array([0]), stepping=stepping)
    assert not refined.fine.settled
    np.testing.assert_array_equal(refined.first_harmonic, refined.fine.average)
    assert refined.error >= refined.coarse.scatter + refined.fine.scatter > 0.0


@pytest.mark.validation
def test_contact_equations_without_a_solution_are_counted_as_failed() -> None:
    structure = structure_of(np.eye(1), np.zeros((1, 1)), np.eye(1))
    gap = np.array([[0.0], [0.0], [1.0]])
    law = np.array([[0.0, 0.0, 1.0, 0.0, 0.0]])
    operators, _ = step_operators(structure, gap, law, load_of(1, {}, [1.0]), 1.0, 16)
    # g = free + response r(g) with r = -k g while open: at a response of -2/k neither state answers free > 0.
    impossible = operators._replace(
        response=np.diag([0.0, 0.0, -2.0]), drive=np.abs(operators.drive) * [[1, 1, 1, 1, -1]]
    )
    state = time_step.StepState(np.zeros(5), np.zeros(3), np.zeros(3))
    record = time_step.StepRecord(np.empty((16, 1)), np.empty((16, 3)), np.empty((16, 3)))
    assert time_step.run_period(operators, state, time_step.step_workspace(3), record) == 0
    assert time_step.run_period(impossible, state, time_step.step_workspace(3), record) != 0
