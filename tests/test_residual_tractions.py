"""Bounds over the tractions of contacts that stick: benchmark B8, brute force, motions in time, other laws."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from evidence.models.lumped import blades_and_damper, lumped, system
from evidence.validation.case_b8_residual_traction import TABLE, y2
from stickslip import CoupledCoulomb, CubicSpring, Interface, Iwan, Jenkins, RigidCoulomb, UnilateralSpring
from stickslip.contact.element import element, element_step
from stickslip.errors import InputError
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.parameter import Discretisation
from stickslip.response.residual_tractions import TractionSearch, confirmed, resonance_bounds, traction_bounds
from stickslip.response.residual_tractions.bounds import _at, _setup, crossings, may_be_several
from stickslip.response.residual_tractions.search import sliders_at
from stickslip.response.system import System
from stickslip.response.time.start import TransientStart
from stickslip.response.time.transient import TimeStepping, integrate
from stickslip.solve.newton_method import Newton
from stickslip.units import HZ

ON_SAMPLES = Discretisation(order=5, samples=256, evaluator="intervals")
EVENTS = Discretisation(order=5)


def damped() -> tuple[System, HarmonicLoad]:
    """B6 with dashpots on the damper, too, so that motions in time settle."""
    made, load = blades_and_damper(m=None)
    damping = np.diag([20.0, 20, 20, 20, 30, 30])
    return replace(made, structure=replace(made.structure, damping=damping)), load


def test_bounds_hold_the_spread_of_benchmark_b8_to_its_digits():
    made, load = blades_and_damper()
    found = traction_bounds(made, load, [HZ * float(row[0]) for row in TABLE], 0, ON_SAMPLES)
    for row, bounds in zip(TABLE, found, strict=True):
        smallest, largest = float(row[1]), float(row[3])
        assert bounds.least.amplitude == pytest.approx(smallest, rel=4e-7)
        if row[0] == "215":  # between the benchmark's five shares of the limit lies a larger one
            assert bounds.most.amplitude > 1.003 * largest
        else:
            assert bounds.most.amplitude == pytest.approx(largest, rel=4e-7)
        assert bounds.unique == (smallest == largest)


def test_no_share_of_the_limits_leads_outside():
    """Each start by the law's own `residual_traction`, which the search does not use."""
    made, load = blades_and_damper()
    (bounds,) = traction_bounds(made, load, [HZ * 215.0], 0, ON_SAMPLES)
    own = [y2(215.0, (a, b))[0] for a in (-1.0, 0.0, 1.0) for b in (-0.9, -0.45, -0.25, 0.3, 0.8)]
    assert min(own) >= bounds.least.amplitude * (1 - 1e-7)
    assert max(own) <= bounds.most.amplitude * (1 + 1e-7)
    assert max(own) > 0.99 * bounds.most.amplitude


def test_gradient_agrees_with_differences():
    made, load = blades_and_damper()
    setup = _setup(made, load, [HZ * 228.0], 0, EVENTS)
    state = _at(setup, HZ * 228.0, TractionSearch(starts=0), None).reference
    by_slider, by_log_omega = state.gradient()
    sticks = state.room.sticks
    assert np.count_nonzero(sticks) == 1
    step = np.where(sticks, 1e-3 * state.room.half, 0.0)
    sides = [setup.problem.solved(state.sliders + k * step, state.omega, (state,)) for k in (1, -1)]
    change = np.log(sides[0].amplitude / sides[1].amplitude) / (2 * step.sum())
    assert by_slider[sticks][0] == pytest.approx(change, rel=1e-4)
    sides = [setup.problem.solved(state.sliders, state.omega * (1 + k), (state,)) for k in (1e-5, -1e-5)]
    change = np.log(sides[0].amplitude / sides[1].amplitude) / 2e-5
    assert by_log_omega == pytest.approx(change, rel=1e-3)


def test_both_ends_are_motions():
    made, load = blades_and_damper()
    how = Discretisation(order=15, samples=512)
    (bounds,) = traction_bounds(made, load, [HZ * 164.0], 0, how)
    assert bounds.most.amplitude / bounds.least.amplitude == pytest.approx(1.0423, abs=2e-4)
    for end in (bounds.least, bounds.most):
        told = confirmed(made, load, bounds.omega, end, 0, how, TimeStepping(max_periods=40))
        assert told.agrees
        assert told.resolved == pytest.approx(end.amplitude, rel=1e-5)
        assert told.transient == pytest.approx(end.amplitude, rel=2e-4)


def test_resonance_of_contacts_that_slip_is_unique():
    made, load = blades_and_damper()
    omegas = HZ * np.linspace(162.0, 164.0, 5)
    known = list(traction_bounds(made, load, list(omegas), 0, EVENTS, TractionSearch(starts=0)))
    least, most = (getattr(resonance_bounds(made, load, known, end, 0, EVENTS), end) for end in ("least", "most"))
    assert least.amplitude == pytest.approx(most.amplitude, rel=1e-7)
    assert least.amplitude == pytest.approx(2.2739e-4, rel=1e-3)  # benchmark B6, on samples
    assert most.stuck == 0


