"""Reading of a study file with all checks that need no mesh, and with the errors that others hide.

A wrong key or value ends the checks before names and files are looked at. So wrong keys are removed, and the rest is checked again.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stickslip.errors import InputError, together
from stickslip.study.file.study import StudyFile, read_file, validated
from stickslip.study.file.toml import read_toml
from stickslip.study.file.vary import value_at, varied_keys, with_values
from stickslip.study.models.checks import refuse
from stickslip.study.own_code import OwnCode

MAX_ROUNDS = 5  # of removing wrong keys and checking again
VARY = "vary"
MEANT = re.compile(r"Did you mean '([^']+)'")
# a name of a file in a message: with a folder, or with a usual ending
PATH = re.compile(r"\S*[/\\]\S*|[\w.-]+\.(?:toml|inp|cdb|dat|csv|npz|op2|op4|vtu|vtk|frd|sti|mas|msh|py|bdf)\b")


@dataclass
class _Rest:
    """What is left of a file without its wrong keys.

    Parameters
    ----------
    raw
        Content of the file.
    keys
        Keys that were removed.
    names
        Names of tables that were removed, as ``brake`` of ``contact.brake``.
    """

    raw: dict[str, Any]
    keys: list[str] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def remove(self, place: str, errors: Sequence[InputError], keys: Sequence[str]) -> bool:
        """Remove wrong keys, and tables that lack one; rename misspelt keys. Return whether anything could be removed."""
        before = len(self.keys)
        for error, key in zip(errors, keys, strict=True):
            meant = MEANT.search(error.remedy) if error.problem.startswith("unknown key") else None
            if meant and value_at(self.raw, key) is not None:
                self._rename(key, meant[1])
                continue
            if key.partition(".")[0] == VARY:
                self._remove_vary(place, [k.removeprefix(f"{VARY}.") for k in keys])
            elif key and value_at(self.raw, key) is not None:
                self._remove(key)
            elif "." in key and value_at(self.raw, key.rpartition(".")[0]) is not None:  # a key that is missing
                table = key.rpartition(".")[0]
                self.names.append(table.rpartition(".")[2])
                self._remove(table)
        return len(self.keys) > before

    def _rename(self, key: str, meant: str) -> None:
        table = value_at(self.raw, key.rpartition(".")[0]) if "." in key else self.raw
        value = table.pop(key.rpartition(".")[2])
        table.setdefault(meant, value)
        self.keys += [key, f"{key.rpartition('.')[0]}.{meant}".lstrip(".")]

    def _remove(self, key: str) -> None:
        *tables, last = key.split(".")
        here = self.raw
        for name in tables:
            here = here[name]
        del here[last]
        self.keys.append(key)

    def _remove_vary(self, place: str, wrong: Sequence[str]) -> None:
        if VARY not in self.raw:
            return
        try:
            first = {key: values[0] for key, values in varied_keys(place, self.raw).items() if key not in wrong}
        except (AttributeError, TypeError):  # [vary] is no table
            first = {}
        self.raw = with_values(self.raw, {k: v for k, v in first.items() if value_at(self.raw, k) is None})
        self.keys.append(VARY)

    def holds(self, key: str) -> bool:
        """Return whether an error at a key is of the file: what it is about was not removed."""
        found = None if key in self.keys else value_at(self.raw, key)
        inside = any(f"{gone}.".startswith(f"{key}.") for gone in self.keys)
        return found is not None and not (isinstance(found, Mapping) and inside)

    def speaks_of_removed(self, error: InputError) -> bool:
        """Return whether an error names a removed table."""
        told = PATH.sub("", str(error))
        return any(re.search(rf"'{name}'|\b{name}\.\w|\w\.{name}\b", told) for name in map(re.escape, self.names))


def checked_file(path: Path, *, allow_code: bool = False) -> StudyFile:
    """Read a study file and make all checks that need no mesh; `allow_code` as in `read_file`.

    Raises
    ------
    InputError
        If the file has errors; the message names each on a line.
    """
    try:
        file = read_file(path, allow_code=allow_code)
        refuse(file)
    except InputError as error:
        hidden = _hidden_errors(path, error, allow_code=allow_code)
        raise (together([*error.each(), *hidden]) if hidden else error) from None
    return file


def _hidden_errors(path: Path, first: InputError, *, allow_code: bool) -> list[InputError]:
    """Return further errors of a file, found by removing the wrong keys and checking again."""
    try:
        text, raw = read_toml(path)
    except InputError:
        return []
    errors = first.each()
    rest, told, found = _Rest(deepcopy(dict(raw))), {str(one) for one in errors}, list[InputError]()
    for _ in range(MAX_ROUNDS):
        keys = list(_keys(path, errors))
        if "schema_version" in keys or not rest.remove(str(path), errors, keys):
            break
        try:
            code = OwnCode(path.resolve().parent, allow_code)
            refuse(StudyFile(path, text, rest.raw, validated(path, rest.raw, code), code))
            break
        except InputError as error:
            errors = error.each()
        for one, key in zip(errors, _keys(path, errors), strict=True):
            if str(one) not in told and rest.holds(key) and not rest.speaks_of_removed(one):
                found.append(one)
            told.add(str(one))
    return found


def _keys(path: Path, errors: Iterable[InputError]) -> Iterator[str]:
    """Yield the key that each error is about, without a position in a list."""
    for one in errors:
        yield one.place.removeprefix(str(path)).removeprefix(": ").partition("[")[0]
