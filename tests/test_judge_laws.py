"""The judge's own laws: order of its scheme, closed forms, and the integration over compiled laws and the balance against it."""

import numpy as np
import pytest

from evidence.integrator import verlet
from evidence.integrator.hysteresis import advance, contact_table
from evidence.integrator.transient import TimeStepping
from evidence.models.small_laws import LAWS, OMEGA, on_one_contact
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.errors import InputError
from stickslip.response.time import transient


def judged(law, steps, tolerance=1e-9, start=None):
    system, load = on_one_contact(law)
    return verlet.integrate(
        system.structure,
        system.interface.gap_operator,
        system.interface.laws,
        load,
        OMEGA,
        np.arange(3),
        start,
        TimeStepping(steps_per_period=steps, tolerance=tolerance),
    )


def marched(law, gaps):
    """Forces of one contact along gaps (steps, 3), and what it remembers at the end."""
    kind, table, states = contact_table([law])
    force, out = np.zeros(3), []
    for before, now in zip([np.zeros(3), *gaps[:-1]], gaps, strict=True):
        advance(kind[0], table[0], before, now, states[0], force)
        out.append(force.copy())
    return np.array(out)


@pytest.mark.validation
@pytest.mark.parametrize("name", LAWS)
def test_halved_steps_leave_a_quarter_of_the_error(name):
    coarse, middle, fine = (judged(LAWS[name], n).harmonics[1] for n in (128, 256, 1024))
    # changes of the state fall anywhere within a step: second order on the whole
    ratio = np.max(np.abs(coarse - fine)) / np.max(np.abs(middle - fine))
    assert 2.5 < ratio < 8.0
    assert np.max(np.abs(middle - fine)) < 2e-3 * np.max(np.abs(fine))


@pytest.mark.validation
@pytest.mark.parametrize("name", LAWS)
def test_integration_over_compiled_laws_agrees(name):
    law = LAWS[name]
    system, load = on_one_contact(law)
    coarse, fine = (judged(law, n, 1e-7).harmonics for n in (512, 1024))
    limit = fine + (fine - coarse) / 3.0
    found = transient.integrate(
        system.structure,
        system.interface.gap_operator,
        system.interface.laws,
        load,
        OMEGA,
        np.arange(3),
        stepping=transient.TimeStepping(steps_per_period=512, tolerance=1e-7),
    )
    assert found.settled
    assert np.max(np.abs(found.harmonics - limit)) < 2e-4 * np.max(np.abs(limit[1]))


@pytest.mark.validation
@pytest.mark.parametrize(
    ("ratio", "exact"), [(r, complex(1.0 / r**2, np.sqrt(1.0 - 1.0 / r**2) / r)) for r in (1.5, 2.0, 5.0)]
)
def test_planar_slider_on_a_circle_is_the_closed_form(ratio, exact):
    errors = []
    for steps in (128, 256, 512):
        tau = 2.0 * np.pi * np.arange(4 * steps + 1) / steps
        gaps = ratio * np.stack([np.cos(tau), np.sin(tau), 0.0 * tau], axis=1)
        force = marched(CoupledCoulomb(k_t=1.0, k_n=0.0, mu=1.0, preload=1.0), gaps)[-1]
        errors.append(abs(complex(force[0], -force[1]).conjugate() / ratio - exact))
    # the way is a polygon: second order
    assert errors[-1] < 1e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


@pytest.mark.validation
def test_a_planar_slider_at_its_limit_that_does_not_move_stays():
    kind, table, states = contact_table([CoupledCoulomb(k_t=1.0, k_n=0.0, mu=1.0, preload=1.0)])
    force, here = np.zeros(3), np.array([0.3, 0.4, 0.0])
    for excess in (0.0, 1e-15, 0.5):
        states[0] = 0.6 * (1.0 + excess), 0.8 * (1.0 + excess)
        advance(kind[0], table[0], here, here, states[0], force)
        np.testing.assert_allclose(force, [0.6, 0.8, -1.0], atol=1e-14)


@pytest.mark.validation
def test_equal_stiffnesses_are_isotropic_and_turn_with_the_plane():
    rng = np.random.default_rng(3)
    gaps = np.cumsum(rng.standard_normal((300, 3)) * [0.3, 0.3, 0.1], axis=0)
    turned = gaps.copy()
    turn = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    turned[:, :2] = gaps[:, :2] @ turn.T
    law = CoupledCoulomb(k_t=2.0, k_n=1.0, mu=0.4, preload=0.5)
    one, other = marched(law, gaps), marched(law, turned)
    states = one[:, 2]
    assert np.any(states == 0.0)
    assert np.any(states < 0.0)
    np.testing.assert_allclose(other[:, :2], one[:, :2] @ turn.T, atol=1e-12)
    twice = CoupledCoulomb(k_t=2.0, k_w=2.0, k_n=1.0, mu=0.4, preload=0.5)
    np.testing.assert_allclose(marched(twice, gaps), one, atol=1e-12)


@pytest.mark.validation
def test_a_motion_that_it_has_settled_to_goes_on_from_its_final_state():
    found = judged(LAWS["Iwan"], 256)
    again = judged(LAWS["Iwan"], 256, start=found.final)
    np.testing.assert_allclose(again.harmonics, found.harmonics, atol=1e-8)


def test_laws_without_a_step_are_refused():
    with pytest.raises(InputError, match="has no law RigidCoulomb"):
        contact_table([RigidCoulomb(mu=0.1)])
