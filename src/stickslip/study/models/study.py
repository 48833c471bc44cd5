"""A study: its analyses and the cases of [vary]."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any

from stickslip.assembly.model import Model
from stickslip.errors import InputError, input_error
from stickslip.study.analysis import Case
from stickslip.study.file.study import StudyFile, TablesOfCase, validated
from stickslip.study.file.tables import OF_THE_MODEL, Tables, asked_of
from stickslip.study.file.vary import refuse_varied, with_values
from stickslip.study.models.checked_file import checked_file
from stickslip.study.models.checks import refuse
from stickslip.study.models.measured import MeasuredPeaks, measured_peaks
from stickslip.study.models.model import model_of, newton
from stickslip.study.models.parts import Memo, digest, digest_of
from stickslip.study.own_code import OwnCode


@dataclass(frozen=True, eq=False)
class Study:
    """A study that has passed all checks that need no mesh.

    Parameters
    ----------
    file
        The study file, with one set of tables for each case.
    memo
        Built parts, shared by all cases.
    """

    file: StudyFile
    memo: Memo = field(default_factory=dict, repr=False)

    @property
    def path(self) -> Path:
        """Path of the file for messages."""
        return self.file.path

    @property
    def text(self) -> str:
        """Content of the file."""
        return self.file.text

    @property
    def tables(self) -> Tables:
        """Tables of the first case."""
        return self.file.tables

    @property
    def code(self) -> OwnCode:
        """User's code that the file names."""
        return self.file.code

    @property
    def title(self) -> str:
        """Title on one line; without a title the name of the file's folder."""
        return self.tables.title or self.file.home.name

    @property
    def folder(self) -> Path:
        """Folder of the results, inside the file's folder."""
        return self.file.home / self.tables.output.folder

    @property
    def asked(self) -> tuple[str, ...]:
        """Names of the analyses whose tables are in the file."""
        return asked_of(self.tables)

    @property
    def measured(self) -> MeasuredPeaks | None:
        """Measured peaks named by the file."""
        return measured_peaks(self.file)

    def cases(self) -> tuple[Case, ...]:
        """Return the cases of [vary], or a single case without it. Models are built on request."""
        return tuple(self._case(i, case) for i, case in enumerate(self.file.cases))

    def model(self, case: int = 0) -> Model:
        """Return the model of a case.

        Raises
        ------
        InputError
            If files cannot be read, or inputs are inconsistent.
        """
        tables = self.file.cases[case].tables
        try:
            return model_of(tables, self.file.home, self.memo)
        except InputError as error:
            raise error.inside(str(self.path)) from None

    def replace(self, values: Mapping[str, Any]) -> "Study":
        """Return the study with other values of some keys, such as ``{"contact.flat.friction_coefficient": 0.4}``.

        Raises
        ------
        InputError
            If a key is unknown, a value is refused, or the key is varied.
        """
        raw = with_values(self.file.raw, values, keep_vary=True)
        found = validated(self.path, raw, self.file.code)
        refuse_varied(str(self.path), raw, values)
        changed = StudyFile(self.path, self.text, raw, found, self.file.code)
        return _checked(Study(changed, self.memo))

    def _case(self, index: int, case: TablesOfCase) -> Case:
        whole, at_rest = model_digests(case.tables, self.file.home)
        other = OtherModel(self.path, with_values(self.file.raw, case.values), self.file.code, self.memo)
        return Case(
            index=index,
            label=case.label,
            values=case.values,
            settings=case.tables,
            build=partial(self.model, index),
            digest=whole,
            home=self.file.home,
            digest_at_rest=at_rest,
            at=other,
            accepts=other.study,
            drive=_drive(case.tables),
        )


@dataclass(frozen=True, eq=False)
class OtherModel:
    """Function that returns the model of a case for another value of a key; picklable.

    Parameters
    ----------
    path
        Path of the study file.
    raw
        Content of the file with the values of the case.
    code
        User's code that the file names.
    memo
        Built parts; empty in another process.
    """

    path: Path
    raw: Mapping[str, Any]
    code: OwnCode
    memo: Memo = field(default_factory=dict, repr=False)

    def __call__(self, key: str, value: float) -> Model:
        """Return the model.

        Raises
        ------
        InputError
            If the key is unknown, or its value is refused.
        """
        found = self.study(key, value)
        try:
            return found.model()
        except InputError as error:
            raise self._refused(key, value, error) from None

    def study(self, key: str, value: float) -> Study:
        """Return the study of the changed model, after all checks that need no mesh.

        Raises
        ------
        InputError
            If the key is unknown, or its value is refused.
        """
        raw = {**self.raw, "vary": {key: [value]}}
        try:
            cases = validated(self.path, raw, self.code)
            return _checked(Study(StudyFile(self.path, "", raw, cases, self.code), self.memo))
        except InputError as error:
            raise self._refused(key, value, error) from None

    def _refused(self, key: str, value: float, error: InputError) -> InputError:
        told = str(error).replace(f"{self.path}: ", "").removeprefix(f"vary.{key}: ")
        remedy = "Name a key of the model as [vary] does, and values that it takes."
        return input_error("parameter", f"{key} = {value:g} is refused: {told.rstrip('.?')}", remedy)

    def __getstate__(self) -> dict[str, Any]:
        return {"path": self.path, "raw": self.raw, "code": self.code, "memo": {}}


def read_study(path: Path, *, allow_code: bool = False) -> Study:
    """Read a study file and make all checks that need no mesh; `allow_code` as in `read_file`.

    Raises
    ------
    InputError
        If the file has errors; the message names each on a line.
    """
    return judged(checked_file(path, allow_code=allow_code))


def _drive(tables: Tables) -> float:
    """Return the ratio of harmonic to static forces; without static forces, the harmonic forces over 1 N."""
    static, harmonic = 0.0, 0.0
    for load in tables.load.values():
        if load.harmonic == 0:
            static += abs(newton(tables, load))
        else:
            harmonic += abs(newton(tables, load))
    return harmonic / (static or 1.0)


def judged(file: StudyFile) -> Study:
    """Return the study of a file that has passed `refuse`.

    Raises
    ------
    InputError
        If the file of measured peaks cannot be used.
    """
    measured_peaks(file)
    return Study(file)


def model_digests(tables: Tables, home: Path) -> tuple[str, str]:
    """Return two hashes of everything a model depends on: with and without harmonic loads and outputs."""
    own = tables.model_dump(mode="json", include=set(OF_THE_MODEL) - {"load"})
    parts = [digest(tables, name, home) for name in tables.part]
    loads = {name: [load.model_dump(mode="json"), newton(tables, load)] for name, load in tables.load.items()}
    if tables.aero is not None:
        parts.append(digest_of(home / tables.aero.file))
    files = [one.file for one in tables.mistuning.values() if one.file is not None]
    parts += [digest_of(home / file) for file in files]
    fields = {name: digest_of(home / load.pressure) for name, load in tables.load.items() if load.pressure is not None}
    for name, content in fields.items():
        loads[name].append(content)
    static = {name: loads[name] for name, load in tables.load.items() if load.harmonic == 0}
    usual = {"measure"} if tables.output.measure == "first" else set()
    output = tables.output.model_dump(mode="json", exclude={"folder", *usual})
    driven = [own, parts, loads, output, tables.harmonics.alert_over]
    return _hash(driven), _hash([own, parts, static])


def _hash(content: object) -> str:
    return sha256(json.dumps(content).encode()).hexdigest()


def _checked(study: Study) -> Study:
    refuse(study.file)
    measured_peaks(study.file)
    return study
