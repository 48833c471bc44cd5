"""Named arrays, numbers and texts as NumPy archives, without pickle."""

import io
import zlib
from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from typing import Any, get_type_hints
from zipfile import BadZipFile

import numpy as np

# what zipfile, zlib and NumPy say of a few wrong bytes: bad directories, compressions and encryptions that are none
DAMAGED = (
    BadZipFile,
    zlib.error,
    EOFError,
    KeyError,
    NotImplementedError,
    OSError,
    RuntimeError,
    TypeError,
)


def encode(values: Mapping[str, Any]) -> bytes:
    """Return named arrays, numbers and texts as a NumPy archive; entries that are None are left out."""
    stream = io.BytesIO()
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
    np.savez(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def decode(payload: bytes) -> dict[str, Any]:
    """Return what `encode` wrote; zero-dimensional arrays come back as Python scalars.

    Raises
    ------
    ValueError
        If it is damaged.
    """
    try:
        with np.load(io.BytesIO(payload), allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
    except DAMAGED as error:
        raise ValueError(f"damaged archive: {error}") from error
    return {k: v.item() if v.ndim == 0 else v for k, v in found.items()}


def encode_record(record: Any) -> bytes:
    """Return a dataclass of arrays, numbers, texts, enumerations and None as a NumPy archive."""
    found = {f.name: getattr(record, f.name) for f in fields(record) if f.init}
    return encode({k: v.name if isinstance(v, Enum) else v for k, v in found.items()})


def decode_record(payload: bytes, kind: type[Any]) -> Any:
    """Return the dataclass of type `kind` that `encode_record` wrote."""
    values, hints = decode(payload), get_type_hints(kind)
    for name, value in values.items():
        hint = hints[name]
        if isinstance(hint, type) and issubclass(hint, Enum):
            values[name] = hint[value]
    missing = {f.name: None for f in fields(kind) if f.init and f.name not in values}
    return kind(**values, **missing)
