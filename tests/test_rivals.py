"""The published ways of choosing harmonics: their formulas against a plain twin, and the failings they are known for."""

import re
import subprocess
import sys
from dataclasses import fields, replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from models import SAMPLES, analyse, basis, solved, table, twin

from evidence.models.lumped import blades_and_damper, griffin
from evidence.strategies.cases import SelectionCase
from evidence.strategies.compare import compared
from evidence.strategies.page import page
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.grolet import Grolet
from stickslip.harmonic.selection.jaumouille import Jaumouille, strain_energy
from stickslip.harmonic.selection.laxalde import Laxalde, left_out
from stickslip.harmonic.selection.maple import Maple
from stickslip.harmonic.selection.strategy import ErrorMeasure, Step, always_kept
from stickslip.harmonic.selection.suess_jacobian import SuessJacobian, column_norms
from stickslip.harmonic.selection.suess_spectral import SuessSpectral
from stickslip.harmonic.strategies import FIXED, OPTIONS, STRATEGIES, VERIFYING, options_of
from stickslip.harmonic.travelling import condense_waves
from stickslip.model.structure import Structure
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.solve.newton_method import Newton

HZ = 2 * np.pi
ORDER = 5
RIVALS = (Laxalde, Jaumouille, Maple, Grolet, SuessSpectral, SuessJacobian)
FORETELLING = (Laxalde, Grolet, SuessSpectral, SuessJacobian)  # never solve a frequency again


# ---- a plain twin of the periodic problem --------------------------------------------------------------------------------


@cache
def step_at(hertz=161.0, harmonics=(0, 1), ahead=1.5, reference=ORDER):
    """The blades and their damper where it slips and lifts off, solved with few harmonics."""
    system, load = blades_and_damper()
    omega = hertz * HZ
    balance, solution = solved(system, load, omega, harmonics)
    measure = ErrorMeasure(np.arange(4))
    return Step(
        balance, balance.with_harmonics(harmonics_of(reference)), (0, 1), solution.x, omega, omega + ahead * HZ, measure
    )


def real_rows(coefficients):
    """(2 ORDER + 1, n) rows 1, cos, sin, ... of Re(Q exp(ihωt))."""
    rows = np.zeros((2 * ORDER + 1, coefficients.shape[1]))
    rows[0] = coefficients[0].real
    for h in range(1, len(coefficients)):
        rows[2 * h - 1], rows[2 * h] = coefficients[h].real, -coefficients[h].imag
    return rows


def forces(gap_rows):
    """(2, 3, SAMPLES) contact forces of (2 ORDER + 1, 6) gap coefficients, marched sample by sample."""
    system, _ = blades_and_damper()
    gaps = (basis(ORDER, SAMPLES) @ gap_rows).T.reshape(2, 3, SAMPLES)
    # across the plane nothing moves; the twin's slider divides by that stiffness
    laws = [replace(law, k_w=1.0) for law in system.interface.laws]
    return np.array([twin(g, law).force for g, law in zip(gaps, laws, strict=True)])


def residual(rows, omega):
    """(2 ORDER + 1, 6) equilibrium of all dofs in N, from the matrices."""
    system, load = blades_and_damper()
    s, gap = system.structure, system.interface.gap_operator.toarray()
    out = analyse(forces(rows @ gap.T), ORDER).reshape(6, -1).T @ gap
    out[0] += s.stiffness @ rows[0] - load.static
    for h in range(1, ORDER + 1):
        z = s.stiffness + 1j * h * omega * s.damping - (h * omega) ** 2 * s.mass
        force = z @ (rows[2 * h - 1] - 1j * rows[2 * h]) - load.harmonics.get(h, 0.0)
        out[2 * h - 1] += force.real
        out[2 * h] -= force.imag
    return out


def slopes(function, rows, size=1e-10):
    """Central differences of a function of rows, all outputs by all inputs."""
    columns = []
    for i in range(rows.size):
        aside = np.zeros(rows.size)
        aside[i] = size
        aside = aside.reshape(rows.shape)
        columns.append((function(rows + aside) - function(rows - aside)).reshape(-1) / (2 * size))
    return np.array(columns).T


@cache
def jacobian():
    """Of all rows, at the solution with harmonics 1 and 3, by differences."""
    step = step_at(harmonics=(0, 1, 3))
    return slopes(lambda r: residual(r, step.omega), rows_of_step(step))


