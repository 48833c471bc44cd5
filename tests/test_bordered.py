"""Periodic problems with extra unknowns and conditions: derivatives, closed forms, folds, and a condition of one's own."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.arrays import FloatArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.bordered import PeriodicProblem, Setting, State, unknown_frequency
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.parameters import law_field, load_level
from stickslip.harmonic.peak import Driven, HorizontalTangent, PhaseQuadrature
from stickslip.model.matrices import lumped
from stickslip.operators import Bordered, array_of
from stickslip.response.continuation.branch import following_vibration, steps_through
from stickslip.response.continuation.starting_solutions import without_branch
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.tracking import track_peak
from stickslip.response.system import System
from stickslip.solve.continuation import FOLD, start_point, trace
from stickslip.solve.krylov import Krylov
from stickslip.solve.linear import Dense, factorised
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Status

FINE = Newton(tolerance=1e-12, max_iterations=60)
LU = partial(factorised, Dense())


@dataclass(frozen=True)
class GivenAmplitude:
    """A condition of one's own: a coordinate moves with an amplitude, m, in the driven harmonics."""

    driven: Driven
    amplitude: float

    def value(self, state: State) -> float:
        return float(np.log(np.linalg.norm(self.driven.motion(state.setting.balance, state.x)) / self.amplitude))

    def gradient(self, state: State) -> FloatArray:
        return np.append(self.driven.gradient(state.setting.balance, state.x), np.zeros(state.extra.size))


def at_level(balance: HarmonicBalance) -> PeriodicProblem:
    """The level of the excitation is unknown, the amplitude is given, and the parameter is the frequency."""
    level = load_level(balance, "excitation")
    return PeriodicProblem(
        lambda extra, omega: Setting(level(float(extra[0])), omega, np.zeros(1)),
        (GivenAmplitude(Driven(0, (1,)), 0.3),),
        LU,
    )


def peak_at_level(balance: HarmonicBalance, field: str, amplitude: float = 0.3) -> PeriodicProblem:
    """Two extra unknowns, ``ln ω`` and the level of the excitation, for a peak of given amplitude; the parameter is a field of the law."""
    family = law_field(balance, field)
    frequency = unknown_frequency(lambda _: balance, 1.1)

    def setting(extra: FloatArray, p: float) -> Setting:
        omega = frequency(extra, p).omega
        member = load_level(family(p), "excitation")(float(extra[1]))
        return Setting(member, omega, np.array([omega, 0.0]))

    driven = Driven(0, (1,))
    conditions = HorizontalTangent(driven), GivenAmplitude(driven, amplitude)
    return PeriodicProblem(setting, conditions, LU)


def peak(balance: HarmonicBalance, condition, field: str) -> PeriodicProblem:
    return PeriodicProblem(unknown_frequency(law_field(balance, field), 1.1), (condition,), LU)


def block() -> tuple[System, HarmonicLoad]:
    """A mass that moves in three directions on a contact that slips; two harmonics act."""
    stiffness = np.array([[1.0, 0.1, 0.15], [0.1, 1.3, 0.1], [0.15, 0.1, 1.1]])
    law = ElasticCoulomb(k_t=0.4, k_w=0.3, k_n=0.5, mu=0.5, preload=1.0)
    system = System(lumped(np.eye(3), stiffness, 0.03 * stiffness), Interface(("c",), (law,), np.eye(3)), np.arange(3))
    force = {1: np.array([0.2, 0.1j, 0.12]), 2: np.array([0.05j, 0.0, 0.1])}
    return system, HarmonicLoad(np.array([0, 0, -0.2]), force)


def duffing() -> tuple[System, HarmonicLoad]:
    """Three masses in a row, the first on a hardening spring; the response to the force on the last one overhangs."""
    k = np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    gap = np.zeros((3, 3))
    gap[0, 0] = 1.0
    interface = Interface(("s",), (CubicSpring(cubic_t=0.4, k_t=0.1),), gap)
    load = HarmonicLoad(np.zeros(3), {1: np.array([0.0, 0.0, 0.02])})
    return System(lumped(np.eye(3), k, 0.02 * k), interface, np.array([2])), load


