"""Points that are put between those of a nonlinear mode: at its largest damping, and where a harmonic passes the frequency of another mode."""

import re

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import brentq, minimize_scalar
from test_nonlinear_modes import followed, one_mass

import stickslip as ss
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.nonlinear_modes import ModeSweep
from stickslip.response.nonlinear_modes.closer import EXTREME, LOCATED
from stickslip.response.parameter import Discretisation
from stickslip.response.system import System


def damping_by_hand(amplitude: float, stiffness: float, spring: float, limit: float) -> float:
    """Return the damping ratio of 1 kg on a Jenkins element by its describing function: of one harmonic that is exact."""
    begins = limit / spring
    angle = np.arccos(1.0 - 2.0 * begins / amplitude)
    square = stiffness + spring / np.pi * (angle - np.sin(angle) * np.cos(angle))
    return 2.0 * limit * (amplitude - begins) / (np.pi * amplitude**2 * square)


@pytest.mark.parametrize("points", [5, 10, 30])
def test_the_largest_damping_is_that_of_the_describing_function(points: int) -> None:
    stiffness, spring, limit = 1.0, 0.5, 1.0
    system, load = one_mass(Jenkins(k_t=spring, limit=limit), 0, stiffness)
    sweep = ModeSweep(span=(0.5, 300.0), points=points)
    found = followed(system, load, Discretisation(order=1), sweep)
    judge = minimize_scalar(
        lambda a: -damping_by_hand(a, stiffness, spring, limit), bounds=(2.1, 20.0), method="bounded"
    )
    best = max(found.solutions, key=lambda p: p.ratio)
    # the parabola through three points is off its largest by EXTREME at most
    assert best.ratio == pytest.approx(-judge.fun, rel=EXTREME)
    assert best.ratio == pytest.approx(damping_by_hand(best.amplitude, stiffness, spring, limit), rel=1e-3)


def two_masses(coupling: float) -> tuple[System, HarmonicLoad]:
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    K = np.array([[1.0 + coupling, -coupling], [-coupling, 16.0 + coupling]])
    contact = Interface(("spring",), (CubicSpring(cubic_t=1.0),), gap)
    return System(lumped(np.eye(2), K), contact, np.array([0, 1])), HarmonicLoad(np.zeros(2))


def resonance_by_hand(coupling: float) -> float:
    """Return the amplitude at which three times the mode's frequency is that of small motions about it in the other mode: means over a period, one harmonic."""

    def off(a: float) -> float:
        stiffness = two_masses(coupling)[0].structure.stiffness
        own, other = (scipy.linalg.eigvalsh(stiffness + np.diag([share * a**2, 0.0])) for share in (0.75, 1.5))
        return float(3.0 * np.sqrt(own[0]) - np.sqrt(other[1]))

    return float(brentq(off, 0.1, 2.0))


@pytest.mark.parametrize("coupling", [0.5, 0.1])
@pytest.mark.parametrize("points", [5, 30])
def test_an_internal_resonance_is_found_where_a_harmonic_passes_another_mode(coupling: float, points: int) -> None:
    system, load = two_masses(coupling)
    sweep = ModeSweep(span=(0.05, 3.0), points=points)
    found = followed(system, load, Discretisation(order=5, samples=128), sweep)
    told = re.search(r"internal resonance of harmonic 3 with mode 2 from ([\d.]+) to ([\d.]+) mm", found.end)
    assert told is not None
    low, high = (1e-3 * float(v) for v in told.groups())
    assert 0.0 < np.log(high / low) < 1.1 * LOCATED
    # the third harmonic changes the mode's frequency itself: a few percent
    assert np.sqrt(low * high) == pytest.approx(resonance_by_hand(coupling), rel=0.03)
    near = [p for p in found.solutions if low * 0.999 <= p.amplitude <= high * 1.001]
    shares = [abs(p.coefficients[3, 1] / p.coefficients[1, 1]) for p in near]
    phases = [np.angle(p.coefficients[3, 1] / p.coefficients[1, 0] ** 3) for p in near]
    assert max(shares) > 0.03
    assert abs(np.cos(phases[0]) - np.cos(phases[-1])) == pytest.approx(2.0, abs=1e-3)


def test_a_damped_internal_resonance_is_none_of_the_damping_of_the_mode_alone() -> None:
    K = 4e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    K[-1, -1] = 4e4
    chain = ss.model.lumped(np.eye(4), K, 1.5e-4 * K, names=("m1", "m2", "m3", "m4"))
    brake = ss.Contact(between=("chain.m2", "ground"), law=ss.Jenkins(k_t=2e4, limit=2.0), acts="tangential")
    outputs = (ss.Output(name="last", on="chain.m4"),)
    model = ss.Model(parts={"chain": ss.Part(structure=chain)}, contacts={"brake": brake}, outputs=outputs)
    result = model.nonlinear_mode(modes=[1], amplitude_mm=(0.3, 2.0), points=10, harmonics=5, most_harmonics=5)
    data = result["nonlinear_mode"].isel(case=0, branch=0)
    assert "internal resonance of harmonic 5 with mode 4 from" in data.end.item()
    on, ratio, hertz = data.resonant_harmonic.values > 0, data.damping_ratio.values, data.frequency_hz.values
    assert set(data.resonant_harmonic.values[on]) == {5}
    # the fourth mode's frequencies with the brake open and stuck
    open_hz, stuck_hz = (
        np.sqrt(np.linalg.eigvalsh(K + np.diag([0.0, k, 0.0, 0.0]))[3]) / (2 * np.pi) for k in (0.0, 2e4)
    )
    top = int(np.nanargmax(ratio))
    assert on[top]
    assert open_hz < 5.0 * hertz[top] < stuck_hz
    # one mode by the describing function gives 7.5 %
    assert data.largest_damping_ratio.item() == pytest.approx(np.nanmax(ratio[~on]))
    assert data.largest_damping_ratio.item() < 0.08
    assert ratio[top] > 0.12
    doubt = next(v for v in result.verdicts if v.level == "doubtful" and "takes part" in v.why)
    assert "elsewhere mode 1 has at most" in doubt.why
    assert "decaying" in doubt.remedy
    # both concepts are close where no other mode takes part
    assert data.other_damping_ratio.item() == pytest.approx(data.largest_damping_ratio.item(), rel=0.1)


def test_a_mode_that_takes_no_part_is_none() -> None:
    system, load = two_masses(0.0)
    sweep = ModeSweep(span=(0.05, 3.0), points=30)
    found = followed(system, load, Discretisation(order=5, samples=128), sweep)
    assert found.end == "amplitude reached"