def rows_of_step(step):
    return real_rows(step.balance.coefficients(step.x))


def share_by_hand(rows, h):
    """Eq. 10 of the gaps' coefficients."""
    gap = rows @ blades_and_damper()[0].interface.gap_operator.toarray().T
    total = sum(c**2 for c in gap[0])
    for k in range(1, ORDER + 1):
        total += sum(c**2 + s**2 for c, s in zip(gap[2 * k - 1], gap[2 * k], strict=True))
    own = [gap[0]] if h == 0 else [gap[2 * h - 1], gap[2 * h]]
    return sum(float(row @ row) for row in own) / total


def kept(rows, threshold):
    return tuple(h for h in range(ORDER + 1) if h < 2 or share_by_hand(rows, h) > threshold)


def test_the_twin_is_the_same_problem():
    step = step_at()
    high = step.reference
    own = high.linearise(high.unknowns(step.balance.coefficients(step.x)), step.omega).residual
    assert np.allclose(
        residual(rows_of_step(step), step.omega),
        own.reshape(-1, 6) * high.force_scale,
        rtol=0,
        atol=1e-9 * high.force_scale,
    )


def test_laxalde_measures_the_forces_left_out():
    """Eq. 8: the time signal less its first Fourier terms, by FFT."""
    step = step_at()
    signal = forces(rows_of_step(step) @ blades_and_damper()[0].interface.gap_operator.toarray().T)
    spectrum = np.fft.rfft(signal)
    left = []
    for h in range(ORDER + 1):
        few = spectrum.copy()
        few[..., h + 1 :] = 0.0
        left.append(np.abs(signal - np.fft.irfft(few, SAMPLES)).sum())
    expected = np.array(left) / left[0]
    assert np.allclose(left_out(step), expected, rtol=1e-9)
    for h in range(1, ORDER + 1):  # a threshold a little above keeps up to h
        verdict = Laxalde(threshold=expected[h] * 1.001).judge(step)
        assert verdict.again is None
        assert verdict.indicator == pytest.approx(expected[1], rel=1e-9)
        assert verdict.following == tuple(range(h + 1))
    assert Laxalde(threshold=0.0).judge(step).following == tuple(range(ORDER + 1))


def test_jaumouille_compares_strain_energies():
    """Eq. 9: ½ xᵀ K x over the samples of a period, with one harmonic and with two."""
    system, _ = blades_and_damper()
    one, two = step_at(), step_at(harmonics=(0, 1, 2))

    def energy(step):
        x = basis(ORDER, SAMPLES) @ rows_of_step(step)
        return 0.5 * np.einsum("ti,ij,tj->t", x, system.structure.stiffness, x).mean()

    assert strain_energy(one) == pytest.approx(energy(one), rel=1e-12)
    expected = abs(energy(one) - energy(two)) / energy(one)
    first = Jaumouille(threshold=0.9 * expected).judge(one)
    assert np.isnan(first.indicator)
    assert first.again == (0, 1, 2)
    for share, again in ((0.9, (0, 1, 2, 3)), (1.1, None)):
        verdict = Jaumouille(threshold=share * expected).judge(replace(two, before=one))
        assert verdict.indicator == pytest.approx(expected, rel=1e-9)
        assert verdict.again == again
        assert verdict.following == (0, 1)


def test_maple_looks_at_the_last_harmonic():
    """Eq. 10."""
    step = step_at(harmonics=(0, 1, 2, 3))
    expected = share_by_hand(rows_of_step(step), 3)
    for share, again in ((0.9, (0, 1, 2, 3, 4)), (1.1, None)):
        verdict = Maple(threshold=share * expected).judge(step)
        assert verdict.indicator == pytest.approx(expected, rel=1e-9)
        assert verdict.again == again
        assert verdict.following == (0, 1, 2, 3)
    full = step_at(harmonics=tuple(range(ORDER + 1)))
    assert Maple(threshold=0.0).judge(full).again is None, "there is none above the reference"


