"""Files that are none, and names, letters and numbers that nobody expects: a line that says what to do, and no hang."""

import errno
import os
import re
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from types import FrameType

import pytest
import xarray as xr
from fault_readers import samples
from small_v2 import write_four_masses
from test_readers_ansys import cube

from stickslip.api.result import Result
from stickslip.errors import InputError, StickslipError
from stickslip.model import load_structure
from stickslip.model.readers.open_model import read_model
from stickslip.model.readers.units import Units
from stickslip.study.models.study import read_study
from stickslip.study.run import run_study
from stickslip.study.store.folder import JOBS, empty_folder, locked_folder
from stickslip.study.store.journal import AT_WORK
from stickslip.study.store.netcdf import attributes_there, write_tree
from stickslip.study.store.progress import LOG, written_down
from stickslip.study.store.provenance import as_text

SUFFIXES = (".inp", ".inp.gz", ".cdb", ".npz", ".mtx", ".mtx.gz", ".sti", ".h5", ".frd", ".full", ".rst", ".op2")


@pytest.fixture
def in_time() -> Iterator[None]:
    """End what hangs: twenty seconds are a thousand times what a refusal takes."""

    def late(_number: int, _frame: FrameType | None) -> None:
        raise AssertionError("it waits for what never comes")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, 20.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("in_time")
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_named_pipe_as_a_deck_is_refused(tmp_path: Path, suffix: str) -> None:
    pipe = tmp_path / f"a{suffix}"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match=r"is no file, but a named pipe.*Write what comes out"):
        read_model(pipe, units=Units.mm_t_s())
    study = tmp_path / "study.toml"
    study.write_text(f'schema_version = 2\n[part.a]\nfile = "{pipe.name}"\nunits = "SI"\n[modes]\n')
    with pytest.raises(InputError, match=r"a\S* is no file\. Give a file"):
        read_study(study)


@pytest.mark.usefixtures("in_time")
@pytest.mark.parametrize(
    ("name", "read", "words"),
    [
        ("study.toml", read_study, "is not a file"),
        ("kept.npz", load_structure, "is no file, but a named pipe"),
        ("result.nc", Result.from_file, "is no file"),
    ],
)
def test_a_named_pipe_as_a_study_a_structure_or_a_result_is_refused(
    tmp_path: Path, name: str, read: Callable[[Path], object], words: str
) -> None:
    os.mkfifo(tmp_path / name)
    with pytest.raises(InputError, match=words):
        read(tmp_path / name)


@pytest.mark.usefixtures("in_time")
def test_a_named_pipe_that_a_deck_includes_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "nodes.inc")
    deck = tmp_path / "a.inp"
    deck.write_text("*INCLUDE, INPUT=nodes.inc\n*NODE\n1, 0, 0, 0\n")
    with pytest.raises(InputError, match=r"nodes\.inc: is no file, but a named pipe"):
        read_model(deck, units=Units.mm_t_s())


@pytest.mark.parametrize(
    ("folder", "words"),
    [
        ("loop", "is a link that leads nowhere, or to itself. Remove it"),
        ("y" * 300, "cannot be written (File name too long). Give a shorter name."),
        ("/".join(60 * ["z" * 100]), "cannot be written (File name too long). Give a shorter name."),
        ("/".join(5 * ["z" * 100]), "Put the study into a folder with a shorter path."),
    ],
)
def test_a_results_folder_that_cannot_be_is_refused_with_what_helps(tmp_path: Path, folder: str, words: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(InputError) as caught, locked_folder(tmp_path / folder):
        pass
    assert words in str(caught.value)


def test_results_that_are_a_link_to_itself_are_refused_by_a_run(tmp_path: Path) -> None:
    study = write_four_masses(tmp_path)
    (tmp_path / "results").symlink_to("results")
    with pytest.raises(InputError, match=r"results: is a link that leads nowhere, or to itself"):
        run_study(read_study(study))


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (errno.EDQUOT, "Your quota is used up, whatever room the disk has. Make room"),
        (errno.ENOSPC, "Make room and run the same command again"),
        (errno.EROFS, "choose another one"),
    ],
)
def test_a_full_disk_or_quota_is_no_reason_to_delete_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: int, words: str
) -> None:
    def full(*_words: object, **_named: object) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr("stickslip.study.store.folder.os.fsync", full)
    with pytest.raises(InputError) as caught, locked_folder(tmp_path):
        pass
    assert words in str(caught.value)
    assert "elete" not in str(caught.value)


