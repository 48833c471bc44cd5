"""The comparison of two trees finds what differs, whichever door it comes through, and leaves out what no two runs share."""

import sqlite3
import subprocess
import tomllib
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from evidence.baseline import interrupted
from evidence.baseline.differences import compared, differing_folders
from evidence.baseline.results import differing_results
from evidence.baseline.studies import EXAMPLES, Example, changed, examples, toml_text
from evidence.baseline.texts import differing_lines, page_lines, terminal_lines
from evidence.baseline.trees import ROOT, Tree, sources_at_work, sources_of_commit, unpacked

# a package that answers any study with the files that lie beside it
PACKAGE = b"""
import pathlib, shutil
answers = pathlib.Path(__file__).parent / "answers"
shutil.copytree(answers, "results")
print((answers / "run.log").read_text())
"""
SENTENCE = "a stable peak"


def fake_tree(
    folder: Path,
    second: float = 2.0,
    seconds: float = 2.5,
    sentence: str = SENTENCE,
    *,
    phase: bool = True,
) -> Tree:
    """Return sources whose every answer is two amplitudes, two phases, two times and a sentence."""
    node = xr.Dataset(
        {
            "amplitude": ("point", [1.0, second]),
            "phase": ("point", [0.0, np.nan]),
            "seconds": ("point", [seconds, 1.0]),
        },
        attrs={"verdict": sentence},
    )
    root = xr.Dataset(attrs={"created": f"at {seconds}", "title": "Two points"})
    xr.DataTree.from_dict({"/": root, "/forced_response": node if phase else node.drop_vars("phase")}).to_netcdf(
        folder / "result.nc", engine="h5netcdf"
    )
    page = (
        f"<p>{sentence}</p><table><tr><th>peak</th><th>time (s)</th></tr><tr><td>1</td><td>{seconds}</td></tr></table>"
    )
    log = f"2026-11-27T11:00:{seconds:02.0f}+00:00 {sentence} ({seconds} s)"
    answers = {
        "result.nc": (folder / "result.nc").read_bytes(),
        "report.html": page.encode(),
        "run.log": log.encode(),
    }
    sources = {"__init__.py": b"", "__main__.py": PACKAGE} | {
        f"answers/{name}": content for name, content in answers.items()
    }
    return unpacked("fake", {f"src/stickslip/{name}": content for name, content in sources.items()}, folder)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({}, []),
        ({"seconds": 31.0}, []),
        (
            {"second": 2.0000000000000004},
            ["/forced_response/amplitude: 1 of 2 values differ, first [1]: 2.0, now 2.0000000000000004"],
        ),
        ({"phase": False}, ["/forced_response/phase: no such variable any more"]),
        (
            {"sentence": "an unstable peak"},
            [
                "-a stable peak",
                "+an unstable peak",
                "/forced_response@verdict: 1 of 1 values differ, first []: 'a stable peak', now 'an unstable peak'",
                "-<time> a stable peak (<time>)",
                "+<time> an unstable peak (<time>)",
                "-<time> a stable peak (<time>)",
                "+<time> an unstable peak (<time>)",
            ],
        ),
    ],
    ids=["the same", "a time", "a bit", "a variable", "a sentence"],
)
def test_two_trees_are_told_apart_by_all_but_times(tmp_path, changes, found):
    trees = (fake_tree(tmp_path), fake_tree(tmp_path, **changes))
    comparison = compared(Example("four_masses"), trees, tmp_path)
    assert [line for line in comparison.differences if not line.startswith(("---", "+++", "@@", " "))] == found
    assert comparison.compared == 3


def test_a_file_that_one_tree_alone_writes_is_found(tmp_path):
    for side in ("old", "new"):
        (tmp_path / side).mkdir()
    (tmp_path / "old" / "report.html").write_text("<p>a page</p>")
    assert differing_folders(tmp_path / "old", tmp_path / "new") == (
        ["report.html: written by the old tree alone"],
        0,
    )


def test_kinds_dimensions_bits_and_texts_of_variables_count():
    def lines(old, new):
        return differing_results({"/": xr.Dataset({"a": old})}, {"/": xr.Dataset({"a": new})})

    values = ("x", np.array([0.0, np.nan]))
    assert lines(values, values) == []
    assert lines(values, ("y", values[1])) == ["//a: dimensions {'x': 2}, now {'y': 2}"]
    assert lines(values, ("x", values[1].astype(np.float32))) == ["//a: kind float64, now float32"]
    assert lines(values, ("x", np.array([-0.0, np.nan]))) == ["//a: 1 of 2 values differ, first [0]: 0.0, now -0.0"]
    assert lines(("x", ["for 3 s", "b"]), ("x", ["for 12 s", "c"])) == [
        "//a: 1 of 2 values differ, first [1]: 'b', now 'c'"
    ]
    assert lines(("x", [1.0], {"units": "m"}), ("x", [1.0], {"units": "mm"})) == [
        "//a@units: 1 of 1 values differ, first []: 'm', now 'mm'"
    ]


