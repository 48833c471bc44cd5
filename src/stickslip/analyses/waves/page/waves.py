"""Modes, Campbell and SAFE diagrams as figures and tables see them: frequencies by travelling wave."""

from dataclasses import dataclass

import numpy as np

from stickslip.report.node import Node
from stickslip.report.plot import colour

NEEDED = ("wave_number", "nodal_diameter", "wave_kind", "frequency_hz")


@dataclass(frozen=True, eq=False)
class Waves(Node):
    """One case of an analysis by waves."""

    @property
    def sectors(self) -> int:
        """Number of sectors; 1 for a whole structure."""
        return int(self.scalar("sectors", 1))

    @property
    def kinds(self) -> list[str]:
        """Of each wave: standing, forward, backward or whole."""
        return [str(kind) for kind in self.data["wave_kind"].values]

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of the waves, such as ``ND 3`` or ``ND 3 forward`` where both directions are there."""
        diameters = self.integers("nodal_diameter")
        if self.sectors == 1:
            return ("whole structure",) * len(diameters)
        names = []
        for diameter, kind in zip(diameters, self.kinds, strict=True):
            both = np.count_nonzero(diameters == diameter) > 1
            names.append(f"ND {diameter}{f' {kind}' if both else ''}")
        return tuple(names)

    @property
    def colours(self) -> tuple[str, ...]:
        """A CSS colour for each wave."""
        return tuple(colour(k) for k in range(len(self.waves)))
