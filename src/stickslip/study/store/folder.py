"""The results folder, which is created, tested and locked before a run."""

import os
import shutil
import sqlite3
from collections.abc import Container, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from stat import S_ISLNK, S_ISREG
from uuid import uuid4

from stickslip.errors import InputError, input_error
from stickslip.study.own_code import CODE_FILE
from stickslip.study.store.atomic_write import REMEDIES, beside, unwritable, unwritable_database
from stickslip.study.store.journal import AT_WORK, BESIDE, SEALED

NEEDED_BYTES = 200_000_000  # results, jobs and parts of a usual run
RESULT, REPORT, LOG_FILE, LOCK = "result.nc", "report.html", "run.log", "run.lock"
JOBS, PARTS = "jobs", "parts"
TRIAL = ".stickslip-trial"
LONGEST_PATH = 512  # bytes of the path of an SQLite file
LONGEST_NAME = len(f"/{JOBS}/{64 * 'k'}.{12 * 'o'}{AT_WORK}{BESIDE}")  # bytes of its longest name in a results folder
WHOLE = (RESULT, REPORT, CODE_FILE, f"{PARTS}/*.npz")  # files written under a temporary name until complete
OWN = (*WHOLE, *map(beside, WHOLE), *(f"{JOBS}/*{end}{more}" for end in (AT_WORK, SEALED) for more in ("", BESIDE)))
LEFT = (*map(beside, WHOLE), "run-*.on", f"{TRIAL}-*")  # files that a killed run may leave behind
SHARD_LOGS = "run-*-of-*.log"
HELD = (LOCK, f"{LOCK}{BESIDE}", LOG_FILE, SHARD_LOGS, *LEFT)  # further files that every run may write


@contextmanager
def locked_folder(folder: Path, *, shared: bool = False) -> Iterator[None]:
    """Create the results folder, lock it for one run or for all its shards, and check that a run can write its files.

    Raises
    ------
    InputError
        If another run uses it, it cannot be created or written, or the disk is nearly full.
    """
    try:
        for inner in (folder, folder / JOBS, folder / PARTS):
            inner.mkdir(parents=True, exist_ok=True)
        _refuse_long_path(folder)
        _refuse_strangers(folder)
        _try_out(folder)
    except OSError as error:
        raise _unwritable(folder, error) from None
    try:
        lock = _locked(folder / LOCK, folder, shared=shared)
    except sqlite3.DatabaseError as error:
        no_lock = input_error(str(folder / LOCK), f"is no lock of a run ({error})", "Delete it.")
        raise unwritable_database(folder / LOCK, error) or no_lock from None
    with closing(lock):
        if not shared:
            for path in (path for pattern in LEFT for path in _found(folder, pattern)):
                with suppress(OSError):
                    path.unlink(missing_ok=True)
        yield


@contextmanager
def token_file(folder: Path) -> Iterator[Path]:
    """Yield a file that exists while the block runs: it shows other machines that they see the folder and the run continues."""
    token = folder / f"run-{uuid4().hex[:12]}.on"
    try:
        token.touch(exist_ok=False)
        yield token
    except OSError as error:
        raise _unwritable(folder, error) from None
    finally:
        token.unlink(missing_ok=True)


def empty_folder(folder: Path, own: Sequence[str] = (), spared: Container[Path] = ()) -> None:
    """Remove the files that runs write, and no others.

    Parameters
    ----------
    folder
        A locked results folder.
    own
        Names of additional files that runs of this study write.
    spared
        Files already written by this run.

    Raises
    ------
    InputError
        If a process of an earlier run still uses one of them; nothing is removed then.
    """
    patterns = (*OWN, *own, *map(beside, own))
    found = [path for pattern in patterns for path in _found(folder, pattern)]
    for path in folder.glob(f"{JOBS}/*{AT_WORK}"):  # a worker may outlive a killed run
        with suppress(sqlite3.DatabaseError):
            _locked(path, folder).close()
    for path in found:
        if path not in spared:
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise unwritable(path, error) from None