def test_a_table_of_the_terminal_is_the_same_whatever_its_time_makes_of_its_widths():
    def table(peak, seconds):
        width = len(seconds) + 2
        return f"""
┏━━━━━━━━━┳━━━━━━┳{width * "━"}┓
┃    case ┃ peak ┃ {"seconds"[: len(seconds)]:>{len(seconds)}} ┃
┡━━━━━━━━━╇━━━━━━╇{width * "━"}┩
│ load =  │ {peak} │ {seconds} │
│     300 │      │ {len(seconds) * " "} │
└─────────┴──────┴{width * "─"}┘
"""

    one, slow, other = (
        terminal_lines(table(*row)) for row in (("1.25", "   0.45"), ("1.25", "  1230.45"), ("1.26", "   0.45"))
    )
    assert differing_lines("t", one, slow) == []
    assert [line for line in differing_lines("t", one, other)[2:] if line[0] in "+-"] == [
        "-load = 300 | 1.25 | <time>",
        "+load = 300 | 1.26 | <time>",
    ]


def test_lines_of_a_job_that_lasts_and_times_of_a_slow_machine_do_not_count():
    slow = [
        "  forced response 40 %: stability, point 14: 26.87 Hz, 1 min 3 s",
        "  response 40 %",
        "peak 1 mm (1.09 ks)",
    ]
    assert terminal_lines("\n".join(slow)) == terminal_lines("peak 1 mm (0.4 s)")


def test_data_of_figures_and_columns_beside_a_time_count():
    page = "<table><tr><th>time (s)</th><th>peak</th></tr><tr><td>{}</td><td>{}</td></tr></table><script>draw([{}])</script>"
    assert page_lines(page.format(1, 2, 3)) == page_lines(page.format(9, 2, 3))
    for other in ((1, 9, 3), (1, 2, 9)):
        assert page_lines(page.format(1, 2, 3)) != page_lines(page.format(*other))


@pytest.mark.parametrize("example", examples(), ids=lambda one: one.name)
def test_every_example_has_a_small_setting_that_asks_for_the_same_analyses(example):
    tables = tomllib.loads((EXAMPLES / example.name / "study.toml").read_text(encoding="utf-8"))
    small = changed(tables, example.settings)
    assert tomllib.loads(toml_text(small)) == small
    assert list(small) == list(tables)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an archive of the sources has no commits")
def test_sources_at_work_are_those_of_the_commit_where_nothing_was_changed():
    commit, here = sources_of_commit("HEAD"), sources_at_work()
    assert "src/stickslip/__main__.py" in commit
    assert {path for path in commit if commit[path] != here.get(path, b"")} <= changed_since_head()


def changed_since_head():
    asked = ["git", "diff", "--name-only", "HEAD", "--", "src/stickslip"]
    return set(subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split())


def journal(folder: Path, name: str, stamps: list[str]) -> None:
    (folder / interrupted.JOBS).mkdir(parents=True, exist_ok=True)
    with closing(sqlite3.connect(folder / interrupted.JOBS / name)) as database, database:
        database.execute("create table record (id integer primary key, arrived text)")
        database.executemany("insert into record (arrived) values (?)", [(one,) for one in stamps])


def test_records_of_a_killed_run_that_are_solved_again_are_found(tmp_path):
    for name, folder in (
        ("a.part", "killed"),
        ("b.job", "killed"),
        ("a.job", "on"),
        ("b.job", "on"),
    ):
        journal(tmp_path / folder, name, ["1", "2"] if name.startswith("a") else ["0"])
    before = interrupted.arrivals(tmp_path / "killed")
    assert interrupted.not_taken_over(before, interrupted.arrivals(tmp_path / "on")) == []
    journal(tmp_path / "anew", "a.job", ["3", "4", "5"])
    assert interrupted.not_taken_over(before, interrupted.arrivals(tmp_path / "anew")) == [
        "job a: 2 records of the killed run were not taken over",
        "job b: 1 records of the killed run were not taken over",
    ]
