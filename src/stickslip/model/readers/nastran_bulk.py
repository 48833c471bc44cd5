"""Nastran's bulk data: cards in small, large and free fields, degrees of freedom of a model, and matrices of ``DMIG`` cards.

Degrees of freedom are those of grids and scalar points, with set membership and output coordinate systems. They come from the tables
of an ``.op2`` file or from the ``GRID`` and ``CORD2`` cards. Nothing is skipped silently.
"""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.readers.nastran_library import (
    CUT_SHORT,
    check_records,
    existing_file,
    is_binary,
    nastran_library,
    reading,
)
from stickslip.model.readers.node_table import rotation_to_global
from stickslip.model.readers.text import SHOWN, read_text
from stickslip.model.readers.units import Units, check_units, in_si
from stickslip.model.structure import Dofs, Structure

SHORTENED = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5-3 is 1.5e-3
CARDS_CUT_SHORT = "The file was cut short, or its cards are not in order."
FIELDS = {True: (16, 4), False: (8, 8)}  # large or small: width of a field, fields per line
NAMED = 72  # column after which fixed fields have the name of the continuation
NAME = re.compile(r"[A-Z][A-Z0-9]*")


@dataclass(frozen=True)
class Card:
    """A card with its continuations.

    Parameters
    ----------
    name
        Name in upper case, without the star of large fields.
    fields
        Data fields, padded to a multiple of eight; empty if the card's fields are not read.
    place
        File and line, for messages.
    """

    name: str
    fields: tuple[str, ...]
    place: str


def bulk_cards(path: Path, read: Collection[str]) -> Iterator[Card]:
    """Yield the cards of bulk data or a punch file, from ``BEGIN``, if present, to ``ENDDATA``.

    Parameters
    ----------
    path
        The file.
    read
        Names of the cards whose fields are read.

    Raises
    ------
    InputError
        If a line is no card, continues none, includes another file, or begins the bulk data of another part.
    """
    name, place, awaited = "", "", ""
    fields: list[str] = []
    for number, text in _bulk_lines(path):
        here = f"{path}: line {number}"
        if "\t" in text and "," not in text:
            raise input_error(here, "has a tab, which fixed fields cannot have", "Use blanks.")
        first = (text.split(",")[0] if "," in text else text[:8]).strip().upper()
        large = first.endswith("*") or first.startswith("*")
        if first and first[0] not in "+*":
            if name:
                yield Card(name, _filled(fields), place)
            name, place = _name(first, here), here
            fields, awaited = _fields(text, large=large, place=here) if name in read else ([], "")
        elif name in read:
            _continues(first, awaited, here)
            more, awaited = _fields(text, large=large, place=here)
            fields += more
        elif not name:
            raise input_error(here, "continues no card", CARDS_CUT_SHORT)
    if name:
        yield Card(name, _filled(fields), place)


def _filled(fields: list[str]) -> tuple[str, ...]:
    """Pad fields to a multiple of eight, the number on a line of small fields; a line of large fields has four."""
    return (*fields, *[""] * (-len(fields) % 8))


