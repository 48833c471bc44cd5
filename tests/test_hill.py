"""Floquet exponents by Hill's method: against the monodromy, of a wheel sector by sector, and where the monodromy refuses."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from test_flutter_wheel import forced
from test_stability import LAWS, random_gaps, random_structure, solved, stopped

from stickslip.contact.interface import Interface
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.model.structure import Dofs, Structure
from stickslip.response.stability import hill_exponents, hill_stability, motion_stability, stability, wave_disturbances
from stickslip.response.stability.flow_map.contact_states import located_states
from stickslip.response.stability.hill_method.contact_tangent import contact_tangents
from stickslip.response.stability.hill_method.hill_segment import Segment
from stickslip.response.system import System
from stickslip.solve.status import Status
from stickslip.study.store.archive import decode, encode


def random_motion(law, seed):
    rng = np.random.default_rng([seed, list(LAWS).index(law)])
    structure = random_structure(rng, 3)
    interface = Interface(("a", "b"), (LAWS[law](),) * 2, rng.standard_normal((6, 3)), np.array([0.7, 1.3]))
    return System(structure, interface, np.array([0])), random_gaps(rng, 2, 3)


def apart(some, others, above):
    """Return the largest distance of a multiplier beyond a modulus from the nearest one of others."""
    large = [m for m in some if abs(m) > above]
    assert large
    return max(min(abs(m - n) for n in others) for m in large)


@pytest.mark.parametrize("law", LAWS)
def test_multipliers_are_those_of_the_monodromy_and_none_is_missed(law):
    for seed in (0, 2):
        system, gaps = random_motion(law, seed)
        expected = motion_stability(system.structure, system.interface, gaps, 0.8)
        found = hill_exponents(system, to_complex(gaps), 0.8, 20)
        theirs = expected.floquet.multipliers
        assert found.missing == 0
        assert apart(theirs, found.multipliers, 0.5) < 3e-4
        assert apart(found.multipliers, theirs, 0.5) < 3e-4
        # what is said of harmonics beyond is no less than what they change
        said = 2 * np.pi * np.abs(found.multipliers) * found.errors
        off = np.array([np.min(np.abs(theirs - m)) for m in found.multipliers])
        assert np.all(off < said + 3e-6)


def stiff_jenkins():
    """One mass behind a Jenkins element nine times as stiff as its spring, gliding most of the time."""
    one = Dofs(np.arange(1), ("x",), np.zeros((1, 3)))
    structure = Structure(np.eye(1), np.array([[0.02]]), np.eye(1), one)
    law = Jenkins(k_t=9.0, limit=1.0)
    interface = Interface(("j",), (law,), np.array([[1.0], [0.0], [0.0]]))
    gaps = np.zeros((3, 3), dtype=complex)
    gaps[1, 0] = 0.6
    return System(structure, interface, np.array([0])), gaps


def test_the_tangent_at_zero_is_no_tangent_elsewhere():
    """The periodic tangent of friction is exact at the exponent 0 alone: a stiff Jenkins element shows by how much it is off."""
    system, gaps = stiff_jenkins()
    real = np.stack([gaps[0].real, gaps[1].real, -gaps[1].imag])
    real = np.concatenate([real, np.zeros((2, 3))])
    exact = motion_stability(system.structure, system.interface, real, 1.3).floquet.multipliers
    found = hill_exponents(system, to_complex(real), 1.3, 30)
    assert apart(exact, found.multipliers, 0.3) < 1e-5
    # Hill's matrix with the tangent at exponent 0, linear in the states
    states = located_states(system.interface, real)
    springs, _, (tangent,) = contact_tangents(states)
    h = np.arange(-40, 41)
    K = np.eye(h.size) * (1.0 + springs[0]) + tangent.matrix(0.0, h, h)
    turn, one = 1j * np.diag(h), np.eye(h.size)
    above = np.hstack([-turn, one])
    below = np.hstack([-K / 1.3**2, -turn - 0.02 / 1.3 * one])
    values = scipy.linalg.eigvals(np.vstack([above, below]))
    values = values[np.abs(values.imag) <= 0.5]
    frozen = np.exp(2 * np.pi * values[np.argsort(-values.real)[:2]])
    assert apart(frozen, exact, 0.1) > 0.01


@pytest.mark.parametrize("force", [0.3, 2.0, 6.0])
def test_a_wheel_is_examined_wave_by_wave_one_sector_at_a_time(force):
    problem, point, _ = forced(force)
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    every = wave_disturbances(problem.system, gaps, point.omega)
    found = hill_exponents(problem.system, gaps, point.omega)
    theirs = np.array([d.multiplier for d in every])
    assert found.missing == 0
    assert apart(theirs, found.multipliers, 0.6) < 3e-5
    assert apart(found.multipliers, theirs, 0.6) < 3e-5
    whole, own = stability(problem, point), hill_stability(problem, point)
    assert own.stability.verdict == whole.verdict
    assert own.stability.multiplier == pytest.approx(whole.multiplier, abs=2e-5)
    if whole.verdict == "unstable":
        assert own.disturbance.wave == 2
        assert own.disturbance.omega == pytest.approx(every[0].omega, rel=1e-3)


def beside_a_stop(law, stiffness, damping, omega, gaps):
    """One kilogram, its displacement being the normal gap and both tangential ones; Hill's exponents and the largest multiplier."""
    one = Dofs(np.arange(1), ("x",), np.zeros((1, 3)))
    structure = Structure(np.eye(1), np.array([[damping]]), np.array([[stiffness]]), one)
    system = System(structure, Interface(("c",), (law,), np.ones((3, 1))), np.array([0]))
    coefficients = np.array(gaps)[:, None] * np.ones(3)
    whole = motion_stability(structure, system.interface, to_real(coefficients), omega)
    size = np.max(np.abs(whole.floquet.multipliers))
    return hill_exponents(system, coefficients, omega), size