def _refuse_strangers(folder: Path) -> None:
    """Refuse links, folders and devices under names of run files: a run would write or delete through them."""
    inner = [folder / name for name in (JOBS, PARTS)]
    files = [path for pattern in (*OWN, *HELD) for path in _found(folder, pattern)]
    for path in [*inner, *files]:
        try:
            mode = path.lstat().st_mode
        except FileNotFoundError:
            continue  # another shard has renamed or removed its file in the meantime
        if S_ISLNK(mode):
            raise _stranger(path, "is a link, which a run does not follow")
        if path not in inner and not S_ISREG(mode):
            raise _stranger(path, "is no file, but a run writes a file of that name")


def _refuse_long_path(folder: Path) -> None:
    """Refuse a folder whose path is too long for SQLite, before any computation."""
    length = len(os.fsencode(folder.absolute()))
    if length + LONGEST_NAME > LONGEST_PATH:
        raise input_error(
            f"output folder {folder}",
            f"has a path of {length} bytes, and SQLite opens files of jobs in folders of up to {LONGEST_PATH - LONGEST_NAME}",
            "Put the study into a folder with a shorter path.",
        )


def _stranger(path: Path, problem: str) -> InputError:
    return input_error(str(path), problem, "Remove it, or name another folder under [output].")


def _try_out(folder: Path) -> None:
    trial = folder / f"{TRIAL}-{uuid4().hex[:12]}"
    with trial.open("xb") as stream:
        stream.write(b"x")
        os.fsync(stream.fileno())
    trial.unlink()
    free = shutil.disk_usage(folder).free
    if free < NEEDED_BYTES:
        raise input_error(
            f"output folder {folder}",
            f"its disk has {free / 1e6:.0f} MB free, a run needs up to {NEEDED_BYTES / 1e6:.0f} MB",
            "Make room, or put the study on another disk.",
        )


def _locked(path: Path, folder: Path, *, shared: bool = False) -> sqlite3.Connection:
    """Return a lock on a file, held until it is closed or the process ends; SQLite locks files in the same way on all systems.

    Shards share the lock, so that no other run begins. On file systems without locks, shards run unlocked.

    Raises
    ------
    InputError
        If another process holds it.
    sqlite3.DatabaseError
        If it is not an SQLite file.
    """
    db = sqlite3.connect(path, isolation_level=None, timeout=0.5)
    try:
        db.execute("begin" if shared else "begin exclusive")
        if shared:
            db.execute("select count(*) from sqlite_master").fetchone()
    except sqlite3.DatabaseError as error:
        if shared and "locked" not in str(error):
            return db
        db.close()
        if "locked" in str(error):
            raise input_error(str(folder), "another run is at work in it", "Wait for it, or stop it.") from None
        raise
    return db


def _found(folder: Path, pattern: str) -> Iterator[Path]:
    """Yield the entries of a folder that match a pattern, including broken links."""
    if "*" in pattern:
        yield from folder.glob(pattern)
    elif os.path.lexists(folder / pattern):
        yield folder / pattern


def _unwritable(folder: Path, error: OSError) -> InputError:
    # os.path returns False for names that are too long, where Path raises
    ways = (folder / JOBS, folder / PARTS, folder, *folder.parents)
    for path in ways:
        if os.path.exists(path) and not os.path.isdir(path):  # noqa: PTH110, PTH112
            return _stranger(path, "is a file, and a run makes a folder of that name")
        if os.path.islink(path) and not os.path.exists(path):  # noqa: PTH110, PTH114
            return _stranger(path, "is a link that leads nowhere, or to itself")
    denied = "Change its permissions, or name another folder under [output]."
    remedy = REMEDIES.get(error.errno or 0, denied)
    return input_error(f"output folder {folder}", f"cannot be written ({error.strerror})", remedy)
