"""Runs of a study that are stopped: nothing finished is computed twice; the numbers are the same to the last bit, with any workers."""

import os
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_v2 import write_four_masses

from stickslip.study.models import parts
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study

SECONDS = 120.0
# two tables multiply; modes do not depend on the load's case
SLIPPING = {"vary.load.shaker.force_n": "[5.0, 8.0]", "modes.number": "3"}
# a user's interrupt before harmonics are raised, a lost machine after some were raised, audited and lowered
STOPS = {signal.SIGINT: " point 6:", signal.SIGKILL: " point 22:"}
SCRIPT = """
import logging, signal, sys
from pathlib import Path
from stickslip.study.store.progress import Interrupted
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in the background ignore it
    logging.basicConfig(level=logging.INFO, format="  %(message)s", stream=sys.stdout)
    try:
        run_study(read_study(Path(sys.argv[1])), workers=int(sys.argv[2]))
    except Interrupted as stopped:
        print(stopped, file=sys.stderr)
        sys.exit(130)
"""


def start(study: Path, workers: int) -> subprocess.Popen[str]:
    script = study.with_name("run.py")
    script.write_text(SCRIPT)
    command = [sys.executable, "-u", str(script), str(study), str(workers)]
    one_thread = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ | one_thread
    )


def stopped(study: Path, how: signal.Signals, workers: int) -> tuple[int, str]:
    """Start a run, send it a signal after some points, return its exit code and what it said on stderr."""
    with start(study, workers) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        for line in process.stdout:
            if STOPS[how] in line:
                process.send_signal(how)
                break
        process.stdout.read()
        said = process.stderr.read()
        return process.wait(SECONDS), said


def journalled(study: Path) -> dict[str, list[tuple[int, str, bytes]]]:
    found = {}
    for path in sorted((study.parent / "results/jobs").glob("*.*")):
        if path.suffix in (".part", ".job"):
            with closing(sqlite3.connect(path)) as db:
                # a run that is stopped as it begins a job leaves a file without tables
                begun = db.execute("select 1 from sqlite_master where name = 'record'").fetchone()
                if begun or path.suffix == ".job":
                    rows = db.execute("select id, arrived, payload from record order by id").fetchall()
                    found[path.stem] = rows
    return found


def same(found: Path, expected: Path) -> None:
    trees = [xr.load_datatree(path.parent / "results/result.nc", engine="h5netcdf") for path in (found, expected)]
    assert all(tree.attrs["complete"] == 1 for tree in trees)
    assert list(trees[0].children) == list(trees[1].children) == ["forced_response", "modes"]
    for name in trees[0].children:
        for variable in trees[1][name].data_vars:
            if "seconds" not in str(variable):
                ours, theirs = (tree[name][variable].values for tree in trees)
                np.testing.assert_array_equal(ours, theirs, err_msg=str(variable))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    study = write_four_masses(tmp_path_factory.mktemp("whole"), SLIPPING)
    run_study(read_study(study))
    return study


@pytest.mark.parametrize(("how", "workers"), [(signal.SIGINT, 2), (signal.SIGKILL, 1)])
def test_stopped_run_goes_on_to_the_same_numbers(
    tmp_path: Path, whole: Path, how: signal.Signals, workers: int, caplog: pytest.LogCaptureFixture
) -> None:
    study = write_four_masses(tmp_path / how.name, SLIPPING)
    code, said = stopped(study, how, workers)
    if how is signal.SIGINT:
        assert code == 130
        folder = study.parent.resolve() / "results"
        told = f"Interrupted. What is finished is kept in {folder}. The same command goes on from there.\n"
        assert said == told
    else:
        assert code == -9, said
    before = journalled(study)
    points = sum(map(len, before.values()))
    assert points >= (6 if how is signal.SIGINT else 25)
    assert points < sum(map(len, journalled(whole).values()))
    with caplog.at_level("INFO"):
        run_study(read_study(study))  # by one process, whatever began it
    assert "goes on after" in caplog.text
    after = journalled(study)
    assert all(after[key][: len(rows)] == rows for key, rows in before.items()), "points were touched"
    same(study, whole)


def test_finished_run_solves_nothing_again(whole: Path) -> None:
    before = journalled(whole)
    run_study(read_study(whole))
    assert journalled(whole) == before


def test_only_what_changes_is_built_and_solved_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two tables of [vary] multiply: two masses, two numbers of modes; a part is made once for each mass."""
    made: list[object] = []
    lumped = parts.lumped

    def counted(*arguments: object, **named: object) -> object:
        made.append(arguments)
        return lumped(*arguments, **named)

    monkeypatch.setattr(parts, "lumped", counted)
    text = write_four_masses(tmp_path / "text").read_text()
    text = text[: text.index("[forced_response]")] + text[text.index("[output]") :]
    varied = (
        "[modes]\n[[vary]]\nmodes.number = [2, 3]\n"
        "[[vary]]\npart.chain.masses_kg = [[1.0, 1.0, 1.0, 1.0], [2.0, 1.0, 1.0, 1.0]]\n"
    )
    path = tmp_path / "study.toml"
    path.write_text(text + varied)
    tree = run_study(read_study(path)).tree
    assert tree["modes"].sizes["case"] == 4
    assert len(made) == 2
    assert list(tree["modes"].vary.values) == ["modes.number", "part.chain.masses_kg"]
    # another case: one mass is made, and its two jobs are solved
    path.write_text(text + varied.replace("[[1.0", "[[3.0, 1.0, 1.0, 1.0], [1.0"))
    before = journalled(path)
    tree = run_study(read_study(path)).tree
    assert tree["modes"].sizes["case"] == 6
    assert len(made) == 3
    after = journalled(path)
    assert len(after) == 6
    assert before.items() <= after.items()
