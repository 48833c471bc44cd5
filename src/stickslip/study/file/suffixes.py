"""Units at the ends of keys, and conversions between them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isclose, pi

from stickslip.errors import did_you_mean, nearest

Powers = tuple[int, int, int, int]  # exponents of length, mass, time and angle

_BASES: dict[str, tuple[str, float, Powers]] = {  # ending: symbol, size in SI, powers
    "m": ("m", 1.0, (1, 0, 0, 0)),
    "cm": ("cm", 1e-2, (1, 0, 0, 0)),
    "mm": ("mm", 1e-3, (1, 0, 0, 0)),
    "um": ("µm", 1e-6, (1, 0, 0, 0)),
    "in": ("in", 0.0254, (1, 0, 0, 0)),
    "ft": ("ft", 0.3048, (1, 0, 0, 0)),
    "kg": ("kg", 1.0, (0, 1, 0, 0)),
    "g": ("g", 1e-3, (0, 1, 0, 0)),
    "t": ("t", 1e3, (0, 1, 0, 0)),
    "lb": ("lb", 0.45359237, (0, 1, 0, 0)),
    "s": ("s", 1.0, (0, 0, 1, 0)),
    "ms": ("ms", 1e-3, (0, 0, 1, 0)),
    "n": ("N", 1.0, (1, 1, -2, 0)),
    "kn": ("kN", 1e3, (1, 1, -2, 0)),
    "lbf": ("lbf", 0.45359237 * 9.80665, (1, 1, -2, 0)),
    "pa": ("Pa", 1.0, (-1, 1, -2, 0)),
    "kpa": ("kPa", 1e3, (-1, 1, -2, 0)),
    "mpa": ("MPa", 1e6, (-1, 1, -2, 0)),
    "gpa": ("GPa", 1e9, (-1, 1, -2, 0)),
    "bar": ("bar", 1e5, (-1, 1, -2, 0)),
    "psi": ("psi", 0.45359237 * 9.80665 / 0.0254**2, (-1, 1, -2, 0)),
    "rad": ("rad", 1.0, (0, 0, 0, 1)),
    "deg": ("°", pi / 180, (0, 0, 0, 1)),
    "hz": ("Hz", 2 * pi, (0, 0, -1, 1)),
    "khz": ("kHz", 2e3 * pi, (0, 0, -1, 1)),
    "rpm": ("rpm", pi / 30, (0, 0, -1, 1)),
}
_PERCENT = ("%", 1e-2, (0, 0, 0, 0))
_EXPONENTS = {"": "", "2": "²", "3": "³", "4": "⁴", "5": "⁵"}
_LONGEST_LIST = 6  # largest number of values that a message converts


@dataclass(frozen=True)
class Unit:
    """A unit at the end of a key.

    Parameters
    ----------
    symbol
        Symbol in sentences.
    size
        Value in SI; angles in rad.
    powers
        Exponents of length, mass, time and angle.
    """

    symbol: str
    size: float
    powers: Powers


def unit_of(ending: str) -> Unit | None:
    """Return the unit of an ending such as ``n_per_mm``; None for an unknown one."""
    if ending == "percent":
        return Unit(*_PERCENT)
    above: list[str] = []
    below: list[str] = []
    size, powers, sign = 1.0, (0, 0, 0, 0), 1
    for word in ending.split("_"):
        if word == "per" and sign == 1:
            sign = -1
            continue
        name = word.rstrip("2345")
        exponent = word.removeprefix(name)
        if name not in _BASES or exponent not in _EXPONENTS:
            return None
        symbol, base, own = _BASES[name]
        times = sign * int(exponent or 1)
        size *= base**times
        powers = tuple(p + times * q for p, q in zip(powers, own, strict=True))  # type: ignore[assignment]
        (above if sign == 1 else below).append(symbol + _EXPONENTS[exponent])
    if sign == -1 and not below:
        return None
    over = f"/{' '.join(below)}" if below else ""
    return Unit(f"{' '.join(above) or '1'}{over}", size, powers)


def split_units(key: str) -> tuple[str, str]:
    """Return the name in a key and the symbol of its unit: ``force_n`` -> ``force``, ``N``."""
    name, unit = next(_split(key))
    return name, unit.symbol


def _split(key: str) -> Iterator[tuple[str, Unit]]:
    """Yield the possible splits of a key into name and unit, the longest unit first; last without a unit."""
    words = key.split("_")
    for k in range(1, len(words)):
        unit = unit_of("_".join(words[k:]))
        if unit is not None:
            yield "_".join(words[:k]), unit
    yield key, Unit("", 1.0, (0, 0, 0, 0))


def nearest_key(word: str, known: Sequence[str], value: object = None) -> str:
    """Return the remedy for an unknown key.

    The remedy names the known key with the same name and another unit, and converts the value. Without such a key it names the most
    similar one.

    Parameters
    ----------
    word
        The unknown key.
    known
        The known keys.
    value
        Value of the key; a number or a list of numbers is converted.
    """
    found = _in_another_unit(word, known)
    if found is None:
        return did_you_mean(word, list(known))
    key, given, meant = found
    return f"Did you mean {key!r}?{_converted(given, meant, value)}"


def meant_key(word: str, known: Sequence[str]) -> str:
    """Return the known key that `nearest_key` names; empty if it names none."""
    found = _in_another_unit(word, known)
    return nearest(word, list(known)) if found is None else found[0]


def _in_another_unit(word: str, known: Sequence[str]) -> tuple[str, Unit, Unit] | None:
    """Return the known key with the same name and another unit, the given unit, and the unit of the known key."""
    for name, given in _split(word):
        for key in known:
            for other, meant in _split(key):
                if (name, given.powers) == (other, meant.powers) and given.symbol != meant.symbol:
                    return key, given, meant
    return None


def _converted(given: Unit, meant: Unit, value: object) -> str:
    """Return a sentence that converts a value, or one unit, to another unit; empty for a key without a unit."""
    if not given.symbol:
        return ""
    factor = given.size / meant.size
    each = value if isinstance(value, list) and 0 < len(value) <= _LONGEST_LIST else [value]
    numbers = [float(v) for v in each if isinstance(v, int | float) and not isinstance(v, bool)]
    if len(numbers) != len(each) or not numbers:
        numbers = [1.0]
    before, after = (", ".join(_number(v * scale) for v in numbers) for scale in (1.0, factor))
    verb = "is" if len(numbers) == 1 and isclose(numbers[0], 1.0) else "are"
    return f" {before} {given.symbol} {verb} {after}{f' {meant.symbol}' * bool(meant.symbol)}."


def _number(value: float) -> str:
    return f"{value:.6g}"
