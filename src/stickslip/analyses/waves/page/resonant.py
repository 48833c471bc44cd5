"""The mode on which the figure of mode shapes opens: an engine order excites it nearest to the speed."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from stickslip.analyses.columns import record_of
from stickslip.analyses.waves.records import Campbell, Interference, Modes, Wave
from stickslip.study.store.netcdf import one_case, variable

WAVE, MODE = "resonant_wave", "resonant_mode"  # indices of the mode on which the figure opens


@dataclass(frozen=True)
class _Met:
    """A mode that an engine order excites, and the distance of this resonance from the speed."""

    wave: Wave
    mode: int
    distance: float


def with_resonance(modes: xr.Dataset, tree: xr.DataTree) -> xr.Dataset:
    """Return the dataset of modes with the mode of each case nearest to a resonance, by SAFE or Campbell diagram.

    Parameters
    ----------
    modes
        Dataset of the analysis ``modes``.
    tree
        The result. The SAFE diagram takes precedence over the Campbell diagram, whose crossings are compared with the
        speed of the modes.
    """
    n = modes.sizes["case"]
    own = {name: tree[name].to_dataset() for name in ("safe", "campbell") if name in tree.children}
    usable = {name: data for name, data in own.items() if data.sizes.get("case") == n}
    found = [_of_case(modes, usable, k) for k in range(n)]
    if all(one is None for one in found):
        return modes
    each = np.array([(0, 0) if one is None else one for one in found])
    meaning = "of the mode nearest to a resonance"
    new = {WAVE: f"index of the wave {meaning}", MODE: f"index {meaning}"}
    return modes.assign_coords({name: variable("case", each[:, k], "1", new[name]) for k, name in enumerate(new)})


def _of_case(modes: xr.Dataset, own: dict[str, xr.Dataset], case: int) -> tuple[int, int] | None:
    """Return the indices of wave and mode in the modes of a case; None if nothing is known."""
    known = record_of(Modes, one_case(modes, case))
    met: list[_Met] = []
    if "safe" in own:
        met = _of_safe(record_of(Interference, one_case(own["safe"], case)))
    if not met and "campbell" in own:
        met = _of_campbell(record_of(Campbell, one_case(own["campbell"], case)), known.speed_rpm or 0.0)
    for one in sorted(met, key=lambda one: one.distance):
        here = [k for k, w in enumerate(known.waves) if w.wave_number == one.wave.wave_number]
        here += [k for k, w in enumerate(known.waves) if w.nodal_diameter == one.wave.nodal_diameter]
        if here and one.mode < len(known.waves[here[0]].frequencies_hz):
            return here[0], one.mode
    return None


def _of_safe(found: Any) -> list[_Met]:
    pairs = (pair for pair in found.pairs if np.isfinite(pair.margin))
    return [_Met(found.waves[pair.wave], pair.mode, abs(pair.margin)) for pair in pairs]


def _of_campbell(found: Any, rpm: float) -> list[_Met]:
    return [_Met(found.waves[w], c.mode, abs(c.speed_rpm - rpm)) for w, c in found.crossings]
