"""The journals of a job, each one SQLite file, to which records are appended.

Every record is a transaction with full synchronisation and a rollback journal, so a killed run leaves only complete records. Every
record and note ends with its checksum, and a sealed file has a checksum of all of them. The file of a running job is ``<key>.part``,
or ``<key>.<owner>.part`` if processes of several machines share the folder; the sealed file is ``<key>.job``.

Of several attempts at one job, each process has its own journal, and the one with most progress counts. No lock is needed, so this
works on shared folders with unreliable locks. Two processes get exactly the same results for a job, so either may seal it.
"""

import shutil
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from uuid import uuid4

from stickslip.errors import InputError, input_error
from stickslip.study.store.archive import FORMAT, decode, decode_record, encode, encode_record
from stickslip.study.store.atomic_write import unwritable, unwritable_database
from stickslip.study.store.progress import LOG

AT_WORK, SEALED = ".part", ".job"
BESIDE = "-journal"  # suffix of SQLite's rollback journal
WHOLE = "whole"  # key of the checksum of all records and notes in a sealed file
DEATHS, DIED_AT = "deaths", "died at"  # keys: abnormal ends of the job's process, and the records and notes at the last
MANY_EMPTY = 256  # empty pages of deleted notes, 4 kB each, above which a file is compacted
PLACE = "select (select count(*) from record) || ' ' || (select count(*) from note)"
ANEW = "Run anew with --fresh, which removes what runs wrote into the folder and no other file."
FRESH = "Delete it, or start over with --fresh, which removes what runs wrote into the folder and no other file."
TABLES = """
create table if not exists meta (key text primary key, value text not null);
create table if not exists record (
    id integer primary key autoincrement,
    arrived text not null default (strftime('%Y-%m-%dT%H:%M:%f', 'now')), payload blob not null);
create table if not exists note (name text primary key, payload blob not null);
"""


class JobJournal:
    """The open file of a running job; a context manager. It serves as the job's `Notes`.

    Parameters
    ----------
    path
        The file, ``<key>.part``; created if missing.
    record_type
        Dataclass of the records, with fields of arrays, numbers, texts, enumerations and None; needed for reading.

    Raises
    ------
    InputError
        If the file is in use, or cannot be read.
    """

    def __init__(self, path: Path, record_type: type[Any] = object) -> None:
        self._path = path
        self._type = record_type
        with _named(path):
            self._db = _opened(path)
            try:
                # the lock is held until the process ends, normally or not
                self._db.execute("pragma locking_mode = exclusive")
                self._db.execute("pragma journal_mode = delete")
                self._db.execute("pragma synchronous = full")
                self._db.executescript(TABLES)
                self._db.execute("insert or ignore into meta values ('file', ?)", (_mark(path),))
                self._db.execute("delete from meta where key = ?", (WHOLE,))
                self._db.execute("update meta set value = value")  # takes the lock
                _check_mark(self._db, path)
            except BaseException:
                self._db.close()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._db.close()

    def add(self, record: object) -> None:
        """Store a finished record; it is on disk when this returns."""
        payload = encode_record(record)
        with _named(self._path):
            self._db.execute("insert into record (payload) values (?)", (payload,))

    def records(self) -> list[Any]:
        """Return the finished records in the order of solution."""
        with _named(self._path):
            return _records(self._db, self._type)

    def put(self, name: str, values: Mapping[str, Any]) -> None:
        """Store named arrays, numbers and texts under `name`."""
        payload = encode(values)
        with _named(self._path):
            self._db.execute("insert or replace into note values (?, ?)", (name, payload))

    def forget(self, name: str) -> None:
        """Remove what `put` stored under `name`."""
        with _named(self._path):
            self._db.execute("delete from note where name = ?", (name,))

    def get(self, name: str) -> dict[str, Any] | None:
        """Return the note stored under `name`; None for an unknown name."""
        with _named(self._path):
            return _note(self._db, name)

    def notes(self) -> dict[str, dict[str, Any]]:
        """Return all notes by name."""
        with _named(self._path):
            return _notes(self._db)

    def check(self) -> None:
        """Read the whole file, and refuse it if any part is damaged."""
        with _named(self._path):
            (said,) = self._db.execute("pragma integrity_check").fetchone()
            if said != "ok":
                raise ValueError(said)
            _records(self._db, self._type)
            _notes(self._db)

    def died(self) -> int:
        """Count an abnormal end of the job's process; return the number of such ends since the last record or note."""
        with _named(self._path):
            (count,) = self._db.execute(PLACE).fetchone()
            kept = dict(self._db.execute("select key, value from meta"))
            deaths = int(kept[DEATHS]) + 1 if kept.get(DIED_AT) == count else 1
            rows = [(DIED_AT, count), (DEATHS, str(deaths))]
            self._db.executemany("insert or replace into meta values (?, ?)", rows)
        return deaths

    def seal(self) -> None:
        """Add the checksum, close the file and rename it to the name of a finished job."""
        with _named(self._path):
            self._db.execute("delete from meta where key in (?, ?)", (DEATHS, DIED_AT))
            self._db.execute("insert into meta values (?, ?)", (WHOLE, _checksum(self._db)))
            (empty,) = self._db.execute("pragma freelist_count").fetchone()
            if empty >= MANY_EMPTY:
                self._db.execute("vacuum")
            self._db.close()
            self._path.replace(self._path.with_name(f"{_key(self._path)}{SEALED}"))


