"""ANSYS archives (``.cdb`` of ``CDWRITE``): nodes, elements, components and material properties, from text.

Only blocked data are read (``NBLOCK``, ``EBLOCK``, ``CMBLOCK``, ``ET``, ``ETBLOCK``, ``MPDATA``); all other commands are skipped, none is
executed.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.readers.keywords import LARGEST
from stickslip.model.readers.text import read_text

HEAD = 11  # numbers before the nodes of an element: material, type, ..., number of nodes, -, element
MATERIAL, TYPE, ESYS, COUNT, NUMBER = 0, 1, 4, 8, 10  # their positions among these numbers
CUT_SHORT = "The file was cut short: write or copy it again."
WRITE = "Select the solids, then write: ESEL,S,ENAME,,185,187 then NSLE then CDWRITE,DB,model,cdb."


ROTATIONS = ("OMEGA", "CMOMEGA", "CGOMGA", "DOMEGA", "CMDOMEGA", "DCGOMG")
CONSTRAINTS = ("CE", "CP")
OPTIONS = ("KEYO", "KEYOP", "KEYOPT")  # options of an element type; ANSYS accepts the first four letters
BEHAVIOUR = ("TB", "TBDAT", "TBDATA")  # material tables in addition to elastic properties, which CDWRITE shortens
SYSTEMS = ("LOCAL",)
SUPPORTS = ("D",)
DAMPING = ("ALPHAD", "BETAD", "DMPRAT", "DMPSTR")
KEPT = (*ROTATIONS, *CONSTRAINTS, *OPTIONS, *BEHAVIOUR, *SYSTEMS, *SUPPORTS, *DAMPING)


@dataclass(frozen=True, eq=False)
class Blocks:
    """Content of an archive, in its own units and numbers.

    Parameters
    ----------
    numbers
        (n,) node numbers.
    points
        (n, 3) positions.
    angles
        (n, 3) angles of the nodal coordinate systems in degrees.
    heads
        (m, 11) numbers that precede the nodes of each element.
    nodes
        m lists of node numbers.
    types
        Type number -> element, e.g. 2 -> 186.
    node_sets
        Node component, in lower case -> node numbers.
    properties
        Material number -> property -> value.
    commands
        (place, words) of commands that change the model: rotation, coupled dofs, constraint equations, options of element
        types (options in ``ET`` as separate ``KEYOPT``), tables of materials, coordinate systems, supports, damping.
    """

    numbers: IntArray
    points: FloatArray
    angles: FloatArray
    heads: IntArray
    nodes: list[IntArray]
    types: Mapping[int, int]
    node_sets: Mapping[str, IntArray]
    properties: Mapping[int, Mapping[str, float]]
    commands: tuple[tuple[str, list[str]], ...]


def read_blocks(path: Path) -> Blocks:
    """Read the blocks of an archive; see `Blocks`.

    Raises
    ------
    InputError
        If there is no block of nodes, or a block is damaged.
    """
    lines = read_text(path).splitlines()
    nodes: list[FloatArray] = []
    heads: list[list[int]] = []
    corners: list[IntArray] = []
    types: dict[int, int] = {}
    sets: dict[str, IntArray] = {}
    properties: dict[int, dict[str, float]] = {}
    commands: list[tuple[str, list[str]]] = []
    at = 0
    while at < len(lines):
        words = [word.strip() for word in lines[at].split(",")]
        command = words[0].upper()
        if command == "NBLOCK":
            table, at = _node_block(path, lines, at)
            nodes.append(table)
        elif command == "EBLOCK":
            at = _element_block(path, lines, at, heads, corners)
        elif command == "CMBLOCK":
            at = _component(path, lines, at, sets)
        elif command == "ETBLOCK":
            at = _type_block(path, lines, at, types, commands)
        elif command == "ET" and len(words) > 2:
            types[_whole(path, at, words[1])] = _whole(path, at, words[2])
            place = f"{path}: line {at + 1}"
            options = enumerate(words[3:9], 1)
            commands += [(place, ["KEYOPT", words[1], str(k), w]) for k, w in options if w]
            at += 1
        elif command in {"MPDATA", "MP"}:
            _property(path, at, words, properties)
            at += 1
        else:
            if command in KEPT:
                commands.append((f"{path}: line {at + 1}", [w.split("!")[0].strip() for w in words]))
            at += 1
    if not nodes:
        raise input_error(str(path), "has no block of nodes (NBLOCK)", "Write it with CDWRITE,DB,model,cdb.")
    table = np.vstack(nodes)
    return Blocks(
        table[:, 0].astype(np.int64),
        table[:, 1:4],
        table[:, 4:7],
        np.array(heads, dtype=np.int64).reshape(-1, HEAD),
        corners,
        types,
        sets,
        properties,
        tuple(commands),
    )


def integer(word: str) -> int:
    """Return a whole number from a word of digits; `ValueError` for other words and too large numbers."""
    number = int(word)
    if not word.isascii() or abs(number) > LARGEST:
        raise ValueError(word)
    return number


def is_whole(word: str) -> bool:
    """Whether `integer` reads a word as a number of at least zero."""
    return word.isascii() and word.isdecimal() and len(word) <= len(str(LARGEST)) and int(word) <= LARGEST


def _whole(path: Path, line: int, word: str) -> int:
    try:
        return integer(word)
    except ValueError as error:
        raise input_error(f"{path}: line {line + 1}", f"{word[:40]!r} is no whole number", CUT_SHORT) from error


def _format(path: Path, lines: list[str], at: int) -> tuple[int, int, int]:
    """Return count and width of whole numbers, and the width of real ones, from ``(3i9,6e21.13e3)``."""
    text = lines[at] if at < len(lines) else ""
    found = re.fullmatch(r"\((\d{1,3})i(\d{1,3})(?:,\d{0,3}e(\d{1,3})\.\d+(?:e\d)?)?\)", text.strip().lower())
    if not found or not int(found[1]) or not int(found[2]):
        raise input_error(f"{path}: line {at + 1}", f"{text[:40]!r} is no format such as (3i9,6e21.13e3)", CUT_SHORT)
    return int(found[1]), int(found[2]), int(found[3] or 0)


def _node_format(path: Path, lines: list[str], at: int) -> tuple[int, int, int]:
    """Return the widths of the node number, of all whole numbers together, and of a real one, from ``(1i7,2i9,6e21.13)``.

    The groups of whole numbers differ from version to version; the node number is the first.
    """
    text = lines[at] if at < len(lines) else ""
    found = re.fullmatch(r"\(((?:\d{1,3}i\d{1,3},)+)\d{0,3}e(\d{1,3})\.\d+(?:e\d)?\)", text.strip().lower())
    groups = [] if found is None else [tuple(map(int, g.split("i"))) for g in found[1].split(",") if g]
    if found is None or not all(count and width for count, width in groups) or not int(found[2]):
        raise input_error(
            f"{path}: line {at + 1}",
            f"{text[:40]!r} is no format of nodes such as (3i9,6e21.13e3)",
            "Write the archive with CDWRITE,DB,model,cdb; if ANSYS wrote this line, send it to us.",
        )
    return groups[0][1], sum(count * width for count, width in groups), int(found[2])


def _block_end(lines: list[str], at: int) -> int:
    """Return the first line from `at` on that starts like a command or ends a block: ``N,R5.3,LOC,-1`` or ``-1``."""
    while at < len(lines) and lines[at][:1] in " 0123456789" and lines[at].strip() not in {"", "-1"}:
        at += 1
    return at


def _fields(path: Path, lines: list[str], first: int, width: int, kind: Callable[[str], float]) -> list[list[float]]:
    """Cut lines into fields of equal width; blank fields are zeros."""
    table = []
    for number, line in enumerate(lines, first + 1):
        row = [line[i : i + width] for i in range(0, len(line.rstrip()), width)]
        try:
            table.append([kind(field) if field.strip() else 0 for field in row])
        except ValueError as error:
            raise input_error(
                f"{path}: line {number}", f"{line[:60]!r} does not hold numbers only", CUT_SHORT
            ) from error
    return table


def _node_block(path: Path, lines: list[str], at: int) -> tuple[FloatArray, int]:
    """Return (n, 7) numbers, positions and angles, and the line after them."""
    stated = [word.strip() for word in lines[at].split(",")]
    width, split, real = _node_format(path, lines, at + 1)
    first, end = at + 2, _block_end(lines, at + 2)
    body = lines[first:end]
    numbers = _fields(path, [line[:width] for line in body], first, width, integer)
    rest = _fields(path, [line[split:] for line in body], first, real, float)
    if any(len(row) != 1 for row in numbers) or any(len(row) > 6 for row in rest):
        raise input_error(f"{path}: line {at + 1}", "the nodes do not follow their format", CUT_SHORT)
    expected = stated[4] if len(stated) > 4 else ""
    if is_whole(expected) and int(expected) != len(body):
        raise input_error(
            f"{path}: line {end + 1}", f"the block of nodes ends after {len(body)} of {expected}", CUT_SHORT
        )
    table = np.zeros((len(body), 7))
    table[:, 0] = [row[0] for row in numbers]
    for i, row in enumerate(rest):
        table[i, 1 : 1 + len(row)] = row
    return table, end


def _type_block(
    path: Path, lines: list[str], at: int, types: dict[int, int], commands: list[tuple[str, list[str]]]
) -> int:
    """Read element types and their options, as ANSYS writes them since 2023 R1; return the line after the block.

    Its format, ``(2i9,19a9)``, has the type's number, the element, and the options from KEYOPT(1) on.
    """
    text = lines[at + 1].strip().lower() if at + 1 < len(lines) else ""
    found = re.fullmatch(r"\(2i(\d{1,2}),\d{0,2}a(\d{1,2})\)", text)
    if not found or found[1] != found[2] or not int(found[1]):
        raise input_error(f"{path}: line {at + 2}", f"{text[:40]!r} is no format such as (2i9,19a9)", CUT_SHORT)
    first, end = at + 2, _block_end(lines, at + 2)
    for line, row in enumerate(_fields(path, lines[first:end], first, int(found[1]), integer), first + 1):
        if len(row) < 2:
            raise input_error(f"{path}: line {line}", "a type of elements lacks its element", CUT_SHORT)
        number, kind, *options = (int(value) for value in row)
        types[number] = kind
        commands += [
            (f"{path}: line {line}", ["KEYOPT", str(number), str(k), str(value)])
            for k, value in enumerate(options, 1)
            if value
        ]
    if end >= len(lines) or lines[end].strip() != "-1":
        raise input_error(f"{path}: line {end + 1}", "the block of element types has no end (-1)", CUT_SHORT)
    return end + 1


def _element_block(path: Path, lines: list[str], at: int, heads: list[list[int]], corners: list[IntArray]) -> int:
    """Append the elements of a block; return the line after it."""
    words = [word.strip().upper() for word in lines[at].split(",")]
    if "SOLID" not in words[2:3]:
        raise input_error(
            f"{path}: line {at + 1}",
            "is a block of elements without the word SOLID, as Workbench writes for contacts",
            WRITE,
        )
    _, width, _ = _format(path, lines, at + 1)
    row, end = at + 2, _block_end(lines, at + 2)
    table = _fields(path, lines[row:end], row, width, integer)
    i = 0
    while i < len(table):
        line = [int(number) for number in table[i]]
        count, i = line[COUNT] if len(line) > HEAD else 0, i + 1
        nodes = line[HEAD:]
        while 0 < len(nodes) < count and i < len(table):
            nodes, i = nodes + [int(number) for number in table[i]], i + 1
        if not count or len(nodes) != count:
            raise input_error(f"{path}: line {row + i}", f"an element has {len(nodes)} of its {count} nodes", CUT_SHORT)
        heads.append(line[:HEAD])
        corners.append(np.array(nodes, dtype=np.int64))
    if end >= len(lines) or lines[end].strip() != "-1":
        raise input_error(f"{path}: line {end + 1}", "the block of elements has no end (-1)", CUT_SHORT)
    return end + 1


def _component(path: Path, lines: list[str], at: int, sets: dict[str, IntArray]) -> int:
    """Add a node component (numbers; a negative one ends a range); return the line after it."""
    words = [word.split("!")[0].strip() for word in lines[at].split(",")]
    if len(words) < 4:
        raise input_error(f"{path}: line {at + 1}", "is no head of a component", CUT_SHORT)
    size = _whole(path, at, words[3])
    _, width, _ = _format(path, lines, at + 1)
    read: list[int] = []
    line = at + 2
    while len(read) < size and line < len(lines):
        found = [int(n) for row in _fields(path, [lines[line]], line, width, integer) for n in row]
        if not found:
            break
        read, line = read + found, line + 1
    if len(read) != size:
        raise input_error(f"{path}: line {line}", f"component {words[1]} has {len(read)} of {size} numbers", CUT_SHORT)
    if words[2].upper().startswith("NODE"):
        sets[words[1].lower()] = _ranges(path, at, read, len(lines))
    return line


def _ranges(path: Path, at: int, read: list[int], most: int) -> IntArray:
    """Expand ranges: 3, -6 is 3, 4, 5, 6. Refuse a range of more than `most` nodes."""
    members: list[IntArray] = []
    for i, number in enumerate(read):
        first = number if number > 0 else (read[i - 1] + 1 if i and read[i - 1] > 0 else 0)
        if not first or abs(number) - first > most:
            raise input_error(f"{path}: line {at + 1}", f"the component has a range that ends at {number}", CUT_SHORT)
        members.append(np.arange(first, abs(number) + 1))
    return np.concatenate(members) if members else np.empty(0, dtype=np.int64)


def _property(path: Path, at: int, words: list[str], properties: dict[int, dict[str, float]]) -> None:
    """Store a material property; refuse one that depends on temperature."""
    if words[0].upper() == "MP":  # MP,EX,1,2.1e11
        name, number, first, values = words[1:2], words[2:3], "1", words[3:4]
    else:  # MPDATA,R5.0, 1,EX  ,       1, 1, 7.000000000E+10,
        name, number, first, values = words[3:4], words[4:5], "".join(words[5:6]), words[6:]
    given = [v for v in values if v]
    if not (name and number and given):
        return
    if first != "1" or len(given) > 1:
        raise input_error(
            f"{path}: line {at + 1}", f"{name[0]} depends on temperature", "Write the model with one value a property."
        )
    try:
        properties.setdefault(_whole(path, at, number[0]), {})[name[0].upper()] = float(given[0])
    except ValueError as error:
        raise input_error(f"{path}: line {at + 1}", f"{given[0][:40]!r} is no number", CUT_SHORT) from error
