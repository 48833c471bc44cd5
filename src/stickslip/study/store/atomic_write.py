"""Atomic writes, and the error messages when they fail."""

import errno
import os
import signal
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from uuid import uuid4

from stickslip.errors import InputError, input_error

_ROOM = "Make room and run the same command again: no finished point is lost."
_QUOTA = f"Your quota is used up, whatever room the disk has. {_ROOM}"
_WRITTEN = (
    "The disk is full, a quota or a limit of the size of files is met, or the disk is broken. Make room and run the same command "
    "again: no finished point is lost."
)
_PLACE = "Give a place that you may write to."
REMEDIES = {
    errno.ENOSPC: _ROOM,
    errno.EDQUOT: _QUOTA,
    errno.EFBIG: "Raise the limit of the size of files, or choose another disk.",
    errno.EROFS: "Its disk may only be read: choose another one.",
    errno.EIO: "Look after the disk: it may be broken.",
    errno.ENOENT: "Make its folder first, or give another place.",
    errno.EISDIR: "A folder has that name: remove it, or give another name.",
    errno.ENOTDIR: "A file stands where a folder has to be: give another place.",
    errno.ELOOP: "Remove the link, which leads to itself.",
    errno.ENAMETOOLONG: "Give a shorter name.",
}


def unwritable(path: Path, error: OSError) -> InputError:
    """Return the error for a file that the system cannot write."""
    remedy = REMEDIES.get(error.errno or 0, _PLACE)
    return input_error(str(path), f"cannot be written ({error.strerror or error})", remedy)


def unwritable_database(path: Path, error: sqlite3.Error) -> InputError | None:
    """Return the error for a file that SQLite cannot write, since SQLite gives no errno; None if the content is at fault."""
    name = getattr(error, "sqlite_errorname", None) or ""
    if name.startswith(("SQLITE_FULL", "SQLITE_IOERR")) and "READ" not in name:
        return input_error(str(path), f"cannot be written ({error})", _WRITTEN)
    if name.startswith(("SQLITE_READONLY", "SQLITE_CANTOPEN", "SQLITE_PERM", "SQLITE_AUTH")):
        return input_error(str(path), f"cannot be written ({error})", _PLACE)
    return None


def beside(name: str, mark: str = "*") -> str:
    """Return the temporary name of a file while it is written, with the same suffix, which libraries evaluate.

    Parameters
    ----------
    name
        Final name.
    mark
        Mark of the writing process; the default is a pattern that matches all processes.
    """
    path = Path(name)
    return str(path.with_name(f"{path.stem}.{mark}.part{path.suffix}"))


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary name to write to, and move the file to `path` when the block ends; `path` is never partly written.

    A link in the way is replaced, not followed.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    temporary = Path(beside(str(path), uuid4().hex[:12]))
    try:
        _refuse_folder(path)
        temporary.open("xb").close()
        yield temporary
        with temporary.open("rb+") as stream:
            os.fsync(stream.fileno())
        temporary.replace(path)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise unwritable(path, error) from error
        raise


def _refuse_folder(path: Path) -> None:
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))


def write_whole(path: Path, content: bytes) -> None:
    """Write a file atomically; see `whole_file`."""
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def interrupted_later() -> Iterator[None]:
    """Delay an interrupt by the user (Ctrl-C) until the block ends, because libraries swallow exceptions raised in callbacks."""
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    asked: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _frame: asked.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if asked:
        raise KeyboardInterrupt
