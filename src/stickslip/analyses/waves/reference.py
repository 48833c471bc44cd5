"""Reference frequencies from a CSV file."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.reduction.waves import wave

MOST_ROWS = 100_000
SAME_SPEED = 1e-6  # relative
_SPEED = re.compile(r"(\d+(?:\.\d+)?)[ _]*rpm", re.IGNORECASE)  # in the name of a case


class Row(BaseModel):
    """A line of the file."""

    nodal_diameter: int = Field(ge=0, description="a whole number")
    mode: int = Field(ge=0, description="a whole number")
    frequency_hz: float = Field(gt=0, allow_inf_nan=False, description="a frequency above zero")
    speed_rpm: float | None = Field(None, ge=0, allow_inf_nan=False, description="a speed of zero or more, or nothing")


@dataclass(frozen=True)
class Reference:
    """Reference frequencies of modes.

    Parameters
    ----------
    path
        Path of the file.
    frequencies_hz
        (nodal diameter, mode from 1) -> frequency, Hz.
    speeds_rpm
        Speeds in the column ``speed_rpm``, or else in the name of the case, as ``prestressed_8000rpm``; empty if unknown.
    """

    path: Path
    frequencies_hz: Mapping[tuple[int, int], float]
    speeds_rpm: tuple[float, ...] = ()

    def not_at(self, rpm: float) -> tuple[float, ...]:
        """Return the speeds of these frequencies that differ from a given speed."""
        return tuple(s for s in self.speeds_rpm if abs(s - rpm) > SAME_SPEED * max(s, rpm))

    def of_waves(self, numbers: Sequence[int], n_modes: int, sectors: int) -> FloatArray:
        """Return (k, m) reference frequencies in Hz for wave numbers; NaN if unknown.

        Both directions of a nodal diameter are compared with the same frequencies.

        Raises
        ------
        InputError
            If no reference frequency belongs to these waves.
        """
        diameters = [wave(k, sectors).nodal_diameter for k in numbers]
        modes = range(1, n_modes + 1)
        out = np.array([[self.frequencies_hz.get((d, m), np.nan) for m in modes] for d in diameters])
        if not np.isfinite(out).any():
            raise input_error(
                str(self.path),
                "holds no frequency of the nodal diameters and modes of this study",
                "Check the columns nodal_diameter and mode (1 is the lowest), and modes.reference_case.",
            )
        return out


def read_reference(path: Path, case: str | None) -> Reference:
    """Read a CSV file of frequencies; with `case`, only the rows whose column ``case`` has this value.

    Raises
    ------
    InputError
        If the file or a column is missing, or a line cannot be read.
    """
    if not path.is_file():
        raise input_error(
            "modes.reference", f"there is no file {path}", "Check the name; it is relative to the study's folder."
        )
    found, speeds = _rows(path, case)
    named = _SPEED.search(case or "")
    if named and not speeds:
        speeds = {float(named[1])}
    return Reference(path, found, tuple(sorted(speeds)))


def _rows(path: Path, case: str | None) -> tuple[dict[tuple[int, int], float], set[float]]:
    found: dict[tuple[int, int], float] = {}
    speeds: set[float] = set()
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            for line, row in _lines(path, stream, case):
                key = row.nodal_diameter, row.mode
                if key in found:
                    raise input_error(
                        f"{path}: line {line}",
                        f"nodal diameter {key[0]}, mode {key[1]} is there twice",
                        "Choose the rows by a column 'case' and modes.reference_case.",
                    )
                found[key] = row.frequency_hz
                speeds |= set() if row.speed_rpm is None else {row.speed_rpm}
    except (UnicodeDecodeError, csv.Error) as error:
        raise input_error(str(path), f"is not a CSV file in UTF-8 ({error})", "Save it as CSV.") from None
    return found, speeds


def _lines(path: Path, stream: TextIO, case: str | None) -> Iterator[tuple[int, Row]]:
    """Yield the reference rows and their line numbers."""
    reader = csv.DictReader(stream)
    required = [name for name, field in Row.model_fields.items() if field.is_required()]
    needed = [*required, *(["case"] if case is not None else [])]
    missing = [name for name in needed if name not in (reader.fieldnames or [])]
    if missing:
        raise input_error(
            str(path), f"has no column {', '.join(missing)}", f"The first line names the columns: {','.join(needed)}."
        )
    for row in reader:
        if reader.line_num > MOST_ROWS:
            raise input_error(str(path), f"has more than {MOST_ROWS} lines", "Cut it to what is compared.")
        if case is None or row["case"] == case:
            yield reader.line_num, _row(f"{path}: line {reader.line_num}", row)


def _row(place: str, row: dict[str, str]) -> Row:
    try:
        return Row.model_validate({k: v for k, v in row.items() if v or k != "speed_rpm"})
    except ValidationError as error:
        column = str(error.errors()[0]["loc"][0])
        raise input_error(
            f"{place}: {column}",
            f"cannot be read, got {row[column]!r}",
            f"Give {Row.model_fields[column].description}.",
        ) from None
