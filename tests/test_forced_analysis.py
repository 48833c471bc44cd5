"""The analysis of the forced response: its dataset against the library, resumption, what it warns of and what it refuses."""

import pickle
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from models import lifting, table
from newton_bounds import allowed, answer_at
from pydantic import ValidationError
from small_v2 import write_four_masses
from synthetic_result import tree_of

from stickslip.analyses.forced_response import analysis as analysis_module
from stickslip.analyses.forced_response.analysis import FORCED_RESPONSE
from stickslip.analyses.forced_response.estimate import estimate, retained_of
from stickslip.analyses.forced_response.page.checks import statistics_in_time
from stickslip.analyses.forced_response.page.response import Response
from stickslip.analyses.forced_response.physics.known import (
    mixed_places,
    no_resonance,
    nothing_pressed,
    off_engine_order,
)
from stickslip.analyses.forced_response.physics.model_change import peak_shift
from stickslip.analyses.forced_response.problem import Question, question_of, sweep_of
from stickslip.analyses.forced_response.table import ForcedResponse
from stickslip.analyses.forced_response.verdicts.curve import Curve
from stickslip.analyses.forced_response.verdicts.rules import twice_the_harmonics
from stickslip.analyses.page import plots
from stickslip.assembly.assembled import Assembled, ContactTable, Frequencies
from stickslip.assembly.contact import Contact
from stickslip.assembly.forces import Load
from stickslip.assembly.model import Model
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.rigid_coulomb import RigidCoulomb
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError, SingularError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.part import Part
from stickslip.model.structure import Structure
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.problem import forced_point
from stickslip.response.forced.response import ForcedPoint, Sweep, accepted_points, forced_problem, forced_response
from stickslip.response.recovery import damped_share, equivalent_damping, fields
from stickslip.response.system import System
from stickslip.solve.iterate import Iterate, Work
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, Solution, newton
from stickslip.solve.status import Rung, Status
from stickslip.study.analysis import Case, Solved
from stickslip.study.file.harmonics import Harmonics
from stickslip.study.models.study import read_study
from stickslip.study.outcome import case_variables
from stickslip.study.run import run_study
from stickslip.study.store.journal import JobJournal
from stickslip.units import HZ, RPM

pytestmark = pytest.mark.usefixtures("peak_alone")
NO_TIME = ("seconds", "attempt_seconds", "seconds_contact", "seconds_linear", "seconds_rest")


def question(system: System, load: HarmonicLoad, sweep: Sweep, **others: object) -> Question:
    """Return a question about a system of the tests."""
    n = system.interface.n_contacts
    contacts = ContactTable(
        system.interface.names,
        ("joint",) * n,
        ("elastic_coulomb",) * n,
        np.full((n, 3), np.nan),
        np.tile(np.eye(3), (n, 1, 1)),
        np.full(n, np.nan),
    )
    labels = tuple(f"out{i}.x" for i in range(len(system.outputs)))
    none, pressed = np.zeros((n, 3)), np.tile([0.0, 0.0, -1.0], (n, 1))
    force = max(float(np.abs(f).max()) for f in load.harmonics.values())
    model = Assembled(
        system,
        system,
        load,
        contacts,
        labels,
        0,
        labels,
        0.0,
        force,
        none,
        pressed,
        Frequencies(*(np.array([30.0, 50.0]),) * 4),
        None,
        1,
        None,
        {},
    )
    asked = {"label": "", "limit": 0.05} | others
    return Question(model=replace(model, **asked.pop("model", {})), sweep=sweep, **asked)  # type: ignore[arg-type]


@pytest.mark.parametrize("limit", [1e6, 0.5])
def test_equivalent_damping_is_that_of_a_linear_oscillator_and_counts_what_friction_takes(limit: float) -> None:
    """Mass 1 on springs 1 and 0.5, of which the second one sticks or slips, with a dashpot."""
    dashpot = 0.03
    structure = Structure(np.eye(1), dashpot * np.eye(1), np.eye(1), table(("a.x",)))
    law = ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=1.0, mu=0.5, preload=2.0 * limit)
    gap = np.array([[1.0], [0.0], [0.0]])
    system = System(structure, Interface(("1",), (law,), gap), np.array([0]))
    load = HarmonicLoad(np.zeros(1), {1: np.array([0.2 + 0j])})
    sweep = Sweep(omega_range=(0.8, 1.4), points=12, peak_points=6, high=5, selection="always_high")
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    top = max(points, key=lambda p: abs(p.coefficients[1, 0]))
    found, sticks = equivalent_damping(problem, top), limit > 1.0
    if sticks:  # ζ = c / 2√(km), where the frequency is that of resonance
        assert found == pytest.approx(dashpot / (2 * np.sqrt(1.5)), rel=5e-3)
        # what a ratio takes over what the load can give: 4πζ k|x|²/2 over πF|x|, everywhere
        for p in points:
            share = 2 * 1e-4 * 1.5 * abs(p.coefficients[1, 0]) / 0.2
            assert damped_share(problem, p, 1e-4) == pytest.approx(share, rel=1e-9)
    moved, energy = fields(problem, top).outputs[:, 0], fields(problem, top).energy.sum()
    h = np.arange(moved.size)
    lost = energy + np.pi * dashpot * top.omega * np.sum(h**2 * np.abs(moved) ** 2)
    assert (energy > 0.1 * lost) == (not sticks)
    # the largest energy beside the work: kinetic, which at a peak is all there is as the springs are relaxed
    kinetic = 0.5 * top.omega**2 * np.sum(h**2 * np.abs(moved) ** 2)
    assert found == pytest.approx(lost / (4 * np.pi * kinetic), rel=0.02 if sticks else 0.2)


