"""Wave numbers of an analysis, and their names."""

from collections.abc import Sequence
from dataclasses import dataclass

from stickslip.errors import input_error
from stickslip.reduction.waves import excited_wave, wave


@dataclass(frozen=True)
class Wheel:
    """What numbers of waves depend on.

    Parameters
    ----------
    sectors
        Of the wheel; 1 for a whole structure.
    parted
        Whether Coriolis forces part the two directions of a nodal diameter.
    """

    sectors: int
    parted: bool

    def numbers(self, diameters: Sequence[int] | None = None) -> tuple[int, ...]:
        """Return the wave numbers of nodal diameters (all if None); forward waves too where the directions are parted."""
        half = self.sectors // 2
        found = sorted(range(half + 1) if diameters is None else diameters)
        if self.parted:
            found += [self.sectors - d for d in reversed(found) if 0 < 2 * d < self.sectors]
        return tuple(found)

    def diagram(self, engine_order: int) -> int:
        """Return the wave number in whose diagram an engine order has its crossings."""
        excited = excited_wave(engine_order, self.sectors)
        # where nothing parts them, both directions have the same frequencies, and one diagram
        return excited if self.parted else min(excited, self.sectors - excited)

    def require(self, diameters: Sequence[int] | None, key: str) -> None:
        """Refuse nodal diameters that the wheel has not."""
        highest = self.sectors // 2
        if diameters and self.sectors == 1 and max(diameters) > 0:
            raise input_error(key, "are of a wheel, and no part is a sector of one", "Leave them out.")
        if diameters and max(diameters) > highest:
            raise input_error(
                key,
                f"{max(diameters)} is above half of {self.sectors} sectors",
                f"The nodal diameters go from 0 to {highest}.",
            )


def wave_name(number: int, sectors: int) -> tuple[int, str]:
    """Return the nodal diameter of a wave number, and its kind."""
    if sectors == 1:
        return 0, "whole"
    found = wave(number, sectors)
    return found.nodal_diameter, found.kind


def label(number: int, sectors: int, *, parted: bool) -> str:
    """Return the name of a wave, with its direction where that matters."""
    diameter, kind = wave_name(number, sectors)
    if sectors == 1:
        return "whole"
    told = parted and kind in ("backward", "forward")
    return f"ND {diameter} {kind}" if told else f"ND {diameter}"
