"""Content of a page beside figures: tables, texts, and buttons for the cases. Plain text, which the templates escape."""

from collections.abc import Sequence
from dataclasses import dataclass

from stickslip.report.cases import ShownCase

# all texts may contain **bold** words, `names` as code, and line breaks


@dataclass(frozen=True)
class Table:
    """A table, which the page offers as CSV, too.

    Parameters
    ----------
    head
        Headings of the columns; empty for a list of facts.
    rows
        One cell a column in each row.
    heading
        Heading above the table; empty for none.
    told
        Paragraphs between the heading and the table.
    numeric
        Whether cells are set flush right from the second column.
    worded
        Whether the last column of a numeric table holds words.
    items
        Sentences listed below it.
    folded
        Line shown while the table is folded away; empty for an open table.
    """

    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    heading: str = ""
    told: Sequence[str] = ()
    numeric: bool = True
    worded: bool = False
    items: Sequence[str] = ()
    folded: str = ""


@dataclass(frozen=True)
class Words:
    """Paragraphs and a list.

    Parameters
    ----------
    told
        Paragraphs.
    heading
        Heading above the paragraphs; empty for none.
    items
        Sentences listed below them.
    folded
        Line shown while all of it is folded away; empty for an open text.
    preformatted
        Lines below the list, shown as they are.
    """

    told: Sequence[str] = ()
    heading: str = ""
    items: Sequence[str] = ()
    folded: str = ""
    preformatted: str = ""


@dataclass(frozen=True)
class Chooser:
    """Buttons that choose the case shown below them."""

    heading: str
    cases: tuple[ShownCase, ...]
    chosen: int


def chooser(heading: str, cases: tuple[ShownCase, ...], chosen: int) -> Chooser | None:
    """Return buttons that choose a case; None for a single case."""
    return Chooser(heading, cases, chosen) if len(cases) > 1 else None
