"""pyYeti, which knows Nastran's binary files: called only after the chain of records has been checked, and never blindly."""

import importlib
import struct
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np

from stickslip.errors import StickslipError, did_you_mean, input_error, missing_package

CUT_SHORT = "Was the file copied whole, in binary mode? Write or copy it again."
FIRST_MARKS = {4, 8, 24, 48}  # bytes of the first record: of a key in op2, of a header in op4


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
    """Return the path of a file that is there and not empty; an `InputError` names a near one."""
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
    """Return whether a file starts with the mark of a binary record instead of text."""
    with path.open("rb") as stream:
        return 0 in stream.read(4)


def check_records(path: Path) -> None:
    """Follow the chain of records of a binary file from end to end: each stands between two equal lengths.

    Only then may a library follow it, which trusts these lengths.

    Raises
    ------
    InputError
        If the chain breaks: the file was cut, damaged, or is of another kind.
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
            raise input_error(
                str(path), f"the chain of records breaks at byte {at} of {size}", CUT_SHORT
            )
        at = end + 4


def _mark(four: bytes, order: str) -> int:
    return int(struct.unpack(f"{order}i", four)[0])


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn what the library raises or warns of while it reads `path` into an `InputError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            yield
    except StickslipError:
        raise
    except (
        ArithmeticError,
        AttributeError,
        EOFError,
        LookupError,
        MemoryError,
        OSError,
        RuntimeError,
        RuntimeWarning,
        TypeError,
        ValueError,
        struct.error,
    ) as error:
        raise input_error(
            str(path), f"cannot be read ({type(error).__name__}: {error})", CUT_SHORT
        ) from error