def _bulk_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of the bulk data with their numbers, without comments and empty ones."""
    lines = [line.split("$")[0].rstrip() for line in read_text(path).splitlines()]
    numbered = [(number, text) for number, text in enumerate(lines, 1) if text.strip()]
    begins = [i for i, (_, text) in enumerate(numbered) if _first_word(text) == "BEGIN"]
    if len(begins) > 1:
        raise input_error(
            f"{path}: line {numbered[begins[1]][0]}",
            "begins the bulk data of another part",
            "Give a file with one part.",
        )
    for number, text in numbered[begins[0] + 1 if begins else 0 :]:
        word = _first_word(text)
        if word == "ENDDATA":
            return
        if word == "INCLUDE":
            raise input_error(
                f"{path}: line {number}",
                "includes a file, which is not read",
                "Write the lines of that file in place of this one.",
            )
        yield number, text


def _first_word(text: str) -> str:
    return next(iter(text.replace(",", " ").split()), "").upper()


def _name(first: str, place: str) -> str:
    """Return the name of a card from its first field."""
    if first.startswith("="):
        raise input_error(place, "repeats cards (=), which is not read", "Write each card.")
    name = first.removesuffix("*").strip()
    if not NAME.fullmatch(name):
        raise input_error(place, f"{name[:SHOWN]!r} is the name of no card", CARDS_CUT_SHORT)
    return name


def _continues(name: str, awaited: str, place: str) -> None:
    """Refuse a continuation of another card, whose name differs from the expected one."""
    name, awaited = name.lstrip("+*"), awaited.lstrip("+*")
    if name and awaited and name != awaited:
        raise input_error(
            place,
            f"continues the card that ends with {name!r}, but stands behind one that ends with {awaited!r}",
            "Write each continuation behind its card.",
        )


def _fields(text: str, *, large: bool, place: str) -> tuple[list[str], str]:
    """Return the data fields of one line, eight small or four large ones, and the name of its continuation."""
    width, count = FIELDS[large]
    named = ""
    if "," in text:
        fields = [part.strip() for part in text.split(",")[1:]]
        if len(fields) == count + 1:
            named = fields.pop()
    else:
        fields = [text[8 + i * width : 8 + (i + 1) * width].strip() for i in range(count)]
        named = text[NAMED : NAMED + 8].strip()
    if len(fields) > count:
        raise input_error(place, f"has {len(fields)} fields, {count} at most", CARDS_CUT_SHORT)
    return fields + [""] * (count - len(fields)), named.upper()


def whole(word: str, place: str) -> int:
    """Return the number of a grid, a system or a component."""
    try:
        number = int(word)
    except ValueError as error:
        raise refused(word, "whole number", place) from error
    if not 0 <= number < 10**9:
        raise refused(word, "grid or component", place)
    return number


def real(word: str, place: str) -> float:
    """Return a real number of Nastran: ``1.5``, ``1.5E-3``, ``1.5D-3``, ``1.5-3``; blank is zero."""
    if not word:
        return 0.0
    plain = word.upper().replace("D", "E")
    if "E" not in plain:
        plain = SHORTENED.sub(r"E\1", plain)
    try:
        return float(plain)
    except ValueError as error:
        raise refused(word, "number", place) from error


def refused(word: str, what: str, place: str) -> InputError:
    """Return the error for a field that is not `what`."""
    return input_error(place, f"{word[:40]!r} is no {what}", CARDS_CUT_SHORT)


COMPONENTS = ("mode", "x", "y", "z", "rx", "ry", "rz")  # component 0 is a scalar point
SYSTEMS = {"CORD2R", "CORD2C", "CORD2S"}
MISSED = {
    **dict.fromkeys(("CORD1R", "CORD1C", "CORD1S", "CORD3G", "CORD3R"), "where a coordinate system lies"),
    "GRDSET": "in which systems grids lie that do not",
    "SEQGP": "in which order the grids stand in the matrices",
}
CONSTRAINTS = {
    "MPC",
    "MPCADD",
    "RBAR",
    "RBAR1",
    "RBE1",
    "RBE2",
    "RBE3",
    "RJOINT",
    "RROD",
    "RSPLINE",
    "RTRPLT",
    "RTRPLT1",
    "SPC",
    "SPC1",
    "SPCADD",
    "SPCOFF",
    "SPCOFF1",
}
SUPPORTS = {"SPC", "SPC1", "SPCADD", "SPCOFF", "SPCOFF1"}
ELEMENTS = {
    *("CHEXA", "CPENTA", "CPYRAM", "CPYRA", "CTETRA", "CBAR", "CBEAM", "CROD", "CQUAD4", "CQUAD8", "CTRIA3", "CTRIA6"),
    *(
        "CELAS1",
        "CELAS2",
        "CBUSH",
        "CDAMP1",
        "CDAMP2",
        "CVISC",
        "CSHEAR",
        "CQUADR",
        "CTRIAR",
        "CBEND",
        "CONROD",
        "CTUBE",
    ),
}
RECTANGULAR, CYLINDRICAL, SPHERICAL = 1, 2, 3


@dataclass(frozen=True, eq=False)
class NastranDofs:
    """The g-set of a Nastran model, in its internal order and units.

    Parameters
    ----------
    ids
        (n,) identification number of the grid or scalar point of each degree of freedom.
    components
        (n,) 1 ... 6, or 0 for a scalar point.
    points
        (n, 3) positions in the basic system; NaN for scalar points.
    turned
        (k,) grids whose output system (field CD) is not parallel to the basic one, ascending.
    turns
        (k, 3, 3) axes of these grids, as columns.
    sets
        Name of a Nastran set, such as ``a`` -> its degrees of freedom; only ``g`` if the file has no sets.
    place
        The file, for messages.
    constraint
        Place and name of the first card that supports or ties degrees of freedom, if the file has such
        cards and no sets.
    """

    ids: IntArray
    components: IntArray
    points: FloatArray
    turned: IntArray
    turns: FloatArray
    sets: Mapping[str, IntArray]
    place: str
    constraint: str = ""

    def rows(self, dof_set: str) -> IntArray:
        """Return the degrees of freedom of a set; an `InputError` names the known sets."""
        if dof_set not in self.sets:
            raise input_error(
                self.place,
                f"does not say which degrees of freedom are in the {dof_set}-set",
                did_you_mean(dof_set, list(self.sets))
                + " The others need the table USET, which the .op2 file has after PARAM,POST,-1.",
            )
        return self.sets[dof_set]

    def table(self, rows: IntArray) -> Dofs:
        """Return the table of the degrees of freedom `rows`, in the file's units; modal coordinates have node −1."""
        names = tuple(COMPONENTS[int(c)] for c in self.components[rows])
        return Dofs(np.where(self.components[rows] == 0, -1, self.ids[rows]), names, self.points[rows])

    def rotation(self, rows: IntArray) -> Matrix | None:
        """Return the rotation of the degrees of freedom `rows` into the basic system; None if all are parallel to it."""
        if not np.isin(self.ids[rows], self.turned).any():
            return None
        return rotation_to_global(self.ids[rows], self.components[rows], self.turned, self.turns, self.place)


