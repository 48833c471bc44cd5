"""Resonances: by variable phase, several at once, of harmonics that nothing drives; against dense sweeps, closed forms and time integration."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.parameter import Discretisation
from stickslip.response.resonances.curve import peak_curve
from stickslip.response.resonances.first import PeakSearch, maxima
from stickslip.response.resonances.tracking import follow_peaks, later_peaks
from stickslip.response.system import System

HOW = Discretisation(order=3)
ONE = np.eye(1)


def two_masses() -> tuple[System, HarmonicLoad]:
    """Two masses in a chain, a friction damper at the first; two forces of different phase, so that the output is nowhere in quadrature at its peak."""
    k = np.array([[2.2, -1.0], [-1.0, 1.4]])
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    system = System(
        lumped(np.eye(2), k, 0.03 * k),
        Interface(("c",), (Jenkins(k_t=0.3, limit=0.2),), gap),
        np.array([1]),
    )
    return system, HarmonicLoad(np.zeros(2), {1: np.array([0.1, 0.05 * np.exp(0.4j)])})


def oscillator(cubic: float, damping: float, force: float) -> tuple[System, HarmonicLoad]:
    """Unit mass and spring with a cubic one: x'' + 2 ζ x' + x + cubic x³ = force cos(ωt)."""
    law = CubicSpring(cubic_t=cubic, k_t=0.0)
    rows = np.array([[1.0], [0.0], [0.0]])
    system = System(
        lumped(ONE, ONE, 2.0 * damping * ONE), Interface(("s",), (law,), rows), np.array([0])
    )
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
    dashpot = sum(
        np.pi * h**2 * one.omega * np.real(np.vdot(x[h], damping @ x[h])) for h in (1, 2, 3)
    )
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
    for by, error in (("phase_quadrature", 1e-5), ("horizontal_tangent", 1e-3)):
        search = PeakSearch(system, load, "excitation", (0.5, 1.3), by, 0, how)
        found = list(peak_curve(search, (0.5, 2.0), 20))
        assert all(p.converged for p in found)
        level = np.array([p.value for p in found])
        turned = int(np.argmax(level))
        assert level[turned] == pytest.approx(most, rel=error)
        assert 0.5 <= level[-1] < 0.55
        assert all(np.diff([p.amplitude for p in found]) > 0.0)
        if by == "phase_quadrature":
            omega = np.array([p.omega for p in found])
            height = np.array([p.amplitude for p in found])
            assert omega**2 == pytest.approx(1.0 - 0.375 * height**2, rel=1e-8)
        else:
            kinds = [p.is_maximum for p in found]
            assert all(kinds[:turned])
            assert not any(kinds[turned + 2 :])


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
