"""What prototypes taught, each with a test of its own.

Some have theirs elsewhere: derivative rows and prefix sums of the kernel in `test_contact_kernel` (each contact state against
differences), the evaluators against each other in `test_evaluators`, the layout and `Gᵀ K G` in `test_balance` and `test_interface`,
the condensation by one eigendecomposition in `test_dynamic_stiffness`, preconditioner and choice of the linear solver in
`test_krylov`, units in `test_balance` and `test_solve_correctors`, steps that are not finite in `test_newton` and
`test_solve_correctors`.
"""

from dataclasses import replace

import numpy as np
import pytest
from models import SLIP, STICK, balance_of, bonded, lifting, table

from evidence.models.lumped import blades_and_damper
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.interface import Interface
from stickslip.contact.law import TT
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.forced.problem import forced_point
from stickslip.response.forced.response import Sweep, forced_problem
from stickslip.response.free_motion import SINGULAR, as_array, by_products, drift
from stickslip.response.system import System
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Status

SLIDER = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=0.0, mu=1.0, preload=1.0)
EVALUATORS = ["intervals", "events", "march"]


def tangential(law, mean, amplitude, evaluator, samples=256):
    """Period of one contact under ``mean + amplitude cos``."""
    gap = np.zeros((3, 3))
    gap[:2, 0] = mean, amplitude
    return contact_forces(gap, compile_contacts([law], evaluator=evaluator), samples)


# ---- contacts -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("evaluator", EVALUATORS)
def test_start_of_a_spring(evaluator):
    # T(0) = k_t x(0): full stick is a pure spring, static part included
    period = tangential(SLIDER, 0.4, 0.3, evaluator)
    assert np.allclose(period.coefficients[:, 0], [0.4, 0.3, 0.0], rtol=0, atol=1e-12)
    assert np.all(period.state[0, 0] == STICK)


@pytest.mark.parametrize("evaluator", EVALUATORS)
def test_shakedown(evaluator):
    # the first cycle slips, the second is all stick: the offset is that of the last slip, and so is its derivative
    period = tangential(SLIDER, 5.0, 0.3, evaluator)
    # the greatest force is the limit: mean = limit - amplitude, whatever the mean of the gap
    assert np.allclose(period.coefficients[:, 0], [0.7, 0.3, 0.0], rtol=0, atol=1e-12)
    block = period.blocks[0][TT]
    assert np.allclose(block[:, 0], 0.0, rtol=0, atol=1e-12)
    assert np.allclose(block[:, 1], [-1.0, 1.0, 0.0], rtol=0, atol=1e-12)


@pytest.mark.parametrize("evaluator", EVALUATORS)
@pytest.mark.parametrize("mean", [0.0, 1.0])
def test_a_limit_of_zero(evaluator, mean):
    period = tangential(ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=0.0, mu=1.0, preload=0.0), mean, 1.0, evaluator)
    assert np.all(period.coefficients[:, 0] == 0.0)
    assert np.all(period.blocks[0][TT] == 0.0)
    assert not np.any(period.state[0, 0] == STICK)


@pytest.mark.parametrize(
    ("evaluator", "size"),
    [
        *(("events", size) for size in (1e-300, 1.0, 1e150, 1e200, np.inf, np.nan)),
        *(("intervals", size) for size in (1e-300, 1.0, 1e150, np.inf, np.nan)),
    ],
)
def test_event_buffers_are_bounded(evaluator, size):
    # very many events a period, and numbers without an order among them; an overflow here corrupted memory
    rng = np.random.default_rng(2)
    law = ElasticCoulomb(k_t=1.0, k_w=2.0, k_n=3.0, mu=0.5, preload=0.1)
    gap = size * rng.standard_normal((51, 60))
    with np.errstate(all="ignore"):
        period = contact_forces(gap, compile_contacts([law] * 20, evaluator=evaluator), 512)
    assert period.coefficients.shape == (51, 60)
    assert np.all(np.isfinite(period.coefficients)) == bool(size <= 1e150)


@pytest.mark.parametrize("order", [3, 5, 10, 20])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gap_that_is_flat_where_it_touches(order, sign):
    # ((1 - cos τ) / 2)^H stays within rounding of zero for a good part of the period
    flat = np.array([1.0])
    for _ in range(order):
        flat = np.polynomial.chebyshev.chebmul(flat, [0.5, -0.5])
    gap = np.zeros((2 * order + 1, 3))
    gap[0, 2], gap[1::2, 2], gap[1, 0] = sign * flat[0], sign * flat[1:], 1.0
    law = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.3)
    exact, sampled = (
        contact_forces(gap, compile_contacts([law], evaluator=evaluator), 4096).coefficients
        for evaluator in ("events", "intervals")
    )
    assert np.max(np.abs(exact - sampled)) < 1e-6


def test_integers_are_numbers():
    law = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.3, preload=1.0)
    gap = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    contacts = compile_contacts([law], evaluator="events")
    whole, real = (contact_forces(np.array(gap, dtype=t), contacts, 16) for t in (int, float))
    assert np.array_equal(whole.coefficients, real.coefficients)
    assert np.array_equal(contact_forces(gap, contacts, 16).coefficients, real.coefficients)
    with pytest.raises(InputError, match=r"shape \(2, 3\) for 1 contacts"):
        contact_forces(np.zeros((2, 3)), contacts, 16)


