"""Harmonic selection as a user meets it: any strategy and any harmonics from a study file to result, page and resumed run."""

import json
import re
import sqlite3
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from small_v2 import write_four_masses, write_two_blades

from stickslip.analyses.forced_response import analysis
from stickslip.analyses.forced_response.chooser import _audited
from stickslip.analyses.forced_response.page.harmonics import choice, errors, kept_harmonics
from stickslip.analyses.forced_response.page.response import Response
from stickslip.errors import InputError
from stickslip.harmonic.selection import strategy_named
from stickslip.harmonic.selection.grolet import Grolet
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.harmonic.strategies import STRATEGIES
from stickslip.response.forced.sweep import Sweep
from stickslip.study.analysis import Advice
from stickslip.study.file.harmonics import SELECTIONS
from stickslip.study.file.tables import json_schema
from stickslip.study.models.study import Study, read_study
from stickslip.study.run import run_study

pytestmark = pytest.mark.usefixtures("peak_alone")

# a damper that slips around the peak, at few frequencies
SLIPPING = {
    "load.shaker.ratio": "8",
    "forced_response.frequency_hz": "[179.8, 181.4]",
    "forced_response.peak_points": "0",
    "forced_response.frequencies": "2",
    "forced_response.stability": '"off"',
}
DECIDE = tuple(name for name in SELECTIONS if always_kept(strategy_named(name)) is None)
ALONE = tuple(name for name in DECIDE if not strategy_named(name).verifies)
# one of those that go through the frequencies alone in every run of the tests, the others with the long ones
JOURNEYS = [pytest.param(name, marks=pytest.mark.validation) if name in ALONE[1:] else name for name in SELECTIONS]


@dataclass(frozen=True)
class Ran:
    """What a run left: the node of the response with the attributes of the whole, and what the terminal prints."""

    data: xr.Dataset
    said: str


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Study:
    """Mesh and reduce the blades once: selections do not touch them."""
    path = write_two_blades(tmp_path_factory.mktemp("blades"), SLIPPING)
    text = path.read_text(encoding="utf-8")
    path.write_text("\n".join(x for x in text.splitlines() if "vary" not in x and "ratio = [" not in x) + "\n")
    return read_study(path)


def changed(base: Study, harmonics: Mapping[str, object], folder: str, **sweep: object) -> Study:
    """Return the study with other keys of [harmonics] and [forced_response], its results in a folder of its own."""
    keys: dict[str, object] = {f"harmonics.{k}": v for k, v in harmonics.items()}
    keys |= {f"forced_response.{k}": v for k, v in sweep.items()}
    return base.replace(keys | {"output.folder": folder})


def run(study: Study, *checks: str) -> Ran:
    outcome = run_study(study, checks=checks)
    tables = outcome.summaries["forced_response"]
    lines = [text for t in tables for text in (t.title, *t.lines)]
    root = outcome.tree.attrs
    data = outcome.tree["forced_response"].to_dataset()
    return Ran(data.assign_attrs(root | data.attrs), "\n".join([*lines, *map(str, outcome.verdicts)]))


NAN = float("nan")


