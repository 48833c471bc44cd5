"""Whatever happens to files, disks, memory and processes: whole files, the same bits, and a line that says what to do.

A small share runs with the suite, the whole with ``make validate``.
"""

import os
import shutil
import signal
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from fault_readers import damaged
from small_v2 import write_four_masses
from typer.testing import CliRunner

from stickslip.api.result import Result
from stickslip.cli import app
from stickslip.errors import InputError
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
from stickslip.study.store import netcdf
from stickslip.study.store.folder import locked_folder
from stickslip.study.store.netcdf import read_tree, write_tree

HERE = Path(__file__).parent
SEED = 1


def shares(few: int, many: int) -> pytest.MarkDecorator:
    """Run with few trials in the suite, and with many in ``make validate``."""
    return pytest.mark.parametrize("count", [few, pytest.param(many, marks=pytest.mark.validation)])


def script(name: str, *words: object) -> str:
    """Run a script of this folder; return what it said."""
    paths = [str(HERE.parent / "src"), str(HERE.parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "PYTHONHASHSEED": "0"}
    ended = subprocess.run(
        [sys.executable, "-W", "ignore", str(HERE / name), *map(str, words)],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    last = ended.stdout.splitlines()[-1:]
    assert ended.returncode == 0, f"{last}\n{ended.stderr[-2000:]}"
    return ended.stdout


@shares(60, 20_000)
def test_damaged_files_are_read_or_refused(tmp_path: Path, count: int) -> None:
    said = script("fault_readers.py", tmp_path, SEED, 0, count)
    assert said.splitlines()[-1] == f"{count} files, 0 failures", said


@pytest.mark.validation
@pytest.mark.parametrize(("how", "count"), [("kills", 200), ("disk", 60), ("memory", 40)])
def test_commands_that_are_stopped_lose_nothing(tmp_path: Path, how: str, count: int) -> None:
    said = script("fault_commands.py", how, tmp_path, SEED, count)
    assert said.splitlines()[-1] == f"{count} {how}, 0 failures", said


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, xr.DataTree]:
    few = {"forced_response.points": "4", "forced_response.peak_points": "0", "modes.number": "2"}
    study = write_four_masses(tmp_path_factory.mktemp("finished"), few)
    return study, run_study(read_study(study)).tree


def same(found: xr.DataTree, expected: xr.DataTree) -> bool:
    return all(
        np.array_equal(found[name][key], expected[name][key], equal_nan=expected[name][key].dtype.kind in "fc")
        for name in expected.children
        for key in expected[name].data_vars
        if "seconds" not in str(key)
    )


@shares(12, 250)
def test_damaged_results_are_refused_by_name_or_give_the_same_numbers(
    finished: tuple[Path, xr.DataTree], tmp_path: Path, count: int
) -> None:
    """Datasets, sealed jobs, and jobs at work; `--fresh` is named, and nothing is used in silence."""
    original, expected = finished
    counted: Counter[str] = Counter()
    for number in range(count):
        rng = np.random.default_rng([SEED, number])
        shutil.copytree(original.parent, tmp_path, dirs_exist_ok=True)
        results = tmp_path / "results"
        files = [results / "result.nc", *sorted((results / "jobs").glob("*.job"))]
        path = files[number % len(files)]
        content = damaged(path.read_bytes(), rng)
        if path.suffix == ".job" and number % 2:  # one that would go on
            path = path.rename(path.with_suffix(".part"))
        path.write_bytes(content)
        try:
            of_file = path.suffix == ".nc"
            tree = Result.from_file(path).data if of_file else run_study(read_study(tmp_path / "study.toml")).tree
        except InputError as error:
            told = error.place == str(path) and "--fresh" in str(error)
            counted["refused" if told else f"{number}: {error}"] += 1
        else:
            assert same(tree, expected), f"{number}: {path} was used in silence"
            counted["same"] += 1
        shutil.rmtree(results)
    assert counted["refused"] > count / 2
    assert set(counted) <= {"refused", "same"}, counted


@pytest.mark.parametrize("name", ["jobs", "run.log", "result.ab12.part.nc", "report.html", "run.lock"])
def test_links_in_the_results_folder_are_not_followed(
    finished: tuple[Path, xr.DataTree], tmp_path: Path, name: str
) -> None:
    shutil.copytree(finished[0].parent, tmp_path / "s")
    link, mine = tmp_path / "s" / "results" / name, tmp_path / "mine"
    if name == "jobs":
        link.rename(mine)
    else:
        link.unlink(missing_ok=True)
        mine.write_text("mine")
    link.symlink_to(mine)
    before = sorted(mine.iterdir()) if mine.is_dir() else mine.read_text()
    with pytest.raises(InputError) as caught:
        run_study(read_study(tmp_path / "s" / "study.toml"), fresh=True)
    assert str(caught.value).startswith(f"{link}: is a link, which a run does not follow. Remove it")
    assert before == (sorted(mine.iterdir()) if mine.is_dir() else mine.read_text())


@pytest.mark.parametrize("name", ["run.log", "result.nc", "run.lock", "jobs/a.part"])
@pytest.mark.parametrize("what", ["folder", "loop"])
def test_what_is_no_file_is_refused_by_name(tmp_path: Path, name: str, what: str) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.mkdir() if what == "folder" else path.symlink_to(path)
    with pytest.raises(InputError) as caught, locked_folder(tmp_path):
        pass
    assert caught.value.place == str(path)


def test_a_file_is_whole_or_not_there(tmp_path: Path) -> None:
    tree = xr.DataTree(xr.Dataset({"a": ("x", np.arange(3.0))}))
    for path, remedy in (
        (tmp_path / "none" / "a.nc", "Make its folder first"),
        (tmp_path / "file" / "a.nc", "A file stands where a folder has to be"),
        (tmp_path / "folder.nc", "A folder has that name"),
        (tmp_path / f"{'x' * 300}.nc", "Give a shorter name"),
    ):
        (tmp_path / "file").write_text("")
        (tmp_path / "folder.nc").mkdir(exist_ok=True)
        with pytest.raises(InputError) as caught:
            write_tree(tree, path)
        assert caught.value.place == str(path)
        assert remedy in str(caught.value)
    # what a kill has left, or a link to elsewhere, is not written through
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "b.part.nc").symlink_to(tmp_path / "mine")
    (tmp_path / "b.nc").symlink_to(tmp_path / "mine")
    write_tree(tree, tmp_path / "b.nc")
    assert (tmp_path / "mine").read_text() == "mine"
    assert Result.from_file(tmp_path / "b.nc").data.a.sum() == 3.0
    assert list(tmp_path.glob("b.*.part.nc")) == []


