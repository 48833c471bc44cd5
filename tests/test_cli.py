"""The commands: exit codes, messages without tracebacks, and a light start."""

import json
import shutil
import subprocess
import sys
from collections import namedtuple
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_study import write_small_study
from typer.testing import CliRunner, Result

import stickslip
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.response.forced.response import ForcedPoint
from stickslip.solve.status import Status
from stickslip.study import threads
from stickslip.study.chooser import Chooser
from stickslip.study.collect import Accepted, CaseResult
from stickslip.study.example import example_text
from stickslip.study.folder import prepare_folder
from stickslip.study.journal import Journal
from stickslip.study.progress import library_versions
from stickslip.study.reference_check import ReferenceDoubt
from stickslip.study.run import fingerprint
from stickslip.study.schema import read_study
from stickslip.study.summary import choice_sentence

HEAVY = ("numpy", "scipy", "numba", "xarray", "pydantic", "plotly", "gmsh", "skfem", "meshio")


@pytest.mark.parametrize("said", [{}, {"OMP_NUM_THREADS": "4"}, {"OPENBLAS_NUM_THREADS": "2"}])
def test_a_run_gives_blas_one_thread_unless_told_otherwise(monkeypatch, said):
    environment = dict(said)
    monkeypatch.setattr(threads.os, "environ", environment)
    threads.one_blas_thread()
    one = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    assert environment == (said or one)


def invoke(*words: str) -> Result:
    return CliRunner().invoke(app, list(words))


def refused(*words: str) -> str:
    """Return what a command says that must end with exit code 2 and without a traceback."""
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    return result.stderr.strip()


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["run", "--help"], ["new", "made"]])
def test_light_commands_load_nothing_heavy(tmp_path: Path, words: list[str]) -> None:
    # typer itself takes pydantic to convert arguments; --help alone is free of it
    heavy = HEAVY if words == ["--help"] else tuple(m for m in HEAVY if m != "pydantic")
    program = (
        f"import sys; sys.argv = ['stickslip', *{words!r}]\n"
        "from stickslip.cli import main\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        f"print([m for m in {heavy!r} if m in sys.modules], file=sys.stderr)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert ended.stderr.strip() == "[]"


def test_version() -> None:
    assert invoke("--version").output == f"stickslip {stickslip.__version__}\n"


def test_unknown_command_and_option_are_bad_input() -> None:
    assert "No such command 'runn'" in refused("runn")
    assert "No such option" in refused("run", "x.toml", "--quick")


def test_schema_is_printed_as_json() -> None:
    assert json.loads(invoke("schema").output)["title"] == "StudyTables"


def test_new_writes_the_example_and_overwrites_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "two"
    result = invoke("new", str(folder))
    assert result.exit_code == 0
    assert (folder / "study.toml").read_text(encoding="utf-8") == example_text()
    (folder / "study.toml").write_text("mine")
    said = refused("new", str(folder))
    assert (
        said
        == f"{folder / 'study.toml'}: exists already. Give another name: nothing is overwritten."
    )
    assert (folder / "study.toml").read_text() == "mine"


def test_new_in_a_place_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = refused("new", str(tmp_path / "file" / "two"))
    assert (
        "study.toml: cannot be written (Not a directory). Give a folder you may write to." in said
    )


@pytest.mark.parametrize("command", ["run", "check"])
def test_missing_study(tmp_path: Path, command: str) -> None:
    path = tmp_path / "none.toml"
    assert refused(command, str(path)) == (
        f"{path}: there is no such file. Check the name, or write an example with 'stickslip new NAME'."
    )


def test_bad_study_is_told_line_by_line(tmp_path: Path) -> None:
    path = write_small_study(tmp_path, mass_kg="-0.1", frequency_hz="[220.0, 150.0]")
    assert [line.split(": ")[1] for line in refused("check", str(path)).splitlines()] == [
        "damper.mass_kg",
        "sweep.frequency_hz",
    ]


def test_output_folder_that_cannot_be_made(tmp_path: Path) -> None:
    path = write_small_study(tmp_path)
    (tmp_path / "results").write_text("a file where the folder should be")
    assert refused("run", str(path)) == (
        f"output folder {tmp_path.resolve() / 'results'}: cannot be written (File exists). "
        "Change its permissions, or name another folder under [output]."
    )


def test_full_disk_is_told_before_anything_is_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usage = namedtuple("usage", "total used free")(10**9, 10**9 - 10**6, 10**6)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with pytest.raises(
        InputError, match=r"its disk has 1 MB free, a run needs up to 200 MB\. Make room"
    ):
        prepare_folder(tmp_path / "results", fresh=False)


def test_fresh_removes_what_a_run_writes_and_nothing_else(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("journal.sqlite", "result.nc", "notes.txt"):
        (folder / name).write_text("")
    prepare_folder(folder, fresh=True)
    assert [p.name for p in folder.iterdir()] == ["notes.txt"]


def leave_journal(path: Path) -> None:
    """Leave what a run of this study leaves when it is stopped."""
    study = read_study(path)
    prepare_folder(study.folder, fresh=False)
    mark = fingerprint(study, library_versions())
    with Journal(study.folder / "journal.sqlite", mark, ForcedPoint) as journal:
        journal.put("blades", {"n": 1})


def test_results_of_another_study_are_not_mixed(tmp_path: Path) -> None:
    path = write_small_study(tmp_path)
    leave_journal(path)
    write_small_study(tmp_path, centrifugal_n="440.0")
    assert "what this command left here is of another or a changed study" in refused(
        "run", str(path)
    )


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("alert_over", '["tip3.x"]', "harmonics.alert_over: 'tip3.x' is neither an output"),
        ("airfoil_size_m", "1e-5", "limits.memory_gb: the run is estimated at"),
        ("sections_m", "[-0.2, 0.0, 0.016]", "non-matching node sets"),
    ],
)
def test_what_needs_no_mesh_is_refused_before_the_folder_is_touched(
    tmp_path: Path, key: str, value: str, said: str
) -> None:
    path = write_small_study(tmp_path, **{key: value})
    assert said in refused("run", str(path))
    assert not (tmp_path / "results").exists()
    leave_journal(path)
    kept = tmp_path / "results" / "result.nc"
    kept.write_text("of an earlier run")
    assert said in refused("run", str(path), "--fresh")
    assert kept.read_text() == "of an earlier run"
    assert kept.with_name("journal.sqlite").is_file()


