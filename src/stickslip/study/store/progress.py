"""Progress and messages of a run, through the standard logging.

Progress records have the attribute ``fraction`` (0 to 1, or None for a stage with unknown fraction); all other records are lines of the
log. The attribute ``job`` names the running job, ``sums_up`` its outcome.
"""

import logging
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path

from stickslip.errors import StickslipError
from stickslip.study.store.atomic_write import unwritable

LOG = logging.getLogger("stickslip")
DONE = "done"  # state of a job at its end
OF_RECORDS = ("fraction", "job", "verdict", "sums_up")  # additional attributes of our log records
_JOB = ContextVar("job", default="")


class Interrupted(StickslipError):  # noqa: N818  stopping a run is no error
    """The user stopped a run; finished records are stored."""


def advance(fraction: float, text: str) -> None:
    """Report the finished fraction of the running job, and its state in words."""
    LOG.info(text, extra={"fraction": fraction, "job": _JOB.get()})


def stage(text: str) -> None:
    """Report the present stage of the running job, if its finished fraction is unknown."""
    LOG.info(text, extra={"fraction": None, "job": _JOB.get()})


def tell(word: str, text: str) -> None:
    """Log a verdict under the word of its level; a note is no warning."""
    level = logging.INFO if word == "note" else logging.WARNING
    LOG.log(level, text, extra={"verdict": word.upper()})


def sum_up(text: str, line: str) -> None:
    """Report the outcome of the running job: in a few words, and as a line."""
    LOG.info(line, extra={"sums_up": text})


def _of_job(record: logging.LogRecord) -> bool:
    """Add the name of the running job to a record."""
    if not hasattr(record, "job"):
        record.job = _JOB.get()
    return True


LOG.addFilter(_of_job)


def head(record: logging.LogRecord) -> str:
    """Return the beginning of a log line: the word of a verdict, ``WARNING`` for other warnings, or nothing."""
    plain = "WARNING" if record.levelno >= logging.WARNING else ""
    word = getattr(record, "verdict", plain)
    return f"{word}: " if word else ""


@contextmanager
def at_work(job: str) -> Iterator[None]:
    """Name the running job in all progress records of the block."""
    token = _JOB.set(job)
    advance(0.0, job)
    try:
        yield
        advance(1.0, DONE)
    finally:
        _JOB.reset(token)


@contextmanager
def written_down(path: Path) -> Iterator[None]:
    """Write all log lines of a run to a file, without pure progress records.

    Raises
    ------
    InputError
        If the file cannot be written, at the beginning or later.
    """
    try:
        # file names may contain bytes that are no UTF-8
        handler = _LogFile(path, encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        raise unwritable(path, error) from None
    formatter = logging.Formatter("%(asctime)s %(head)s%(message)s", "%Y-%m-%dT%H:%M:%S+00:00")
    formatter.converter = time.gmtime
    handler.setFormatter(formatter)
    handler.addFilter(_line)
    level = LOG.level
    LOG.addHandler(handler)
    LOG.setLevel(min(LOG.getEffectiveLevel(), logging.INFO))
    try:
        yield
    finally:
        LOG.setLevel(level)
        LOG.removeHandler(handler)
        with suppress(OSError):  # the error was raised before
            handler.close()


class _LogFile(logging.FileHandler):
    """A log file that stops the run if it cannot be written; the standard library would print a traceback and continue."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Raise an error on a full disk; if it occurs in a thread that repeats lines of workers, the next line here raises it."""
        error = sys.exc_info()[1]
        if not isinstance(error, OSError):
            super().handleError(record)
        elif threading.current_thread() is threading.main_thread():
            raise unwritable(Path(self.baseFilename), error) from None


def _line(record: logging.LogRecord) -> bool:
    """Return whether a record is a line of the log, and add the beginning of the line."""
    record.head = head(record)
    return not hasattr(record, "fraction")