@pytest.mark.parametrize("evaluator", ["march", "intervals", "events"])
def test_slider_at_rest_on_its_limit_sticks(evaluator):
    # x - s of a slider at its limit is off by rounding: the march took that for slip and lost the derivative
    law = Jenkins(k_t=1.84, k_w=1.84, limit=0.3)
    gap = np.zeros((3, 3))
    gap[0, :2] = 0.5
    period = contact_forces(gap, compile_contacts([law], evaluator=evaluator), 64)
    assert period.coefficients[0, :2] == pytest.approx(0.3)
    # a steady displacement moves the slider along
    assert np.diag(period.blocks[0][TT]) == pytest.approx([0.0, 1.84, 1.84])


def test_too_few_samples():
    system, load = lifting()
    with pytest.raises(InputError, match="16 samples a period for 5 harmonics"):
        balance_of(system, load, order=5, samples=16)


# ---- solvers ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [64, 1024])
def test_recontact_into_stick(samples):
    # the sampled Jacobian is off there at any number of samples: Newton does not mind
    system, load = blades_and_damper(excitation=40.0)
    omega = 1100.0
    balance = balance_of(system, load, order=5, samples=samples)
    start = balance.unknowns(bonded(system, load, omega, balance))
    solution = newton(lambda v: balance.linearise(v, omega), start, Newton())
    assert solution.status is Status.CONVERGED
    states = balance.contacts(solution.x, omega).state[:, 0]
    opened = (states != SLIP) & (states != STICK)
    into_stick = opened & (np.roll(states, -1, axis=1) == STICK)
    assert np.any(into_stick), "no contact closes into stick: nothing was shown"


@pytest.mark.parametrize(("parametrisation", "through"), [("natural", False), ("arc_length", True)])
def test_frequency_stepping_ends_at_a_fold(parametrisation, through):
    system, load = lifting()
    balance = balance_of(system, load, order=3, samples=256)
    weights = np.ones(balance.size)
    weights[:1] = 0.0
    control = StepControl(scale=0.15, largest=0.25, max_points=300)
    following = Following(
        newton=Newton(max_iterations=10), control=control, weights=weights, parametrisation=parametrisation
    )
    # downward from above the peak, which bends to lower frequencies
    start = start_point(balance, balance.unknowns(bonded(system, load, 1.0, balance)), 1.0, following)
    assert start.solution.status.converged
    last = list(trace(balance, start, 1.6, following))[-1]
    assert (last.p == 1.6 and last.solution.status.converged) is through
    if not through:
        assert last.solution.status is Status.STEP_TOO_SMALL


def rubbing(retention):
    """A driven mass, and beside it one that nothing but friction holds."""
    mass, none = np.diag([1.0, 1e-3]), np.zeros((2, 2))
    stiffness = np.diag([1.0, 0.0])
    gap = none.repeat(2, axis=0)[:3]
    gap[0] = [1.0, -1.0]
    law = ElasticCoulomb(k_t=1.0, k_w=0.0, k_n=0.0, mu=1.0, preload=1e-4)
    structure = Structure(mass, np.diag([0.02, 0.0]), stiffness, table(("x", "xD")))
    system = System(structure, Interface(("d",), (law,), gap), np.array([0]), free=np.array([1])).with_retention(
        retention
    )
    return system, HarmonicLoad(np.zeros(2), {1: np.array([0.1, 0.0], dtype=complex)})


def test_free_damper():
    # a contact that slips in every cycle forgets its mean: nothing places the damper, and no globalisation helps
    sweep = Sweep(omega_range=(0.8, 1.2), selection="always_high", high=3)
    found = {}
    for retention in (0.0, 1e-4):
        system, load = rubbing(retention)
        problem = forced_problem(system, load, sweep)
        balance, omega = problem.low, 0.9
        # the motion where the damper lags behind: x = F / (k - w² + i c w), the damper at rest
        q = np.zeros((4, system.retained.size), dtype=complex)
        q[1, 0] = 0.1 / (1.0 - omega**2 + 0.02j * omega)
        q = q if system.retained.size == 2 else q[:, -1:]
        solution = newton(
            lambda v, b=balance, w=omega: b.linearise(v, w), balance.unknowns(q), Newton(max_iterations=60)
        )
        point = forced_point(balance, solution, "low", 0, omega, 0.0)
        found[retention] = solution.status, drift(problem, point)
    assert found[0.0][1].undetermined
    assert "xD" in found[0.0][1].coordinate
    assert found[1e-4][0] is Status.CONVERGED
    assert not found[1e-4][1].undetermined


@pytest.mark.parametrize("retention", [0.0, 1e-12, 1e-7])
def test_free_damper_by_products(retention):
    # the same question asked of the products: thousands of contacts leave no room for the array
    system, load = rubbing(retention)
    balance = forced_problem(system, load, Sweep(omega_range=(0.8, 1.2), selection="always_high", high=3)).low
    q = np.zeros((4, system.retained.size), dtype=complex)
    q[1, 0] = 0.1 / (1.0 - 0.9**2 + 0.02j * 0.9)
    jac = replace(balance, jacobian="structured").linearise(balance.unknowns(q[:, -balance.linear.n :]), 0.9).jac
    ratio, vector = as_array(jac.dense())
    found = by_products(jac)
    if retention == 0.0:
        assert ratio < SINGULAR
        assert found is None or found[0] < SINGULAR
    else:
        assert found[0] == pytest.approx(ratio, rel=0.01)
        assert abs(found[1] @ vector) > 0.999
