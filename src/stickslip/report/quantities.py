"""Numbers as engineers read them: few digits, prefixes, thin spaces."""

import math
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.units import BEYOND, LARGEST_PERCENT, LONGEST_M, MM

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
NARROW_SPACE = "\u202f"
NONE = "–"
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Scale:
    """A factor and the unit that goes with it: ``values * factor`` are in ``unit``."""

    factor: float
    unit: str


def scale_for(values: FloatArray, unit: str) -> Scale:
    """Choose the engineering prefix that suits the largest finite magnitude of `values` in `unit`."""
    finite = np.abs(values[np.isfinite(values)])
    largest = float(finite.max()) if finite.size else 0.0
    if largest == 0.0:
        return Scale(1.0, unit)
    # a hair above the power of ten, so that 1e-6 m is 1 µm in spite of its rounding
    exponent = 3 * math.floor(math.log10(largest * (1 + 1e-12)) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    return Scale(10.0**-exponent, _PREFIXES[exponent] + unit)


def number(value: float, digits: int = 3) -> str:
    """Write `value` with `digits` significant digits, powers of ten only where they are shorter."""
    if not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if exponent < -4 or exponent > 6:
        mantissa = f"{value / 10.0**exponent:.{digits - 1}f}"
        return f"{mantissa}·10".replace("-", "−") + str(exponent).translate(_RAISED)
    rounded = round(value, digits - 1 - exponent)
    decimals = max(0, digits - 1 - exponent)
    text = f"{rounded:,.{decimals}f}".replace(",", NARROW_SPACE)
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return text.replace("-", "−")


def fixed(value: float, decimals: int) -> str:
    """Write `value` with a fixed number of decimals, for columns."""
    if not math.isfinite(value):
        return NONE
    text = f"{value:,.{decimals}f}".replace(",", NARROW_SPACE)
    return text.replace("-", "−")


def quantity(value: float, unit: str, digits: int = 3) -> str:
    """Write `value` in `unit` with an engineering prefix, e.g. ``12.3 µm``; implausibly large lengths as words."""
    if _beyond(value, unit):
        return BEYOND
    scale = scale_for(np.array([value]), unit)
    return f"{number(value * scale.factor, digits)} {scale.unit}" if math.isfinite(value) else NONE


def amplitude(value: float, unit: str, digits: int = 4) -> str:
    """Write an amplitude of an output: lengths in mm, as in verdicts and on the terminal; other units with a prefix."""
    if unit != "m" or not math.isfinite(value):
        return quantity(value, unit, digits)
    return BEYOND if _beyond(value, unit) else f"{number(value / MM, digits)} mm"


def column(values: FloatArray, unit: str, digits: int = 4, *, millimetres: bool = False) -> tuple[str, list[str]]:
    """Write numbers of one column with one unit and the same decimals, as `aligned` does.

    Parameters
    ----------
    values, unit, digits
        Values in `unit`; the unit gets the prefix that suits the largest value.
    millimetres
        Whether lengths are in mm, as amplitudes are in verdicts and on the terminal.

    Returns
    -------
    unit, cells
    """
    given = np.asarray(values)
    beyond = np.array([_beyond(float(v), unit) for v in given], dtype=bool)
    usual = np.where(beyond, np.nan, given)
    scale = Scale(1 / MM, "mm") if millimetres and unit == "m" else scale_for(usual, unit)
    cells = aligned(usual * scale.factor, digits)
    return scale.unit, [BEYOND if far else cell for far, cell in zip(beyond, cells, strict=True)]


def _beyond(value: float, unit: str) -> bool:
    return unit == "m" and math.isfinite(value) and abs(value) > LONGEST_M


def aligned(values: FloatArray, digits: int = 4) -> list[str]:
    """Write numbers of one column with the same decimals, at most five; the smallest keeps two digits if these suffice."""
    sizes = np.abs(values[np.isfinite(values) & (values != 0.0)])
    if not sizes.size:
        return [fixed(float(v), 0) for v in values]
    of_largest, of_smallest = (math.floor(math.log10(v)) for v in (sizes.max(), sizes.min()))
    decimals = min(max(0, digits - 1 - of_largest, 1 - of_smallest), 5)
    return [fixed(float(v), decimals) for v in values]


def percent(value: float, digits: int = 2) -> str:
    """Write a value in percent; values below 0.0001 % and very large ones become bounds, as ``< 0.0001 %``."""
    if math.isfinite(value) and 0 < abs(value) < 1e-4:
        return "< 0.0001 %"
    if math.isfinite(value) and value > LARGEST_PERCENT:
        return f"over {number(LARGEST_PERCENT)} %"
    return f"{number(value, digits)} %" if math.isfinite(value) else NONE


def predicted(error: float) -> str:
    """Write a predicted change in percent; above 100 % as ``over 100 %``, since the prediction is linear."""
    return "over 100 %" if error > 100.0 else percent(error)


def joined(words: list[str]) -> str:
    """Join words as a sentence does."""
    if len(words) < 2:
        return "".join(words)
    return ", ".join(words[:-1]) + " and " + words[-1]


def runs(numbers: list[int]) -> str:
    """Write ascending whole numbers; three or more in a row become a range: ``2, 4, 10 to 41``."""
    found: list[list[int]] = []
    for n in numbers:
        if found and n == found[-1][-1] + 1:
            found[-1].append(n)
        else:
            found.append([n])
    each = [[f"{run[0]} to {run[-1]}"] if len(run) > 2 else map(str, run) for run in found]
    return ", ".join(text for own in each for text in own)


def counted(n: int, word: str) -> str:
    """Write a count with its noun."""
    return f"{n} {word}" if n == 1 else f"{n} {word}s"
