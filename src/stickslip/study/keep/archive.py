"""Named arrays, numbers and texts as NumPy archives with a checksum, without pickle."""

import io
from collections.abc import Mapping
from dataclasses import fields
from enum import Enum
from typing import Any, get_type_hints

import numpy as np

from stickslip.model.checksum import checked, with_checksum

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
        with np.load(io.BytesIO(archive), allow_pickle=False) as opened:
            found = {name: opened[name] for name in opened.files}
    except MemoryError:
        raise
    # of another program that knows the checksum: zipfile, zlib and NumPy say it of wrong bytes in a dozen ways
    except Exception as error:
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
        if name not in hints:
            raise ValueError(f"a record has no {name!r}")
        hint = hints[name]
        if isinstance(hint, type) and issubclass(hint, Enum):
            values[name] = hint[value]
    missing = {f.name: None for f in fields(kind) if f.init and f.name not in values}
    return kind(**values, **missing)
