"""Output on the terminal: lines, tables, and the single line of a failure of output, memory or disk."""

import errno
import math
import os
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from stickslip.errors import printable
from stickslip.study.file.case_names import CASE, shortened

_NUMBER = re.compile(r"-?\d+(\.\d+)?")
_DECIMALS = 5  # most decimals of cells that are printed unchanged
_DIGITS = 5  # digits of the largest number of a column
PLAIN_WIDTH = 130  # characters of a line without a terminal


def console() -> Console:
    """Return the console; its lines are wide if the output goes to a file."""
    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def say(text: str) -> None:
    """Print a line."""
    console().print(printable(text), markup=False, highlight=False, soft_wrap=True)


def say_lines(title: str, texts: Sequence[str]) -> None:
    """Print lines under a title; nothing for no lines."""
    for text in [f"\n{title}", *(f"  {text}" for text in texts)] if texts else []:
        say(text)


def aligned(cells: Sequence[str]) -> list[str]:
    """Return the cells of a numeric column with equal decimals, enough for two digits of the smallest number."""
    numbers = [c for c in cells if c]
    if not numbers or not all(_NUMBER.fullmatch(c) for c in numbers):
        return list(cells)
    sizes = [abs(float(c)) for c in numbers if float(c) != 0.0]
    each = {len(c.partition(".")[2]) for c in numbers}
    if not sizes or (len(each) == 1 and max(each) <= _DECIMALS):
        return list(cells)
    of_largest, of_smallest = (math.floor(math.log10(v)) for v in (max(sizes), min(sizes)))
    decimals = min(max(each), max(0, _DIGITS - 1 - of_largest, 1 - of_smallest))
    return [f"{float(c):.{decimals}f}" if c else c for c in cells]


def say_table(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[str]) -> None:
    """Print a table without its empty columns, then the lines below it."""
    if not rows:
        say_lines(title, lines)
        return
    say(f"\n{title}")
    table = Table()
    head, rows = _with_short_names(head, rows)
    told = [k for k in range(len(head)) if any(row[k] for row in rows)]
    for name in (head[k] for k in told):
        table.add_column(name, justify="right")
    columns = [aligned([row[k] for row in rows]) for k in told]
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    console().print(table)
    for line in lines:
        say(f"  {line}")


def _with_short_names(
    head: Sequence[str], rows: Sequence[Sequence[str]]
) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
    """Return a table whose long names of cases are without the words that they have in common; the heading has them."""
    if not rows or head[0] != CASE:
        return head, rows
    first, names = shortened([row[0] for row in rows])
    return [first, *head[1:]], [[name, *row[1:]] for name, row in zip(names, rows, strict=True)]


def say_columns(title: str, names: Iterable[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table whose cells wrap."""
    say(f"\n{title}")
    table = Table()
    head, cells_of = _with_short_names(list(names), list(rows))
    for name in head:
        table.add_column(name, overflow="fold")
    for cells in cells_of:
        table.add_row(*(Text(printable(cell)) for cell in cells))
    console().print(table)


def say_answers(verdicts: Sequence[str], failed: int, files: Sequence[Path], last: str) -> None:
    """Print verdicts, number of unconverged points, files, and last the conclusion."""
    say_lines("Verdicts", verdicts)
    if failed:
        told = f"{failed} of the points: marked in the result and in the report, not filled in"
        say_lines("Not converged", [told])
    say_lines("Files", [str(f) for f in files])
    say(f"\n{last}")


TRACEBACK = "STICKSLIP_TRACEBACK"  # environment variable that requests a traceback
FAILED = 1  # exit code
_LONGEST = 300  # characters of the message of a library
_NO_MEMORY = ("cannot allocate", "failed to map segment", "out of memory", "can't start new thread")


@contextmanager
def output_that_may_fail() -> Iterator[None]:
    """Run a command and end with its exit code, also if the output is closed, full or limited to few characters.

    Raises
    ------
    SystemExit
        At the end of the command, and if the output cannot be written.
    """
    if sys.stdout is None:  # closed: the next opened file would get its descriptor
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115
    with suppress(AttributeError):  # a replacement of stdout may lack the method
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # discards buffered output
        with suppress(OSError, AttributeError):
            sys.stderr.write(f"standard output: cannot be written ({error.strerror}).\n")
        raise SystemExit(FAILED) from None


def unforeseen(error: BaseException) -> str:
    """Return the line that reports an error of the system or an internal error."""
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
    from stickslip.study.own_code import line_of

    where, name = _origin(error), type(error).__name__
    if (own := line_of(error)) is not None:
        return printable(
            f"{own}: {name}: {said}. Correct your code, and run the same command again. "
            f"{TRACEBACK}=1 in the environment shows the calls."
        )
    return printable(
        f"stickslip: {name}: {said} ({where}). This is a fault of stickslip: please report it. "
        f"{TRACEBACK}=1 in the environment shows where it comes from."
    )


def _lacks_memory(error: BaseException | None) -> bool:
    """Return whether memory was short; some libraries report it in words, or as the cause of other errors."""
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
