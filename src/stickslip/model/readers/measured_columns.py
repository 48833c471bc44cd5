"""Columns of measured numbers from a CSV file, with the unit at the end of each name, and hysteresis loops made of them."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.readers.text import SHOWN, read_text

MAX_ROWS = 2_000_000
LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
FORCES = {"n": 1.0, "kn": 1e3}
REPEATED_VALUE_RTOL = 1e-9  # relative difference below which two values are equal


@dataclass(frozen=True, eq=False)
class MeasuredColumns:
    """A table of text whose first line names the columns.

    Parameters
    ----------
    path
        The file.
    names
        Names of the columns, in lower case.
    lines
        Line number of each row in the file.
    rows
        Cells of each row.
    word
        Name of a row in messages.
    """

    path: Path
    names: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    word: str = "line"

    def place(self, row: int, name: str = "") -> str:
        """Return the place of a row, or of one of its cells, for messages."""
        return f"{self.path}: {self.word} {self.lines[row]}" + (f": {name}" if name else "")

    def numbers(self, name: str, *, gaps: bool = False) -> FloatArray:
        """Return a column as finite numbers; with `gaps` an empty cell is NaN.

        Raises
        ------
        InputError
            If a cell is no number; the message names line and cell.
        """
        at = self.names.index(name)
        return np.array(
            [self._number(line, name, row[at], gaps=gaps) for line, row in zip(self.lines, self.rows, strict=True)]
        )

    def named(self, stem: str, units: Mapping[str, float]) -> tuple[str, float]:
        """Return the name of the column ``STEM_UNIT`` and its factor to SI; an empty name if there is none.

        Raises
        ------
        InputError
            If there are two such columns.
        """
        found = [(f"{stem}_{unit}", factor) for unit, factor in units.items() if f"{stem}_{unit}" in self.names]
        if len(found) > 1:
            raise input_error(
                f"{self.path}: line 1", f"has both {found[0][0]} and {found[1][0]}", "Leave one of them out."
            )
        return found[0] if found else ("", 1.0)

    def required(self, stem: str, units: Mapping[str, float]) -> FloatArray:
        """Return the column ``STEM_UNIT`` in SI.

        Raises
        ------
        InputError
            If there is no such column, or two.
        """
        name, factor = self.named(stem, units)
        if not name:
            choices = [f"{stem}_{unit}" for unit in units]
            near = next((n for n in self.names if n.startswith(stem) or stem.startswith(n)), "")
            remedy = f"Rename the column {near!r}." if near else did_you_mean(stem, [*self.names])
            raise input_error(f"{self.path}: line 1", f"has no column {' or '.join(choices)}", remedy)
        return factor * self.numbers(name)

    def unknown(self, name: str, known: Sequence[str], columns: str) -> InputError:
        """Return the error for an unknown column, with the nearest known name, or with the list in `columns`."""
        near = did_you_mean(name, [*known])
        remedy = near if near.startswith("Did") else f"The columns are {columns}. One of words is called note."
        place = f"{self.path}: {self.word} 1" if self.word == "line" else str(self.path)
        return input_error(place, f"has a column {name!r}, which is not known", remedy)

    def wrong(self, row: int, name: str, problem: str, remedy: str) -> InputError:
        """Return the error for the cell of a row in the column `name`."""
        got = self.rows[row][self.names.index(name)][:SHOWN]
        return input_error(self.place(row, name), f"{problem}, got {got!r}", remedy)

    def _number(self, line: int, name: str, text: str, *, gaps: bool) -> float:
        if gaps and not text:
            return math.nan
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if math.isfinite(value):
            return value
        remedy = "Leave the cell empty where nothing was measured." if gaps else "Mend the line."
        raise input_error(
            f"{self.path}: {self.word} {line}: {name}", f"is no finite number, got {text[:SHOWN]!r}", remedy
        )


def read_columns(path: Path) -> MeasuredColumns:
    """Read a CSV file with a line of names; empty lines and lines that begin with ``#`` are skipped.

    Raises
    ------
    InputError
        If the file cannot be read, names a column twice, or a line has another number of cells.
    """
    table: list[tuple[int, list[str]]] = []
    reader = csv.reader(read_text(path).splitlines())  # accepts all line ends
    try:
        for row in reader:
            if any(cell.strip() for cell in row) and not row[0].lstrip().startswith("#"):
                table.append((reader.line_num, [cell.strip() for cell in row]))
            if len(table) > MAX_ROWS:
                raise input_error(str(path), f"has over {MAX_ROWS} lines", "Cut or thin it out.")
    except csv.Error as error:
        raise input_error(str(path), f"is no CSV file ({error})", "Separate by commas.") from None
    if len(table) < 2:
        raise input_error(
            str(path), "holds no numbers", "The first line names the columns, each further line is a row."
        )
    names = tuple(name.lower() for name in table[0][1])
    _check(path, names, table)
    return MeasuredColumns(path, names, tuple(line for line, _ in table[1:]), tuple(tuple(row) for _, row in table[1:]))


def same(a: FloatArray | float, b: FloatArray | float) -> BoolArray:
    """Whether two values of a varied key are equal up to the rounding of files."""
    return np.asarray(np.isclose(a, b, rtol=REPEATED_VALUE_RTOL, atol=0.0))


def _check(path: Path, names: tuple[str, ...], table: list[tuple[int, list[str]]]) -> None:
    place = f"{path}: line {table[0][0]}"
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        remedy = "Separate the columns by commas, and write 1.5 with a point."
        raise input_error(place, f"is one column, got {names[0][:SHOWN]!r}", remedy)
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise input_error(place, f"names the column {twice[0]!r} twice", "Leave one of them out.")
    for line, row in table[1:]:
        if len(row) != len(names):
            raise input_error(
                f"{path}: line {line}",
                f"has {len(row)} cells, the first line {len(names)}",
                "Mend the line; the file may be cut short, or have commas in its numbers.",
            )


LOOP = "loop"  # column that identifies the recording


def read_loops(path: str | Path) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Read displacement and force of hysteresis loops, in SI.

    The columns are ``displacement_m`` (or ``_mm``, ``_um``) and ``force_n`` (or ``_kn``), in the order of time. A column ``loop``
    separates recordings that are not consecutive; other columns are ignored.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple
        For each recording the displacements (n,) in m and forces (n,) in N.

    Raises
    ------
    InputError
        If the file cannot be read; the message names line and cell.
    """
    if not Path(path).is_file():
        near = [p.name for p in Path(path).parent.glob("*.csv")]
        raise input_error(
            str(path), "there is no such file", did_you_mean(Path(path).name, near) if near else "Check the path."
        )
    table = read_columns(Path(path))
    displacement = table.required("displacement", LENGTHS)
    force = table.required("force", FORCES)
    if LOOP not in table.names:
        return ((displacement, force),)
    at = table.names.index(LOOP)
    of = np.array([row[at] for row in table.rows])
    names = list(dict.fromkeys(of.tolist()))
    again = np.flatnonzero(of[1:] != of[:-1]) + 1
    if len(again) != len(names) - 1:
        row = next(int(i) for i in again if of[i] in of[:i])
        raise table.wrong(
            row, LOOP, "comes back to an earlier recording", "Give each recording in one piece, or another name."
        )
    return tuple((displacement[of == name], force[of == name]) for name in names)
