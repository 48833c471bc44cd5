"""Matrices from ``DMIG`` cards of Nastran's bulk data and punch files; read here, so that no package is needed."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.readers.nastran import assembled, real_symmetric
from stickslip.model.readers.nastran_dofs import NastranDofs, read_nastran_dofs
from stickslip.model.readers.nastran_library import existing_file
from stickslip.model.readers.text import read_text
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Structure

SQUARE, SYMMETRIC = 1, 6
SHORTENED = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5-3 is 1.5e-3
CUT_SHORT = "The file was cut short, or its cards are not in order."
FIELDS = {True: (16, 4), False: (8, 8)}  # large or small: width of a field, fields a line


@dataclass(eq=False)
class Cards:
    """The cards of one matrix.

    Parameters
    ----------
    form
        1 square, 6 symmetric; others are rectangular.
    rows, columns
        Coordinates, ten times the grid plus the component.
    values
        Entries.
    """

    form: int
    rows: list[int] = field(default_factory=list)
    columns: list[int] = field(default_factory=list)
    values: list[complex] = field(default_factory=list)


def read_nastran_dmig(
    path: Path | str,
    *,
    mass: str,
    stiffness: str,
    damping: str | None = None,
    geometry: Path | str | None = None,
    units: Units | None = None,
    plausible: bool = True,
) -> Structure:
    """Read mass, stiffness and damping from ``DMIG`` cards: small, large or free fields.

    Coordinates with neither mass nor stiffness are left out. ``INCLUDE`` is not followed.

    Parameters
    ----------
    path
        The bulk data or punch file.
    mass, stiffness, damping
        Names of the matrices, e.g. ``"MAAX"`` and ``"KAAX"``.
    geometry
        Bulk data with the ``GRID`` and ``CORD2`` cards of the model, or its ``.op2`` file; needs pyYeti. Without it
        positions are NaN, and ``x, y, z`` are the axes of each grid's own output system.
    units
        Unit system of the model, SI by default: the files do not say.
    plausible
        Whether mass and size are checked against what solids have.

    Returns
    -------
    Structure
        Sparse, in SI, sorted by grid. Scalar points are coordinates of the kind ``mode``. The set ``massless`` holds the
        coordinates without mass, if any.

    Raises
    ------
    InputError
        If a card is damaged, a name unknown, or a matrix complex or not symmetric.
    """
    units = Units.si() if units is None else units
    path = existing_file(path)
    found = _cards(path)
    names = [name.upper() for name in (mass, stiffness, damping) if name is not None]
    for name in names:
        if name in found and found[name].form not in (SQUARE, SYMMETRIC):
            raise input_error(f"{path}: {name}", "is rectangular", "Give square matrices.")
        if name not in found:
            raise input_error(
                str(path),
                f"holds no DMIG matrix {name!r}",
                did_you_mean(name, list(found)) if found else "It holds none at all.",
            )
    keys = np.unique(np.concatenate([found[n].rows + found[n].columns for n in names]))
    keys = keys.astype(np.int64)
    matrices = [_matrix(found[name], keys, f"{path}: {name}") for name in names]
    known = _dofs(keys, geometry, str(path))
    structure = assembled(matrices, known, np.arange(len(keys)))
    structure = in_si(structure, units)
    if plausible:
        check_units(structure, units, str(path))
    return structure


def _dofs(keys: IntArray, geometry: Path | str | None, place: str) -> NastranDofs:
    """Return the coordinates `keys`, with positions and axes where the geometry is given."""
    ids, components = keys // 10, keys % 10
    points = np.full((len(keys), 3), np.nan)
    sets = {"g": np.arange(len(keys))}
    if geometry is None:
        empty = np.empty(0, dtype=np.int64)
        return NastranDofs(ids, components, points, empty, np.empty((0, 3, 3)), sets, place)
    known = read_nastran_dofs(geometry)
    theirs = 10 * known.ids + known.components
    order = np.argsort(theirs, kind="stable")
    at = order[np.minimum(np.searchsorted(theirs[order], keys), len(theirs) - 1)]
    missing = np.unique(ids[(theirs[at] != keys) & (components > 0)])
    if len(missing):
        raise input_error(
            place,
            f"has {len(missing)} grids that {known.place} lacks, e.g. {missing[0]}",
            "Give the bulk data of the same model.",
        )
    points[components > 0] = known.points[at[components > 0]]
    return NastranDofs(ids, components, points, known.turned, known.turns, sets, place)


def _matrix(cards: Cards, keys: IntArray, place: str) -> Matrix:
    """Return the (n, n) matrix in the order of `keys`."""
    n = len(keys)
    rows, columns = np.searchsorted(keys, cards.rows), np.searchsorted(keys, cards.columns)
    values = np.array(cards.values)
    if cards.form == SYMMETRIC:
        low, high = np.minimum(rows, columns), np.maximum(rows, columns)
        rows, columns = low, high
    entries = rows.astype(np.int64) * n + columns
    if len(np.unique(entries)) < len(entries):
        raise input_error(
            place, "gives an entry twice", "Give each entry once, one triangle if symmetric."
        )
    matrix = scipy.sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()
    if cards.form == SYMMETRIC:
        matrix = (matrix + matrix.T - scipy.sparse.diags_array(matrix.diagonal())).tocsr()
    return real_symmetric(matrix, place)


def _cards(path: Path) -> dict[str, Cards]:
    """Return all square DMIG matrices of a file."""
    found: dict[str, Cards] = {}
    for line, fields in _logical_cards(path):
        place = f"{path}: line {line}"
        name, second = fields[0].upper(), fields[1]
        if second in {"", "0"} and name not in found:
            found[name] = Cards(_whole(fields[2], place))
            continue
        if name not in found:
            raise input_error(
                place, f"DMIG {name} has a column before its head (DMIG {name} 0 ...)", CUT_SHORT
            )
        cards = found[name]
        if cards.form not in (SQUARE, SYMMETRIC):
            continue  # rectangular ones are refused only where they are asked for
        column = _key(second, fields[2], place)
        for i in range(4, len(fields), 4):
            if not fields[i]:
                continue
            cards.rows.append(_key(fields[i], fields[i + 1], place))
            cards.columns.append(column)
            cards.values.append(complex(_real(fields[i + 2], place), _real(fields[i + 3], place)))
    return found


def _logical_cards(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield each DMIG card with its line number: its data fields, continuations joined, filled up to fours."""
    card: list[str] = []
    start = 0
    for number, line in enumerate(read_text(path).splitlines(), 1):
        text = line.split("$")[0].rstrip()
        if not text:
            continue
        first = text.split(",")[0] if "," in text else text[:8]
        mark = first.strip().upper()
        if mark[:1] in {"+", "*"} or not mark:
            if card:
                card += _fields(text, large=mark[:1] == "*", place=f"{path}: line {number}")
            continue
        if card:
            yield start, card
        card = []
        if mark in {"DMIG", "DMIG*"}:
            card = _fields(text, large=mark == "DMIG*", place=f"{path}: line {number}")
            start = number
    if card:
        yield start, card