# ---- derivatives ---------------------------------------------------------------------------------------------------------

BOTH = Driven(0, (1, 2))
PROBLEMS = {
    "horizontal tangent": lambda b, f: peak(b, HorizontalTangent(Driven(0, (1,))), f),
    "horizontal tangent of two harmonics": lambda b, f: peak(b, HorizontalTangent(BOTH), f),
    "phase quadrature": lambda b, f: peak(b, PhaseQuadrature(BOTH, 0.3), f),
    "quadrature of the second harmonic": lambda b, f: peak(b, PhaseQuadrature(Driven(0, (2, 1)), 0.3), f),
    "amplitude by level": lambda b, _: at_level(b),
    "peak of an amplitude": peak_at_level,
}
CASES = {"block": (block, "mu", 0.5), "duffing": (duffing, "cubic_t", 0.4)}


@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_the_residual(case, name):
    made, field, value = CASES[case]
    system, load = made()
    balance = Discretisation(order=3).balance(system, load, system.outputs[:1])
    problem = PROBLEMS[name](balance, field)
    extra = {"amplitude by level": [0.8], "peak of an amplitude": [-0.04, 0.8]}.get(name, [-0.04])
    p = 1.05 if name == "amplitude by level" else value
    x = without_branch(system, balance, FINE, 1.05).x
    rng = np.random.default_rng(1)
    y = np.append(x + 0.05 * np.max(np.abs(x)) * rng.standard_normal(x.size), extra)
    at = problem.linearise(y, p)
    assert isinstance(at.jac, Bordered)
    assert at.jac.shape == (y.size, y.size)
    step = 1e-5
    columns = [
        (problem.residual(y + step * e, p) - problem.residual(y - step * e, p)) / (2 * step) for e in np.eye(y.size)
    ]
    found, expected = array_of(at.jac), np.array(columns).T
    size = np.max(np.abs(expected), axis=1)
    # differences of differences: 1e-6 of noise in J over a step of 1e-5 leaves four digits in the row of a tangent
    away = np.max(np.abs(found - expected), axis=1)
    assert np.all(away < 1e-3 * size)
    assert np.max(away[: x.size]) < 1e-5 * np.max(size)
    h = 1e-4 * p
    by_p = (problem.residual(y, p + h) - problem.residual(y, p - h)) / (2 * h)
    assert np.max(np.abs(at.jac_p - by_p)) < 1e-4 * max(np.max(np.abs(by_p)), 1e-3)


@given(st.integers(0, 2**31), st.integers(1, 6), st.lists(st.integers(1, 3), min_size=1, max_size=3))
@settings(max_examples=40, deadline=None)
def test_borders_around_borders_are_one_matrix(seed, n, widths):
    rng = np.random.default_rng(seed)
    jac = whole = rng.standard_normal((n, n))
    for m in widths:
        column, row = rng.standard_normal((len(whole), m)), rng.standard_normal((m, len(whole)))
        corner = rng.standard_normal((m, m))
        jac, whole = Bordered(jac, column, row, corner), np.block([[whole, column], [row, corner]])
    v = rng.standard_normal(len(whole))
    assert jac.shape == whole.shape
    assert np.array_equal(array_of(jac), whole)
    assert np.array_equal(array_of(jac.transposed), whole.T)
    # sums of some ten numbers of size one
    for made in (jac, jac.flat):
        assert np.allclose(made.matvec(v), whole @ v, rtol=0, atol=1e-13)
        assert np.allclose(made.rmatvec(v), v @ whole, rtol=0, atol=1e-13)


# ---- closed forms --------------------------------------------------------------------------------------------------------