def solved(asked: Question, done: int | None = None, first: Solved | None = None) -> Solved:
    """Solve a question, going on after `done` points of a first try."""
    asked = pickle.loads(pickle.dumps(asked))
    with JobJournal(Path(":memory:"), ForcedPoint) as journal:
        for point in () if first is None else first.records[:done]:
            journal.add(point)
        for point in FORCED_RESPONSE.solve(asked, journal.records(), journal):
            journal.add(point)
        case = Case(0, asked.label, {"x": 1.0} if asked.label else {}, None, None, "", Path())  # type: ignore[arg-type]
        return Solved(case, journal.records(), journal.notes())


def dataset(*each: Solved) -> xr.Dataset:
    """Return the dataset of cases, as the runner has it."""
    return FORCED_RESPONSE.dataset(each).assign(case_variables([s.case for s in each]))


def warnings_of(data: xr.Dataset) -> list[str]:
    return [v.sentence for v in FORCED_RESPONSE.verdicts(data) if v.told]


def rubbing() -> tuple[System, HarmonicLoad]:
    """Two masses in a row, the first of which rubs at two places against the ground, each with a limit of its own."""
    mass, stiffness = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]])
    gap = np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]] * 2)
    laws = tuple(ElasticCoulomb(k_t=0.5, k_w=0.0, k_n=1.0, mu=0.5, preload=n) for n in (1.0, 0.4))
    structure = Structure(mass, 0.02 * stiffness, stiffness, table(("a.x", "b.x")))
    system = System(structure, Interface(("1", "2"), laws, gap), np.array([0, 1]))
    return system, HarmonicLoad(np.zeros(2), {1: np.array([0.0, 0.06 + 0j])})


@pytest.fixture(scope="module")
def rubbed() -> tuple[Question, Solved]:
    """Their first resonance, at which one place slips."""
    system, load = rubbing()
    sweep = Sweep(omega_range=(0.6, 1.0), low=1, high=3, points=10, peak_points=3, samples=64)
    asked = question(system, load, sweep)
    return asked, solved(asked)


def test_dataset_holds_what_the_library_finds(rubbed: tuple[Question, Solved]) -> None:
    asked, found = rubbed
    data = dataset(found)
    system, load = asked.model.system, asked.model.load
    points = accepted_points(list(forced_response(system, load, asked.sweep)))
    problem = forced_problem(system, load, asked.sweep)
    assert data.sizes["point"] == len(points) == int(data.points[0])
    np.testing.assert_array_equal(data.frequency_hz, [p.omega / HZ for p in points])
    np.testing.assert_array_equal(data.order, [p.order for p in points])
    np.testing.assert_array_equal(data.unknowns, [2 * p.order + 1 for p in points])
    assert set(data.order.values) == {1, 3}
    for i, point in enumerate(points):
        own = fields(problem, point)
        for name, value in (("output_displacement", own.outputs), ("gap", own.gaps), ("contact_force", own.forces)):
            stored = data[name][i].values[..., 0] + 1j * data[name][i].values[..., 1]
            np.testing.assert_array_equal(stored[: point.order + 1], value)
            assert np.all(stored[point.order + 1 :] == 0.0)
        np.testing.assert_array_equal(data.dissipated_energy[i], own.energy)
        assert data.harmonic_kept[i].values.tolist() == [int(h <= point.order) for h in range(data.sizes["harmonic"])]
    top = int(np.argmax(data.amplitude[:, 0].values))
    assert int(data.peak_point[0]) == top
    assert float(data.peak_amplitude[0]) == data.amplitude[top, 0]
    assert set(np.unique(data.peak_state)) == {0, 1}
    assert data.contact_group.values.tolist() == ["joint", "joint"]
    assert data.attrs["failed"] == 0
    assert list(data.attrs["high_harmonics"]) == [0, 1, 2, 3]
    assert "speed_rpm" not in data
    assert "verify_case" not in data


