"""Results of bladed disks as the report sees them: up to three files of one model."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error

COMMANDS = ("modes", "campbell", "safe")
NEEDED = {
    "modes": ("wave_number", "nodal_diameter", "wave_kind", "frequency_hz"),
    "campbell": ("wave_number", "nodal_diameter", "wave_kind", "speed_rpm", "frequency_hz"),
    "safe": ("wave_number", "nodal_diameter", "wave_kind", "frequency_hz", "pair_margin"),
}
# Okabe and Ito's colours without black and yellow, then darker ones: readable on white, distinct side by side
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7b3294", "#8c564b")


@dataclass(frozen=True, eq=False)
class WheelResult:
    """The result of one command.

    Parameters
    ----------
    data
        The dataset of docs/design.md.
    path
        Its file.
    """

    data: xr.Dataset
    path: Path

    def has(self, *names: str) -> bool:
        """Say whether all the variables are there and none is empty."""
        return all(name in self.data and self.data[name].size > 0 for name in names)

    def floats(self, name: str) -> FloatArray:
        """Return the values of a variable as floats."""
        return np.asarray(self.data[name].values, dtype=np.float64)

    def integers(self, name: str) -> IntArray:
        """Return the values of a variable as integers."""
        return np.asarray(self.data[name].values).astype(np.int64)

    def text(self, attribute: str, default: str = "") -> str:
        """Return an attribute as text, not escaped."""
        value = self.data.attrs.get(attribute, default)
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)

    def numbers(self, attribute: str) -> FloatArray:
        """Return an attribute as numbers, empty where it is missing."""
        return np.atleast_1d(np.asarray(self.data.attrs.get(attribute, []), dtype=np.float64))

    def scalar(self, attribute: str, default: float = float("nan")) -> float:
        """Return an attribute as a number."""
        found = self.numbers(attribute)
        return float(found[0]) if found.size else default

    @property
    def sectors(self) -> int:
        """Number of sectors; 1 for a whole structure."""
        return int(self.scalar("sectors", 1))

    @property
    def waves(self) -> tuple[str, ...]:
        """Names of the waves, such as ``ND 3`` or ``ND 3 forward`` where both directions are there."""
        diameters = self.integers("nodal_diameter")
        kinds = [str(kind) for kind in self.data["wave_kind"].values]
        if self.sectors == 1:
            return ("whole structure",) * len(kinds)
        names = []
        for diameter, kind in zip(diameters, kinds, strict=True):
            both = np.count_nonzero(diameters == diameter) > 1
            names.append(f"ND {diameter}{f' {kind}' if both else ''}")
        return tuple(names)

    @property
    def colours(self) -> tuple[str, ...]:
        """A CSS colour for each wave."""
        return tuple(colour(k) for k in range(len(self.waves)))


def colour(index: int) -> str:
    """Return the CSS colour of the line number `index`."""
    return _COLOURS[index % len(_COLOURS)]


def load_wheel(path: Path) -> dict[str, WheelResult]:
    """Read the results of bladed disks in a folder, or beside a file of that kind.

    Results of another model than that of the newest file are left out, those of the command named stay.

    Parameters
    ----------
    path
        ``modes.nc``, ``campbell.nc``, ``safe.nc`` or a folder that holds some of them.

    Returns
    -------
    dict
        Command -> result, in the order of `COMMANDS`.

    Raises
    ------
    InputError
        If there is none, or a file is no such result.
    """
    folder = path if path.is_dir() else path.parent
    found = {c: folder / f"{c}.nc" for c in COMMANDS if (folder / f"{c}.nc").is_file()}
    if not found:
        raise input_error(
            str(path),
            "there is no result of a bladed disk",
            "Run 'stickslip modes', 'campbell' or 'safe' first.",
        )
    loaded = {command: _load(file, command) for command, file in found.items()}
    leading = max(loaded.values(), key=lambda r: r.path.stat().st_mtime_ns)
    if path.name in {r.path.name for r in loaded.values()}:
        leading = next(r for r in loaded.values() if r.path.name == path.name)
    return _of_one_model(loaded, leading)


def _of_one_model(found: Mapping[str, WheelResult], leading: WheelResult) -> dict[str, WheelResult]:
    wanted = leading.text("model_hash")
    return {c: r for c, r in found.items() if r.text("model_hash") == wanted}


def _load(path: Path, command: str) -> WheelResult:
    remedy = f"Give the {command}.nc that `stickslip {command}` wrote."
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
            data = file.load()
    except (OSError, ValueError) as error:
        raise input_error(str(path), f"not a netCDF-4 file ({error})", remedy) from error
    missing = [name for name in NEEDED[command] if name not in data]
    if missing:
        raise input_error(str(path), f"variables {', '.join(missing)} are missing", remedy)
    return WheelResult(data, path)
