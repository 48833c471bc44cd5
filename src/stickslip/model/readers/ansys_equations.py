"""Constraint equations (CE) and coupled dofs (CP) of ANSYS archives."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.fe.links import Links
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.readers.ansys_binary import read_ansys_nodes, rotations
from stickslip.model.readers.ansys_blocks import Blocks, is_whole, read_blocks

LABELS = {"UX": 0, "UY": 1, "UZ": 2}
LEAVE_OUT = "Delete it (CEDELE, CPDELE), or let ANSYS write its matrices (read_ansys_full)."
Term = tuple[str, str, str]  # node, label, coefficient


def read_ansys_links(path: Path | str, mesh: SolidMesh, *, cyclic: bool = False) -> Links | None:
    """Read the equations of an archive on the nodes of its mesh; None if it has none.

    Parameters
    ----------
    path
        The ``.cdb`` file.
    mesh
        Its mesh, with the numbers of ANSYS.
    cyclic
        Whether pairs of coupled nodes are those of cyclic faces, which the wheel ties.

    Raises
    ------
    InputError
        If an equation is not homogeneous, or names rotations or nodes without solids; the message names the line.
    """
    path = Path(path)
    blocks = read_blocks(path)
    rows = [*_equations(blocks), *_couplings(blocks, cyclic=cyclic)]
    if not rows:
        return None
    table = read_ansys_nodes(path)
    row, column, value = [], [], []
    for i, (place, terms) in enumerate(rows):
        for node, label, factor in terms:
            number, axis, weight = _term(place, node, label, factor)
            at = int(np.searchsorted(mesh.numbers, number))
            if at == len(mesh.numbers) or mesh.numbers[at] != number:
                raise input_error(place, f"names node {number}, which belongs to no solid", LEAVE_OUT)
            turned: FloatArray = rotations(table, np.array([number]))[0][:, axis]
            for c in np.flatnonzero(turned):
                row.append(i)
                column.append(3 * at + int(c))
                value.append(weight * float(turned[c]))
    n = len(mesh.points)
    empty = scipy.sparse.csr_array((3 * n, 3 * n))
    equations = scipy.sparse.csr_array((value, (row, column)), shape=(len(rows), 3 * n))
    return Links(equations, tuple(place for place, _ in rows), np.zeros(n), empty, empty)


def _term(place: str, node: str, label: str, factor: str) -> tuple[int, int, float]:
    try:
        weight = float(factor)
    except ValueError:
        weight = float("nan")
    if not is_whole(node) or not np.isfinite(weight):
        raise input_error(
            place, f"has the term {node!r}, {label!r}, {factor!r}", "A term has node, label, coefficient."
        )
    if label.upper() not in LABELS:
        raise input_error(place, f"constrains {label!r}, and solids have UX, UY and UZ", LEAVE_OUT)
    return int(node), LABELS[label.upper()], weight


def _equations(blocks: Blocks) -> list[tuple[str, list[Term]]]:
    """Return place and terms of the equations, as the command has them or as ``CDWRITE`` writes them (``DEFI``, ``NODE``)."""
    found: dict[str, tuple[str, list[Term]]] = {}
    number = ""
    for place, (command, *words) in blocks.commands:
        if command.upper() != "CE":
            continue
        written = len(words) > 1 and words[1].upper() in ("DEFI", "NODE")
        if written and words[1].upper() == "DEFI":
            number, constant, terms = words[3] if len(words) > 3 else "", "".join(words[4:5]), []
        elif written:
            constant, terms = "", words[2:]
        else:
            number, constant, terms = "".join(words[:1]), "".join(words[1:2]), words[2:]
        if _value(constant) != 0.0 or number.upper() in ("HIGH", "NEXT"):
            raise input_error(place, f"is no homogeneous equation with a number ({','.join(words[:5])})", LEAVE_OUT)
        own = found.setdefault(number, (place, []))[1]
        own += _three(terms)
    for place, own in found.values():
        if not own:
            raise input_error(place, "is an equation without terms", "Give node, label and coefficient of each term.")
    return [*found.values()]


def _three(words: list[str]) -> Iterator[Term]:
    given = [*words]
    while given and not given[-1]:
        given.pop()
    for i in range(0, len(given), 3):
        node, label, factor = [*given[i : i + 3], "", ""][:3]
        yield node, label, factor


def _value(word: str) -> float:
    try:
        return float(word or 0)
    except ValueError:
        return float("nan")


def _couplings(blocks: Blocks, *, cyclic: bool) -> list[tuple[str, list[Term]]]:
    """Return place and terms of ``u = u_first`` for the further nodes of coupled sets."""
    sets: dict[tuple[str, str], tuple[str, list[str]]] = {}
    for place, (command, *words) in blocks.commands:
        if command.upper() != "CP":
            continue
        if len(words) < 3 or not words[1]:
            raise input_error(place, f"couples {','.join(words)}", "Write number, label, nodes.")
        sets.setdefault((words[0], words[1].upper()), (place, []))[1].extend(word for word in words[2:] if word)
    rows = []
    for (_, label), (place, nodes) in sets.items():
        if cyclic and len(nodes) == 2:
            continue
        for own in LABELS if label == "ALL" else (label,):
            rows += [(place, [(nodes[0], own, "1"), (node, own, "-1")]) for node in nodes[1:]]
    return rows