@pytest.mark.parametrize("kept", [1, 5, -3, -1, None])
def test_what_was_interrupted_goes_on_to_the_same_bits(rubbed: tuple[Question, Solved], kept: int | None) -> None:
    asked, whole = rubbed
    again = solved(asked, kept, whole)
    assert len(again.records) == len(whole.records)
    same = dataset(whole).drop_vars(NO_TIME)
    xr.testing.assert_identical(dataset(again).drop_vars(NO_TIME), same)


def test_file_of_netcdf_gives_the_same_dataset(rubbed: tuple[Question, Solved], tmp_path: Path) -> None:
    data = dataset(rubbed[1])
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as read:
        xr.testing.assert_equal(read.load(), data)


def test_checks_of_a_finished_job_agree_and_solve_nothing_again(
    rubbed: tuple[Question, Solved], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, whole = rubbed
    both = replace(asked, checks=frozenset(FORCED_RESPONSE.checks))
    found = solved(both, None, whole)
    data = dataset(found)
    # one case alone: its peak and both flanks
    assert data.sizes["check"] == 3
    # three harmonics of a slipping contact: half a percent is what the fifth one does
    assert np.abs(data.verify_difference_percent).max() < 1.0
    assert np.all(data.verify_settled == 1)
    assert data.sizes["point"] == data.reference_error_percent.size
    assert float(data.reference_worst_percent[0]) == data.reference_error_percent.max()
    told = [t.title for t in FORCED_RESPONSE.summary(data)]
    assert told == [
        "Forced response",
        "Where guarded_alert asked for more harmonics",
        "Against more harmonics",
        "Is it stable?",
        "Against time integration",
    ]


def test_cases_of_different_harmonics_and_contacts_stand_side_by_side(rubbed: tuple[Question, Solved]) -> None:
    asked, _ = rubbed
    system = asked.model.system
    other = replace(system, interface=replace(system.interface, names=("1", "3")))
    sweep = replace(asked.sweep, high=5, selection="always_high", points=3, peak_points=0, samples=128)
    contacts = replace(asked.model.contacts, names=("1", "3"))
    one = replace(asked, sweep=replace(sweep, high=3), label="high = 3")
    two = replace(asked, sweep=sweep, label="high = 5", model=replace(asked.model, system=other, contacts=contacts))
    each = [solved(one), solved(two)]
    data, alone = dataset(*each), [dataset(s) for s in each]
    assert data.contact.values.tolist() == ["1", "2", "3"]
    assert data.sizes["harmonic"] == 6
    split = [data.isel(point=data.point_case == i) for i in (0, 1)]
    for i, labels in enumerate((["1", "2"], ["1", "3"])):
        n = alone[i].sizes["harmonic"]
        np.testing.assert_array_equal(split[i].gap.sel(contact=labels)[:, :n], alone[i].gap.values)
        assert np.all(split[i].gap.sel(contact=labels)[:, n:] == 0.0)
        assert np.all(split[i].harmonic_kept[:, n:] == 0)
        np.testing.assert_array_equal(
            data.peak_force[i].sel(contact=labels)[..., : alone[i].sizes["sample"]], alone[i].peak_force[0]
        )
    assert np.all(np.isnan(split[0].gap.sel(contact="3")))
    assert np.all(data.peak_state[0].sel(contact="3") == -1)
    assert int(data.peak_point[1]) >= int(data.points[0])
    rows = FORCED_RESPONSE.summary(data)[0].rows
    assert [r[0] for r in rows] == ["high = 3", "high = 5"]


@pytest.mark.parametrize("driven", [(3,), (1, 3)])
def test_amplitudes_and_the_peak_are_those_of_the_harmonics_that_the_load_drives(driven: tuple[int, ...]) -> None:
    system, load = rubbing()
    forces = dict.fromkeys(driven, load.harmonics[1])
    sweep = Sweep(omega_range=(0.2, 0.33), low=3, high=3, selection="always_high", points=8, peak_points=0, samples=64)
    asked = question(system, HarmonicLoad(load.static, forces), sweep)
    data = dataset(solved(asked))
    assert list(data.attrs["driven_harmonics"]) == list(driven)
    motion = data.output_displacement.values[..., 0] + 1j * data.output_displacement.values[..., 1]
    size = np.sqrt(np.sum(np.abs(motion[:, list(driven)]) ** 2, axis=1))
    np.testing.assert_allclose(data.amplitude.values, size, rtol=1e-14)
    top = int(np.argmax(size[:, 0]))
    assert int(data.peak_point[0]) == top
    # the first harmonic alone would give another peak, or next to nothing
    assert float(data.peak_amplitude[0]) > 1.05 * np.abs(motion[top, 1, 0])
    title = FORCED_RESPONSE.summary(data)[0].title
    words = "harmonic 3" if driven == (3,) else "norm of harmonics 1, 3"
    assert title == f"Forced response, {words}"


def test_checks_that_some_cases_had_stay_with_theirs(rubbed: tuple[Question, Solved]) -> None:
    asked, whole = rubbed
    checked = replace(asked, label="b", checks=frozenset({"verify"}))
    first = replace(whole, case=replace(whole.case, label="a"))
    data = dataset(first, solved(checked, None, whole))
    assert set(data.verify_case.values) == {1}
    assert data.sizes["check"] == 1


def lifted(**sweep: object) -> Question:
    system, load = lifting()
    given: dict[str, object] = {
        "omega_range": (0.8, 1.6),
        "low": 3,
        "high": 3,
        "selection": "always_high",
        "points": 30,
        "peak_points": 4,
        "samples": 128,
    }
    return question(system, load, Sweep(**given | sweep))  # type: ignore[arg-type]


def test_fold_is_told_with_the_label_of_its_case() -> None:
    asked = lifted()
    data = dataset(solved(asked))
    assert 0 < int(data.refinement.sum()) <= asked.sweep.peak_points
    (said,) = [t for t in warnings_of(data) if "folds" in t]
    assert said.startswith("The response folds between 0.2")
    assert 'the peak stands among them. Sweep the other way (forced_response.direction = "down"), too' in said
    told = warnings_of(dataset(solved(replace(asked, label="load.f.force_n = 2"))))
    assert any(t.startswith("load.f.force_n = 2: the response folds between") for t in told)


def test_points_are_judged_by_their_own_errors_and_doubted_where_nothing_judged_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = replace(lifted(points=10, peak_points=0), limit=1e-4)  # a hundredth of a per cent
    data = dataset(solved(asked))
    own = data.own_error_percent.values
    assert 0 < np.count_nonzero(own > 0.01) < own.size
    doubted = ["are predicted to change it by" in text for text in data.verdict_reason.values.tolist()]
    np.testing.assert_array_equal(doubted, own > 0.01)
    monkeypatch.setattr("stickslip.response.forced.collected.own_error", lambda *_: float("nan"))
    data = dataset(solved(asked))
    assert np.all(data.verdict.values >= 1)
    assert data.verdict_reason[0].item().startswith("the error of H = ")
    assert int(data.case_verdict[0]) >= 1
    again = dataset(solved(replace(asked, checks=frozenset({"verify_harmonics"}))))
    doubted = [
        "are predicted to change it, in amplitude or phase, by" in text for text in again.verdict_reason.values.tolist()
    ]
    np.testing.assert_array_equal(doubted, again.reference_error_percent.values > 0.01)
    assert not any("not examined" in text for text in again.verdict_reason.values.tolist())


def test_of_always_low_the_remedy_names_the_selection_and_says_what_was_compared() -> None:
    # the side of the resonance where the contact begins to open: fifteen points, of which two miss more than 5 %
    few = lifted(omega_range=(1.3, 1.45), low=1, high="auto", selection="always_low", points=2, peak_points=0)
    data = dataset(solved(replace(few, checks=frozenset({"verify_harmonics"}))))
    at = int(np.nanargmax(data.reference_error_percent.values))
    assert "up to 15 harmonics instead of H = 1 are predicted to change it" in data.verdict_reason[at].item()
    remedy = 'Give harmonics.selection = "guarded_alert" or "always_high", or a larger harmonics.low'
    assert {f.remedy for f in twice_the_harmonics(Curve(data, 0))} == {f"{remedy}."}
    (told,) = [t for t in FORCED_RESPONSE.summary(data) if t.title == "Against more harmonics"]
    (line,) = told.lines
    assert "gainst harmonics up to 15, where harmonics.high stands for 5" in line
    assert f"{remedy}, and compare; with H = 5 a solution has 11 unknowns a coordinate instead of 3" in line
    assert "Raise harmonics.high" not in line


def test_peak_at_the_end_is_no_resonance() -> None:
    said = warnings_of(dataset(solved(lifted(omega_range=(0.6, 0.9), points=5))))
    told = (
        f"The largest amplitude stands at the end of the sweep ({0.9 / HZ:.2f} Hz); it is no resonance. "
        f"Widen forced_response.frequency_hz to values beyond {0.9 / HZ:.5g} Hz. Where contacts shift the resonance, a larger motion of its branch may reach into the range: "
        "[all_motions] looks for it."
    )
    assert told in said


def test_what_no_balance_is_found_for_is_found_in_time_or_told_with_what_showed_it() -> None:
    # a mass on a stop comes back in every period at 1.5, in every second one at 3.5
    stop = Interface(("1",), (UnilateralSpring(k_n=20.0),), np.array([[0.0], [0.0], [1.0]]))
    structure = Structure(np.eye(1), 0.1 * np.eye(1), np.eye(1), table(("a.x",)))
    sweep = Sweep(
        omega_range=(1.5, 3.5),
        at=(1.5, 3.5),
        low=9,
        high=9,
        selection="always_high",
        peak_points=0,
        rescue="in_time",
        newton=Newton(max_iterations=1),
    )
    load = HarmonicLoad(np.zeros(1), {1: np.array([1.0 + 0j])})
    data = dataset(solved(question(System(structure, stop, np.array([0])), load, sweep)))
    periodic, other = data.marched_sentence.values.tolist()
    assert data.status.values.tolist() == [0, Status.NOT_PERIODIC]
    assert periodic.startswith("periodic in time after")
    assert other.count("it repeats itself every 2 periods") == 2
    assert data.verdict_reason.values.tolist()[1].endswith(f"{other})")


def test_two_motions_of_one_case_that_are_not_periodic_stand_on_the_page() -> None:
    stop = Interface(("1",), (UnilateralSpring(k_n=20.0),), np.array([[0.0], [0.0], [1.0]]))
    structure = Structure(np.eye(1), 0.1 * np.eye(1), np.eye(1), table(("a.x",)))
    sweep = Sweep(
        omega_range=(3.5, 3.6),
        at=(3.5, 3.6),
        low=9,
        high=9,
        selection="always_high",
        peak_points=0,
        rescue="off",
        newton=Newton(max_iterations=1),
    )
    load = HarmonicLoad(np.zeros(1), {1: np.array([1.0 + 0j])})
    asked = question(System(structure, stop, np.array([0])), load, sweep)
    for seconds, words in ((5.0, "amplitude goes from"), (1e-9, "the time was too short: 1 of at least 128 periods")):
        data = dataset(solved(replace(asked, not_periodic_s=seconds)))
        shown = statistics_in_time(Response(data))
        assert shown is not None
        assert len(shown.items) == len(shown.rows) == 2
        assert all(words in item and "nan" not in item for item in shown.items)


def test_points_without_a_solution_are_marked_and_not_filled_in() -> None:
    hopeless = Newton(max_iterations=1)
    asked = lifted(newton=hopeless, frequencies=2, omega_range=(0.3, 1.4), peak_points=0, rescue="off")
    data = dataset(solved(replace(asked, not_periodic_s=2.0)))
    lost = data.status.values != 0
    assert 0 < lost.sum() == int(data.points_failed[0]) == data.attrs["failed"]
    for name in ("amplitude", "gap", "contact_force", "output_displacement", "dissipated_energy"):
        assert np.all(np.isnan(data[name].values[lost])), name
        assert np.all(np.isfinite(data[name].values[~lost])), name
    assert any(f"{lost.sum()} points did not converge" in t for t in warnings_of(data))
    assert np.all(data.verdict.values[lost] == 2)
    assert np.all(data.verdict.values[~lost] < 2)
    assert int(data.case_verdict[0]) == 1
    # what the motion is like there is told by time integration, and said to be that
    hz = data.frequency_hz.values[lost]
    assert np.isin(data.not_periodic_frequency_hz.values, hz).all()
    assert data.not_periodic_largest.values[0, 0] >= data.not_periodic_least.values[0, 0] > 0.0
    assert str(data.not_periodic_sentence.values[0]).split(": ")[1].startswith("no periodic motion")
    assert any("That is time integration" in str(v) for v in FORCED_RESPONSE.verdicts(data))
    assert "not_periodic" in plots(tree_of(forced_response=data))


def drifting(retention: float) -> Question:
    """A mass between two contacts that both slip in every cycle: nothing says where it stands."""
    mass, stiffness = np.diag([1.0, 0.1]), np.diag([100.0, 0.0])
    damping = np.diag([0.4, 0.0])
    gap = np.array([[1.0, -1.0], [0.0, 0.0], [0.0, 0.0]])
    law = Jenkins(k_t=200.0, limit=0.05)
    structure = Structure(mass, damping, stiffness, table(("blade.x", "ring.x")))
    bare = System(structure, Interface(("ring",), (law,), gap), np.array([0]), free=np.array([1]))
    load = HarmonicLoad(np.zeros(2), {1: np.array([1.0 + 0j, 0.0])})
    sweep = Sweep(omega_range=(8.0, 12.0), low=1, high=3, points=8, peak_points=4, samples=64)
    held = bare.with_retention(retention)
    return question(held, load, sweep, examine="off", model={"bare": bare, "retention": retention})


def test_body_that_may_drift_is_told_and_retention_is_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(analysis_module, "peak_shift", peak_shift)
    loose = dataset(solved(drifting(0.0)))
    means = loose.retained_displacement.isel(harmonic=0).values
    assert np.nanmax(np.abs(means)) < 1e-3  # the sliders move by 2.5e-4 m; a column of rounding once led to 7e14 m
    free = warnings_of(loose)
    assert any("the mean position of node1.ring.x is undetermined and the body may drift" in t for t in free)
    data = dataset(solved(drifting(1e-2)))
    assert not any("may drift" in t for t in warnings_of(data))
    assert 0.0 < abs(float(data.retention_peak_shift[0])) < 1e-3


def test_load_without_an_equilibrium_leaves_a_case_without_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object):
        raise SingularError("static equilibrium: coordinate x is held by nothing")
        yield

    monkeypatch.setattr("stickslip.analyses.forced_response.analysis.forced_response", fails)
    asked = lifted()
    with JobJournal(Path(":memory:"), ForcedPoint) as journal:
        with pytest.raises(SingularError, match="held by nothing"):
            list(FORCED_RESPONSE.solve(asked, [], journal))
        case = Case(0, "", {}, None, None, "", Path())  # type: ignore[arg-type]
        empty = Solved(case, journal.records(), journal.notes())
    monkeypatch.undo()
    data = dataset(empty, solved(lifted(points=5, peak_points=0)))
    # what stopped it stands there as a point that did not converge
    assert data.points.values.tolist()[0] == data.points_failed.values.tolist()[0] == 1
    assert np.isnan(data.peak_amplitude[0])
    assert int(data.peak_point[0]) == -1
    assert data.point_case.values.tolist() == [0, *[1] * (data.sizes["point"] - 1)]
    assert data.order.dtype.kind == "i"


