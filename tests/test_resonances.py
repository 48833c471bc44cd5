"""Resonances: by variable phase, several at once, of harmonics that nothing drives; against dense sweeps, closed forms and time integration."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stickslip.arrays import ComplexArray
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.peak import PeakProblem
from stickslip.model.matrices import lumped
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.first import PeakSearch, maxima
from stickslip.response.resonances.tracking import follow_peaks, later_peaks, peak_curve
from stickslip.response.self_excited.curve import at_amplitude
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import self_excited_motions
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton

HOW = Discretisation(order=3)
ONE = np.eye(1)


def two_masses() -> tuple[System, HarmonicLoad]:
    """Two masses in a chain, a friction damper at the first; two forces of different phase, so that the output is nowhere in quadrature at its peak."""
    k = np.array([[2.2, -1.0], [-1.0, 1.4]])
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    system = System(
        lumped(np.eye(2), k, 0.03 * k), Interface(("c",), (Jenkins(k_t=0.3, limit=0.2),), gap), np.array([1])
    )
    return system, HarmonicLoad(np.zeros(2), {1: np.array([0.1, 0.05 * np.exp(0.4j)])})


def oscillator(cubic: float, damping: float, force: float) -> tuple[System, HarmonicLoad]:
    """Unit mass and spring with a cubic one: x'' + 2 ζ x' + x + cubic x³ = force cos(ωt)."""
    law = CubicSpring(cubic_t=cubic, k_t=0.0)
    rows = np.array([[1.0], [0.0], [0.0]])
    system = System(lumped(ONE, ONE, 2.0 * damping * ONE), Interface(("s",), (law,), rows), np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})


def test_variable_phase_is_the_maximum_where_quadrature_is_not():
    system, load = two_masses()
    values = [0.2, 0.18, 0.16, 0.14, 0.12]

    def peaks(by):
        search = PeakSearch(system, load, "limit", (0.6, 2.2), by, 0, HOW)
        return list(follow_peaks(search, values, 1))

    top, lag, quarter = map(peaks, ("horizontal_tangent", "variable_phase", "phase_quadrature"))
    for a, b, c in zip(top, lag, quarter, strict=True):
        assert all(p.converged for p in (a, b, c))
        assert 0.0 <= 1.0 - b.amplitude / a.amplitude < 2e-5
        assert 1.0 - c.amplitude / a.amplitude > 2e-3
        # what the point itself says of it, by slope and curvature
        assert b.below == pytest.approx(a.amplitude / b.amplitude - 1.0, rel=0.1, abs=1e-9)
        assert c.below == pytest.approx(a.amplitude / c.amplitude - 1.0, rel=0.3)
    assert sum(p.evaluations for p in lag[1:]) < 0.6 * sum(p.evaluations for p in top[1:])


def test_energy_is_what_dashpot_and_friction_take():
    system, load = two_masses()
    (one,) = follow_peaks(PeakSearch(system, load, "limit", (0.6, 2.2), how=HOW), [0.15], 1)
    damping = system.plain_structure.damping
    x = one.coefficients
    dashpot = sum(np.pi * h**2 * one.omega * np.real(np.vdot(x[h], damping @ x[h])) for h in (1, 2, 3))
    assert one.friction > 0.1 * one.energy
    assert one.energy == pytest.approx(dashpot + one.friction, rel=1e-9)


def test_peaks_of_several_modes_are_followed_at_once():
    system, load = two_masses()
    search = PeakSearch(system, load, "limit", (0.6, 2.2), how=HOW)
    found = list(follow_peaks(search, [0.2, 0.15], 3))
    assert [(p.peak, p.value) for p in found] == [(0, 0.2), (1, 0.2), (0, 0.15), (1, 0.15)]
    assert all(p.converged and p.is_maximum for p in found)
    assert found[0].amplitude > found[1].amplitude
    assert found[1].omega > 1.5 * found[0].omega
    # each of them is the only one of its own range
    (alone,) = follow_peaks(replace(search, omega_range=(1.3, 2.2)), [0.15], 3)
    assert alone.omega == pytest.approx(found[3].omega, rel=1e-9)
    assert alone.amplitude == pytest.approx(found[3].amplitude, rel=1e-9)


