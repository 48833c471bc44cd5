"""Harmonic selection as a user meets it: any strategy and any harmonics from a study file to result, page and resumed run."""

import json
import sqlite3
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_study import write_small_study
from stickslip.report.choice import choice
from stickslip.report.figure_harmonics import kept_harmonics
from stickslip.report.figures_error import errors
from stickslip.report.result import load_result
from stickslip.report.summary import headline
from typer.testing import CliRunner, Result

from stickslip.cli import app
from stickslip.harmonic.selection import STRATEGIES, strategy_named
from stickslip.harmonic.selection.strategy import always_kept
from stickslip.response.forced.sweep import Sweep
from stickslip.study import build
from stickslip.study import run as run_module
from stickslip.study.blades import ReducedBlades, reduced_blades
from stickslip.study.collect import NO_SHIFT
from stickslip.study.example import example_text
from stickslip.study.harmonics_table import SELECTIONS
from stickslip.study.schema import json_schema, read_study

# a damper that slips around the peak, at few frequencies
SLIPPING = {"ratios": "[20]", "frequency_hz": "[177.6, 179.2]", "points": "4", "peak_points": "0"}
FIXED = tuple(n for n in STRATEGIES if always_kept(strategy_named(n)))
ALONE = tuple(n for n in STRATEGIES if n not in FIXED and not strategy_named(n).verifies)
# one of those that go through the frequencies alone in every run of the tests, the others with the long ones
JOURNEYS = [
    pytest.param(name, marks=pytest.mark.validation) if name in ALONE[1:] else name
    for name in SELECTIONS
]


def write_study(folder: Path, harmonics: str = "", sweep: str = "frequencies = 2") -> Path:
    """Write a small study; `harmonics` and `sweep` are lines of their tables, in place of the example's."""
    path = write_small_study(folder, **SLIPPING)
    lines = path.read_text(encoding="utf-8").splitlines()
    given = {line.partition(" = ")[0] for line in harmonics.splitlines()}
    lines = [line for line in lines if line.partition(" = ")[0] not in given]
    for table, added in (("[harmonics]", harmonics), ("[sweep]", sweep)):
        place = next(i for i, line in enumerate(lines) if line.startswith(table))
        lines[place + 1 : place + 1] = added.splitlines()
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def blades(tmp_path_factory: pytest.TempPathFactory) -> ReducedBlades:
    """Mesh and reduce the blades once: selections do not touch them."""
    study = read_study(write_study(tmp_path_factory.mktemp("blades")))
    damper = study.tables.damper.library(study.tables.blades.library())
    return reduced_blades(study, damper, None, lambda _: None)


@pytest.fixture(autouse=True)
def same_blades(blades: ReducedBlades, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "reduced_blades", lambda *_: blades)
    # following the peak with less retention costs more than all else here, and is not what is tested
    monkeypatch.setattr(run_module, "peak_shift", lambda *_: NO_SHIFT)


