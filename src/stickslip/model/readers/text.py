"""Text files, plain or gzipped, and tables of numbers in them; errors name file, line and value."""

import gzip
import io
import zlib
from pathlib import Path

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import did_you_mean, input_error
from stickslip.model.npz import require_no_pipe

TEXT_RATIO = 200  # largest ratio of unpacked to packed size; numbers as text reach about 5
PIECE = 2**24  # characters parsed at a time
SHOWN = 60  # largest number of characters of a line in a message
CUT_SHORT = "The file was cut short: write or copy it again."


def read_text(path: Path) -> str:
    """Return the text of a file; a ``.gz`` file is unpacked, up to a plausible size.

    Raises
    ------
    InputError
        If the file is missing, cannot be read, is a damaged gzip file or unpacks to an implausible size.
    """
    require_no_pipe(path)
    try:
        if path.suffix != ".gz":
            return _decoded(path, path.read_bytes())
        limit = TEXT_RATIO * path.stat().st_size + 10_000
        with gzip.open(path) as stream:
            content = stream.read(limit + 1)
    except FileNotFoundError as error:
        raise input_error(str(path), "there is no such file", _neighbours(path)) from error
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise input_error(str(path), f"is no whole gzip file ({error})", CUT_SHORT) from error
    except OSError as error:
        raise input_error(str(path), f"cannot be read ({error.strerror})", "Check the path.") from error
    if len(content) > limit:
        raise input_error(
            str(path),
            f"unpacks to more than {TEXT_RATIO} times its size, which no table of numbers does",
            "If the file is right, unpack it and give the plain one.",
        )
    return _decoded(path, content)


def _decoded(path: Path, content: bytes) -> str:
    zero = content.find(b"\0")
    if zero >= 0:
        raise input_error(
            str(path),
            f"is no text: byte {zero + 1} is zero, as in pictures, archives and binary results",
            "Give the file that the program wrote as text (ASCII or UTF-8).",
        )
    return content.decode("utf-8-sig", errors="replace")  # some editors write a byte-order mark


def _neighbours(path: Path) -> str:
    """Return a hint for messages: the file beside `path` that was probably meant."""
    try:
        names = [p.name for p in path.parent.iterdir()]
    except OSError:
        return "Check the path."
    hint = did_you_mean(path.name, names)
    return hint if hint.startswith("Did") else "Check the path."


def number_table(
    path: Path, text: str, columns: int, *, separator: str | None = None, first_line: int = 1
) -> FloatArray:
    """Parse lines of numbers, all with the same count.

    Parameters
    ----------
    path
        File of the text, for messages.
    text
        Lines of `columns` numbers; empty lines are skipped.
    columns
        Count of numbers in a line.
    separator
        Separator of numbers; None: blanks.
    first_line
        Line number of the text's first line, for messages.

    Returns
    -------
    ndarray
        (rows, columns), all finite.

    Raises
    ------
    InputError
        If a line contains anything but numbers; the message quotes it.
    """
    tables = [np.empty((0, columns))]
    start = 0
    while start < len(text):  # in pieces, because a text stream needs four times the memory
        end = text.find("\n", start + PIECE) + 1 or len(text)
        piece, start = text[start:end], end
        if not piece.strip():
            continue
        try:
            table = np.loadtxt(io.StringIO(piece), delimiter=separator, comments=None, ndmin=2)
        except (ValueError, OverflowError):
            table = np.empty((0, 0))
        if table.shape[1] != columns or not np.isfinite(table).all():
            raise _blame(path, text, columns, separator, first_line)
        tables.append(table)
    return np.vstack(tables)


def _blame(path: Path, text: str, columns: int, separator: str | None, first_line: int) -> Exception:
    """Return the error that names the first bad line."""
    for number, line in enumerate(text.splitlines(), first_line):
        fields = line.split(separator)
        if not line.strip():
            continue
        if len(fields) != columns:
            return input_error(
                f"{path}: line {number}",
                f"needs {columns} numbers, got {len(fields)}: {line[:SHOWN]!r}",
                "Check that the file is of the expected kind and whole.",
            )
        for field in fields:
            if not _is_finite(field):
                return input_error(
                    f"{path}: line {number}",
                    f"{field.strip()[:SHOWN]!r} is no finite number",
                    "Check that the file is of the expected kind; NaN and Inf come from a failed run.",
                )
    return input_error(str(path), "is no table of numbers", "Check that the file is whole.")


def _is_finite(field: str) -> bool:
    try:
        return bool(np.isfinite(float(field)))
    except ValueError:
        return False


def whole_numbers(path: Path, table: FloatArray, names: tuple[str, ...]) -> IntArray:
    """Return the first columns as integers (rows, len(names)); refuse fractions and numbers beyond the range of integers."""
    columns = table[:, : len(names)]
    wrong = (columns != np.rint(columns)) | (np.abs(columns) > 2**53)
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise input_error(
            f"{path}: entry {row + 1}",
            f"the {names[column]} {columns[row, column]:g} is no whole number",
            "Check that the columns stand in the expected order.",
        )
    return np.asarray(columns, dtype=np.int64)