def test_backbone_of_a_duffing_oscillator_is_its_closed_form():
    # one harmonic, in quadrature: ω² = 1 + ¾ c a², 2 ζ ω a = force, without any approximation
    system, load = oscillator(0.5, 0.02, 0.02)
    how = Discretisation(order=1)
    levels = [0.5, 1.0, 2.0, 3.0]
    search = PeakSearch(system, load, "excitation", (0.7, 1.6), "phase_quadrature", 0, how)
    for p in follow_peaks(search, levels, 1):
        assert p.omega**2 == pytest.approx(1.0 + 0.75 * 0.5 * p.amplitude**2, rel=1e-9)
        assert 0.04 * p.omega * p.amplitude == pytest.approx(0.02 * p.value, rel=1e-9)
        assert p.energy == pytest.approx(np.pi * 0.02 * p.value * p.amplitude, rel=1e-9)


def test_maxima_that_stand_out_are_those_of_a_branch():
    heights = np.array([0.0, 3.0, 2.99, 3.01, 1.0, 2.0, 1.999, 2.0, 0.5, 4.0])
    assert maxima(heights) == [3, 5]
    assert maxima(np.array([0.0, 5.0, 1.0, 2.0, 0.0])) == [1, 3]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"harmonic": 4}, "harmonic: is 4, of 3 harmonics"),
        ({"periods": 4}, "periods: is 4, of 3 harmonics"),
        ({"harmonic": 2, "by": "phase_quadrature"}, "Only odd multiples of the load's harmonic"),
    ],
)
def test_harmonics_that_peak_are_checked(change, message):
    system, load = two_masses()
    with pytest.raises(InputError, match=message):
        list(follow_peaks(PeakSearch(system, load, "limit", (0.6, 2.2), how=HOW, **change), [0.2]))


def test_a_curve_goes_round_the_fold_at_which_a_peak_ends():
    # softening, one harmonic: force = 2 ζ ω a with ω² = 1 + ¾ c a²; it is largest at a² = -2 / (3 c), and beyond a maximum has become a minimum
    system, load = oscillator(-0.5, 0.02, 0.02)
    how = Discretisation(order=1)
    most = 0.04 * np.sqrt(4.0 / 3.0) / np.sqrt(2.0) / 0.02
    for by, error in (("phase_quadrature", 1e-3), ("horizontal_tangent", 1e-2)):
        search = PeakSearch(system, load, "excitation", (0.5, 1.3), by, 0, how)
        found = list(peak_curve(search, (0.5, 2.0), 10))
        assert all(p.converged for p in found)
        level = np.array([p.value for p in found])
        turned = int(np.argmax(level))
        assert level[turned] == pytest.approx(most, rel=error)
        assert 0.5 <= level[-1] < 0.65
        assert all(np.diff([p.amplitude for p in found]) > 0.0)
        if by == "phase_quadrature":
            omega = np.array([p.omega for p in found])
            height = np.array([p.amplitude for p in found])
            assert omega**2 == pytest.approx(1.0 - 0.375 * height**2, rel=1e-8)
        else:
            kinds = [p.is_maximum for p in found]
            assert all(kinds[:turned])
            assert not any(kinds[turned + 3 :])


def test_evaluations_along_a_curve_are_those_of_its_corrections_and_five_to_align_it(monkeypatch):
    calls, linearise = [], PeakProblem.linearise

    def counted(problem, y, p):
        calls.append(p)
        return linearise(problem, y, p)

    monkeypatch.setattr(PeakProblem, "linearise", counted)
    system, load = oscillator(-0.5, 0.02, 0.02)
    search = PeakSearch(system, load, "excitation", (0.5, 1.3), "phase_quadrature", 0, Discretisation(order=1))
    told = []
    for point in peak_curve(search, (0.5, 1.0), 5):
        told.append((point.evaluations, len(calls)))
        calls.clear()
    assert len(told) > 4
    # of the five that align the equation at a point one is among those counted
    assert all(evaluations == corrections + 4 for evaluations, corrections in told[1:])


