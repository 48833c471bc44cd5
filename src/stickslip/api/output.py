"""Messages when output, memory or disk fail: one line."""

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from stickslip.errors import printable

TRACEBACK = "STICKSLIP_TRACEBACK"  # the environment variable that asks for one
FAILED = 1  # exit code
_LONGEST = 300  # characters of what a library says
_NO_MEMORY = ("cannot allocate", "failed to map segment", "out of memory", "can't start new thread")


@contextmanager
def output_that_may_fail() -> Iterator[None]:
    """Run a command with an output that may be closed, full or of few letters, and end with an exit code.

    Raises
    ------
    SystemExit
        If the output cannot be written, or as the command ends.
    """
    if sys.stdout is None:  # closed: the first file that is opened would get its number
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
    with suppress(AttributeError):  # not what was put in its place
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # what is left goes there
        with suppress(OSError, AttributeError):
            sys.stderr.write(f"standard output: cannot be written ({error.strerror}).\n")
        raise SystemExit(FAILED) from None


def unforeseen(error: BaseException) -> str:
    """Return the line that an error of the system, or one that we should not have, is told with."""
    said = " ".join(str(error).split())[:_LONGEST]
    if _lacks_memory(error):
        return (
            f"out of memory ({printable(said) or 'no more is given'}). What is finished is kept. Use fewer --workers, make the "
            "model smaller, or allow more memory."
        )
    if isinstance(error, OSError):
        place = f"{error.filename}" if error.filename else "a file, or the standard output"
        return printable(
            f"{place}: cannot be used ({error.strerror or said}). Look after it and run the same command again."
        )
    where, name = _origin(error), type(error).__name__
    return printable(
        f"stickslip: {name}: {said} ({where}). This is a fault of stickslip: please report it. "
        f"{TRACEBACK}=1 in the environment shows where it comes from."
    )


def _lacks_memory(error: BaseException | None) -> bool:
    """Say whether memory is what lacked: libraries that cannot be loaded say it in words, and hide it behind others."""
    while error is not None:
        words = str(error).lower()
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return True
        if any(text in words for text in _NO_MEMORY):
            return True
        error = error.__cause__ or error.__context__
    return False


def _origin(error: BaseException) -> str:
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    if trace is None:
        return "nowhere"
    return f"{Path(trace.tb_frame.f_code.co_filename).name}, line {trace.tb_lineno}"
