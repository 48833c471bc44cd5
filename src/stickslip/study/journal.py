"""Crash-safe store of everything a run has finished, point by point.

One SQLite file. Every point is its own transaction with full synchronisation and a rollback journal, so that a killed run
leaves whole points only. Arrays travel as uncompressed NumPy archives, written and read without pickle.
"""

import io
import sqlite3
from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from pathlib import Path
from types import TracebackType
from typing import Any, Self, get_type_hints

import numpy as np

from stickslip.errors import input_error

FORMAT = 4  # raised whenever the tables or the archives change
TABLES = """
create table if not exists meta (key text primary key, value text not null);
create table if not exists point (
    id integer primary key autoincrement, load_case integer not null,
    arrived text not null default (strftime('%Y-%m-%dT%H:%M:%f', 'now')), payload blob not null);
create table if not exists record (name text primary key, payload blob not null);
"""


class Journal:
    """An open journal; use as a context manager.

    Parameters
    ----------
    path
        The file; created when it does not exist.
    fingerprint
        What the stored numbers depend on. A journal of another fingerprint is refused, unless nothing is in it.
    point_type
        Dataclass of the points, of arrays, numbers, strings, enumerations and None.

    Raises
    ------
    InputError
        If the file belongs to another study or version, or cannot be read.
    """

    def __init__(self, path: Path, fingerprint: str, point_type: type[Any]) -> None:
        self._path = path
        self._type = point_type
        try:
            # autocommit: each insert is a transaction of its own
            self._db = sqlite3.connect(path, isolation_level=None, timeout=0.5)
            # held until the process ends, however it ends: one run a folder
            self._db.execute("pragma locking_mode = exclusive")
            self._db.execute("pragma journal_mode = delete")
            self._db.execute("pragma synchronous = full")
            self._db.executescript(TABLES)
            self._check(f"{FORMAT}:{fingerprint}")
            self._db.execute("update meta set value = value")  # takes the lock
        except sqlite3.DatabaseError as error:
            self._db.close()
            if "locked" in str(error):
                raise input_error(
                    str(path.parent), "another run is at work in it", "Wait for it, or stop it."
                ) from None
            raise input_error(
                str(path),
                f"the journal of finished points cannot be used ({error})",
                "Free the folder, or start over with --fresh.",
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._db.close()

    def _check(self, fingerprint: str) -> None:
        if not self.count and self._db.execute("select 1 from record").fetchone() is None:
            # a start that ended before anything was computed binds nobody
            self._db.execute("delete from meta")
        self._db.execute("insert or ignore into meta values ('fingerprint', ?)", (fingerprint,))
        (found,) = self._db.execute("select value from meta where key = 'fingerprint'").fetchone()
        if found != fingerprint:
            self._db.close()
            raise input_error(
                str(self._path.parent),
                "what this command left here is of another or a changed study, or of another version of stickslip or its libraries",
                "Start over with --fresh, which removes this command's files of the folder and no others, or name another folder under [output].",
            )

    @property
    def count(self) -> int:
        """Number of finished points, of all load cases."""
        (n,) = self._db.execute("select count(*) from point").fetchone()
        return int(n)

    def add(self, load_case: int, point: object) -> None:
        """Store a finished point; it is on the disk when this returns."""
        self._db.execute(
            "insert into point (load_case, payload) values (?, ?)",
            (load_case, encode(_values(point))),
        )

    def points(self, load_case: int) -> list[Any]:
        """Return the finished points of a load case in the order in which they came."""
        rows = self._db.execute(
            "select payload from point where load_case = ? order by id", (load_case,)
        )
        return [self._point(decode(payload)) for (payload,) in rows]

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        """Store named arrays, numbers and strings under `name`."""
        self._db.execute("insert or replace into record values (?, ?)", (name, encode(values)))

    def get(self, name: str) -> dict[str, Any] | None:
        """Return what `put` stored under `name`, or None."""
        row = self._db.execute("select payload from record where name = ?", (name,)).fetchone()
        return None if row is None else decode(row[0])

    def _point(self, values: dict[str, Any]) -> Any:
        hints = get_type_hints(self._type)
        for name, value in values.items():
            hint = hints[name]
            if isinstance(hint, type) and issubclass(hint, Enum):
                values[name] = hint[value]
        missing = {f.name: None for f in fields(self._type) if f.init and f.name not in values}
        return self._type(**values, **missing)


def _values(point: Any) -> dict[str, Any]:
    found = {f.name: getattr(point, f.name) for f in fields(point) if f.init}
    return {k: v.name if isinstance(v, Enum) else v for k, v in found.items()}


def encode(values: Mapping[str, Any]) -> bytes:
    """Return named arrays, numbers and strings as a NumPy archive; entries that are None are left out."""
    stream = io.BytesIO()
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def decode(payload: bytes) -> dict[str, Any]:
    """Return what `encode` wrote; zero-dimensional arrays come back as Python scalars."""
    with np.load(io.BytesIO(payload), allow_pickle=False) as archive:
        found = {name: archive[name] for name in archive.files}
    return {k: v.item() if v.ndim == 0 else v for k, v in found.items()}