def test_peaks_that_are_there_at_the_last_value_alone_are_followed_back():
    system, load = two_masses()
    search = PeakSearch(system, load, "limit", (0.6, 2.2), how=HOW)
    values = [0.2, 0.16, 0.12]
    both = list(follow_peaks(search, values, 2))
    first = [p for p in both if p.peak == 0]
    later = list(later_peaks(search, values, first, 3))
    assert [(p.peak, p.value) for p in later] == [(1, 0.12), (1, 0.16), (1, 0.2)]
    known = [p.amplitude for p in both if p.peak == 1]
    assert [p.amplitude for p in later] == pytest.approx(known[::-1], rel=1e-9)
    assert list(later_peaks(search, values, both, 3)) == []


def in_time(
    acceleration: Callable[[float, float, float], float],
    omega: float,
    motion: ComplexArray,
    harmonic: int,
    periods: int,
) -> float:
    """Amplitude of a harmonic after some periods of an oscillator, by SciPy from the state of a balance's motion at t = 0."""
    h = np.arange(motion.size)
    start = [np.sum(motion.real), np.sum((1j * h * omega * motion).real)]
    last = 2.0 * np.pi / omega * (periods - 1 + np.arange(128) / 128)
    found = solve_ivp(
        lambda t, y: [y[1], acceleration(t, y[0], y[1])], (0.0, last[-1]), start, "DOP853", last, rtol=1e-9, atol=1e-11
    )
    return float(2.0 * abs(np.fft.rfft(found.y[0])[harmonic]) / 128)


def hardening(force: float, damping: float, omega: float, cubic: float = 1.0):
    return lambda t, x, v: force * np.cos(omega * t) - 2.0 * damping * v - x - cubic * x**3


def stopped(force: float, damping: float, omega: float, stop: float):
    return lambda t, x, v: force * np.cos(omega * t) - 2.0 * damping * v - x - stop * min(x, 0.0)


def test_a_superharmonic_resonance_is_that_of_time_integration():
    # harmonic 3 of a hardening oscillator near a third of its frequency; motions 0.6 % beside the peak are lower
    system, load = oscillator(1.0, 0.03, 0.4)
    search = PeakSearch(system, load, "excitation", (0.3, 0.6), how=Discretisation(order=11), harmonic=3)
    (top,) = follow_peaks(search, [1.0], 1)
    assert top.is_maximum
    x = top.coefficients[:, 0]
    assert abs(x[3]) == pytest.approx(top.amplitude, rel=1e-12)
    at = [
        in_time(hardening(0.4, 0.03, w), w, x, 3, n)
        for w, n in ((top.omega, 4), (0.994 * top.omega, 20), (1.006 * top.omega, 20))
    ]
    assert at[0] == pytest.approx(top.amplitude, rel=2e-5)
    assert max(at[1:]) < 0.999 * at[0]
    # by phase, from level to level, what the tangent finds
    levels = [1.0, 0.9, 0.8]
    exact = list(follow_peaks(search, levels, 1))
    by_phase = list(follow_peaks(replace(search, by="variable_phase"), levels, 1))
    assert [p.amplitude for p in by_phase] == pytest.approx([p.amplitude for p in exact], rel=1e-3)


def test_an_even_superharmonic_of_a_stop_is_that_of_time_integration():
    rows = np.array([[0.0], [0.0], [1.0]])
    law = UnilateralSpring(k_n=0.5)
    system = System(lumped(ONE, ONE, 0.06 * ONE), Interface(("s",), (law,), rows), np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.array([0.1 + 0j])})
    search = PeakSearch(system, load, "excitation", (0.45, 0.65), how=Discretisation(order=12), harmonic=2)
    (top,) = follow_peaks(search, [1.0], 1)
    x = top.coefficients[:, 0]
    at = [
        in_time(stopped(0.1, 0.03, w, 0.5), w, x, 2, n)
        for w, n in ((top.omega, 4), (0.98 * top.omega, 20), (1.02 * top.omega, 20))
    ]
    assert at[0] == pytest.approx(top.amplitude, rel=1e-4)
    assert max(at[1:]) < 0.99 * at[0]