def read_nastran_dofs(path: Path | str) -> NastranDofs:
    """Read the degrees of freedom of a model from an ``.op2`` file, bulk data or the ``.asm`` file of ``EXTSEOUT``.

    Raises
    ------
    InputError
        If the file is damaged, holds no grids, or has unsupported cards that may change the positions of grids (``INCLUDE``).
    """
    path = existing_file(path)
    binary = is_binary(path)
    if binary:
        check_records(path)
    with reading(path):
        table, sets, constraint = (*_table_of_op2(path), "") if binary else _table_of_bulk(path)
    if table is None or not len(table):
        raise input_error(
            str(path), "holds no grids", "Give bulk data with GRID cards, or an .op2 file written with PARAM,POST,-1."
        )
    with reading(path):
        return replace(_dofs(table, sets, str(path)), constraint=constraint)


def _table_of_op2(path: Path) -> tuple[Any, dict[str, IntArray]]:
    """Return pyYeti's table of the g-set of the residual structure, and the sets in the file."""
    with nastran_library("op2").OP2(str(path)) as file:
        names = {str(name) for name in file.dbnames}
        if names & {"SUPERID", "EMAP", "EMAPS", "SLIST"}:  # the alter NAS2CAM wrote it
            table = file.rdn2cop2()["uset"].get(0)
        else:
            table = file.rdparampost(get_mats=False, get_dr_tables=False).get("uset")
    if table is None or not any(name.startswith("USET") for name in names):
        return table, {}
    member = np.asarray(table["nasset"], dtype=np.int64)
    masks = nastran_library("n2p").mkusetmask()
    return table, {name: np.flatnonzero(member & int(mask)) for name, mask in masks.items()}


def _table_of_bulk(path: Path) -> tuple[Any, dict[str, IntArray], str]:
    """Return pyYeti's table of all grids, the sets, and the first constraint.

    The a-set of an external superelement (``.asm``) has its own order.
    """
    text, constraint = _geometry(path)
    bulk = nastran_library("bulk")
    if path.suffix.lower() != ".asm":
        return bulk.bulk2uset(StringIO(text), follow_includes=False)[0], {}, constraint
    # the components of the grids are in the .pch file beside it
    _geometry(existing_file(path.with_suffix(".pch")))
    table, _, _, kept = bulk.asm2uset(str(path), try_rdextrn="pv_only", follow_includes=False)
    return table, {"a": np.flatnonzero(kept)}, ""


