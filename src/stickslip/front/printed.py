"""What commands print: lines and tables, on a terminal or a wide page."""

import sys
from collections.abc import Iterable, Sequence

from rich.console import Console
from rich.table import Table

from stickslip.errors import printable

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


def say_table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[str]
) -> None:
    """Print a table without its empty columns, and lines below it."""
    if not rows:
        say_lines(title, lines)
        return
    say(f"\n{title}")
    table = Table()
    told = [k for k in range(len(head)) if any(row[k] for row in rows)]
    for name in (head[k] for k in told):
        table.add_column(name, justify="right")
    for cells in rows:
        table.add_row(*(cells[k] for k in told))
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
        table.add_row(*(printable(cell) for cell in cells))
    console().print(table)
