"""The section of an analysis on the page: figures, tables and texts, each a function of its dataset."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import xarray as xr

from stickslip.report.content import Chooser, Table, Words
from stickslip.report.plot import Plot

Content = Plot | Table | Words | Chooser
Shown = Content | Sequence[Content] | None  # None if the dataset lacks the variables
Part = Callable[[Any], Shown]  # takes a view of the dataset


@dataclass(frozen=True)
class Card:
    """A number at the top of the page, its name and a remark; red for danger. The first one of a page is its answer."""

    value: str
    label: str
    note: str
    danger: bool = False


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