def _geometry(path: Path) -> tuple[str, str]:
    """Return the grids and coordinate systems of bulk data as plain cards, and the first constraint among all cards."""
    lines, constraint = [], ""
    seen: dict[str, set[int]] = {"grid": set(), "coordinate system": {0}}
    named: dict[int, str] = {}  # coordinate system -> place of the card that names it first
    for card in bulk_cards(path, {"GRID", *SYSTEMS}):
        if card.name in MISSED:
            raise input_error(
                card.place,
                f"{card.name} is not read, and says {MISSED[card.name]}",
                "Write it into the GRID and CORD2 cards.",
            )
        if card.name in CONSTRAINTS or (card.name == "GRID" and card.fields[6] not in {"", "0"}):
            constraint = constraint or f"{card.place}: {card.name}"
        if card.name == "GRID":
            number, reference, *at, output = card.fields[:6]
            grid, systems = _once(number, "grid", seen, card), [reference, output]
            words = [str(_whole(word, card)) for word in systems]
            lines.append(f"GRID,{grid},{words[0]},{_reals(at, card)},{words[1]}")
        elif card.name in SYSTEMS:
            number, reference, *points = [*card.fields, *[""] * 8][:11]
            system, systems = _once(number, "coordinate system", seen, card), [reference]
            lines.append(f"{card.name},{system},{_whole(reference, card)},{_reals(points[:6], card)}")
            lines.append("," + _reals(points[6:], card))
        else:
            continue
        for word in systems:
            named.setdefault(_whole(word, card), card.place)
    for system in named.keys() - seen["coordinate system"]:
        raise input_error(named[system], f"coordinate system {system} is not in the file", "Add its CORD2 card.")
    return "\n".join(lines) + "\n", constraint


def _once(word: str, what: str, seen: dict[str, set[int]], card: Card) -> int:
    """Return the number of a grid or a system; refuse a number that an earlier card has."""
    number = whole(word, card.place)
    if number in seen[what]:
        raise input_error(card.place, f"{what} {number} is there twice", "Give each once.")
    seen[what].add(number)
    return number


def _whole(word: str, card: Card) -> int:
    return whole(word or "0", card.place)


def _reals(words: Sequence[str], card: Card) -> str:
    values = [real(word, card.place) for word in words]
    if not np.isfinite(values).all():
        raise input_error(card.place, "has a place that is not finite", CARDS_CUT_SHORT)
    return ",".join(map(repr, values))


def _dofs(table: Any, sets: dict[str, IntArray], place: str) -> NastranDofs:
    ids = np.asarray(table.index.get_level_values(0), dtype=np.int64)
    components = np.asarray(table.index.get_level_values(1), dtype=np.int64)
    values = np.asarray(table[["x", "y", "z"]], dtype=float)
    points = np.full((len(ids), 3), np.nan)
    first = np.flatnonzero(components == 1)
    for offset in range(6):  # six rows for each grid: position, system, origin, axes
        points[first + offset] = values[first]
    turns = np.array([_axes(values[row : row + 6], int(ids[row]), place) for row in first])
    own = (np.abs(turns.reshape(-1, 3, 3) - np.eye(3)) > 1e-14).any(axis=(1, 2))
    order = np.argsort(ids[first[own]])
    sets = {"g": np.arange(len(ids)), **sets}
    return NastranDofs(
        ids,
        components,
        points,
        ids[first[own]][order],
        turns.reshape(-1, 3, 3)[own][order],
        {name: rows for name, rows in sets.items() if len(rows)},
        place,
    )


def _axes(rows: FloatArray, grid: int, place: str) -> FloatArray:
    """Return the (3, 3) axes, as columns, of a grid's output system, from its six rows of pyYeti's table."""
    kind, system = int(rows[1, 1]), rows[3:]
    if not np.allclose(system @ system.T, np.eye(3), atol=1e-9):
        raise input_error(place, f"the output system of grid {grid} is not orthogonal", "Give its axes right angles.")
    if kind == RECTANGULAR:
        return system
    x, y, z = system.T @ (rows[0] - rows[2])
    azimuth = np.arctan2(y, x)
    c, s = np.cos(azimuth), np.sin(azimuth)
    if kind == CYLINDRICAL:
        local = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    elif kind == SPHERICAL:
        polar = np.arctan2(np.hypot(x, y), z)
        cp, sp = np.cos(polar), np.sin(polar)
        local = np.array([[sp * c, cp * c, -s], [sp * s, cp * s, c], [cp, -sp, 0.0]])
    else:
        raise input_error(place, f"grid {grid} has an output system of kind {kind}", "Use CORD2R, C or S.")
    return np.asarray(system @ local)


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


