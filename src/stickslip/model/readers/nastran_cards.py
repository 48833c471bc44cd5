"""Cards of Nastran's bulk data, in small, large and free fields, with their line numbers; nothing is skipped silently."""

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from stickslip.errors import InputError, input_error
from stickslip.model.readers.text import SHOWN, read_text

SHORTENED = re.compile(r"(?<=[\d.])([+-]\d+)$")  # 1.5-3 is 1.5e-3
CUT_SHORT = "The file was cut short, or its cards are not in order."
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
            raise input_error(here, "continues no card", CUT_SHORT)
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
        raise input_error(place, f"{name[:SHOWN]!r} is the name of no card", CUT_SHORT)
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
        raise input_error(place, f"has {len(fields)} fields, {count} at most", CUT_SHORT)
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
    return input_error(place, f"{word[:40]!r} is no {what}", CUT_SHORT)
