"""The file of a job: exact, whole after a kill, its own job's only, and named where it is damaged."""

import sqlite3
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.solve.status import Status
from stickslip.study.keep.archive import decode, encode
from stickslip.study.keep.journal import JobJournal, read_note, read_sealed


@dataclass(frozen=True, eq=False)
class Point:
    """A record of everything that a record may hold."""

    stage: str
    index: int
    omega: float
    q: np.ndarray
    empty: np.ndarray
    status: Status
    error: float
    more: np.ndarray | None = None


def point(index: int) -> Point:
    rng = np.random.default_rng(index)
    q = rng.standard_normal((2, 4)) + 1j * rng.standard_normal((2, 4))
    status = Status.STALLED if index == 3 else Status.CONVERGED
    return Point("low", index, 1000.0 / 3 + index, q, np.zeros((0, 3)), status, float("nan"))


def same(a: Point, b: Point) -> bool:
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(Point)]
    return all(
        type(x) is type(y) and np.array_equal(x, y, equal_nan=not isinstance(x, str | None))
        for x, y in pairs
    )


def test_records_come_back_bit_for_bit_in_their_order(tmp_path: Path) -> None:
    path = tmp_path / "a.part"
    with JobJournal(path, Point) as journal:
        for i in (0, 3):
            journal.add(point(i))
    with JobJournal(path, Point) as journal:
        journal.add(point(1))
        journal.seal()
    assert [p.name for p in tmp_path.iterdir()] == ["a.job"]
    back, notes = read_sealed(tmp_path / "a.job", Point)
    assert [p.index for p in back] == [0, 3, 1]
    assert all(same(p, point(p.index)) for p in back)
    assert back[1].status is Status.STALLED
    assert notes == {}


def test_notes_hold_arrays_numbers_and_text(tmp_path: Path) -> None:
    values = {"a": np.eye(2), "n": 3, "x": 1 / 3, "names": np.array(["L1.1", "R.3"]), "none": None}
    with JobJournal(tmp_path / "a.part", Point) as journal:
        assert journal.get("model") is None
        journal.put("model", values)
        journal.put("model", values | {"n": 4})
        back = journal.get("model")
        assert list(journal.notes()) == ["model"]
        journal.seal()
    assert back is not None
    assert sorted(back) == ["a", "n", "names", "x"]
    assert back["n"] == 4
    assert back["x"] == 1 / 3
    assert list(back["names"]) == ["L1.1", "R.3"]
    kept = read_note(tmp_path / "a.job", "model")
    assert kept is not None
    assert kept["x"] == 1 / 3
    assert read_note(tmp_path / "a.job", "none") is None


def test_objects_that_would_need_pickle_are_refused() -> None:
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        encode({"a": np.array([object()])})
    assert decode(encode({"a": 1.5})) == {"a": 1.5}


def test_file_of_another_job_is_refused(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as journal:
        journal.put("model", {"n": 1})
    (tmp_path / "a.part").rename(tmp_path / "b.part")
    with pytest.raises(
        InputError, match=r"b\.part: is the file of another job or version\. .*--fresh"
    ):
        JobJournal(tmp_path / "b.part", Point)


def test_job_that_is_at_work_is_not_opened_again(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as first:
        with pytest.raises(
            InputError, match=r"another run is at work in it\. Wait for it, or stop"
        ):
            JobJournal(tmp_path / "a.part", Point)
        first.add(point(0))


@pytest.mark.parametrize("end", [".part", ".job"])
def test_damaged_file_is_told(tmp_path: Path, end: str) -> None:
    path = tmp_path / f"a{end}"
    path.write_bytes(b"no database at all" * 100)
    with pytest.raises(
        InputError, match=r"the file of a job cannot be used .*start over with --fr"
    ):
        JobJournal(path, Point) if end == ".part" else read_sealed(path, Point)


def test_damaged_record_is_told(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as journal:
        journal.add(point(0))
        journal.seal()
    db = sqlite3.connect(tmp_path / "a.job")
    db.execute("update record set payload = x'00ff'")
    db.commit()
    db.close()
    with pytest.raises(InputError, match=r"a\.job: the file of a job cannot be used"):
        read_sealed(tmp_path / "a.job", Point)


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from stickslip.study.keep.journal import JobJournal
from test_journal import Point, point
with JobJournal(Path(sys.argv[1]), Point) as journal:
    journal.add(point(0))
    journal.add(point(1))
    journal._db.execute("begin")
    journal.add(point(2))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_kill_in_the_middle_of_an_insert_leaves_whole_records(tmp_path: Path) -> None:
    path = tmp_path / "a.part"
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(path), str(Path(__file__).parent)], check=False
    )
    assert ended.returncode == -9
    with JobJournal(path, Point) as journal:
        assert [p.index for p in journal.records()] == [0, 1]
    check = sqlite3.connect(path)
    assert check.execute("pragma integrity_check").fetchone() == ("ok",)
    check.close()


def test_any_wrong_byte_of_an_archive_is_a_value_error_or_harmless():
    whole = encode({"a": np.arange(40.0), "name": "x"})
    rng = np.random.default_rng(3)
    for _ in range(400):
        payload = bytearray(whole)
        payload[int(rng.integers(len(payload)))] = int(rng.integers(256))
        start = int(rng.integers(len(payload)))
        if rng.random() < 0.3:
            payload[start : start + 30] = bytes(30)
        try:
            decode(bytes(payload))
        except ValueError:
            continue
