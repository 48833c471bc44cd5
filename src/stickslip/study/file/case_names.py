"""Short names of cases: the shortest text that tells them apart, with units."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from stickslip.study.file.suffixes import split_units

Values = Mapping[str, Any]  # varied key -> value
JOINT = ", "  # between the parts of a name
DIGITS, MOST_DIGITS = 6, 17  # of a number: usually, and all that it has


@dataclass(frozen=True)
class Naming:
    """How names tell a varied key: its word, its unit, and the digits of its values."""

    word: str
    unit: str
    digits: int


def short_names(tables: Sequence[Sequence[Values]]) -> dict[str, Naming]:
    """Return the naming of each varied key that a name needs: ``load.shaker.force_n`` -> ``force``, ``N``.

    Of keys that run together only the first one is needed that tells their values apart, else all.

    Parameters
    ----------
    tables
        For each table of [vary] its rows of values.
    """
    words = key_words([key for rows in tables for key in _telling(rows)])
    column = {key: [row[key] for row in rows] for rows in tables for key in _telling(rows)}
    return {key: Naming(word, unit, _digits(column[key])) for key, (word, unit) in words.items()}


def key_words(keys: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return word and unit of each key: ``load.shaker.force_n`` -> ``force``, ``N``; of keys with one word also the tables above."""
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
        Its varied keys with their values.
    names
        What `short_names` found.
    """
    return JOINT.join(
        " ".join(filter(None, (own.word, written(values[key], own.digits), own.unit)))
        for key, own in names.items()
        if key in values
    )


def written(value: Any, digits: int = DIGITS) -> str:
    """Return a varied value as text, with so many digits of a number."""
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
    """Return the fewest digits with which values differ as texts where they differ as numbers."""
    every = _told_apart(values, MOST_DIGITS)
    return next((n for n in range(DIGITS, MOST_DIGITS) if _told_apart(values, n) == every), MOST_DIGITS)