def planar_friction(path: Path, *sides: str) -> Path:
    """Give sides of a study's damper coupled_coulomb."""
    text = path.read_text(encoding="utf-8")
    for side in sides:
        begin = text.index(f"[contact.{side}]")
        end = text.index("\n\n", begin)
        changed = text[begin:end].replace("elastic_coulomb", "coupled_coulomb")
        changed = changed.replace("axial_stiffness_n_per_m = 450e6\n", "")
        text = text[:begin] + changed + text[end:]
    path.write_text(text, encoding="utf-8")
    return path


def test_other_law_and_evaluator_from_a_file_to_the_result(tmp_path: Path) -> None:
    path = planar_friction(write_small_study(tmp_path, evaluator='"intervals"'), "flat")
    ended = invoke("run", str(path), "--no-report")
    assert ended.exit_code == 0, ended.output
    with xr.open_dataset(tmp_path / "results" / "result.nc") as data:
        assert data.attrs["evaluator"] == "intervals"
        assert list(data.contact_law.values) == ["coupled_coulomb"] * 6 + ["elastic_coulomb"] * 3
        assert int(data.points_failed.sum()) == 0
        # the static force stands on the limit, along the radius of the disc
        force = data.static_force.sel(contact=[f"L{i}.{j}" for i in (1, 2) for j in (1, 2, 3)])
        friction = np.hypot(force.sel(direction="t"), force.sel(direction="w"))
        np.testing.assert_allclose(friction, -0.6 * force.sel(direction="n"), rtol=1e-3)
        # under so faint a harmonic force the contacts are springs: the peak is the mode with the springs of both laws
        modes = data.frequency_stuck_reduced_hz.values
        assert np.min(np.abs(modes / data.peak_frequency_hz.values[0] - 1.0)) < 1e-3


@pytest.mark.parametrize("fresh", [(), ("--fresh",)])
def test_time_integration_of_other_laws_is_refused_before_anything_is_done(
    tmp_path: Path, fresh: tuple[str, ...]
) -> None:
    path = planar_friction(write_small_study(tmp_path), "flat", "curved")
    kept = tmp_path / "results" / "result.nc"
    kept.parent.mkdir()
    kept.write_text("of an earlier run")
    said = refused("run", str(path), "--verify", *fresh).splitlines()
    assert said == [
        (
            f"{path}: contact.{side}.law: --verify integrates in time, which knows elastic_coulomb alone, got 'coupled_coulomb'. "
            "Run without --verify, or give the law elastic_coulomb."
        )
        for side in ("flat", "curved")
    ]
    assert [p.name for p in kept.parent.iterdir()] == ["result.nc"]
    assert kept.read_text() == "of an earlier run"


def test_results_of_another_law_or_evaluator_are_not_mixed(tmp_path: Path) -> None:
    leave_journal(write_small_study(tmp_path))
    for changed in (
        write_small_study(tmp_path, evaluator='"march"'),
        planar_friction(write_small_study(tmp_path), "curved"),
    ):
        assert "what this command left here is of another or a changed study" in refused(
            "run", str(changed)
        )


