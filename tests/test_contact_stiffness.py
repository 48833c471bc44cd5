"""How a peak depends on the stiffness of its contacts: closed forms, differences of solutions, and what a result says."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import minimize_scalar

import stickslip as ss
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.rules import contact_stiffness, told_of_model
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import accepted_points, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.peak_sensitivity import stiffer, stiffness_slope
from stickslip.response.system import System
from stickslip.solve.newton_method import newton
from tests.newton_bounds import FINE, unknowns_bound

STEP = 1e-3


def rubbing(law, force=1.0):
    """Two masses, the first of which rubs on the ground along t and is pressed along n."""
    stiffness = 1e4 * np.array([[2.0, -1.0], [-1.0, 2.0]])
    structure = Structure(np.eye(2), 2e-4 * stiffness, stiffness, numbered_dofs(2))
    gaps = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    system = System(structure, Interface(("c",), (law,), gaps), np.array([0]))
    return system, HarmonicLoad(np.zeros(2), {1: np.array([force + 0j, 0.0])})


def solved(system, load, omega, sweep, start):
    """Return the problem and the amplitude and unknowns at a frequency, from a motion nearby."""
    problem = forced_problem(system, load, sweep)
    balance = problem.balance(sweep.high_harmonics)
    found = newton(lambda v: balance.linearise(v, omega), balance.unknowns(start), FINE)
    assert found.status.converged
    motion = balance.coefficients(found.x)
    return problem, balance, found.x, problem.amplitude_of(omega, motion, 0), motion


@pytest.mark.parametrize(
    "law",
    [
        ElasticCoulomb(k_t=8e3, k_w=8e3, k_n=5e3, mu=0.4, preload=2.0),
        Jenkins(k_t=6e3, limit=0.4),
        ElasticCoulomb(k_t=8e3, k_w=8e3, k_n=5e3, mu=0.4, preload=0.3),
    ],
)
def test_the_slope_at_a_frequency_is_that_of_two_solutions(law):
    """Central differences of two steps bound their own error; Newton's ends add what they leave open."""
    sweep = Sweep(omega_range=(80.0, 140.0), low=5, high=5, selection="always_high", newton=FINE)
    for omega in (100.0, 112.0):
        system, load = rubbing(law)
        listed = replace(sweep, at=(80.0, omega, 140.0), peak_points=0)
        point = accepted_points(list(forced_response(system, load, listed)))[1]
        problem, _, _, size, motion = solved(system, load, omega, sweep, point.coefficients)
        point = replace(point, coefficients=motion)
        slope = stiffness_slope(problem, point, 0, resonance=False)
        assert slope is not None
        assert np.isnan(slope.omega)
        differences, bounds = [], []
        for step in (STEP, STEP / 2):
            ends = []
            for factor in (1.0 + step, 1.0 - step):
                interface = stiffer(system.interface, factor)
                assert interface is not None
                own = replace(system, interface=interface)
                _, other, at, amplitude, _ = solved(own, load, omega, sweep, motion)
                ends.append(amplitude)
                off = unknowns_bound(at, other.linearise(at, omega)) * other.displacement_scale
                bounds.append(4 * off / (2 * STEP * size))
            differences.append((ends[0] - ends[1]) / (2 * step * size))
        truncation = 4.0 * abs(differences[0] - differences[1])
        assert slope.amplitude == pytest.approx(differences[1], abs=truncation + max(bounds) + 1e-8)
        assert abs(slope.amplitude) > 100.0 * (truncation + max(bounds))


def test_a_linear_peak_has_its_closed_form():
    """One mass on two springs: F/(c ω_d) at ω² = K/m - c²/2m², of which one spring is the contact."""
    m, c, own, k = 2.0, 4.0, 1.5e4, 5e3
    structure = Structure(m * np.eye(1), c * np.eye(1), own * np.eye(1), numbered_dofs(1))
    gaps = np.array([[1.0], [0.0], [0.0]])
    contact = Interface(("c",), (Jenkins(k_t=k, limit=1e9),), gaps)
    system = System(structure, contact, np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.array([3.0 + 0j])})
    sweep = Sweep(omega_range=(80.0, 120.0), low=1, high=3, points=7, peak_points=3)
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    top = max(points, key=problem.amplitude)
    peak = np.sqrt((own + k) / m - c**2 / (2 * m**2))
    found = stiffness_slope(problem, top, 0, resonance=True)
    assert found is not None
    # F/(c ω_d) falls as the root of its stiffness grows; the parabola through two slopes is off by the square of the way to the peak
    damped = (own + k) / m - c**2 / (4 * m**2)
    way = abs(top.omega / peak - 1.0) + 1e-4
    ratio = c / (2 * m * peak)
    assert way < 0.2 * ratio
    assert found.amplitude == pytest.approx(-k / m / (2 * damped), abs=10 * (way / ratio) ** 2)
    assert found.omega == pytest.approx(k / m / (2 * peak), rel=10 * (way / ratio))


