"""All motions: deflation, isolas, starts in time and their basins, against closed forms and SciPy."""

from itertools import islice

import numpy as np
import pytest
from models import table
from scipy.integrate import solve_ivp
from scipy.stats import binom

from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.polynomial_spring import PolynomialSpring
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.response.all_motions import MotionSearch, all_motions, share_interval
from stickslip.response.all_motions.basins import APERIODIC, DIVERGED
from stickslip.response.all_motions.found import search_problem
from stickslip.response.all_motions.search import search_stages
from stickslip.response.system import System


def one_mass(law, c: float, force: float, direction: int = 0) -> tuple[System, HarmonicLoad]:
    """m = k = 1 with a contact to ground."""
    one = np.ones((1, 1))
    gap = np.zeros((3, 1))
    gap[direction] = 1.0
    structure = Structure(one, c * one, one.copy(), table(("x",)))
    system = System(structure, Interface(("c",), (law,), gap), np.array([0]))
    return system, HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})


# ---- Duffing ---------------------------------------------------------------------------------------------------------------

C, CUBIC, FORCE, OMEGA = 0.05, 1.0, 0.1, 1.3


def duffing_amplitudes(omega: float) -> np.ndarray:
    """Amplitudes of one harmonic: ((1 - ω² + 3/4 κ s)² + c²ω²) s = F², s = a²."""
    d = 1.0 - omega**2
    s = np.roots([(0.75 * CUBIC) ** 2, 1.5 * CUBIC * d, d**2 + (C * omega) ** 2, -(FORCE**2)])
    real = s[np.abs(s.imag) < 1e-9].real
    return np.sort(np.sqrt(real[real > 0.0]))


def duffing() -> tuple[System, HarmonicLoad]:
    return one_mass(CubicSpring(cubic_t=CUBIC, k_t=1e-12), C, FORCE)


@pytest.fixture(scope="module")
def found():
    system, load = duffing()
    search = MotionSearch(
        omega_range=(0.6, 1.7), at=(OMEGA,), harmonics=1, samples=32, points=15, starts=24, steps=128, most_periods=300
    )
    return all_motions(system, load, search)


def test_duffing_has_the_three_motions_of_the_closed_form(found):
    own = sorted(m.amplitude for m in found.at[0].motions)
    np.testing.assert_allclose(own, duffing_amplitudes(OMEGA), rtol=1e-8)
    by_size = sorted(found.at[0].motions, key=lambda m: m.amplitude)
    assert by_size[1].stability == "unstable"
    # what harmonics left out would change may keep one from being judged, never make it unstable
    assert {by_size[0].stability, by_size[2].stability} <= {"stable", "undecided"}
    assert [b.origin for b in found.branches] == ["sweep"], "the sweep meets all three"


def test_starts_end_where_integration_by_scipy_does(found):
    """The shares of two hundred starts of SciPy's own, drawn in the same disc, lie within what both samples leave open."""
    at = found.at[0]
    stable = [i for i, m in enumerate(at.motions) if m.stability != "unstable"]
    assert sum(at.basins.count(i) for i in stable) == len(at.basins.ends) == 24
    assert all(at.basins.count(i) > 0 for i in stable)
    high = max(stable, key=lambda i: at.motions[i].amplitude)
    rng = np.random.default_rng(5)
    n = 120
    # the disc of the search: 1.5 times the largest motion
    size = 1.5 * max(m.amplitude for m in at.motions) * np.sqrt(rng.uniform(size=n))
    turn = rng.uniform(0.0, 2.0 * np.pi, n)
    begin = np.concatenate([size * np.cos(turn), size * np.sin(turn)])
    period = 2.0 * np.pi / OMEGA

    def rate(t, y):
        x, v = y[:n], y[n:]
        return np.concatenate([v, FORCE * np.cos(OMEGA * t) - C * v - x - CUBIC * x**3])

    times = np.linspace(40, 41, 33) * period
    late = solve_ivp(rate, (0.0, 41 * period), begin, rtol=1e-6, atol=1e-6, t_eval=times).y[:n]
    amplitude = np.max(np.abs(late), axis=1)
    middle = sorted(m.amplitude for m in at.motions)[1]
    ended_high = int(np.sum(amplitude > middle))
    low, top = share_interval(ended_high, n)
    own_low, own_top = at.basins.interval(high)
    assert max(low, own_low) <= min(top, own_top)
    assert 0 < ended_high < n