@pytest.mark.parametrize("what", ["note", "lock"])
def test_a_limit_that_sqlite_meets_is_no_reason_to_delete_its_file(tmp_path: Path, what: str) -> None:
    """SQLite knows a full disk; a quota or a limit of the size of files is a disk error to it."""
    program = f"""
import resource, signal, sys
from pathlib import Path
import numpy as np
from stickslip.study.store.folder import JOBS, empty_folder, locked_folder
from stickslip.study.store.journal import AT_WORK
from stickslip.study.store.netcdf import attributes_there, write_tree
from stickslip.study.store.progress import LOG, written_down
from stickslip.study.store.provenance import as_text
from stickslip.study.store.journal import JobJournal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
if {what!r} == "lock":
    resource.setrlimit(resource.RLIMIT_FSIZE, (1, 1))
    with locked_folder(Path(sys.argv[1])):
        with JobJournal(Path(sys.argv[1]) / "jobs" / "a.part") as journal:
            pass
with JobJournal(Path(sys.argv[1]) / "a.part") as journal:
    resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, 40_000))
    for i in range(100):
        journal.put(f"note {{i}}", {{"a": np.zeros(1000)}})
"""
    ended = subprocess.run([sys.executable, "-c", program, str(tmp_path)], capture_output=True, text=True, check=False)
    last = ended.stderr.splitlines()[-1]
    assert "a limit of the size of files is met" in last, ended.stderr
    assert "Make room" in last
    assert "elete" not in last


def test_numbers_of_twenty_digits_and_other_scripts_end_in_a_line(tmp_path: Path) -> None:
    """At the first numbers of each file, and at some others: NumPy's integers end at 19 digits, and '²' is a digit to Python."""
    tried = 0
    for sample in samples(tmp_path / "whole"):
        binary = sample.path.suffix in (".gz", ".npz", ".h5", ".full", ".rst", ".op2")
        if binary or sample.path.stat().st_size > 50_000:
            continue
        text = sample.path.read_text(encoding="utf-8", errors="replace")
        places = [m.span() for m in re.finditer(r"(?<![\w.])\d+(?![\w.])", text)]
        for first, end in places[:4] + places[4 :: max(1, len(places) // 3)]:
            for number in ("9" * 20, "²"):
                tried += 1
                sample.path.write_text(text[:first] + number + text[end:], encoding="utf-8")
                with suppress(StickslipError):
                    sample.read(sample.path)
        sample.path.write_text(text, encoding="utf-8")
    assert tried > 150


@pytest.mark.parametrize("node", ["9" * 20, "²", "9" * 5000])
def test_coupled_pairs_of_impossible_nodes_are_refused_by_line(tmp_path: Path, node: str) -> None:
    path = tmp_path / "a.cdb"
    path.write_text(f"{cube()}CP,1,ALL,10,{node}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.cdb: line \d+: constrains the model \(CP\)"):
        read_model(path, units=Units.mm_t_s())


def test_names_that_are_no_utf8_stand_in_log_and_result(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes of a file system without UTF-8: no traceback of the log, and a result that says its study."""
    monkeypatch.setattr(LOG, "propagate", False)  # pytest-xdist cannot send such letters of a captured log
    name = os.fsdecode(b"st\xff.toml")
    with written_down(tmp_path / "run.log"):
        LOG.info(f"study {name}")
    assert "Logging error" not in capsys.readouterr().err
    assert r"study st\udcff.toml" in (tmp_path / "run.log").read_text(encoding="utf-8")
    tree = xr.DataTree(xr.Dataset(attrs={"study_file": as_text(name)}))
    write_tree(tree, tmp_path / "result.nc")
    assert attributes_there(tmp_path / "result.nc")["study_file"] == r"st\udcff.toml"


def test_a_job_that_a_worker_still_writes_keeps_a_new_run_out(tmp_path: Path) -> None:
    job, other = (tmp_path / JOBS / f"{name}{AT_WORK}" for name in ("at work", "left"))
    job.parent.mkdir()
    other.write_bytes(b"no database")
    with closing(sqlite3.connect(job, isolation_level=None)) as worker:
        worker.execute("begin exclusive")
        with pytest.raises(InputError, match=re.escape(f"{tmp_path}: another run is at work in it")):
            empty_folder(tmp_path)
        assert set(tmp_path.glob("*/*")) >= {job, other}
    empty_folder(tmp_path)
    assert not list(tmp_path.glob("*/*"))
