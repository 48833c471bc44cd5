"""Matrices from ``DMIG`` cards of Nastran's bulk data and punch files; no other package is needed."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import IntArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.readers.nastran import assembled, real_symmetric
from stickslip.model.readers.nastran_cards import CUT_SHORT, Card, bulk_cards, real, refused, whole
from stickslip.model.readers.nastran_dofs import NastranDofs, read_nastran_dofs
from stickslip.model.readers.nastran_library import existing_file
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Structure

SQUARE, SYMMETRIC = 1, 6
# cards without effect on the matrices: positions of grids, sets and tables; all others change the model
BESIDE = {
    "ASET",
    "ASET1",
    "BNDFIX",
    "BNDFIX1",
    "BNDFREE",
    "BNDFREE1",
    "BSET",
    "BSET1",
    "CORD1C",
    "CORD1R",
    "CORD1S",
    "CORD2C",
    "CORD2R",
    "CORD2S",
    "CSET",
    "CSET1",
    "DMI",
    "DTI",
    "EIGR",
    "EIGRL",
    "EPOINT",
    "EXTRN",
    "GRDSET",
    "GRID",
    "QSET",
    "QSET1",
    "SECONCT",
    "SEBULK",
    "SPOINT",
    "USET",
    "USET1",
}
PRINTS = {"EXTOUT", "GRDPNT", "POST", "PRTMAXIM"}  # parameters that affect only the output


@dataclass(eq=False)
class Cards:
    """The cards of one matrix.

    Parameters
    ----------
    form
        1 for square, 6 for symmetric; other numbers are rectangular.
    refused
        Reason why the matrix cannot be read; empty if it can.
    rows, columns
        Coordinates as ten times the grid plus the component.
    values
        Entries of the matrix.
    """

    form: int
    refused: str = ""
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

    Coordinates with neither mass nor stiffness are left out. A card that may change the model is refused: the file may contain
    the matrices, positions of grids and sets only.

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
        Unit system of the model, SI by default; it is not in the files.
    plausible
        Whether mass and size are checked for plausibility.

    Returns
    -------
    Structure
        Sparse, in SI, sorted by grid. Scalar points are coordinates of the kind ``mode``. The set ``massless`` contains the
        coordinates without mass, if any.

    Raises
    ------
    InputError
        If a card is damaged or not read, a name unknown, or a matrix complex or not symmetric.
    """
    units = Units.si() if units is None else units
    path = existing_file(path)
    found = _cards(path)
    names = [name.upper() for name in (mass, stiffness, damping) if name is not None]
    for name in names:
        if name in found and found[name].refused:
            raise input_error(
                f"{path}: {name}", found[name].refused, "Give square matrices with real and imaginary parts."
            )
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
    """Return the coordinates `keys`, with positions and axes if the geometry is given."""
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
        raise input_error(place, "gives an entry twice", "Give each entry once, one triangle if symmetric.")
    matrix = scipy.sparse.coo_array((values, (rows, columns)), shape=(n, n)).tocsr()
    if cards.form == SYMMETRIC:
        matrix = (matrix + matrix.T - scipy.sparse.diags_array(matrix.diagonal())).tocsr()
    return real_symmetric(matrix, place)


def _cards(path: Path) -> dict[str, Cards]:
    """Return all DMIG matrices of a file by name; an unreadable matrix has the reason and no entries."""
    found: dict[str, Cards] = {}
    for card in bulk_cards(path, {"DMIG", "PARAM"}):
        if card.name != "DMIG":
            _refuse_what_is_missed(card)
            continue
        name, second = card.fields[0].upper(), card.fields[1]
        if second in {"", "0"}:
            if name in found:
                raise input_error(card.place, f"DMIG {name} has a second head", "Give each matrix once.")
            found[name] = _head(card)
            continue
        if name not in found:
            raise input_error(card.place, f"DMIG {name} has a column before its head (DMIG {name} 0 ...)", CUT_SHORT)
        if not found[name].refused:  # an unreadable matrix is an error only if it is requested
            _add_column(found[name], card)
    return found


def _head(card: Card) -> Cards:
    form, polar = whole(card.fields[2], card.place), card.fields[5]
    if form not in (SQUARE, SYMMETRIC):
        return Cards(form, "is rectangular")
    return Cards(form, "" if polar in {"", "0"} else "holds moduli and phases (POLAR)")


def _add_column(cards: Cards, card: Card) -> None:
    """Add the entries of one column: the column's own fields come first, then four for each entry."""
    column = _key(card.fields[1], card.fields[2], card.place)
    groups = [card.fields[i : i + 4] for i in range(4, len(card.fields), 4)]
    if card.fields[3] or any(any(group) for group in groups if not group[0]):
        raise input_error(card.place, "has a number where none belongs", CUT_SHORT)
    for point, component, value, imaginary in filter(lambda group: group[0], groups):
        cards.rows.append(_key(point, component, card.place))
        cards.columns.append(column)
        cards.values.append(complex(real(value, card.place), real(imaginary, card.place)))


def _refuse_what_is_missed(card: Card) -> None:
    """Refuse a card that adds to the model, constrains it or scales it: only matrices are read here."""
    if card.name == "PARAM" and card.fields[0].upper() in PRINTS:
        return
    if card.name not in BESIDE:
        name = " ".join(filter(None, (card.name, *card.fields[:1])))
        raise input_error(
            card.place,
            f"{name} is not read, and may change the model",
            "Write the DMIG cards into a file of their own if the matrices are the whole model.",
        )


def _key(point: str, component: str, place: str) -> int:
    """Return ten times the grid or scalar point plus the component, 0 ... 6."""
    number = whole(component or "0", place)
    if number > 6:
        raise refused(component, "component 0 to 6", place)
    return 10 * whole(point, place) + number
