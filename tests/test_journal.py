"""The journal: exact, whole after a kill, and closed to other studies."""

import sqlite3
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from stickslip.errors import InputError
from stickslip.response.forced.response import ForcedPoint
from stickslip.solve.status import Status
from stickslip.study.journal import Journal, decode, encode


def point(index: int) -> ForcedPoint:
    rng = np.random.default_rng(index)
    q = rng.standard_normal((2, 4)) + 1j * rng.standard_normal((2, 4))
    status = Status.STALLED if index == 3 else Status.CONVERGED
    return ForcedPoint(
        "low",
        index,
        1000.0 / 3 + index,
        q,
        rng.standard_normal(9),
        0.1,
        status,
        4,
        float("nan"),
        1e-3,
        2e-3,
        4e-3,
    )


def same(a: ForcedPoint, b: ForcedPoint) -> bool:
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in fields(ForcedPoint)]
    return all(
        type(x) is type(y) and np.array_equal(x, y, equal_nan=not isinstance(x, str))
        for x, y in pairs
    )


def test_points_come_back_bit_for_bit_in_their_order(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with Journal(path, "a", ForcedPoint) as journal:
        for i in (0, 3, 1):
            journal.add(0, point(i))
        journal.add(1, point(2))
    with Journal(path, "a", ForcedPoint) as journal:
        back = journal.points(0)
        assert [p.index for p in back] == [0, 3, 1]
        assert all(same(p, point(p.index)) for p in back)
        assert back[1].status is Status.STALLED
        assert [p.index for p in journal.points(1)] == [2]
        assert journal.points(7) == []


def test_records_hold_arrays_numbers_and_text(tmp_path: Path) -> None:
    values = {"a": np.eye(2), "n": 3, "x": 1 / 3, "names": np.array(["L1.1", "R.3"]), "none": None}
    with Journal(tmp_path / "j.sqlite", "a", ForcedPoint) as journal:
        assert journal.get("model") is None
        journal.put("model", values)
        journal.put("model", values | {"n": 4})
        back = journal.get("model")
    assert back is not None
    assert sorted(back) == ["a", "n", "names", "x"]
    assert back["n"] == 4
    assert back["x"] == 1 / 3
    assert list(back["names"]) == ["L1.1", "R.3"]


def test_objects_that_would_need_pickle_are_refused() -> None:
    with pytest.raises(ValueError, match="Object arrays cannot be saved"):
        encode({"a": np.array([object()])})
    assert decode(encode({"a": 1.5})) == {"a": 1.5}


def test_folder_of_another_study_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with Journal(path, "a", ForcedPoint) as journal:
        journal.put("model", {"n": 1})
    with pytest.raises(InputError) as caught:
        Journal(path, "b", ForcedPoint)
    assert str(caught.value) == (
        f"{tmp_path}: what this command left here is of another or a changed study, or of another version of stickslip or its libraries. "
        "Start over with --fresh, which removes this command's files of the folder and no others, or name another folder under [output]."
    )


def test_journal_in_which_nothing_was_computed_binds_nobody(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with Journal(path, "a", ForcedPoint):
        pass
    with Journal(path, "b", ForcedPoint) as journal:
        assert journal.count == 0
        journal.add(2, point(0))
        assert journal.count == 1
    with pytest.raises(InputError, match="of another or a changed study"):
        Journal(path, "a", ForcedPoint)


def test_second_run_in_the_same_folder_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with Journal(path, "a", ForcedPoint) as first:
        with pytest.raises(
            InputError, match=r"another run is at work in it\. Wait for it, or stop it"
        ):
            Journal(path, "a", ForcedPoint)
        first.add(0, point(0))


def test_damaged_journal_is_told(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    path.write_bytes(b"no database at all" * 100)
    with pytest.raises(
        InputError, match=r"journal of finished points cannot be used .*or start over with --fresh"
    ):
        Journal(path, "a", ForcedPoint)


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from stickslip.response.forced.response import ForcedPoint
from stickslip.study.journal import Journal
from test_journal import point
with Journal(Path(sys.argv[1]), "a", ForcedPoint) as journal:
    journal.add(0, point(0))
    journal.add(0, point(1))
    journal._db.execute("begin")
    journal.add(0, point(2))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_kill_in_the_middle_of_an_insert_leaves_whole_points(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(path), str(Path(__file__).parent)], check=False
    )
    assert ended.returncode == -9
    with Journal(path, "a", ForcedPoint) as journal:
        assert [p.index for p in journal.points(0)] == [0, 1]
    check = sqlite3.connect(path)
    assert check.execute("pragma integrity_check").fetchone() == ("ok",)
    check.close()