def test_harmonics_are_added_until_what_is_counted_is_found():
    """A stop that is met for a part of the period: with the first harmonics taken one is counted outside the circle, and none is found."""
    law = UnilateralSpring(k_n=88.145, initial_gap=0.45239)
    found, size = beside_a_stop(law, 2.3929, 0.02236, 0.77454, [-0.311 + 0j, -0.8971 - 1.4188j])
    assert size > 1.9
    assert found.missing == 0
    assert np.max(np.abs(found.multipliers)) == pytest.approx(size, rel=2e-2)


def test_a_mode_above_all_harmonics_is_not_counted_as_stable():
    """Three springs hold the mass where they are closed, and it rings above all harmonics; open it is driven away."""
    law = ElasticCoulomb(k_t=3000.0, k_w=3000.0, k_n=8000.0, mu=0.4, preload=500.0)
    found, size = beside_a_stop(law, -5.0, 0.0, 1.0, [0.05 + 0j, 0.4 + 0.3j, 0.1 - 0.05j])
    assert size > 2.0
    assert found.missing is None


def above_its_harmonics(slow, fast):
    """Two modes that close a stop together, at 1.3 and 40 times the frequency of the motion, with these damping coefficients."""
    two = Dofs(np.arange(2), ("x", "y"), np.zeros((2, 3)))
    structure = Structure(np.eye(2), np.diag([slow, fast]), np.diag([1.69, 1600.0]), two)
    interface = Interface(
        ("s",), (UnilateralSpring(k_n=1.0e3, initial_gap=0.1),), np.array([[0.0, 0.0], [0.0, 0.0], [0.1, 1.0]])
    )
    gaps = np.zeros((3, 3), dtype=complex)
    gaps[1, 2], gaps[2, 2] = 0.7, 0.1j
    system = System(structure, interface, np.array([0]))
    exact = motion_stability(structure, interface, to_real(gaps), 1.0).floquet.multipliers
    return system, gaps, exact


def test_a_mode_that_contacts_feed_above_all_harmonics_makes_the_count_unknown():
    """Its stiffness changes where the stop is met: it may grow unless its damping takes more in a period than these changes can give."""
    system, gaps, exact = above_its_harmonics(0.02, 0.002)
    assert hill_exponents(system, gaps, 1.0, 13).missing is None
    found = hill_exponents(system, gaps, 1.0)  # with as many harmonics as the mode has
    assert found.missing == 0
    assert apart(exact, found.multipliers, 0.9) < 2e-2
    system, gaps, exact = above_its_harmonics(0.02, 1.0)
    found = hill_exponents(system, gaps, 1.0, 13)
    assert found.missing == 0
    assert apart(exact, found.multipliers, 0.7) < 5e-3


