"""The file of a job: exact, whole after a kill, its own job's only, and named where it is damaged."""

import io
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.model.checksum import with_checksum
from stickslip.solve.status import Status
from stickslip.study.analysis import Pieces
from stickslip.study.store.archive import decode, decode_record, encode, encode_record
from stickslip.study.store.journal import JobJournal, read_note, read_sealed


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
    return all(type(x) is type(y) and np.array_equal(x, y, equal_nan=not isinstance(x, str | None)) for x, y in pairs)


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


def test_objects_in_an_archive_of_another_program_are_not_read() -> None:
    stream = io.BytesIO()
    np.savez(stream, a=np.array([object()]))
    with pytest.raises(ValueError, match="damaged archive: an array of objects"):
        decode(with_checksum(stream.getvalue()))


@pytest.mark.parametrize(
    "array",
    [
        np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        np.arange(24).reshape(2, 3, 4).transpose(2, 0, 1),
        np.zeros((0, 3), dtype=complex),
        np.array([True, False]),
        np.array(["µ", "", "three"]),
    ],
    ids=["columns", "turned", "empty", "truths", "texts"],
)
def test_arrays_come_back_as_numpy_reads_them(array: np.ndarray) -> None:
    payload = encode({"a": array})
    (found,) = decode(payload).values()
    with np.load(io.BytesIO(payload)) as opened:
        known = opened["a"]
    assert found.dtype == known.dtype
    assert found.flags.f_contiguous == known.flags.f_contiguous
    np.testing.assert_array_equal(found, array)
    found[...] = found  # it may be changed


def test_file_of_another_job_is_refused(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as journal:
        journal.put("model", {"n": 1})
    (tmp_path / "a.part").rename(tmp_path / "b.part")
    with pytest.raises(InputError, match=r"b\.part: is the file of another job\. .*--fresh"):
        JobJournal(tmp_path / "b.part", Point)


def test_job_that_is_at_work_is_not_opened_again(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as first:
        with pytest.raises(InputError, match=r"another run is at work in it\. Wait for it, or stop"):
            JobJournal(tmp_path / "a.part", Point)
        first.add(point(0))


@pytest.mark.parametrize("end", [".part", ".job"])
def test_damaged_file_is_told(tmp_path: Path, end: str) -> None:
    path = tmp_path / f"a{end}"
    path.write_bytes(b"no database at all" * 100)
    with pytest.raises(InputError, match=r"the file of a job cannot be used .*start over with --fr"):
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
from stickslip.study.store.journal import JobJournal
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
    ended = subprocess.run([sys.executable, "-c", KILLED, str(path), str(Path(__file__).parent)], check=False)
    assert ended.returncode == -9
    with JobJournal(path, Point) as journal:
        assert [p.index for p in journal.records()] == [0, 1]
    check = sqlite3.connect(path)
    assert check.execute("pragma integrity_check").fetchone() == ("ok",)
    check.close()


def test_a_file_of_an_older_layout_is_refused_with_run_anew(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as journal:
        journal.add(point(0))
    with closing(sqlite3.connect(tmp_path / "a.part")) as db:
        db.execute("update meta set value = '6:a' where key = 'file'")
        db.commit()
    with pytest.raises(InputError, match=r"a\.part: was written by another version .*Run anew"):
        JobJournal(tmp_path / "a.part", Point)


def test_every_flipped_bit_of_a_record_or_note_is_seen():
    """All bits: of what zip passes over (dates, flags, the names in its directory), too."""
    note = encode({"a": np.arange(5.0), "name": "x", "finished": True})
    for whole, read in ((encode_record(point(3)), decode_record), (note, decode)):
        kind = (Point,) if read is decode_record else ()
        for bit in range(8 * len(whole)):
            flipped = bytearray(whole)
            flipped[bit // 8] ^= 1 << bit % 8
            with pytest.raises(ValueError, match=r"checksum|other bytes"):
                read(bytes(flipped), *kind)
        for length in range(len(whole)):
            with pytest.raises(ValueError, match="checksum"):
                read(whole[:length], *kind)


FLIPS = pytest.mark.parametrize("count", [300, pytest.param(5000, marks=pytest.mark.validation)])


@FLIPS
@pytest.mark.parametrize("end", [".part", ".job"])
def test_a_flipped_bit_of_a_job_is_refused_or_changes_nothing(tmp_path: Path, end: str, count: int) -> None:
    """Anywhere in the file: names of notes, numbers of records, SQLite's own pages."""
    path = tmp_path / "a.part"
    with JobJournal(path, Point) as journal:
        journal.add(point(0))
        journal.add(point(3))
        journal.put("finished", {"points": 2})
        journal.put("model", {"a": np.eye(2), "names": np.array(["L1.1", "R.3"])})
        if end == ".job":
            journal.seal()
    whole, path = path.with_suffix(end).read_bytes(), path.with_suffix(end)
    rng = np.random.default_rng(11)
    told: list[tuple[str, bool]] = []
    for bit in rng.integers(8 * len(whole), size=count):
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << int(bit % 8)
        path.write_bytes(flipped)
        try:
            records, notes = _read(path)
        except InputError as error:
            told.append((error.place, "--fresh" in error.remedy))
        else:
            assert [p.index for p in records] == [0, 3]
            assert all(same(p, point(p.index)) for p in records)
            assert notes["finished"] == {"points": 2}
            np.testing.assert_array_equal(notes["model"]["a"], np.eye(2))
            assert list(notes["model"]["names"]) == ["L1.1", "R.3"]
    assert len(told) > count // 20
    assert set(told) == {(str(path), True)}


def test_pieces_of_a_stopped_computation_are_found_again_and_given_up_at_its_end(tmp_path: Path) -> None:
    path, made = tmp_path / "a.part", []

    def make(value: int) -> dict[str, np.ndarray]:
        made.append(value)
        return {"a": np.full(200_000, float(value))}

    def computed(journal: JobJournal, count: int) -> float:
        pieces = Pieces(journal, "stability.0", seconds=0.0)
        total = sum(pieces.keep(f"piece {i}", lambda i=i: make(i))["a"].sum() for i in range(count))  # type: ignore[misc]
        if count == 5:
            pieces.give_up()
        return float(total)

    with JobJournal(path, Point) as journal:
        computed(journal, 3)  # stopped here
    with JobJournal(path, Point) as journal:
        assert len(journal.notes()) == 3
        assert computed(journal, 5) == 200_000 * 10.0
        assert made == [0, 1, 2, 3, 4]
        assert journal.notes() == {}
        journal.add(point(0))
        large = path.stat().st_size
        journal.seal()
    assert path.with_suffix(".job").stat().st_size < 0.01 * large
    assert same(read_sealed(path.with_suffix(".job"), Point)[0][0], point(0))


def test_pieces_that_are_soon_made_are_not_kept(tmp_path: Path) -> None:
    with JobJournal(tmp_path / "a.part", Point) as journal:
        Pieces(journal, "stability.0").keep("piece", lambda: {"a": 1.0})
        assert journal.notes() == {}


def _read(path: Path) -> tuple[list[Point], dict[str, dict[str, object]]]:
    """Read a file as a run does that goes on with it."""
    if path.suffix == ".job":
        return read_sealed(path, Point)
    with JobJournal(path, Point) as journal:
        journal.check()
        return journal.records(), journal.notes()