def test_warnings_of_a_sweep_beside_all_resonances() -> None:
    asked = lifted(omega_range=(60 * HZ, 70 * HZ))
    told = (
        "no natural frequency lies between 60.00 and 70.00 Hz, neither with open nor with stuck contacts; the nearest one is "
        "50.00 Hz. Widen forced_response.frequency_hz: frequency_hz = [48, 52] holds it."
    )
    (verdict,) = no_resonance(asked)
    assert f"{verdict.why}. {verdict.remedy}" == told
    assert no_resonance(lifted(omega_range=(40 * HZ, 70 * HZ))) == ()
    assert mixed_places(("a.x", "b.rz"), "each")[0].why.startswith("harmonics.alert_over mixes rotations (b.rz)")
    assert mixed_places(("a.x", "b.y"), "each") == mixed_places(("a.x", "b.rz"), "answer") == ()


def test_a_range_beside_the_engine_order_is_noted() -> None:
    asked = lifted(omega_range=(495 * HZ, 512 * HZ))
    wheel = replace(asked.model, sectors=24, engine_order=6, orders={1: 6})
    (note,) = off_engine_order(replace(asked, model=wheel, rpm=8000.0))
    assert (note.level, note.word) == ("trusted", "note")
    assert note.why.startswith("at 8000 rpm engine order 6 excites at 800 Hz, outside 495 to 512 Hz;")
    assert "passes this range at 4950 to 5120 rpm" in note.remedy
    for other in ({"rpm": 5000.0}, {"rpm": 0.0}, {"rpm": 8000.0, "key": "speed_rpm"}):
        assert off_engine_order(replace(asked, model=wheel, **other)) == ()


