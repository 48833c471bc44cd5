"""Fatigue and static strength of a material, over temperature where known."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.units import quantity, quantity_of

# a steel of 500 Pa or of 5e14 Pa is one in another unit
_STRESS: dict[str, Any] = {"least": 1e5, "most": 1e11}
_MEGAPASCALS = "500 MPa are 500e6"
Strength = float | tuple[float, ...] | FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class StrengthCard:
    """Limits of a material; a tuple of values holds one for each of `temperatures`, a number holds at all of them.

    Parameters
    ----------
    fatigue_limit_pa
        Amplitude endured under tension-compression (R = -1) in Pa.
    fatigue_limit_r0_pa
        Amplitude, half of the range, endured under tension from zero (R = 0) in Pa.
    torsion_limit_pa
        Amplitude of the shear stress endured under alternating torsion (R = -1) in Pa.
    ultimate_pa, yield_pa
        Tensile strength and 0.2 % proof stress in Pa.
    fracture_pa
        True fracture strength in Pa, for Morrow's line.
    walker_exponent
        Walker's γ in (0, 1].
    sn_slope, sn_slope_beyond
        Exponents of N = N_knee (S_knee / S)^slope above and below the fatigue limit; without the second the limit is endured for ever.
    knee_cycles
        Number of cycles at which the fatigue limit is reached.
    survival_probability
        Probability of survival that the limits stand for, in (0, 1).
    threshold_pa_sqrt_m
        Threshold ΔK_th of the range of the stress intensity factor in Pa √m.
    temperatures
        Rising temperatures of the tuples, in the unit of those that `at` is given; empty: none.

    Raises
    ------
    InputError
        If a value lies outside the range of its unit, if tuples and temperatures differ in number, or if limits contradict each other.
    """

    fatigue_limit_pa: Strength = quantity("amplitude endured at R = -1", "pa", key="fatigue_limit", **_STRESS)
    fatigue_limit_r0_pa: Strength | None = quantity(
        "amplitude endured at R = 0, half of the range", "pa", key="fatigue_limit_r0", default=None, **_STRESS
    )
    torsion_limit_pa: Strength | None = quantity(
        "shear amplitude endured under alternating torsion", "pa", key="torsion_limit", default=None, **_STRESS
    )
    ultimate_pa: Strength | None = quantity("tensile strength", "pa", key="ultimate", default=None, **_STRESS)
    yield_pa: Strength | None = quantity("0.2 % proof stress", "pa", key="yield", default=None, **_STRESS)
    fracture_pa: Strength | None = quantity("true fracture strength", "pa", key="fracture", default=None, **_STRESS)
    walker_exponent: Strength | None = quantity("Walker's exponent γ", default=None, above=0, most=1)
    sn_slope: Strength | None = quantity("exponent of the S-N line", default=None, least=1, most=100)
    sn_slope_beyond: Strength | None = quantity(
        "exponent of the S-N line beyond the knee", default=None, least=1, most=1000
    )
    knee_cycles: Strength | None = quantity("cycles of the knee of the S-N line", default=None, least=1e3, most=1e12)
    survival_probability: float | None = quantity("survival probability of the limits", default=None, above=0, below=1)
    threshold_pa_sqrt_m: Strength | None = quantity(
        "threshold of the range of the stress intensity factor",
        "pa_sqrt_m",
        key="threshold",
        default=None,
        least=1e5,
        most=1e9,
    )
    temperatures: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for entry in fields(self):
            if entry.name != "temperatures" and getattr(self, entry.name) is not None:
                self._check_number(entry.name)
                self._check_size(entry.name)
        if not np.all(np.diff(self.temperatures) > 0):
            raise input_error(
                "StrengthCard.temperatures", f"must rise, got {list(self.temperatures)}", "Give the lowest first."
            )
        self._check_order()

    def at(self, temperature: Any) -> "StrengthCard":
        """Return the card whose limits over temperature are arrays (...) at temperatures (...); linear between rows.

        Below the lowest temperature of the card its values stay; a card without temperatures is returned as it is.

        Raises
        ------
        InputError
            If a temperature is no number or above the highest of the card: strength falls there.
        """
        own = np.asarray(temperature, dtype=float)
        if not self.temperatures:
            return self
        if not np.all(own <= self.temperatures[-1]):  # NaN, too
            raise input_error(
                "StrengthCard.temperatures",
                f"end at {self.temperatures[-1]:g}, and the material has up to {own.max():g}",
                "Add rows up to the highest temperature.",
            )
        changed = {
            name: np.interp(own, self.temperatures, value)
            for name, value in ((entry.name, getattr(self, entry.name)) for entry in fields(self))
            if name != "temperatures" and isinstance(value, tuple)
        }
        return replace(self, temperatures=(), **changed)

    def take(self, places: IntArray | BoolArray) -> "StrengthCard":
        """Return the card of some of the places whose limits are arrays (k,); other limits stay."""
        each: dict[str, Any] = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        some: dict[str, Any] = {name: own[places] for name, own in each.items() if isinstance(own, np.ndarray)}
        return replace(self, **some)

    def need(self, rule: str, *names: str) -> list[FloatArray]:
        """Return limits by the names of their fields, as arrays.

        Raises
        ------
        InputError
            If the card lacks one, which names the `rule` that needs it, or if a temperature was not chosen yet.
        """
        if self.temperatures:
            raise input_error(
                "StrengthCard.temperatures",
                f"are {len(self.temperatures)}, and {rule} needs the card at one for each place",
                "Use card.at(temperature).",
            )
        about = {entry.name: quantity_of(entry) for entry in fields(self)}
        for name in names:
            if getattr(self, name) is None:
                known = about[name]
                text = known.about if known else name
                raise input_error(
                    f"StrengthCard.{name}",
                    f"is missing, and {rule} needs it",
                    f"Give the {text}, or choose another rule.",
                )
        return [np.asarray(getattr(self, name), dtype=float) for name in names]

    def _check_number(self, name: str) -> None:
        value = getattr(self, name)
        if isinstance(value, tuple) and len(value) != len(self.temperatures):
            raise input_error(
                f"StrengthCard.{name}",
                f"has {len(value)} values for {len(self.temperatures)} temperatures",
                "Give one value for each temperature, or one number for all.",
            )

    def _check_size(self, name: str) -> None:
        known = quantity_of(type(self).__dataclass_fields__[name])
        value = getattr(self, name)
        given = (
            value.ravel().tolist() if isinstance(value, np.ndarray) else value if isinstance(value, tuple) else [value]
        )
        wrong = [one for one in given if known is not None and not known.allows(one)]
        if known is None or not wrong:
            return
        unit = {"pa": f" in Pa ({_MEGAPASCALS})", "pa_sqrt_m": " in Pa √m (5 MPa √m are 5e6)"}.get(known.unit, "")
        got = repr(wrong[0]) if isinstance(wrong[0], str) else f"{wrong[0]:g}"
        raise input_error(f"StrengthCard.{name}", f"must {known.limits}, got {got}", f"Give the {known.about}{unit}.")

    def _check_order(self) -> None:
        """Refuse limits that contradict each other."""
        self._check_pair("yield_pa", "ultimate_pa", "Check which is which: yielding comes before rupture.", equal=True)
        self._check_pair("ultimate_pa", "fracture_pa", "Give the true stress, force over the necked area.", equal=True)
        self._check_pair(
            "fatigue_limit_pa", "ultimate_pa", "Give the amplitude at R = -1, no range and no static limit."
        )
        remedy = "Give the amplitude at R = 0, half of the maximum: a tensile mean lowers what is endured."
        self._check_pair("fatigue_limit_r0_pa", "fatigue_limit_pa", remedy)

    def _check_pair(self, low: str, high: str, remedy: str, *, equal: bool = False) -> None:
        small, large = getattr(self, low), getattr(self, high)
        if small is None or large is None:
            return
        a, b = np.broadcast_arrays(np.asarray(small, dtype=float), np.asarray(large, dtype=float))
        wrong = (a > b) if equal else (a >= b)
        if np.any(wrong):
            first = np.flatnonzero(wrong)[0]
            at = f" at {self.temperatures[first]:g} degrees" if self.temperatures and a.ndim else ""
            raise input_error(
                f"StrengthCard.{low}",
                f"must be {'at most' if equal else 'below'} {high}{at}, got {a.ravel()[first]:g} and {b.ravel()[first]:g} Pa",
                remedy,
            )
