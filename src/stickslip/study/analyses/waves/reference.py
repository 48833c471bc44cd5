"""Frequencies to compare with, from a CSV file."""

import csv
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import InputError, input_error
from stickslip.reduction.waves import wave

COLUMNS = ("nodal_diameter", "mode", "frequency_hz")
MOST_ROWS = 100_000


@dataclass(frozen=True)
class Reference:
    """Frequencies to compare with.

    Parameters
    ----------
    path
        Their file.
    frequencies_hz
        (nodal diameter, mode from 1) -> Hz.
    """

    path: Path
    frequencies_hz: Mapping[tuple[int, int], float]

    def of_waves(self, numbers: Sequence[int], n_modes: int, sectors: int) -> FloatArray:
        """Return the (k, m) frequencies in Hz of wave numbers, NaN where there is none.

        Both directions of a nodal diameter are compared with the same frequencies.

        Raises
        ------
        InputError
            If nothing is left to compare with.
        """
        diameters = [wave(k, sectors).nodal_diameter for k in numbers]
        modes = range(1, n_modes + 1)
        out = np.array(
            [[self.frequencies_hz.get((d, m), np.nan) for m in modes] for d in diameters]
        )
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
        If it is not there, columns are missing, or a line cannot be read.
    """
    if not path.is_file():
        raise input_error(
            "modes.reference",
            f"there is no file {path}",
            "Check the name; it is relative to the study's folder.",
        )
    return Reference(path, _rows(path, case))


def _rows(path: Path, case: str | None) -> dict[tuple[int, int], float]:
    found: dict[tuple[int, int], float] = {}
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            reader = csv.DictReader(stream)
            needed = COLUMNS if case is None else (*COLUMNS, "case")
            missing = [name for name in needed if name not in (reader.fieldnames or [])]
            if missing:
                raise input_error(
                    str(path),
                    f"has no column {', '.join(missing)}",
                    f"The first line names the columns: {','.join(needed)}.",
                )
            for row in reader:
                if reader.line_num > MOST_ROWS:
                    raise input_error(
                        str(path), f"has more than {MOST_ROWS} lines", "Cut it to what is compared."
                    )
                if case is not None and row["case"] != case:
                    continue
                key = _whole(path, reader.line_num, row, 0), _whole(path, reader.line_num, row, 1)
                if key in found:
                    raise input_error(
                        f"{path}: line {reader.line_num}",
                        f"nodal diameter {key[0]}, mode {key[1]} is there twice",
                        "Choose the rows by a column 'case' and modes.reference_case.",
                    )
                found[key] = _hertz(path, reader.line_num, row)
    except (UnicodeDecodeError, csv.Error) as error:
        raise input_error(
            str(path), f"is not a CSV file in UTF-8 ({error})", "Save it as CSV."
        ) from None
    return found


def _whole(path: Path, line: int, row: dict[str, str], column: int) -> int:
    text = row[COLUMNS[column]]
    if not (text or "").strip().isdigit():
        raise _unreadable(path, line, COLUMNS[column], text, "a whole number")
    return int(text)


def _hertz(path: Path, line: int, row: dict[str, str]) -> float:
    text = row[COLUMNS[2]]
    try:
        value = float(text)
    except (TypeError, ValueError):
        raise _unreadable(path, line, COLUMNS[2], text, "a number in Hz") from None
    if not (math.isfinite(value) and value > 0):
        raise _unreadable(path, line, COLUMNS[2], text, "a frequency above zero")
    return value


def _unreadable(path: Path, line: int, column: str, text: object, wanted: str) -> InputError:
    return input_error(
        f"{path}: line {line}: {column}", f"cannot be read, got {text!r}", f"Give {wanted}."
    )
