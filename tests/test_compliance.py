"""Displacement form: same solutions as the force form, exact derivatives, and a refusal where there is no compliance."""

from dataclasses import replace

import numpy as np
import pytest
from compliance_form import ComplianceForm
from models import balance_of, solved
from newton_bounds import unknowns_bound
from test_dlft import rubbing

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.errors import SingularError
from stickslip.solve.newton_method import Newton, newton


def held():
    """Blade, damper, blade, the damper on a weak spring."""
    system, load = blades_and_damper()
    return system.with_retention(1e3), load


@pytest.mark.kernel
@pytest.mark.parametrize(("case", "omega"), [(lambda: griffin(0.1), 1.1), (held, 2 * np.pi * 160)])
def test_same_solutions_as_the_force_form(case, omega):
    system, load = case()
    balance, found = solved(system, load, omega)
    form = ComplianceForm(balance)
    assert np.max(np.abs(form.linearise(found.x, omega).residual)) < 1e-6
    start = found.x + 1e-3 * np.random.default_rng(0).standard_normal(found.x.size)
    again = newton(lambda v: form.linearise(v, omega), start, Newton(tolerance=1e-11))
    assert again.status.converged
    assert np.any(form.contacts(again.x, omega).state == 1), "the contact should slip"
    other = balance.unknowns(form.coefficients(again.x))
    bound = unknowns_bound(other, balance.linearise(found.x, omega), balance.linearise(other, omega))
    assert np.max(np.abs(other - found.x)) <= bound


@pytest.mark.parametrize("problem", [lambda: balance_of(*held()), lambda: rubbing(3, 64)])
def test_derivatives(problem):
    form = ComplianceForm(problem())
    omega = 1.3 if form.size < 10 else 900.0
    x = np.random.default_rng(3).standard_normal(form.size)
    at = form.linearise(x, omega)
    step = 1e-6
    sides = [
        (form.linearise(x + step * e, omega).residual - form.linearise(x - step * e, omega).residual) / (2 * step)
        for e in np.eye(form.size)
    ]
    np.testing.assert_allclose(at.dense_jac(), np.array(sides).T, atol=1e-6 * np.abs(sides).max())
    h = 1e-6 * omega
    by_omega = (form.linearise(x, omega + h).residual - form.linearise(x, omega - h).residual) / (2 * h)
    np.testing.assert_allclose(at.jac_p, by_omega, atol=1e-6 * np.abs(by_omega).max())


def test_jacobian_is_the_identity_where_no_contact_acts():
    problem = rubbing(3, 64)
    form = ComplianceForm(problem.balance)  # the structure without its rigid contact
    jac = form.linearise(np.ones(form.size), 0.8).dense_jac()
    np.testing.assert_allclose(jac, np.eye(form.size), atol=1e-12)


def test_a_free_damper_is_refused_by_name():
    # without its tie xD-yD nothing but the contacts holds the damper
    system, load = blades_and_damper()
    stiffness = system.structure.stiffness.copy()
    stiffness[4:, 4:] = 0.0
    free = replace(system, structure=replace(system.structure, stiffness=stiffness))
    form = ComplianceForm(balance_of(free, load), free.retained_labels)
    with pytest.raises(SingularError, match=r"harmonic 0 at 1000 rad/s is singular.*damper.node3"):
        form.linearise(np.zeros(form.size), 1000.0)