# ---- the table, and what is refused ------------------------------------------------------------------------------------


def settings(harmonics: dict[str, object] | None = None, **table_: object) -> SimpleNamespace:
    return SimpleNamespace(
        forced_response=ForcedResponse(**table_),
        harmonics=Harmonics(**harmonics or {}),
        solver=SimpleNamespace(evaluator="events", rescue="all", globalisation="line_search"),
        limits=SimpleNamespace(memory_gb=4.0, work_s=7200.0),
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "is missing. Give one of frequency_hz and frequencies_hz"),
        ({"frequency_hz": [2.0, 1.0]}, "must be the lower before the higher"),
        ({"frequency_hz": [1.0, 2.0], "frequencies_hz": [1.0]}, "cannot stand beside frequency_hz"),
        ({"frequencies_hz": [1.0, 1.0]}, "must grow"),
        ({"frequencies_hz": [1.0, 2.0], "frequencies": 4}, "cannot stand beside frequencies_hz"),
        ({"frequency_hz": [1.0, 2.0], "over": "speed"}, "is not for over = 'speed'. Give speed_rpm"),
        ({"speed_rpm": [1.0, 2.0]}, "is not for over = 'frequency'"),
        ({"over": "speed"}, "is missing. Give one of speed_rpm"),
        ({"frequency_hz": [1.0, 2.0], "frequencies": 1}, "greater than or equal to 2"),
    ],
)
def test_tables_that_do_not_say_where_are_refused(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message.replace("(", r"\(")):
        ForcedResponse(**given)


