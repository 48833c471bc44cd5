"""[all_motions] of a study: an isola named in verdicts and on the page, resuming, Python, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from study_texts import DETACHED, study_of

from stickslip.analyses.all_motions.analysis import ALL_MOTIONS
from stickslip.analyses.all_motions.page import Motions, basin_table, branch_table, branches
from stickslip.analyses.all_motions.records import FoundMotions
from stickslip.analyses.all_motions.verdicts import case_verdicts
from stickslip.analyses.columns import record_of
from stickslip.api.study import Study
from stickslip.errors import InputError
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
from stickslip.study.store.netcdf import one_case
from stickslip.units import HZ

STUDY = f"""{DETACHED}[all_motions]
frequency_hz = [0.016, 0.2]
at_hz = [0.055]
harmonics = 1
tries = 25
starts = 12
steps = 64
most_periods = 200
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    home = tmp_path_factory.mktemp("all_motions")
    return study_of(STUDY, home).path.parent


@pytest.fixture(scope="module")
def result(folder):
    return Study.from_file(folder / "study.toml").run()


def test_a_study_names_the_isola_that_reaches_higher(result):
    case = one_case(result.data["all_motions"].to_dataset(), 0)
    assert case["origin"].values.tolist()[0] == "sweep"
    assert int(np.sum(case["isola"].values)) == 1
    assert any("an isola reaches" in v.why and v.warns for v in result.verdicts)
    words = set(case["motion_stability"].values.reshape(-1)) - {""}
    assert words <= {"stable", "unstable", "undecided"}
    counts = case["motion_count"].values[0]
    assert counts[counts >= 0].sum() + case["aperiodic"].values[0] + case["unsolved"].values[0] == 12
    low, share, high = (case[f"motion_{n}"].values[0] for n in ("share_low", "share", "share_high"))
    assert np.all(low <= share)
    assert np.all(share <= high)


def test_the_page_draws_all_branches_and_tells_the_basins(result, folder):
    view = Motions(one_case(result.data["all_motions"].to_dataset(), 0))
    figure = branches(view).figure
    assert sum(t.mode == "lines" for t in figure.data) == len(view.names)
    assert any("isola" in row[0] for row in branch_table(view).rows)
    assert any("of 12" in row[-1] for row in basin_table(view).rows)
    page = result.report(folder / "page.html").read_text(encoding="utf-8")
    assert "All motions that were found" in page


def test_a_finished_run_searches_nothing_again_and_gives_the_same(result, folder):
    again = run_study(read_study(folder / "study.toml"))
    one, other = (tree["all_motions"].to_dataset() for tree in (result.data, again.tree))
    np.testing.assert_array_equal(one["amplitude"].values, other["amplitude"].values)
    assert one["seconds"].values == other["seconds"].values


def test_python_gives_the_motions_of_a_study(folder):
    model = Study.from_file(folder / "study.toml").model()
    found = model.all_motions(frequency_hz=(0.016, 0.2), at_hz=[0.055], harmonics=1, tries=3, starts=0)
    data = found.data["all_motions"]
    hertz = data["searched_hz"].values.reshape(-1)
    assert hertz == pytest.approx([0.055])
    # one mass, one harmonic: ((K - ω²)² + c²ω²) a² = F² at every motion
    a = data["motion_amplitude"].values.reshape(-1)
    s, omega = a[np.isfinite(a)] ** 2, 0.055 * HZ
    k = 1.0 - 1.5 * s + 0.625 * s**2
    np.testing.assert_allclose(((k - omega**2) ** 2 + (0.05 * omega) ** 2) * s, 0.02**2, rtol=1e-7)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("at_hz = [0.5]", "all_motions.at_hz"),
        ("steps = 4", "all_motions.steps"),
        ("solves = 0", "all_motions.solves"),
        ("budget_s = 60.0", "all_motions.budget_s: is no key any more.*Give solves"),
    ],
)
def test_bad_tables_are_refused_by_key(tmp_path, line, said):
    key = line.split(" = ", maxsplit=1)[0]
    kept = [own for own in STUDY.splitlines() if not own.startswith(key)]
    with pytest.raises(InputError, match=said):
        study_of("\n".join([*kept, line]), tmp_path)


