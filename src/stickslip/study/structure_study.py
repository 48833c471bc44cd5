"""The study of a bladed disk: TOML, validated whole, every problem named with its key and a remedy."""

import json
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, ValidationError, model_validator

from stickslip.errors import input_error
from stickslip.study.geometry import MaterialTable
from stickslip.study.messages import custom_error, told
from stickslip.study.schema import SCHEMA_VERSION, check_version, read_toml
from stickslip.study.sections import Output, Section
from stickslip.study.sector_table import SectorTable
from stickslip.study.structure_tables import (
    CampbellTable,
    FileModel,
    Modes,
    Rotation,
    SafeTable,
)

Command = Literal["modes", "campbell", "safe"]
CHUNK = 1 << 20  # bytes of a model file that are hashed at a time


class ModelTable(Section):
    """The model: exactly one of a parametric sector and files."""

    sector: SectorTable | None = Field(
        None, description="the table [model.sector], a parametric sector of a bladed disk"
    )
    file: FileModel | None = Field(
        None, description="the table [model.file], a model from a finite-element program"
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.sector is None) == (self.file is None):
            found = "neither" if self.sector is None else "both"
            raise custom_error(
                f"needs one of [model.sector] and [model.file], got {found}", "Give exactly one."
            )
        return self


class StructureTables(Section):
    """Everything a study of a bladed disk may hold."""

    schema_version: SCHEMA_VERSION = Field(
        description="schema_version = 1, the version of the file's layout"
    )
    title: str = Field("Bladed disk", max_length=200, description="a title of one line")
    model: ModelTable = Field(description="the tables [model.sector] or [model.file]")
    material: MaterialTable | None = Field(
        None,
        description="the table [material]; may be left out where the model's file holds a material or matrices",
    )
    rotation: Rotation = Field(default_factory=Rotation, description="the table [rotation]")
    modes: Modes = Field(default_factory=Modes, description="the table [modes]")
    campbell: CampbellTable | None = Field(None, description="the table [campbell]")
    safe: SafeTable | None = Field(None, description="the table [safe]")
    output: Output = Field(default_factory=Output, description="the table [output]")

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.model.sector is not None and self.material is None:
            raise custom_error(
                "is missing", "A parametric sector needs the table [material].", "material"
            )
        # of a file the true number of sectors is known when it has been read
        wrong = self.model.sector and self.excess(self.model.sector.sectors)
        if wrong:
            key, problem, remedy = wrong
            raise custom_error(problem, remedy, key)
        return self

    def excess(self, sectors: int) -> tuple[str, str, str] | None:
        """Return key, problem and remedy of nodal diameters that a wheel of `sectors` has not; None if all are right."""
        asked = {
            "modes.nodal_diameters": self.modes.nodal_diameters,
            "campbell.nodal_diameters": self.campbell and self.campbell.nodal_diameters,
        }
        highest = sectors // 2
        for key, diameters in asked.items():
            if diameters and max(diameters) > highest:
                problem = f"{max(diameters)} is above half of {sectors} sectors"
                return key, problem, f"The nodal diameters go from 0 to {highest}."
        return None


@dataclass(frozen=True)
class StructureStudy:
    """A study of a bladed disk that has been read and found good.

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
    tables: StructureTables
    folder: Path

    def located(self, name: str) -> Path:
        """Return the path of a file that the study names."""
        return self.path.resolve().parent / name

    @property
    def model_files(self) -> dict[str, Path]:
        """Keys of [model.file] that name files, and the files."""
        table = self.tables.model.file
        if table is None:
            return {}
        named = {key: getattr(table, key) for key in ("path", "mesh", "mass", "damping", "nodes")}
        return {key: self.located(name) for key, name in named.items() if name is not None}

    def content_hash(self, command: Command | None = None) -> str:
        """Hash all that numbers depend on: of the model and its speed, and of the table of `command`.

        The content of the model's files belongs to it; title, output folder and references do not.
        """
        parts = {"model", "material"} | ({"rotation", command} if command else set())
        content = self.tables.model_dump_json(
            include=parts, exclude={"modes": {"reference", "reference_case"}}
        )
        files = [p for path in self.model_files.values() for p in _with_companions(path)]
        digests = [_digest(path) for path in files]
        return sha256("\n".join([content, *digests]).encode()).hexdigest()


def read_structure_study(path: Path) -> StructureStudy:
    """Read and validate a study of a bladed disk.

    Raises
    ------
    InputError
        Naming every problem of the file, one a line; or a file that it names and that is not there.
    """
    text, raw = read_toml(path)
    if "model" not in raw and ("blades" in raw or "damper" in raw):
        raise input_error(
            str(path),
            "is a study of two blades and a damper, this command is for bladed disks",
            f"Use 'stickslip run {path}', or write a study of a bladed disk with 'stickslip new NAME --kind sector'.",
        )
    check_version(path, raw.get("schema_version"))
    try:
        tables = StructureTables.model_validate(raw, context={"study": path})
    except ValidationError as error:
        raise told(str(path), StructureTables, error) from None
    study = StructureStudy(path, text, tables, path.resolve().parent / tables.output.folder)
    _require_files(study)
    return study


def structure_schema() -> str:
    """Return the JSON Schema of studies of bladed disks."""
    return json.dumps(StructureTables.model_json_schema(), indent=2)


def is_structure_study(raw: dict[str, Any]) -> bool:
    """Say whether the content of a study file is that of a bladed disk."""
    return "model" in raw and "blades" not in raw


def _require_files(study: StructureStudy) -> None:
    """Refuse names of files that are not there, before anything else is done."""
    named = {f"model.file.{key}": path for key, path in study.model_files.items()}
    if study.tables.modes.reference is not None:
        named["modes.reference"] = study.located(study.tables.modes.reference)
    for key, path in named.items():
        if not path.is_file():
            raise input_error(
                f"{study.path}: {key}",
                f"there is no file {path}",
                "Check the name; it is relative to the study's folder.",
            )


def _with_companions(path: Path) -> list[Path]:
    """Return a file and those that CalculiX writes beside a stiffness."""
    zipped = ".gz" if path.name.endswith(".gz") else ""
    plain = path.name.removesuffix(".gz")
    if not plain.endswith(".sti"):
        return [path]
    beside = [path.with_name(plain.removesuffix(".sti") + end + zipped) for end in (".mas", ".dof")]
    return [path, *(p for p in beside if p.is_file())]


def _digest(path: Path) -> str:
    digest = sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()
