"""Short names of cases: the shortest text, with units, that distinguishes them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from stickslip.study.file.suffixes import split_units

Values = Mapping[str, Any]  # varied key -> value
JOINT = ", "  # separator of the parts of a name
CASE = "case"  # heading of legends and columns
LONG = 24  # letters of a name that a column has room for
DIGITS, MOST_DIGITS = 6, 17  # usual and largest number of digits of a value
LEAST_SHOWN, MOST_SHOWN = 0.1, 1e4  # outside of these a number is easier to read with another prefix of its unit
# unit of a key -> units with other prefixes that engineers write, with the power of ten of their numbers
PREFIXED: dict[str, dict[str, int]] = {
    "kg": {"g": 3, "t": -3},
    "m": {"mm": 3, "µm": 6},
    "mm": {"µm": 3, "m": -3},
    "m²": {"mm²": 6},
    "s": {"ms": 3},
    "N": {"kN": -3},
    "N m": {"kN m": -3},
    "Pa": {"MPa": -6, "GPa": -9, "kPa": -3},
    "Hz": {"kHz": -3},
    "kg m²": {"kg mm²": 6},
    "N/m": {"N/mm": -3, "N/µm": -6},
    "N/m³": {"N/mm³": -9},
}


@dataclass(frozen=True)
class Naming:
    """Format of a varied key in names and along axes.

    Parameters
    ----------
    word
        The key in words.
    unit
        Unit that an engineer writes; empty for none.
    digits
        Digits of the values.
    tens
        Power of ten from the values of the key to numbers in `unit`.
    """

    word: str
    unit: str
    digits: int = DIGITS
    tens: int = 0

    @property
    def title(self) -> str:
        """The title of an axis: ``force (N)``."""
        return f"{self.word} ({self.unit})" if self.unit else self.word

    def shown(self, value: Any) -> Any:
        """Return a value of the key, or a list of them, in `unit`: ``0.01`` -> ``10.0`` for ``g``; texts stay."""
        if isinstance(value, list):
            return [self.shown(v) for v in value]
        if not self.tens or not is_number(value):
            return value
        return float(Decimal(repr(float(value))).scaleb(self.tens))

    def value(self, value: Any) -> str:
        """Return a value with its unit: ``10 g``."""
        return " ".join(filter(None, (written(self.shown(value), self.digits), self.unit)))

    def name(self, value: Any) -> str:
        """Return the key with a value: ``mass 10 g``."""
        return f"{self.word} {self.value(value)}"


def short_names(tables: Sequence[Sequence[Values]]) -> dict[str, Naming]:
    """Return the naming of each varied key that names need: ``load.shaker.force_n`` -> ``force``, ``N`` or ``kN``.

    Among keys that vary together, the first one whose values all differ is enough; without such a key all are needed. A table with a
    single row is needed where no table has more.

    Parameters
    ----------
    tables
        Rows of values for each table of [vary].
    """
    several = [rows for rows in tables if len(rows) > 1] or tables
    return namings({key: [row[key] for row in rows] for rows in several for key in _telling(rows)})


def namings(columns: Mapping[str, Sequence[Any]]) -> dict[str, Naming]:
    """Return the naming of each key by its values: ``part.damper.mass_kg`` with 0.005 and 0.01 -> ``mass``, ``g``.

    All values of a key have one unit. It is the unit of the key, unless another prefix leaves fewer numbers below 0.1 or from 10 000 on;
    among several prefixes the one with the shortest numbers is taken.

    Parameters
    ----------
    columns
        Varied keys with their values.
    """
    words = _key_words(list(columns))
    return {key: _naming(*words[key], values) for key, values in columns.items()}


def _naming(word: str, unit: str, values: Sequence[Any]) -> Naming:
    own = Naming(word, unit, _digits(values))
    entries = [entry for value in values for entry in (value if isinstance(value, list) else [value])]
    if not all(map(is_number, entries)):
        return own
    choices = [own, *(Naming(word, name, own.digits, tens) for name, tens in PREFIXED.get(unit, {}).items())]
    every = _told_apart(values, own.digits)
    apart = [one for one in choices if one is own or len({one.value(v) for v in values}) == every]

    def effort(one: Naming) -> tuple[int, bool, int]:
        return _unreadable(one, entries), one is not own, sum(len(one.value(v)) for v in values)

    return min(apart, key=effort)


def _unreadable(naming: Naming, numbers: Sequence[float]) -> int:
    """Return how many numbers, apart from 0, are too small or too large to read well."""
    return sum(not LEAST_SHOWN <= abs(naming.shown(v)) < MOST_SHOWN for v in numbers if v)


def is_number(value: Any) -> bool:
    """Whether a value of a study file is a number; true and false are none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _key_words(keys: Sequence[str]) -> dict[str, tuple[str, str]]:
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
    return JOINT.join(own.name(values[key]) for key, own in names.items() if key in values)


def written(value: Any, digits: int = DIGITS) -> str:
    """Return a varied value as text; numbers have `digits` digits, a list of one number stands as the number."""
    if isinstance(value, list):
        each = " ".join(written(v, digits) for v in value)
        return each if len(value) == 1 else f"[{each}]"
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


def without_common_words(names: Sequence[str]) -> tuple[str, list[str]]:
    """Split names that begin alike in all their parts: ``force 2 N, mu 0.3`` and others -> ``force, mu`` and ``2 N, 0.3`` and others.

    The first result is empty, and the names are whole, if they have no common words.
    """
    rows = [[part.split(" ") for part in name.split(JOINT)] for name in names]
    if len({len(row) for row in rows}) != 1 or len(names) < 2 or any("=" in name for name in names):
        return "", list(names)
    common = []
    for parts in zip(*rows, strict=True):
        words = [same.pop() for same in map(set, zip(*(part[:-1] for part in parts), strict=False)) if len(same) == 1]
        alike = all(part[: len(words)] == words for part in parts)
        common.append(words if alike and len(set(map(tuple, parts))) > 1 else [])
    title = JOINT.join(" ".join(words) for words in common if words)
    short = [JOINT.join(" ".join(part[len(w) :]) for part, w in zip(row, common, strict=True)) for row in rows]
    return title, short


def shortened(names: Sequence[str]) -> tuple[str, list[str]]:
    """Return a heading and names for a column or a list of cases; long names lose the words that they have in common."""
    if max(map(len, names), default=0) <= LONG:
        return CASE, list(names)
    title, short = without_common_words(names)
    return title or CASE, short
