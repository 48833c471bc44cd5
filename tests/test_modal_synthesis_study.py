"""[modal_synthesis] in a study: levels against direct solutions, verdicts, the page, going on after an interruption."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from study_texts import DETACHED, JENKINS, answered, study_of

import stickslip as ss
from stickslip.analyses.modal_synthesis import analysis as solving
from stickslip.analyses.modal_synthesis.page import _along
from stickslip.analyses.modal_synthesis.problem import _bounded
from stickslip.analyses.page import plots
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.study.run import run_study
from stickslip.study.store.netcdf import one_case

STUDY = f"""{JENKINS}[modal_synthesis]
levels = [0.02, 0.5, 1.0, 2.0]
harmonics = 3
most_harmonics = 3
amplitude_mm = [100.0, 20000.0]
"""
# of two masses on a weak spring: a neighbour that is near
NEAR = (
    STUDY.replace("masses_kg = [1.0]", "masses_kg = [1.0, 1.0]")
    .replace(
        'springs_n_per_m = [["ground", 1, 1.0]]',
        'springs_n_per_m = [["ground", 1, 1.0], ["ground", 2, 1.0], [1, 2, 0.03]]',
    )
    .replace('[["ground", 1, 0.02]]', '[["ground", 1, 0.01], ["ground", 2, 0.01]]')
    .replace('on = "blade.m1"\nforce_n = 0.1', 'on = "blade.m2"\nforce_n = 0.02')
    .replace("tangential_stiffness_n_per_m = 0.5", "tangential_stiffness_n_per_m = 0.2")
)


def test_the_largest_difference_from_direct_solutions_is_told_with_level_and_frequency():
    def told(*levels):
        each = [SimpleNamespace(level=n, along_error=e, along_error_omega=w) for n, e, w in levels]
        return _along(SimpleNamespace(found=SimpleNamespace(levels=each)))

    hz = 2 * math.pi
    assert told() == told((1.0, None, None), (2.0, math.nan, 3.0)) == ""
    both = told((1.0, 0.02, 40.0 * hz), (2.0, -0.05, 50.0 * hz), (3.0, 0.03, 60.0 * hz), (4.0, math.nan, 70.0 * hz))
    assert both == " Full lines differ from them around the peaks by up to 5 %, at level 2 and 50 Hz."
    assert told((1.0, 0.02, None)).endswith("by up to 2 %, at level 1 and – Hz.")


def test_levels_of_b3_from_its_mode_with_direct_solutions_beside_them(tmp_path):
    text = STUDY.replace("[0.02, 0.5, 1.0, 2.0]", "[0.5, 1.0]")
    text += "direct = true\npassage_hz_per_s = [2e-5]\n"
    outcome = answered(text, tmp_path)
    case = one_case(outcome.tree["modal_synthesis"].to_dataset(), 0)
    assert set(case["answer"].values) == {"trusted"}
    # B3 at fc = 0.2 and 0.1 by similarity, one harmonic: 0.6038447 / 2, 0.6260618
    assert case["peak_amplitude"].values == pytest.approx([0.30192, 0.62606], rel=0.01)
    assert np.all(np.abs(case["direct_error"].values) < 0.01)
    assert np.all(case["direct_seconds"].values > case["seconds"].values)
    assert np.all(case["passage_finished"].values == 1)
    assert np.all(case["passage_peak_amplitude"].values[:, 0] < 1.001 * case["peak_amplitude"].values)
    assert not [v for v in outcome.verdicts if v.rank]
    figures = plots(outcome.tree)
    assert {"modal_synthesis", "modal_synthesis_peaks", "modal_synthesis_passage"} <= set(figures)
    told = outcome.summaries["modal_synthesis"][0]
    assert told.head[6] == "answer"
    assert told.rows[0][6] == "trusted"
    through = outcome.summaries["modal_synthesis"][1]
    assert len(through.rows) == 2
    assert case["passage_share"].values[:, 0] == pytest.approx(
        case["passage_peak_amplitude"].values[:, 0] / case["peak_amplitude"].values
    )
    # one mass has no other mode: all of the curve is alone, and as far off as the text of the theory says
    assert np.all(case["alone"].values[case["curve"].values >= 0] == 1)
    assert np.all(np.abs(case["along_error"].values) < 0.03)
    assert any("synthesised curves differ" in v.why for v in outcome.verdicts)


def test_a_level_at_which_the_mode_is_not_alone_is_refused_and_not_shown(tmp_path):
    model = ss.Study.from_file(study_of(NEAR, tmp_path).path).model()
    result = model.modal_synthesis(levels=[0.5, 3.0], harmonics=5, most_harmonics=5, folder=tmp_path / "out")
    case = one_case(result.data["modal_synthesis"].to_dataset(), 0)
    assert list(case["answer"].values) == ["trusted", "refused"]
    assert np.isnan(case["peak_amplitude"].values[1])
    assert np.all(np.isnan(case["amplitude"].values[1]))
    assert [v.level for v in result.verdicts] == ["trusted", "doubtful"]
    assert "refused" in result.verdicts[1].why
    page = result.report(tmp_path / "report.html").read_text()
    assert "1 level not shown" in page
    nothing = model.modal_synthesis(levels=[3.0], harmonics=5, most_harmonics=5)
    assert nothing.verdicts[-1].level == "wrong"
    assert "nothing is left" in nothing.verdicts[-1].why
    below = model.modal_synthesis(levels=[1e-3], harmonics=3, most_harmonics=3, amplitude_mm=[2e4, 6e4], points=8)
    assert "begins with more than the level reaches" in below.verdicts[0].why


def test_an_interrupted_run_goes_on_with_the_mode_that_it_has(tmp_path, monkeypatch):
    study = study_of(STUDY, tmp_path)
    own, calls = solving._level, []

    def stopped(shared, level):
        calls.append(level)
        if len(calls) == 3:
            raise KeyboardInterrupt
        return own(shared, level)

    monkeypatch.setattr(solving, "_level", stopped)
    with pytest.raises(BaseException, match="goes on from there"):
        run_study(study)
    monkeypatch.setattr("stickslip.analyses.modal_synthesis.analysis.nonlinear_mode", None)
    run_study(study)
    assert calls == [0.02, 0.5, 1.0, 1.0, 2.0]


def test_what_it_has_no_form_for_is_refused_before_anything_is_computed(tmp_path):
    for change, what in (
        (("[modal_synthesis]", "[modal_synthesis]\nmode = 2"), "no such mode"),
        (("force_n = 0.1", "force_n = 0.1\nharmonic = 2"), "answers to harmonic 1"),
        (("force_n = 0.1", "force_n = 0.1\nharmonic = 0"), "no load vibrates"),
        (("levels = [0.02, 0.5", "levels = [0.5, 0.5"), "twice"),
    ):
        with pytest.raises(InputError, match=what):
            answered(STUDY.replace(*change), tmp_path)


def test_the_peak_told_is_that_of_a_sweep_and_a_detached_curve_is_a_doubt(tmp_path):
    text = f"{DETACHED}[modal_synthesis]\nlevels = [0.5, 1.0]\nharmonics = 1\nmost_harmonics = 1\namplitude_mm = [50.0, 3000.0]\n"
    outcome = answered(text, tmp_path)
    case = one_case(outcome.tree["modal_synthesis"].to_dataset(), 0)

    def force(amplitude: float) -> float:  # at the peak, with one harmonic
        stiffness = 1.0 - 1.5 * amplitude**2 + 0.625 * amplitude**4
        return float(0.05 * amplitude * np.sqrt(stiffness - 0.05**2 / 4))

    swept, detached = (case[n].values for n in ("peak_amplitude", "detached_peak_amplitude"))
    assert [force(a) for a in swept] == pytest.approx([0.01, 0.02], rel=1e-3)
    assert force(detached[1]) == pytest.approx(0.02, rel=1e-3)
    assert detached[1] > 1.5 * swept[1]
    assert np.isnan(detached[0])
    assert list(case["answer"].values) == ["trusted", "doubtful"]
    (told,) = (v for v in outcome.verdicts if v.rank)
    assert f"meets has {1e3 * swept[1]:.4g} mm" in told.why
    assert f"detached curve it is {1e3 * detached[1]:.4g} mm" in told.why
    assert "a sweep does not reach" in told.why
    assert told.remedy.startswith("[all_motions]")


def test_a_level_at_which_nothing_slips_is_answered_in_proportion_however_small(tmp_path):
    text = STUDY.replace("levels = [0.02, 0.5, 1.0, 2.0]", "levels = [1e-30, 1e-3]")
    outcome = answered(text.replace("amplitude_mm = [100.0, 20000.0]\n", ""), tmp_path)
    case = one_case(outcome.tree["modal_synthesis"].to_dataset(), 0)
    # stuck: 0.1 N over c ω, damped as little as that
    exact = 0.1 * case["level"].values / (0.02 * np.sqrt(1.5 - 0.02**2 / 4))
    assert case["peak_amplitude"].values == pytest.approx(exact, rel=1e-6)
    assert np.nanmax(case["amplitude"].values[0]) == pytest.approx(exact[0], rel=1e-6)
    assert [v.level for v in outcome.verdicts] == ["trusted"]


def test_a_level_beyond_all_numbers_is_refused_by_its_value(tmp_path):
    with pytest.raises(InputError, match=r"modal_synthesis\.levels\[1\]: is 1e\+300, which no"):
        answered(STUDY.replace("levels = [0.02, 0.5, 1.0, 2.0]", "levels = [1.0, 1e300]"), tmp_path)
    with pytest.raises(InputError, match=r"modal_synthesis\.levels: holds 1e\+30, with which"):
        _bounded([1.0, 1e30], HarmonicLoad(np.zeros(1), {1: np.array([1e31 + 0j])}))  # of loads in Python