@given(st.floats(0.2, 5.0), st.floats(0.2, 5.0), st.floats(0.005, 0.2), st.integers(1, 4), st.floats(-3.0, 3.0))
@settings(max_examples=12, deadline=None)
def test_peaks_of_one_mass_are_those_of_the_formula(mass, stiffness, ratio, harmonic, phase):
    # a stuck damper beside the spring: the oscillator is linear, whichever harmonic of the frequency drives it
    natural = np.sqrt((stiffness + 0.5) / mass)
    gap = np.zeros((3, 1))
    gap[0] = 1.0
    contact = Interface(("c",), (Jenkins(k_t=0.5, limit=1e3),), gap)
    structure = lumped(*(np.array([[v]]) for v in (mass, stiffness, 2.0 * ratio * mass * natural)))
    system = System(structure, contact, np.array([0]))
    load = HarmonicLoad(np.zeros(1), {harmonic: np.array([0.1 * np.exp(1j * phase)])})
    around = natural / harmonic * np.array([0.7, 1.4])
    how = Discretisation(order=harmonic, samples=64)
    top, quarter = (
        next(track_peak(system, load, "limit", [1e3], tuple(around), by, discretisation=how))
        for by in ("horizontal_tangent", "phase_quadrature")
    )
    assert top.converged
    assert quarter.converged
    # residuals of 1e-10 over a flat top: frequencies to 1e-9 of the half-width, amplitudes to its square
    assert top.omega == pytest.approx(natural / harmonic * np.sqrt(1 - 2 * ratio**2), rel=1e-8)
    height = 0.1 / (2 * mass * natural**2 * ratio * np.sqrt(1 - ratio**2))
    assert top.amplitude == pytest.approx(height, rel=1e-9)
    assert quarter.omega == pytest.approx(natural / harmonic, rel=1e-8)
    assert quarter.amplitude == pytest.approx(0.1 / (2 * mass * natural**2 * ratio), rel=1e-9)
    assert quarter.phase == pytest.approx(-np.pi / 2, abs=1e-8)


def test_the_peak_is_that_of_all_harmonics_that_the_load_drives():
    system, load = block()
    how = Discretisation(order=4)
    found = next(track_peak(system, load, "mu", [0.5], (0.8, 1.6), discretisation=how))
    assert found.converged
    heights = []
    for omega in found.omega * (1 + np.array([-1e-3, 0.0, 1e-3])):
        balance = how.balance(system, load, system.outputs[:1])
        guess = balance.unknowns(found.coefficients[:, balance.linear.retained])
        x = newton(lambda v, w=omega, b=balance: b.linearise(v, w), guess, FINE).x
        heights.append(np.linalg.norm(balance.coefficients(x)[1:3, 0]))
    assert heights[0] < heights[1] > heights[2]
    assert found.amplitude == pytest.approx(heights[1], rel=1e-9)
    alone = np.abs(found.coefficients[1, 0])
    assert found.amplitude > (1 + 1e-6) * alone  # the second harmonic counts


# ---- a condition of one's own -----------------------------------------------------------------------------------------------


def test_a_level_is_found_for_every_frequency():
    system, load = duffing()
    balance = Discretisation(order=3, samples=64).balance(system, load, system.outputs)
    problem = at_level(balance)
    following = following_vibration(balance, steps_through(0.2, 10), FINE)
    following = replace(following, weights=np.append(following.weights, 1.0))
    y = np.append(without_branch(system, balance, FINE, 0.35).x, 1.0)
    start = start_point(problem, y, 0.35, following)
    points = [start, *trace(problem, start, 0.55, following)]
    assert all(p.solution.status.converged for p in points)
    assert points[-1].p == 0.55
    for point in points:
        motion = balance.coefficients(point.x[:-1])
        assert abs(motion[1, 0]) == pytest.approx(0.3, rel=1e-10)
        own = load_level(balance, "excitation")(float(point.x[-1]))
        assert np.max(np.abs(own.linearise(point.x[:-1], point.p).residual)) < 1e-10
    # at resonance the smallest force gives the amplitude
    levels = [p.x[-1] for p in points]
    assert 0 < int(np.argmin(levels)) < len(levels) - 1