@pytest.mark.parametrize(("count", "starts"), [(0, 20), (7, 20), (20, 20)])
def test_the_interval_holds_what_is_not_improbable(count, starts):
    low, high = share_interval(count, starts)
    assert low <= count / starts <= high
    if count > 0:
        assert binom.sf(count - 1, starts, low) == pytest.approx(0.025, abs=1e-9)
    if count < starts:
        assert binom.cdf(count, starts, high) == pytest.approx(0.025, abs=1e-9)


# ---- an isola in closed form -----------------------------------------------------------------------------------------------

SOFT, HARD, WEAK, PUSH = -2.0, 1.0, 0.05, 0.02


def stiffness(s):
    """Of the first harmonic, over s = a²: softening, then hardening."""
    return 1.0 + 0.75 * SOFT * s + 0.625 * HARD * s**2


def isola() -> tuple[float, float]:
    """Smallest and largest amplitude of the isola: c² a² (K - c²/4) = F² at both."""
    c2 = WEAK**2
    roots = np.roots([0.625 * HARD, 0.75 * SOFT, 1.0 - c2 / 4.0, -(PUSH**2) / c2])
    s = np.sort(roots[np.abs(roots.imag) < 1e-12].real)
    assert s.size == 3
    return float(np.sqrt(s[1])), float(np.sqrt(s[2]))


def test_deflation_finds_the_isola_of_the_closed_form_and_follows_it_round():
    system, load = one_mass(PolynomialSpring(along_t=(0.0, 0.0, SOFT, 0.0, HARD)), WEAK, PUSH)
    low, high = isola()
    omega = float(np.sqrt(stiffness(high**2) - WEAK**2 / 2.0))
    search = MotionSearch(omega_range=(0.1, 1.3), at=(omega,), harmonics=1, samples=32, points=40, tries=20, starts=0)
    result = all_motions(system, load, search)
    assert len(result.isolas) == 1
    ring = result.isolas[0]
    assert ring.origin == "deflation"
    # every point solves (K - ω²)² + c²ω² = F²/a²
    s = ring.amplitude**2
    left = (stiffness(s) - ring.omega**2) ** 2 + (WEAK * ring.omega) ** 2
    np.testing.assert_allclose(left * s, PUSH**2, rtol=1e-8)
    assert ring.amplitude.max() == pytest.approx(high, rel=2e-3)
    assert ring.amplitude.max() <= high * (1.0 + 1e-9)
    assert ring.amplitude.min() == pytest.approx(low, rel=2e-2)
    assert ring.peak > result.branches[0].peak, "the isola is higher than what a sweep shows"
    assert not result.spent
    # its folds and its peak lie between the points: ω² = K - c²/2 ± sqrt(F²/s - c² (K - c²/4))
    s = np.linspace(low**2, high**2, 200_001)
    root = np.sqrt(np.maximum(PUSH**2 / s - WEAK**2 * (stiffness(s) - WEAK**2 / 4.0), 0.0))
    squares = stiffness(s) - WEAK**2 / 2.0 + np.array([[-1.0], [1.0]]) * root
    np.testing.assert_allclose(ring.extent, np.sqrt([squares.min(), squares.max()]), rtol=3e-4)
    assert ring.peak == pytest.approx(high, rel=3e-4)


# ---- an absorber ---------------------------------------------------------------------------------------------------------------