def test_what_grows_is_known_where_the_count_is_not():
    system, gaps, exact = above_its_harmonics(-0.1, 0.002)
    found = hill_exponents(system, gaps, 1.0, 13)
    assert found.missing is None
    grows = np.abs(found.multipliers) > 1.0
    said = 2 * np.pi * np.abs(found.multipliers) * found.errors
    assert np.count_nonzero(grows) == 1
    assert apart(found.multipliers[grows], exact, 1.0) < said[grows][0] < 0.2


def test_verdicts_are_those_of_the_monodromy():
    problem, points = stopped(3)
    compared = 0
    for point in points[2::3]:
        expected, found = stability(problem, point), hill_stability(problem, point)
        assert found.stability.verdict == expected.verdict
        if np.isfinite(expected.multiplier_error):
            assert found.stability.multiplier == pytest.approx(expected.multiplier, abs=3e-4)
            compared += 1
    assert compared > 3


def test_structural_damping_has_exponents():
    """Two masses on a spring with a loss factor, at rest in their contact: those of the linear structure, upper half of the strip."""
    system, _ = random_motion("Jenkins", 0)
    structure = replace(system.structure, damping=np.zeros((3, 3)), loss=0.05 * np.asarray(system.structure.stiffness))
    stiff = replace(system.interface, laws=(Jenkins(k_t=1e-9, limit=1.0),) * 2)
    lossy = System(structure, stiff, np.array([0]))
    gaps = np.zeros((2, 6), dtype=complex)
    with pytest.raises(InputError, match="structural damping"):
        motion_stability(structure, stiff, np.zeros((3, 6)), 0.8)
    found = hill_exponents(lossy, gaps, 0.8)
    squares = scipy.linalg.eigh(structure.stiffness, structure.mass, eigvals_only=True)
    exact = np.exp(2 * np.pi * 1j * np.sqrt(squares * (1 + 0.05j)) / 0.8)
    assert apart(exact, found.multipliers, 0.5) < 1e-6


def test_what_cannot_be_examined_is_refused():
    problem, point = solved(0.1, 1.1, 1)
    with pytest.raises(InputError, match="did not converge"):
        hill_stability(problem, replace(point, status=Status.STALLED))
    system, gaps = stiff_jenkins()
    other = replace(system.interface, laws=(Dahl(k_t=1.0, limit=1.0),))
    with pytest.raises(InputError, match="not located"):
        hill_exponents(replace(system, interface=other), gaps, 1.0)


def test_a_stopped_examination_goes_on_where_it_was(monkeypatch):
    """Matrices of the segments are kept with what they were made of: none is made twice, and the bits are the same."""
    problem, points = stopped(3)
    point = points[2]
    made = []
    node = Segment.node

    def counted(self, sigma):
        made.append(sigma)
        return node(self, sigma)

    monkeypatch.setattr(Segment, "node", counted)
    whole = hill_stability(problem, point)
    all_nodes, pieces = len(made), {}

    def keep(content, make):
        if content not in pieces:
            if len(pieces) == most:
                raise KeyboardInterrupt
            pieces[content] = decode(encode(make()))  # as a journal does
        return pieces[content]

    made.clear()
    for most in (1, 2, 10**6):
        try:
            found = hill_stability(problem, point, keep)
        except KeyboardInterrupt:
            assert len(pieces) == most
    assert len(made) == all_nodes
    np.testing.assert_array_equal(found.stability.floquet.multipliers, whole.stability.floquet.multipliers)
    np.testing.assert_array_equal(found.stability.errors, whole.stability.errors)
    made.clear()
    other = replace(point, coefficients=point.coefficients * (1.0 + 1e-12))
    hill_stability(problem, other, keep)
    assert len(made) > 0.5 * all_nodes  # pieces of another motion are of no use
