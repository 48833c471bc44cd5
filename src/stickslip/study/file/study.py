"""The study file: TOML that is validated as a whole for each case of [vary]."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from stickslip.errors import InputError, input_error, together
from stickslip.study.file.messages import told
from stickslip.study.file.tables import VERSION, Tables, study_tables
from stickslip.study.file.toml import read_toml
from stickslip.study.file.vary import VariedCase, cases_of, value_at, varied_keys, with_values
from stickslip.study.own_code import OwnCode

# fields of an `Analysis` without a default, which the runner needs
OF_AN_ANALYSIS = ("name", "table", "record", "key", "inputs", "solve", "dataset", "check", "summary")


@dataclass(frozen=True, eq=False)
class TablesOfCase:
    """The tables of a study with the values of one case.

    Parameters
    ----------
    label
        Name of the case: from [vary], or the shortest text that distinguishes the cases; empty for a study without [vary].
    values
        Varied key -> its value in this case.
    tables
        The validated tables.
    """

    label: str
    values: Mapping[str, Any]
    tables: Tables


@dataclass(frozen=True, eq=False)
class StudyFile:
    """A validated study file.

    Parameters
    ----------
    path
        Path of the file for messages.
    text
        Text of the file, kept for the provenance of results.
    raw
        Content of the file as parsed TOML.
    cases
        Cases of [vary]; one case without it.
    code
        User's code that the file names.
    """

    path: Path
    text: str
    raw: Mapping[str, Any]
    cases: tuple[TablesOfCase, ...]
    code: OwnCode = field(default_factory=OwnCode)

    @property
    def tables(self) -> Tables:
        """Tables of the first case. Title, output folder and analyses are the same in all cases."""
        return self.cases[0].tables

    @property
    def home(self) -> Path:
        """Folder to which file names are relative."""
        return self.path.resolve().parent


def read_file(path: Path, *, allow_code: bool = False) -> StudyFile:
    """Read and validate a study file; with `allow_code` it may name modules of the user, which are then imported.

    Raises
    ------
    InputError
        Naming every problem of the file, one a line.
    """
    text, raw = read_toml(path)
    code = OwnCode(path.resolve().parent, allow_code)
    return StudyFile(path, text, raw, validated(path, raw, code), code)


def validated(path: Path, raw: Mapping[str, Any], code: OwnCode) -> tuple[TablesOfCase, ...]:
    """Return the tables of each case of a file's content; the file may name the user's `code`.

    Raises
    ------
    InputError
        Naming every problem, one a line.
    """
    _check_version(path, raw.get("schema_version"))
    model = study_tables(_own_analyses(path, raw, code))
    found: list[TablesOfCase] = []
    cases = cases_of(str(path), raw, model)
    errors = {str(one): one for one in _of_replaced(path, raw, code, model)}
    for case in cases:
        try:
            found.append(_case(path, raw, case, code, model))
        except InputError as error:  # an error that occurs in many cases is reported once
            errors |= {str(one): one for one in error.each()}
    if errors:
        raise together(errors.values())
    return tuple(found)


def _own_analyses(path: Path, raw: Mapping[str, Any], code: OwnCode) -> tuple[tuple[str, type[BaseModel]], ...]:
    """Return names and tables of the user's analyses: other tables than those of stickslip, with a key ``analysis``."""
    found = []
    for name, table in raw.items():
        if name in study_tables().model_fields or not isinstance(table, Mapping) or "analysis" not in table:
            continue
        place = f"{path}: {name}.analysis"
        try:
            own = code.at(str(table["analysis"]), "analysis", OF_AN_ANALYSIS)
        except InputError as error:
            raise input_error(place, error.problem, error.remedy) from None
        if own.name != name:
            raise input_error(place, f"is the analysis {own.name!r}", f"Call the table [{own.name}].")
        found.append((name, own.table))
    return tuple(found)


def _of_replaced(path: Path, raw: Mapping[str, Any], code: OwnCode, model: type[Tables]) -> list[InputError]:
    """Return errors about values that [vary] replaces in every case, which would otherwise never be checked."""
    varied = {f"{path}: {key}" for key in varied_keys(str(path), raw)}
    given = {key for key in varied if value_at(raw, key.removeprefix(f"{path}: ")) is not None}
    if not given:
        return []
    try:
        _case(path, raw, VariedCase("", {}), code, model)
    except InputError as error:
        return [one for one in error.each() if one.place in given]
    return []


def _case(path: Path, raw: Mapping[str, Any], case: VariedCase, code: OwnCode, model: type[Tables]) -> TablesOfCase:
    try:
        tables = model.model_validate(with_values(raw, case.values), context={"study": path, "code": code})
    except ValidationError as error:
        renamed = {key: f"vary.{key}" for key in case.values}
        raise told(str(path), model, error, renamed) from None
    return TablesOfCase(case.name, case.values, tables)


def _check_version(path: Path, found: object) -> None:
    """Refuse a file of another layout version before checking its keys."""
    if found is None or (found == VERSION and isinstance(found, int)):
        return
    older = found == 1
    raise input_error(
        f"{path}: schema_version",
        f"this version of stickslip reads {VERSION}, got {found!r}",
        "The tables have changed: [blades], [damper] and [model] are now [part.NAME], loads are [load.NAME], [sweep] is "
        "[forced_response]. Begin with an example of 'stickslip new NAME'."
        if older
        else f"Write schema_version = {VERSION}, or install the stickslip that the file was written for.",
    )