def test_resonance_where_a_contact_sticks_is_a_band():
    made, load = damped()
    omegas = HZ * np.array([214.0, 217.0, 219.0, 222.0])
    known = list(traction_bounds(made, load, list(omegas), 0, EVENTS, TractionSearch(starts=0)))
    top = resonance_bounds(made, load, known, "most", 0, EVENTS)
    assert top.most.amplitude > max(b.most.amplitude for b in known)
    assert HZ * 217.0 < top.omega < HZ * 222.0


def test_motions_in_time_from_random_states_stay_within():
    made, load = damped()
    omega, random = HZ * 160.0, np.random.default_rng(3)
    (bounds,) = traction_bounds(made, load, [omega], 0, Discretisation(order=15, samples=512))
    gaps, laws = made.interface.gap_operator, made.interface.laws
    sizes = []
    for _ in range(5):
        u = 3e-4 * random.normal(size=6) + np.array([0, 0, 0, 0, 0, 3e-4])
        at = (gaps @ u).reshape(2, 3)
        states = [np.array([x[0] + 4e-4 * random.uniform(-1, 1), x[1]]) for x in at]
        start = TransientStart(u, 3e-4 * omega * random.normal(size=6), states)
        stepping = TimeStepping(steps_per_period=256, max_periods=200)
        run = integrate(made.structure, gaps, laws, load, omega, made.outputs[:1], start, stepping)
        assert run.scatter < 5e-4
        sizes.append(abs(run.harmonics[1, 0]))
    assert min(sizes) > bounds.least.amplitude * (1 - 5e-4)
    assert max(sizes) < bounds.most.amplitude * (1 + 5e-4)
    assert max(sizes) > 1.02 * min(sizes)  # they differ, as the bounds do


def stopped(law, gap_rows: int = 1) -> tuple[System, HarmonicLoad]:
    """A mass held by a friction element beside a stop: where the element rests decides how hard the stop is hit."""
    n = gap_rows
    stiffness, mass = 1e4 * np.eye(n), np.eye(n)
    gap = np.zeros((6, n))
    gap[range(n), range(n)] = 1.0
    gap[5, 0] = 1.0
    structure = lumped(mass, 20.0 * np.eye(n), stiffness)
    laws = [law, UnilateralSpring(k_n=5e4, preload=2.0)]
    forces = np.array([4.0, 2.0 - 1.0j])[:n]
    return system(structure, laws, gap), HarmonicLoad(np.zeros(n), {1: forces.astype(complex)})


@pytest.mark.parametrize(
    ("law", "rows"),
    [
        (Jenkins(k_t=1e4, limit=6.0), 1),
        (Iwan(k_t=1e4, limit=6.0), 1),
        (CoupledCoulomb(k_t=1e4, k_n=0.0, mu=0.5, preload=12.0), 2),
        (CoupledCoulomb(k_t=1e4, k_w=1.2e4, k_n=0.0, mu=0.5, preload=12.0), 2),
    ],
    ids=["jenkins", "iwan", "planar", "two stiffnesses"],
)
def test_other_laws(law, rows):
    made, load = stopped(law, rows)
    omega = 130.0
    how = Discretisation(order=3, samples=64)
    (bounds,) = traction_bounds(made, load, [omega], 0, how, TractionSearch(starts=0))
    assert bounds.most.amplitude > 1.02 * bounds.least.amplitude
    assert bounds.least.amplitude <= bounds.reference.amplitude <= bounds.most.amplitude
    setup = _setup(made, load, [omega], 0, how)
    begin, random = setup.reference(omega, ()), np.random.default_rng(5)
    shares = random.uniform(-1.0, 1.0, (6, *begin.sliders.shape))
    sizes = [setup.problem.solved(sliders_at(begin, s), omega, (begin,)).amplitude for s in shares]
    assert max(sizes) <= bounds.most.amplitude * (1 + 1e-5)
    assert min(sizes) >= bounds.least.amplitude * (1 - 1e-5)
    assert max(sizes) > 1.001 * min(sizes)
    for end in (bounds.least, bounds.most):
        assert np.nanmax(np.abs(end.multipliers)) <= 1.0 + 1e-9
        assert confirmed(made, load, omega, end, 0, how, TimeStepping(steps_per_period=256)).agrees


