"""Branches in any parameter, and the resonance peak followed directly: against fixed-frequency solutions, dense sweeps and closed forms."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from newton_bounds import unknowns_bound

from evidence.models.lumped import griffin
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic import balance as balance_module
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import AtFrequency, law_field, load_level
from stickslip.harmonic.peak import Driven, PeakProblem
from stickslip.model.matrices import lumped
from stickslip.operators import array_of
from stickslip.response.continuation.branch import following_vibration, steps_through
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.parameter import Discretisation, branch_in_parameter, parameter_family
from stickslip.response.resonances.tracking import smallest_peak, track_peak
from stickslip.response.system import System
from stickslip.solve.continuation import start_point, trace
from stickslip.solve.krylov import Krylov
from stickslip.solve.linear import Dense, factorised
from stickslip.solve.newton_method import Newton, newton

NONE = np.zeros(0, dtype=np.int64)
FINE = Newton(tolerance=1e-12, max_iterations=60)


def damped(limit: float = 0.2) -> tuple[System, HarmonicLoad]:
    """Benchmark B3 with its damper as a Jenkins element."""
    system, load = griffin(limit)
    laws = (Jenkins(k_t=0.5, limit=limit),)
    return replace(system, interface=replace(system.interface, laws=laws)), load


def block(preload: float = 1.0, mu: float = 0.5) -> tuple[System, HarmonicLoad]:
    """A mass that moves in three directions on one contact; it slips at resonance, and lifts off under a small preload."""
    stiffness = np.array([[1.0, 0.1, 0.15], [0.1, 1.3, 0.1], [0.15, 0.1, 1.1]])
    law = ElasticCoulomb(k_t=0.4, k_w=0.3, k_n=0.5, mu=mu, preload=preload)
    system = System(lumped(np.eye(3), stiffness, 0.03 * stiffness), Interface(("c",), (law,), np.eye(3)), np.arange(3))
    return system, HarmonicLoad(np.array([0, 0, -0.2]), {1: np.array([0.2, 0.1j, 0.12])})


def duffing() -> tuple[System, HarmonicLoad]:
    """Two masses, the first on a hardening spring; force and output at the second, which is condensed."""
    k = np.array([[2.0, -1.0], [-1.0, 1.0]])
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    interface = Interface(("s",), (CubicSpring(cubic_t=0.4, k_t=0.1),), gap)
    load = HarmonicLoad(np.zeros(2), {1: np.array([0.0, 0.02])})
    return System(lumped(np.eye(2), k, 0.03 * k), interface, np.array([1])), load


def member(system, load, parameter, value, how):
    """The periodic problem at one value, the first output retained."""
    dof = system.outputs[:1]
    return parameter_family(system, load, parameter, value, lambda s, f: how.balance(s, f, dof))(value)


def amplitude(balance, dof, x):
    n = balance.linear.n
    place = int(np.searchsorted(balance.linear.retained, dof))
    return balance.displacement_scale * np.hypot(x[n + place], x[2 * n + place])


def dense_peak(system, load, parameter, value, how, omegas):
    """Largest amplitude over closely spaced frequencies, each solved from the one before; the top by a parabola."""
    balance = member(system, load, parameter, value, how)
    x = without_branch(system, balance, FINE, omegas[0]).x
    heights = []
    for omega in omegas:
        solution = newton(lambda v, w=omega: balance.linearise(v, w), x, FINE)
        assert solution.status.converged
        x = solution.x
        heights.append(amplitude(balance, system.outputs[0], x))
    top = int(np.argmax(heights))
    assert 0 < top < len(omegas) - 1
    a, b, c = np.polyfit(omegas[top - 1 : top + 2] - omegas[top], heights[top - 1 : top + 2], 2)
    return c - b**2 / (4 * a), omegas[top] - b / (2 * a)


# ---- the equation of the peak --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("condition", ["horizontal_tangent", "phase_quadrature", "variable_phase"])
@pytest.mark.parametrize("case", [damped, block, duffing])
def test_derivatives_of_the_peak_problem(case, condition):
    system, load = case()
    how = Discretisation(order=3)
    balance = how.balance(system, load, system.outputs[:1])
    name = {"damped": "limit", "block": "mu", "duffing": "cubic_t"}[case.__name__]
    value = {"damped": 0.2, "block": 0.5, "duffing": 0.4}[case.__name__]
    invert = partial(factorised, Dense())
    driven = Driven(0, (1,))
    problem = PeakProblem(law_field(balance, name), condition, driven, 0.3, 1.1, invert)
    x = without_branch(system, balance, FINE, 1.05).x
    y = np.append(x + 0.05 * np.max(np.abs(x)) * np.random.default_rng(1).standard_normal(x.size), -0.04)
    at = problem.linearise(y, value)
    step = 1e-5
    jac = np.array(
        [
            (problem.linearise(y + step * e, value).residual - problem.linearise(y - step * e, value).residual)
            / (2 * step)
            for e in np.eye(y.size)
        ]
    ).T
    # differences of differences: 1e-6 of noise in J over a step of 1e-5 leaves four digits in the last row
    scale = np.max(np.abs(jac), axis=1)
    away = np.abs(array_of(at.jac) - jac)
    assert np.all(np.max(away, axis=1) < 1e-3 * scale)
    assert np.max(away[:-1]) < 1e-5 * np.max(scale)
    h = 1e-4 * value
    by_p = (problem.linearise(y, value + h).residual - problem.linearise(y, value - h).residual) / (2 * h)
    assert np.max(np.abs(at.jac_p - by_p)) < 1e-4 * max(np.max(np.abs(by_p)), 1e-3)


# ---- peaks against dense sweeps -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limit", [0.03, 0.1, 0.6])
def test_tracked_peak_of_a_damper_is_that_of_a_dense_sweep(limit):
    system, load = damped()
    how = Discretisation(order=3)
    points = list(track_peak(system, load, "limit", [0.2, limit], (0.8, 1.4), discretisation=how))
    found = points[-1]
    assert found.converged
    assert found.is_maximum
    omegas = found.omega * (1 + np.linspace(-0.003, 0.003, 61))
    height, at = dense_peak(system, load, "limit", limit, how, omegas)
    assert found.amplitude == pytest.approx(height, rel=1e-6)
    assert found.omega == pytest.approx(at, rel=1e-4)


@pytest.mark.parametrize(
    ("parameter", "values"),
    [("mu", (0.5, 0.3, 0.15)), ("preload", (1.0, 0.5, 0.2, 0.0, -0.2)), ("excitation", (1.0, 1.5, 2.0))],
)
def test_tracked_peak_of_a_contact_in_three_directions(parameter, values):
    system, load = block()
    how = Discretisation(order=3)
    states = set()
    for point in track_peak(system, load, parameter, values, (0.8, 1.6), discretisation=how):
        assert point.converged
        assert point.is_maximum
        omegas = point.omega * (1 + np.linspace(-2e-3, 2e-3, 41))
        height, _ = dense_peak(system, load, parameter, point.value, how, omegas)
        assert point.amplitude == pytest.approx(height, rel=1e-6)
        balance = member(system, load, parameter, point.value, how)
        x = balance.unknowns(point.coefficients[:, balance.linear.retained])
        assert np.max(np.abs(balance.linearise(x, point.omega).residual)) < 1e-9
        states |= set(np.unique(balance.contacts(x, point.omega).state))
    assert {0, 1} <= states
    if parameter == "preload":
        assert 2 in states  # it lifts off


def test_tracked_peak_of_a_condensed_output_beside_a_fold():
    system, load = duffing()
    how = Discretisation(order=5, samples=64)
    points = list(track_peak(system, load, "excitation", (1.0, 2.0, 3.0), (0.5, 0.9), discretisation=how))
    assert all(p.converged and p.is_maximum for p in points)
    # hardening: larger peaks lie at higher frequencies
    assert np.all(np.diff([p.omega for p in points]) > 0.0)
    # from below, where there is one solution, up the branch that overhangs, to just beyond its top
    near = points[0].omega * (1 + np.linspace(-1e-4, 1e-4, 21))
    omegas = np.append(np.linspace(0.55, 0.999 * near[0], 60), near)
    height, _ = dense_peak(system, load, "excitation", 1.0, how, omegas)
    assert points[0].amplitude == pytest.approx(height, rel=1e-6)


@pytest.mark.parametrize(("ratio", "form"), [(0.03, "dense"), (0.01, "structured"), (0.004, "dense")])
def test_a_peak_that_almost_is_a_fold_is_tracked(ratio, form, monkeypatch):
    # the lighter the damping, the nearer the fold: by the frequency the response has no slope there, along itself it has
    system, load = duffing()
    stiffness = system.structure.stiffness
    system = replace(system, structure=lumped(np.eye(2), stiffness, ratio * stiffness))
    monkeypatch.setattr(balance_module, "products_pay", lambda _: form == "structured")
    how = Discretisation(order=3, samples=64)
    levels = ratio / 0.03 * np.array([1.0, 1.5, 2.0])
    points = list(track_peak(system, load, "excitation", levels, (0.5, 0.9), discretisation=how))
    assert all(p.converged and p.is_maximum for p in points)
    last = points[-1]
    balance = replace(member(system, load, "excitation", levels[-1], how), jacobian="dense")
    control = replace(steps_through(0.4, 40), largest=0.05, max_points=5000)
    following = following_vibration(balance, control, FINE)
    start = start_point(balance, without_branch(system, balance, FINE, 0.5).x, 0.5, following)
    branch = list(trace(balance, start, last.omega * 1.02, following))
    heights = [amplitude(balance, system.outputs[0], p.x) for p in branch]
    # nothing is higher, and what is nearest lies within half a step: (0.05 / 2)² / 2
    assert max(heights) <= last.amplitude * (1 + 1e-9)
    assert max(heights) == pytest.approx(last.amplitude, rel=4e-4)


def test_samples_leave_a_peak_with_kinks_that_is_found_all_the_same():
    system, load = damped()
    exact = Discretisation(order=1)
    sampled = replace(exact, evaluator="intervals", samples=128)
    values = (0.2, 0.14)
    one, other = (
        [p.amplitude for p in track_peak(system, load, "limit", values, (0.8, 1.4), discretisation=d)]
        for d in (exact, sampled)
    )
    # second order in 1/samples: (2π/128)² / 12 is 2.0e-4
    assert other == pytest.approx(one, rel=8e-4)
    assert other != one


@pytest.mark.parametrize("by", ["horizontal_tangent", "phase_quadrature"])
def test_many_unknowns_are_tracked_by_products_as_by_arrays(by, monkeypatch):
    system, load = block()
    how, values = Discretisation(order=4), (0.5, 0.3, 0.15)
    arrays = list(track_peak(system, load, "mu", values, (0.8, 1.6), by, discretisation=how))
    monkeypatch.setattr(balance_module, "products_pay", lambda _: True)
    assert how.balance(system, load, NONE).structured
    krylov = Krylov()
    how = replace(how, newton=Newton(linear=krylov))
    products = list(track_peak(system, load, "mu", values, (0.8, 1.6), by, discretisation=how))
    assert krylov.counts.products > 0
    for one, other in zip(products, arrays, strict=True):
        assert one.converged
        assert other.converged
        for name in ("amplitude", "omega", "phase"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-9)
        # differences of Jacobians over 1e-6
        assert one.curvature == pytest.approx(other.curvature, rel=1e-5)
        assert one.slope == pytest.approx(other.slope, rel=1e-5)


def test_phase_quadrature_is_in_quadrature_and_near_the_top():
    system, load = block()
    values = (0.5, 0.4, 0.3)
    how = Discretisation(order=3)
    tops = track_peak(system, load, "mu", values, (0.8, 1.6), discretisation=how)
    for top, point in zip(
        tops, track_peak(system, load, "mu", values, (0.8, 1.6), "phase_quadrature", discretisation=how), strict=True
    ):
        assert point.phase == pytest.approx(-np.pi / 2, abs=1e-9)
        assert point.amplitude < top.amplitude  # the horizontal tangent is the maximum
        assert point.amplitude == pytest.approx(top.amplitude, rel=5e-3)


@pytest.mark.parametrize(("case", "parameter", "value"), [(damped, "limit", 0.12), (block, "mu", 0.3)])
def test_phase_quadrature_is_where_a_dense_sweep_crosses_it(case, parameter, value):
    system, load = case()
    how = Discretisation(order=3)
    start = {"limit": 0.2, "mu": 0.5}[parameter]
    point = list(
        track_peak(system, load, parameter, (start, value), (0.8, 1.6), "phase_quadrature", discretisation=how)
    )[-1]
    balance = member(system, load, parameter, value, how)
    n, place = balance.linear.n, int(np.searchsorted(balance.linear.retained, system.outputs[0]))
    omegas = point.omega * (1 + np.linspace(-5e-3, 5e-3, 42))  # 42: none is the tracked one
    x = without_branch(system, balance, FINE, omegas[0]).x
    found = []
    for omega in omegas:
        x = newton(lambda v, w=omega: balance.linearise(v, w), x, FINE).x
        found.append(complex(x[n + place], -x[2 * n + place]) * balance.displacement_scale)
    # the largest force is in phase with the cosine: in quadrature the real part vanishes
    real = np.real(found)
    assert real[0] > 0.0 > real[-1]
    i = int(np.flatnonzero(real > 0.0)[-1])
    share = real[i] / (real[i] - real[i + 1])
    # between neighbours 2.4e-4 apart the curves are straight to the square of that, over the half-width of the peak
    assert point.omega == pytest.approx(omegas[i] + share * (omegas[i + 1] - omegas[i]), rel=1e-6)
    height = abs(found[i] + share * (found[i + 1] - found[i]))
    assert point.amplitude == pytest.approx(height, rel=1e-5)


@pytest.mark.parametrize("by", ["horizontal_tangent", "phase_quadrature"])
@pytest.mark.parametrize(
    ("case", "parameter", "value"), [(damped, "limit", 0.12), (block, "mu", 0.35), (block, "excitation", 1.3)]
)
def test_slope_along_the_curve_of_peaks(case, parameter, value, by):
    system, load = case()
    values = value * np.array([0.999, 1.0, 1.001])
    points = list(track_peak(system, load, parameter, values, (0.8, 1.6), by, discretisation=Discretisation(order=3)))
    difference = (points[2].amplitude - points[0].amplitude) / (points[2].value - points[0].value)
    assert points[1].slope == pytest.approx(difference, rel=1e-4)


def test_smallest_peak_is_the_optimum_of_the_damper():
    system, load = damped()
    best = smallest_peak(system, load, "limit", (0.1, 0.2), (0.8, 1.4), discretisation=Discretisation(order=1))
    # literature benchmark B3, to its printed digits
    assert best.value == pytest.approx(0.138956, abs=5e-7)
    assert best.amplitude == pytest.approx(0.5509002, abs=5e-8)
    assert best.omega == pytest.approx(1.118581, abs=5e-7)
    around = track_peak(
        system, load, "limit", best.value * np.array([0.98, 1.02]), (0.8, 1.4), discretisation=Discretisation(order=1)
    )
    assert all(p.amplitude > best.amplitude for p in around)


def test_tracking_needs_fewer_evaluations_than_sweeping():
    system, load = damped()
    values = np.linspace(0.3, 0.1, 11)
    points = list(track_peak(system, load, "limit", values, (0.8, 1.4), discretisation=Discretisation(order=3)))
    sweep = points[0].evaluations
    assert all(p.converged for p in points)
    assert sum(p.evaluations for p in points[1:]) < 0.25 * sweep * (len(points) - 1)


# ---- branches in a parameter ----------------------------------------------------------------------------------------------


@pytest.mark.kernel
@pytest.mark.parametrize(
    ("parameter", "span"),
    [
        ("excitation", (0.3, 2.0)),
        ("static_load", (0.0, 1.0)),
        ("mu", (1.0, 0.1)),
        ("preload", (2.0, -0.1)),
        ("k_n", (0.5, 1.5)),
        ("k_t", (0.1, 1.0)),
        ("initial_gap", (-2.0, 0.1)),
    ],
)
def test_branch_ends_where_a_fresh_solution_lies(parameter, span):
    system, load = block()
    how = Discretisation(order=3)
    points = list(branch_in_parameter(system, load, parameter, span, 0.9, points=8, discretisation=how))
    assert all(p.converged for p in points)
    assert (points[0].value, points[-1].value) == span
    balance = member(system, load, parameter, span[1], how)
    x = balance.unknowns(points[-1].coefficients[:, balance.linear.retained])
    assert np.max(np.abs(balance.linearise(x, 0.9).residual)) < 1e-9
    fresh = newton(lambda v: balance.linearise(v, 0.9), without_branch(system, balance, FINE, 0.9).x, FINE)
    assert fresh.status.converged
    bound = unknowns_bound(x, *(balance.linearise(v, 0.9) for v in (fresh.x, x)))
    assert np.max(np.abs(fresh.x - x)) <= bound


def test_stuck_contact_answers_in_proportion_to_the_excitation():
    system, load = damped(limit=1e3)
    points = list(branch_in_parameter(system, load, "excitation", (0.5, 2.0), 1.1, points=5))
    first = points[0].coefficients[1, 0] / 0.5
    assert [p.coefficients[1, 0] / p.value for p in points] == pytest.approx([first] * len(points), rel=1e-9)


@pytest.mark.parametrize("first", [0.2, 2.5])
def test_branch_in_the_excitation_goes_round_folds(first):
    system, load = duffing()
    # above the linear resonance the amplitude over the excitation is S-shaped
    how = Discretisation(order=3, samples=64)
    points = list(branch_in_parameter(system, load, "excitation", (first, 6.0), 0.72, points=30, discretisation=how))
    assert all(p.converged for p in points)
    assert points[-1].value == 6.0
    assert {p.forward for p in points} == {True, False}
    values = np.array([p.value for p in points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(values))))
    assert turns.size == 2
    assert min(values) < 1.6  # the second fold, which the branch goes back to from wherever it begins
    heights = np.array([abs(p.coefficients[1, 1]) for p in points])
    assert heights[-1] > 3 * heights[0]


def test_a_function_of_the_user_may_vary_anything():
    system, load = block()

    def softer(mu):
        return block(mu=mu)

    ends = [
        list(branch_in_parameter(system, load, parameter, (0.5, 0.2), 1.0, points=4))[-1].coefficients
        for parameter in ("mu", softer)
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)

    def heavier(mass):
        structure = replace(system.structure, mass=mass * system.structure.mass)
        return replace(system, structure=structure), load

    points = list(track_peak(system, load, heavier, (1.0, 1.2), (0.8, 1.6)))
    assert points[1].omega < points[0].omega


@pytest.mark.parametrize("part", ["excitation", "static_load"])
def test_derivative_by_the_load_is_exact(part):
    system, load = block()
    balance = Discretisation(order=2).balance(system, load, NONE)
    problem = AtFrequency(load_level(balance, part), 0.9)
    x = np.random.default_rng(3).standard_normal(balance.size)
    at = problem.linearise(x, 1.0)
    change = problem.linearise(x, 3.0).residual - problem.linearise(x, 2.0).residual
    np.testing.assert_allclose(at.jac_p, change, atol=1e-9)
    assert np.any(change)


def test_initial_gap_of_an_elastic_contact_is_a_negative_preload():
    system, load = block()
    balance = Discretisation(order=2).balance(system, load, NONE)
    assert law_field(balance, "initial_gap")(0.3).interface.laws[0].preload == pytest.approx(-0.15)


# ---- failure paths --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": []}, "values: are empty"),
        ({"by": "energy"}, "by: is 'energy'"),
        ({"output": 1}, "output: is 1, of 1 outputs. Give 0 to 0"),
        ({"parameter": "colour"}, "'colour' is no field of the contact laws"),
        ({"omega_range": (1.2, 1.5)}, "holds no peak"),
        ({"omega_range": (1.5, 1.2)}, "must be positive and growing"),
        ({"load": HarmonicLoad(np.array([0.1]))}, "load: drives no harmonic"),
    ],
)
def test_input_of_tracking_is_checked(change, message):
    system, load = damped()
    given = {"parameter": "limit", "values": [0.2], "omega_range": (0.8, 1.4), **change}
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        list(track_peak(system, **{"load": load, **given}))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"order": 0}, "Discretisation.order: must be at least 1, got 0"),
        ({"samples": 0}, "Discretisation.samples: must be at least 1, got 0"),
        ({"evaluator": "event"}, "evaluator: 'event' is none of intervals, march, events"),
    ],
)
def test_discretisation_is_checked(given, message):
    with pytest.raises(InputError, match=message):
        Discretisation(**given)


@pytest.mark.parametrize(("omega", "points"), [(-1.0, 40), (np.nan, 40), (1.0, 0)])
def test_frequency_and_points_of_a_branch_are_checked(omega, points):
    system, load = damped()
    with pytest.raises(InputError, match=r"omega, points: must be positive, got"):
        list(branch_in_parameter(system, load, "limit", (0.2, 0.3), omega, points=points))


def test_output_that_never_is_in_quadrature_is_told():
    system, load = damped()
    # at 0.9 to 1.3 rad/s the phase lies between 0 and -π; a second, larger force turned by 90° takes the reference away from it
    two = System(
        lumped(np.eye(2), np.diag([1.0, 1e4]), 0.02 * np.eye(2)),
        Interface(("d",), system.interface.laws, np.array([[1.0, 0.0], [0, 0], [0, 0]])),
        np.array([0, 1]),
    )
    turned = HarmonicLoad(np.zeros(2), {1: np.array([load.harmonics[1][0], 1.0j])})
    with pytest.raises(InputError, match="in quadrature with the force"):
        list(track_peak(two, turned, "limit", [0.2], (0.9, 1.3), "phase_quadrature"))


def test_span_without_a_smallest_peak_is_told():
    system, load = damped()
    with pytest.raises(InputError, match="the peak amplitude changes by"):
        smallest_peak(system, load, "limit", (0.2, 0.4), (0.8, 1.4))


@pytest.mark.parametrize("span", [(1.0, 1.0), (np.nan, 1.0)])
def test_span_of_a_branch_is_checked(span):
    system, load = damped()
    with pytest.raises(InputError, match="span: goes from"):
        list(branch_in_parameter(system, load, "limit", span, 1.0))
