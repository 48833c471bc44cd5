"""The section of an analysis on the page: figures, tables and texts, each a function of its dataset."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import xarray as xr

from stickslip.report.content import Chooser, Table, Words
from stickslip.report.plot import Plot

Content = Plot | Table | Words | Chooser
Shown = Content | Sequence[Content] | None  # None where the dataset does not hold what is shown
Part = Callable[[Any], Shown]  # of a view of the dataset


@dataclass(frozen=True)
class Card:
    """A box at the top of the page: one number, what it is, and more about it; red where it tells of danger."""

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
        Its anchor.
    title
        Its heading.
    parts
        In their order.
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
    """All that the page shows of an analysis.

    Parameters
    ----------
    name
        Of the analysis, its node in the result.
    needs
        Variables without which there is nothing to show.
    view
        Makes of the dataset what the parts take.
    blocks
        Chapters of the page.
    by_case
        Whether `view` sees one case at a time, so that the blocks are drawn for each.
    cards
        Boxes for the top of the page.
    """

    name: str
    needs: tuple[str, ...]
    view: Callable[[xr.Dataset], Any]
    blocks: tuple[Block, ...]
    by_case: bool = False
    cards: Callable[[Any], Sequence[Card]] = _nothing