TUNED = {"knl2": 0.0042, "k2": 0.0454, "c2": 0.0128, "m2": 0.05, "c1": 0.002}  # of Habib, Detroux and others


def absorber(force: float) -> tuple[System, HarmonicLoad]:
    """A Duffing oscillator with a nonlinear tuned absorber."""
    k2, c2 = TUNED["k2"], TUNED["c2"]
    damping = np.array([[TUNED["c1"] + c2, -c2], [-c2, c2]])
    stiffness = np.array([[1.0 + k2, -k2], [-k2, k2]])
    gap = np.zeros((6, 2))
    gap[0, 0], gap[3, 0], gap[3, 1] = 1.0, -1.0, 1.0
    laws = (CubicSpring(cubic_t=1.0, k_t=1e-12), CubicSpring(cubic_t=TUNED["knl2"], k_t=1e-12))
    structure = Structure(np.diag([1.0, TUNED["m2"]]), damping, stiffness, table(("x", "y")))
    system = System(structure, Interface(("main", "absorber"), laws, gap), np.array([0]))
    return system, HarmonicLoad(np.zeros(2), {1: np.array([force + 0j, 0.0])})


def absorber_amplitudes(omega: float, force: float) -> np.ndarray:
    """Amplitudes of the main mass with one harmonic: at each relative amplitude z the force that it takes is known, and z is walked through."""
    k2, c2, m2 = TUNED["k2"], TUNED["c2"], TUNED["m2"]
    z = np.geomspace(1e-3, 60.0, 400_000)
    pull = k2 + 0.75 * TUNED["knl2"] * z**2 + 1j * c2 * omega
    x = z * (pull - m2 * omega**2) / (m2 * omega**2)
    taken = (1.0 - omega**2 + 1j * TUNED["c1"] * omega + 0.75 * abs(x) ** 2) * x - pull * z
    miss = np.abs(taken) - force
    at = np.flatnonzero(miss[:-1] * miss[1:] < 0.0)
    share = miss[at] / (miss[at] - miss[at + 1])
    return np.sort(np.abs(x[at]) + share * (np.abs(x[at + 1]) - np.abs(x[at])))


@pytest.mark.parametrize(("force", "isolas"), [(0.12, 0), (0.14, 1)])
def test_the_detached_curve_of_an_absorber_is_found_where_there_is_one(force, isolas):
    system, load = absorber(force)
    omega = 1.9
    search = MotionSearch(omega_range=(0.8, 2.4), at=(omega,), harmonics=1, samples=32, points=12, tries=12, starts=0)
    found = all_motions(system, load, search)
    own = np.sort([m.amplitude for m in found.at[0].motions])
    np.testing.assert_allclose(own, absorber_amplitudes(omega, force), rtol=1e-6)
    assert len(found.isolas) == isolas
    assert all(b.peak > 2.5 * found.branches[0].peak for b in found.isolas)


# ---- motions of a third of the frequency: nothing leads to them from the response -----------------------------------------------

THIRD_C, THIRD_F = 0.002, 0.6


