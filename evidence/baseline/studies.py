"""Every example study, in a setting small enough to run twice; each keeps its analyses, its laws and its readers."""

import json
import shutil
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from evidence.baseline.trees import ROOT

EXAMPLES = ROOT / "examples"
RUN = ("run", "study.toml")
Settings = Mapping[str, Any]


@dataclass(frozen=True)
class Example:
    """An example study as the comparison runs it.

    Parameters
    ----------
    name
        Folder of `EXAMPLES`.
    settings
        Keys by their full names and what they are set to; None removes a key or table.
    commands
        What is run in its folder, in this order.
    seconds
        Of the processor, about, for one tree: longer ones begin first.
    """

    name: str
    settings: Settings = field(default_factory=dict)
    commands: tuple[tuple[str, ...], ...] = (RUN,)
    seconds: float = 10.0

    def write(self, folder: Path) -> None:
        """Write the study and the files that it reads into a folder."""
        shutil.copytree(EXAMPLES / self.name, folder, ignore=shutil.ignore_patterns("results", "__pycache__"))
        path = folder / "study.toml"
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        path.write_text(toml_text(changed(tables, self.settings)), encoding="utf-8")


COARSE_BLADES = {
    "part.blades.airfoil_size_m": 0.012,
    "part.blades.platform_size_m": 0.012,
    "part.blades.foot_size_m": 0.016,
}
COARSE_SECTOR = {"part.blade.disk_size_m": 0.04, "part.blade.platform_size_m": 0.03, "part.blade.airfoil_size_m": 0.03}
SMALL = {
    one.name: one
    for one in (
        Example(
            "two_blades",
            COARSE_BLADES
            | {"vary.load.shaker.ratio": [250, 4], "forced_response.points": 10, "forced_response.peak_points": 4},
            seconds=40,
        ),
        Example(
            "second_bending",
            COARSE_BLADES
            | {"vary.load.shaker.ratio": [100, 5], "forced_response.points": 8, "forced_response.peak_points": 4},
            seconds=40,
        ),
        Example("friction_ring", {"vary.contact.groove.slip_limit_n": [1.0, 2.9, 20.0]}, seconds=40),
        Example("mistuned_wheel", {"vary.contact.damper.slip_limit_n": [2.0], "forced_response.points": 8}, seconds=40),
        Example(
            "shrouded_sector",
            COARSE_SECTOR | {"forced_response.points": 6, "campbell.points": 3, "safe.engine_orders": [4, 6, 12]},
            seconds=40,
        ),
        Example(
            "platform_damper",
            {"vary.load.gas.force_n": [3.0], "forced_response.points": 6, "part.blade.disk_size_m": 0.04},
            seconds=40,
        ),
        Example("own_blades", {"vary.load.shaker.ratio": [500], "forced_response.points": 8}, seconds=40),
        Example("calculix_wheel", {"vary.load.gas.force_n": [2.0], "forced_response.points": 6}, seconds=40),
        Example("sector_deck", {}, seconds=40),
        Example("run_up", {"part.blade.disk_size_m": 0.04, "run_up.points": 6, "run_up.peak_points": 2}, seconds=40),
        Example("root_joint", {"vary.load.shaker.force_n": [20.0], "forced_response.points": 6}, seconds=40),
        Example(
            "rubbing_beam",
            {"vary.load.side.force_n": [1.0], "vary.load.up.force_n": [1.0], "forced_response.points": 10},
            seconds=40,
        ),
        Example("two_tones", {"quasi_periodic.points": 3}, seconds=20),
        Example("flutter_ring", {"limit_cycle.periods": 300}, seconds=20),
    )
}


def examples() -> list[Example]:
    """Return all example studies; one that has no setting here is run as it is."""
    names = sorted(path.parent.name for path in EXAMPLES.glob("*/study.toml"))
    return [SMALL.get(name, Example(name)) for name in names]


def changed(tables: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return the tables of a study with keys set.

    Raises
    ------
    KeyError
        If a key or table that is to be removed, or the table of a key, is not there.
    """
    whole = json.loads(json.dumps(tables))
    for key, value in settings.items():
        *way, last = key.split(".")
        table = whole
        for name in way:
            table = table[name]
        if value is None:
            del table[last]
        else:
            table[last] = value
    return whole


def toml_text(tables: Mapping[str, Any], way: tuple[str, ...] = ()) -> str:
    """Return tables as TOML: the keys of each first, its tables after them."""
    keys = [f"{json.dumps(k)} = {_value(v)}" for k, v in tables.items() if not isinstance(v, dict)]
    below = [toml_text(v, (*way, k)) for k, v in tables.items() if isinstance(v, dict)]
    head = [f"[{'.'.join(map(json.dumps, way))}]"] if way and (keys or not below) else []
    return "\n".join(_nonempty([*head, *keys, "" if head else None, *below]))


def _nonempty(lines: Iterable[str | None]) -> list[str]:
    return [line for line in lines if line is not None]


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {_value(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    return repr(value) if isinstance(value, float) else json.dumps(value)
