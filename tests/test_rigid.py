"""Forced response with rigid contacts: one call against benchmark B5, through resonance, and in relative coordinates."""

from dataclasses import replace

import numpy as np
import pytest
from test_relative import relative, two_flexible_bodies

import stickslip as ss
from stickslip.response.rigid import rigid_response

TWO_MASSES = ss.model.lumped(np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([[0.04, -0.02], [-0.02, 0.02]]))
LOAD = ss.HarmonicLoad(np.zeros(2), {1: np.array([20.0 + 0j, 0.0])})


def rubbing(law=None):
    """Benchmark B5: the second of two masses rubs on the ground."""
    gap = np.zeros((3, 2))
    gap[0, 1] = 1.0
    law = law or ss.RigidCoulomb(mu=0.9, preload=9.0)
    return ss.System(TWO_MASSES, ss.Interface(("rub",), (law,), gap), np.array([0, 1]))


def at(omega, order, samples=None):
    how = ss.response.Discretisation(order=order, samples=samples or 32 * order)
    (point,) = rigid_response(rubbing(), LOAD, (omega, omega), discretisation=how)
    assert point.converged
    return point


@pytest.mark.parametrize(
    ("omega", "first"), [(0.55, (54.359118, 80.780423)), (1.0, (10.612322, 15.277103)), (1.5, (35.664777, 26.786093))]
)
def test_sliding_motions_of_benchmark_b5(omega, first):
    # first order in 1/H without sticking: three orders extrapolate; 32 samples a harmonic leave an error of 1e-3
    coarse, middle, fine = (np.abs(at(omega, order).coefficients[1]) for order in (12, 24, 48))
    np.testing.assert_allclose((8 * fine - 6 * middle + coarse) / 3, first, rtol=2e-3)
    assert np.all(np.abs(fine - first) <= 0.6 * np.abs(middle - first) + 1e-3 * np.array(first))


@pytest.mark.parametrize(
    ("omega", "first", "stick"), [(0.4, (22.318648, 27.965463), 0.13680), (2.0, (10.048455, 0.302843), 0.36710)]
)
def test_sticking_motions_of_benchmark_b5(omega, first, stick):
    # first order in 1/H here too, but no power series: compared as it comes
    point = at(omega, 48)
    assert np.mean(point.state[0, 0] == 0) == pytest.approx(stick, abs=0.02)
    np.testing.assert_allclose(np.abs(point.coefficients[1]), first, rtol=0.03)
    assert np.max(np.abs(point.contact_force[0, 0])) == pytest.approx(8.1)


def test_response_through_resonance_until_the_contact_sticks():
    how = ss.response.Discretisation(order=5, samples=160)
    points = list(rigid_response(rubbing(), LOAD, (0.45, 2.2), 25, how))
    assert all(p.converged for p in points)
    assert (points[0].omega, points[-1].omega) == (0.45, 2.2)
    heights = [abs(p.coefficients[1, 1]) for p in points]
    assert 0.55 < points[int(np.argmax(heights))].omega < 0.7  # first mode of the free structure: 0.618
    assert heights[-1] < 1e-8
    # the first mass alone remains: K = 2, C = 0.04
    alone = 20.0 / abs(2.0 - 2.2**2 + 0.04j * 2.2)
    assert abs(points[-1].coefficients[1, 0]) == pytest.approx(alone, rel=1e-8)
    # the penalty law follows, with its own fold of springs: the same peak to the flexibility that it adds
    soft = rubbing(ss.RigidCoulomb(mu=0.9, preload=9.0).softened(1e3))
    sweep = ss.Sweep(omega_range=(0.5, 0.8), selection="always_high", points=25)
    forced = ss.response.forced_problem(soft, LOAD, sweep)
    peak = max(forced.amplitude(p, 1) for p in ss.forced_response(soft, LOAD, sweep) if p.converged)
    assert max(heights) == pytest.approx(peak, rel=0.01)


def test_contact_between_two_flexible_bodies_in_relative_coordinates():
    system, load = two_flexible_bodies()
    laws = tuple(ss.RigidCoulomb(mu=0.3, preload=20.0) for _ in system.interface.laws)
    system = replace(system, interface=replace(system.interface, laws=laws))
    with pytest.raises(ss.InputError, match="in_relative_coordinates"):
        next(rigid_response(system, load, (330.0, 330.0)))
    other, load = relative(system, load)
    how = ss.response.Discretisation(order=3, samples=96)
    (point,) = rigid_response(other, load, (330.0, 330.0), discretisation=how)
    assert point.converged
    assert set(np.unique(point.state)) == {0, 1}
    limit = np.max(np.abs(point.contact_force[:, :2]))
    assert limit == pytest.approx(0.3 * 20.0)


def test_messages():
    with pytest.raises(ss.InputError, match="omega_range: goes from 2 to 1 rad/s"):
        next(rigid_response(rubbing(), LOAD, (2.0, 1.0)))
    soft = rubbing(ss.RigidCoulomb(mu=0.9, preload=9.0).softened(10.0))
    with pytest.raises(ss.InputError, match="no contact is rigid"):
        next(rigid_response(soft, LOAD, (1.0, 2.0)))
