"""Short names of cases: the shortest text that tells them apart, with units."""

from collections.abc import Mapping, Sequence
from typing import Any

from stickslip.study.file.suffixes import split_units

Values = Mapping[str, Any]  # varied key -> value
JOINT = ", "  # between the parts of a name


def short_names(tables: Sequence[Sequence[Values]]) -> dict[str, tuple[str, str]]:
    """Return the word and the unit for each varied key that a name needs: ``load.shaker.force_n`` -> ``force``, ``N``.

    Of keys that run together only the first one is needed that tells their values apart, else all.

    Parameters
    ----------
    tables
        For each table of [vary] its rows of values.
    """
    keys = [key for rows in tables for key in _telling(rows)]
    split = {key: split_units(key.rpartition(".")[2]) for key in keys}
    words = {key: own.replace("_", " ") for key, (own, _) in split.items()}
    above = 1
    while len(set(words.values())) < len(words) and above < max(key.count(".") for key in keys) + 1:
        above += 1
        doubled = [key for key in keys if list(words.values()).count(words[key]) > 1]
        for key in doubled:
            words[key] = " ".join((*key.split(".")[-above:-1], split[key][0])).replace("_", " ")
    return {key: (words[key], split[key][1]) for key in keys}


def short_name(values: Values, names: Mapping[str, tuple[str, str]]) -> str:
    """Return the name of a case: ``force 3 N, friction coefficient 0.4``.

    Parameters
    ----------
    values
        Its varied keys with their values.
    names
        What `short_names` found.
    """
    return JOINT.join(
        " ".join(filter(None, (word, written(values[key]), unit)))
        for key, (word, unit) in names.items()
        if key in values
    )


def written(value: Any) -> str:
    """Return a varied value as text: six digits of a number."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def assignments(values: Values) -> tuple[str, ...]:
    """Return varied keys with their values: ``load.shaker.force_n = 3``."""
    return tuple(f"{key} = {written(value)}" for key, value in values.items())


def _telling(rows: Sequence[Values]) -> list[str]:
    """Return the first key whose values differ in all rows, or all keys."""
    keys = list(rows[0]) if rows else []
    for key in keys:
        if len({written(row[key]) for row in rows}) == len(rows):
            return [key]
    return keys
