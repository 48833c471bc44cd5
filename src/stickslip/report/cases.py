"""Cases of [vary]: their names and colours on the page."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from stickslip.report.plot import ramp
from stickslip.study.file.case_names import JOINT
from stickslip.study.varied import assigned_of, families, first_varied_number, varied_values

CASE = "case"  # heading of legends and columns


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


def families_of(data: xr.Dataset, key: str, cases: Sequence[ShownCase]) -> dict[str, list[ShownCase]]:
    """Group some cases as `study.varied.families` does, each group by rising values; groups without a case are left out."""
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
