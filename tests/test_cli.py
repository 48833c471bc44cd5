"""The commands: exit codes, messages without tracebacks, journeys of each kind of study, and a light start."""

import html
import json
import os
import re
import shutil
import subprocess
import sys
from collections import namedtuple
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import get_args

import pytest
import xarray as xr
from small_v2 import (
    TWO_BLADES,
    write_example_deck,
    write_four_masses,
    write_shrouded_deck,
    write_shrouded_sector,
    write_two_blades,
)
from typer.testing import CliRunner, Result

import stickslip
from stickslip.api import study as front
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.model import blas_threads
from stickslip.study.check import SECTIONS
from stickslip.study.file.example import Kind, example_text
from stickslip.study.outcome import Outcome
from stickslip.study.store.folder import locked_folder
from stickslip.study.store.progress import Interrupted

pytestmark = pytest.mark.usefixtures("peak_alone", "parts_once")

DOCS = Path(__file__).parents[1] / "docs"
HEAVY = ("numpy", "scipy", "numba", "xarray", "pydantic", "plotly", "gmsh", "skfem", "meshio")


@pytest.mark.parametrize("said", [{}, {"OMP_NUM_THREADS": "4"}, {"OPENBLAS_NUM_THREADS": "2"}])
def test_a_run_gives_blas_one_thread_unless_told_otherwise(monkeypatch, said):
    environment = dict(said)
    monkeypatch.setattr(blas_threads.os, "environ", environment)
    blas_threads.one_blas_thread()
    one = {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    assert environment == (said or one)


@pytest.mark.parametrize("said", [False, True])
def test_loaded_blas_has_one_thread_for_a_while_unless_told_otherwise(monkeypatch, said):
    """The order of sums, and so the bits, are then those of the command; NumPy's wheel keeps an OpenBLAS."""
    counts = [5, 7]
    own = [(partial(counts.__getitem__, i), partial(counts.__setitem__, i)) for i in range(2)]
    assert len(blas_threads.loaded()) == 2
    assert all(get() >= 1 for get, _ in blas_threads.loaded())
    monkeypatch.setattr(blas_threads, "loaded", lambda: own)
    monkeypatch.setattr(blas_threads, "SAID", said)
    with blas_threads.one_loaded_blas_thread():
        assert counts == ([5, 7] if said else [1, 1])
    assert counts == [5, 7]


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
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert ended.stderr.strip() == "[]"


def test_a_wrong_study_is_refused_before_what_computes_and_draws_is_loaded(tmp_path: Path) -> None:
    """Within a second: no kernel is compiled or read, no result or figure can be made yet."""
    title = write_four_masses(tmp_path / "a", {"title": "3"})
    part = write_four_masses(tmp_path / "b")
    text = part.read_text(encoding="utf-8")
    part.write_text(text.replace('"chain.m2", "ground"', '"chian.m2", "ground"'), encoding="utf-8")
    late = (
        "numba",
        "scipy.sparse",
        "xarray",
        "pandas",
        "plotly",
        "stickslip.api.study",
        "stickslip.assembly.model",
        "stickslip.response.system",
        "stickslip.harmonic.balance",
    )
    program = (
        "import sys\nfrom stickslip.cli import main\n"
        f"for study in {[str(title), str(part)]!r}:\n"
        "    sys.argv = ['stickslip', 'check', study]\n"
        "    try:\n        main()\n    except SystemExit as end:\n        assert end.code == 2, end.code\n"
        f"print([m for m in {late!r} if m in sys.modules])\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ended.stdout.strip() == "[]"
    assert "title: must be a text, got 3" in ended.stderr
    assert "there is no part 'chian'. Did you mean 'chain'?" in ended.stderr


def test_version() -> None:
    assert invoke("--version").output == f"stickslip {stickslip.__version__}\n"


def test_unknown_command_and_option_are_bad_input() -> None:
    assert "No such command 'runn'" in refused("runn")
    assert "No such option" in refused("run", "x.toml", "--quick")


def done(*words: str) -> str:
    """Return what a command prints that must end well, its lines joined."""
    result = invoke(*words)
    assert result.exit_code == 0, result.output
    return result.output


def test_schema_is_printed_as_json() -> None:
    schema = json.loads(invoke("schema").output)
    assert schema["title"] == "StudyTables"
    assert {"part", "contact", "vary", "forced_response", "campbell"} <= set(schema["properties"])


@pytest.mark.parametrize("command", ["modes", "campbell", "safe"])
def test_commands_of_before_are_analyses_now(command: str) -> None:
    assert f"No such command '{command}'" in refused(command, "study.toml")


@pytest.mark.parametrize("kind", get_args(Kind))
def test_new_writes_the_example_of_a_kind(tmp_path: Path, kind: str) -> None:
    said = done("new", str(tmp_path / "made"), "--kind", kind)
    path = tmp_path / "made" / "study.toml"
    assert path.read_text(encoding="utf-8") == example_text(kind)
    assert said.index(f"stickslip check {path}") < said.index(f"stickslip run {path}")
    if kind == "file":
        assert "part.blade.file: there is no file" in refused("check", str(path))
    else:
        assert front.Study.from_file(path).content.asked


def with_few_cases(path: Path) -> None:
    """Keep the first and the last value of a list that is varied, each assembled and advised anew, and mesh blades coarsely."""

    def coarse(size: re.Match[str]) -> str:
        return f"{size[1]}_size_m = {TWO_BLADES[f'part.blades.{size[1]}_size_m']}"

    text = re.sub(
        r"^(airfoil|platform|foot)_size_m = \S+", coarse, path.read_text(encoding="utf-8"), flags=re.MULTILINE
    )
    head, table, rest = text.partition("[vary]")
    path.write_text(head + table + re.sub(r"\[([^],\n]+)(?:, [^],\n]+)*(, [^],\n]+)\]", r"[\1\2]", rest, count=1))


def test_the_second_table_of_vary_in_the_damper_is_taken_as_it_stands(tmp_path: Path) -> None:
    done("new", str(tmp_path / "made"), "--kind", "damper")
    path = tmp_path / "made" / "study.toml"
    path.write_text(re.sub(r"^# (\[\[vary\]\]|contact\.)", r"\1", path.read_text(), flags=re.MULTILINE))
    assert len(stickslip.Study.from_file(path).cases) == 10


@pytest.mark.parametrize("name", ["vary", "title"])
def test_keys_without_a_table_of_their_own_are_told(name: str) -> None:
    assert name in done("keys", name)


# the other kinds are examples of the repository, which tests/test_journeys.py or others go through
@pytest.mark.parametrize(
    "kind", [pytest.param("own_blades", marks=pytest.mark.validation), "damper", "wheel", "mistuned"]
)
def test_check_passes_what_new_writes(tmp_path: Path, kind: str) -> None:
    done("new", str(tmp_path / "made"), "--kind", kind)
    with_few_cases(tmp_path / "made" / "study.toml")
    said = done("check", str(tmp_path / "made" / "study.toml"))
    assert said.splitlines()[0].startswith("checking ")
    assert f"{tmp_path / 'made' / 'study.toml'}: good to run\n" in said, "a template that its own check doubts"
    places = [said.index(f"\n{heading}:") for heading in SECTIONS.values() if heading in said]
    assert places == sorted(places)
    assert len(places) >= 3
    rigid_damper = kind in ("own_blades", "damper")
    assert ("damper: left can slip to and fro" in said) == rigid_damper
    assert ("of at most 0." in said) == rigid_damper


def test_check_estimates_its_time_before_heavy_libraries_are_imported(tmp_path: Path) -> None:
    """Numba, xarray and the analyses take seconds to import: the line comes before them."""
    path = write_two_blades(tmp_path)
    code = (
        "import sys; from pathlib import Path; from stickslip.api.reading import read\n"
        f"read(Path({str(path)!r}), lambda line: print(line, [m for m in ('numba', 'xarray', 'stickslip.study.run') if m in sys.modules]))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert re.fullmatch(r"checking one case: parts of about [1-9][\d,]* nodes take some \d+ s \[\]\n", told), told


def test_new_overwrites_no_deck(tmp_path: Path) -> None:
    (tmp_path / "two").mkdir()
    deck = tmp_path / "two" / "blade.inp"
    deck.write_text("mine")
    assert f"{deck}: exists already" in refused("new", str(tmp_path / "two"), "--kind", "own_blades")
    assert deck.read_text() == "mine"
    assert not (tmp_path / "two" / "study.toml").exists()


def test_check_doubts_units(tmp_path: Path) -> None:
    """Frequencies 1000 times off the range, a contact that gives way by a millimetre, and a damper as heavy as its blades."""
    far = write_four_masses(tmp_path / "far", {"forced_response.frequency_hz": "[8000.0, 16000.0]"})
    said = done("check", str(far))
    assert "the nearest natural frequency, " in said
    assert "times below the range. Check the units: mm for m shifts" in said
    soft = write_two_blades(
        tmp_path / "soft", {"contact.flat.normal_stiffness_n_per_m": "5e4", "part.damper.mass_kg": "3.0"}
    )
    said = done("check", str(soft))
    assert re.search(r"at rest contact flat is pressed together by \d+(\.\d+)? mm", said)
    assert re.search(r"damper weighs 3 kg beside [\d.]+ kg of all other parts", said)
    assert "3 doubtful" in said or "2 doubtful" in said


def test_new_writes_the_example_and_overwrites_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "two"
    result = invoke("new", str(folder))
    assert result.exit_code == 0
    assert (folder / "study.toml").read_text(encoding="utf-8") == example_text()
    (folder / "study.toml").write_text("mine")
    said = refused("new", str(folder))
    assert said == f"{folder / 'study.toml'}: exists already. Give another name: nothing is overwritten."
    assert (folder / "study.toml").read_text() == "mine"


def test_new_in_a_place_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    said = refused("new", str(tmp_path / "file" / "two"))
    assert "study.toml: cannot be written (Not a directory). A file stands where a folder has to be" in said


@pytest.mark.parametrize("command", ["run", "check"])
def test_missing_study(tmp_path: Path, command: str) -> None:
    path = tmp_path / "none.toml"
    assert refused(command, str(path)) == (
        f"{path}: there is no such file. Check the name, or write an example with 'stickslip new NAME'."
    )


def test_bad_study_is_told_line_by_line(tmp_path: Path) -> None:
    wrong = {"part.damper.mass_kg": "-0.1", "forced_response.frequency_hz": "[220.0, 150.0]"}
    path = write_two_blades(tmp_path, wrong)
    assert [line.split(": ")[1] for line in refused("check", str(path)).splitlines()] == [
        "part.damper.mass_kg",
        "forced_response.frequency_hz",
    ]


def test_a_study_of_schema_one_is_refused_with_the_remedy(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text("schema_version = 1\n[blades]\n")
    said = refused("run", str(path))
    assert "schema_version: this version of stickslip reads 2, got 1" in said
    assert "stickslip new NAME" in said


def test_output_folder_that_cannot_be_made(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    (tmp_path / "results").write_text("a file where the folder should be")
    assert "results: is a file, and a run makes a folder" in refused("run", str(path))


def test_full_disk_is_told_before_anything_is_computed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usage = namedtuple("usage", "total used free")(10**9, 10**9 - 10**6, 10**6)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage)
    with (
        pytest.raises(InputError, match=r"its disk has 1 MB free, a run needs up to 200 MB\. Make room"),
        locked_folder(tmp_path / "results"),
    ):
        pass


def test_check_says_once_what_holds_for_all_cases(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path, {"vary.load.shaker.force_n": "[5.0, 8.0, 9.0]"})
    said = done("check", str(path)).splitlines()
    assert said.count("force 5 N") == 1
    assert len([line for line in said if "natural frequencies, contacts open" in line]) == 1
    assert "the same holds for: force 8 N, 9 N" in said
    total = next(line for line in said if line.startswith("all 3 cases: "))
    found = re.fullmatch(r"all 3 cases: some (\d+) s to solve on one core, at most (\d+) s", total)
    of_one = re.search(r"([\d.]+) s to solve this case, at most ([\d.]+) s", "\n".join(said))
    assert found is not None
    assert of_one is not None
    least, most = found.groups()
    assert int(most) == pytest.approx(3 * float(of_one[2]), abs=1.0 + 1.5)  # both are rounded to a second or a digit
    assert int(least) <= int(most)
    sentences = [text.split() for line in said for text in re.split(r"; |\. ", line)]
    assert [" ".join(words) for words in sentences if len(words) > 20] == []


def test_masses_from_new_to_the_page(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    said = done("check", str(path))
    assert "natural frequencies" in said
    assert f"{path}: good to run" in said
    assert not (tmp_path / "results").exists()
    said = done("run", str(path))
    results = tmp_path / "results"
    for name in ("result.nc", "report.html", "run.log"):
        assert str(results / name) in said
    assert "Forced response" in said
    (results / "report.html").unlink()
    assert str(results / "report.html") in done("report", str(results))
    page = (results / "report.html").read_text(encoding="utf-8")
    # terminal, page and Python say the same
    found, told = front.Result.from_file(results), html.unescape(re.sub(r"<[^>]*>", "", page))
    assert found.verdicts
    for v in found.verdicts:
        assert v.why[1:] in told  # a sentence without a frequency begins with a capital
        assert not v.told or str(v) in said
    # the curve stands above all chapters; the checks are those of stability, which nobody has to ask for
    assert page.count("<h2>") == 7
    # what is finished is not computed again, and --fresh computes it again
    assert "jobs to do: 0" in done("run", str(path), "--no-report")
    assert "jobs to do: 1" in done("run", str(path), "--no-report", "--fresh")


def test_two_blades_answer_and_can_be_read_without_this_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stickslip.cli, "MANY_CASES", 1)
    few = {"forced_response.points": "4", "forced_response.stability": '"off"', "reduction.fixed_interface_modes": "6"}
    path = write_two_blades(tmp_path, {"vary.load.shaker.ratio": "[2000, 1000]"} | few)
    said = done("run", str(path))
    assert "ratio 1000" in said
    assert "writing the page of 2 cases" in said
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    for key in ("response", "loops_t", "states", "motion_damper", "mesh"):
        assert f'<figure id="fig-{key}"' in page
    assert "No point dissipates energy at any frequency." in page  # in place of empty axes
    section = (DOCS / "results.md").read_text(encoding="utf-8").partition("## Without this package")[2]
    (snippet,) = re.findall(r"^```python\n(.*?)^```", section, flags=re.DOTALL | re.MULTILINE)
    drawn = find_spec("matplotlib") is not None
    program = snippet if drawn else "".join(line for line in snippet.splitlines(True) if ".plot" not in line)
    program += """
import sys

one = tree["forced_response"].to_dataset()
mine = one.point_case.values == 1
assert one.vary_value.values.tolist() == [[2000.0], [1000.0]] and one.peak_frequency_hz[0] > 100
assert one.case.values.tolist() == ["ratio 2000", "ratio 1000"]
assert (table.ratio.values == one.vary_value.values[one.point_case, 0]).all()
assert (table.frequency_hz.values == one.frequency_hz.values).all()
assert float(highest.sel(ratio=1000)) == float(amplitude[mine].max())
assert (data.sel(ratio=1000).amplitude.values == one.amplitude.values[mine]).all()
assert "stickslip" not in sys.modules
"""
    if drawn:
        program += """
import matplotlib.pyplot as plt

*curves, peaks = plt.gca().lines
assert len(curves) == one.sizes["output"]
assert (curves[0].get_xdata() == one.frequency_hz.values[mine]).all()
assert (peaks.get_xdata() == [2000, 1000]).all() and (peaks.get_ydata() == one.peak_amplitude.values).all()
"""
    alone = {**os.environ, "MPLBACKEND": "agg"}
    asked = [sys.executable, "-c", program]
    ended = subprocess.run(asked, check=False, capture_output=True, text=True, cwd=tmp_path, env=alone)
    assert ended.stderr == ""


def test_a_sector_answers_analysis_by_analysis_on_one_page(tmp_path: Path) -> None:
    path = write_shrouded_sector(tmp_path)
    said = done("run", str(path), "--only", "modes")
    assert "Natural frequencies in Hz" in said
    assert "Crossings" not in said
    assert "answers: 1\n" in said
    assert "Crossings" in done("run", str(path), "--only", "campbell", "--only", "safe")
    with xr.open_datatree(tmp_path / "results" / "result.nc", engine="h5netcdf") as tree:
        assert set(tree.children) == {"modes", "campbell", "safe"}
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    for key in ("diameters", "shapes", "campbell", "safe"):
        assert f'<figure id="fig-{key}" class="all-cases">' in page


def test_a_deck_from_inspect_to_modes(tmp_path: Path) -> None:
    path = write_shrouded_deck(tmp_path)
    said = done("inspect", str(tmp_path / "sector.inp"), "--frequencies", "2")
    assert "set " in said
    assert "Natural frequencies in Hz" in done("run", str(path), "--only", "modes", "--no-report")
    assert not (tmp_path / "results" / "report.html").exists()


@pytest.mark.validation
def test_a_deck_with_friction_at_its_shrouds_answers_all_questions_on_one_page(tmp_path: Path) -> None:
    path = write_example_deck(tmp_path)
    said = done("run", str(path))
    for table in ("Forced response", "Natural frequencies in Hz", "Crossings", "near resonance"):
        assert table in said
    with xr.open_datatree(tmp_path / "results" / "result.nc", engine="h5netcdf") as tree:
        assert set(tree.children) == {"forced_response", "modes", "campbell", "safe"}
        found = tree["forced_response"]
        assert found.sizes["contact"] == 21
        assert int(found.status.max()) == 0
        slips = float(found.dissipated_energy.sum("contact").max())
        assert slips > 1e-4  # J: shrouds slip
    page = (tmp_path / "results" / "report.html").read_text(encoding="utf-8")
    for key in ("response", "states", "diameters", "campbell", "safe"):
        assert f'<figure id="fig-{key}"' in page


def test_only_names_what_there_is(tmp_path: Path) -> None:
    path = write_four_masses(tmp_path)
    assert "Did you mean 'forced_response'?" in refused("run", str(path), "--only", "force_response")
    assert f"{path}: modes: is missing. Add the table [modes]" in refused("run", str(path), "--only", "modes")


def test_exit_codes_tell_points_without_solution_and_interruptions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_four_masses(tmp_path)
    tree = xr.DataTree(xr.Dataset(attrs={"title": "t"}))
    monkeypatch.setattr(front, "answers", lambda *_, **__: Outcome(tree, {}, 2, ()))
    ended = invoke("run", str(path), "--no-report")
    assert ended.exit_code == 1
    assert "2 of the points: marked in the result and in the report, not filled in" in ended.output

    def stopped(*_: object, **__: object) -> None:
        text = "Interrupted. The same command goes on from there."
        raise Interrupted(text)

    monkeypatch.setattr(front, "answers", stopped)
    ended = invoke("run", str(path))
    assert ended.exit_code == 130
    assert "The same command goes on" in ended.stderr


def test_report_of_nothing(tmp_path: Path) -> None:
    said = refused("report", str(tmp_path))
    assert str(tmp_path / "result.nc") in said