def test_sweeps_over_ranges_lists_and_speeds() -> None:
    sweep = sweep_of(settings(frequency_hz=[1.0, 2.0], direction="down"), None)
    assert sweep.omega_range == (HZ, 2 * HZ)
    assert sweep.ends == (2 * HZ, HZ)
    sweep = sweep_of(settings(frequencies_hz=[1.0, 1.5, 4.0]), None)
    assert sweep.grid.tolist() == [HZ, 1.5 * HZ, 4 * HZ]
    assert sweep_of(settings(frequencies_hz=[3.0]), None).grid.tolist() == [3 * HZ]
    sweep = sweep_of(settings(over="speed", speed_rpm=[100.0, 200.0]), 6)
    assert sweep.omega_range == (600 * RPM, 1200 * RPM)
    with pytest.raises(InputError, match=r"forced_response\.over: is speed, and no load has an engine order"):
        sweep_of(settings(over="speed", speed_rpm=[100.0, 200.0]), None)


def test_response_over_speed_has_speeds() -> None:
    asked = replace(lifted(points=5, peak_points=0), key="speed_rpm")
    asked = replace(asked, model=replace(asked.model, engine_order=2, sectors=4))
    data = dataset(solved(asked))
    np.testing.assert_allclose(data.speed_rpm * 2 / 60, data.frequency_hz, rtol=1e-14)
    assert not data.refinement.any()
    assert data.attrs["engine_order"] == 2
    assert data.attrs["sectors"] == 4