def thirds(omega: float) -> np.ndarray:
    """Amplitudes a of x = A cos(ωt + φ) + a cos(ωt/3) with harmonics ω/3 and ω alone, from both balances by roots over a².

    Of ω/3: (1 - ω²/9 + κ(3/4 a² + 3/2 A²))² + (cω/3)² = (3/4 κ a A)²; of ω: the force that is left has the size F.
    """
    found = []
    a = np.linspace(0.05, 3.0, 20_000)
    # at each a the first equation gives A² by a quadratic; the second must then hold
    w3 = omega / 3.0
    d = 1.0 - w3**2 + 0.75 * a**2
    damp = THIRD_C * w3
    # (d + 1.5 B)² + damp² = (9/16) a² B with B = A²
    b, c0 = 3.0 * d - 0.5625 * a**2, d**2 + damp**2
    root = b**2 - 9.0 * c0
    for sign in (1.0, -1.0):
        big = (-b + sign * np.sqrt(np.maximum(root, 0.0))) / 4.5
        size = np.sqrt(np.maximum(big, 0.0))
        # both components turn into one equation for the phase ψ of A against a: 3/4 a A e^{iψ} = -(d + 1.5 B + i damp)
        turn = -(d + 1.5 * big + 1j * damp) / np.maximum(0.75 * a * size, 1e-300)
        rest = (1.0 - omega**2 + 0.75 * big + 1.5 * a**2 + 1j * THIRD_C * omega) * size * turn + 0.25 * a**3
        miss = np.where((root > 0.0) & (big > 0.0), np.abs(rest) - THIRD_F, np.nan)
        there = np.flatnonzero(miss[:-1] * miss[1:] < 0.0)
        found += [a[i] - miss[i] * (a[i + 1] - a[i]) / (miss[i + 1] - miss[i]) for i in there]
    return np.sort(found)


def test_motions_of_a_third_of_the_frequency_are_an_isola_and_those_of_two_harmonics():
    omega = 4.2
    system, load = one_mass(CubicSpring(cubic_t=1.0, k_t=1e-12), THIRD_C, THIRD_F)
    search = MotionSearch(
        omega_range=(3.9, 4.4), at=(omega,), periods=3, harmonics=1, samples=32, points=8, tries=8, starts=0, seed=1
    )
    found = all_motions(system, load, search).at[0].motions
    sizes = [np.abs(m.coefficients[:, 0]) for m in found]
    own = np.sort([q[1] for q in sizes if q[1] > 1e-6])
    np.testing.assert_allclose(own, thirds(omega), rtol=1e-4)
    # the others have the period of the load: roots of the same cubic as above
    d = 1.0 - omega**2
    roots = np.roots([0.5625, 1.5 * d, d**2 + (THIRD_C * omega) ** 2, -(THIRD_F**2)]).real
    for q in sizes:
        assert q[1] > 1e-6 or np.min(np.abs(np.sqrt(roots) / q[3] - 1.0)) < 1e-6


# ---- a stop ----------------------------------------------------------------------------------------------------------------

STOP, CLEARANCE, DAMPING, DRIVE, FAST = 3.0, 1.0, 0.04, 0.1, 1.15


def stop() -> tuple[System, HarmonicLoad]:
    return one_mass(UnilateralSpring(k_n=STOP, initial_gap=CLEARANCE), DAMPING, DRIVE, direction=2)


def impacting(y0, periods):
    period = 2.0 * np.pi / FAST

    def rate(t, y):
        # the contact closes where the displacement along n has come to -clearance
        push = STOP * max(0.0, -y[0] - CLEARANCE)
        return [y[1], DRIVE * np.cos(FAST * t) - DAMPING * y[1] - y[0] + push]

    times = np.linspace(periods - 1, periods, 65) * period
    y = solve_ivp(rate, (0.0, periods * period), y0, rtol=1e-8, atol=1e-10, t_eval=times, max_step=period / 40).y[0]
    return 2.0 * abs(np.mean(y[:-1] * np.exp(-1j * FAST * times[:-1])))


@pytest.mark.validation
def test_a_mass_beside_a_stop_moves_without_and_with_impacts():
    system, load = stop()
    search = MotionSearch(
        omega_range=(0.8, 1.5), at=(FAST,), harmonics=9, points=12, tries=6, starts=16, steps=256, most_periods=300
    )
    at = all_motions(system, load, search).at[0]
    stable = sorted((m for m in at.motions if m.stability == "stable"), key=lambda m: m.amplitude)
    assert len(stable) == 2
    free = DRIVE / abs(1.0 - FAST**2 + 1j * DAMPING * FAST)
    assert free < CLEARANCE
    assert stable[0].amplitude == pytest.approx(free, rel=1e-9), "without impacts it is linear"
    motion = stable[1].coefficients[:, 0]
    begin = [float(np.sum(motion.real)), float(np.sum((1j * FAST * np.arange(motion.size) * motion).real))]
    assert impacting(begin, 60) == pytest.approx(stable[1].amplitude, rel=2e-3)
    assert min(at.basins.count(at.motions.index(m)) for m in stable) > 0


