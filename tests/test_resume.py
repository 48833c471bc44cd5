"""Runs that are stopped: nothing finished is computed twice, and the numbers are the same to the last bit."""

import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from small_study import write_small_study

SECONDS = 120.0
# a damper that slips around the peak: first passage, repeats with more harmonics, and points of the peak
SLIPPING = {"ratios": "[20]", "frequency_hz": "[172.0, 184.0]", "points": "6"}
# a user's interrupt in the first passage, a lost machine in the repeats
STOPS = {signal.SIGINT: "  low 6:", signal.SIGKILL: "  high 15:"}


def command(study: Path, *options: str) -> list[str]:
    return [sys.executable, "-u", "-m", "stickslip", "run", str(study), "--no-report", *options]


def environment() -> dict[str, str]:
    return os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def run(study: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command(study, *options),
        capture_output=True,
        text=True,
        check=False,
        timeout=SECONDS,
        env=environment(),
    )


def stopped(study: Path, how: signal.Signals) -> tuple[int, str]:
    """Start a run, send it a signal after some points, return its exit code and what it said on stderr."""
    with subprocess.Popen(
        command(study), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment()
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        for line in process.stdout:
            if line.startswith(STOPS[how]):
                process.send_signal(how)
                break
        process.stdout.read()
        said = process.stderr.read()
        return process.wait(SECONDS), said


def journalled(study: Path) -> list[tuple[int, str, bytes]]:
    db = sqlite3.connect(study.parent / "results/journal.sqlite")
    rows = db.execute("select id, arrived, payload from point order by id").fetchall()
    db.close()
    return rows


@pytest.fixture(scope="module")
def whole(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[Path, subprocess.CompletedProcess[str]]:
    study = write_small_study(tmp_path_factory.mktemp("whole"), **SLIPPING)
    return study, run(study)


def test_whole_run_is_read_without_this_package(
    whole: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    study, ended = whole
    assert ended.returncode in (0, 1), ended.stderr
    assert ended.stderr == ""
    reader = (
        "import sys, numpy, xarray\n"
        f"d = xarray.open_dataset({str(study.parent / 'results/result.nc')!r})\n"
        "assert 'stickslip' not in sys.modules\n"
        "assert d.attrs['complete'] == 1 and list(d['part'].values) == ['re', 'im']\n"
        "q = d.output_displacement.sel(part='re') + 1j * d.output_displacement.sel(part='im')\n"
        "good = d.status.values == 0\n"
        "numpy.testing.assert_allclose(abs(q).sel(harmonic=1)[good], d.amplitude[good], rtol=1e-14)\n"
        "assert all('units' in v.attrs and 'long_name' in v.attrs for v in d.data_vars.values())\n"
        "assert int(d.points.sum()) == d.sizes['point'] == int((d.points_low + d.points_high).sum())\n"
        "peak = int(d.peak_point[0])\n"
        "assert float(d.amplitude[peak, 0]) == float(d.peak_amplitude[0]) == float(d.amplitude[:, 0].max())\n"
        "assert d.sizes['contact'] == 9 and d.sizes['retained'] == 33 and d.sizes['harmonic'] == 6\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", reader], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr


def test_exit_code_tells_of_points_that_did_not_converge(
    whole: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    study, ended = whole
    with xr.open_dataset(study.parent / "results/result.nc") as data:
        failed = int(data.points_failed.sum())
    assert ended.returncode == (1 if failed else 0)


def test_run_writes_mesh_and_log(whole: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    folder = whole[0].parent / "results"
    assert (folder / "blades.vtu").stat().st_size > 0
    assert (folder / "blades.msh").stat().st_size > 0
    log = (folder / "run.log").read_text()
    assert "stuck mode 5: full" in log
    assert "F_CL/F_HE = 20: peak" in log


def test_table_and_alert_are_told(whole: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    said = whole[1].stdout
    for column in (
        "F_CL/F_HE",
        "peak mm",
        "at Hz",
        "points",
        "H = 1",
        "H = 5",
        "Newton",
        "contact s",
        "linear s",
        "rest s",
    ):
        assert column in said
    assert "asked for more harmonics" in said
    assert "points repeated with 5 harmonics, at" in said
    assert str(whole[0].parent / "results/result.nc") in said


@pytest.mark.parametrize("how", list(STOPS))
def test_stopped_run_goes_on_to_the_same_numbers(
    tmp_path: Path, whole: tuple[Path, subprocess.CompletedProcess[str]], how: signal.Signals
) -> None:
    study = write_small_study(tmp_path / how.name, **SLIPPING)
    code, said = stopped(study, how)
    if how is signal.SIGINT:
        assert code == 130
        folder = study.parent.resolve() / "results"
        assert (
            said
            == f"Interrupted. What is finished is kept in {folder}. The same command goes on from there.\n"
        )
    else:
        assert code == -9
    before = journalled(study)
    assert len(before) >= (6 if how is signal.SIGINT else 30)
    assert len(before) < len(journalled(whole[0]))
    ended = run(study)
    assert ended.returncode == whole[1].returncode, ended.stderr
    assert "reduced blades taken from the earlier start" in ended.stdout
    after = journalled(study)
    assert after[: len(before)] == before, "finished points were touched"
    assert len(after) == len(journalled(whole[0]))
    with (
        xr.open_dataset(whole[0].parent / "results/result.nc") as expected,
        xr.open_dataset(study.parent / "results/result.nc") as found,
    ):
        for name in expected.data_vars:
            if "seconds" not in str(name):
                np.testing.assert_array_equal(
                    found[name].values, expected[name].values, err_msg=str(name)
                )


def test_finished_run_solves_nothing_again(
    whole: tuple[Path, subprocess.CompletedProcess[str]],
) -> None:
    before = journalled(whole[0])
    assert run(whole[0]).returncode == whole[1].returncode
    assert journalled(whole[0]) == before