def test_contacts_that_are_stiffer_keep_friction_preload_and_gaps():
    laws = (
        ElasticCoulomb(k_t=1.0, k_w=2.0, k_n=3.0, mu=0.4, preload=2.0),
        ElasticCoulomb(k_t=1.0, k_w=2.0, k_n=3.0, mu=0.4, preload=-6.0),
        UnilateralSpring(k_n=4.0, initial_gap=1e-3),
    )
    made = stiffer(Interface(("a", "b", "c"), laws, np.zeros((9, 1))), 2.0)
    assert made is not None
    twice = made.laws
    assert twice[0] == ElasticCoulomb(k_t=2.0, k_w=4.0, k_n=6.0, mu=0.4, preload=2.0)
    assert twice[1] == ElasticCoulomb(k_t=2.0, k_w=4.0, k_n=6.0, mu=0.4, preload=-12.0)
    assert twice[2] == UnilateralSpring(k_n=8.0, initial_gap=1e-3)


@dataclass(frozen=True)
class TwoSliders(Jenkins):
    """A law of one's own whose stiffnesses have other names; only its fields and its stuck stiffness are read here."""

    k_1: float = 2.0
    k_2: int = 3
    share: float = 0.5
    along_n: tuple[float, ...] = (4.0, 5.0)
    squared: float = 0.0

    def stuck_stiffness(self):
        return np.array([self.k_t + self.k_1 + self.k_2 + self.squared**2, 0.0, self.along_n[0]])


def test_stiffnesses_of_a_law_of_ones_own_are_those_its_stuck_stiffness_follows():
    law = TwoSliders(k_t=1.0, limit=7.0)
    made = stiffer(Interface(("a",), (law,), np.zeros((3, 1))), 1.5)
    assert made is not None
    assert made.laws == (replace(law, k_t=1.5, k_1=3.0, k_2=4.5, along_n=(6.0, 7.5)),)
    unknown = replace(law, squared=2.0)  # the stuck stiffness follows it by its square
    assert stiffer(Interface(("a", "b"), (law, unknown), np.zeros((6, 1))), 1.5) is None


def peak_of(k):
    """Return the largest amplitude of the second mass, m, and its frequency, Hz: the closed form of its compliance at its maximum."""

    def size(omega):
        stiffness = 1e4 * np.array([[2.0, -1], [-1, 1.0]]) + np.diag([k, 0.0])
        dynamic = stiffness - omega**2 * np.eye(2) + 1j * omega * np.eye(2)
        return abs(np.linalg.inv(dynamic)[1, 1])

    found = minimize_scalar(lambda omega: -size(omega), bounds=(55.0, 75.0), method="bounded", options={"xatol": 1e-9})
    return np.array([-found.fun, found.x / (2 * np.pi)])


def test_a_result_tells_what_the_contact_stiffness_does_to_the_peak():
    """Soft contacts decide the peak, contacts a million times as stiff as the structure do not."""
    for k in (1e3, 1e10):
        body = ss.model.lumped(np.eye(2), 1e4 * np.array([[2.0, -1], [-1, 1.0]]), np.eye(2), names=("a", "b"))
        model = ss.Model(
            parts={"p": ss.Part(structure=body)},
            contacts={"c": ss.Contact(between=("p.a", "ground"), law=ss.Jenkins(k_t=k, limit=1e9), acts="tangential")},
            loads={"f": ss.Load(on="p.b", newton=1.0)},
            outputs=(ss.Output(name="b", on="p.b"),),
        )
        result = model.forced_response(hz=(5.0, 20.0), points=12)
        first = next(v for v in result.verdicts if v.level == "trusted")
        assert "with contacts 10 % softer" in first.why
        told = float(result["forced_response"].stiffness_peak_slope.values[0])
        exact, hertz = (peak_of(1.01 * k) - peak_of(0.99 * k)) / (0.02 * np.array([peak_of(k)[0], 1.0]))
        # quadratic in the way to the peak, as in the closed form above; a hundredth of a per cent of the amplitude
        assert told == pytest.approx(exact, abs=1e-4)
        assert (abs(exact) > 5e-3) == (k < 1e4)
        slope = float(result["forced_response"].stiffness_frequency_slope_hz.values[0])
        assert slope == pytest.approx(hertz, rel=0.05, abs=1e-4)


@pytest.mark.parametrize(
    ("slope", "note", "said"), [(-0.51, True, "+5.1 %"), (-0.49, False, "+4.9 %"), (1e-6, False, "less than 0.001 %")]
)
def test_a_peak_that_contacts_decide_is_noted_and_never_doubted(slope, note, said):
    """Beside 5 %: a tenth of the stiffness times the slope."""
    slopes = {"stiffness_peak_slope": slope, "stiffness_frequency_slope_hz": np.nan}
    data = xr.Dataset({name: ("case", [value]) for name, value in slopes.items()})
    found = list(contact_stiffness(Curve(data, 0)))
    assert bool(found) == note
    assert all(f.level == "trusted" and said in f.why for f in found)
    assert any(said in told for told in told_of_model(Curve(data, 0)))