def test_a_result_goes_to_a_file_with_an_ending_or_into_a_folder(tmp_path: Path) -> None:
    result = Result(xr.DataTree(xr.Dataset(attrs={"title": "t"})))
    with pytest.raises(InputError, match=r"out: is no folder that exists.*Give .*out\.nc"):
        result.save(tmp_path / "out")
    assert result.save(tmp_path) == tmp_path / "result.nc"
    with pytest.raises(InputError, match=r"result\['modes'\]: is no analysis of this result"):
        _ = result["modes"]


def test_without_a_place_for_compiled_functions_the_package_loads_and_says_so_once() -> None:
    program = "import stickslip.contact.slider, stickslip.response.time.stepping.time_step"
    nowhere = {"NUMBA_CACHE_DIR": "/dev/null/none", "NUMBA_CACHE_LOCATOR_CLASSES": "_UserProvidedCacheLocator"}
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env={**os.environ, **nowhere}
    )
    assert ended.stderr.count("compiled functions cannot be kept") == 1
    assert "NUMBA_CACHE_DIR" in ended.stderr


@pytest.mark.parametrize(("shell", "code"), [(">/dev/full", 1), (">&-", 0)])
def test_an_output_that_is_full_or_closed_gives_a_line(shell: str, code: int) -> None:
    command = f"{sys.executable} -m stickslip --version {shell}"
    ended = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
    assert ended.returncode == code
    full = "standard output: cannot be written (No space left on device).\n"
    assert ended.stderr == (full if code else "")


def test_letters_that_the_output_lacks_are_replaced_and_controls_are_told(tmp_path: Path) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "stickslip", "check", str(tmp_path / "\x1b[31mω.toml")],
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert ended.returncode == 2
    assert rb"\x1b[31m" in ended.stderr
    assert b"\x1b" not in ended.stderr
    assert b"there is no such file" in ended.stderr


def test_a_run_at_work_keeps_its_files_from_a_fresh_one(tmp_path: Path) -> None:
    """Two processes, of which this is one: the second is refused before it removes anything, and the first goes on to its end."""
    study = write_four_masses(tmp_path, {"forced_response.stability": '"off"'})
    command = [sys.executable, "-u", "-m", "stickslip", "run", str(study), "--no-report", "-v"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as first:
        assert first.stdout is not None
        for line in first.stdout:
            if "point " in line:
                break
        first.send_signal(signal.SIGSTOP)
        second = CliRunner().invoke(app, ["run", str(study), "--no-report", "-v", "--fresh"])
        first.send_signal(signal.SIGCONT)
        first.stdout.read()
        at_work = first.wait(60)
    assert second.exit_code == 2
    assert "another run is at work in it. Wait for it, or stop it." in second.stderr
    assert at_work == 0
    assert Result.from_file(tmp_path / "results").data.attrs["complete"] == 1


def test_an_interrupt_waits_until_a_result_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # HDF5 calls back while it writes, and what is raised there is lost
    tree = xr.DataTree(xr.Dataset({"x": ("i", np.arange(3.0))}))
    made = netcdf.to_bytes
    after = []

    def interrupted(tree: xr.DataTree) -> bytes:
        os.kill(os.getpid(), signal.SIGINT)
        after.append("goes on")
        return made(tree)

    monkeypatch.setattr(netcdf, "to_bytes", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background ignore it
    try:
        with pytest.raises(KeyboardInterrupt):
            write_tree(tree, tmp_path / "result.nc")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert after == ["goes on"]
    np.testing.assert_array_equal(read_tree(tmp_path / "result.nc").x, np.arange(3.0))