def test_grolet_foretells_along_the_tangent():
    """Eq. 11, 12 with derivatives by differences."""
    step = step_at(harmonics=(0, 1, 3))
    rows, size = rows_of_step(step), 1e-4
    by_omega = residual(rows, step.omega + size) - residual(rows, step.omega - size)
    right = -by_omega.reshape(-1) / (2 * size) * (step.next_omega - step.omega)
    ahead = rows + np.linalg.solve(jacobian(), right).reshape(rows.shape)
    expected = {h: share_by_hand(ahead, h) for h in range(ORDER + 1)}
    for threshold in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        verdict = Grolet(threshold=threshold).judge(step)
        assert verdict.again is None
        # differences of forces of 100 N in steps of 3e-5 N
        assert verdict.indicator == pytest.approx(max(expected[h] for h in (2, 4, 5)), rel=1e-4)
        assert verdict.following == kept(ahead, threshold)


@pytest.mark.parametrize("frozen", [False, True])
def test_suess_adds_the_missing_harmonics_alone(frozen):
    """Eq. 26 with the block of the Jacobian, eq. 14 with that of the structure."""
    step = step_at(harmonics=(0, 1, 3))
    rows = rows_of_step(step)
    missing = [3, 4, 7, 8, 9, 10]  # rows of harmonics 2, 4, 5
    own = np.concatenate([np.arange(6) + 6 * row for row in missing])
    s = blades_and_damper()[0].structure
    if frozen:
        jac = np.zeros((rows.size, rows.size))
        for h in (2, 4, 5):
            w = h * step.omega
            z, c = s.stiffness - w**2 * s.mass, w * s.damping
            at = 6 * (2 * h - 1)
            jac[at : at + 12, at : at + 12] = np.block([[z, c], [-c, z]])
    else:
        jac = jacobian()
    r = residual(rows, step.omega).reshape(-1)
    more = rows.copy()
    more[missing] = np.linalg.solve(jac[np.ix_(own, own)], -r[own]).reshape(-1, 6)
    expected = max(share_by_hand(more, h) for h in (2, 4, 5))
    for threshold in (1e-6, 1e-4, 1e-3, 1e-2, 1e-1):
        verdict = SuessSpectral(threshold=threshold, frozen=frozen).judge(step)
        assert verdict.again is None
        assert verdict.indicator == pytest.approx(expected, rel=1e-4)
        assert verdict.following == kept(more, threshold)