def assembled(matrices: list[Matrix], known: NastranDofs, rows: IntArray) -> Structure:
    """Return the structure of mass, stiffness and perhaps damping, along the basic axes, in the file's units.

    Parameters
    ----------
    matrices
        Two or three (n, n) sparse matrices.
    known
        All degrees of freedom.
    rows
        (n,) degrees of freedom of the matrices.
    """
    turn = known.rotation(rows)
    if turn is not None:
        matrices = [(turn @ matrix @ turn.T).tocsr() for matrix in matrices]
    used = np.flatnonzero(sum(abs(matrix).sum(axis=1) for matrix in matrices))
    mass, stiffness, *damping = [matrix[used][:, used] for matrix in matrices]
    massless = np.flatnonzero(abs(mass).sum(axis=1) == 0)
    return Structure(
        mass,
        damping[0] if damping else scipy.sparse.csr_array(mass.shape),
        stiffness,
        known.table(rows[used]),
        {"massless": massless} if len(massless) else {},
    )


def real_symmetric(matrix: Matrix, place: str) -> Matrix:
    """Return the symmetric part of a real matrix, (n, n) CSR; refuse an unsymmetric matrix.

    Raises
    ------
    InputError
        If it is not square, complex, not finite, or unsymmetric by more than rounding.
    """
    if matrix.shape[0] != matrix.shape[1]:
        raise input_error(place, f"is {matrix.shape[0]} x {matrix.shape[1]}", "Give square matrices.")
    if np.iscomplexobj(matrix.data):
        if matrix.data.imag.any():
            raise input_error(
                place, "is complex", "Structural damping is an operation on the real stiffness here: write it without."
            )
        matrix = matrix.real
    if not np.isfinite(matrix.data).all():
        raise input_error(place, "holds numbers that are not finite", CUT_SHORT)
    matrix = scipy.sparse.csr_array(matrix, dtype=float)
    skew, largest = abs(matrix - matrix.T).max(), abs(matrix).max()
    if skew > 1e-6 * largest:  # smaller differences come from single precision and few digits
        raise input_error(
            place,
            f"is not symmetric: entries differ by {skew:.3g} from those across the diagonal",
            "Give mass, stiffness and damping of a structure at rest.",
        )
    return scipy.sparse.csr_array((matrix + matrix.T) / 2)


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
    known = _dofs_of_text(keys, geometry, str(path))
    structure = assembled(matrices, known, np.arange(len(keys)))
    structure = in_si(structure, units)
    if plausible:
        check_units(structure, units, str(path))
    return structure


def _dofs_of_text(keys: IntArray, geometry: Path | str | None, place: str) -> NastranDofs:
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
            raise input_error(
                card.place, f"DMIG {name} has a column before its head (DMIG {name} 0 ...)", CARDS_CUT_SHORT
            )
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
        raise input_error(card.place, "has a number where none belongs", CARDS_CUT_SHORT)
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


def refuse_bulk_model(path: Path) -> None:
    """Refuse bulk data with elements, which are not read; a file without cards of elements, masses or rigid elements passes.

    Raises
    ------
    InputError
        If there is such a card; the message names the line of the first one.
    """
    kinds: dict[str, int] = {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        name = line.split("$")[0][:8].split(",")[0].strip().rstrip("*").upper()
        if name in CONSTRAINTS - SUPPORTS or name.startswith("CONM") or name in ELEMENTS:
            kinds.setdefault(name, number)
    if kinds:
        first = min(kinds, key=lambda name: kinds[name])
        raise input_error(
            f"{path}: line {kinds[first]}",
            f"{first}: a model of Nastran's bulk data is not read, this one of {', '.join(sorted(kinds))}",
            "Have Nastran write its matrices, which contain masses and rigid elements (DMIG or .op4, the page Nastran), or write the mesh as "
            "a deck of CalculiX or Abaqus.",
        )