def test_a_peak_of_given_amplitude_has_two_extra_unknowns():
    system, load = duffing()
    system = replace(system, outputs=np.array([0]))
    how = Discretisation(order=3, samples=64)
    balance = how.balance(system, load, system.outputs)
    around = (0.35, 0.7)
    top = next(track_peak(system, load, "excitation", [1.0], around, discretisation=how))
    problem = peak_at_level(balance, "cubic_t", 0.8 * top.amplitude)
    x = balance.unknowns(top.coefficients[:, balance.linear.retained])
    y = np.append(x, [np.log(top.omega / 1.1), 1.0])
    solution = newton(lambda v: problem.linearise(v, 0.4), y, FINE)
    assert solution.status.converged
    level = float(solution.x[-1])
    assert 0.5 < level < 1.0
    # it is the peak that is tracked at this level
    levels = [1.0, level]
    found = list(track_peak(system, load, "excitation", levels, around, discretisation=how))[-1]
    assert found.amplitude == pytest.approx(0.8 * top.amplitude, rel=1e-9)
    assert found.omega == pytest.approx(1.1 * np.exp(solution.x[-2]), rel=1e-9)


# ---- folds, and out of bounds ----------------------------------------------------------------------------------------------


def test_at_a_fold_the_border_is_solved_by_iteration_as_by_lu():
    system, load = duffing()
    balance = Discretisation(order=5, samples=64).balance(system, load, system.outputs)
    balance = replace(balance, jacobian="structured")
    following = following_vibration(balance, steps_through(0.2, 40), FINE)
    start = start_point(balance, without_branch(system, balance, FINE, 0.35).x, 0.35, following)
    folds = [p for p in trace(balance, start, 0.6, following, (FOLD,)) if p.mark]
    assert len(folds) == 2
    rng = np.random.default_rng(0)
    driven = Driven(0, (1,))
    for fold in folds:
        at = balance.linearise(fold.x, fold.p)
        sizes = np.linalg.svd(at.jac.dense(), compute_uv=False)
        assert sizes[-1] < 1e-6 * sizes[-2]  # singular, as far as a fold can be located
        problem = PeriodicProblem(unknown_frequency(lambda _: balance, fold.p), (PhaseQuadrature(driven, 0.0),), LU)
        border = problem.linearise(np.append(fold.x, 0.0), 0.0).jac
        more = rng.standard_normal((2, border.shape[0]))
        for jac in (border, Bordered(border, more[0], more[1], 0.5)):
            right = rng.standard_normal(jac.shape[0])
            whole = array_of(replace(jac.flat, jac=at.jac.dense()))
            exact = np.linalg.solve(whole, right)
            iterated = factorised(Krylov(tolerance=1e-12), jac)
            assert np.linalg.norm(iterated(right) - exact) < 1e-9 * np.linalg.norm(exact)
            other = np.linalg.solve(whole.T, right)
            found = iterated(right, transposed=True)
            assert np.linalg.norm(found - other) < 1e-9 * np.linalg.norm(other)


def test_a_corrector_that_leaves_the_frequencies_is_told_so():
    system, load = duffing()
    balance = Discretisation(order=1, samples=64).balance(system, load, system.outputs)
    problem = peak(balance, HorizontalTangent(Driven(0, (1,))), "cubic_t")
    at = problem.linearise(np.append(np.ones(balance.size), 3.5), 0.4)
    assert np.all(np.isinf(at.residual))
    solution = newton(lambda v: problem.linearise(v, 0.4), np.append(np.ones(balance.size), 3.5), FINE)
    assert solution.status is Status.NOT_FINITE


def test_a_tangent_at_a_fold_has_no_value():
    system, load = duffing()
    balance = Discretisation(order=1, samples=64).balance(system, load, system.outputs)
    settings = unknown_frequency(lambda _: balance, 0.5)
    problem = PeriodicProblem(settings, (HorizontalTangent(Driven(0, (1,))),), lambda _: None)
    at = problem.linearise(np.append(np.ones(balance.size), 0.0), 0.0)
    assert at.residual[-1] == np.inf
    assert not np.any(at.jac.borders[1])
    state = problem.state(np.append(np.ones(balance.size), 0.0), 0.0)
    assert state.along is None
    assert not np.any(problem.conditions[0].gradient(state))
