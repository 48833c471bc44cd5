"""What the alert may cost: no evaluation of a contact, no second verdict; and a corrector for starts that are near."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_bounds import unknowns_bound

from evidence.models.lumped import blades_and_damper, griffin
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic import balance as balance_module
from stickslip.harmonic.aft import contact_forces, forces_between
from stickslip.harmonic.selection.jacobian_alert import JacobianAlert
from stickslip.response.forced.response import Sweep, forced_response
from stickslip.solve.line_search import NaturalLevel
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Status

HZ = 2 * np.pi
STEPS = Sweep(omega_range=(155 * HZ, 166 * HZ), samples=64, frequencies=8, peak_points=0, threshold=np.inf, high=5)
SIZE = 1e-5  # gap amplitudes, m


@pytest.fixture
def evaluations(monkeypatch):
    """Count what asks contacts for their forces."""
    calls = []

    def counted(gaps, *args, **kwargs):
        calls.append(gaps.shape)
        return contact_forces(gaps, *args, **kwargs)

    monkeypatch.setattr(balance_module, "contact_forces", counted)
    return calls


def run(system, load, selection, sweep=STEPS):
    return list(forced_response(system, load, replace(sweep, selection=selection)))


# ---- the alert ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sweep", [STEPS, replace(STEPS, frequencies=0, points=6)], ids=["frequencies", "arc length"])
def test_the_alert_evaluates_no_contact(evaluations, sweep):
    system, load = blades_and_damper()
    plain = run(system, load, "always_low", sweep)
    without = len(evaluations)
    evaluations.clear()
    alerted = run(system, load, JacobianAlert(threshold=np.inf), sweep)
    assert max(p.predicted_error for p in alerted) > 0.01, "nothing slips: nothing was shown"
    assert len(evaluations) == without
    for a, b in zip(plain, alerted, strict=True):
        assert np.array_equal(a.coefficients, b.coefficients)


def test_contacts_on_samples_are_evaluated_once_a_point(evaluations):
    """Their events are not known: the price is one evaluation with many harmonics."""
    system, load = griffin(0.1)
    sweep = Sweep(omega_range=(1.05, 1.2), samples=64, frequencies=4, peak_points=0, evaluator="intervals", high=5)
    run(system, load, "always_low", sweep)
    without = len(evaluations)
    evaluations.clear()
    points = run(system, load, JacobianAlert(threshold=np.inf), sweep)
    assert len(evaluations) == without + len(points)


def test_a_repeat_asks_for_no_second_verdict(monkeypatch):
    system, load = blades_and_damper()
    asked = []
    judge = JacobianAlert.judge
    monkeypatch.setattr(JacobianAlert, "judge", lambda self, step: asked.append(step.omega) or judge(self, step))
    points = run(system, load, JacobianAlert(threshold=0.002))
    low = [p for p in points if p.stage == "low"]
    assert any(p.stage == "high" for p in points), "nothing was repeated: nothing was shown"
    assert asked == [p.omega for p in low if p.converged]


@pytest.mark.parametrize("stop", [8, 9])
def test_a_resumed_run_repeats_from_the_same_start(stop):
    # the start q + Δq is written down with the point of the first passage
    system, load = blades_and_damper()
    sweep = replace(STEPS, selection=JacobianAlert(threshold=0.002))
    points = list(forced_response(system, load, sweep))
    assert len(points) > stop, "nothing was repeated: nothing was shown"
    rest = list(forced_response(system, load, sweep, done=points[:stop]))
    for a, b in zip(rest, points[stop:], strict=True):
        assert np.array_equal(a.coefficients, b.coefficients)
        assert a.iterations == b.iterations


# ---- forces between known events ------------------------------------------------------------------------------------------


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    order=st.integers(1, 3),
    more=st.integers(0, 5),
    preload=st.sampled_from([0.0, 20.0, 300.0]),
)
def test_forces_of_more_harmonics_need_no_other_evaluation(seed, order, more, preload):
    rng = np.random.default_rng(seed)
    laws = [ElasticCoulomb(k_t=2e7, k_w=1e7, k_n=3e7, mu=mu, preload=preload) for mu in (0.3, 0.5, 0.0)]
    contacts = compile_contacts(laws, weights=np.array([1.0, 2.0, 0.5]), evaluator="events")
    gaps = SIZE * rng.standard_normal((2 * order + 1, 9))
    found = contact_forces(gaps, contacts, 0, history=False)
    assert found.events is not None
    assert found.events.whole
    again = forces_between(found.events, contacts, order + more)
    padded = np.vstack([gaps, np.zeros((2 * more, 9))])
    direct = contact_forces(padded, contacts, 0, history=False)
    # rounding of events, times stiffness and gap; a missed event would be off by a share of the force
    size = 3e7 * SIZE
    assert np.max(np.abs(again.coefficients - direct.coefficients)) <= 1e-10 * size
    assert np.max(np.abs(again.blocks - direct.blocks)) <= 1e-7 * 3e7
    if more == 0:
        assert np.array_equal(again.coefficients, found.coefficients)
        assert np.array_equal(again.blocks, found.blocks)


def test_events_of_stuck_contacts_are_none():
    law = ElasticCoulomb(k_t=2e7, k_w=1e7, k_n=3e7, mu=0.3, preload=1e5)
    contacts = compile_contacts([law], evaluator="events")
    gaps = SIZE * np.ones((3, 3))
    assert contact_forces(gaps, contacts, 0, history=False).events.none
    slipping = contact_forces(1e3 * gaps, contacts, 0, history=False)
    assert not slipping.events.none


def test_a_lost_iterate_has_no_events():
    law = ElasticCoulomb(k_t=2e7, k_w=1e7, k_n=3e7, mu=0.3, preload=1e5)
    contacts = compile_contacts([law], evaluator="events")
    events = contact_forces(np.full((3, 3), np.nan), contacts, 0, history=False).events
    assert not events.whole
    assert not events.none


# ---- the corrector of repeats ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class At:
    residual: np.ndarray
    jac: np.ndarray
    seconds_contact: float = 0.0


def chain(scales):
    """A chain with cubic springs to the ground, its equations multiplied by `scales`."""
    n = scales.size
    stiffness = 2.1 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    load = np.linspace(1.0, 3.0, n)

    def evaluate(x):
        residual = stiffness @ x + 5.0 * x**3 - load
        jac = stiffness + np.diag(15.0 * x**2)
        return At(scales * residual, np.asfortranarray(scales[:, None] * jac))

    return evaluate


def test_the_natural_test_does_not_see_the_scales_of_equations():
    # rows times powers of two leave every correction as it was; a test of residuals would go other ways
    scales = 2.0 ** np.array([0, 8, -7, 3, 10, -9])
    start = np.array([-3.0, 2.0, 0.0, 8.0, -1.0, 4.0])
    one, other = (
        newton(chain(s), start, Newton(tolerance=1e-9 * s.min()), NaturalLevel()) for s in (np.ones(6), scales)
    )
    assert one.status is other.status is Status.CONVERGED
    reached = chain(np.ones(6))(one.x), chain(scales)(other.x)
    assert np.abs(one.x - other.x).max() <= unknowns_bound(one.x, *reached)
    reference = newton(chain(np.ones(6)), start, Newton(tolerance=1e-12))
    reached = (chain(np.ones(6))(end.x) for end in (one, reference))
    assert np.abs(one.x - reference.x).max() <= unknowns_bound(one.x, *reached)


def test_the_natural_test_finds_no_root_where_there_is_none():
    def rootless(x):
        return At(x**2 + 1.0, np.array([[2.0 * x[0]]], order="F"))

    solution = newton(rootless, np.array([3.0]), Newton(max_iterations=200), NaturalLevel())
    assert solution.status is not Status.CONVERGED
    assert solution.residual_norm >= 1.0


def test_the_natural_test_tells_a_singular_jacobian():
    def flat(x):
        return At(np.array([x[0] - 1.0, 1.0]), np.array([[1.0, 0.0], [0.0, 0.0]], order="F"))

    assert newton(flat, np.zeros(2), Newton(), NaturalLevel()).status is Status.SINGULAR
