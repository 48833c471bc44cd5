"""The section of an analysis on the page: figures, tables, texts and buttons for the cases, each a function of its dataset.

Content beside figures is plain text, which the templates escape.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import xarray as xr

from stickslip.report.cases import ShownCase
from stickslip.report.plot import Plot

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


Content = Plot | Table | Words | Chooser
Shown = Content | Sequence[Content] | None  # None if the dataset lacks the variables
Part = Callable[[Any], Shown]  # takes a view of the dataset


@dataclass(frozen=True)
class Card:
    """A number at the top of the page, its name and a remark; red for danger. The first one of a page is its answer.

    Of several cards with the same `question` the page shows the one with the least `margin`.
    """

    value: str
    label: str
    note: str
    danger: bool = False
    question: str = ""
    margin: float = 0.0


@dataclass(frozen=True)
class Block:
    """A chapter of the page.

    Parameters
    ----------
    key
        Anchor of the chapter.
    title
        Heading of the chapter.
    parts
        Figures, tables and texts in the order of the page.
    folded
        Whether only the heading is shown at first.
    """

    key: str
    title: str
    parts: tuple[Part, ...]
    folded: bool = False


def _nothing(_: Any) -> Sequence[Any]:
    return ()


@dataclass(frozen=True)
class Section:
    """The figures, tables and texts of one analysis on the page.

    Parameters
    ----------
    name
        Name of the analysis and of its node in the result.
    needs
        Variables without which the section is left out.
    view
        Function that turns the dataset into the view; every part takes this view.
    blocks
        Chapters of the page.
    by_case
        Whether `view` takes one case at a time; the blocks are then drawn once a case.
    cards
        Numbers for the top of the page, the answer first.
    answer
        Parts that draw the answer: the first figure among them stands at the top of the page. Empty: the first figure of the section.
    yields_to
        Analyses whose answer and figure stand at the top instead, if the result has one of them.
    """

    name: str
    needs: tuple[str, ...]
    view: Callable[[xr.Dataset], Any]
    blocks: tuple[Block, ...]
    by_case: bool = False
    cards: Callable[[Any], Sequence[Card]] = _nothing
    answer: tuple[Part, ...] = ()
    yields_to: tuple[str, ...] = ()