def _fields(text: str, *, large: bool, place: str) -> list[str]:
    """Return the data fields of one line, eight small or four large ones."""
    width, count = FIELDS[large]
    if "," in text:
        fields = [part.strip() for part in text.split(",")[1:]]
        if len(fields) == count + 1:
            fields = fields[:count]  # the last one names the continuation
    else:
        if "\t" in text:
            raise input_error(place, "has a tab, which fixed fields cannot have", "Use blanks.")
        fields = [text[8 + i * width : 8 + (i + 1) * width].strip() for i in range(count)]
    if len(fields) > count:
        raise input_error(place, f"has {len(fields)} fields, {count} at most", CUT_SHORT)
    return fields + [""] * (count - len(fields))


def _key(point: str, component: str, place: str) -> int:
    """Return ten times the grid or scalar point plus the component, 0 ... 6."""
    number = _whole(component or "0", place)
    if number > 6:
        raise _not(component, "component 0 to 6", place)
    return 10 * _whole(point, place) + number


def _whole(word: str, place: str) -> int:
    try:
        number = int(word)
    except ValueError as error:
        raise _not(word, "whole number", place) from error
    if not 0 <= number < 10**9:
        raise _not(word, "grid or component", place)
    return number


def _real(word: str, place: str) -> float:
    """Return a real number of Nastran: ``1.5``, ``1.5E-3``, ``1.5D-3``, ``1.5-3``; blank is zero."""
    if not word:
        return 0.0
    plain = word.upper().replace("D", "E")
    if "E" not in plain:
        plain = SHORTENED.sub(r"E\1", plain)
    try:
        return float(plain)
    except ValueError as error:
        raise _not(word, "number", place) from error


def _not(word: str, what: str, place: str) -> InputError:
    return input_error(place, f"{word[:40]!r} is no {what}", CUT_SHORT)
