"""Arrays of an ``.npz`` file, checked before anything is allocated; nothing in the file is executed."""

import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from stickslip.errors import InputError, input_error
from stickslip.model.checksum import add_checksum, check_file

Arrays = dict[str, npt.NDArray[Any]]

DEFLATE_RATIO = 1032  # no deflated stream is longer than this many times its compressed length
READABLE_KINDS = "biufcSU"
_GARBLED = (
    OSError,
    ValueError,
    EOFError,
    RuntimeError,
    SyntaxError,
    OverflowError,
    struct.error,
    tokenize.TokenError,
    zlib.error,
)
BROKEN = "The file is damaged or was cut short: write or copy it again."


def require_no_pipe(path: Path) -> None:
    """Refuse named pipes, sockets and devices, from which reading would never end.

    Raises
    ------
    InputError
        If the path is neither a file nor a folder.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise input_error(
            str(path),
            "is no file, but a named pipe, a socket or a device",
            "Write what comes out of it into a file, and give that.",
        )


def read_npz(path: Path) -> Arrays:
    """Return the arrays of an ``.npz`` file by name.

    Parameters
    ----------
    path
        A file of `numpy.savez` or `numpy.savez_compressed`.

    Returns
    -------
    dict
        Name -> array of numbers or texts.

    Raises
    ------
    InputError
        If the file is missing, is no ``.npz``, is damaged, contains Python objects (which could run code), or claims
        more data than its size allows.
    """
    require_no_pipe(path)
    try:
        check_file(path)
        with zipfile.ZipFile(path) as archive:
            return {_array_name(entry, path): _read_array(archive, entry, path) for entry in archive.infolist()}
    except FileNotFoundError as error:
        raise input_error(str(path), "there is no such file", "Check the path.") from error
    except (IsADirectoryError, PermissionError) as error:
        raise input_error(str(path), f"cannot be read ({error.strerror})", "Check the path.") from error
    except zipfile.BadZipFile as error:
        raise input_error(str(path), f"is no .npz file ({error})", BROKEN) from error
    except InputError:
        raise
    # exceptions of zipfile, zlib and numpy on garbled bytes
    except _GARBLED as error:
        raise input_error(str(path), f"cannot be read ({error})", BROKEN) from error


def write_npz(path: Path, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write arrays and their checksum under a temporary name and rename the file, so that `path` is always complete.

    Raises
    ------
    InputError
        If the path does not end in ``.npz`` or cannot be written.
    """
    if path.suffix != ".npz":
        raise input_error(str(path), f"unknown file format {path.suffix!r}", "Name it .npz.")
    temporary = path.with_name(path.name + ".part")
    try:
        with zipfile.ZipFile(temporary, "w") as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as stream:
                    np.lib.format.write_array(stream, np.asarray(array), allow_pickle=False)
        add_checksum(temporary)
        temporary.replace(path)
    except OSError as error:
        raise input_error(
            str(path), f"cannot be written ({error.strerror})", "Check the folder and its room."
        ) from error


def _array_name(entry: zipfile.ZipInfo, path: Path) -> str:
    if not entry.filename.endswith(".npy"):
        raise input_error(f"{path}: {entry.filename}", "is no array", "Give a file of numpy.savez.")
    return entry.filename.removesuffix(".npy")


def _read_array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path) -> npt.NDArray[Any]:
    """Read one member, after checking that its header agrees with its size."""
    place = f"{path}: array {entry.filename.removesuffix('.npy')!r}"
    if entry.file_size > DEFLATE_RATIO * max(entry.compress_size, 1):
        raise input_error(place, f"claims {entry.file_size} bytes, more than it can hold", BROKEN)
    if entry.header_offset + entry.compress_size > path.stat().st_size:
        raise input_error(place, f"claims {entry.compress_size} bytes beyond the file's end", BROKEN)
    with archive.open(entry) as stream:
        shape, dtype = _read_header(stream)
        if dtype.kind not in READABLE_KINDS or not dtype.itemsize:
            raise input_error(
                place,
                f"has the type {dtype}, only numbers and texts are read",
                "Python objects are never loaded: save plain arrays.",
            )
        count = 1
        for length in shape:
            count *= length  # Python integers do not overflow
        if stream.tell() + count * dtype.itemsize != entry.file_size:
            raise input_error(
                place, f"its header asks for {count * dtype.itemsize} bytes of a member of {entry.file_size}", BROKEN
            )
    with archive.open(entry) as stream:
        array: npt.NDArray[Any] = np.lib.format.read_array(stream, allow_pickle=False)
    return array


def _read_header(stream: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    version = np.lib.format.read_magic(stream)
    read = np.lib.format.read_array_header_1_0
    if version == (2, 0):
        read = np.lib.format.read_array_header_2_0
    elif version != (1, 0):
        raise ValueError(f"array format {version}")
    shape, _, dtype = read(stream)
    return shape, dtype
