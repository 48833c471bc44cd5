"""The results folder: made, tried out and locked before anything long begins."""

import os
import shutil
import sqlite3
from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from stickslip.errors import InputError, input_error
from stickslip.study.keep.journal import AT_WORK, SEALED

NEEDED_BYTES = 200_000_000  # results, jobs and parts of a usual run
RESULT, REPORT, LOG_FILE, LOCK = "result.nc", "report.html", "run.log", "run.lock"
JOBS, PARTS = "jobs", "parts"
OWN = (
    RESULT,
    f"{RESULT}.part",
    REPORT,
    *(f"{JOBS}/*{end}" for end in (AT_WORK, SEALED, f"{AT_WORK}-journal")),
    f"{PARTS}/*.npz",
    f"{PARTS}/*.npz.part",
)


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Make the folder, hold it for one run, and make sure that a run's files fit into it.

    Raises
    ------
    InputError
        If another run is at work in it, it cannot be made or written, or the disk is nearly full.
    """
    try:
        for inner in (folder, folder / JOBS, folder / PARTS):
            inner.mkdir(parents=True, exist_ok=True)
        _try_out(folder)
    except OSError as error:
        raise _unwritable(folder, error) from None
    lock = _lock(folder)
    try:
        yield
    finally:
        lock.close()


def empty_folder(folder: Path, own: Sequence[str] = (), spared: Container[Path] = ()) -> None:
    """Remove what runs write, and no other file.

    Parameters
    ----------
    folder
        A results folder that is locked.
    own
        Names of further files that runs of this study write.
    spared
        Files that this run has written already.
    """
    for pattern in (*OWN, *own):
        for path in folder.glob(pattern):
            if path not in spared:
                path.unlink()


def _try_out(folder: Path) -> None:
    trial = folder / ".stickslip-trial"
    with trial.open("wb") as stream:
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


def _lock(folder: Path) -> sqlite3.Connection:
    """Return what holds the folder until it is closed or the process ends: SQLite locks files alike on all systems."""
    db = sqlite3.connect(folder / LOCK, isolation_level=None, timeout=0.5)
    try:
        db.execute("begin exclusive")
    except sqlite3.DatabaseError as error:
        db.close()
        if "locked" in str(error):
            raise input_error(
                str(folder), "another run is at work in it", "Wait for it, or stop it."
            ) from None
        raise input_error(
            str(folder / LOCK), f"is no lock of a run ({error})", "Delete it."
        ) from None
    return db


def _unwritable(folder: Path, error: OSError) -> InputError:
    return input_error(
        f"output folder {folder}",
        f"cannot be written ({error.strerror})",
        "Change its permissions, or name another folder under [output].",
    )
