"""The Jacobian Alert against its published form and published numbers."""

from dataclasses import replace

import numpy as np
import pytest
from models import balance_of, blades_and_damper, griffin, solved

from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.selection import alert as alert_module
from stickslip.harmonic.fourier import to_real
from stickslip.harmonic.selection.alert import jacobian_alert
from stickslip.harmonic.selection.strategy import ErrorMeasure
from stickslip.solve.newton import Newton, newton

ALL = ErrorMeasure(np.arange(4))


def published(high, x, omega):
    """Eq. 21: J̃ (q + Δq) = F at the padded low-order solution."""
    at = high.linearise(x, omega)
    load = to_real(high.linear.condensed(omega, high.order).load).reshape(-1) / high.force_scale
    return np.linalg.solve(at.jac, load)


def both(system, load, hertz, samples=256):
    omega = 2 * np.pi * hertz
    low, solution = solved(system, load, omega, 1, samples)
    high = low.with_order(5)
    return low, high, solution.x, high.unknowns(low.coefficients(solution.x)), omega


@pytest.mark.parametrize("hertz", [160.0, 161.0, 163.0, 228.0])
def test_published_form_for_homogeneous_forces(hertz):
    low, high, x, padded, omega = both(*blades_and_damper(), hertz)
    alert = jacobian_alert(low, high, x, omega, ALL)
    assert np.allclose(
        alert.start, published(high, padded, omega), rtol=0, atol=1e-9 * np.abs(x).max()
    )


def test_published_form_fails_with_a_preload_in_the_contact():
    system, load = blades_and_damper()
    laws = tuple(
        ElasticCoulomb(
            k_t=law.k_t, k_w=0.0, k_n=law.k_n, mu=law.mu, preload=20.0, residual_traction=0.0
        )
        for law in system.interface.laws
    )
    low, high, x, padded, omega = both(
        replace(system, interface=replace(system.interface, laws=laws)), load, 160.0
    )
    alert = jacobian_alert(low, high, x, omega, ALL)
    # Newton's form is one step to the high-order solution, the published one lands elsewhere
    exact = newton(lambda v: high.linearise(v, omega), alert.start, Newton()).x
    away = np.max(np.abs(exact - padded))
    assert np.max(np.abs(alert.start - exact)) < away
    assert np.max(np.abs(published(high, padded, omega) - exact)) > 3 * np.max(
        np.abs(alert.start - exact)
    )


@pytest.mark.parametrize("hertz", [150.0, 155.0, 170.0, 200.0])
def test_no_alert_in_full_stick(hertz):
    low, high, x, padded, omega = both(*blades_and_damper(), hertz)
    assert np.all(low.contacts(x, omega).state == 0)
    alert = jacobian_alert(low, high, x, omega, ALL)
    assert alert.error < 1e-8  # Newton's tolerance over the size of the solution
    assert np.allclose(alert.start, padded, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("hertz", "percent"),
    [
        (159, 0.0070),
        (160, 0.5494),
        (161, 15.310),
        (163, 1.1485),
        (164, 0.6292),
        (220, 2.2010),
        (228, 2.4511),
    ],
)
def test_published_predictions(hertz, percent):
    """Benchmark B7; 163 Hz is the known miss of the method: the true error there is 7.28 %."""
    low, high, x, _, omega = both(*blades_and_damper(), float(hertz))
    alert = jacobian_alert(low, high, x, omega, ALL)
    assert 100 * alert.error == pytest.approx(
        percent, abs=6e-4
    )  # as printed: four decimals, three for the large one


def test_small_motions_do_not_raise_the_alarm():
    low, high, x, _, omega = both(*blades_and_damper(), 161.0)
    before = np.abs(low.linear.recover(omega, low.coefficients(x))[1])
    alert = jacobian_alert(low, high, x, omega, ALL)
    assert before[alert.worst] > 1e-3 * before[ALL.dofs].max()
    single = [
        jacobian_alert(low, high, x, omega, ErrorMeasure(np.array([d]))).error for d in ALL.dofs
    ]
    assert alert.error == pytest.approx(max(single), rel=1e-12)
    assert int(np.argmax(single)) == alert.worst


def test_step_is_exact_where_no_state_changes():
    # a constant limit: H = 1 to H = 5 of one Jenkins spring; the prediction is right to second order in the change
    system, load = griffin(0.1)
    low, solution = solved(system, load, 1.15, 1, 1024)
    high = low.with_order(5)
    alert = jacobian_alert(low, high, solution.x, 1.15, ErrorMeasure(np.array([0])))
    exact = newton(lambda v: high.linearise(v, 1.15), alert.start, Newton()).x
    padded = high.unknowns(low.coefficients(solution.x))
    assert np.max(np.abs(alert.start - exact)) < 0.05 * np.max(np.abs(padded - exact))


def test_singular_enlarged_problem_is_an_infinite_error(monkeypatch):
    # an open damper leaves no force on the missing harmonics either: ask for the enlarged step all the same
    monkeypatch.setattr(alert_module, "_silent", lambda *_: False)
    low = balance_of(*blades_and_damper(), order=1)
    high = low.with_order(3)
    # nothing touches: the free body's static part has no stiffness
    x = np.zeros(low.size)
    x[5] = -1e3
    assert np.all(low.contacts(x, 1000.0).state == 2)
    assert jacobian_alert(low, high, x, 1000.0, ALL).error == np.inf


def test_alert_is_silent_without_a_factorisation_where_nothing_acts(monkeypatch):
    system, load = blades_and_damper(excitation=0.01)
    low, solution = solved(system, load, 2 * np.pi * 150.0, order=1)
    x = solution.x
    high = low.with_order(5)
    full = high.linearise(high.unknowns(low.coefficients(x)), 2 * np.pi * 150.0)
    assert np.max(np.abs(np.linalg.solve(full.jac, full.residual))) < 1e-9
    monkeypatch.setattr(np.linalg, "solve", None)
    assert jacobian_alert(low, high, x, 2 * np.pi * 150.0, ALL).error == 0.0
