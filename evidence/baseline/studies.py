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
SMALL = Path(__file__).with_name("small.toml")
RUN = "run study.toml"
OF_THE_RUN = ("commands", "seconds")  # keys of an example in `SMALL` that are none of its study
USUAL_SECONDS = 10.0  # of the processor for an example without a setting
Settings = Mapping[str, Any]


@dataclass(frozen=True)
class Example:
    """An example study as the comparison runs it.

    Parameters
    ----------
    name
        Folder of `EXAMPLES`.
    settings
        Keys by their full names and what they are set to.
    commands
        What is run in its folder, in this order.
    seconds
        Of the processor, about, for one tree: longer ones begin first.
    """

    name: str
    settings: Settings = field(default_factory=dict)
    commands: tuple[tuple[str, ...], ...] = (tuple(RUN.split()),)
    seconds: float = USUAL_SECONDS

    def write(self, folder: Path) -> None:
        """Write the study and the files that it reads into a folder."""
        shutil.copytree(EXAMPLES / self.name, folder, ignore=shutil.ignore_patterns("results", "__pycache__"))
        path = folder / "study.toml"
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        path.write_text(toml_text(changed(tables, self.settings)), encoding="utf-8")


def examples() -> list[Example]:
    """Return all example studies; one that has no setting in ``small.toml`` is run as it is."""
    names = sorted(path.parent.name for path in EXAMPLES.glob("*/study.toml"))
    small = tomllib.loads(SMALL.read_text(encoding="utf-8"))
    if unknown := set(small) - set(names):
        raise KeyError(f"{SMALL}: no example is called {', '.join(sorted(unknown))}")
    return [_example(name, small.get(name, {})) for name in names]


def _example(name: str, small: Settings) -> Example:
    own = {key: value for key, value in small.items() if key not in OF_THE_RUN}
    commands = tuple(tuple(command.split()) for command in small.get("commands", [RUN]))
    return Example(name, own, commands, small.get("seconds", USUAL_SECONDS))


def changed(tables: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return the tables of a study with keys set.

    Raises
    ------
    KeyError
        If there is no table of a key.
    """
    whole = json.loads(json.dumps(tables))
    for key, value in settings.items():
        *way, last = key.split(".")
        table = whole
        for name in way:
            table = table[name]
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
