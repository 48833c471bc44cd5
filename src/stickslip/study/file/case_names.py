"""Short names of cases: the shortest text, with units, that distinguishes them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stickslip.study.file.suffixes import split_units

Values = Mapping[str, Any]  # varied key -> value
JOINT = ", "  # separator of the parts of a name
DIGITS, MOST_DIGITS = 6, 17  # usual and largest number of digits of a value


@dataclass(frozen=True)
class Naming:
    """Format of a varied key in names: its word, its unit, and the digits of its values."""

    word: str
    unit: str
    digits: int


def short_names(tables: Sequence[Sequence[Values]]) -> dict[str, Naming]:
    """Return the naming of each varied key that names need: ``load.shaker.force_n`` -> ``force``, ``N``.

    Among keys that vary together, the first one whose values all differ is enough; without such a key all are needed.

    Parameters
    ----------
    tables
        Rows of values for each table of [vary].
    """
    words = key_words([key for rows in tables for key in _telling(rows)])
    column = {key: [row[key] for row in rows] for rows in tables for key in _telling(rows)}
    return {key: Naming(word, unit, _digits(column[key])) for key, (word, unit) in words.items()}


def key_words(keys: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return word and unit of each key: ``load.shaker.force_n`` -> ``force``, ``N``; equal words get the names of their tables."""
    split = {key: split_units(key.rpartition(".")[2]) for key in keys}
    words = {key: own.replace("_", " ") for key, (own, _) in split.items()}
    above = 1
    while len(set(words.values())) < len(words) and above < max(key.count(".") for key in keys) + 1:
        above += 1
        doubled = [key for key in keys if list(words.values()).count(words[key]) > 1]
        for key in doubled:
            words[key] = " ".join((*key.split(".")[-above:-1], split[key][0])).replace("_", " ")
    return {key: (words[key], split[key][1]) for key in keys}


def short_name(values: Values, names: Mapping[str, Naming]) -> str:
    """Return the name of a case: ``force 3 N, friction coefficient 0.4``.

    Parameters
    ----------
    values
        Varied keys of the case with their values.
    names
        Result of `short_names`.
    """
    return JOINT.join(
        " ".join(filter(None, (own.word, written(values[key], own.digits), own.unit)))
        for key, own in names.items()
        if key in values
    )


def written(value: Any, digits: int = DIGITS) -> str:
    """Return a varied value as text; numbers have `digits` digits."""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def assignments(values: Values) -> tuple[str, ...]:
    """Return varied keys with their values: ``load.shaker.force_n = 3``."""
    return tuple(f"{key} = {written(value)}" for key, value in values.items())


def _telling(rows: Sequence[Values]) -> list[str]:
    """Return the first key whose values differ in all rows, or all keys."""
    keys = list(rows[0]) if rows else []
    for key in keys:
        if _told_apart([row[key] for row in rows], MOST_DIGITS) == len(rows):
            return [key]
    return keys


def _told_apart(values: Sequence[Any], digits: int) -> int:
    return len({written(value, digits) for value in values})


def _digits(values: Sequence[Any]) -> int:
    """Return the smallest number of digits with which different numbers have different texts."""
    every = _told_apart(values, MOST_DIGITS)
    return next((n for n in range(DIGITS, MOST_DIGITS) if _told_apart(values, n) == every), MOST_DIGITS)
