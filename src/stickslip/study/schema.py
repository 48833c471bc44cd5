"""The study file: TOML, validated whole, every problem named with its key and a remedy."""

import json
import tomllib
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import Field, ValidationError

from stickslip.errors import input_error
from stickslip.study.contacts import Contact
from stickslip.study.geometry import Blades, Damper, MaterialTable
from stickslip.study.harmonics_table import Harmonics
from stickslip.study.messages import told
from stickslip.study.sections import (
    Damping,
    Limits,
    Loads,
    Output,
    Reduction,
    Retention,
    Section,
    Solver,
    SweepTable,
)

LARGEST_FILE = 1_000_000  # bytes
SCHEMA_VERSION = Literal[1]


class StudyTables(Section):
    """Everything a study file may hold."""

    schema_version: SCHEMA_VERSION = Field(
        description="schema_version = 1, the version of the file's layout"
    )
    title: str = Field(
        "Two blades and a friction damper", max_length=200, description="a title of one line"
    )
    blades: Blades = Field(description="the table [blades], the geometry of the two equal blades")
    material: MaterialTable = Field(description="the table [material], the blades' material")
    reduction: Reduction = Field(default_factory=Reduction, description="the table [reduction]")
    damping: Damping = Field(description="the table [damping], the blades' structural damping")
    damper: Damper = Field(description="the table [damper], the rigid damper between the platforms")
    contact: Contact = Field(description="the tables [contact.flat] and [contact.curved]")
    loads: Loads = Field(description="the table [loads]")
    sweep: SweepTable = Field(description="the table [sweep]")
    harmonics: Harmonics = Field(default_factory=Harmonics, description="the table [harmonics]")
    solver: Solver = Field(default_factory=Solver, description="the table [solver]")
    retention: Retention = Field(default_factory=Retention, description="the table [retention]")
    limits: Limits = Field(default_factory=Limits, description="the table [limits]")
    output: Output = Field(default_factory=Output, description="the table [output]")


@dataclass(frozen=True)
class Study:
    """A study file that has been read and found good.

    Parameters
    ----------
    path
        The file.
    text
        Its content, kept for the provenance of results.
    tables
        Its validated content.
    folder
        Where results go, inside the file's folder.
    """

    path: Path
    text: str
    tables: StudyTables
    folder: Path

    @property
    def content_hash(self) -> str:
        """Hash of all that numbers depend on: neither comments nor title, limits and output folder."""
        content = self.tables.model_dump_json(exclude={"title", "limits", "output"})
        return sha256(content.encode()).hexdigest()


def read_study(path: Path) -> Study:
    """Read and validate a study file.

    Raises
    ------
    InputError
        Naming every problem of the file, one a line.
    """
    text, raw = read_toml(path)
    if "model" in raw and "blades" not in raw:
        raise input_error(
            str(path),
            "is a study of a bladed disk, this command is for two blades and a damper",
            f"Use 'stickslip modes {path}', 'stickslip campbell' or 'stickslip safe'.",
        )
    check_version(path, raw.get("schema_version"))
    try:
        tables = StudyTables.model_validate(raw, context={"study": path})
    except ValidationError as error:
        raise told(str(path), StudyTables, error) from None
    return Study(path, text, tables, path.resolve().parent / tables.output.folder)


def json_schema() -> str:
    """Return the JSON Schema of study files."""
    return json.dumps(StudyTables.model_json_schema(), indent=2)


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a study file and its raw content.

    Raises
    ------
    InputError
        If it is not there, too large, or no TOML.
    """
    text = _text(path)
    try:
        return text, tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise input_error(
            str(path), f"is not valid TOML: {error}", "Correct the line named."
        ) from None


def _text(path: Path) -> str:
    place = str(path)
    if not path.exists():
        raise input_error(
            place,
            "there is no such file",
            "Check the name, or write an example with 'stickslip new NAME'.",
        )
    if not path.is_file():
        raise input_error(
            place, "is not a file", "Name the study file itself, for example two_blades/study.toml."
        )
    try:
        with path.open("rb") as stream:
            content = stream.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise input_error(
                place,
                f"is larger than {LARGEST_FILE} bytes",
                "A study file is a few kilobytes of TOML.",
            )
        # TOML allows both line ends; one form keeps hashes and provenance the same
        return content.decode("utf-8").replace("\r\n", "\n")
    except OSError as error:
        raise input_error(
            place, f"cannot be read ({error.strerror})", "Check its permissions."
        ) from None
    except UnicodeDecodeError as error:
        raise input_error(
            place, f"is not UTF-8 text (byte {error.start})", "Save it as UTF-8."
        ) from None


def check_version(path: Path, found: object) -> None:
    """Refuse another version of the layout before its keys are judged by this one's."""
    known = get_args(SCHEMA_VERSION)
    if found is not None and (found not in known or isinstance(found, bool | float)):
        raise input_error(
            f"{path}: schema_version",
            f"this version of stickslip reads {known[0]}, got {found!r}",
            f"Write schema_version = {known[0]}, or install the stickslip that the file was written for.",
        )
