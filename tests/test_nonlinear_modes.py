"""Nonlinear modes: published tables, conservative modes by quadrature, folds, energy, decay in time, the study and its page."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import quad
from study_texts import JENKINS, answered, study_of

from evidence.judges.free_decay import free_decay
from evidence.models.lumped import griffin, small_chain
from evidence.validation import case_nonlinear_modes
from stickslip.analyses.columns import record_of
from stickslip.analyses.nonlinear_mode.records import ModeRecord, NonlinearModes
from stickslip.analyses.nonlinear_mode.verdicts import case_verdicts
from stickslip.analyses.page import plots
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.iwan import Iwan, UniformBand
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.matrix_products import known_by_vectors
from stickslip.model.matrices import lumped
from stickslip.response.equilibrium import holding, opening
from stickslip.response.nonlinear_modes import Backbone, ModeSweep, nonlinear_mode
from stickslip.response.nonlinear_modes.backbone import _begun_anew
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.curve import at_amplitude, slip_amplitude
from stickslip.response.self_excited.modes import stuck_modes
from stickslip.response.self_excited.problem import self_excited_motions
from stickslip.response.system import System
from stickslip.study.check import check_study
from stickslip.study.store.journal import JobJournal
from stickslip.study.store.netcdf import one_case
from stickslip.study.store.progress import Interrupted


def one_mass(law: object, row: int, stiffness: float = 1.0) -> tuple[System, HarmonicLoad]:
    gap = np.zeros((3, 1))
    gap[row, 0] = 1.0
    contacts = Interface(("c",), (law,), gap)
    return System(lumped(np.eye(1), stiffness * np.eye(1)), contacts, np.array([0])), HarmonicLoad(np.zeros(1))


def followed(system: System, load: HarmonicLoad, how: Discretisation, sweep: ModeSweep) -> Backbone:
    mode = stuck_modes(system, 1, holding(system, load.static))[0]
    return nonlinear_mode(system, load, mode, int(system.outputs[0]), how, sweep)


def period(potential, low: float, high: float) -> float:
    """Return the period of one mass of 1 kg between two turning points by quadrature."""
    energy = potential(high)

    def integrand(angle: float) -> float:
        x = 0.5 * (high + low) + 0.5 * (high - low) * np.sin(angle)
        return 0.5 * (high - low) * np.cos(angle) / np.sqrt(2.0 * (energy - potential(x)))

    return 2.0 * quad(integrand, -np.pi / 2, np.pi / 2, epsabs=1e-12, limit=400)[0]


def test_the_table_of_one_mass_on_a_friction_spring():
    records = case_nonlinear_modes.one_mass()
    assert len(records) == 30
    assert all(record["holds"] for record in records)


def test_a_model_without_dimensions_slips_beyond_one():
    how, sweep = Discretisation(order=3), ModeSweep(points=8)
    found = [followed(*one_mass(Jenkins(k_t=0.5, limit=limit), 0), how, sweep) for limit in (1e-3, 10.0)]
    small, large = (backbone.points for backbone in found)
    top_small, top_large = (max(points, key=lambda p: p.ratio) for points in (small, large))
    assert top_large.amplitude == pytest.approx(1e4 * top_small.amplitude, rel=0.3)
    assert top_large.ratio == pytest.approx(top_small.ratio, rel=0.02)
    assert large[-1].slipping == small[-1].slipping == 1.0
    pressed = UnilateralSpring(k_n=1.0, preload=5.0)
    assert opening((pressed, Jenkins(k_t=1.0, limit=5.0))).tolist() == [True, False]


def test_rows_of_the_rubbing_beam_with_21_harmonics(monkeypatch):
    monkeypatch.setattr(case_nonlinear_modes, "BEGINNINGS", 2)
    records = case_nonlinear_modes.rub(21, 2048, case_nonlinear_modes.MANY[2:], reduced=True)
    for record in records[::2]:
        assert record["ours"] == pytest.approx(record["reference"], rel=3e-7)


def test_a_conservative_mode_needs_no_dummy_load():
    """A mass on a cubic spring: the frequency is that of an elliptic integral, and there is no damping."""
    system, load = one_mass(CubicSpring(cubic_t=0.5), 0)
    found = followed(system, load, Discretisation(order=15, samples=256), ModeSweep(span=(1e-3, 3.0), points=10))
    assert found.end == "amplitude reached"
    for point in found.points:
        top = float(np.sum(point.coefficients[:, 0]).real)
        exact = period(lambda x: 0.5 * x**2 + 0.125 * x**4, -top, top)
        assert point.omega == pytest.approx(2.0 * np.pi / exact, rel=1e-9)
        assert abs(point.ratio) < 1e-10
        assert point.modal_amplitude == pytest.approx(point.amplitude, rel=1e-12)
    # energy: of a linear spring the whole, here less than that since the spring hardens
    assert found.points[0].energy == pytest.approx(0.5 * found.points[0].amplitude ** 2, rel=1e-4)


def test_a_one_sided_spring_has_a_mean_and_the_frequency_of_two_arcs():
    """A stop half way: to one side an arc about zero, beyond the gap one about where both springs are in balance."""
    gap, k = 0.4, 3.0
    system, load = one_mass(UnilateralSpring(k_n=k, initial_gap=gap), 2)
    found = followed(system, load, Discretisation(order=41, samples=1024), ModeSweep(span=(0.1, 1.2), points=8))
    time = np.linspace(0.0, 2.0 * np.pi, 20001)
    for point in found.points:
        if point.amplitude < gap:
            assert point.omega == pytest.approx(1.0, rel=1e-9)
            continue
        x = np.real(np.exp(1j * np.outer(time, np.arange(42))) @ point.coefficients[:, 0])
        far = float(x.max())  # a normal gap that closes is negative
        centre, fast = k * gap / (1.0 + k), np.sqrt(1.0 + k)
        beyond = np.arctan(fast * np.sqrt(far**2 - gap**2) / fast**2 / (gap - centre))
        exact = 2.0 * (np.pi - np.arccos(gap / far)) + 2.0 * beyond / fast
        assert point.omega == pytest.approx(2.0 * np.pi / exact, rel=1e-6)
        assert point.open_for > 0.3
    assert abs(found.points[-1].coefficients[0, 0]) > 0.1


def test_slip_begins_where_the_motion_slips_and_not_where_a_slider_shakes_down():
    """A static force beyond the limit leaves the slider on it; about another mean the mass sticks up to twice the limit over the spring."""
    system, _ = griffin(0.1)
    load = HarmonicLoad(np.array([1.0]))
    mode = stuck_modes(system, 1, holding(system, load.static))[0]
    problem = self_excited_motions(system, load, mode, 0, Discretisation(order=3))
    assert slip_amplitude(problem) == pytest.approx(0.2, rel=0.03)


@pytest.mark.parametrize("kind", ["structural damping", "Coriolis forces"])
def test_the_slope_by_a_mass_damping_is_that_of_differences_where_the_interior_is_not_diagonal(kind):
    rng = np.random.default_rng(4)
    chain = small_chain()
    body, skew = chain.structure, 0.3 * rng.standard_normal((20, 20))
    other = (
        {"loss": 0.02 * body.stiffness} if kind == "structural damping" else {"damping": body.damping + skew - skew.T}
    )
    chain = replace(chain, structure=replace(body, **other))
    how = Discretisation(order=3)
    plain = self_excited_motions(chain, HarmonicLoad(np.zeros(20)), stuck_modes(chain, 1)[0], 19, how).balance
    assert known_by_vectors(plain.linear) is None
    x = rng.standard_normal(plain.size)
    for rate in (0.0, -0.3):
        linears = [plain.linear.with_mass_damping(rate + d) for d in (-1e-4, 0.0, 1e-4)]
        before, _, after = (replace(plain, linear=own).linear_residual(x, 7.0) for own in linears)
        slope = replace(plain, linear=linears[1]).by_mass_damping(x, 7.0, lambda h: body.of_harmonic(h).mass)
        np.testing.assert_allclose(slope, (after - before) / 2e-4, rtol=0, atol=1e-7 * np.max(np.abs(slope)))


def test_residuals_without_condensed_matrices_are_those_with_them():
    """Trials of a corrector are evaluated by products with vectors; damping by mass adds the same force either way."""
    rng = np.random.default_rng(4)
    chain = small_chain()
    mode = stuck_modes(chain, 1)[0]
    how = Discretisation(order=3)
    static = HarmonicLoad(rng.standard_normal(20))
    plain = self_excited_motions(chain, static, mode, 19, how).balance
    linear, interior = plain.linear, plain.linear.interior.size
    assert interior > 0
    assert known_by_vectors(linear) is linear
    x = rng.standard_normal(plain.size)
    for rate in (0.0, -0.3):
        balance = replace(plain, linear=linear.with_mass_damping(rate))
        period = balance.forces(x, 7.0)
        whole = balance.linearise(x, 7.0, period).residual
        size = np.max(np.abs(whole))
        np.testing.assert_allclose(balance.residual(x, 7.0, period), whole, rtol=0, atol=1e-12 * size)
        # the force is no straight line in the rate: the interior is damped too
        ends = [
            replace(plain, linear=linear.with_mass_damping(rate + d)).linear_residual(x, 7.0) for d in (-1e-4, 1e-4)
        ]
        slope = balance.by_mass_damping(x, 7.0, lambda h: chain.structure.of_harmonic(h).mass)
        np.testing.assert_allclose(slope, (ends[1] - ends[0]) / 2e-4, rtol=0, atol=1e-7 * np.max(np.abs(slope)))


def test_harmonics_are_raised_until_frequency_and_damping_stay():
    system, load = griffin(0.1)
    load = HarmonicLoad(load.static)
    sweep = ModeSweep(span=(0.15, 1.0), points=8, most_harmonics=31, tolerance=1e-4)
    raised = followed(system, load, Discretisation(order=1), sweep)
    orders = {p.order for p in raised.points}
    assert min(orders) == 1
    assert max(orders) > 3
    many = self_excited_motions(system, load, raised.mode, 0, Discretisation(order=61, samples=1024))
    for point in raised.points:
        exact = at_amplitude(many, point.amplitude)
        assert exact.converged
        assert point.omega == pytest.approx(exact.omega, rel=sweep.tolerance)
        assert point.ratio == pytest.approx(exact.level, rel=sweep.tolerance)


def test_all_four_folds_of_a_mode_in_resonance_with_another_are_followed():
    system, load = small_chain(), HarmonicLoad(np.zeros(20))
    mode = stuck_modes(system, 1)[0]
    sweep = ModeSweep(span=(0.12 * abs(mode.shape[19]), 4.0 * abs(mode.shape[19])), points=15)
    how = Discretisation(order=5, samples=256, evaluator="intervals")
    found = nonlinear_mode(system, load, mode, 19, how, sweep)
    log = np.log10([p.modal_amplitude for p in found.solutions])
    turned = log[1:-1][np.diff(np.sign(np.diff(log))) != 0]
    # folds of an independent program
    assert turned == pytest.approx([-0.7325, -0.8143, -0.5227, -0.5708], abs=0.03)
    # gross slip: every slider has slipped
    assert found.solutions[-1].slipping == 1.0
    assert "gross slip from" in found.end


def test_a_point_counts_as_begun_anew_where_it_leaps_ahead_of_all_others():
    """Behind a fold the farthest point is not the last one."""
    way = ((0.0, 0.1), (1.5, 0.4), (3.0, 0.4), (2.0, 0.4), (4.0, 0.1), (4.25, 0.1), (4.26, 0.1), (4.5, 0.4))
    found = [SimpleNamespace(p=p, converged=True, point=SimpleNamespace(step=step)) for p, step in way]
    assert _begun_anew(found, SimpleNamespace(gap=1.0, last=9.0), 0.1) == 2


def test_a_mode_ends_at_gross_slip_where_that_is_asked():
    system, load = griffin(0.1)
    found = followed(system, HarmonicLoad(load.static), Discretisation(order=3), ModeSweep(to_gross_slip=True))
    told = re.match(r"gross slip at ([\d.]+) mm", found.end)
    assert told
    assert 200.0 <= float(told[1]) < 300.0  # the slider lets go at 0.2 m
    assert [p.slipping for p in found.points[-2:]] == [0.0, 1.0]


def test_gross_slip_of_several_sliders_is_that_of_the_last_of_them():
    """Twenty sliders that slip from 0.01 to 0.39 m on, beside one that never does."""
    law = Iwan(k_t=0.5, limit=0.09, population=UniformBand(elastic_share=0.1))
    sweep = ModeSweep(to_gross_slip=True)
    found = followed(*one_mass(law, 0), Discretisation(order=3), sweep)
    assert found.end.startswith("gross slip at ")
    before, last = found.points[-2:]
    assert [p.slipping for p in found.points[:1]] == [0.0]
    assert before.slipping in np.arange(1, 20) / 20
    assert before.sticking == pytest.approx(1.0 - before.slipping)
    assert (last.slipping, last.sticking) == (1.0, 0.0)
    travels = [0.5 * np.ptp(_history(p)) for p in (before, last)]
    assert travels[0] < 0.39 < travels[1]


def _history(point) -> np.ndarray:
    time = np.linspace(0.0, 2.0 * np.pi, 2001)
    order = np.arange(len(point.coefficients))
    return np.real(np.exp(1j * np.outer(time, order)) @ point.coefficients[:, 0])


def test_springs_that_do_not_slip_need_a_range_of_amplitudes(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no contact slips or opens"):
        followed(*one_mass(CubicSpring(cubic_t=0.5), 0), Discretisation(order=3), ModeSweep())
    old = STUDY[STUDY.index('law = "jenkins"') : STUDY.index("[load.shaker]")]
    text = STUDY.replace(old, 'law = "cubic_spring"\ncubic_tangential_n_per_m3 = 0.5\n')
    text = text.replace("amplitude_mm = [100.0, 2000.0]\n", "")
    with pytest.raises(InputError, match=r"nonlinear_mode\.amplitude_mm"):
        check_study(study_of(text, tmp_path))


def test_both_concepts_agree_as_the_square_of_the_damping():
    def worst(stiffness: float) -> float:
        gap = np.zeros((3, 1))
        gap[0, 0] = 1.0
        friction = Interface(("d",), (Jenkins(k_t=stiffness, limit=0.2 * stiffness),), gap)
        system = System(lumped(np.eye(1), np.eye(1)), friction, np.array([0]))
        each = [
            followed(
                system,
                HarmonicLoad(np.zeros(1)),
                Discretisation(order=5),
                ModeSweep(span=(0.1, 2.0), points=4, concept=concept),
            )
            for concept in ("periodic", "decaying")
        ]
        (w, z), (v, y) = (np.array([(p.omega, p.ratio) for p in e.solutions]).T for e in each)
        assert (w[0], z[0]) == pytest.approx((v[0], y[0]), abs=1e-12)
        assert z.max() > 0.05 * stiffness
        last = abs(w[-1] / v[-1] - 1.0)
        assert abs(z[-1] / y[-1] - 1.0) < 0.1 * stiffness
        return last

    assert worst(0.02) < 0.02 * worst(0.2)


def test_a_decaying_motion_is_that_of_the_eigenvalue_however_it_is_damped():
    """Two masses, one of them damped strongly: no damping in proportion to the mass makes that a steady motion, but it decays as the eigenvalue says."""
    gap = np.zeros((3, 2))
    gap[0, 0] = 1.0
    stiffness, damping = np.array([[2.0, -1.0], [-1.0, 1.0]]), np.diag([0.0, 0.5])
    system = System(
        lumped(np.eye(2), stiffness, damping), Interface(("d",), (Jenkins(k_t=0.5, limit=0.1),), gap), np.array([1])
    )
    stuck = stiffness + np.diag([0.5, 0.0])
    values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-stuck, -damping]]))
    slowest = min(values[values.imag > 0], key=abs)
    sweep = ModeSweep(span=(1e-3, 2e-3), points=2, concept="decaying")
    point = followed(system, HarmonicLoad(np.zeros(2)), Discretisation(order=3), sweep).points[-1]
    assert point.omega == pytest.approx(abs(slowest), rel=1e-10)
    assert point.ratio == pytest.approx(-slowest.real / abs(slowest), rel=1e-9)
    steady = followed(
        system, HarmonicLoad(np.zeros(2)), Discretisation(order=3), replace(sweep, concept="periodic")
    ).points[-1]
    assert abs(steady.ratio / point.ratio - 1.0) > 1e-3


def test_a_free_motion_decays_as_the_mode_says():
    """In time, by a program of its own: period after period of a mass that rubs lightly."""
    stiffness, slips = 0.0125, 0.2
    limits = np.array([slips * stiffness])
    decay = free_decay(np.eye(1), np.zeros((1, 1)), np.array([stiffness]), limits, np.array([1.5]), 25, 400)
    gap = np.zeros((3, 1))
    gap[0, 0] = 1.0
    friction = Interface(("d",), (Jenkins(k_t=stiffness, limit=limits[0]),), gap)
    system = System(lumped(np.eye(1), np.eye(1)), friction, np.array([0]))
    for concept in ("periodic", "decaying"):
        sweep = ModeSweep(span=(0.3, 2.0), points=60, concept=concept)
        found = followed(system, HarmonicLoad(np.zeros(1)), Discretisation(order=5), sweep)
        a, w, z = np.array([(p.amplitude, p.omega, p.ratio) for p in found.solutions]).T
        assert decay.omega == pytest.approx(np.interp(decay.amplitude, a, w), rel=1e-5)
        assert decay.ratio == pytest.approx(np.interp(decay.amplitude, a, z), rel=2e-3)
    assert decay.amplitude[-1] < 0.9 * decay.amplitude[0]


STUDY = f"""{JENKINS}[forced_response]
frequency_hz = [0.15, 0.2]
points = 15
stability = "off"
[nonlinear_mode]
amplitude_mm = [100.0, 2000.0]
points = 10
"""


def test_the_mode_from_a_study_its_words_and_its_backbone_over_the_response(tmp_path: Path) -> None:
    outcome = answered(STUDY, tmp_path)
    case = one_case(outcome.tree["nonlinear_mode"].to_dataset(), 0)
    assert case["mode_frequency_hz"].values == pytest.approx(np.sqrt(1.5) / (2 * np.pi), rel=1e-9)
    assert 0.2 < float(case["gross_slip_amplitude"][0]) < 0.3
    assert float(case["largest_damping_ratio"][0]) == pytest.approx(0.0738, rel=0.01)
    told = outcome.summaries["nonlinear_mode"][0]
    assert "mm on" in told.rows[0][-1].partition("gross slip from ")[2]
    said = [v for v in outcome.verdicts if "largest damping" in v.why]
    assert [v.level for v in said] == ["trusted"]
    assert "mode 1 followed from 100 to 2000 mm: the largest damping ratio is 7.3" in said[0].why
    figures = plots(outcome.tree)
    assert {
        "nonlinear_mode_frequency",
        "nonlinear_mode_damping",
        "nonlinear_mode_energy",
        "nonlinear_mode_energy_damping",
        "backbones",
    } <= set(figures)
    response, backbone = figures["backbones"].data
    top = int(np.nanargmax(response.y))
    order = np.argsort(backbone.y)
    at_peak = np.interp(response.y[top], np.array(backbone.y)[order], np.array(backbone.x)[order])
    assert response.x[top] == pytest.approx(at_peak, rel=0.01)


def test_a_run_that_is_stopped_goes_on_inside_a_mode(tmp_path: Path, monkeypatch) -> None:
    """Every solve is on the disk before the next one: a run that was stopped has the bits of one that was not."""
    alone = STUDY.replace(STUDY[STUDY.index("[forced_response]") : STUDY.index("[nonlinear_mode]")], "").replace(
        "points = 10", "points = 5"
    )
    add, kinds = JobJournal.add, list[str]()

    def run(folder: str, stop: int) -> xr.Dataset:
        kinds.clear()

        def add_until(journal: JobJournal, record: ModeRecord) -> None:
            if len(kinds) == stop:
                raise Interrupted("stopped")
            kinds.append(record.kind)
            add(journal, record)

        monkeypatch.setattr(JobJournal, "add", add_until)
        return answered(alone, tmp_path / folder).tree["nonlinear_mode"].to_dataset()

    whole = run("whole", 1000)
    every = list(kinds)
    assert every[-1] == "end"
    assert "audit" in every
    with pytest.raises(Interrupted):
        run("stopped", 7)
    resumed = run("stopped", 1000)
    assert kinds == every[7:]
    for name in whole:
        np.testing.assert_array_equal(resumed[name].values, whole[name].values)


def test_what_has_no_such_mode_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no such mode"):
        answered(STUDY.replace("points = 10", "modes = [2]"), tmp_path)


def case_of(end: str, status: list[int], change: list[float], problem: str = "") -> dict[str, xr.Variable]:
    words = {"end": end, "problem": problem, "mode": 1, "wave_number": -1, "accuracy": 1e-3}
    words |= {"largest_damping_ratio": 0.05, "largest_damping_amplitude": 0.002}
    case = {name: xr.Variable(("branch",), [value]) for name, value in words.items()}
    amplitude = np.where(np.array(status) == 0, 1e-3 * np.arange(1, len(status) + 1), np.nan)
    along = {"status": status, "change": change, "amplitude": amplitude}
    return case | {name: xr.Variable(("branch", "point"), [own]) for name, own in along.items()}


@pytest.mark.parametrize(
    ("end", "status", "change", "level", "words"),
    [
        (
            "amplitude reached",
            [0, 0, -1],
            [1e-4, 1e-4, np.nan],
            "trusted",
            "mode 1 followed from 1 to 2 mm: the largest damping ratio is 5 % at 2 mm, an end of the range: it may be larger beyond",
        ),
        ("amplitude reached", [0, 0], [1e-4, 2e-3], "doubtful", "1 of its 2 motions still change by up to 0.2 %"),
        ("amplitude reached", [0, 0], [np.nan, np.nan], "doubtful", "one set of harmonics alone"),
        ("amplitude reached", [0, 2, 0], [0.0, np.nan, 0.0], "doubtful", "1 of its points are no motions"),
        ("lost at 1 m after 2 points", [0, 2], [0.0, np.nan], "doubtful", "mode 1: lost at 1 m"),
        ("lift-off ends it at 1 m", [0, 2], [0.0, np.nan], "trusted", "lift-off ends it"),
    ],
)
def test_what_is_to_be_thought_of_a_mode(end, status, change, level, words):
    found = case_verdicts("", record_of(NonlinearModes, case_of(end, status, change)))
    assert {v.level for v in found} == {level}
    assert words in found[0].why