def test_a_subharmonic_resonance_is_that_of_time_integration():
    # a third of the frequency of the load; nothing leads there from the response of one period
    system, load = oscillator(1.0, 0.03, 3.0)
    search = PeakSearch(system, load, "excitation", (2.8, 6.5), how=Discretisation(order=9), periods=3)
    top, more = follow_peaks(search, [0.95, 1.0], 1)
    assert all(p.converged and p.is_maximum for p in (top, more))
    assert more.amplitude > 5.0 * abs(more.coefficients[3, 0])
    # just before the peak, where the branch ends, the motion stays: SciPy goes from the peak's state to the balance's motion there
    omega = 0.98 * more.omega / 3.0
    balance = search.how.balance(system, load.over_periods(3), np.array([0]))
    found = newton(lambda v: balance.linearise(v, omega), balance.unknowns(more.coefficients), Newton())
    motion = balance.coefficients(found.x)[:, 0]
    assert abs(motion[1]) > 0.9 * more.amplitude

    def force(t: float, x: float, v: float) -> float:
        return 3.0 * np.cos(3.0 * omega * t) - 0.06 * v - x - x**3

    assert in_time(force, omega, more.coefficients[:, 0], 1, 60) == pytest.approx(abs(motion[1]), rel=1e-4)


def test_a_range_without_subharmonic_motions_is_told():
    system, load = oscillator(1.0, 0.3, 0.01)
    search = PeakSearch(system, load, "excitation", (2.8, 4.0), how=HOW, periods=3)
    with pytest.raises(InputError, match="no motion of 3 periods that was found from 324 starts"):
        list(follow_peaks(search, [1.0], 1))


@pytest.mark.parametrize(
    ("driven", "level", "frequency", "by_energy", "by_force"),
    [(0, 0.7, 0.0348, 0.97, 2.46), (1, 0.5, -0.0074, 1.02, None), (1, 1.1, -0.0056, 1.01, None)],
)
def test_quadrature_is_no_mode_where_one_force_cannot_balance_friction(driven, level, frequency, by_energy, by_force):
    # the table of docs/theory/tracking.md
    k = np.array([[2.0, -1.0], [-1.0, 1.0]])
    gap = np.zeros((3, 2))
    gap[0, 1] = 1.0
    contacts = Interface(("c",), (Jenkins(k_t=1.0, limit=1.0),), gap)
    system = System(lumped(np.eye(2), k, 0.01 * k), contacts, np.array([0]))
    force = np.eye(2)[driven]
    load = HarmonicLoad(np.zeros(2), {1: force.astype(complex)})
    how = Discretisation(order=5)
    stuck = stuck_modes(system, 2)[0]
    around = (0.4, 1.15 * stuck.omega)
    search = PeakSearch(system, load, "excitation", around, "phase_quadrature", 0, how)
    point = list(follow_peaks(search, [0.4, level], 1))[-1]
    motions = self_excited_motions(system, HarmonicLoad(np.zeros(2)), stuck, 0, how)
    mode = at_amplitude(motions, point.amplitude)
    assert point.converged
    assert mode.converged
    assert point.omega / mode.omega - 1.0 == pytest.approx(frequency, abs=5e-5)
    h = np.arange(6)
    kinetic = 0.5 * float(np.sum((h * point.omega) ** 2 * np.sum(np.abs(point.coefficients) ** 2, axis=1)))
    assert point.energy / (4 * np.pi * kinetic) / mode.level == pytest.approx(by_energy, abs=5e-3)
    if by_force is not None:
        shape = stuck.shape.real / np.linalg.norm(stuck.shape.real)
        read = level * shape[driven] * shape[0] / (2 * point.omega**2 * point.amplitude)
        assert read / mode.level == pytest.approx(by_force, abs=5e-3)