def test_suess_measures_columns_of_the_contact_jacobian():
    step = step_at()
    gap = rows_of_step(step) @ blades_and_damper()[0].interface.gap_operator.toarray().T
    jac = slopes(lambda g: analyse(forces(g), ORDER).reshape(6, -1).T, gap)
    harmonic = np.repeat((np.arange(2 * ORDER + 1) + 1) // 2, 6)
    expected = []
    for z in range(ORDER + 1):
        column = jac[:, harmonic == z]
        others = (harmonic != z) & (harmonic > 0)
        expected.append(np.linalg.norm(column[others]) / np.linalg.norm(column[harmonic == z]))
    assert np.allclose(column_norms(step), expected, rtol=1e-5)
    for threshold in (0.5, 1.0, 1.2, 1.5, 2.0):
        following = SuessJacobian(threshold=threshold).judge(step).following
        assert following == tuple(h for h in range(ORDER + 1) if h < 2 or expected[h] > threshold)


def test_nothing_couples_in_full_stick():
    step = step_at(hertz=170.0)
    assert column_norms(step)[1:].max() < 1e-12
    for made in FORETELLING:
        verdict = made().judge(step)
        assert verdict.indicator < 1e-12
        assert verdict.following == (0, 1)


# ---- strain energy -------------------------------------------------------------------------------------------------------


def in_time(coefficients, matrix):
    """½ xᵀ K x, mean over a period, of the real part of a motion in many samples."""
    turn = np.exp(2j * np.pi * np.outer(np.arange(16) / 16, np.arange(len(coefficients))))
    x = (turn @ coefficients).real
    return 0.5 * np.einsum("ti,ij,tj->t", x, matrix, x).mean()


@pytest.mark.parametrize("damping", ["proportional", "general", "gyroscopic"])
def test_strain_energy_of_a_condensed_structure_is_that_of_all_dofs(damping):
    rng = np.random.default_rng(3)
    a, b, c = rng.standard_normal((3, 6, 6))
    stiffness, mass = a @ a.T + 3 * np.eye(6), b @ b.T + 3 * np.eye(6)
    own = {"proportional": 0.1 * stiffness, "general": 0.1 * c @ c.T, "gyroscopic": 0.1 * c @ c.T + c - c.T}
    structure = Structure(mass, own[damping], stiffness, table(tuple("abcdef")))
    load = HarmonicLoad(rng.standard_normal(6), {1: rng.standard_normal(6) + 1j})
    linear = condense(structure, np.array([1, 4]), load)
    q = rng.standard_normal((4, 2)) + 1j * rng.standard_normal((4, 2))
    q[0] = q[0].real
    expected = in_time(linear.recover(0.7, q), stiffness)
    assert linear.strain_energy(0.7, q).sum() == pytest.approx(expected, rel=1e-10)
    waves = condense_waves((structure,) * 4, np.array([1, 4]), load)
    assert waves.strain_energy(0.7, q) == pytest.approx(linear.strain_energy(0.7, q), rel=1e-10)


# ---- what every strategy keeps to ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(STRATEGIES))
def test_what_a_study_file_is_judged_by_is_what_the_strategy_says(name):
    found = strategy_named(name)
    own = {field.name for field in fields(found)}
    assert (name in VERIFYING) == found.verifies
    assert (name in FIXED) == (always_kept(found) is not None)
    assert options_of(name) == tuple(option for option in OPTIONS if option in own)


@pytest.mark.parametrize("name", sorted(STRATEGIES))
@pytest.mark.parametrize("reference", [5, (1, 3, 5)])
def test_supports_stay_between_the_smallest_and_the_reference(name, reference):
    for hertz in (150.0, 160.5, 161.0):
        for harmonics in ((0, 1), (0, 1, 3)):
            step = step_at(hertz=hertz, harmonics=harmonics, reference=reference)
            verdict = strategy_named(name).judge(step)
            for found in (verdict.again or (0, 1), verdict.following):
                assert set(step.smallest) <= set(found) <= set(step.reference.harmonics)
                assert list(found) == sorted(set(found))


@pytest.mark.parametrize("made", RIVALS)
def test_rivals_take_the_single_passage_and_keep_their_own_threshold(made):
    name = next(n for n, c in STRATEGIES.items() if c[1] == made.__name__)
    sweep = Sweep(omega_range=(1.0, 2.0), selection=name, threshold=0.3)
    assert sweep.single
    assert sweep.strategy == made()


# ---- through the frequencies ---------------------------------------------------------------------------------------------


def response(system, load, hertz, frequencies, selection, **options):
    sweep = Sweep(
        omega_range=(hertz[0] * HZ, hertz[1] * HZ),
        frequencies=frequencies,
        selection=selection,
        samples=SAMPLES,
        peak_points=0,
        **{"passages": "single", "high": 5, **options},
    )
    points = list(forced_response(system, load, sweep))
    return forced_problem(system, load, sweep), points


def errors(system, load, hertz, frequencies, selection, **options):
    """Harmonics and true error of each frequency."""
    problem, points = response(system, load, hertz, frequencies, selection, **options)
    _, exact = response(system, load, hertz, frequencies, "always_high")
    mine = accepted_points(points)
    assert all(p.converged for p in [*mine, *exact])
    pairs = zip(mine, exact, strict=True)
    return [p.support for p in mine], np.array([problem.real_error(p, r) for p, r in pairs])


# about a third of the resonance: the third harmonic resonates, the even ones vanish
SUPERHARMONIC = (0.33 / HZ, 0.42 / HZ)


@pytest.mark.parametrize("selection", [Jaumouille(threshold=1e-6), Maple(threshold=1e-12)])
def test_premature_stop(selection):
    """However fine the threshold: harmonic 2 brings nothing, so that 3 is never tried (review of Grolet in section 3)."""
    system, load = griffin(0.03)
    supports, wrong = errors(system, load, SUPERHARMONIC, 7, selection)
    assert set(supports) == {(0, 1, 2)}
    assert wrong.max() > 0.2
    # what they miss, those with a reference support find
    supports, wrong = errors(system, load, SUPERHARMONIC, 7, "jacobian_alert")
    assert wrong.max() < 0.01
    assert (0, 1, 2, 3, 4, 5) in supports
    # and they too, if the increment is one of odd harmonics
    supports, wrong = errors(system, load, SUPERHARMONIC, 7, selection, high=(1, 3, 5))
    assert {3 in support for support in supports} == {True}
    assert wrong.max() < 0.01


def test_rattling():
    """A harmonic that is left out is foretold larger than it turns out once it is in (section 4.5.2, after Süß)."""
    system, load = blades_and_damper()
    supports, _ = errors(system, load, (159.5, 164.0), 19, SuessSpectral(threshold=0.01))
    has_third = [3 in support for support in supports]
    turns = sum(a != b for a, b in pairwise(has_third))
    assert turns >= 8
    # between two supports there is nothing to rattle: the alert goes in once and out once
    supports, _ = errors(system, load, (159.5, 164.0), 19, "jacobian_alert")
    assert sum(a != b for a, b in pairwise(supports)) == 2


@pytest.mark.parametrize("made", FORETELLING)
def test_lag_behind_a_sudden_change_of_contact_state(made):
    """155, 158, 161 Hz: stuck, stuck, slip with lift-off; the harmonics for 161 Hz were chosen at 158 Hz."""
    system, load = blades_and_damper()
    supports, wrong = errors(system, load, (155.0, 173.0), 7, made())
    assert supports[:3] == [(0, 1)] * 3
    assert wrong[2] > 0.1, "a wrong result is accepted"
    assert len(supports[3]) > 3, "the harmonics come one frequency late"
    assert wrong[3] < 0.01
    supports, wrong = errors(system, load, (155.0, 173.0), 7, "jacobian_alert")
    assert supports[2] == tuple(range(6))
    assert wrong.max() < 0.01


@pytest.mark.parametrize("made", FORETELLING)
def test_no_lag_where_a_frequency_is_repeated_until_it_has_what_it_foretells(made):
    """Section 4.5.3: with `repeats` 161 Hz is solved again at 161 Hz."""
    system, load = blades_and_damper()
    strategy = made(repeats=True)
    supports, wrong = errors(system, load, (155.0, 173.0), 7, strategy)
    assert supports[:2] == [(0, 1)] * 2, "nothing is repeated in stick"
    assert len(supports[2]) > 3
    assert wrong.max() < 0.01
    problem, points = response(system, load, (155.0, 173.0), 7, strategy)
    grid = sorted({p.omega for p in points})
    tried = [p for p in points if p.omega == grid[2]]
    foretold = [
        strategy.judge(
            problem.step(
                problem.balance(p.support), problem.balance(p.support).unknowns(p.coefficients), p.omega, grid[3]
            )
        ).following
        for p in tried
    ]
    for point, own, following in zip(tried, foretold, tried[1:], strict=False):
        assert following.support == tuple(sorted({*point.support, *own}))
        assert set(own) - set(point.support), "there was a reason to repeat it"
    assert len(tried) > 1
    assert set(foretold[-1]) <= set(tried[-1].support), "the last has all that it foretells"


def test_maple_never_drops_a_harmonic_and_laxalde_does():
    system, load = blades_and_damper()
    for made, last in ((Maple, 6), (Laxalde, 2)):
        supports, _ = errors(system, load, (155.0, 173.0), 13, made())
        assert max(len(s) for s in supports) >= 4
        assert len(supports[-1]) == last


# ---- single passage ------------------------------------------------------------------------------------------------------


def test_single_and_double_passage_accept_the_same_solutions():
    """Section 4.4: two orders of the same work."""
    system, load = blades_and_damper()
    found = {
        passages: accepted_points(response(system, load, (157.0, 166.0), 13, "jacobian_alert", passages=passages)[1])
        for passages in ("single", "double")
    }
    assert {len(p.support) for p in found["single"]} == {2, 6}
    for one, two in zip(*found.values(), strict=True):
        assert one.omega == two.omega
        assert one.support == two.support
        # from other starts to the same solution: Newton's tolerance over the softest direction
        size = np.abs(two.coefficients).max()
        assert np.allclose(one.coefficients, two.coefficients, rtol=0, atol=1e-6 * size)


SOME_FAIL = Newton(max_iterations=4)


@pytest.mark.parametrize(
    ("selection", "options"), [("jacobian_alert", {}), ("jaumouille", {}), ("grolet", {"newton": SOME_FAIL})]
)
def test_single_passage_goes_on_as_it_would_have(selection, options):
    case = (*blades_and_damper(), (158.0, 164.0), 7, selection)
    problem, points = response(*case, **options)
    assert len({p.index for p in points}) == 7
    for k in range(0, len(points) + 1, 3):
        rest = list(forced_response(*case[:2], problem.sweep, done=points[:k]))
        assert len(rest) == len(points) - k
        for a, b in zip(rest, points[k:], strict=True):
            assert (a.stage, a.index, a.omega, a.status) == (b.stage, b.index, b.omega, b.status)
            assert (a.support, a.iterations) == (b.support, b.iterations)
            assert np.array_equal(a.coefficients, b.coefficients)
            assert np.array_equal(a.asked, b.asked)
            assert np.array_equal(a.predicted_error, b.predicted_error, equal_nan=True)


@pytest.mark.parametrize("made", RIVALS)
def test_indicators_have_no_units(made):
    """The same blades in mm and N."""
    said = []
    for length in (1.0, 1000.0):
        system, load = blades_and_damper(length=length)
        steps = []
        for harmonics in ((0, 1), (0, 1, 2)):
            balance, solution = solved(system, load, 161.0 * HZ, harmonics)
            steps.append(
                Step(
                    balance,
                    balance.with_order(ORDER),
                    (0, 1),
                    solution.x,
                    161.0 * HZ,
                    162.0 * HZ,
                    ErrorMeasure(np.arange(4)),
                )
            )
        said.append(made().judge(replace(steps[1], before=steps[0])))
    assert said[0].following == said[1].following
    assert said[0].again == said[1].again
    # the residuals that Newton leaves
    assert said[0].indicator == pytest.approx(said[1].indicator, rel=1e-4)


# ---- one of one's own ----------------------------------------------------------------------------------------------------


def test_example_of_an_own_strategy():
    script = Path(__file__).parents[1] / "examples" / "own_strategy.py"
    ended = subprocess.run([sys.executable, "-W", "error", str(script)], capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    rows = re.findall(r"([\d.]+) Hz: ([\d.]+) m with harmonics (.*)", ended.stdout)
    for omega, amplitude in [(2.0 * np.pi * float(f), float(a)) for f, a, _ in rows[:4]]:
        # below 0.07 m the damper is a spring and nothing else; printed to four decimals
        exact = abs(0.1 / (1.5 - omega**2 + 0.02j * omega))
        assert amplitude == pytest.approx(exact, abs=6e-5)
    assert [kept for *_, kept in rows] == ["0, 1"] * 8 + ["0, 1, 3"] * 5


# ---- the comparison of all -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def comparison():
    system, load = griffin(0.03)
    hertz = (HZ * SUPERHARMONIC[0], HZ * SUPERHARMONIC[1])
    return compared(SelectionCase("mass", "a mass", system, load, hertz, 7, samples=SAMPLES))


def test_comparison_counts_what_a_sweep_shows(comparison):
    system, load = griffin(0.03)
    judge = forced_problem(
        system, load, Sweep(omega_range=comparison.case.omega_range, high=10, samples=SAMPLES, selection="always_low")
    )
    _, exact = response(system, load, SUPERHARMONIC, 7, "always_high", high=10)
    for selection in ("always_low", "jaumouille", "jacobian_alert", "always_high"):
        outcome = comparison.of(selection)
        _, points = response(system, load, SUPERHARMONIC, 7, selection, passages="double")
        last = {p.omega: p for p in points}  # repeats come last
        pairs = [(last[r.omega], r) for r in exact]
        found = np.array([judge.real_error(p, r) for p, r in pairs])
        top = int(np.argmax([abs(r.coefficients[1, 0]) for r in exact]))
        assert outcome.missed == int(np.sum(found > 0.05))
        assert outcome.at_peak == pytest.approx(found[top], rel=1e-3, abs=1e-9)
        assert outcome.unknowns == sum(2 * p.harmonics.size - 1 for p in points)
        assert outcome.iterations == sum(p.iterations for p in points)
        assert outcome.lost == 0


def test_page_has_a_row_for_every_strategy(comparison):
    text = page([comparison], "## Findings")
    for outcome in comparison.outcomes:
        assert f"| `{outcome.entry.selection}`" in text
    assert set(STRATEGIES) <= {o.entry.selection for o in comparison.outcomes}