def model(**others: object) -> Model:
    structure = Structure(np.eye(3), np.eye(3), np.eye(3), table(("x", "y", "z")), {"tip": np.arange(3)})
    law = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.5)
    given: dict[str, object] = {
        "parts": {"blade": Part(structure=structure)},
        "contacts": {"root": Contact(between=("blade.tip", "ground"), law=law, acts="tangential")},
        "loads": {"shaker": Load(on="blade.tip", newton=1.0, direction=(1.0, 0.0, 0.0))},
    }
    return Model(**given | others)  # type: ignore[arg-type]


def refused(asked: Model, checks: frozenset[str] = frozenset(), high: int | str = "auto", **limits: float) -> str:
    own = settings({"low": 1, "high": high}, frequency_hz=[1.0, 2.0])
    own.limits = SimpleNamespace(**{"memory_gb": 4.0, "work_s": 7200.0} | limits)
    case = Case(0, "", {}, own, lambda: asked, "", Path(), checks)
    with pytest.raises(InputError) as error:
        question_of(case, asked)
    return str(error.value)


def test_a_speed_of_rotation_is_told_in_rpm() -> None:
    turning = model(speed=6000.0 * RPM, loads={"shaker": Load(on="blade.tip", newton=1.0)})
    own = settings({"low": 1, "high": 3}, frequency_hz=[1.0, 2.0])
    case = Case(0, "", {}, own, lambda: turning, "", Path(), frozenset())
    assert question_of(case, turning).rpm == pytest.approx(6000.0)


def test_what_cannot_be_answered_is_refused_by_key() -> None:
    third = Load(on="blade.tip", newton=1.0, direction=(1.0, 0.0, 0.0), harmonic=3)
    assert refused(model(loads={"third": third})) == (
        "harmonics.low: must hold harmonic 3, which load.third drives, got 1. Add it, for example low = [1, 3], or leave low out."
    )
    rigid = Contact(between=("blade.tip", "ground"), law=RigidCoulomb(mu=0.3), acts="tangential")
    assert refused(model(contacts={"root": rigid}), frozenset({"verify"})) == (
        "contact.root.law: --verify integrates in time, and rigid_coulomb has no stiffness: its force is no function of the gap. "
        "Run without --verify, or give a law with stiffnesses, such as elastic_coulomb."
    )
    # the limits first lower the harmonics of auto to its second level, which are as many as the number here
    for high, unknowns in (("auto", 33), (5, 33)):
        case = f"a case of the forced response (1 nodes, {unknowns} unknowns, "
        told = refused(model(), high=high, memory_gb=0.1)
        assert told.startswith(f"limits.memory_gb: {case}")
        assert refused(model(), high=high, work_s=1e-9).startswith(f"limits.work_s: {case}")


def test_static_loads_need_no_harmonic_of_their_own() -> None:
    pull = Load(on="blade.tip", newton=1.0, direction=(1.0, 0.0, 0.0), harmonic=0)
    assert estimate(model(loads={"pull": pull}), lifted().sweep).nodes == 1
    assert retained_of(model()) == 3