def invoke(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def run(study: Path, *options: str) -> tuple[xr.Dataset, str]:
    """Run a study without its page; return the result and what was printed."""
    ended = invoke("run", str(study), "--no-report", *options)
    assert ended.exit_code == 0, ended.output
    with xr.open_dataset(study.parent / "results/result.nc") as data:
        return data.load(), ended.output


def forget_after(study: Path, kept: int) -> int:
    """Leave the first points of a run in its journal, as a killed one does; return how many there were."""
    db = sqlite3.connect(study.parent / "results/journal.sqlite")
    rows = [i for (i,) in db.execute("select id from point order by id")]
    db.execute("delete from point where id > ?", (rows[kept - 1],))
    db.execute("delete from record where name like 'finished%' or name like 'retention%'")
    db.commit()
    db.close()
    return len(rows)


def test_study_and_library_have_one_default(tmp_path: Path) -> None:
    default = Sweep(omega_range=(1.0, 2.0)).selection
    assert read_study(write_small_study(tmp_path / "a")).tables.harmonics.selection == default
    silent = write_small_study(tmp_path / "b")
    text = "".join(
        line
        for line in silent.read_text(encoding="utf-8").splitlines(keepends=True)
        if not line.startswith("selection")
    )
    silent.write_text(text, encoding="utf-8")
    assert read_study(silent).tables.harmonics.selection == default
    assert f'selection = "{default}"' in example_text()


def test_editors_are_offered_every_strategy() -> None:
    key = json.loads(json_schema())["$defs"]["Harmonics"]["properties"]["selection"]
    assert key["enum"] == [*STRATEGIES]
    assert all(name in key["description"] for name in SELECTIONS)


@pytest.mark.parametrize("name", JOURNEYS)
def test_every_strategy_from_a_file_to_result_and_page(tmp_path: Path, name: str) -> None:
    study = write_study(tmp_path, f'selection = "{name}"\nhigh = 3')
    data, said = run(study)
    alone = name in ALONE
    assert data.attrs["selection"] == name
    assert data.attrs["passages"] == ("single" if alone else "double")
    assert list(np.atleast_1d(data.attrs["high_harmonics"])) == [0, 1, 2, 3]
    kept = data.harmonic_kept.values
    assert np.all(kept[:, :2] == 1), "the static term and what the force drives are always kept"
    # a solution is zero in harmonics that it does not keep and in no other that the contacts excite
    parts = np.abs(data.output_displacement.values).sum(axis=(2, 3))
    assert np.all(parts[kept == 0] == 0.0)
    assert np.all(parts[:, :2] > 0.0)
    np.testing.assert_array_equal(
        data.unknowns.values, data.sizes["retained"] * (2 * kept.sum(axis=1) - 1)
    )
    assert int(data.unknowns_solved[0]) == int(data.attempt_unknowns.sum())
    assert ("alert_error_percent" in data) == (name not in (*ALONE, *FIXED))
    if alone:
        assert not np.any(np.isfinite(data.predicted_error_percent.values))
    everywhere = (
        data.sizes["point"] * data.sizes["retained"] * 7
    )  # three harmonics and the static term
    cost = f"{int(data.attempt_unknowns.sum())} unknowns were solved in all; H = 3 everywhere would be about"
    if name not in FIXED:
        assert f"Where {name} asked for more harmonics" in said
    result = load_result(tmp_path / "results/result.nc")
    drawn = kept_harmonics(result).figure
    assert drawn is not None
    marks = {(x, y) for x, y in zip(drawn.data[0].x, drawn.data[0].y, strict=True)}
    hz = data.frequency_hz.values
    assert marks == {(hz[i], h) for i, h in zip(*np.nonzero(kept), strict=True) if h > 0}
    assert (errors(result).figure is None) == (name in FIXED)
    page = choice(result) + headline(result)
    assert name in page
    for told in (said, page):
        assert (cost in told) == (f" = {everywhere} (an estimate" in told) == (name not in FIXED)
    assert ("predicted error" in page) == (name not in (*ALONE, *FIXED))


@pytest.mark.parametrize(
    ("harmonics", "after"),
    [
        ('selection = "maple"\nhigh = 4', 2),
        pytest.param(
            'selection = "jacobian_alert"\npassages = "single"\nhigh = 3',
            2,
            marks=pytest.mark.validation,
        ),
        ('selection = "jacobian_alert"\nlow = [1]\nhigh = [1, 3, 5]', 3),
    ],
    ids=["single passage", "alert in a single passage", "list of harmonics"],
)
def test_resumed_run_gives_the_same_bits(tmp_path: Path, harmonics: str, after: int) -> None:
    study = write_study(tmp_path, harmonics, "frequencies = 3")
    whole, _ = run(study)
    count = forget_after(study, after)
    assert count > after, "nothing is left to do again"
    again, said = run(study)
    assert f"{after} points are taken from the earlier start" in said
    assert set(whole.data_vars) == set(again.data_vars)
    for key in whole.data_vars:
        if "seconds" not in str(key):
            np.testing.assert_array_equal(again[key].values, whole[key].values, err_msg=str(key))


@pytest.mark.validation
def test_odd_harmonics_alone_are_solved_and_shown(tmp_path: Path) -> None:
    study = write_study(tmp_path, 'selection = "always_high"\nhigh = [1, 3, 5]')
    data, said = run(study, "--verify-harmonics")
    assert data.harmonic_kept.values.tolist() == [[1, 1, 0, 1, 0, 1]] * data.sizes["point"]
    assert "H = 1, 3, 5" in said
    # the even ones that the study leaves out are among those that it is held against
    error = data.reference_error_percent.values
    assert np.all(np.isfinite(error))
    assert float(data.reference_worst_percent[0]) == np.max(error)
    assert f"against 10 harmonics, {int(np.sum(error > 5))} of {error.size} solutions" in said
    assert ("harmonics.high leaves out 2, 4: keep them" in said) == bool(np.any(error > 5))
    full, _ = run(write_study(tmp_path / "full", 'selection = "always_high"\nhigh = 5'))
    # what they change at all, the check must have foretold within its order of magnitude
    change = np.abs(full.amplitude.values[:, 0] / data.amplitude.values[:, 0] - 1)
    assert 100 * change.max() < 3 * error.max()


@pytest.mark.parametrize(
    "over",
    [
        '"outputs"',
        '"contacts"',
        '["tip1.x", "L1.1.z", "damper.x"]',
        '["tip1.x", "damper.z", "damper.rx"]',
    ],
)
def test_error_is_taken_where_the_study_says(tmp_path: Path, over: str) -> None:
    study = write_study(tmp_path, f"alert_over = {over}\nalert_harmonics = [0, 1]")
    ended = invoke("check", str(study))
    assert ended.exit_code == 0, ended.output
    count = {'"outputs"': 9, '"contacts"': 27}.get(over, 3)
    line = next(x for x in ended.output.splitlines() if "its error is that of" in x)
    assert "harmonic 0, 1 over" in line
    assert line.count(",") == count  # one more than between the labels: that of the harmonics
    mixed = "WARNING: harmonics.alert_over mixes rotations (damper.rx) with displacements (tip1.x, damper.z)"
    assert (mixed in ended.output) == ("damper.rx" in over)
    assert ("WARNING" in ended.output) == ("damper.rx" in over)
    case = build.case_of(read_study(study), None, lambda _: None)
    labels = np.array(case.system.structure.dofs.labels)
    assert case.system.alert_dofs is not None
    assert [x.rpartition(".")[2] for x in labels[case.system.alert_dofs]] == [
        x.rpartition(".")[2] for x in case.error_labels
    ]


def test_check_tells_of_strategies_that_take_no_double_passage(tmp_path: Path) -> None:
    said = invoke("check", str(write_study(tmp_path, 'selection = "grolet"'))).output
    assert "single passage: each frequency is settled before the next one" in said
    assert 'passages = "double" and alert_threshold_percent are not used' in said


REFUSED = {
    "unknown strategy": (
        'selection = "jacobian_allert"',
        "harmonics.selection: is not known, got 'jacobian_allert'. Did you mean 'jacobian_alert'?",
    ),
    "threshold of another kind": (
        'selection = "jacobian_alert"\nstrategy_threshold = 0.1',
        (
            "harmonics.strategy_threshold: is not for jacobian_alert, which predicts an error, got 0.1. "
            "Give alert_threshold_percent instead."
        ),
    ),
    "threshold of nothing": (
        'selection = "always_low"\nstrategy_threshold = 0.1',
        "harmonics.strategy_threshold: has no meaning for selection = 'always_low', got 0.1. Remove it: nothing is decided.",
    ),
    "threshold below nothing": (
        "alert_threshold_percent = -5",
        (
            "harmonics.alert_threshold_percent: must be greater than 0, got -5. Give a percentage greater than zero: "
            "frequencies whose predicted error is larger get more harmonics (for selections that predict an error)."
        ),
    ),
    "harmonics of no kind": (
        "low = 0",
        "harmonics.low: must be a harmonic from 1 to 30 or a list of them, got 0. 5 keeps all up to the fifth",
    ),
    "harmonics in words": (
        'high = [1, "3"]',
        "harmonics.high: must be a harmonic from 1 to 30 or a list of them, got [1, '3']. 5 keeps all",
    ),
    "high without low": (
        "low = [1, 2]\nhigh = [1, 3, 5]",
        "harmonics.high: must hold every harmonic of low = [1, 2], got [1, 3, 5]. Add 2, or leave that out of low.",
    ),
    "force left out": (
        "low = [3]",
        "harmonics.low: must hold harmonic 1, which the force drives, got [3]. Add it, for example low = [1, 3].",
    ),
    "error of what is not kept": (
        "alert_harmonics = [1, 3]",
        "harmonics.alert_harmonics: names harmonic 3, which low = 1 does not keep: nothing is known of its error. Add it to low",
    ),
    "no such place": (
        'alert_over = "contact"',
        "harmonics.alert_over: must be along, outputs, contacts or a list of labels, got 'contact'. Did you mean 'contacts'?",
    ),
    "no such label": (
        'alert_over = ["tip1.x", "L1.9.x"]',
        "harmonics.alert_over: 'L1.9.x' is neither an output nor a contact point's or the damper's motion. Did you mean 'L1.",
    ),
    "no such passages": (
        'passages = "triple"',
        "harmonics.passages: is not known, got 'triple'.",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused_with_a_remedy(tmp_path: Path, name: str) -> None:
    harmonics, message = REFUSED[name]
    study = write_study(tmp_path, harmonics)
    ended = invoke("check", str(study))
    assert ended.exit_code == 2, ended.output
    assert f"{study}: {message}" in ended.stderr


def test_one_frequency_is_no_sweep(tmp_path: Path) -> None:
    ended = invoke("check", str(write_study(tmp_path, sweep="frequencies = 1")))
    assert ended.exit_code == 2
    assert "sweep.frequencies: must be greater than or equal to 2, got 1." in ended.stderr