def test_bounds_hold_the_motions_of_other_branches():
    """One harmonic of a Duffing oscillator: its three amplitudes are the roots of a cubic in a²."""
    m, c, k, cubic, force, omega = 1.0, 2.0, 1e4, 1e8, 2.0, 115.0
    gap = np.zeros((6, 1))
    gap[[0, 3]] = 1.0
    laws = [CubicSpring(cubic_t=cubic), Jenkins(k_t=1e2, limit=1e-6)]  # slips all the time
    made = system(lumped(m * np.eye(1), c * np.eye(1), k * np.eye(1)), laws, gap)
    load = HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})
    slope, off = 0.75 * cubic, k - m * omega**2
    squares = np.roots([slope**2, 2 * slope * off, off**2 + (c * omega) ** 2, -(force**2)])
    sizes = np.sort(np.sqrt(squares[np.abs(squares.imag) < 1e-12].real))
    assert len(sizes) == 3
    how = Discretisation(order=1)
    (bounds,) = traction_bounds(made, load, [omega], 0, how, TractionSearch(starts=0))
    assert bounds.branches == 3
    assert [bounds.least.amplitude, bounds.most.amplitude] == pytest.approx(sizes[[0, 2]], rel=1e-4)
    # the branch ends where the force does the work of the dashpot alone: a = F / (c ω) on the backbone
    omegas = np.linspace(116.0, 126.0, 6)
    known = list(traction_bounds(made, load, list(omegas), 0, how, TractionSearch(starts=0)))
    top = resonance_bounds(made, load, known, "most", 0, how, TractionSearch(starts=0))
    end = np.sqrt((k + np.sqrt(k**2 + 4 * m * slope * (force / c) ** 2)) / (2 * m))
    assert [b.branches for b in known] == [3 if b.omega < end else 1 for b in known]
    assert top.most.amplitude == pytest.approx(force / (c * end), rel=2e-4)


@pytest.mark.parametrize(
    ("converged", "places", "count"),
    [
        ((True, True), (105.0, 125.0), 1),
        ((True, True), (125.0, 105.0), 1),
        ((True, True), (115.0, 125.0), 1),
        ((True, True), (115.0, 115.0), 1),
        ((True, True), (115.5, 125.0), 0),
        ((True, True), (105.0, 114.5), 0),
        ((False, True), (105.0, 125.0), 0),
        ((True, False), (105.0, 125.0), 0),
        ((False, False), (105.0, 125.0), 0),
    ],
)
def test_a_branch_crosses_a_frequency_between_two_solutions_that_converged(converged, places, count):
    made = system(lumped(np.eye(1), 2.0 * np.eye(1), 1e4 * np.eye(1)), [Jenkins(k_t=1e2, limit=1e-6)], np.eye(3, 1))
    load = HarmonicLoad(np.zeros(1), {1: np.array([2.0 + 0j])})
    balance = harmonic_balance(made.condensed(load, 1, np.array([0])), made.interface, 1, 64)
    ends = [
        SimpleNamespace(converged=c, p=p, point=SimpleNamespace(x=np.zeros(3)))
        for c, p in zip(converged, places, strict=True)
    ]
    found = list(crossings([ends], balance, 115.0, Newton()))
    assert len(found) == count
    for x in found:
        assert np.linalg.norm(balance.linearise(x, 115.0).residual) < 1e-8


def test_friction_under_a_constant_normal_load_is_not_swept():
    alone = [
        Jenkins(k_t=1e4, limit=6.0),
        Iwan(k_t=1e4, limit=6.0),
        CoupledCoulomb(k_t=1e4, k_n=0.0, mu=0.5, preload=12.0),
    ]
    others = [UnilateralSpring(k_n=5e4, preload=2.0), CoupledCoulomb(k_t=1e4, k_n=1e4, mu=0.5, preload=12.0)]
    for law in (*alone, *others):
        interface = Interface(("one",), (law,), np.eye(3))
        assert may_be_several(interface) == (law in others)


@dataclass(frozen=True, kw_only=True)
class Own:
    """A law of one's own, a Jenkins element: it says where its spring starts and what limits it."""

    k_t: float
    limit: float
    slider: tuple[float, float] | None = None

    kernel = element_step
    pairs = 5

    def parameters(self):
        return element(k_t=self.k_t, mu=1.0, preload=self.limit, unilateral=False)

    def initial_state(self):
        return np.array(self.slider or (0.0, 0.0))

    def stuck_stiffness(self):
        return np.array([self.k_t, 0.0, 0.0])


def test_a_law_of_ones_own_that_is_marched():
    found = []
    for law in (Own(k_t=1e4, limit=6.0), Jenkins(k_t=1e4, limit=6.0)):
        made, load = stopped(law)
        (bounds,) = traction_bounds(made, load, [130.0], 0, Discretisation(order=3), TractionSearch(starts=0))
        found.append([end.amplitude for end in (bounds.least, bounds.reference, bounds.most)])
    assert found[0] == pytest.approx(found[1], rel=1e-3)  # one on 256 samples, the other at events
    assert found[1][2] > 1.02 * found[1][0]


@dataclass(frozen=True)
class Sticky:
    """A law of one's own that remembers a force and says nothing of its start."""

    pairs = 5

    def initial_state(self):
        return np.zeros(2)

    def stuck_stiffness(self):
        return np.array([1.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("law", "why"), [(RigidCoulomb(mu=0.3), "is rigid"), (Sticky(), "does not say where its springs start")]
)
def test_what_is_not_supported_is_said(law, why):
    made, load = stopped(Jenkins(k_t=1e4, limit=6.0))
    interface = made.interface
    own = Interface(interface.names, (law, interface.laws[1]), interface.gap_operator)
    with pytest.raises(InputError, match=why):
        next(traction_bounds(replace(made, interface=own), load, [130.0]))
