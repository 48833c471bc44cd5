"""Calls of pyYeti, which reads Nastran's binary files; the chain of records is checked first, and its errors are converted."""

import importlib
import re
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np

from stickslip.errors import StickslipError, did_you_mean, input_error, missing_package

CUT_SHORT = "Was the file copied whole, in binary mode? Write or copy it again."
FIRST_MARKS = {4, 8, 24, 48}  # length in bytes of the first record: a key in op2, a header in op4


def nastran_library(module: str) -> ModuleType:
    """Return a module of pyYeti, such as ``op4``.

    Raises
    ------
    StickslipError
        If it is not installed.
    """
    try:
        return importlib.import_module(f"pyyeti.nastran.{module}")
    except (ModuleNotFoundError, OSError) as error:
        raise missing_package("pyyeti", error, "readers") from error


def existing_file(path: Path | str) -> Path:
    """Return the path of a file that exists and is not empty; an `InputError` suggests a similar name."""
    path = Path(path)
    if not path.is_file():
        beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
        near = did_you_mean(path.name, beside)
        remedy = near if near.startswith("Did") else "Check the path."
        raise input_error(str(path), "there is no such file", remedy)
    if not path.stat().st_size:
        raise input_error(str(path), "is empty", CUT_SHORT)
    return path


def is_binary(path: Path) -> bool:
    """Whether a file starts with the mark of a binary record instead of text."""
    with path.open("rb") as stream:
        return 0 in stream.read(4)


def check_records(path: Path) -> None:
    """Check the chain of records of a binary file from end to end: each record is enclosed by two equal lengths.

    The library trusts these lengths, so this check comes first.

    Raises
    ------
    InputError
        If the chain is broken: the file was cut short, is damaged, or is of another kind.
    """
    size = path.stat().st_size
    content = np.memmap(path, dtype=np.uint8, mode="r")
    first = bytes(content[:4])
    order = next((o for o in "<>" if len(first) == 4 and _mark(first, o) in FIRST_MARKS), None)
    if order is None:
        raise input_error(
            str(path),
            "does not start like a binary file of Nastran",
            "Give an .op4 or .op2 file that Nastran wrote with FORM=UNFORMATTED, or the text form.",
        )
    at = 0
    while at < size:
        length = _mark(bytes(content[at : at + 4]), order) if at + 8 <= size else -1
        end = at + 4 + length
        if length < 0 or end + 4 > size or _mark(bytes(content[end : end + 4]), order) != length:
            raise input_error(str(path), f"the chain of records breaks at byte {at} of {size}", CUT_SHORT)
        at = end + 4


def check_lines(path: Path) -> None:
    """Check the columns of a text OP4 file from end to end: each has as many lines as its head states.

    With a large damaged count the library would read endlessly, so this check comes first.

    Raises
    ------
    InputError
        If a head is invalid, or the lines end before the columns.
    """
    with path.open(encoding="ascii", errors="replace") as stream:
        number = 0
        try:
            for number, line in enumerate(stream, 1):  # noqa: B007  # named in the message
                if not line.strip():
                    return
                _skip_matrix(stream, line)
        except (ValueError, StopIteration) as error:
            raise input_error(f"{path}: matrix {number}", "breaks off or is garbled", CUT_SHORT) from error


def _skip_matrix(lines: Iterator[str], head: str) -> None:
    """Skip the columns of one text matrix."""
    width = 16 if head.rstrip().endswith("|I16") else 8
    columns, rows, kind = int(head[:width]), int(head[width : 2 * width]), 2 * width + 8
    words = 1 if int(head[kind : kind + 8]) % 2 else 2  # words of a number
    form = re.search(r"([1-9]\d*)[ED]\d+\.\d+", head[kind + 16 :].upper())
    a_line = int(form[1]) if form else 5
    big = rows < 0 or rows >= 65536
    while True:
        line = next(lines)
        column, row, stored = (int(line[i : i + 8]) for i in (0, 8, 16))
        if column > columns:
            next(lines)  # the column past the last one ends a matrix
            return
        if column < 1 or stored < 0:
            raise ValueError(line)
        if row > 0:  # dense column
            _skip(lines, -(-stored // a_line))
            continue
        while stored > 0:
            line = next(lines)
            length = int(line[:8]) - 1 if big else (int(line) >> 16) - 1
            if length < 1:
                raise ValueError(line)
            stored -= length + (2 if big else 1)
            _skip(lines, -(-(length // words) // a_line))


def _skip(lines: Iterator[str], count: int) -> None:
    for _ in range(count):
        next(lines)


def _mark(four: bytes, order: str) -> int:
    return int(struct.unpack(f"{order}i", four)[0])


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Convert exceptions and warnings of the library while it reads `path` into an `InputError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            yield
    except StickslipError:
        raise
    except Exception as error:  # pandas, which the library uses, raises errors of its own
        raise input_error(str(path), f"cannot be read ({type(error).__name__}: {error})", CUT_SHORT) from error
