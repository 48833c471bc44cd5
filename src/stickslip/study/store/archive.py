"""Named arrays, numbers and texts as NumPy archives with a checksum and without pickle, and a cache of such archives on disk."""

import io
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from functools import cache, lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np

from stickslip.model.checksum import checked, with_checksum
from stickslip.study.store.atomic_write import write_whole
from stickslip.study.store.progress import LOG

# bytes before the description of an array: NumPy's magic string, then the length of the description
HEADER = np.lib.format.MAGIC_LEN + 2
LAST_NAME = ".npy"  # suffix of an array in the archive

FORMAT = 8  # version of all stored files, raised when tables, records or archives change, at most once for each release


def encode(values: Mapping[str, Any]) -> bytes:
    """Return named arrays, numbers and texts as a NumPy archive with checksum; None entries are left out."""
    stream = io.BytesIO()
    arrays: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
    np.savez(stream, allow_pickle=False, **arrays)
    return with_checksum(stream.getvalue())


def decode(payload: bytes) -> dict[str, Any]:
    """Return the content written by `encode`; zero-dimensional arrays become Python scalars.

    Raises
    ------
    ValueError
        If the content does not agree with its checksum.
    """
    archive = checked(payload)
    try:
        with zipfile.ZipFile(io.BytesIO(archive)) as opened:
            found = {n.removesuffix(LAST_NAME): _array(opened.read(n)) for n in opened.namelist()}
    except MemoryError:
        raise
    # an archive with a valid checksum from another program: zipfile, zlib and NumPy raise many different errors
    except Exception as error:
        raise ValueError(f"damaged archive: {error}") from error
    return {k: v.item() if v.ndim == 0 else v for k, v in found.items()}


def _array(content: bytes) -> Any:
    """Return an array written by `numpy.savez`. `numpy.load` parses each header anew, in two thirds of its time."""
    end = HEADER + int.from_bytes(content[HEADER - 2 : HEADER], "little")
    shape, by_columns, dtype = _described(content[:end])
    if dtype.hasobject:
        raise ValueError("an array of objects")
    values = np.frombuffer(content, dtype, offset=end)
    return values.reshape(shape, order="F" if by_columns else "C").copy(order="K")


@lru_cache(maxsize=512)
def _described(header: bytes) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, memory order and type of an array from its header."""
    stream = io.BytesIO(header)
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an array with a description of more than 64 kB")
    found: tuple[tuple[int, ...], bool, np.dtype[Any]] = np.lib.format.read_array_header_1_0(stream)
    return found


_hints = cache(get_type_hints)


def encode_record(record: Any) -> bytes:
    """Return a dataclass of arrays, numbers, texts, enumerations, None, and tuples of such dataclasses as a NumPy archive."""
    return encode(flat(record))


def flat(record: Any) -> dict[str, Any]:
    """Return the fields of a record by name; fields of nested records as ``field/index/name``, with the number of records."""
    found: dict[str, Any] = {}
    for own in (f for f in fields(record) if f.init):
        value = getattr(record, own.name)
        if _row_type(type(record), own.name) is None:
            found[own.name] = value.name if isinstance(value, Enum) else value
            continue
        found[own.name] = len(value)
        for i, row in enumerate(value):
            found |= {f"{own.name}/{i}/{name}": entry for name, entry in flat(row).items()}
    return found


def _row_type(kind: type[Any], name: str) -> type[Any] | None:
    """Return the record class of a field ``tuple[Class, ...]``; None for another field."""
    hint = _hints(kind)[name]  # type: ignore[arg-type]  # a class has a hash
    inner = get_args(hint)[0] if get_origin(hint) is tuple else None
    return inner if is_dataclass(inner) and isinstance(inner, type) else None


def decode_record(payload: bytes, kind: type[Any]) -> Any:
    """Return a record of class `kind` written by `encode_record`."""
    return from_flat(decode(payload), kind)


def from_flat(values: Mapping[str, Any], kind: type[Any]) -> Any:
    """Return a record of class `kind` from the result of `flat`, as stored in a note."""
    hints = _hints(kind)  # type: ignore[arg-type]  # a class has a hash
    own: dict[str, Any] = {}
    inner: dict[str, dict[int, dict[str, Any]]] = {}
    for name, value in values.items():
        field, _, rest = name.partition("/")
        if field not in hints:
            raise ValueError(f"a record has no {field!r}")
        if rest:
            index, _, entry = rest.partition("/")
            inner.setdefault(field, {}).setdefault(int(index), {})[entry] = value
            continue
        hint = hints[field]
        own[field] = hint[value] if isinstance(hint, type) and issubclass(hint, Enum) else value
    for field, count in own.items():
        row = _row_type(kind, field)
        if row is not None:
            own[field] = tuple(from_flat(inner[field][i], row) for i in range(count))
    missing = {f.name: None for f in fields(kind) if f.init and f.name not in own}
    return kind(**own, **missing)


@dataclass(frozen=True, eq=False)
class PartStore:
    """Cache of named arrays, numbers and texts under the hash of their inputs.

    Parameters
    ----------
    folder
        Folder of the files; None: nothing is stored.
    fresh
        Whether files of earlier runs are ignored.
    written
        Files written by this run.
    """

    folder: Path | None = None
    fresh: bool = False
    written: set[Path] = field(default_factory=set)

    def kept(self, content: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        """Return the stored result of `make`, or make and store it; `content` is everything that it depends on."""
        if self.folder is None:
            return make()
        named = sha256(f"{FORMAT} {content}".encode()).hexdigest()
        path = self.folder / f"{named}.npz"
        if path.is_file() and (path in self.written or not self.fresh):
            try:
                return decode(path.read_bytes())
            except (ValueError, OSError) as error:
                LOG.info(f"{path} is damaged and made anew ({error})")
        # encode and decode new results, too: computed and read values then have equal bits and types
        payload = encode(make())
        write_whole(path, payload)
        self.written.add(path)
        return decode(payload)
