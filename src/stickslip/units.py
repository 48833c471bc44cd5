"""Units of engineers and the SI units of the library, and what a study file says of a dataclass's field."""

import math
from dataclasses import MISSING, Field, dataclass, field
from typing import Any

HZ = 2 * math.pi  # rad/s
RPM = 2 * math.pi / 60  # rad/s
DEG = math.pi / 180  # rad
MM = 1e-3  # m

TO_SI = {"hz": HZ, "rpm": RPM, "deg": DEG, "mm": MM}  # of units that keys end with; others are SI
PER_AREA = {"n_per_m": "n_per_m3", "n": "pa", "n_per_m3": "n_per_m5"}  # of what is shared, given for a square metre
_METADATA = "quantity"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """What a study file says of a field of a dataclass: its key, its unit, what it may be.

    Parameters
    ----------
    about
        What it is, without unit and range.
    unit
        Suffix of its key, e.g. ``m``, ``deg``, ``n_per_m``; empty for numbers without one.
    key
        Its key without the unit, where that differs from the field's name.
    above, least, below, most
        What the values, in the key's unit, must exceed, not fall short of, not reach, not exceed.
    entries
        Least and largest number of entries of a list; zeros for any.
    choices
        The words it may be.
    shared
        Whether it is shared among the points of an interface: stiffnesses and forces of laws.
    """

    about: str
    unit: str = ""
    key: str = ""
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    entries: tuple[int, int] = (0, 0)
    choices: tuple[str, ...] = ()
    shared: bool = False

    def key_of(self, name: str, *, per_area: bool = False) -> str:
        """Return the key of the field `name`, with its unit."""
        unit = PER_AREA.get(self.unit, self.unit) if per_area and self.shared else self.unit
        return "_".join(part for part in (self.key or name, unit) if part)

    @property
    def factor(self) -> float:
        """What makes SI of a value in the key's unit."""
        return TO_SI.get(self.unit, 1.0)


def quantity(about: str, unit: str = "", *, default: Any = MISSING, **limits: Any) -> Any:
    """Return a dataclass field that a study file can make a key of; `limits` are further fields of `Quantity`."""
    return field(default=default, metadata={_METADATA: Quantity(about=about, unit=unit, **limits)})


def table(about: str) -> dict[str, Quantity]:
    """Return the metadata of a dataclass field that holds quantities itself: a table of its own in a study file."""
    return {_METADATA: Quantity(about=about)}


def quantity_of(entry: Field[Any]) -> Quantity | None:
    """Return what `quantity` put down of a dataclass's field; None for other fields."""
    return entry.metadata.get(_METADATA)
