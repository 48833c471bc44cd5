"""Residual and Jacobian of the harmonic balance, and the symmetries that its solutions must have."""

import numpy as np
import pytest
from models import SAMPLES, balance_of, bonded, free_body_3d, solved
from newton_bounds import unknowns_bound

from evidence.models.lumped import blades_and_damper
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad

OMEGA = 400.0


# ---- derivatives --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("preload", "size"), [(30.0, 0.02), (30.0, 1.0), (5.0, 2.0), (-5.0, 2.0), (-1e9, 1.0)])
def test_jacobian_of_a_free_body_on_two_contacts(preload, size):
    """From full stick through slip and lift-off to contacts that never touch."""
    system, load = free_body_3d(preload=preload)
    balance = balance_of(system, load)
    states = set()
    used = total = 0
    for seed in range(3):
        rng = np.random.default_rng(seed)
        decay = np.repeat([1.0, 1, 1, 0.3, 0.3, 0.1, 0.1], balance.linear.n)
        unit = 30.0 / (2e5 * balance.displacement_scale)
        x = size * unit * decay * rng.standard_normal(balance.size)
        at = balance.linearise(x, OMEGA)
        here = balance.contacts(x, OMEGA)
        states |= set(np.unique(here.state).tolist())
        step = 1e-6 * size * unit  # piecewise linear: exact but for rounding, unless a state changes
        for column in range(balance.size):
            move = np.zeros(balance.size)
            move[column] = step
            total += 1
            around = [balance.contacts(x + s * move, OMEGA) for s in (1, -1)]
            if not all(np.array_equal(a.state, here.state) for a in around):
                continue  # two derivatives, and the difference mixes them
            used += 1
            up, down = (balance.linearise(x + s * move, OMEGA).residual for s in (1, -1))
            difference = (up - down) / (2 * step)
            assert np.max(np.abs(at.jac[:, column] - difference)) <= 1e-6 * np.max(np.abs(at.jac))
    assert used >= 0.9 * total
    assert len(states) == {0.02: 1}.get(size, 3 if abs(preload) < 1e8 else 1)


def test_derivative_by_frequency():
    system, load = free_body_3d()
    balance = balance_of(system, load)
    x = np.random.default_rng(0).standard_normal(balance.size)
    at = balance.linearise(x, OMEGA)
    step = 1e-3
    difference = (balance.linearise(x, OMEGA + step).residual - balance.linearise(x, OMEGA - step).residual) / (
        2 * step
    )
    # all coordinates but none of the body's are retained: Z is quadratic in ω, the difference is exact but for rounding
    assert np.allclose(at.jac_p, difference, rtol=0, atol=1e-6 * np.abs(difference).max())


def test_evaluations_do_not_share_memory():
    # the corrector overwrites the Jacobian that it is given
    system, load = free_body_3d()
    balance = balance_of(system, load)
    x = np.zeros(balance.size)
    first = balance.linearise(x, OMEGA)
    kept = first.jac.copy()
    first.jac[:] = np.nan
    assert np.array_equal(balance.linearise(x, OMEGA).jac, kept)


def test_residual_against_the_complex_equations():
    system, load = free_body_3d()
    order = 2
    balance = balance_of(system, load, order)
    x = np.random.default_rng(1).standard_normal(balance.size)
    q = balance.coefficients(x)
    structure = system.structure
    period = balance.contacts(x, OMEGA)
    spectrum = np.fft.rfft(period.force.reshape(6, SAMPLES)) / SAMPLES
    spectrum[:, 1:] *= 2.0
    residual = balance.coefficients(balance.linearise(x, OMEGA).residual) / balance.displacement_scale
    for h in range(order + 1):
        w = h * OMEGA
        z = structure.stiffness + 1j * w * structure.damping - w**2 * structure.mass
        want = z @ q[h] + system.interface.gap_operator.T @ spectrum[:, h] - load.coefficients(order)[h]
        if h == 0:
            want = want.real
        assert np.allclose(residual[h] * balance.force_scale, want, rtol=0, atol=1e-10 * np.abs(want).max())


def test_unknowns_and_coefficients_round_trip():
    system, load = free_body_3d()
    balance = balance_of(system, load)
    x = np.random.default_rng(1).standard_normal(balance.size)
    assert np.allclose(balance.unknowns(balance.coefficients(x)), x, rtol=1e-15)
    larger = balance.with_order(5)
    assert np.allclose(larger.unknowns(balance.coefficients(x))[: balance.size], x, rtol=1e-15)


# ---- solutions ----------------------------------------------------------------------------------------------------------


def held(system, mu=1e3, preload=1e3):
    """The same system with contacts that never slip nor open, and the body held against what two contacts leave free."""
    from dataclasses import replace

    laws = tuple(
        ElasticCoulomb(k_t=law.k_t, k_w=law.k_w, k_n=law.k_n, mu=mu, preload=preload) for law in system.interface.laws
    )
    return replace(system, interface=replace(system.interface, laws=laws)).with_retention(1e4)


def test_full_stick_is_the_linear_solution():
    system, load = free_body_3d()
    system = held(system)
    balance, solution = solved(system, load, OMEGA, start=np.zeros((1, 12)))
    want = bonded(system, load, OMEGA, balance)
    got = balance.coefficients(solution.x)
    assert np.all(balance.contacts(solution.x, OMEGA).state == 0)
    assert solution.iterations <= 2
    assert np.allclose(got, want, rtol=0, atol=1e-10 * np.abs(want).max())


FREQUENCY = 2 * np.pi * 162.0  # both contacts slip and open at this frequency: nothing is remembered from the start