# ---- subharmonic isola -----------------------------------------------------------------------------------------------------


@pytest.mark.validation
def test_the_third_order_subharmonic_isola_of_a_duffing_oscillator_is_found():
    # q'' + 4 q' + 1e4 q + 1e8 q³ = 100 cos Ωt: from 341.9 to 424.5 rad/s
    one, gap = np.ones((1, 1)), np.array([[1.0], [0.0], [0.0]])
    structure = Structure(one, 4.0 * one, 1e4 * one, table(("q",)))
    contact = Interface(("c",), (CubicSpring(cubic_t=1e8),), gap)
    system, load = System(structure, contact, np.array([0])), HarmonicLoad(np.zeros(1), {1: np.array([100.0 + 0j])})
    search = MotionSearch(
        omega_range=(300.0, 500.0), at=(400.0,), periods=3, harmonics=3, samples=72, points=10, tries=1, starts=0
    )
    found = all_motions(system, load, search)
    (isola,) = (b for b in found.branches if b.isola)
    assert isola.origin == "deflation"
    # the limits are known to their last digit, of the frequency of the load
    assert isola.extent == pytest.approx((341.9, 424.5), abs=0.1)
    # two motions of the isola beside the three of the load's period
    assert len(found.at[0].motions) == 5
    # its third harmonics alone: 3/4 κ a² = (Ω/3)² - k without damping and load
    free = np.sqrt(((400.0 / 3) ** 2 - 1e4) / (0.75 * 1e8))
    assert min(abs(m.amplitude / free - 1.0) for m in found.at[0].motions) < 0.05


# ---- budget, resumption, bad input -----------------------------------------------------------------------------------------


def test_a_budget_that_is_spent_is_said_and_nothing_begins_after_it():
    system, load = duffing()
    result = all_motions(system, load, MotionSearch(omega_range=(0.6, 1.7), harmonics=1, points=20, solves=1))
    assert result.spent
    assert result.tries == result.starts == 0
    assert len(result.at) == 5
    assert all(at.spent for at in result.at)
    assert result.branches[0].omega.size == 1, "the sweep ends with the budget, too"
    assert result.branches[0].end == "the budget is spent"


def test_an_interrupted_search_goes_on_to_the_same_stages():
    system, load = stop()
    search = MotionSearch(
        omega_range=(1.1, 1.2), at=(FAST,), harmonics=3, points=8, tries=1, starts=2, steps=64, most_periods=60
    )
    problem = search_problem(system, load, search)
    whole = list(search_stages(problem, search))
    assert [s.kind for s in whole[:3]] == ["branch", "branch", "searched"]
    # of the first stop only what comes next: the second one is followed to the end
    for stop_at, end in ((1, 2), (2, len(whole)), (len(whole) - 1, len(whole))):
        rest = islice(search_stages(problem, search, whole[:stop_at]), end - stop_at)
        again = [*whole[:stop_at], *rest]
        assert [s.kind for s in again] == [s.kind for s in whole[:end]]
        for one, other in zip(whole[:end], again, strict=True):
            np.testing.assert_array_equal(one.coefficients, other.coefficients)
            np.testing.assert_array_equal(one.branch, other.branch)
            assert one.tries == other.tries