def test_a_largest_stable_motion_that_no_start_reached_is_noted(result):
    case = record_of(FoundMotions, one_case(result.data["all_motions"].to_dataset(), 0))
    (place,) = case.places
    top = max((m for m in place.motions if m.stability == "stable"), key=lambda m: m.amplitude)
    for reached in (3, 0):
        motions = tuple(replace(m, count=reached) if m is top else m for m in place.motions)
        found = case_verdicts("", replace(case, places=(replace(place, motions=motions),)))
        notes = [v for v in found if "was reached by none of 12 starts" in v.why]
        assert [v.word for v in notes] == ["note"] * (reached == 0)


def test_what_the_budget_left_and_where_a_branch_was_lost_are_said(result):
    case = record_of(FoundMotions, one_case(result.data["all_motions"].to_dataset(), 0))
    *branches, last = case.branches
    changed = {
        "spent": True,
        "places": tuple(replace(place, spent=True) for place in case.places),
        "branches": (*branches, replace(last, end="lost at 0.05 Hz (why)")),
    }
    said = [v.why for v in case_verdicts("", replace(case, **changed)) if v.level == "doubtful"]
    assert any("at 1 of 1 frequencies (0.055 Hz) not all was tried" in why for why in said)
    assert any(f"branch {len(case.branches)} (deflation) is not known to its end: lost" in why for why in said)


def test_motions_that_need_more_harmonics_are_doubtful(result):
    """With one harmonic there is an isola that does not exist: the true motion has a third harmonic near the mass's own frequency."""
    assert any(v.level == "doubtful" and "more harmonics" in v.why for v in result.verdicts)


WHEEL = """
schema_version = 2
[part.blisk]
shape = "lumped"
sectors = 6
names = ["disk", "tip"]
masses_kg = [1.0, 0.5]
springs_n_per_m = [["disk", "ground", 1e5], ["disk", "next.disk", 1e6], ["disk", "tip", 1e6]]
[part.blisk.damping]
modal_ratio = 1e-2
[contact.spring]
between = ["blisk.tip", "ground"]
law = "polynomial_spring"
along_t = [0.0, 0.0, 1e10]
[load.gas]
on = "blisk.tip"
force_n = 20.0
engine_order = 2
[all_motions]
frequency_hz = [180.0, 220.0]
at_hz = [200.0]
harmonics = 1
points = 5
tries = 1
"""


def test_of_a_wheel_travelling_waves_are_searched_and_what_is_not_examined_is_said(tmp_path):
    (tmp_path / "study.toml").write_text(WHEEL, encoding="utf-8")
    result = Study.from_file(tmp_path / "study.toml").run()
    case = one_case(result.data["all_motions"].to_dataset(), 0)
    assert set(case["motion_stability"].values.reshape(-1)) <= {"not examined", ""}
    assert np.all(np.isnan(case["motion_change"].values))
    assert any("travelling wave" in v.why for v in result.verdicts)
    assert "not examined" in result.report(tmp_path / "page.html").read_text(encoding="utf-8")


def test_more_modes_than_the_model_has_are_refused(folder):
    model = Study.from_file(folder / "study.toml").model()
    with pytest.raises(InputError, match=r"all_motions.modes.*: 1\."):
        model.all_motions(frequency_hz=(0.016, 0.2), at_hz=[0.055], harmonics=1, modes=2)


def test_the_check_estimates_the_time(folder):
    study = read_study(folder / "study.toml")
    case = study.cases()[0]
    told = ALL_MOTIONS.check(case, study.model())[1]
    seconds = float(told.removeprefix("all_motions: about ").partition(" s ")[0])
    assert 0.001 < seconds < 1000.0
