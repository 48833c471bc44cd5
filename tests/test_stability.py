"""Multipliers of solved points: closed forms, differences of an independent flow map, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from evidence.judges.flow_map import FlowMap, judged
from evidence.models.lumped import griffin
from evidence.models.random_motions import as_solved
from evidence.models.solving import at_frequency
from stickslip.contact.addresses import compiled_step
from stickslip.contact.interface import Interface
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.bouc_wen import BoucWen
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.dahl import Dahl
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan, UniformBand
from stickslip.contact.laws.regularised_coulomb import RegularisedCoulomb
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import to_real
from stickslip.model.structure import Dofs, Structure
from stickslip.response.forced.problem import forced_problem, with_stiffness
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.stability import motion_stability, stability
from stickslip.response.stability.flow_map import monodromy
from stickslip.response.stability.missing_harmonics import FARTHER, MIN_HARMONICS, corrected, solved_with
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton, newton
from stickslip.solve.status import Status


def matched(found, expected):
    """Return the largest distance of multipliers from their nearest partners, zeros being added where one list is longer."""
    left = list(found)
    left += [0.0] * (len(expected) - len(left))
    expected = [*expected, *[0.0] * (len(left) - len(expected))]
    worst = 0.0
    for value in expected:
        nearest = int(np.argmin(np.abs(np.array(left) - value)))
        worst = max(worst, abs(left.pop(nearest) - value))
    return worst


def flow_map(structure, interface, gaps, omega, begin=0.0):
    return FlowMap(
        judged(
            np.asarray(structure.mass),
            np.asarray(structure.damping),
            np.asarray(structure.stiffness),
            interface.gap_operator.toarray(),
            [law.elements() for law in interface.laws],
            interface.factors,
            gaps,
            omega,
        ),
        begin,
    )


def compared(structure, interface, gaps, omega):
    """Return the stability and its distance from the multipliers of the flow map; resting sliders are ones there."""
    found = motion_stability(structure, interface, gaps, omega)
    expected = flow_map(structure, interface, gaps, omega).multipliers()
    ours = [*found.floquet.multipliers, *np.ones(found.resting)]
    return found, matched(ours, expected)


def random_structure(rng, n):
    root = rng.standard_normal((n, n))
    mass = root @ root.T + n * np.eye(n)
    root = rng.standard_normal((n, n))
    stiffness = root @ root.T + np.eye(n)
    skew = rng.standard_normal((n, n))
    damping = 0.02 * stiffness + 0.05 * mass + 0.1 * (skew - skew.T)
    return Structure(mass, damping, stiffness, Dofs(np.arange(n), ("x",) * n, np.zeros((n, 3))))


def random_gaps(rng, contacts, order):
    gaps = rng.standard_normal((2 * order + 1, 3 * contacts))
    decay = np.repeat(np.arange(order + 1.0), 2)[1:]
    decay[0] = 2.0  # a mean that lets contacts touch
    return gaps / decay[:, None] ** 2


LAWS = {
    "Jenkins": lambda: ElasticCoulomb(k_t=1.5, k_w=0.7, k_n=0.0, mu=0.5, preload=1.0),
    "variable normal force": lambda: ElasticCoulomb(k_t=1.5, k_w=0.9, k_n=1.2, mu=0.4, preload=3.0),
    "lift-off": lambda: ElasticCoulomb(k_t=1.5, k_w=0.9, k_n=1.2, mu=0.4, preload=0.2),
    "lift-off into stick": lambda: ElasticCoulomb(k_t=0.3, k_w=0.2, k_n=2.0, mu=5.0, preload=0.2),
    "clearance": lambda: ElasticCoulomb(k_t=0.5, k_w=0.9, k_n=1.2, mu=1.4, preload=-0.3),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_multipliers_are_those_of_the_flow_map(law, seed):
    rng = np.random.default_rng([seed, list(LAWS).index(law)])
    structure = random_structure(rng, 3)
    interface = Interface(("a", "b"), (LAWS[law](),) * 2, rng.standard_normal((6, 3)), np.array([0.7, 1.3]))
    found, off = compared(structure, interface, random_gaps(rng, 2, 3), 0.8)
    assert found.transitions > 0
    assert off < 2e-7


def test_laws_of_many_sliders_have_a_state_for_each():
    rng = np.random.default_rng(5)
    structure = random_structure(rng, 2)
    law = Iwan(k_t=1.5, limit=1.0, population=UniformBand(n_sliders=6))
    interface = Interface(("a",), (law,), rng.standard_normal((3, 2)))
    found, off = compared(structure, interface, 3.0 * random_gaps(rng, 1, 2), 0.8)
    assert found.floquet.multipliers.size + found.resting == 4 + 6
    assert off < 2e-7


def solved(limit, omega, order):
    system, load = griffin(limit)
    point = at_frequency(system, load, omega / (2 * np.pi), order, samples=512, span=0.02)
    sweep = Sweep(omega_range=(0.9 * omega, omega), low=order, high=order, samples=512, selection="always_low")
    return forced_problem(system, load, sweep), point


def test_slider_of_griffins_blade_is_projected():
    # exponentials alone give 1.402
    found = stability(*solved(0.1, 1.1, 11))
    expected = [0.649 + 0.216j, 0.649 - 0.216j, 0.0]
    assert matched(found.floquet.multipliers, expected) < 5e-4
    assert found.stable
    assert (found.resting, found.transitions) == (0, 4)


def stopped(order):
    """Return a mass that meets a stop with friction, as a problem, and the points of its response."""
    structure, _, _ = one_mass(0.02)
    law = ElasticCoulomb(k_t=3.0, k_w=0.0, k_n=8.0, mu=0.3, preload=0.5)
    system = System(structure, Interface(("stop",), (law,), np.array([[0.6], [0.0], [0.8]])), np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.ones(1, dtype=complex)})
    sweep = Sweep(
        omega_range=(0.5, 3.5),
        low=order,
        high=order,
        selection="always_low",
        frequencies=20,
        peak_points=0,
        evaluator="events",
    )
    return forced_problem(system, load, sweep), list(forced_response(system, load, sweep))


def verdicts(order, many=31):
    """Return (with few harmonics as they are, with the error of the missing ones, with many) of a mass that meets a stop with friction."""
    problem, points = stopped(order)
    structure, system = problem.system.structure, problem.system
    best = problem.balance(tuple(range(many + 1)))
    operator = problem.low.interface.gap_operator
    for point in points:
        start, options = best.unknowns(point.coefficients), Newton(tolerance=1e-11, max_iterations=60)
        exact = newton(lambda x: best.linearise(x, point.omega), start, options)  # noqa: B023
        if not (point.converged and exact.status.converged):
            continue
        plain, truth = (
            motion_stability(structure, system.interface, to_real(c @ operator.T), point.omega)
            for c in (point.coefficients, best.coefficients(exact.x))
        )
        yield plain.verdict, stability(problem, point).verdict, truth.verdict


@pytest.mark.parametrize("order", [1, 3])
def test_few_harmonics_are_undecided_rather_than_wrong(order):
    found = list(verdicts(order))
    assert len(found) > 15
    # with errors that leave the missing harmonics out some verdicts are wrong
    assert any(plain != truth for plain, _, truth in found)
    assert not [row for row in found if row[1] not in (row[2], "undecided")]
    assert sum(row[1] != "undecided" for row in found) > len(found) / 3


def test_newton_goes_on_where_a_step_leads_nowhere_and_its_change_counts_twice():
    problem, points = stopped(1)
    found = [(p, corrected(problem, p)) for p in points]
    assert any(more is None for _, more in found)
    farther = [(p, *more) for p, more in found if more and more[1] == FARTHER]
    assert farther
    for point, more, _ in farther:
        assert more.order == MIN_HARMONICS
        balance = with_stiffness(problem.balance(more.support))
        residual = balance.linearise(balance.unknowns(more.coefficients), more.omega).residual
        assert np.max(np.abs(residual)) < 1e-9
        found, plain, better = stability(problem, point), *(as_solved(problem, p) for p in (point, more))
        change = abs(better.floquet.multipliers[0] - plain.floquet.multipliers[0])
        # of two of a pair either may be the partner
        assert found.errors[0] <= FARTHER * change * (1.0 + 1e-9)
        assert found.multiplier == pytest.approx(better.multiplier, rel=1e-9)


def test_the_reason_names_the_multiplier_and_its_error():
    found = stability(*solved(0.1, 1.1, 11))
    assert found.multiplier == np.max(np.abs(found.floquet.multipliers))
    assert found.reason.startswith(
        f"the largest multiplier that is not neutral has the modulus {found.multiplier:.4g} ± "
    )
    first = np.arange(found.errors.size) == 0
    wide = replace(found, errors=np.where(first, 0.5, 0.0), moduli=None)
    assert (wide.multiplier, wide.multiplier_error) == (found.multiplier, 0.5)
    assert "may lie inside or outside the unit circle" in wide.reason
    # not the largest one decides but that which is known to lie outside
    outside = replace(found.floquet, multipliers=np.where(first, 4.0, 1.5))
    grown = replace(found, floquet=outside, errors=np.where(first, 3.9, 0.1), moduli=None)
    assert (grown.verdict, grown.multiplier, grown.multiplier_error) == ("unstable", 1.5, 0.1)
    assert "1.5 ± 0.1 lies outside the unit circle" in grown.reason
    unjudged = replace(found, errors=np.full_like(found.errors, np.inf), moduli=None)
    assert "its error is not known" in unjudged.reason
    lost = replace(unjudged, floquet=replace(found.floquet, multipliers=np.full(3, np.nan)))
    assert np.isnan(lost.multiplier)
    assert "no multiplier is known" in lost.reason


def test_an_error_that_reaches_the_unit_circle_leaves_it_undecided():
    found = stability(*solved(0.1, 1.1, 11))
    assert found.verdict == "stable"
    found = replace(found, moduli=None)
    wide = np.where(np.arange(found.errors.size) == 0, 0.5, 0.0)
    assert replace(found, errors=wide).verdict == "undecided"
    assert replace(found, errors=np.full(wide.size, np.nan)).verdict == "undecided"
    grown = replace(found.floquet, multipliers=2.5 * found.floquet.multipliers)
    assert replace(found, floquet=grown, errors=wide).verdict == "unstable"


def test_a_growth_with_an_error_of_its_own_size_is_undecided():
    found = replace(stability(*solved(0.1, 1.1, 11)), moduli=None)
    first = np.arange(found.errors.size) == 0
    large = replace(found.floquet, multipliers=np.where(first, -58.6, 0.1))
    for error, verdict in ((20.0, "unstable"), (29.0, "unstable"), (29.5, "undecided"), (55.1, "undecided")):
        wide = np.where(first, error, 0.0)
        assert replace(found, floquet=large, errors=wide).verdict == verdict
    # another multiplier may show it all the same
    two = replace(large, multipliers=np.where(np.arange(first.size) == 1, 1.2, large.multipliers))
    wide = np.where(first, 55.1, 1e-3)
    assert replace(found, floquet=two, errors=wide).verdict == "unstable"


def test_motions_without_missing_forces_have_no_error():
    # all contacts stuck: no force acts on harmonics above the excitation's
    assert stability(*solved(100.0, 1.3, 3)).error == 0.0


def test_resting_sliders_are_parameters():
    (problem, point), (system, _) = solved(100.0, 1.3, 3), griffin(100.0)
    found = stability(problem, point)
    stuck = system.stuck_structure()
    matrix = np.block([[np.zeros((1, 1)), np.eye(1)], [-stuck.stiffness, -stuck.damping]])
    exact = np.exp(scipy.linalg.eigvals(matrix) * 2 * np.pi / 1.3)
    assert matched(found.floquet.multipliers, exact) < 1e-12
    assert (found.resting, found.grazing, found.transitions) == (1, 0, 0)


def test_a_slider_that_shook_down_is_told_from_one_that_never_slipped():
    system, _ = griffin(0.1)
    gaps = np.zeros((3, 3))
    gaps[:, 0] = [0.5, 0.19, 0.0]  # the mean pulls beyond the limit, the vibration is within
    found = motion_stability(system.structure, system.interface, gaps, 1.1)
    assert (found.resting, found.grazing, found.transitions) == (1, 1, 0)


def test_multipliers_do_not_depend_on_units_nor_on_the_time_of_the_load():
    rng = np.random.default_rng(3)
    structure = random_structure(rng, 3)
    interface = Interface(("a", "b"), (LAWS["lift-off"](),) * 2, rng.standard_normal((6, 3)))
    gaps = random_gaps(rng, 2, 3)
    expected = motion_stability(structure, interface, gaps, 0.8).floquet.multipliers
    shifted, angle = gaps.copy(), 0.7
    for h in range(1, 4):
        c, s = np.cos(h * angle), np.sin(h * angle)
        shifted[[2 * h - 1, 2 * h]] = np.array([[c, s], [-s, c]]) @ gaps[[2 * h - 1, 2 * h]]
    found = motion_stability(structure, interface, shifted, 0.8).floquet.multipliers
    assert matched(found, expected) < 1e-10
    kilo = replace(
        structure, mass=1e3 * structure.mass, damping=1e3 * structure.damping, stiffness=1e3 * structure.stiffness
    )
    heavy = replace(interface, weights=np.full(2, 1e3))
    assert matched(motion_stability(kilo, heavy, gaps, 0.8).floquet.multipliers, expected) < 1e-10


def test_what_has_no_multipliers_is_refused():
    problem, point = solved(0.1, 1.1, 1)
    with pytest.raises(InputError, match="did not converge"):
        stability(problem, replace(point, status=Status.STALLED))
    system, _ = griffin(0.1)
    gaps = np.zeros((3, 3))
    rigid = replace(system.interface, laws=(RigidCoulomb(mu=0.3),))
    with pytest.raises(InputError, match="rigid"):
        motion_stability(system.structure, rigid, gaps, 1.0)
    massless = replace(system.structure, mass=np.zeros((1, 1)))
    with pytest.raises(InputError, match="mass matrix"):
        motion_stability(massless, system.interface, gaps, 1.0)
    lossy = replace(system.structure, loss=np.eye(1))
    with pytest.raises(InputError, match="structural damping"):
        motion_stability(lossy, system.interface, gaps, 1.0)


def bouc_wen_rate(z, x, v):
    return (1.0 - (0.5 * np.sign(z * v) + 0.2) * abs(z)) * v


# law, force along t of displacement, velocity and state, rate of the state
MARCHED = {
    "cubic spring": (CubicSpring(k_t=0.5, cubic_t=0.8), lambda x, v, z: 0.5 * x + 0.8 * x**3, lambda z, x, v: 0.0),
    "Bouc-Wen": (BoucWen(k_t=1.5, beta=0.5, gamma=0.2), lambda x, v, z: 1.5 * z, bouc_wen_rate),
    "regularised": (
        RegularisedCoulomb(mu=0.4, transition_velocity=0.3, preload=2.0),
        lambda x, v, z: 0.8 * np.tanh(v / 0.3),
        lambda z, x, v: 0.0,
    ),
}


def smooth_multipliers(structure, row, motion, omega, force, rate, small=1e-3):
    """Return multipliers by differences of a flow map that SciPy integrates; `motion` gives displacement and velocity along t."""
    n = structure.n
    inverse = np.linalg.inv(structure.mass)

    def flow(t, y):
        (x, v), d, w = motion(t), y[:n], y[n : 2 * n]
        more = force(x + row @ d, v + row @ w, y[-1]) - force(x, v, y[-2])
        speed = inverse @ (-structure.stiffness @ d - structure.damping @ w - row * more)
        return [*w, *speed, rate(y[-2], x, v), rate(y[-1], x + row @ d, v + row @ w)]

    period = 2 * np.pi / omega

    def settling(t, z):
        x, v = motion(t)
        return [rate(z[0], x, v)]

    def image(y):
        return solve_ivp(flow, (0.0, period), y, method="DOP853", rtol=1e-9, atol=1e-12, max_step=0.2).y[:, -1]

    def drift(z):
        return solve_ivp(settling, (0.0, period), [z], method="DOP853", rtol=1e-9, max_step=0.2).y[0, -1] - z

    z = brentq(drift, -1.42, 1.42) if drift(1.0) else 0.0
    columns = []
    for unit in np.eye(2 * n + 1):
        both = [image(np.array([*(s * unit[:-1]), z, z + s * unit[-1]])) for s in (small, -small)]
        changed = both[0] - both[1]
        columns.append(np.array([*changed[: 2 * n], changed[-1]]) / (2 * small))
    return np.linalg.eigvals(np.array(columns).T)


@pytest.mark.parametrize("name", MARCHED)
def test_other_laws_are_followed_along_their_tangents(name):
    law, force, rate = MARCHED[name]
    rng = np.random.default_rng(11)
    structure, row = random_structure(rng, 1), np.ones(1)
    interface = Interface(("a",), (law,), np.vstack([row, np.zeros((2, 1))]))
    gaps = np.zeros((5, 3))
    gaps[:, 0] = [0.0, 1.2, 0.3, 0.2, -0.1]

    def motion(t):
        h = 0.8 * np.array([1, 1, 2, 2])
        waves = np.cos(h * t - np.array([0, 1, 0, 1]) * np.pi / 2)
        rates = -h * np.sin(h * t - np.array([0, 1, 0, 1]) * np.pi / 2)
        return gaps[1:, 0] @ waves, gaps[1:, 0] @ rates

    found = motion_stability(structure, interface, gaps, 0.8)
    expected = smooth_multipliers(structure, row, motion, 0.8, force, rate)
    # states that nothing moves: of Bouc-Wen's second tangent here, of the judge's z there
    ours = [m for m in found.floquet.multipliers if abs(m) > 1e-6 and m != 1.0]
    off = matched(ours, [m for m in expected if abs(m - 1.0) > 1e-9])
    assert off < min(2e-5, found.error)


def test_sampled_and_located_contacts_go_together():
    # a linear spring as a law of either kind
    rng = np.random.default_rng(2)
    structure = random_structure(rng, 3)
    operator, gaps = rng.standard_normal((6, 3)), random_gaps(rng, 2, 3)
    friction = LAWS["lift-off"]()
    springs = (CubicSpring(k_t=0.9, k_w=0.5, k_n=0.4), Bonded(k_t=0.9, k_w=0.5, k_n=0.4))
    sampled, located = (
        motion_stability(structure, Interface(("a", "b"), (friction, law), operator, np.array([0.7, 1.3])), gaps, 0.8)
        for law in springs
    )
    assert located.resting == 2
    assert (sampled.transitions, sampled.resting) == (located.transitions, 0)
    assert matched(sampled.floquet.multipliers, located.floquet.multipliers) < 1e-9


@pytest.mark.parametrize("n_modes", [2, 9])  # blocks of one sample, and of several
def test_a_block_of_samples_is_one_sample_after_the_other(n_modes, monkeypatch):
    rng = np.random.default_rng(n_modes)
    structure, gaps = random_structure(rng, n_modes), random_gaps(rng, 3, 5)
    laws = (
        LAWS["lift-off"](),
        CoupledCoulomb(k_t=0.9, k_n=0.7, mu=0.4, preload=0.6),
        CubicSpring(k_t=0.9, k_w=0.5, k_n=0.4),
    )
    interface = Interface(("a", "b", "c"), laws, rng.standard_normal((9, n_modes)), np.array([0.7, 1.3, 0.4]))
    of_blocks = motion_stability(structure, interface, gaps, 0.8)

    def each_alone(kicks, first, shares, step, states):
        for i, share in enumerate(shares, first):
            kicks.kick(i, share, states)
            states = step @ states
        return states

    monkeypatch.setattr(monodromy._Kicks, "advance", each_alone)
    one_by_one = motion_stability(structure, interface, gaps, 0.8)
    assert of_blocks.transitions == one_by_one.transitions > 0
    assert matched(of_blocks.floquet.multipliers, one_by_one.floquet.multipliers) < 1e-9


@pytest.mark.parametrize("law", ["variable normal force", "lift-off", "lift-off into stick"])
def test_planar_friction_along_a_line_is_that_of_a_spring_along_it(law):
    rng = np.random.default_rng(3)
    structure, operator, gaps = random_structure(rng, 3), rng.standard_normal((6, 3)), random_gaps(rng, 2, 3)
    operator[[1, 4]], gaps[:, [1, 4]] = 0.0, 0.0
    spring = replace(LAWS[law](), k_w=0.0)
    planar = CoupledCoulomb(k_t=spring.k_t, k_n=spring.k_n, mu=spring.mu, preload=spring.preload)
    located, sampled = (
        motion_stability(structure, Interface(("a", "b"), (each,) * 2, operator), gaps, 0.8)
        for each in (spring, planar)
    )
    large = [m for m in located.floquet.multipliers if abs(m) > 0.1]
    off = [np.min(np.abs(sampled.floquet.multipliers - m)) for m in large]
    assert large
    assert max(off) < 5e-3
    assert sampled.error < 3e-2


def one_mass(damping=0.05):
    structure = Structure(np.eye(1), np.array([[damping]]), np.eye(1), Dofs(np.arange(1), ("x",), np.zeros((1, 3))))
    gaps = np.zeros((3, 3))
    gaps[1, 0] = 2.7
    return structure, np.array([[1.0], [0.0], [0.0]]), gaps


@pytest.mark.parametrize("velocity", [1e-2, 1e-3, 1e-6])
def test_steep_friction_takes_velocity_where_that_passes_zero(velocity):
    structure, operator, gaps = one_mass()
    omega, force = 1.1, 0.5
    law = RegularisedCoulomb(mu=0.5, transition_velocity=velocity, preload=1.0)
    found = motion_stability(structure, Interface(("a",), (law,), operator), gaps, omega)
    # a narrow crossing of zero keeps exp(-2 F / (m a)) of a disturbed velocity
    half = scipy.linalg.expm(np.array([[0.0, 1.0], [-1.0, -0.05]]) * np.pi / omega)
    kept = np.diag([1.0, np.exp(-2.0 * force / (omega**2 * 2.7))])
    off = matched(found.floquet.multipliers, np.linalg.eigvals(kept @ half @ kept @ half))
    assert off < 5e-5 + 0.1 * velocity
    assert found.error < 5e-4


@pytest.mark.parametrize(("law", "states"), [(Dahl(k_t=1.0, limit=0.5), 2), (BoucWen(k_t=1.5, beta=0.5, gamma=0.2), 2)])
def test_a_tangent_without_stiffness_adds_no_multiplier(law, states):
    structure, operator, gaps = one_mass()
    found = motion_stability(structure, Interface(("a",), (law,), operator), gaps, 1.1)
    with_w = replace(law, k_w=0.3)
    other = motion_stability(structure, Interface(("a",), (with_w,), operator), gaps, 1.1)
    assert (found.floquet.neutral, found.resting) == (0, 0)
    assert found.floquet.multipliers.size == 2 + states
    assert other.floquet.multipliers.size == 2 + 2 * states


def test_a_planar_slider_that_never_slips_is_removed_as_a_spring_is():
    structure, operator, gaps = one_mass()
    found, expected = (
        motion_stability(structure, Interface(("a",), (law,), operator), gaps, 1.1)
        for law in (
            CoupledCoulomb(k_t=1.0, k_n=0.2, mu=0.3, preload=1e6),
            ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=0.2, mu=0.3, preload=1e6),
        )
    )
    assert (found.resting, found.grazing, found.floquet.neutral) == (2, 0, 0)
    assert expected.resting == 2
    assert matched(found.floquet.multipliers, expected.floquet.multipliers) < 1e-9


def test_a_planar_slider_that_was_dragged_and_rests_is_grazing():
    structure, operator, gaps = one_mass()
    law = CoupledCoulomb(k_t=1.0, k_n=0.2, mu=0.5, preload=2.0)
    gaps[0, 0], gaps[1, 0] = 3.0, 0.5
    found = motion_stability(structure, Interface(("a",), (law,), operator), gaps, 1.1)
    assert (found.resting, found.grazing, found.floquet.neutral) == (2, 1, 0)


def test_planar_contacts_open_and_close_where_their_springs_do():
    # without friction both laws are one unilateral spring, whose transitions are located
    structure, operator, gaps = one_mass()
    operator[2], gaps[:, 2] = 0.4, 0.4 * gaps[:, 0]
    values = {"k_t": 1.0, "k_n": 1.0, "mu": 0.0, "preload": 1.0}
    planar, spring = (
        motion_stability(structure, Interface(("a",), (law,), operator), gaps, 1.1)
        for law in (CoupledCoulomb(**values), ElasticCoulomb(k_w=0.0, **values))
    )
    assert planar.transitions == 2
    large = [m for m in planar.floquet.multipliers if abs(m) > 1e-3]
    assert matched(large, spring.floquet.multipliers[: len(large)]) < 1e-11


def test_laws_without_finite_tangents_leave_the_verdict_undecided(monkeypatch):
    structure, operator, gaps = one_mass()
    law = CoupledCoulomb(k_t=1.0, k_n=0.2, mu=0.5, preload=2.0)
    whole = law.kernel

    def broken(gap, velocity, old, parameters, force, new, jac, status):
        whole(gap, velocity, old, parameters, force, new, jac, status)
        if gap[0] > 0.0:
            jac[0, 0] = np.nan

    monkeypatch.setattr(CoupledCoulomb, "kernel", compiled_step(broken))
    found = motion_stability(structure, Interface(("a",), (law,), operator), gaps, 1.1)
    assert found.verdict == "undecided"
    assert found.error == np.inf
    assert found.errors.shape == found.floquet.multipliers.shape == (2,)


def test_a_known_motion_with_more_harmonics_takes_the_place_of_a_newton_step():
    problem, points = stopped(3)
    worked = []
    for point in points[2::5]:
        more = solved_with(problem, point, 15)
        assert more is not None
        known, alone = stability(problem, point, more.point), stability(problem, point)
        assert known.verdict == alone.verdict
        apart = abs(known.multiplier - alone.multiplier)
        assert apart <= known.multiplier_error + alone.multiplier_error
        worked.append(known.work < alone.work)
    assert any(worked)