@pytest.mark.kernel
@pytest.mark.parametrize(("length", "force"), [(1e3, 1.0), (1.0, 1e-3), (1e3, 1e-3), (1e-3, 1e6)])
def test_units_do_not_matter(length, force):
    """mm for m, kN for N: scaled problem, path and count of Newton steps are the same."""
    system, load = blades_and_damper()
    balance, solution = solved(system, load, FREQUENCY)
    # stiffness in (force unit)/(length unit)
    other_system, other_load = blades_and_damper(length=1 / length, force=1 / force)
    other, same = solved(other_system, other_load, FREQUENCY)
    assert same.iterations == solution.iterations
    reached = (b.linearise(end.x, FREQUENCY) for b, end in ((balance, solution), (other, same)))
    assert np.abs(same.x - solution.x).max() <= unknowns_bound(same.x, *reached)
    assert other.displacement_scale == pytest.approx(balance.displacement_scale * length, rel=0.5)


@pytest.mark.kernel
@pytest.mark.parametrize("steps", [1, 16, 37])
def test_a_later_excitation_gives_a_later_response(steps):
    shift = 2 * np.pi * steps / SAMPLES
    system, load = blades_and_damper()
    _, late_load = blades_and_damper(phase=-shift)
    balance, a = solved(system, load, FREQUENCY)
    q = balance.coefficients(a.x)
    turned = q * np.exp(-1j * shift * np.arange(4))[:, None]
    late, b = solved(system, late_load, FREQUENCY, start=turned)
    assert b.iterations == 0, "the shifted solution solves the shifted problem"
    bound = unknowns_bound(a.x, balance.linearise(a.x, FREQUENCY), late.linearise(b.x, FREQUENCY))
    apart = np.abs(balance.coefficients(b.x) - turned).max() / balance.displacement_scale
    assert apart <= np.sqrt(2.0) * bound  # of a complex amplitude


@pytest.mark.kernel
def test_tangents_may_point_either_way():
    system, load = blades_and_damper()
    turned, _ = blades_and_damper(mirrored=True)
    (one, a), (other, b) = (solved(s, load, FREQUENCY) for s in (system, turned))
    reached = one.linearise(a.x, FREQUENCY), other.linearise(b.x, FREQUENCY)
    assert np.abs(a.x - b.x).max() <= unknowns_bound(a.x, *reached)


@pytest.mark.parametrize(
    ("frequency", "low", "high"),
    [(160, 1.986549e-4, 2.000666e-4), (162, 2.588833e-4, 2.251094e-4), (164, 1.906946e-4, 1.896742e-4)],
)
def test_published_amplitudes(frequency, low, high):
    """Benchmark B7: amplitude of y2 with one and with five harmonics, 256 samples, printed to seven figures."""
    system, load = blades_and_damper()
    omega = 2 * np.pi * frequency
    start = None
    for order, want in ((1, low), (5, high)):
        balance, solution = solved(system, load, omega, order, 256, start)
        start = balance.coefficients(solution.x)
        amplitude = np.abs(balance.linear.recover(omega, start)[1, 3])
        assert amplitude == pytest.approx(want, rel=2e-6)


# ---- messages -----------------------------------------------------------------------------------------------------------


def test_zero_load_is_refused():
    # neither a load nor a preload: there is nothing to measure residuals by
    system, _ = free_body_3d(preload=0.0)
    with pytest.raises(InputError, match="HarmonicLoad: is zero"):
        balance_of(system, HarmonicLoad(np.zeros(12)))


def test_a_preload_is_a_load():
    system, _ = free_body_3d(preload=30.0)
    assert balance_of(system, HarmonicLoad(np.zeros(12))).force_scale == 30.0


def test_what_the_balance_cannot_keep_or_does_not_know_is_refused():
    system, load = free_body_3d()
    high = HarmonicLoad(load.static, {**load.harmonics, 3: load.harmonics[1]})
    with pytest.raises(InputError, match=r"excites harmonic 3, but only 0, 1, 2 are kept\. Keep 3 or more"):
        balance_of(system, high, 2)
    with pytest.raises(
        InputError, match="order: must be the highest harmonic or a list of harmonics from 0 on, got -1"
    ):
        balance_of(system, load, -1)
    linear = condense(system.structure, system.retained, load)
    with pytest.raises(InputError, match="'exact' is none of intervals, march, events"):
        harmonic_balance(linear, system.interface, 1, 16, "exact")
    with pytest.raises(InputError, match="'sparse' is none of auto, dense, structured"):
        harmonic_balance(linear, system.interface, 1, 16, jacobian="sparse")


@pytest.mark.parametrize(("order", "samples", "least"), [(5, 20, 40), (1, 4, 16)])
def test_too_few_samples_are_refused(order, samples, least):
    system, load = free_body_3d()
    with pytest.raises(InputError, match=rf"{samples} samples a period for {order} harmonics.*Give at least {least}"):
        balance_of(system, load, order, samples)
    with pytest.raises(InputError, match="samples a period"):
        balance_of(system, load, 1, samples).with_order(order)


def test_contact_dofs_must_be_retained():
    system, load = free_body_3d()
    with pytest.raises(InputError, match=r"contact dofs \[1\] are not retained"):
        harmonic_balance(condense(system.structure, np.delete(np.arange(12), 1), load), system.interface, 1, 32)
    # of many the first five are named
    with pytest.raises(InputError, match=r"contact dofs \[0, 1, 2, 3, 4\] are not retained"):
        harmonic_balance(condense(system.structure, np.arange(6, 12), load), system.interface, 1, 32)
