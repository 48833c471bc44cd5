"""A small table for Python and notebooks."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of equal length.

    Parameters
    ----------
    columns
        By name; units stand in the names.
    """

    columns: Mapping[str, npt.NDArray[Any]]

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        """Return a column."""
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        """Return the names of the columns, so that ``dict(table)`` and ``pandas.DataFrame(dict(table))`` work."""
        return iter(self.columns)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self.columns.values()), ()))

    def keys(self) -> list[str]:
        """Return the names of the columns."""
        return list(self.columns)

    def rows(self) -> list[list[str]]:
        """Return the cells as text."""
        return [[_text(v) for v in row] for row in zip(*self.columns.values(), strict=True)]

    def __repr__(self) -> str:
        every = [self.keys(), *self.rows()]
        widths = [max(map(len, column)) for column in zip(*every, strict=True)]
        return "\n".join("  ".join(cell.rjust(w) for cell, w in zip(row, widths, strict=True)) for row in every)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{escape(name)}</th>" for name in self.columns)
        body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self.rows())
        return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _text(value: Any) -> str:
    if isinstance(value, float | np.floating):
        return f"{value:.6g}" if np.isfinite(value) else "–"
    return str(value)
