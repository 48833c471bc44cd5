"""Lines and tables on the terminal."""

import math
import re
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from stickslip.errors import printable

_NUMBER = re.compile(r"-?\d+(\.\d+)?")
_DECIMALS = 5  # of cells that are printed as they are
_DIGITS = 5  # of the largest number of a column
PLAIN_WIDTH = 130  # columns of a table that is not on a terminal


def console() -> Console:
    """Return the screen, or a wide page where the output goes to a file."""
    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def say(text: str) -> None:
    """Print a line."""
    console().print(printable(text), markup=False, highlight=False, soft_wrap=True)


def say_lines(title: str, texts: Sequence[str]) -> None:
    """Print lines under a title; nothing where there are none."""
    for text in [f"\n{title}", *(f"  {text}" for text in texts)] if texts else []:
        say(text)


def aligned(cells: Sequence[str]) -> list[str]:
    """Return the cells of a column of numbers with the same decimals: those of the largest, more where the smallest needs them for two digits."""
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
    """Print a table without its empty columns, and lines below it."""
    if not rows:
        say_lines(title, lines)
        return
    say(f"\n{title}")
    table = Table()
    told = [k for k in range(len(head)) if any(row[k] for row in rows)]
    for name in (head[k] for k in told):
        table.add_column(name, justify="right")
    columns = [aligned([row[k] for row in rows]) for k in told]
    for cells in zip(*columns, strict=True):
        table.add_row(*cells)
    console().print(table)
    for line in lines:
        say(f"  {line}")


def say_columns(title: str, names: Iterable[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table whose cells fold."""
    say(f"\n{title}")
    table = Table()
    for name in names:
        table.add_column(name, overflow="fold")
    for cells in rows:
        table.add_row(*(Text(printable(cell)) for cell in cells))
    console().print(table)


def say_answers(verdicts: Sequence[str], failed: int, files: Sequence[Path], last: str) -> None:
    """Print the verdicts, how many points have no solution, which files there are, and last whether to trust it."""
    say_lines("Verdicts", verdicts)
    if failed:
        told = f"{failed} of the points: marked in the result and in the report, not filled in"
        say_lines("Not converged", [told])
    say_lines("Files", [str(f) for f in files])
    say(f"\n{last}")