def test_what_a_run_would_refuse_is_refused_before_any_job(tmp_path: Path):
    pull = {"load.pull.on": '"chain.m4"', "load.pull.force_n": "3.0", "load.pull.harmonic": "0"}
    path = write_four_masses(tmp_path, pull | {"vary.load.shaker.force_n": "[1e-9]"})
    case = read_study(path).cases()[0]
    with pytest.raises(InputError, match=r"load.shaker.force_n \(force 1e-09 N\): the excitation is"):
        FORCED_RESPONSE.inputs(case, case.build())


def test_friction_that_nothing_presses_is_told(tmp_path: Path):
    law = {
        "contact.rub.between": '["chain.m2", "ground"]',
        "contact.rub.law": '"elastic_coulomb"',
        "contact.rub.acts": '"normal"',
    }
    keys = {
        "normal_stiffness_n_per_m": "1e4",
        "friction_coefficient": "0.3",
        "axial_stiffness_n_per_m": "0.0",
        "tangential_stiffness_n_per_m": "1e4",
    }
    path = write_four_masses(tmp_path, law | {f"contact.rub.{key}": value for key, value in keys.items()})
    case = read_study(path).cases()[0]
    said = nothing_pressed(FORCED_RESPONSE.inputs(case, case.build()))
    assert said[0].why.startswith("all 1 contact points with friction are open in the static state")


def test_a_first_run_says_how_long_it_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(analysis_module, "COMPILED", 0.0)
    path = write_four_masses(tmp_path, {"forced_response.points": "3", "harmonics.high": "1"})
    with caplog.at_level("INFO", "stickslip"):
        run_study(read_study(path))
    said = [r.getMessage() for r in caplog.records if "compiled" in r.getMessage()]
    assert said[0].startswith("compiled the contact laws in ")


class FullSteps:
    """Newton's method without a globalisation."""

    def advance(self, work: Work, now: Iterate) -> Iterate | Status:
        step = work.newton_step(now)
        return Status.SINGULAR if step is None else work.at(now.x + step)


def test_each_globalisation_acts_where_full_newton_steps_fail(tmp_path: Path) -> None:
    """One frequency without neighbours: the key decides the way there, its number of steps, and not the solution."""
    listed = {"forced_response.frequencies_hz": "[13.5]", "forced_response.peak_points": "0"}
    keys = listed | {"harmonics.high": "5", "harmonics.selection": '"always_high"', "solver.rescue": '"off"'}
    found: dict[str, xr.Dataset] = {}
    for name in GLOBALISATIONS:
        path = write_four_masses(
            tmp_path / name, keys | {"solver.globalisation": f'"{name}"', "load.shaker.force_n": "3.0"}
        )
        path.write_text(path.read_text().replace("frequency_hz = [8.0, 16.0]\n", ""))
        study = read_study(path)
        found[name] = run_study(study).tree["forced_response"].to_dataset()
        assert found[name].attempt_status.values.tolist() == [int(Status.CONVERGED)]
    question = FORCED_RESPONSE.inputs(study.cases()[0], study.cases()[0].build())
    problem, omega = question.problem, 2 * np.pi * 13.5
    start = bonded_start(problem.low, omega, question.model.system)

    def corrected(options: Newton, other: FullSteps | None = None) -> Solution:
        return newton(lambda x: problem.low.linearise(x, omega), start, options, other)

    full = corrected(Newton(max_iterations=200), FullSteps())
    assert full.status == Status.TOO_MANY_ITERATIONS  # the contacts switch to and fro for ever
    ways = {name: corrected(Newton(globalisation=name)) for name in GLOBALISATIONS}
    assert all(way.rung == Rung.DAMPED_STEP for way in ways.values())  # each refused a full step
    counts = {name: way.iterations for name, way in ways.items()}
    assert len(set(counts.values())) == len(counts), counts
    assert {name: int(data.attempt_newton_iterations[0]) for name, data in found.items()} == counts
    point = forced_point(problem.low, ways["line_search"], "low", 0, omega, 0.0)
    answer = answer_at(problem, point)
    for data in found.values():
        motion = data.output_displacement.values[0, ..., 0] + 1j * data.output_displacement.values[0, ..., 1]
        assert np.abs(motion - answer.outputs).max() <= allowed("outputs", answer, answer)


def test_a_repeat_without_a_solution_is_told_without_the_remedy_of_a_sweep() -> None:
    system, load = lifting()
    sweep = Sweep(omega_range=(0.6, 0.8), low=1, high=1, points=2, samples=64)
    lost = replace(next(iter(forced_response(system, load, sweep))), status=Status.TOO_MANY_ITERATIONS)
    _, point = analysis_module.progress(replace(lost, stage="point"), sweep)
    _, again = analysis_module.progress(replace(lost, stage="settled"), sweep)
    assert point.endswith(Status.TOO_MANY_ITERATIONS.advice)
    assert again.startswith("more harmonics for a doubted point, point 1: ")
    assert again.endswith(", no solution")