def forget_after(study: Study, kept: int) -> int:
    """Leave the first points of a run in its journal, as a killed one does; return how many there were."""
    (sealed,) = (study.folder / "jobs").glob("*.job")
    with sqlite3.connect(sealed) as db:
        rows = [i for (i,) in db.execute("select id from record order by id")]
        db.execute("delete from record where id > ?", (rows[kept - 1],))
        db.execute("update sqlite_sequence set seq = ?", (rows[kept - 1],))  # the last number
        db.execute("delete from note")
    db.close()
    sealed.rename(sealed.with_suffix(".part"))
    return len(rows)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([], ""),
        (
            [(0.01, 0.5, False)],
            "; audits: 1 point solved again with more harmonics, which changed the motion by at most 1 %",
        ),
        (
            [
                (0.01, NAN, False),
                (0.02, 0.3, True),
                (NAN, NAN, True),
                (NAN, 0.5, True),
                (NAN, 0.03, False),
                (NAN, 0.04, False),
            ],
            (
                "; audits: 2 points solved again with more harmonics, which changed the motion by at most 2 %"
                "; 2 points exact, as no force acts on the harmonics left out"
                "; 2 points judged by prediction alone, of at most 4 %"
            ),
        ),
        ([(NAN, NAN, False), (NAN, 0.03, False)], "; 1 point judged by prediction alone, of at most 3 %"),
        ([(NAN, NAN, True)], "; 1 point exact, as no force acts on the harmonics left out"),
    ],
)
def test_what_is_known_of_the_points_is_counted(points, said):
    every = [
        SimpleNamespace(point=SimpleNamespace(converged=True), audit_error=audit, own_error=own, exact=exact)
        for audit, own, exact in points
    ]
    lost = SimpleNamespace(point=SimpleNamespace(converged=False), audit_error=0.5, own_error=0.5, exact=True)
    assert _audited(SimpleNamespace(accepted=[*every, lost])) == said


def test_study_and_library_have_one_default(base: Study) -> None:
    default = Sweep(omega_range=(1.0, 2.0)).selection
    assert base.tables.harmonics.selection == default
    assert f'selection = "{default}"' in base.text


def test_editors_are_offered_every_strategy() -> None:
    key = json.loads(json_schema())["$defs"]["Harmonics"]["properties"]["selection"]
    assert key["enum"] == list(STRATEGIES)
    assert all(name in key["description"] for name in SELECTIONS)


@pytest.mark.parametrize("name", JOURNEYS)
def test_every_strategy_from_a_file_to_result_and_page(base: Study, name: str) -> None:
    ran = run(changed(base, {"selection": name, "high": 3}, f"of_{name}"))
    data, decides, alone = ran.data, name in DECIDE, name in ALONE
    assert data.attrs["selection"] == name
    assert data.attrs["passages"] == ("single" if alone else "double")
    assert list(np.atleast_1d(data.attrs["high_harmonics"])) == [0, 1, 2, 3]
    kept = data.harmonic_kept.values
    assert np.all(kept[:, :2] == 1), "the static term and what the force drives are always kept"
    # a solution is zero in harmonics that it does not keep and in no other that the contacts excite
    parts = np.abs(data.output_displacement.values).sum(axis=(2, 3))
    assert np.all(parts[kept == 0] == 0.0)
    assert np.all(parts[:, :2] > 0.0)
    np.testing.assert_array_equal(data.unknowns.values, data.sizes["retained"] * (2 * kept.sum(axis=1) - 1))
    assert int(data.unknowns_solved[0]) == int(data.attempt_unknowns.sum())
    assert ("alert_error_percent" in data) == (decides and not alone)
    if alone:
        assert not np.any(np.isfinite(data.predicted_error_percent.values))
    # three harmonics and the static term
    everywhere = data.sizes["point"] * data.sizes["retained"] * 7
    cost = f"{int(data.attempt_unknowns.sum())} unknowns were solved in all; H = 3 everywhere would be about"
    assert (f"Where {name} asked for more harmonics" in ran.said) == decides
    response = Response(data)
    drawn = kept_harmonics(response)
    assert (drawn is None) == (not decides)
    if drawn is not None:
        hz = data.frequency_hz.values
        marks = set(zip(drawn.figure.data[0].x, drawn.figure.data[0].y, strict=True))
        assert marks == {(hz[i], h) for i, h in zip(*np.nonzero(kept), strict=True) if h > 0}
    assert (errors(response) is None) == (not decides)
    page = str(choice(response))  # tables and words as data
    assert name in page
    for told in (ran.said, page):
        assert (cost in told) == (f" = {everywhere} (an estimate" in told) == decides


