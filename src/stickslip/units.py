"""Engineering units, the SI units of the library, and allowed values of dataclass fields."""

import math
from dataclasses import MISSING, Field, dataclass, field, fields
from numbers import Real
from typing import Any

from stickslip.errors import input_error

HZ = 2 * math.pi  # rad/s
RPM = 2 * math.pi / 60  # rad/s
DEG = math.pi / 180  # rad
MM = 1e-3  # m

TO_SI = {"hz": HZ, "rpm": RPM, "deg": DEG, "mm": MM}  # factors of units at the end of keys; other units are SI
# unit of a quantity shared among the points of an interface -> its unit per square metre
PER_AREA = {"n_per_m": "n_per_m3", "n": "pa", "n_per_m3": "n_per_m5", "n_s_per_m": "n_s_per_m3"}
_METADATA = "quantity"


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Key, unit and allowed values of a dataclass field in a study file.

    Parameters
    ----------
    about
        Description of the quantity, without unit and range.
    unit
        Suffix of the key, e.g. ``m``, ``deg``, ``n_per_m``; empty for numbers without one.
    key
        Key without the unit, if it differs from the field's name.
    above, least, below, most
        Bounds of the values, in the key's unit: ``> above``, ``>= least``, ``< below``, ``<= most``.
    usual
        Largest size that a study file accepts, in the key's unit; larger values are wrong units. Python accepts more.
    entries
        Least and largest number of entries of a list; zeros for any.
    choices
        Allowed words.
    shared
        Whether the value is divided among the points of an interface, as stiffnesses and forces of laws are.
    """

    about: str
    unit: str = ""
    key: str = ""
    above: float | None = None
    least: float | None = None
    below: float | None = None
    most: float | None = None
    usual: float | None = None
    entries: tuple[int, int] = (0, 0)
    choices: tuple[str, ...] = ()
    shared: bool = False

    def key_of(self, name: str, *, per_area: bool = False) -> str:
        """Return the key of the field `name`, with its unit."""
        unit = PER_AREA.get(self.unit, self.unit) if per_area and self.shared else self.unit
        return "_".join(part for part in (self.key or name, unit) if part)

    @property
    def factor(self) -> float:
        """Factor from the key's unit to SI."""
        return TO_SI.get(self.unit, 1.0)

    @property
    def in_files(self) -> tuple[float | None, float | None]:
        """Least and largest value that a study file accepts, in the key's unit."""
        if self.usual is None:
            return self.least, self.most
        lowest = -self.usual if self.above is None and self.least is None else self.least
        return lowest, self.usual

    @property
    def limits(self) -> str:
        """Limits in SI as a phrase after "must": ``be positive``, ``lie in [0, 1)``."""
        if self.choices:
            return f"be one of {', '.join(self.choices)}"
        few, many = self.entries
        count = f"{few}" if few == many else f"{few} to {many}"
        if many:
            return f"be {count} numbers, each {self._interval}"
        return ("lie " if self._interval.startswith("in ") else "be ") + self._interval

    @property
    def _interval(self) -> str:
        low, high = (
            next((side * self.factor for side in sides if side is not None), None)
            for sides in ((self.above, self.least), (self.below, self.most))
        )
        if low is not None and high is not None:
            closing = "]" if self.below is None else ")"
            return f"in {'[' if self.above is None else '('}{low:.4g}, {high:.4g}{closing}"
        if low == 0.0:
            return "finite and not negative" if self.above is None else "positive"
        return "finite" if low is None else f"at least {low:.4g}"

    def allows(self, value: Any) -> bool:
        """Whether a value in SI, or each entry of a list, is within the limits."""
        entries = value if isinstance(value, (tuple, list)) else (value,)
        few, many = self.entries
        return (not many or few <= len(entries) <= many) and all(map(self._allows_one, entries))

    def _allows_one(self, value: Any) -> bool:
        if self.choices:
            return value in self.choices
        if not isinstance(value, Real):
            return not (self.unit and isinstance(value, str))
        size, unit = float(value), self.factor
        return (
            math.isfinite(size)
            and (self.above is None or size > self.above * unit)
            and (self.least is None or size >= self.least * unit)
            and (self.below is None or size < self.below * unit)
            and (self.most is None or size <= self.most * unit)
        )


LONGEST_M = 1e3  # amplitude above which no number is stated: the motion grows without bound
BEYOND = "more than a kilometre"
LARGEST_PERCENT = 1e5  # largest difference that is stated: beyond, one of the two values is no amplitude
_ANY = Quantity(about="")


def millimetres(size: float, digits: int = 4) -> str:
    """Return an amplitude (m) in millimetres for a sentence; in words if it is NaN or implausibly large."""
    return _beyond(size) or f"{1e3 * size:.{digits}g} mm"


def millimetres_between(least: float, most: float, digits: int = 4) -> str:
    """Return a range of amplitudes (m) in millimetres for a sentence; in words as `millimetres`."""
    if _beyond(least) or _beyond(most):
        return f"{millimetres(least, digits)} to {millimetres(most, digits)}"
    return f"{1e3 * least:.{digits}g} to {1e3 * most:.{digits}g} mm"


def metres(size: float) -> str:
    """Return an amplitude (m) in metres for a comparison; in words as `millimetres`."""
    return _beyond(size) or f"{size:.5e} m"


def _beyond(size: float) -> str:
    if not math.isfinite(size):
        return "no finite amplitude"
    return BEYOND if abs(size) > LONGEST_M else ""


def quantity(about: str, unit: str = "", *, default: Any = MISSING, **limits: Any) -> Any:
    """Return a dataclass field that becomes a key of the study file; `limits` are further fields of `Quantity`.

    Raises
    ------
    InputError
        If the value is shared among points and `PER_AREA` lacks its unit per square metre.
    """
    if limits.get("shared") and unit and unit not in PER_AREA:
        raise input_error(
            "quantity",
            f"{about} is shared, and its unit {unit!r} has none per area",
            "Add the pair to `PER_AREA` of units.py.",
        )
    return field(default=default, metadata={_METADATA: Quantity(about=about, unit=unit, **limits)})


def length(about: str, default: Any = MISSING, *, usual: float = 100, **limits: Any) -> Any:
    """Return the field of a length in metres, positive unless `limits` say otherwise."""
    return quantity(about, "m", default=default, usual=usual, **(limits or {"above": 0}))


def angle(about: str, degrees: float, **limits: Any) -> Any:
    """Return the field of an angle in rad, its default and limits in degrees."""
    return quantity(about, "deg", default=math.radians(degrees), **limits)


def table(about: str) -> dict[str, Quantity]:
    """Return the metadata of a dataclass field that holds quantities itself: a table of its own in a study file."""
    return {_METADATA: Quantity(about=about)}


def quantity_of(entry: Field[Any]) -> Quantity | None:
    """Return the `Quantity` of a dataclass field; None for other fields."""
    return entry.metadata.get(_METADATA)


def check_quantities(given: Any) -> None:
    """Check that the numbers of a dataclass are within the limits of their quantities; other numbers must be finite.

    Raises
    ------
    InputError
        For the first field that fails.
    """
    for entry in fields(given):
        known, value = quantity_of(entry) or _ANY, getattr(given, entry.name)
        if value is not None and not known.allows(value):
            unit = {"": "", "deg": " in rad"}.get(known.unit, " in SI units")
            raise input_error(
                f"{type(given).__name__}.{entry.name}",
                f"must {known.limits}, got {repr(value) if isinstance(value, str) else value}",
                f"Meant is{unit}: {known.about or 'a number in SI units'}.",
            )