def read_sealed(path: Path, record_type: type[Any]) -> tuple[list[Any], dict[str, dict[str, Any]]]:
    """Return the records and the notes of a sealed job.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    with _named(path), _reading(path) as db:
        (whole,) = db.execute("select value from meta where key = ?", (WHOLE,)).fetchone()
        if whole != _checksum(db):
            raise ValueError("holds other records or notes than were sealed")
        return _records(db, record_type), _notes(db)


def read_note(path: Path, name: str) -> dict[str, Any] | None:
    """Return one note of a sealed job; None for an unknown name. Errors as in `read_sealed`."""
    with _named(path), _reading(path) as db:
        return _note(db, name)


def read_place(path: Path) -> tuple[int, int]:
    """Return the number of records in a job's file, and of abnormal ends since the last record; zeros for an unreadable file."""
    try:
        with closing(_unlocked(path)) as db:
            (records,) = db.execute("select count(*) from record").fetchone()
            deaths = db.execute("select value from meta where key = ?", (DEATHS,)).fetchone()
        return records, int(deaths[0]) if deaths else 0
    except (sqlite3.Error, ValueError):
        return 0, 0  # another process may be writing


def _unlocked(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)


@contextmanager
def _reading(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(_unlocked(path)) as db:
        _check_mark(db, path)
        if db.execute("select value from meta where key = ?", (WHOLE,)).fetchone() is None:
            raise input_error(str(path), "is the file of a job that has not ended", FRESH)
        yield db


def _opened(path: Path) -> sqlite3.Connection:
    """Open a file; without locks if it has an owner and so a single writer, since some shared folders have no locks."""
    name, alone = str(path), path.stem != _key(path)
    if alone:
        name = f"{path.absolute().as_uri()}?nolock=1"
    # autocommit: each insert is its own transaction
    return sqlite3.connect(name, isolation_level=None, timeout=0.5, uri=alone)


def _key(path: Path) -> str:
    """Return the key of a job from the name of any of its files."""
    return path.name.partition(".")[0]


def _mark(path: Path) -> str:
    return f"{FORMAT}:{_key(path)}"


def _check_mark(db: sqlite3.Connection, path: Path) -> None:
    """Refuse the file of another job or of another layout version."""
    row = db.execute("select value from meta where key = 'file'").fetchone()
    layout, _, key = str(row[0] if row else "").partition(":")
    if layout.isdecimal() and int(layout) != FORMAT and key == _key(path):
        problem = f"was written by another version of stickslip (layout {layout}, this one has {FORMAT})"
        raise input_error(str(path), problem, ANEW)
    if row is None or row[0] != _mark(path):
        raise input_error(str(path), "is the file of another job", FRESH)


def _checksum(db: sqlite3.Connection) -> str:
    """Return the checksum of all records and notes, with their numbers or names."""
    found = sha256()
    for rows in ("select id, payload from record order by id", "select name, payload from note order by name"):
        for place, payload in db.execute(rows).fetchall():  # see `_notes`
            found.update(f"{place} {len(payload)} ".encode() + payload)
    return found.hexdigest()


def _records(db: sqlite3.Connection, kind: type[Any]) -> list[Any]:
    """Return the records after a check that none is missing: numbers have no gaps, and the last number is stored separately."""
    rows = db.execute("select id, payload from record order by id").fetchall()
    last = db.execute("select seq from sqlite_sequence where name = 'record'").fetchone()
    if [number for number, _ in rows] != list(range(1, (last[0] if last else 0) + 1)):
        raise ValueError("records are missing")
    return [decode_record(payload, kind) for _, payload in rows]


def _notes(db: sqlite3.Connection) -> dict[str, dict[str, Any]]:
    # fetchall: a query interrupted by an error would hold the file's lock as long as the exception exists
    rows = db.execute("select name, payload from note order by name").fetchall()
    return {name: decode(payload) for name, payload in rows}


def _note(db: sqlite3.Connection, name: str) -> dict[str, Any] | None:
    row = db.execute("select payload from note where name = ?", (name,)).fetchone()
    return None if row is None else decode(row[0])


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Convert errors of libraries about a damaged file or a full disk into an error that names the file."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise unwritable(path, error) from error
    except (sqlite3.Error, ValueError, KeyError, TypeError, OverflowError) as error:
        if "locked" in str(error):
            raise input_error(
                str(path.parent.parent), "another run is at work in it", "Wait for it, or stop it."
            ) from None
        refused = unwritable_database(path, error) if isinstance(error, sqlite3.Error) else None
        if refused is not None:
            raise refused from error
        raise input_error(str(path), f"the file of a job cannot be used ({error})", FRESH) from error


def file_at_work(sealed: Path, owner: str = "") -> Path:
    """Return the name of the file of a running job: ``KEY.part``, or ``KEY.OWNER.part``."""
    return sealed.with_suffix(f".{owner}{AT_WORK}" if owner else AT_WORK)


def new_owner() -> str:
    """Return a unique name for this process."""
    return uuid4().hex[:12]


def left_behind(sealed: Path) -> list[Path]:
    """Return all files of a running job, the one with most progress first."""
    found = [p for p in sealed.parent.glob(f"{sealed.stem}.*") if p.suffix == AT_WORK]
    return sorted(found, key=reached, reverse=True)


def reached(path: Path) -> tuple[int, int, int]:
    """Return the progress of a file: its size, its number of records (small records may not change the size), and deaths."""
    return (_size(path), *read_place(path))


def begin(sealed: Path, own: Path, record: type) -> None:
    """Create the file of a running job as a copy of the existing one with most progress, of any process."""
    for path in sorted([*left_behind(sealed), sealed], key=reached, reverse=True):
        if path == own or reached(path) <= reached(own):
            return
        if _copied(path, own, record):
            return


@contextmanager
def until_sealed_elsewhere(sealed: Path, own: Path) -> Iterator[None]:
    """End an attempt without an error when another process seals the job first and removes this attempt's file."""
    try:
        yield
    except InputError:
        if own.exists() or not sealed.exists():
            raise
        LOG.info(f"{sealed.stem[:12]}: another process has finished this job")
        clear(sealed)


def clear(sealed: Path) -> None:
    """Remove all files left by the attempts at a sealed job; files already removed by another process are ignored."""
    for end in (AT_WORK, f"{AT_WORK}{BESIDE}"):
        for file in sealed.parent.glob(f"{sealed.stem}.*{end.removeprefix('.')}"):
            with suppress(OSError):  # the next run in the folder removes it
                file.unlink(missing_ok=True)


def _copied(path: Path, own: Path, record: type) -> bool:
    """Copy a file to which another process may be writing; return whether the copy is valid."""
    copy = file_at_work(own.with_name(own.name.partition(".")[0]), new_owner())
    try:
        # with the rollback journal, SQLite undoes incomplete writes in the copy
        with suppress(FileNotFoundError):
            shutil.copyfile(f"{path}{BESIDE}", f"{copy}{BESIDE}")
        shutil.copyfile(path, copy)
        with JobJournal(copy, record) as journal:
            journal.check()
        copy.replace(own)
    except (OSError, InputError) as error:
        LOG.info(f"{path} is passed over ({error})")
        for file in (copy, Path(f"{copy}{BESIDE}")):
            file.unlink(missing_ok=True)
        return False
    return True


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return -1