@pytest.mark.parametrize(
    ("harmonics", "after"),
    [
        ({"selection": "maple", "high": 4}, 2),
        pytest.param({"selection": "jacobian_alert", "passages": "single", "high": 3}, 2, marks=pytest.mark.validation),
        ({"selection": "jacobian_alert", "low": [1], "high": [1, 3, 5]}, 3),
    ],
    ids=["single passage", "alert in a single passage", "list of harmonics"],
)
def test_resumed_run_gives_the_same_bits(
    base: Study, harmonics: dict[str, object], after: int, caplog: pytest.LogCaptureFixture
) -> None:
    study = changed(base, harmonics, f"again_{len(str(harmonics))}", frequencies=3)
    whole = run(study).data
    count = forget_after(study, after)
    assert count > after, "nothing is left to do again"
    with caplog.at_level("INFO"):
        again = run(study).data
    assert f"goes on after {after} records of the earlier start" in caplog.text
    assert set(whole.data_vars) == set(again.data_vars)
    for key in whole.data_vars:
        if "seconds" not in str(key):
            np.testing.assert_array_equal(again[key].values, whole[key].values, err_msg=str(key))


@pytest.mark.validation
def test_odd_harmonics_alone_are_solved_and_shown(base: Study) -> None:
    odd = changed(base, {"selection": "always_high", "high": [1, 3, 5]}, "odd")
    ran = run(odd, "verify_harmonics")
    data = ran.data
    assert data.harmonic_kept.values.tolist() == [[1, 1, 0, 1, 0, 1]] * data.sizes["point"]
    assert "H = 1, 3, 5" in ran.said
    # the even ones that the study leaves out are among those that it is held against
    error = data.reference_error_percent.values
    assert np.all(np.isfinite(error))
    assert float(data.reference_worst_percent[0]) == np.max(error)
    above = int(np.sum(error > 5))
    assert int(data.reference_above[0]) == above
    assert f" {above} of {error.size} solutions" in ran.said
    assert ("leaves out 2, 4" in str(data.reference_sentence.values[0])) == (above > 0)
    full = run(changed(base, {"selection": "always_high", "high": 5}, "full")).data
    # what they change at all, the check must have foretold within its order of magnitude
    change = np.abs(full.amplitude.values[:, 0] / data.amplitude.values[:, 0] - 1)
    assert 100 * change.max() < 3 * error.max()


def check(study: Study) -> Advice:
    (case,) = study.cases()
    found = analysis.FORCED_RESPONSE.check(case, case.build())
    assert isinstance(found, Advice)
    return found


@pytest.mark.parametrize(
    "over", ["outputs", "contacts", ["tip1.x", "L1.1.z", "damper.x"], ["tip1.x", "damper.z", "damper.rx"]], ids=str
)
def test_error_is_taken_where_the_study_says(base: Study, over: object) -> None:
    study = changed(base, {"alert_over": over, "alert_harmonics": [0, 1]}, "over")
    said = check(study)
    count = {"outputs": 9, "contacts": 27}.get(str(over), 3)
    line = next(x for x in said.computed if "its error counts harmonic" in x)
    assert "harmonic 0, 1 of" in line
    assert line.count(",") == count  # one more than between the labels: that of the harmonics
    mixed = "harmonics.alert_over mixes rotations (damper.rx) with displacements (tip1.x, damper.z)"
    assert any(x.startswith(mixed) for x in said.doubts) == ("damper.rx" in over)
    (case,) = study.cases()
    model = analysis.FORCED_RESPONSE.inputs(case, case.build()).model
    labels = np.array(model.system.structure.dofs.labels)
    assert model.system.alert_dofs is not None
    assert [x.rpartition(".")[2] for x in labels[model.system.alert_dofs]] == [
        x.rpartition(".")[2] for x in model.error_labels
    ]


