"""Cases of [vary]: their names and colours on the page."""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.report.plot import ramp
from stickslip.report.quantities import number
from stickslip.study.varied import as_number, first_varied_number, varied_values


@dataclass(frozen=True)
class ShownCase:
    """A case as the page names it.

    Parameters
    ----------
    index
        Position along ``case`` in the dataset.
    label
        Varied keys with their values; empty for a study without [vary].
    short
        The values alone, for legends and columns.
    value
        Value of the first varied key whose values are numbers; NaN without one.
    excitation
        Amplitude of the harmonic force in N; NaN for none.
    colour
        CSS colour, from navy for the first case to gold for the last one.
    """

    index: int
    label: str
    short: str
    value: float
    excitation: float
    colour: str

    @property
    def where(self) -> str:
        """The end of a sentence about this case: `` for key = value``, or nothing."""
        return f" for {self.label}" if self.label else ""

    @property
    def named(self) -> str:
        """The subject of a sentence about this case: ``key = value``, or ``the response``."""
        return self.label or "the response"


def varied(data: xr.Dataset) -> str:
    """Return the varied keys as the heading of a legend or column."""
    return ", ".join(varied_values(data)[0]) or "case"


def first_number(data: xr.Dataset) -> tuple[str, np.ndarray]:
    """Return the first varied key whose values are numbers, and its values (case,); NaN if there is none."""
    key, values = first_varied_number(data)
    return key, values


def _short(row: np.ndarray) -> str:
    return ", ".join(number(as_number(v), 4) if np.isfinite(as_number(v)) else str(v) for v in row)


def cases_of(data: xr.Dataset) -> tuple[ShownCase, ...]:
    """Return the cases of an analysis in the order of the study."""
    n = data.sizes.get("case", 1)
    values, numbers = varied_values(data)[1], first_number(data)[1]
    labels = [str(v) for v in data["case_label"].values] if "case_label" in data else [""] * n
    force = np.asarray(data["excitation_n"].values) if "excitation_n" in data else np.full(n, np.nan)
    return tuple(
        ShownCase(i, labels[i], _short(values[i]) or str(i + 1), float(numbers[i]), float(force[i]), colour)
        for i, colour in enumerate(ramp(n))
    )