def test_run_that_costs_too_much_is_refused_before_meshing(tmp_path: Path) -> None:
    path = write_small_study(tmp_path, airfoil_size_m="1e-5")
    said = refused("check", str(path))
    assert f"{path}: limits.memory_gb: the run is estimated at" in said
    assert (
        "the limit is 4 GB. Take a coarser mesh, fewer points, ratios or harmonics, or raise the limit."
        in said
    )
    path = write_small_study(tmp_path, work_s="1e-3")
    said = refused("check", str(path))
    assert f"{path}: limits.work_s: the run is estimated at" in said
    assert "the limit is 0.001 s." in said


def test_node_sets_that_do_not_match_are_named(tmp_path: Path) -> None:
    path = write_small_study(tmp_path)
    text = path.read_text().replace("[damper]\n", "[damper]\nflat_angle_deg = 40.0\n")
    path.write_text(text)
    said = refused("check", str(path))
    assert f"{path}: [blades] with [damper]: " in said
    assert (
        "non-matching node sets: these contact points of the damper are not on a platform's underside: L1.1 at"
        in said
    )
    assert "L2.3 at" in said
    assert "R.1" not in said


def test_report_of_nothing(tmp_path: Path) -> None:
    said = refused("report", str(tmp_path))
    assert str(tmp_path / "result.nc") in said


def first_passage(index: int, hertz: float, error: float) -> ForcedPoint:
    """Return a point with a predicted error (a fraction)."""
    return ForcedPoint(
        "low", index, 2 * np.pi * hertz, np.zeros((2, 1), dtype=complex), np.zeros(2), 0.1, Status.CONVERGED,
        3, error, 0.0, 0.0, 0.0, harmonics=np.arange(2), asked=np.arange(6 if error > 0.05 else 0),
    )  # fmt: skip


def told(errors: list[float]) -> str:
    """Return what is said of a load case whose points over the threshold a branch with many harmonics replaced."""
    passage = [first_passage(i, 100.0 + i, e) for i, e in enumerate(errors)]
    branch = [replace(p, stage="branch", predicted_error=np.nan) for p in passage]
    kept = tuple(Accepted(p, None, None, None, np.nan) for p in branch)
    solved = (*passage, *branch)
    result = CaseResult(4.0, 1.0, solved, kept, -1, None, 0, (0, 1))
    alert = Chooser("jacobian_alert", False, (0, 1), tuple(range(6)), 0.05, True, ("tip1.x",))
    return choice_sentence(result, alert)


def test_alert_is_told_where_a_branch_took_the_place_of_the_points_it_was_asked_at() -> None:
    assert told([0.01, 0.06, 0.31, 0.02]) == (
        "F_CL/F_HE = 4: 2 of 4 points repeated with 5 harmonics, at 101.00 to 102.00 Hz, because leaving the higher harmonics out "
        "was predicted to change the response by more than 5 % (largest: 31 % at 102.00 Hz)."
    )
    assert "no frequency needs more harmonics; the largest predicted error is 2 %" in told(
        [0.01, np.nan, 0.02]
    )
    assert "(largest: over 100 % at 101.00 Hz)" in told([0.01, 11.3])
    assert told([np.nan]) == "F_CL/F_HE = 4: jacobian_alert was not asked."
    assert "(largest: over 100 % at 101.00 Hz)" in told([0.01, np.inf])


@pytest.mark.parametrize(
    ("harmonics", "high", "advice"),
    [
        (10, (0, 1, 2, 3, 4, 5), "Raise harmonics.high, for instance to 10, and compare; a solution then has 21 unknowns"),
        (10, (0, 1, 3, 5), "harmonics.high leaves out 2, 4: keep them, and compare; a solution then has 11 unknowns"),
        (40, tuple(range(21)), "Raise harmonics.high, for instance to 30, and compare; a solution then has 61 unknowns"),
        (60, tuple(range(31)), "No study keeps more than 30 harmonics"),
    ],
)  # fmt: skip
def test_advice_names_the_harmonics_that_a_study_can_keep(
    harmonics: int, high: tuple[int, ...], advice: str
) -> None:
    errors = np.array([0.01, np.nan, 2.0])
    doubt = ReferenceDoubt(4.0, harmonics, high, 0.05, errors, 178.0, "5", "tip1.x")
    assert "the largest change is over 100 % of tip1.x at 178.00 Hz" in doubt.sentence
    assert "1 of 2 solutions" in doubt.sentence
    assert "complex amplitude, phase included" in doubt.sentence
    assert advice in doubt.warning
    assert replace(doubt, errors=errors[:2]).warning == ""