def test_check_tells_of_strategies_that_take_no_double_passage(base: Study) -> None:
    said = "\n".join(check(changed(base, {"selection": "grolet"}, "grolet")).computed)
    assert "single passage: each frequency is settled before the next one" in said
    assert 'passages = "double" and alert_threshold_percent are not used' in said


def test_check_tells_where_resonances_are_and_what_it_will_cost(base: Study) -> None:
    said = check(base)
    assert said.computed[0] == "sweep: 179.80 to 181.40 Hz"
    cost = (
        r"estimate: about \d+ s for the parts, once, then [\d.]+ s to solve this case, at most [\d.]+ (s|min)",
        r"estimate: contacts slip at the resonance \(stuck, a friction force would be [\d.]+ times its limit\)",
        r"estimate: harmonics are uncertain, here H = 15, at most H = 41 at 10 % of \d+ points",
        r"estimate: at most \d+ Newton steps, \d+ unknowns, [\d.]+ GB of memory",
        r"estimate: stability, audits and time integration come on top; doubted points take up to 120 s a case",
        r"estimate: limits\.work_s is compared with \d+ s",
    )
    for pattern, line in zip(cost, said.computed[1:7], strict=True):
        assert re.fullmatch(pattern, line), line
    assert any(re.match(r"natural frequencies, contacts stuck: .* Hz (in the range|above)", x) for x in said.beside)
    assert said.at_rest[0].startswith("static equilibrium: 9 of 9 contact points are pressed")
    assert said.at_rest[1].startswith("contact flat: 6 of 6 closed, ")
    assert "damper: flat can slip to and fro, T/N reaches the friction coefficient 0.6" in said.at_rest
    assert said.doubts == ()
    beside = check(changed(base, {}, "beside", frequency_hz=[20.0, 30.0]))
    assert any("no natural frequency lies between 20.00 and 30.00 Hz" in x for x in beside.doubts)


def test_the_options_of_a_rival_reach_the_response(tmp_path: Path) -> None:
    keys = {
        "harmonics.selection": '"grolet"',
        "harmonics.high": "5",
        "harmonics.strategy_threshold": "1e-6",
        "forced_response.frequencies": "10",
    }
    solved = {}
    for options in ({}, {"per_dof": "true"}, {"per_dof": "true", "repeats": "true"}):
        own = keys | {f"harmonics.{name}": value for name, value in options.items()}
        study = read_study(write_four_masses(tmp_path / "_".join(options), own))
        assert study.tables.harmonics.chooser == Grolet(threshold=1e-6, **dict.fromkeys(options, True))
        solved[tuple(options)] = int(run(study).data.unknowns_solved.sum())
    # of each coordinate by itself fewer are kept, and what is repeated is solved twice
    assert solved[("per_dof",)] < solved[()]
    assert solved[("per_dof",)] < solved[("per_dof", "repeats")]


