"""Named arrays, numbers and texts as NumPy archives with a checksum, without pickle."""

import io
import zipfile
from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from functools import cache, lru_cache
from typing import Any, get_type_hints

import numpy as np

from stickslip.model.checksum import checked, with_checksum

# bytes before the description of an array: what NumPy marks its files with, then the length of the description
HEADER = np.lib.format.MAGIC_LEN + 2
LAST_NAME = ".npy"  # of an array in the archive

FORMAT = 7  # of all that is kept: raised whenever tables, records or archives change, once an issue at most


def encode(values: Mapping[str, Any]) -> bytes:
    """Return named arrays, numbers and texts as a NumPy archive and its checksum; entries that are None are left out."""
    stream = io.BytesIO()
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
    np.savez(stream, allow_pickle=False, **arrays)
    return with_checksum(stream.getvalue())


def decode(payload: bytes) -> dict[str, Any]:
    """Return what `encode` wrote; zero-dimensional arrays come back as Python scalars.

    Raises
    ------
    ValueError
        If it differs by a single bit from what was written.
    """
    archive = checked(payload)
    try:
        with zipfile.ZipFile(io.BytesIO(archive)) as opened:
            found = {n.removesuffix(LAST_NAME): _array(opened.read(n)) for n in opened.namelist()}
    except MemoryError:
        raise
    # of another program that knows the checksum: zipfile, zlib and NumPy say it of wrong bytes in a dozen ways
    except Exception as error:
        raise ValueError(f"damaged archive: {error}") from error
    return {k: v.item() if v.ndim == 0 else v for k, v in found.items()}


def _array(content: bytes) -> Any:
    """Return an array as `numpy.savez` wrote it; `numpy.load` parses the description of each anew, which takes two thirds of its time."""
    end = HEADER + int.from_bytes(content[HEADER - 2 : HEADER], "little")
    shape, by_columns, dtype = _described(content[:end])
    if dtype.hasobject:
        raise ValueError("an array of objects")
    flat = np.frombuffer(content, dtype, offset=end)
    return flat.reshape(shape, order="F" if by_columns else "C").copy(order="K")


@lru_cache(maxsize=512)
def _described(header: bytes) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, whether columns stay together, and type of an array from what stands before it."""
    stream = io.BytesIO(header)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an array with a description of more than 64 kB")
    found: tuple[tuple[int, ...], bool, np.dtype[Any]] = np.lib.format.read_array_header_1_0(stream)
    return found


_hints = cache(get_type_hints)


def encode_record(record: Any) -> bytes:
    """Return a dataclass of arrays, numbers, texts, enumerations and None as a NumPy archive."""
    found = {f.name: getattr(record, f.name) for f in fields(record) if f.init}
    return encode({k: v.name if isinstance(v, Enum) else v for k, v in found.items()})


def decode_record(payload: bytes, kind: type[Any]) -> Any:
    """Return the dataclass of type `kind` that `encode_record` wrote."""
    values, hints = decode(payload), _hints(kind)  # type: ignore[arg-type]  # a class has a hash
    for name, value in values.items():
        if name not in hints:
            raise ValueError(f"a record has no {name!r}")
        hint = hints[name]
        if isinstance(hint, type) and issubclass(hint, Enum):
            values[name] = hint[value]
    missing = {f.name: None for f in fields(kind) if f.init and f.name not in values}
    return kind(**values, **missing)
