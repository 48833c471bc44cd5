"""Cases of [vary]: their names and colours on the page."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.report.plot import ramp
from stickslip.study.coordinates import assigned_of, families, first_varied_number, varied_values


@dataclass(frozen=True)
class ShownCase:
    """A case as the page names it.

    Parameters
    ----------
    index
        Position along ``case`` in the dataset.
    label
        Name of the case; empty for a study without [vary].
    value
        Value of the first varied key whose values are numbers; NaN without one.
    excitation
        Amplitude of the harmonic force in N; NaN for none.
    assigned
        Varied keys with their values: ``load.shaker.force_n = 3``.
    colour
        CSS colour, from navy for the first case to gold for the last one.
    """

    index: int
    label: str
    value: float
    excitation: float
    assigned: tuple[str, ...]
    colour: str

    @property
    def short(self) -> str:
        """The name, or the number of a case without one, for legends and columns."""
        return self.label or str(self.index + 1)

    @property
    def identity(self) -> frozenset[str]:
        """Identity of the case in other results: varied keys with their values, or the name if nothing is varied."""
        return frozenset(self.assigned or (self.label,))

    @property
    def where(self) -> str:
        """The end of a sentence about this case: `` with NAME``, or an empty text."""
        return f" with {self.label}" if self.label else ""

    @property
    def named(self) -> str:
        """The subject of a sentence about this case: its name, or ``the response``."""
        return self.label or "the response"


def first_number(data: xr.Dataset) -> tuple[str, np.ndarray]:
    """Return the first varied key whose values are numbers, and its values (case,); NaN if there is none."""
    key, values = first_varied_number(data)
    return key, values


def families_of(data: xr.Dataset, key: str, cases: Sequence[ShownCase]) -> dict[str, list[ShownCase]]:
    """Group some cases as `study.coordinates.families` does, each group by rising values; groups without a case are left out."""
    own = {case.index: case for case in sorted(cases, key=lambda c: c.value)}
    groups = {name: [own[k] for k in own if k in members] for name, members in families(data, key).items()}
    return {name: group for name, group in groups.items() if group}


def cases_of(data: xr.Dataset) -> tuple[ShownCase, ...]:
    """Return the cases of an analysis in the order of the study."""
    n = data.sizes.get("case", 1)
    (keys, values), numbers = varied_values(data), first_number(data)[1]
    rows = [dict(zip(keys, row, strict=True)) for row in values]
    labels = [str(v) for v in data["case_label"].values] if "case_label" in data else [""] * n
    force = np.asarray(data["excitation_n"].values) if "excitation_n" in data else np.full(n, np.nan)
    return tuple(
        ShownCase(
            i,
            labels[i],
            float(numbers[i]),
            float(force[i]),
            assigned_of(rows[i]),
            colour,
        )
        for i, colour in enumerate(ramp(n))
    )