REFUSED = {
    "unknown strategy": (
        {"selection": "jacobian_allert"},
        "harmonics.selection: is not known, got 'jacobian_allert'. Did you mean 'jacobian_alert'?",
    ),
    "threshold of another kind": (
        {"selection": "jacobian_alert", "strategy_threshold": 0.1},
        (
            "harmonics.strategy_threshold: is not for jacobian_alert, which predicts an error, got 0.1. "
            "Give alert_threshold_percent instead."
        ),
    ),
    "threshold of nothing": (
        {"selection": "always_low", "strategy_threshold": 0.1},
        "harmonics.strategy_threshold: has no meaning for selection = 'always_low', got 0.1. Remove it: nothing is decided.",
    ),
    "harmonics of each dof by a rule that knows none": (
        {"selection": "laxalde", "per_dof": True},
        "harmonics.per_dof: has no meaning for selection = 'laxalde', got true. Remove it, or choose one of grolet, maple.",
    ),
    "repeats of a rule that repeats anyway": (
        {"selection": "maple", "repeats": True},
        "harmonics.repeats: has no meaning for selection = 'maple', got true. Remove it, or choose one of grolet, laxalde, suess_jacobian, suess_spectral.",
    ),
    "threshold below nothing": (
        {"alert_threshold_percent": -5},
        (
            "harmonics.alert_threshold_percent: must be greater than 0, got -5. It means: a percentage greater than zero: "
            "frequencies whose predicted error is larger get more harmonics (for selections that predict an error)."
        ),
    ),
    "harmonics of no kind": (
        {"low": 0},
        "harmonics.low: must be a harmonic from 1 to 200 or a list of them, got 0. 5 keeps all up to the fifth",
    ),
    "harmonics in words": (
        {"high": [1, "3"]},
        (
            "harmonics.high: must be 'auto', a harmonic from 1 to 200 or a list of them, got [1, '3']. "
            "'auto' raises them until each point is quiet; 5 keeps all"
        ),
    ),
    "harmonics by a wrong name": (
        {"high": "automatic"},
        "harmonics.high: must be 'auto', a harmonic from 1 to 200 or a list of them, got 'automatic'.",
    ),
    "auto for the first passage": (
        {"low": "auto"},
        "harmonics.low: must be a harmonic from 1 to 200 or a list of them, got 'auto'. 5 keeps",
    ),
    "high without low": (
        {"low": [1, 2], "high": [1, 3, 5]},
        "harmonics.high: must hold every harmonic of low = [1, 2], got [1, 3, 5]. Add 2, or leave that out of low.",
    ),
    "error of what is not kept": (
        {"alert_harmonics": [1, 3]},
        "harmonics.alert_harmonics: names harmonic 3, which low = 1 does not keep: nothing is known of its error. Add it to low",
    ),
    "no such place": (
        {"alert_over": "contact"},
        "harmonics.alert_over: must be answer, along, outputs, contacts or a list of labels, got 'contact'. Did you mean 'contacts'?",
    ),
    "no such passages": ({"passages": "triple"}, "harmonics.passages: is not known, got 'triple'."),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_with_a_remedy(base: Study, name: str) -> None:
    harmonics, message = REFUSED[name]
    with pytest.raises(InputError) as error:
        changed(base, harmonics, "refused")
    assert f"{base.path}: {message}" in str(error.value)


@pytest.mark.parametrize(
    ("harmonics", "message"),
    [
        ({"low": [3]}, "load.shaker.harmonic: 1 is not kept by harmonics.low = [3]. Add it there, or leave that out."),
        ({"high": [3, 5]}, "load.shaker.harmonic: 1 is not kept by harmonics.high = [3, 5]. Add it there."),
        ({"alert_over": ["tip1.x", "L1.9.x"]}, "'L1.9.x'"),
    ],
    ids=["force left out", "force left out of all", "no such label"],
)
def test_what_does_not_fit_the_model_is_refused_with_a_remedy(
    base: Study, harmonics: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError) as error:
        run(changed(base, harmonics, "unfit"))
    assert message in str(error.value)


def test_one_frequency_is_no_sweep(base: Study) -> None:
    with pytest.raises(InputError, match=r"forced_response.frequencies: must be greater than or equal to 2, got 1\."):
        changed(base, {}, "one", frequencies=1)


def test_the_result_tells_the_facts_of_its_model_and_the_log_how_well_it_is_reduced(tmp_path: Path) -> None:
    forces = {"vary.load.shaker.force_n": "[0.5, 0.6]"}
    study = read_study(write_four_masses(tmp_path, forces))
    outcome = run_study(study)
    told = outcome.tree["forced_response"].attrs
    assert told["mass_kg"] == pytest.approx(study.model().facts.mass)
    assert told["dofs"] == 4
    assert told["retained"] == 3
    assert told["rotation"] == "matrices as read, unchanged by speed"
    log = (study.folder / "run.log").read_text(encoding="utf-8")
    assert log.count("free mode 1: full") == log.count("stuck mode 1: full") == 1