def test_an_interrupted_search_draws_the_same_states_after_a_motion_was_found():
    system, load = stop()
    search = MotionSearch(
        omega_range=(1.1, 1.2),
        at=(FAST,),
        harmonics=3,
        points=8,
        tries=1,
        starts=5,
        spread=6.0,
        steps=64,
        most_periods=400,
    )
    problem = search_problem(system, load, search)
    whole = list(search_stages(problem, search))
    kinds = [(s.kind, s.origin) for s in whole]
    after = kinds.index(("branch", "deflation")) + 1
    again = [*whole[:after], *search_stages(problem, search, whole[:after])]
    assert [(s.kind, s.origin) for s in again] == kinds
    for one, other in zip(whole, again, strict=True):
        np.testing.assert_array_equal(one.branch, other.branch)


def test_a_start_that_still_rings_at_half_the_frequency_has_not_settled():
    """A spring with a square feeds what rings at half of the frequency: a multiplier of 0.997, while the driven harmonic hardly changes."""
    system, load = one_mass(PolynomialSpring(along_t=(0.0, 0.56, 0.4)), 0.043, 0.271)
    search = MotionSearch(
        omega_range=(1.9, 2.0),
        at=(1.97,),
        periods=2,
        harmonics=2,
        points=8,
        tries=1,
        starts=3,
        steps=64,
        most_periods=60,
        seed=3,
    )
    assert all_motions(system, load, search).at[0].basins.ends == 3 * (APERIODIC,)


def test_starts_that_grow_without_bound_are_counted_as_that():
    system, load = one_mass(CubicSpring(cubic_t=CUBIC, k_t=1e-12), -0.6, FORCE)
    search = MotionSearch(omega_range=(0.8, 1.6), at=(OMEGA,), harmonics=1, points=8, tries=1, starts=2, steps=64)
    at = all_motions(system, load, search).at[0]
    assert at.basins.ends == (DIVERGED, DIVERGED)


def test_what_more_harmonics_would_change_is_told_of_each_motion(found):
    """The change by a Newton step is about the distance from the motions with nine harmonics."""
    system, load = duffing()
    search = MotionSearch(omega_range=(0.6, 1.7), at=(OMEGA,), harmonics=9, samples=72, points=10, tries=1, starts=0)
    more = sorted(all_motions(system, load, search).at[0].motions, key=lambda m: m.amplitude)
    few = sorted(found.at[0].motions, key=lambda m: m.amplitude)
    for one, other in zip(few, more, strict=True):
        apart = other.coefficients[1:].copy()
        apart[0] -= one.coefficients[1]
        real = float(np.linalg.norm(apart) / np.linalg.norm(other.coefficients[1:]))
        assert 0.5 * real < one.change < 2.0 * real
        assert other.change < 1e-3


def test_what_cannot_be_marched_is_searched_and_said():
    one = np.ones((1, 1))
    gap = np.array([[1.0], [0.0], [0.0]])
    lossy = Structure(one, 0.0 * one, one.copy(), table(("x",)), loss=0.05 * one)
    law = CubicSpring(cubic_t=CUBIC, k_t=1e-12)
    system = System(lossy, Interface(("c",), (law,), gap), np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.array([FORCE + 0j])})
    search = MotionSearch(omega_range=(0.8, 1.6), at=(OMEGA,), harmonics=1, points=15, tries=2)
    found = all_motions(system, load, search)
    assert "structural damping" in found.unmarched
    assert found.starts == 0
    assert {m.stability for m in found.at[0].motions} == {"not examined"}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"at": (9.0,)}, "MotionSearch.at"),
        ({"solves": 0}, "solves"),
        ({"points": 0}, "MotionSearch.points"),
        ({"periods": 20, "harmonics": 13}, "MotionSearch.steps"),
    ],
)
def test_bad_searches_are_refused(keys, said):
    with pytest.raises(InputError, match=said):
        MotionSearch(omega_range=(0.5, 2.0), **keys)


def test_rigid_contacts_are_refused():
    system, load = one_mass(RigidCoulomb(mu=0.3, preload=1.0), C, FORCE)
    with pytest.raises(InputError, match="a contact is rigid"):
        all_motions(system, load, MotionSearch(omega_range=(0.5, 2.0)))
