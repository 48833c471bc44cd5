"""Degrees of freedom of a Nastran model: grids, scalar points, set membership and output coordinate systems.

They come from the tables of an ``.op2`` file or from the ``GRID`` and ``CORD2`` cards of bulk data.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.arrays import FloatArray, IntArray, Matrix
from stickslip.errors import did_you_mean, input_error
from stickslip.model.readers.nastran_cards import CUT_SHORT, Card, bulk_cards, real, whole
from stickslip.model.readers.nastran_library import check_records, existing_file, is_binary, nastran_library, reading
from stickslip.model.readers.node_table import rotation_to_global
from stickslip.model.structure import Dofs

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
        raise input_error(card.place, "has a place that is not finite", CUT_SHORT)
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
        raise input_error(place, f"the output system of grid {grid} is not orthogonal", "Check it.")
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
